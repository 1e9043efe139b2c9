/*
 * norms_check.c - are the percentiles what they say? The subjects are dealt into five groups; a
 * model of the other four has leave-one-out values of its own subjects, among which each member of
 * the fifth gets its percentiles. Of members of one kind these are uniform.
 *
 * Registrations are those of all: what a subject gains by having taken part in the mean that it is
 * registered to is not seen here.
 */
#include "norms.h"

#include <string.h>

struct check {
    const struct norms *norms;
    size_t counted;
    double *values; /* [NORMS_GROUPS][SRNF_NORM_TRAITS][n] */
};

/* Subject `index % count` about the fold without group `index / count` and itself. */
static int describe_body(void *argument, size_t index, const struct srnf_context *context,
                         struct srnf_error *error)
{
    const struct check *check = argument;
    const struct norms *norms = check->norms;
    size_t group = index / norms->subjects.count;

    (void)context;
    return norms_describe_subject(norms, group, index % norms->subjects.count, check->counted,
                                  check->values + group * SRNF_NORM_TRAITS * norms->n, error);
}

/* Percentiles of member i, whose group was left out, among those of the other groups. scratch:
   [3][n] */
static int judge_member(const struct check *check, size_t i, double *scratch,
                        double percentile[SRNF_NORM_CHECKS])
{
    const struct norms *norms = check->norms;
    size_t n = norms->n;
    size_t group = norms_group(norms->subjects.of[i]);
    const double *values = check->values + group * SRNF_NORM_TRAITS * n;
    const double own[2] = {values[SRNF_TRAIT_RESIDUAL * n + i],
                           values[SRNF_TRAIT_MAHALANOBIS * n + i]};
    struct srnf_norm_rank rank;
    size_t count = 0;
    int status = SRNF_OK;

    for (size_t j = 0; j < n; j++) {
        count += norms_group(norms->subjects.of[j]) != group;
    }
    for (size_t j = 0, at = 0; j < n; j++) {
        if (norms_group(norms->subjects.of[j]) != group) {
            scratch[at] = values[SRNF_TRAIT_RESIDUAL * n + j];
            scratch[count + at] = values[SRNF_TRAIT_MAHALANOBIS * n + j];
            scratch[2 * count + at++] = norms->weights[j];
        }
    }
    for (size_t t = 0; t < 2 && status == SRNF_OK; t++) {
        status = srnf_norm_rank(count, scratch + t * count, scratch + 2 * count, own[t], &rank);
        percentile[t] = rank.percentile;
    }
    if (status == SRNF_OK) {
        status = srnf_norm_rank_together(count, 2, scratch, scratch + 2 * count, own, &rank);
        percentile[2] = rank.percentile;
    }
    return status;
}

static int judge(const struct check *check, struct srnf_norm_check *out)
{
    const struct subjects *s = &check->norms->subjects;
    double *scratch = srnf_alloc(3, check->norms->n * sizeof(double));
    int status = SRNF_ENOMEM;

    out->percentiles = srnf_alloc(SRNF_NORM_CHECKS, s->count * sizeof(double));
    if (scratch && out->percentiles) {
        status = SRNF_OK;
    }
    for (size_t k = 0; k < s->count && status == SRNF_OK; k++) {
        double percentile[SRNF_NORM_CHECKS];

        status = judge_member(check, s->members[s->start[k]], scratch, percentile);
        for (size_t c = 0; c < SRNF_NORM_CHECKS && status == SRNF_OK; c++) {
            out->percentiles[c * s->count + k] = percentile[c];
        }
    }
    for (size_t c = 0; c < SRNF_NORM_CHECKS && status == SRNF_OK; c++) {
        status = srnf_norm_uniform(s->count, out->percentiles + c * s->count, &out->distance[c],
                                   &out->p_value[c]);
    }
    out->n = s->count;
    srnf_free(scratch);
    return status;
}

int norms_check(const struct norms *norms, size_t counted, struct stats_progress progress,
                struct srnf_norm_check *check, struct srnf_error *error)
{
    struct check run = {.norms = norms, .counted = counted};
    int status = SRNF_ENOMEM;

    run.values = srnf_alloc(NORMS_GROUPS * SRNF_NORM_TRAITS, norms->n * sizeof(double));
    if (run.values) {
        status = stats_run(norms->context, NORMS_GROUPS * norms->subjects.count, describe_body,
                           &run, progress, error);
    }
    status = status ? status : judge(&run, check);
    srnf_free(run.values);
    return status;
}
