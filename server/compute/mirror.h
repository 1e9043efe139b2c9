/*
 * mirror.h - would the mirror image of a surface match better? Trials that a process makes
 * beside its answer, to warn of left and right ones that are compared as they are.
 */
#ifndef SRNFD_COMPUTE_MIRROR_H
#define SRNFD_COMPUTE_MIRROR_H

#include "compute/group.h"

/* The mirrored match is clearly better below this part of the distance as it is. */
#define COMPUTE_MIRROR_CLEARLY 0.9
/* The same where nothing but the distance speaks for two sides. Mirrored, 13 pairs of ventricles
   and of asteroids, which have no side, are 1.01 to 1.50 times as far apart (bench_mirror). */
#define COMPUTE_MIRROR_UNTOLD 0.8
/* Pairs of one group that are tried at most. */
#define COMPUTE_MIRROR_TRIALS_MAX 12

struct compute_mirror_trial {
    size_t first, second; /* members of the group; 0 and 1 of a pair */
    double distance;      /* as they are */
    double mirrored;      /* with one of them mirrored */
};

/* How a group of surfaces stands to sides. */
struct compute_handedness {
    struct compute_mirrored mirrored; /* members that are taken mirrored */
    /* Whether members i and j are the left and the right one of the same; NULL: nothing is tried */
    bool (*opposite)(const void *user, size_t i, size_t j);
    const void *user;
    size_t n_trials; /* [out] */
    bool registered; /* [out] whether distances are of registered surfaces */
    bool unnamed;    /* [out] the one trial is of two surfaces that nothing calls opposite */
    struct compute_mirror_trial trials[COMPUTE_MIRROR_TRIALS_MAX];
};

/*
 * Tries pairs of opposite members, each member with the nearest of those that are opposite to it,
 * the nearest pairs first, COMPUTE_MIRROR_TRIALS_MAX at most: so many more distances at most, of
 * the n (n - 1) / 2 that the matrix took. Two registered surfaces that are not opposite are tried
 * as compute_mirror_pair does, by the metric of SRNFs.
 *   matrix        [in] double[n][n] of the group by metric and registration
 *   registration  [in] as for srnf_metric_distances
 * Returns a core status.
 */
int compute_mirror_group(struct jobs_run *run, const struct srnf_sht *sht, enum srnf_metric metric,
                         const struct compute_group *group,
                         const struct srnf_register_options *registration, const double *matrix,
                         struct compute_handedness *handedness, struct srnf_error *error);

/*
 * Registers the mirror image of moving to the fixed surface; unless the two are opposite, only
 * where rigid registration at a low degree says that it may be clearly better, which costs little.
 *   opposite  [in]  whether the two are the left and the right one of the same
 *   distance  [in]  of moving, registered with the same options
 *   trial     [out] mirrored is the distance of the mirror image, or distance itself where that was
 *                   not registered
 * Returns a core status.
 */
int compute_mirror_pair(struct jobs_run *run, const struct srnf_sht *sht, const double *fixed,
                        const double *moving, const struct srnf_register_options *registration,
                        bool opposite, double distance, struct compute_mirror_trial *trial,
                        struct srnf_error *error);

/*
 * Values at the nodes of the image of a surface (srnf_surface_mirror) from those of the surface, in
 * place: on rows whose columns lie at phi = 2 pi j / columns, pi - phi is column columns / 2 - j.
 *   columns  [in] even
 *   values   [in/out] double[rows][columns]
 */
void compute_mirror_columns(size_t rows, size_t columns, double *values);

/* Whether the trial speaks for mirroring one of the two, which are opposite or not known to be. */
bool compute_mirror_better(const struct compute_mirror_trial *trial, bool opposite);

#endif
