/*
 * events.c - GET /v1/jobs/{id}/events: a job as a stream of server-sent events (WHATWG HTML, 9.2).
 *
 * An event is the job's record as it is at that moment, not an entry of a history: `status` when
 * the status differs from that of the event before, `progress` when anything else does, `deleted`
 * when the job is gone. So a client that reads slowly gets fewer events and never old ones, and
 * nothing is kept for it but the piece that it is about to read. The stream ends with the event of
 * the status in which the job ended.
 *
 * A stream belongs to the token that asked for it: once that is revoked or has expired nothing more
 * is told, and the stream ends, at the latest when http/ asks again (STREAM_CHECK).
 *
 * The id of an event is a digest of the record. A client that comes back with Last-Event-ID has
 * seen that record: it gets the next one that differs, whatever happened in between, also after a
 * restart of the daemon; if the record is that of an ended job the answer is 204, which tells an
 * EventSource to stay away.
 */
#include "api/events.h"
#include "api/respond.h"
#include "api/routes.h"

#include "api/auth.h"
#include "api/job_answers.h"
#include "store/digest.h"
#include "store/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void leave(void *argument)
{
    struct api_stream_state *state = argument;

    stream_leave(state->auth, state->account);
    free(state);
}

struct api_stream_state *events_enter(struct api_call *call)
{
    struct api_stream_state *state = calloc(1, sizeof *state);

    if (!state) {
        (void)problem_respond_store(call, STORE_NOMEM, "", "");
        return NULL;
    }
    if (!stream_enter(call)) {
        free(state);
        return NULL;
    }
    state->auth = call->api->auth;
    state->account = call->request->caller.account;
    state->status = -1;
    return state;
}

void events_open(struct api_call *call, struct api_stream_state *state, const char *job_id)
{
    struct api_response *response = call->response;

    response->stream.state = state;
    response->stream.free_state = leave;
    response->status = 200;
    (void)snprintf(response->stream.job_id, sizeof response->stream.job_id, "%s", job_id);
    (void)api_response_header_text(response, "Content-Type", "text/event-stream");
    (void)api_response_header_text(response, "Cache-Control", "no-store");
    (void)api_response_header_text(response, "X-Accel-Buffering", "no");
}

static void event_id(const char *data, char id[EVENT_ID_LENGTH + 1])
{
    char hex[65];

    store_sha256_hex(hex, data, strlen(data));
    memcpy(id, hex, EVENT_ID_LENGTH);
    id[EVENT_ID_LENGTH] = '\0';
}

void events_set_piece(struct api_response *response, char *piece)
{
    free(response->body);
    response->body = (unsigned char *)piece;
    response->body_size = piece ? strlen(piece) : 0;
    response->stream.ended = response->stream.ended || !piece;
}

static char *make_event(bool first, const char *id, const char *name, const char *data)
{
    char *piece = NULL, retry[32] = "";

    if (first) {
        (void)snprintf(retry, sizeof retry, "retry: %d\n", EVENT_RECONNECT_MS);
    }
    return asprintf(&piece, "%sid: %s\nevent: %s\ndata: %s\n\n", retry, id, name, data) < 0 ? NULL
                                                                                            : piece;
}

/* The event of the job as it is, if it differs from the one before; otherwise an empty piece, or a
   comment that keeps the connection alive. */
static void tell_job(struct api_response *response, const struct store_job *job, bool alive)
{
    struct api_stream_state *state = response->stream.state;
    json_t *record = job_record(job, NULL);
    char *data = record ? json_dumps(record, JSON_COMPACT) : NULL;
    char id[EVENT_ID_LENGTH + 1];

    json_decref(record);
    if (!data) {
        events_set_piece(response, NULL);
        return;
    }
    event_id(data, id);
    if (strcmp(id, state->seen) == 0) {
        events_set_piece(response, strdup(alive ? EVENT_ALIVE : ""));
    } else {
        bool moved = state->status != (int)job->status;

        events_set_piece(response,
                         make_event(state->status < 0, id, moved ? "status" : "progress", data));
        memcpy(state->seen, id, sizeof id);
        state->status = (int)job->status;
    }
    free(data);
    response->stream.ended = response->stream.ended || job_ended(job);
}

static void next_of_job(struct api *api, struct api_response *response, bool alive)
{
    struct store_job job = {0};
    const char *id = response->stream.job_id;
    int status = jobs_get(api->config.jobs, id, &job);

    if (status == STORE_OK) {
        tell_job(response, &job, alive);
        store_job_clear(&job);
    } else if (status == STORE_NOT_FOUND) {
        char data[STORE_ID_MAX + 16];

        (void)snprintf(data, sizeof data, "{\"id\":\"%s\"}", id);
        response->stream.ended = true;
        events_set_piece(response, make_event(false, "deleted", "deleted", data));
    } else {
        /* The store does not answer now: the client comes back by itself. */
        events_set_piece(response, NULL);
    }
}

void api_stream_next(struct api *api, struct api_response *response, bool alive)
{
    const struct api_stream_state *state = response->stream.state;

    if (auth_holds(state->auth, state->account)) {
        state->next(api, response, alive);
    } else {
        /* The token was revoked, or has expired: coming back, the client is told so. */
        events_set_piece(response, NULL);
    }
}

void jobs_events(struct api_call *call)
{
    const char *known = api_request_header(call->request, "Last-Event-ID");
    struct api_stream_state *state;
    struct store_job job = {0};
    int status = jobs_get(call->api->config.jobs, call->parameters[0], &job);

    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, "no-such-job", call->parameters[0]);
        return;
    }
    state = events_enter(call);
    if (!state) {
        store_job_clear(&job);
        return;
    }
    state->next = next_of_job;
    if (known && strlen(known) == EVENT_ID_LENGTH) {
        memcpy(state->seen, known, sizeof state->seen);
    }
    events_open(call, state, job.id);
    tell_job(call->response, &job, true);
    if (job_ended(&job) && known && strcmp(known, state->seen) == 0 && state->status < 0) {
        api_response_clear(call->response);
        call->response->status = 204;
    }
    store_job_clear(&job);
}
