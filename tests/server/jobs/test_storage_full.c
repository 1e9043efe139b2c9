/*
 * Results for which there is no room fail their job with storage-full, and so does scratch,
 * whatever the process makes of it; the engine goes on: on a file system of 2 MB that only a
 * process of its own sees. Skipped without the right to mount
 * one.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <sys/wait.h>
#include <time.h>

#include "../store/fixture.h"
#include "jobs/jobs.h"
#include "jobs/submit.h"
#include "store/store.h"
#include "support/small_disk.h"
#include "store/job.h"

#define CANNOT_MOUNT 77
#define TRIES 10000

/* Answers with as many bytes as the inputs say. */
static void run_size(struct jobs_run *run, void *user, const char *inputs,
                     struct jobs_result *result)
{
    size_t size = strtoul(inputs, NULL, 10);

    (void)run;
    (void)user;
    result->results = malloc(size + 1);
    memset(result->results, 'r', size);
    result->results[size] = '\0';
}

/* Writes as many bytes to scratch as the inputs say, and reads the last of them; answers in any
   case. */
static void run_scratch(struct jobs_run *run, void *user, const char *inputs,
                        struct jobs_result *result)
{
    const struct srnf_scratch *scratch = jobs_run_scratch(run);
    unsigned char bytes[10000], read[sizeof bytes];
    size_t size = strtoul(inputs, NULL, 10), at = 0;
    int status = scratch ? SRNF_OK : SRNF_EIO;

    (void)user;
    memset(bytes, 's', sizeof bytes);
    for (; status == SRNF_OK && at < size; at += sizeof bytes) {
        status = scratch->write(scratch->user, at, bytes, sizeof bytes);
    }
    if (status == SRNF_OK && (scratch->read(scratch->user, at - sizeof read, read, sizeof read) ||
                              memcmp(read, bytes, sizeof read) != 0)) {
        result->problem_code = "data-damaged";
    } else if (status == SRNF_OK && jobs_run_scratch(run)->used != at) {
        result->problem_code = "internal"; /* the next who asks would write over it */
    } else {
        result->results = strdup("{}");
    }
}

/* Submits a job and waits for its end; the row goes to *job. */
static bool run_to_end(struct jobs *jobs, const char *process, const char *inputs,
                       struct store_job *job)
{
    struct timespec time = {.tv_nsec = 2000000L};
    enum jobs_submission how;
    char id[STORE_ID_MAX];

    if (jobs_submit(jobs, NULL, process, inputs, NULL, NULL, job, &how) != JOBS_OK) {
        return false;
    }
    memcpy(id, job->id, sizeof id);
    for (int i = 0; i < TRIES && job->status <= STORE_JOB_RUNNING; i++) {
        nanosleep(&time, NULL);
        store_job_clear(job);
        if (jobs_get(jobs, id, job) != STORE_OK) {
            return false;
        }
    }
    return true;
}

/* In the child; returns the number of what failed. */
static int run_on_a_small_disk(const char *path)
{
    static const struct jobs_process table[] = {
        {"size", run_size, NULL}, {"scratch", run_scratch, NULL}, {NULL, NULL, NULL}};
    struct jobs_config config = {.workers = 1, .table = table};
    char message[256];
    struct jobs *jobs;
    struct store_job job;

    if (!small_disk_mount(path, "size=2m")) {
        return CANNOT_MOUNT;
    }
    if (store_open(&config.store, path, message, sizeof message) != STORE_OK ||
        jobs_open(&jobs, &config) != JOBS_OK) {
        return 1;
    }
    if (!run_to_end(jobs, "size", "4000000", &job) || job.status != STORE_JOB_FAILED ||
        strcmp(job.problem_code, "storage-full") != 0) {
        return 2;
    }
    store_job_clear(&job);
    if (!run_to_end(jobs, "scratch", "4000000", &job) || job.status != STORE_JOB_FAILED ||
        strcmp(job.problem_code, "storage-full") != 0 ||
        !strstr(job.problem_detail, "--job-cache")) {
        return 4;
    }
    store_job_clear(&job);
    if (!run_to_end(jobs, "scratch", "300000", &job) || job.status != STORE_JOB_SUCCESSFUL) {
        return 5;
    }
    store_job_clear(&job);
    if (!run_to_end(jobs, "size", "300000", &job) || job.status != STORE_JOB_SUCCESSFUL) {
        return 3;
    }
    store_job_clear(&job);
    jobs_close(jobs, 5.0);
    store_close(config.store);
    return 0;
}

static void no_room_for_results_is_a_failure(void **state)
{
    struct fixture *fixture = *state;
    int status;
    pid_t child = fork();

    assert_true(child >= 0);
    if (child == 0) {
        _exit(run_on_a_small_disk(fixture->path));
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    if (WEXITSTATUS(status) == CANNOT_MOUNT) {
        print_message("# no right to mount a small file system\n");
        skip();
    }
    assert_int_equal(WEXITSTATUS(status), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(no_room_for_results_is_a_failure, fixture_setup_closed,
                                        fixture_teardown),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
