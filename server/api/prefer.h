/*
 * prefer.h - the Prefer header (RFC 7240) as far as executions know it.
 */
#ifndef SRNFD_API_PREFER_H
#define SRNFD_API_PREFER_H

#include "api/api.h"

struct prefer {
    bool respond_async;
    bool has_wait;
    double wait; /* seconds */
};

/* Reads all Prefer headers; what is unknown or does not parse is no preference, as the RFC wants.
 */
void prefer_read(const struct api_request *request, struct prefer *prefer);

#endif
