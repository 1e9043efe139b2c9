/*
 * events.h - what both kinds of streams of server-sent events share: that of one job (events.c) and
 * that of all jobs (events_all.c).
 */
#ifndef SRNFD_API_EVENTS_H
#define SRNFD_API_EVENTS_H

#include <stdint.h>

#include "api/handler.h"

#define EVENT_ID_LENGTH 16
#define EVENT_RECONNECT_MS 2000
#define EVENT_ALIVE ": still here\n\n"

/* What a stream knows of its client. */
struct api_stream_state {
    /* Makes the next piece; the response is that of the stream. */
    void (*next)(struct api *api, struct api_response *response, bool alive);
    struct api_auth *auth;
    struct auth_account *account;   /* whose streams this is one of; NULL: of none */
    char seen[EVENT_ID_LENGTH + 1]; /* of one job: id of the last event; "" at first */
    int status;                     /* of the last event; -1 at first */
    uint64_t told;                  /* of all jobs: the point in time (changes.h) */
    char owner[STORE_OWNER_MAX];    /* whose jobs they are, if restricted */
    bool restricted;
};

/* Makes the piece (malloc) the response's body; one that memory is short for ends the stream. */
void events_set_piece(struct api_response *response, char *piece);
/* Answers with a stream that this state, which it takes over, goes on with, woken by the job;
   API_STREAM_ALL: by any. */
void events_open(struct api_call *call, struct api_stream_state *state, const char *job_id);
/* A state for the caller, counted among its streams until that of events_open ends. NULL when a
   problem was answered. */
struct api_stream_state *events_enter(struct api_call *call);

#endif
