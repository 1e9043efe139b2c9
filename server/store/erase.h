/*
 * erase.h - removing meshes, surfaces and models, with what needs them.
 */
#ifndef SRNFD_STORE_ERASE_H
#define SRNFD_STORE_ERASE_H

#include "store/store.h"

struct store_labels; /* store/labels.h */

#define STORE_ERASE_LISTED 20  /* of what needs it */
#define STORE_ERASE_RUNNING 64 /* jobs to be canceled at a time */
#define STORE_ERASE_KINDS 8

/* One thing by its kind ("mesh", "surface", "model", "job", "cohort", ..) and its id or name. */
struct store_thing {
    char kind[12];
    char id[STORE_COHORT_NAME_MAX];
};

struct store_erasure {
    const char *owner, *id;          /* whose, and what */
    bool cascade;                    /* what needs it goes too */
    bool all;                        /* also what others have who do not have it themselves */
    const struct store_labels *seen; /* where not NULL: name and tags that it must have */

    bool relabelled;
    /* What needs it, directly or through others: the first ones, nearest first, and all. */
    struct store_thing needed_by[STORE_ERASE_LISTED];
    size_t needing;
    size_t foreign; /* of them, what others have: a cascade without `all` is refused */
    /* Of them, jobs that wait or run, the first ones and all: they are to be canceled, and the
       erasure asked for again when they have ended. */
    char unended[STORE_ERASE_RUNNING][STORE_ID_MAX];
    size_t n_unended;
    /* What has gone, by kind. */
    struct {
        char kind[12];
        size_t count;
    } erased[STORE_ERASE_KINDS];
};

/*
 * Takes the mesh, surface or model from its owner, in one transaction with what needs it and with
 * the jobs whose results name what goes. Content that nobody else has goes for good: its row, its
 * bytes, what was derived from it. When it returns, neither the database nor its log nor a file
 * below blobs/ has it, unless another process reads the database for long, or a backup is being
 * made; then it goes as soon as that ends, at the next sweep at the latest.
 *
 * STORE_NOT_FOUND: the owner does not have it. STORE_CONFLICT: something needs it, and the erasure
 * says what; or, if it says `relabelled`, its name or tags are not those that were seen.
 */
int store_erase(struct store *store, struct store_erasure *erasure);

/* Who has the content of this id: the first `most` of them by name, and how many there are. */
int store_owner_names(struct store *store, const char *id, char (*owners)[STORE_OWNER_MAX],
                      size_t most, size_t *count);

#endif
