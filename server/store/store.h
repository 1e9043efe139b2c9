/*
 * store.h - everything durable: one SQLite database and a folder of content-addressed blobs under
 * the data directory. The only part of the daemon that knows SQLite or writes files.
 *
 * Design
 *   One writer thread owns the only read-write connection: it executes queued writes in groups
 *   (one transaction, one fsync for all that wait), runs the checkpoints when idle, and wakes the
 *   callers. Every writing function below blocks until its group is committed with
 *   synchronous=FULL: what it returns is a promise that survives kill -9. Readers use read-only
 *   connections, one per calling thread at a time, kept in a pool. A group that fails as a whole
 *   is retried one write at a time, so that one bad write does not spoil its neighbours.
 *
 *   Values up to STORE_INLINE_MAX bytes live in the database; larger ones are files under
 *   blobs/ab/abcdef... named by their SHA-256: written under a temporary name, fsync, rename,
 *   fsync of the folder, and only then the row.
 *
 * Functions return 0 or a negative STORE_* code. Every struct store_x filled by a function owns
 * its strings and is released by the matching store_x_clear. Any function may be called from any
 * thread.
 */
#ifndef SRNFD_STORE_H
#define SRNFD_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STORE_INLINE_MAX ((size_t)256 * 1024)
#define STORE_COHORT_NAME_MAX 101 /* bytes of the longest name with its zero */
#define STORE_ID_MAX 64           /* bytes of the longest id with its zero */

enum store_status {
    STORE_OK = 0,
    STORE_NOT_FOUND = -1,
    STORE_CONFLICT = -2, /* the row is not in the state that the write asks for */
    STORE_FULL = -3,     /* no space left on the device */
    STORE_IO = -4,       /* any other failure of the device */
    STORE_CORRUPT = -5,  /* not our database, damaged, or a blob that does not match its name */
    STORE_NEWER = -6,    /* written by a newer version */
    STORE_BUSY = -7,     /* another daemon holds the data directory */
    STORE_NOMEM = -8,
    STORE_CLOSED = -9,  /* the store is shutting down */
    STORE_QUOTA = -10,  /* the owner holds as many bytes as it may */
    STORE_QUEUED = -11, /* the owner has as many jobs waiting as it may */
};
const char *store_strerror(int status);

struct store;

/* Creates or opens the data directory, migrates the database (each migration in one transaction),
   takes the lock that keeps a second daemon out, and starts the writer thread. message gets a
   sentence on failure. */
int store_open(struct store **out, const char *directory, char *message, size_t message_size);
void store_close(struct store *store);

/* Content ids: prefix + 32 hex digits of SHA-256. */
void store_content_id(char id[STORE_ID_MAX], const char *prefix, const void *bytes, size_t size);
void store_sha256_hex(char hex[65], const void *bytes, size_t size);

/* Milliseconds since the epoch: the only clock that rows carry. */
int64_t store_now_ms(void);

/* ---- Owners ---------------------------------------------------------------------------------- */

/* Bytes of the longest name of an owner with its zero. An owner is the name of a token; "" is the
   one owner of a service without tokens. */
#define STORE_OWNER_MAX 65

/* For whom something is stored. */
struct store_owner {
    const char *name;  /* borrowed; NULL: "" */
    int64_t bytes_max; /* that the owner may hold with it, otherwise STORE_QUOTA; 0: no limit;
                          STORE_BYTES_KEPT: as was said the last time */
};
#define STORE_BYTES_KEPT INT64_C(-1)

/* Who asks: what belongs to the owner is seen, with `all` what belongs to anyone. */
struct store_view {
    const char *owner; /* NULL: "" */
    bool all;
};

/* Whether the mesh, surface, model or job of this id belongs to the owner (NULL: ""): STORE_OK or
   STORE_NOT_FOUND. */
int store_owner_has(struct store *store, const char *owner, const char *id);
/* Bytes that the owner holds: meshes, coefficients, the arrays of models, what jobs were given,
   results and checkpoints, cohorts, and for each row something for itself. What several owners have
   counts for each. most: what it may hold, as was said last (0: any number); may be NULL. */
int store_owner_bytes(struct store *store, const char *owner, int64_t *bytes, int64_t *most);
/* Remembers when a token was last used, by its id. */
int store_token_used(struct store *store, const char *token, int64_t when_ms);

/* What an owner may have: jobs that wait and run, and bytes. 0: no limit. */
struct store_job_limits {
    size_t queued, running;
    int64_t bytes;
};

/* ---- Lists ----------------------------------------------------------------------------------- */

/* Newest first. A cursor is (created_ms, id) of the last item seen; after_id NULL or "" starts at
   the top. visit is called once per row with a struct of the kind that is valid only during the
   call; it returns false to stop. */
struct store_page {
    size_t limit;
    int64_t after_ms;
    const char *after_id;
    const char *process, *status; /* filters, for jobs only; NULL: all */
    const char *owner;            /* what belongs to this owner; NULL: to anyone */
};

/* ---- Whether it works ------------------------------------------------------------------------ */

/* STORE_OK, or why nothing that needs room is taken at present: STORE_FULL, STORE_IO. What frees
   room (deletions, cancellations) is done all the same. */
int store_room(const struct store *store);
/* SELECT 1 through a reader: is the database there? */
int store_ping(struct store *store);

/* Removes files below blobs/ that no row names, unless a backup is being made. */
int store_sweep_files(struct store *store, size_t *removed);

#endif
