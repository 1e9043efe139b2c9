/*
 * repair.c - the process repair: from a mesh that cannot be analysed to one that can, by what the
 * caller asks for and nothing else.
 *
 * Uploads stay as they were sent, and the problems of a mesh's report name the inputs here that
 * would mend it. The repaired mesh is another mesh (process_keep_mesh); where nothing was changed,
 * the result is the record of the one that was sent.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/meshes.h"
#include "api/respond.h"
#include "compute/prepared.h"
#include "store/mesh.h"
#include "toolkit/table.h"

#define LENGTH_MAX 1e12
#define SECONDS_A_FACE 2e-5
#define SECONDS_A_VOXEL 1e-6

struct repair {
    char mesh[STORE_ID_MAX];
    bool orient, islands, duplicates, degenerate;
    double merge, holes;
    long handles;
};

/* ---- The mesh, whatever its problems --------------------------------------------------------- */

static bool is_mesh_id(const char *id)
{
    return id && strncmp(id, "mesh-", 5) == 0 && strlen(id) == 37 &&
           strspn(id + 5, "0123456789abcdef") == 32;
}

static void read_mesh(struct process_inputs *inputs, const struct process_input *input)
{
    const char *id = json_string_value(json_object_get(inputs->given, input->name));
    struct store_mesh mesh = {0};
    int status;

    if (!is_mesh_id(id)) {
        problem_add(inputs->list, "/inputs/mesh",
                    "must be the id of a mesh: mesh- and 32 hexadecimal digits");
        return;
    }
    if (inputs->answered || inputs->shape_only) {
        return;
    }
    status = call_sees(inputs->call, id);
    if (status == 0) {
        status = store_mesh_get(inputs->call->api->config.store, id, &mesh);
    }
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-mesh", id);
        inputs->answered = true;
        return;
    }
    inputs->call->work.faces += mesh.faces;
    store_mesh_clear(&mesh);
    (void)json_object_set_new(inputs->canonical, input->name, json_string(id));
}

static bool type_mesh(const json_t *value, void *member)
{
    const char *id = json_string_value(value);

    return id && strlen(id) < STORE_ID_MAX && memcpy(member, id, strlen(id) + 1);
}

static const struct input_own mesh_own = {
    .schema = "\"type\":\"string\",\"pattern\":\"" PROCESS_MESH_PATTERN "\"",
    .read = read_mesh,
    .type = type_mesh,
    .refers = true,
};

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

#define AT(member) offsetof(struct repair, member)
static const struct process_input inputs[] = {
    {"mesh", INPUT_OWN, AT(mesh),
     "The mesh to repair, with problems in its report. One without problems is left as it is, "
     "whatever is asked for.",
     .required = true, .own = &mesh_own},
    {"orient", INPUT_BOOLEAN, AT(orient), "Turn faces so that all of them look outwards.",
     .fallback = 0},
    {"islands", INPUT_BOOLEAN, AT(islands),
     "Keep the component of the largest area. Faces that share an edge are of one component.",
     .fallback = 0},
    {"duplicates", INPUT_BOOLEAN, AT(duplicates),
     "Of faces with the same corners keep one, or none where they lie back to back and the surface "
     "is closed without them.",
     .fallback = 0},
    {"degenerate", INPUT_BOOLEAN, AT(degenerate), "Drop faces that name a point twice.",
     .fallback = 0},
    {"merge", INPUT_REAL, AT(merge),
     "Join vertices that are within this distance of each other, in the units of the mesh; the "
     "first "
     "one stays where it is. 0: only equal points are joined.",
     .lowest = 0, .highest = LENGTH_MAX},
    {"holes", INPUT_REAL, AT(holes),
     "Close holes of at most this perimeter, in the units of the mesh, and of at most 1000 edges, "
     "by "
     "the triangles of least area between their own vertices. 0: none.",
     .lowest = 0, .highest = LENGTH_MAX},
    {"handles", INPUT_INTEGER, AT(handles),
     "Cut handles or fill the tunnels through them, by way of a volume of so many voxels along the "
     "longest side of the mesh, 16 at least: the whole surface is made anew from it, and detail "
     "finer than a voxel is lost (see distance). 0: none.",
     .highest = SRNF_HANDLES_VOXELS_MAX},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"mesh", OUTPUT_OBJECT,
     "Record of the repaired mesh; its report says what is still wrong with it. Where nothing was "
     "changed, that of the mesh that was sent."},
    {"changes", OUTPUT_OBJECTS,
     "What was changed: code, count, element (face or vertex), first (its lowest number in the "
     "mesh "
     "that was sent, from 0, or null) and position in its units. Codes and what they count: "
     "equal-vertices-merged and near-vertices-merged, vertices; degenerate-faces-dropped, "
     "duplicate-faces-dropped and faces-turned, faces; islands-removed, components; holes-closed, "
     "holes; made-anew-from-voxels, vertices of the new surface; handle-cut, tunnel-filled, "
     "island-removed and cavity-filled, voxels, located where most of them are."},
    {"refused", OUTPUT_OBJECTS,
     "What was asked for and not done: as changes, and detail, which says why and what would help. "
     "Codes: one-sided, hole-too-long, hole-of-too-many-edges, holes-in-doubt, handles-in-doubt."},
    {"distance", OUTPUT_OBJECT,
     "Between the mesh that was sent and the repaired one, both ways, in its units: rms, weighted "
     "by "
     "area, and max. What was removed or added counts with its distance from what is left."},
    {NULL, NULL, NULL},
};

static void check(struct process_inputs *given)
{
    json_int_t voxels = json_integer_value(json_object_get(given->canonical, "handles"));

    if (voxels > 0 && voxels < SRNF_HANDLES_VOXELS_MIN) {
        problem_add(given->list, "/inputs/handles", "must be 0, or %d to %d voxels",
                    SRNF_HANDLES_VOXELS_MIN, SRNF_HANDLES_VOXELS_MAX);
    }
}

/* ---- Running --------------------------------------------------------------------------------- */

static int mend(struct jobs_run *run, const struct repair *repair, const struct srnf_mesh *mesh,
                struct srnf_mended *mended, struct srnf_mesh_distance *distance,
                struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    const struct srnf_mend_options options = {.orient = repair->orient,
                                              .islands = repair->islands,
                                              .duplicates = repair->duplicates,
                                              .degenerate = repair->degenerate,
                                              .merge = repair->merge,
                                              .holes = repair->holes};
    struct srnf_error error = {.element = -1};
    int status = srnf_mend(mesh, &options, context, mended, &error);

    if (status == SRNF_OK && repair->handles > 0) {
        status = srnf_mend_handles(mended->n_changes > 0 ? NULL : mesh, (size_t)repair->handles,
                                   context, mended, &error);
    }
    if (status < 0) {
        return compute_fail(result, status, &error, repair->mesh);
    }
    if (mended->n_changes > 0) {
        status = srnf_mesh_distance(mesh, &mended->mesh, context, distance);
    }
    return status < 0 ? compute_fail(result, status, NULL, repair->mesh) : 0;
}

static json_t *items_json(const struct srnf_mend_item *items, size_t n)
{
    json_t *list = json_array();

    for (size_t i = 0; i < n; i++) {
        const struct srnf_mend_item *item = &items[i];
        bool numbered = item->first >= 0, placed = isfinite(item->position[0]);
        const char *element = item->of_vertex ? "vertex" : "face";
        json_t *entry =
            json_pack("{s:s, s:I, s:s?, s:o, s:o}", "code", item->code, "count",
                      (json_int_t)item->count, "element", numbered ? element : NULL, "first",
                      numbered ? json_integer(item->first) : json_null(), "position",
                      placed ? json_vector(item->position, 3) : json_null());

        if (item->detail[0]) {
            (void)json_object_set_new(entry, "detail", json_string(item->detail));
        }
        (void)json_array_append_new(list, entry);
    }
    return list;
}

/* The record of the repaired mesh, under the name of the one that was sent; or of that. */
static json_t *keep(struct jobs_run *run, const struct repair *repair, struct store_mesh *row,
                    const struct srnf_mended *mended, struct jobs_result *result)
{
    struct mesh_description description = {.name = row->name, .mesh = &mended->mesh};

    if (mended->n_changes == 0) {
        return mesh_record(row);
    }
    description.source = process_source(run, "repair", repair->mesh, NULL);
    if (mesh_mirrored(row)) {
        (void)json_object_set_new(description.source, "mirrored", json_true());
    }
    return process_keep_mesh(run, &description, "the repaired mesh", result);
}

static json_t *run_repair(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct repair *repair = typed;
    struct store_mesh row = {0};
    struct srnf_mesh mesh = {.n_vertices = 0};
    struct srnf_mended mended = {.n_changes = 0};
    struct srnf_mesh_distance distance = {0.0, 0.0};
    json_t *record = NULL, *document = NULL;
    int status = store_mesh_get_as(jobs_run_store(run), jobs_run_owner(run), repair->mesh, &row);

    if (status) {
        (void)compute_fail_store(result, status, repair->mesh);
        goto out;
    }
    if (compute_mesh_read(run, repair->mesh, &mesh, result) == 0 &&
        mend(run, repair, &mesh, &mended, &distance, result) == 0) {
        record = keep(run, repair, &row, &mended, result);
    }
    if (record) {
        document = json_pack("{s:o, s:o, s:o, s:{s:o, s:o}}", "mesh", record, "changes",
                             items_json(mended.changes, mended.n_changes), "refused",
                             items_json(mended.refused, mended.n_refused), "distance", "rms",
                             json_finite(distance.rms), "max", json_finite(distance.max));
    }
out:
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&mesh);
    store_mesh_clear(&row);
    return document;
}

static double repair_seconds(const struct api_work *work, const json_t *canonical)
{
    double side = json_number_value(json_object_get(canonical, "handles"));

    return 0.1 + SECONDS_A_FACE * (double)work->faces + SECONDS_A_VOXEL * side * side * side;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct repair),
    .check = check,
    .run = run_repair,
};

const struct api_process repair_process = {
    .id = "repair",
    .title = "Repair a mesh",
    .description = "Mends what is asked for of a mesh that cannot be analysed, with every change "
                   "counted and located, and the distance between before and after.",
    .table = &table,
    .seconds = repair_seconds,
};
