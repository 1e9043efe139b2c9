/*
 * changes.h - which jobs have changed lately, in the order of their last change: what the stream of
 * all jobs (events_all.c) tells, and goes on from.
 */
#ifndef SRNFD_API_CHANGES_H
#define SRNFD_API_CHANGES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"

#define CHANGES_ID_SIZE 97 /* of the text of a point in time, with its end */

struct changes;

/* One job that has changed after some point in time. */
struct change {
    char id[STORE_ID_MAX];
    uint64_t at;    /* its last change */
    bool of_status; /* its row has changed since that point, not its progress alone */
};

/* NULL without memory. */
struct changes *changes_create(void);
void changes_destroy(struct changes *changes);

/* The job has changed: its row, or else its progress. owner may be NULL: not known here. */
void changes_note(struct changes *changes, const char *job_id, const char *owner, bool of_status);

/* Whose job it is, for those that were noted without. */
void changes_set_owner(struct changes *changes, const char *job_id, const char *owner);

/* Whether the job is known to be this owner's. */
bool changes_is_of(struct changes *changes, const char *job_id, const char *owner);

/* The newest point in time. */
uint64_t changes_now(struct changes *changes);

/* A point in time as a text that says nothing of its number, another one at each call, and back:
   false where it is of another run of the daemon, or none. */
void changes_text(const struct changes *changes, uint64_t at, char text[CHANGES_ID_SIZE]);
bool changes_parse(struct changes *changes, const char *text, uint64_t *at);

/* The jobs that changed after *seen, the earliest first, at most `most` of them; *seen becomes the
   point up to which they were looked at. owner: leaves out what is known to be of others; NULL:
   all. *lost: more has changed since *seen than is remembered. */
size_t changes_since(struct changes *changes, const char *owner, uint64_t *seen,
                     struct change *list, size_t most, bool *lost);

#endif
