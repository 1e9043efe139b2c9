/*
 * train.c - the process train: a classifier of a labelled cohort that is kept as a model, with its
 * nested validation (srnf/train.h); and the run of train-parts, which differs in its members alone
 * (train_parts.c).
 *
 * Labels and subjects are those of the cohort's members, as they were when the job was made, and
 * classes are in the order in which their labels first appear, as for classify. What the registered
 * surfaces come to is kept for a later attempt at the same job.
 */
#include "processes/train.h"

#include <stdio.h>
#include <string.h>

#include "api/warnings.h"
#include "compute/searches.h"
#include "compute/seconds.h"
#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"

#define COMPONENTS_KEPT 20.0 /* of each fold, where no more are asked for */
#define TEMPLATES 3.0        /* that folds have, as a rule */

#define WHY_ONE_LABEL                                                                          \
    "What is left out is a whole subject, whose label a classifier is asked for: it has one. " \
    "Take one member of each subject, or members of one label."

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

const char *const train_methods[] = {"srnf-gauss", "srnf-nn", NULL};
/* In the order of enum srnf_covariance and enum srnf_priors. */
const char *const train_covariances[] = {"auto", "pooled", "class", NULL};
const char *const train_priors[] = {"cohort", "equal", NULL};
const char *const train_scales[] = {"shape", "shape-and-size", NULL};

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, TRAIN_AT(parts.group),
     "Name of a cohort whose members have labels, each of them members of five subjects at least.",
     .required = true, .own = &group_members},
    {"mixedRoutes", INPUT_BOOLEAN, TRAIN_AT(parts.group.mixed_routes), GROUP_MIXED_ROUTES_TEXT,
     .fallback = 0},
    TRAIN_INPUTS,
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"model", OUTPUT_OBJECT,
     "Record of the model, of kind classifier: what one of pca has, about the template, "
     "and " TRAIN_CLASSIFIER_TEXT},
    {"members", OUTPUT_INTEGER, "Of the cohort."},
    {"relativeEnergy", OUTPUT_NUMBER_OR_NULL, "Of the mean: what is lost by being a surface."},
    TRAIN_OUTPUTS,
    {NULL, NULL, NULL},
};

/* ---- What holds between inputs --------------------------------------------------------------- */

void train_check_folds(struct process_inputs *given, const struct classify_classes *classes)
{
    long components = (long)json_integer_value(json_object_get(given->canonical, "components"));
    bool open = !components || inputs_chose(given->canonical, "covariance", "auto");
    bool parts = json_object_get(json_object_get(given->canonical, "cohort"), "parts") != NULL;
    size_t numbers = parts ? classify_parts_count(given->canonical)
                           : inputs_chose(given->canonical, "scale", "shape-and-size") +
                                 json_array_size(json_object_get(given->canonical, "covariates"));
    size_t features = (components ? (size_t)components : 1) + numbers;
    size_t determined =
        srnf_train_determined(classes->count, classes->subjects,
                              !inputs_chose(given->canonical, "covariance", "class"), open);

    if (classify_check_count(given, numbers) &&
        inputs_chose(given->canonical, "method", train_methods[0]) && features > determined) {
        problem_add(given->list, components ? "/inputs/components" : "/inputs/covariance",
                    "asks for a covariance of %zu features, size and covariates counted; the "
                    "training subjects of an inner fold determine one of %zu",
                    features, determined);
    }
}

void train_check_names(struct process_inputs *given)
{
    const json_t *canonical = given->canonical;
    const json_t *covariates = json_object_get(canonical, "covariates"), *name, *size;
    json_t *sizes =
        classify_number_names(inputs_chose(canonical, "scale", "shape-and-size"),
                              json_object_get(json_object_get(canonical, "cohort"), "parts"), NULL);
    char pointer[64];
    size_t i, k;

    json_array_foreach(covariates, i, name)
    {
        json_array_foreach(sizes, k, size)
        {
            if (json_equal(name, size)) {
                (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", i);
                problem_add(given->list, pointer,
                            "\"%.60s\" is what a size is called here: give the covariate another "
                            "name, or leave out scale",
                            json_string_value(name));
            }
        }
    }
    json_decref(sizes);
}

double train_bytes(const json_t *canonical, size_t n, size_t n_parts)
{
    double components = json_number_value(json_object_get(canonical, "components"));
    double kept = components > COMPONENTS_KEPT ? components : COMPONENTS_KEPT;
    double folds = (double)n_parts + (n_parts > 1 ? 1.0 : 0.0);

    /* Scores and distances of each fold, and the products of its template. */
    return 8.0 * (double)n * (double)n * (folds * (kept + 1.0) + TEMPLATES * (double)n_parts);
}

static void complete(struct process_inputs *given)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    long degree = inputs_integer(given, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, given->degree);
    size_t n = json_array_size(json_object_get(cohort, "surfaces"));

    inputs_check_memory(given, n, degree, TRAIN_COPIES, train_bytes(given->canonical, n, 1));
    classify_classes_check(given, cohort, SRNF_TRAIN_SUBJECTS_MIN, train_check_folds);
    train_check_names(given);
    if (!given->list->errors) {
        classify_set_covariates(given);
    }
    if (!given->list->errors) {
        (void)group_check_labels(given, json_object_get(cohort, "subjects"),
                                 json_object_get(cohort, "labels"), WHY_ONE_LABEL);
    }
}

static double seconds(const struct api_work *work, const json_t *canonical)
{
    double n = (double)(work->surfaces + work->meshes);
    double degree = json_number_value(json_object_get(canonical, "lmax"));

    return seconds_of_group(work, true) + seconds_of_folds(SRNF_METRIC_SRNF, n, degree) +
           seconds_of_label_permutations(true, n, 2.0, (double)SRNF_RELABELLINGS) +
           seconds_of_inversion(degree);
}

/* ---- Running --------------------------------------------------------------------------------- */

static struct train_answer answer_of(const struct train *train)
{
    size_t n_parts = train->parts.n_parts;
    struct train_answer answer = {.n_parts = n_parts ? n_parts : 1, .several = n_parts > 0};
    struct srnf_train_options *options = &answer.options;

    answer.n = train->parts.group.n / answer.n_parts;
    *options = srnf_train_options_defaults();
    options->gauss = train->method == 0;
    options->registration = registration_defaults(train->parts.mean.common_pose);
    options->components = (size_t)train->components;
    options->covariance = (enum srnf_covariance)train->covariance;
    options->priors = (enum srnf_priors)train->priors;
    options->subjects = answer.several ? NULL : train->parts.group.subjects;
    options->n_features = (train->scale ? answer.n_parts : 0) + json_array_size(train->covariates);
    options->feature_weight = train->size_weight;
    options->n_parts = answer.n_parts;
    options->weights = answer.several ? train->parts.weights : NULL;
    options->position_weight = answer.several ? train->parts.pose_weight : 1.0;
    return answer;
}

static int load(struct jobs_run *run, const struct train *train, struct train_answer *answer,
                struct jobs_result *result)
{
    const struct group_input *group = &train->parts.group;
    size_t missing;
    bool found = answer->several ? classify_parts_classes(group->cohort, &answer->classes)
                                 : classify_classes_find(group->cohort, group->subjects,
                                                         &answer->classes, &missing);

    int status =
        found ? group_load(run, group, true, (size_t)train->parts.mean.lmax, &answer->group, result)
              : compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");

    if (status == 0 && train->parts.relative_pose) {
        answer->options.positions = answer->positions =
            pca_parts_positions(run, group, answer->n, answer->n_parts, &answer->group, result);
        status = answer->positions ? 0 : -1;
    }
    return status;
}

static int compute(struct jobs_run *run, const struct train *train, struct train_answer *answer,
                   struct jobs_result *result)
{
    const struct group_input *group = &train->parts.group;
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = load(run, train, answer, result);

    if (status) {
        return status;
    }
    status = jobs_transform_acquire(jobs_run_jobs(run), answer->group.degree,
                                    SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    jobs_run_phase(run, 95.0);
    jobs_run_keep_parts(run);
    compute_searches_spread(run);
    answer->n_theta = srnf_sht_grid(sht)->n_theta;
    answer->n_phi = srnf_sht_grid(sht)->n_phi;
    status = classify_numbers(run, sht, group, &answer->group, answer->n,
                              train->scale ? answer->n_parts : 0,
                              json_object_get(group->cohort, "values"), &answer->numbers);
    answer->options.features = answer->numbers;
    status = status ? status
                    : srnf_train(sht, answer->n, answer->group.surfaces, answer->classes.labels,
                                 answer->classes.count, &answer->options, jobs_run_context(run),
                                 &answer->trained, &error);
    jobs_transform_release(jobs_run_jobs(run), sht);
    status = status ? compute_fail(result, status, &error, "training the classifier") : 0;
    if (status == SRNF_ENUMERIC) {
        const struct classify_constants constants = {.covariates = train->covariates,
                                                     .sizes = train->scale ? answer->n_parts : 0,
                                                     .n = answer->n,
                                                     .numbers = answer->numbers,
                                                     .labels = answer->classes.labels};

        error.element = -1; /* of an inner fold */
        classify_name_constant(&constants, &error, result);
    }
    return status;
}

/* ---- Results --------------------------------------------------------------------------------- */

static json_t *members_json(const struct train_answer *answer, const json_t *subjects)
{
    const struct srnf_trained *trained = &answer->trained;
    const struct classify_classes *classes = &answer->classes;
    bool gauss = trained->classifier.gauss;
    json_t *array = json_array();

    for (size_t i = 0; i < classes->n; i++) {
        json_t *evidence = json_object();

        for (size_t c = 0; c < classes->count; c++) {
            double value = trained->evidence[i * classes->count + c];

            (void)json_object_set_new(evidence, classes->names[c],
                                      json_finite(gauss ? value : -value + 0.0));
        }
        (void)json_array_append_new(
            array,
            json_pack("{s:O, s:s, s:s, s:o, s:o, s:o}", "subject", json_array_get(subjects, i),
                      "label", classes->names[classes->labels[i]], "predicted",
                      classes->names[trained->assessment.predicted[i]], "probabilities",
                      assessment_by_class(trained->probabilities + i * classes->count,
                                          classes->count, classes->names),
                      gauss ? "logLikelihoods" : "nearestDistances", evidence, "components",
                      trained->components ? json_integer((json_int_t)trained->components[i])
                                          : json_null()));
    }
    return array;
}

static json_t *refitted_json(const struct srnf_train_options *options)
{
    static const char *const parts[] = {
        "template: the medoid",
        "registrations to it",
        "calibration of the probabilities, by folds of their own",
        "mean",
        "principal components",
        "class means and covariances",
        "number of components and kind of covariance, where open",
        "what numbers beside shape weigh in distances",
    };
    size_t all = sizeof parts / sizeof parts[0];
    json_t *list = json_array();

    for (size_t i = 0; i < (options->gauss ? all - 1 : 3); i++) {
        (void)json_array_append_new(list, json_string(parts[i]));
    }
    if (!options->gauss && options->n_features > 0) {
        (void)json_array_append_new(list, json_string(parts[all - 1]));
    }
    return list;
}

static bool warn(struct jobs_run *run, const struct train *train, const struct train_answer *answer,
                 json_t *document, struct jobs_result *result)
{
    const struct group_input *group = &train->parts.group;
    const struct group_doubts doubts = {.surfaces = group->surfaces,
                                        .cohort = group->cohort,
                                        .group = &answer->group,
                                        .pairs = answer->trained.pairs,
                                        .classes = answer->classes.labels,
                                        .n_classes = answer->classes.count,
                                        .names = answer->classes.names,
                                        .rotates = !train->parts.mean.common_pose,
                                        .members = true,
                                        .mirrors = true};

    assessment_warn(warnings_of(document), NULL, answer->classes.count,
                    answer->trained.assessment.confusion, &answer->trained.assessment.balanced,
                    answer->classes.names);
    group_warn_duplicates(run, document, group->surfaces, group->cohort,
                          (const char(*)[STORE_ID_MAX])answer->group.contents);
    if (answer->several) {
        return train_parts_warn(run, train, answer, document, result);
    }
    warnings_put(document, handedness_of_names(run, group->surfaces, group->cohort));
    return group_doubts_warn(run, &doubts, document, result);
}

/* What train has beside train-parts, and the other way round. */
static void set_members(const struct train_answer *answer, json_t *document)
{
    if (answer->several) {
        (void)json_object_set(document, "parts", answer->parts);
        (void)json_object_set(document, "positions", answer->places);
    } else {
        (void)json_object_set_new(document, "members", json_integer((json_int_t)answer->n));
        (void)json_object_set_new(document, "relativeEnergy",
                                  json_finite(answer->mean_energies[0]));
    }
}

static json_t *document_of(struct jobs_run *run, const struct train *train,
                           const struct train_answer *answer, json_t *record,
                           struct jobs_result *result)
{
    const struct group_input *group = &train->parts.group;
    const struct classify_classes *classes = &answer->classes;
    size_t n_subjects = answer->several ? answer->n : group->n_subjects;
    json_t *subjects =
        group_subjects(run, group->surfaces, json_object_get(group->cohort, "subjects"));
    json_t *names = json_array();
    json_t *document;

    for (size_t c = 0; c < classes->count; c++) {
        (void)json_array_append_new(names, json_string(classes->names[c]));
    }
    document = json_pack("{s:o, s:o, s:o, s:o, s:o, s:I, s:I, s:o}", "model", record, "validation",
                         assessment_json(&answer->trained.assessment, classes->names), "perSubject",
                         members_json(answer, subjects), "classes", names, "refitted",
                         refitted_json(&answer->options), "subjects", (json_int_t)n_subjects,
                         "lmax", (json_int_t)answer->group.degree, "registration",
                         registration_json(&answer->options.registration));
    (void)json_object_set_new(document, "features",
                              classify_number_names(train->scale != 0,
                                                    json_object_get(group->cohort, "parts"),
                                                    train->covariates));
    set_members(answer, document);
    routes_set_bridged(document, group->n, group->ids, answer->group.bridged);
    json_decref(subjects);
    if (!warn(run, train, answer, document, result)) {
        json_decref(document);
        return NULL;
    }
    return document;
}

json_t *train_run(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct train *train = typed;
    struct train_answer answer = answer_of(train);
    json_t *document = NULL, *record = NULL;

    if (compute(run, train, &answer, result) == 0) {
        record = train_keep(run, train, &answer, result);
    }
    if (record) {
        document = document_of(run, train, &answer, record, result);
    }
    srnf_trained_clear(&answer.trained);
    srnf_free(answer.numbers);
    srnf_free(answer.positions);
    json_decref(answer.parts);
    json_decref(answer.places);
    classify_classes_clear(&answer.classes);
    compute_group_clear(&answer.group);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct train),
    .complete = complete,
    .run = train_run,
};

const struct api_process train_process = {
    .id = "train",
    .title = "Training of a classifier",
    .description = "A classifier of a labelled cohort, kept as a model, with calibrated "
                   "probabilities and the nested validation of all that was chosen.",
    .methods =
        "A classifier was trained on square-root normal fields (SRNFs) of the shapes and assessed "
        "by nested cross-validation over subjects, in which all choices and the calibration of "
        "the probabilities were made anew in each fold",
    .table = &table,
    .seconds = seconds,
};
