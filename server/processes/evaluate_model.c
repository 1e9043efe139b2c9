/*
 * evaluate_model.c - the process evaluate-model: how compact, general and specific a model is.
 *
 * Either a stored model is evaluated, whose mean and registration are what they were, or a group,
 * whose mean is computed first; the options of the mean then belong to the inputs, and with a model
 * they are refused.
 *
 * A stored model holds its subjects as scores. Where it keeps all components they are the
 * registered SRNFs themselves; where some were cut off, leaving one out would measure the cut.
 */
#include <stdio.h>

#include "api/models.h"
#include "compute/model.h"
#include "text.h"
#include "toolkit/mean.h"
#include "toolkit/seconds.h"
#include "toolkit/typicality.h"
#include "api/warnings.h"
#include "store/model.h"

struct evaluate {
    char model[STORE_ID_MAX];
    struct group_input group;
    struct mean_input mean;
    long components, samples, seed; /* components 0: COMPONENTS or what there is */
};

static const struct input_own surfaces =
    GROUP_SURFACES_OWN("[\"array\",\"null\"]", 3, PROCESS_GROUP_MAX);

static const struct process_input inputs[] = {
    {"model", INPUT_MODEL, offsetof(struct evaluate, model),
     "A model that keeps all of its components; or surfaces or a cohort instead, with the options "
     "of their mean.",
     .nullable = true},
    {"surfaces", INPUT_OWN, offsetof(struct evaluate, group),
     "The surfaces. Meshes are encoded with the default options.", .own = &surfaces,
     .unless = "model"},
    {"cohort", INPUT_OWN, offsetof(struct evaluate, group),
     "Name of a cohort, instead of surfaces.", .own = &group_cohort, .unless = "model"},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct evaluate, group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .unless = "model"},
    MEAN_INPUTS(evaluate, "model"),
    MEAN_SRNF_METHOD(
        evaluate, "srnf: of the space of SRNFs, in which components are straight lines.", "model"),
    {"components", INPUT_INTEGER, offsetof(struct evaluate, components),
     "The curves run from 1 to this; at most two less than there are surfaces, fewer where "
     "subjects are repeated. null: 10 or what there is.",
     .lowest = 1, .highest = PROCESS_COMPONENTS_MAX, .open = true, .nullable = true},
    {"samples", INPUT_INTEGER, offsetof(struct evaluate, samples), "Drawn for the specificity.",
     .lowest = 2, .highest = PROCESS_QUALITY_SAMPLES_MAX,
     .fallback = PROCESS_QUALITY_SAMPLES_DEFAULT},
    {"seed", INPUT_INTEGER, offsetof(struct evaluate, seed), "Of the samples.",
     .highest = PROCESS_SEED_MAX},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"members", OUTPUT_INTEGER, "Of the group or the model."},
    {"subjects", OUTPUT_INTEGER, "Members without a subject are subjects of their own."},
    {"compactness", OUTPUT_OBJECTS,
     "[{components, value, standardError}]: share of the variance in the first components."},
    {"generalisation", OUTPUT_OBJECTS,
     "[{components, value, standardError, elastic, elasticStandardError}]: distance of a member, "
     "whose subject is left out, from its reconstruction, averaged; standard errors allow for "
     "dependence within subjects. value is the surface distance: root of the mean square distance "
     "of corresponding points, by area, for surfaces of area 1; elastic is the L2 distance of "
     "SRNFs."},
    {"specificity", OUTPUT_OBJECTS,
     "The same members: distance of a sample from the nearest subject, averaged."},
    {"refitted", OUTPUT_STRINGS, "What is fitted again without the subject that is left out."},
    {"shared", OUTPUT_STRINGS, "What is not: the registration is that of all."},
    MEAN_MEMBERS_OUTPUTS,
    {NULL, NULL, NULL},
};

#define COPIES 6 /* fields of each surface: those of the mean, points, and a copy for the Gram */
#define COMPONENTS 10   /* of the curves, unless more are asked for */
#define SHARE_MEAN 40.0 /* percent of the job that the mean is */

/* ---- Inputs ---------------------------------------------------------------------------------- */

/* Leaving a subject out takes three of them, and leaves a component less than the members that
   stay. subjects: of the n members, as group_subject_numbers takes them. */
static void check_subjects(struct process_inputs *given, const char *pointer, size_t n,
                           const json_t *subjects)
{
    json_int_t asked = json_integer_value(json_object_get(given->canonical, "components"));
    size_t count, largest;
    size_t *numbers = group_subject_numbers(subjects, n, &count, &largest);

    if (!numbers) {
        problem_add(given->list, pointer, "is too large for the memory there is");
    } else if (n > PROCESS_GROUP_MAX) {
        problem_add(given->list, pointer, "has %zu surfaces; up to %d can be left out one by one",
                    n, PROCESS_GROUP_MAX);
    } else if (count < 3) {
        problem_add(given->list, pointer,
                    "has %zu surface%s of %zu subject%s; leaving one out takes three at least", n,
                    plural(n), count, plural(count));
    } else if (asked > (json_int_t)(n - largest) - 1) {
        problem_add(given->list, "/inputs/components",
                    "is %lld; without a subject of %zu of the %zu surfaces there are at most %zu "
                    "components",
                    (long long)asked, largest, n, n - largest - 1);
    }
    srnf_free(numbers);
}

static void complete(struct process_inputs *given)
{
    const char *id = json_string_value(json_object_get(given->canonical, "model"));
    const json_t *surfaces_given = json_object_get(given->canonical, "surfaces");
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    struct store_model model = {.record = NULL};
    json_t *made;

    if (!id) {
        check_subjects(given, "/inputs/surfaces", json_array_size(surfaces_given),
                       json_object_get(cohort, "subjects"));
        mean_complete(given, COPIES);
    } else if (store_model_get_as(given->call->api->config.store, given->call->request->caller.name,
                                  id, 0, &model) == 0) {
        made = model_made_from(&model);
        check_subjects(given, "/inputs/model", (size_t)model.subjects,
                       json_object_get(made, "subjects"));
        json_decref(made);
    }
    store_model_clear(&model);
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

/* ---- Running --------------------------------------------------------------------------------- */

/* Samples, and components as they are asked for, or as many as n members allow of whom the largest
   subject is left out. */
static struct srnf_quality_options options_of(const struct evaluate *asked, size_t n,
                                              size_t largest, const size_t *subjects)
{
    struct srnf_quality_options options = srnf_quality_options_defaults();
    size_t most = n > largest + 1 ? n - largest - 1 : 1;

    options.components = most < COMPONENTS ? most : COMPONENTS;
    if (asked->components) {
        options.components = (size_t)asked->components;
    }
    options.samples = (size_t)asked->samples;
    options.seed = (uint64_t)asked->seed;
    options.subjects = subjects;
    return options;
}

/* Of what lies on the grid that was acquired. registered_q: double[n][3][P], or NULL: no memory. */
static int measure(struct jobs_run *run, const struct srnf_sht *sht, size_t n, const double *mean,
                   const double *mean_q, const double *registered_q,
                   const struct srnf_quality_options *options, struct srnf_quality *quality,
                   struct jobs_result *result)
{
    struct srnf_error error = {0};
    int status = SRNF_ENOMEM;

    if (registered_q) {
        status = srnf_model_quality(sht, n, mean, mean_q, registered_q, options,
                                    jobs_run_context(run), quality, &error);
    }
    if (status == SRNF_EDEGENERATE) { /* surfaces that do not differ: no mesh is degenerate */
        return compute_fail_alike(result, "surfaces");
    }
    return status ? compute_fail(result, status, &error, "evaluating the model") : 0;
}

static int acquire(struct jobs_run *run, size_t degree, size_t n_theta, size_t n_phi,
                   const struct srnf_sht **sht, struct jobs_result *result)
{
    int status = jobs_transform_acquire(jobs_run_jobs(run), degree, SRNF_GRID_GAUSS_LEGENDRE,
                                        n_theta, n_phi, sht);

    return status ? compute_fail(result, status, NULL, "preparing the harmonic transform") : 0;
}

static int measure_group(struct jobs_run *run, const struct evaluate *asked,
                         struct group_mean *mean, struct srnf_quality *quality,
                         struct jobs_result *result)
{
    const struct group_input *members = &asked->group;
    const struct compute_mean_inputs more = {.share = SHARE_MEAN};
    const struct compute_mean_outputs *found = &mean->outputs;
    struct srnf_quality_options options =
        options_of(asked, members->n, members->largest, members->subjects);
    const struct srnf_sht *sht = NULL;
    int status = group_mean_compute(run, members, &asked->mean, more, mean, result);

    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    jobs_run_keep_parts(run);
    status = acquire(run, found->group.degree, found->n_theta, found->n_phi, &sht, result);
    if (status == 0) {
        status = measure(run, sht, members->n, found->mean.coefficients, found->mean.mean_q,
                         found->mean.registered_q, &options, quality, result);
        jobs_transform_release(jobs_run_jobs(run), sht);
    }
    return status;
}

static json_t *evaluate_group(struct jobs_run *run, const struct evaluate *asked,
                              struct jobs_result *result)
{
    struct group_mean mean;
    struct srnf_quality quality = {0};
    json_t *document = NULL;

    if (measure_group(run, asked, &mean, &quality, result) == 0) {
        document = quality_json(&quality);
        mean_set_members(document, &mean);
        mean_warn_members(run, &mean, document);
        typicality_warn_poses(run, &asked->group, &mean.outputs, false, warnings_of(document));
        document = mean_warn(run, &mean, (struct group_doubts){.classes = NULL}, document, result);
    }
    srnf_quality_clear(&quality);
    group_mean_clear(&mean);
    return document;
}

/* The SRNFs of the subjects of a model, double[n][3][P], srnf_free; NULL without memory. */
static double *rebuild(const struct compute_model *model, const struct srnf_sht *sht)
{
    size_t n = model->pca.n;
    size_t size = store_model_count(&model->stored, STORE_MODEL_MEAN_Q);
    double *q = srnf_alloc(n, size * sizeof(double));

    for (size_t i = 0; q && i < n; i++) {
        srnf_pca_reconstruct(srnf_sht_grid(sht), &model->pca,
                             model->stored.arrays[STORE_MODEL_MEAN_Q],
                             model->pca.scores + i * model->pca.components, q + i * size);
    }
    return q;
}

static int check_complete(const struct compute_model *model, double total_variance,
                          struct jobs_result *result)
{
    struct srnf_error error = {.status = SRNF_EINVAL, .element = -1};
    bool complete;
    double kept = srnf_pca_kept_variance(&model->pca, total_variance, &complete);

    if (complete) {
        return 0;
    }
    (void)snprintf(error.message, sizeof error.message,
                   "the model keeps %.6g of a variance of %.6g: evaluate the group it was made of",
                   kept, total_variance);
    return compute_fail(result, SRNF_EINVAL, &error, "evaluating the model");
}

static int measure_model(struct jobs_run *run, const struct evaluate *asked, double total_variance,
                         const struct srnf_quality_options *options, struct srnf_quality *quality,
                         struct jobs_result *result)
{
    struct compute_model model;
    const struct srnf_sht *sht = NULL;
    int status = compute_model_load(run, asked->model, &model, result);
    double *q;

    if (status) {
        return status;
    }
    jobs_run_keep_parts(run);
    status = check_complete(&model, total_variance, result);
    if (status == 0) {
        status = acquire(run, (size_t)model.stored.lmax, (size_t)model.stored.n_theta,
                         (size_t)model.stored.n_phi, &sht, result);
    }
    if (status == 0) {
        q = rebuild(&model, sht);
        status = measure(run, sht, model.pca.n, model.mean.coefficients,
                         model.stored.arrays[STORE_MODEL_MEAN_Q], q, options, quality, result);
        srnf_free(q);
        jobs_transform_release(jobs_run_jobs(run), sht);
    }
    compute_model_clear(&model);
    return status;
}

static json_t *evaluate_model(struct jobs_run *run, const struct evaluate *asked,
                              struct jobs_result *result)
{
    struct srnf_quality quality = {0};
    struct srnf_quality_options options;
    json_t *document = NULL, *made = NULL;
    size_t n = 0, count, largest;
    double total = read_record(run, asked->model, &made, &n);
    size_t *numbers = group_subject_numbers(json_object_get(made, "subjects"), n, &count, &largest);

    options = options_of(asked, n, largest, numbers);
    if (!numbers) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    } else if (measure_model(run, asked, total, &options, &quality, result) == 0) {
        document = quality_json(&quality);
        group_warn_duplicates(run, document, json_object_get(made, "surfaces"), made, NULL);
    }
    srnf_quality_clear(&quality);
    srnf_free(numbers);
    json_decref(made);
    return document;
}

static json_t *run_evaluate(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct evaluate *asked = typed;

    return asked->model[0] ? evaluate_model(run, asked, result)
                           : evaluate_group(run, asked, result);
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct evaluate),
    .complete = complete,
    .run = run_evaluate,
};

const struct api_process evaluate_process = {
    .id = "evaluate-model",
    .title = "Quality of a model",
    .description = "Compactness, generalisation and specificity of a model or of the model that a "
                   "group makes, as curves over the number of components with standard errors.",
    .methods =
        "Compactness, generalisation (leave-one-out over subjects) and specificity of the model "
        "were measured over the number of its components",
    .table = &table,
    .seconds = evaluate_seconds,
};
