/*
 * events_all.c - GET /v1/events: all jobs that the caller sees, as one stream of server-sent
 * events.
 *
 * As in the stream of one job (events.c), an event is a job's record as it is at that moment:
 * `status` when its row has changed since the point up to which the client was told, `progress`
 * when only its progress has, `deleted` with its id when it is gone. The stream does not end with a
 * job. Nothing is kept for a client but the piece that it is about to read, of at most PIECE_JOBS
 * events; what comes next is what has changed since (changes.h).
 *
 * The id of an event is the point in time of its change. A client that comes back with it is told
 * what changed after that. Where that is not known any more, since the daemon was started anew or
 * too many jobs have changed, and where a client comes without it, there is a `start`: the stream
 * tells what changes from here on, and what was before is in the list of jobs, which the client
 * asks for then.
 *
 * A job that was removed by its age, or with what it was made of, is not told.
 */
#include "api/changes.h"
#include "api/events.h"
#include "api/respond.h"
#include "api/routes.h"

#include "api/auth.h"
#include "api/job_answers.h"
#include "store/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PIECE_JOBS 16

void api_job_changed(struct api *api, const char *job_id, bool of_status)
{
    changes_note(api->changes, job_id, NULL, of_status);
}

static void write_event(FILE *out, const struct api *api, uint64_t at, const char *name,
                        const char *data)
{
    char id[CHANGES_ID_SIZE];

    changes_text(api->changes, at, id);
    (void)fprintf(out, "id: %s\nevent: %s\ndata: %s\n\n", id, name, data);
}

static bool is_theirs(const struct api_stream_state *state, const struct store_job *job)
{
    return !state->restricted || strcmp(job->owner, state->owner) == 0;
}

/* False when memory was short. */
static bool write_job(FILE *out, struct api *api, const struct change *change,
                      const struct store_job *job)
{
    json_t *record = job_record(job, NULL);
    char *data = record ? json_dumps(record, JSON_COMPACT) : NULL;

    json_decref(record);
    if (data) {
        write_event(out, api, change->at, change->of_status ? "status" : "progress", data);
    }
    free(data);
    return data != NULL;
}

/* The event of one job. False when it cannot be told now. */
static bool tell_change(FILE *out, struct api *api, const struct api_stream_state *state,
                        const struct change *change)
{
    struct store_job job = {0};
    int status = jobs_get(api->config.jobs, change->id, &job);
    bool told = true;

    if (status == STORE_OK) {
        changes_set_owner(api->changes, job.id, job.owner);
        told = !is_theirs(state, &job) || write_job(out, api, change, &job);
        store_job_clear(&job);
    } else if (status == STORE_NOT_FOUND) {
        char data[STORE_ID_MAX + 16];

        /* One whose owner was not known before it went is nobody's. */
        if (!state->restricted || changes_is_of(api->changes, change->id, state->owner)) {
            (void)snprintf(data, sizeof data, "{\"id\":\"%.63s\"}", change->id);
            write_event(out, api, change->at, "deleted", data);
        }
    } else {
        told = false;
    }
    return told;
}

/* Writes what has changed since the client was told. False when it cannot be told now. */
static bool write_piece(FILE *out, struct api *api, struct api_stream_state *state, bool first)
{
    struct change list[PIECE_JOBS];
    bool lost = first, told = true;
    size_t n = 0;

    if (!lost) {
        n = changes_since(api->changes, state->restricted ? state->owner : NULL, &state->told, list,
                          PIECE_JOBS, &lost);
    }
    if (lost) {
        n = 0;
        state->told = changes_now(api->changes);
        write_event(out, api, state->told, "start", "{}");
    }
    for (size_t i = 0; i < n && told; i++) {
        told = tell_change(out, api, state, &list[i]);
    }
    return told;
}

static void set_next(struct api *api, struct api_response *response, bool first, bool alive,
                     const char *before)
{
    struct api_stream_state *state = response->stream.state;
    char *piece = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&piece, &size);
    bool told = out && fputs(before, out) >= 0 && write_piece(out, api, state, first);

    if (told && alive && ftell(out) == (long)strlen(before)) {
        told = fputs(EVENT_ALIVE, out) >= 0;
    }
    if (!out || fclose(out) != 0 || !told) {
        /* The client comes back by itself. */
        free(piece);
        piece = NULL;
    }
    events_set_piece(response, piece);
}

static void next_of_all(struct api *api, struct api_response *response, bool alive)
{
    set_next(api, response, false, alive, "");
}

void jobs_events_all(struct api_call *call)
{
    const char *known = api_request_header(call->request, "Last-Event-ID");
    char after[CHANGES_ID_SIZE], retry[32];
    struct api_stream_state *state;
    bool refused = false, given = query_get(call, "after", after, sizeof after, &refused);

    state = refused ? NULL : events_enter(call);
    if (!state) {
        return;
    }
    known = known ? known : given ? after : "";
    state->next = next_of_all;
    state->restricted = call->request->caller.restricted;
    memcpy(state->owner, call->request->caller.name, sizeof state->owner);
    events_open(call, state, API_STREAM_ALL);
    (void)snprintf(retry, sizeof retry, "retry: %d\n", EVENT_RECONNECT_MS);
    set_next(call->api, call->response, !changes_parse(call->api->changes, known, &state->told),
             true, retry);
}
