/*
 * model.c - the rows of models: principal components about a mean surface, frozen when they are
 * made. Like a surface, a model never changes.
 *
 * Its arrays are blobs of doubles (numbers.c), which the rows of model_array name. The id is made
 * of the sizes, the id of the mean, the bytes of the arrays, and a text that says what else the
 * model is made of: whose members and which mirrored, and how they were registered. What reads a
 * model computes with that as well. The record itself is not part of it, as it tells which job made
 * the model: one that is made again keeps the record of the first time.
 *
 * Models made before there was a calibration, or that text, lack them. They stay as they are; made
 * again they get another id.
 */
#include "store/internal.h"
#include "store/numbers.h"
#include "store/batch.h"
#include "store/model.h"
#include "store/page.h"
#include "store/store.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COLUMNS "id, record, mean, lmax, n_theta, n_phi, subjects, components, created_ms"
#define COLUMNS_AS                                                                 \
    "model.id, coalesce(owned.record, model.record), mean, lmax, n_theta, n_phi, " \
    "subjects, components, coalesce(owned.created_ms, model.created_ms), "         \
    "coalesce(owned.name, ''), coalesce(owned.tags, '[]')"

static const char *const array_names[STORE_MODEL_ARRAYS] = {
    [STORE_MODEL_MEAN_Q] = "mean_q",           [STORE_MODEL_MODES] = "modes",
    [STORE_MODEL_EIGENVALUES] = "eigenvalues", [STORE_MODEL_SCORES] = "scores",
    [STORE_MODEL_CALIBRATION] = "calibration",
};

void store_model_clear(struct store_model *model)
{
    free(model->record);
    free(model->name);
    free(model->tags);
    for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
        free(model->arrays[i]);
    }
    *model = (struct store_model){0};
}

size_t store_model_count(const struct store_model *model, enum store_model_array array)
{
    size_t field = 3 * (size_t)model->n_theta * (size_t)model->n_phi;
    const size_t counts[STORE_MODEL_ARRAYS] = {
        [STORE_MODEL_MEAN_Q] = field,
        [STORE_MODEL_MODES] = (size_t)model->components * field,
        [STORE_MODEL_EIGENVALUES] = (size_t)model->components,
        [STORE_MODEL_SCORES] = (size_t)model->subjects * (size_t)model->components,
        [STORE_MODEL_CALIBRATION] = STORE_CALIBRATION_VALUES * (size_t)model->subjects,
    };

    return counts[array];
}

/* ---- Reading --------------------------------------------------------------------------------- */

static int from_row(sqlite3_stmt *row, struct store_model *model)
{
    int status = STORE_OK;

    *model = (struct store_model){0};
    store_column_id(row, 0, model->id, sizeof model->id);
    model->record = store_column_text(row, 1, &status);
    store_column_id(row, 2, model->mean, sizeof model->mean);
    model->lmax = sqlite3_column_int64(row, 3);
    model->n_theta = sqlite3_column_int64(row, 4);
    model->n_phi = sqlite3_column_int64(row, 5);
    model->subjects = sqlite3_column_int64(row, 6);
    model->components = sqlite3_column_int64(row, 7);
    model->created_ms = sqlite3_column_int64(row, 8);
    model->name = store_column_text(row, 9, &status);
    model->tags = store_column_text(row, 10, &status);
    if (status != STORE_OK) {
        store_model_clear(model);
    }
    return status;
}

static int read_array(struct store *store, sqlite3 *db, struct store_model *model,
                      enum store_model_array array)
{
    sqlite3_stmt *row = NULL;
    char hash[65] = "";
    int status =
        store_prepare(db, &row, "SELECT content FROM model_array WHERE model = ? AND name = ?",
                      "tt", model->id, array_names[array]);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        store_column_id(row, 0, hash, sizeof hash);
    }
    sqlite3_finalize(row);
    if (status == STORE_OK) {
        status = store_read_doubles(store, db, hash, store_model_count(model, array),
                                    &model->arrays[array]);
    }
    if (status == STORE_NOT_FOUND && array == STORE_MODEL_CALIBRATION && !*hash) {
        return STORE_OK;
    }
    return status == STORE_NOT_FOUND ? STORE_CORRUPT : status;
}

int store_model_get(struct store *store, const char *id, unsigned arrays, struct store_model *model)
{
    return store_model_get_as(store, NULL, id, arrays, model);
}

int store_model_get_as(struct store *store, const char *owner, const char *id, unsigned arrays,
                       struct store_model *model)
{
    struct store_query query;
    int status =
        store_query_first(&query, store, STORE_ROW_AS(COLUMNS_AS, "model"), "tt", owner, id);

    *model = (struct store_model){0};
    if (status == STORE_OK) {
        status = from_row(query.row, model);
    }
    for (size_t i = 0; status == STORE_OK && i < STORE_MODEL_ARRAYS; i++) {
        if (arrays & (1u << i)) {
            status = read_array(store, query.reader->db, model, (enum store_model_array)i);
        }
    }
    if (status != STORE_OK) {
        store_model_clear(model);
    }
    store_query_close(&query);
    return status;
}

struct list {
    bool (*visit)(void *user, const struct store_model *model);
    void *user;
};

static int list_row(void *argument, sqlite3_stmt *row, bool *more)
{
    const struct list *list = argument;
    struct store_model model;
    int status = from_row(row, &model);

    if (status == STORE_OK) {
        *more = list->visit(list->user, &model);
        store_model_clear(&model);
    }
    return status;
}

const struct store_listing store_model_listing = {
    STORE_LISTING_OF_CONTENT("model", COLUMNS_AS),
    .process = "listed.process",
    .cohort = "listed.cohort = :cohort",
    .mesh = STORE_LISTED_BY_MESH,
};

int store_model_list(struct store *store, const struct store_page *page,
                     bool (*visit)(void *user, const struct store_model *model), void *user)
{
    struct list list = {.visit = visit, .user = user};

    return store_page_walk(store, &store_model_listing, page, list_row, &list);
}

/* ---- Writing --------------------------------------------------------------------------------- */

struct put {
    const struct store_model *model;
    struct store_content contents[STORE_MODEL_ARRAYS];
    unsigned char *bytes[STORE_MODEL_ARRAYS];
    int64_t now;
    bool created;
};

static int insert_row(sqlite3 *db, const struct put *put, size_t *changed)
{
    const struct store_model *model = put->model;

    return store_execute(db, changed,
                         "INSERT INTO model (" COLUMNS ") "
                         "SELECT ?1, ?2, id, ?4, ?5, ?6, ?7, ?8, ?9 FROM surface WHERE id = ?3",
                         "tttiiiiii", model->id, model->record ? model->record : "", model->mean,
                         model->lmax, model->n_theta, model->n_phi, model->subjects,
                         model->components, put->now);
}

/* Whether the content is there already, as another owner's. */
static int is_there(sqlite3 *db, const char *id, bool *there)
{
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row, "SELECT 1 FROM model WHERE id = ?", "t", id);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    sqlite3_finalize(row);
    *there = status == STORE_OK;
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

static int insert_arrays(struct store *store, sqlite3 *db, const struct put *put)
{
    int status = STORE_OK;

    for (size_t i = 0; status == STORE_OK && i < STORE_MODEL_ARRAYS; i++) {
        if (!put->bytes[i]) {
            continue;
        }
        status = store_blob_keep(store, db, &put->contents[i]);
        if (status == STORE_OK) {
            status = store_execute(db, NULL,
                                   "INSERT INTO model_array (model, name, content) "
                                   "VALUES (?, ?, ?)",
                                   "ttt", put->model->id, array_names[i], put->contents[i].hash);
        }
    }
    return status;
}

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct put *put = write->argument;
    const struct store_model *model = put->model;
    struct store_holding holding = {.id = model->id,
                                    .kind = "model",
                                    .record = model->record ? model->record : "",
                                    .also = model->mean,
                                    .now = put->now};
    size_t changed = 0;
    bool there = false;
    int status;

    for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
        holding.bytes += (int64_t)put->contents[i].size;
    }
    status = store_owner_take(db, &model->owner, &holding, &put->created);
    if (status == STORE_OK && put->created) {
        status = is_there(db, model->id, &there);
    }
    if (status != STORE_OK || !put->created || there) {
        return status;
    }
    status = insert_row(db, put, &changed);
    if (status == STORE_OK && changed == 0) {
        return STORE_NOT_FOUND;
    }
    return status == STORE_OK ? insert_arrays(store, db, put) : status;
}

/* The bytes of the arrays; the id is a hash over them. */
static int make_bytes(struct store_model *model, struct put *put)
{
    const int64_t sizes[] = {model->lmax, model->n_theta, model->n_phi, model->subjects,
                             model->components};
    crypto_hash_sha256_state state;
    unsigned char eight[8], hash[crypto_hash_sha256_BYTES];
    char hex[sizeof hash * 2 + 1];

    crypto_hash_sha256_init(&state);
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        store_put_integer(eight, sizes[i]);
        crypto_hash_sha256_update(&state, eight, sizeof eight);
    }
    crypto_hash_sha256_update(&state, (const unsigned char *)model->mean, strlen(model->mean));
    for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
        size_t count = store_model_count(model, (enum store_model_array)i);

        if (i == STORE_MODEL_CALIBRATION && !model->arrays[i]) {
            continue;
        }
        put->bytes[i] = malloc(count ? count * 8 : 1);
        if (!put->bytes[i]) {
            return STORE_NOMEM;
        }
        store_put_doubles(put->bytes[i], model->arrays[i], count);
        crypto_hash_sha256_update(&state, put->bytes[i], count * 8);
    }
    if (model->identity) {
        crypto_hash_sha256_update(&state, (const unsigned char *)model->identity,
                                  strlen(model->identity));
    }
    crypto_hash_sha256_final(&state, hash);
    sodium_bin2hex(hex, sizeof hex, hash, sizeof hash);
    snprintf(model->id, sizeof model->id, "model-%.32s", hex);
    return STORE_OK;
}

/* Takes record and time of what the store holds. */
static int adopt(struct store *store, struct store_model *model)
{
    struct store_model held;
    int status = store_model_get_as(store, store_owner_name(&model->owner), model->id, 0, &held);

    if (status == STORE_OK) {
        free(model->record);
        free(model->name);
        free(model->tags);
        model->record = held.record;
        model->name = held.name;
        model->tags = held.tags;
        model->created_ms = held.created_ms;
        held.record = held.name = held.tags = NULL;
        store_model_clear(&held);
    }
    return status;
}

/* Stages the arrays that there are; *staged gets how many were gone through. */
static int stage(struct store *store, struct put *put, size_t *staged)
{
    int status = STORE_OK;

    for (; status == STORE_OK && *staged < STORE_MODEL_ARRAYS; ++*staged) {
        if (put->bytes[*staged]) {
            size_t count = store_model_count(put->model, (enum store_model_array) * staged);

            status =
                store_blob_stage(store, put->bytes[*staged], count * 8, &put->contents[*staged]);
        }
    }
    return status;
}

int store_model_put(struct store *store, struct store_model *model, bool *created)
{
    struct put put = {.model = model, .now = store_now_ms()};
    size_t staged = 0;
    int status = make_bytes(model, &put);

    *created = false;
    status = status == STORE_OK ? stage(store, &put, &staged) : status;
    if (status == STORE_OK) {
        status = store_write(store, run_put, &put);
    }
    for (size_t i = 0; i < staged; i++) {
        if (put.bytes[i]) {
            store_blob_unstage(store, &put.contents[i]);
        }
    }
    for (size_t i = 0; status == STORE_OK && !put.created && i < staged; i++) {
        if (put.bytes[i]) {
            status = store_blob_mend(store, put.bytes[i],
                                     8 * store_model_count(model, (enum store_model_array)i));
        }
    }
    for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
        free(put.bytes[i]);
    }
    if (status == STORE_OK) {
        *created = put.created;
        status = adopt(store, model);
    }
    return status;
}

/* ---- As part of a batch ---------------------------------------------------------------------- */

struct batched {
    struct put put;
    struct store_model model;
};

static void clear_batched(struct store *store, void *argument)
{
    struct batched *batched = argument;

    for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
        store_blob_unstage(store, &batched->put.contents[i]);
        free(batched->put.bytes[i]);
    }
    store_model_clear(&batched->model);
    free(batched);
}

int store_batch_add_model(struct store_batch *batch, struct store_model *model, const char *id)
{
    struct store *store = store_batch_store(batch);
    struct batched *batched = calloc(1, sizeof *batched);
    size_t staged = 0;
    int status;

    if (!batched) {
        store_model_clear(model);
        return STORE_NOMEM;
    }
    batched->model = *model;
    *model = (struct store_model){0};
    batched->put = (struct put){.model = &batched->model, .now = store_now_ms()};
    status = make_bytes(&batched->model, &batched->put);
    batched->model.identity = NULL; /* borrowed, and done with */
    if (status == STORE_OK && strcmp(batched->model.id, id) != 0) {
        status = STORE_CORRUPT;
    }
    status = status == STORE_OK ? stage(store, &batched->put, &staged) : status;
    return store_batch_add(
        batch, status, STORE_BATCH_MODEL,
        &(struct store_batch_item){run_put, &batched->put, clear_batched, batched});
}
