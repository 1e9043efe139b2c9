/*
 * train.c - the process train: a classifier of a labelled cohort that is kept as a model, with its
 * nested validation (srnf/train.h).
 *
 * Labels and subjects are those of the cohort's members, as they were when the job was made, and
 * classes are in the order in which their labels first appear, as for classify. What the registered
 * surfaces come to is kept for a later attempt at the same job.
 */
#include "processes/train.h"

#include <string.h>

#include "api/warnings.h"
#include "compute/searches.h"
#include "compute/seconds.h"
#include "toolkit/assessment.h"
#include "toolkit/covariates.h"
#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"

/* Fields that are held for each surface: those of classify, the registered ones, and components. */
#define COPIES 16

#define WHY_ONE_LABEL                                                                          \
    "What is left out is a whole subject, whose label a classifier is asked for: it has one. " \
    "Take one member of each subject, or members of one label."

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

const char *const train_methods[] = {"srnf-gauss", "srnf-nn", NULL};
/* In the order of enum srnf_covariance and enum srnf_priors. */
static const char *const covariances[] = {"auto", "pooled", "class", NULL};
static const char *const priors[] = {"cohort", "equal", NULL};
static const char *const scales[] = {"shape", "shape-and-size", NULL};

#define AT(member) offsetof(struct train, member)
static const struct process_input inputs[] = {
    GROUP_MEMBERS_INPUTS(train, "Name of a cohort whose members have labels, each of them members "
                                "of five subjects at least."),
    {"method", INPUT_CHOICE, AT(method),
     "srnf-gauss: a normal distribution for each class on principal components of SRNFs; srnf-nn: "
     "the nearest neighbour by SRNFs.",
     .choices = train_methods},
    {"components", INPUT_OWN, AT(components),
     "Of the Gaussians; auto: chosen inside each fold, of 20 at most.",
     .own = &classify_components_own},
    {"covariance", INPUT_CHOICE, AT(covariance),
     "One for all classes, or one for each; auto: chosen inside each fold.",
     .choices = covariances},
    {"scale", INPUT_CHOICE, AT(scale), "Whether the log of the size counts beside shape.",
     .choices = scales},
    {"covariates", INPUT_OWN, AT(covariates),
     "Numbers of the members that count beside shape, by their names: predict then needs them of "
     "every surface.",
     .own = &covariates_names},
    {"sizeWeight", INPUT_REAL, AT(size_weight),
     "Of size, and of each covariate, in distances; at 1 it weighs as much as shape. Gaussians "
     "need none.",
     .highest = PROCESS_SIZE_WEIGHT_MAX, .fallback = 1},
    {"priors", INPUT_CHOICE, AT(priors),
     "What the probabilities take the classes to be before a surface is seen. cohort: their shares "
     "among the subjects; equal: as likely as each other.",
     .choices = priors},
    {"commonPose", INPUT_BOOLEAN, AT(common_pose),
     "The surfaces share a pose: no registration rotates.", .fallback = 0},
    {"lmax", INPUT_INTEGER, AT(lmax),
     "Degree of the classifier; surfaces are cut or filled up to it. Default: the largest of "
     "theirs. 15 is enough for most.",
     .lowest = SRNF_DEGREE_MIN, .highest = SRNF_DEGREE_MAX, .derived = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"model", OUTPUT_OBJECT,
     "Record of the model, of kind classifier: what one of pca has, about the template, and "
     "classifier: method, classes, members and subjects of each, priors, template {surface, "
     "member}, components, covariance, means and covariances of the Gaussians (the numbers beside "
     "shape first), features {size, names, values, factors} (numbers beside shape: whether size is "
     "one, those of each member, and "
     "what differences are multiplied by in distances), slope, offsets and "
     "targets of the calibration, nearest (of each member the distance to the nearest of another "
     "subject, left out) and validation."},
    {"validation", OUTPUT_OBJECT,
     "Nested: of each member, by a classifier in whose making its subject had no "
     "part: " ASSESSMENT_TEXT "."},
    {"perSubject", OUTPUT_OBJECTS,
     "Of each member, without its subject: [{subject, label, predicted, probabilities, and "
     "logLikelihoods or nearestDistances, of each class; components of its fold, or null}]."},
    {"classes", OUTPUT_STRINGS, "The labels, in the order in which they first appear."},
    {"features", OUTPUT_STRINGS, "The numbers beside shape: size, and covariates."},
    {"refitted", OUTPUT_STRINGS, "What is made again without the subject that is left out."},
    {"members", OUTPUT_INTEGER, "Of the cohort."},
    {"subjects", OUTPUT_INTEGER, "Members without a subject are subjects of their own."},
    {"relativeEnergy", OUTPUT_NUMBER_OR_NULL, "Of the mean: what is lost by being a surface."},
    {"lmax", OUTPUT_INTEGER, "Degree of the classifier."},
    BRIDGED_GROUP_OUTPUTS,
    REGISTRATION_OUTPUT,
    {NULL, NULL, NULL},
};

/* ---- What holds between inputs --------------------------------------------------------------- */

/* Whether the inner folds have training subjects enough for what is asked of them. */
static void check_folds(struct process_inputs *given, const struct classify_classes *classes,
                        size_t smallest)
{
    long components = (long)json_integer_value(json_object_get(given->canonical, "components"));
    bool open = !components || inputs_chose(given->canonical, "covariance", "auto");
    size_t features = (components ? (size_t)components : 1) +
                      inputs_chose(given->canonical, "scale", "shape-and-size") +
                      json_array_size(json_object_get(given->canonical, "covariates"));
    size_t determined;

    (void)smallest;
    determined =
        srnf_train_determined(classes->count, classes->subjects,
                              !inputs_chose(given->canonical, "covariance", "class"), open);
    if (inputs_chose(given->canonical, "method", train_methods[0]) && features > determined) {
        problem_add(given->list, components ? "/inputs/components" : "/inputs/covariance",
                    "asks for a covariance of %zu features, size and covariates counted; the "
                    "training subjects of an inner fold determine one of %zu",
                    features, determined);
    }
}

static void complete(struct process_inputs *given)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    long degree = inputs_integer(given, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, given->degree);

    inputs_check_memory(given, json_array_size(json_object_get(cohort, "surfaces")), degree, COPIES,
                        0.0);
    classify_classes_check(given, cohort, SRNF_TRAIN_SUBJECTS_MIN, check_folds);
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
           seconds_of_inversion(degree);
}

/* ---- Running --------------------------------------------------------------------------------- */

static struct srnf_train_options options_of(const struct train *train)
{
    struct srnf_train_options options = srnf_train_options_defaults();

    options.gauss = train->method == 0;
    options.registration = registration_defaults(train->common_pose);
    options.components = (size_t)train->components;
    options.covariance = (enum srnf_covariance)train->covariance;
    options.priors = (enum srnf_priors)train->priors;
    options.subjects = train->group.subjects;
    options.n_features = (train->scale != 0) + json_array_size(train->covariates);
    options.feature_weight = train->size_weight;
    return options;
}

static int compute(struct jobs_run *run, const struct train *train, struct train_answer *answer,
                   struct jobs_result *result)
{
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    size_t missing;
    int status;

    if (!classify_classes_find(train->group.cohort, train->group.subjects, &answer->classes,
                               &missing)) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    }
    status = group_load(run, &train->group, true, (size_t)train->lmax, &answer->group, result);
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
    status = classify_numbers(run, sht, &train->group, &answer->group, train->scale != 0,
                              json_object_get(train->group.cohort, "values"), &answer->numbers);
    answer->options.features = answer->numbers;
    status = status ? status
                    : srnf_train(sht, answer->group.n, answer->group.surfaces,
                                 answer->classes.labels, answer->classes.count, &answer->options,
                                 jobs_run_context(run), &answer->trained, &error);
    jobs_transform_release(jobs_run_jobs(run), sht);
    return status ? compute_fail(result, status, &error, "training the classifier") : 0;
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
    const struct group_input *group = &train->group;
    const struct group_doubts doubts = {.surfaces = group->surfaces,
                                        .cohort = group->cohort,
                                        .group = &answer->group,
                                        .classes = answer->classes.labels,
                                        .n_classes = answer->classes.count,
                                        .names = answer->classes.names,
                                        .rotates = !train->common_pose,
                                        .mirrors = true};

    group_warn_duplicates(run, document, group->surfaces, group->cohort,
                          (const char(*)[STORE_ID_MAX])answer->group.contents);
    warnings_put(document, handedness_of_names(run, group->surfaces, group->cohort));
    return group_doubts_warn(run, &doubts, document, result);
}

static json_t *document_of(struct jobs_run *run, const struct train *train,
                           const struct train_answer *answer, json_t *record,
                           struct jobs_result *result)
{
    const struct group_input *group = &train->group;
    const struct classify_classes *classes = &answer->classes;
    json_t *subjects =
        group_subjects(run, group->surfaces, json_object_get(group->cohort, "subjects"));
    json_t *names = json_array();
    json_t *document;

    for (size_t c = 0; c < classes->count; c++) {
        (void)json_array_append_new(names, json_string(classes->names[c]));
    }
    document = json_pack("{s:o, s:o, s:o, s:o, s:o, s:I, s:I, s:o, s:I, s:o}", "model", record,
                         "validation", assessment_json(&answer->trained.assessment, classes->names),
                         "perSubject", members_json(answer, subjects), "classes", names, "refitted",
                         refitted_json(&answer->options), "members", (json_int_t)classes->n,
                         "subjects", (json_int_t)group->n_subjects, "relativeEnergy",
                         json_finite(answer->mean_energy), "lmax", (json_int_t)answer->group.degree,
                         "registration", registration_json(&answer->options.registration));
    (void)json_object_set_new(document, "features",
                              classify_number_names(train->scale != 0, train->covariates));
    routes_set_bridged(document, group->n, group->ids, answer->group.bridged);
    json_decref(subjects);
    if (!warn(run, train, answer, document, result)) {
        json_decref(document);
        return NULL;
    }
    return document;
}

static json_t *run_train(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct train *train = typed;
    struct train_answer answer = {.options = options_of(train)};
    json_t *document = NULL, *record = NULL;

    if (compute(run, train, &answer, result) == 0) {
        record = train_keep(run, train, &answer, result);
    }
    if (record) {
        document = document_of(run, train, &answer, record, result);
    }
    srnf_trained_clear(&answer.trained);
    srnf_free(answer.numbers);
    classify_classes_clear(&answer.classes);
    compute_group_clear(&answer.group);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct train),
    .complete = complete,
    .run = run_train,
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
