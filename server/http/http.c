/*
 * http.c - starting and stopping: the daemon of libmicrohttpd, the request threads and the timer.
 *
 * Connections come from the front (front.c), which hands over those whose first request has a well
 * formed head.
 *
 * Stopping goes in this order: the front, and so no new connections; what waits for jobs is
 * answered with the job as it is; requests in progress get their grace, those that are queued and
 * uploads the most of it; the pool ends, after which no connection is suspended (libmicrohttpd
 * aborts the process otherwise); then the daemon, and with it the connections that are left.
 */
#include "http/internal.h"

#include "clock.h"
#include "log.h"

#include <limits.h>
#include <sodium.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define CONNECTION_MEMORY \
    ((size_t)32 << 10) /* for a head within head.h's limits and ours; cleared for each request */
#define OWNER_REQUESTS_LEAST 16 /* of the default, where connections are few */
#define THREADS_MAX 4           /* that are started without being asked for */
/* Part of the grace after which what is queued is not handled any more, and uploads are told to
   stop, which they do in a second or two. */
#define HANDLING_GRACE 0.75

/* Requests that these threads answer take microseconds: one thread for two processors keeps up with
   clients on the others. On two processors a second one cost more in changing places than it won:
   52,000 requests of /healthz a second instead of 72,000 (wrk -t1 -c16). */
static size_t default_threads(void)
{
    long processors = sysconf(_SC_NPROCESSORS_ONLN);

    return processors < 4 ? 1 : processors > 2 * THREADS_MAX ? THREADS_MAX : (size_t)processors / 2;
}

/* What no one caller may have all of. */
static void set_shares(struct http_config *config)
{
    size_t requests = config->max_connections / 4;

    if (config->kept_connections == 0) {
        config->kept_connections = config->max_connections / 8;
    }
    if (config->kept_connections >= config->max_connections) {
        config->kept_connections = config->max_connections - 1;
    }
    if (config->max_owner_requests == 0) {
        config->max_owner_requests =
            requests > OWNER_REQUESTS_LEAST ? requests : OWNER_REQUESTS_LEAST;
    }
    if (config->max_owner_buffered == 0) {
        config->max_owner_buffered = config->max_buffered / 4;
    }
    if (config->max_peer_buffered == 0) {
        config->max_peer_buffered = config->max_buffered / 2;
    }
}

static void set_defaults(struct http_config *config)
{
    const struct http_config defaults = {.threads = default_threads(),
                                         .request_threads = 4,
                                         .upload_threads = 2,
                                         .max_connections = 1024,
                                         .max_waiting = 4096,
                                         .max_streams = 128,
                                         .heartbeat_seconds = 15,
                                         .max_buffered = (size_t)1 << 30,
                                         .max_owner_files = (size_t)1 << 30,
                                         .least_rate = 16384,
                                         .header_seconds = 15,
                                         .transfer_seconds = 30,
                                         .idle_seconds = 60};

    config->threads = config->threads ? config->threads : defaults.threads;
    config->request_threads =
        config->request_threads ? config->request_threads : defaults.request_threads;
    config->upload_threads =
        config->upload_threads ? config->upload_threads : defaults.upload_threads;
    config->max_connections =
        config->max_connections ? config->max_connections : defaults.max_connections;
    config->max_waiting = config->max_waiting ? config->max_waiting : defaults.max_waiting;
    config->max_streams = config->max_streams ? config->max_streams : defaults.max_streams;
    config->heartbeat_seconds =
        config->heartbeat_seconds > 0 ? config->heartbeat_seconds : defaults.heartbeat_seconds;
    config->max_buffered = config->max_buffered ? config->max_buffered : defaults.max_buffered;
    config->max_owner_files =
        config->max_owner_files ? config->max_owner_files : defaults.max_owner_files;
    config->header_seconds =
        config->header_seconds > 0 ? config->header_seconds : defaults.header_seconds;
    config->transfer_seconds =
        config->transfer_seconds > 0 ? config->transfer_seconds : defaults.transfer_seconds;
    config->idle_seconds = config->idle_seconds > 0 ? config->idle_seconds : defaults.idle_seconds;
    config->least_rate = config->least_rate > 0 ? config->least_rate : defaults.least_rate;
    set_shares(config);
}

__attribute__((format(printf, 2, 0))) static void log_library(void *cls, const char *format,
                                                              va_list arguments)
{
    char text[400];

    (void)cls;
    (void)vsnprintf(text, sizeof text, format, arguments);
    text[strcspn(text, "\n")] = '\0';
    LOG_WARN("http-library", log_text("message", text));
}

/* Not MHD_OPTION_STRICT_FOR_CLIENT: all that it adds is a refusal without Host, and the library
   sends the head of such a page twice. guard.c refuses that, and more.

   The limit of connections is slots.c's alone. At its own limit libmicrohttpd 0.9.75 closes the
   newcomer without giving back the lock that it holds (new_connection_process_), and its thread
   waits for itself for ever. */
static int start_daemon(struct http *http)
{
    /* One thread is no pool: the library would warn of its size. */
    const struct MHD_OptionItem pool[] = {
        {http->config.threads > 1 ? MHD_OPTION_THREAD_POOL_SIZE : MHD_OPTION_END,
         (intptr_t)http->config.threads, NULL},
        {MHD_OPTION_END, 0, NULL}};
    unsigned tls_flag = http->tls ? MHD_USE_TLS : 0;
    struct MHD_OptionItem tls[TLS_OPTIONS];

    tls_options(http->tls, tls);
    http->daemon = MHD_start_daemon(
        MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG |
            MHD_USE_NO_LISTEN_SOCKET | MHD_USE_ITC | tls_flag,
        0, NULL, NULL, exchange_step, http, MHD_OPTION_EXTERNAL_LOGGER, log_library, http,
        MHD_OPTION_CONNECTION_LIMIT, (unsigned)INT_MAX, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        CONNECTION_MEMORY, MHD_OPTION_NOTIFY_CONNECTION, connection_notify, http,
        MHD_OPTION_URI_LOG_CALLBACK, connection_target, http, MHD_OPTION_NOTIFY_COMPLETED,
        exchange_completed, http, MHD_OPTION_ARRAY, tls, MHD_OPTION_ARRAY, pool, MHD_OPTION_END);
    return http->daemon ? 0 : -1;
}

static int init_sync(struct http *http)
{
    pthread_condattr_t monotonic;

    (void)pthread_condattr_init(&monotonic);
    (void)pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    (void)pthread_mutex_init(&http->mutex, NULL);
    for (size_t i = 0; i < LANES; i++) {
        (void)pthread_cond_init(&http->lanes[i].work, NULL);
    }
    (void)pthread_cond_init(&http->timer, &monotonic);
    (void)pthread_cond_init(&http->idle, &monotonic);
    (void)pthread_condattr_destroy(&monotonic);
    return 0;
}

static void http_free(struct http *http)
{
    tls_close(http->tls);
    (void)pthread_cond_destroy(&http->idle);
    (void)pthread_cond_destroy(&http->timer);
    for (size_t i = 0; i < LANES; i++) {
        (void)pthread_cond_destroy(&http->lanes[i].work);
    }
    (void)pthread_mutex_destroy(&http->mutex);
    free(http->taps);
    free(http->judged);
    free(http);
}

int http_start(struct http **out, const struct http_config *config, char *message, size_t size)
{
    struct http *http = calloc(1, sizeof *http);

    *out = NULL;
    if (!http || init_sync(http) != 0) {
        (void)snprintf(message, size, "not enough memory");
        free(http);
        return -1;
    }
    http->config = *config;
    set_defaults(&http->config);
    request_ids_start(http);
    randombytes_buf(&http->holders_seed, sizeof http->holders_seed);
    if (config->tls_certificate) {
        http->tls = tls_open(config->tls_certificate, config->tls_key, message, size);
        if (!http->tls) {
            http_free(http);
            return -1;
        }
    }
    http->listen_fd =
        listen_open(config->listen, http->address, sizeof http->address, message, size);
    if (http->listen_fd < 0) {
        http_free(http);
        return -1;
    }
    if (tap_start(http) != 0 || pool_start(http) != 0 || timer_start(http) != 0 ||
        start_daemon(http) != 0 || front_start(http) != 0) {
        (void)snprintf(message, size, "cannot start the threads that listen on %s", config->listen);
        (void)close(http->listen_fd);
        if (http->daemon) {
            MHD_stop_daemon(http->daemon);
        }
        pool_stop(http);
        timer_stop(http);
        http_free(http);
        return -1;
    }
    metrics_watch(http->config.metrics, METRIC_HTTP_IN_PROGRESS, &http->n_exchanges);
    metrics_set(http->config.metrics, METRIC_HTTP_CONNECTIONS_MAX, METRIC_LABELS("serving"),
                (double)http->config.max_connections);
    metrics_set(http->config.metrics, METRIC_HTTP_CONNECTIONS_MAX, METRIC_LABELS("waiting"),
                (double)http->config.max_waiting);
    *out = http;
    return 0;
}

const char *http_address(const struct http *http)
{
    return http->address;
}

/* Waits until no request is in progress, at most grace_seconds. */
static void wait_idle(struct http *http, double grace_seconds)
{
    double end = clock_now() + grace_seconds;
    struct timespec until = clock_timespec(end);

    (void)pthread_mutex_lock(&http->mutex);
    while (http->n_exchanges > 0 && clock_now() < end) {
        (void)pthread_cond_timedwait(&http->idle, &http->mutex, &until);
    }
    (void)pthread_mutex_unlock(&http->mutex);
}

void http_stop(struct http *http, double grace_seconds)
{
    if (!http) {
        return;
    }
    front_stop(http);
    (void)close(http->listen_fd);
    (void)pthread_mutex_lock(&http->mutex);
    http->draining = true;
    pool_wake_all(http);
    (void)pthread_mutex_unlock(&http->mutex);
    wait_idle(http, HANDLING_GRACE * grace_seconds);
    (void)pthread_mutex_lock(&http->mutex);
    lane_stop(http);
    (void)pthread_mutex_unlock(&http->mutex);
    wait_idle(http, (1 - HANDLING_GRACE) * grace_seconds);
    pool_stop(http);
    MHD_stop_daemon(http->daemon);
    timer_stop(http);
    metrics_watch(http->config.metrics, METRIC_HTTP_IN_PROGRESS, NULL);
    http_free(http);
}
