/*
 * test_twice.c - writes that run a second time, as on a disk that was full at the first try or
 * after another write of their group has failed: what they did the first time counts for nothing.
 * srnfd-test: once (the store computes nothing)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>

#include "server/store/fixture.h"
#include "store/batch.h"
#include "store/internal.h"
#include "store/surface.h"

/* ---- A disk that is full for one write of the log -------------------------------------------- */

static sqlite3_vfs full_disk;               /* the default one with another xOpen */
static sqlite3_io_methods full_log;         /* those of the log, with another xWrite */
static const sqlite3_io_methods *plain_log; /* as they were */
static atomic_int full_for;                 /* writes that are still to find no room */

static int write_log(sqlite3_file *file, const void *bytes, int size, sqlite3_int64 at)
{
    if (atomic_load(&full_for) > 0) {
        atomic_fetch_sub(&full_for, 1);
        return SQLITE_FULL;
    }
    return plain_log->xWrite(file, bytes, size, at);
}

static int open_file(sqlite3_vfs *vfs, const char *name, sqlite3_file *file, int flags, int *given)
{
    int rc = sqlite3_vfs_find("unix")->xOpen(vfs, name, file, flags, given);

    if (rc == SQLITE_OK && (flags & SQLITE_OPEN_WAL)) {
        plain_log = file->pMethods;
        full_log = *plain_log;
        full_log.xWrite = write_log;
        file->pMethods = &full_log;
    }
    return rc;
}

static int fill_disks(void **state)
{
    (void)state;
    full_disk = *sqlite3_vfs_find("unix");
    full_disk.zName = "full";
    full_disk.pNext = NULL;
    full_disk.xOpen = open_file;
    return sqlite3_vfs_register(&full_disk, 1);
}

/* ---- Recovery -------------------------------------------------------------------------------- */

/* A job that ran alone and others are found running, and there is no room to write it: with the
   reserve recovery runs again, and leaves none running. */
static void recovery_on_a_full_disk_leaves_nothing_running(void **state)
{
    struct fixture *fixture = *state;
    char alone[STORE_ID_MAX], others[3][STORE_ID_MAX];
    struct store_job job;
    size_t requeued, failed;

    assert_int_equal(fixture_insert_job(fixture->store, 0, alone), STORE_OK);
    assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
    store_job_clear(&job);
    assert_int_equal(store_job_recover(fixture->store, 1, NULL, &requeued, &failed), STORE_OK);
    assert_int_equal(store_job_claim_alone(fixture->store, &job), STORE_OK);
    assert_string_equal(job.id, alone);
    store_job_clear(&job);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(fixture_insert_job(fixture->store, 1 + i, others[i]), STORE_OK);
        assert_int_equal(store_job_claim(fixture->store, &job), STORE_OK);
        store_job_clear(&job);
    }

    atomic_store(&full_for, 1);
    assert_int_equal(store_job_recover(fixture->store, 3, NULL, &requeued, &failed), STORE_OK);
    assert_int_equal(atomic_load(&full_for), 0);
    assert_int_equal(requeued, 3);
    assert_int_equal(failed, 1);
    assert_int_equal(fixture_status(fixture->store, alone), STORE_JOB_FAILED);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(fixture_status(fixture->store, others[i]), STORE_JOB_ACCEPTED);
    }
}

/* ---- A job that is restored ------------------------------------------------------------------ */

#define TAKEN "job-01234567-89ab-7cde-8f01-23456789abcd"

static sem_t holding, go_on;

/* Holds the writer, so that what comes meanwhile makes a group. */
static int run_holding(struct store *store, sqlite3 *db, struct store_write *write)
{
    (void)store;
    (void)db;
    (void)write;
    (void)sem_post(&holding);
    (void)sem_wait(&go_on);
    return STORE_OK;
}

/* Breaks its group, once. */
static int run_breaking(struct store *store, sqlite3 *db, struct store_write *write)
{
    int *times = write->argument;

    (void)store;
    (void)db;
    return (*times)++ == 0 ? STORE_IO : STORE_OK;
}

static void *hold(void *user)
{
    assert_int_equal(store_write(user, run_holding, NULL), STORE_OK);
    return NULL;
}

static void *commit(void *user)
{
    struct store_batch *batch = user;
    size_t failed;

    assert_int_equal(store_batch_commit(batch, "b", &failed), STORE_OK);
    return NULL;
}

static void *break_once(void *user)
{
    int times = 0;

    assert_int_equal(store_write(user, run_breaking, &times), STORE_OK);
    assert_int_equal(times, 2);
    return NULL;
}

static void wait_for_queue(struct store *store, size_t length)
{
    for (size_t n = 0; n < length; usleep(1000)) {
        n = 0;
        pthread_mutex_lock(&store->writer.mutex);
        for (const struct store_write *write = store->writer.head; write; write = write->next) {
            n++;
        }
        pthread_mutex_unlock(&store->writer.mutex);
    }
}

/* Commits the batch in a group that fails, so that it is done twice. */
static void commit_twice(struct store *store, struct store_batch *batch)
{
    pthread_t threads[3];

    assert_int_equal(sem_init(&holding, 0, 0), 0);
    assert_int_equal(sem_init(&go_on, 0, 0), 0);
    assert_int_equal(pthread_create(&threads[0], NULL, hold, store), 0);
    (void)sem_wait(&holding);
    assert_int_equal(pthread_create(&threads[1], NULL, commit, batch), 0);
    wait_for_queue(store, 1);
    assert_int_equal(pthread_create(&threads[2], NULL, break_once, store), 0);
    wait_for_queue(store, 2);
    (void)sem_post(&go_on);
    for (size_t i = 0; i < 3; i++) {
        assert_int_equal(pthread_join(threads[i], NULL), 0);
    }
}

/* A sphere of degree 1 that the job has made. */
static struct store_surface made_surface(const char *owner)
{
    struct store_surface surface = {
        .record = strdup("{\"source\":{\"process\":\"mean\",\"job\":\"" TAKEN "\"}}"),
        .lmax = 1,
        .coefficients = calloc(12, sizeof(double)),
        .coefficient_count = 12,
        .owner = {.name = owner},
    };

    surface.coefficients[3] = surface.coefficients[5] = surface.coefficients[10] = 1.0;
    store_surface_id(surface.id, 1, surface.coefficients, 1.0);
    return surface;
}

static struct store_job restored_job(const char *owner)
{
    struct store_job job = {.id = TAKEN,
                            .process = strdup("mean"),
                            .inputs = strdup("{}"),
                            .numeric_build = strdup("test build"),
                            .created_ms = 1,
                            .started_ms = 2,
                            .finished_ms = 3};

    snprintf(job.owner, sizeof job.owner, "%s", owner);
    store_sha256_hex(job.digest, owner, strlen(owner));
    return job;
}

static void restore(struct store *store, const char *owner, bool twice)
{
    struct store_batch *batch = store_batch_create(store);
    struct store_surface surface = made_surface(owner);
    struct store_job job = restored_job(owner);
    char results[128];
    size_t failed;

    snprintf(results, sizeof results, "{\"surface\":\"%s\"}", surface.id);
    assert_int_equal(store_batch_add_surface(batch, &surface), STORE_OK);
    assert_int_equal(store_batch_add_job(batch, &job, results, strlen(results), 0), STORE_OK);
    if (twice) {
        commit_twice(store, batch);
    } else {
        assert_int_equal(store_batch_commit(batch, owner, &failed), STORE_OK);
    }
    store_batch_destroy(batch);
}

/* Another owner has the job's id. What it made names it by the id that it got, also where the batch
   was done twice. */
static void a_job_restored_twice_is_named_by_its_new_id(void **state)
{
    struct fixture *fixture = *state;
    struct store_surface surface = made_surface("b"), held;
    struct store_job job, found;

    restore(fixture->store, "a", false);
    restore(fixture->store, "b", true);
    job = restored_job("b");
    assert_int_equal(store_job_find(fixture->store, job.digest, &found), STORE_OK);
    assert_string_not_equal(found.id, TAKEN);
    assert_int_equal(store_surface_get_as(fixture->store, "b", surface.id, false, &held), STORE_OK);
    if (!strstr(held.record, found.id)) {
        fail_msg("the record %s, the job %s", held.record, found.id);
    }
    store_job_clear(&job);
    store_job_clear(&found);
    store_surface_clear(&surface);
    store_surface_clear(&held);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(recovery_on_a_full_disk_leaves_nothing_running),
        TEST(a_job_restored_twice_is_named_by_its_new_id),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, fill_disks, NULL);
}
