/*
 * classify.h - the process classify: comparisons by the metrics that the methods ask for,
 * and a classifier on each.
 */
#ifndef SRNFD_COMPUTE_CLASSIFY_H
#define SRNFD_COMPUTE_CLASSIFY_H

#include "compute/group.h"

struct compute_classify_method {
    const char *name;
    enum srnf_metric metric;
    bool gauss; /* otherwise the nearest neighbour */
};
/* Ended by a NULL name; the first is the default. */
extern const struct compute_classify_method compute_classify_methods[];
#define COMPUTE_CLASSIFY_METHODS 7

struct compute_classify_inputs {
    const struct compute_group *group;
    const double *scales; /* [n] that multiply the surfaces back, for size; NULL: shape only */
    const size_t *labels; /* [n] below n_classes */
    size_t n_classes;
    size_t n_methods;
    const struct compute_classify_method *const *methods; /* [n_methods] */
    struct srnf_folds_options comparison;
    struct srnf_classify_options classifier; /* log_scale is set from scales */
    double *pairs; /* [n][n], gets the distances of the first comparison; NULL: not */
};

/*
 * Each metric compares once, whatever asks for it. Returns 0, or a negative status with the problem
 * in result. results, typicality: [n_methods], to be cleared with srnf_classification_clear and
 * srnf_folds_typicality_clear in any case.
 */
int compute_classify(struct jobs_run *run, const struct compute_classify_inputs *inputs,
                     struct srnf_classification *results, struct srnf_folds_typicality *typicality,
                     struct jobs_result *result);

#endif
