/*
 * routes.h - by which route surfaces came to their sphere (star, area, given), and what is
 * said where surfaces that are compared came by different ones.
 *
 * Two surfaces of one shape by two routes lie apart, since registration finds the way from one
 * parameterization to the other only up to its penalty and degree. A mesh among the inputs is
 * encoded by the default route. Of a surface its record tells: encode writes the route down, and
 * what a process makes has the route that all it was made of share. Of coefficients that were sent
 * in, and of what was made of two routes, nothing is known.
 *
 * A group whose members are known to differ is refused unless the input mixedRoutes allows it.
 * Then, where the group is registered, members by star beside others by area are bridged: compared
 * by the encodings of their meshes by area (compute/bridge.h). What differs all the same, or
 * is not known, in a group or a pair, has the warning mixed-routes.
 */
#ifndef SRNFD_TOOLKIT_ROUTES_H
#define SRNFD_TOOLKIT_ROUTES_H

#include "toolkit/table.h"
#include "compute/bridge.h"

struct store_surface; /* store/surface.h */

/* Outputs: what routes_set_bridged sets. */
#define BRIDGED_GROUP_OUTPUTS                                                                     \
    {"bridged", OUTPUT_BOOLEAN,                                                                   \
     "Whether registered members by star, beside others by area, were compared by the encodings " \
     "of their meshes by area."},                                                                 \
    {                                                                                             \
        "bridgedSurfaces", "\"type\":\"array\",\"items\":{" OUTPUT_STRING "}",                    \
            "Their ids: surfaces that encode made by star, of meshes that are known. Each was "   \
            "encoded again by area, at its degree and with its other options, and the numbers "   \
            "are "                                                                                \
            "those of a group by area."                                                           \
    }

/* The route that these have in common, static; NULL where they have none or one of them is not
   known. of_mesh: that of meshes, NULL for the default one. */
const char *routes_common(struct jobs_run *run, size_t n, const char *const *ids,
                          const char *of_mesh);

/* Answers 422 mixed-routes where the surfaces (ids) are known to differ and the canonical
   "mixedRoutes" is not true. False when answered. */
bool inputs_routes(struct process_inputs *inputs, const json_t *surfaces);

/* Where the surface or mesh comes from: known of meshes, which go by the default route, and of what
   encode made by star or area. */
void routes_origin(struct jobs_run *run, const char *id, struct compute_origin *origin);
/* The members of a group that are to be bridged, for compute_group_load: [n], srnf_free; NULL
   without memory. allowed: routes may mix, and the group is registered; otherwise none is
   bridged. */
struct compute_origin *routes_bridges(struct jobs_run *run, bool allowed, size_t n,
                                      const char *const *ids);
/* The route that all members have as they were computed with; otherwise as routes_common. */
const char *routes_of_group(struct jobs_run *run, size_t n, const char *const *ids,
                            const bool *bridged);
/* Tells which members of a group were bridged: bridged and bridgedSurfaces. */
void routes_set_bridged(json_t *document, size_t n, const char *const *ids, const bool *bridged);

/* Adds the warning to the document's warnings where what the inputs name differs. What stands in
   bridgedSurfaces of the document is by area; a pair with bridged true was registered through its
   meshes. */
void routes_warn(struct jobs_run *run, const json_t *inputs, json_t *document);

#endif
