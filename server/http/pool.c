/*
 * pool.c - the request threads srnfd-req-N, their queue, and the exchanges that wait for jobs.
 *
 * A suspended exchange goes QUEUED -> RUNNING -> READY, or, when its handler asked to wait for a
 * job, RUNNING -> QUEUED once more (the job may have ended before the wait was known) -> RUNNING ->
 * WAITING, and from there back to QUEUED whenever the job changes, the deadline passes or the
 * daemon drains. A change that comes while the exchange is queued or running is kept in `woken`, so
 * none is lost. When READY it leaves all lists and the connection is resumed without the lock: from
 * then on it belongs to libmicrohttpd's thread again.
 */
#include "http/internal.h"

#include <stdio.h>
#include <string.h>

/* The mutex is held. */
static void enqueue(struct http *http, struct exchange *exchange)
{
    exchange->phase = PHASE_QUEUED;
    exchange->woken = false;
    exchange->queue_next = NULL;
    *http->queue_last = exchange;
    http->queue_last = &exchange->queue_next;
    (void)pthread_cond_signal(&http->work);
}

static struct exchange *dequeue(struct http *http)
{
    struct exchange *exchange = http->queue_first;

    http->queue_first = exchange->queue_next;
    if (!http->queue_first) {
        http->queue_last = &http->queue_first;
    }
    return exchange;
}

bool pool_submit(struct exchange *exchange)
{
    struct http *http = exchange->http;
    bool open;

    (void)pthread_mutex_lock(&http->mutex);
    open = !http->stopping;
    if (open) {
        MHD_suspend_connection(exchange->mhd);
        enqueue(http, exchange);
    }
    (void)pthread_mutex_unlock(&http->mutex);
    return open;
}

/* A stream that pauses is woken by the timer, when its pause is over. */
static bool pauses(struct exchange *exchange)
{
    return exchange->streams && !exchange->http->draining && http_now() < exchange->pause_until;
}

void pool_wake(struct exchange *exchange)
{
    if (exchange->phase == PHASE_WAITING && pauses(exchange)) {
        exchange->deadline = exchange->pause_until;
        (void)pthread_cond_signal(&exchange->http->timer);
    } else if (exchange->phase == PHASE_WAITING) {
        enqueue(exchange->http, exchange);
    } else {
        exchange->woken = true;
    }
}

void pool_wake_all(struct http *http)
{
    for (struct exchange *exchange = http->waits; exchange; exchange = exchange->wait_next) {
        pool_wake(exchange);
    }
}

static void wake_those_of(struct http *http, const char *job_id, bool streams_only)
{
    (void)pthread_mutex_lock(&http->mutex);
    for (struct exchange *exchange = http->waits; exchange; exchange = exchange->wait_next) {
        if ((exchange->streams || !streams_only) && strcmp(exchange->wait_job, job_id) == 0) {
            pool_wake(exchange);
        }
    }
    (void)pthread_mutex_unlock(&http->mutex);
}

void http_job_changed(struct http *http, const char *job_id)
{
    wake_those_of(http, job_id, false);
}

void http_job_progressed(struct http *http, const char *job_id)
{
    wake_those_of(http, job_id, true);
}

static void add_wait(struct http *http, struct exchange *exchange, const char *job_id,
                     double deadline)
{
    exchange->waits = true;
    exchange->deadline = deadline;
    (void)snprintf(exchange->wait_job, sizeof exchange->wait_job, "%s", job_id);
    exchange->wait_next = http->waits;
    exchange->wait_place = &http->waits;
    if (http->waits) {
        http->waits->wait_place = &exchange->wait_next;
    }
    http->waits = exchange;
    (void)pthread_cond_signal(&http->timer);
}

void pool_await_stream(struct exchange *exchange)
{
    struct http *http = exchange->http;

    add_wait(http, exchange, exchange->response.stream.job_id, exchange->alive_at);
    exchange->phase = PHASE_WAITING;
    pool_wake(exchange);
}

static void remove_wait(struct exchange *exchange)
{
    *exchange->wait_place = exchange->wait_next;
    if (exchange->wait_next) {
        exchange->wait_next->wait_place = exchange->wait_place;
    }
    exchange->waits = false;
}

/* Runs the handler, or goes on after a wait. No lock is held; the exchange is RUNNING and this
   thread's. */
static void run(struct exchange *exchange, double seconds_left)
{
    struct api *api = exchange->http->config.api;

    if (exchange->streams) {
        stream_run(exchange);
        return;
    }
    if (!exchange->resumed) {
        api_handle(api, &exchange->request, &exchange->response);
        return;
    }
    exchange->response.wait.seconds = seconds_left;
    api_resume(api, &exchange->request, &exchange->response);
}

/* The same for a stream: true when there is a piece to send. */
static bool settle_stream(struct http *http, struct exchange *exchange)
{
    if (stream_has_piece(exchange)) {
        exchange->phase = PHASE_READY;
        return true;
    }
    exchange->phase = PHASE_WAITING;
    exchange->deadline = exchange->alive_at;
    if (exchange->woken || http->draining) {
        pool_wake(exchange);
    }
    return false;
}

/* After a run, with the mutex held: true when the response is complete. */
static bool settle(struct http *http, struct exchange *exchange, bool was_waiting)
{
    if (exchange->streams) {
        return settle_stream(http, exchange);
    }
    if (!exchange->response.wait.job_id[0]) {
        exchange->phase = PHASE_READY;
        return true;
    }
    if (!exchange->waits) {
        add_wait(http, exchange, exchange->response.wait.job_id,
                 http_now() + exchange->response.wait.seconds);
    }
    exchange->resumed = true;
    if (!was_waiting || exchange->woken || http->draining) {
        enqueue(http, exchange);
    } else {
        exchange->phase = PHASE_WAITING;
    }
    return false;
}

static void *work(void *argument)
{
    struct http *http = argument;

    (void)pthread_mutex_lock(&http->mutex);
    for (;;) {
        struct exchange *exchange;
        double seconds_left;
        bool was_waiting;

        while (!http->queue_first && !http->stopping) {
            (void)pthread_cond_wait(&http->work, &http->mutex);
        }
        if (!http->queue_first) {
            break;
        }
        exchange = dequeue(http);
        exchange->phase = PHASE_RUNNING;
        was_waiting = exchange->resumed;
        seconds_left = exchange->deadline - http_now();
        if (http->draining || seconds_left < 0) {
            seconds_left = 0;
        }
        (void)pthread_mutex_unlock(&http->mutex);
        run(exchange, seconds_left);
        (void)pthread_mutex_lock(&http->mutex);
        if (settle(http, exchange, was_waiting)) {
            if (exchange->waits) {
                remove_wait(exchange);
            }
            (void)pthread_mutex_unlock(&http->mutex);
            MHD_resume_connection(exchange->mhd);
            (void)pthread_mutex_lock(&http->mutex);
        }
    }
    (void)pthread_mutex_unlock(&http->mutex);
    return NULL;
}

int pool_start(struct http *http)
{
    size_t wanted = http->config.request_threads;

    http->queue_last = &http->queue_first;
    for (size_t i = 0; i < wanted && i < HTTP_REQUEST_THREADS_MAX; i++) {
        char name[16];

        if (pthread_create(&http->request_threads[i], NULL, work, http) != 0) {
            return -1;
        }
        http->n_request_threads++;
        (void)snprintf(name, sizeof name, "srnfd-req-%zu", i + 1);
        (void)pthread_setname_np(http->request_threads[i], name);
    }
    return 0;
}

void pool_stop(struct http *http)
{
    (void)pthread_mutex_lock(&http->mutex);
    http->draining = true;
    http->stopping = true;
    pool_wake_all(http);
    (void)pthread_cond_broadcast(&http->work);
    (void)pthread_mutex_unlock(&http->mutex);
    for (size_t i = 0; i < http->n_request_threads; i++) {
        (void)pthread_join(http->request_threads[i], NULL);
    }
    http->n_request_threads = 0;
}
