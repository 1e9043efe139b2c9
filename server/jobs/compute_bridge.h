/*
 * compute_bridge.h - registering two surfaces that came to their sphere by different routes, from
 * meshes that are known.
 */
#ifndef SRNFD_COMPUTE_BRIDGE_H
#define SRNFD_COMPUTE_BRIDGE_H

#include "jobs/compute.h"

/* Where a surface came from; mesh "" where that is not known. */
struct compute_origin {
    char mesh[STORE_ID_MAX];
    enum srnf_parameterization route; /* star or area */
    double center[3];                 /* of star */
};

/*
 * As srnf_register without a warm start. Where both origins are known and their routes differ, the
 * surfaces are registered by the encodings of their meshes by area, and the warps between the
 * routes, which the meshes give, carry that over: bridged is then true. Both encodings of one mesh
 * need no search.
 *   origins   [in]  of template and moving, or NULL
 *   bridged   [out] whether this was done
 * Returns 0 or a negative core status, with the problem set.
 */
int compute_register_pair(struct jobs_run *run, const struct srnf_sht *sht, const double *fixed,
                          const double *moving, const struct compute_origin *origins,
                          const struct srnf_register_options *options,
                          struct srnf_registration *registration, bool *bridged,
                          struct jobs_result *result);
/* Whether compute_register_pair would bridge them. */
bool compute_bridgeable(const struct compute_origin *a, const struct compute_origin *b);

#endif
