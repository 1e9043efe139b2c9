/*
 * worker.c - the command: its options, its threads, and its end.
 *
 *   srnfd worker --server URL [--slots N] [--token-file F] [--certificate F] [--cache DIR]
 *                [--cache-bytes N] [--idle-seconds S] [--grace-seconds S]
 *
 * SIGTERM or SIGINT drains: nothing more is leased, tasks at work have the grace to end, and what
 * has not ended then is given back. A second signal gives back at once. kill -9 is safe: leases
 * expire.
 */
#include "worker/worker.h"

#include "worker/internal.h"

#include "clock.h"
#include "jobs/memory.h"
#include "log.h"
#include "signals.h"

#include <cblas.h>
#include <curl/curl.h>
#include <errno.h>
#include <fftw3.h>
#include <signal.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define CACHE_BYTES 1073741824.0
#define IDLE_SECONDS 60.0
#define GRACE_SECONDS 20.0
#define CREDENTIALS_MAX 16384

struct options {
    const char *server, *token_file, *certificate, *cache;
    double slots, cache_bytes, idle_seconds, grace_seconds;
};

/* What came on standard input: the token, and after its line a certificate. */
struct credentials {
    char text[CREDENTIALS_MAX];
    const char *token;    /* within it; NULL: there is none */
    char certificate[32]; /* path of a file in memory, or "" */
};

static const char usage[] =
    "usage: srnfd worker --server URL [--slots N] [--token-file FILE] [--certificate FILE]\n"
    "                    [--cache DIR] [--cache-bytes N] [--idle-seconds S] [--grace-seconds S]\n"
    "  --server         https://host:8443, or http on this machine\n"
    "  --slots          tasks at once; one per processor\n"
    "  --token-file     whose first line is a token of the role worker; -: standard input\n"
    "  --certificate    PEM file of the certificate that the service has; the system's "
    "authorities;\n"
    "                   -: what follows the token on standard input\n"
    "  --cache          folder for what tasks are about; none\n"
    "  --cache-bytes    that it may take, 1073741824\n"
    "  --idle-seconds   without a task, after which the worker ends; 0: never; 60\n"
    "  --grace-seconds  that SIGTERM gives tasks to end before they are given back, 20\n";

void worker_give_up(struct worker *worker, enum worker_end end, const char *why)
{
    int none = WORKER_DONE;

    if (atomic_compare_exchange_strong(&worker->end, &none, (int)end)) {
        LOG_ERROR(end == WORKER_ALONE ? "service-lost" : "refused", log_text("message", why));
    }
    atomic_store(&worker->draining, true);
    if (end == WORKER_ALONE) {
        atomic_store(&worker->hurried, true);
    }
}

/* ---- Options --------------------------------------------------------------------------------- */

static int wrong_use(const char *what, const char *value)
{
    (void)fprintf(stderr, "srnfd worker: %s%s%s\n%s", what, value ? ": " : "", value ? value : "",
                  usage);
    return WORKER_WRONG_USE;
}

static bool read_number(const char *text, double most, double *number)
{
    char *end;
    double value = strtod(text, &end);

    *number = value;
    return end != text && !*end && value >= 0.0 && value <= most;
}

static bool is_standard_input(const char *path)
{
    return path && strcmp(path, "-") == 0;
}

/* Whether the file begins with a line that has something. */
static bool has_line(const char *path)
{
    FILE *file = fopen(path, "re");
    int first = file ? fgetc(file) : EOF;

    if (file) {
        (void)fclose(file);
    }
    return first != EOF && first != '\n' && first != '\r';
}

static int read_options(struct options *options, int n_arguments, char **arguments)
{
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const struct {
        const char *name;
        const char **text;
        double *number, most;
    } known[] = {
        {"--server", &options->server, NULL, 0},
        {"--token-file", &options->token_file, NULL, 0},
        {"--certificate", &options->certificate, NULL, 0},
        {"--cache", &options->cache, NULL, 0},
        {"--slots", NULL, &options->slots, WORKER_SLOTS_MAX},
        {"--cache-bytes", NULL, &options->cache_bytes, 1e15},
        {"--idle-seconds", NULL, &options->idle_seconds, 1e9},
        {"--grace-seconds", NULL, &options->grace_seconds, 3600},
    };
    const size_t n_known = sizeof known / sizeof known[0];

    *options = (struct options){.slots = processors > 0 ? (double)processors : 1.0,
                                .cache_bytes = CACHE_BYTES,
                                .idle_seconds = IDLE_SECONDS,
                                .grace_seconds = GRACE_SECONDS};
    for (int i = 0; i < n_arguments; i += 2) {
        size_t k = 0;

        while (k < n_known && strcmp(known[k].name, arguments[i]) != 0) {
            k++;
        }
        if (k == n_known) {
            return wrong_use("no such option", arguments[i]);
        }
        if (i + 1 == n_arguments) {
            return wrong_use("an option without its value", arguments[i]);
        }
        if (known[k].text) {
            *known[k].text = arguments[i + 1];
        } else if (!read_number(arguments[i + 1], known[k].most, known[k].number)) {
            return wrong_use("not a number in its range", arguments[i + 1]);
        }
    }
    if (!options->server) {
        return wrong_use("--server is needed", NULL);
    }
    if (options->slots < 1.0) {
        return wrong_use("--slots must be 1 at least", NULL);
    }
    if (options->token_file && !is_standard_input(options->token_file) &&
        access(options->token_file, R_OK) != 0) {
        return wrong_use("the file of the token cannot be read", options->token_file);
    }
    if (options->token_file && !is_standard_input(options->token_file) &&
        !has_line(options->token_file)) {
        return wrong_use("the file of the token is empty, or begins with an empty line",
                         options->token_file);
    }
    if (is_standard_input(options->certificate) && !is_standard_input(options->token_file)) {
        return wrong_use("--certificate - goes with --token-file -", NULL);
    }
    return 0;
}

/* Into a file without a name, since not every TLS library takes certificates from memory. It is
   open until the end. */
static bool keep_certificate(struct credentials *credentials, const char *text)
{
    size_t size = strlen(text);
    int fd = strncmp(text, "-----BEGIN", 10) == 0 ? memfd_create("certificate", MFD_CLOEXEC) : -1;

    (void)snprintf(credentials->certificate, sizeof credentials->certificate, "/proc/self/fd/%d",
                   fd);
    return fd >= 0 && write(fd, text, size) == (ssize_t)size;
}

/* Reads what standard input has, where the options say that it has something. */
static int read_credentials(const struct options *options, struct credentials *credentials)
{
    char *text = credentials->text, *certificate;
    size_t size;

    *credentials = (struct credentials){.token = NULL};
    if (!is_standard_input(options->token_file)) {
        return 0;
    }
    size = fread(text, 1, sizeof credentials->text - 1, stdin);
    text[size] = '\0';
    if (size == 0 || !feof(stdin)) {
        return wrong_use("standard input must have a token, and 16 KiB at most", NULL);
    }
    credentials->token = text;
    text += strcspn(text, "\r\n");
    certificate = text + strspn(text, "\r\n");
    *text = '\0';
    if (!credentials->token[0] || strlen(credentials->token) >= LINK_TOKEN_MAX - 8) {
        return wrong_use("the first line of standard input is no token", NULL);
    }
    if (is_standard_input(options->certificate) && !keep_certificate(credentials, certificate)) {
        return wrong_use("no certificate follows the token on standard input", NULL);
    }
    return 0;
}

/* ---- Who this is ----------------------------------------------------------------------------- */

static void read_cpu(char cpu[WORKER_NAME_MAX])
{
    FILE *file = fopen("/proc/cpuinfo", "re");
    char line[256];

    (void)snprintf(cpu, WORKER_NAME_MAX, "unknown");
    while (file && fgets(line, sizeof line, file)) {
        const char *colon = strchr(line, ':');

        if (colon && colon[1] && strncmp(line, "model name", 10) == 0) {
            line[strcspn(line, "\n")] = '\0';
            (void)snprintf(cpu, WORKER_NAME_MAX, "%.*s", WORKER_NAME_MAX - 1, colon + 2);
            break;
        }
    }
    if (file) {
        (void)fclose(file);
    }
}

/* As the service takes names: what it would refuse becomes a question mark. */
static void make_plain(char *text)
{
    for (; *text; text++) {
        if (*text < ' ' || *text > '~' || strchr("<>&\"'", *text)) {
            *text = '?';
        }
    }
}

static void introduce(struct worker *worker)
{
    unsigned char bytes[4];
    char hex[2 * sizeof bytes + 1];

    if (gethostname(worker->host, sizeof worker->host - 1) != 0 || !worker->host[0]) {
        (void)snprintf(worker->host, sizeof worker->host, "unknown");
    }
    worker->host[sizeof worker->host - 1] = '\0';
    make_plain(worker->host);
    randombytes_buf(bytes, sizeof bytes);
    (void)sodium_bin2hex(hex, sizeof hex, bytes, sizeof bytes);
    (void)snprintf(worker->name, sizeof worker->name, "%.40s-%ld-%s", worker->host, (long)getpid(),
                   hex);
    read_cpu(worker->cpu);
    make_plain(worker->cpu);
    build_arithmetic_id(worker->build);
    worker->target.host = worker->host;
    worker->target.cpu = worker->cpu;
    worker->target.build = worker->build;
}

/* ---- Life ------------------------------------------------------------------------------------ */

static int create(struct worker *worker, const struct options *options)
{
    worker->n_slots = (size_t)options->slots;
    worker->idle_seconds = options->idle_seconds;
    worker->cache = cache_open(options->cache, (size_t)options->cache_bytes);
    worker->slots = calloc(worker->n_slots, sizeof *worker->slots);
    atomic_store(&worker->worked, clock_now());
    if (!worker->cache || !worker->slots) {
        return -1;
    }
    for (size_t i = 0; i < worker->n_slots; i++) {
        struct worker_slot *slot = &worker->slots[i];

        slot->worker = worker;
        (void)pthread_mutex_init(&slot->mutex, NULL);
        slot->link = link_create(&worker->target, &worker->draining);
        if (!slot->link) {
            return -1;
        }
    }
    return 0;
}

static void destroy(struct worker *worker)
{
    for (size_t i = 0; worker->slots && i < worker->n_slots; i++) {
        link_destroy(worker->slots[i].link);
        (void)pthread_mutex_destroy(&worker->slots[i].mutex);
    }
    free(worker->slots);
    cache_close(worker->cache);
}

/* Waits until all slots have ended; signals drain, and then hurry. */
static void wait_for_slots(struct worker *worker, const sigset_t *signals, double grace_seconds)
{
    double until = 0.0;

    while (atomic_load(&worker->running) > 0) {
        struct timespec pause = {.tv_nsec = 100 * 1000000L};
        int received = sigtimedwait(signals, NULL, &pause);

        if (received > 0) {
            LOG("draining", log_text("signal", received == SIGTERM ? "SIGTERM" : "SIGINT"));
            atomic_store(&worker->hurried, atomic_load(&worker->draining));
            atomic_store(&worker->draining, true);
        }
        if (atomic_load(&worker->draining) && until <= 0.0) {
            until = clock_now() + grace_seconds;
        }
        if (until > 0.0 && clock_now() >= until) {
            atomic_store(&worker->hurried, true);
        }
    }
}

static int run(struct worker *worker, const sigset_t *signals, double grace_seconds)
{
    pthread_t heart;
    bool beats = pthread_create(&heart, NULL, worker_heart_main, worker) == 0;

    for (size_t i = 0; beats && i < worker->n_slots; i++) {
        (void)atomic_fetch_add(&worker->running, 1);
        if (pthread_create(&worker->slots[i].thread, NULL, worker_slot_main, &worker->slots[i])) {
            (void)atomic_fetch_sub(&worker->running, 1);
            break;
        }
        worker->n_started++;
    }
    if (worker->n_started < worker->n_slots) {
        worker_give_up(worker, WORKER_REFUSED, "the threads could not be started");
    }
    wait_for_slots(worker, signals, grace_seconds);
    atomic_store(&worker->over, true);
    for (size_t i = 0; i < worker->n_started; i++) {
        (void)pthread_join(worker->slots[i].thread, NULL);
    }
    if (beats) {
        (void)pthread_join(heart, NULL);
    }
    return atomic_load(&worker->end);
}

/* What must be set once, before any thread exists. */
static int prepare_process(sigset_t *signals)
{
    (void)sigemptyset(signals);
    (void)sigaddset(signals, SIGTERM);
    (void)sigaddset(signals, SIGINT);
    signals_await(signals);
    (void)signal(SIGPIPE, SIG_IGN);
    (void)signal(SIGXFSZ,
                 SIG_IGN); /* a file that may not grow costs requests, as a full disk does */
    jobs_memory_prepare();
    fftw_make_planner_thread_safe();
    openblas_set_num_threads(1);
    return sodium_init() < 0 || curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK ? -1 : 0;
}

int worker_command(int n_arguments, char **arguments)
{
    struct options options;
    struct credentials credentials;
    struct worker worker = {.n_slots = 0};
    char url[400];
    const char *problem;
    sigset_t signals;
    int status = read_options(&options, n_arguments, arguments);

    status = status ? status : read_credentials(&options, &credentials);
    if (status) {
        return status;
    }
    (void)snprintf(url, sizeof url, "%s", options.server);
    while (url[0] && url[strlen(url) - 1] == '/') {
        url[strlen(url) - 1] = '\0';
    }
    worker.target = (struct link_target){.url = url};
    if (credentials.token) {
        worker.target.token = credentials.token;
    } else {
        worker.target.token_file = options.token_file;
    }
    worker.target.certificate =
        is_standard_input(options.certificate) ? credentials.certificate : options.certificate;
    problem = link_problem(&worker.target);
    if (problem) {
        return wrong_use(problem, options.server);
    }
    if (prepare_process(&signals) != 0 || create(&worker, &options) != 0) {
        LOG_ERROR("failed", log_text("message", "not enough memory"));
        status = 1;
    } else {
        introduce(&worker);
        LOG("starting", log_text("server", url), log_text("worker", worker.name));
        status = run(&worker, &signals, options.grace_seconds);
        LOG("stopped", log_number("status", (double)status));
    }
    destroy(&worker);
    curl_global_cleanup();
    return status;
}
