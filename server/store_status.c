/*
 * store_status.c - the codes of the store as sentences.
 */
#include "store_status.h"

#include <stddef.h>

static const char *const sentences[] = {
    [-STORE_OK] = "success",
    [-STORE_NOT_FOUND] = "not found",
    [-STORE_CONFLICT] = "not in the state that this change asks for",
    [-STORE_FULL] = "no space left in the data directory",
    [-STORE_IO] = "the data directory cannot be read or written",
    [-STORE_CORRUPT] = "the data are damaged or not ours",
    [-STORE_NEWER] = "the data were written by a newer version",
    [-STORE_BUSY] = "another daemon uses the data directory",
    [-STORE_NOMEM] = "not enough memory",
    [-STORE_CLOSED] = "the store is shutting down",
    [-STORE_QUOTA] = "the owner holds as many bytes as it may",
    [-STORE_QUEUED] = "the owner has as many jobs waiting as it may",
};

const char *store_strerror(int status)
{
    size_t n = sizeof sentences / sizeof sentences[0];

    return status <= 0 && status > -(int)n ? sentences[-status] : "unknown status";
}
