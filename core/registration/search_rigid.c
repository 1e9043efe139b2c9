/*
 * search_rigid.c - the best rotation as a start: the best of the screening, refined, and what there
 * is beside it.
 */
#include "tournament.h"

#include <math.h>

#define RIGID_REFINED ((size_t)10)

/* Refined on the grid of the last round of the tournament, by its table. */
static int refine_starts(const struct search *s, size_t count, struct start_rotation *starts)
{
    const struct tabulated_moving *table = &s->subject->rounds[TOURNAMENT_ROUNDS - 1];
    struct moving moving = {.representation = s->options->representation, .table = table};
    struct problem problem = {.moving = &moving, .free_rotation = s->full.free_rotation};
    size_t rows = tournament_round(TOURNAMENT_ROUNDS - 1, table->degree).rows;
    double *memory = NULL;
    int status = search_coarsen(s, rows, table->degree, &memory, &problem.target);

    moving.plan.points.context = s->context;
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        status = registration_rigid(&problem, &starts[i], NULL);
    }
    srnf_free(memory);
    return status;
}

/* On the full grid: by the table, then by the surface itself, which has little left to do. */
static int refine_best(const struct search *s, struct start_rotation *best, double *curvature)
{
    struct moving moving = {.representation = s->options->representation,
                            .table = &s->subject->full};
    struct problem problem = s->full;
    int status = SRNF_OK;

    moving.plan.points.context = s->context;
    problem.moving = &moving;
    if (!s->options->exact && best->energy >= DIRECT_ENERGY) {
        status = registration_rigid(&problem, best, NULL);
    }
    return status ? status : registration_rigid(&s->full, best, curvature);
}

int search_rigid(const struct search *s, struct search_result *result)
{
    struct start_rotation starts[RIGID_REFINED];
    size_t best = 0;
    int status;
    size_t count = search_screen(s, RIGID_REFINED, starts, &status);

    if (status == SRNF_OK) {
        status = refine_starts(s, count, starts);
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        best = starts[i].energy < starts[best].energy ? i : best;
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double angle;
        double trace = 0.0;

        for (size_t k = 0; k < 9; k++) {
            trace += starts[i].rotation[k] * starts[best].rotation[k];
        }
        angle = acos(fmax(-1.0, fmin(1.0, 0.5 * (trace - 1.0))));
        if (angle > AMBIGUITY_ANGLE && starts[best].energy > 0.0 &&
            (result->ambiguity_objective == 0.0 ||
             starts[i].energy / starts[best].energy < result->ambiguity_objective)) {
            result->ambiguity_objective = starts[i].energy / starts[best].energy;
            result->ambiguity_angle = angle;
        }
    }
    if (status == SRNF_OK) {
        status = refine_best(s, &starts[best], &result->rotational_curvature);
        result->rotations_searched = true;
    }
    if (status == SRNF_OK) {
        status = warp_create(&result->warp, &s->full.target);
    }
    if (status == SRNF_OK) {
        status = warp_rotate(&result->warp, &s->full.target, starts[best].rotation);
        result->warp.stopped = starts[best].stopped;
    }
    return status;
}
