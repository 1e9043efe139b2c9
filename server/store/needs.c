/*
 * needs.c - what needs what: rows of `need`, which say of which meshes, surfaces, models and jobs
 * a thing was made or was given (migrations/0012_needs.sql). What is needed does not go unless what
 * needs it goes too (erase.c).
 *
 * Texts are opaque to the store, but ids can be told from all else in them: a JSON string that is
 * nothing but a kind, a hyphen and 32 hexadecimal digits, or "job-" and a UUID. A text that says
 * the same of something that is not there, such as a label, is passed over.
 */
#include "store/internal.h"

#include <stdlib.h>
#include <string.h>

#define KIND_MAX 8 /* letters */
#define DIGITS 32
#define UUID 36

/* Characters of the id that begins here and ends with a quotation mark; 0: none does. */
static size_t id_length(const char *text)
{
    size_t kind = strspn(text, "abcdefghijklmnopqrstuvwxyz"), length;

    if (kind == 0 || kind > KIND_MAX || text[kind] != '-') {
        return 0;
    }
    length = strspn(text + kind + 1, "0123456789abcdef-");
    if (length != (strncmp(text, "job-", 4) == 0 ? UUID : DIGITS)) {
        return 0;
    }
    length += kind + 1;
    return text[length] == '"' && length < STORE_ID_MAX ? length : 0;
}

static bool add(struct store_ids *ids, const char *id, size_t length)
{
    if (ids->count == ids->size) {
        size_t size = ids->size ? 2 * ids->size : 16;
        char(*list)[STORE_ID_MAX] = realloc(ids->list, size * sizeof *list);

        if (!list) {
            return false;
        }
        ids->list = list;
        ids->size = size;
    }
    memcpy(ids->list[ids->count], id, length);
    ids->list[ids->count++][length] = '\0';
    return true;
}

void store_ids_clear(struct store_ids *ids)
{
    free(ids->list);
    *ids = (struct store_ids){0};
}

int store_ids_find(struct store_ids *ids, const char *text)
{
    for (const char *at = text ? strchr(text, '"') : NULL; at; at = strchr(at, '"')) {
        size_t length = id_length(++at);

        if (length > 0 && !add(ids, at, length)) {
            store_ids_clear(ids);
            return STORE_NOMEM;
        }
        at += length;
    }
    return STORE_OK;
}

int store_need_add(sqlite3 *db, const char *owner, const char *needing, const char *id, bool along)
{
    return store_execute(db, NULL,
                         "INSERT INTO need (owner, needing, id, along) SELECT ?1, ?2, ?3, ?4 "
                         "WHERE ?3 <> ?2 AND (EXISTS (SELECT 1 FROM owned WHERE id = ?3) OR "
                         "EXISTS (SELECT 1 FROM job WHERE id = ?3)) ON CONFLICT DO NOTHING",
                         "ttti", owner, needing, id, (int64_t)along);
}

int store_needs_add(sqlite3 *db, const char *owner, const char *needing,
                    const struct store_ids *ids, bool along)
{
    int status = STORE_OK;

    for (size_t i = 0; i < ids->count && status == STORE_OK; i++) {
        status = store_need_add(db, owner, needing, ids->list[i], along);
    }
    return status;
}
