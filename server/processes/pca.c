/*
 * pca.c - the process pca: the mean and the principal components of the registered SRNFs about it.
 *
 * It makes a model: mean SRNF, modes, eigenvalues and scores, stored under the hash of their
 * content. Its record keeps what it was made from and how its members were registered, which is
 * how project registers others; and for each member the id of its surface, its distance from the
 * mean and its residual, by which project knows the member again.
 */
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/models.h"
#include "toolkit/mean.h"
#include "toolkit/seconds.h"
#include "store/model.h"

struct pca {
    struct group_input group;
    struct mean_input mean;
    long components; /* 0: all above rounding */
};

static const struct process_input inputs[] = {
    GROUP_INPUTS(pca),
    MEAN_INPUTS(pca, NULL),
    MEAN_SRNF_METHOD(pca, "srnf: components are straight lines in the space of SRNFs.", NULL),
    {"components", INPUT_INTEGER, offsetof(struct pca, components),
     "How many to keep at most; null: all above rounding.", .lowest = 1,
     .highest = PROCESS_COMPONENTS_MAX, .nullable = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"model", OUTPUT_OBJECT,
     "Record of the model: mean, eigenvalues, explained, cumulative, scores."},
    {"compactness", OUTPUT_OBJECTS,
     "[{components, value}]: variance of the first components together."},
    MEAN_RESULT_OUTPUTS,
    {NULL, NULL, NULL},
};

#define COPIES 6 /* fields of each surface: those of the mean, modes and their copy */

static void complete(struct process_inputs *given)
{
    mean_complete(given, COPIES);
}

/* ---- The model ------------------------------------------------------------------------------- */

static json_t *ids_json(size_t n, const char (*ids)[STORE_ID_MAX])
{
    json_t *array = json_array();

    for (size_t i = 0; i < n; i++) {
        (void)json_array_append_new(array, json_string(ids[i]));
    }
    return array;
}

static char *dump(const json_t *document)
{
    return json_memory_dumps(document, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
}

/* What the record of the model holds beside its numbers, and what of that is part of the model's
   id: all but the job. Both to be freed; NULL without memory. */
static void record_texts(struct jobs_run *run, const struct group_mean *mean, char **text,
                         char **identity)
{
    const struct group_input *members = mean->members;
    const struct compute_mean_outputs *found = &mean->outputs;
    const json_t *name = json_object_get(members->cohort, "name");
    const json_t *subjects = json_object_get(members->cohort, "subjects");
    const json_t *mirrored = json_object_get(members->cohort, "mirrored");
    json_t *record = json_pack(
        "{s:o, s:{s:s, s:s, s:O, s:O?, s:O?, s:O?, s:o, s:o, s:o, s:o, s:o, s:o, s:o}}",
        "totalVariance", json_finite(found->pca.total_variance), "madeFrom", "process", "pca",
        "job", jobs_run_job_id(run), "surfaces", members->surfaces, "cohort", name, "subjects",
        subjects, "mirrored", mirrored, "labels", group_labels(run, members->surfaces, subjects),
        "groups", group_groups(members->cohort), "registration",
        registration_json(mean->inputs.registration), "contents",
        ids_json(found->group.n, (const char(*)[STORE_ID_MAX])found->group.ids), "shapes",
        ids_json(found->group.n, (const char(*)[STORE_ID_MAX])found->group.contents), "residuals",
        json_vector(found->residuals, found->mean.n), "distances",
        json_vector(found->mean.distances, found->mean.n));

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

static bool model_sound(const struct compute_mean_outputs *found, struct jobs_result *result)
{
    const struct srnf_pca *pca = &found->pca;
    size_t field = 3 * found->n_theta * found->n_phi;

    return process_finite(pca->components, pca->eigenvalues, "the eigenvalues", result) &&
           process_finite(pca->n * pca->components, pca->scores, "the scores", result) &&
           process_finite(pca->components * field, pca->modes, "the modes", result) &&
           process_finite(field, found->mean.mean_q, "the mean SRNF", result) &&
           process_finite(SRNF_CALIBRATION_TRAITS * found->calibration.n, found->calibration.values,
                          "the leave-one-out values", result);
}

/* Stores the model; its record with the mean surface's (taken over) in it, or NULL with the problem
   set. */
static json_t *keep_model(struct jobs_run *run, const struct group_mean *mean, json_t *surface,
                          struct jobs_result *result)
{
    const struct compute_mean_outputs *found = &mean->outputs;
    struct store_model model = {
        .lmax = (int64_t)found->group.degree,
        .n_theta = (int64_t)found->n_theta,
        .n_phi = (int64_t)found->n_phi,
        .subjects = (int64_t)found->pca.n,
        .components = (int64_t)found->pca.components,
        .owner = {.name = jobs_run_owner(run), .bytes_max = STORE_BYTES_KEPT}};
    const char *mean_id = json_string_value(json_object_get(surface, "id"));
    json_t *record = NULL;
    char *identity;
    bool created;
    int status = STORE_NOMEM;

    record_texts(run, mean, &model.record, &identity);
    model.identity = identity;
    if (mean_id && strlen(mean_id) < sizeof model.mean) {
        memcpy(model.mean, mean_id, strlen(mean_id) + 1);
    }
    if (model.record && identity && copy_array(&model, STORE_MODEL_MEAN_Q, found->mean.mean_q) &&
        copy_array(&model, STORE_MODEL_MODES, found->pca.modes) &&
        copy_array(&model, STORE_MODEL_EIGENVALUES, found->pca.eigenvalues) &&
        copy_array(&model, STORE_MODEL_SCORES, found->pca.scores) &&
        (found->calibration.n == 0 ||
         copy_array(&model, STORE_MODEL_CALIBRATION, found->calibration.values))) {
        status = store_model_put(jobs_run_store(run), &model, &created);
    }
    if (status) {
        (void)compute_fail_kept(run, result, status, "the model");
        json_decref(surface);
    } else {
        record = model_record(&model, surface);
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

static json_t *run_pca(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct pca *asked = typed;
    const struct compute_mean_inputs more = {.fit = true, .components = (size_t)asked->components};
    struct group_mean mean;
    json_t *document = NULL, *record = NULL;

    if (group_mean_compute(run, &asked->group, &asked->mean, more, &mean, result) == 0 &&
        model_sound(&mean.outputs, result)) {
        record = mean_keep_surface(run, "pca", "mean", &mean, NULL, result);
    }
    if (record) {
        record = keep_model(run, &mean, record, result);
    }
    if (record) {
        document = json_pack("{s:o, s:o}", "model", record, "compactness",
                             compactness_json(&mean.outputs.pca));
        document = mean_finish(run, &mean, document, result);
    }
    group_mean_clear(&mean);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct pca),
    .complete = complete,
    .run = run_pca,
};

const struct api_process pca_process = {
    .id = "pca",
    .title = "Principal components of a group",
    .description = "The mean and the principal components of the registered SRNFs about it, as a "
                   "model that is kept.",
    .table = &table,
    .seconds = mean_seconds,
};
