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

#include <stddef.h>
#include <stdbool.h>
#include <stdint.h>

#include "store_status.h"

#define STORE_INLINE_MAX ((size_t)256 * 1024) /* bytes of the largest value in the database */

struct store;

/* Creates or opens the data directory, migrates the database (each migration in one transaction),
   takes the lock that keeps a second daemon out, and starts the writer thread. message gets a
   sentence on failure. */
int store_open(struct store **out, const char *directory, char *message, size_t message_size);
void store_close(struct store *store);

/* Milliseconds since the epoch: the only clock that rows carry. */
int64_t store_now_ms(void);

/* STORE_OK, or why nothing that needs room is taken at present: STORE_FULL, STORE_IO. What frees
   room (deletions, cancellations) is done all the same. */
int store_room(const struct store *store);
/* SELECT 1 through a reader: is the database there? */
int store_ping(struct store *store);

/* A descriptor of an empty file of the data directory that has no name and goes with it; -1 with
   *status. */
int store_scratch_file(const struct store *store, int *status);
/* Whether such a file may have so many bytes more: the disk keeps free what it is to, for which
   prepared meshes give way. */
bool store_scratch_fits(struct store *store, int64_t bytes);

/* Removes files below blobs/ that no row names, unless a backup is being made. */
int store_sweep_files(struct store *store, size_t *removed);

#endif
