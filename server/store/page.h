/*
 * page.h - pages of what the store lists.
 */
#ifndef SRNFD_STORE_PAGE_H
#define SRNFD_STORE_PAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What a list is sorted by; what is equal, by id. */
enum store_page_key {
    STORE_PAGE_CREATED,
    STORE_PAGE_NAME, /* small and capital letters alike */
    STORE_PAGE_PROCESS,
    STORE_PAGE_STATUS, /* of jobs */
};

/* A page of a list, newest first where nothing else is said. visit is called once per row with a
   struct of the kind that is valid only during the call; it returns false to stop. Texts are
   borrowed; a filter that is NULL lets all pass. */
struct store_page {
    size_t limit;
    enum store_page_key key;
    bool rising;
    /* The last item of the page before: its id, and its time or its text by the key. NULL or "":
       the page is the first. */
    const char *after_id, *after_text;
    int64_t after_ms;
    const char
        *owner;       /* what belongs to this owner; NULL: to anyone, as the first owner calls it */
    const char *name; /* part of the name, small and capital letters alike */
    const char *tag;  /* not of cohorts */
    /* That made it, or of the job; not of volumes and cohorts. With commas: one of several, whose
       names need no escapes in JSON. */
    const char *process;
    const char *status;         /* of jobs; the same */
    const char *cohort;         /* members of it, jobs and models that were given it */
    const char *mesh;           /* made of it, given it, or with it as a member */
    int64_t since_ms, until_ms; /* created at or after, and before; 0: at any time */
    bool nothing;               /* no row passes */
    bool by_duration;           /* of jobs: those that have begun, and have run for this long: */
    int64_t shortest_ms, longest_ms, now_ms; /* bounds included; the present, for those that run */
    int64_t *total; /* gets how many pass the filters, on all pages; NULL: not asked */
};

#endif
