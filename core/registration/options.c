/*
 * options.c - the options of registrations, and the reasons why they end.
 */
#include "registration.h"

#include <math.h>

#define DEGREE_MAX 32

struct srnf_register_options srnf_register_options_defaults(void)
{
    return (struct srnf_register_options){.rotation = true,
                                          .reparameterization = true,
                                          .degree = 12,
                                          .penalty_jacobian = 0.003,
                                          .penalty_displacement = 0.01};
}

static const char *const stop_names[] = {
    [SRNF_REGISTER_DIRECT] = "direct",
    [SRNF_REGISTER_TOLERANCE] = "tolerance",
    [SRNF_REGISTER_STATIONARY] = "stationary",
    [SRNF_REGISTER_REFUSED] = "stepRefused",
    [SRNF_REGISTER_MAX_ITERATIONS] = "maxIterations",
};

const char *srnf_register_stop_name(enum srnf_register_stop stop)
{
    return (size_t)stop < sizeof stop_names / sizeof stop_names[0] ? stop_names[stop] : "unknown";
}

enum srnf_register_stop registration_worse_stop(enum srnf_register_stop a,
                                                enum srnf_register_stop b)
{
    return a > b ? a : b;
}

int registration_check(const struct srnf_register_options *o, struct srnf_error *error)
{
    if (o->degree < 1 || o->degree > DEGREE_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "degree %zu is not in 1 to %d", o->degree,
                         DEGREE_MAX);
    }
    if (!(o->penalty_jacobian >= 0.0) || !(o->penalty_displacement >= 0.0) ||
        !isfinite(o->penalty_jacobian) || !isfinite(o->penalty_displacement)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "a penalty is not a number from 0 up");
    }
    return SRNF_OK;
}
