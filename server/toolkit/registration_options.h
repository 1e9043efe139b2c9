/*
 * registration_options.h - how surfaces are registered, between JSON and the core: the inputs by
 * which processes ask for it, options in results and in the records of models, and the defaults of
 * the processes that only ask whether.
 */
#ifndef SRNFD_TOOLKIT_REGISTRATION_OPTIONS_H
#define SRNFD_TOOLKIT_REGISTRATION_OPTIONS_H

#include "toolkit/table.h"

/*
 * Inputs in the table of a process, with the members registered, common_pose and symmetric (bool)
 * of its typed inputs. Where registered is true, the options of the core are those of
 * registration_defaults, or of registration_pair_defaults.
 */
#define REGISTER_INPUT(typed, text)                                                        \
    {                                                                                      \
        "register", INPUT_BOOLEAN, offsetof(struct typed, registered), text, .fallback = 1 \
    }
#define COMMON_POSE_INPUT(typed, text)                                                        \
    {                                                                                         \
        "commonPose", INPUT_BOOLEAN, offsetof(struct typed, common_pose), text, .fallback = 0 \
    }
#define SYMMETRIC_INPUT(typed, default_, text)                                                    \
    {                                                                                             \
        "symmetric", INPUT_BOOLEAN, offsetof(struct typed, symmetric), text, .fallback = default_ \
    }
/* Where register is false, commonPose and symmetric, if they are inputs, mean nothing and get the
   defaults of pairs, so that one question has one canonical form. For check of such processes. */
void registration_one_spelling(struct process_inputs *inputs);

/* How the surfaces of a group were registered, in a result. */
#define REGISTRATION_OUTPUT                                                                    \
    {                                                                                          \
        "registration", OUTPUT_OBJECT_OR_NULL,                                                 \
            "How surfaces were registered: degree, penalty and all other options; null where " \
            "they were not."                                                                   \
    }

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
