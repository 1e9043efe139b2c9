/*
 * trajectories.h - what the files of trajectories share.
 */
#ifndef SRNF_STATS_TRAJECTORIES_H
#define SRNF_STATS_TRAJECTORIES_H

#include "paired.h"
#include "regress.h"
#include "srnf/trajectories.h"

struct trajectory_run {
    const struct srnf_sht *sht;
    const struct srnf_visits *visits;
    const struct srnf_regress_design *design;
    const struct srnf_trajectories_options *options;
    const struct srnf_context *context;
    struct subjects subjects;
    size_t n, points; /* subjects, nodes */
    /* Of each subject, [n][3][P]: slope and place at the time of reference, of SRNFs and of
       displacements times the roots of the areas. */
    double *slope_q, *slope_v, *level_q, *level_v;
    double origin;              /* the first of all times: others are computed with from it on */
    const double *normals;      /* [n][P] slopes along the normal, once the mean slope is known */
    double *spread;             /* [n] sum of squares of the times about their mean */
    double *left;               /* [n] sum of squares of SRNFs about the line */
    double *weights, *roots;    /* [n], 1 on average; and their roots */
    double *values;             /* [n][columns] of the design, of subjects */
    double *scaled;             /* [n][columns] times the roots */
    struct srnf_nested *nested; /* [tests], times the roots */
    double **nested_values;     /* [tests] their memory */
    bool weighted;              /* not all weights are 1 */
    struct srnf_trajectories *out;
};

/* Times from the origin on: exact differences keep what times far from 0 have in common out of all
   sums. So is the reference, until the run is done. */
static inline double trajectory_time(const struct trajectory_run *run, size_t member)
{
    return run->visits->times[member] - run->origin;
}

/* trajectories_lines.c: slopes and levels of all subjects, with spread and left. */
SRNF_CHECKED int trajectory_lines(struct trajectory_run *run, const struct srnf_context *context,
                                  struct srnf_error *error);
/* trajectories_weights.c: variances, weights and the weighted design. */
SRNF_CHECKED int trajectory_weigh(struct trajectory_run *run, struct srnf_error *error);
/* trajectories_within.c: how far visits lie off their lines, `within`; with its interval, NAN with
   fewer than 3 degrees of freedom. */
SRNF_CHECKED int trajectory_within(struct trajectory_run *run, struct srnf_error *error);
/* trajectories_between.c: how much slopes differ, from `within`; with its interval. */
SRNF_CHECKED int trajectory_between(struct trajectory_run *run, struct srnf_error *error);
/* trajectories_model.c: the mean slope, the model of slopes, and predicted surfaces. */
SRNF_CHECKED int trajectory_mean(struct trajectory_run *run, const struct srnf_context *context,
                                 struct srnf_error *error);
SRNF_CHECKED int trajectory_model(struct trajectory_run *run, const struct srnf_context *context,
                                  struct srnf_error *error);
SRNF_CHECKED int trajectory_predict(struct trajectory_run *run, const struct srnf_context *context,
                                    struct srnf_error *error);
/* trajectories_subjects.c: subjects beside the others. gram: [2][n][n] of slopes, as SRNFs and as
   displacements. */
SRNF_CHECKED int trajectory_subjects(struct trajectory_run *run, const double *const gram[2],
                                     struct srnf_error *error);
/* trajectories_doubts.c: left of each subject, and the exchanged visits. */
SRNF_CHECKED int trajectory_doubts(struct trajectory_run *run, struct srnf_error *error);

#endif
