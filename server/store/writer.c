/*
 * writer.c - the writer thread: the only one that changes the database, and the only one that
 * runs checkpoints (database.c says why).
 *
 * A caller puts its write, which lives on its own stack, at the end of the queue and sleeps. The
 * thread takes what has gathered, up to GROUP_MAX, and runs it as one transaction, each write
 * within a savepoint of its own: a write that is refused (STORE_CONFLICT, STORE_NOT_FOUND,
 * STORE_QUOTA, STORE_QUEUED) is
 * undone alone. One COMMIT, and so one fsync, serves the group; only then are the callers woken.
 * A group whose writes are all relaxed, as leases and their results are, is committed without that
 * fsync: other processes see it and it outlives this one, and a failure of power that undoes it
 * costs no more than the work. The next group that is not, or checkpoint, brings it to the disk.
 * When the group fails as a whole, because the disk is full or a statement broke the transaction,
 * it is rolled back and its writes are run again one by one, so that the failure stays with
 * whoever causes it; one that frees room then has the reserve (reserve.c).
 *
 * Checkpoints copy the log into the database: when no write has come for IDLE_MS, and between two
 * groups when the log has grown under sustained load by what the reserve has (8 MiB). They are
 * PASSIVE: they never wait for readers, and what one could not copy, the next one does. Only where
 * readers, each beginning before the last has ended, have kept SQLite from beginning the log anew
 * up to PAGES_FAR, one waits for them. After an erasure (erase.c) one empties the log.
 *
 * Threads: the writer thread srnfd-store. Lock: writer->mutex (rank 40), never held while SQLite
 * runs.
 */
#include "store/internal.h"
#include "store/prepared.h"

#include "store/store.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define GROUP_MAX 64
#define ROOM_FIRST (INT64_C(1) << 20) /* of what gives way to a write */
#define IDLE_MS 200
#define PURGE_MS 200          /* that emptying the log waits for readers */
#define PAGES_FAR (64 * 2048) /* where waiting for readers is better than growing on */

/* Those of enum STORE_BEGIN ..; prepared at the start, so that none fails where memory is short. */
static const char *const steps[STORE_STEPS] = {"BEGIN IMMEDIATE", "COMMIT", "ROLLBACK",
                                               "SAVEPOINT one_write", "RELEASE one_write"};

static int execute(sqlite3 *db, const char *sql)
{
    return store_map(db, sqlite3_exec(db, sql, NULL, NULL, NULL));
}

static int take_step(struct store_writer *writer, size_t step)
{
    int status = store_map(writer->db, sqlite3_step(writer->steps[step]));

    (void)sqlite3_reset(writer->steps[step]);
    return status;
}

static void finalize_all(struct store_writer *writer)
{
    for (size_t i = 0; i < STORE_STEPS; i++) {
        sqlite3_finalize(writer->steps[i]);
        writer->steps[i] = NULL;
    }
    for (size_t i = 0; i < STORE_KEPT_MAX; i++) {
        sqlite3_finalize(writer->kept[i].statement);
        writer->kept[i].statement = NULL;
    }
}

static int prepare_steps(struct store_writer *writer)
{
    int rc = SQLITE_OK;

    for (size_t i = 0; i < STORE_STEPS && rc == SQLITE_OK; i++) {
        rc = sqlite3_prepare_v3(writer->db, steps[i], -1, SQLITE_PREPARE_PERSISTENT,
                                &writer->steps[i], NULL);
    }
    if (rc != SQLITE_OK) {
        finalize_all(writer);
    }
    return rc == SQLITE_OK ? STORE_OK : STORE_NOMEM;
}

/* Whether the next commits wait for the disk: not where all writes of the group can do without, and
   then the next commit that waits brings theirs there too. */
static int set_relaxed(struct store_writer *writer, const struct store_write *list)
{
    bool relaxed = true;
    int status = STORE_OK;

    for (const struct store_write *write = list; write; write = write->next) {
        relaxed = relaxed && write->relaxed;
    }
    if (relaxed != writer->relaxed) {
        status = execute(writer->db,
                         relaxed ? "PRAGMA synchronous = NORMAL" : "PRAGMA synchronous = FULL");
        writer->relaxed = status == STORE_OK ? relaxed : writer->relaxed;
    }
    return relaxed ? STORE_OK : status;
}

/* After a refusal, the transaction goes on without this write; after anything else it cannot be
   trusted. */
static bool is_refusal(int status)
{
    return status == STORE_CONFLICT || status == STORE_NOT_FOUND || status == STORE_QUOTA ||
           status == STORE_QUEUED;
}

/* Runs one write in its savepoint. Returns a status only where the whole transaction has failed. */
static int run_write(struct store *store, struct store_write *write)
{
    sqlite3 *db = store->writer.db;
    int status;

    if (!write->frees && store_room(store) != STORE_OK) {
        write->status = store_room(store);
        return STORE_OK;
    }
    status = take_step(&store->writer, STORE_SAVEPOINT);
    if (status != STORE_OK) {
        return status;
    }
    write->n_dropped = 0;
    write->erases = false;
    write->status = write->run(store, db, write);
    if (write->status < 0) {
        write->n_dropped = 0;
        write->erases = false;
        if (!is_refusal(write->status) || sqlite3_get_autocommit(db)) {
            return write->status;
        }
        status = execute(db, "ROLLBACK TO one_write");
    }
    return status == STORE_OK ? take_step(&store->writer, STORE_RELEASE) : status;
}

/* Ends a transaction that has failed, unless SQLite has done so itself. */
static void roll_back(struct store_writer *writer)
{
    if (!sqlite3_get_autocommit(writer->db)) {
        (void)take_step(writer, STORE_ROLLBACK);
    }
}

/* Runs the list as one transaction. On success each write has its own status; otherwise nothing
   was done. */
static int run_group(struct store *store, struct store_write *list)
{
    sqlite3 *db = store->writer.db;
    int status = set_relaxed(&store->writer, list);

    status = status ? status : take_step(&store->writer, STORE_BEGIN);
    for (struct store_write *write = list; write && status == STORE_OK; write = write->next) {
        status = run_write(store, write);
    }
    if (status == STORE_OK) {
        status = take_step(&store->writer, STORE_COMMIT);
    }
    if (status != STORE_OK) {
        roll_back(&store->writer);
    }
    store_recent_expire(store->recent);
    for (struct store_write *write = list; write && status == STORE_OK; write = write->next) {
        for (size_t i = 0; i < write->n_dropped; i++) {
            store_blob_remove(store, db, write->dropped[i]);
        }
        store->writer.purge = store->writer.purge || write->erases;
    }
    return status;
}

/* A failure loses nothing: the log keeps what it has, and the next checkpoint tries again. */
static void checkpoint(struct store *store)
{
    struct store_writer *writer = &store->writer;
    int mode = writer->pages > PAGES_FAR ? SQLITE_CHECKPOINT_RESTART : SQLITE_CHECKPOINT_PASSIVE;
    int pages = 0, copied = 0;

    if (store_reserve_copies(store, writer->db) &&
        sqlite3_wal_checkpoint_v2(writer->db, NULL, mode, &pages, &copied) == SQLITE_OK) {
        writer->pages_copied = copied > 0 ? copied : 0;
    }
}

int store_write_drop(struct store_write *write, const char *hash)
{
    if (write->n_dropped == write->dropped_size) {
        size_t size = write->dropped_size ? 2 * write->dropped_size : 4;
        char(*list)[65] = realloc(write->dropped, size * sizeof *list);

        if (!list) {
            return STORE_NOMEM;
        }
        write->dropped = list;
        write->dropped_size = size;
    }
    memcpy(write->dropped[write->n_dropped], hash, 64);
    write->dropped[write->n_dropped++][64] = '\0';
    return STORE_OK;
}

/* Copies the whole log and cuts it to nothing, since it has pages as they were before an erasure,
   and cleans those of the database. Waits for readers, but not for long; what
   they prevent is tried again when the writer is idle. */
static void purge(struct store *store)
{
    struct store_writer *writer = &store->writer;

    if (!writer->purge || !store_reserve_copies(store, writer->db)) {
        return;
    }
    sqlite3_busy_timeout(writer->db, PURGE_MS);
    if (sqlite3_wal_checkpoint_v2(writer->db, NULL, SQLITE_CHECKPOINT_TRUNCATE, NULL, NULL) ==
        SQLITE_OK) {
        writer->pages = writer->pages_copied = 0;
        writer->dirty = false;
        writer->purge = store_scrub(writer->db) != STORE_OK;
    }
    sqlite3_busy_timeout(writer->db, STORE_BUSY_TIMEOUT_MS);
}

/* Runs a write alone. Where it finds no room, prepared meshes give way, for ever more since nobody
   knows what it needs; and where it frees it has the reserve. */
static void run_alone(struct store *store, struct store_write *write)
{
    int status = run_group(store, write);

    for (int64_t bytes = ROOM_FIRST; status == STORE_FULL && store_prepared_give_way(store, bytes);
         bytes *= 2) {
        status = run_group(store, write);
    }
    if (status == STORE_FULL && write->frees && store_reserve_release(store)) {
        checkpoint(store);
        status = run_group(store, write);
    }
    if (status != STORE_OK) {
        write->status = status;
    }
}

static void run_list(struct store *store, struct store_write *list)
{
    if (list->next && run_group(store, list) == STORE_OK) {
        return;
    }
    for (struct store_write *write = list, *next; write; write = next) {
        next = write->next;
        write->next = NULL;
        run_alone(store, write);
        write->next = next;
    }
}

/* Called by SQLite after each commit with the length of the log. */
static int count_pages(void *user, sqlite3 *db, const char *name, int pages)
{
    struct store_writer *writer = user;

    (void)db;
    (void)name;
    /* Once all is copied and nobody reads the log any more, SQLite begins it anew. */
    writer->pages_copied = pages < writer->pages ? 0 : writer->pages_copied;
    writer->pages = pages;
    writer->dirty = true;
    return SQLITE_OK;
}

static struct timespec from_now(int64_t ms)
{
    struct timespec until;

    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += ms / 1000;
    until.tv_nsec += ms % 1000 * 1000000L;
    until.tv_sec += until.tv_nsec / 1000000000L;
    until.tv_nsec %= 1000000000L;
    return until;
}

/* Waits for writes, for at most IDLE_MS where there is something to do without them: the log is
   dirty, or the reserve is missing. Returns with the mutex held; false: timed out. */
static bool wait_for_writes(struct store *store)
{
    struct store_writer *writer = &store->writer;
    bool timed = writer->dirty || writer->purge || store_room(store) != STORE_OK;
    struct timespec until;
    bool timed_out = false;

    until = from_now(IDLE_MS);
    while (!writer->head && !writer->closing && !timed_out) {
        if (timed) {
            timed_out = pthread_cond_timedwait(&writer->wake, &writer->mutex, &until) == ETIMEDOUT;
        } else {
            pthread_cond_wait(&writer->wake, &writer->mutex);
        }
    }
    return !timed_out;
}

/* Cuts at most GROUP_MAX writes off the queue; the mutex is held. */
static struct store_write *take_group(struct store_writer *writer)
{
    struct store_write *list = writer->head, *last = list;

    for (size_t n = 1; last && last->next && n < GROUP_MAX; n++) {
        last = last->next;
    }
    if (last) {
        writer->head = last->next;
        last->next = NULL;
    }
    if (!writer->head) {
        writer->tail = NULL;
    }
    return list;
}

static void wake_callers(struct store_writer *writer, struct store_write *list)
{
    pthread_mutex_lock(&writer->mutex);
    for (struct store_write *write = list, *next; write; write = next) {
        /* A write that is done may vanish with its caller's stack as soon as the mutex is free. */
        next = write->next;
        write->done = true;
        pthread_cond_broadcast(&write->finished);
    }
    pthread_mutex_unlock(&writer->mutex);
}

static void *writer_main(void *user)
{
    struct store *store = user;
    struct store_writer *writer = &store->writer;
    int most = store_reserve_pages(store); /* of the log, before it is copied */

    pthread_setname_np(pthread_self(), "srnfd-store");
    for (bool closing = false; !closing;) {
        struct store_write *list;
        bool idle;

        pthread_mutex_lock(&writer->mutex);
        idle = !wait_for_writes(store);
        list = take_group(writer);
        closing = writer->closing && !list;
        pthread_mutex_unlock(&writer->mutex);
        store_reserve_take(store);
        if (list) {
            run_list(store, list);
            purge(store);
            wake_callers(writer, list);
        }
        if (writer->pages - writer->pages_copied > most || (idle && !list && writer->dirty)) {
            checkpoint(store);
            /* What readers still hold back waits for the next commit rather than for a timer. */
            writer->dirty = false;
        }
        if (idle) {
            purge(store);
        }
    }
    return NULL;
}

int store_writer_start(struct store *store)
{
    struct store_writer *writer = &store->writer;
    pthread_condattr_t attributes;

    if (prepare_steps(writer) != STORE_OK) {
        return STORE_NOMEM;
    }
    if (pthread_condattr_init(&attributes) != 0) {
        finalize_all(writer);
        return STORE_NOMEM;
    }
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&writer->mutex, NULL);
    pthread_cond_init(&writer->wake, &attributes);
    pthread_cond_init(&writer->probe.finished, &attributes);
    pthread_condattr_destroy(&attributes);
    sqlite3_wal_hook(writer->db, count_pages, writer);
    writer->started = pthread_create(&writer->thread, NULL, writer_main, store) == 0;
    if (!writer->started) {
        finalize_all(writer);
        pthread_cond_destroy(&writer->wake);
        pthread_cond_destroy(&writer->probe.finished);
        pthread_mutex_destroy(&writer->mutex);
        return STORE_NOMEM;
    }
    return STORE_OK;
}

void store_writer_stop(struct store *store)
{
    struct store_writer *writer = &store->writer;

    if (!writer->started) {
        return;
    }
    pthread_mutex_lock(&writer->mutex);
    writer->closing = true;
    pthread_cond_signal(&writer->wake);
    pthread_mutex_unlock(&writer->mutex);
    pthread_join(writer->thread, NULL);
    pthread_cond_destroy(&writer->wake);
    pthread_cond_destroy(&writer->probe.finished);
    pthread_mutex_destroy(&writer->mutex);
    finalize_all(writer);
    writer->started = false;
}

/* Puts the write at the end of the queue; the mutex is held. */
static void enqueue(struct store_writer *writer, struct store_write *write)
{
    if (writer->tail) {
        writer->tail->next = write;
    } else {
        writer->head = write;
    }
    writer->tail = write;
    pthread_cond_signal(&writer->wake);
}

/* Queues the write and sleeps until it is done. */
static int queue_and_wait(struct store *store, struct store_write *write)
{
    struct store_writer *writer = &store->writer;

    pthread_cond_init(&write->finished, NULL);
    pthread_mutex_lock(&writer->mutex);
    if (!writer->closing) {
        enqueue(writer, write);
        while (!write->done) {
            pthread_cond_wait(&write->finished, &writer->mutex);
        }
    }
    pthread_mutex_unlock(&writer->mutex);
    pthread_cond_destroy(&write->finished);
    free(write->dropped);
    return write->status;
}

int store_write(struct store *store, int (*run)(struct store *, sqlite3 *, struct store_write *),
                void *argument)
{
    struct store_write write = {.run = run, .argument = argument, .status = STORE_CLOSED};

    return queue_and_wait(store, &write);
}

int store_write_relaxed(struct store *store,
                        int (*run)(struct store *, sqlite3 *, struct store_write *), void *argument)
{
    struct store_write write = {
        .run = run, .argument = argument, .relaxed = true, .status = STORE_CLOSED};

    return queue_and_wait(store, &write);
}

int store_write_freeing(struct store *store,
                        int (*run)(struct store *, sqlite3 *, struct store_write *), void *argument)
{
    struct store_write write = {
        .run = run, .argument = argument, .frees = true, .status = STORE_CLOSED};

    return queue_and_wait(store, &write);
}

/* The write is the writer's own, since it goes on when its callers have left. */
int store_write_probe(struct store *store,
                      int (*run)(struct store *, sqlite3 *, struct store_write *), int64_t wait_ms,
                      bool *answered)
{
    struct store_writer *writer = &store->writer;
    struct store_write *probe = &writer->probe;
    struct timespec until = from_now(wait_ms);
    int status = STORE_CLOSED;

    pthread_mutex_lock(&writer->mutex);
    if (!writer->closing && (!writer->probing || probe->done)) {
        writer->probing = true;
        probe->run = run;
        probe->status = STORE_CLOSED;
        probe->done = false;
        probe->next = NULL;
        enqueue(writer, probe);
    }
    while (!writer->closing && !probe->done &&
           pthread_cond_timedwait(&probe->finished, &writer->mutex, &until) != ETIMEDOUT) {
    }
    *answered = writer->closing || probe->done;
    status = probe->done ? probe->status : status;
    pthread_mutex_unlock(&writer->mutex);
    return status;
}
