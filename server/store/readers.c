/*
 * readers.c - the pool of read-only connections.
 *
 * A thread takes a connection for the length of one query and gives it back; the pool keeps up to
 * IDLE_MAX of them open and closes the rest. In WAL mode a reader sees the last commit before its
 * statement began and never waits for the writer.
 *
 * Lock: readers.mutex (rank 41), never held while SQLite runs.
 */
#include "store/internal.h"

#include <stdlib.h>

#define IDLE_MAX 16

int store_readers_start(struct store *store)
{
    pthread_mutex_init(&store->readers.mutex, NULL);
    pthread_cond_init(&store->readers.returned, NULL);
    return STORE_OK;
}

void store_readers_stop(struct store *store)
{
    struct store_readers *readers = &store->readers;

    pthread_mutex_lock(&readers->mutex);
    readers->closing = true;
    while (readers->in_use > 0) {
        pthread_cond_wait(&readers->returned, &readers->mutex);
    }
    pthread_mutex_unlock(&readers->mutex);
    while (readers->idle) {
        struct store_reader *reader = readers->idle;

        readers->idle = reader->next;
        sqlite3_close(reader->db);
        free(reader);
    }
    pthread_cond_destroy(&readers->returned);
    pthread_mutex_destroy(&readers->mutex);
}

/* Opens one more connection; it counts as in use already. */
static int open_reader(struct store *store, struct store_reader **out)
{
    struct store_reader *reader = calloc(1, sizeof *reader);
    int status = reader ? store_connect_reader(store->database, &reader->db) : STORE_NOMEM;

    if (status != STORE_OK) {
        free(reader);
        return status;
    }
    *out = reader;
    return STORE_OK;
}

int store_reader_take(struct store *store, struct store_reader **reader)
{
    struct store_readers *readers = &store->readers;
    int status = STORE_OK;

    *reader = NULL;
    pthread_mutex_lock(&readers->mutex);
    if (readers->closing) {
        pthread_mutex_unlock(&readers->mutex);
        return STORE_CLOSED;
    }
    readers->in_use++;
    if (readers->idle) {
        *reader = readers->idle;
        readers->idle = (*reader)->next;
        readers->n_idle--;
    }
    pthread_mutex_unlock(&readers->mutex);
    if (!*reader) {
        status = open_reader(store, reader);
        if (status != STORE_OK) {
            store_reader_return(store, NULL);
        }
    }
    return status;
}

void store_reader_return(struct store *store, struct store_reader *reader)
{
    struct store_readers *readers = &store->readers;
    struct store_reader *surplus = NULL;
    /* A COMMIT may fail for want of memory. Within its transaction a connection would see what it
       saw then for ever. */
    bool whole = reader && sqlite3_get_autocommit(reader->db);

    pthread_mutex_lock(&readers->mutex);
    if (whole && readers->n_idle < IDLE_MAX) {
        reader->next = readers->idle;
        readers->idle = reader;
        readers->n_idle++;
    } else {
        surplus = reader;
    }
    pthread_mutex_unlock(&readers->mutex);
    if (surplus) {
        sqlite3_close(surplus->db);
        free(surplus);
    }
    /* Counted last: a store that closes waits for this connection to be gone. */
    pthread_mutex_lock(&readers->mutex);
    readers->in_use--;
    pthread_cond_broadcast(&readers->returned);
    pthread_mutex_unlock(&readers->mutex);
}
