/*
 * shoot.c - shooting from a surface with a given velocity of SRNFs (the paper, section 4.2).
 *
 * The geodesic is the line q_t = Q(f) + t v. It is walked outwards from t = 0, first to the
 * positive times, then to the negative ones, in steps of at most STEP ||Q(f)||, so that each
 * surface is a good start for the next:
 *   first step   f + t w, w the vector whose Q_*f is nearest to v (transport.c)
 *   then         the last two surfaces, extrapolated linearly
 * or the surface before, where that has the lower energy, or a surface that the caller has for the
 * end.
 * Surfaces that were asked for are inverted to the end, those between only so far as to be good
 * starts.
 *
 * Costs 200 to 400 transforms a surface, and some 100 to 200 for the first step.
 */
#include "geodesic.h"

#include <math.h>

#define STEP 0.1          /* of ||Q(f)||, between surfaces inverted one after the other */
#define STEPS_MAX 64      /* between two times */
#define DECREASE 1e-4     /* of E, for surfaces asked for */
#define DECREASE_WAY 1e-1 /* for those on the way */
#define TOLERANCE 1e-20   /* relative E, where the line stays in the image of Q */
#define TOLERANCE_WAY 1e-8
#define TOLERANCE_FIRST 1e-2 /* of the vector that the first step goes along */
#define VANISHED 1e-12       /* ||q_t||^2 / ||Q(f)||^2 from which on the surface is a point */

/* A walk along the line. here and before are the last two surfaces, at the times of the same
   names. */
struct walk {
    const struct srnf_context *context;
    struct gauss_newton *system;
    size_t count, values;
    double *memory;
    double *q0, *q, *velocity;     /* fields; q belongs to the system */
    double *here, *before, *trial; /* surfaces */
    double here_time, before_time;
    bool first; /* before is not a surface but here + w */
    double speed, norm0;
    double *direction;  /* w */
    const double *hint; /* a start for the last surface, or NULL */
};

static int open_walk(struct walk *walk, const struct srnf_sht *sht, const double *surface,
                     const double *velocity, const struct srnf_context *context)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct srnf_tangent tangent = {0};
    int status;

    walk->context = context;
    walk->count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    walk->values = 3 * grid->n_theta * grid->n_phi;
    walk->memory = srnf_alloc(3 * walk->values + 3 * walk->count, sizeof(double));
    if (!walk->memory) {
        return SRNF_ENOMEM;
    }
    walk->q0 = walk->memory;
    walk->q = walk->memory + walk->values;
    walk->velocity = walk->memory + 2 * walk->values;
    walk->here = walk->memory + 3 * walk->values;
    walk->before = walk->here + walk->count;
    walk->trial = walk->here + 2 * walk->count;
    status = gauss_newton_create(&walk->system, sht, walk->q);
    if (status) {
        return status;
    }
    /* With a target of 0 the residual of the surface is its own SRNF. */
    walk->norm0 = sqrt(gauss_newton_try(walk->system, surface));
    gauss_newton_accept(walk->system);
    linear_copy(walk->values, walk->system->state.residual, walk->q0);
    linear_copy(walk->values, velocity, walk->velocity);
    walk->speed = sqrt(pointwise_norm2(walk->system->points, walk->system->weight, velocity));
    if (!(walk->norm0 > 0.0) || !isfinite(walk->norm0) || !isfinite(walk->speed)) {
        return SRNF_EINVAL;
    }
    status = transport_pull_velocity(walk->system, velocity, TOLERANCE_FIRST, context, &tangent);
    walk->direction = tangent.coefficients;
    return status;
}

static void close_walk(struct walk *walk)
{
    gauss_newton_destroy(walk->system);
    srnf_free(walk->direction);
    srnf_free(walk->memory);
}

static void keep_better(struct walk *walk, const double *candidate, double *f, double *energy)
{
    double own = gauss_newton_try(walk->system, candidate);

    if (own < *energy) {
        *energy = own;
        linear_copy(walk->count, candidate, f);
    }
}

/* Inverts q_t into f, from the best start; then f is where the walk is. */
static int step_to(struct walk *walk, double t, bool asked, const double *hint, double *f,
                   double *energy)
{
    const struct continuation options = {.tolerance = asked ? TOLERANCE : TOLERANCE_WAY,
                                         .decrease = asked ? DECREASE : DECREASE_WAY,
                                         .refine = asked};
    double ratio = walk->first ? t : (t - walk->here_time) / (walk->here_time - walk->before_time);
    int status;

    linear_copy(walk->values, walk->q0, walk->q);
    linear_axpy(walk->values, t, walk->velocity, walk->q);
    walk->system->q_norm2 = pointwise_norm2(walk->system->points, walk->system->weight, walk->q);
    if (!(walk->system->q_norm2 > VANISHED * walk->norm0 * walk->norm0)) {
        return SRNF_ENUMERIC;
    }
    for (size_t i = 0; i < walk->count; i++) {
        double change = walk->first ? walk->direction[i] : walk->here[i] - walk->before[i];

        walk->trial[i] = walk->here[i] + ratio * change;
    }
    linear_copy(walk->count, walk->here, f);
    *energy = gauss_newton_try(walk->system, f);
    keep_better(walk, walk->trial, f, energy);
    if (hint) {
        keep_better(walk, hint, f, energy);
    }
    status = inversion_continue(walk->system, &options, walk->context, f, energy);
    for (size_t k = 0; k < 3; k++) { /* a start from outside has a translation of its own */
        f[k * walk->count / 3] = walk->here[k * walk->count / 3];
    }
    linear_copy(walk->count, walk->here, walk->before);
    linear_copy(walk->count, f, walk->here);
    walk->before_time = walk->here_time;
    walk->here_time = t;
    walk->first = false;
    return status;
}

/* From where the walk is to t, on the same side of 0; the surface there into f. */
static int walk_to(struct walk *walk, double t, double *f, double *energy)
{
    double from = walk->here_time;
    double steps = ceil(fabs(t - from) * walk->speed / (STEP * walk->norm0));
    size_t n = steps < STEPS_MAX ? (size_t)fmax(1.0, steps) : STEPS_MAX;

    for (size_t k = 1; k <= n; k++) {
        bool last = k == n;
        double at = last ? t : from + (t - from) * (double)k / (double)n;
        int status;

        if (srnf_is_canceled(walk->context)) {
            return SRNF_ECANCELED;
        }
        status = step_to(walk, at, last, last ? walk->hint : NULL, f, energy);
        if (status) {
            return status;
        }
    }
    return SRNF_OK;
}

/* The next time on a side (+1 or -1) beyond `reached`; n when there is none. Equal times come in
   their order. */
static size_t next_time(size_t n, const double *times, double side, const bool *done)
{
    size_t next = n;

    for (size_t i = 0; i < n; i++) {
        bool here = side > 0.0 ? times[i] >= 0.0 : times[i] < 0.0;

        if (here && !done[i] && (next == n || side * times[i] < side * times[next])) {
            next = i;
        }
    }
    return next;
}

static int shoot(struct walk *walk, const double *surface, const double *times,
                 struct srnf_shot *shot)
{
    bool done[SRNF_SHOOT_TIMES_MAX] = {false};
    size_t count = 0;

    for (double side = 1.0; side >= -1.0; side -= 2.0) {
        size_t i;

        linear_copy(walk->count, surface, walk->here);
        walk->here_time = 0.0;
        walk->first = true;
        while ((i = next_time(shot->n, times, side, done)) < shot->n) {
            double *f = shot->coefficients + i * walk->count;
            int status = SRNF_OK;

            done[i] = true;
            if (times[i] == walk->here_time) { /* at 0, or the same time again */
                linear_copy(walk->count, walk->here, f);
                linear_copy(walk->values, walk->q0, walk->q);
                linear_axpy(walk->values, times[i], walk->velocity, walk->q);
                walk->system->q_norm2 =
                    pointwise_norm2(walk->system->points, walk->system->weight, walk->q);
                shot->energy[i] = gauss_newton_try(walk->system, f);
            } else {
                status = walk_to(walk, times[i], f, &shot->energy[i]);
            }
            if (status) {
                return status;
            }
            shot->relative_energy[i] = shot->energy[i] / walk->system->q_norm2;
            srnf_report_progress(walk->context, (double)++count / (double)shot->n, "shooting");
        }
    }
    return SRNF_OK;
}

int geodesic_check_times(size_t n, const double *times, struct srnf_error *error)
{
    if (n < 1 || n > SRNF_SHOOT_TIMES_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the number of times is %zu, not 1 to %zu", n,
                         SRNF_SHOOT_TIMES_MAX);
    }
    for (size_t i = 0; i < n; i++) {
        if (!(fabs(times[i]) <= SRNF_SHOOT_TIME_MAX)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i, "time %zu is %g, not from -%g to %g",
                             i, times[i], SRNF_SHOOT_TIME_MAX, SRNF_SHOOT_TIME_MAX);
        }
    }
    return SRNF_OK;
}

static int check(const struct srnf_sht *sht, const double *surface, const double *velocity,
                 size_t n, const double *times, struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    int status = geodesic_check_times(n, times, error);

    if (status) {
        return status;
    }
    return srnf_check_finite(3 * srnf_coefficient_count(srnf_sht_degree(sht)), surface,
                             "coefficient of the surface", error) &&
                   srnf_check_finite(3 * grid->n_theta * grid->n_phi, velocity,
                                     "value of the velocity", error)
               ? SRNF_OK
               : SRNF_EINVAL;
}

int geodesic_shoot(const struct srnf_sht *sht, const double *surface, const double *velocity,
                   size_t n, const double *times, const double *hint,
                   const struct srnf_context *context, struct srnf_shot *shot,
                   struct srnf_error *error)
{
    struct walk walk = {.hint = hint};
    int status;

    *shot = (struct srnf_shot){0};
    status = check(sht, surface, velocity, n, times, error);
    if (status) {
        return status;
    }
    status = open_walk(&walk, sht, surface, velocity, context);
    if (status) {
        goto out;
    }
    shot->degree = srnf_sht_degree(sht);
    shot->n = n;
    shot->coefficients = srnf_alloc(n, walk.count * sizeof(double));
    shot->energy = srnf_alloc(2 * n, sizeof(double));
    status = SRNF_ENOMEM;
    if (shot->coefficients && shot->energy) {
        shot->relative_energy = shot->energy + n;
        status = shoot(&walk, surface, times, shot);
        shot->transforms = walk.system->transforms;
    }
out:
    if (status) {
        (void)srnf_fail(error, status, -1, "%s",
                        status == SRNF_EINVAL ? "an SRNF is zero or too large"
                        : status == SRNF_ENUMERIC
                            ? "the line passes through 0: the surface shrinks to a point"
                            : srnf_strerror(status));
        srnf_shot_clear(shot);
    }
    close_walk(&walk);
    return status;
}

int srnf_shoot(const struct srnf_sht *sht, const double *surface, const double *velocity, size_t n,
               const double *times, const struct srnf_context *context, struct srnf_shot *shot,
               struct srnf_error *error)
{
    return geodesic_shoot(sht, surface, velocity, n, times, NULL, context, shot, error);
}

void srnf_shot_clear(struct srnf_shot *shot)
{
    srnf_free(shot->coefficients);
    srnf_free(shot->energy);
    *shot = (struct srnf_shot){0};
}
