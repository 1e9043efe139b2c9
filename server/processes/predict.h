/*
 * predict.h - what the files of the process predict share: a classifier as it was kept, and what it
 * makes of a group of surfaces.
 */
#ifndef SRNFD_PROCESSES_PREDICT_H
#define SRNFD_PROCESSES_PREDICT_H

#include "compute/model.h"
#include "store/model.h"
#include "toolkit/group.h"

/* A classifier from its record and arrays (predict_model.c). */
struct kept {
    struct compute_model model;
    const json_t *parts;   /* in record: {name, ..}; NULL of one structure */
    double *target;        /* [parts][3][(L+1)^2] of the templates */
    json_t *record, *made; /* of the model; madeFrom of it */
    const char *method;    /* in record, as the next */
    const char **names;    /* [classes] */
    size_t classes;
    size_t *labels;  /* [members] */
    double *weights; /* [members] 1 / members of its subject */
    double *nearest; /* [members] leave-one-out */
    /* Numbers beside shape: their names in record, the sizes first that count, and [members][of
       these]. */
    const json_t *feature_names;
    size_t sizes; /* of each structure, or 0 */
    double *numbers;
    size_t subjects; /* whose members these are */
    struct srnf_register_options registration;
    struct srnf_classifier classifier;
};
/* 0, or a negative status with the problem set; kept_clear in any case. */
int kept_load(struct jobs_run *run, const char *id, struct kept *kept, struct jobs_result *result);
void kept_clear(struct kept *kept);
/* Whether a model that is a classifier has all that predict needs of it; true of others. why: what
   is wrong with the numbers of one that has; otherwise untouched. */
bool predict_model_fits(const struct store_model *model, char why[API_WHY_MAX]);
/* "Surface", or "Subject" of several structures. */
const char *predict_what(const struct kept *kept);
/* The class of a name, or kept->classes. */
size_t kept_class(const struct kept *kept, const char *name);

/* What is asked and answered. */
struct predict {
    struct group_input group; /* of several structures part after part, each of the same subjects */
    char model[STORE_ID_MAX];
    json_t *priors, *covariates; /* of the surfaces: an array of objects, or null; owned */
    int handedness;              /* enum handedness */
};

/* predict_parts.c: the input parts, an object or a list of objects {name: surface}; surfaces and
   cohort, which may be of several structures; and for complete, whether they are what the model is
   of: the canonical surfaces are then part after part. by is set. */
extern const struct input_own predict_surfaces, predict_cohort, predict_parts, predict_by;
bool predict_check_parts(struct process_inputs *given, const struct store_model *model);
/* The subjects of the group by their members of the first part, in a view: surfaces and cohort are
   new references. */
struct group_input predict_subjects(const struct group_input *group, size_t n_parts);
/* Of several structures [{name, surface, distance, residual}] of subject i; otherwise null. */
json_t *predict_parts_json(const struct group_input *group, const struct kept *kept,
                           const struct srnf_class_prediction *prediction, size_t i);
/* {distance, residual} of the relative positions; null of a classifier without them. */
json_t *predict_position_json(const struct kept *kept,
                              const struct srnf_class_prediction *prediction);

/* predict_numbers.c: the input covariates; and for complete, whether the classifier's covariates
   are there, which it puts into the canonical cohort where one is given. */
extern const struct input_own predict_covariates;
void predict_check_covariates(struct process_inputs *given, const struct store_model *model);
/* [n][numbers of the classifier] of the surfaces; 0, or a negative status with the problem set. */
int predict_load_numbers(struct jobs_run *run, const struct predict *predict,
                         const struct kept *kept, const struct srnf_sht *sht,
                         const struct compute_group *group, double **numbers,
                         struct jobs_result *result);
/* {name: value} of surface i, sizes as lengths; null without any. Adds a warning for each that is
   beyond those of the training members. */
json_t *predict_numbers_json(const struct kept *kept, const double *numbers, size_t i,
                             const char *name, json_t *warnings);

#define PREDICT_TRAITS 4
struct predict_answer {
    size_t n; /* subjects: the members of each part */
    struct compute_group group;
    double *numbers;                           /* [n][numbers of the classifier] beside shape */
    double *positions;                         /* [n][parts][3], or NULL */
    double *priors;                            /* [classes] */
    struct srnf_class_prediction *predictions; /* [n] */
    double *evidence, *probabilities;          /* [n][classes] */
    size_t *predicted;                         /* [n] */
    bool *trained;                             /* [n] the surface is one that it was trained on */
    size_t *known; /* [n] parts that it was trained on, of one of its subjects or of several */
    struct srnf_typicality *traits; /* [n][PREDICT_TRAITS] */
    double *nearest, *mirrored; /* [n] distances from the nearest training member, and those of the
                                   mirror images; the same where these were not tried */
};
extern const enum srnf_trait predict_traits[PREDICT_TRAITS];

/* The parts of subject i whose surface a training member has as the same part; first: the first of
   them, or their number. */
size_t predict_known_parts(const struct kept *kept, const struct predict_answer *answer, size_t i,
                           size_t *first);
/* The training member whose surfaces all have the content of subject i, or their number. */
size_t predict_member(const struct kept *kept, const struct predict_answer *answer, size_t i);
/* predict_mirrored.c: the distances of the mirror images, but for training members. A core
   status. */
int predict_mirrored(struct jobs_run *run, const struct srnf_sht *sht,
                     const struct srnf_frozen *frozen, const struct kept *kept,
                     struct predict_answer *answer, struct srnf_error *error);

/* predict_parts.c: where the parts of the subjects of a group, as it was loaded, are, for a
   classifier that heeds it; 0, or a negative status with the problem set. */
int predict_place(struct jobs_run *run, const struct group_input *group, const struct kept *kept,
                  struct predict_answer *answer, struct jobs_result *result);

/* predict_result.c: the result document; NULL with the problem set. */
json_t *predict_document(struct jobs_run *run, const struct group_input *group,
                         const struct kept *kept, const struct predict_answer *answer,
                         struct jobs_result *result);

#endif
