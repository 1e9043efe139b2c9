/*
 * paired.h - differences within subjects: two visits, or two sides (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * Of each subject there are two surfaces. What all subjects have in common is the mean of the
 * differences: the change from visit to visit, or directional asymmetry. What is left is how
 * subjects differ in that: of sides, fluctuating asymmetry (A. Palmer, C. Strobeck, "Fluctuating
 * asymmetry: measurement, analysis, patterns", 1986; C. Klingenberg, G. McIntyre, "Geometric
 * morphometrics of developmental instability", 1998).
 */
#ifndef SRNF_PUBLIC_PAIRED_H
#define SRNF_PUBLIC_PAIRED_H

#include "srnf/base.h"
#include "srnf/register.h"
#include "srnf/sphere.h"
#include "srnf/subjects.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

struct srnf_pairs {
    size_t n;                               /* subjects, 5 at least */
    const double *mean;                     /* [3][(L+1)^2] of all surfaces, both of each subject */
    const double *first_q, *second_q;       /* [n][3][n_theta][n_phi], registered to that mean */
    const double *first_size, *second_size; /* [n] by which lengths are multiplied, positive */
    /* [n][3][(L+1)^2] surfaces whose SRNFs the fields are, or nearly are: theirs are searched from
       these on. NULL: from the mean on, which may be too far from surfaces in other poses. */
    const double *const *first, *const *second;
};

struct srnf_paired_options {
    size_t permutations; /* sign flips, 1 .. 10,000,000; default 10,000 */
    size_t bootstraps;   /* of subjects, for intervals, 100 .. 100,000; default 1000 */
    uint64_t seed;       /* of both; default 0 */
    /* How the two surfaces of a subject are registered to each other; NULL: as they lie. */
    const struct srnf_register_options *registration;
};
struct srnf_paired_options srnf_paired_options_defaults(void);

/* An estimate with its 95 % interval, NAN where all subjects are the same. */
struct srnf_estimate {
    double value, interval[2];
};

struct srnf_paired {
    size_t n;
    struct srnf_permutation_test test; /* relabellings: different sign flips */
    double norm;                       /* of the mean difference, in L2 of SRNFs */
    double norm_interval[2]; /* 95 %, as change from no bootstrap (core/stats/intervals.c): NAN
                                where weights leave fewer than 3 degrees of freedom, too */
    double p_value;          /* of that */
    double max_p_value;      /* of the largest local statistic */
    /* Roots of mean squares over the surface, in the unit of the sizes: */
    struct srnf_estimate change;      /* of the mean displacement, from the first to the second */
    struct srnf_estimate fluctuating; /* standard deviation of the displacements about it */
    struct srnf_estimate individual;  /* the same of the subjects' means of both surfaces */
    struct srnf_estimate share; /* of the mean in the squares of all differences in L2, 0 .. 1 */
    /* Of each subject, [n]: */
    double *length;    /* of its displacement */
    double *deviation; /* of that from the mean of the others' */
    double *along;     /* its part along the mean of the others', which decides its sign */
    double *distance;  /* of its two surfaces, in L2 of SRNFs */
    double *normals;   /* [n][P] displacement along the outward normal of the mean surface */
    /* The map, [P], as in struct srnf_comparison and struct srnf_regression: */
    double *statistic, *p, *significance, *fdr; /* Hotelling's T^2 of one sample */
    double *effect, *normal;                    /* length of the mean displacement; its part */
    double *standard_error;                     /* of normal */
    double *confidence; /* half the width of a 95 % region for normal, at all nodes together */
};
void srnf_paired_clear(struct srnf_paired *paired);

/*
 * Differences within subjects, tested by sign flips: where the two surfaces of a subject can be
 * exchanged, the sign of its difference can (formulae in core/stats/paired.c). The level is exact:
 * everything before that treats the two surfaces of a subject alike, if the mean is one of all
 * surfaces.
 *   paired  [out] freed with srnf_paired_clear; untouched on error
 * Equal seeds give equal results, on any number of threads.
 * Cost: 2 n inversions and as many registrations, of which each pair is kept when it is done
 * (srnf_context.keep); 3 permutations n P multiply-adds (dgemm). Memory: 120 bytes a node and
 * subject.
 * Errors: SRNF_EINVAL (a number out of range, data that are not finite, fewer than 5 pairs),
 * SRNF_EDEGENERATE (a mean without area), SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED.
 */
#define SRNF_PAIRS_MIN ((size_t)5)
SRNF_CHECKED int srnf_paired_differences(const struct srnf_sht *sht, const struct srnf_pairs *pairs,
                                         const struct srnf_paired_options *options,
                                         const struct srnf_context *context,
                                         struct srnf_paired *paired, struct srnf_error *error);

/* Measurements of both sides of subjects, some of them repeated. */
struct srnf_measurements {
    size_t n;               /* measurements */
    const double *q;        /* [n][3][n_theta][n_phi], registered to the mean of all */
    const double *sizes;    /* [n] by which lengths are multiplied, positive */
    const size_t *subjects; /* [n] as in srnf/subjects.h: 5 at least, each with both sides */
    const int *side;        /* [n] 0 or 1 */
};

/* Analysis of variance of individuals and sides: mean squares are of squared L2 norms of SRNFs. */
struct srnf_asymmetry_test {
    struct srnf_permutation_test test; /* relabellings: of measurements within subjects */
    double individual, side;           /* mean squares of the two, of subjects - 1 and 1 */
    double interaction, error;         /* and those that are compared */
    /* 95 % (core/stats/paired_measured_squares.c); that of side is that of the difference, which
       struct srnf_paired has */
    double individual_interval[2], interaction_interval[2], error_interval[2];
    size_t freedom[2];      /* of these: subjects - 1, n - 2 subjects */
    struct srnf_estimate f; /* interaction over error */
    double p_value;         /* of that */
    /* Standard deviation in L2 of the difference of a subject's sides that is no error, and that of
       a measurement; and the share of the former in the variance of the difference of one
       measurement of either side. */
    struct srnf_estimate fluctuating, measured, repeatability;
    /* Subjects with a side that is measured repeatedly. Of fewer than SRNF_PAIRS_MIN the intervals
       are NAN, those of f too: how the error differs between subjects is not known. */
    size_t repeated;
};

/*
 * Whether the sides of subjects differ by more than what they are measured wrongly by, once what
 * all subjects have in common is taken out (formulae in core/stats/paired_measured.c).
 *   options  [in]  permutations, bootstraps and seed
 *   found    [out] nothing to free; untouched on error
 * Equal seeds give equal results, on any number of threads.
 * Cost: n^2 multiply-adds for each permutation. Memory: 24 bytes a node and measurement.
 * Errors: SRNF_EINVAL (as srnf_paired_differences; a subject without a side; no side of any subject
 * that is measured twice), SRNF_EDEGENERATE (measurements of a side that are all equal),
 * SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_test_asymmetry(const struct srnf_sht *sht,
                                     const struct srnf_measurements *measurements,
                                     const struct srnf_paired_options *options,
                                     const struct srnf_context *context,
                                     struct srnf_asymmetry_test *found, struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
