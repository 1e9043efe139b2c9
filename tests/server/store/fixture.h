/*
 * fixture.h - what the tests of the store and of the engine share: a data directory that goes
 * away, and rows to put into it. For programs that include cmocka.h first.
 */
#ifndef SRNFD_TEST_FIXTURE_H
#define SRNFD_TEST_FIXTURE_H

#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "store/store.h"
#include "store/digest.h"
#include "support/scratch.h"
#include "store/job.h"
#include "store/mesh.h"

struct fixture {
    char path[SCRATCH_MAX];
    struct store *store;
};

static inline struct store *fixture_store(const char *path)
{
    struct store *store = NULL;
    char message[256];
    int status = store_open(&store, path, message, sizeof message);

    if (status != STORE_OK) {
        fail_msg("store_open: %s (%s)", store_strerror(status), message);
    }
    return store;
}

/* The directory only: nothing is open, and no thread runs. */
static inline int fixture_setup_closed(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);

    assert_true(scratch_make(fixture->path, "test"));
    *state = fixture;
    return 0;
}

static inline int fixture_setup(void **state)
{
    struct fixture *fixture;

    fixture_setup_closed(state);
    fixture = *state;
    fixture->store = fixture_store(fixture->path);
    return 0;
}

static inline int fixture_teardown(void **state)
{
    struct fixture *fixture = *state;

    store_close(fixture->store);
    scratch_remove(fixture->path);
    free(fixture);
    return 0;
}

static inline void fixture_reopen(struct fixture *fixture)
{
    store_close(fixture->store);
    fixture->store = fixture_store(fixture->path);
}

/* Changes stored inline content while no store has it open. */
static inline void fixture_damage_inline(struct fixture *fixture)
{
    char path[512];
    sqlite3 *db;

    store_close(fixture->store);
    snprintf(path, sizeof path, "%s/srnfd.db", fixture->path);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db,
                                  "UPDATE blob SET bytes = zeroblob(size) WHERE bytes IS NOT NULL",
                                  NULL, NULL, NULL),
                     SQLITE_OK);
    sqlite3_close(db);
    fixture->store = fixture_store(fixture->path);
}

/* Bytes that differ from seed to seed and do not compress into a pattern. */
static inline unsigned char *fixture_bytes(size_t size, unsigned seed)
{
    unsigned char *bytes = malloc(size + 1);
    uint64_t x = 0x9e3779b97f4a7c15u * (seed + 1);

    for (size_t i = 0; i < size; i++) {
        x = x * 6364136223846793005u + 1442695040888963407u;
        bytes[i] = (unsigned char)(x >> 56);
    }
    bytes[size] = '\0';
    return bytes;
}

/* Puts a mesh of these bytes; returns the status. */
static inline int fixture_put_mesh(struct store *store, const unsigned char *bytes, size_t size,
                                   char id[STORE_ID_MAX], bool *created)
{
    struct store_mesh mesh = {
        .name = strdup("a name"),
        .format = strdup("ply"),
        .report = strdup("{\"closed\":true}"),
        .bytes = (int64_t)size,
        .vertices = 4,
        .faces = 4,
    };
    int status;

    store_content_id(mesh.id, "mesh-", bytes, size);
    memcpy(id, mesh.id, STORE_ID_MAX);
    status = store_mesh_put(store, &mesh, bytes, created);
    store_mesh_clear(&mesh);
    return status;
}

/* Inserts an accepted job whose id, time and digest follow from its number. */
static inline int fixture_insert_job(struct store *store, int number, char id[STORE_ID_MAX])
{
    char process[] = "encode", inputs[64], build[] = "test build", empty[] = "";
    struct store_job job = {.process = process,
                            .inputs = inputs,
                            .message = empty,
                            .numeric_build = build,
                            .created_ms = 1000 + number,
                            .progress = 0.0};

    snprintf(inputs, sizeof inputs, "{\"number\":%d}", number);
    snprintf(job.id, sizeof job.id, "job-%08d", number);
    store_sha256_hex(job.digest, inputs, strlen(inputs));
    memcpy(id, job.id, STORE_ID_MAX);
    return store_job_insert(store, &job, NULL, NULL, NULL);
}

static inline enum store_job_status fixture_status(struct store *store, const char *id)
{
    struct store_job job;
    enum store_job_status status;

    assert_int_equal(store_job_get(store, id, &job), STORE_OK);
    status = job.status;
    store_job_clear(&job);
    return status;
}

#endif
