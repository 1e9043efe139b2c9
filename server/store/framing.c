/*
 * framing.c - how the results of a job are framed (framing.h): a row each of those that are not
 * framed as they are stored.
 */
#include "store/framing.h"

#include "store/holdings.h"
#include "store/internal.h"

struct framing {
    const char *owner, *job, *text;
};

static int run_set(struct store *store, sqlite3 *db, struct store_write *write)
{
    const struct framing *framing = write->argument;
    int status = store_execute(db, NULL, "DELETE FROM framing WHERE job = ?", "t", framing->job);

    (void)store;
    if (status == STORE_OK && framing->text[0]) {
        status = store_execute(db, NULL,
                               "INSERT INTO framing (job, owner, text) SELECT id, ?2, ?3 FROM job "
                               "WHERE id = ?1",
                               "ttt", framing->job, framing->owner, framing->text);
    }
    return status == STORE_OK ? store_owner_check(db, framing->owner, 0) : status;
}

int store_framing_set(struct store *store, const char *owner, const char *job, const char *text)
{
    struct framing framing = {.owner = owner ? owner : "", .job = job, .text = text};

    return store_write(store, run_set, &framing);
}

int store_framing_get(struct store *store, const char *job, char text[STORE_FRAMING_MAX])
{
    struct store_reader *reader = NULL;
    int status = store_reader_take(store, &reader);

    text[0] = '\0';
    if (status != STORE_OK) {
        return status;
    }
    status = store_text(reader->db, text, STORE_FRAMING_MAX,
                        "SELECT text FROM framing WHERE job = ?", job);
    store_reader_return(store, reader);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}
