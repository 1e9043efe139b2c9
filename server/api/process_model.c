/*
 * process_model.c - the processes that use a model: modes, sample and project. Canonical inputs
 * and result documents.
 *
 * modes takes points c sqrt(lambda_k) along one mode, in units of its standard deviation. They are
 * inverted outwards from the mean on either side, each from its neighbour nearer to the mean.
 * sample draws scores from the normal distribution of the model, the same ones from the same seed
 * on every machine, and inverts each from the mean. Neither point need be the SRNF of a surface:
 * relativeEnergy says how far from one it is.
 *
 * Every surface names the mean as its reference, from which the deformation in its mesh is
 * measured.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/models.h"
#include "api/process_group.h"
#include "api/process_routes.h"
#include "api/registration_options.h"
#include "api/surfaces.h"
#include "api/typicality.h"
#include "jobs/compute_model.h"

static const char *const modes_names[] = {"model", "mode", "coefficients", NULL};
static const char *const sample_names[] = {"model", "count", "seed", "components", NULL};
static const char *const project_names[] = {"model", "surface", NULL};

/* ---- Canonical inputs ------------------------------------------------------------------------ */

bool inputs_model(struct process_inputs *inputs, struct store_model *model)
{
    const char *id = json_string_value(json_object_get(inputs->given, "model"));
    int status;

    *model = (struct store_model){.record = NULL};
    if (!id || strncmp(id, "model-", 6) != 0 || strlen(id) != 38 ||
        strspn(id + 6, "0123456789abcdef") != 32) {
        problem_add(inputs->list, "/inputs/model",
                    "must be the id of a model: model- and 32 hexadecimal digits");
        return false;
    }
    status = call_sees(inputs->call, id);
    if (status == 0) {
        status = store_model_get_as(inputs->call->api->config.store,
                                    inputs->call->request->caller.name, id, 0, model);
    }
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-model", id);
        inputs->answered = true;
        return false;
    }
    inputs->call->work.degree = (long)model->lmax;
    (void)json_object_set_new(inputs->canonical, "model", json_string(id));
    return true;
}

/* The model of the input; its components, or 0 with a problem noted or answered. */
static long read_model(struct process_inputs *inputs)
{
    struct store_model model;
    long components = inputs_model(inputs, &model) ? (long)model.components : 0;

    store_model_clear(&model);
    return components;
}

json_t *modes_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    static const double fallback[] = {-2.0, -1.0, 0.0, 1.0, 2.0};
    struct process_inputs inputs;
    long components;

    if (!inputs_open(&inputs, call, given, list, modes_names)) {
        return NULL;
    }
    inputs_numbers(&inputs, "coefficients", PROCESS_COEFFICIENTS_MAX, PROCESS_DEVIATIONS_MAX,
                   sizeof fallback / sizeof fallback[0], fallback);
    components = read_model(&inputs);
    (void)inputs_integer(&inputs, "mode", 1, components ? components : PROCESS_COMPONENTS_MAX, 1);
    return inputs_close(&inputs);
}

json_t *sample_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    long components;

    if (!inputs_open(&inputs, call, given, list, sample_names)) {
        return NULL;
    }
    (void)inputs_integer(&inputs, "count", 1, PROCESS_SAMPLES_MAX, 1);
    (void)inputs_integer(&inputs, "seed", 0, PROCESS_SEED_MAX, 0);
    components = read_model(&inputs);
    components = components ? components : PROCESS_COMPONENTS_MAX;
    (void)inputs_integer(&inputs, "components", 1, components, components);
    return inputs_close(&inputs);
}

json_t *project_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    long degree;

    if (!inputs_open(&inputs, call, given, list, project_names)) {
        return NULL;
    }
    if (read_model(&inputs)) {
        (void)inputs_surface(&inputs, "surface", &degree);
    } else if (!json_is_string(json_object_get(given, "surface"))) {
        problem_add(list, "/inputs/surface", "is required: the id of a surface or a mesh");
    }
    return inputs_close(&inputs);
}

/* ---- Surfaces of a model --------------------------------------------------------------------- */

/* Stores what was inverted; the records, or NULL with the problem set. names: char[n][64]. */
static json_t *keep_surfaces(struct jobs_run *run, const char *process,
                             const struct compute_model *model,
                             const struct compute_reconstruction *points, const char (*names)[64],
                             struct jobs_result *result)
{
    size_t degree = (size_t)model->stored.lmax, count = 3 * srnf_coefficient_count(degree);
    double scale = process_scale(run, model->stored.mean, 0.0);
    const char *mean = model->stored.mean, *route = routes_common(run, 1, &mean, NULL);
    json_t *records = json_array(), *record;

    for (size_t i = 0; i < points->n; i++) {
        struct surface_description description = {
            .name = names[i],
            .degree = degree,
            .coefficients = points->coefficients + i * count,
            .scale = scale,
            .measures = &points->measures[i],
            .parameterization = "inherited",
            .route = route,
            .source = process_source(run, process, NULL, model->stored.mean),
        };

        record = process_keep_surface(run, &description, "a surface of the model", result);
        if (!record) {
            json_decref(records);
            return NULL;
        }
        (void)json_array_append_new(records, record);
    }
    return records;
}

/* Of the points on the same side of the mean, the farthest one that is nearer to it than point i;
   n: the mean itself. Of equal ones the first comes before the others. */
static size_t point_before(const double *coefficients, size_t n, size_t i)
{
    double own = fabs(coefficients[i]);
    size_t best = n;

    for (size_t j = 0; j < n; j++) {
        double other = fabs(coefficients[j]);
        bool same_side = coefficients[j] * coefficients[i] > 0.0;

        if (same_side && (other < own || (other == own && j < i)) &&
            (best == n || other >= fabs(coefficients[best]))) {
            best = j;
        }
    }
    return best;
}

void modes_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document, *surfaces;
    const json_t *given = json_object_get(inputs, "coefficients");
    size_t n = json_array_size(given), mode, before[PROCESS_COEFFICIENTS_MAX] = {0};
    double coefficients[PROCESS_COEFFICIENTS_MAX] = {0}, deviation, *scores = NULL;
    char names[PROCESS_COEFFICIENTS_MAX][64];
    struct compute_model model = {0};
    struct compute_reconstruction points = {0};

    (void)api;
    if (!inputs || compute_model_load(run, json_string_value(json_object_get(inputs, "model")),
                                      &model, result)) {
        goto out;
    }
    mode = (size_t)json_integer_value(json_object_get(inputs, "mode"));
    deviation = sqrt(model.pca.eigenvalues[mode - 1]);
    scores = srnf_alloc(n * model.pca.components, sizeof(double));
    if (!scores) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "preparing the modes");
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        coefficients[i] = json_number_value(json_array_get(given, i));
        scores[i * model.pca.components + mode - 1] = coefficients[i] * deviation;
        (void)snprintf(names[i], sizeof names[i], "mode %zu, %+.4g sd", mode, coefficients[i]);
    }
    for (size_t i = 0; i < n; i++) {
        before[i] = point_before(coefficients, n, i);
    }
    if (compute_reconstruct(run, &model, n, scores, before, &points, result)) {
        goto out;
    }
    surfaces = keep_surfaces(run, "modes", &model, &points, names, result);
    if (surfaces) {
        document = json_object();
        (void)json_object_set_new(document, "surfaces", surfaces);
        (void)json_object_set_new(document, "coefficients", json_vector(coefficients, n));
        (void)json_object_set_new(document, "standardDeviation", json_finite(deviation));
        (void)json_object_set_new(document, "relativeEnergy",
                                  json_vector(points.relative_energy, n));
        process_finish(run, document, inputs, result);
    }
out:
    compute_reconstruction_clear(&points);
    srnf_free(scores);
    compute_model_clear(&model);
    json_decref(inputs);
}

/* ---- Samples --------------------------------------------------------------------------------- */

/* Scores of all samples in all components, zero beyond those that are drawn: double[n][k]. */
static double *draw(const struct compute_model *model, uint64_t seed, size_t n, size_t components)
{
    size_t all = model->pca.components;
    double *scores = srnf_alloc(n * all, sizeof(double));
    double *drawn = srnf_alloc(n * components, sizeof(double));

    if (scores && drawn) {
        srnf_pca_sample(&model->pca, seed, n, components, drawn);
        for (size_t i = 0; i < n; i++) {
            memcpy(scores + i * all, drawn + i * components, components * sizeof(double));
        }
    } else {
        srnf_free(scores);
        scores = NULL;
    }
    srnf_free(drawn);
    return scores;
}

void sample_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document, *surfaces;
    size_t n = (size_t)json_integer_value(json_object_get(inputs, "count"));
    size_t components = (size_t)json_integer_value(json_object_get(inputs, "components"));
    long long seed = json_integer_value(json_object_get(inputs, "seed"));
    struct compute_model model = {0};
    struct compute_reconstruction points = {0};
    size_t shape[2] = {n, 0}, before[PROCESS_SAMPLES_MAX];
    char names[PROCESS_SAMPLES_MAX][64];
    double *scores = NULL;

    (void)api;
    if (!inputs || compute_model_load(run, json_string_value(json_object_get(inputs, "model")),
                                      &model, result)) {
        goto out;
    }
    scores = draw(&model, (uint64_t)seed, n, components);
    if (!scores) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "drawing the samples");
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        before[i] = n;
        (void)snprintf(names[i], sizeof names[i], "sample %zu, seed %lld", i + 1, seed);
    }
    if (compute_reconstruct(run, &model, n, scores, before, &points, result)) {
        goto out;
    }
    surfaces = keep_surfaces(run, "sample", &model, &points, names, result);
    if (surfaces) {
        shape[1] = model.pca.components;
        document = json_object();
        (void)json_object_set_new(document, "surfaces", surfaces);
        (void)json_object_set_new(document, "scores", json_nested(scores, 2, shape));
        (void)json_object_set_new(document, "relativeEnergy",
                                  json_vector(points.relative_energy, n));
        process_finish(run, document, inputs, result);
    }
out:
    compute_reconstruction_clear(&points);
    srnf_free(scores);
    compute_model_clear(&model);
    json_decref(inputs);
}

/* ---- Projection ------------------------------------------------------------------------------ */

/* The subjects of a model, from its record; srnf_free releases what subjects points to. */
struct subjects {
    struct compute_subjects view;
    const char **contents;
    double *numbers; /* residuals, then distances */
};

static void subjects_clear(struct subjects *subjects)
{
    srnf_free(subjects->contents);
    srnf_free(subjects->numbers);
}

/* made is borrowed for as long as subjects is used. No subjects where the record does not tell. */
static int read_subjects(const json_t *made, size_t n, struct subjects *subjects)
{
    const json_t *contents = json_object_get(made, "contents");
    const json_t *residuals = json_object_get(made, "residuals");
    const json_t *distances = json_object_get(made, "distances");

    *subjects = (struct subjects){0};
    if (json_array_size(contents) != n || json_array_size(residuals) != n ||
        json_array_size(distances) != n) {
        return 0;
    }
    subjects->contents = srnf_alloc(n, sizeof *subjects->contents);
    subjects->numbers = srnf_alloc(2 * n, sizeof(double));
    if (!subjects->contents || !subjects->numbers) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        const char *content = json_string_value(json_array_get(contents, i));

        subjects->contents[i] = content ? content : "";
        subjects->numbers[i] = json_number_value(json_array_get(residuals, i));
        subjects->numbers[n + i] = json_number_value(json_array_get(distances, i));
    }
    subjects->view = (struct compute_subjects){.n = n,
                                               .contents = subjects->contents,
                                               .residuals = subjects->numbers,
                                               .distances = subjects->numbers + n};
    return 0;
}

void project_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document, *made = NULL;
    const struct srnf_register_options *registration = NULL;
    struct srnf_register_options options;
    struct compute_model model = {0};
    struct compute_projection projection = {0};
    struct subjects subjects = {0};

    (void)api;
    if (!inputs || compute_model_load(run, json_string_value(json_object_get(inputs, "model")),
                                      &model, result)) {
        goto out;
    }
    made = model_made_from(&model.stored);
    if (registration_read(json_object_get(made, "registration"), &options)) {
        registration = &options;
    }
    if (read_subjects(made, model.pca.n, &subjects)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the model");
        goto out;
    }
    if (compute_project(run, &model, json_string_value(json_object_get(inputs, "surface")),
                        registration, &subjects.view, &projection, result) ||
        !process_finite(model.pca.components, projection.scores, "the scores", result)) {
        goto out;
    }
    document = json_object();
    (void)json_object_set_new(document, "scores",
                              json_vector(projection.scores, model.pca.components));
    (void)json_object_set_new(document, "trainingSubject",
                              json_boolean(projection.training_subject));
    (void)json_object_set_new(document, "residual", json_finite(projection.residual));
    (void)json_object_set_new(document, "distance", json_finite(projection.distance));
    (void)json_object_set_new(document, "distanceBefore", json_finite(projection.distance_before));
    (void)json_object_set_new(document, "registration", registration_json(registration));
    typicality_set_projection(document, &model, &projection);
    process_finish(run, document, inputs, result);
out:
    srnf_free(projection.scores);
    subjects_clear(&subjects);
    json_decref(made);
    compute_model_clear(&model);
    json_decref(inputs);
}
