/*
 * paired.h - what the files of differences within subjects share.
 */
#ifndef SRNF_STATS_PAIRED_H
#define SRNF_STATS_PAIRED_H

#include "maps.h"
#include "stats.h"
#include "subjects.h"
#include "srnf/paired.h"

struct paired_run {
    const struct srnf_sht *sht;
    const struct srnf_pairs *pairs; /* of paired_align.c alone */
    const double *mean;             /* [3][(L+1)^2] */
    const double *weights;          /* [n] of the subjects, 1 on average; NULL: all 1 */
    const struct srnf_paired_options *options;
    const struct srnf_context *context;
    size_t n, points, permutations;
    struct stats_embedding embedding;
    double *parts;   /* [n][3][3][P]: difference of SRNFs; of displacements times the roots of the
                        areas; mean of both surfaces, as those */
    double *normal;  /* [3][P] of the mean surface */
    double *vectors; /* [n][3][P] the displacements again, one after another, times the weights */
    double *along; /* [n][P] of them along the normal, less their mean over subjects, times those */
    double *gram[3]; /* [n][n] of the three parts, without weights */
    struct srnf_paired *out;
};

/* paired.c: memory of all but the parts, and of the result; and the unit normals of the mean.
   paired_close in any case. */
SRNF_CHECKED int paired_open(struct paired_run *run);
void paired_close(struct paired_run *run);
SRNF_CHECKED int paired_normal(struct paired_run *run);

/* paired_align.c: fills parts. */
SRNF_CHECKED int paired_align(struct paired_run *run, struct stats_progress progress,
                              struct srnf_error *error);
/* paired_flip.c: all that sign flips tell. */
SRNF_CHECKED int paired_flip(struct paired_run *run, struct stats_progress progress,
                             struct srnf_error *error);
/* paired_bootstrap.c: intervals. */
SRNF_CHECKED int paired_bootstrap(struct paired_run *run, struct srnf_error *error);
/* The interval of an estimate from n drawn ones, which are sorted, of log-normal kind. value and
   drawn are squares where `root`, of which the roots are told. */
void paired_estimate(struct srnf_estimate *to, double value, bool root, size_t n, double *drawn);

#endif
