/*
 * embedded.h - files that are part of the binary: migrations/NNNN_*.sql and api/openapi.yaml, put
 * there by deploy/embed.sh at build time, in the order of their names.
 */
#ifndef SRNFD_EMBEDDED_H
#define SRNFD_EMBEDDED_H

#include <stddef.h>

struct embedded_file {
    const char *path;           /* as in the source tree; NULL ends the table */
    const unsigned char *bytes; /* zero-terminated beyond size */
    size_t size;
};

extern const struct embedded_file embedded_files[];

#endif
