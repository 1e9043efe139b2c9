/*
 * inflight.h - the set of Idempotency-Keys whose first request is not answered yet.
 */
#ifndef SRNFD_API_INFLIGHT_H
#define SRNFD_API_INFLIGHT_H

enum inflight_entry { INFLIGHT_ENTERED, INFLIGHT_TAKEN, INFLIGHT_NO_MEMORY };
struct api_inflight;

/* NULL without memory. */
struct api_inflight *inflight_create(void);
void inflight_destroy(struct api_inflight *inflight);
/* Enters the key, until inflight_leave, unless another request has. From any thread. */
enum inflight_entry inflight_enter(struct api_inflight *inflight, const char *key);
void inflight_leave(struct api_inflight *inflight, const char *key);

#endif
