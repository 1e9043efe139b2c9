/*
 * search.c - registration in one direction: global start, rising degrees.
 *
 * The start is the basin that a tournament finds (tournament.c), the best rotation, refined, or the
 * identity. Refining a basin is a matter of fields of the degrees 4, 8, 12, ... up to the one asked
 * for: by tables (climb.c), or directly, in exact mode and where two surfaces turn out to be the
 * same up to a warp, so that what the tables leave is more than what there is to gain.
 */
#include "exact.h"
#include "landmarks.h"
#include "tournament.h"

#include <math.h>
#include <string.h>

#define STEPS_MAX ((size_t)40)   /* of a degree, where the options do not say */
#define ROUGH_DEGREE ((size_t)2) /* of the first steps from a rotation that is not refined */
#define ROUGH_STEPS ((size_t)5)
#define EXACT_ENERGY 1e-3 /* below it two surfaces may well be the same up to a warp */

const struct ladder_rung registration_ladder[LADDER_RUNGS] = {{4, 1e-2},  {8, 3e-3},  {12, 1e-3},
                                                              {16, 1e-3}, {24, 1e-3}, {32, 1e-3}};

static size_t steps_max(const struct search *s)
{
    return s->options->max_steps ? s->options->max_steps : STEPS_MAX;
}

/* All rungs above `from` and up to the degree of the options, directly; a last one for a degree
   between two. */
static int climb_directly(const struct search *s, size_t from, struct warp *warp,
                          size_t *iterations)
{
    struct samples samples = {0};
    int status = samples_create(&samples, s->full.target.n);
    size_t top = s->options->degree;

    for (size_t k = 0; k < LADDER_RUNGS && status == SRNF_OK; k++) {
        bool last = k + 1 == LADDER_RUNGS || registration_ladder[k].degree >= top;
        size_t degree = registration_ladder[k].degree < top ? registration_ladder[k].degree : top;
        struct schedule schedule = {steps_max(s), registration_ladder[k].decrease};
        struct level level;

        if (degree > from) {
            status = level_create(&level, &s->full, degree);
            if (status == SRNF_OK) {
                status = registration_optimize(&s->full, &level, &schedule, s->context, warp,
                                               &samples, iterations);
                level_clear(&level);
            }
        }
        if (last) {
            break;
        }
    }
    samples_clear(&samples);
    if (status == SRNF_OK && s->options->exact && warp->energy < EXACT_ENERGY) {
        status = registration_polish(&s->full, s->sht, s->has_template ? &s->moving_template : NULL,
                                     s->context, warp, iterations);
    }
    return status;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

/* The rotation that a search began with; steps in the template's domain come before it. NULL: the
   chain has none. */
static const double *first_rotation(const struct srnf_warp *chain)
{
    for (size_t k = 0; k < chain->n_links; k++) {
        if (chain->links[k].kind == SRNF_WARP_ROTATION) {
            return chain->links[k].values;
        }
    }
    return NULL;
}

/* All degrees directly, from a rotation: refined, as two surfaces that are nearly the same lie
   best, or, in exact mode, first warped roughly. */
static int climb_from_rotation(const struct search *s, const double rotation[9], struct warp *warp,
                               size_t *iterations)
{
    const size_t degree = s->options->degree < ROUGH_DEGREE ? s->options->degree : ROUGH_DEGREE;
    const struct schedule rough = {ROUGH_STEPS, 1e-3};
    struct samples samples = {0};
    struct level level;
    struct start_rotation start = {.energy = 0.0};
    int status = warp_create(warp, &s->full.target);

    memcpy(start.rotation, rotation, sizeof start.rotation);
    if (status == SRNF_OK && !s->options->exact) {
        status = registration_rigid(&s->full, &start, NULL);
    }
    status = status ? status : warp_rotate(warp, &s->full.target, start.rotation);
    if (!s->options->exact) {
        status = status ? status : search_measure(s, warp);
        return status ? status : climb_directly(s, 0, warp, iterations);
    }
    status = status ? status : samples_create(&samples, s->full.target.n);
    status = status ? status : level_create(&level, &s->full, degree);
    if (status == SRNF_OK) {
        status =
            registration_optimize(&s->full, &level, &rough, s->context, warp, &samples, iterations);
        level_clear(&level);
    }
    samples_clear(&samples);
    return status ? status : climb_directly(s, 0, warp, iterations);
}

/* Guided by landmarks, by tables whatever is left: from the chain of result, whose landmarks are
   met first where they are to be. */
static int climb_guided(const struct search *s, struct search_result *result)
{
    bool exact = isinf(s->landmarks->pairs.weight);
    int status = exact ? landmarks_match(s, &result->warp.chain) : SRNF_OK;

    status = status ? status
                    : warp_replay(&result->warp, &s->full.target, &result->warp.chain, s->context);
    status = status ? status : climb_run(s, 0, true, result);
    return status || !exact ? status : landmarks_met(s, &result->warp.chain);
}

/* The degree from which on rungs follow a basin. */
static size_t basin_degree(const struct search *s)
{
    return s->options->degree > BASIN_DEGREE ? BASIN_DEGREE : s->options->degree - 1;
}

/* Directly from the chain of what was found, the tournament's. */
static int climb_from_chain(const struct search *s, struct search_result *result)
{
    int status = warp_replay(&result->warp, &s->full.target, &result->warp.chain, s->context);

    status = status ? status : search_measure(s, &result->warp);
    return status ? status : climb_directly(s, basin_degree(s), &result->warp, &result->iterations);
}

/* Directly from the rotation of what was found, if that is better. In exact mode nothing has gone
   on from what was found, and its chain is the second choice, since it ends less near to rounding:
   it serves where steps from its rotation leave the basin. */
static int climb_again(const struct search *s, struct search_result *result)
{
    bool replaces = s->options->exact;
    const double *rotation = first_rotation(&result->warp.chain);
    struct warp direct = {0};
    int status;

    if (!rotation) {
        return SRNF_OK;
    }
    status = climb_from_rotation(s, rotation, &direct, &result->iterations);
    if (status == SRNF_OK && replaces && direct.energy >= EXACT_ENERGY) {
        status = climb_from_chain(s, result);
        replaces = false;
    }
    if (status == SRNF_OK && (replaces || direct.objective < result->warp.objective)) {
        struct warp replaced = result->warp;

        result->warp = direct;
        direct = replaced;
    }
    warp_clear(&direct);
    return status;
}

/* Up from the start that result holds: measured on the full grid where `placed`, else a chain
   alone, which has a rotation. Directly in exact mode; and where little is left, if that is
   better. */
static int climb(const struct search *s, size_t from, bool placed, struct search_result *result)
{
    bool exact = s->options->exact;
    int status = SRNF_OK;

    if (s->landmarks) {
        return climb_guided(s, result);
    }
    if (placed && (exact || result->warp.energy < DIRECT_ENERGY)) {
        return climb_directly(s, from, &result->warp, &result->iterations);
    }
    if (!exact) {
        status = climb_run(s, from, placed, result);
        if (status || result->warp.energy >= DIRECT_ENERGY) {
            return status;
        }
    }
    result->carried = false;
    return climb_again(s, result);
}

static int from_basin(const struct search *s, bool still, struct search_result *result)
{
    int status = still ? tournament_still(s, result) : tournament_run(s, result);

    if (status == SRNF_OK) {
        struct srnf_warp chain = result->warp.chain;

        result->warp.chain = (struct srnf_warp){0};
        status = warp_create(&result->warp, &s->full.target);
        srnf_warp_clear(&result->warp.chain);
        result->warp.chain = chain;
    }
    srnf_report_progress(s->context, 0.6, "warping");
    return status ? status : climb(s, basin_degree(s), false, result);
}

/* Whether coarse grids are good for the first steps from the identity: not where little is left,
   nor where landmarks or a low degree are asked for. */
static int starts_coarsely(const struct search *s, bool *coarsely)
{
    double energy = 0.0;
    int status = SRNF_OK;

    *coarsely = s->options->reparameterization && !s->landmarks && search_refits(s);
    if (*coarsely) {
        status = climb_still_energy(s, &energy);
        *coarsely = energy >= DIRECT_ENERGY;
    }
    return status;
}

/* From the identity, or from the best rotation. */
static int from_rigid(const struct search *s, bool still, struct search_result *result)
{
    int status = still ? warp_create(&result->warp, &s->full.target) : search_rigid(s, result);

    status = status ? status : search_measure(s, &result->warp);
    if (status == SRNF_OK && s->options->reparameterization) {
        srnf_report_progress(s->context, 0.6, "warping");
        status = climb(s, 0, true, result);
    }
    return status;
}

/* The warp of another search instead. What is told of rotations stays: it was found before any warp
   was. */
static void take_warp(struct search_result *other, struct search_result *result)
{
    struct warp replaced = result->warp;

    result->warp = other->warp;
    result->carried = other->carried;
    other->warp = replaced;
}

/* On from the best rigid start instead, where that alone is better than what there is: entrants of
   the tournament are not refined, and penalties may hold them where they are. */
static int try_rigid(const struct search *s, struct search_result *result)
{
    struct search_result other = {.iterations = 0};
    int status;

    if (!result->rotations_searched || !(result->rigid_energy < result->warp.objective)) {
        return SRNF_OK;
    }
    status = search_rigid(s, &other);
    status = status ? status : search_measure(s, &other.warp);
    if (status == SRNF_OK && other.warp.objective < result->warp.objective) {
        status = climb(s, 0, true, &other);
        result->iterations += other.iterations;
    }
    if (status == SRNF_OK && other.warp.objective < result->warp.objective) {
        take_warp(&other, result);
    }
    search_result_clear(&other);
    return status;
}

/* From what the options say. */
static int run_once(const struct search *s, struct search_result *result)
{
    const struct srnf_register_options *o = s->options;
    bool still = o->common_pose || o->start == SRNF_START_IDENTITY;
    bool basin = !still && o->start != SRNF_START_RIGID && o->reparameterization;
    int status = still ? starts_coarsely(s, &basin) : SRNF_OK;

    *result = (struct search_result){0};
    if (status == SRNF_OK) {
        status = basin ? from_basin(s, still, result) : from_rigid(s, still, result);
    }
    if (status == SRNF_OK && basin && !still) {
        status = try_rigid(s, result);
    }
    if (status) {
        search_result_clear(result);
    }
    return status;
}

/* From a rotation, if that ends lower than what there is; *none: whether there is nothing yet. */
static int run_from_rotation(const struct search *s, const double rotation[9], bool *none,
                             struct search_result *result)
{
    struct search_result other = {.iterations = 0};
    int status = warp_create(&other.warp, &s->full.target);

    status = status ? status : warp_rotate(&other.warp, &s->full.target, rotation);
    status = status ? status : climb(s, 0, true, &other);
    result->iterations += other.iterations;
    if (status == SRNF_OK && (*none || other.warp.objective < result->warp.objective)) {
        take_warp(&other, result);
        *none = false;
    }
    search_result_clear(&other);
    return status == SRNF_EUNMATCHED ? SRNF_OK : status;
}

/* From there, and from where the landmarks point. What cannot meet them is out. */
static int run_guided(const struct search *s, struct search_result *result)
{
    double rotations[LANDMARK_STARTS][9];
    size_t count = 0;
    int status = run_once(s, result);
    bool none = status == SRNF_EUNMATCHED;

    status = none ? SRNF_OK : status;
    status = status ? status : landmarks_start(s, rotations, &count);
    for (size_t k = 0; k < count && status == SRNF_OK; k++) {
        status = run_from_rotation(s, rotations[k], &none, result);
    }
    status = status == SRNF_OK && none ? SRNF_EUNMATCHED : status;
    if (status) {
        search_result_clear(result);
    }
    return status;
}

/* Whether a search for a basin went no further: it does where little is left. */
static bool ends_in_basin(const struct search *s, const struct search_result *result)
{
    return s->basin && s->options->degree > BASIN_DEGREE && result->warp.energy >= DIRECT_ENERGY;
}

int search_run(const struct search *s, struct search_result *result)
{
    const struct srnf_register_options *o = s->options;
    bool still = o->common_pose || o->start == SRNF_START_IDENTITY;
    int status = s->landmarks && !still ? run_guided(s, result) : run_once(s, result);

    if (ends_in_basin(s, result)) {
        result->warp.stopped = SRNF_REGISTER_DIRECT; /* no reason of the highest degree yet */
    }
    result->distance = search_distance(s, &result->warp);
    return status;
}

int search_refine(const struct search *s, struct search_result *result)
{
    int status = SRNF_OK;

    if (s->options->reparameterization && !s->options->exact && !s->landmarks &&
        result->warp.energy >= DIRECT_ENERGY) {
        status = climb_run(s, s->options->degree, true, result);
        if (status == SRNF_OK && result->warp.energy < DIRECT_ENERGY) {
            status = climb_again(s, result);
        }
    }
    result->distance = search_distance(s, &result->warp);
    return status;
}

int search_continue(const struct search *s, const struct srnf_warp *chain,
                    struct search_result *result)
{
    size_t from = s->options->degree > BASIN_DEGREE ? BASIN_DEGREE : 0;
    int status = search_evaluate(s, chain, result);

    if (status == SRNF_OK && s->options->reparameterization) {
        status = climb(s, from, true, result);
    }
    if (status) {
        search_result_clear(result);
    }
    result->distance = search_distance(s, &result->warp);
    return status;
}
