/*
 * volumes.h - label volumes in the api layer.
 */
#ifndef SRNFD_API_VOLUMES_H
#define SRNFD_API_VOLUMES_H

#include "api/handler.h"

struct store_volume; /* store/volume.h */

/* The record; in lists it is without its labels, of which there may be thousands. */
json_t *volume_record(const struct store_volume *volume, bool with_labels);
/* Whether the media type may be that of a volume. */
bool volume_type_known(const char *value, size_t length);

#endif
