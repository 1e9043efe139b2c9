/*
 * bridge.h - comparing surfaces that came to their sphere by different routes, from meshes
 * that are known: pairs are registered through their meshes, members of groups are encoded again.
 */
#ifndef SRNFD_COMPUTE_BRIDGE_H
#define SRNFD_COMPUTE_BRIDGE_H

#include "compute/compute.h"

/* Where a surface came from: what encode was asked for. mesh "" where that is not known. */
struct compute_origin {
    char surface[STORE_ID_MAX]; /* itself; "" for a mesh */
    char mesh[STORE_ID_MAX];
    enum srnf_parameterization route; /* star or area */
    double center[3];                 /* of star */
    double smoothing;
    bool mirrored, unit_area;
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

/*
 * Loads a member of a group that came by star, in the stead of which stands the encoding by area of
 * its mesh, at its degree and with all else that encode was asked for then: so that it is to others
 * by area what it would be had it been encoded by area at first. Its id, and the id of its content,
 * stay what they are. Where the mesh cannot be encoded again the surface is taken as it is.
 *   mirror   [in]  take the mirror image, as compute_surface_load_within
 *   bridged  [out] whether the encoding by area is what was loaded; a doubt of it is then noted
 * Returns 0 or a negative status, with the problem set.
 */
int compute_bridge_load(struct jobs_run *run, const struct srnf_context *context,
                        const struct compute_origin *origin, bool mirror,
                        struct compute_surface *surface, bool *bridged, struct jobs_result *result);

#endif
