/*
 * slivers.h - closed meshes of genus zero whose faces are long and thin, of any size: what costs a
 * spatial index, a raster or a map to the sphere the most.
 */
#ifndef TESTS_SLIVERS_H
#define TESTS_SLIVERS_H

#include "srnf.h"

/* One family of meshes. star: a point sees the whole of each. */
struct sliver_family {
    const char *name;
    struct srnf_mesh (*make)(size_t faces); /* about so many; the caller clears the mesh */
    bool star;
};

/* Ended by a family without a name. The first is no mesh of slivers: a sphere of even triangles, to
   compare with. */
extern const struct sliver_family sliver_families[];

#endif
