/*
 * quality.h - what the files of the quality of a model share.
 */
#ifndef SRNF_STATS_QUALITY_H
#define SRNF_STATS_QUALITY_H

#include "stats.h"
#include "subjects.h"

struct quality_run {
    const struct srnf_sht *sht;
    const struct srnf_grid *grid;
    size_t n, points, components;
    const double *mean, *mean_q, *q;
    struct stats_embedding embedding;
    struct subjects subjects;
    double *vectors; /* [n][3][P] the members' surfaces as points */
    double *gram;    /* [n][n] <q_i - mean_q, q_j - mean_q> */
};

/* Distances of one subject or sample after 1 .. components components: [components] each. */
struct quality_distances {
    double *surface, *elastic;
};

/*
 * A surface that follows a q as components are added: each inversion starts from the last.
 * quality_walk_step inverts walk->q and puts the point of the surface into walk->vector.
 */
struct quality_walk {
    const struct quality_run *run;
    double *q, *vector;   /* [3][P] */
    double *from, *found; /* [3][(L+1)^2] */
    void *workspace;
};
SRNF_CHECKED int quality_walk_open(struct quality_walk *walk, const struct quality_run *run);
void quality_walk_close(struct quality_walk *walk);
SRNF_CHECKED int quality_walk_step(struct quality_walk *walk, const struct srnf_context *context,
                                   struct srnf_error *error);
/* Distance from the walk's vector to that of a subject. */
double quality_walk_distance(const struct quality_walk *walk, size_t subject);

/* quality_fold.c: describes member i without its subject. */
SRNF_CHECKED int quality_fold(const struct quality_run *run, size_t i,
                              const struct srnf_context *context, struct quality_distances out,
                              struct srnf_error *error);

#endif
