/*
 * test_scratch.c - files of running jobs: what is written is read, by the next attempt too; they go
 * with the end of their job, however it ends, and at a start where it has ended before.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>

#include "server/store/fixture.h"
#include "store/internal.h"
#include "store/scratch.h"

#define SIZE ((size_t)5000)
#define FAR ((uint64_t)1 << 20)
#define WRITERS ((size_t)8)

static bool is_there(const struct fixture *fixture, const char *job)
{
    char path[SCRATCH_MAX + 80];

    (void)snprintf(path, sizeof path, "%s/scratch/%s", fixture->path, job);
    return access(path, F_OK) == 0;
}

/* A file for the job with some bytes. */
static void write_some(struct fixture *fixture, const char *job)
{
    struct store_scratch *scratch;
    unsigned char *bytes = fixture_bytes(SIZE, 1);
    uint64_t used;

    assert_int_equal(store_scratch_open(fixture->store, job, false, &scratch, &used), STORE_OK);
    assert_int_equal(used, 0);
    assert_int_equal(store_scratch_write(scratch, 0, bytes, SIZE), STORE_OK);
    store_scratch_close(scratch);
    free(bytes);
    assert_true(is_there(fixture, job));
}

static void what_is_written_is_read(void **state)
{
    struct fixture *fixture = *state;
    unsigned char *bytes = fixture_bytes(SIZE, 7), read[SIZE];
    struct store_scratch *scratch;
    uint64_t used;

    assert_int_equal(store_scratch_open(fixture->store, "job-a", true, &scratch, &used), STORE_OK);
    assert_int_equal(used, 0);
    assert_false(is_there(fixture, "job-a"));
    assert_int_equal(store_scratch_write(scratch, FAR, bytes, SIZE), STORE_OK);
    assert_int_equal(store_scratch_read(scratch, FAR, read, SIZE), STORE_OK);
    assert_memory_equal(read, bytes, SIZE);
    assert_int_equal(store_scratch_read(scratch, FAR + 1, read, SIZE), STORE_CORRUPT);
    store_scratch_close(scratch);
    assert_int_equal(store_scratch_open(fixture->store, "job-a", true, &scratch, &used), STORE_OK);
    assert_int_equal(used, FAR + SIZE);
    memset(read, 0, SIZE);
    assert_int_equal(store_scratch_read(scratch, FAR, read, SIZE), STORE_OK);
    assert_memory_equal(read, bytes, SIZE);
    store_scratch_close(scratch);
    /* An attempt that cannot use it begins with nothing. */
    assert_int_equal(store_scratch_open(fixture->store, "job-a", false, &scratch, &used), STORE_OK);
    assert_int_equal(used, 0);
    assert_false(is_there(fixture, "job-a"));
    store_scratch_close(scratch);
    free(bytes);
}

struct writer {
    struct store_scratch *scratch;
    pthread_t thread;
    size_t number;
    int status;
};

static void *write_one(void *argument)
{
    struct writer *writer = argument;
    unsigned char *bytes = fixture_bytes(SIZE, (unsigned)writer->number);

    writer->status = store_scratch_write(writer->scratch, writer->number * SIZE, bytes, SIZE);
    free(bytes);
    return NULL;
}

static void many_may_be_the_first_to_write(void **state)
{
    struct fixture *fixture = *state;
    struct writer writers[WRITERS];
    struct store_scratch *scratch;
    unsigned char read[SIZE];
    uint64_t used;

    assert_int_equal(store_scratch_open(fixture->store, "job-b", false, &scratch, &used), STORE_OK);
    for (size_t i = 0; i < WRITERS; i++) {
        writers[i] = (struct writer){.scratch = scratch, .number = i};
        assert_int_equal(pthread_create(&writers[i].thread, NULL, write_one, &writers[i]), 0);
    }
    for (size_t i = 0; i < WRITERS; i++) {
        unsigned char *bytes = fixture_bytes(SIZE, (unsigned)i);

        pthread_join(writers[i].thread, NULL);
        assert_int_equal(writers[i].status, STORE_OK);
        assert_int_equal(store_scratch_read(scratch, i * SIZE, read, SIZE), STORE_OK);
        assert_memory_equal(read, bytes, SIZE);
        free(bytes);
    }
    store_scratch_close(scratch);
}

/* Inserts a job, and claims it. */
static void run_job(struct fixture *fixture, int number, struct store_job *job)
{
    char id[STORE_ID_MAX];

    assert_int_equal(fixture_insert_job(fixture->store, number, id), STORE_OK);
    assert_int_equal(store_job_claim(fixture->store, job), STORE_OK);
    assert_string_equal(job->id, id);
    write_some(fixture, id);
}

static void goes_with_the_end_of_its_job(void **state)
{
    struct fixture *fixture = *state;
    struct store *store = fixture->store;
    char id[STORE_ID_MAX];
    struct store_job job;

    run_job(fixture, 1, &job);
    assert_int_equal(
        store_job_transition(store, job.id, job.attempt, STORE_JOB_ACCEPTED, NULL, NULL, NULL),
        STORE_OK);
    assert_true(is_there(fixture, job.id)); /* it is to go on */
    store_job_clear(&job);
    assert_int_equal(store_job_claim(store, &job), STORE_OK);
    assert_int_equal(
        store_job_transition(store, job.id, job.attempt, STORE_JOB_SUCCESSFUL, "{}", NULL, NULL),
        STORE_OK);
    assert_false(is_there(fixture, job.id));
    store_job_clear(&job);

    run_job(fixture, 2, &job);
    assert_int_equal(store_job_transition(store, job.id, job.attempt, STORE_JOB_FAILED, NULL,
                                          "numerical-failure", "."),
                     STORE_OK);
    assert_false(is_there(fixture, job.id));
    store_job_clear(&job);

    assert_int_equal(fixture_insert_job(store, 3, id), STORE_OK);
    write_some(fixture, id);
    assert_int_equal(store_job_request_cancel(store, id, &job), STORE_OK);
    assert_false(is_there(fixture, id));
    store_job_clear(&job);
}

/* An operator may link the folder to another disk, where other files may lie. */
static void goes_from_a_linked_folder(void **state)
{
    struct fixture *fixture = *state;
    char link[SCRATCH_MAX + 80], elsewhere[SCRATCH_MAX + 80], other[SCRATCH_MAX + 100];
    FILE *file;

    (void)snprintf(link, sizeof link, "%s/scratch", fixture->path);
    (void)snprintf(elsewhere, sizeof elsewhere, "%s/elsewhere", fixture->path);
    (void)snprintf(other, sizeof other, "%s/notes", elsewhere);
    (void)rmdir(link);
    assert_int_equal(mkdir(elsewhere, 0700), 0);
    assert_int_equal(symlink("elsewhere", link), 0);
    file = fopen(other, "w");
    assert_non_null(file);
    assert_int_equal(fclose(file), 0);
    write_some(fixture, "job-a");
    write_some(fixture, "job-b");
    store_scratch_remove(fixture->store, "job-a");
    assert_false(is_there(fixture, "job-a"));
    fixture_reopen(fixture);
    assert_int_equal(store_scratch_sweep(fixture->store), STORE_OK);
    assert_false(is_there(fixture, "job-b"));
    assert_int_equal(access(other, F_OK), 0);
}

static void is_swept_at_a_start(void **state)
{
    struct fixture *fixture = *state;
    char id[STORE_ID_MAX];
    struct store_job job;
    size_t requeued, failed;

    run_job(fixture, 4, &job);
    memcpy(id, job.id, sizeof id);
    store_job_clear(&job);
    write_some(fixture, "job-gone");
    fixture_reopen(fixture);
    assert_int_equal(store_job_recover(fixture->store, 3, NULL, &requeued, &failed), STORE_OK);
    assert_int_equal(requeued, 1);
    assert_true(is_there(fixture, id));
    assert_false(is_there(fixture, "job-gone"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_is_written_is_read, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(many_may_be_the_first_to_write, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(goes_with_the_end_of_its_job, fixture_setup,
                                        fixture_teardown),
        cmocka_unit_test_setup_teardown(goes_from_a_linked_folder, fixture_setup, fixture_teardown),
        cmocka_unit_test_setup_teardown(is_swept_at_a_start, fixture_setup, fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
