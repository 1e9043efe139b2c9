/*
 * registration_options.h - how surfaces are registered, between JSON and the core: options in
 * results and in the records of models, and the defaults of the processes that only ask whether.
 */
#ifndef SRNFD_API_REGISTRATION_OPTIONS_H
#define SRNFD_API_REGISTRATION_OPTIONS_H

#include "api/handler.h"

/* In the order of enum srnf_register_start; ended by NULL. */
extern const char *const registration_starts[];

/* The defaults; in a common pose, without any rotation. */
struct srnf_register_options registration_defaults(bool common_pose);
/* The same and both ways: what distances, geodesic, shoot, transport and transfer do, so that they
   agree on the distance of a pair. */
struct srnf_register_options registration_pair_defaults(bool common_pose);
/* {"degree", "penalty", "rotation", ..}; NULL options: JSON null, nothing is registered. */
json_t *registration_json(const struct srnf_register_options *options);
/* Back from registration_json; false where it was null. */
bool registration_read(const json_t *value, struct srnf_register_options *options);

#endif
