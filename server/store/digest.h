/*
 * digest.h - SHA-256 of content, and the ids that are made of it.
 */
#ifndef SRNFD_STORE_DIGEST_H
#define SRNFD_STORE_DIGEST_H

#include <stddef.h>

#include "ids.h"

/* Content ids: prefix + 32 hex digits of SHA-256. */
void store_content_id(char id[STORE_ID_MAX], const char *prefix, const void *bytes, size_t size);
void store_sha256_hex(char hex[65], const void *bytes, size_t size);

#endif
