/*
 * page.c - one page of a list: the statement for its filters and its order, and the walk that all
 * lists share.
 *
 * The order is that of (key, id), both rising or both falling; a page starts after the row that the
 * page before ended with, so that rows added meanwhile neither repeat nor hide others. Keys and ids
 * of the page come first, from an index that has all that is filtered and sorted by
 * (migrations/0016_lists.sql), and then its rows. By time the index has the order; by another key
 * SQLite keeps the first rows as it walks all. The total is counted in the same index.
 *
 * No text of a client becomes part of a statement: they are bound by name.
 */
#include "store/internal.h"

#include "store/page.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct sql {
    char *text;
    size_t used;
};

static void add(struct sql *sql, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void add(struct sql *sql, const char *format, ...)
{
    va_list arguments;
    int length;

    va_start(arguments, format);
    length = vsnprintf(sql->text + sql->used, STORE_PAGE_SQL_MAX - sql->used, format, arguments);
    va_end(arguments);
    assert(length >= 0 && (size_t)length < STORE_PAGE_SQL_MAX - sql->used);
    sql->used += (size_t)length;
}

/* A condition, where it is asked for; what has nothing to be filtered by passes none. */
static void add_filter(struct sql *sql, bool asked, const char *left, const char *right)
{
    if (asked) {
        add(sql, " AND %s%s", left ? left : "0", left ? right : "");
    }
}

/* One value, or one of several: + keeps the index by status, which has not the order, out of it. */
static void add_choice(struct sql *sql, const char *column, const char *name, const char *value)
{
    if (!value || !strchr(value, ',')) {
        char equal[24];

        (void)snprintf(equal, sizeof equal, " = :%s", name);
        add_filter(sql, value, column, equal);
        return;
    }
    add(sql,
        " AND +%s IN (SELECT value FROM json_each('[\"' || replace(:%s, ',', '\",\"') || '\"]'))",
        column ? column : "NULL", name);
}

static void add_filters(struct sql *sql, const struct store_listing *listing,
                        const struct store_page *page)
{
    add(sql, " FROM %s WHERE %s", listing->rows, page->owner ? listing->one : listing->all);
    add_filter(sql, page->since_ms > 0, "listed.created_ms", " >= :since");
    add_filter(sql, page->until_ms > 0, "listed.created_ms", " < :until");
    add_choice(sql, listing->process, "process", page->process);
    add_choice(sql, listing->status, "status", page->status);
    add_filter(sql, page->by_duration, listing->duration, " BETWEEN :shortest AND :longest");
    add_filter(sql, page->nothing, "listed.created_ms", " < 0");
    add_filter(sql, page->cohort, listing->cohort, "");
    add_filter(sql, page->mesh, listing->mesh, "");
    add_filter(sql, page->tag, listing->tag, "");
    if (page->name) {
        add(sql, " AND instr(folded(%s), folded(:name)) > 0", listing->name);
    }
}

/* What the list is sorted by, and the parameter that a page starts after. */
static const char *key_of(const struct store_listing *listing, const struct store_page *page,
                          char key[64], const char **after)
{
    const char *column = page->key == STORE_PAGE_CREATED   ? "listed.created_ms"
                         : page->key == STORE_PAGE_NAME    ? listing->name
                         : page->key == STORE_PAGE_PROCESS ? listing->process
                                                           : listing->status;
    bool folds = page->key == STORE_PAGE_NAME;

    *after = page->key == STORE_PAGE_CREATED ? ":after_ms"
             : folds                         ? "folded(:after_text)"
                                             : ":after_text";
    /* + keeps the index by status, which lacks what else is asked for, out of it */
    (void)snprintf(key, 64,
                   folds                             ? "folded(%s)"
                   : page->key == STORE_PAGE_CREATED ? "%s"
                                                     : "+%s",
                   column ? column : "''");
    return key;
}

void store_page_sql(const struct store_listing *listing, const struct store_page *page,
                    char text[STORE_PAGE_SQL_MAX])
{
    const char *direction = page->rising ? "" : " DESC", *after;
    struct sql sql = {.text = text};
    char key[64];

    (void)key_of(listing, page, key, &after);
    add(&sql, "SELECT %s FROM (SELECT %s, %s AS page_key, %s AS page_id", listing->columns,
        listing->found, key, listing->id);
    add_filters(&sql, listing, page);
    if (page->after_id && page->after_id[0]) {
        add(&sql, " AND (%s, %s) %c (%s, :after_id)", key, listing->id, page->rising ? '>' : '<',
            after);
    }
    add(&sql, " ORDER BY %s%s, %s%s LIMIT :limit) AS page %s", key, direction, listing->id,
        direction, listing->join);
    add(&sql, " ORDER BY page_key%s, page_id%s", direction, direction);
}

void store_page_count_sql(const struct store_listing *listing, const struct store_page *page,
                          char text[STORE_PAGE_SQL_MAX])
{
    struct sql sql = {.text = text};

    add(&sql, "SELECT count(*)");
    add_filters(&sql, listing, page);
}

/* Those of the parameters that the statement has. */
static int bind(sqlite3_stmt *rows, const struct store_page *page)
{
    const struct {
        const char *name, *text;
        int64_t number;
        bool whole;
    } parameters[] = {
        {":owner", page->owner, 0, false},
        {":name", page->name, 0, false},
        {":tag", page->tag, 0, false},
        {":process", page->process, 0, false},
        {":status", page->status, 0, false},
        {":cohort", page->cohort, 0, false},
        {":mesh", page->mesh, 0, false},
        {":after_id", page->after_id, 0, false},
        {":after_text", page->after_text, 0, false},
        {":after_ms", NULL, page->after_ms, true},
        {":since", NULL, page->since_ms, true},
        {":until", NULL, page->until_ms, true},
        {":now", NULL, page->now_ms, true},
        {":shortest", NULL, page->shortest_ms, true},
        {":longest", NULL, page->longest_ms, true},
        {":limit", NULL, (int64_t)page->limit, true},
    };
    int rc = SQLITE_OK;

    for (size_t i = 0; i < sizeof parameters / sizeof parameters[0] && rc == SQLITE_OK; i++) {
        int place = sqlite3_bind_parameter_index(rows, parameters[i].name);

        if (place > 0 && !parameters[i].whole) { /* a null pointer binds NULL */
            rc = sqlite3_bind_text(rows, place, parameters[i].text, -1, SQLITE_STATIC);
        } else if (place > 0) {
            rc = sqlite3_bind_int64(rows, place, parameters[i].number);
        }
    }
    return rc;
}

static int open_rows(sqlite3 *db, sqlite3_stmt **rows, const char *sql,
                     const struct store_page *page)
{
    int rc = sqlite3_prepare_v2(db, sql, -1, rows, NULL);

    return store_map(db, rc == SQLITE_OK ? bind(*rows, page) : rc);
}

static int read_total(sqlite3 *db, const struct store_listing *listing,
                      const struct store_page *page)
{
    char sql[STORE_PAGE_SQL_MAX];
    sqlite3_stmt *rows = NULL;
    int status;

    store_page_count_sql(listing, page, sql);
    status = open_rows(db, &rows, sql, page);
    if (status == STORE_OK) {
        status = store_step(db, rows);
    }
    if (status == STORE_OK) {
        *page->total = sqlite3_column_int64(rows, 0);
    }
    sqlite3_finalize(rows);
    return status;
}

static int read_rows(sqlite3 *db, const struct store_listing *listing,
                     const struct store_page *page, store_page_row *row, void *argument)
{
    char sql[STORE_PAGE_SQL_MAX];
    sqlite3_stmt *rows = NULL;
    int status;

    store_page_sql(listing, page, sql);
    status = open_rows(db, &rows, sql, page);
    for (bool more = true; status == STORE_OK && more;) {
        status = store_step(db, rows);
        if (status == STORE_OK) {
            status = row(argument, rows, &more);
        }
    }
    sqlite3_finalize(rows);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

int store_page_walk(struct store *store, const struct store_listing *listing,
                    const struct store_page *page, store_page_row *row, void *argument)
{
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    if (status != STORE_OK) {
        return status;
    }
    /* One snapshot for the total and the rows. */
    status = store_execute(reader->db, NULL, "BEGIN", "");
    if (status == STORE_OK) {
        if (page->total) {
            status = read_total(reader->db, listing, page);
        }
        if (status == STORE_OK) {
            status = read_rows(reader->db, listing, page, row, argument);
        }
        (void)store_execute(reader->db, NULL, "COMMIT", "");
    }
    store_reader_return(store, reader);
    return status;
}
