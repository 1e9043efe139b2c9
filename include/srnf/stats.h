/*
 * stats.h - distances, mean, principal components, samples (core/stats).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_STATS_H
#define SRNF_PUBLIC_STATS_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/landmarks.h"
#include "srnf/register.h"
#include "srnf/pullback.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/*
 * Symmetric matrix of distances between n surfaces, double[n][n], diagonal 0. Pairs run in parallel
 * through the context. options NULL: as parameterized, no registration; otherwise symmetric is set.
 *   surfaces  [in] n pointers to double[3][(L+1)^2]
 * Errors: as srnf_register; the matrix is then undefined.
 */
SRNF_CHECKED int srnf_distances(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                                const struct srnf_register_options *options,
                                const struct srnf_context *context, double *matrix,
                                struct srnf_error *error);

/* Pairs (i, j) with i < j in the order (0,1), (0,2), (1,2), (0,3), ..: pair j (j - 1) / 2 + i. */
void srnf_pair(size_t index, size_t *i, size_t *j);

/* Bytes that registered distances of n surfaces take beside the matrix, at most. */
double srnf_distances_memory(size_t n, size_t degree);

/* What srnf_context.measure is asked for. */
struct srnf_pair_search {
    const struct srnf_sht *sht;
    const struct srnf_register_options *options;
    size_t n;
    const double *const *surfaces; /* [n] */
    size_t count;
    const size_t (*pairs)[2]; /* [count] of surfaces, the first before the second */
    double from, to;          /* of the progress of the computation that they are part of */
    double *distances;        /* [count] */
};

struct srnf_neighbours {
    size_t n, k;
    size_t *indices;   /* [n][k] nearest first; equal distances in the order of the surfaces */
    double *distances; /* [n][k] */
    size_t pairs;      /* n (n - 1) / 2 */
    size_t registered; /* of them; the others are known to be farther than the k-th of both */
};
void srnf_neighbours_clear(struct srnf_neighbours *neighbours);
/*
 * The k nearest neighbours of each surface, by the registered distances that srnf_distances has of
 * all pairs, of which only those are registered that a lower bound does not rule out
 * (core/stats/neighbours.c). The bound holds whatever the registration finds, up to the quadrature
 * of warped fields, for which 0.2 % of the norms are taken off it.
 *   surfaces   [in]  n pointers to double[3][(L+1)^2]
 *   k          [in]  1 .. n - 1
 *   options    [in]  of the registration, which is made symmetric; its representation is the SRNF
 *   neighbours [out] srnf_neighbours_clear
 * Errors: SRNF_EINVAL, else as srnf_register.
 */
SRNF_CHECKED int srnf_nearest_neighbours(const struct srnf_sht *sht, size_t n,
                                         const double *const *surfaces, size_t k,
                                         const struct srnf_register_options *options,
                                         const struct srnf_context *context,
                                         struct srnf_neighbours *neighbours,
                                         struct srnf_error *error);

/* Room outside of memory, such as a file. Both calls come from any thread, at the same time never
   for bytes that overlap; what is read was written before, by this call or by the earlier one that
   left `used`. They return 0, or a negative status, which then is that of the whole: SRNF_EIO. */
struct srnf_scratch {
    void *user;
    int (*write)(void *user, uint64_t offset, const void *bytes, size_t size);
    int (*read)(void *user, uint64_t offset, void *bytes, size_t size);
    uint64_t used; /* bytes that an earlier call has left, for what resumes it; 0: none */
};

struct srnf_mean_options {
    const struct srnf_register_options *registration; /* NULL: as parameterized */
    /* Points that guide the warps to the mean, or that tell how well these correspond, or NULL.
       Guided, warps must be sought (registration, reparameterization, and not exact). */
    const struct srnf_group_landmarks *landmarks;
    const size_t *subjects; /* [n] as in srnf/subjects.h: those of one are laid alike; or NULL */
    double tolerance;       /* relative change of the mean q, or twice in a row of the objective, at
                              which the mean is found; default 1e-3 */
    size_t max_iterations;  /* default 20 */
    /* Bytes of what evaluating and moving subjects takes that may be kept from one iteration to the
       next; beyond it is made anew each time, which takes longer and gives the same bits. Default
       256 MiB. */
    size_t keep_bytes;
    /* Where the warps of a large group go, all but held_bytes of them (default 128 MiB): the same
       bits as in memory. A checkpoint then refers to it, and is resumed with the scratch as it was
       left and what came after in it. NULL: all are in memory. */
    const struct srnf_scratch *scratch;
    size_t held_bytes;
    /* Called after each iteration with all that is needed to go on from there: a caller that keeps
       the bytes can hand them back as `resume`. Optional. */
    void (*checkpoint)(void *user, const void *bytes, size_t size);
    void *checkpoint_user;
    const void *resume; /* of the same surfaces and options, or NULL */
    size_t resume_size;
};
struct srnf_mean_options srnf_mean_options_defaults(void);
struct srnf_mean_iteration {
    double change;    /* ||mu_k - mu_k-1|| / ||mu_k||, as parameterized from the centre */
    double variance;  /* mean squared distance to the mean q */
    double objective; /* variance / mean of ||q_i||^2 + mean penalty: never rises where domains are
                         warped, unless surfaces of one subject are laid alike; rotations alone are
                         sought from nothing each time */
    double seconds;
};
struct srnf_mean {
    size_t n;
    double *coefficients;   /* [3][(L+1)^2] the mean surface: mean_q inverted once */
    double *mean_q;         /* [3][n_theta][n_phi] */
    double *registered_q;   /* [n][3][n_theta][n_phi] the subjects, registered to the mean */
    double *distances;      /* [n] to the mean */
    double relative_energy; /* of the inversion of mean_q: what is lost by being a surface */
    size_t iterations;
    bool converged;
    struct srnf_mean_iteration *history; /* [iterations] */
    size_t n_landmarks;                  /* of the options */
    double *landmarks;                   /* [n_landmarks][3] on the sphere of the mean */
    double *landmark_points; /* [n][n_landmarks][3] where the warps take those, on the sphere of
                                each surface */
    bool *apart; /* [n] whether the surfaces of its subject do not lie alike; NULL where that was
                    not asked */
};
void srnf_mean_clear(struct srnf_mean *mean);

/*
 * Karcher mean (the paper, Algorithm 2): register all to the mean SRNF, average, keep the
 * parameterization centred, repeat; one inversion at the end. Starts from the medoid of the
 * unregistered distances, in groups above 500 that of some 500 of them at equal steps, or from the
 * plain mean in a common pose. After the first iteration and, where that moved any, at rest, unless
 * in a common pose or guided by landmarks, all are sought once more from nothing, and those that
 * lie better another way round are turned (core/stats/mean_anew.c): the mean of nearly symmetric
 * surfaces would depend on their poses. After that surfaces of one subject that lie otherwise on
 * the mean than on each other are laid alike (core/stats/mean_visits.c), and all warps go on from
 * there. Subjects run in parallel.
 * Fields of warps are sought on a grid that their degree cannot overfit, however coarse that of sht
 * is. The registration's representation is the SRNF.
 * Landmarks are those of the mean and of each surface: the mean's lie where the squared angles to
 * those of the surfaces are least (core/stats/mean_landmarks.c).
 * Errors: SRNF_EINVAL, SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED, SRNF_EIO (scratch);
 * SRNF_EUNMATCHED: landmarks of a surface, the element, that no warp meets as they are to be met.
 * SRNF_WNOT_CONVERGED: the mean as it is after max_iterations.
 */
SRNF_CHECKED int srnf_karcher_mean(const struct srnf_sht *sht, size_t n,
                                   const double *const *surfaces,
                                   const struct srnf_mean_options *options,
                                   const struct srnf_context *context, struct srnf_mean *mean,
                                   struct srnf_error *error);

/*
 * The mean in the pulled-back metric takes the place of that of SRNFs: its surface, the distances
 * to it, what it loses of mean_q, and converged, if both were. mean_q and registered_q stay.
 *   coefficients  [in/out] double[n][3][(L+1)^2] the surfaces of the mean; registered to its
 *                 surface where registration is not NULL
 *   mean          [in/out] of srnf_karcher_mean
 *   pullback      [out] as of srnf_pullback_mean; cleared with srnf_pullback_mean_clear
 * Errors: SRNF_EINVAL (n is not that of the mean), else as srnf_register and srnf_pullback_mean;
 * mean and coefficients are then undefined, to be cleared as ever. SRNF_WNOT_CONVERGED: as
 * srnf_pullback_mean.
 */
SRNF_CHECKED int srnf_mean_pull_back(const struct srnf_sht *sht, size_t n, double *coefficients,
                                     const struct srnf_register_options *registration,
                                     const struct srnf_pullback_mean_options *options,
                                     const struct srnf_context *context, struct srnf_mean *mean,
                                     struct srnf_pullback_mean *pullback, struct srnf_error *error);

/* Principal components of registered SRNFs about their mean, with quadrature weights: eigenvectors
   of the n x n Gram matrix. Signs are fixed: the largest entry of each score column is positive. */
struct srnf_pca {
    size_t n, components;
    double *eigenvalues; /* [components] variances (divided by n - 1), decreasing, above rounding */
    double *explained;   /* [components] shares of the total variance; */
    double total_variance;
    double *modes;  /* [components][3][n_theta][n_phi], orthonormal */
    double *scores; /* [n][components] */
};
void srnf_pca_clear(struct srnf_pca *pca);
/*
 * 95 % intervals of eigenvalue k and of its share of the total variance, of the covariance that
 * members are drawn from (core/stats/pca_intervals.c): in small groups the first eigenvalues are
 * too large and lie near the upper ends. NAN of fewer than 10 members, and of what does not stand
 * out from what is below. Members are independent: not several of a subject. How far modes are off
 * and what registration adds is not in them. Modes and explained are not read. Missed, by
 * test_pca_intervals_200.c: normal scores, in 35 settings, in at most 10 % of groups, mostly below
 * 5; with the tails of Student's distribution with 8 degrees in up to 12.
 */
void srnf_pca_interval(const struct srnf_pca *pca, size_t k, double eigenvalue[2],
                       double explained[2]);
/* The same of the total variance; NAN of fewer than 4 members. distances: [n] from the mean. */
void srnf_pca_total_interval(const struct srnf_pca *pca, const double *distances,
                             double interval[2]);
/* Sum of the variances of its components; *complete is whether they are all there was: no more than
   1e-9 of total_variance is missing, which rounding can be. */
double srnf_pca_kept_variance(const struct srnf_pca *pca, double total_variance, bool *complete);
/* max_components 0: all above rounding. registered_q: [n][3][n_theta][n_phi]. */
SRNF_CHECKED int srnf_pca_fit(const struct srnf_grid *grid, size_t n, const double *mean_q,
                              const double *registered_q, size_t max_components,
                              struct srnf_pca *pca);
/* The same, which can be canceled. Errors: SRNF_ECANCELED too. */
SRNF_CHECKED int srnf_pca_fit_within(const struct srnf_grid *grid, size_t n, const double *mean_q,
                                     const double *registered_q, size_t max_components,
                                     const struct srnf_context *context, struct srnf_pca *pca);
/*
 * The largest components of a group too large for its n x n Gram matrix, by randomized subspace
 * iteration (core/stats/pca_largest.c): the same bits each time, on any number of threads.
 *   components  [in]  how many, 1 .. the lesser of n and the 3 n_theta n_phi numbers of a field;
 *                     fewer come out where those beyond are rounding
 *   bounds      [out] [components] of each eigenvalue: the covariance has an eigenvalue so near,
 *                     norm of its residual; 0 beyond those that come out
 * Cost: some 5 to 40 rounds of 4 n 3 n_theta n_phi (3/2 components) operations. Memory beside the
 * result: 1.5 components (n + 6 n_theta n_phi) numbers.
 * Errors: SRNF_EINVAL (n or components out of range, data that are not finite), SRNF_ENOMEM,
 * SRNF_ENUMERIC, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_pca_fit_largest(const struct srnf_grid *grid, size_t n, const double *mean_q,
                                      const double *registered_q, size_t components,
                                      const struct srnf_context *context, struct srnf_pca *pca,
                                      double *bounds);
/* Scores of another q in the frozen model, and the norm of what the modes cannot represent. */
void srnf_pca_project(const struct srnf_grid *grid, const struct srnf_pca *pca,
                      const double *mean_q, const double *q, double *scores, double *residual);
/* Those norms of n of them. registered_q: double[n][3][n_theta][n_phi]; residuals: double[n].
   Errors: SRNF_ENOMEM. */
SRNF_CHECKED int srnf_pca_residuals(const struct srnf_grid *grid, const struct srnf_pca *pca,
                                    const double *mean_q, size_t n, const double *registered_q,
                                    double *residuals);
/* q = mean_q + sum_k scores[k] mode_k */
void srnf_pca_reconstruct(const struct srnf_grid *grid, const struct srnf_pca *pca,
                          const double *mean_q, const double *scores, double *q);
/* Standard normal scores times sqrt(eigenvalue) from a seed: a counter-based generator, the same
   numbers on every machine. scores: [count][components]. */
void srnf_pca_sample(const struct srnf_pca *pca, uint64_t seed, size_t count, size_t components,
                     double *scores);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
