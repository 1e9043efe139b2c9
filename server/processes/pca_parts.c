/*
 * pca_parts.c - the process pca-parts: principal components of several structures of each subject
 * together.
 *
 * Every part is registered to its own mean. With relativePose the positions of the parts count as
 * well: the centroid of each less the mean of its subject's, in units of the subject's size, the
 * root of the total area. That needs data in a common pose, where the turns of the parts against
 * each other are in the SRNFs already.
 */
#include "processes/pca_parts.h"

#include <stdio.h>
#include <string.h>

#include "toolkit/seconds.h"

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, offsetof(struct pca_parts, group),
     "A cohort whose members have a subject and, as a covariate, the name of the part of it that "
     "they are. Each subject has each part once.",
     .required = true, .own = &pca_parts_cohort, .highest = COMPUTE_PAIRS_MAX},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct pca_parts, group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .fallback = 0},
    {"by", INPUT_OWN, offsetof(struct pca_parts, n), "The covariate that names the part.",
     .own = &pca_parts_by},
    {"weights", INPUT_OWN, offsetof(struct pca_parts, n),
     "Of the squared distances of each part in those of subjects, by its name; 1 where none is "
     "given.",
     .own = &pca_parts_weights},
    MEAN_INPUTS(pca_parts, NULL),
    {"components", INPUT_INTEGER, offsetof(struct pca_parts, components),
     "How many to keep at most; null: all above rounding, 499 of them at most.", .lowest = 1,
     .highest = PROCESS_COMPONENTS_MAX, .nullable = true},
    {"modes", INPUT_INTEGER, offsetof(struct pca_parts, modes),
     "Of so many components the surfaces of every part two standard deviations from the mean, "
     "either way.",
     .lowest = 0, .highest = PCA_PARTS_MODES_MAX, .fallback = 1},
    PCA_PARTS_POSE_INPUTS(pca_parts, relative_pose, pose_weight, "(commonPose, or register false)"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"model", OUTPUT_OBJECT,
     "Record of the model, of kind parts: what one of pca has, of subjects, and parts and "
     "positions. project, score, modes and sample take it."},
    {"parts", OUTPUT_OBJECTS,
     "For each part: name, weight, mean (record of its surface), relativeEnergy of that, "
     "iterations, converged, variance (weighted, as in totalVariance), share of the total, and "
     "distances of the subjects from its mean."},
    {"subjects", OUTPUT_STRINGS, "In the order of the scores."},
    {"groups", "\"type\":\"array\",\"items\":{\"type\":[\"string\",\"null\"]}",
     "The label of each subject, that of its first part."},
    {"eigenvalues", OUTPUT_NUMBERS, "Variances of the scores, decreasing."},
    {"explained", OUTPUT_NUMBERS, "Shares of totalVariance."},
    {"cumulative", OUTPUT_NUMBERS, "Their sums."},
    {"totalVariance", OUTPUT_NUMBER,
     "Mean squared distance of subjects from the mean, with n - 1: the sum of that of the parts, "
     "each times its weight, and of the positions."},
    {"scores", OUTPUT_MATRIX, "Of each subject on each component."},
    {"shares", OUTPUT_MATRIX,
     "Of each component: which part of its variance is that of each part, and last of the "
     "positions. The sum is 1."},
    {"modes", OUTPUT_OBJECTS,
     "{component, part, deviations, surface, relativeEnergy}: records of the surfaces along the "
     "first components; the deformation from the part's mean rides along in their meshes. "
     "relativeEnergy as in modes."},
    {"positions", OUTPUT_OBJECT_OR_NULL,
     "null without relativePose: weight, variance (weighted), share of the total, mean (of each "
     "part, [x, y, z]) and components, what a score of 1 adds for each part."},
    REGISTRATION_OUTPUT,
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    mean_complete(given, PCA_PARTS_COPIES);
    if (!given->list->errors) {
        pca_parts_complete(given);
    }
}

/* ---- Running --------------------------------------------------------------------------------- */

static json_t *run_pca_parts(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct pca_parts *asked = typed;
    const struct srnf_register_options options = registration_defaults(asked->mean.common_pose);
    size_t most = asked->n > PROCESS_COMPONENTS_MAX + 1 ? PROCESS_COMPONENTS_MAX : 0;
    struct compute_parts_inputs more = {
        .n = asked->n,
        .n_parts = asked->n_parts,
        .weights = asked->weights,
        .registration = asked->mean.registered ? &options : NULL,
        .tolerance = asked->mean.tolerance,
        .max_iterations = (size_t)asked->mean.max_iterations,
        .components = asked->components > 0 ? (size_t)asked->components : most,
        .position_weight = asked->pose_weight,
        .modes = (size_t)asked->modes,
        .deviations = 2.0,
    };
    struct compute_parts_outputs found = {.n_parts = 0};
    json_t *document = NULL;
    double *positions = NULL;

    if (group_load(run, &asked->group, asked->mean.registered, (size_t)asked->mean.lmax,
                   &found.group, result)) {
        goto out;
    }
    if (asked->relative_pose) {
        more.positions = positions =
            pca_parts_positions(run, &asked->group, asked->n, asked->n_parts, &found.group, result);
        if (!positions) {
            goto out;
        }
    }
    if (compute_parts(run, &more, &found, result) == 0) {
        document = pca_parts_document(run, asked, &more, &found, result);
    }
out:
    srnf_free(positions);
    compute_parts_clear(&found);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct pca_parts),
    .check = pca_parts_check_pose,
    .complete = complete,
    .run = run_pca_parts,
};

const struct api_process pca_parts_process = {
    .id = "pca-parts",
    .title = "Joint principal components of several structures",
    .description = "The structures of each subject together: a mean of each, and the principal "
                   "components of the SRNFs of all of them, with or without where they are.",
    .methods = "Principal components were taken of the square-root normal fields (SRNFs) of all "
               "structures of a subject together, each about its own mean[, to which it was "
               "registered elastically,] and times the root of its weight",
    .table = &table,
    .seconds = mean_seconds,
};
