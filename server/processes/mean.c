/*
 * mean.c - the processes mean and pca over HTTP: canonical inputs and result documents.
 *
 * A mean that has not converged within maxIterations is a result, with converged false. Its scale
 * is the mean of its members' scales.
 *
 * pca makes a model: mean SRNF, modes, eigenvalues and scores, stored under the hash of their
 * content. Its record keeps what it was made from and how its members were registered, which is
 * how project registers others; and for each member the id of its surface, its distance from the
 * mean and its residual, by which project knows the member again.
 */
#include "processes/mean.h"

#include <stdlib.h>
#include <string.h>

#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "api/json_memory.h"
#include "api/models.h"
#include "toolkit/routes.h"
#include "toolkit/registration_options.h"
#include "api/surfaces.h"
#include "toolkit/typicality.h"
#include "api/warnings.h"

static const char *const mean_names[] = {"surfaces",    "cohort", "register", "commonPose",
                                         "tolerance",   "method", "lmax",     "maxIterations",
                                         "mixedRoutes", NULL};
static const char *const pca_names[] = {"surfaces",   "cohort",      "register", "commonPose",
                                        "tolerance",  "method",      "lmax",     "maxIterations",
                                        "components", "mixedRoutes", NULL};
static const char *const mean_methods[] = {"srnf", "pullback", NULL};
static const char *const methods[] = {"srnf", NULL}; /* of all that needs the mean SRNF itself */

/* Fields that are held for each surface: q and the warp on the grid; with modes and their copy. */
#define COPIES_MEAN 4
#define COPIES_PCA 6
/* Of the pulled-back mean: 200 bytes for each point of each surface of its 8 segments
   (srnf_pullback_mean), in fields of 24. */
#define COPIES_PULLBACK (COPIES_MEAN + 8 * 200 / 24)

/* ---- Canonical inputs ------------------------------------------------------------------------ */

/* method apart. */
static void read_options(struct process_inputs *inputs)
{
    (void)inputs_boolean(inputs, "register", true);
    (void)inputs_boolean(inputs, "commonPose", false);
    (void)inputs_real(inputs, "tolerance", PROCESS_MEAN_TOLERANCE_MIN, PROCESS_MEAN_TOLERANCE_MAX,
                      PROCESS_MEAN_TOLERANCE_DEFAULT);
    (void)inputs_integer(inputs, "maxIterations", 1, PROCESS_MEAN_ITERATIONS_MAX,
                         PROCESS_MEAN_ITERATIONS_DEFAULT);
}

void inputs_mean_options(struct process_inputs *inputs)
{
    read_options(inputs);
    (void)inputs_choice(inputs, "method", methods);
}

void inputs_mean_degree(struct process_inputs *inputs, size_t n, long degree, size_t copies)
{
    degree = inputs_integer(inputs, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, degree);
    if (n) {
        inputs_check_memory(inputs, n, degree, copies);
    }
}

/* Group and degree, after the options. */
static size_t read_group(struct process_inputs *inputs, size_t copies)
{
    long degree = PROCESS_DEGREE_DEFAULT;
    size_t n = 0;

    if (!inputs->list->errors) {
        n = inputs_group(inputs, &degree);
    }
    inputs_mean_degree(inputs, n, degree, copies);
    return n;
}

json_t *mean_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    bool pullback;
    size_t n;

    if (!inputs_open(&inputs, call, given, list, mean_names)) {
        return NULL;
    }
    read_options(&inputs);
    pullback = strcmp(inputs_choice(&inputs, "method", mean_methods), "pullback") == 0;
    n = read_group(&inputs, pullback ? COPIES_PULLBACK : COPIES_MEAN);
    if (pullback && n > PROCESS_PULLBACK_GROUP_MAX) {
        problem_add(list, "/inputs/method", "pullback takes up to %d surfaces; there are %zu",
                    PROCESS_PULLBACK_GROUP_MAX, n);
    }
    return inputs_close(&inputs);
}

json_t *pca_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;

    if (!inputs_open(&inputs, call, given, list, pca_names)) {
        return NULL;
    }
    (void)inputs_integer_or_null(&inputs, "components", 1, PROCESS_COMPONENTS_MAX);
    inputs_mean_options(&inputs);
    (void)read_group(&inputs, COPIES_PCA);
    return inputs_close(&inputs);
}

bool mean_inputs(struct jobs_run *run, const json_t *inputs, size_t n, const char *const *ids,
                 struct compute_mean_inputs *typed, struct srnf_register_options *options,
                 struct jobs_result *result)
{
    const char *method = json_string_value(json_object_get(inputs, "method"));

    *options = registration_defaults(json_is_true(json_object_get(inputs, "commonPose")));
    *typed = (struct compute_mean_inputs){
        .n = n,
        .ids = ids,
        .mirrored = group_mirrored(json_object_get(inputs, "cohort")),
        .degree = (size_t)json_integer_value(json_object_get(inputs, "lmax")),
        .tolerance = json_number_value(json_object_get(inputs, "tolerance")),
        .max_iterations = (size_t)json_integer_value(json_object_get(inputs, "maxIterations")),
        .components = (size_t)json_integer_value(json_object_get(inputs, "components")),
    };
    typed->pullback = method && strcmp(method, "pullback") == 0;
    if (json_is_true(json_object_get(inputs, "register"))) {
        typed->registration = options;
    }
    typed->origins = ids ? routes_bridges(run,
                                          json_is_true(json_object_get(inputs, "mixedRoutes")) &&
                                              !json_is_false(json_object_get(inputs, "register")),
                                          n, ids)
                         : NULL;
    if (!typed->origins) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    }
    return typed->origins != NULL;
}

/* The same with what it borrows, to be freed with srnf_free. */
struct borrowed {
    struct srnf_register_options options;
    const char **ids;
    size_t *subjects;
};

static bool typed_inputs(struct jobs_run *run, const json_t *inputs,
                         struct compute_mean_inputs *typed, struct borrowed *borrowed,
                         struct jobs_result *result)
{
    size_t n = 0, count, largest;

    borrowed->ids = group_ids(json_object_get(inputs, "surfaces"), &n);
    if (!mean_inputs(run, inputs, n, borrowed->ids, typed, &borrowed->options, result)) {
        return false;
    }
    borrowed->subjects = group_subject_numbers(
        json_object_get(json_object_get(inputs, "cohort"), "subjects"), n, &count, &largest);
    typed->subjects = borrowed->subjects;
    if (!borrowed->subjects) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    }
    return borrowed->subjects != NULL;
}

/* ---- The mean -------------------------------------------------------------------------------- */

json_t *mean_keep_surface(struct jobs_run *run, const char *process, const char *name,
                          const struct compute_mean_inputs *typed,
                          const struct compute_mean_outputs *outputs, const struct store_maps *maps,
                          struct jobs_result *result)
{
    struct surface_description description = {
        .name = name,
        .degree = outputs->group.degree,
        .coefficients = outputs->mean.coefficients,
        .measures = &outputs->measures,
        .parameterization = "inherited",
        .route = routes_of_group(run, typed->n, typed->ids, outputs->group.bridged),
        .source = process_source(run, process, NULL, NULL),
        .maps = maps,
    };

    for (size_t i = 0; i < typed->n; i++) {
        description.scale +=
            process_scale(run, typed->ids[i], outputs->group.scales[i]) / (double)typed->n;
    }
    return process_keep_surface(run, &description, "the mean", result);
}

static json_t *history_json(const struct srnf_mean *mean)
{
    json_t *history = json_array();

    for (size_t i = 0; i < mean->iterations; i++) {
        const struct srnf_mean_iteration *step = &mean->history[i];
        (void)json_array_append_new(history, json_pack("{s:I, s:o, s:o, s:o, s:o}", "iteration",
                                                       (json_int_t)i + 1, "change",
                                                       json_finite(step->change), "variance",
                                                       json_finite(step->variance), "objective",
                                                       json_finite(step->objective), "seconds",
                                                       json_finite(step->seconds)));
    }
    return history;
}

void mean_set_members(json_t *document, const struct compute_mean_inputs *typed,
                      const struct compute_mean_outputs *outputs)
{
    const struct srnf_mean *mean = &outputs->mean;

    (void)json_object_set_new(document, "iterations", json_integer((json_int_t)mean->iterations));
    (void)json_object_set_new(document, "converged", json_boolean(mean->converged));
    (void)json_object_set_new(document, "history", history_json(mean));
    (void)json_object_set_new(document, "relativeEnergy", json_finite(mean->relative_energy));
    (void)json_object_set_new(document, "seconds", json_finite(outputs->seconds));
    (void)json_object_set_new(document, "registration", registration_json(typed->registration));
    routes_set_bridged(document, typed->n, typed->ids, outputs->group.bridged);
}

bool mean_warn(struct jobs_run *run, const struct compute_mean_inputs *typed,
               const struct compute_mean_outputs *outputs, struct group_doubts doubts,
               json_t *document, struct jobs_result *result)
{
    doubts.group = &outputs->group;
    doubts.pairs = outputs->pairs;
    doubts.rotates = typed->registration && !typed->registration->common_pose;
    doubts.members = doubts.mirrors = true;
    return group_doubts_warn(run, &doubts, document, result);
}

/* What the results of mean and pca tell beside; false with the problem set. */
static bool set_members(struct jobs_run *run, json_t *document, const json_t *inputs,
                        const struct compute_mean_inputs *typed,
                        const struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    const struct group_doubts doubts = {.surfaces = json_object_get(inputs, "surfaces"),
                                        .cohort = json_object_get(inputs, "cohort")};
    const struct srnf_mean *mean = &outputs->mean;
    json_t *labels = group_labels(run, json_object_get(inputs, "surfaces"),
                                  json_object_get(json_object_get(inputs, "cohort"), "subjects"));

    mean_set_members(document, typed, outputs);
    typicality_warn_poses(warnings_of(document), outputs, typed->subjects, labels);
    (void)json_object_set_new(document, "labels", labels);
    (void)json_object_set_new(document, "groups", group_groups(json_object_get(inputs, "cohort")));
    (void)json_object_set_new(document, "distances", json_vector(mean->distances, mean->n));
    warnings_put(document, handedness_of_names(run, json_object_get(inputs, "surfaces"),
                                               json_object_get(inputs, "cohort")));
    group_warn_duplicates(run, document, json_object_get(inputs, "surfaces"),
                          json_object_get(inputs, "cohort"),
                          (const char(*)[STORE_ID_MAX])outputs->group.contents);
    return mean_warn(run, typed, outputs, doubts, document, result);
}

/* What the mean in the pulled-back metric came to; null for the other method. */
static json_t *pullback_document(const struct srnf_pullback_mean *pullback)
{
    if (pullback->n == 0) {
        return json_null();
    }
    return json_pack("{s:I, s:o, s:o, s:o, s:I, s:b, s:o}", "segments",
                     (json_int_t)srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH).segments,
                     "variance", json_finite(pullback->variance), "meanVelocity",
                     json_finite(pullback->mean_velocity), "moved", json_finite(pullback->moved),
                     "iterations", (json_int_t)pullback->iterations, "converged",
                     pullback->converged, "transforms", json_finite(pullback->transforms));
}

void mean_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document, *surface;
    struct compute_mean_inputs typed = {0};
    struct compute_mean_outputs outputs = {0};
    struct borrowed borrowed = {.ids = NULL};

    (void)api;
    if (!inputs) {
        return;
    }
    if (!typed_inputs(run, inputs, &typed, &borrowed, result) ||
        compute_mean(run, &typed, &outputs, result)) {
        goto out;
    }
    surface = mean_keep_surface(run, "mean", "mean", &typed, &outputs, NULL, result);
    if (surface) {
        document = json_object();
        (void)json_object_set_new(document, "surface", surface);
        (void)json_object_set_new(document, "pullback", pullback_document(&outputs.pullback));
        if (set_members(run, document, inputs, &typed, &outputs, result)) {
            process_finish(run, document, inputs, result);
        } else {
            json_decref(document);
        }
    }
out:
    compute_mean_clear(&outputs);
    srnf_free(typed.origins);
    srnf_free(borrowed.ids);
    srnf_free(borrowed.subjects);
    json_decref(inputs);
}

/* ---- Principal components -------------------------------------------------------------------- */

/* The ids that the members have as surfaces, those encoded here too. */
static json_t *contents_json(const struct compute_group *group)
{
    json_t *contents = json_array();

    for (size_t i = 0; i < group->n; i++) {
        (void)json_array_append_new(contents, json_string(group->contents[i]));
    }
    return contents;
}

static char *dump(const json_t *document)
{
    return json_memory_dumps(document, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
}

/* What the record of the model holds beside its numbers, and what of that is part of the model's
   id: all but the job. Both to be freed; NULL without memory. */
static void record_texts(struct jobs_run *run, const json_t *inputs,
                         const struct compute_mean_inputs *typed,
                         const struct compute_mean_outputs *outputs, char **text, char **identity)
{
    const json_t *cohort = json_object_get(json_object_get(inputs, "cohort"), "name");
    const json_t *subjects = json_object_get(json_object_get(inputs, "cohort"), "subjects");
    const json_t *mirrored = json_object_get(json_object_get(inputs, "cohort"), "mirrored");
    json_t *record = json_pack(
        "{s:o, s:{s:s, s:s, s:O, s:O?, s:O?, s:O?, s:o, s:o, s:o, s:o, s:o, s:o}}", "totalVariance",
        json_finite(outputs->pca.total_variance), "madeFrom", "process", "pca", "job",
        jobs_run_job_id(run), "surfaces", json_object_get(inputs, "surfaces"), "cohort", cohort,
        "subjects", subjects, "mirrored", mirrored, "labels",
        group_labels(run, json_object_get(inputs, "surfaces"),
                     json_object_get(json_object_get(inputs, "cohort"), "subjects")),
        "groups", group_groups(json_object_get(inputs, "cohort")), "registration",
        registration_json(typed->registration), "contents", contents_json(&outputs->group),
        "residuals", json_vector(outputs->residuals, outputs->mean.n), "distances",
        json_vector(outputs->mean.distances, outputs->mean.n));

    *text = record ? dump(record) : NULL;
    (void)json_object_del(json_object_get(record, "madeFrom"), "job");
    *identity = record ? dump(record) : NULL;
    json_decref(record);
}

/* A copy that the store can own; false without memory. */
static bool copy_array(struct store_model *model, enum store_model_array array, const double *from)
{
    size_t count = store_model_count(model, array);

    model->arrays[array] = malloc(count ? count * sizeof(double) : 1);
    if (model->arrays[array]) {
        memcpy(model->arrays[array], from, count * sizeof(double));
    }
    return model->arrays[array] != NULL;
}

static bool model_sound(const struct compute_mean_outputs *outputs, struct jobs_result *result)
{
    const struct srnf_pca *pca = &outputs->pca;
    size_t field = 3 * outputs->n_theta * outputs->n_phi;

    return process_finite(pca->components, pca->eigenvalues, "the eigenvalues", result) &&
           process_finite(pca->n * pca->components, pca->scores, "the scores", result) &&
           process_finite(pca->components * field, pca->modes, "the modes", result) &&
           process_finite(field, outputs->mean.mean_q, "the mean SRNF", result) &&
           process_finite(SRNF_CALIBRATION_TRAITS * outputs->calibration.n,
                          outputs->calibration.values, "the leave-one-out values", result);
}

/* Stores the model; its record with the mean's (taken over) in it, or NULL with the problem set. */
static json_t *keep_model(struct jobs_run *run, const json_t *inputs,
                          const struct compute_mean_inputs *typed,
                          const struct compute_mean_outputs *outputs, json_t *mean,
                          struct jobs_result *result)
{
    struct store_model model = {
        .lmax = (int64_t)outputs->group.degree,
        .n_theta = (int64_t)outputs->n_theta,
        .n_phi = (int64_t)outputs->n_phi,
        .subjects = (int64_t)outputs->pca.n,
        .components = (int64_t)outputs->pca.components,
        .owner = {.name = jobs_run_owner(run), .bytes_max = STORE_BYTES_KEPT}};
    const char *mean_id = json_string_value(json_object_get(mean, "id"));
    json_t *record = NULL;
    char *identity;
    bool created;
    int status = STORE_NOMEM;

    record_texts(run, inputs, typed, outputs, &model.record, &identity);
    model.identity = identity;
    if (mean_id && strlen(mean_id) < sizeof model.mean) {
        memcpy(model.mean, mean_id, strlen(mean_id) + 1);
    }
    if (model.record && identity && copy_array(&model, STORE_MODEL_MEAN_Q, outputs->mean.mean_q) &&
        copy_array(&model, STORE_MODEL_MODES, outputs->pca.modes) &&
        copy_array(&model, STORE_MODEL_EIGENVALUES, outputs->pca.eigenvalues) &&
        copy_array(&model, STORE_MODEL_SCORES, outputs->pca.scores) &&
        (outputs->calibration.n == 0 ||
         copy_array(&model, STORE_MODEL_CALIBRATION, outputs->calibration.values))) {
        status = store_model_put(jobs_run_store(run), &model, &created);
    }
    if (status) {
        (void)compute_fail_kept(run, result, status, "the model");
        json_decref(mean);
    } else {
        record = model_record(&model, mean);
    }
    free(identity);
    store_model_clear(&model);
    return record;
}

/* Variance of the first components together, as Davies has it. */
static json_t *compactness_json(const struct srnf_pca *pca)
{
    json_t *array = json_array();
    double sum = 0.0;

    for (size_t i = 0; i < pca->components; i++) {
        sum += pca->eigenvalues[i];
        (void)json_array_append_new(array, json_pack("{s:I, s:o}", "components", (json_int_t)i + 1,
                                                     "value", json_finite(sum)));
    }
    return array;
}

void pca_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document, *record;
    struct compute_mean_inputs typed = {0};
    struct compute_mean_outputs outputs = {0};
    struct borrowed borrowed = {.ids = NULL};

    (void)api;
    if (!inputs) {
        return;
    }
    if (!typed_inputs(run, inputs, &typed, &borrowed, result) ||
        compute_pca(run, &typed, &outputs, result) || !model_sound(&outputs, result)) {
        goto out;
    }
    record = mean_keep_surface(run, "pca", "mean", &typed, &outputs, NULL, result);
    if (record) {
        record = keep_model(run, inputs, &typed, &outputs, record, result);
    }
    if (record) {
        document = json_object();
        (void)json_object_set_new(document, "model", record);
        (void)json_object_set_new(document, "compactness", compactness_json(&outputs.pca));
        if (set_members(run, document, inputs, &typed, &outputs, result)) {
            process_finish(run, document, inputs, result);
        } else {
            json_decref(document);
        }
    }
out:
    compute_mean_clear(&outputs);
    srnf_free(typed.origins);
    srnf_free(borrowed.ids);
    srnf_free(borrowed.subjects);
    json_decref(inputs);
}
