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

static int read_one(sqlite3_stmt *row, struct store_task *task)
{
    char status[16];

    store_column_id(row, 0, status, sizeof status);
    task->status = status_of(status);
    task->attempt = sqlite3_column_int64(row, 1);
    task->lost = sqlite3_column_int64(row, 2);
    task->expires_ms = sqlite3_column_int64(row, 3);
    store_column_id(row, 4, task->worker, sizeof task->worker);
    store_column_id(row, 6, task->secret, sizeof task->secret);
    if (task->status == STORE_TASK_DONE) {
        const void *bytes = sqlite3_column_blob(row, 5);

        task->result_size = (size_t)sqlite3_column_bytes(row, 5);
        task->result = malloc(task->result_size ? task->result_size : 1);
        if (!task->result) {
            return STORE_NOMEM;
        }
        if (task->result_size > 0) {
            memcpy(task->result, bytes, task->result_size);
        }
    }
    return STORE_OK;
}

static int read_all(sqlite3 *db, size_t n, struct store_task *tasks)
{
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row,
                               "SELECT status, attempt, lost, expires_ms, worker, result, "
                               "secret FROM task "
                               "WHERE id = ?1",
                               "t", NULL);

    for (size_t i = 0; status == STORE_OK && i < n; i++) {
        status = store_map(db, sqlite3_bind_text(row, 1, tasks[i].id, -1, SQLITE_STATIC));
        if (status == STORE_OK) {
            status = store_step(db, row);
        }
        if (status == STORE_OK) {
            status = read_one(row, &tasks[i]);
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
    int status;

    for (size_t i = 0; i < n; i++) {
        tasks[i].result = NULL;
        tasks[i].result_size = 0;
    }
    status = store_write(store, run_open, &open);
    if (status == STORE_OK) {
        status = store_reader_take(store, &reader);
    }
    if (status == STORE_OK) {
        status = read_all(reader->db, n, tasks);
        store_reader_return(store, reader);
    }
    for (size_t i = 0; status != STORE_OK && i < n; i++) {
        free(tasks[i].result);
        tasks[i].result = NULL;
    }
    return status;
}

/* ---- Moves ----------------------------------------------------------------------------------- */

struct move {
    const char *id, *text; /* text: secret or reason, as the move has it */
    char secret[65];       /* digest */
    int64_t attempt, ms;
    const char *worker;
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
    int status = store_execute(db, &changed,
                               "UPDATE task SET status = 'leased', attempt = ?, secret = ?, "
                               "worker = ?, expires_ms = ? WHERE id = ? AND status = 'waiting' "
                               "AND attempt < ?",
                               "ittiti", move->attempt, move->secret, move->worker, move->ms,
                               move->id, move->attempt);

    (void)store;
    return judge(status, changed);
}

int store_task_lease(struct store *store, const char *id, int64_t attempt, const char *secret,
                     const char *worker, int64_t expires_ms)
{
    struct move move = move_of(id, secret);

    move.attempt = attempt;
    move.worker = worker;
    move.ms = expires_ms;
    return store_write(store, run_lease, &move);
}

static int run_extend(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;
    size_t changed = 0;
    int status = store_execute(db, &changed,
                               "UPDATE task SET expires_ms = ? WHERE id = ? AND secret = ? "
                               "AND status = 'leased'",
                               "itt", move->ms, move->id, move->secret);

    (void)store;
    return judge(status, changed);
}

int store_task_extend(struct store *store, const char *id, const char *secret, int64_t expires_ms)
{
    struct move move = move_of(id, secret);

    move.ms = expires_ms;
    return store_write(store, run_extend, &move);
}

static int run_finish(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct move *move = write->argument;
    size_t changed = 0;
    int status = store_execute(db, &changed,
                               "UPDATE task SET status = 'done', result = ? WHERE id = ? "
                               "AND secret = ? AND status = 'leased'",
                               "btt", move->result, move->size, move->id, move->secret);

    (void)store;
    return judge(status, changed);
}

int store_task_finish(struct store *store, const char *id, const char *secret, const void *result,
                      size_t size)
{
    struct move move = move_of(id, secret);

    move.result = result;
    move.size = size;
    return store_write(store, run_finish, &move);
}

/* Reasons are lines; those that do not fit are left out. ?1: the reason, NULL for none. */
#define ADD_REASON(reason)                                                 \
    "reasons = iif(" reason " IS NULL OR length(reasons) > 600, reasons, " \
    "trim(reasons || char(10) || substr(" reason ", 1, 300), char(10)))"

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
            "('attempt ' || attempt || ': no sign of ' || worker)") " WHERE id = ?1 AND attempt = "
                                                                    "?2 AND status = 'leased' AND "
                                                                    "expires_ms <= ?3",
        "tii", move->id, move->attempt, move->ms);

    (void)store;
    return judge(status, changed);
}

int store_task_lose(struct store *store, const char *id, int64_t attempt, int64_t now_ms)
{
    struct move move = move_of(id, NULL);

    move.attempt = attempt;
    move.ms = now_ms;
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
