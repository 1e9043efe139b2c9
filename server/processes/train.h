/*
 * train.h - what the files of the processes train and train-parts share: their typed inputs, the
 * tables, and what a run has come to.
 */
#ifndef SRNFD_PROCESSES_TRAIN_H
#define SRNFD_PROCESSES_TRAIN_H

#include "processes/classify_parts.h"
#include "store/model.h"
#include "toolkit/assessment.h"
#include "toolkit/covariates.h"

/* Of the parts train has the group, the pose and the degree, and n_parts 0. */
struct train {
    struct pca_parts parts;
    int method, covariance, priors;
    int scale;
    double size_weight;
    json_t *covariates; /* names, owned */
    long components;
};

/* Fields that are held for each surface: those of classify, the registered ones, and components. */
#define TRAIN_COPIES 16

/* ---- Tables (train.c) ------------------------------------------------------------------------ */

/* NULL at the end. Of the methods the first is by Gaussians; the others are in the order of the
   enums of the core. */
extern const char *const train_methods[], *const train_covariances[], *const train_priors[],
                                                                          *const train_scales[];

/* Rows of the inputs after those that name the members. */
#define TRAIN_AT(member) offsetof(struct train, member)
#define TRAIN_INPUTS                                                                               \
    {"method", INPUT_CHOICE, TRAIN_AT(method),                                                     \
     "srnf-gauss: a normal distribution for each class on principal components of SRNFs; "         \
     "srnf-nn: the nearest neighbour by SRNFs.",                                                   \
     .choices = train_methods},                                                                    \
        {"components", INPUT_OWN, TRAIN_AT(components),                                            \
         "Of the Gaussians; auto: chosen inside each fold, of 20 at most.",                        \
         .own = &classify_components_own},                                                         \
        {"covariance", INPUT_CHOICE, TRAIN_AT(covariance),                                         \
         "One for all classes, or one for each; auto: chosen inside each fold.",                   \
         .choices = train_covariances},                                                            \
        {"scale", INPUT_CHOICE, TRAIN_AT(scale),                                                   \
         "Whether the log of the size, of each structure, counts beside shape.",                   \
         .choices = train_scales},                                                                 \
        {"covariates", INPUT_OWN, TRAIN_AT(covariates),                                            \
         "Numbers of the members that count beside shape, by their names: predict then needs "     \
         "them of all that it is asked about.",                                                    \
         .own = &covariates_names},                                                                \
        {"sizeWeight",                                                                             \
         INPUT_REAL,                                                                               \
         TRAIN_AT(size_weight),                                                                    \
         "Of each size and covariate in distances; at 1 it weighs as much as shape. Gaussians "    \
         "need none.",                                                                             \
         .highest = PROCESS_SIZE_WEIGHT_MAX,                                                       \
         .fallback = 1},                                                                           \
        {"priors", INPUT_CHOICE, TRAIN_AT(priors),                                                 \
         "What the probabilities take the classes to be before a surface is seen. cohort: their "  \
         "shares among the subjects; equal: as likely as each other.",                             \
         .choices = train_priors},                                                                 \
        {"commonPose", INPUT_BOOLEAN, TRAIN_AT(parts.mean.common_pose),                            \
         "The surfaces share a pose: no registration rotates.", .fallback = 0},                    \
    {                                                                                              \
        "lmax", INPUT_INTEGER, TRAIN_AT(parts.mean.lmax),                                          \
            "Degree of the classifier; surfaces are cut or filled up to it. Default: the largest " \
            "of theirs. 15 is enough for most.",                                                   \
            .lowest = SRNF_DEGREE_MIN, .highest = SRNF_DEGREE_MAX, .derived = true                 \
    }

/* Rows of the outputs. */
#define TRAIN_CLASSIFIER_TEXT                                                                      \
    "classifier: method, classes, members and subjects of each, priors, template {surface, "       \
    "member}, components, covariance, means and covariances of the Gaussians (the numbers beside " \
    "shape first), features {size, names, values, factors} (numbers beside shape: whether size "   \
    "is one, those of each member, and what differences are multiplied by in distances), slope, "  \
    "offsets and targets of the calibration, nearest (of each member the distance to the nearest " \
    "of another subject, left out) and validation."
#define TRAIN_OUTPUTS                                                                              \
    {"validation", OUTPUT_OBJECT,                                                                  \
     "Nested: of each member, by a classifier in whose making its subject had no "                 \
     "part: " ASSESSMENT_TEXT "."},                                                                \
        {"perSubject", OUTPUT_OBJECTS,                                                             \
         "Of each member, without its subject: [{subject, label, predicted, probabilities, and "   \
         "logLikelihoods or nearestDistances, of each class; components of its fold, or null}]."}, \
        {"classes", OUTPUT_STRINGS, "The labels, in the order in which they first appear."},       \
        {"features", OUTPUT_STRINGS, "The numbers beside shape: sizes, and covariates."},          \
        {"refitted", OUTPUT_STRINGS, "What is made again without the subject that is left out."},  \
        {"subjects", OUTPUT_INTEGER, "Members without a subject are subjects of their own."},      \
        {"lmax", OUTPUT_INTEGER, "Degree of the classifier."}, BRIDGED_GROUP_OUTPUTS,              \
        REGISTRATION_OUTPUT

/* Of the inner folds. */
classify_check_folds train_check_folds;
/* For complete: that no covariate is called what a size is called. */
void train_check_names(struct process_inputs *given);
/* Bytes that the folds of n subjects take beside the fields. */
double train_bytes(const json_t *canonical, size_t n, size_t n_parts);
/* Of both processes: runs on typed inputs. */
json_t *train_run(struct jobs_run *run, const void *typed, struct jobs_result *result);

/* ---- What a run comes to --------------------------------------------------------------------- */

struct train_answer {
    size_t n, n_parts; /* subjects that are classified; one part of train */
    bool several;      /* train-parts: the members of each part are in the order of the subjects */
    struct compute_group group;
    struct classify_classes classes;
    struct srnf_train_options options;
    struct srnf_trained trained;
    double *numbers;                      /* [n][of options] beside shape */
    double *positions;                    /* [n][n_parts][3], or NULL */
    size_t n_theta, n_phi;                /* of one part */
    double mean_energies[SRNF_PARTS_MAX]; /* relative, of the inversions of the means */
    json_t *parts, *places; /* train-parts: parts and positions of the record, owned */
};

/* train_model.c: stores templates, means and model; the record of the model, or NULL with the
   problem set. Of several parts answer->parts is set. */
json_t *train_keep(struct jobs_run *run, const struct train *train, struct train_answer *answer,
                   struct jobs_result *result);

/* train_parts.c: the warnings of each part, by its name; false with the problem set. */
bool train_parts_warn(struct jobs_run *run, const struct train *train,
                      const struct train_answer *answer, json_t *document,
                      struct jobs_result *result);

#endif
