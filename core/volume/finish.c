/*
 * finish.c - the mesh of a smoothed net: into the world, cut into triangles, shifted to the volume
 * of the voxels, and checked.
 */
#include "extract.h"

#include <math.h>
#include <string.h>

#define VOLUME_ROUNDS 30
#define VOLUME_TOLERANCE 1e-9
#define SHIFT_MOST 0.75   /* in spacings: what needs more was smoothed too much for its size */
#define VOLUME_BOUND 1e-3 /* that is promised */

static double squared_distance(const double *x, uint32_t a, uint32_t b)
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double d = x[3 * a + k] - x[3 * b + k];

        sum += d * d;
    }
    return sum;
}

static void add_face(struct srnf_mesh *mesh, uint32_t a, uint32_t b, uint32_t c, bool turned)
{
    uint32_t *face = mesh->faces + 3 * mesh->n_faces++;

    face[0] = a;
    face[1] = turned ? c : b;
    face[2] = turned ? b : c;
}

/* A polygon into triangles: one of four corners by its shorter diagonal, one with spare vertices as
   a fan around one of them, whose diagonals no other polygon has. */
static void cut_polygon(const struct voxel_net *net, size_t polygon, struct srnf_mesh *mesh,
                        bool turned)
{
    const uint32_t *corners = net->corners + net->first[polygon];
    size_t n = net->first[polygon + 1] - net->first[polygon], apex = 0;

    if (n == 4) {
        apex = squared_distance(mesh->vertices, corners[0], corners[2]) >
               squared_distance(mesh->vertices, corners[1], corners[3]);
    } else {
        while (net->reach[corners[apex]] >= 0.5f) {
            apex++;
        }
    }
    for (size_t i = 1; i + 1 < n; i++) {
        add_face(mesh, corners[apex], corners[(apex + i) % n], corners[(apex + i + 1) % n], turned);
    }
}

static int make_mesh(struct extraction *work)
{
    struct srnf_mesh *mesh = &work->extracted->mesh;
    const struct voxel_net *net = &work->net;
    bool turned = extract_determinant(work) < 0.0;

    srnf_mesh_clear(mesh);
    mesh->vertices = srnf_alloc(net->n_vertices, 3 * sizeof(double));
    mesh->faces = srnf_alloc(net->n_corners - 2 * net->n_polygons, 3 * sizeof *mesh->faces);
    if (!mesh->vertices || !mesh->faces) {
        return extract_no_memory(work);
    }
    mesh->n_vertices = net->n_vertices;
    for (size_t v = 0; v < net->n_vertices; v++) {
        extract_world(work, net->vertices + 3 * v, mesh->vertices + 3 * v);
    }
    for (size_t p = 0; p < net->n_polygons; p++) {
        cut_polygon(net, p, mesh, turned);
    }
    return SRNF_OK;
}

/* Area-weighted normals, not unit; returns the volume and the area. Corners are taken from the
   first vertex, so that nothing is lost far from the origin. */
static double measure(const struct srnf_mesh *mesh, double *normals, double *area)
{
    const double *o = mesh->vertices;
    double volume = 0.0;

    memset(normals, 0, 3 * mesh->n_vertices * sizeof(double));
    *area = 0.0;
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const uint32_t *face = mesh->faces + 3 * f;
        const double *a = o + 3 * face[0], *b = o + 3 * face[1], *c = o + 3 * face[2];
        double u[3], v[3], n[3];

        for (size_t k = 0; k < 3; k++) {
            u[k] = b[k] - a[k];
            v[k] = c[k] - a[k];
        }
        for (size_t k = 0; k < 3; k++) {
            n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
            volume += n[k] * (a[k] - o[k]) / 6.0;
        }
        *area += 0.5 * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (size_t k = 0; k < 9; k++) {
            normals[3 * face[k / 3] + k % 3] += n[k % 3];
        }
    }
    return volume;
}

static double smallest(const double spacing[3])
{
    return fmin(spacing[0], fmin(spacing[1], spacing[2]));
}

/* Shifts all vertices along their normals until the mesh encloses the volume. */
static int restore_volume(struct extraction *work)
{
    struct srnf_extracted *extracted = work->extracted;
    struct srnf_mesh *mesh = &extracted->mesh;
    double *normals = srnf_alloc(mesh->n_vertices, 3 * sizeof(double));
    double area = 0.0, shift = 0.0, most = SHIFT_MOST * smallest(work->volume->spacing);

    if (!normals) {
        return extract_no_memory(work);
    }
    for (size_t round = 0; round <= VOLUME_ROUNDS; round++) {
        double missing, target = extracted->voxel_volume;

        extracted->volume = measure(mesh, normals, &area);
        missing = target - extracted->volume;
        if (round == VOLUME_ROUNDS || fabs(missing) <= VOLUME_TOLERANCE * target || !(area > 0.0) ||
            srnf_is_canceled(work->context)) {
            break;
        }
        shift += missing / area;
        for (size_t v = 0; v < mesh->n_vertices; v++) {
            double *n = normals + 3 * v;
            double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);

            for (size_t k = 0; k < 3 && length > 0.0; k++) {
                mesh->vertices[3 * v + k] += missing / area * n[k] / length;
            }
        }
    }
    srnf_free(normals);
    extracted->max_offset = fabs(shift);
    if (!(fabs(extracted->volume - extracted->voxel_volume) <=
          VOLUME_BOUND * extracted->voxel_volume) ||
        extracted->max_offset > most) {
        return srnf_fail(
            work->error, SRNF_ENUMERIC, -1,
            "the surface encloses %g cubic millimetres and its voxels %g, and shifting "
            "it does not help; smooth less",
            extracted->volume, extracted->voxel_volume);
    }
    return SRNF_OK;
}

static int check_mesh(struct extraction *work)
{
    const struct srnf_mesh *mesh = &work->extracted->mesh;
    struct srnf_mesh copy = {.n_vertices = mesh->n_vertices, .n_faces = mesh->n_faces};
    struct srnf_mesh_report report = {.genus = -1};
    int status = SRNF_ENOMEM;

    copy.vertices = srnf_alloc(mesh->n_vertices, 3 * sizeof(double));
    copy.faces = srnf_alloc(mesh->n_faces, 3 * sizeof *copy.faces);
    if (copy.vertices && copy.faces) {
        memcpy(copy.vertices, mesh->vertices, 3 * mesh->n_vertices * sizeof(double));
        memcpy(copy.faces, mesh->faces, 3 * mesh->n_faces * sizeof *copy.faces);
        status = srnf_mesh_prepare_within(&copy, false, work->context, &report);
    }
    srnf_mesh_clear(&copy);
    if (status != SRNF_OK) {
        return status == SRNF_ECANCELED ? status : extract_no_memory(work);
    }
    return report.n_problems == 0
               ? SRNF_OK
               : srnf_fail(work->error, report.problems[0].status, report.problems[0].first,
                           "the extracted surface has a problem: %.180s",
                           report.problems[0].detail);
}

int extract_finish(struct extraction *work)
{
    int status = make_mesh(work);

    status = status == SRNF_OK ? restore_volume(work) : status;
    return status == SRNF_OK ? check_mesh(work) : status;
}
