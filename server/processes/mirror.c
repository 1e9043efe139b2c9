/*
 * mirror.c - the process mirror: the mirror image of a mesh or a surface, with its faces or
 * parameters turned so that it looks outwards as before.
 *
 * A mesh is reflected in a plane through the origin of its own coordinates. A surface is reflected
 * in a plane through the origin of its stored, centred frame, and its sphere with it
 * (core/surface/mirror.c): by default only signs of coefficients change. Where it was goes to the
 * other side of the same plane through the origin of the input's coordinates, so that
 * space=original shows what the mirrored mesh would have become.
 *
 * What was made of a mirror image is one too: records say so (mirrored), and an image of an image
 * is none.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compute/mirror.h"
#include "compute/prepared.h"
#include "compute/seconds.h"
#include "store/mesh.h"
#include "store/surface.h"
#include "toolkit/routes.h"
#include "toolkit/table.h"

#define SECONDS_A_FACE 5e-6 /* as an upload: a thalamus of 6,000 faces took 0.03 s */
#define NORMAL_LEAST 1e-100
#define NORMAL_MOST 1e100

struct plane {
    double normal[3]; /* of length 1 */
};

struct mirroring {
    char mesh[STORE_ID_MAX], surface[STORE_ID_MAX];
    struct plane plane;
};

/* ---- Plane ----------------------------------------------------------------------------------- */

/* One spelling for each plane: the unit normal whose first component that is not 0 is positive,
   and that along x by its name. */
static json_t *canonical_plane(const double given[3])
{
    double length = hypot(hypot(given[0], given[1]), given[2]), normal[3];
    size_t first = given[0] != 0.0 ? 0 : given[1] != 0.0 ? 1 : 2;

    for (size_t k = 0; k < 3; k++) {
        normal[k] = (given[first] < 0.0 ? -given[k] : given[k]) / length + 0.0;
    }
    return normal[1] == 0.0 && normal[2] == 0.0 ? json_string("sagittal") : json_vector(normal, 3);
}

static void read_plane(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(value);
    const size_t shape[1] = {3};
    double normal[3], length;

    if (!value || (text && strcmp(text, "sagittal") == 0)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_string("sagittal"));
        return;
    }
    if (!json_is_array(value)) {
        problem_add(inputs->list, "/inputs/plane",
                    "must be \"sagittal\" or the three numbers of a normal");
        return;
    }
    if (!json_read_numbers(value, 1, shape, normal, inputs->list, "/inputs/plane")) {
        return;
    }
    length = hypot(hypot(normal[0], normal[1]), normal[2]);
    if (!(length >= NORMAL_LEAST && length <= NORMAL_MOST)) {
        problem_add(inputs->list, "/inputs/plane", "has a normal of length %g", length);
        return;
    }
    (void)json_object_set_new(inputs->canonical, input->name, canonical_plane(normal));
}

static bool type_plane(const json_t *value, void *member)
{
    struct plane *plane = member;

    *plane = (struct plane){.normal = {1.0, 0.0, 0.0}};
    for (size_t k = 0; json_is_array(value) && k < 3; k++) {
        plane->normal[k] = json_number_value(json_array_get(value, k));
    }
    return true;
}

static const struct input_own plane_own = {
    .schema = "\"oneOf\":[{\"type\":\"string\",\"enum\":[\"sagittal\"]},{\"type\":\"array\","
              "\"items\":{\"type\":"
              "\"number\"},\"minItems\":3,\"maxItems\":3}],\"default\":\"sagittal\"",
    .read = read_plane,
    .type = type_plane,
};

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

#define AT(member) offsetof(struct mirroring, member)
static const struct process_input inputs[] = {
    {"mesh", INPUT_MESH, AT(mesh), "The mesh to mirror; or surface instead.", .nullable = true,
     .unless = "surface"},
    {"surface", INPUT_SURFACE, AT(surface),
     "The surface to mirror; a mesh is encoded with the default options first.", .nullable = true},
    {"plane", INPUT_OWN, AT(plane),
     "The plane, through the origin: sagittal is x = 0, which takes left to right where x runs "
     "from "
     "one side of the body to the other, as in RAS and LPS coordinates; or a normal [x, y, z]. Of "
     "a mesh, in its own coordinates. Of a surface, in its stored frame, whose axes are those of "
     "its mesh unless it was registered to another; where it was (origin) is reflected in the same "
     "plane through the origin of the input's coordinates.",
     .own = &plane_own},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"mesh", OUTPUT_OBJECT_OR_NULL,
     "Record of the mirrored mesh, faces outward as they were; source names the one that was sent. "
     "null for a surface."},
    {"surface", OUTPUT_OBJECT_OR_NULL,
     "Record of the mirrored surface, orientation kept; source names the one that was sent, and "
     "mirrored says whether the image is one: that of a mirror image is none. null for a mesh."},
    {NULL, NULL, NULL},
};

static void check(struct process_inputs *given)
{
    const json_t *mesh = json_object_get(given->given, "mesh");
    const json_t *surface = json_object_get(given->given, "surface");

    if ((!mesh || json_is_null(mesh)) && (!surface || json_is_null(surface))) {
        problem_add(given->list, "/inputs/mesh", "a mesh or a surface is required");
    }
}

/* ---- Running --------------------------------------------------------------------------------- */

/* {"process", "job", "mesh", "plane", ..} of what is made. */
static json_t *source_of(struct jobs_run *run, const struct mirroring *mirroring, const char *mesh)
{
    json_t *source = process_source(run, "mirror", mesh, NULL);

    (void)json_object_set_new(source, "plane", canonical_plane(mirroring->plane.normal));
    return source;
}

static json_t *mirror_mesh(struct jobs_run *run, const struct mirroring *mirroring,
                           struct jobs_result *result)
{
    struct store_mesh row = {.name = NULL};
    struct srnf_mesh mesh = {.n_vertices = 0};
    struct mesh_description description = {.mesh = &mesh};
    json_t *record = NULL;
    int status = store_mesh_get_as(jobs_run_store(run), jobs_run_owner(run), mirroring->mesh, &row);

    if (status) {
        (void)compute_fail_store(result, status, mirroring->mesh);
    } else if (compute_mesh_read(run, mirroring->mesh, &mesh, result) == 0) {
        srnf_mesh_mirror_in(&mesh, mirroring->plane.normal);
        description.name = row.name;
        description.source = source_of(run, mirroring, mirroring->mesh);
        (void)json_object_set_new(description.source, "mirrored",
                                  json_boolean(!mesh_mirrored(&row)));
        record = process_keep_mesh(run, &description, "the mirrored mesh", result);
    }
    srnf_mesh_clear(&mesh);
    store_mesh_clear(&row);
    return record;
}

/* x = scale R' f + origin becomes the reflection of itself in the plane whose normal is R' n. */
static void reflect_place(struct surface_place *place, const double normal[3])
{
    double own[3], along = 0.0;

    for (size_t k = 0; k < 3; k++) {
        own[k] = place->rotation[k] * normal[0] + place->rotation[3 + k] * normal[1] +
                 place->rotation[6 + k] * normal[2];
        along += 2.0 * own[k] * place->origin[k];
    }
    for (size_t k = 0; k < 3; k++) {
        place->origin[k] = place->origin[k] - along * own[k] + 0.0;
    }
}

/* False: their grid has no image on itself, and without their image the maps are left out. */
static bool reflect_maps(struct store_maps *maps)
{
    if (maps->n_phi % 2 != 0) {
        return false;
    }
    compute_mirror_columns(maps->count * (size_t)maps->n_theta, (size_t)maps->n_phi, maps->values);
    return true;
}

/* What the record of a stored surface tells that its mirror image keeps. */
struct kept {
    struct store_surface row; /* of a mesh, empty but for its name */
    struct store_maps maps;
    json_t *record;
    double smoothing;
};

/* False with the problem set. */
static bool read_kept(struct jobs_run *run, const char *id, struct kept *kept,
                      struct jobs_result *result)
{
    struct store *store = jobs_run_store(run);
    int status;

    *kept = (struct kept){.record = NULL};
    if (compute_is_mesh(id)) {
        struct store_mesh mesh = {.name = NULL};

        status = store_mesh_get_as(store, jobs_run_owner(run), id, &mesh);
        kept->row.name = mesh.name;
        mesh.name = NULL;
        store_mesh_clear(&mesh);
        return status == STORE_OK || compute_fail_store(result, status, id) == STORE_OK;
    }
    status = store_surface_get_as(store, jobs_run_owner(run), id, false, &kept->row);
    if (status == STORE_OK) {
        kept->record = json_loads(kept->row.record ? kept->row.record : "{}", 0, NULL);
        status = store_surface_maps(store, id, &kept->maps);
        status = status == STORE_NOT_FOUND ? STORE_OK : status;
    }
    if (status) {
        (void)compute_fail_store(result, status, id);
    }
    return status == STORE_OK;
}

static void clear_kept(struct kept *kept)
{
    json_decref(kept->record);
    store_maps_clear(&kept->maps);
    store_surface_clear(&kept->row);
}

static json_t *keep_image(struct jobs_run *run, const struct mirroring *mirroring,
                          struct compute_surface *image, struct kept *kept,
                          struct jobs_result *result)
{
    const char *id = mirroring->surface, *ids[1] = {id};
    const json_t *smoothing = json_object_get(kept->record, "smoothing");
    const char *mesh =
        compute_is_mesh(id)
            ? id
            : json_string_value(json_object_get(json_object_get(kept->record, "source"), "mesh"));
    struct surface_place place = process_place(run, image);
    struct srnf_surface_measures measures;
    struct surface_description description = {
        .name = kept->row.name,
        .degree = image->degree,
        .coefficients = image->coefficients,
        .scale = process_scale(run, id, image->scale),
        .measures = &measures,
        .parameterization = "inherited",
        .route = routes_common(run, 1, ids, NULL),
        .mirrored = !process_mirrored(run, id),
        .smoothing = smoothing ? &kept->smoothing : NULL,
        .maps = kept->maps.count > 0 && reflect_maps(&kept->maps) ? &kept->maps : NULL,
        .warnings = process_doubts(run),
    };

    kept->smoothing = json_number_value(smoothing);
    if (place.known) {
        reflect_place(&place, mirroring->plane.normal);
        description.origin = place.origin;
        description.rotation = place.rotation;
        description.frame_mesh = place.mesh;
        description.frame = process_frame(
            run, id, &place,
            surface_frame_json(id, "The coordinates that the mirrored surface came from; the image "
                                   "lies on the other side of the plane through their origin that "
                                   "it was reflected in."));
    }
    if (compute_measure(run, image->degree, 1, image->coefficients, &measures, result)) {
        json_decref(description.warnings);
        json_decref(description.frame);
        return NULL;
    }
    description.source = source_of(run, mirroring, mesh);
    if (!compute_is_mesh(id)) {
        (void)json_object_set_new(description.source, "surface", json_string(id));
    }
    return process_keep_surface(run, &description, "the mirrored surface", result);
}

static json_t *mirror_surface(struct jobs_run *run, const struct mirroring *mirroring,
                              struct jobs_result *result)
{
    struct compute_surface image;
    struct kept kept;
    json_t *record = NULL;

    if (!read_kept(run, mirroring->surface, &kept, result)) {
        clear_kept(&kept);
        return NULL;
    }
    if (compute_surface_load(run, mirroring->surface, 90.0, &image, result) == 0) {
        jobs_run_phase(run, 100.0);
        srnf_surface_mirror_in(image.degree, image.coefficients, mirroring->plane.normal);
        record = keep_image(run, mirroring, &image, &kept, result);
    }
    compute_surface_clear(&image);
    clear_kept(&kept);
    return record;
}

static json_t *run_mirror(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct mirroring *mirroring = typed;
    bool of_mesh = mirroring->mesh[0] != '\0';
    json_t *record =
        of_mesh ? mirror_mesh(run, mirroring, result) : mirror_surface(run, mirroring, result);

    return record ? json_pack("{s:o, s:o}", of_mesh ? "mesh" : "surface", record,
                              of_mesh ? "surface" : "mesh", json_null())
                  : NULL;
}

static double mirror_seconds(const struct api_work *work, const json_t *canonical)
{
    bool encodes = !json_is_null(json_object_get(canonical, "surface")) && work->meshes > 0;

    return 0.02 + SECONDS_A_FACE * (double)work->faces +
           (encodes ? seconds_of_encodings((double)work->degree, 1.0, (double)work->faces) : 0.0);
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct mirroring),
    .check = check,
    .run = run_mirror,
};

const struct api_process mirror_process = {
    .id = "mirror",
    .title = "Mirror a mesh or a surface",
    .description = "The mirror image of a mesh or a surface, orientation kept, so that left and "
                   "right structures compare.",
    .table = &table,
    .seconds = mirror_seconds,
};
