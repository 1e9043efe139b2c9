/*
 * model_keep.c - see model_keep.h.
 */
#include "toolkit/model_keep.h"

#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/models.h"
#include "store/model.h"
#include "toolkit/registration_options.h"

bool model_is_sound(const struct model_parts *parts, struct jobs_result *result)
{
    const struct srnf_pca *pca = parts->pca;
    size_t field = 3 * parts->n_theta * parts->n_phi;

    return process_finite(pca->components, pca->eigenvalues, "the eigenvalues", result) &&
           process_finite(pca->n * pca->components, pca->scores, "the scores", result) &&
           process_finite(pca->components * field, pca->modes, "the modes", result) &&
           process_finite(field, parts->mean_q, "the mean SRNF", result) &&
           process_finite(SRNF_CALIBRATION_TRAITS * parts->calibration->n,
                          parts->calibration->values, "the leave-one-out values", result);
}

json_t *model_ids(size_t n, const char (*ids)[STORE_ID_MAX])
{
    json_t *array = json_array();

    for (size_t i = 0; i < n; i++) {
        (void)json_array_append_new(array, json_string(ids[i]));
    }
    return array;
}

json_t *model_making(struct jobs_run *run, const char *process, const struct group_input *members,
                     const struct model_parts *parts,
                     const struct srnf_register_options *registration,
                     const char (*contents)[STORE_ID_MAX])
{
    const json_t *name = json_object_get(members->cohort, "name");
    const json_t *subjects = json_object_get(members->cohort, "subjects");
    const json_t *mirrored = json_object_get(members->cohort, "mirrored");

    return json_pack("{s:s, s:s, s:O, s:O?, s:O?, s:O?, s:o, s:o, s:o, s:o, s:o, s:o}", "process",
                     process, "job", jobs_run_job_id(run), "surfaces", members->surfaces, "cohort",
                     name, "subjects", subjects, "mirrored", mirrored, "labels",
                     group_labels(run, members->surfaces, subjects), "groups",
                     group_groups(members->cohort), "registration", registration_json(registration),
                     "contents", model_ids(parts->group->n, contents), "residuals",
                     json_vector(parts->residuals, parts->pca->n), "distances",
                     json_vector(parts->distances, parts->pca->n));
}

static char *dump(const json_t *document)
{
    return json_memory_dumps(document, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
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

static bool copy_arrays(struct store_model *model, const struct model_parts *parts)
{
    return copy_array(model, STORE_MODEL_MEAN_Q, parts->mean_q) &&
           copy_array(model, STORE_MODEL_MODES, parts->pca->modes) &&
           copy_array(model, STORE_MODEL_EIGENVALUES, parts->pca->eigenvalues) &&
           copy_array(model, STORE_MODEL_SCORES, parts->pca->scores) &&
           (parts->calibration->n == 0 ||
            copy_array(model, STORE_MODEL_CALIBRATION, parts->calibration->values));
}

json_t *model_keep(struct jobs_run *run, const struct model_parts *parts, json_t *record,
                   json_t *mean, struct jobs_result *result)
{
    struct store_model model = {
        .lmax = (int64_t)parts->group->degree,
        .n_theta = (int64_t)parts->n_theta,
        .n_phi = (int64_t)parts->n_phi,
        .subjects = (int64_t)parts->pca->n,
        .components = (int64_t)parts->pca->components,
        .owner = {.name = jobs_run_owner(run), .bytes_max = STORE_BYTES_KEPT}};
    const char *mean_id = json_string_value(json_object_get(mean, "id"));
    json_t *whole = NULL;
    char *identity;
    bool created;
    int status = STORE_NOMEM;

    model.record = record ? dump(record) : NULL;
    (void)json_object_del(json_object_get(record, "madeFrom"), "job");
    identity = record ? dump(record) : NULL;
    json_decref(record);
    model.identity = identity;
    if (mean_id && strlen(mean_id) < sizeof model.mean) {
        memcpy(model.mean, mean_id, strlen(mean_id) + 1);
    }
    if (model.record && identity && copy_arrays(&model, parts)) {
        status = store_model_put(jobs_run_store(run), &model, &created);
    }
    if (status) {
        (void)compute_fail_kept(run, result, status, "the model");
        json_decref(mean);
    } else {
        whole = model_record(&model, mean);
    }
    free(identity);
    store_model_clear(&model);
    return whole;
}
