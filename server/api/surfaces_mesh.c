/*
 * surfaces_mesh.c - GET /v1/surfaces/{id}/mesh: the surface as triangles over a geodesic sphere,
 * with exact normals, in a format for viewing.
 *
 * Coordinates are those of the surface as stored; the record's scale multiplies them back to the
 * units of the mesh it came from. A surface whose source names a reference (those of a geodesic,
 * deformed from its first) carries the scalar field "deformation": at each vertex, the distance
 * to the point of the reference with the same parameter. Maps that were stored with the surface
 * (significance and effect of a comparison) ride along, interpolated between their nodes.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/respond.h"
#include "api/routes.h"
#include "api/surfaces_grid.h"
#include "compute/compute.h"
#include "store/surface.h"

static const char *const formats[] = {"ply", "obj", "stl", "vtk", "glb"};
#define FORMATS (sizeof formats / sizeof formats[0])

static bool refuse(struct api_call *call, const char *pointer, const char *detail)
{
    struct problem_list list = {.errors = NULL};

    problem_add(&list, pointer, "%s", detail);
    (void)problem_respond_list(call, "invalid-input", &list);
    return false;
}

/* The format that Accept likes best; NULL, with a problem answered, where it takes none. */
static const char *negotiate_format(struct api_call *call)
{
    const char *types[FORMATS + 1] = {NULL};
    int best;

    for (size_t i = 0; i < FORMATS; i++) {
        types[i] = mesh_media_type(formats[i]);
    }
    best = accept_best(call->request, types);
    if (best < 0) {
        (void)problem_respond(call, "not-acceptable",
                              "This is served as %s, %s, %s, %s and %s; ?format= chooses, too.",
                              types[0], types[1], types[2], types[3], types[4]);
    }
    return best < 0 ? NULL : formats[best];
}

/* ?format=, otherwise what Accept likes best, ply first. NULL when a problem was answered. */
static const char *choose_format(struct api_call *call)
{
    bool refused = false;
    char text[16];

    if (!query_get(call, "format", text, sizeof text, &refused)) {
        return refused ? NULL : negotiate_format(call);
    }
    for (size_t i = 0; i < FORMATS; i++) {
        if (strcmp(text, formats[i]) == 0) {
            return formats[i];
        }
    }
    (void)refuse(call, "/format", "format must be ply, obj, stl, vtk or glb");
    return NULL;
}

/* ?resolution=: parts of each edge of the icosahedron. 0 when a problem was answered. */
static size_t choose_resolution(struct api_call *call, size_t degree)
{
    double harmonics = (double)srnf_coefficient_count(degree), limit;
    bool refused = false;
    char text[32], detail[200];
    long number = SURFACE_RESOLUTION_DEFAULT;

    /* 10 r^2 vertices times the harmonics is the work. */
    limit = floor(sqrt(SURFACE_MESH_WORK_MAX / harmonics / 10.0));
    if (limit > SURFACE_RESOLUTION_MAX) {
        limit = SURFACE_RESOLUTION_MAX;
    }
    if (query_get(call, "resolution", text, sizeof text, &refused)) {
        if (!query_whole(text, &number) || number < 1 || (double)number > limit) {
            (void)snprintf(
                detail, sizeof detail,
                "resolution must be a whole number from 1 to %.0f for a surface of degree "
                "%zu",
                limit, degree);
            (void)refuse(call, "/resolution", detail);
            return 0;
        }
    }
    return refused ? 0 : (size_t)number;
}

/* The id of the surface that deformation is measured from; false where there is none. */
static bool reference_of(const struct store_surface *surface, char id[STORE_ID_MAX])
{
    json_t *record = json_loads(surface->record ? surface->record : "{}", 0, NULL);
    const json_t *source = json_object_get(record, "source");
    const char *text = json_string_value(json_object_get(source, "reference"));
    bool found = text && strlen(text) < STORE_ID_MAX;

    if (found) {
        memcpy(id, text, strlen(text) + 1);
    }
    json_decref(record);
    return found;
}

/* What rides along with a mesh. */
struct riders {
    size_t count;
    double *values[1 + STORE_MAPS_MAX]; /* owned */
    struct srnf_mesh_field fields[1 + STORE_MAPS_MAX];
    struct store_maps maps; /* holds names */
};

static void add_rider(struct riders *riders, const char *name, double *values)
{
    riders->values[riders->count] = values;
    riders->fields[riders->count++] = (struct srnf_mesh_field){.name = name, .values = values};
}

static void clear_riders(struct riders *riders)
{
    for (size_t i = 0; i < riders->count; i++) {
        srnf_free(riders->values[i]);
    }
    store_maps_clear(&riders->maps);
}

/* Distance at each vertex to the same parameter of the reference, where there is one of this
   degree. Without memory there is none: the field is an extra. */
static void add_deformation(struct api_call *call, const struct store_surface *surface,
                            const struct srnf_mesh *sphere, struct riders *riders)
{
    struct store_surface reference = {0};
    char id[STORE_ID_MAX];
    size_t count = surface->coefficient_count, n = sphere->n_vertices;
    double *difference = srnf_alloc(count, sizeof(double)), *values = NULL, *field = NULL;

    if (!difference || !reference_of(surface, id) ||
        store_surface_get(call->api->config.store, id, true, &reference) ||
        reference.lmax != surface->lmax) {
        goto out;
    }
    for (size_t i = 0; i < count; i++) {
        difference[i] = surface->coefficients[i] - reference.coefficients[i];
    }
    values = srnf_alloc(n, 3 * sizeof(double));
    field = srnf_alloc(n, sizeof(double));
    if (!values || !field ||
        srnf_harmonics_at_points((size_t)surface->lmax, 3, difference, n, sphere->vertices, values,
                                 NULL)) {
        srnf_free(field);
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        field[i] = sqrt(values[i] * values[i] + values[n + i] * values[n + i] +
                        values[2 * n + i] * values[2 * n + i]);
    }
    add_rider(riders, "deformation", field);
out:
    srnf_free(values);
    store_surface_clear(&reference);
    srnf_free(difference);
}

/* The stored maps at each vertex. */
static void add_maps(struct api_call *call, const struct store_surface *surface,
                     const struct srnf_mesh *sphere, struct riders *riders)
{
    struct store_maps *maps = &riders->maps;
    struct jobs *jobs = call->api->config.jobs;
    const struct srnf_sht *sht = NULL;
    size_t points;

    if (store_surface_maps(call->api->config.store, surface->id, maps) ||
        jobs_transform_acquire(jobs, (size_t)surface->lmax, SRNF_GRID_GAUSS_LEGENDRE,
                               (size_t)maps->n_theta, (size_t)maps->n_phi, &sht)) {
        return;
    }
    points = (size_t)maps->n_theta * (size_t)maps->n_phi;
    for (size_t i = 0; i < maps->count; i++) {
        double *field = srnf_alloc(sphere->n_vertices, sizeof(double));

        if (!field) {
            break;
        }
        srnf_grid_interpolate(srnf_sht_grid(sht), maps->values + i * points, sphere->n_vertices,
                              sphere->vertices, field);
        add_rider(riders, maps->names[i], field);
    }
    jobs_transform_release(jobs, sht);
}

static void respond_mesh(struct api_call *call, const struct store_surface *surface,
                         const char *format, size_t resolution)
{
    struct srnf_mesh mesh = {0}, sphere = {0};
    struct srnf_buffer buffer = {0};
    struct riders riders = {.count = 0};
    double *normals = NULL;
    unsigned char *bytes = NULL;
    int status = srnf_surface_triangulate((size_t)surface->lmax, surface->coefficients, resolution,
                                          &mesh, &normals);

    if (status == 0 && srnf_mesh_icosphere(resolution, &sphere) == 0) {
        add_deformation(call, surface, &sphere, &riders);
        add_maps(call, surface, &sphere, &riders);
        srnf_mesh_clear(&sphere);
    }
    if (status == 0) {
        status = srnf_mesh_write(&mesh, srnf_mesh_format_from_name(format), normals, riders.fields,
                                 riders.count, &buffer);
    }
    /* The buffer is the core's; a response owns memory of malloc. */
    bytes = status == 0 ? malloc(buffer.size ? buffer.size : 1) : NULL;
    if (bytes) {
        memcpy(bytes, buffer.data, buffer.size);
        (void)api_response_header(call->response, "Content-Disposition",
                                  "attachment; filename=\"%s.%s\"", surface->id, format);
        respond_bytes(call, 200, mesh_media_type(format), bytes, buffer.size);
    } else {
        status = status ? status : SRNF_ENOMEM;
        (void)problem_respond(call, compute_problem_code(status), "%s.", srnf_strerror(status));
    }
    srnf_buffer_clear(&buffer);
    clear_riders(&riders);
    srnf_free(normals);
    srnf_mesh_clear(&mesh);
}

void surfaces_mesh(struct api_call *call)
{
    struct store_surface surface = {0};
    const char *format = choose_format(call);
    char tag[STORE_ID_MAX + 48];
    size_t resolution;
    int status;

    if (!format) {
        return;
    }
    status = store_surface_get_as(call->api->config.store, call->request->caller.name,
                                  call->parameters[0], true, &surface);
    if (status) {
        (void)problem_respond_store(call, status, "no-such-surface", call->parameters[0]);
        return;
    }
    resolution = choose_resolution(call, (size_t)surface.lmax);
    if (resolution) {
        (void)api_response_header_text(call->response, "Vary", "Accept");
        (void)snprintf(tag, sizeof tag, "%s.mesh.%zu.%s", surface.id, resolution, format);
        if (!respond_not_modified(call, tag)) {
            respond_mesh(call, &surface, format, resolution);
        }
    }
    store_surface_clear(&surface);
}
