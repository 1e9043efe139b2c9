/*
 * train.h - what the files of the process train share: its typed inputs and what a run has come to.
 */
#ifndef SRNFD_PROCESSES_TRAIN_H
#define SRNFD_PROCESSES_TRAIN_H

#include "processes/classify.h"
#include "store/model.h"

struct train {
    struct group_input group;
    int method, covariance, priors;
    int scale;
    double size_weight;
    json_t *covariates; /* names, owned */
    long components, lmax;
    bool common_pose;
};
extern const char *const train_methods[]; /* NULL at the end; the first by Gaussians */

struct train_answer {
    struct compute_group group;
    struct classify_classes classes;
    struct srnf_train_options options;
    struct srnf_trained trained;
    double *numbers; /* [n][of options] beside shape */
    size_t n_theta, n_phi;
    double mean_energy; /* relative, of the inversion of the mean */
};

/* train_model.c: stores template, mean and model; the record of the model, or NULL with the problem
   set. */
json_t *train_keep(struct jobs_run *run, const struct train *train, struct train_answer *answer,
                   struct jobs_result *result);

#endif
