/*
 * train.h - a classifier that is kept and asked about other surfaces, and what its answers are
 * worth (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * NESTED VALIDATION. Each subject is left out in turn, and everything is made again without it: the
 * template, the registrations to it, components, their number, the Gaussians, and the calibration
 * of the probabilities, for which the remaining subjects are left out group by group from
 * components and Gaussians of their own. What is told of the one left out has seen nothing of it.
 * The classifier that is kept is made in the same way of all.
 *
 * PROBABILITIES. With s_c the evidence for class c, its log-likelihood or minus the distance to its
 * nearest member, the calibration is
 *
 *     p_c = softmax over c of (a s_c + b_c),    a >= 0,
 *
 * of the largest likelihood under J. Platt's smoothed targets ("Probabilistic outputs for support
 * vector machines", 1999): (N_c + 1) / (N_c + C) for a member's own class, 1 / (N_c + C) for each
 * other, N_c the members of its class and C the number of classes. For two classes it is Platt's
 * sigmoid. Members of a subject weigh as much as one. On average p_c is then t_c, the mean target,
 * so that p_c / t_c, made to sum to 1, is a likelihood, and priors p of the classes enter as
 *
 *     P(c) = p_c (prior_c / t_c) / sum of the same.
 *
 * Without the division what a fold says would depend on how many of the class it left out: under
 * no effect at all it would name the other one (B. Parker, S. Guenter, J. Bedo, "Stratification
 * bias in low signal microarray studies", BMC Bioinformatics 8, 2007).
 *
 * NUMBERS BESIDE SHAPE, such as size and covariates, are further features of the Gaussians, before
 * the components; nearest neighbours have the distances of srnf_classify_nearest, with the
 * spreads of those that are trained on.
 *
 * SEVERAL STRUCTURES of each subject count together as in srnf_folds_join: each part has a template
 * of its own, in every fold, and what is said of distances, means and components is of the stacked
 * fields (srnf_stack), in which the squares of a part have its weight. One part of weight 1 is one
 * structure, to the last bit.
 */
#ifndef SRNF_PUBLIC_TRAIN_H
#define SRNF_PUBLIC_TRAIN_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/classify.h"
#include "srnf/parts.h"
#include "srnf/stats.h"
#include "srnf/typicality.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* ---- Calibration of probabilities ------------------------------------------------------------ */

struct srnf_platt {
    size_t classes;
    double slope;    /* a */
    double *offsets; /* [classes] b, the first 0 */
    double *targets; /* [classes] t, the mean of the targets */
};
void srnf_platt_clear(struct srnf_platt *platt);
/*
 * Fits a calibration. Newton's method on a convex function; where a would be negative it is 0, and
 * the probabilities are the mean targets.
 *   evidence  [in]  [n][classes], finite
 *   labels    [in]  [n] below classes, each class has members
 *   subjects  [in]  [n] as in srnf/subjects.h, or NULL
 *   platt     [out] srnf_platt_clear; untouched on error
 * Errors: SRNF_EINVAL, SRNF_ENUMERIC, SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_platt_fit(size_t n, size_t classes, const double *evidence,
                                const size_t *labels, const size_t *subjects,
                                struct srnf_platt *platt);
/* Probabilities, [classes], of one evidence under priors, [classes], which sum to 1. */
void srnf_platt_apply(const struct srnf_platt *platt, const double *priors, const double *evidence,
                      double *probabilities);
/* The class of the largest probability; where several have it, of the largest evidence of them. */
size_t srnf_platt_choose(size_t classes, const double *probabilities, const double *evidence);

/* ---- What predictions are worth -------------------------------------------------------------- */

#define SRNF_RELIABILITY_BINS 10

/* Members whose probability of a class is in one tenth of [0, 1]. */
struct srnf_reliability {
    size_t members, of_class;
    double mean, observed, interval[2]; /* of the probability; share of the class, Wilson's 95 % */
};

/* Of probabilities: means over members. */
struct srnf_scores {
    double brier;    /* half of sum_c (P(c) - [c is the label])^2: of two classes (P - [..])^2 */
    double log_loss; /* -log P(label); INFINITY is possible */
    double brier_reference, log_loss_reference;     /* of always saying the priors */
    double brier_interval[2], log_loss_interval[2]; /* 95 %; NAN: infinite, a class has 1 subject */
};

struct srnf_assessment {
    size_t n, classes, subjects, correct;
    size_t *predicted; /* [n] */
    size_t *confusion; /* [classes][classes]: row the label, column what was predicted */
    struct srnf_rate accuracy;
    double effective;              /* the members' number as independent ones */
    struct srnf_rate *sensitivity; /* [classes] share of each class that is told */
    struct srnf_rate balanced;     /* their mean */
    struct srnf_rate *auc;         /* [classes] of each against the rest */
    double chance;   /* sum of squared shares of the classes: labels drawn in these proportions */
    double majority; /* share of the largest class */
    struct srnf_scores scores;            /* members weighed by prior over share of their class */
    struct srnf_scores unweighted;        /* each member alike */
    struct srnf_reliability *reliability; /* [classes][SRNF_RELIABILITY_BINS] */
};
void srnf_assessment_clear(struct srnf_assessment *assessment);

/*
 * Compares predictions with labels. Where the priors are not the shares of the labels, `scores`
 * weigh each member by prior over share of its class: they are what would be seen where the priors
 * hold. `unweighted` are what is seen of these members.
 *
 * The balanced accuracy has the interval that follows from those of the sensitivities, as classes
 * have different subjects (G. Zou, A. Donner, "Construction of confidence limits about effect
 * measures", Statistics in Medicine 27, 2008): its lower half has the length
 * sqrt(sum_c (value_c - lower_c)^2) / classes, the upper one likewise. An AUC ranks members by
 * s_c - max of the others' evidence, which no calibration changes within a fold; its interval is
 * srnf_auc_interval with the numbers of subjects. The interval of a score s, which is of the
 * classifiers as they are, not of others like them, is s exp(-+ t e / s): e the standard error of a
 * sum over subjects, scores taken about the mean of their class, and t the .975 quantile of
 * Student's distribution with subjects less classes degrees of freedom. With dispersions the
 * members depend on each other: shares count fewer, and lengths of the others grow by the roots,
 * those of scores by the accuracy's.
 *   labels         [in]  [n] below classes; each class has members
 *   subjects       [in]  [n] as in srnf/subjects.h, or NULL
 *   evidence       [in]  [n][classes]
 *   probabilities  [in]  [n][classes]
 *   priors         [in]  [classes], positive
 *   dispersions    [in]  of these classes, or NULL: members of different subjects are independent
 *   assessment     [out] srnf_assessment_clear; untouched on error
 * Cost n^2 classes. Errors: SRNF_EINVAL, SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_assess(size_t n, size_t classes, const size_t *labels, const size_t *subjects,
                             const double *evidence, const double *probabilities,
                             const double *priors, const struct srnf_dispersions *dispersions,
                             struct srnf_assessment *assessment);
/*
 * The 95 % interval of an area under the curve of `positives` against `negatives`: all A with
 * |auc - A| <= 1.96 sqrt(V(A)),
 *
 *     V(A) = A (1 - A) [1 + h (1 - A) / (2 - A) + h A / (1 + A)] / (positives negatives),
 *     h = (positives + negatives) / 2 - 1
 *
 * (R. Newcombe, "Confidence intervals for an effect size measure based on the Mann-Whitney
 * statistic, part 2", Statistics in Medicine 25, 2006, method 5). It has a length where auc is 1.
 */
void srnf_auc_interval(double auc, double positives, double negatives, double interval[2]);
/*
 * Whether two methods that were asked about the same members are right equally often: McNemar's
 * exact test. With d_s the members of subject s that only the first gets right less those that only
 * the second does, p is the probability of |sum of e_s d_s| at least as large as |sum of d_s| with
 * signs e_s by fair coins, exactly: for one member a subject the two-sided binomial test.
 *   first, second  [in]  [n] whether each is right
 *   only           [out] members that only the first, and only the second, gets right
 * Errors: SRNF_EINVAL, SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_mcnemar(size_t n, const size_t *subjects, const bool *first,
                              const bool *second, size_t only[2], double *p_value);

/* ---- A classifier ---------------------------------------------------------------------------- */

struct srnf_classifier {
    size_t classes;
    bool gauss;          /* otherwise the nearest neighbour */
    size_t components;   /* of the Gaussians; 0: none */
    size_t features;     /* numbers beside shape, which stand before the components */
    bool pooled;         /* one covariance for all classes */
    double *means;       /* [classes][features + components] */
    double *covariances; /* [1 or classes][features + components][features + components] */
    double *factors; /* [features] of their differences in distances; NULL: Gaussians, or none */
    struct srnf_platt platt;
    double *priors; /* [classes] */
};
void srnf_classifier_clear(struct srnf_classifier *classifier);
/* Whether its covariances are positive definite, as asking it takes. SRNF_ENUMERIC: the element of
   the error is the number of the first that is not; SRNF_ENOMEM. */
SRNF_CHECKED int srnf_classifier_check(const struct srnf_classifier *classifier,
                                       struct srnf_error *error);

enum srnf_priors {
    SRNF_PRIORS_COHORT = 0, /* the shares of the classes among the subjects */
    SRNF_PRIORS_EQUAL = 1,
};

struct srnf_train_options {
    size_t relabellings;                       /* as in srnf_classify_options */
    bool gauss;                                /* default true */
    struct srnf_register_options registration; /* as in srnf_folds_options */
    size_t components; /* of the Gaussians, 0 .. 64; default 0: chosen inside each fold, of 20 */
    enum srnf_covariance covariance;
    enum srnf_priors priors;
    const size_t *subjects;  /* [n] as in srnf/subjects.h; default NULL */
    const double *features;  /* [n][n_features] numbers beside shape; default NULL */
    size_t n_features;       /* 0 .. SRNF_FEATURES_MAX, default 0 */
    double feature_weight;   /* of each in distances; 0 .. 1000, default 1: as much as shape */
    size_t n_parts;          /* structures of each member, 1 .. SRNF_PARTS_MAX; default 1 */
    const double *weights;   /* [n_parts] above 0, of their squared distances; default NULL: 1 */
    const double *positions; /* double[n][n_parts][3] as for srnf_folds_join; default NULL */
    double position_weight;  /* above 0, of their squared distances; default 1 */
};
struct srnf_train_options srnf_train_options_defaults(void);

#define SRNF_TRAIN_SUBJECTS_MIN 5 /* of each class */
/* Features, components and other numbers, that the training subjects of any inner fold determine,
   from the subjects of each class. pooled: of one covariance for all classes; open: where a choice
   inside leaves out one more. */
size_t srnf_train_determined(size_t classes, const size_t *counts, bool pooled, bool open);

struct srnf_trained {
    size_t n, n_parts;
    size_t *medoids;     /* [n_parts] the member that all are registered to */
    double *pairs;       /* [n_parts][n][n] distances between members so registered, unweighted */
    double *target;      /* [n_parts][3][(L+1)^2] it, normalized: the template */
    double *mean_q;      /* stacked, of the registered, [3][n_parts n_theta][n_phi], and a row more
                            with positions */
    struct srnf_pca pca; /* of them, all components */
    struct srnf_calibration calibration; /* srnf_calibrate */
    double *distances;                   /* [n] from the mean */
    double *residuals;                   /* [n] beyond the components */
    double *nearest; /* [n] distance from the nearest member of another subject, each left out */
    struct srnf_classifier classifier;
    /* Nested: of each member, without its subject. */
    double *evidence;      /* [n][classes] */
    double *probabilities; /* [n][classes] */
    size_t *components;    /* [n] of the Gaussians of its fold; NULL: none */
    struct srnf_assessment assessment;
    struct srnf_dispersions dispersions; /* that its intervals rest on */
};
void srnf_trained_clear(struct srnf_trained *trained);

/*
 * Makes a classifier of labelled surfaces, with its nested validation.
 *   surfaces  [in]  n_parts n pointers to double[3][(L+1)^2], part after part
 *   labels    [in]  [n] below n_classes, each of SRNF_TRAIN_SUBJECTS_MIN subjects at least
 *   trained   [out] srnf_trained_clear; untouched on error
 * Cost: that of srnf_folds_compare for each part, and ten eigenproblems of size n for each subject.
 * Errors: SRNF_EINVAL (labels, options, subjects too few for the components), SRNF_ENUMERIC,
 * else as srnf_folds_compare.
 */
SRNF_CHECKED int srnf_train(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                            const size_t *labels, size_t n_classes,
                            const struct srnf_train_options *options,
                            const struct srnf_context *context, struct srnf_trained *trained,
                            struct srnf_error *error);

/* A classifier as it is kept, with what its training members are in it. */
struct srnf_frozen {
    const struct srnf_classifier *classifier;
    const struct srnf_pca *pca;
    size_t n_parts;         /* structures of a subject, 1 .. SRNF_PARTS_MAX */
    const double *weights;  /* [n_parts] above 0; NULL: 1 */
    double position_weight; /* 0: without positions */
    const double *target;   /* [n_parts][3][(L+1)^2] */
    const double *mean_q;   /* stacked, as the modes of pca */
    const size_t *labels;   /* [pca->n] */
    size_t subjects;        /* whose members these are */
    const double *numbers;  /* [pca->n][features of the classifier]; NULL where these are 0 */
};

/* What it makes of one surface. */
struct srnf_class_prediction {
    double residual;    /* norm of what the components cannot represent */
    double distance;    /* from the mean */
    double mahalanobis; /* of the components that srnf_mahalanobis_components counts */
    double nearest;     /* distance from the nearest training member */
    /* What each part has in residual and distance, weighted: their squares add up to those. */
    struct srnf_part_prediction {
        double residual, distance;
    } parts[SRNF_PARTS_MAX], position;
};

/*
 * Asks a classifier about n surfaces, or subjects of several structures: each surface is normalized
 * and registered to the template of its part.
 *   surfaces       [in]  n_parts n pointers to double[3][(L+1)^2], part after part
 *   positions      [in]  double[n][n_parts][3], of a classifier with positions; otherwise NULL
 *   features       [in]  [n][features of the classifier] numbers beside shape; NULL: it has none
 *   priors         [in]  [classes]; NULL: those of the classifier
 *   predictions    [out] [n]
 *   evidence       [out] [n][classes]
 *   probabilities  [out] [n][classes]
 * Surfaces run in parallel. Errors: SRNF_EINVAL, SRNF_EDEGENERATE, as srnf_register.
 */
SRNF_CHECKED int srnf_predict(const struct srnf_sht *sht, const struct srnf_frozen *frozen,
                              size_t n, const double *const *surfaces, const double *positions,
                              const double *features,
                              const struct srnf_register_options *registration,
                              const double *priors, const struct srnf_context *context,
                              struct srnf_class_prediction *predictions, double *evidence,
                              double *probabilities, struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
