/*
 * job_state.c - how a job moves from state to state. All of it is here.
 *
 *   accepted --claim--> running --transition--> successful, failed, dismissed
 *      |                   '------transition--> accepted       (put back by a daemon that stops)
 *      '--cancel, transition--> dismissed
 *
 * The queue gives its owners turns: a claim takes a job of the owner who has had the fewest. Each
 * claim sets turn := max(turn + 1, the largest turn of all): owners with jobs waiting follow each
 * other in a round, and one who comes later, or was kept from running, joins the round and is not
 * given the turns that it missed (start-time fair queueing of Goyal, Vin and Cheng, 1996, with all
 * jobs of one length). An owner with running_max jobs running is passed over. The cost is that of a
 * walk along the owners by turn to the first with a job, each an index look.
 *
 * Within a turn the job goes first whose creation plus expected time is earliest: short before
 * long, and yet a job is overtaken only by those that came at most its own expected time after it,
 * so that none starves. An express claim is the same, turns included, among the jobs that are
 * marked as short; an owner who holds as much of the express lane as one may is passed over, unless
 * nobody else uses the service.
 *
 * Jobs that the daemon has died with several times wait for store_job_claim_alone and no other
 * claim (jobs/alone.c): among them turns and order are the same.
 *
 * Every move is one UPDATE guarded by the state that it starts from, and, once a job has been
 * claimed, by the number of its attempt: whoever comes late with the result of an attempt that
 * was given up finds that the guard does not hold.
 */
#include "store/internal.h"
#include "store/job.h"
#include "store/store.h"

#include <stdlib.h>
#include <string.h>

static const char *const names[] = {"accepted", "running", "successful", "failed", "dismissed"};

const char *store_job_status_name(enum store_job_status status)
{
    return names[status];
}

/* ---- Claim ----------------------------------------------------------------------------------- */

/* The statements of a claim, among the jobs that waiting names. ?1 is an owner to be passed over,
   NULL for none. The owner '' is there always, and has jobs only where there are no others. */
#define NEXT_OWNER(waiting)                                                                \
    "SELECT name FROM owner WHERE EXISTS "                                                 \
    "(SELECT 1 FROM job WHERE owner = name AND " waiting ") AND (running_max = 0 OR "      \
    "(SELECT count(*) FROM job WHERE owner = name AND status = 'running') < running_max) " \
    "AND (?1 IS NULL OR name <> ?1 OR NOT EXISTS "                                         \
    "(SELECT 1 FROM owner WHERE name NOT IN ('', ?1))) "                                   \
    "ORDER BY turn, name LIMIT 1"
#define CLAIM(waiting)                                                                             \
    "UPDATE job SET status = 'running', attempt = attempt + 1, started_ms = ?1, updated_ms = ?1, " \
    "progress = 0, message = '' WHERE id = (SELECT id FROM job WHERE owner = ?2 AND " waiting      \
    " ORDER BY created_ms + expected_ms, id LIMIT 1) AND status = 'accepted' "                     \
    "RETURNING " STORE_JOB_COLUMNS
#define ANY "status = 'accepted' AND alone = 0"
#define EXPRESS "status = 'accepted' AND express = 1 AND alone = 0"
#define ALONE "status = 'accepted' AND alone = 1"

static const struct claim_sql {
    const char *next_owner, *waits, *claim;
} claim_any = {NEXT_OWNER(ANY), "SELECT 1 FROM job WHERE " ANY " LIMIT 1", CLAIM(ANY)},
  claim_express = {NEXT_OWNER(EXPRESS), "SELECT 1 FROM job WHERE " EXPRESS " LIMIT 1",
                   CLAIM(EXPRESS)},
  claim_alone = {NEXT_OWNER(ALONE), "SELECT 1 FROM job WHERE " ALONE " LIMIT 1", CLAIM(ALONE)};

struct claim {
    const struct claim_sql *sql;
    const char *except; /* an owner, or NULL */
    struct store_job *job;
};

/* Whose turn it is. STORE_NOT_FOUND: no job waits; STORE_CONFLICT: none that may run now. */
static int next_owner(sqlite3 *db, const struct claim *claim, char owner[STORE_OWNER_MAX])
{
    const struct claim_sql *sql = claim->sql;
    sqlite3_stmt *row = NULL;
    int64_t waiting = 0;
    int status = store_prepare(db, &row, sql->next_owner, "t", claim->except);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        store_column_id(row, 0, owner, STORE_OWNER_MAX);
    }
    sqlite3_finalize(row);
    if (status == STORE_NOT_FOUND && store_scalar(db, &waiting, sql->waits) == STORE_OK) {
        status = STORE_CONFLICT;
    }
    return status;
}

static int take_turn(sqlite3 *db, const char *owner)
{
    return store_execute(db, NULL,
                         "UPDATE owner SET turn = max(turn + 1, (SELECT max(turn) FROM owner)) "
                         "WHERE name = ?",
                         "t", owner);
}

static int run_claim(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct claim *claim = write->argument;
    char owner[STORE_OWNER_MAX];
    sqlite3_stmt *row = NULL;
    int64_t now = store_now_ms();
    int status = next_owner(db, claim, owner);

    (void)store;
    store_job_clear(claim->job);
    if (status == STORE_OK) {
        status = take_turn(db, owner);
    }
    if (status != STORE_OK) {
        return status;
    }
    status = store_prepare(db, &row, claim->sql->claim, "it", now, owner);
    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    if (status == STORE_OK) {
        status = store_job_from_row(row, claim->job);
    }
    sqlite3_finalize(row);
    return status;
}

static int claim_job(struct store *store, const struct claim_sql *sql, const char *except,
                     struct store_job *job)
{
    struct claim claim = {.sql = sql, .except = except, .job = job};
    int status;

    *job = (struct store_job){0};
    status = store_write(store, run_claim, &claim);
    if (status != STORE_OK) {
        store_job_clear(job);
    }
    return status;
}

int store_job_claim(struct store *store, struct store_job *job)
{
    return claim_job(store, &claim_any, NULL, job);
}

int store_job_claim_express(struct store *store, const char *except, struct store_job *job)
{
    return claim_job(store, &claim_express, except, job);
}

int store_job_claim_alone(struct store *store, struct store_job *job)
{
    return claim_job(store, &claim_alone, NULL, job);
}

/* Owners with jobs take turns, so before the r-th job of one come at most r jobs of each whose turn
   is earlier, and r - 1 of each whose turn is later. */
int store_job_position(struct store *store, const char *id, size_t *position)
{
    struct store_query query;
    int status = store_query_first(
        &query, store,
        "WITH own AS (SELECT id, owner, turn, created_ms + expected_ms AS due FROM job "
        "JOIN owner ON name = owner WHERE id = ? AND status = 'accepted'), "
        "ranked AS (SELECT own.owner, turn, "
        "(SELECT count(*) FROM job WHERE job.owner = own.owner AND status = 'accepted' "
        "AND created_ms + expected_ms < due) + (SELECT count(*) FROM job "
        "WHERE job.owner = own.owner AND status = 'accepted' "
        "AND created_ms + expected_ms = due AND job.id <= own.id) AS rank FROM own) "
        "SELECT rank + coalesce((SELECT sum(min((SELECT count(*) FROM job "
        "WHERE job.owner = name AND status = 'accepted'), "
        "rank - ((owner.turn, name) > (ranked.turn, ranked.owner)))) "
        "FROM owner WHERE name <> ranked.owner), 0) FROM ranked",
        "t", id);

    *position = 0;
    if (status == STORE_OK) {
        *position = (size_t)sqlite3_column_int64(query.row, 0);
    }
    store_query_close(&query);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* In the r-th round each owner has its r-th job, the owners in the order of their turns. */
int store_job_places(struct store *store,
                     bool (*visit)(void *user, const char *id, size_t position), void *user)
{
    struct store_query query;
    int status = store_query_open(
        &query, store,
        "WITH ranked AS (SELECT job.id AS id, turn, name, row_number() OVER (PARTITION BY "
        "job.owner ORDER BY created_ms + expected_ms, job.id) AS rank FROM job "
        "JOIN owner ON name = job.owner WHERE status = 'accepted') "
        "SELECT id FROM ranked ORDER BY rank, turn, name",
        "");
    bool more = true;

    for (size_t position = 1; status == STORE_OK && more; position++) {
        status = store_query_next(&query);
        if (status == STORE_OK) {
            more = visit(user, (const char *)sqlite3_column_text(query.row, 0), position);
        }
    }
    store_query_close(&query);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* ---- Transition ------------------------------------------------------------------------------ */

/* The transition table: to each state, the states that lead there. Only a claim leads to running.
   */
static const struct {
    const char *from[2];
} transitions[] = {
    [STORE_JOB_ACCEPTED] = {{"running", "running"}},
    [STORE_JOB_RUNNING] = {{"", ""}},
    [STORE_JOB_SUCCESSFUL] = {{"running", "running"}},
    [STORE_JOB_FAILED] = {{"running", "running"}},
    [STORE_JOB_DISMISSED] = {{"accepted", "running"}},
};

struct transition {
    const char *id;
    int64_t attempt;
    enum store_job_status to;
    const struct store_content *results; /* NULL: none */
    struct store_ids named;              /* by the results */
    const char *problem_code, *problem_detail;
};

/* Why the guard did not hold: no such job, or another state or attempt. */
static int explain(sqlite3 *db, const char *id)
{
    struct store_job job;
    int status = store_job_row(db, id, &job);

    if (status == STORE_OK) {
        store_job_clear(&job);
        status = STORE_CONFLICT;
    }
    return status;
}

/* What the results name, they go with; the rows that say so must fit, too. */
static int note_results(sqlite3 *db, const struct transition *t)
{
    char owner[STORE_OWNER_MAX] = "";
    int status = store_text(db, owner, sizeof owner, "SELECT owner FROM job WHERE id = ?", t->id);

    if (status == STORE_OK) {
        status = store_needs_add(db, owner, t->id, &t->named, true);
    }
    return status == STORE_OK ? store_owner_check(db, owner, 0) : status;
}

static int run_transition(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct transition *t = write->argument;
    size_t changed = 0;
    int64_t back = t->to == STORE_JOB_ACCEPTED, now = store_now_ms();
    double progress = t->to == STORE_JOB_SUCCESSFUL ? 100.0 : back ? 0.0 : -1.0;
    int status =
        t->results ? store_owner_check_job(db, t->id, (int64_t)t->results->size) : STORE_OK;

    if (status == STORE_OK && t->results) {
        status = store_blob_keep(store, db, t->results);
    }
    if (status == STORE_OK) {
        status = store_execute(
            db, &changed,
            "UPDATE job SET status = ?1, results = ?2, problem_code = ?3, problem_detail = ?4, "
            "progress = ?5, message = '', updated_ms = ?6, finished_ms = iif(?7, 0, ?6), "
            "started_ms = iif(?7, 0, started_ms), "
            "cancel_requested = cancel_requested OR ?1 = 'dismissed' "
            "WHERE id = ?8 AND attempt = ?9 AND status IN (?10, ?11)",
            "ttttdiititt", names[t->to], t->results ? t->results->hash : NULL, t->problem_code,
            t->problem_detail, progress, now, back, t->id, t->attempt, transitions[t->to].from[0],
            transitions[t->to].from[1]);
    }
    if (status == STORE_OK && changed > 0 && t->named.count > 0) {
        status = note_results(db, t);
    }
    if (status == STORE_OK && changed > 0 && !back) {
        status = store_checkpoint_drop(db, t->id, write);
    }
    return status == STORE_OK && changed == 0 ? explain(db, t->id) : status;
}

int store_job_transition(struct store *store, const char *id, int64_t attempt,
                         enum store_job_status to, const char *results, const char *problem_code,
                         const char *problem_detail)
{
    bool failed = to == STORE_JOB_FAILED;
    struct store_content staged = {.temporary = ""};
    struct transition transition = {
        .id = id,
        .attempt = attempt,
        .to = to,
        .problem_code = failed ? problem_code : NULL,
        .problem_detail = failed ? problem_detail : NULL,
    };
    int status = STORE_OK;

    /* Results belong to success, a problem to failure, and neither to anything else. */
    if ((to == STORE_JOB_SUCCESSFUL) != (results != NULL) || failed != (problem_code != NULL)) {
        return STORE_CONFLICT;
    }
    if (results) {
        status = store_ids_find(&transition.named, results);
        transition.results = &staged;
    }
    if (status == STORE_OK && results) {
        status = store_blob_stage(store, results, strlen(results), &staged);
    }
    if (status == STORE_OK) {
        status = results ? store_write(store, run_transition, &transition)
                         : store_write_freeing(store, run_transition, &transition);
        store_blob_unstage(store, &staged);
    }
    if (status == STORE_OK && to != STORE_JOB_ACCEPTED) {
        store_scratch_remove(store, id);
    }
    store_ids_clear(&transition.named);
    return status;
}

/* ---- Cancel ---------------------------------------------------------------------------------- */

struct cancel {
    const char *id;
    struct store_job *job;
};

static int run_cancel(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct cancel *cancel = write->argument;
    int status = store_execute(db, NULL,
                               "UPDATE job SET cancel_requested = 1, updated_ms = ?1, "
                               "finished_ms = iif(status = 'accepted', ?1, 0), "
                               "status = iif(status = 'accepted', 'dismissed', status) "
                               "WHERE id = ?2 AND status IN ('accepted', 'running')",
                               "it", store_now_ms(), cancel->id);

    (void)store;
    store_job_clear(cancel->job);
    if (status == STORE_OK) {
        status = store_job_row(db, cancel->id, cancel->job);
    }
    if (status == STORE_OK && cancel->job->status == STORE_JOB_DISMISSED) {
        status = store_checkpoint_drop(db, cancel->id, write);
    }
    return status;
}

int store_job_request_cancel(struct store *store, const char *id, struct store_job *job)
{
    struct cancel cancel = {.id = id, .job = job};
    int status;

    *job = (struct store_job){0};
    status = store_write_freeing(store, run_cancel, &cancel);
    if (status != STORE_OK) {
        store_job_clear(job);
    } else if (job->status == STORE_JOB_DISMISSED) {
        store_scratch_remove(store, id);
    }
    return status;
}

/* ---- Recovery -------------------------------------------------------------------------------- */

struct recovery {
    int64_t deaths_max;
    const char *named; /* the job at fault; "": not known */
    size_t requeued, failed;
};

static int dismiss_canceled(sqlite3 *db, int64_t now)
{
    return store_execute(db, NULL,
                         "UPDATE job SET status = 'dismissed', finished_ms = ?1, "
                         "updated_ms = ?1, progress = -1 "
                         "WHERE status = 'running' AND cancel_requested",
                         "i", now);
}

/* The job at fault has failed; the others have nothing to do with it. */
static int blame_named(sqlite3 *db, int64_t now, struct recovery *recovery)
{
    int status =
        store_execute(db, &recovery->failed,
                      "UPDATE job SET status = 'failed', finished_ms = ?1, updated_ms = ?1, "
                      "progress = -1, deaths = deaths + 1, problem_code = 'job-crashed', "
                      "problem_detail = 'The daemon died of a fault in the thread that ran this "
                      "job.' WHERE status = 'running' AND id = ?2",
                      "it", now, recovery->named);

    if (status == STORE_OK && recovery->failed > 0) {
        status = store_execute(db, &recovery->requeued,
                               "UPDATE job SET status = 'accepted', started_ms = 0, "
                               "updated_ms = ?1, progress = 0 WHERE status = 'running'",
                               "i", now);
    }
    return status;
}

/* A death is counted with each that ran; what ran alone has failed. */
static int count_deaths(sqlite3 *db, int64_t now, struct recovery *recovery)
{
    int status =
        store_execute(db, &recovery->failed,
                      "UPDATE job SET status = 'failed', finished_ms = ?1, "
                      "updated_ms = ?1, progress = -1, deaths = deaths + 1, "
                      "problem_code = 'attempts-exhausted', "
                      "problem_detail = 'The daemon died ' || (deaths + 1) || ' times while "
                      "it ran this job, the last time with no other job beside it.' "
                      "WHERE status = 'running' AND alone = 1",
                      "i", now);

    if (status == STORE_OK) {
        status = store_execute(db, &recovery->requeued,
                               "UPDATE job SET status = 'accepted', started_ms = 0, "
                               "updated_ms = ?1, progress = 0, deaths = deaths + 1, "
                               "alone = deaths + 1 >= ?2 WHERE status = 'running'",
                               "ii", now, recovery->deaths_max);
    }
    return status;
}

/* At the start nothing runs: what the rows call running was cut short. */
static int run_recover(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct recovery *recovery = write->argument;
    int64_t now = store_now_ms();
    int status = dismiss_canceled(db, now);

    (void)store;
    recovery->requeued = recovery->failed = 0;
    if (status == STORE_OK && recovery->named[0]) {
        status = blame_named(db, now, recovery);
    }
    if (status == STORE_OK && recovery->failed == 0) {
        status = count_deaths(db, now, recovery);
    }
    return status;
}

int store_job_recover(struct store *store, int64_t deaths_max, const char *named, size_t *requeued,
                      size_t *failed)
{
    struct recovery recovery = {.deaths_max = deaths_max, .named = named ? named : ""};
    int status = store_write_freeing(store, run_recover, &recovery);

    *requeued = status == STORE_OK ? recovery.requeued : 0;
    *failed = status == STORE_OK ? recovery.failed : 0;
    status = status == STORE_OK ? store_checkpoint_sweep(store) : status;
    return status == STORE_OK ? store_scratch_sweep(store) : status;
}
