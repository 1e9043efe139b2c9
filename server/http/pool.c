/*
 * pool.c - the threads that handle requests, and the exchanges that wait for jobs. Their queues are
 * those of lane.c.
 *
 * A suspended exchange goes QUEUED -> RUNNING -> READY, or, when its handler asked to wait for a
 * job, RUNNING -> QUEUED once more (the job may have ended before the wait was known) -> RUNNING ->
 * WAITING, and from there back to QUEUED whenever the job changes, the deadline or WAIT_CHECK
 * passes or the daemon drains. A change that comes while the exchange is queued or running is kept
 * in `woken`, so none is lost. When READY it leaves all lists and the connection is resumed without
 * the lock: from then on it belongs to libmicrohttpd's thread again.
 */
#include "http/internal.h"

#include "clock.h"
#include "jobs/fault.h"
#include "priority.h"

#include <poll.h>
#include <stdio.h>
#include <string.h>

/* Seconds between two looks whether an answer may still be waited for: its token may be revoked. */
#define WAIT_CHECK 1.0

bool pool_submit(struct exchange *exchange)
{
    struct http *http = exchange->http;
    bool open, upload = api_is_upload(&exchange->request);

    /* Without the lock: to tell them apart a large body may have to be looked through. */
    exchange->small = upload && api_is_small(&exchange->request);
    exchange->lane = upload ? LANE_UPLOADS : LANE_REQUESTS;
    exchange->fetches = api_fetches(&exchange->request);
    (void)pthread_mutex_lock(&http->mutex);
    open = !http->stopping && !http->giving_up;
    if (open) {
        exchange->request.stop = &exchange->stop;
        MHD_suspend_connection(exchange->mhd);
        lane_enqueue(http, exchange);
    }
    (void)pthread_mutex_unlock(&http->mutex);
    return open;
}

/* A stream that pauses is woken by the timer, when its pause is over. */
static bool pauses(struct exchange *exchange)
{
    return exchange->streams && !exchange->http->draining && clock_now() < exchange->pause_until;
}

void pool_wake(struct exchange *exchange)
{
    if (exchange->phase == PHASE_WAITING && pauses(exchange)) {
        exchange->deadline = exchange->pause_until;
        (void)pthread_cond_signal(&exchange->http->timer);
    } else if (exchange->phase == PHASE_WAITING) {
        lane_enqueue(exchange->http, exchange);
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
        bool all = exchange->streams && strcmp(exchange->wait_job, API_STREAM_ALL) == 0 &&
                   strcmp(job_id, API_WAIT_TASKS) != 0;

        if (all ||
            ((exchange->streams || !streams_only) && strcmp(exchange->wait_job, job_id) == 0)) {
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

    add_wait(http, exchange, exchange->response.stream.job_id, stream_look_at(exchange));
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

/* The answer of what was told to stop, or passed over. */
static void give_up(struct exchange *exchange)
{
    bool gone = atomic_load(&exchange->gone);

    exchange->close = true;
    api_problem(&exchange->request, &exchange->response, gone ? 408 : 503,
                gone ? "request-timeout" : "shutting-down",
                gone ? "The connection was closed at its other end before the request was handled."
                     : "The service is shutting down.");
}

/* Whether the other end has closed its connection, or the half from which requests come. */
static bool has_left(const struct exchange *exchange)
{
    struct pollfd fd = {.fd = exchange->connection->fd, .events = POLLRDHUP};

    return poll(&fd, 1, 0) > 0 && (fd.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
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
    if (atomic_load(&exchange->stop)) {
        give_up(exchange);
        return;
    }
    if (!exchange->resumed) {
        api_handle(api, &exchange->request, &exchange->response);
        if (exchange->response.undone == API_STOPPED) {
            give_up(exchange);
        }
        return;
    }
    exchange->response.wait.seconds = seconds_left;
    exchange->request.gone = exchange->connection && has_left(exchange);
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
    exchange->deadline = stream_look_at(exchange);
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
    if (exchange->response.undone == API_AGAIN) {
        exchange->response.undone = API_DONE;
        exchange->request.alone = !exchange->request.small;
        exchange->small = false; /* it belongs to the threads that large ones have, too */
        lane_enqueue(http, exchange);
        return false;
    }
    exchange->request.alone = false;
    atomic_store(&exchange->stop, false);
    if (!exchange->response.wait.job_id[0]) {
        exchange->phase = PHASE_READY;
        return true;
    }
    exchange->lane = LANE_REQUESTS; /* what is left of it is short */
    if (!exchange->waits) {
        add_wait(http, exchange, exchange->response.wait.job_id,
                 clock_now() + exchange->response.wait.seconds);
    }
    exchange->resumed = true;
    if (!was_waiting || exchange->woken || http->draining) {
        lane_enqueue(http, exchange);
    } else {
        exchange->phase = PHASE_WAITING;
        exchange->look_at = clock_now() + WAIT_CHECK;
    }
    return false;
}

/* Handles what the thread of the lane has taken. The mutex is held, and let go of meanwhile. */
static void handle(struct lane *lane, size_t thread, struct exchange *exchange)
{
    struct http *http = lane->http;
    bool was_waiting = exchange->resumed;
    double seconds_left = exchange->deadline - clock_now();

    if (http->draining || seconds_left < 0) {
        seconds_left = 0;
    }
    (void)pthread_mutex_unlock(&http->mutex);
    run(exchange, seconds_left);
    (void)pthread_mutex_lock(&http->mutex);
    lane_leave(http, lane, thread);
    if (settle(http, exchange, was_waiting)) {
        if (exchange->waits) {
            remove_wait(exchange);
        }
        (void)pthread_mutex_unlock(&http->mutex);
        MHD_resume_connection(exchange->mhd);
        (void)pthread_mutex_lock(&http->mutex);
    }
}

static void *work(void *argument)
{
    struct lane *lane = argument;
    struct http *http = lane->http;
    size_t thread;

    if (lane == &http->lanes[LANE_UPLOADS]) {
        priority_compute();
    }
    fault_thread();
    (void)pthread_mutex_lock(&http->mutex);
    thread = lane->n_started++;
    while (!lane_is_over(http, lane)) {
        struct exchange *exchange = lane_take(http, lane, thread);

        if (exchange) {
            handle(lane, thread, exchange);
        } else {
            (void)pthread_cond_wait(&lane->work, &http->mutex);
        }
    }
    (void)pthread_mutex_unlock(&http->mutex);
    return NULL;
}

static int start_threads(struct http *http, struct lane *lane, const char *name, size_t wanted)
{
    lane->http = http;
    lane->last = &lane->first;
    for (size_t i = 0; i < wanted && i < HTTP_REQUEST_THREADS_MAX; i++) {
        char text[16];

        if (pthread_create(&lane->threads[i], NULL, work, lane) != 0) {
            return -1;
        }
        (void)pthread_mutex_lock(&http->mutex);
        lane->n_threads++;
        (void)pthread_mutex_unlock(&http->mutex);
        (void)snprintf(text, sizeof text, "srnfd-%s-%zu", name, i + 1);
        (void)pthread_setname_np(lane->threads[i], text);
    }
    return 0;
}

int pool_start(struct http *http)
{
    int status =
        start_threads(http, &http->lanes[LANE_REQUESTS], "req", http->config.request_threads);

    return status ? status
                  : start_threads(http, &http->lanes[LANE_UPLOADS], "upload",
                                  http->config.upload_threads + 1);
}

void pool_stop(struct http *http)
{
    (void)pthread_mutex_lock(&http->mutex);
    http->draining = true;
    http->stopping = true;
    pool_wake_all(http);
    lane_stop(http);
    for (size_t i = 0; i < LANES; i++) {
        (void)pthread_cond_broadcast(&http->lanes[i].work);
    }
    (void)pthread_mutex_unlock(&http->mutex);
    for (size_t i = 0; i < LANES; i++) {
        for (size_t k = 0; k < http->lanes[i].n_threads; k++) {
            (void)pthread_join(http->lanes[i].threads[k], NULL);
        }
    }
    (void)pthread_mutex_lock(&http->mutex); /* the timer still looks at the lanes */
    for (size_t i = 0; i < LANES; i++) {
        http->lanes[i].n_threads = 0;
    }
    (void)pthread_mutex_unlock(&http->mutex);
}
