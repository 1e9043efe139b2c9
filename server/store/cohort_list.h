/*
 * cohort_list.h - the lists of members that cohorts have (cohort_list.c); of the store alone.
 */
#ifndef SRNFD_STORE_COHORT_LIST_H
#define SRNFD_STORE_COHORT_LIST_H

#include "store/cohort.h"

#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct store;

/* Members that one transaction adds or removes: it takes some 20 ms. */
#define STORE_LIST_PIECE 2000

/* A list that was filled before its cohort is there. */
struct store_list {
    int64_t number;  /* 0: none */
    size_t erasures; /* of the store when it was begun */
};

/* On the writer thread: a number that no list has. */
int store_list_next(sqlite3 *db, int64_t *list);
/* On the writer thread: adds `count` members of the cohort. STORE_NOT_FOUND: number *missing does
   not exist, or the owner may not name it. */
int store_list_add(sqlite3 *db, int64_t list, const struct store_cohort *cohort, const char *owner,
                   size_t first, size_t count, size_t *missing);
/* Writes all members to a loose list, piece by piece. Leaves nothing where it fails; status and
   *missing as above. */
int store_list_fill(struct store *store, const struct store_cohort *cohort, const char *owner,
                    struct store_list *list, size_t *missing);
/* On the writer thread: the list is the cohort's, which the caller puts into the same transaction.
   STORE_NOT_FOUND: member number *missing was erased meanwhile. */
int store_list_take(struct store *store, sqlite3 *db, const struct store_list *list,
                    const struct store_cohort *cohort, const char *owner, size_t *missing);
/* The list has no cohort and gets none: it is removed. */
void store_list_abandon(struct store *store, const struct store_list *list);

/* On the writer thread: removes some members of lists whose cohort has gone; *left: there may be
   more. */
int store_lists_empty(sqlite3 *db, bool *left);
/* Removes all of them, piece by piece. What a failure leaves, the next call or start removes. */
void store_lists_sweep(struct store *store);
/* At the start: also those that a crash left half filled. */
void store_lists_recover(struct store *store);

#endif
