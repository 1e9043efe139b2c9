/*
 * compare_groups.h - what the files of the process compare-groups share: its typed inputs and its
 * result.
 */
#ifndef SRNFD_PROCESSES_COMPARE_GROUPS_H
#define SRNFD_PROCESSES_COMPARE_GROUPS_H

#include "toolkit/mean.h"
#include "store/surface.h"

/* The cohort with what is compared of it. */
struct compared {
    struct group_input group;
    int *which; /* [n] group of each member, 0 or 1 */
    size_t n_covariates;
    double *covariates; /* [n][n_covariates] */
};

struct compare {
    struct compared cohort;
    struct mean_input mean;
    long permutations, seed;
    json_t *covariates; /* names */
};

/* compare_groups_cohort.c: the input cohort, a struct compared; and what the comparison needs
   beside the surfaces, put into the canonical cohort once all inputs are read. */
extern const struct input_own compare_groups_cohort;
void compare_groups_describe(struct process_inputs *given);

/* compare_groups_result.c: the maps in one array, count 0 without memory; and the document without
   the surface and the members. */
struct store_maps compare_groups_maps(const struct compute_mean_outputs *mean,
                                      const struct srnf_comparison *comparison);
json_t *compare_groups_document(const struct compare *asked,
                                const struct compute_mean_outputs *mean,
                                const struct srnf_comparison *comparison,
                                const struct store_maps *maps);
/* Adds what the members and the two groups are doubted for; takes the document over and returns it,
   or NULL with the problem set. */
json_t *compare_groups_warn(struct jobs_run *run, const struct compare *asked,
                            const struct group_mean *mean, json_t *document,
                            struct jobs_result *result);

#endif
