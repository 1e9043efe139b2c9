/*
 * embedded.h - files that are part of the binary: migrations/NNNN_*.sql, in the order of
 * their numbers, api/openapi.yaml and what is derived from it, and, packed by gzip under ui/, the
 * dashboard and its example; put there by deploy/embed.sh at build time.
 */
#ifndef SRNFD_EMBEDDED_H
#define SRNFD_EMBEDDED_H

#include <stddef.h>

struct embedded_file {
    const char *path;           /* as in the source tree, or beside what it is derived from; NULL
                                   ends the table */
    const unsigned char *bytes; /* zero-terminated beyond size */
    size_t size;
};

extern const struct embedded_file embedded_files[];

#endif
