/*
 * descriptors.h - how many connections the limit of open files (RLIMIT_NOFILE) leaves room for.
 */
#ifndef SRNFD_DESCRIPTORS_H
#define SRNFD_DESCRIPTORS_H

#include <stdbool.h>
#include <stddef.h>

struct descriptors {
    size_t limit;                /* of the process */
    size_t threads;              /* that open files of the data */
    size_t connections, waiting; /* with a request and without one, as configured */
};

/* Raises the limit of open files to what the system lets the process have, and returns it. */
size_t descriptors_raise(void);

/* What the connections and the files beside them take at most. */
size_t descriptors_needed(const struct descriptors *descriptors);

/* Lowers the numbers of connections until they fit the limit: those that wait first, down to a
   quarter of all, then both; neither below 1. False: they fit already. */
bool descriptors_fit(struct descriptors *descriptors);

#endif
