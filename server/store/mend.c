/*
 * mend.c - content that comes again replaces what the store holds of it, where that is damaged.
 *
 * Ids are made of content: whoever sends the same bytes again sends what was lost. The stored copy
 * is read and hashed; only where it is missing, changed or unreadable are the bytes written, in the
 * way of all blobs (blob.c), under the row that is there.
 */
#include "store/internal.h"

#include "store/digest.h"

#include <stdlib.h>

static int run_mend(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct store_content *content = write->argument;
    bool file = content->temporary[0] != '\0';
    int status = store_blob_keep(store, db, content);

    if (status == STORE_OK && file) {
        status = store_execute(db, NULL, "UPDATE blob SET size = ?, bytes = NULL WHERE hash = ?",
                               "it", (int64_t)content->size, content->hash);
    } else if (status == STORE_OK) {
        status =
            store_execute(db, NULL, "UPDATE blob SET size = ?, bytes = ? WHERE hash = ?", "ibt",
                          (int64_t)content->size, content->bytes, content->size, content->hash);
    }
    return status;
}

/* Whether the stored copy is what it should be. */
static int look(struct store *store, const char *hash)
{
    struct store_reader *reader = NULL;
    unsigned char *bytes = NULL;
    size_t size;
    int status = store_reader_take(store, &reader);

    if (status == STORE_OK) {
        status = store_blob_read(store, reader->db, hash, &bytes, &size);
        store_reader_return(store, reader);
        free(bytes);
    }
    return status;
}

int store_blob_mend(struct store *store, const void *bytes, size_t size)
{
    struct store_content staged;
    char hash[65];
    int status;

    store_sha256_hex(hash, bytes, size);
    status = look(store, hash);
    if (status != STORE_CORRUPT && status != STORE_IO) {
        return status;
    }
    status = store_blob_stage(store, bytes, size, &staged);
    if (status == STORE_OK) {
        status = store_write(store, run_mend, &staged);
        store_blob_unstage(store, &staged);
    }
    return status;
}
