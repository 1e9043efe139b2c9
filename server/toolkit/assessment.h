/*
 * assessment.h - in result documents and records of classifiers: what predictions are worth.
 */
#ifndef SRNFD_TOOLKIT_ASSESSMENT_H
#define SRNFD_TOOLKIT_ASSESSMENT_H

#include "toolkit/process.h"

/* What assessment_json has, for the tables of outputs. */
#define ASSESSMENT_TEXT                                                                            \
    "members; subjects; correct; accuracy {value, interval}, with effectiveCount (intervals are "  \
    "of 95 %; of shares Wilson's, by the members' number as independent ones, and where members "  \
    "are left out of each other wider, by how far results without any effect vary more than "      \
    "those of independent members); balancedAccuracy, the "                                        \
    "mean share of each class that is told, and sensitivity of each class; auc of each class "     \
    "against the rest, of evidence (logLikelihoods, or how much nearer it is), not of calibrated " \
    "probabilities (Newcombe 2006, method 5, with numbers of subjects); chance, the sum of "       \
    "squared shares of the labels, which labels drawn in these proportions get right, and "        \
    "majorityRate, which always naming the largest class does; brier, half the sum over classes "  \
    "of (probability - [it is the label])^2, and logLoss, with those of "                          \
    "always saying the priors (brierReference, logLossReference) and their brierInterval and "     \
    "logLossInterval, both null where a class has members of one subject, which does not say "     \
    "how they vary, and a logLoss and its interval null where the label "                          \
    "of a member had the probability 0: members of a class weigh its prior together, as where "    \
    "the priors hold, and in unweighted, which has the same six, each member weighs alike; "       \
    "confusion (rows: labels, columns: predictions, in the "                                       \
    "order of classes); calibration, for each class ten bins [{from, to, members, "                \
    "meanProbability, observed, interval}] of its probability, numbers null where a bin is empty"

/* classes: [assessment->classes] names. New reference. */
json_t *assessment_json(const struct srnf_assessment *assessment, const char *const *classes);
/* {value, interval}, and {name: {value, interval}} of each class. */
json_t *assessment_rate(const struct srnf_rate *rate);
json_t *assessment_rates(const struct srnf_rate *rates, size_t n, const char *const *classes);
/* Warns (names-one-class, not-above-chance) of a classifier that names one class alone, or whose
   balanced accuracy may be that of chance.
     method     [in] its name, or NULL where there is one
     confusion  [in] [n][n], rows the labels
     classes    [in] [n] */
void assessment_warn(json_t *warnings, const char *method, size_t n, const size_t *confusion,
                     const struct srnf_rate *balanced, const char *const *classes);
/* {name: number} of each class. */
json_t *assessment_by_class(const double *values, size_t n, const char *const *classes);

#endif
