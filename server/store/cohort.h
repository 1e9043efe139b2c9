/*
 * cohort.h - cohorts in the store.
 */
#ifndef SRNFD_STORE_COHORT_H
#define SRNFD_STORE_COHORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "owner.h"
#include "store_status.h"

struct store;
struct store_page; /* store/page.h */

struct store_cohort {
    char name[STORE_COHORT_NAME_MAX];
    char owner[STORE_OWNER_MAX]; /* set by get and in lists */
    char *record;                /* JSON text, opaque here; the same content is the same text */
    char digest[65];             /* SHA-256 of the record: set by put and get */
    int64_t created_ms;
    size_t n_members;
    char (*members)[STORE_ID_MAX]; /* [n_members] mesh-... or surf-..., malloc; NULL in lists */
    struct store_view view;        /* for put: whose it is, and whether members may be others' */
    int64_t bytes_max;             /* for put: as of struct store_owner */
};
void store_cohort_clear(struct store_cohort *cohort);

/* Stores the cohort; *created is false where it is there with this very record. What it names
   stays as long as the cohort does. STORE_CONFLICT: the name is taken by another record.
   STORE_NOT_FOUND: member number *missing does not exist. */
int store_cohort_put(struct store *store, struct store_cohort *cohort, bool *created,
                     size_t *missing);
/* Replaces the cohort of cohort->owner that was read as `old`, where its digest is still this one,
   by the given one, that may have another name; its time stays. Members that are the same are not
   written again, nor looked at. STORE_CONFLICT: the digest is another one by now
   (*changed), or the new name is taken. STORE_NOT_FOUND: there is no such cohort, or member number
   *missing does not exist: in that case cohort->created_ms was set. */
int store_cohort_replace(struct store *store, const struct store_cohort *old,
                         struct store_cohort *cohort, bool *changed, size_t *missing);
int store_cohort_get(struct store *store, const char *name, struct store_cohort *cohort);
/* Names are each owner's own; the functions above are for the owner "". */
int store_cohort_get_as(struct store *store, const char *owner, const char *name,
                        struct store_cohort *cohort);
/* digest: only where the cohort has this one; NULL: whatever it has. */
int store_cohort_delete_as(struct store *store, const char *owner, const char *name,
                           const char *digest);
/* Who has a cohort of that name: the first `most` of them by name, and how many there are. */
int store_cohort_owners(struct store *store, const char *name, char (*owners)[STORE_OWNER_MAX],
                        size_t most, size_t *count);
/* Newest first: see store_page; after_id is a name here. */
int store_cohort_list(struct store *store, const struct store_page *page,
                      bool (*visit)(void *user, const struct store_cohort *cohort), void *user);

#endif
