/*
 * page.h - pages of what the store lists.
 */
#ifndef SRNFD_STORE_PAGE_H
#define SRNFD_STORE_PAGE_H

#include <stddef.h>
#include <stdint.h>

/* Newest first. A cursor is (created_ms, id) of the last item seen; after_id NULL or "" starts at
   the top. visit is called once per row with a struct of the kind that is valid only during the
   call; it returns false to stop. */
struct store_page {
    size_t limit;
    int64_t after_ms;
    const char *after_id;
    const char *process, *status; /* filters, for jobs only; NULL: all */
    const char *owner;            /* what belongs to this owner; NULL: to anyone */
};

#endif
