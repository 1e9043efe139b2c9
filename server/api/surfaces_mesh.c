/*
 * surfaces_mesh.c - GET /v1/surfaces/{id}/mesh: the surface as triangles over a geodesic sphere,
 * with exact normals, in a format for viewing.
 *
 * With ?space=normalized, the default, coordinates are those of the surface as stored; with
 * ?space=original they are those of what it came from, x = scale R' f + origin of its record. One
 * that never was anywhere, such as a mean, gets back its scale alone. The file says which it is. A
 * surface whose source names a reference (those of a geodesic,
 * deformed from its first) carries the scalar field "deformation": at each vertex, the distance
 * to the point of the reference with the same parameter. Maps that were stored with the surface
 * (significance and effect of a comparison) ride along, interpolated between their nodes.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/mesh_export.h"
#include "api/respond.h"
#include "api/routes.h"
#include "api/surfaces.h"
#include "api/surfaces_grid.h"
#include "compute/compute.h"
#include "store/surface.h"

static bool refuse(struct api_call *call, const char *pointer, const char *detail)
{
    struct problem_list list = {.errors = NULL};

    problem_add(&list, pointer, "%s", detail);
    (void)problem_respond_list(call, "invalid-input", &list);
    return false;
}

/* ?space=: whether the units and place of the input are asked for. False when a problem was
   answered. */
static bool choose_space(struct api_call *call, bool *original)
{
    bool refused = false;
    char text[16];

    *original = false;
    if (!query_get(call, "space", text, sizeof text, &refused)) {
        return !refused;
    }
    *original = strcmp(text, "original") == 0;
    return *original || strcmp(text, "normalized") == 0
               ? true
               : refuse(call, "/space", "space must be original or normalized");
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
    size_t count, n_vertices;
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

/* What the maps of this name are; unknown ones have no unit. */
static const struct {
    const char *name, *unit, *meaning;
} meanings[] = {
    {"deformation", "length", "distance to the point of the reference with the same parameter"},
    {"significance", "1", "p-value of a difference here, corrected for all points of the map"},
    {"fdr", "1", "least false discovery rate at which the difference here is found"},
    {"effect", "length", "length of the difference here: of two means, or within subjects"},
    {"normalEffect", "length", "the difference along the outward normal, outward positive"},
    {"pointwiseP", "1", "p-value of a difference here, not corrected"},
    {"statistic", "1", "statistic of the test here"},
    {"standardError", "length", "standard error of the displacement along the outward normal here"},
    {"confidence", "length", "half the width of the region of confidence here"},
    {"deviation", "length", "along the outward normal, from what is expected here"},
    {"spread", "length", "standard deviation here of members that were left out"},
    {"zScore", "1", "deviation here in standard deviations of members that were left out"},
};

void surface_map_meaning(const char *name, const char **unit, const char **meaning)
{
    for (size_t k = 0; k < sizeof meanings / sizeof meanings[0]; k++) {
        if (strcmp(name, meanings[k].name) == 0) {
            *unit = meanings[k].unit;
            *meaning = meanings[k].meaning;
        }
    }
}

/* The names, units and meanings of the fields; lengths are in the space of the coordinates. */
static void describe_riders(struct riders *riders, bool original, const double scale)
{
    for (size_t i = 0; i < riders->count; i++) {
        struct srnf_mesh_field *field = &riders->fields[i];

        surface_map_meaning(field->name, &field->unit, &field->meaning);
        if (original && strcmp(field->name, "deformation") == 0) {
            for (size_t v = 0; v < riders->n_vertices; v++) {
                riders->values[i][v] *= scale;
            }
        }
    }
}

/* x = scale R' f + origin; normals are turned. */
static void put_in_place(const struct surface_place *place, struct srnf_mesh *mesh, double *normals)
{
    const double *r = place->rotation;

    for (size_t i = 0; i < mesh->n_vertices; i++) {
        double *v = mesh->vertices + 3 * i, *n = normals + 3 * i;
        const double f[3] = {v[0], v[1], v[2]}, m[3] = {n[0], n[1], n[2]};

        for (size_t k = 0; k < 3; k++) {
            v[k] =
                place->scale * (r[k] * f[0] + r[3 + k] * f[1] + r[6 + k] * f[2]) + place->origin[k];
            n[k] = r[k] * m[0] + r[3 + k] * m[1] + r[6 + k] * m[2];
        }
    }
}

#define COMMENT_MAX 400

/* What the file says of units and place. */
static void write_comment(const struct store_surface *surface, const struct surface_place *place,
                          bool original, char comment[COMMENT_MAX])
{
    const char *text =
        !original ? "as stored: centred and scaled; the record has scale, origin and rotation"
        : !place->known
            ? "units of the input; the surface never had a place: its centroid stays where it is"
        : surface_record_mirrored(surface) ? "units and place of the input, as its mirror image"
                                           : "units, place and orientation of the input";
    char frame[300] = "";

    if (original && place->known) {
        surface_record_frame(surface, frame, sizeof frame);
    }
    (void)snprintf(comment, COMMENT_MAX, "%s%s%s", text, frame[0] ? ". " : "", frame);
}

static void respond_mesh(struct api_call *call, const struct store_surface *surface,
                         const struct mesh_export *choice, size_t resolution, bool original)
{
    const struct surface_place place = surface_record_place(surface);
    char comment[COMMENT_MAX];
    const struct srnf_mesh_description description = {
        .name = surface->id,
        .space = original ? "original" : "normalized",
        .comment = comment,
    };
    struct srnf_mesh mesh = {0}, sphere = {0};
    struct riders riders = {.count = 0};
    double *normals = NULL;
    int status = srnf_surface_triangulate((size_t)surface->lmax, surface->coefficients, resolution,
                                          &mesh, &normals);

    write_comment(surface, &place, original, comment);
    riders.n_vertices = mesh.n_vertices;
    if (status == 0 && srnf_mesh_icosphere(resolution, &sphere) == 0) {
        add_deformation(call, surface, &sphere, &riders);
        add_maps(call, surface, &sphere, &riders);
        describe_riders(&riders, original, place.scale);
        srnf_mesh_clear(&sphere);
    }
    if (status == 0) {
        if (original) {
            put_in_place(&place, &mesh, normals);
        }
        mesh_export_respond(call, choice, surface->id, &mesh, normals, riders.fields, riders.count,
                            &description);
    } else {
        (void)problem_respond(call, compute_problem_code(status), "%s.", srnf_strerror(status));
    }
    clear_riders(&riders);
    srnf_free(normals);
    srnf_mesh_clear(&mesh);
}

void surfaces_mesh(struct api_call *call)
{
    struct store_surface surface = {0};
    struct mesh_export choice;
    char tag[STORE_ID_MAX + 96];
    bool original;
    size_t resolution;
    int status;

    if (!mesh_export_choose(call, &choice) || !choose_space(call, &original)) {
        return;
    }
    status = store_surface_get_as(call->api->config.store, call->request->caller.name,
                                  call->parameters[0], true, &surface);
    if (status) {
        (void)problem_respond_store(call, status, "no-such-surface", call->parameters[0]);
        return;
    }
    resolution = mesh_export_resolution(call, (size_t)surface.lmax);
    if (resolution) {
        (void)api_response_header_text(call->response, "Vary", "Accept");
        (void)snprintf(tag, sizeof tag, "%s.mesh.%zu.%s%s", surface.id, resolution, choice.format,
                       original ? ".original" : "");
        if (!respond_not_modified(call, tag)) {
            respond_mesh(call, &surface, &choice, resolution, original);
        }
    }
    store_surface_clear(&surface);
}
