/*
 * surface_maps.c - scalar maps on a surface: what a test found at each point of it.
 *
 * Maps are content: the same coefficients with other maps are another surface, whose id is made of
 * the plain one and of the maps. They are written in one transaction with the surface's row and
 * never change. Values are one blob of doubles (numbers.c), map after map.
 */
#include "store/internal.h"
#include "store/numbers.h"
#include "store/surface.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NAMES_MAX (STORE_MAPS_MAX * STORE_MAP_NAME_MAX)

void store_maps_clear(struct store_maps *maps)
{
    free(maps->values);
    *maps = (struct store_maps){0};
}

size_t store_maps_values(const struct store_maps *maps)
{
    return maps->count * (size_t)maps->n_theta * (size_t)maps->n_phi;
}

static void join_names(const struct store_maps *maps, char names[NAMES_MAX])
{
    size_t used = 0;

    names[0] = '\0';
    for (size_t i = 0; i < maps->count; i++) {
        int written =
            snprintf(names + used, NAMES_MAX - used, "%s%s", i ? "," : "", maps->names[i]);

        used += written > 0 ? (size_t)written : 0;
    }
}

/* False where the text does not hold maps->count names. */
static bool split_names(struct store_maps *maps, const char *names)
{
    for (size_t i = 0; i < maps->count; i++) {
        size_t length = strcspn(names, ",");

        if (length == 0 || length >= STORE_MAP_NAME_MAX) {
            return false;
        }
        memcpy(maps->names[i], names, length);
        maps->names[i][length] = '\0';
        names += length + (names[length] == ',');
    }
    return *names == '\0';
}

void store_surface_id_maps(char id[STORE_ID_MAX], const struct store_maps *maps)
{
    crypto_hash_sha256_state state;
    unsigned char bytes[8], hash[crypto_hash_sha256_BYTES];
    char hex[sizeof hash * 2 + 1], names[NAMES_MAX];

    join_names(maps, names);
    crypto_hash_sha256_init(&state);
    crypto_hash_sha256_update(&state, (const unsigned char *)id, strlen(id) + 1);
    crypto_hash_sha256_update(&state, (const unsigned char *)names, strlen(names) + 1);
    store_put_integer(bytes, maps->n_theta);
    crypto_hash_sha256_update(&state, bytes, sizeof bytes);
    store_put_integer(bytes, maps->n_phi);
    crypto_hash_sha256_update(&state, bytes, sizeof bytes);
    for (size_t i = 0; i < store_maps_values(maps); i++) {
        store_put_doubles(bytes, &maps->values[i], 1);
        crypto_hash_sha256_update(&state, bytes, sizeof bytes);
    }
    crypto_hash_sha256_final(&state, hash);
    sodium_bin2hex(hex, sizeof hex, hash, sizeof hash);
    snprintf(id, STORE_ID_MAX, "surf-%.32s", hex);
}

/* malloc; NULL without memory. */
static unsigned char *bytes_of(const struct store_maps *maps)
{
    size_t count = store_maps_values(maps);
    unsigned char *bytes = malloc(count * 8);

    if (bytes) {
        store_put_doubles(bytes, maps->values, count);
    }
    return bytes;
}

int store_maps_stage(struct store *store, const struct store_maps *maps, unsigned char **bytes,
                     struct store_content *content)
{
    *bytes = bytes_of(maps);
    return *bytes ? store_blob_stage(store, *bytes, 8 * store_maps_values(maps), content)
                  : STORE_NOMEM;
}

int store_maps_mend(struct store *store, const struct store_maps *maps)
{
    unsigned char *bytes = bytes_of(maps);
    int status = bytes ? store_blob_mend(store, bytes, 8 * store_maps_values(maps)) : STORE_NOMEM;

    free(bytes);
    return status;
}

int store_maps_insert(struct store *store, sqlite3 *db, const char *surface,
                      const struct store_maps *maps, const struct store_content *content)
{
    char names[NAMES_MAX];
    int status = store_blob_keep(store, db, content);

    join_names(maps, names);
    if (status == STORE_OK) {
        status =
            store_execute(db, NULL,
                          "INSERT INTO surface_maps (surface, names, maps, n_theta, n_phi, "
                          "content) VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT (surface) DO NOTHING",
                          "ttiiit", surface, names, (int64_t)maps->count, maps->n_theta,
                          maps->n_phi, content->hash);
    }
    return status;
}

static int from_row(sqlite3_stmt *row, struct store_maps *maps, char hash[65])
{
    int64_t count = sqlite3_column_int64(row, 1);
    int status = STORE_OK;
    char *names = store_column_text(row, 0, &status);

    maps->n_theta = sqlite3_column_int64(row, 2);
    maps->n_phi = sqlite3_column_int64(row, 3);
    store_column_id(row, 4, hash, 65);
    if (status == STORE_OK && (count < 1 || count > STORE_MAPS_MAX)) {
        status = STORE_CORRUPT;
    }
    if (status == STORE_OK) {
        maps->count = (size_t)count;
        status = split_names(maps, names) ? STORE_OK : STORE_CORRUPT;
    }
    free(names);
    return status;
}

int store_surface_maps(struct store *store, const char *id, struct store_maps *maps)
{
    char hash[65] = "";
    struct store_query query;
    int status = store_query_first(
        &query, store,
        "SELECT names, maps, n_theta, n_phi, content FROM surface_maps WHERE surface = ?", "t", id);

    *maps = (struct store_maps){0};
    if (status == STORE_OK) {
        status = from_row(query.row, maps, hash);
    }
    if (status == STORE_OK) {
        status = store_read_doubles(store, query.reader->db, hash, store_maps_values(maps),
                                    &maps->values);
    }
    if (status != STORE_OK) {
        store_maps_clear(maps);
    }
    store_query_close(&query);
    return status;
}
