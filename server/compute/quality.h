/*
 * quality.h - the processes evaluate-model and compare-groups: how good a model is, and
 * whether two groups differ.
 */
#ifndef SRNFD_COMPUTE_QUALITY_H
#define SRNFD_COMPUTE_QUALITY_H

#include "compute/mean.h"
#include "compute/model.h"

/*
 * Quality of the linear model of a group, whose mean is computed first as compute_mean does.
 *   components [in] of options: 0 stands for COMPUTE_QUALITY_COMPONENTS or what the group allows
 * Returns 0, or a negative status with the problem in result. mean is cleared with
 * compute_mean_clear, quality with srnf_quality_clear.
 */
#define COMPUTE_QUALITY_COMPONENTS 10
int compute_quality_group(struct jobs_run *run, const struct compute_mean_inputs *inputs,
                          const struct srnf_quality_options *options,
                          struct compute_mean_outputs *mean, struct srnf_quality *quality,
                          struct jobs_result *result);

/* The same of a stored model, whose subjects are rebuilt from their scores: a model that keeps
   less than all of the variance, total_variance, is refused. */
int compute_quality_model(struct jobs_run *run, const char *id, double total_variance,
                          const struct srnf_quality_options *options, struct srnf_quality *quality,
                          struct jobs_result *result);

struct compute_comparison_inputs {
    struct compute_mean_inputs mean;
    const int *group; /* [n] 0 or 1 */
    size_t n_covariates;
    const double *covariates; /* [n][n_covariates] */
    struct srnf_compare_options options;
};

/* The mean of all, and the comparison of the groups about it. comparison is cleared with
   srnf_comparison_clear. */
int compute_comparison(struct jobs_run *run, const struct compute_comparison_inputs *inputs,
                       struct compute_mean_outputs *mean, struct srnf_comparison *comparison,
                       struct jobs_result *result);

#endif
