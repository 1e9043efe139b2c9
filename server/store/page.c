/*
 * page.c - one page of a table, newest first: the walk that all lists share.
 *
 * The order is that of (created_ms, key), both falling; a page starts after the row that the page
 * before ended with, so that rows added meanwhile neither repeat nor hide others. An index on both
 * gives the order without sorting; newer rows than the page's are passed over.
 */
#include "store/internal.h"

#include "store/page.h"

int store_page_walk(struct store *store, const struct store_page *page, const char *sql,
                    store_page_row *row, void *argument)
{
    struct store_reader *reader = NULL;
    sqlite3_stmt *rows = NULL;
    int status = store_reader_take(store, &reader);

    if (status != STORE_OK) {
        return status;
    }
    status = store_prepare(reader->db, &rows, sql, "tiittt", page->after_id ? page->after_id : "",
                           page->after_ms, (int64_t)page->limit, page->process, page->status,
                           page->owner);
    for (bool more = true; status == STORE_OK && more;) {
        status = store_step(reader->db, rows);
        if (status == STORE_OK) {
            status = row(argument, rows, &more);
        }
    }
    sqlite3_finalize(rows);
    store_reader_return(store, reader);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}
