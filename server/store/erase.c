/*
 * erase.c - removing meshes, surfaces and models, with what needs them.
 *
 * What goes is closed under `need` (needs.c): with a mesh go the surfaces that were made of it, the
 * jobs it was given to and all that those made, the models that stand on them, and the cohorts that
 * name any of these. Ended jobs whose results name something that goes do so too, without being
 * asked about: an answer that names what is not there would be none. All is one transaction, so a
 * crash leaves everything or nothing; files go after the commit (blob.c), and those that a crash
 * leaves are without a row, for the next start to sweep.
 *
 * Content belongs to each of its owners. Only the last takes it along; the others keep what they
 * have, and nothing of what the one called it stays. A caller who may name what others have (an
 * admin) can need a thing without having it: the last owner then cannot go from under that.
 *
 * Zeroing: secure_delete overwrites rows in the database. Before the caller is woken, the writer
 * empties the log (writer.c) and zeroes what moving rows has left in pages (scrub.c).
 *
 * Cost: an index look for each that needs something, and the removal of rows.
 */
#include "store/mesh.h"
#include "store/prepared.h"
#include "store/cohort_list.h"
#include "store/internal.h"
#include "store/erase.h"
#include "store/labels.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LOOSE(kind) \
    "DELETE FROM cohort_member WHERE " kind " = ? AND +list IN (SELECT list FROM loose_list)"

/* A kind of content. A new one is a row here, a row of owned, and a trigger that removes the owned
   rows of what is removed. */
static const struct kind {
    const char *name;
    const char *blobs; /* hashes of its content, each of which may be another's too */
    const char
        *inherit; /* the content's row takes the description of ?2's row, its first owner now */
    const char *remove;
    const char *loose; /* takes it out of lists that have no cohort; NULL: none names it */
} kinds[] = {
    /* In this order: a model holds its mean surface in place. */
    {"model", "SELECT content FROM model_array WHERE model = ?",
     "UPDATE model SET record = (SELECT record FROM owned WHERE id = ?1 AND owner = ?2) "
     "WHERE id = ?1",
     "DELETE FROM model WHERE id = ?", NULL},
    {"surface",
     "SELECT coefficients FROM surface WHERE id = ?1 UNION ALL "
     "SELECT content FROM surface_maps WHERE surface = ?1",
     "UPDATE surface SET (name, record) = "
     "(SELECT name, record FROM owned WHERE id = ?1 AND owner = ?2) WHERE id = ?1",
     "DELETE FROM surface WHERE id = ?", LOOSE("surface")},
    {"mesh", "SELECT content FROM mesh WHERE id = ?",
     "UPDATE mesh SET (name, source) = "
     "(SELECT name, record FROM owned WHERE id = ?1 AND owner = ?2) WHERE id = ?1",
     "DELETE FROM mesh WHERE id = ?", LOOSE("mesh")},
    {"volume", "SELECT content FROM volume WHERE id = ?",
     "UPDATE volume SET name = (SELECT name FROM owned WHERE id = ?1 AND owner = ?2) WHERE id = ?1",
     "DELETE FROM volume WHERE id = ?", NULL},
};

#define N_KINDS (sizeof kinds / sizeof kinds[0])
#define BLOBS_MAX 8 /* of one thing */

/* ---- What goes ------------------------------------------------------------------------------- */

/* What another has who does not have the content itself, where only one does. */
#define FOREIGN(other)                                                                        \
    "(NOT EXISTS (SELECT 1 FROM owned WHERE owned.owner = " other " AND owned.id = goes.id) " \
    "AND NOT EXISTS (SELECT 1 FROM owned WHERE owned.id = goes.id AND "                       \
    "owned.owner <> goes.owner))"
#define OF(other) "(" other " = goes.owner OR " FOREIGN(other) ")"
/* ?1 and ?2: owner and id to begin with. Rows: owner, kind, id, whether a job that has not ended,
   whether it goes along without being asked about. */
static const char closure[] =
    "WITH RECURSIVE goes (owner, id) AS (VALUES (?1, ?2) UNION SELECT need.owner, needing "
    "FROM goes JOIN need ON need.id = goes.id AND along = 0 WHERE " OF(
        "need.owner") ") "
                      "SELECT goes.owner, kind, goes.id, 0, 0 FROM goes "
                      "JOIN owned ON owned.owner = goes.owner AND owned.id = goes.id UNION ALL "
                      "SELECT goes.owner, 'job', goes.id, status IN ('accepted', 'running'), 0 "
                      "FROM goes "
                      "JOIN job ON job.id = goes.id UNION ALL "
                      "SELECT * FROM (SELECT cohort.owner, 'cohort', cohort.name, 0, 0 FROM goes "
                      "JOIN cohort_member AS member ON mesh = goes.id JOIN cohort ON cohort.list = "
                      "member.list WHERE " OF(
                          "cohort.owner") " UNION "
                                          "SELECT cohort.owner, 'cohort', cohort.name, 0, 0 FROM "
                                          "goes "
                                          "JOIN cohort_member AS member ON surface = goes.id JOIN "
                                          "cohort ON cohort.list = member.list WHERE " OF(
                                              "cohort.owner") ") UNION ALL "
                                                              "SELECT DISTINCT need.owner, 'job', "
                                                              "needing, 0, 1 FROM goes "
                                                              "JOIN need ON need.id = goes.id AND "
                                                              "along = 1 JOIN job ON job.id = "
                                                              "needing WHERE "
                                                              "needing NOT IN (SELECT id FROM "
                                                              "goes) AND " OF("need.owner");

struct going {
    char owner[STORE_OWNER_MAX];
    struct store_thing thing;
};

struct plan {
    struct going *list;
    size_t count, size;
};

static int plan_row(struct plan *plan, sqlite3_stmt *row, const char *owner,
                    struct store_erasure *erasure)
{
    struct going *going;
    bool along = sqlite3_column_int(row, 4) != 0;

    if (plan->count == plan->size) {
        size_t size = plan->size ? 2 * plan->size : 64;
        struct going *list = realloc(plan->list, size * sizeof *list);

        if (!list) {
            return STORE_NOMEM;
        }
        plan->list = list;
        plan->size = size;
    }
    going = &plan->list[plan->count++];
    store_column_id(row, 0, going->owner, sizeof going->owner);
    store_column_id(row, 1, going->thing.kind, sizeof going->thing.kind);
    store_column_id(row, 2, going->thing.id, sizeof going->thing.id);
    if (along || strcmp(going->thing.id, erasure->id) == 0) {
        return STORE_OK;
    }
    if (strcmp(going->owner, owner) != 0) {
        erasure->foreign++;
    } else if (erasure->needing - erasure->foreign < STORE_ERASE_LISTED) {
        erasure->needed_by[erasure->needing - erasure->foreign] = going->thing;
    }
    erasure->needing++;
    if (sqlite3_column_int(row, 3)) {
        if (erasure->n_unended < STORE_ERASE_RUNNING) {
            (void)snprintf(erasure->unended[erasure->n_unended], STORE_ID_MAX, "%.63s",
                           going->thing.id);
        }
        erasure->n_unended++;
    }
    return STORE_OK;
}

/* All that goes, the thing itself first. STORE_NOT_FOUND: it is not the owner's. */
static int make_plan(sqlite3 *db, struct plan *plan, struct store_erasure *erasure)
{
    const char *owner = erasure->owner ? erasure->owner : "";
    sqlite3_stmt *rows = NULL;
    int status = store_prepare(db, &rows, closure, "tt", owner, erasure->id);

    erasure->needing = erasure->foreign = erasure->n_unended = 0;
    memset(erasure->erased, 0, sizeof erasure->erased);
    while (status == STORE_OK && (status = store_step(db, rows)) == STORE_OK) {
        status = plan_row(plan, rows, owner, erasure);
    }
    sqlite3_finalize(rows);
    if (status == STORE_NOT_FOUND) {
        status = plan->count > 0 && strcmp(plan->list[0].thing.id, erasure->id) == 0
                     ? STORE_OK
                     : STORE_NOT_FOUND;
    }
    return status;
}

/* ---- How it goes ----------------------------------------------------------------------------- */

/* The other owner who describes the content from now on; STORE_NOT_FOUND: there is none. */
static int next_owner(sqlite3 *db, const char *id, char owner[STORE_OWNER_MAX])
{
    return store_text(db, owner, STORE_OWNER_MAX,
                      "SELECT owner FROM owned WHERE id = ? ORDER BY first DESC, created_ms, owner "
                      "LIMIT 1",
                      id);
}

static int inherit(sqlite3 *db, const struct kind *kind, const char *id, const char *heir)
{
    sqlite3_stmt *row = NULL;
    int status = store_prepare(db, &row, "SELECT 1 FROM owned WHERE id = ? AND first = 1", "t", id);

    if (status == STORE_OK) {
        status = store_step(db, row);
    }
    sqlite3_finalize(row);
    if (status != STORE_NOT_FOUND) {
        return status; /* the first one is still there */
    }
    status = store_execute(db, NULL, kind->inherit, "tt", id, heir);
    return status == STORE_OK
               ? store_execute(db, NULL, "UPDATE owned SET first = 1 WHERE id = ? AND owner = ?",
                               "tt", id, heir)
               : status;
}

/* The hashes of its content, before the rows go that name them. */
static int find_blobs(sqlite3 *db, const char *sql, const char *id, char hashes[BLOBS_MAX][65],
                      size_t *count)
{
    sqlite3_stmt *rows = NULL;
    int status = store_prepare(db, &rows, sql, "t", id);

    *count = 0;
    while (status == STORE_OK && (status = store_step(db, rows)) == STORE_OK) {
        if (*count == BLOBS_MAX) {
            status = STORE_CORRUPT;
            break;
        }
        store_column_id(rows, 0, hashes[(*count)++], 65);
    }
    sqlite3_finalize(rows);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* Nobody has it any more. */
static int remove_content(sqlite3 *db, const struct kind *kind, const char *id,
                          struct store_write *write)
{
    char hashes[BLOBS_MAX][65];
    size_t count;
    int status = find_blobs(db, kind->blobs, id, hashes, &count);

    if (status == STORE_OK && kind->loose) {
        status = store_execute(db, NULL, kind->loose, "t", id);
    }
    if (status == STORE_OK) {
        status = store_execute(db, NULL, kind->remove, "t", id);
    }
    for (size_t i = 0; i < count && status == STORE_OK; i++) {
        bool dropped = false;

        status = store_blob_release(db, hashes[i], &dropped);
        if (status == STORE_OK && dropped) {
            status = store_write_drop(write, hashes[i]);
        }
    }
    return status;
}

static int erase_content(sqlite3 *db, const struct kind *kind, const struct going *going,
                         struct store_write *write)
{
    const char *id = going->thing.id;
    char heir[STORE_OWNER_MAX];
    int status = store_execute(db, NULL, "DELETE FROM owned WHERE owner = ? AND id = ?", "tt",
                               going->owner, id);

    if (status == STORE_OK) {
        status = next_owner(db, id, heir);
    }
    if (status == STORE_NOT_FOUND) {
        return remove_content(db, kind, id, write);
    }
    return status == STORE_OK ? inherit(db, kind, id, heir) : status;
}

static void count_erased(struct store_erasure *erasure, const char *kind)
{
    size_t i = 0;

    while (erasure->erased[i].kind[0] && strcmp(erasure->erased[i].kind, kind) != 0) {
        i++;
    }
    (void)snprintf(erasure->erased[i].kind, sizeof erasure->erased[i].kind, "%s", kind);
    erasure->erased[i].count++;
}

/* What names others goes before them. */
static int erase_all(sqlite3 *db, const struct plan *plan, struct store_erasure *erasure,
                     struct store_write *write)
{
    int status = STORE_OK;

    for (size_t step = 0; step < N_KINDS + 1; step++) {
        for (size_t i = 0; i < plan->count && status == STORE_OK; i++) {
            const struct going *going = &plan->list[i];
            const char *kind = going->thing.kind;

            if (step > 0 && strcmp(kind, kinds[step - 1].name) == 0) {
                status = erase_content(db, &kinds[step - 1], going, write);
            } else if (step == 0 && strcmp(kind, "job") == 0) {
                status = store_job_remove(db, going->thing.id, write);
            } else if (step == 0 && strcmp(kind, "cohort") == 0) {
                status = store_execute(db, NULL, "DELETE FROM cohort WHERE owner = ? AND name = ?",
                                       "tt", going->owner, going->thing.id);
            } else {
                continue;
            }
            count_erased(erasure, kind);
        }
    }
    return status;
}

static int run_erase(struct store *store, sqlite3 *db, struct store_write *write)
{
    struct store_erasure *erasure = write->argument;
    struct plan plan = {.list = NULL};
    int status =
        erasure->seen ? store_labels_check(db, erasure->owner, erasure->id, erasure->seen) : 0;

    erasure->relabelled = status == STORE_CONFLICT;
    if (status != STORE_OK) {
        return status;
    }
    status = make_plan(db, &plan, erasure);
    if (status == STORE_OK &&
        (erasure->n_unended > 0 || (erasure->needing > 0 && !erasure->cascade) ||
         (erasure->foreign > 0 && !erasure->all))) {
        status = STORE_CONFLICT;
    }
    if (status == STORE_OK) {
        status = erase_all(db, &plan, erasure, write);
        write->erases = true;
        store->erasures++;
    }
    free(plan.list);
    return status;
}

int store_erase(struct store *store, struct store_erasure *erasure)
{
    int status = store_write_freeing(store, run_erase, erasure);
    size_t removed = 0;

    if (status == STORE_OK && strncmp(erasure->id, "mesh-", 5) == 0) {
        status = store_mesh_drop_derived(store, erasure->id);
    }
    if (status == STORE_OK && erasure->cascade) {
        store_lists_sweep(store);
        status = store_prepared_sweep(store, &removed);
    }
    return status;
}

int store_owner_names(struct store *store, const char *id, char (*owners)[STORE_OWNER_MAX],
                      size_t most, size_t *count)
{
    return store_owners_of(store, "SELECT owner FROM owned WHERE id = ? ORDER BY owner", id, owners,
                           most, count);
}
