/*
 * trajectories.h - how surfaces change with time, within subjects (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * Of each subject there are surfaces at two times or more. SRNFs are vectors, so that each subject
 * has a line
 *
 *     q_ij = a_i + b_i (t_ij - r) + error,    r a time of reference,
 *
 * by least squares, and its slope b_i is a field: a change of shape per unit of time. What slopes
 * have in common, and how they depend on covariates of the subjects, is asked of them in a second
 * stage (N. Laird, J. Ware, "Random-effects models for longitudinal data", 1982; G. Verbeke, G.
 * Molenberghs, "Linear mixed models for longitudinal data", 2000, ch. 3).
 */
#ifndef SRNF_PUBLIC_TRAJECTORIES_H
#define SRNF_PUBLIC_TRAJECTORIES_H

#include "srnf/base.h"
#include "srnf/norms.h"
#include "srnf/paired.h"
#include "srnf/regress.h"
#include "srnf/sphere.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* How far apart times of visits may be: the first and the last of a subject at least, any two at
   most. And how many of their spans a prediction may lie before or after them all. */
#define SRNF_TIMES_APART_MIN 1e-30
#define SRNF_TIMES_APART_MAX 1e30
#define SRNF_TIMES_BEYOND_MAX 1e6

struct srnf_visits {
    size_t n;                  /* surfaces, two at least of each subject */
    const double *mean;        /* [3][(L+1)^2] of all of them */
    const double *q;           /* [n][3][n_theta][n_phi], registered to that mean */
    const double *sizes;       /* [n] by which lengths are multiplied, positive; about 1, since
                               predicted surfaces are searched from the mean on */
    const double *times;       /* [n] */
    const size_t *subjects;    /* [n] as in srnf/subjects.h */
    const double *at_times;    /* [points of the design] times of the predictions */
    const double *const *near; /* [n] as surfaces of struct srnf_compare_options; may be NULL */
};

struct srnf_trajectories_options {
    size_t permutations; /* sign flips, and of each test, 1 .. 10,000,000; default 10,000 */
    size_t bootstraps;   /* of subjects, for intervals, 100 .. 100,000; default 1000 */
    uint64_t seed;       /* of both; default 0 */
};
struct srnf_trajectories_options srnf_trajectories_options_defaults(void);

/* Of a subject beside the others: what the model of all others predicts for its slope. */
struct srnf_subject_trajectory {
    size_t visits;
    double first, last; /* times */
    double weight;      /* 1 on average */
    double left;   /* variance of its visits about its line, squared L2 of SRNFs; 0: two visits */
    double turned; /* how far the opposite of its slope is from what the others predict for it, over
                      how far its slope is: small where its visits are in reversed order */
    double speed;  /* its part along that prediction, over the prediction's length */
    struct srnf_norm_rank odd;    /* its distance from that in L2, in standard deviations, among the
                                     same of the others */
    struct srnf_norm_rank faster; /* its speed among those of the others */
};

/* The slope at a point of the predictions, per unit of time along the outward normal. */
struct srnf_predicted_slope {
    double *normal, *standard_error; /* [P] */
    double *confidence; /* [P] half the width of a 95 % region that holds at all nodes together */
};

/* Visits of two subjects that seem to have changed places. */
struct srnf_exchanged_visits {
    size_t members[2];
    /* Root mean squares of the visits of either subject about their line, of two visits about their
       mean, over the median of all subjects', as they are and with the two exchanged. */
    double before[2], after[2];
};

struct srnf_trajectories {
    size_t n, subjects, points;
    double reference; /* time, the mean of the subjects' mean times */
    /* Squared L2 norms of SRNFs: of a visit about the line of its subject, with its degrees of
       freedom, and of slopes about the model, beyond what the former makes of them: by weighted
       squares (R. Paule, J. Mandel, "Consensus values and weighting factors", 1982), so that a
       slope that is known badly hides nothing; 0 only where slopes differ less than that makes
       them. */
    double within, between;
    /* 95 %: core/stats/trajectories_within.c, NAN with fewer than 3 degrees of freedom, of which
       nothing is known then by those of T; where the weighted squares are between their
       quantiles (W. Viechtbauer, "Confidence intervals for the amount of heterogeneity in
       meta-analysis", 2007; core/stats/trajectories_between.c), NAN where slopes are the same. */
    double within_interval[2], between_interval[2];
    size_t freedom; /* 0: two visits of each; within is 0 and all weights are 1 */
    bool weighted;  /* not all weights are 1 */
    /* All slopes together: change is their weighted mean, fluctuating how they differ, individual
       how the surfaces at the time of reference do. of lengths per unit of time, but individual. */
    struct srnf_paired slope;
    /* The second stage, of slopes; its predicted surfaces are those at the times asked for. */
    struct srnf_regression model;
    struct srnf_predicted_slope *slope_at;   /* [points] */
    struct srnf_subject_trajectory *subject; /* [subjects] in the order of first appearance */
    /* Each subject is in one at most: with the two exchanged neither scatters more than usual, and
       both do as they are (core/stats/trajectories_doubts.c). */
    struct srnf_exchanged_visits *exchanged;
    size_t exchanges;
};
void srnf_trajectories_clear(struct srnf_trajectories *trajectories);

/*
 * Lines of subjects, their slopes on a design, and what that predicts (formulae in
 * core/stats/trajectories.c). The mean slope is tested by sign flips, whose level is exact where
 * slopes without a common part are as likely as their opposites; terms as in srnf_regress.
 *   design        [in]  rows of members as for srnf_regress, averaged over the members of each
 *                       subject; columns may be 0
 *   trajectories  [out] freed with srnf_trajectories_clear; untouched on error
 * Equal seeds give equal results, on any number of threads.
 * Cost: n inversions; flips and permutations as in srnf_paired_differences and srnf_regress; one
 * inversion for each prediction. Memory: 24 bytes a node and surface, 250 a node and subject.
 * Errors: SRNF_EINVAL (as srnf_regress; fewer than 5 subjects; a subject with one time only:
 * element is the member that is its first; times that are not finite, or beyond the
 * limits above), SRNF_EDEGENERATE (a mean
 * without area), SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_fit_trajectories(const struct srnf_sht *sht, const struct srnf_visits *visits,
                                       const struct srnf_regress_design *design,
                                       const struct srnf_trajectories_options *options,
                                       const struct srnf_context *context,
                                       struct srnf_trajectories *trajectories,
                                       struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
