/*
 * exp.c - the exponential map of the pulled-back metric (the paper, Algorithm 3), as the
 * discrete geodesic that starts with f_1 = f_0 + v / m.
 *
 * A path of least energy satisfies J_k' W (Q_k+1 - 2 Q_k + Q_k-1) = 0 at every interior surface.
 * Read forwards, each of these equations gives the next surface from the last two. It is solved by
 * Newton's method: the matrix is J_k' W J_k+1, which has no symmetry, scaled on both sides by
 * D^(-1/2), D = diag(1 + l (l + 1) / 4), for GMRES. (Replacing J_k+1 by J_k would make it symmetric
 * and not converge.) The start is the path extrapolated by a parabola.
 *
 * So exp(log(f)) is f to the accuracy to which the path of the logarithm is straight: 1e-9 when its
 * gradient is 1e-9 (same m). The error against the continuous geodesic is O(1 / m).
 *
 * Cost: 4 to 7 Newton steps a surface, 200 to 500 products of two transforms. Memory: 81 vectors of
 * coefficients.
 */
#include "pullback.h"

#include <math.h>

#define NEWTON_STEPS ((size_t)20)
#define NEWTON_TOLERANCE 1e-12 /* of the residual, relative to the momentum */
#define NEWTON_ACCEPTED 1e-8   /* what is still called converged */
#define SMALL 1e-4             /* part of ||q|| below which momentum is not what counts */
#define SHORTENED ((size_t)8)
#define INNER_TOLERANCE_MAX 0.1
#define INNER_TOLERANCE_MIN 1e-6
#define INNER_CAP ((size_t)80)

struct shooter {
    const struct srnf_context *context;
    struct gauss_newton *system; /* state: f_k; trial: the candidate for f_k+1; q: 2 q_k - q_k-1 */
    size_t count, field;
    double *memory;
    double *before, *here, *target; /* fields q_k-1, q_k, and 2 q_k - q_k-1 */
    double *scale;                  /* D^(-1/2) */
    double *candidate, *step, *residual, *scaled, *inner;
    double reference; /* what residuals are relative to */
    double worst;
    size_t iterations;
};

static int create(struct shooter *s, const struct srnf_sht *sht)
{
    size_t fields = 3 * srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    size_t n = 3 * srnf_coefficient_count(srnf_sht_degree(sht));

    s->count = n;
    s->field = fields;
    s->memory = srnf_alloc(3 * fields + 5 * n + linear_gmres_doubles(n, INNER_CAP), sizeof(double));
    if (!s->memory) {
        return SRNF_ENOMEM;
    }
    s->before = s->memory;
    s->here = s->memory + fields;
    s->target = s->memory + 2 * fields;
    s->scale = s->memory + 3 * fields;
    s->candidate = s->scale + n;
    s->step = s->scale + 2 * n;
    s->residual = s->scale + 3 * n;
    s->scaled = s->scale + 4 * n;
    s->inner = s->scale + 5 * n;
    linear_diagonal(srnf_sht_degree(sht), 1.0, 0.25, s->scale);
    for (size_t i = 0; i < n; i++) {
        s->scale[i] = s->scale[i] > 0.0 ? 1.0 / sqrt(s->scale[i]) : 0.0;
    }
    return gauss_newton_create(&s->system, sht, s->target);
}

static void destroy(struct shooter *s)
{
    gauss_newton_destroy(s->system);
    srnf_free(s->memory);
}

static void scale(const struct shooter *s, const double *x, double *out)
{
    for (size_t i = 0; i < s->count; i++) {
        out[i] = s->scale[i] * x[i];
    }
}

/* Norm of D^(-1/2) J_k' W field; the vector itself to out. */
static double tangential(struct shooter *s, const double *field, double *out)
{
    gauss_newton_pull_back(s->system, field, s->scaled);
    scale(s, s->scaled, out);
    return sqrt(linear_dot(s->count, out, out));
}

/* Residual of the equation at a candidate for f_k+1. */
static double residual_at(struct shooter *s, const double *f)
{
    (void)gauss_newton_try(s->system, f);
    return tangential(s, s->system->trial.residual, s->residual);
}

/* D^(-1/2) J_k' W J_k+1 D^(-1/2) x */
static void product(void *argument, const double *x, double *out)
{
    struct shooter *s = argument;

    scale(s, x, s->scaled);
    gauss_newton_differential(s->system, &s->system->trial, s->scaled, s->system->field);
    gauss_newton_pull_back(s->system, s->system->field, s->scaled);
    scale(s, s->scaled, out);
}

/* One Newton step from f, in place; the new norm of the residual, which lies in s->residual, or the
   old one when no length of the step lowers it. */
static double newton_step(struct shooter *s, double *f, double norm)
{
    double relative = norm / s->reference;
    struct linear_problem problem = {
        .n = s->count,
        .product = product,
        .argument = s,
        .tolerance = fmax(INNER_TOLERANCE_MIN, fmin(INNER_TOLERANCE_MAX, relative)),
        .cap = INNER_CAP,
        .context = s->context};
    double length = -1.0;

    (void)linear_gmres(&problem, s->residual, s->step, s->inner);
    scale(s, s->step, s->step);
    for (size_t k = 0; k <= SHORTENED; k++) {
        double next;

        linear_copy(s->count, f, s->candidate);
        linear_axpy(s->count, length, s->step, s->candidate);
        next = residual_at(s, s->candidate);
        if (next < norm) {
            linear_copy(s->count, s->candidate, f);
            return next;
        }
        length *= 0.5;
    }
    (void)residual_at(s, f);
    return norm;
}

/* Surface k + 1, which holds its start on entry. On return the trial belongs to it. */
static void solve_surface(struct shooter *s, double *f)
{
    double norm = residual_at(s, f);

    for (size_t k = 0; k < NEWTON_STEPS && norm > NEWTON_TOLERANCE * s->reference &&
                       !srnf_is_canceled(s->context);
         k++) {
        double next = newton_step(s, f, norm);

        s->iterations++;
        if (!(next < norm)) {
            break;
        }
        norm = next;
    }
    s->worst = norm / s->reference <= s->worst ? s->worst : norm / s->reference;
}

/* Makes f_k the state, with q_k in here; q_k-1 moves to before. */
static void enter(struct shooter *s, const double *f)
{
    double *swap = s->before;
    const struct gauss_newton_state *trial = &s->system->trial;

    s->before = s->here;
    s->here = swap;
    (void)gauss_newton_try(s->system, f);
    for (size_t c = 0; c < 3; c++) {
        size_t n = s->system->points;

        for (size_t i = 0; i < n; i++) {
            s->here[c * n + i] = trial->unit[c * n + i] * trial->root[i];
        }
    }
    gauss_newton_accept(s->system);
}

/* Target and reference of the equation at f_k. */
static void aim(struct shooter *s)
{
    double momentum;
    double size;

    for (size_t i = 0; i < s->field; i++) {
        s->target[i] = s->here[i] - s->before[i];
    }
    momentum = tangential(s, s->target, s->residual);
    size = tangential(s, s->here, s->residual);
    s->reference = fmax(momentum, SMALL * size);
    for (size_t i = 0; i < s->field; i++) {
        s->target[i] += s->here[i];
    }
}

/* Start of f_k+1 from the three before it, or two. Translations go on by the same rule, which is
   exact on the straight line they follow. */
static void extrapolate(size_t k, size_t count, double *f)
{
    const double *a = f - count;
    const double *b = f - 2 * count;
    const double *c = f - 3 * count;

    for (size_t i = 0; i < count; i++) {
        f[i] = k >= 2 ? 3.0 * a[i] - 3.0 * b[i] + c[i] : 2.0 * a[i] - b[i];
    }
}

static int walk(struct shooter *s, const struct srnf_context *context,
                struct srnf_pullback_shot *result)
{
    size_t m = result->steps - 1;
    size_t n = s->count;

    enter(s, result->coefficients);
    for (size_t k = 1; k < m; k++) {
        double *f = result->coefficients + (k + 1) * n;

        if (srnf_is_canceled(context)) {
            return SRNF_ECANCELED;
        }
        enter(s, f - n);
        aim(s);
        if (!isfinite(s->reference)) {
            return SRNF_ENUMERIC;
        }
        extrapolate(k, n, f);
        if (s->reference > 0.0) {
            solve_surface(s, f);
        }
        srnf_report_progress(context, (double)k / (double)m, "following the velocity");
    }
    return SRNF_OK;
}

/* Ends and times; the first step along the velocity. */
static int start(struct srnf_pullback_shot *result, size_t degree, size_t segments,
                 const double *from, const double *velocity)
{
    size_t count = 3 * srnf_coefficient_count(degree);

    result->degree = degree;
    result->steps = segments + 1;
    result->coefficients = srnf_alloc((segments + 1) * count, sizeof(double));
    result->times = srnf_alloc(segments + 1, sizeof(double));
    if (!result->coefficients || !result->times) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k <= segments; k++) {
        result->times[k] = (double)k / (double)segments;
    }
    for (size_t i = 0; i < count; i++) {
        result->coefficients[i] = from[i];
        result->coefficients[count + i] = from[i] + velocity[i] / (double)segments;
    }
    return SRNF_OK;
}

int srnf_pullback_exp(const struct srnf_sht *sht, const double *from, const double *velocity,
                      size_t segments, const struct srnf_context *context,
                      struct srnf_pullback_shot *result, struct srnf_error *error)
{
    struct shooter s = {0};
    int status;

    *result = (struct srnf_pullback_shot){0};
    status = pullback_check_segments(segments, error);
    status = status ? status : pullback_check_surface(sht, from, "the surface", error);
    status = status ? status : pullback_check_surface(sht, velocity, "the velocity", error);
    status = status ? status : start(result, srnf_sht_degree(sht), segments, from, velocity);
    status = status ? status : create(&s, sht);
    s.context = context;
    status = status ? status : walk(&s, context, result);
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : status;
    if (status == SRNF_OK) {
        result->residual = s.worst;
        result->iterations = s.iterations;
        result->transforms = s.system->transforms;
        status =
            pullback_measure(sht, context, segments, result->coefficients, NULL, &result->path);
    }
    destroy(&s);
    if (status) {
        srnf_pullback_shot_clear(result);
        return pullback_fail(status, error);
    }
    srnf_report_progress(context, 1.0, "the velocity is followed");
    return result->residual <= NEWTON_ACCEPTED ? SRNF_OK : SRNF_WNOT_CONVERGED;
}

void srnf_pullback_shot_clear(struct srnf_pullback_shot *result)
{
    srnf_free(result->coefficients);
    srnf_free(result->times);
    *result = (struct srnf_pullback_shot){0};
}
