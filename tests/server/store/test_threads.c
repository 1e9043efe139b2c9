/*
 * Twenty threads write and read at once; then everything that was acknowledged is there, once.
 *
 * Assertions are made on the main thread only: cmocka leaves a test by a jump, which must not
 * cross threads.
 * srnfd-test: slow
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdatomic.h>

#include "fixture.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/page.h"

#define THREADS 20
#define ROUNDS 15

struct shared {
    struct store *store;
    atomic_int next, errors;
    atomic_int claimed, made, created[ROUNDS];
};

static void expect(struct shared *shared, bool condition)
{
    atomic_fetch_add(&shared->errors, !condition);
}

/* A mesh that all threads store in the same round: exactly one of them creates it. Every third is
   large. */
static void put_the_same(struct shared *shared, int round)
{
    size_t size = round % 3 == 0 ? STORE_INLINE_MAX + 100 : 2000, got = 0;
    unsigned char *bytes = fixture_bytes(size, (unsigned)round), *content = NULL;
    char id[STORE_ID_MAX];
    bool created = false;

    expect(shared, fixture_put_mesh(shared->store, bytes, size, id, &created) == STORE_OK);
    atomic_fetch_add(&shared->created[round], created);
    expect(shared, store_mesh_content(shared->store, id, &content, &got) == STORE_OK);
    expect(shared, content && got == size && memcmp(content, bytes, size) == 0);
    free(content);
    free(bytes);
}

/* A job of one's own, and the end of whichever job comes first. */
static void insert_and_claim(struct shared *shared)
{
    int number = atomic_fetch_add(&shared->next, 1);
    char id[STORE_ID_MAX];
    struct store_job job;

    expect(shared, fixture_insert_job(shared->store, number, id) == STORE_OK);
    expect(shared, store_job_get(shared->store, id, &job) == STORE_OK);
    store_job_clear(&job);
    if (store_job_claim(shared->store, &job) == STORE_OK) {
        atomic_fetch_add(&shared->claimed, 1);
        expect(shared, store_job_transition(shared->store, job.id, job.attempt,
                                            STORE_JOB_SUCCESSFUL, "{}", NULL, NULL) == STORE_OK);
        store_job_clear(&job);
    }
}

/* The same digest from all threads: one job. */
static void insert_the_same(struct shared *shared, int round, int number)
{
    char process[] = "encode", inputs[] = "{}";
    struct store_job job = {.process = process, .inputs = inputs, .created_ms = 1};
    int status;

    snprintf(job.id, sizeof job.id, "job-same-%d-%d", round, number);
    store_sha256_hex(job.digest, &round, sizeof round);
    status = store_job_insert(shared->store, &job, NULL, NULL, NULL);
    expect(shared, status == STORE_OK || status == STORE_CONFLICT);
    atomic_fetch_add(&shared->made, status == STORE_OK);
}

static bool see(void *user, const struct store_job *job)
{
    (void)job;
    ++*(int *)user;
    return true;
}

static void *thread_main(void *user)
{
    struct shared *shared = user;
    int number = atomic_fetch_add(&shared->next, 1);

    for (int round = 0; round < ROUNDS; round++) {
        struct store_page page = {.limit = 20};
        int seen = 0;

        put_the_same(shared, round);
        insert_and_claim(shared);
        insert_the_same(shared, round, number);
        expect(shared, store_job_list(shared->store, &page, see, &seen) == STORE_OK && seen > 0);
    }
    return NULL;
}

static void twenty_threads_write_and_read(void **state)
{
    struct fixture *fixture = *state;
    struct shared shared = {.store = fixture->store};
    pthread_t threads[THREADS];
    size_t waiting, successful;

    for (int i = 0; i < THREADS; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, thread_main, &shared), 0);
    }
    for (int i = 0; i < THREADS; i++) {
        pthread_join(threads[i], NULL);
    }
    assert_int_equal(shared.errors, 0);
    for (int round = 0; round < ROUNDS; round++) {
        assert_int_equal(shared.created[round], 1);
    }
    /* A digest may be used again only after its job has ended otherwise than successfully. */
    assert_int_equal(shared.made, ROUNDS);
    fixture_reopen(fixture);
    assert_int_equal(store_job_count(fixture->store, STORE_JOB_SUCCESSFUL, &successful), STORE_OK);
    assert_int_equal(store_job_count(fixture->store, STORE_JOB_ACCEPTED, &waiting), STORE_OK);
    assert_int_equal(successful, shared.claimed);
    assert_int_equal(successful + waiting, THREADS * ROUNDS + ROUNDS);
}

/* Results that are dropped and stored again at the same moment are never lost: the files of equal
   content are shared. */
struct churn {
    struct store *store;
    const char *text;
    atomic_int next, errors;
};

static void *churn_main(void *user)
{
    struct churn *churn = user;

    for (int i = 0; i < ROUNDS; i++) {
        char id[STORE_ID_MAX], *results = NULL;
        struct store_job job;
        size_t size;
        bool fine =
            fixture_insert_job(churn->store, atomic_fetch_add(&churn->next, 1), id) == STORE_OK &&
            store_job_claim(churn->store, &job) == STORE_OK;

        if (fine) {
            fine = store_job_transition(churn->store, job.id, 1, STORE_JOB_SUCCESSFUL, churn->text,
                                        NULL, NULL) == STORE_OK &&
                   store_job_results(churn->store, job.id, &results, &size) == STORE_OK &&
                   strcmp(results, churn->text) == 0 &&
                   store_job_delete(churn->store, job.id) == STORE_OK;
            store_job_clear(&job);
        }
        free(results);
        atomic_fetch_add(&churn->errors, !fine);
    }
    return NULL;
}

static void shared_blobs_come_and_go(void **state)
{
    struct fixture *fixture = *state;
    char *text = malloc(STORE_INLINE_MAX + 2);
    struct churn churn = {.store = fixture->store, .text = text};
    pthread_t threads[6];

    memset(text, 'x', STORE_INLINE_MAX + 1);
    text[STORE_INLINE_MAX + 1] = '\0';
    for (int i = 0; i < 6; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, churn_main, &churn), 0);
    }
    for (int i = 0; i < 6; i++) {
        pthread_join(threads[i], NULL);
    }
    free(text);
    assert_int_equal(churn.errors, 0);
}

/* Lists without a pause: there is hardly a moment without a reader. */
static void *read_on(void *user)
{
    struct churn *churn = user;
    const struct store_page page = {.limit = 5};

    while (atomic_load(&churn->next) == 0) {
        int seen = 0;

        atomic_fetch_add(&churn->errors,
                         store_job_list(churn->store, &page, see, &seen) != STORE_OK);
    }
    return NULL;
}

/* Rounds of 60 MB in one go, without the pause in which the log would be copied at leisure. The log
   begins anew whenever all of it is copied and no reader looks at it: after a few rounds it must be
   smaller than what went through it, however the threads were scheduled. */
static void the_log_stays_bounded_under_load(void **state)
{
    struct fixture *fixture = *state;
    struct churn churn = {.store = fixture->store};
    unsigned char *bytes = fixture_bytes(200000, 9);
    char path[512], id[STORE_ID_MAX];
    pthread_t readers[2];
    struct stat info = {.st_size = 0};
    double written = 0.0;
    unsigned count = 0;
    bool created;

    snprintf(path, sizeof path, "%s/srnfd.db-wal", fixture->path);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(pthread_create(&readers[i], NULL, read_on, &churn), 0);
    }
    do {
        for (unsigned i = 0; i < 300; i++, count++) {
            memcpy(bytes, &count, sizeof count);
            atomic_fetch_add(&churn.errors, fixture_put_mesh(fixture->store, bytes, 200000, id,
                                                             &created) != STORE_OK);
            written += 200000.0;
        }
        atomic_fetch_add(&churn.errors, stat(path, &info) != 0);
    } while ((double)info.st_size > 0.8 * written && written < 4e8);
    atomic_store(&churn.next, 1);
    for (int i = 0; i < 2; i++) {
        pthread_join(readers[i], NULL);
    }
    free(bytes);
    printf("# %.0f MB written, a log of %.0f MB\n", 1e-6 * written, 1e-6 * (double)info.st_size);
    assert_int_equal(churn.errors, 0);
    assert_true((double)info.st_size <= 0.8 * written);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup, fixture_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(twenty_threads_write_and_read),
        TEST(shared_blobs_come_and_go),
        TEST(the_log_stays_bounded_under_load),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
