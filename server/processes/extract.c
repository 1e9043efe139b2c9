/*
 * extract.c - the process extract: from labels of a stored volume to a closed mesh of genus zero.
 *
 * Labels that the volume does not have are refused at submission, without a job. The mesh is a mesh
 * like an uploaded one (process_keep_mesh), so that encode and all else take it by its id.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/respond.h"
#include "api/volumes.h"
#include "api/warnings.h"
#include "store/volume.h"
#include "toolkit/table.h"

#define LABELS_MAX 256
#define LABEL_MAX 9007199254740991.0
#define CHANGED_MOST 0.01 /* of the voxels: beyond it the mesh is in part the correction's */
/* Processor time of one worker for balls in volumes of 64^3, 128^3 and 200^3 voxels, on a machine
   of 2026: reading took 1.4e-8 s a voxel of the volume, the rest 1.4e-6 to 1.8e-6 s a voxel of the
   label where that has 100,000 of them or more. To measure again: POST such volumes and compare
   utime in /proc/PID/stat around each extract. */
#define SECONDS_A_VOXEL 1.5e-8
#define SECONDS_A_LABELLED 1.6e-6

struct labels {
    size_t n;
    int64_t values[LABELS_MAX];
};

struct extraction {
    char volume[STORE_ID_MAX];
    struct labels labels;
    long smoothing;
    int topology;
};

enum { CORRECT, REFUSE };
static const char *const topologies[] = {"correct", "refuse", NULL};

/* ---- Volume ---------------------------------------------------------------------------------- */

static bool is_volume_id(const char *id)
{
    return id && strncmp(id, "vol-", 4) == 0 && strlen(id) == 36 &&
           strspn(id + 4, "0123456789abcdef") == 32;
}

static void note_voxels(struct process_inputs *inputs, const struct store_volume *volume)
{
    json_t *record = volume_record(volume, false);
    const json_t *shape = json_object_get(record, "shape");
    double voxels = 1.0;

    for (size_t k = 0; k < 3; k++) {
        voxels *= json_number_value(json_array_get(shape, k));
    }
    inputs->call->work.voxels += (int64_t)voxels;
    json_decref(record);
}

static void read_volume(struct process_inputs *inputs, const struct process_input *input)
{
    const char *id = json_string_value(json_object_get(inputs->given, input->name));
    struct store_volume volume = {.id = ""};
    int status;

    if (!is_volume_id(id)) {
        problem_add(inputs->list, "/inputs/volume",
                    "must be the id of a volume: vol- and 32 hexadecimal digits");
        return;
    }
    if (inputs->answered || inputs->shape_only) {
        return;
    }
    status = call_sees(inputs->call, id);
    if (status == 0) {
        status = store_volume_get_as(inputs->call->api->config.store, NULL, id, &volume);
    }
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-volume", id);
        inputs->answered = true;
        return;
    }
    note_voxels(inputs, &volume);
    store_volume_clear(&volume);
    (void)json_object_set_new(inputs->canonical, input->name, json_string(id));
}

static bool type_volume(const json_t *value, void *member)
{
    const char *id = json_string_value(value);

    return id && strlen(id) < STORE_ID_MAX && memcpy(member, id, strlen(id) + 1);
}

static const struct input_own volume_own = {
    .schema = "\"type\":\"string\",\"pattern\":\"" PROCESS_VOLUME_PATTERN "\"",
    .read = read_volume,
    .type = type_volume,
    .refers = true,
};

/* ---- Labels ---------------------------------------------------------------------------------- */

static int compare_values(const void *a, const void *b)
{
    const int64_t *x = a, *y = b;

    return (*x > *y) - (*x < *y);
}

/* Sorted and each once: the union does not depend on their order. */
static void read_labels(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *array = json_object_get(inputs->given, input->name);
    size_t n = json_array_size(array);
    int64_t values[LABELS_MAX];
    json_t *canonical;

    if (!json_is_array(array) || n < 1 || n > LABELS_MAX) {
        problem_add(inputs->list, "/inputs/labels", "must be an array of 1 to %d labels",
                    LABELS_MAX);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        double value = json_number_value(json_array_get(array, i));

        if (!json_is_number(json_array_get(array, i)) ||
            !(value >= -LABEL_MAX && value <= LABEL_MAX) || (double)(int64_t)value < value ||
            (double)(int64_t)value > value || (int64_t)value == 0) {
            problem_add(inputs->list, "/inputs/labels",
                        "element %zu must be a whole number other than 0, which is background", i);
            return;
        }
        values[i] = (int64_t)value;
    }
    qsort(values, n, sizeof values[0], compare_values);
    canonical = json_array();
    for (size_t i = 0; i < n; i++) {
        if (i == 0 || values[i] != values[i - 1]) {
            (void)json_array_append_new(canonical, json_integer(values[i]));
        }
    }
    (void)json_object_set_new(inputs->canonical, input->name, canonical);
}

static bool type_labels(const json_t *value, void *member)
{
    struct labels *labels = member;

    labels->n = json_array_size(value);
    for (size_t i = 0; i < labels->n && i < LABELS_MAX; i++) {
        labels->values[i] = json_integer_value(json_array_get(value, i));
    }
    return labels->n > 0 && labels->n <= LABELS_MAX;
}

static const struct input_own labels_own = {
    .schema = "\"type\":\"array\",\"minItems\":1,\"maxItems\":256,\"items\":{\"type\":\"integer\","
              "\"minimum\":-9007199254740991,\"maximum\":9007199254740991,\"not\":{\"const\":0}}",
    .read = read_labels,
    .type = type_labels,
};

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

#define AT(member) offsetof(struct extraction, member)
static const struct process_input inputs[] = {
    {"volume", INPUT_OWN, AT(volume), "The label volume.", .required = true, .own = &volume_own},
    {"labels", INPUT_OWN, AT(labels),
     "Labels of the volume, whose voxels together are the structure. Their order does not matter.",
     .required = true, .own = &labels_own},
    {"smoothing", INPUT_INTEGER, AT(smoothing),
     "Passes of smoothing, which takes the steps of the voxels away; no point moves by more than a "
     "voxel, and the volume stays that of the voxels. 0: none.",
     .lowest = 0, .highest = SRNF_SMOOTHING_PASSES_MAX, .fallback = 30},
    {"topology", INPUT_CHOICE, AT(topology),
     "What is done where the voxels are not a ball: correct drops all but the largest component, "
     "fills cavities, and cuts handles or closes tunnels, whichever changes fewer voxels; refuse "
     "fails with not-genus-zero, and says where.",
     .choices = topologies},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"mesh", OUTPUT_OBJECT, "Record of the mesh, in world millimetres, faces outward."},
    {"changed", OUTPUT_OBJECT,
     "voxels that were changed for genus zero, added and removed of them; places found, and the "
     "100 "
     "largest of them as places: change (island-removed, cavity-filled, handle-cut, "
     "tunnel-filled), "
     "voxels, and position, the mean of their centres in world millimetres."},
    {"volumeChange", OUTPUT_NUMBER,
     "Volume of the mesh less that of its voxels after the changes, over the latter; within .001."},
    {"volume", OUTPUT_NUMBER, "Of the mesh, cubic millimetres."},
    {"voxels", OUTPUT_INTEGER, "Of the labels, as they are in the volume."},
    {"offset", OUTPUT_NUMBER,
     "Shift along the normals, in millimetres, that gave the volume back that smoothing took."},
    {"smoothing", OUTPUT_INTEGER,
     "Passes that were made: fewer than asked for where the structure is too thin for them."},
    {"crossings", OUTPUT_INTEGER,
     "Pairs of faces of the mesh that go through each other, for certain; 0 on a surface that does "
     "not cross itself."},
    {NULL, NULL, NULL},
};

/* Labels that the volume does not have. */
static void complete(struct process_inputs *given)
{
    const char *id = json_string_value(json_object_get(given->canonical, "volume"));
    const json_t *wanted = json_object_get(given->canonical, "labels");
    struct store_volume volume = {.id = ""};
    json_t *record;

    if (store_volume_get_as(given->call->api->config.store, NULL, id, &volume) != 0) {
        return; /* the job finds out */
    }
    record = volume_record(&volume, true);
    for (size_t i = 0; i < json_array_size(wanted); i++) {
        const json_t *labels = json_object_get(record, "labels");
        json_int_t value = json_integer_value(json_array_get(wanted, i));
        size_t n = 0;

        while (n < json_array_size(labels) &&
               json_integer_value(json_object_get(json_array_get(labels, n), "value")) != value) {
            n++;
        }
        given->call->work.labelled +=
            json_integer_value(json_object_get(json_array_get(labels, n), "voxels"));
        if (n == json_array_size(labels)) {
            problem_add(given->list, "/inputs/labels", "the volume has no label %lld",
                        (long long)value);
        }
    }
    json_decref(record);
    store_volume_clear(&volume);
}

/* ---- Running --------------------------------------------------------------------------------- */

static int load_volume(struct jobs_run *run, const char *id, struct srnf_volume *volume,
                       struct jobs_result *result)
{
    struct srnf_volume_limits limits = srnf_volume_limits_defaults();
    struct srnf_error error = {.element = -1};
    unsigned char *bytes = NULL;
    size_t size = 0;
    int status = store_volume_content(jobs_run_store(run), id, &bytes, &size);

    if (status) {
        return compute_fail_store(result, status, id);
    }
    limits.context = jobs_run_context(run);
    limits.max_memory = SIZE_MAX; /* that of the job is counted */
    status = srnf_volume_read(bytes, size, SRNF_VOLUME_UNKNOWN, &limits, volume, &error);
    free(bytes);
    return status < 0 ? compute_fail(result, status, &error, id) : 0;
}

static json_t *changes_json(const struct srnf_extracted *extracted)
{
    size_t listed = extracted->n_places < SRNF_PLACES_MAX ? extracted->n_places : SRNF_PLACES_MAX;
    json_t *places = json_array();

    for (size_t i = 0; i < listed; i++) {
        const struct srnf_changed_place *place = &extracted->places[i];

        (void)json_array_append_new(places, json_pack("{s:s, s:I, s:o}", "change",
                                                      srnf_change_name(place->change), "voxels",
                                                      (json_int_t)place->voxels, "position",
                                                      json_vector(place->position, 3)));
    }
    return json_pack("{s:I, s:I, s:I, s:I, s:o}", "voxels", (json_int_t)extracted->changed, "added",
                     (json_int_t)extracted->added, "removed", (json_int_t)extracted->removed,
                     "count", (json_int_t)extracted->n_places, "places", places);
}

/* "AAL: 77+78"; the labels alone where that is too long. */
static void make_name(struct jobs_run *run, const struct extraction *extraction, size_t size,
                      char *name)
{
    struct store_volume volume = {.id = ""};
    char labels[64] = "";
    size_t used = 0;

    for (size_t i = 0; i < extraction->labels.n && used < sizeof labels - 24; i++) {
        used += (size_t)snprintf(labels + used, sizeof labels - used, "%s%lld", i ? "+" : "",
                                 (long long)extraction->labels.values[i]);
    }
    if (process_read(store_volume_get_as(jobs_run_store(run), jobs_run_owner(run),
                                         extraction->volume, &volume)) &&
        volume.name && volume.name[0] && strlen(volume.name) + 72 < NAME_CHARACTERS_MAX) {
        (void)snprintf(name, size, "%s: %s", volume.name, labels);
    } else {
        (void)snprintf(name, size, "%s", labels);
    }
    store_volume_clear(&volume);
}

static json_t *keep_mesh(struct jobs_run *run, const struct extraction *extraction,
                         const struct srnf_extracted *extracted, struct jobs_result *result)
{
    json_t *source = process_source(run, "extract", NULL, NULL), *labels = json_array();
    char name[NAME_SIZE];
    struct mesh_description description = {
        .name = name, .mesh = &extracted->mesh, .source = source};

    for (size_t i = 0; i < extraction->labels.n; i++) {
        (void)json_array_append_new(labels, json_integer(extraction->labels.values[i]));
    }
    (void)json_object_set_new(source, "volume", json_string(extraction->volume));
    (void)json_object_set_new(source, "labels", labels);
    make_name(run, extraction, sizeof name, name);
    return process_keep_mesh(run, &description, "the mesh", result);
}

static void warn_of_changes(json_t *document, const struct srnf_extracted *extracted)
{
    size_t changed = extracted->added + extracted->removed;
    double share = (double)changed / (double)extracted->voxels;

    if (share > CHANGED_MOST) {
        warning_add(warnings_of(document), "topology-changed",
                    json_pack("{s:I, s:I, s:I}", "added", (json_int_t)extracted->added, "removed",
                              (json_int_t)extracted->removed, "voxels",
                              (json_int_t)extracted->voxels),
                    "%zu voxels were added and %zu removed to make the structure one of genus "
                    "zero, %.3g %% of its %zu. Look at the places in changed: correct the "
                    "segmentation there, or extract separate parts each by itself.",
                    extracted->added, extracted->removed, 100.0 * share, extracted->voxels);
    }
}

static void warn_of_crossings(json_t *document, const struct srnf_mesh_crossings *crossings)
{
    if (crossings->pairs == 0) {
        return;
    }
    warning_add(warnings_of(document), "self-crossing",
                json_pack("{s:I, s:[I, I], s:o}", "pairs", (json_int_t)crossings->pairs, "faces",
                          (json_int_t)crossings->faces[0], (json_int_t)crossings->faces[1],
                          "position", json_vector(crossings->position, 3)),
                "The surface goes through itself: %zu pairs of faces cross, the first near "
                "(%.4g, %.4g, %.4g). Smooth less, or correct the segmentation there.",
                crossings->pairs, crossings->position[0], crossings->position[1],
                crossings->position[2]);
}

static json_t *result_json(const struct srnf_extracted *extracted,
                           const struct srnf_mesh_crossings *crossings, json_t *mesh)
{
    json_t *document =
        json_pack("{s:o, s:o, s:o, s:o, s:I, s:o, s:I, s:I}", "mesh", mesh, "changed",
                  changes_json(extracted), "volumeChange",
                  json_finite(extracted->volume / extracted->voxel_volume - 1.0), "volume",
                  json_finite(extracted->volume), "voxels", (json_int_t)extracted->voxels, "offset",
                  json_finite(extracted->max_offset), "smoothing", (json_int_t)extracted->smoothing,
                  "crossings", (json_int_t)crossings->pairs);

    if (extracted->at_border) {
        warning_add(warnings_of(document), "label-at-border", NULL,
                    "The structure reaches the edge of the volume and was closed there: it may be "
                    "cut off, and the face along the edge is none of its own.");
    }
    warn_of_changes(document, extracted);
    warn_of_crossings(document, crossings);
    return document;
}

static json_t *run_extract(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct extraction *extraction = typed;
    const struct srnf_extract_options options = {.smoothing = (size_t)extraction->smoothing,
                                                 .strict = extraction->topology == REFUSE};
    struct srnf_extracted extracted = {.voxels = 0};
    struct srnf_error error = {.element = -1};
    struct srnf_volume volume = {.format = SRNF_VOLUME_UNKNOWN};
    struct srnf_mesh_crossings crossings;
    json_t *mesh = NULL, *document = NULL;

    if (load_volume(run, extraction->volume, &volume, result) == 0) {
        int status = srnf_extract(&volume, extraction->labels.values, extraction->labels.n,
                                  &options, jobs_run_context(run), &extracted, &error);

        if (status >= 0) {
            status = srnf_mesh_find_crossings(&extracted.mesh, jobs_run_context(run), &crossings);
        }
        if (status < 0) {
            (void)compute_fail(result, status, &error, extraction->volume);
        } else {
            mesh = keep_mesh(run, extraction, &extracted, result);
        }
    }
    srnf_volume_clear(&volume);
    if (mesh) {
        document = result_json(&extracted, &crossings, mesh);
    }
    srnf_extracted_clear(&extracted);
    return document;
}

static double extract_seconds(const struct api_work *work, const json_t *canonical)
{
    (void)canonical;
    return 0.05 + SECONDS_A_VOXEL * (double)work->voxels +
           SECONDS_A_LABELLED * (double)work->labelled;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct extraction),
    .complete = complete,
    .run = run_extract,
};

const struct api_process extract_process = {
    .id = "extract",
    .title = "Extract a mesh from a segmentation",
    .description =
        "From labels of a volume to a closed mesh of genus zero: topology corrected in the voxels, "
        "with every change located, anti-aliased within them, in world millimetres.",
    .table = &table,
    .seconds = extract_seconds,
};
