/*
 * scrub.c - zeroes the space in the database's pages that no row uses.
 *
 * secure_delete zeroes rows where they lie when they are deleted. But when SQLite moves rows
 * between the pages of a table (it does whenever one is full), it leaves the old bytes in the gap
 * between the list of cells and the cells (rebuildPage of its btree.c): a row that was moved and
 * deleted afterwards can so be read in the file still, as tests/server/store/test_erase.c finds
 * without this.
 *
 * The bytes of a gap mean nothing, so they are overwritten in the file itself, through SQLite's own
 * file, when the log has been emptied (writer.c): readers never look at them, a crash leaves less
 * of them, and no lock is taken or lost. The writer's cache, which has the pages as they were, is
 * given back before.
 *
 * Layout (SQLite's file format, 1.6): a page of a table or index begins with its kind, 2, 5, 10 or
 * 13; page 1 does so after 100 bytes. At 3 the number of cells, at 5 where the cells begin, 0 for
 * 65536; the list of cells follows after 8 bytes, 12 where the kind is 2 or 5. All other pages
 * begin with a page number, which is below 2^25 up to 128 GiB; beyond that nothing is done.
 *
 * Cost: reading the database once: 0.07 s of a processor where it has 0.5 GiB and is in memory.
 */
#include "store/internal.h"

#include <stdlib.h>
#include <string.h>

#define CHUNK ((int64_t)1 << 20) /* a multiple of all page sizes */
#define PAGES_MAX ((int64_t)1 << 25)

static size_t number_at(const unsigned char *bytes)
{
    return ((size_t)bytes[0] << 8) | bytes[1];
}

/* The gap of a page: from *start on, so many bytes; 0: it has none. */
static size_t gap_of(const unsigned char *page, size_t size, bool first, size_t *start)
{
    size_t header = first ? 100 : 0, content;
    unsigned char kind = page[header];
    bool inner = kind == 2 || kind == 5;

    if (!inner && kind != 10 && kind != 13) {
        return 0;
    }
    content = number_at(page + header + 5);
    content = content ? content : 65536;
    *start = header + (inner ? 12 : 8) + 2 * number_at(page + header + 3);
    return content <= size && *start < content ? content - *start : 0;
}

static bool is_zero(const unsigned char *bytes, size_t size)
{
    return size == 0 || (bytes[0] == 0 && memcmp(bytes, bytes + 1, size - 1) == 0);
}

/* The pages of one chunk of the file. */
static int scrub_chunk(sqlite3_file *file, unsigned char *bytes, int64_t offset, int64_t length,
                       int64_t page_size)
{
    int rc = file->pMethods->xRead(file, bytes, (int)length, offset);

    for (int64_t at = 0; rc == SQLITE_OK && at < length; at += page_size) {
        size_t start = 0, size = gap_of(bytes + at, (size_t)page_size, offset + at == 0, &start);

        if (size > 0 && !is_zero(bytes + at + start, size)) {
            memset(bytes + at + start, 0, size);
            rc = file->pMethods->xWrite(file, bytes + at + start, (int)size,
                                        offset + at + (int64_t)start);
        }
    }
    return rc;
}

int store_scrub(sqlite3 *db)
{
    sqlite3_file *file = NULL;
    unsigned char *bytes = malloc((size_t)CHUNK);
    sqlite3_int64 length = 0;
    int64_t page_size = 0;
    int rc, status = bytes ? store_scalar(db, &page_size, "PRAGMA page_size") : STORE_NOMEM;

    if (status == STORE_OK) {
        (void)sqlite3_db_release_memory(db);
        rc = sqlite3_file_control(db, "main", SQLITE_FCNTL_FILE_POINTER, &file);
        rc = rc == SQLITE_OK ? file->pMethods->xFileSize(file, &length) : rc;
        if (length / page_size >= PAGES_MAX) {
            length = 0;
        }
        for (int64_t at = 0; rc == SQLITE_OK && at < length; at += CHUNK) {
            rc = scrub_chunk(file, bytes, at, length - at < CHUNK ? length - at : CHUNK, page_size);
        }
        rc = rc == SQLITE_OK ? file->pMethods->xSync(file, SQLITE_SYNC_FULL) : rc;
        status = rc == SQLITE_OK ? STORE_OK : STORE_IO;
    }
    free(bytes);
    return status;
}
