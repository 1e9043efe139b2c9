/*
 * metrics.c - the table of metric families, their series, and the text that Prometheus reads.
 *
 * A series is kept under the values of its labels in a small hash table of its family. Series are
 * made when first counted and stay; their number is bounded (METRIC_SERIES_MAX) so that no client
 * can make the daemon hold, or a monitor store, more than the tables of routes, processes and
 * problems amount to. Histograms have one fixed set of bounds each.
 *
 * Counting takes no lock: a series is added at the head of its chain when it is complete, never
 * moves and never goes before the registry does, and its numbers are atomic. Lock: one mutex for
 * each family, to add a series; rank: innermost, nothing is called while it is held.
 */
#include "metrics.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHAINS 64 /* of the hash table of one family */
#define LABEL_BYTES_MAX 512
#define BOUNDS_MAX 14

enum kind { KIND_COUNTER, KIND_GAUGE, KIND_HISTOGRAM };
static const char *const kind_names[] = {"counter", "gauge", "histogram"};

/* Upper bounds of the buckets, in seconds: of answers, and of jobs. Ended by 0. */
static const double request_bounds[BOUNDS_MAX + 1] = {
    0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 10, 30, 0};
static const double job_bounds[BOUNDS_MAX + 1] = {0.01, 0.05, 0.1, 0.5, 1,    2.5,   5,
                                                  10,   30,   60,  300, 1800, 10800, 0};
/* The same in bytes, of what jobs have in use: 1 MiB to 16 GiB. */
#define MIB 1048576.0
static const double memory_bounds[BOUNDS_MAX + 1] = {
    1 * MIB,   4 * MIB,   8 * MIB,    16 * MIB,   32 * MIB,   64 * MIB,    128 * MIB,
    256 * MIB, 512 * MIB, 1024 * MIB, 2048 * MIB, 4096 * MIB, 16384 * MIB, 0};

static const struct family {
    enum kind kind;
    const char *name, *help;
    const char *labels[METRIC_LABELS_MAX]; /* NULL: no more */
    const double *bounds;                  /* of a histogram */
} families[METRICS] = {
    [METRIC_BUILD_INFO] = {KIND_GAUGE,
                           "srnfd_build_info",
                           "Always 1; the labels tell what was built.",
                           {"version", "numeric_build"},
                           NULL},
    [METRIC_HTTP_REQUESTS] = {KIND_COUNTER,
                              "srnfd_http_requests_total",
                              "Requests answered, by route of the API, method and status.",
                              {"route", "method", "status"},
                              NULL},
    [METRIC_HTTP_SECONDS] = {KIND_HISTOGRAM,
                             "srnfd_http_request_duration_seconds",
                             "From the end of the head of a request to its answer, by route.",
                             {"route"},
                             request_bounds},
    [METRIC_HTTP_RECEIVED] =
        {KIND_COUNTER, "srnfd_http_received_bytes_total", "Bytes of request bodies.", {NULL}, NULL},
    [METRIC_HTTP_SENT] =
        {KIND_COUNTER, "srnfd_http_sent_bytes_total", "Bytes of response bodies.", {NULL}, NULL},
    [METRIC_HTTP_REFUSALS] = {KIND_COUNTER,
                              "srnfd_http_refusals_total",
                              "Requests answered with a problem, by its code.",
                              {"code"},
                              NULL},
    [METRIC_HTTP_ACCEPTED] = {KIND_COUNTER,
                              "srnfd_http_connections_accepted_total",
                              "Connections accepted.",
                              {NULL},
                              NULL},
    [METRIC_HTTP_CONNECTIONS] = {KIND_GAUGE,
                                 "srnfd_http_connections",
                                 "Open connections: waiting for the head of their first request, "
                                 "or serving.",
                                 {"place"},
                                 NULL},
    [METRIC_HTTP_CUT] = {KIND_COUNTER,
                         "srnfd_http_connections_cut_total",
                         "Connections ended because the client was late, had gone, or made room.",
                         {"reason"},
                         NULL},
    [METRIC_HTTP_IN_PROGRESS] = {KIND_GAUGE,
                                 "srnfd_http_requests_in_progress",
                                 "Requests whose answer is not sent yet.",
                                 {NULL},
                                 NULL},
    [METRIC_HTTP_STREAMS] =
        {KIND_GAUGE, "srnfd_http_streams", "Open streams of server-sent events.", {NULL}, NULL},
    [METRIC_HTTP_BUFFERED] = {KIND_GAUGE,
                              "srnfd_http_buffered_bytes",
                              "Memory held for the bodies of requests.",
                              {NULL},
                              NULL},
    [METRIC_UPLOAD_MEMORY] = {KIND_GAUGE,
                              "srnfd_upload_memory_bytes",
                              "Memory that parsing the bodies of requests has in use.",
                              {NULL},
                              NULL},
    [METRIC_UPLOAD_MEMORY_LIMIT] = {KIND_GAUGE,
                                    "srnfd_upload_memory_limit_bytes",
                                    "Memory that it may have in use, for all bodies together.",
                                    {NULL},
                                    NULL},
    [METRIC_JOBS_SUBMITTED] = {KIND_COUNTER,
                               "srnfd_jobs_submitted_total",
                               "Executions by what became of them: a new job, joined to one in "
                               "progress, or answered from the cache.",
                               {"process", "how"},
                               NULL},
    [METRIC_JOBS_ENDED] = {KIND_COUNTER,
                           "srnfd_jobs_ended_total",
                           "Jobs that ended since the start, by process and final status.",
                           {"process", "status"},
                           NULL},
    [METRIC_JOB_SECONDS] = {KIND_HISTOGRAM,
                            "srnfd_job_duration_seconds",
                            "From the claim of a job by a worker to its end.",
                            {"process"},
                            job_bounds},
    [METRIC_JOB_WAIT_SECONDS] = {KIND_HISTOGRAM,
                                 "srnfd_job_wait_seconds",
                                 "From the acceptance of a job to its claim by a worker.",
                                 {"process"},
                                 job_bounds},
    [METRIC_JOB_MEMORY] = {KIND_HISTOGRAM,
                           "srnfd_job_memory_bytes",
                           "The most memory that a job had in use at once.",
                           {"process"},
                           memory_bounds},
    [METRIC_JOB_MEMORY_LIMIT] = {KIND_GAUGE,
                                 "srnfd_job_memory_limit_bytes",
                                 "Memory that a job may have in use.",
                                 {NULL},
                                 NULL},
    [METRIC_ENCODINGS] = {KIND_COUNTER,
                          "srnfd_encodings_total",
                          "Encodings of meshes that jobs needed: made, or kept from earlier jobs.",
                          {"source"},
                          NULL},
    [METRIC_MESHES] = {KIND_COUNTER,
                       "srnfd_meshes_total",
                       "Meshes that jobs read: made ready by the job, or kept so before it.",
                       {"source"},
                       NULL},
    [METRIC_JOBS] = {KIND_GAUGE,
                     "srnfd_jobs",
                     "Jobs that have not ended, by process and status.",
                     {"process", "status"},
                     NULL},
    [METRIC_QUEUE_LENGTH] =
        {KIND_GAUGE, "srnfd_queue_length", "Accepted jobs that wait for a worker.", {NULL}, NULL},
    [METRIC_QUEUE_AGE] = {KIND_GAUGE,
                          "srnfd_queue_age_seconds",
                          "How long the oldest accepted job has waited.",
                          {NULL},
                          NULL},
    [METRIC_WORKERS] = {KIND_GAUGE, "srnfd_workers", "Worker threads.", {NULL}, NULL},
    [METRIC_WORKERS_BUSY] =
        {KIND_GAUGE, "srnfd_workers_busy", "Worker threads with a job of their own.", {NULL}, NULL},
    [METRIC_EXPRESS] =
        {KIND_GAUGE, "srnfd_express_workers", "Threads for short jobs alone.", {NULL}, NULL},
    [METRIC_EXPRESS_BUSY] =
        {KIND_GAUGE, "srnfd_express_workers_busy", "Those of them with a job.", {NULL}, NULL},
    [METRIC_TASKS] = {KIND_COUNTER,
                      "srnfd_tasks_total",
                      "Tasks that workers leased, and what became of them.",
                      {"kind", "event"},
                      NULL},
    [METRIC_TASK_SECONDS] = {KIND_COUNTER,
                             "srnfd_task_seconds_total",
                             "Time from lease to result of tasks that are done.",
                             {"kind"},
                             NULL},
    [METRIC_TASK_BYTES] = {KIND_COUNTER,
                           "srnfd_task_bytes_total",
                           "Bytes of contents that workers read and of results that they wrote.",
                           {"part"},
                           NULL},
    [METRIC_TASKS_LEASED] =
        {KIND_GAUGE, "srnfd_tasks_leased", "Tasks that workers have leased.", {NULL}, NULL},
    [METRIC_REMOTE_WORKERS] = {KIND_GAUGE,
                               "srnfd_remote_workers",
                               "Worker processes that gave a sign of late.",
                               {NULL},
                               NULL},
    [METRIC_PILOTS] = {KIND_GAUGE,
                       "srnfd_pilots",
                       "Workers that Slurm was asked for, by whether it has started them.",
                       {"state"},
                       NULL},
    [METRIC_STORE_BYTES] = {KIND_GAUGE,
                            "srnfd_store_bytes",
                            "Size of what the data directory holds, by part.",
                            {"part"},
                            NULL},
    [METRIC_STORE_FREE] = {KIND_GAUGE,
                           "srnfd_store_free_bytes",
                           "Space left on the file system of the data directory.",
                           {NULL},
                           NULL},
    [METRIC_LOG_DROPPED] = {KIND_COUNTER,
                            "srnfd_log_lines_dropped_total",
                            "Lines of the log that were dropped because nobody reads them.",
                            {NULL},
                            NULL},
    [METRIC_PROCESS_CPU_SECONDS] = {KIND_COUNTER,
                                    "process_cpu_seconds_total",
                                    "Processor time spent, user and system.",
                                    {NULL},
                                    NULL},
    [METRIC_PROCESS_RESIDENT] =
        {KIND_GAUGE, "process_resident_memory_bytes", "Resident memory.", {NULL}, NULL},
    [METRIC_PROCESS_VIRTUAL] =
        {KIND_GAUGE, "process_virtual_memory_bytes", "Virtual memory.", {NULL}, NULL},
    [METRIC_PROCESS_OPEN_FDS] =
        {KIND_GAUGE, "process_open_fds", "Open file descriptors.", {NULL}, NULL},
    [METRIC_PROCESS_MAX_FDS] =
        {KIND_GAUGE, "process_max_fds", "Limit of open file descriptors.", {NULL}, NULL},
    [METRIC_PROCESS_THREADS] = {KIND_GAUGE, "process_threads", "Threads.", {NULL}, NULL},
    [METRIC_PROCESS_START_SECONDS] = {KIND_GAUGE,
                                      "process_start_time_seconds",
                                      "Start of the process, in seconds since the epoch.",
                                      {NULL},
                                      NULL},
};

struct series {
    struct series *next;                          /* of its chain */
    _Atomic double value;                         /* of a histogram: the sum */
    const atomic_size_t *_Atomic watched;         /* holds the value in its place; may be NULL */
    atomic_uint_least64_t bucket[BOUNDS_MAX + 1]; /* observations, not cumulated; last: the rest */
    size_t key_length;
    char key[]; /* the label values, each with its zero */
};

struct metrics {
    struct {
        pthread_mutex_t mutex;
        struct series *_Atomic chains[CHAINS];
        size_t n_series;
    } of[METRICS];
};

struct metrics *metrics_create(void)
{
    struct metrics *metrics = calloc(1, sizeof *metrics);

    for (size_t i = 0; metrics && i < METRICS; i++) {
        (void)pthread_mutex_init(&metrics->of[i].mutex, NULL);
    }
    return metrics;
}

void metrics_destroy(struct metrics *metrics)
{
    if (!metrics) {
        return;
    }
    for (size_t i = 0; i < METRICS; i++) {
        for (size_t chain = 0; chain < CHAINS; chain++) {
            while (metrics->of[i].chains[chain]) {
                struct series *series = metrics->of[i].chains[chain];

                metrics->of[i].chains[chain] = series->next;
                free(series);
            }
        }
        (void)pthread_mutex_destroy(&metrics->of[i].mutex);
    }
    free(metrics);
}

/* ---- Series ---------------------------------------------------------------------------------- */

/* The label values, each with its zero, into key; returns their length in all. Values that do not
   fit are cut. */
static size_t make_key(enum metric metric, const char *const *labels, char key[LABEL_BYTES_MAX])
{
    size_t length = 0;

    for (size_t i = 0; i < METRIC_LABELS_MAX && families[metric].labels[i]; i++) {
        const char *value = labels && labels[i] ? labels[i] : "other";
        size_t room = (LABEL_BYTES_MAX - length) / (METRIC_LABELS_MAX - i);
        size_t n = strnlen(value, room - 1);

        memcpy(key + length, value, n);
        key[length + n] = '\0';
        length += n + 1;
    }
    return length;
}

/* FNV-1a. */
static size_t chain_of(const char *key, size_t length)
{
    uint32_t hash = 2166136261u;

    for (size_t i = 0; i < length; i++) {
        hash = (hash ^ (unsigned char)key[i]) * 16777619u;
    }
    return (hash ^ (hash >> 16)) % CHAINS;
}

static struct series *look_up(struct metrics *metrics, enum metric metric, const char *key,
                              size_t length)
{
    struct series *series = atomic_load_explicit(&metrics->of[metric].chains[chain_of(key, length)],
                                                 memory_order_acquire);

    while (series && !(series->key_length == length && memcmp(series->key, key, length) == 0)) {
        series = series->next;
    }
    return series;
}

static struct series *add_series(struct metrics *metrics, enum metric metric, const char *key,
                                 size_t length)
{
    struct series *_Atomic *chain = &metrics->of[metric].chains[chain_of(key, length)];
    struct series *series = calloc(1, sizeof *series + length + 1);

    if (series) {
        memcpy(series->key, key, length);
        series->key_length = length;
        series->next = atomic_load_explicit(chain, memory_order_relaxed);
        atomic_store_explicit(chain, series, memory_order_release);
        metrics->of[metric].n_series++;
    }
    return series;
}

/* The series of these labels, made if it is new; NULL when memory is short. */
static struct series *find(struct metrics *metrics, enum metric metric, const char *const *labels)
{
    char key[LABEL_BYTES_MAX];
    size_t length = make_key(metric, labels, key);
    struct series *series = look_up(metrics, metric, key, length);

    if (series) {
        return series;
    }
    (void)pthread_mutex_lock(&metrics->of[metric].mutex);
    if (metrics->of[metric].n_series >= METRIC_SERIES_MAX) {
        length = make_key(metric, NULL, key);
    }
    series = look_up(metrics, metric, key, length);
    if (!series) {
        series = add_series(metrics, metric, key, length);
    }
    (void)pthread_mutex_unlock(&metrics->of[metric].mutex);
    return series;
}

static void add(_Atomic double *sum, double value)
{
    double before = atomic_load_explicit(sum, memory_order_relaxed);

    while (!atomic_compare_exchange_weak_explicit(sum, &before, before + value,
                                                  memory_order_relaxed, memory_order_relaxed)) {
    }
}

struct series *metrics_series(struct metrics *metrics, enum metric metric,
                              const char *const *labels)
{
    return metrics ? find(metrics, metric, labels) : NULL;
}

void series_add(struct series *series, double value)
{
    if (series) {
        add(&series->value, value);
    }
}

void metrics_add(struct metrics *metrics, enum metric metric, const char *const *labels,
                 double value)
{
    series_add(metrics_series(metrics, metric, labels), value);
}

void metrics_set(struct metrics *metrics, enum metric metric, const char *const *labels,
                 double value)
{
    struct series *series = metrics_series(metrics, metric, labels);

    if (series) {
        atomic_store_explicit(&series->value, value, memory_order_relaxed);
    }
}

/* The number of a series that is no histogram. */
static double value_of(const struct series *series)
{
    const atomic_size_t *watched = atomic_load(&series->watched);

    return watched ? (double)atomic_load(watched) : atomic_load(&series->value);
}

void metrics_watch(struct metrics *metrics, enum metric metric, const atomic_size_t *counter)
{
    struct series *series = metrics_series(metrics, metric, NULL);

    if (series) {
        atomic_store(&series->value, value_of(series));
        atomic_store(&series->watched, counter);
    }
}

void series_observe(struct series *series, enum metric metric, double value)
{
    const double *bounds = families[metric].bounds;
    size_t bucket = 0;

    if (!series || !bounds) {
        return;
    }
    while (bucket < BOUNDS_MAX && bounds[bucket] > 0 && value > bounds[bucket]) {
        bucket++;
    }
    if (bucket < BOUNDS_MAX && bounds[bucket] <= 0) {
        bucket = BOUNDS_MAX;
    }
    add(&series->value, value);
    atomic_fetch_add_explicit(&series->bucket[bucket], 1, memory_order_relaxed);
}

void metrics_observe(struct metrics *metrics, enum metric metric, const char *const *labels,
                     double value)
{
    series_observe(metrics_series(metrics, metric, labels), metric, value);
}

static uint64_t in_bucket(const struct series *series, size_t bucket)
{
    return atomic_load_explicit(&series->bucket[bucket], memory_order_relaxed);
}

double metrics_value(struct metrics *metrics, enum metric metric, const char *const *labels)
{
    char key[LABEL_BYTES_MAX];
    size_t length = make_key(metric, labels, key);
    const struct series *series = look_up(metrics, metric, key, length);
    double value = 0.0;

    if (series && families[metric].bounds) {
        for (size_t i = 0; i <= BOUNDS_MAX; i++) {
            value += (double)in_bucket(series, i);
        }
    } else if (series) {
        value = value_of(series);
    }
    return value;
}

/* ---- The text -------------------------------------------------------------------------------- */

/* A label's value: backslash, quote and newline are escaped. */
static void put_escaped(FILE *out, const char *value)
{
    for (; *value; value++) {
        if (*value == '\\' || *value == '"') {
            (void)fputc('\\', out);
        }
        if (*value == '\n') {
            (void)fputs("\\n", out);
        } else {
            (void)fputc(*value, out);
        }
    }
}

/* {route="/healthz",le="0.1"}, or nothing; bound NULL: without le. */
static void put_labels(FILE *out, const struct family *family, const struct series *series,
                       const char *bound)
{
    const char *value = series->key;
    const char *separator = "{";

    for (size_t i = 0; i < METRIC_LABELS_MAX && family->labels[i]; i++) {
        (void)fprintf(out, "%s%s=\"", separator, family->labels[i]);
        put_escaped(out, value);
        (void)fputc('"', out);
        value += strlen(value) + 1;
        separator = ",";
    }
    if (bound) {
        (void)fprintf(out, "%sle=\"%s\"", separator, bound);
        separator = ",";
    }
    if (separator[0] == ',') {
        (void)fputc('}', out);
    }
}

static void put_histogram(FILE *out, const struct family *family, const struct series *series)
{
    uint64_t cumulated = 0;
    char bound[32];

    for (size_t i = 0; i < BOUNDS_MAX && family->bounds[i] > 0; i++) {
        cumulated += in_bucket(series, i);
        (void)snprintf(bound, sizeof bound, "%.15g", family->bounds[i]);
        (void)fprintf(out, "%s_bucket", family->name);
        put_labels(out, family, series, bound);
        (void)fprintf(out, " %llu\n", (unsigned long long)cumulated);
    }
    cumulated += in_bucket(series, BOUNDS_MAX);
    (void)fprintf(out, "%s_bucket", family->name);
    put_labels(out, family, series, "+Inf");
    (void)fprintf(out, " %llu\n%s_sum", (unsigned long long)cumulated, family->name);
    put_labels(out, family, series, NULL);
    (void)fprintf(out, " %.15g\n%s_count", atomic_load(&series->value), family->name);
    put_labels(out, family, series, NULL);
    (void)fprintf(out, " %llu\n", (unsigned long long)cumulated);
}

static void put_family(FILE *out, struct metrics *metrics, enum metric metric)
{
    const struct family *family = &families[metric];

    (void)fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", family->name, family->help, family->name,
                  kind_names[family->kind]);
    for (size_t chain = 0; chain < CHAINS; chain++) {
        const struct series *series = metrics->of[metric].chains[chain];

        for (; series; series = series->next) {
            if (family->bounds) {
                put_histogram(out, family, series);
                continue;
            }
            (void)fputs(family->name, out);
            put_labels(out, family, series, NULL);
            (void)fprintf(out, " %.15g\n", value_of(series));
        }
    }
}

char *metrics_text(struct metrics *const *registries, size_t count, size_t *size)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, size);
    bool written = false;

    if (!out) {
        return NULL;
    }
    for (int metric = 0; metric < METRICS; metric++) {
        bool done = false;

        for (size_t i = 0; i < count && !done; i++) {
            (void)pthread_mutex_lock(&registries[i]->of[metric].mutex);
            if (registries[i]->of[metric].n_series > 0) {
                put_family(out, registries[i], (enum metric)metric);
                done = true;
            }
            (void)pthread_mutex_unlock(&registries[i]->of[metric].mutex);
        }
    }
    written = !ferror(out);
    if (fclose(out) != 0 || !written) {
        free(text);
        text = NULL;
    }
    return text;
}
