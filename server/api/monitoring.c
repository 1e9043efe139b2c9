/*
 * monitoring.c - GET /readyz and GET /metrics: what a load balancer and a monitor ask.
 *
 * Ready means that an upload and an execution would be taken now: a write reaches the disk, the
 * database can be read, the queue has room, every worker lives, the file of tokens can be read, and
 * the file system keeps its floor of free space. Each is one row of the table below; where one
 * fails the answer is 503 not-ready, and says which and why. The write is a real one, with its
 * fsync, so its outcome is kept for PROBE_MS: asking often costs the disk nothing. Nor does a
 * monitor wait for its turn among the writes of others: a write that is not through after WAIT_MS
 * goes on by itself, and the store counts as writable if the last one is no longer ago than
 * LATE_MS.
 *
 * /metrics writes what the layers count (metrics.h), and beside it what is only measured when asked
 * for, in a registry made for this answer.
 *
 * Lock: api->probe.mutex protects the outcome of the last probe; nothing is called while it is
 * held.
 */
#include "api/respond.h"
#include "api/routes.h"

#include "api/auth.h"
#include "build.h"
#include "jobs/tasks.h"
#include "log.h"
#include "store/job.h"
#include "store/store.h"
#include "store/usage.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#define PROBE_MS 500
#define WAIT_MS 40
#define LATE_MS 10000
#define WHY_MAX 160

static int64_t monotonic_ms(void)
{
    struct timespec now;

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* ---- /readyz --------------------------------------------------------------------------------- */

static int probe_write(struct api *api)
{
    int64_t now = monotonic_ms(), age;
    bool answered = false;
    int status;

    (void)pthread_mutex_lock(&api->probe.mutex);
    status = api->probe.status;
    age = api->probe.at_ms > 0 ? now - api->probe.at_ms : INT64_MAX;
    (void)pthread_mutex_unlock(&api->probe.mutex);
    if (age < PROBE_MS) {
        return status;
    }
    if (status == STORE_OK && age < LATE_MS) {
        int late = store_probe(api->config.store, WAIT_MS, &answered);

        if (!answered) {
            return STORE_OK;
        }
        status = late;
    } else {
        status = store_probe(api->config.store, LATE_MS, &answered);
        if (!answered) {
            return STORE_BUSY;
        }
    }
    (void)pthread_mutex_lock(&api->probe.mutex);
    api->probe.status = status;
    api->probe.at_ms = monotonic_ms();
    (void)pthread_mutex_unlock(&api->probe.mutex);
    return status;
}

/* Each says whether all is well, or why not. */

static bool check_read(struct api *api, char why[WHY_MAX])
{
    int status = store_ping(api->config.store);

    (void)snprintf(why, WHY_MAX, "the database does not answer: %s", store_strerror(status));
    return status == STORE_OK;
}

static bool check_write(struct api *api, char why[WHY_MAX])
{
    int status = probe_write(api);

    (void)snprintf(why, WHY_MAX, "a write does not get through: %s",
                   status == STORE_BUSY ? "others have been before it for ten seconds"
                                        : store_strerror(status));
    return status == STORE_OK;
}

static bool check_tokens(struct api *api, char why[WHY_MAX])
{
    (void)snprintf(why, WHY_MAX, "the file of tokens cannot be read; nobody is let in");
    return auth_readable(api);
}

static bool check_space(struct api *api, char why[WHY_MAX])
{
    int64_t bytes = 0;
    int status = store_free_bytes(api->config.store, &bytes);

    if (status != STORE_OK) {
        (void)snprintf(why, WHY_MAX, "the free space is not known: %s", store_strerror(status));
        return false;
    }
    (void)snprintf(why, WHY_MAX, "%lld bytes are free, less than the floor of %.0f",
                   (long long)bytes, api->config.least_free_bytes);
    return (double)bytes >= api->config.least_free_bytes;
}

static bool check_queue(struct api *api, char why[WHY_MAX])
{
    struct jobs_health health;

    jobs_health(api->config.jobs, &health);
    (void)snprintf(why, WHY_MAX, "%s: %zu of %zu places are taken",
                   health.closing ? "the queue is closed" : "the queue is full", health.queued,
                   health.queue_limit);
    return !health.closing && health.queued < health.queue_limit;
}

static bool check_workers(struct api *api, char why[WHY_MAX])
{
    struct jobs_health health;

    jobs_health(api->config.jobs, &health);
    (void)snprintf(why, WHY_MAX, "%zu of %zu workers run, %zu of %zu threads for short jobs",
                   health.alive, health.workers, health.express_alive, health.express);
    return health.alive == health.workers && health.express_alive == health.express;
}

static const struct {
    const char *name;
    bool (*check)(struct api *api, char why[WHY_MAX]);
} checks[] = {
    {"databaseReadable", check_read}, {"storeWritable", check_write},
    {"spaceLeft", check_space},       {"queueAccepting", check_queue},
    {"workersAlive", check_workers},  {"tokensReadable", check_tokens},
};

void system_readyz(struct api_call *call)
{
    struct problem_list problems = {.errors = NULL};
    json_t *passed = json_object();
    char pointer[64], why[WHY_MAX];

    for (size_t i = 0; i < sizeof checks / sizeof checks[0]; i++) {
        bool well = checks[i].check(call->api, why);

        (void)json_object_set_new(passed, checks[i].name, json_boolean(well));
        if (!well) {
            (void)snprintf(pointer, sizeof pointer, "/checks/%s", checks[i].name);
            problem_add(&problems, pointer, "%s", why);
        }
    }
    if (problems.errors) {
        json_decref(passed);
        (void)problem_respond_list(call, "not-ready", &problems);
        return;
    }
    respond_json(call, 200, json_pack("{s:s,s:o}", "status", "ready", "checks", passed));
}

/* ---- /metrics -------------------------------------------------------------------------------- */

struct load {
    struct metrics *now;
    int64_t oldest_ms; /* of the accepted jobs; 0: none */
};

static void take_load(void *user, const struct store_load *part)
{
    struct load *load = user;
    bool accepted = strcmp(part->status, store_job_status_name(STORE_JOB_ACCEPTED)) == 0;

    metrics_set(load->now, METRIC_JOBS, METRIC_LABELS(part->process, part->status),
                (double)part->count);
    if (accepted && (load->oldest_ms == 0 || part->oldest_ms < load->oldest_ms)) {
        load->oldest_ms = part->oldest_ms;
    }
}

static void measure_jobs(struct api *api, struct metrics *now)
{
    struct load load = {.now = now};
    struct jobs_health health;
    size_t workers, leased;
    double age = 0.0;

    jobs_health(api->config.jobs, &health);
    metrics_set(now, METRIC_QUEUE_LENGTH, NULL, (double)health.queued);
    metrics_set(now, METRIC_WORKERS, NULL, (double)health.alive);
    metrics_set(now, METRIC_WORKERS_BUSY, NULL, (double)health.busy);
    metrics_set(now, METRIC_EXPRESS, NULL, (double)health.express_alive);
    metrics_set(now, METRIC_EXPRESS_BUSY, NULL, (double)health.express_busy);
    metrics_set(now, METRIC_JOB_MEMORY_LIMIT, NULL, (double)jobs_memory_limit(api->config.jobs));
    jobs_remotes_count(api->config.jobs, &workers, &leased);
    metrics_set(now, METRIC_REMOTE_WORKERS, NULL, (double)workers);
    metrics_set(now, METRIC_TASKS_LEASED, NULL, (double)leased);
    if (store_job_load(api->config.store, take_load, &load) != STORE_OK) {
        return;
    }
    if (load.oldest_ms > 0) {
        age = 1e-3 * (double)(store_now_ms() - load.oldest_ms);
    }
    metrics_set(now, METRIC_QUEUE_AGE, NULL, age > 0 ? age : 0.0);
}

static void measure_store(struct api *api, struct metrics *now)
{
    struct store_usage usage;

    if (store_usage(api->config.store, &usage) != STORE_OK) {
        return;
    }
    metrics_set(now, METRIC_STORE_BYTES, METRIC_LABELS("database"), (double)usage.database);
    metrics_set(now, METRIC_STORE_BYTES, METRIC_LABELS("wal"), (double)usage.log);
    metrics_set(now, METRIC_STORE_BYTES, METRIC_LABELS("blobs"), (double)usage.blobs);
    metrics_set(now, METRIC_STORE_BYTES, METRIC_LABELS("prepared"), (double)usage.prepared);
    metrics_set(now, METRIC_STORE_FREE, NULL, (double)usage.free);
}

void system_metrics(struct api_call *call)
{
    struct metrics *now = metrics_create();
    struct metrics *registries[2] = {now, call->api->config.metrics};
    char id[BUILD_ID_SIZE], *text = NULL;
    size_t size = 0;

    if (now) {
        build_numeric_id(id);
        metrics_set(now, METRIC_BUILD_INFO, METRIC_LABELS(SRNF_VERSION, id), 1);
        metrics_set_process(now);
        metrics_set(now, METRIC_LOG_DROPPED, NULL, (double)log_dropped());
        metrics_set(now, METRIC_UPLOAD_MEMORY, NULL, (double)atomic_load(&call->api->uploads.used));
        metrics_set(now, METRIC_UPLOAD_MEMORY_LIMIT, NULL, (double)call->api->config.upload_memory);
        measure_jobs(call->api, now);
        measure_store(call->api, now);
        text = metrics_text(registries, registries[1] ? 2 : 1, &size);
    }
    metrics_destroy(now);
    if (!text) {
        (void)problem_respond(call, "out-of-memory", "There is not enough memory for this.");
        return;
    }
    respond_bytes(call, 200, "text/plain; version=0.0.4; charset=utf-8", (unsigned char *)text,
                  size);
    (void)api_response_header_text(call->response, "Cache-Control", "no-store");
}
