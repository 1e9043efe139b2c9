/*
 * process_routes.h - by which route surfaces came to their sphere (star, area, given), and what is
 * said where surfaces that are compared came by different ones.
 *
 * Two surfaces of one shape by two routes lie apart, since registration finds the way from one
 * parameterisation to the other only up to its penalty and degree. A mesh among the inputs is
 * encoded by the default route. Of a surface its record tells: encode writes the route down, and
 * what a process makes has the route that all it was made of share. Of coefficients that were sent
 * in, and of what was made of two routes, nothing is known.
 *
 * A group whose members are known to differ is refused unless the input mixedRoutes allows it;
 * then, where nothing is known of some members, and where a pair differs, the result has the
 * warning mixed-routes.
 */
#ifndef SRNFD_API_PROCESS_ROUTES_H
#define SRNFD_API_PROCESS_ROUTES_H

#include "api/process.h"
#include "jobs/compute_bridge.h"

/* The route in a surface's record: "star", "area", "given", or NULL where it is not known. Static.
 */
const char *surface_route(const struct store_surface *surface);

/* The route that these have in common, static; NULL where they have none or one of them is not
   known. of_mesh: that of meshes, NULL for the default one. */
const char *routes_common(struct jobs_run *run, size_t n, const char *const *ids,
                          const char *of_mesh);

/* Reads "mixedRoutes", and answers 422 mixed-routes where the surfaces (ids) are known to differ
   and it is not true. False when answered. */
bool inputs_routes(struct process_inputs *inputs, const json_t *surfaces);

/* Where the surface or mesh comes from: known of meshes, which go by the default route, and of what
   encode made by star or area. */
void routes_origin(struct jobs_run *run, const char *id, struct compute_origin *origin);
/* Of several: [n], srnf_free; NULL without memory. */
struct compute_origin *routes_origins(struct jobs_run *run, size_t n, const char *const *ids);

/* Adds the warning to the document's warnings where what the inputs name differs, unless its member
   bridged is true: registration then went through the meshes (jobs/compute_bridge.h). */
void routes_warn(struct jobs_run *run, const json_t *inputs, json_t *document);

#endif
