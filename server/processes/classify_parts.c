/*
 * classify_parts.c - the process classify-parts: each subject of a labelled cohort classified by
 * several of its structures together, with size and other numbers where they are asked for.
 *
 * Each part is compared in folds of its own; what a fold knows of a subject left out is the sum
 * over the parts (srnf_folds_join). The canonical cohort has its members part after part, and in
 * subjectLabels and values what the subjects are and the covariates that count.
 */
#include "processes/classify_parts.h"

#include <math.h>
#include <string.h>

#include "compute/searches.h"
#include "compute/seconds.h"
#include "toolkit/covariates.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"

#define COMPONENTS_KEPT 20
#define SHARE 20.0            /* percent of the job that encoding its meshes takes */
#define SHARE_COMPARISON 75.0 /* of what that leaves: all parts */

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

static const char *const covariances[] = {"auto", "pooled", "class", NULL};
static const char *const scales[] = {"shape", "shape-and-size", NULL};

#define AT(member) offsetof(struct classify_parts, member)
static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, AT(parts.group),
     "A cohort whose members have a label, a subject and, as a covariate, the name of the part of "
     "it that they are. Each subject has each part once, and one label; each label is that of "
     "three subjects at least.",
     .required = true, .own = &pca_parts_cohort},
    {"mixedRoutes", INPUT_BOOLEAN, AT(parts.group.mixed_routes), GROUP_MIXED_ROUTES_TEXT,
     .fallback = 0},
    {"by", INPUT_OWN, AT(parts.n), "The covariate that names the part.", .own = &pca_parts_by},
    {"weights", INPUT_OWN, AT(parts.n),
     "Of the squared distances of each part, of unit area, in those of subjects, by its name; 1 "
     "where none is given.",
     .own = &pca_parts_weights},
    {"method", INPUT_OWN, AT(methods),
     "srnf-gauss: a normal distribution for each class on joint principal components; srnf-nn: "
     "nearest neighbour by joint distances; srm-gauss and srm-nn: the same of square-root maps; or "
     "a list of them.",
     .own = &classify_method_own},
    {"components", INPUT_OWN, AT(components),
     "Of the Gaussians; auto: chosen inside each fold, of 20 at most.",
     .own = &classify_components_own},
    {"covariance", INPUT_CHOICE, AT(covariance),
     "One for all classes, or one for each; auto: chosen inside each fold.",
     .choices = covariances},
    {"scale", INPUT_CHOICE, AT(scale), "Whether the log of the size of each part counts as well.",
     .choices = scales},
    {"covariates", INPUT_OWN, AT(covariates),
     "Numbers of the subjects that count beside shape, by their names.", .own = &covariates_names},
    {"sizeWeight", INPUT_REAL, AT(size_weight),
     "Of each size and covariate in distances; at 1 it weighs as much as all shapes together. "
     "Gaussians need none.",
     .highest = PROCESS_SIZE_WEIGHT_MAX, .fallback = 1},
    {"permutations", INPUT_INTEGER, AT(permutations),
     "Of the labels of subjects, for the p-value; 0: none.", .highest = PROCESS_PERMUTATIONS_MAX},
    {"seed", INPUT_INTEGER, AT(seed), "Of the permutations.", .highest = PROCESS_SEED_MAX},
    {"commonPose", INPUT_BOOLEAN, AT(parts.mean.common_pose),
     "The surfaces share a pose: no registration rotates.", .fallback = 0},
    PCA_PARTS_POSE_INPUTS(classify_parts, parts.relative_pose, parts.pose_weight, "(commonPose)"),
    {"lmax", INPUT_INTEGER, AT(parts.mean.lmax),
     "Degree of the comparison; the surfaces are cut or filled up to it. Default: the largest of "
     "theirs.",
     .lowest = SRNF_DEGREE_MIN, .highest = SRNF_DEGREE_MAX, .derived = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"methods", OUTPUT_OBJECT,
     "By name, as in classify, of the subjects: all parts, and the other numbers, together."},
    {"comparisons", OUTPUT_OBJECTS, "Of each pair of methods, as in classify."},
    {"parts", OUTPUT_OBJECTS,
     "For each part: name, weight, and methods, what it says alone, by the same folds and without "
     "other numbers: by name accuracy, correct, confidenceInterval, onlyTogether and onlyAlone "
     "(subjects that only all parts together, and only this one, get right) and pValue, McNemar's "
     "exact test that both are right equally often."},
    {"features", OUTPUT_STRINGS, "The numbers beside shape: size of each part, and covariates."},
    {"subjects", OUTPUT_INTEGER, "What is classified."},
    {"chance", OUTPUT_NUMBER, "As in classify."},
    {"majorityRate", OUTPUT_NUMBER, "As in classify."},
    {"permutations", OUTPUT_INTEGER, "As in classify."},
    {"relabellings", OUTPUT_NUMBER_OR_NULL, "As in classify."},
    {"exact", "\"type\":[\"boolean\",\"null\"]", "As in classify."},
    {"classes", "\"type\":\"array\",\"items\":{" OUTPUT_STRING "}",
     "The labels, in the order in which they first appear."},
    {"lmax", OUTPUT_INTEGER, "Degree of the comparison."},
    BRIDGED_GROUP_OUTPUTS,
    {"registration", OUTPUT_OBJECT, "Of each part: degree, penalty and all other options."},
    {NULL, NULL, NULL},
};

/* ---- Costs ----------------------------------------------------------------------------------- */

static double seconds(const struct api_work *work, const json_t *canonical)
{
    double members = (double)(work->surfaces + work->meshes);
    double parts = fmax(1.0, (double)json_array_size(
                                 json_object_get(json_object_get(canonical, "cohort"), "parts")));
    double degree = json_number_value(json_object_get(canonical, "lmax"));
    double permutations = json_number_value(json_object_get(canonical, "permutations"));
    double sum = seconds_of_group(work, true);
    const json_t *name;
    size_t i;

    json_array_foreach(json_object_get(canonical, "method"), i, name)
    {
        const struct srnf_method *method = classify_method_find(json_string_value(name));

        sum +=
            parts * seconds_of_folds(method->metric, members / parts, degree) +
            seconds_of_label_permutations(method->gauss, members / parts, 2.0,
                                          permutations + (parts + 1.0) * (double)SRNF_RELABELLINGS);
    }
    return sum;
}

/* ---- Running --------------------------------------------------------------------------------- */

struct joint {
    struct srnf_folds parts[PCA_PARTS_MAX], all;
    const double *positions; /* [n][parts][3], or NULL */
};

static void clear_joint(struct joint *joint, size_t n_parts)
{
    for (size_t p = 0; p < n_parts; p++) {
        srnf_folds_clear(&joint->parts[p]);
    }
    srnf_folds_clear(&joint->all);
}

/* The run's, without its progress. */
static struct srnf_context quiet_of(struct jobs_run *run)
{
    struct srnf_context quiet = *jobs_run_context(run);

    quiet.progress = NULL;
    return quiet;
}

/* The comparisons of one metric: of each part, and of all. */
static int compare(struct jobs_run *run, const struct classify_parts *asked,
                   const struct srnf_sht *sht, const struct classify_answer *answer,
                   enum srnf_metric metric, double share, struct joint *joint,
                   struct srnf_error *error)
{
    const struct compute_group *group = &answer->group;
    size_t n = asked->parts.n, n_parts = asked->parts.n_parts;
    struct srnf_context quiet = quiet_of(run);
    int status = SRNF_OK;

    for (size_t p = 0; p < n_parts && status == SRNF_OK; p++) {
        jobs_run_phase(run, share / (double)n_parts);
        status =
            srnf_folds_compare(sht, metric, n, group->surfaces + p * n, &answer->asked.comparison,
                               jobs_run_context(run), &joint->parts[p], error);
    }
    return status
               ? status
               : srnf_folds_join(n_parts, joint->parts, asked->parts.weights, joint->positions,
                                 asked->parts.pose_weight, answer->asked.comparison.max_components,
                                 &quiet, &joint->all, error);
}

/* One method, of all parts with the other numbers and of each alone. */
static int classify_by(struct jobs_run *run, const struct classify_parts *asked, size_t m,
                       const struct joint *joint, struct classify_answer *answer,
                       struct classify_parts_alone *alone, struct srnf_error *error)
{
    const struct srnf_method *method = &asked->methods.list[m];
    struct srnf_classify_options plain = answer->asked.classifier;
    struct srnf_context quiet = quiet_of(run);
    int status = (method->gauss ? srnf_classify_gauss : srnf_classify_nearest)(
        &joint->all, answer->classes.labels, answer->classes.count, &answer->asked.classifier,
        &quiet, &answer->results[m], error);

    status = status ? status
                    : srnf_folds_typicality(&joint->all, SRNF_TYPICAL_ALPHA_GROUP,
                                            &answer->typicality[m]);
    plain.features = NULL;
    plain.n_features = 0;
    plain.permutations = 0;
    for (size_t p = 0; p < asked->parts.n_parts && status == SRNF_OK; p++) {
        status = (method->gauss ? srnf_classify_gauss : srnf_classify_nearest)(
            &joint->parts[p], answer->classes.labels, answer->classes.count, &plain, &quiet,
            &alone[p].results[m], error);
    }
    return status;
}

static int compute(struct jobs_run *run, const struct classify_parts *asked,
                   const struct srnf_sht *sht, const double *positions,
                   struct classify_answer *answer, struct classify_parts_alone *alone,
                   struct srnf_error *error)
{
    static const enum srnf_metric metrics[] = {SRNF_METRIC_SRNF, SRNF_METRIC_SRM};
    size_t wanted[2] = {0, 0};
    struct joint *joint = srnf_alloc(1, sizeof *joint);
    int status = joint ? SRNF_OK : SRNF_ENOMEM;

    if (joint) {
        joint->positions = positions;
    }
    for (size_t m = 0; m < asked->methods.n; m++) {
        wanted[asked->methods.list[m].metric == SRNF_METRIC_SRM]++;
    }
    for (size_t k = 0; k < 2 && status == SRNF_OK; k++) {
        double share = SHARE_COMPARISON / (double)((wanted[0] > 0) + (wanted[1] > 0));

        if (wanted[k] == 0) {
            continue;
        }
        status = compare(run, asked, sht, answer, metrics[k], share, joint, error);
        for (size_t m = 0; m < asked->methods.n && status == SRNF_OK; m++) {
            if (asked->methods.list[m].metric == metrics[k]) {
                status = classify_by(run, asked, m, joint, answer, alone, error);
            }
        }
        clear_joint(joint, asked->parts.n_parts);
    }
    srnf_free(joint);
    return status;
}

/* What is asked of the core, but for what is loaded. */
static struct srnf_methods_inputs asked_of(const struct classify_parts *asked)
{
    struct srnf_methods_inputs of = {.n = asked->parts.n,
                                     .comparison = srnf_folds_options_defaults(),
                                     .classifier = srnf_classify_options_defaults()};
    size_t components = (size_t)asked->components;

    of.comparison.registration = registration_defaults(asked->parts.mean.common_pose);
    of.comparison.max_components = components > COMPONENTS_KEPT ? components : COMPONENTS_KEPT;
    of.comparison.keep = true;
    of.classifier.components = components;
    of.classifier.covariance = (enum srnf_covariance)asked->covariance;
    of.classifier.size_weight = asked->size_weight;
    of.classifier.permutations = (size_t)asked->permutations;
    of.classifier.seed = (uint64_t)asked->seed;
    return of;
}

static int load(struct jobs_run *run, const struct classify_parts *asked,
                struct classify_answer *answer, struct jobs_result *result)
{
    if (!classify_parts_classes(asked->parts.group.cohort, &answer->classes)) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    }
    return group_load(run, &asked->parts.group, true, (size_t)asked->parts.mean.lmax,
                      &answer->group, result);
}

static int run_all(struct jobs_run *run, const struct classify_parts *asked,
                   struct classify_answer *answer, struct classify_parts_alone *alone,
                   struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {.element = -1};
    const json_t *values = json_object_get(asked->parts.group.cohort, "values");
    size_t sizes = asked->scale ? asked->parts.n_parts : 0;
    double *features = NULL, *positions = NULL;
    int status = load(run, asked, answer, result);

    if (status == 0 && asked->parts.relative_pose) {
        positions = pca_parts_positions(run, &asked->parts.group, asked->parts.n,
                                        asked->parts.n_parts, &answer->group, result);
        status = positions ? 0 : -1;
    }
    if (status) {
        return status;
    }
    status =
        jobs_transform_acquire(jobs, answer->group.degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);
    if (status) {
        srnf_free(positions);
        return compute_fail(result, status, NULL, "preparing the classification");
    }
    jobs_run_keep_parts(run);
    compute_searches_spread(run);
    status = classify_numbers(run, sht, &asked->parts.group, &answer->group, asked->parts.n, sizes,
                              values, &features);
    answer->asked.classifier.features = features;
    answer->asked.classifier.n_features = sizes + json_array_size(values);
    status = status ? status : compute(run, asked, sht, positions, answer, alone, &error);
    jobs_transform_release(jobs, sht);
    answer->asked.classifier.features = NULL;
    status = status ? compute_fail(result, status, &error, "classifying the subjects") : 0;
    if (status == SRNF_ENUMERIC) {
        const struct classify_constants constants = {.covariates = asked->covariates,
                                                     .sizes = sizes,
                                                     .n = asked->parts.n,
                                                     .numbers = features,
                                                     .labels = answer->classes.labels};

        classify_name_constant(&constants, &error, result);
    }
    srnf_free(features);
    srnf_free(positions);
    return status;
}

static json_t *run_classify_parts(struct jobs_run *run, const void *typed,
                                  struct jobs_result *result)
{
    const struct classify_parts *asked = typed;
    struct classify_answer answer = {.asked = asked_of(asked)};
    struct classify_parts_alone *alone = srnf_alloc(asked->parts.n_parts, sizeof *alone);
    json_t *document = NULL;

    if (!alone) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "preparing the classification");
    } else if (run_all(run, asked, &answer, alone, result) == 0) {
        document = classify_parts_document(run, asked, &answer, alone, result);
    }
    for (size_t m = 0; m < CLASSIFY_METHODS; m++) {
        srnf_classification_clear(&answer.results[m]);
        srnf_folds_typicality_clear(&answer.typicality[m]);
        for (size_t p = 0; alone && p < asked->parts.n_parts; p++) {
            srnf_classification_clear(&alone[p].results[m]);
        }
    }
    srnf_free(alone);
    classify_classes_clear(&answer.classes);
    compute_group_clear(&answer.group);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct classify_parts),
    .check = pca_parts_check_pose,
    .complete = classify_parts_complete,
    .run = run_classify_parts,
};

const struct api_process classify_parts_process = {
    .id = "classify-parts",
    .title = "Classification by several structures",
    .description = "Each subject of a labelled cohort classified by several of its structures "
                   "together, with their sizes and covariates if you like, beside what each "
                   "structure says alone.",
    .methods = "Labels were predicted by leave-one-out over subjects from all structures of a "
               "subject together; accuracies have Wilson intervals of 95 %, with the design effect "
               "of 100 relabellings",
    .table = &table,
    .seconds = seconds,
};
