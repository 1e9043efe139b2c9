/*
 * evaluate_model.c - the process evaluate-model over HTTP: canonical inputs and result document.
 *
 * Either a stored model is evaluated, whose mean and registration are what they were, or a group,
 * whose mean is computed first; the options of the mean then belong to the inputs, and with a model
 * they are refused.
 */
#include <string.h>

#include "toolkit/handedness.h"
#include "api/models.h"
#include "processes/mean.h"
#include "toolkit/registration_options.h"
#include "toolkit/typicality.h"
#include "api/warnings.h"
#include "compute/quality.h"

static const char *const names[] = {
    "model", "surfaces",      "cohort",     "register", "commonPose", "tolerance",   "method",
    "lmax",  "maxIterations", "components", "samples",  "seed",       "mixedRoutes", NULL};
/* What a model already has. */
static const char *const of_groups[] = {"surfaces",    "cohort", "register", "commonPose",
                                        "tolerance",   "method", "lmax",     "maxIterations",
                                        "mixedRoutes", NULL};

#define COPIES 6 /* fields of each surface: those of the mean, points, and a copy for the Gram */

/* ---- Canonical inputs ------------------------------------------------------------------------ */

/* Leaving a subject out takes three of them, and leaves a component less than the members that
   stay. subjects: of the n members, as group_subject_numbers takes them. */
static void check_subjects(struct process_inputs *inputs, const char *pointer, size_t n,
                           const json_t *subjects)
{
    json_int_t asked = json_integer_value(json_object_get(inputs->canonical, "components"));
    size_t count, largest;
    size_t *numbers = group_subject_numbers(subjects, n, &count, &largest);

    if (!numbers) {
        problem_add(inputs->list, pointer, "is too large for the memory there is");
    } else if (count < 3) {
        problem_add(inputs->list, pointer,
                    "has %zu surfaces of %zu subjects; leaving one out takes three at least", n,
                    count);
    } else if (asked > (json_int_t)(n - largest) - 1) {
        problem_add(inputs->list, "/inputs/components",
                    "is %lld; without a subject of %zu of the %zu surfaces there are at most %zu "
                    "components",
                    (long long)asked, largest, n, n - largest - 1);
    }
    srnf_free(numbers);
}

static void read_model_input(struct process_inputs *inputs)
{
    char pointer[48];
    struct store_model model = {.record = NULL};

    if (inputs_model(inputs, &model)) {
        json_t *made = model_made_from(&model);

        check_subjects(inputs, "/inputs/model", (size_t)model.subjects,
                       json_object_get(made, "subjects"));
        json_decref(made);
        store_model_clear(&model);
    }
    for (const char *const *name = of_groups; *name; name++) {
        const json_t *given = json_object_get(inputs->given, *name);

        if (given && !json_is_null(given)) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/%s", *name);
            problem_add(inputs->list, pointer, "belongs to a group; a model has its own");
        }
        (void)json_object_set_new(inputs->canonical, *name, json_null());
    }
}

static void read_group_input(struct process_inputs *inputs)
{
    long degree = PROCESS_DEGREE_DEFAULT;
    size_t n = 0;

    (void)json_object_set_new(inputs->canonical, "model", json_null());
    inputs_mean_options(inputs);
    if (!inputs->list->errors) {
        n = inputs_group(inputs, &degree);
    }
    if (n > 0) {
        check_subjects(inputs, "/inputs/surfaces", n,
                       json_object_get(json_object_get(inputs->canonical, "cohort"), "subjects"));
    }
    inputs_mean_degree(inputs, n, degree, COPIES);
}

json_t *evaluate_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    const json_t *model;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    (void)inputs_integer(&inputs, "samples", 2, PROCESS_QUALITY_SAMPLES_MAX,
                         PROCESS_QUALITY_SAMPLES_DEFAULT);
    (void)inputs_integer(&inputs, "seed", 0, PROCESS_SEED_MAX, 0);
    (void)inputs_integer_or_null(&inputs, "components", 1, PROCESS_COMPONENTS_MAX);
    model = json_object_get(given, "model");
    if (model && !json_is_null(model)) {
        read_model_input(&inputs);
    } else {
        read_group_input(&inputs);
    }
    return inputs_close(&inputs);
}

/* ---- Results --------------------------------------------------------------------------------- */

/* [{components, value, standardError, ..}]; elastic may be NULL. */
static json_t *curve_json(size_t components, const struct srnf_curve *curve,
                          const struct srnf_curve *elastic)
{
    json_t *array = json_array();

    for (size_t k = 0; k < components; k++) {
        json_t *point = json_pack("{s:I, s:o, s:o}", "components", (json_int_t)k + 1, "value",
                                  json_finite(curve->value[k]), "standardError",
                                  json_finite(curve->standard_error[k]));

        if (elastic) {
            (void)json_object_set_new(point, "elastic", json_finite(elastic->value[k]));
            (void)json_object_set_new(point, "elasticStandardError",
                                      json_finite(elastic->standard_error[k]));
        }
        (void)json_array_append_new(array, point);
    }
    return array;
}

static json_t *quality_json(const struct srnf_quality *quality)
{
    size_t k = quality->components;
    json_t *document = json_object();

    (void)json_object_set_new(document, "members", json_integer((json_int_t)quality->n));
    (void)json_object_set_new(document, "subjects", json_integer((json_int_t)quality->subjects));
    (void)json_object_set_new(document, "compactness", curve_json(k, &quality->compactness, NULL));
    (void)json_object_set_new(
        document, "generalisation",
        curve_json(k, &quality->generalisation, &quality->generalisation_elastic));
    (void)json_object_set_new(document, "specificity",
                              curve_json(k, &quality->specificity, &quality->specificity_elastic));
    (void)json_object_set_new(document, "refitted", json_pack("[s, s]", "mean", "components"));
    (void)json_object_set_new(document, "shared", json_pack("[s]", "registration"));
    return document;
}

/* What the store tells of the making of a model: its total variance, madeFrom (new reference, may
   be NULL), and the number of members. */
static double read_record(struct jobs_run *run, const char *id, json_t **made, size_t *n)
{
    struct store_model model = {.record = NULL};
    json_t *record = NULL;
    double total = 0.0;

    if (process_read(store_model_get_as(jobs_run_store(run), jobs_run_owner(run), id, 0, &model))) {
        record = json_loads(model.record ? model.record : "{}", 0, NULL);
        total = json_number_value(json_object_get(record, "totalVariance"));
        *made = json_incref(json_object_get(record, "madeFrom"));
        *n = (size_t)model.subjects;
    }
    json_decref(record);
    store_model_clear(&model);
    return total;
}

/* Subjects of n members into the options; false with the problem set. */
static bool set_subjects(const json_t *subjects, size_t n, struct srnf_quality_options *options,
                         size_t **numbers, struct jobs_result *result)
{
    size_t count, largest;

    *numbers = group_subject_numbers(subjects, n, &count, &largest);
    options->subjects = *numbers;
    if (!*numbers) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    }
    return *numbers != NULL;
}

static json_t *evaluate_group(struct jobs_run *run, const json_t *inputs,
                              struct srnf_quality_options *options, struct jobs_result *result)
{
    const json_t *subjects = json_object_get(json_object_get(inputs, "cohort"), "subjects");
    const struct group_doubts doubts = {.surfaces = json_object_get(inputs, "surfaces"),
                                        .cohort = json_object_get(inputs, "cohort")};
    struct compute_mean_inputs typed = {0};
    struct compute_mean_outputs mean = {0};
    struct srnf_register_options registration;
    struct srnf_quality quality = {0};
    json_t *document = NULL;
    size_t n = 0, *numbers = NULL;
    const char **ids = group_ids(json_object_get(inputs, "surfaces"), &n);

    if (mean_inputs(run, inputs, n, ids, &typed, &registration, result) &&
        set_subjects(subjects, n, options, &numbers, result)) {
        typed.subjects = numbers;
    }
    if (numbers && compute_quality_group(run, &typed, options, &mean, &quality, result) == 0) {
        document = quality_json(&quality);
        mean_set_members(document, &typed, &mean);
        warnings_put(document, handedness_of_names(run, json_object_get(inputs, "surfaces"),
                                                   json_object_get(inputs, "cohort")));
        group_warn_duplicates(run, document, json_object_get(inputs, "surfaces"),
                              json_object_get(inputs, "cohort"),
                              (const char(*)[STORE_ID_MAX])mean.group.contents);
        typicality_warn_poses(warnings_of(document), &mean, numbers, NULL);
        if (!mean_warn(run, &typed, &mean, doubts, document, result)) {
            json_decref(document);
            document = NULL;
        }
    }
    srnf_quality_clear(&quality);
    compute_mean_clear(&mean);
    srnf_free(typed.origins);
    srnf_free(numbers);
    srnf_free(ids);
    return document;
}

static json_t *evaluate_model(struct jobs_run *run, const char *id,
                              struct srnf_quality_options *options, struct jobs_result *result)
{
    struct srnf_quality quality = {0};
    json_t *document = NULL, *made = NULL;
    size_t *numbers = NULL, n = 0;
    double total = read_record(run, id, &made, &n);
    const json_t *subjects = json_object_get(made, "subjects");

    if (set_subjects(subjects, n, options, &numbers, result) &&
        compute_quality_model(run, id, total, options, &quality, result) == 0) {
        document = quality_json(&quality);
        group_warn_duplicates(run, document, json_object_get(made, "surfaces"), made, NULL);
    }
    srnf_quality_clear(&quality);
    srnf_free(numbers);
    json_decref(made);
    return document;
}

void evaluate_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document;
    const char *model = json_string_value(json_object_get(inputs, "model"));
    struct srnf_quality_options options = srnf_quality_options_defaults();

    (void)api;
    if (!inputs) {
        return;
    }
    options.components = (size_t)json_integer_value(json_object_get(inputs, "components"));
    options.samples = (size_t)json_integer_value(json_object_get(inputs, "samples"));
    options.seed = (uint64_t)json_integer_value(json_object_get(inputs, "seed"));
    document = model ? evaluate_model(run, model, &options, result)
                     : evaluate_group(run, inputs, &options, result);
    if (document) {
        process_finish(run, document, inputs, result);
    }
    json_decref(inputs);
}
