/*
 * bench_tasks.c - what tasks of workers cost the daemon: up to a thousand workers as threads that
 * lease over HTTP, answer after times that are drawn, and return a result that they have not
 * computed (drawn.h).
 *
 *   bench_tasks [THREADS MILLISECONDS]   one row of the second table alone
 *
 * A row is one job of `distances`, whose pairs are tasks, or blocks of them where they are many.
 * The first table has tasks of one second exactly: how long one to six workers take, and how much
 * longer than that is without what comes between two tasks; "cpu ms" is processor time of the
 * daemon for each, but for that "of the job", whose thread computes a few pairs again, with workers
 * or without. The second has as many tasks as come: for each the processor time of the daemon, what
 * goes over the network, and what is written to the disk.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "bench/drawn.h"

#define SURFACES 230
#define PAIRS_AT 40 /* in the inputs of a task: how many pairs it has */

static struct drawn drawn;
static atomic_size_t returned, pairs; /* tasks, and what they had */
static char ids[SURFACES][80];

/* ---- What is computed ------------------------------------------------------------------------ */

/* Ellipsoids with a bend, all different. */
static void make_surface(size_t i)
{
    double x[25] = {[3] = 1.0, [6] = 0.05 * sin((double)i)}, y[25] = {[1] = 1.0},
           z[25] = {[2] = 1.0 + 0.01 * (double)i};
    const double *all[3] = {x, y, z};
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
    (void)snprintf(body + length, sizeof body - (size_t)length, "}}");
    drawn_send(&drawn, "/v1/surfaces", "", body, "id", ids[i]);
}

/* A job of all pairs of n surfaces, in an order of its own; its id. */
static void submit(size_t row, size_t n, char job[80])
{
    char body[SURFACES * 90 + 100];
    int length =
        snprintf(body, sizeof body, "{\"inputs\":{\"handedness\":\"ignore\",\"surfaces\":[");

    for (size_t i = 0; i < n; i++) {
        length += snprintf(body + length, sizeof body - (size_t)length, "%s\"%s\"", i ? "," : "",
                           ids[(i + row) % SURFACES]);
    }
    (void)snprintf(body + length, sizeof body - (size_t)length, "]}}");
    drawn_send(&drawn, "/v1/processes/distances/execution", "Prefer: respond-async\r\n", body,
               "jobID", job);
}

/* ---- Workers --------------------------------------------------------------------------------- */

struct worker {
    pthread_t thread;
    size_t number;
    double mean; /* seconds of a task */
    bool exact;  /* all take as long */
    uint64_t state;
    size_t done, refused;
};

/* One task; false: there is none. */
static bool work(struct worker *worker, struct link *link)
{
    static const unsigned char half[8] = {[6] = 0xe0, [7] = 0x3f}; /* 0.5 */
    struct drawn_lease lease;
    size_t n;

    if (!drawn_ask(&drawn, link, worker->number, 2.0, &lease)) {
        worker->refused++;
        return true;
    }
    if (!lease.document) {
        return false;
    }
    n = (size_t)drawn_number(&lease, PAIRS_AT);
    drawn_pause(worker->exact ? worker->mean : drawn_seconds(&worker->state, worker->mean));
    if (drawn_return(link, &lease, half, sizeof half, n)) {
        worker->done++;
        (void)atomic_fetch_add(&returned, 1);
        (void)atomic_fetch_add(&pairs, n);
    } else {
        worker->refused++;
    }
    return true;
}

static void *work_on(void *argument)
{
    struct worker *worker = argument;
    struct link *link = link_create(&drawn.target, &drawn.stop);

    while (link && !atomic_load(&drawn.stop)) {
        if (!work(worker, link) && worker->done > 0) {
            break;
        }
    }
    link_destroy(link);
    return NULL;
}

/* ---- Rows ------------------------------------------------------------------------------------ */

struct row {
    size_t threads, surfaces;
    double mean;
};

/* Until the job has ended; returns the seconds since then, and how many requests were refused. */
static double run_workers(const struct row *row, bool exact, const char *job, double begun,
                          size_t *refused)
{
    static struct worker workers[DRAWN_WORKERS_MAX];
    char status[80] = "";
    double seconds;

    *refused = 0;
    atomic_store(&returned, 0);
    atomic_store(&pairs, 0);
    atomic_store(&drawn.stop, false);
    for (size_t i = 0; i < row->threads; i++) {
        workers[i] =
            (struct worker){.number = i, .mean = row->mean, .exact = exact, .state = 977 * (i + 1)};
        if (pthread_create(&workers[i].thread, NULL, work_on, &workers[i])) {
            drawn_give_up(&drawn, "threads", "too many");
        }
    }
    while (strcmp(status, "successful") != 0 && strcmp(status, "failed") != 0 &&
           drawn_now() - begun < 300.0) {
        (void)usleep(10000);
        if (atomic_load(&pairs) >= row->surfaces * (row->surfaces - 1) / 2) {
            drawn_job(&drawn, job, "status", status); /* before, that would cost it more */
        }
    }
    seconds = drawn_now() - begun;
    atomic_store(&drawn.stop, true);
    for (size_t i = 0; i < row->threads; i++) {
        (void)pthread_join(workers[i].thread, NULL);
        *refused += workers[i].refused;
    }
    return seconds;
}

/* Tasks of a second by some workers, against as many seconds as each of them must work. */
static void run_exact(size_t number, const struct row *row)
{
    size_t tasks = row->surfaces * (row->surfaces - 1) / 2, refused;
    double ideal = ceil((double)tasks / (double)row->threads) * row->mean, seconds;
    struct drawn_cost before, after;
    char job[80];

    submit(number, row->surfaces, job);
    before = drawn_measure(&drawn);
    seconds = run_workers(row, true, job, before.seconds, &refused);
    after = drawn_measure(&drawn);
    (void)printf("%8zu %8zu %9.1f %9.2f %9.1f %% %9.2f %11.2f\n", row->threads, tasks, ideal,
                 seconds, 100.0 * ideal / seconds,
                 1e3 * drawn_sum(&before, &after, false) / (double)tasks,
                 1e3 * drawn_sum(&before, &after, true) / (double)tasks);
    (void)fflush(stdout);
}

static void run_drawn(size_t number, const struct row *row)
{
    struct drawn_cost before, after;
    size_t refused;
    char job[80];

    submit(number, row->surfaces, job);
    before = drawn_measure(&drawn);
    (void)run_workers(row, false, job, before.seconds, &refused);
    after = drawn_measure(&drawn);
    (void)printf("%8zu %8.0f %9.0f ", row->threads, 1e3 * row->mean,
                 (double)row->threads / (row->mean > 1e-3 ? row->mean : 1e-3));
    drawn_print(&before, &after, (double)atomic_load(&returned));
    (void)printf(" %8zu\n", refused);
    (void)fflush(stdout);
}

int main(int n_arguments, char **arguments)
{
    static const struct row exact[] = {{1, 5, 1.0}, {2, 7, 1.0}, {4, 9, 1.0}, {6, 12, 1.0}};
    static const struct row rows[] = {{1, 100, 0.0},
                                      {16, SURFACES, 0.0},
                                      {100, SURFACES, 0.5},
                                      {1000, SURFACES, 5.0},
                                      {1000, SURFACES, 2.0}};
    const size_t n_exact = sizeof exact / sizeof exact[0], n_rows = sizeof rows / sizeof rows[0];
    bool one = n_arguments == 3;

    drawn_open(&drawn);
    for (size_t i = 0; i < SURFACES; i++) {
        make_surface(i);
    }
    if (!one) {
        (void)printf(" workers    tasks   ideal s         s  efficiency    cpu ms  "
                     "of the job\n");
    }
    for (size_t i = 0; i < n_exact && !one; i++) {
        run_exact(i, &exact[i]);
    }
    (void)printf("\n workers  task ms   ideal/s %s  refused\n", DRAWN_HEAD);
    if (one) {
        run_drawn(0, &(struct row){strtoul(arguments[1], NULL, 10) % (DRAWN_WORKERS_MAX + 1),
                                   SURFACES, 1e-3 * strtod(arguments[2], NULL)});
    }
    for (size_t i = 0; i < n_rows && !one; i++) {
        run_drawn(i, &rows[i]);
    }
    return drawn_close(&drawn);
}
