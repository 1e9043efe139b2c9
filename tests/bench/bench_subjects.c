/*
 * bench_subjects.c - a mean of thousands of subjects whose registrations a thousand workers return:
 * what each costs the daemon, and where it saturates. The workers are threads (drawn.h); each takes
 * a task, fetches what it is about as a worker with a cache does, answers after a time that is
 * drawn, and returns what was found once for one of the subjects, so that bytes and their reading
 * are real and only the search is left out. The daemon's share of a mean after the registrations is
 * not run: the job is cancelled then.
 *
 *   bench_subjects [SUBJECTS [THREADS MILLISECONDS [none]]]    1000 subjects in three rows
 *
 * With "none" contents are not fetched, which tells what their requests cost.
 *
 * Beside processor and bytes a task it tells which thread of the daemon has most to do, its largest
 * memory, and the size of the database.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "bench/drawn.h"
#include "tasks/tasks.h"

#include <sys/stat.h>

#define DEGREE ((size_t)15)
#define COUNT ((DEGREE + 1) * (DEGREE + 1))
#define SUBJECTS_MAX ((size_t)10000)
#define SENDERS ((size_t)8)
#define SUBJECTS_AT 48 /* in the inputs of a task: how many subjects it has */

static struct drawn drawn;
static char (*ids)[80];
static size_t subjects;
static atomic_size_t sent;
static struct tasks_bytes found; /* of one subject */
static bool fetches = true;

/* ---- Subjects -------------------------------------------------------------------------------- */

/* A sphere with waves of its own, small and of low degree mostly: JSON (malloc). */
static char *describe(size_t i, size_t *size)
{
    uint64_t state = 7919 * (i + 1);
    char *body = NULL;
    FILE *out = open_memstream(&body, size);

    (void)fprintf(out, "{\"coefficients\":{\"lmax\":%zu", DEGREE);
    for (size_t c = 0; c < 3; c++) {
        (void)fprintf(out, ",\"%c\":[", "xyz"[c]);
        for (size_t k = 0; k < COUNT; k++) {
            double l = floor(sqrt((double)k));
            double wave = k > 0 ? 0.2 * (drawn_uniform(&state) - 0.5) / (l * l) : 0.0;
            double value = wave + (k == (size_t[]){3, 1, 2}[c] ? 1.0 + 0.3 * (double)c : 0.0);

            (void)fprintf(out, "%s%.6g", k ? "," : "", value);
        }
        (void)fputc(']', out);
    }
    (void)fputs("}}", out);
    (void)fclose(out);
    return body;
}

/* As ids[i]. */
static void make_subject(struct link *link, size_t i)
{
    struct link_answer answer;
    size_t size;
    char *body = describe(i, &size);
    json_t *document;

    link_send(link,
              &(struct link_request){.method = "POST",
                                     .path = "/v1/surfaces",
                                     .type = "application/json",
                                     .body = body,
                                     .size = size,
                                     .seconds = 60.0},
              &answer);
    if (answer.status / 100 != 2) {
        drawn_give_up(&drawn, "a surface", (const char *)answer.bytes);
    }
    document = json_loadb((const char *)answer.bytes, answer.size, 0, NULL);
    (void)snprintf(ids[i], sizeof ids[i], "%s", json_string_value(json_object_get(document, "id")));
    json_decref(document);
    link_answer_clear(&answer);
    free(body);
}

static void *send_subjects(void *argument)
{
    struct link *link = link_create(&drawn.target, &drawn.stop);
    size_t i;

    (void)argument;
    while ((i = atomic_fetch_add(&sent, 1)) < subjects) {
        make_subject(link, i);
    }
    link_destroy(link);
    return NULL;
}

static void send_all(void)
{
    pthread_t threads[SENDERS];

    for (size_t i = 0; i < SENDERS; i++) {
        if (pthread_create(&threads[i], NULL, send_subjects, NULL)) {
            drawn_give_up(&drawn, "threads", "too many");
        }
    }
    for (size_t i = 0; i < SENDERS; i++) {
        (void)pthread_join(threads[i], NULL);
    }
}

static void submit(size_t row, char job[80])
{
    char *body = NULL;
    size_t size;
    FILE *out = open_memstream(&body, &size);

    (void)fprintf(out, "{\"inputs\":{\"tolerance\":%.12g,\"surfaces\":[",
                  1e-3 + 1e-9 * (double)row);
    for (size_t i = 0; i < subjects; i++) {
        (void)fprintf(out, "%s\"%s\"", i ? "," : "", ids[i]);
    }
    (void)fputs("]}}", out);
    (void)fclose(out);
    drawn_send(&drawn, "/v1/processes/mean/execution", "Prefer: respond-async\r\n", body, "jobID",
               job);
    free(body);
}

/* ---- Workers --------------------------------------------------------------------------------- */

struct worker {
    pthread_t thread;
    size_t number;
    double mean;
    uint64_t state;
    char field[TASKS_DIGEST_SIZE]; /* the centre that it has */
    size_t done, refused;
};

static atomic_size_t returned, tasks; /* subjects, and tasks of them */
static size_t first;                  /* subjects of the task that was there to see */

/* How many the task is about, beside the centre. */
static size_t subjects_of(const struct drawn_lease *lease)
{
    return json_array_size(json_object_get(lease->document, "contents")) - 1;
}

/* Gets what the task is about that the worker does not have. */
static bool fetch(struct worker *worker, struct link *link, const struct drawn_lease *lease)
{
    size_t n = json_array_size(json_object_get(lease->document, "contents"));
    bool good = true;

    for (size_t i = strcmp(worker->field, drawn_content(lease, 0)) == 0; i < n && good; i++) {
        struct link_answer answer;

        good = drawn_fetch(link, lease, i, &answer);
        link_answer_clear(&answer);
    }
    (void)snprintf(worker->field, sizeof worker->field, "%s", drawn_content(lease, 0));
    return good;
}

static void *work_on(void *argument)
{
    struct worker *worker = argument;
    struct link *link = link_create(&drawn.target, &drawn.stop);

    while (link && !atomic_load(&drawn.stop)) {
        struct drawn_lease lease;
        size_t n;

        if (!drawn_ask(&drawn, link, worker->number, 2.0, &lease)) {
            worker->refused++;
        } else if (lease.document) {
            bool good = !fetches || fetch(worker, link, &lease);

            drawn_pause(drawn_seconds(&worker->state, worker->mean));
            n = subjects_of(&lease);
            good = drawn_return(link, &lease, found.bytes, found.size, n) && good;
            worker->refused += !good;
            (void)atomic_fetch_add(&returned, good ? n : 0);
            (void)atomic_fetch_add(&tasks, good);
        }
    }
    link_destroy(link);
    return NULL;
}

/* Computes the first subject of a task, as a worker does: what it finds is that of all. Waits until
   there is a task. */
static void find_one(void)
{
    struct link *link = link_create(&drawn.target, &drawn.stop);
    struct link_answer answers[2];
    struct tasks_content contents[2];
    struct drawn_lease lease = {.document = NULL};
    unsigned char inputs[4096];
    size_t size = 0;
    const char *text;

    while (!lease.document) {
        (void)drawn_ask(&drawn, link, 0, 20.0, &lease);
    }
    for (size_t i = 0; i < 2; i++) {
        if (!drawn_fetch(link, &lease, i, &answers[i])) {
            drawn_give_up(&drawn, "a content", answers[i].why);
        }
        contents[i] = (struct tasks_content){.bytes = answers[i].bytes, .size = answers[i].size};
    }
    text = json_string_value(json_object_get(lease.document, "inputs"));
    if (sodium_base642bin(inputs, sizeof inputs, text, strlen(text), NULL, &size, NULL,
                          sodium_base64_VARIANT_ORIGINAL) != 0 ||
        size < SUBJECTS_AT + 8) {
        drawn_give_up(&drawn, "a task", "it cannot be read");
    }
    memset(inputs + SUBJECTS_AT, 0, 8);
    inputs[SUBJECTS_AT] = 1;
    if (tasks_kind_find(TASKS_SEARCHES)->run(inputs, size, contents, 2, NULL, &found, NULL) != 0) {
        drawn_give_up(&drawn, "a task", "it cannot be computed");
    }
    (void)printf("a task: %zu bytes of the centre, %zu of the subject, %zu found\n",
                 contents[0].size, contents[1].size, found.size);
    link_answer_clear(&answers[0]);
    link_answer_clear(&answers[1]);
    first = subjects_of(&lease);
    if (!drawn_return(link, &lease, found.bytes, found.size, first)) {
        drawn_give_up(&drawn, "a result", "it is not taken");
    }
    link_destroy(link);
}

/* ---- Rows ------------------------------------------------------------------------------------ */

/* Whether a job has tasks to lease now. */
static bool is_offered(void)
{
    struct link *link = link_create(&drawn.target, &drawn.stop);
    struct drawn_lease lease = {.document = NULL};
    bool offered;

    (void)drawn_ask(&drawn, link, 0, 20.0, &lease);
    first = lease.document ? subjects_of(&lease) : 0;
    offered = lease.document && drawn_return(link, &lease, found.bytes, found.size, first);
    link_destroy(link);
    return offered;
}

static void cancel(const char *job)
{
    char path[120], status[80] = "";

    (void)snprintf(path, sizeof path, "/v1/jobs/%s/cancel", job);
    (void)daemon_status(&drawn.service, "POST", path, "");
    while (strcmp(status, "running") == 0 || !status[0]) {
        (void)usleep(20000);
        drawn_job(&drawn, job, "status", status);
    }
}

static double file_mib(const char *name)
{
    struct stat info;
    char path[400];

    (void)snprintf(path, sizeof path, "%s/%s", drawn.service.data, name);
    return stat(path, &info) == 0 ? (double)info.st_size / 1048576.0 : 0.0;
}

static void run_row(size_t row, size_t threads, double mean)
{
    static struct worker workers[DRAWN_WORKERS_MAX];
    struct drawn_cost before, after;
    size_t refused = 0;
    char job[80];

    submit(row, job);
    if (!found.bytes) {
        find_one();
        (void)printf(" workers  task ms   ideal/s %s  refused   MiB  database MiB\n", DRAWN_HEAD);
    } else {
        while (!is_offered()) {
        }
    }
    atomic_store(&returned, first);
    atomic_store(&tasks, 0);
    atomic_store(&drawn.stop, false);
    before = drawn_measure(&drawn);
    for (size_t i = 0; i < threads; i++) {
        workers[i] = (struct worker){.number = 1 + i, .mean = mean, .state = 977 * (i + 1)};
        if (pthread_create(&workers[i].thread, NULL, work_on, &workers[i])) {
            drawn_give_up(&drawn, "threads", "too many");
        }
    }
    while (atomic_load(&returned) < subjects && drawn_now() - before.seconds < 600.0) {
        (void)usleep(10000);
    }
    after = drawn_measure(&drawn);
    atomic_store(&drawn.stop, true);
    for (size_t i = 0; i < threads; i++) {
        (void)pthread_join(workers[i].thread, NULL);
        refused += workers[i].refused;
    }
    (void)printf("%8zu %8.0f %9.0f ", threads, 1e3 * mean,
                 (double)threads / (mean > 1e-3 ? mean : 1e-3));
    drawn_print(&before, &after, (double)atomic_load(&tasks));
    (void)printf(" %8zu %5.0f %13.0f\n", refused, after.memory,
                 file_mib("srnfd.db") + file_mib("srnfd.db-wal"));
    (void)fflush(stdout);
    cancel(job);
}

int main(int n_arguments, char **arguments)
{
    subjects = n_arguments > 1 ? strtoul(arguments[1], NULL, 10) : 1000;
    if (subjects < 2 || subjects > SUBJECTS_MAX) {
        (void)fprintf(stderr, "2 to %zu subjects\n", SUBJECTS_MAX);
        return 2;
    }
    ids = calloc(subjects, sizeof *ids);
    drawn_open(&drawn);
    send_all();
    (void)printf("%zu subjects at degree %zu\n", subjects, DEGREE);
    fetches = n_arguments != 5 || strcmp(arguments[4], "none") != 0;
    if (n_arguments >= 4) {
        run_row(0, strtoul(arguments[2], NULL, 10) % (DRAWN_WORKERS_MAX + 1),
                1e-3 * strtod(arguments[3], NULL));
    } else {
        run_row(0, 100, 1.0);
        run_row(1, 1000, 5.0);
        run_row(2, 1000, 1.0);
    }
    free(found.bytes);
    free(ids);
    return drawn_close(&drawn);
}
