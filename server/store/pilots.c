/*
 * pilots.c - the arrays of workers that Slurm was asked for (pilots.h).
 */
#include "store/pilots.h"

#include "store/internal.h"

#include <stdlib.h>
#include <string.h>

static const char *const statuses[] = {"intended", "submitted", "ending"};

static int run_pilots_put(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct store_pilots *row = write->argument;

    (void)store;
    return store_execute(db, NULL,
                         "INSERT OR REPLACE INTO pilots (name, job, number, status, try, size, "
                         "memory, token, vanished) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                         "ttttiiiti", row->name, row->job, row->number, statuses[row->status],
                         row->attempt, row->size, row->memory, row->token, (int64_t)row->vanished);
}

int store_pilots_put(struct store *store, const struct store_pilots *row)
{
    struct store_pilots copy = *row;

    return store_write(store, run_pilots_put, &copy);
}

static int run_pilots_drop(struct store *store, sqlite3 *db, struct store_write *write)
{
    const char *const *name = write->argument;

    (void)store;
    return store_execute(db, NULL, "DELETE FROM pilots WHERE name = ?", "t", *name);
}

int store_pilots_drop(struct store *store, const char *name)
{
    return store_write(store, run_pilots_drop, &name);
}

static void read_pilots(sqlite3_stmt *rows, struct store_pilots *row)
{
    char status[16];

    *row = (struct store_pilots){.status = STORE_PILOTS_INTENDED};
    store_column_id(rows, 0, row->name, sizeof row->name);
    store_column_id(rows, 1, row->job, sizeof row->job);
    store_column_id(rows, 2, row->number, sizeof row->number);
    store_column_id(rows, 3, status, sizeof status);
    for (size_t i = 0; i < sizeof statuses / sizeof statuses[0]; i++) {
        if (strcmp(status, statuses[i]) == 0) {
            row->status = (enum store_pilots_status)i;
        }
    }
    row->attempt = sqlite3_column_int64(rows, 4);
    row->size = sqlite3_column_int64(rows, 5);
    row->memory = sqlite3_column_int64(rows, 6);
    store_column_id(rows, 7, row->token, sizeof row->token);
    row->vanished = sqlite3_column_int64(rows, 8) != 0;
}

int store_pilots_list(struct store *store, struct store_pilots **list, size_t *n)
{
    struct store_query query;
    int status =
        store_query_open(&query, store,
                         "SELECT name, job, number, status, try, size, memory, token, vanished "
                         "FROM pilots ORDER BY name",
                         "");

    *list = NULL;
    *n = 0;
    while (status == STORE_OK && (status = store_query_next(&query)) == STORE_OK) {
        struct store_pilots *grown = realloc(*list, (*n + 1) * sizeof **list);

        if (!grown) {
            status = STORE_NOMEM;
            break;
        }
        *list = grown;
        read_pilots(query.row, &grown[(*n)++]);
    }
    store_query_close(&query);
    if (status == STORE_NOT_FOUND) {
        return STORE_OK;
    }
    free(*list);
    *list = NULL;
    *n = 0;
    return status;
}

int store_pilots_wanted(struct store *store, const char *job, bool *wanted)
{
    struct store_reader *reader = NULL;
    char status[16] = "";
    int result = store_reader_take(store, &reader);

    *wanted = false;
    if (result == STORE_OK) {
        result = store_text(reader->db, status, sizeof status,
                            "SELECT status FROM job WHERE id = ?", job);
        store_reader_return(store, reader);
        *wanted = strcmp(status, "accepted") == 0 || strcmp(status, "running") == 0;
    }
    return result == STORE_NOT_FOUND ? STORE_OK : result;
}
