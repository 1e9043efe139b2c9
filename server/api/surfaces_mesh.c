/*
 * surfaces_mesh.c - GET /v1/surfaces/{id}/mesh: the surface as triangles over a geodesic sphere,
 * with exact normals, in a format for viewing.
 *
 * Coordinates are those of the surface as stored; the record's scale multiplies them back to the
 * units of the mesh it came from. A surface whose source names a reference (those of a geodesic,
 * deformed from its first) carries the scalar field "deformation": at each vertex, the distance
 * to the point of the reference with the same parameter.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/respond.h"
#include "api/surfaces_grid.h"

static const char *const formats[] = {"ply", "obj", "stl", "vtk", "glb"};

static bool refuse(struct api_call *call, const char *pointer, const char *detail)
{
    struct problem_list list = {NULL};

    problem_add(&list, pointer, "%s", detail);
    (void)problem_respond_list(call, "invalid-input", &list);
    return false;
}

/* ?format=, by default ply. NULL when a problem was answered. */
static const char *choose_format(struct api_call *call)
{
    bool refused = false;
    char text[16];

    if (!query_get(call, "format", text, sizeof text, &refused)) {
        return refused ? NULL : formats[0];
    }
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++) {
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

/* Distance at each vertex to the same parameter of the reference, or NULL where there is no
   reference of this degree (or no memory: the field is an extra). */
static double *deformation(struct api_call *call, const struct store_surface *surface,
                           size_t resolution)
{
    struct store_surface reference = {0};
    struct srnf_mesh sphere = {0};
    char id[STORE_ID_MAX];
    size_t count = surface->coefficient_count, n;
    double *difference = srnf_alloc(count, sizeof(double)), *values = NULL, *field = NULL;

    if (!difference || !reference_of(surface, id) ||
        store_surface_get(call->api->config.store, id, true, &reference) ||
        reference.lmax != surface->lmax || srnf_mesh_icosphere(resolution, &sphere)) {
        goto out;
    }
    n = sphere.n_vertices;
    for (size_t i = 0; i < count; i++) {
        difference[i] = surface->coefficients[i] - reference.coefficients[i];
    }
    values = srnf_alloc(n, 3 * sizeof(double));
    field = srnf_alloc(n, sizeof(double));
    if (!values || !field ||
        srnf_harmonics_at_points((size_t)surface->lmax, 3, difference, n, sphere.vertices, values,
                                 NULL)) {
        srnf_free(field);
        field = NULL;
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        field[i] = sqrt(values[i] * values[i] + values[n + i] * values[n + i] +
                        values[2 * n + i] * values[2 * n + i]);
    }
out:
    srnf_free(values);
    srnf_mesh_clear(&sphere);
    store_surface_clear(&reference);
    srnf_free(difference);
    return field;
}

static void respond_mesh(struct api_call *call, const struct store_surface *surface,
                         const char *format, size_t resolution)
{
    struct srnf_mesh mesh = {0};
    struct srnf_buffer buffer = {0};
    struct srnf_mesh_field field = {.name = "deformation"};
    double *normals = NULL, *values = deformation(call, surface, resolution);
    unsigned char *bytes = NULL;
    int status = srnf_surface_triangulate((size_t)surface->lmax, surface->coefficients, resolution,
                                          &mesh, &normals);

    field.values = values;
    if (status == 0) {
        status = srnf_mesh_write(&mesh, srnf_mesh_format_from_name(format), normals, &field,
                                 values ? 1 : 0, &buffer);
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
        (void)problem_respond(call, problem_code_of(status), "%s.", srnf_strerror(status));
    }
    srnf_buffer_clear(&buffer);
    srnf_free(values);
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
        (void)snprintf(tag, sizeof tag, "%s.mesh.%zu.%s", surface.id, resolution, format);
        if (!respond_not_modified(call, tag)) {
            respond_mesh(call, &surface, format, resolution);
        }
    }
    store_surface_clear(&surface);
}
