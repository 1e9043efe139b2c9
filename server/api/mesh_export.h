/*
 * mesh_export.h - meshes as answers: which format is asked for, and the bytes. Shared by the meshes
 * of surfaces and by uploaded ones.
 */
#ifndef SRNFD_API_MESH_EXPORT_H
#define SRNFD_API_MESH_EXPORT_H

#include "api/handler.h"

/* A format that is written, as a media type under which it is served. "positions" is the
   coordinates of the vertices alone, in their order: x, y, z of each as 32-bit numbers, the lowest
   byte first. */
struct mesh_export {
    const char *format, *media_type;
};

/* ?format=, otherwise what Accept likes best, ply first. False when a problem was answered. */
bool mesh_export_choose(struct api_call *call, struct mesh_export *choice);

/* ?resolution=: parts of each edge of the icosahedron on which a surface of this degree is drawn. 0
   when a problem was answered. */
size_t mesh_export_resolution(struct api_call *call, size_t degree);

/* Writes the mesh and answers with it, as a file of the name id.format; normals may be NULL. */
void mesh_export_respond(struct api_call *call, const struct mesh_export *choice, const char *id,
                         const struct srnf_mesh *mesh, const double *normals,
                         const struct srnf_mesh_field *fields, size_t n_fields,
                         const struct srnf_mesh_description *description);

#endif
