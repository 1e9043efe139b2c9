/*
 * volumes.h - label volumes in the api layer.
 */
#ifndef SRNFD_API_VOLUMES_H
#define SRNFD_API_VOLUMES_H

#include "api/handler.h"

struct store_volume; /* store/volume.h */

/* The record; in lists it is without its labels, of which there may be thousands. */
json_t *volume_record(const struct store_volume *volume, bool with_labels);
/* Reads the body into a row to be stored; *held: the owner has it. False when a problem was
   answered. store_volume_clear in any case. */
bool volume_read_body(struct api_call *call, const char *name, struct store_volume *row,
                      bool *held);
/* Reads it and keeps it for the caller; *created: it is new there. False when a problem was
   answered. store_volume_clear in any case. */
bool volume_keep_body(struct api_call *call, const char *name, struct store_volume *row,
                      bool *created);
/* Whether the media type may be that of a volume. */
bool volume_type_known(const char *value, size_t length);

#endif
