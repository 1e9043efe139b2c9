/*
 * landmarks_match.c - a warp that meets landmarks exactly, before any surface is looked at.
 *
 * Any distinct points of the sphere can be taken to any others by a diffeomorphism that keeps
 * orientation; what there may not be is one without folds and pinches of the given degree of
 * fields. Each step is the smoothest field, the one of least sum (l (l + 1))^2 c^2, whose values at
 * the points are a part of what is left to go; the part is halved until the step keeps orientation
 * with a margin. A step whose part is 1 arrives to rounding.
 */
#include "landmarks.h"

#include <math.h>
#include <string.h>

#define STEPS_MAX 200
#define STEP_JACOBIAN_MIN 0.5
#define PART_MIN (1.0 / 128.0)
#define JACOBIAN_MIN \
    1e-3               /* of all steps together, and its inverse: beyond it the sphere is pinched */
#define MET 1e-12      /* radians: arrived */
#define MET_AFTER 1e-8 /* after the steps of a search, each of which keeps them to rounding */

struct nodes {
    size_t n;
    double *points, *jacobian, *new_points, *new_jacobian, *scratch;
    double *step, *potentials;
};

static int nodes_create(struct nodes *nodes, const struct search *s, size_t unknowns)
{
    size_t n = s->full.target.n;

    nodes->n = n;
    nodes->points = srnf_alloc((8 + FIELDS_SCRATCH) * n + 2 * unknowns + 2, sizeof(double));
    if (!nodes->points) {
        return SRNF_ENOMEM;
    }
    nodes->jacobian = nodes->points + 3 * n;
    nodes->new_points = nodes->jacobian + n;
    nodes->new_jacobian = nodes->new_points + 3 * n;
    nodes->scratch = nodes->new_jacobian + n;
    nodes->step = nodes->scratch + FIELDS_SCRATCH * n;
    nodes->potentials = nodes->step + unknowns;
    return SRNF_OK;
}

/* The farthest landmark, and how far it is. */
static double farthest(const struct landmark_track *t, size_t *worst)
{
    double most = 0.0;

    for (size_t j = 0; j < t->landmarks->n; j++) {
        double angle = landmarks_angle(t->at + 3 * j, t->landmarks->moving + 3 * j);

        if (angle > most) {
            most = angle;
            *worst = j;
        }
    }
    return most;
}

/* M^-1 of the smoothness; values of the surface do not turn. */
static bool smooth(void *system, const double *rhs, double *out)
{
    const struct fields *fields = system;
    size_t each = fields->count - 1;

    for (size_t l = 1; l <= fields->degree; l++) {
        double weight = 1.0 / (double)(l * (l + 1) * l * (l + 1));

        for (size_t i = l * l - 1; i + 1 < (l + 1) * (l + 1); i++) {
            out[i] = weight * rhs[i];
            out[each + i] = weight * rhs[each + i];
        }
    }
    memset(out + 2 * each, 0, 3 * sizeof *out);
    return true;
}

static bool is_pinched(size_t n, const double *jacobian)
{
    for (size_t i = 0; i < n; i++) {
        if (!(jacobian[i] > JACOBIAN_MIN) || !(jacobian[i] < 1.0 / JACOBIAN_MIN)) {
            return true;
        }
    }
    return false;
}

/* One step as long as it may be; SRNF_EUNMATCHED where none may be taken. */
static int advance(struct landmark_track *t, struct nodes *nodes, struct srnf_warp *chain)
{
    landmark_track_linearize(t);
    for (double part = 1.0; part >= PART_MIN; part *= 0.5) {
        double least;

        memset(nodes->step, 0, t->unknowns * sizeof(double));
        if (!landmark_track_correct(t, smooth, &t->fields, part, nodes->step, NULL)) {
            return SRNF_EUNMATCHED;
        }
        registration_potentials(&t->fields, nodes->step, nodes->potentials);
        least =
            fields_apply(&t->fields, nodes->potentials, nodes->n, nodes->points, nodes->jacobian,
                         nodes->new_points, nodes->new_jacobian, nodes->scratch);
        if (least >= STEP_JACOBIAN_MIN && !is_pinched(nodes->n, nodes->new_jacobian)) {
            (void)landmark_track_try(t, nodes->potentials);
            landmark_track_accept(t);
            memcpy(nodes->points, nodes->new_points, 3 * nodes->n * sizeof(double));
            memcpy(nodes->jacobian, nodes->new_jacobian, nodes->n * sizeof(double));
            return warp_append(chain, SRNF_WARP_EXP, t->fields.degree, nodes->potentials);
        }
    }
    return SRNF_EUNMATCHED;
}

int landmarks_match(const struct search *s, struct srnf_warp *chain)
{
    /* The same condition on steps as in the search; exact landmarks, whatever their weight. */
    const struct srnf_landmarks *given = &s->landmarks->pairs;
    struct srnf_landmarks exact = {given->n, given->fixed, given->moving, INFINITY};
    struct landmark_track track = {.landmarks = NULL};
    struct nodes nodes = {.points = NULL};
    int status = landmark_track_create(&track, &exact, chain, s->options->degree, s->context);

    status = status ? status : nodes_create(&nodes, s, track.unknowns);
    if (status == SRNF_OK) {
        status = warp_apply(chain, s->context, nodes.n, s->full.target.points, nodes.points,
                            nodes.jacobian);
    }
    for (size_t k = 0; status == SRNF_OK && farthest(&track, &s->landmarks->worst) > MET; k++) {
        status = srnf_is_canceled(s->context) ? SRNF_ECANCELED
                 : k < STEPS_MAX              ? advance(&track, &nodes, chain)
                                              : SRNF_EUNMATCHED;
    }
    srnf_free(nodes.points);
    landmark_track_clear(&track);
    return status;
}

int landmarks_met(const struct search *s, const struct srnf_warp *chain)
{
    const struct srnf_landmarks *landmarks = &s->landmarks->pairs;
    double *angles = srnf_alloc(landmarks->n, sizeof(double));
    int status = angles ? srnf_landmarks_measure(chain, landmarks, angles) : SRNF_ENOMEM;

    for (size_t i = 0; angles && i < landmarks->n && status == SRNF_OK; i++) {
        if (!(angles[i] <= MET_AFTER)) {
            s->landmarks->worst = i;
            status = SRNF_EUNMATCHED;
        }
    }
    srnf_free(angles);
    return status;
}

int landmarks_fail(const struct landmark_search *landmarks, struct srnf_error *error)
{
    return srnf_fail(error, SRNF_EUNMATCHED, (int64_t)landmarks->worst,
                     "landmark %zu was not met, with the others, by any warp that keeps "
                     "orientation and stretches or shrinks no area by more than a thousand",
                     landmarks->worst);
}
