/*
 * surface.c - the rows of surfaces. Like a mesh, a surface never changes; name, record and time are
 * each owner's (owner.c).
 *
 * Coefficients are stored as IEEE 754 doubles in little-endian order, whatever the machine: 3
 * (lmax + 1)^2 of them.
 */
#include "store/internal.h"
#include "store/numbers.h"
#include "store/batch.h"
#include "store/holdings.h"
#include "store/page.h"
#include "store/store.h"
#include "store/surface.h"

#include <assert.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COLUMNS "id, name, record, lmax, created_ms"
#define COLUMNS_AS                                                            \
    "surface.id, coalesce(owned.name, surface.name), coalesce(owned.record, " \
    "surface.record), lmax, coalesce(owned.created_ms, surface.created_ms), " \
    "coalesce(owned.tags, '[]')"

static size_t count_of(int64_t lmax)
{
    return 3 * (size_t)(lmax + 1) * (size_t)(lmax + 1);
}

static void content_id(char id[STORE_ID_MAX], const char *prefix, int64_t lmax,
                       const double *coefficients, double scale)
{
    crypto_hash_sha256_state state;
    unsigned char bytes[8], hash[crypto_hash_sha256_BYTES];
    char hex[sizeof hash * 2 + 1];

    crypto_hash_sha256_init(&state);
    store_put_integer(bytes, lmax);
    crypto_hash_sha256_update(&state, bytes, sizeof bytes);
    for (size_t i = 0; i < count_of(lmax); i++) {
        store_put_doubles(bytes, &coefficients[i], 1);
        crypto_hash_sha256_update(&state, bytes, sizeof bytes);
    }
    store_put_doubles(bytes, &scale, 1);
    crypto_hash_sha256_update(&state, bytes, sizeof bytes);
    crypto_hash_sha256_final(&state, hash);
    sodium_bin2hex(hex, sizeof hex, hash, sizeof hash);
    snprintf(id, STORE_ID_MAX, "%s%.32s", prefix, hex);
}

void store_surface_id(char id[STORE_ID_MAX], int64_t lmax, const double *coefficients, double scale)
{
    content_id(id, "surf-", lmax, coefficients, scale);
}

void store_shape_id(char id[STORE_ID_MAX], int64_t lmax, const double *coefficients)
{
    content_id(id, "shape-", lmax, coefficients, 0.0);
}

void store_surface_id_place(char id[STORE_ID_MAX], const double origin[3], const double rotation[9],
                            const char *mesh)
{
    crypto_hash_sha256_state state;
    unsigned char bytes[(3 + 9) * 8], hash[crypto_hash_sha256_BYTES];
    char hex[sizeof hash * 2 + 1];

    store_put_doubles(bytes, origin, 3);
    store_put_doubles(bytes + 24, rotation, 9);
    crypto_hash_sha256_init(&state);
    crypto_hash_sha256_update(&state, (const unsigned char *)id, strlen(id) + 1);
    crypto_hash_sha256_update(&state, bytes, sizeof bytes);
    crypto_hash_sha256_update(&state, (const unsigned char *)mesh, strlen(mesh) + 1);
    crypto_hash_sha256_final(&state, hash);
    sodium_bin2hex(hex, sizeof hex, hash, sizeof hash);
    snprintf(id, STORE_ID_MAX, "surf-%.32s", hex);
}

void store_surface_clear(struct store_surface *surface)
{
    free(surface->name);
    free(surface->record);
    free(surface->tags);
    free(surface->coefficients);
    store_maps_clear(&surface->maps);
    *surface = (struct store_surface){0};
}

static int from_row(sqlite3_stmt *row, struct store_surface *surface)
{
    int status = STORE_OK;

    *surface = (struct store_surface){0};
    store_column_id(row, 0, surface->id, sizeof surface->id);
    surface->name = store_column_text(row, 1, &status);
    surface->record = store_column_text(row, 2, &status);
    surface->lmax = sqlite3_column_int64(row, 3);
    surface->created_ms = sqlite3_column_int64(row, 4);
    surface->tags = store_column_text(row, 5, &status);
    if (status != STORE_OK) {
        store_surface_clear(surface);
    }
    return status;
}

static int read_coefficients(struct store *store, sqlite3 *db, const char *hash,
                             struct store_surface *surface)
{
    size_t count = count_of(surface->lmax);
    int status = store_read_doubles(store, db, hash, count, &surface->coefficients);

    surface->coefficient_count = status == STORE_OK ? count : 0;
    return status;
}

int store_surface_get(struct store *store, const char *id, bool with_coefficients,
                      struct store_surface *surface)
{
    return store_surface_get_as(store, NULL, id, with_coefficients, surface);
}

int store_surface_get_as(struct store *store, const char *owner, const char *id,
                         bool with_coefficients, struct store_surface *surface)
{
    char hash[65] = "";
    struct store_query query;
    int status = store_query_first(
        &query, store, STORE_ROW_AS(COLUMNS_AS ", coefficients", "surface"), "tt", owner, id);

    *surface = (struct store_surface){0};
    if (status == STORE_OK) {
        store_column_id(query.row, 6, hash, sizeof hash);
        status = from_row(query.row, surface);
        memcpy(surface->hash, hash, sizeof hash);
    }
    if (status == STORE_OK && with_coefficients) {
        status = read_coefficients(store, query.reader->db, hash, surface);
    }
    if (status != STORE_OK) {
        store_surface_clear(surface);
    }
    store_query_close(&query);
    return status;
}

struct put {
    const struct store_surface *surface;
    const struct store_content *content, *maps; /* maps NULL: it has none */
    int64_t now;
    bool created;
};

static int run_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct put *put = write->argument;
    const struct store_surface *surface = put->surface;
    const int64_t maps_size = put->maps ? (int64_t)put->maps->size : 0;
    const struct store_holding holding = {.id = surface->id,
                                          .kind = "surface",
                                          .name = surface->name ? surface->name : "",
                                          .record = surface->record ? surface->record : "",
                                          .alone = surface->alone,
                                          .bytes = (int64_t)put->content->size + maps_size,
                                          .now = put->now};
    int status = store_owner_take(db, &surface->owner, &holding, &put->created);

    if (status == STORE_OK && put->created) {
        status = store_blob_keep(store, db, put->content);
    }
    if (status == STORE_OK && put->created) {
        status = store_execute(db, NULL,
                               "INSERT INTO surface (" COLUMNS ", coefficients) "
                               "VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT (id) DO NOTHING",
                               "tttiit", surface->id, surface->name ? surface->name : "",
                               surface->record ? surface->record : "", surface->lmax, put->now,
                               put->content->hash);
    }
    if (status == STORE_OK && put->created && put->maps) {
        status = store_maps_insert(store, db, surface->id, &surface->maps, put->maps);
    }
    return status;
}

/* Takes name, record and time of what the store holds. */
static int adopt(struct store *store, struct store_surface *surface)
{
    const char *owner = store_owner_name(&surface->owner);
    struct store_surface held;
    int status = store_surface_get_as(store, owner, surface->id, false, &held);

    if (status == STORE_OK) {
        free(surface->name);
        free(surface->record);
        free(surface->tags);
        surface->name = held.name;
        surface->record = held.record;
        surface->tags = held.tags;
        surface->created_ms = held.created_ms;
    }
    return status;
}

int store_surface_put(struct store *store, struct store_surface *surface, bool *created)
{
    struct store_content staged = {.size = 0}, maps = {.size = 0};
    struct put put = {.surface = surface, .content = &staged, .now = store_now_ms()};
    size_t count = count_of(surface->lmax);
    unsigned char *bytes, *map_bytes = NULL;
    bool owned = false;
    int status = store_owner_has(store, surface->owner.name, surface->id);

    assert(surface->coefficient_count == count);
    *created = false;
    if (status == STORE_OK) {
        status = adopt(store, surface);
        owned = status == STORE_OK;
    }
    if (status != STORE_OK && status != STORE_NOT_FOUND) {
        return status;
    }
    bytes = malloc(count * 8);
    if (!bytes) {
        return STORE_NOMEM;
    }
    store_put_doubles(bytes, surface->coefficients, count);
    if (owned) {
        status = store_blob_mend(store, bytes, count * 8);
        free(bytes);
        return status == STORE_OK && surface->maps.count ? store_maps_mend(store, &surface->maps)
                                                         : status;
    }
    status = store_blob_stage(store, bytes, count * 8, &staged);
    if (status == STORE_OK && surface->maps.count) {
        put.maps = &maps;
        status = store_maps_stage(store, &surface->maps, &map_bytes, &maps);
    }
    if (status == STORE_OK) {
        status = store_write(store, run_put, &put);
    }
    store_blob_unstage(store, &staged);
    store_blob_unstage(store, &maps);
    free(bytes);
    free(map_bytes);
    if (status == STORE_OK) {
        *created = put.created;
        status = adopt(store, surface);
    }
    return status;
}

/* ---- As part of a batch ---------------------------------------------------------------------- */

struct batched {
    struct put put;
    struct store_surface surface;
    struct store_content content, maps;
    unsigned char *bytes, *map_bytes;
};

static void clear_batched(struct store *store, void *argument)
{
    struct batched *batched = argument;

    store_blob_unstage(store, &batched->content);
    store_blob_unstage(store, &batched->maps);
    store_surface_clear(&batched->surface);
    free(batched->bytes);
    free(batched->map_bytes);
    free(batched);
}

/* The bytes and what of them is on the disk. */
static int stage_batched(struct store *store, struct batched *batched)
{
    struct store_surface *surface = &batched->surface;
    size_t count = count_of(surface->lmax);
    int status;

    batched->bytes = malloc(count * 8);
    if (!batched->bytes) {
        return STORE_NOMEM;
    }
    store_put_doubles(batched->bytes, surface->coefficients, count);
    status = store_blob_stage(store, batched->bytes, count * 8, &batched->content);
    if (status == STORE_OK && surface->maps.count) {
        batched->put.maps = &batched->maps;
        status = store_maps_stage(store, &surface->maps, &batched->map_bytes, &batched->maps);
    }
    free(surface->coefficients);
    surface->coefficients = NULL;
    return status;
}

int store_batch_add_surface(struct store_batch *batch, struct store_surface *surface)
{
    struct store *store = store_batch_store(batch);
    struct batched *batched = calloc(1, sizeof *batched);
    int status;

    if (!batched) {
        store_surface_clear(surface);
        return STORE_NOMEM;
    }
    batched->surface = *surface;
    *surface = (struct store_surface){0};
    batched->put = (struct put){
        .surface = &batched->surface, .content = &batched->content, .now = store_now_ms()};
    status = stage_batched(store, batched);
    return store_batch_add(
        batch, status, STORE_BATCH_SURFACE,
        &(struct store_batch_item){run_put, &batched->put, clear_batched, batched});
}

struct list {
    bool (*visit)(void *user, const struct store_surface *surface);
    void *user;
};

static int list_row(void *argument, sqlite3_stmt *row, bool *more)
{
    const struct list *list = argument;
    struct store_surface surface;
    int status = from_row(row, &surface);

    if (status == STORE_OK) {
        *more = list->visit(list->user, &surface);
        store_surface_clear(&surface);
    }
    return status;
}

const struct store_listing store_surface_listing = {
    STORE_LISTING_OF_CONTENT("surface", COLUMNS_AS),
    .process = "listed.process",
    .cohort = STORE_LISTED_BY_COHORT("surface"),
    .mesh = STORE_LISTED_BY_MESH,
};

int store_surface_list(struct store *store, const struct store_page *page,
                       bool (*visit)(void *user, const struct store_surface *surface), void *user)
{
    struct list list = {.visit = visit, .user = user};

    return store_page_walk(store, &store_surface_listing, page, list_row, &list);
}
