/*
 * methods.h - classification of labelled surfaces by several methods at once (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * A method is a metric and a classifier (srnf/classify.h). Methods of one metric share its
 * comparison, which is what is costly; only one comparison is in memory at a time.
 */
#ifndef SRNF_PUBLIC_METHODS_H
#define SRNF_PUBLIC_METHODS_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/classify.h"
#include "srnf/typicality.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

struct srnf_method {
    const char *name; /* static */
    enum srnf_metric metric;
    bool gauss; /* srnf_classify_gauss; otherwise srnf_classify_nearest */
    /* Seconds, or anything in proportion to them, that the comparison by the metric and the
       classifier are expected to take: what progress is weighed by. */
    double comparison_cost, classifier_cost;
};

struct srnf_methods_inputs {
    size_t n;
    const double *const *surfaces; /* [n] double[3][(L+1)^2] */
    const double *scales;          /* [n] that multiply the surfaces back to their sizes, above 0:
                                      size counts beside shape; NULL: shape only */
    const size_t *labels;          /* [n] below n_classes */
    size_t n_classes;
    size_t n_methods;
    const struct srnf_method *methods; /* [n_methods] */
    struct srnf_folds_options comparison;
    struct srnf_classify_options classifier; /* log_scale is set from scales */
    double alpha;                            /* of srnf_folds_typicality */
};

/*
 * Each metric compares once, in the order of enum srnf_metric, and each of its methods classifies.
 *   results, typicality  [out] [n_methods], to be cleared with srnf_classification_clear and
 *                              srnf_folds_typicality_clear in any case
 *   pairs                [out] [n][n] distances by the first of the metrics: of two members the
 *                              lesser of those in the folds that leave one of them out; NULL: not
 *                              wanted
 *   step                 [out] static: what failed
 * Errors: as srnf_normalize, srnf_folds_compare, srnf_classify_gauss, srnf_classify_nearest and
 * srnf_folds_typicality; SRNF_EINVAL for a scale.
 */
SRNF_CHECKED int srnf_classify_by_methods(const struct srnf_sht *sht,
                                          const struct srnf_methods_inputs *inputs,
                                          const struct srnf_context *context,
                                          struct srnf_classification *results,
                                          struct srnf_folds_typicality *typicality, double *pairs,
                                          const char **step, struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
