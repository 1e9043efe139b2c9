/*
 * classify.h - what the classifiers share: a study, its outcome under one labelling, and the
 * assessment that is the same for all of them.
 */
#ifndef SRNF_STATS_CLASSIFY_H
#define SRNF_STATS_CLASSIFY_H

#include "stats.h"
#include "subjects.h"

#include "srnf/train.h"

/* What the n folds of one labelling came to. Arrays that are NULL are not asked for. */
struct outcome {
    size_t *predicted;  /* [n]; never NULL */
    double *evidence;   /* [n][n_classes] */
    size_t *components; /* [n] */
    bool *pooled;       /* [n] */
};

/* The lead of class c, that members are ranked by, over all others: [n]. */
void assess_leads(size_t n, size_t classes, const double *evidence, size_t c, double *lead);
/* The area under the curve of class c; lead: [n]. */
double assess_auc(size_t n, const size_t *labels, size_t c, const double *lead);
/* Newcombe's variance of an area (srnf_auc_interval). */
double assess_auc_variance(double a, double positives, double negatives);
/* What answers are worth, without probabilities: all of an assessment but scores and reliability
   (assess.c); to be cleared in any case. */
SRNF_CHECKED int assess_answers(size_t n, size_t classes, const size_t *labels,
                                const size_t *subjects, const double *evidence,
                                const size_t *predicted, const struct srnf_dispersions *dispersions,
                                struct srnf_assessment *assessment);

struct study;
/* Predicts the class of every subject from the labels of the others. Re-entrant. */
typedef int study_predict(const struct study *study, const size_t *labels,
                          const struct outcome *outcome, struct srnf_error *error);

struct study {
    const struct srnf_folds *comparison;
    const struct srnf_classify_options *options;
    struct subjects subjects;
    size_t n_classes;
    size_t smallest;    /* subjects of the class that has fewest */
    size_t determined;  /* features of a pooled covariance in any fold */
    const double *rows; /* nearest: [n folds][n] distances, size included */
    study_predict *predict;
};

/* Fills the study but for rows and predict; checks labels and options, and that each class has
   members of three subjects. To be closed in any case. */
SRNF_CHECKED int study_open(struct study *study, const struct srnf_folds *comparison,
                            const size_t *labels, size_t n_classes,
                            const struct srnf_classify_options *options, struct srnf_error *error);
void study_close(struct study *study);
/* How far the members depend on each other, by relabellings of the subjects (relabel.c); to be
   cleared in any case. */
SRNF_CHECKED int study_disperse(const struct study *study, const size_t *labels,
                                const struct srnf_context *context, struct srnf_dispersions *out,
                                struct srnf_error *error);
void dispersions_clear(struct srnf_dispersions *dispersions);
/* What part of the progress the relabellings have, beside the permutations that follow. */
double study_relabelling_part(const struct study *study);
/* Predicts, counts, and predicts again for each permutation of the labels. gaussian: components
   and covariance are kept. */
SRNF_CHECKED int study_assess(const struct study *study, const size_t *labels, bool gaussian,
                              const struct srnf_context *context,
                              struct srnf_classification *result, struct srnf_error *error);

#endif
