/*
 * test_fault.c - a daemon that dies of a fault tells which job its thread ran: one line on standard
 * error, and at the next start that job alone has failed; what ran beside it is put back without a
 * death. A fault outside of jobs blames none of them.
 *
 * srnfd-test: release-only
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/wait.h>
#include <time.h>

#include "../store/fixture.h"
#include "jobs/fault.h"
#include "jobs/jobs.h"
#include "jobs/submit.h"
#include "store/job.h"
#include "store/page.h"
#include "store/store.h"

static atomic_int besides; /* jobs that run beside the deadly one */

static void nap(void)
{
    const struct timespec time = {.tv_nsec = 10000000};

    (void)nanosleep(&time, NULL);
}

static void run_lasting(struct jobs_run *run, void *user, const char *inputs,
                        struct jobs_result *result)
{
    (void)run;
    (void)user;
    (void)inputs;
    (void)result;
    (void)atomic_fetch_add(&besides, 1);
    for (;;) {
        nap();
    }
}

/* Until the stack is used up. */
static void dive(volatile char *above)
{
    volatile char here[4096];

    if (atomic_load(&besides) > 100) {
        return;
    }

    here[0] = above ? above[0] : 0;
    dive(here);
    here[1] = here[0]; /* no tail call */
}

static void run_deadly(struct jobs_run *run, void *user, const char *inputs,
                       struct jobs_result *result)
{
    (void)run;
    (void)user;
    (void)result;
    while (atomic_load(&besides) < 2) {
        nap();
    }
    switch (inputs[0]) {
    case 's':
        (void)raise(SIGSEGV);
        break;
    case 'a':
        abort();
    default:
        dive(NULL);
    }
}

static const struct jobs_process table[] = {
    {"lasting", run_lasting, NULL}, {"deadly", run_deadly, NULL}, {NULL, NULL, NULL}};

/* The life of a daemon that ends by a fault: of a job, or, without inputs, of a thread without
   one. */
static void live(const char *path, const char *inputs, int told)
{
    struct jobs_config config = {
        .workers = 3, .table = table, .numeric_build = "test", .max_queued = 10};
    char faulty[STORE_ID_MAX];
    struct store_job job = {0};
    enum jobs_submission how;
    struct jobs *jobs;

    (void)dup2(told, STDERR_FILENO);
    config.store = fixture_store(path);
    if (!fault_open(path, faulty)) {
        _exit(1);
    }
    fault_watch();
    if (jobs_open(&jobs, &config) != JOBS_OK ||
        jobs_submit(jobs, NULL, "lasting", "1", NULL, NULL, &job, &how) != 0 ||
        jobs_submit(jobs, NULL, "lasting", "2", NULL, NULL, &job, &how) != 0) {
        _exit(2);
    }
    if (inputs && jobs_submit(jobs, NULL, "deadly", inputs, NULL, NULL, &job, &how) != 0) {
        _exit(3);
    }
    while (!inputs && atomic_load(&besides) < 2) {
        nap();
    }
    if (!inputs) {
        (void)raise(SIGSEGV);
    }
    for (int i = 0; i < 3000; i++) {
        nap();
    }
    _exit(4);
}

struct tally {
    char deadly[STORE_ID_MAX];
    size_t crashed, accepted;
};

static bool count(void *user, const struct store_job *job)
{
    struct tally *tally = user;

    if (strcmp(job->process, "deadly") == 0) {
        (void)snprintf(tally->deadly, sizeof tally->deadly, "%s", job->id);
        tally->crashed += job->status == STORE_JOB_FAILED && job->problem_code &&
                          strcmp(job->problem_code, "job-crashed") == 0;
    } else {
        tally->accepted += job->status == STORE_JOB_ACCEPTED;
    }
    return true;
}

static void dies_by(const char *path, const char *inputs, int number, struct tally *tally,
                    char text[512])
{
    const struct store_page page = {.limit = 10};
    char faulty[STORE_ID_MAX];
    size_t requeued, failed;
    struct store *store;
    int told[2], status;
    ssize_t n;
    pid_t child;

    assert_int_equal(pipe(told), 0);
    child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        live(path, inputs, told[1]);
    }
    (void)close(told[1]);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status));
    assert_int_equal(WTERMSIG(status), number);
    n = read(told[0], text, 511);
    text[n > 0 ? n : 0] = '\0';
    (void)close(told[0]);
    store = fixture_store(path);
    assert_true(fault_open(path, faulty));
    assert_int_equal(store_job_recover(store, 3, faulty, &requeued, &failed), STORE_OK);
    fault_clear();
    fault_close();
    assert_int_equal(requeued, 2);
    assert_int_equal(failed, inputs ? 1 : 0);
    assert_int_equal(store_job_list(store, &page, count, tally), STORE_OK);
    assert_int_equal(tally->accepted, 2);
    assert_string_equal(faulty, tally->deadly);
    assert_true(fault_open(path, faulty)); /* once told it is not told again */
    assert_string_equal(faulty, "");
    fault_close();
    store_close(store);
}

static void the_job_at_fault_is_blamed(void **state)
{
    static const struct {
        const char *inputs;
        int number;
        const char *name;
    } cases[] = {{"s", SIGSEGV, "SIGSEGV"}, {"a", SIGABRT, "SIGABRT"}, {"o", SIGSEGV, "SIGSEGV"}};

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char path[SCRATCH_MAX], text[512];
        struct tally tally = {.deadly = ""};

        assert_true(scratch_make(path, "fault"));
        dies_by(path, cases[i].inputs, cases[i].number, &tally, text);
        assert_int_equal(tally.crashed, 1);
        assert_non_null(strstr(text, cases[i].name));
        assert_non_null(strstr(text, tally.deadly));
        assert_non_null(strstr(text, "\"process\":\"deadly\""));
        scratch_remove(path);
    }
}

static void a_fault_elsewhere_blames_no_job(void **state)
{
    char path[SCRATCH_MAX], text[512];
    struct tally tally = {.deadly = ""};

    (void)state;
    assert_true(scratch_make(path, "fault"));
    dies_by(path, NULL, SIGSEGV, &tally, text);
    assert_int_equal(tally.crashed, 0);
    assert_non_null(strstr(text, "no job"));
    scratch_remove(path);
}

/* What is no record of a fault names nobody, and a folder that is not there has no record. */
static void records_are_judged(void **state)
{
    static const char *const texts[] = {"", "no job\n", "job-1", "../x\n", "job-1;drop\n"};
    char path[SCRATCH_MAX], file[SCRATCH_MAX + 8], faulty[STORE_ID_MAX] = "x";

    (void)state;
    assert_true(scratch_make(path, "fault"));
    (void)snprintf(file, sizeof file, "%s/fault", path);
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        FILE *record = fopen(file, "w");

        assert_non_null(record);
        (void)fputs(texts[i], record);
        (void)fclose(record);
        assert_true(fault_open(path, faulty));
        assert_string_equal(faulty, "");
        fault_close();
    }
    scratch_remove(path);
    assert_false(fault_open(path, faulty));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_job_at_fault_is_blamed),
        cmocka_unit_test(a_fault_elsewhere_blames_no_job),
        cmocka_unit_test(records_are_judged),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
