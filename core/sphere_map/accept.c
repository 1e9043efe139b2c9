/*
 * accept.c - is this a mesh that the parameterization can work on?
 *
 * Everything after this walks around vertices and takes for granted that the faces there form one
 * ring of three or more. That holds for every vertex of a triangulation whose edges have two faces
 * each, run in opposite directions, whose vertices have one fan each, and which is one piece with
 * more than three vertices. With Euler characteristic 2 it can be collapsed to a tetrahedron
 * (E. Steinitz). Counts of vertices and faces alone prove nothing of this: a torus beside a sphere
 * has those of a sphere.
 */
#include "sphere_map.h"

static bool indices_in_range(const struct srnf_mesh *mesh, int64_t *face)
{
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        if (mesh->faces[c] >= mesh->n_vertices) {
            *face = (int64_t)(c / 3);
            return false;
        }
    }
    return true;
}

/* The first trouble, in the order of enum srnf_status. */
static int judge(const struct srnf_mesh *mesh, const struct srnf_topology *t,
                 struct srnf_error *error)
{
    const struct {
        bool found;
        int status;
        int64_t element;
        const char *message;
    } troubles[] = {
        {t->boundary.count > 0, SRNF_ENOT_CLOSED, t->boundary.face,
         "a face has an edge that no other face shares"},
        {t->crowded.count > 0, SRNF_ENOT_MANIFOLD, t->crowded.face,
         "a face has an edge that more than two faces share"},
        {t->split_vertices > 0, SRNF_ENOT_MANIFOLD, t->first_split_vertex,
         "a vertex joins faces of several fans"},
        {t->disagreeing.count > 0, SRNF_ENOT_ORIENTED, t->disagreeing.face,
         "a face and its neighbour run the same way along their edge"},
        {t->components > 1, SRNF_ECOMPONENTS, t->first_face_elsewhere,
         "a face belongs to another component than the first one"},
        {t->vertices + t->faces != t->edges + 2, SRNF_EGENUS, -1,
         "the Euler characteristic is not 2"},
        {t->degenerate_faces > 0, SRNF_EDEGENERATE, t->first_degenerate_face,
         "a face names a vertex twice"},
        {t->vertices < mesh->n_vertices, SRNF_EINVAL, -1, "a vertex belongs to no face"},
    };

    for (size_t i = 0; i < sizeof troubles / sizeof troubles[0]; i++) {
        if (troubles[i].found) {
            return srnf_fail(error, troubles[i].status, troubles[i].element, "%s",
                             troubles[i].message);
        }
    }
    return SRNF_OK;
}

int spherical_accept(const struct srnf_mesh *mesh, struct srnf_error *error)
{
    struct srnf_topology topology;
    int64_t face = -1;

    if (mesh->n_faces > SRNF_MESH_FACES_MAX || mesh->n_vertices > SRNF_MESH_VERTICES_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu vertices and %zu faces are too many",
                         mesh->n_vertices, mesh->n_faces);
    }
    if (mesh->n_vertices < 4 || mesh->n_faces < 4) {
        return srnf_fail(error, SRNF_EGENUS, -1,
                         "%zu vertices and %zu faces are no closed surface of genus 0",
                         mesh->n_vertices, mesh->n_faces);
    }
    if (!indices_in_range(mesh, &face)) {
        return srnf_fail(error, SRNF_EINVAL, face, "a face names a vertex that does not exist");
    }
    if (srnf_topology_analyse(mesh, NULL, &topology)) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
    }
    return judge(mesh, &topology, error);
}
