/*
 * registration_options.c - the options of a registration as JSON, and back. A model keeps them in
 * its record, so that a new subject is registered to its mean as those it was made from were.
 */
#include "toolkit/registration_options.h"

#include <string.h>

const char *const registration_starts[] = {"tournament", "rigid", "identity", NULL};

/* Replaces a canonical member, if there is one. */
static void replace(struct process_inputs *inputs, const char *name, bool value)
{
    if (json_object_get(inputs->canonical, name)) {
        (void)json_object_set_new(inputs->canonical, name, json_boolean(value));
    }
}

void registration_one_spelling(struct process_inputs *inputs)
{
    if (json_is_false(json_object_get(inputs->canonical, "register"))) {
        replace(inputs, "commonPose", false);
        replace(inputs, "symmetric", true);
    }
}

struct srnf_register_options registration_defaults(bool common_pose)
{
    struct srnf_register_options options = srnf_register_options_defaults();

    if (common_pose) {
        options.common_pose = true;
        options.rotation = false;
        options.start = SRNF_START_IDENTITY;
    }
    return options;
}

struct srnf_register_options registration_pair_defaults(bool common_pose)
{
    struct srnf_register_options options = registration_defaults(common_pose);

    options.symmetric = true;
    return options;
}

json_t *registration_json(const struct srnf_register_options *options)
{
    if (!options) {
        return json_null();
    }
    return json_pack("{s:I, s:{s:f, s:f}, s:b, s:b, s:s, s:b, s:b, s:b}", "degree",
                     (json_int_t)options->degree, "penalty", "jacobian",
                     options->exact ? 0.0 : options->penalty_jacobian, "displacement",
                     options->exact ? 0.0 : options->penalty_displacement, "rotation",
                     options->rotation, "reparameterization", options->reparameterization, "start",
                     registration_starts[options->start], "commonPose", options->common_pose,
                     "symmetric", options->symmetric, "exact", options->exact);
}

bool registration_read(const json_t *value, struct srnf_register_options *options)
{
    const json_t *penalty = json_object_get(value, "penalty");
    const char *start = json_string_value(json_object_get(value, "start"));

    *options = srnf_register_options_defaults();
    if (!json_is_object(value)) {
        return false;
    }
    options->degree = (size_t)json_integer_value(json_object_get(value, "degree"));
    options->penalty_jacobian = json_number_value(json_object_get(penalty, "jacobian"));
    options->penalty_displacement = json_number_value(json_object_get(penalty, "displacement"));
    options->rotation = json_is_true(json_object_get(value, "rotation"));
    options->reparameterization = json_is_true(json_object_get(value, "reparameterization"));
    options->common_pose = json_is_true(json_object_get(value, "commonPose"));
    options->symmetric = json_is_true(json_object_get(value, "symmetric"));
    options->exact = json_is_true(json_object_get(value, "exact"));
    for (int i = 0; start && registration_starts[i]; i++) {
        if (strcmp(start, registration_starts[i]) == 0) {
            options->start = (enum srnf_register_start)i;
        }
    }
    return true;
}
