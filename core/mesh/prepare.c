/*
 * prepare.c - from a mesh as it was read to one that can be analysed, or to the reasons why it
 * cannot be: which points are one.
 *
 * A file can give one point several vertices: marching cubes does so in every voxel that has the
 * level exactly, formats without shared vertices (STL) everywhere, and programs that keep a normal
 * or a texture coordinate with each vertex along every crease or seam. A file can also mean it:
 * a surface that touches itself. Which of the two it is shows in what comes of it:
 *
 *   welded   equal points are joined; faces that collapse by it go, of equal faces all but one, and
 *            faces that lie back to back (srnf_repair_drop_faces). Taken if nothing is left to
 *            complain of.
 *   opened   the same, with a vertex for each fan of faces where fans touch in a point. Taken if
 *            the welded mesh does not do but this does: the surface touches itself in points.
 *   indexed  as the indices say. Taken if neither does, and this mesh is sound, or is at least a
 *            closed, oriented manifold, which the welded one is not: it touches itself along edges,
 *            or closes a ring. Points stay apart where they are equal.
 *
 * If none is sound the report is that of the welded mesh (of the indexed one where that is a closed
 * manifold, or nothing is left of the other). So joining never makes a sound mesh unsound.
 *
 * Nothing else is repaired: closing holes or joining points that are only near would be a guess.
 */
#include "mesh_geometry.h"

#include <string.h>

/* One reading of the mesh. */
struct candidate {
    struct srnf_mesh mesh;
    struct srnf_mesh_origin origin; /* with room for all that was there at first */
    struct srnf_mesh_report report;
};

bool mesh_is_finite(const struct srnf_mesh *mesh)
{
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        if (mesh->faces[c] >= mesh->n_vertices) {
            return false;
        }
    }
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        if (!isfinite(mesh->vertices[i])) {
            return false;
        }
    }
    return true;
}

/* And few enough of both. */
static bool mesh_is_valid(const struct srnf_mesh *mesh)
{
    return mesh->n_faces <= SRNF_MESH_FACES_MAX && mesh->n_vertices <= SRNF_MESH_VERTICES_MAX &&
           mesh_is_finite(mesh);
}

static void origin_clear(struct srnf_mesh_origin *origin)
{
    srnf_free(origin->vertices);
    srnf_free(origin->faces);
    *origin = (struct srnf_mesh_origin){0};
}

static void candidate_clear(struct candidate *c)
{
    srnf_mesh_clear(&c->mesh);
    origin_clear(&c->origin);
    *c = (struct candidate){0};
}

static int copy_mesh(const struct srnf_mesh *from, struct srnf_mesh *to)
{
    *to = (struct srnf_mesh){.n_vertices = from->n_vertices, .n_faces = from->n_faces};
    to->vertices = srnf_alloc(from->n_vertices, 3 * sizeof *to->vertices);
    to->faces = srnf_alloc(from->n_faces, 3 * sizeof *to->faces);
    if (!to->vertices || !to->faces) {
        srnf_mesh_clear(to);
        return SRNF_ENOMEM;
    }
    if (from->n_vertices > 0) {
        memcpy(to->vertices, from->vertices, 3 * from->n_vertices * sizeof *to->vertices);
    }
    if (from->n_faces > 0) {
        memcpy(to->faces, from->faces, 3 * from->n_faces * sizeof *to->faces);
    }
    return SRNF_OK;
}

static int alloc_origin(const struct srnf_mesh *mesh, struct srnf_mesh_origin *origin)
{
    origin->vertices = srnf_alloc(mesh->n_vertices, sizeof *origin->vertices);
    origin->faces = srnf_alloc(mesh->n_faces, sizeof *origin->faces);
    if (!origin->vertices || !origin->faces) {
        origin_clear(origin);
        return SRNF_ENOMEM;
    }
    return SRNF_OK;
}

static int copy_origin(const struct srnf_mesh_origin *from, const struct srnf_mesh *mesh,
                       struct srnf_mesh_origin *to)
{
    int status = alloc_origin(mesh, to);

    if (status == SRNF_OK && mesh->n_vertices > 0) {
        memcpy(to->vertices, from->vertices, mesh->n_vertices * sizeof *to->vertices);
    }
    if (status == SRNF_OK && mesh->n_faces > 0) {
        memcpy(to->faces, from->faces, mesh->n_faces * sizeof *to->faces);
    }
    return status;
}

static int copy_candidate(const struct candidate *from, struct candidate *to)
{
    int status = copy_mesh(&from->mesh, &to->mesh);

    to->report = (struct srnf_mesh_report){.repairs = from->report.repairs};
    if (status == SRNF_OK) {
        status = copy_origin(&from->origin, &from->mesh, &to->origin);
    }
    if (status != SRNF_OK) {
        candidate_clear(to);
    }
    return status;
}

static bool is_sound(const struct candidate *c)
{
    return c->report.n_problems == 0;
}

static bool is_closed_manifold(const struct candidate *c)
{
    return c->report.closed && c->report.edge_manifold && c->report.vertex_manifold &&
           c->report.oriented;
}

static int weld(const struct candidate *indexed, const struct srnf_context *context,
                struct candidate *welded)
{
    struct srnf_mesh_repairs *repairs = &welded->report.repairs;
    int status = copy_candidate(indexed, welded);

    if (status == SRNF_OK) {
        status = srnf_repair_merge_vertices(&welded->mesh, &welded->origin, context,
                                            &repairs->duplicate_vertices_merged);
    }
    if (status == SRNF_OK) {
        status = srnf_repair_drop_faces(&welded->mesh, &welded->origin, context, repairs);
    }
    return status == SRNF_OK
               ? srnf_mesh_examine(&welded->mesh, &welded->origin, context, &welded->report)
               : status;
}

static int open_fans(const struct candidate *welded, const struct srnf_context *context,
                     struct candidate *opened)
{
    struct srnf_mesh_repairs *repairs = &opened->report.repairs;
    int status = copy_candidate(welded, opened);

    if (status == SRNF_OK) {
        status = srnf_repair_split_fans(&opened->mesh, &opened->origin, context,
                                        &repairs->touching_vertices_kept_apart);
    }
    if (status == SRNF_OK) {
        size_t *merged = &repairs->duplicate_vertices_merged;
        size_t apart = repairs->touching_vertices_kept_apart;

        *merged -= apart < *merged ? apart : *merged;
        status = srnf_mesh_examine(&opened->mesh, &opened->origin, context, &opened->report);
    }
    return status;
}

/* Leaves in `indexed` the reading that is taken. */
static int choose(struct candidate *indexed, const struct srnf_context *context)
{
    struct candidate welded = {0}, opened = {0}, *taken = indexed;
    int status = weld(indexed, context, &welded);

    if (status != SRNF_OK) {
        goto out;
    }
    if (is_sound(&welded)) {
        taken = &welded;
        goto out;
    }
    if (welded.report.closed && welded.report.edge_manifold && !welded.report.vertex_manifold) {
        status = open_fans(&welded, context, &opened);
        if (status != SRNF_OK) {
            goto out;
        }
    }
    if (opened.origin.vertices && is_sound(&opened)) {
        taken = &opened;
        goto out;
    }
    status = srnf_mesh_examine(&indexed->mesh, &indexed->origin, context, &indexed->report);
    if (status != SRNF_OK) {
        goto out;
    }
    if (is_sound(indexed) || welded.mesh.n_faces == 0 ||
        (is_closed_manifold(indexed) && !is_closed_manifold(&welded))) {
        indexed->report.repairs.touching_vertices_kept_apart =
            welded.report.repairs.duplicate_vertices_merged;
    } else {
        taken = &welded;
    }
out:
    if (status == SRNF_OK && taken != indexed) {
        struct candidate swap = *indexed;

        *indexed = *taken;
        *taken = swap;
    }
    candidate_clear(&opened);
    candidate_clear(&welded);
    return status;
}

/* origin [out] of the caller, also on failure. */
static int prepare(struct srnf_mesh *mesh, bool weld_vertices, const struct srnf_context *context,
                   struct srnf_mesh_report *report, struct srnf_mesh_origin *origin)
{
    struct candidate c = {.mesh = *mesh};
    int status = SRNF_EINVAL;

    *report = (struct srnf_mesh_report){0};
    *origin = (struct srnf_mesh_origin){0};
    if (!mesh_is_valid(mesh)) {
        return status;
    }
    status = alloc_origin(mesh, &c.origin);
    if (status != SRNF_OK) {
        return status;
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        c.origin.vertices[i] = (uint32_t)i;
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        c.origin.faces[f] = (uint32_t)f;
    }
    status = weld_vertices ? choose(&c, context)
                           : srnf_mesh_examine(&c.mesh, &c.origin, context, &c.report);
    *mesh = c.mesh;
    *report = c.report;
    *origin = c.origin;
    return status;
}

int srnf_mesh_prepare_within(struct srnf_mesh *mesh, bool weld_vertices,
                             const struct srnf_context *context, struct srnf_mesh_report *report)
{
    struct srnf_mesh_origin origin;
    int status = prepare(mesh, weld_vertices, context, report, &origin);

    origin_clear(&origin);
    return status;
}

int srnf_mesh_prepare(struct srnf_mesh *mesh, bool weld_vertices, struct srnf_mesh_report *report)
{
    return srnf_mesh_prepare_within(mesh, weld_vertices, NULL, report);
}

/* ---- A mesh and its sphere ------------------------------------------------------------------- */

static bool same_faces(const struct srnf_mesh *a, const struct srnf_mesh *b)
{
    return a->n_vertices == b->n_vertices && a->n_faces == b->n_faces && a->n_faces > 0 &&
           memcmp(a->faces, b->faces, 3 * a->n_faces * sizeof *a->faces) == 0;
}

/* The sphere's vertices as those of the mesh went, and the faces of the mesh. */
static int follow(const struct srnf_mesh *mesh, const uint32_t *origin, struct srnf_mesh *sphere)
{
    struct srnf_mesh followed;
    int status = copy_mesh(mesh, &followed);

    if (status != SRNF_OK) {
        return status;
    }
    for (size_t i = 0; i < followed.n_vertices; i++) {
        memcpy(followed.vertices + 3 * i, sphere->vertices + 3 * (size_t)origin[i],
               3 * sizeof *followed.vertices);
    }
    srnf_mesh_clear(sphere);
    *sphere = followed;
    return SRNF_OK;
}

int srnf_mesh_prepare_pair(struct srnf_mesh *mesh, struct srnf_mesh *sphere,
                           struct srnf_mesh_report *report)
{
    return srnf_mesh_prepare_pair_within(mesh, sphere, NULL, report);
}

int srnf_mesh_prepare_pair_within(struct srnf_mesh *mesh, struct srnf_mesh *sphere,
                                  const struct srnf_context *context,
                                  struct srnf_mesh_report *report)
{
    struct srnf_mesh_report of_sphere;
    struct srnf_mesh original = {0};
    struct srnf_mesh_origin origin = {0};
    int status;

    if (!mesh_is_valid(mesh) || !mesh_is_valid(sphere) || !same_faces(mesh, sphere)) {
        status = srnf_mesh_prepare_within(mesh, true, context, report);
        return status == SRNF_OK ? srnf_mesh_prepare_within(sphere, true, context, &of_sphere)
                                 : status;
    }
    status = copy_mesh(mesh, &original);
    if (status == SRNF_OK) {
        status = prepare(mesh, false, context, report, &origin);
    }
    if (status == SRNF_OK && report->n_problems > 0) {
        srnf_mesh_clear(mesh);
        origin_clear(&origin);
        *mesh = original;
        original = (struct srnf_mesh){0};
        status = prepare(mesh, true, context, report, &origin);
    }
    if (status == SRNF_OK) {
        status = follow(mesh, origin.vertices, sphere);
    }
    origin_clear(&origin);
    srnf_mesh_clear(&original);
    return status;
}
