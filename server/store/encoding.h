/*
 * encoding.h - encodings of meshes that are kept for later jobs.
 */
#ifndef SRNFD_STORE_ENCODING_H
#define SRNFD_STORE_ENCODING_H

#include <stddef.h>
#include <stdint.h>

#include "store_status.h"

struct store;

/*
 * A cache of what meshes were encoded to. Values are opaque here.
 *   name   64 hex digits, of all that decides the value
 *   mesh   that was encoded, and sphere, "" or that of its parameterization: the encoding goes with
 *          either
 *   limit  bytes of all values together, beyond which the oldest go; a few dozen may be more at
 *          times
 */
int store_encoding_put(struct store *store, const char *name, const char *mesh, const char *sphere,
                       const void *value, size_t size, int64_t limit);
/* value is allocated with malloc. STORE_NOT_FOUND: there is none, or it is damaged. */
int store_encoding_get(struct store *store, const char *name, unsigned char **value, size_t *size);

#endif
