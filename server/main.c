/*
 * main.c - the daemon's command line, and the order in which its layers start and stop.
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
#include "api/handler.h"
#include "processes/processes.h"
#include "api/json_memory.h"
#include "api/remote.h"
#include "api/routes.h"
#include "build.h"
#include "clock.h"
#include "commands.h"
#include "config.h"
#include "http/http.h"
#include "jobs/fault.h"
#include "log.h"
#include "main/executor.h"
#include "main/token_command.h"
#include "notify.h"
#include "priority.h"
#include "signals.h"
#include "store/prepared.h"
#include "store/store.h"
#include "store/token.h"
#include "toolkit/table.h"
#include "worker/worker.h"

#include <cblas.h>
#include <errno.h>
#include <fftw3.h>
#include <pthread.h>
#include <signal.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define PROCESSES_MAX 64

struct link {
    pthread_rwlock_t lock;
    struct http *http;
    struct slurm *slurm;
};

/* All that lives while the daemon serves, in the order of its making. */
struct service {
    struct store *store;
    struct jobs *jobs;
    struct api *api;
    struct http *http;
    struct metrics *metrics;
    struct executor executor;
    struct slurm *slurm;
    struct link link;
    struct jobs_process table[PROCESSES_MAX];
    char numeric_build[BUILD_ID_SIZE];
    char faulty[STORE_ID_MAX]; /* the job that the last run died of */
};

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

/* ---- serve ----------------------------------------------------------------------------------- */

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

    for (; processes.rows[n] && n < PROCESSES_MAX - 1; n++) {
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
                                .least_rate = config->least_rate,
                                .local_only = http_is_loopback(config->listen),
                                .open = config->insecure,
                                .allowed_hosts = config->allowed_hosts,
                                .cors_origins = config->cors_origins};
}

static int start(struct service *service, const struct config *config, char *message, size_t size)
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
    store_prepared_limit(service->store, (int64_t)config->kept_meshes);
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

static void stop(struct service *service, double grace_seconds)
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

/* Connections are descriptors: as many as the system lets the process have. */
static void raise_descriptor_limit(void)
{
    struct rlimit limit;

    if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < limit.rlim_max) {
        limit.rlim_cur = limit.rlim_max;
        (void)setrlimit(RLIMIT_NOFILE, &limit);
    }
}

/* What must be set once, before any thread exists. */
static int prepare_process(sigset_t *signals)
{
    (void)sigemptyset(signals);
    (void)sigaddset(signals, SIGTERM);
    (void)sigaddset(signals, SIGINT);
    (void)sigaddset(signals, SIGHUP);
    signals_await(signals);
    (void)signal(SIGPIPE, SIG_IGN);
    raise_descriptor_limit();
    fftw_make_planner_thread_safe();
    openblas_set_num_threads(1);
    json_memory_watch();
    json_object_seed(0);
    return sodium_init() < 0 ? -1 : 0;
}

/* Waits for the signal to stop; meanwhile, where the service manager wants signs of life, gives one
   whenever the store has answered, be it with an error. A daemon that hangs gives none. SIGHUP is
   no reason to stop, nor is there anything to do: tokens and certificates are read anew when their
   files are replaced. */
static int wait_for_signal(const struct service *service, const sigset_t *signals)
{
    double seconds = notify_watchdog_seconds() / 3.0;
    struct timespec pause = {.tv_sec = (time_t)seconds,
                             .tv_nsec = (long)(1e9 * (seconds - (double)(time_t)seconds))};
    int received = -1;

    while (received < 0) {
        if (seconds > 0.0) {
            (void)store_ping(service->store);
            notify_manager("WATCHDOG=1");
            received = sigtimedwait(signals, NULL, &pause);
        } else {
            received = sigwaitinfo(signals, NULL);
        }
        if (received == SIGHUP) {
            LOG("hangup", log_text("message", "the service goes on; files of tokens and "
                                              "certificates are read when they are replaced"));
            received = -1;
        }
    }
    return received;
}

static bool check_links(const struct config *config, char *message, size_t size)
{
    struct remote_rules *rules =
        remote_rules_read(config->link_prefixes, config->link_networks, message, size);

    remote_rules_free(rules);
    return rules != NULL;
}

/* Whether the settings are safe together; otherwise a sentence in message. Beyond loopback there
   must be a token, since whoever reaches the address may call; so where hosts are allowed, which is
   how a proxy brings callers from elsewhere. */
static bool check_settings(const struct config *config, char *message, size_t size)
{
    struct store_tokens tokens;
    int status = STORE_OK;

    if (!http_is_address(config->listen)) {
        (void)snprintf(message, size, "listen: " HTTP_NO_ADDRESS, config->listen);
        return false;
    }
    if ((config->tls_certificate[0] == '\0') != (config->tls_key[0] == '\0')) {
        (void)snprintf(message, size, "--tls-certificate and --tls-key need each other");
        return false;
    }
    if (!check_links(config, message, size) || !executor_check(config, message, size)) {
        return false;
    }
    if (config->insecure || (http_is_loopback(config->listen) && !config->allowed_hosts[0])) {
        return true;
    }
    status = store_tokens_load(config->data, &tokens);
    if (status == STORE_OK && tokens.n > 0) {
        store_tokens_clear(&tokens);
        return true;
    }
    store_tokens_clear(&tokens);
    if (status == STORE_OK) {
        (void)snprintf(
            message, size,
            "without tokens the service answers callers of this machine only: no address "
            "beyond loopback, no allowedHosts; srnfd token add makes a token, and "
            "--insecure overrides this");
    } else {
        (void)snprintf(message, size, "the file of tokens in --data %.200s cannot be used: %s",
                       config->data, store_strerror(status));
    }
    return false;
}

static int serve(int n_arguments, char **arguments)
{
    struct service service = {.link.lock = PTHREAD_RWLOCK_INITIALIZER};
    struct config config;
    char message[600];
    sigset_t signals;
    int received;

    if (config_load(&config, n_arguments, arguments, message, sizeof message) != 0) {
        LOG_ERROR("refused", log_text("message", message));
        return 2;
    }
    if (!check_settings(&config, message, sizeof message)) {
        LOG_ERROR("refused", log_text("message", message), log_text("listen", config.listen));
        return 2;
    }
    if (prepare_process(&signals) != 0 || start(&service, &config, message, sizeof message) != 0) {
        LOG_ERROR("failed", log_text("message", message));
        stop(&service, 0);
        return 1;
    }
    LOG("listening", log_text("address", http_address(service.http)),
        log_text("scheme", config.tls_certificate[0] ? "https" : "http"),
        log_text("data", config.data),
        log_number("workers", (double)jobs_worker_count(service.jobs)),
        log_number("jobMemory", (double)jobs_memory_limit(service.jobs)),
        log_text("version", SRNF_VERSION), log_text("numericBuild", service.numeric_build));
    log_start();
    notify_manager("READY=1");
    received = wait_for_signal(&service, &signals);
    log_stop();
    notify_manager("STOPPING=1");
    LOG("draining", log_text("signal", received == SIGTERM ? "SIGTERM" : "SIGINT"));
    stop(&service, config.grace_seconds);
    LOG("stopped", log_number("status", 0));
    return 0;
}

/* ---- The other commands ---------------------------------------------------------------------- */

static int print_version(int n_arguments, char **arguments)
{
    struct build_part parts[BUILD_PARTS];

    (void)n_arguments;
    (void)arguments;
    build_parts(parts);
    for (size_t i = 0; i < BUILD_PARTS; i++) {
        (void)printf("%-14s %s\n", parts[i].name, parts[i].version);
    }
    return 0;
}

/* One route per line with its query parameters: what tests/api/test_openapi.sh compares. */
static int print_routes(int n_arguments, char **arguments)
{
    (void)n_arguments;
    (void)arguments;
    for (const struct api_route *route = api_routes; route->method; route++) {
        (void)printf("%s %s %s\n", route->method, route->pattern,
                     route->query[0] ? route->query : "-");
    }
    return 0;
}

/* A line of JSON a process: what api/generate.sh puts into the description of the API. */
static int print_processes(int n_arguments, char **arguments)
{
    (void)n_arguments;
    (void)arguments;
    for (size_t i = 0; processes.rows[i]; i++) {
        char *line = process_description(processes.rows[i]);

        if (!line || puts(line) == EOF) {
            return 1;
        }
        free(line);
    }
    return 0;
}

static int print_help(int n_arguments, char **arguments);

static const struct command {
    const char *name;
    int (*run)(int n_arguments, char **arguments);
    const char *text; /* NULL: not in the help */
} commands[] = {
    {"serve", serve, "serve the API until SIGTERM"},
    {"backup", command_backup, "copy the data to a directory, also while the daemon runs"},
    {"check", command_check, "verify the data; --repair removes files that nothing needs"},
    {"token", token_command, "add, list or revoke the tokens of a data directory"},
    {"worker", worker_command, "compute tasks for a service on this or another machine"},
    {"version", print_version, "print the versions of this build and its libraries"},
    {"help", print_help, "print this"},
    {"routes", print_routes, NULL},
    {"processes", print_processes, NULL},
};

static int print_help(int n_arguments, char **arguments)
{
    const struct config_help *table;
    size_t n = config_table(&table);

    (void)n_arguments;
    (void)arguments;
    (void)printf("usage: srnfd COMMAND [OPTIONS]\n\n");
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (commands[i].text) {
            (void)printf("  %-8s %s\n", commands[i].name, commands[i].text);
        }
    }
    (void)printf("\nOptions of serve, their environment variables, and their members in the JSON\n"
                 "file that --config or SRNFD_CONFIG names:\n\n");
    for (size_t i = 0; i < n; i++) {
        (void)printf("  %-20s %-24s %-16s\n      %s\n", table[i].option, table[i].environment,
                     table[i].member, table[i].text);
    }
    return 0;
}

int main(int argc, char **argv)
{
    (void)umask(077); /* nothing of the data is for others, whatever the folder allows */
    (void)signal(SIGXFSZ, SIG_IGN); /* a limit on file sizes is a full disk to whoever writes */
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            return print_help(0, NULL);
        }
    }
    for (size_t i = 0; argc > 1 && i < sizeof commands / sizeof commands[0]; i++) {
        if (strcmp(argv[1], commands[i].name) == 0) {
            return commands[i].run(argc - 2, argv + 2);
        }
    }
    (void)fprintf(
        stderr,
        "usage: srnfd serve|backup|check|token|worker|version|help; srnfd --help tells more\n");
    return 2;
}
