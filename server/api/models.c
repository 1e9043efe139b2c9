/*
 * models.c - the model resource: principal components about a mean surface, or a classifier that
 * rests on them, as a record, and its modes and scores as JSON, CSV or .npy.
 *
 * A model never changes, so its id (and the representation) is the entity tag. The text that the
 * store keeps beside the numbers holds what cannot be told from them: totalVariance and madeFrom.
 *
 *   scores, CSV   label, subject and id of the member (of parts the first), then one column for
 *                 each component
 *   modes, CSV    component, theta, phi, x, y, z: one line for each node of the grid
 */
#include "compute/compute.h"
#include "api/lists.h"
#include "api/model_intervals.h"
#include "api/model_parts.h"
#include "api/models.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/npy.h"
#include "api/json_numbers.h"
#include "api/labels.h"
#include "api/routes.h"
#include "api/surfaces.h"
#include "api/tables.h"
#include "store/model.h"
#include "store/surface.h"

#define EIGENVALUES (1u << STORE_MODEL_EIGENVALUES)
#define SCORES (1u << STORE_MODEL_SCORES)
#define MODES (1u << STORE_MODEL_MODES)

/* ---- Records --------------------------------------------------------------------------------- */

static json_t *model_links(const char *id, const char *mean)
{
    json_t *links = json_object();
    char path[STORE_ID_MAX + 40];

    (void)snprintf(path, sizeof path, "/v1/models/%s", id);
    (void)json_object_set_new(links, "self", json_string(path));
    (void)snprintf(path, sizeof path, "/v1/models/%s/modes", id);
    (void)json_object_set_new(links, "modes", json_string(path));
    (void)snprintf(path, sizeof path, "/v1/models/%s/scores", id);
    (void)json_object_set_new(links, "scores", json_string(path));
    (void)snprintf(path, sizeof path, "/v1/surfaces/%s", mean);
    (void)json_object_set_new(links, "mean", json_string(path));
    return links;
}

/* By the record that the store keeps: one of a classifier, or of parts, has them in it. */
static const char *kind_of(const json_t *record)
{
    return json_object_get(record, "classifier") ? "classifier"
           : json_object_get(record, "parts")    ? "parts"
                                                 : "components";
}

const char *model_kind(const struct store_model *model)
{
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    const char *kind = kind_of(record);

    json_decref(record);
    return kind;
}

/* What the store keeps as a text, with the sizes. */
static json_t *model_head(const struct store_model *model)
{
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    struct compute_joint joint = {.n_parts = 0};
    const size_t rows = model_joint(model, &joint) ? compute_joint_rows(&joint, model) : 0;
    const struct {
        const char *name;
        int64_t value;
    } sizes[] = {
        {"lmax", model->lmax},         {"nTheta", (int64_t)rows},         {"nPhi", model->n_phi},
        {"subjects", model->subjects}, {"components", model->components},
    };

    if (!json_is_object(record)) {
        json_decref(record);
        return NULL;
    }
    (void)json_object_set_new(record, "id", json_string(model->id));
    (void)json_object_set_new(record, "kind", json_string(kind_of(record)));
    (void)json_object_set_new(record, "name", json_string(model->name ? model->name : ""));
    labels_set_tags(record, model->tags);
    (void)json_object_set_new(record, "created", json_time(model->created_ms));
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        (void)json_object_set_new(record, sizes[i].name, json_integer(sizes[i].value));
    }
    (void)json_object_set_new(record, "links", model_links(model->id, model->mean));
    return record;
}

static json_t *labels_of(const struct store_model *model)
{
    json_t *made = model_made_from(model);
    json_t *labels = json_incref(json_object_get(made, "labels"));

    json_decref(made);
    return labels ? labels : json_array();
}

/* The groups of the subjects; null where they have none. */
static json_t *groups_of(const struct store_model *model)
{
    json_t *made = model_made_from(model);
    json_t *groups = json_incref(json_object_get(made, "groups"));

    json_decref(made);
    return groups ? groups : json_null();
}

json_t *model_made_from(const struct store_model *model)
{
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    json_t *made = json_incref(json_object_get(record, "madeFrom"));

    json_decref(record);
    return made ? made : json_object();
}

static void set_spectrum(json_t *record, const struct store_model *model)
{
    const double *eigenvalues = model->arrays[STORE_MODEL_EIGENVALUES];
    double total = json_number_value(json_object_get(record, "totalVariance")), sum = 0.0;
    json_t *explained = json_array(), *cumulative = json_array();

    for (size_t i = 0; i < (size_t)model->components; i++) {
        sum += eigenvalues[i];
        (void)json_array_append_new(explained, json_finite(eigenvalues[i] / total));
        (void)json_array_append_new(cumulative, json_finite(sum / total));
    }
    (void)json_object_set_new(record, "eigenvalues",
                              json_vector(eigenvalues, (size_t)model->components));
    (void)json_object_set_new(record, "explained", explained);
    (void)json_object_set_new(record, "cumulative", cumulative);
    model_set_intervals(record, (size_t)model->subjects, (size_t)model->components,
                        model->arrays[STORE_MODEL_EIGENVALUES], model->arrays[STORE_MODEL_SCORES]);
}

/* [subjects][components], of as many components as SURFACE_JSON_NUMBERS_MAX numbers allow. */
static json_t *first_scores(const struct store_model *model)
{
    const double *scores = model->arrays[STORE_MODEL_SCORES];
    size_t n = (size_t)model->subjects, k = (size_t)model->components;
    size_t most = SURFACE_JSON_NUMBERS_MAX / (n ? n : 1);
    json_t *rows = json_array();

    most = most < 1 ? 1 : most;
    for (size_t i = 0; i < n; i++) {
        (void)json_array_append_new(rows, json_vector(scores + i * k, k < most ? k : most));
    }
    return rows;
}

json_t *model_record(const struct store_model *model, json_t *mean)
{
    json_t *record = model_head(model);

    if (!record) {
        json_decref(mean);
        return NULL;
    }
    (void)json_object_set_new(record, "mean", mean);
    set_spectrum(record, model);
    (void)json_object_set_new(record, "labels", labels_of(model));
    (void)json_object_set_new(record, "groups", groups_of(model));
    (void)json_object_set_new(record, "scores", first_scores(model));
    return record;
}

/* ---- Handlers -------------------------------------------------------------------------------- */

static bool find_model(struct api_call *call, unsigned arrays, struct store_model *model)
{
    int status = store_model_get_as(call->api->config.store, call->request->caller.name,
                                    call->parameters[0], arrays, model);

    if (status) {
        (void)problem_respond_store(call, status, "no-such-model", call->parameters[0]);
    }
    return status == 0;
}

static void set_tag(char etag[MODEL_ETAG_MAX], const char *id, const char *name, const char *tags,
                    const char *mean_name, const char *mean_tags)
{
    char own[LABELS_ETAG_MAX], of_mean[LABELS_ETAG_MAX];

    labels_etag(own, id, name, tags);
    labels_etag(of_mean, "", mean_name, mean_tags);
    (void)snprintf(etag, MODEL_ETAG_MAX, "%s%s", own, of_mean);
}

int model_tag(struct api_call *call, const char *owner, const struct store_labels_held *held,
              char etag[MODEL_ETAG_MAX])
{
    struct store *store = call->api->config.store;
    struct store_labels_held of_mean = {.name = NULL};
    struct store_model model;
    int status = store_model_get_as(store, owner, call->parameters[0], 0, &model);

    if (status == STORE_OK) {
        status = store_labels_get(store, owner, model.mean, &of_mean);
        set_tag(etag, model.id, held->name, held->tags, of_mean.name, of_mean.tags);
        store_labels_clear(&of_mean);
        store_model_clear(&model);
    }
    return status;
}

void models_get(struct api_call *call)
{
    struct store_model model;
    struct store_surface mean = {0};
    char etag[MODEL_ETAG_MAX];
    int status;

    if (!find_model(call, EIGENVALUES | SCORES, &model)) {
        return;
    }
    status = store_surface_get_as(call->api->config.store, call->request->caller.name, model.mean,
                                  false, &mean);
    if (status) {
        (void)problem_respond_store(call, status, "no-such-surface", model.mean);
        goto out;
    }
    set_tag(etag, model.id, model.name, model.tags, mean.name, mean.tags);
    if (respond_not_modified(call, etag)) {
        goto out;
    }
    respond_json(call, 200, model_record(&model, surface_record(&mean)));
out:
    store_surface_clear(&mean);
    store_model_clear(&model);
}

/* Lists leave out what of a classifier grows with its members and the square of its components. */
static bool add_model(void *user, const struct store_model *model)
{
    json_t *record = model_head(model);
    json_t *classifier = json_object_get(record, "classifier");

    (void)json_object_del(classifier, "means");
    (void)json_object_del(classifier, "covariances");
    (void)json_object_del(classifier, "nearest");
    return list_add(user, record, model->created_ms, model->id);
}

void models_list(struct api_call *call)
{
    struct list list;

    if (list_open(call, "models", &list)) {
        list_respond(call, &list, "/v1/models",
                     store_model_list(call->api->config.store, &list.page, add_model, &list));
    }
}

/* Sets the entity tag; true when 304 was answered. */
static bool unchanged(struct api_call *call, const char *id, const char *what, enum table_form form)
{
    char tag[STORE_ID_MAX + 40];

    (void)api_response_header_text(call->response, "Vary", "Accept");
    (void)snprintf(tag, sizeof tag, "%s.%s.%s", id, what, table_form_name(form));
    return respond_not_modified(call, tag);
}

static void scores_csv(struct api_call *call, const struct store_model *model, const char *name)
{
    const double *scores = model->arrays[STORE_MODEL_SCORES];
    size_t k = (size_t)model->components;
    json_t *made = model_made_from(model);
    struct table_text text;
    char column[32];

    if (table_open(call, &text)) {
        csv_member_heads(text.out);
        for (size_t j = 0; j < k; j++) {
            (void)snprintf(column, sizeof column, "component %zu", j + 1);
            csv_text(text.out, false, column);
        }
        csv_end_line(text.out);
        for (size_t i = 0; i < (size_t)model->subjects; i++) {
            csv_member(text.out, json_object_get(made, "labels"), json_object_get(made, "subjects"),
                       json_object_get(made, "surfaces"), i);
            for (size_t j = 0; j < k; j++) {
                csv_number(text.out, false, scores[i * k + j]);
            }
            csv_end_line(text.out);
        }
        table_respond_csv(call, &text, name);
    }
    json_decref(made);
}

void models_scores(struct api_call *call)
{
    struct store_model model;
    enum table_form form;
    char name[STORE_ID_MAX + 16];
    size_t shape[2];

    if (!table_choose(call, &form) || !find_model(call, SCORES, &model)) {
        return;
    }
    shape[0] = (size_t)model.subjects;
    shape[1] = (size_t)model.components;
    (void)snprintf(name, sizeof name, "%s-scores", model.id);
    if (unchanged(call, model.id, "scores", form)) {
        goto out;
    }
    if (form == TABLE_NPY) {
        table_respond_npy(call, model.arrays[STORE_MODEL_SCORES], 2, shape, name);
    } else if (form == TABLE_CSV) {
        scores_csv(call, &model, name);
    } else {
        respond_json(call, 200,
                     json_pack("{s:I, s:I, s:o, s:o, s:o}", "subjects", (json_int_t)model.subjects,
                               "components", (json_int_t)model.components, "labels",
                               labels_of(&model), "groups", groups_of(&model), "scores",
                               first_scores(&model)));
    }
out:
    store_model_clear(&model);
}

/* ---- Modes ----------------------------------------------------------------------------------- */

static const double two_pi = 6.28318530717958647692;

static void modes_csv(struct api_call *call, const struct store_model *model,
                      const struct srnf_grid *grid, const double *values, const char *name)
{
    static const char *const columns[] = {"component", "theta", "phi", "x", "y", "z"};
    size_t nodes = grid->n_theta * grid->n_phi;
    struct table_text text;

    if (!table_open(call, &text)) {
        return;
    }
    for (size_t i = 0; i < 6; i++) {
        csv_text(text.out, i == 0, columns[i]);
    }
    csv_end_line(text.out);
    for (size_t i = 0; i < (size_t)model->components * nodes; i++) {
        size_t node = i % nodes;

        csv_number(text.out, true, (double)(i / nodes + 1));
        csv_number(text.out, false, grid->theta[node / grid->n_phi]);
        csv_number(text.out, false, two_pi * (double)(node % grid->n_phi) / (double)grid->n_phi);
        for (size_t k = 0; k < 3; k++) {
            csv_number(text.out, false, values[3 * i + k]);
        }
        csv_end_line(text.out);
    }
    table_respond_csv(call, &text, name);
}

static json_t *modes_json(const struct store_model *model, const struct srnf_grid *grid,
                          const double *values)
{
    const size_t shape[3] = {grid->n_theta, grid->n_phi, 3};
    json_t *phi = json_array(), *modes = json_array();

    for (size_t j = 0; j < grid->n_phi; j++) {
        (void)json_array_append_new(phi, json_real(two_pi * (double)j / (double)grid->n_phi));
    }
    for (size_t k = 0; k < (size_t)model->components; k++) {
        (void)json_array_append_new(modes,
                                    json_nested(values + k * shape[0] * shape[1] * 3, 3, shape));
    }
    return json_pack("{s:I, s:I, s:I, s:o, s:o, s:o, s:o}", "components",
                     (json_int_t)model->components, "nTheta", (json_int_t)grid->n_theta, "nPhi",
                     (json_int_t)grid->n_phi, "theta", json_vector(grid->theta, grid->n_theta),
                     "phi", phi, "weights", json_vector(grid->weight, grid->n_theta), "modes",
                     modes);
}

static void respond_modes(struct api_call *call, const struct store_model *model,
                          enum table_form form)
{
    size_t nodes = (size_t)model->n_theta * (size_t)model->n_phi, k = (size_t)model->components;
    const size_t shape[4] = {k, (size_t)model->n_theta, (size_t)model->n_phi, 3};
    struct jobs *jobs = call->api->config.jobs;
    const struct srnf_sht *sht = NULL;
    double *values = srnf_alloc(k * nodes, 3 * sizeof(double));
    char name[STORE_ID_MAX + 16];
    int status = SRNF_ENOMEM;

    if (values) {
        status = jobs_transform_acquire(jobs, (size_t)model->lmax, SRNF_GRID_GAUSS_LEGENDRE,
                                        shape[1], shape[2], &sht);
    }
    if (status) {
        (void)problem_respond(call, compute_problem_code(status), "The modes: %s.",
                              srnf_strerror(status));
        goto out;
    }
    for (size_t i = 0; i < k; i++) {
        field_interleave(nodes, model->arrays[STORE_MODEL_MODES] + 3 * i * nodes,
                         values + 3 * i * nodes);
    }
    (void)snprintf(name, sizeof name, "%s-modes", model->id);
    if (form == TABLE_NPY) {
        table_respond_npy(call, values, 4, shape, name);
    } else if (form == TABLE_CSV) {
        modes_csv(call, model, srnf_sht_grid(sht), values, name);
    } else {
        respond_json(call, 200, modes_json(model, srnf_sht_grid(sht), values));
    }
out:
    if (sht) {
        jobs_transform_release(jobs, sht);
    }
    srnf_free(values);
}

void models_modes(struct api_call *call)
{
    struct problem_list list = {.errors = NULL};
    struct store_model model;
    enum table_form form;
    struct model_part part;
    char what[32] = "modes";
    size_t count = 0;
    bool good;

    if (!table_choose(call, &form) || !find_model(call, 0, &model)) {
        return;
    }
    good = model_choose_part(call, &model, &part);
    count = good ? store_model_count(&model, STORE_MODEL_MODES) : 0;
    store_model_clear(&model);
    if (good && form != TABLE_NPY && count > SURFACE_JSON_NUMBERS_MAX) {
        problem_add(&list, "/format",
                    "the modes have %zu numbers and a text answer at most %zu; ask for format=npy",
                    count, SURFACE_JSON_NUMBERS_MAX);
        (void)problem_respond_list(call, "invalid-input", &list);
        return;
    }
    if (good && find_model(call, MODES, &model)) {
        if (part.name[0]) {
            (void)snprintf(what, sizeof what, "modes.%zu", part.index);
        }
        if (!unchanged(call, model.id, what, form) && model_choose_part(call, &model, &part)) {
            respond_modes(call, &model, form);
        }
        store_model_clear(&model);
    }
}
