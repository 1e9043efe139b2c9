/*
 * service.c - the order in which the daemon's layers start and stop.
 *
 * Up: store, jobs (which recovers the queue), api, http, slurm. Down, on SIGTERM or SIGINT: workers
 * that Slurm was asked for are cancelled, http stops listening and lets requests end, jobs let
 * their runs end or put them back, both within the one grace, then the store closes.
 * A second signal does not hurry this; kill -9 is always safe, because everything acknowledged is
 * on the disk.
 *
 * The jobs layer calls back on changed rows before http and slurm exist and after they are gone;
 * the pointers to them are therefore kept under a lock. Lock: link.lock protects link.http and
 * link.slurm, rank before their own.
 */
#include "main/service.h"

#include "api/handler.h"
#include "api/routes.h"
#include "clock.h"
#include "descriptors.h"
#include "jobs/fault.h"
#include "log.h"
#include "priority.h"
#include "processes/processes.h"
#include "store/prepared.h"
#include "store/store.h"
#include "toolkit/table.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

static void job_changed(void *user, const char *job_id)
{
    struct service *service = user;

    (void)pthread_rwlock_rdlock(&service->link.lock);
    if (service->link.http) {
        api_job_changed(service->api, job_id, true);
        http_job_changed(service->link.http, job_id);
    }
    (void)pthread_rwlock_unlock(&service->link.lock);
}

static void job_progressed(void *user, const char *job_id)
{
    struct service *service = user;

    (void)pthread_rwlock_rdlock(&service->link.lock);
    if (service->link.http) {
        api_job_changed(service->api, job_id, false);
        http_job_progressed(service->link.http, job_id);
    }
    (void)pthread_rwlock_unlock(&service->link.lock);
}

static void tasks_offered(void *user)
{
    struct service *service = user;

    (void)pthread_rwlock_rdlock(&service->link.lock);
    if (service->link.http) {
        http_job_changed(service->link.http, API_WAIT_TASKS);
    }
    if (service->link.slurm) {
        slurm_wake(service->link.slurm);
    }
    (void)pthread_rwlock_unlock(&service->link.lock);
}

/* What tells of the store failing is worth somebody's attention. */
static const char *level_of(const char *event)
{
    static const char *const alarms[] = {"job-lost", "job-not-written", "job-checkpoint-failed",
                                         "claim-failed", "job-memory-kept"};

    for (size_t i = 0; i < sizeof alarms / sizeof alarms[0]; i++) {
        if (strcmp(event, alarms[i]) == 0) {
            return "error";
        }
    }
    return strcmp(event, "job-failed") == 0 ? "warn" : "info";
}

static void job_logged(void *user, const char *event, const char *job_id, const char *trace,
                       const char *detail)
{
    const struct log_field fields[] = {log_text("job", job_id), log_text("detail", detail),
                                       log_text("traceparent", trace)};

    (void)user;
    log_line(level_of(event), event, fields, trace[0] ? 3 : 2);
}

static void link_layers(struct service *service, struct http *http, struct slurm *slurm)
{
    (void)pthread_rwlock_wrlock(&service->link.lock);
    service->link.http = http;
    service->link.slurm = slurm;
    (void)pthread_rwlock_unlock(&service->link.lock);
}

static int start_jobs(struct service *service, const struct config *config)
{
    struct jobs_config jobs = {.store = service->store,
                               .workers = (size_t)config->workers,
                               .table = service->table,
                               .user = service,
                               .numeric_build = service->numeric_build,
                               .max_queued = (size_t)config->max_queued,
                               .faulty = service->faulty,
                               .job_seconds = config->job_seconds,
                               .job_memory = (size_t)config->job_memory,
                               .job_cache = (size_t)config->job_cache,
                               .kept_encodings = config->kept_encodings,
                               .retention_days = config->retention_days,
                               .sweep_seconds = config->sweep_seconds,
                               .log = job_logged,
                               .changed = job_changed,
                               .progressed = job_progressed,
                               .offers_tasks = executor_offers_tasks(config),
                               .offered = tasks_offered,
                               .lease_seconds = config->lease_seconds,
                               .task_seconds = config->task_seconds,
                               .verify_tasks = config->verify_tasks,
                               .metrics = service->metrics};
    size_t n = 0;

    for (; processes.rows[n] && n < SERVICE_PROCESSES_MAX - 1; n++) {
        service->table[n] = (struct jobs_process){
            .id = processes.rows[n]->id, .run = table_run, .definition = processes.rows[n]->table};
    }
    build_numeric_id(service->numeric_build);
    return jobs_open(&service->jobs, &jobs);
}

static void watch_faults(struct service *service, const struct config *config)
{
    if (!fault_open(config->data, service->faulty)) {
        LOG_WARN("faults-not-recorded", log_text("message", strerror(errno)));
    }
    fault_thread();
    fault_watch();
}

static struct api_config api_settings(const struct config *config)
{
    return (struct api_config){.processes = &processes,
                               .max_body = (size_t)config->max_body,
                               .sync_wait_seconds = config->sync_wait_seconds,
                               .least_free_bytes = config->least_free,
                               .upload_memory = (size_t)config->upload_memory,
                               .tokens = config->data,
                               .link_prefixes = config->link_prefixes,
                               .link_networks = config->link_networks,
                               .link_seconds = config->link_seconds,
                               .executor = config->executor,
                               .quotas = {[STORE_QUOTA_QUEUED] = (int64_t)config->quota_queued,
                                          [STORE_QUOTA_RUNNING] = (int64_t)config->quota_running,
                                          [STORE_QUOTA_BYTES] = (int64_t)config->quota_bytes,
                                          [STORE_QUOTA_REQUESTS] = (int64_t)config->quota_requests,
                                          [STORE_QUOTA_STREAMS] = (int64_t)config->quota_streams}};
}

static struct http_config http_settings(const struct config *config)
{
    return (struct http_config){.listen = config->listen,
                                .threads = (size_t)config->http_threads,
                                .request_threads = (size_t)config->request_threads,
                                .upload_threads = (size_t)config->upload_threads,
                                .max_connections = (size_t)config->max_connections,
                                .kept_connections = (size_t)config->kept_connections,
                                .max_owner_requests = (size_t)config->max_owner_requests,
                                .max_waiting = (size_t)config->max_waiting,
                                .max_streams = (size_t)config->max_streams,
                                .header_seconds = config->header_seconds,
                                .transfer_seconds = config->transfer_seconds,
                                .idle_seconds = config->idle_seconds,
                                .log_refusals_only = strcmp(config->access_log, "refusals") == 0,
                                .log_probes = strcmp(config->access_log, "all") == 0,
                                .max_buffered = (size_t)config->max_buffered,
                                .max_owner_buffered = (size_t)config->max_owner_buffered,
                                .max_peer_buffered = (size_t)config->max_peer_buffered,
                                .max_owner_files = (size_t)config->max_owner_exports,
                                .least_rate = config->least_rate,
                                .local_only = http_is_loopback(config->listen),
                                .open = config->insecure,
                                .allowed_hosts = config->allowed_hosts,
                                .cors_origins = config->cors_origins};
}

/* So that connections, each a descriptor, leave room for files. */
static void fit_connections(const struct service *service, const struct config *config,
                            struct http_config *http)
{
    struct descriptors fitted = {.limit = descriptors_raise(),
                                 .threads = jobs_worker_count(service->jobs) +
                                            JOBS_EXPRESS_THREADS + http->request_threads +
                                            http->upload_threads + 1,
                                 .connections = http->max_connections,
                                 .waiting = http->max_waiting};
    size_t needed = descriptors_needed(&fitted);
    char message[300];

    if (!descriptors_fit(&fitted)) {
        return;
    }
    http->max_connections = fitted.connections;
    http->max_waiting = fitted.waiting;
    (void)snprintf(message, sizeof message,
                   "the limit of open files leaves room for %zu connections with a request and %zu "
                   "without one, of %.0f and %.0f; for all of them it must be %zu: LimitNOFILE in "
                   "the unit, or ulimit -Hn",
                   fitted.connections, fitted.waiting, config->max_connections, config->max_waiting,
                   needed);
    LOG_WARN("connections-fitted", log_text("message", message),
             log_number("maxConnections", (double)fitted.connections),
             log_number("maxWaiting", (double)fitted.waiting),
             log_number("openFiles", (double)fitted.limit),
             log_number("neededOpenFiles", (double)needed));
}

int service_start(struct service *service, const struct config *config, char *message, size_t size)
{
    char reason[300] = "";
    struct api_config api = api_settings(config);
    struct http_config http = http_settings(config);

    priority_answer();
    service->metrics = metrics_create();
    if (!service->metrics) {
        (void)snprintf(message, size, "not enough memory");
        return -1;
    }
    api.metrics = http.metrics = service->metrics;
    if (config->tls_certificate[0]) {
        http.tls_certificate = config->tls_certificate;
        http.tls_key = config->tls_key;
    }
    if (store_open(&service->store, config->data, reason, sizeof reason) != 0) {
        (void)snprintf(message, size, "--data %.280s: %s", config->data, reason);
        return -1;
    }
    store_prepared_limit(service->store, (int64_t)config->kept_meshes, (int64_t)config->least_free);
    watch_faults(service, config);
    if (start_jobs(service, config) != 0) {
        (void)snprintf(message, size, "the workers could not be started");
        return -1;
    }
    api.store = service->store;
    api.jobs = service->jobs;
    if (api_create(&service->api, &api) != 0) {
        (void)snprintf(message, size, "not enough memory");
        return -1;
    }
    http.api = service->api;
    fit_connections(service, config, &http);
    if (http_start(&service->http, &http, message, size) != 0) {
        return -1;
    }
    service->executor.slurm = (struct slurm_config){
        .store = service->store, .jobs = service->jobs, .metrics = service->metrics};
    if (executor_start(&service->executor, config, http_address(service->http), &service->slurm,
                       message, size) != 0) {
        return -1;
    }
    link_layers(service, service->http, service->slurm);
    if (service->slurm) {
        slurm_wake(service->slurm);
    }
    return 0;
}

void service_stop(struct service *service, double grace_seconds)
{
    double end = clock_now() + grace_seconds;

    if (service->jobs) {
        jobs_drain(service->jobs);
    }
    link_layers(service, NULL, NULL);
    slurm_close(service->slurm); /* while its workers can still give back what they have */
    http_stop(service->http, grace_seconds);
    if (service->jobs) {
        jobs_close(service->jobs, end - clock_now());
    }
    api_destroy(service->api);
    if (service->store) {
        store_close(service->store);
    }
    fault_close();
    metrics_destroy(service->metrics);
    (void)pthread_rwlock_destroy(&service->link.lock);
}
