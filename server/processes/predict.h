/*
 * predict.h - what the files of the process predict share: a classifier as it was kept, and what it
 * makes of a group of surfaces.
 */
#ifndef SRNFD_PROCESSES_PREDICT_H
#define SRNFD_PROCESSES_PREDICT_H

#include "compute/model.h"
#include "toolkit/group.h"

/* A classifier from its record and arrays (predict_model.c). */
struct kept {
    struct compute_model model;
    struct compute_surface template;
    json_t *record, *made; /* of the model; madeFrom of it */
    const char *method;    /* in record, as the next */
    const char **names;    /* [classes] */
    size_t classes;
    size_t *labels;  /* [members] */
    double *weights; /* [members] 1 / members of its subject */
    double *nearest; /* [members] leave-one-out */
    size_t subjects; /* whose members these are */
    struct srnf_register_options registration;
    struct srnf_classifier classifier;
};
/* 0, or a negative status with the problem set; kept_clear in any case. */
int kept_load(struct jobs_run *run, const char *id, struct kept *kept, struct jobs_result *result);
void kept_clear(struct kept *kept);
/* The class of a name, or kept->classes. */
size_t kept_class(const struct kept *kept, const char *name);

/* What is asked and answered. */
#define PREDICT_TRAITS 4
struct predict_answer {
    struct compute_group group;
    double *priors;                            /* [classes] */
    struct srnf_class_prediction *predictions; /* [n] */
    double *evidence, *probabilities;          /* [n][classes] */
    size_t *predicted;                         /* [n] */
    bool *trained;                             /* [n] the surface is one that it was trained on */
    struct srnf_typicality *traits;            /* [n][PREDICT_TRAITS] */
    double *nearest, *mirrored; /* [n] distances from the nearest training member, and those of the
                                   mirror images; the same where these were not tried */
};
extern const enum srnf_trait predict_traits[PREDICT_TRAITS];

/* predict_result.c: the result document; NULL with the problem set. */
json_t *predict_document(struct jobs_run *run, const struct group_input *group,
                         const struct kept *kept, const struct predict_answer *answer,
                         struct jobs_result *result);

#endif
