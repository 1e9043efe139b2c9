/*
 * bench_tasks.c - what tasks of workers cost the daemon: a thousand workers as threads that lease
 * over HTTP, answer after times that are drawn, and return a result that they have not computed.
 *
 *   bench_tasks [THREADS MILLISECONDS]   one row instead of the table
 *
 * A row is one job of `distances`, each of whose pairs is a task. It tells tasks a second, and for
 * each task the processor time of the daemon, what goes over the network, and what it writes.
 * Threads of workers share the machine with the daemon: where both want the processors, tasks a
 * second are what is left to it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "support/daemon.h"
#include "worker/link.h"
#include "build.h"

#include <curl/curl.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define SURFACES 100
#define TASKS (SURFACES * (SURFACES - 1) / 2)
#define THREADS_MAX 1000
#define RESULT_DIGEST "sha-256=:TPpbQspmkyh2TmfNmjS7j5CxbtfKjYXoRDeD18zOFe0=:"

static struct daemon service;
static char ids[SURFACES][80];
static char url[64], build[BUILD_ARITHMETIC_SIZE];
static atomic_bool stop;
static struct link_target target = {.url = url};

static double now(void)
{
    struct timespec time;

    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void give_up(const char *what, const char *detail)
{
    (void)fprintf(stderr, "bench_tasks: %s: %s\n", what, detail);
    daemon_release(&service);
    exit(1);
}

/* ---- What is computed ------------------------------------------------------------------------ */

/* Ellipsoids with a bend, all different. */
static void make_surface(size_t i)
{
    static const char fields[] = "Content-Type: application/json\r\n";
    double x[25] = {[3] = 1.0, [6] = 0.05 * sin((double)i)}, y[25] = {[1] = 1.0},
           z[25] = {[2] = 1.0 + 0.01 * (double)i};
    const double *all[3] = {x, y, z};
    struct answer answer;
    char body[2000];
    int length = snprintf(body, sizeof body, "{\"coefficients\":{\"lmax\":4");

    for (size_t c = 0; c < 3; c++) {
        length += snprintf(body + length, sizeof body - (size_t)length, ",\"%c\":[", "xyz"[c]);
        for (size_t k = 0; k < 25; k++) {
            length += snprintf(body + length, sizeof body - (size_t)length, "%s%g", k ? "," : "",
                               all[c][k]);
        }
        length += snprintf(body + length, sizeof body - (size_t)length, "]");
    }
    length += snprintf(body + length, sizeof body - (size_t)length, "}}");
    if (daemon_request(&service, "POST", "/v1/surfaces", fields, body, (size_t)length, &answer) /
            100 !=
        2) {
        give_up("a surface", answer.body ? answer.body : "no answer");
    }
    answer_member(&answer, "id", ids[i], sizeof ids[i]);
    answer_clear(&answer);
}

/* A job of all pairs, the surfaces in an order of its own; its id. */
static void submit(size_t row, char job[80])
{
    static const char fields[] = "Content-Type: application/json\r\nPrefer: respond-async\r\n";
    struct answer answer;
    char body[SURFACES * 90 + 100];
    int length =
        snprintf(body, sizeof body, "{\"inputs\":{\"handedness\":\"ignore\",\"surfaces\":[");

    for (size_t i = 0; i < SURFACES; i++) {
        length += snprintf(body + length, sizeof body - (size_t)length, "%s\"%s\"", i ? "," : "",
                           ids[(i + row) % SURFACES]);
    }
    length += snprintf(body + length, sizeof body - (size_t)length, "]}}");
    if (daemon_request(&service, "POST", "/v1/processes/distances/execution", fields, body,
                       (size_t)length, &answer) /
            100 !=
        2) {
        give_up("a job", answer.body ? answer.body : "no answer");
    }
    answer_member(&answer, "jobID", job, 80);
    answer_clear(&answer);
}

/* ---- What it costs --------------------------------------------------------------------------- */

struct cost {
    double seconds, processor, received, sent, written;
};

static double metric(const char *text, const char *name)
{
    const char *at = text;
    double sum = 0.0;

    while ((at = strstr(at, name)) != NULL) {
        if (at > text && at[-1] == '\n') {
            sum += strtod(strpbrk(at, " ") + 1, NULL);
        }
        at += strlen(name);
    }
    return sum;
}

static struct cost measure(void)
{
    struct cost cost = {.seconds = now()};
    struct answer answer;
    char path[64], line[256];
    FILE *file;

    if (daemon_request(&service, "GET", "/metrics", "", NULL, 0, &answer) != 200) {
        give_up("metrics", "no answer");
    }
    cost.processor = metric(answer.body, "process_cpu_seconds_total ");
    cost.received = metric(answer.body, "srnfd_http_received_bytes_total ");
    cost.sent = metric(answer.body, "srnfd_http_sent_bytes_total ");
    answer_clear(&answer);
    (void)snprintf(path, sizeof path, "/proc/%ld/io", (long)service.pid);
    file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file)) {
        if (strncmp(line, "wchar: ", 7) == 0) {
            cost.written = strtod(line + 7, NULL); /* files and sockets */
        }
    }
    if (file) {
        (void)fclose(file);
    }
    return cost;
}

/* ---- Workers --------------------------------------------------------------------------------- */

struct worker {
    pthread_t thread;
    size_t number;
    double mean; /* seconds of a task */
    uint64_t state;
    size_t done, refused;
};

/* Of an exponential distribution, cut at three times its mean: no lease is to expire. */
static double draw(struct worker *worker)
{
    double times;

    worker->state = worker->state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    times = -log1p(-(double)(worker->state >> 11) * 0x1p-53);
    return worker->mean * (times < 3.0 ? times : 3.0);
}

static bool member(const struct link_answer *answer, const char *name, char value[64])
{
    const char *at = strstr((const char *)answer->bytes, name);

    return at && sscanf(at + strlen(name), "\":\"%63[^\"]", value) == 1;
}

/* One task; false: there is none. */
static bool work(struct worker *worker, struct link *link)
{
    static const unsigned char half[8] = {[6] = 0xe0, [7] = 0x3f}; /* 0.5 */
    struct link_answer answer;
    char body[600], task[64] = "", secret[64] = "", path[160];
    double seconds;

    (void)snprintf(body, sizeof body,
                   "{\"worker\":\"thread-%zu\",\"host\":\"bench\",\"cpu\":\"none\",\"slots\":1,"
                   "\"numericBuild\":\"%s\",\"wait\":2}",
                   worker->number, build);
    link_send(link,
              &(struct link_request){.method = "POST",
                                     .path = "/v1/leases",
                                     .type = "application/json",
                                     .body = body,
                                     .size = strlen(body),
                                     .seconds = 30.0},
              &answer);
    if (answer.status == 201 && member(&answer, "task", task)) {
        (void)member(&answer, "secret", secret);
    }
    if (answer.status >= 400 && answer.status < 500) {
        give_up("a lease", (const char *)answer.bytes); /* the daemon is of another build */
    }
    worker->refused += answer.status != 201 && answer.status != 204;
    link_answer_clear(&answer);
    if (!task[0]) {
        return false;
    }
    seconds = draw(worker);
    (void)nanosleep(&(struct timespec){.tv_sec = (time_t)seconds,
                                       .tv_nsec = (long)(1e9 * (seconds - floor(seconds)))},
                    NULL);
    (void)snprintf(path, sizeof path, "/v1/leases/%s/result", task);
    link_send(link,
              &(struct link_request){.method = "PUT",
                                     .path = path,
                                     .secret = secret,
                                     .type = "application/octet-stream",
                                     .digest = RESULT_DIGEST,
                                     .body = half,
                                     .size = sizeof half,
                                     .seconds = 30.0},
              &answer);
    worker->done += answer.status == 204;
    worker->refused += answer.status != 204;
    link_answer_clear(&answer);
    return true;
}

static void *work_on(void *argument)
{
    struct worker *worker = argument;
    struct link *link = link_create(&target, &stop);

    while (link && !atomic_load(&stop)) {
        if (!work(worker, link) && worker->done > 0) {
            break;
        }
    }
    link_destroy(link);
    return NULL;
}

/* ---- A row ----------------------------------------------------------------------------------- */

static bool has_ended(const char *job)
{
    struct answer answer;
    char path[120], status[32];

    (void)snprintf(path, sizeof path, "/v1/jobs/%s", job);
    (void)daemon_request(&service, "GET", path, "", NULL, 0, &answer);
    answer_member(&answer, "status", status, sizeof status);
    answer_clear(&answer);
    return strcmp(status, "successful") == 0 || strcmp(status, "failed") == 0;
}

static void run_row(size_t row, size_t threads, double mean)
{
    static struct worker workers[THREADS_MAX];
    struct cost before, after;
    char job[80];
    size_t done = 0, refused = 0;
    double tasks = TASKS;

    submit(row, job);
    before = measure();
    for (size_t i = 0; i < threads; i++) {
        workers[i] = (struct worker){.number = i, .mean = mean, .state = 977 * (i + 1)};
        if (pthread_create(&workers[i].thread, NULL, work_on, &workers[i])) {
            give_up("threads", "too many");
        }
    }
    while (!has_ended(job) && now() - before.seconds < 120.0) {
        (void)usleep(20000);
    }
    after = measure();
    atomic_store(&stop, true);
    for (size_t i = 0; i < threads; i++) {
        (void)pthread_join(workers[i].thread, NULL);
        done += workers[i].done;
        refused += workers[i].refused;
    }
    atomic_store(&stop, false);
    (void)printf("%8zu %9.0f %9.0f %9.0f %9.2f %9.0f %9.0f %9.0f %8zu %8zu\n", threads, 1e3 * mean,
                 (double)threads / (mean > 1e-3 ? mean : 1e-3),
                 tasks / (after.seconds - before.seconds),
                 1e3 * (after.processor - before.processor) / tasks,
                 (after.received - before.received) / tasks, (after.sent - before.sent) / tasks,
                 (after.written - before.written) / tasks, done, refused);
    (void)fflush(stdout);
}

int main(int n_arguments, char **arguments)
{
    static const char *const options[] = {
        "--executor",        "workers", "--lease-seconds",      "30",   "--workers", "1",
        "--max-connections", "2048",    "--max-owner-requests", "2048", NULL};
    char folder[] = "/tmp/srnfd-tasks.XXXXXX", command[80];

    (void)curl_global_init(CURL_GLOBAL_DEFAULT);
    if (!mkdtemp(folder)) {
        return 1;
    }
    daemon_prepare(&service, folder, "data");
    service.options = options;
    if (!daemon_start(&service)) {
        give_up("the daemon", "it does not start");
    }
    (void)snprintf(url, sizeof url, "http://127.0.0.1:%d", service.port);
    build_arithmetic_id(build);
    for (size_t i = 0; i < SURFACES; i++) {
        make_surface(i);
    }
    (void)printf("%d tasks a row\n%8s %9s %9s %9s %9s %9s %9s %9s %8s %8s\n", TASKS, "threads",
                 "task ms", "ideal /s", "tasks /s", "cpu ms", "in B", "out B", "write B", "done",
                 "refused");
    if (n_arguments == 3) {
        run_row(0, (size_t)strtoul(arguments[1], NULL, 10) % (THREADS_MAX + 1),
                1e-3 * strtod(arguments[2], NULL));
    } else {
        static const struct {
            size_t threads;
            double mean;
        } rows[] = {{1, 0.0}, {16, 0.0}, {100, 0.5}, {1000, 5.0}, {1000, 2.0}};

        for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
            run_row(i, rows[i].threads, rows[i].mean);
        }
    }
    (void)daemon_stop(&service);
    daemon_release(&service);
    (void)snprintf(command, sizeof command, "rm -rf --one-file-system %s", folder);
    return system(command) == 0 ? 0 : 1;
}
