/*
 * main.c - the daemon's command line, and how its process serves until a signal (main/service.c).
 */
#include "processes/processes.h"
#include "api/json_memory.h"
#include "api/remote.h"
#include "api/routes.h"
#include "build.h"
#include "commands.h"
#include "config.h"
#include "jobs/memory.h"
#include "log.h"
#include "main/executor.h"
#include "main/kernels.h"
#include "main/service.h"
#include "main/token_command.h"
#include "notify.h"
#include "signals.h"
#include "store/store.h"
#include "store/token.h"
#include "toolkit/table.h"
#include "worker/worker.h"

#include <cblas.h>
#include <fftw3.h>
#include <signal.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* What must be set once, before any thread exists. */
static int prepare_process(sigset_t *signals)
{
    (void)sigemptyset(signals);
    (void)sigaddset(signals, SIGTERM);
    (void)sigaddset(signals, SIGINT);
    (void)sigaddset(signals, SIGHUP);
    signals_await(signals);
    (void)signal(SIGPIPE, SIG_IGN);
    jobs_memory_prepare();
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
    if (prepare_process(&signals) != 0 ||
        service_start(&service, &config, message, sizeof message) != 0) {
        LOG_ERROR("failed", log_text("message", message));
        service_stop(&service, 0);
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
    jobs_drain(service.jobs); /* no job starts after the word */
    LOG("draining", log_text("signal", received == SIGTERM ? "SIGTERM" : "SIGINT"));
    service_stop(&service, config.grace_seconds);
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
    kernels_choose(argv);
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
