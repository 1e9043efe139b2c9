/*
 * search_measure.c - what a warp is worth to a search: energy, objective and distance on the nodes
 * of the full problem, by the moving field itself.
 */
#include "landmarks.h"

#include <math.h>

double search_distance(const struct search *s, const struct warp *warp)
{
    return sqrt(warp->energy * s->full.target.norm2);
}

int search_measure(const struct search *s, struct warp *warp)
{
    const struct problem *problem = &s->full;
    struct samples samples = {.n = problem->target.n};
    double ignored[9];
    int status = SRNF_OK;

    samples.q = srnf_alloc(3 * samples.n, sizeof(double));
    if (!samples.q) {
        return SRNF_ENOMEM;
    }
    moving_values(problem->moving, samples.n, warp->points, NULL, samples.q);
    registration_measure(problem, warp, &samples, ignored);
    srnf_free(samples.q);
    status = srnf_is_canceled(moving_context(problem->moving)) ? SRNF_ECANCELED : SRNF_OK;
    if (status == SRNF_OK && s->landmarks) {
        double cost;

        status = landmarks_cost(&s->landmarks->pairs, &warp->chain, &cost);
        warp->objective += cost;
    }
    return status;
}

int search_evaluate(const struct search *s, const struct srnf_warp *chain,
                    struct search_result *result)
{
    int status = warp_create(&result->warp, &s->full.target);

    if (status == SRNF_OK) {
        status = warp_replay(&result->warp, &s->full.target, chain, s->context);
    }
    if (status == SRNF_OK) {
        status = search_measure(s, &result->warp);
    }
    result->distance = search_distance(s, &result->warp);
    return status;
}

void search_result_clear(struct search_result *result)
{
    warp_clear(&result->warp);
}
