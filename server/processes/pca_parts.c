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

#include "toolkit/positions.h"
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
    {"relativePose", INPUT_BOOLEAN, offsetof(struct pca_parts, relative_pose),
     "Where the parts are counts as well: their centroids relative to the mean of the subject's, "
     "in units of the root of the subject's total area. The data must share a pose (commonPose, "
     "or register false).",
     .fallback = 0},
    {"poseWeight", INPUT_REAL, offsetof(struct pca_parts, pose_weight),
     "Of the squared distances of those positions.", .lowest = 1e-6,
     .highest = PCA_PARTS_WEIGHT_MAX, .fallback = 1},
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

static void check(struct process_inputs *given)
{
    const json_t *canonical = given->canonical;

    if (json_is_true(json_object_get(canonical, "relativePose")) &&
        !json_is_true(json_object_get(canonical, "commonPose")) &&
        !json_is_false(json_object_get(canonical, "register"))) {
        problem_add(given->list, "/inputs/relativePose",
                    "needs commonPose or register false: where parts are turned one by one, their "
                    "pose is lost");
    }
}

static void complete(struct process_inputs *given)
{
    mean_complete(given, PCA_PARTS_COPIES);
    if (!given->list->errors) {
        pca_parts_describe(given);
    }
}

/* ---- Positions ------------------------------------------------------------------------------- */

/* Those of one subject: [n_parts][3]. */
static int find_subject(struct jobs_run *run, const struct pca_parts *asked,
                        const struct srnf_sht *sht, const struct compute_group *group,
                        size_t subject, double *own, struct jobs_result *result)
{
    struct compute_surface surfaces[PCA_PARTS_MAX];
    const double *numbers[PCA_PARTS_MAX];

    for (size_t p = 0; p < asked->n_parts; p++) {
        size_t i = p * asked->n + subject;

        surfaces[p] = (struct compute_surface){.scale = group->scales[i],
                                               .mirrored = asked->group.mirrored.member[i]};
        (void)snprintf(surfaces[p].id, sizeof surfaces[p].id, "%s", asked->group.ids[i]);
        memcpy(surfaces[p].origin, group->origins[i], sizeof surfaces[p].origin);
        numbers[p] = group->surfaces[i];
    }
    return positions_find(run, sht, asked->n_parts, surfaces, numbers, own, result);
}

/* [n][n_parts][3]; NULL with the problem set. */
static double *find_positions(struct jobs_run *run, const struct pca_parts *asked,
                              const struct compute_group *group, struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    double *positions = srnf_alloc(3 * asked->n * asked->n_parts, sizeof(double));
    int status = jobs_transform_acquire(jobs, group->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);

    if (status || !positions) {
        status = compute_fail(result, status ? status : SRNF_ENOMEM, NULL, "placing the parts");
    }
    for (size_t i = 0; i < asked->n && !status; i++) {
        status =
            find_subject(run, asked, sht, group, i, positions + 3 * i * asked->n_parts, result);
    }
    jobs_transform_release(jobs, sht);
    if (status) {
        srnf_free(positions);
        return NULL;
    }
    return positions;
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
        more.positions = positions = find_positions(run, asked, &found.group, result);
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
    .check = check,
    .complete = complete,
    .run = run_pca_parts,
};

const struct api_process pca_parts_process = {
    .id = "pca-parts",
    .title = "Joint principal components of several structures",
    .description = "The structures of each subject together: a mean of each, and the principal "
                   "components of the SRNFs of all of them, with or without where they are.",
    .methods =
        "Principal components were taken of the square-root normal fields (SRNFs) of all "
        "structures of a subject together, each about its own mean, to which it was registered "
        "elastically unless register is no, and times the root of its weight",
    .table = &table,
    .seconds = mean_seconds,
};
