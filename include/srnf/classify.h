/*
 * classify.h - distances by several metrics, and classification of labelled surfaces with
 * leave-one-out validation (core/stats; the paper, section 5).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * Classification has two stages. The first, srnf_folds_compare, sees no labels: each surface is put
 * beside all others in a fold of its own, in which all surfaces of its subject (srnf/subjects.h)
 * were left out. The second fits a classifier to the labels of the others and asks it for the one.
 * What is costly is the first; the second can be repeated with permuted labels as often as a
 * p-value asks for.
 */
#ifndef SRNF_PUBLIC_CLASSIFY_H
#define SRNF_PUBLIC_CLASSIFY_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/register.h"
#include "srnf/subjects.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum srnf_metric {
    SRNF_METRIC_SRNF = 0,     /* between SRNFs, registered elastically */
    SRNF_METRIC_SRM = 1,      /* between square-root maps |n|^(1/2) f, registered elastically */
    SRNF_METRIC_HARMONIC = 2, /* between the surfaces as parameterized, after a rotation */
    SRNF_METRIC_ICP = 3,      /* between closest points, after iterated rigid alignment */
    SRNF_METRIC_SPHARM = 4,   /* between points that the first-order ellipsoids make correspond */
};
/* "srnf", "srm", "harmonic", "icp", "spharm"; never NULL. */
const char *srnf_metric_name(enum srnf_metric metric);

/*
 * Symmetric matrix of distances, double[n][n], diagonal 0. Sizes are kept; translations drop out.
 *   srnf, srm  as srnf_distances; srm takes each surface about its area centroid
 *   harmonic   min over O in SO(3) of ||f_i - O f_j||, l = 0 terms left out
 *   icp        srnf_icp between triangulations of the surfaces (SRNF_ICP_FREQUENCY)
 *   spharm     ||f_i - f_j|| after srnf_align_ellipsoid, the least over the four ways in which the
 *              axes of one may point
 *   registration  [in] of srnf and srm; NULL: nothing is turned or registered, whatever the metric
 * Pairs run in parallel. Errors: as srnf_register and srnf_icp; SRNF_EINVAL for a metric unknown.
 */
SRNF_CHECKED int srnf_metric_distances(const struct srnf_sht *sht, enum srnf_metric metric,
                                       size_t n, const double *const *surfaces,
                                       const struct srnf_register_options *registration,
                                       const struct srnf_context *context, double *matrix,
                                       struct srnf_error *error);
#define SRNF_ICP_FREQUENCY 6 /* 720 faces */

/*
 * Turns domain and values so that the ellipsoid of the first degree lies along the axes, the
 * longest along x (C. Brechbuehler, G. Gerig, O. Kuebler, "Parametrization of closed surfaces for
 * 3-D shape description", CVIU 1995): with A the matrix of the degree-1 part, A = U S V', the
 * surface becomes e -> U' f(V e). U and V are rotations; the signs of their columns are arbitrary,
 * and so are the axes where two singular values agree.
 *   aligned  [out] double[3][(L+1)^2]; may be coefficients
 * Errors: SRNF_ENUMERIC, SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_align_ellipsoid(const struct srnf_sht *sht, const double *coefficients,
                                      double *aligned);

/*
 * Copies a surface with its area centroid at the origin and unit area.
 *   log_scale  [out] log of the length that multiplies it back; optional
 * Errors: SRNF_EDEGENERATE (no area), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_normalize(const struct srnf_sht *sht, const double *coefficients,
                                double *normalized, double *log_scale);

/* ---- First stage: comparing subjects, one left out at a time --------------------------------- */

enum srnf_refit {
    SRNF_REFIT_FOLD = 0,   /* each fold registers all to what its training subjects give */
    SRNF_REFIT_SHARED = 1, /* all are registered once, to what all of them give */
};

struct srnf_folds_options {
    struct srnf_register_options registration; /* of srnf and srm; representation is set */
    size_t rounds;          /* of registering: to the template, then to means; 1 .. 20, default 1 */
    enum srnf_refit refit;  /* default SRNF_REFIT_FOLD */
    size_t max_components;  /* that scores are kept of; 1 .. 64, default 20 */
    const size_t *subjects; /* [n] as in srnf/subjects.h; default NULL */
    bool keep; /* what a classifier is frozen from, too: of one round, refitted; default false */
};
struct srnf_folds_options srnf_folds_options_defaults(void);

/*
 * What fold i knows, in which all members of the subject of member i are left out: scores of all
 * members on the principal components of the training members about their mean (srnf and srm only),
 * and the distances of member i from all others. Members of one subject have the same fold, but for
 * these distances.
 */
struct srnf_folds {
    size_t n, components;
    double *scores;    /* [n folds][n members][components]; NULL where the metric has none */
    double *distances; /* [n folds][n]: of member i */
    double *spread;    /* [n folds] rms distance between two training members */
    size_t *subjects;  /* [n] of each member; NULL: each its own */
    /* With options.keep and a metric that registers, NULL otherwise: */
    size_t *templates;  /* [n] the member that the fold of each has as its template */
    double **products;  /* [n] double[n][n], inner products of the fields registered to that member;
                          NULL where it is no template */
    size_t medoid;      /* of all members: a template too */
    double *registered; /* [n][3][n_theta][n_phi] fields registered to it */
};
void srnf_folds_clear(struct srnf_folds *comparison);

/*
 * Compares n surfaces by a metric. Surfaces are normalized first (srnf_normalize).
 *
 * srnf and srm: the template of a fold is the medoid of its training members, to which all are
 * registered from nothing; in each further round the target is the mean of the training
 * members as registered so far, and everybody, those left out too, takes a few Gauss-Newton
 * steps toward it. Means, components and distances come from the last round. Nothing of the subject
 * left out, of none of its members, enters what the fold says of the others, not in the last bit.
 * With SRNF_REFIT_SHARED template and targets are those of all members; mean and components are
 * still the fold's own. Labels enter nowhere.
 *
 * harmonic, icp and spharm fit nothing: each fold reads a row of srnf_metric_distances.
 *
 * Cost: n cold registrations for each template (few: leaving out one subject rarely changes the
 * medoid), and with SRNF_REFIT_FOLD n refinements a subject for each round after the first.
 * Errors: SRNF_EINVAL (fewer than 3 subjects, options), else as srnf_metric_distances.
 */
SRNF_CHECKED int srnf_folds_compare(const struct srnf_sht *sht, enum srnf_metric metric, size_t n,
                                    const double *const *surfaces,
                                    const struct srnf_folds_options *options,
                                    const struct srnf_context *context,
                                    struct srnf_folds *comparison, struct srnf_error *error);

/*
 * Several structures of each subject as one: the comparison of the vectors (sqrt(w_1) q_1, ..,
 * sqrt(w_P) q_P, sqrt(w) x) of members, x the positions of the parts. Each part has its own folds;
 * the fold of a subject has the mean and the components of the joint vectors of the others, from
 * the sum of w_p times the inner products of the parts as they lie in that subject's fold of each.
 * Nothing of the subject left out enters (core/stats/folds_join.c). One part of weight 1 is the
 * part, to the last bit.
 *   n_parts     [in]  1 .. SRNF_PARTS_MAX
 *   parts       [in]  of the same members in the same order, with keep and the same subjects
 *   weights     [in]  [n_parts] above 0, of squared distances
 *   positions   [in]  double[n][n_parts][3] as for srnf_joint_pca_fit, or NULL: without
 *   position_weight [in] above 0, with positions
 *   components  [in]  that scores are kept of; 1 .. 64
 *   joint       [out] srnf_folds_clear; without templates, products and registered
 * Cost n^3 for each subject; folds run in parallel. Errors: SRNF_EINVAL, SRNF_ENUMERIC,
 * SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_folds_join(size_t n_parts, const struct srnf_folds *parts,
                                 const double *weights, const double *positions,
                                 double position_weight, size_t components,
                                 const struct srnf_context *context, struct srnf_folds *joint,
                                 struct srnf_error *error);

/* ---- Second stage: classifiers --------------------------------------------------------------- */

enum srnf_covariance {
    SRNF_COVARIANCE_AUTO = 0,   /* chosen inside each fold */
    SRNF_COVARIANCE_POOLED = 1, /* one for all classes (linear discriminant analysis) */
    SRNF_COVARIANCE_CLASS = 2,  /* each class its own (quadratic) */
};

#define SRNF_FEATURES_MAX ((size_t)64)

struct srnf_classify_options {
    const double *log_scale; /* [n] sizes, as a feature beside shape; NULL: shape only */
    const double *features;  /* [n][n_features] other numbers beside shape, such as covariates */
    size_t n_features;       /* 0 .. SRNF_FEATURES_MAX, default 0 */
    double size_weight;      /* of size, and of each feature, in distances; 0 .. 1000, default 1 */
    size_t components;       /* of the Gaussians; 0: chosen inside each fold */
    enum srnf_covariance covariance;
    size_t permutations; /* of the labels, for the p-value; 0: none */
    uint64_t seed;
    size_t relabellings; /* for the width of intervals, 0 .. 10,000, default 100 */
};
struct srnf_classify_options srnf_classify_options_defaults(void);

struct srnf_rate {
    double value, interval[2]; /* 95 % */
};

/*
 * How much more results of leave-one-out vary than those of as many independent members: the ratio
 * of the variances, 1 at least. Members that are left out of each other are right or wrong
 * together, so that binomial intervals are too narrow (Q. Noirhomme et al., "Biased binomial
 * assessment of cross-validated estimation of classification accuracies illustrated in diagnosis
 * predictions", NeuroImage: Clinical 4, 2014), and more so downwards. Both are seen where labels
 * say nothing: subjects exchange their labels some times, by a seed of its own, and all that
 * depends on labels is made anew. With d the deviations of the results from what answers without
 * regard to labels would get (1/2 of an area under a curve),
 *
 *     above = sum over d > 0 of d^2 / c / V,    below likewise over d < 0,
 *
 * c half of the relabellings, or the number on that side if it is less, and V the variance that
 * independent members would have. An interval counts members 1 / above times towards its lower end,
 * which tells from no effect, and 1 / below times towards its upper end: the design effect of Rao
 * and Scott (srnf/subjects.h). Where labels do say something, members depend on each other less,
 * and intervals are rather too wide.
 */
#define SRNF_RELABELLINGS ((size_t)100) /* the default of how often */
struct srnf_dispersion {
    double below, above;
};
struct srnf_dispersions {
    size_t relabellings; /* 0: all are 1, as none were asked for or labels differ in a subject */
    struct srnf_dispersion accuracy, balanced;
    struct srnf_dispersion *sensitivity, *auc; /* [classes]; freed with the first */
};

struct srnf_classification {
    size_t n, n_classes;
    size_t subjects;    /* whose members the n are */
    size_t *predicted;  /* [n] */
    double *evidence;   /* [n][n_classes] log-likelihoods of srnf_classify_gauss; of
                          srnf_classify_nearest minus the distance from the nearest of the class */
    size_t *components; /* [n] used in each fold; NULL for srnf_classify_nearest */
    bool *pooled;      /* [n] whether the fold's covariance is one for all classes; NULL likewise */
    size_t *confusion; /* [n_classes][n_classes]: row the label, column what was predicted */
    size_t correct;
    double accuracy;
    double interval[2]; /* 95 %, Wilson's with the members' number as independent ones */
    double effective;   /* that number: srnf_cluster_interval, or less by the dispersion */
    struct srnf_rate balanced, *auc;     /* as in srnf_assess; [n_classes] */
    struct srnf_dispersions dispersions; /* how far the members depend on each other */
    double majority; /* share of the largest class: what always naming it gets right */
    double p_value;  /* of as many right by permutation of the labels; NAN: none */
    struct srnf_permutation_test test; /* of p_value */
};
void srnf_classification_clear(struct srnf_classification *classification);

/*
 * Subjects of each class, and how many features of one covariance the training subjects of any fold
 * determine: without the subject that is in most classes, one less for each of those than there are
 * subjects of classes beyond one for each class.
 *   labels      [in]  [n] below n_classes
 *   subjects    [in]  [n] as in srnf/subjects.h, or NULL
 *   counts      [out] [n_classes]
 * Errors: SRNF_EINVAL (a label or a subject), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_class_subjects(size_t n, const size_t *labels, const size_t *subjects,
                                     size_t n_classes, size_t *counts, size_t *determined);

/*
 * Gaussian classifier on the first k components: N(mean of the class, covariance), equal priors;
 * the class of the largest likelihood. A covariance is divided by its degrees of freedom. Size, if
 * given, is one more feature, and so is each of the other numbers; k does not count them, and the
 * likelihoods do not depend on their units.
 *
 * Components and covariance that are left open are those, of all that the fold has subjects enough
 * for, with the largest sum of log posterior probabilities of the training subjects' labels in an
 * inner leave-one-out: the Gaussians are fitted again without each subject in turn (in closed form,
 * by downdates of the rank that it has members), the fold's components stay. The fewest components
 * win ties. Degrees of freedom are those between subjects: n_c - sum m_s^2 / n_c for class c of n_c
 * members, m_s of them of subject s, which makes the variance between subjects unbiased (S. R.
 * Searle, G. Casella, C. E. McCulloch, "Variance components", 1992), and n_c - 1 without repeats.
 *   labels  [in] [n] classes, each below n_classes; every class needs members of 3 subjects
 * The p-value exchanges the labels of whole subjects, all members' together.
 * Cost O(n^2 k^2) for one labelling. Permutations run in parallel.
 * Errors: SRNF_EINVAL (labels, options; no scores; more components than the training subjects of a
 * fold determine; permutations where labels differ within a subject), SRNF_ENUMERIC (a covariance
 * is singular), SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_classify_gauss(const struct srnf_folds *comparison, const size_t *labels,
                                     size_t n_classes, const struct srnf_classify_options *options,
                                     const struct srnf_context *context,
                                     struct srnf_classification *result, struct srnf_error *error);

/*
 * The class of the nearest training member, never one of the same subject. With size, d^2 + (w s
 * (z_i - z_j) / r)^2, z the log scale, s the fold's spread, r the rms difference of z between two
 * training members, w size_weight: at w = 1 size weighs as much as shape. Each other number adds
 * such a term.
 */
SRNF_CHECKED int srnf_classify_nearest(const struct srnf_folds *comparison, const size_t *labels,
                                       size_t n_classes,
                                       const struct srnf_classify_options *options,
                                       const struct srnf_context *context,
                                       struct srnf_classification *result,
                                       struct srnf_error *error);

/* A permutation of 0 .. n - 1, uniform but for 2^-64: the index-th of a seed, on every machine. */
void srnf_permutation(uint64_t seed, uint64_t index, size_t n, size_t *permutation);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
