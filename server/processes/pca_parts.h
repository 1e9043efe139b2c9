/*
 * pca_parts.h - what the files of the process pca-parts share.
 */
#ifndef SRNFD_PROCESSES_PCA_PARTS_H
#define SRNFD_PROCESSES_PCA_PARTS_H

#include "compute/parts.h"
#include "toolkit/mean.h"

#define PCA_PARTS_MAX 32 /* SRNF_PARTS_MAX */
#define PCA_PARTS_WEIGHT_MAX 1000000
#define PCA_PARTS_COPIES 9 /* fields of each surface: registered, stacked, weighted, modes, kept */
#define PCA_PARTS_MODES_MAX 20

struct pca_parts {
    struct group_input group; /* part after part, each with the subjects in the same order */
    struct mean_input mean;
    size_t n, n_parts; /* subjects */
    double weights[PCA_PARTS_MAX];
    long components, modes;
    bool relative_pose;
    double pose_weight;
};

/* Rows of inputs: whether where the parts are counts as well. pose: what says that the data share
   a pose. */
#define PCA_PARTS_POSE_INPUTS(typed, relative, weight, pose)                                       \
    {"relativePose", INPUT_BOOLEAN, offsetof(struct typed, relative),                              \
     "Where the parts are counts as well: their centroids relative to the mean of the subject's, " \
     "in units of the root of the subject's total area. The data must share a pose " pose ".",     \
     .fallback = 0},                                                                               \
    {                                                                                              \
        "poseWeight", INPUT_REAL, offsetof(struct typed, weight),                                  \
            "Of the squared distances of those positions.",                                        \
            .lowest = 1e-6, .highest = PCA_PARTS_WEIGHT_MAX, .fallback = 1                         \
    }

/* ---- pca_parts_positions.c ------------------------------------------------------------------- */

/* For check: where parts are turned one by one, where they are says nothing. */
void pca_parts_check_pose(struct process_inputs *given);
/* [n][n_parts][3] of n subjects whose members stand part after part, as they were loaded; NULL with
   the problem set. */
double *pca_parts_positions(struct jobs_run *run, const struct group_input *group, size_t n,
                            size_t n_parts, const struct compute_group *loaded,
                            struct jobs_result *result);

/* ---- pca_parts_cohort.c ---------------------------------------------------------------------- */

extern const struct input_own pca_parts_cohort, pca_parts_by, pca_parts_weights;
/* For complete: the parts and subjects of the canonical cohort, whose members are put part after
   part; or problems that name who lacks a part. */
void pca_parts_complete(struct process_inputs *given);
/* The same for a model of several structures: its parts are the cohort's, in its order. Any number
   of subjects will do, and weights are not read. */
void pca_parts_sort(struct process_inputs *given, const json_t *names);

/* ---- pca_parts_result.c ---------------------------------------------------------------------- */

/* The result document (new reference), or NULL with the problem set. */
json_t *pca_parts_document(struct jobs_run *run, const struct pca_parts *asked,
                           const struct compute_parts_inputs *inputs,
                           const struct compute_parts_outputs *found, struct jobs_result *result);

/* ---- pca_parts_model.c ----------------------------------------------------------------------- */

/* Keeps the model of the result document; its record (new reference), or NULL with the problem
   set. */
json_t *pca_parts_keep(struct jobs_run *run, const struct pca_parts *asked,
                       const struct compute_parts_inputs *inputs,
                       const struct compute_parts_outputs *found, const json_t *document,
                       struct jobs_result *result);

/* The member madeFrom of a model of several structures (new reference): what is told of members is
   of subjects, but for their surfaces and what stands for those. */
struct model_parts; /* toolkit/model_keep.h */
json_t *pca_parts_making(struct jobs_run *run, const char *process, const struct group_input *group,
                         size_t n, const struct model_parts *numbers,
                         const struct srnf_register_options *registration);

/* ---- pca_parts_doubts.c ---------------------------------------------------------------------- */

/* The members of a part: borrowed but for surfaces and cohort, which are new references. */
struct group_input pca_parts_members(const struct pca_parts *asked, size_t part);
/* Adds the warnings of a document, which is taken over, by the name of the part. what: "modes"
   where they are of its modes, or NULL. */
void pca_parts_tell(json_t *warnings, json_t *document, const char *part, const char *what);
/* Adds the warnings of each part, by its name: of its members, its mean and its modes. false with
   the problem set. */
bool pca_parts_warn(struct jobs_run *run, const struct pca_parts *asked,
                    const struct compute_parts_inputs *inputs,
                    const struct compute_parts_outputs *found, json_t *document,
                    struct jobs_result *result);

#endif
