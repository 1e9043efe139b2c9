/*
 * options.c - the options of a registration as bytes: eleven numbers in the order of enum option,
 * after the version of that list.
 *
 * Reading fills the struct by position, so that the compiler tells (missing initializer) when the
 * struct has got an option that is not written here; it then gets a number, and the list a new
 * version. A daemon and its workers are of one build, but tasks outlive both.
 */
#include "tasks/internal.h"

#define VERSION 1

enum option {
    OPTION_VERSION,
    OPTION_REPRESENTATION,
    OPTION_ROTATION,
    OPTION_REPARAMETERIZATION,
    OPTION_DEGREE,
    OPTION_PENALTY_JACOBIAN,
    OPTION_PENALTY_DISPLACEMENT,
    OPTION_START,
    OPTION_COMMON_POSE,
    OPTION_SYMMETRIC,
    OPTION_EXACT,
    OPTION_MAX_STEPS,
    OPTIONS
};
_Static_assert(8 * OPTIONS == TASKS_OPTIONS_SIZE, "each option is one number");

void tasks_put_options(unsigned char *bytes, const struct srnf_register_options *o)
{
    tasks_put(bytes + 8 * OPTION_VERSION, VERSION);
    tasks_put(bytes + 8 * OPTION_REPRESENTATION, (uint64_t)o->representation);
    tasks_put(bytes + 8 * OPTION_ROTATION, o->rotation);
    tasks_put(bytes + 8 * OPTION_REPARAMETERIZATION, o->reparameterization);
    tasks_put(bytes + 8 * OPTION_DEGREE, o->degree);
    tasks_put_double(bytes + 8 * OPTION_PENALTY_JACOBIAN, o->penalty_jacobian);
    tasks_put_double(bytes + 8 * OPTION_PENALTY_DISPLACEMENT, o->penalty_displacement);
    tasks_put(bytes + 8 * OPTION_START, (uint64_t)o->start);
    tasks_put(bytes + 8 * OPTION_COMMON_POSE, o->common_pose);
    tasks_put(bytes + 8 * OPTION_SYMMETRIC, o->symmetric);
    tasks_put(bytes + 8 * OPTION_EXACT, o->exact);
    tasks_put(bytes + 8 * OPTION_MAX_STEPS, o->max_steps);
}

/* What a number of the list is at most. */
static uint64_t most_of(enum option option)
{
    switch (option) {
    case OPTION_VERSION:
        return VERSION;
    case OPTION_REPRESENTATION:
        return SRNF_REPRESENTATION_SRM;
    case OPTION_START:
        return SRNF_START_IDENTITY;
    case OPTION_DEGREE:
        return TASKS_DEGREE_MAX;
    case OPTION_PENALTY_JACOBIAN:
    case OPTION_PENALTY_DISPLACEMENT:
        return UINT64_MAX; /* doubles, which the core judges */
    case OPTION_MAX_STEPS:
        return SIZE_MAX;
    default:
        return 1;
    }
}

bool tasks_get_options(const unsigned char *bytes, struct srnf_register_options *options)
{
    bool good = tasks_get(bytes) == VERSION;

    for (enum option i = OPTION_VERSION; good && i < OPTIONS; i++) {
        good = tasks_get(bytes + 8 * i) <= most_of(i);
    }
    if (good) {
        const struct srnf_register_options read = {
            (enum srnf_representation)tasks_get(bytes + 8 * OPTION_REPRESENTATION),
            tasks_get(bytes + 8 * OPTION_ROTATION) != 0,
            tasks_get(bytes + 8 * OPTION_REPARAMETERIZATION) != 0,
            (size_t)tasks_get(bytes + 8 * OPTION_DEGREE),
            tasks_get_double(bytes + 8 * OPTION_PENALTY_JACOBIAN),
            tasks_get_double(bytes + 8 * OPTION_PENALTY_DISPLACEMENT),
            (enum srnf_register_start)tasks_get(bytes + 8 * OPTION_START),
            tasks_get(bytes + 8 * OPTION_COMMON_POSE) != 0,
            tasks_get(bytes + 8 * OPTION_SYMMETRIC) != 0,
            tasks_get(bytes + 8 * OPTION_EXACT) != 0,
            (size_t)tasks_get(bytes + 8 * OPTION_MAX_STEPS),
        };

        *options = read;
    }
    return good;
}
