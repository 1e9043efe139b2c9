/*
 * task.c - tasks and leases (task.h). Writes of many workers that come together share a
 * transaction, and so a sync, as all writes do (writer.c).
 */
#include "store/task.h"

#include "store/digest.h"
#include "store/internal.h"

#include <stdlib.h>
#include <string.h>

/* ---- Opening --------------------------------------------------------------------------------- */

struct open_tasks {
    const char *job, *kind;
    size_t n;
    struct store_task *tasks;
};

static int run_open(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct open_tasks *open = write->argument;
    sqlite3_stmt *insert = NULL;
    int status = store_prepare(db, &insert,
                               "INSERT OR IGNORE INTO task (id, job, kind, status) "
                               "VALUES (?3, ?1, ?2, 'waiting')",
                               "ttt", open->job, open->kind, NULL);

    (void)store;
    for (size_t i = 0; status == STORE_OK && i < open->n; i++) {
        status = store_map(db, sqlite3_bind_text(insert, 3, open->tasks[i].id, -1, SQLITE_STATIC));
        if (status == STORE_OK) {
            status = store_step(db, insert);
            status = status == STORE_NOT_FOUND ? STORE_OK : status;
        }
        (void)sqlite3_reset(insert);
    }
    sqlite3_finalize(insert);
    return status;
}

static enum store_task_status status_of(const char *name)
{
    return strcmp(name, "done") == 0     ? STORE_TASK_DONE
           : strcmp(name, "leased") == 0 ? STORE_TASK_LEASED
                                         : STORE_TASK_WAITING;
}

static void read_one(sqlite3_stmt *row, struct store_task *task)
{
    char status[16];

    store_column_id(row, 0, status, sizeof status);
    task->status = status_of(status);
    task->attempt = sqlite3_column_int64(row, 1);
    task->lost = sqlite3_column_int64(row, 2);
    store_column_id(row, 3, task->worker, sizeof task->worker);
    store_column_id(row, 4, task->secret, sizeof task->secret);
}

static int read_all(sqlite3 *db, size_t n, struct store_task *tasks)
{
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row,
                               "SELECT status, attempt, lost, worker, secret FROM task "
                               "WHERE id = ?1",
                               "t", NULL);

    for (size_t i = 0; status == STORE_OK && i < n; i++) {
        status = store_map(db, sqlite3_bind_text(row, 1, tasks[i].id, -1, SQLITE_STATIC));
        if (status == STORE_OK) {
            status = store_step(db, row);
        }
        if (status == STORE_OK) {
            read_one(row, &tasks[i]);
        }
        (void)sqlite3_reset(row);
    }
    sqlite3_finalize(row);
    return status;
}

int store_tasks_open(struct store *store, const char *job, const char *kind, size_t n,
                     struct store_task *tasks)
{
    struct open_tasks open = {.job = job, .kind = kind, .n = n, .tasks = tasks};
    struct store_reader *reader = NULL;
    int status = store_write(store, run_open, &open);

    if (status == STORE_OK) {
        status = store_reader_take(store, &reader);
    }
    if (status == STORE_OK) {
        status = read_all(reader->db, n, tasks);
        store_reader_return(store, reader);
    }
    return status;
}

int store_task_get(struct store *store, struct store_task *task)
{
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    if (status == STORE_OK) {
        status = read_all(reader->db, 1, task);
        store_reader_return(store, reader);
    }
    return status;
}

/* ---- Reading --------------------------------------------------------------------------------- */

int store_task_holds(struct store *store, const char *id, const char *secret)
{
    struct store_query query;
    char digest[65];
    int status;

    store_sha256_hex(digest, secret, strlen(secret));
    status = store_query_first(
        &query, store, "SELECT 1 FROM task WHERE id = ? AND secret = ? AND status = 'leased'", "tt",
        id, digest);
    store_query_close(&query);
    return status == STORE_NOT_FOUND ? STORE_CONFLICT : status;
}

static int copy_result(sqlite3_stmt *row, unsigned char **result, size_t *size)
{
    const void *bytes = sqlite3_column_blob(row, 0);

    *size = (size_t)sqlite3_column_bytes(row, 0);
    *result = malloc(*size ? *size : 1);
    if (!*result) {
        return STORE_NOMEM;
    }
    if (*size > 0) {
        memcpy(*result, bytes, *size);
    }
    return STORE_OK;
}

int store_task_result(struct store *store, const char *id, unsigned char **result, size_t *size)
{
    struct store_query query;
    int status = store_query_first(
        &query, store, "SELECT result FROM task WHERE id = ? AND status = 'done'", "t", id);

    *result = NULL;
    *size = 0;
    status = status == STORE_OK ? copy_result(query.row, result, size) : status;
    store_query_close(&query);
    return status;
}

/* ---- Moves ----------------------------------------------------------------------------------- */

struct move {
    const char *id, *text; /* text: secret or reason, as the move has it */
    char secret[65];       /* digest */
    int64_t attempt;
    const char *worker;
    const struct store_maker *maker;
    const void *result;
    size_t size;
};

static struct move move_of(const char *id, const char *secret)
{
    struct move move = {.id = id};

    if (secret) {
        store_sha256_hex(move.secret, secret, strlen(secret));
    }
    return move;
}

/* One row was changed, or the guard did not hold. */
static int judge(int status, size_t changed)
{
    return status == STORE_OK && changed != 1 ? STORE_CONFLICT : status;
}

static int run_lease(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;
    size_t changed = 0;
    int status = store_execute_kept(
        store, &changed,
        "UPDATE task SET status = 'leased', attempt = ?1, secret = ?2, worker = ?3, "
        "place = ?4 || ' (' || ?5 || ')' WHERE id = ?6 AND status = 'waiting' AND attempt < ?1",
        "ittttt", move->attempt, move->secret, move->worker, move->maker->host, move->maker->cpu,
        move->id);

    (void)db;
    return judge(status, changed);
}

int store_task_lease(struct store *store, const char *id, int64_t attempt, const char *secret,
                     const char *worker, const struct store_maker *maker)
{
    struct move move = move_of(id, secret);

    move.attempt = attempt;
    move.worker = worker;
    move.maker = maker;
    /* Where the power fails the lease is none, and its task is computed again. */
    return store_write_relaxed(store, run_lease, &move);
}

/* One more result of the maker for the job of the task. */
static int count_result(struct store *store, const struct move *move)
{
    const struct store_maker *maker = move->maker;
    size_t changed = 0;
    int status = store_execute_kept(store, &changed,
                                    "UPDATE executor SET tasks = tasks + 1 WHERE job = "
                                    "(SELECT job FROM task WHERE id = ?) AND host = ? AND cpu = ? "
                                    "AND build = ?",
                                    "tttt", move->id, maker->host, maker->cpu, maker->build);

    if (status == STORE_OK && changed == 0) {
        status = store_execute_kept(
            store, NULL,
            "INSERT INTO executor (job, host, cpu, build, tasks) "
            "SELECT job, ?2, ?3, ?4, 1 FROM task WHERE id = ?1 AND "
            "(SELECT count(*) FROM executor WHERE executor.job = task.job) < ?5",
            "tttti", move->id, maker->host, maker->cpu, maker->build, (int64_t)STORE_EXECUTORS_MAX);
    }
    return status;
}

static int run_finish(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;
    size_t changed = 0;
    int status = store_execute_kept(store, &changed,
                                    "UPDATE task SET status = 'done', result = ? WHERE id = ? "
                                    "AND secret = ? AND status = 'leased'",
                                    "btt", move->result, move->size, move->id, move->secret);

    (void)db;
    status = judge(status, changed);
    return status == STORE_OK ? count_result(store, move) : status;
}

int store_task_finish(struct store *store, const char *id, const char *secret,
                      const struct store_maker *maker, const void *result, size_t size)
{
    struct move move = move_of(id, secret);

    move.maker = maker;
    move.result = result;
    move.size = size;
    /* Likewise: what follows from the result waits for the disk, and brings it there too. */
    return store_write_relaxed(store, run_finish, &move);
}

/* Reasons are lines, each with where it was; those that do not fit are left out. reason: NULL for
   none. */
#define ADD_REASON(reason)                                                 \
    "reasons = iif(" reason " IS NULL OR length(reasons) > 600, reasons, " \
    "trim(reasons || char(10) || iif(place = '', '', place || ': ') || "   \
    "substr(" reason ", 1, 300), char(10)))"

static int run_give_back(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;
    size_t changed = 0;
    int status = store_execute(db, &changed,
                               "UPDATE task SET status = 'waiting', secret = '', "
                               "lost = lost + (?1 IS NOT NULL), " ADD_REASON(
                                   "?1") " WHERE id = ?2 AND secret = ?3 AND status = 'leased'",
                               "ttt", move->text, move->id, move->secret);

    (void)store;
    return judge(status, changed);
}

int store_task_give_back(struct store *store, const char *id, const char *secret,
                         const char *reason)
{
    struct move move = move_of(id, secret);

    move.text = reason;
    return store_write(store, run_give_back, &move);
}

static int run_lose(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;
    size_t changed = 0;
    int status = store_execute(
        db, &changed,
        "UPDATE task SET status = 'waiting', secret = '', lost = lost + 1, " ADD_REASON(
            "?3") " WHERE id = ?1 AND attempt = ?2 AND status = 'leased'",
        "tit", move->id, move->attempt, move->text);

    (void)store;
    return judge(status, changed);
}

int store_task_lose(struct store *store, const char *id, int64_t attempt, const char *reason)
{
    struct move move = move_of(id, NULL);

    move.attempt = attempt;
    move.text = reason;
    return store_write(store, run_lose, &move);
}

static int run_reset(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;
    size_t changed = 0;
    int status = store_execute(db, &changed,
                               "UPDATE task SET status = 'waiting', result = NULL, secret = '', "
                               "lost = lost + 1 WHERE id = ? AND status = 'done'",
                               "t", move->id);

    (void)store;
    return judge(status, changed);
}

int store_task_reset(struct store *store, const char *id)
{
    struct move move = move_of(id, NULL);

    return store_write(store, run_reset, &move);
}

static int run_drop(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;

    (void)store;
    return store_execute(db, NULL, "DELETE FROM task WHERE job = ? AND status = 'done'", "t",
                         move->id);
}

int store_tasks_drop_done(struct store *store, const char *job)
{
    struct move move = {.id = job};

    return store_write(store, run_drop, &move);
}

int store_task_makers(struct store *store, const char *job,
                      void (*visit)(void *user, const struct store_maker *maker, int64_t tasks),
                      void *user)
{
    struct store_query query;
    int status = store_query_open(&query, store,
                                  "SELECT host, cpu, build, tasks FROM executor WHERE job = ? "
                                  "ORDER BY tasks DESC, host, cpu, build",
                                  "t", job);

    while (status == STORE_OK && (status = store_query_next(&query)) == STORE_OK) {
        visit(user,
              &(struct store_maker){.host = (const char *)sqlite3_column_text(query.row, 0),
                                    .cpu = (const char *)sqlite3_column_text(query.row, 1),
                                    .build = (const char *)sqlite3_column_text(query.row, 2)},
              sqlite3_column_int64(query.row, 3));
    }
    store_query_close(&query);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

int store_task_reasons(struct store *store, const char *id, char reasons[STORE_TASK_REASONS_MAX])
{
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    reasons[0] = '\0';
    if (status == STORE_OK) {
        status = store_text(reader->db, reasons, STORE_TASK_REASONS_MAX,
                            "SELECT reasons FROM task WHERE id = ?", id);
        store_reader_return(store, reader);
    }
    return status;
}
