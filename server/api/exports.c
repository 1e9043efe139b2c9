/*
 * exports.c - GET /v1/cohorts/{name}/export and /v1/models/{id}/export: a study as one zip.
 *
 * The zip is written into a file of the data directory that has no name, one entry after another,
 * and sent from there: in memory is one mesh, surface, model or result at a time. It is dated by
 * the newest that is in it, so that the same study is the same bytes: their digest is its entity
 * tag, and who was cut off asks for the rest of them (transmit.c). What is in it:
 *
 *   srnfd-study.json          what an import restores it from: ids, records, options, times, builds
 *   ro-crate-metadata.json    the same for people and archives (RO-Crate 1.1, JSON-LD)
 *   cohort.csv                the members
 *   volumes/ID.FORMAT         the segmentations that meshes were extracted from, as they were sent
 *   meshes/ID.FORMAT          the bytes that were uploaded
 *   surfaces/ID.npz, ID.ply   coefficients and maps; a mesh of it
 *   models/ID.npz, ID-scores.csv
 *   jobs/ID.json, ID.csv      results as they were answered; a table where the process has one
 */
#include "api/cohorts.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "api/auth.h"
#include "api/json_memory.h"
#include "api/models.h"
#include "api/npy.h"
#include "api/respond.h"
#include "api/routes.h"
#include "api/study.h"
#include "api/surfaces.h"
#include "api/zip.h"
#include "srnf.h"
#include "store/cohort.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/store.h"
#include "store/surface.h"
#include "store/volume.h"

#define PLY_QUERY "format=ply"

struct export
{
    struct study study;
    struct zip_writer zip;
    json_t *manifest, *graph, *parts;
    const struct store_cohort *cohort; /* NULL: of a model */
};

static struct store *store_of(const struct export *export)
{
    return export->study.call->api->config.store;
}

/* Notes a failure of the store; true where there is none. */
static bool good(struct export *export, int status)
{
    if (status != STORE_OK && export->study.status == STORE_OK) {
        export->study.status = status;
    }
    return status == STORE_OK;
}

/* ---- The metadata ---------------------------------------------------------------------------- */

static void describe_file(struct export *export, const char *path, const char *name,
                          const char *type)
{
    (void)json_array_append_new(export->graph,
                                json_pack("{s:s, s:s, s:s, s:s}", "@id", path, "@type", "File",
                                          "name", name[0] ? name : path, "encodingFormat", type));
    (void)json_array_append_new(export->parts, json_pack("{s:s}", "@id", path));
}

/* What made the results of a job. */
static void describe_job(struct export *export, const struct store_job *job, const char *path)
{
    char id[STORE_ID_MAX + 2];
    json_t *ends = json_time(job->finished_ms);

    (void)snprintf(id, sizeof id, "#%s", job->id);
    (void)json_array_append_new(
        export->graph,
        json_pack("{s:s, s:s, s:s, s:{s:s}, s:{s:s}, s:s, s:o}", "@id", id, "@type", "CreateAction",
                  "name", job->process, "instrument", "@id", "#srnfd", "result", "@id", path,
                  "description", job->inputs ? job->inputs : "", "endTime", ends));
}

static json_t *crate(struct export *export, const char *name)
{
    json_t *graph = json_array();

    (void)json_array_append_new(
        graph, json_pack("{s:s, s:s, s:{s:s}, s:{s:s}}", "@id", "ro-crate-metadata.json", "@type",
                         "CreativeWork", "conformsTo", "@id", "https://w3id.org/ro/crate/1.1",
                         "about", "@id", "./"));
    (void)json_array_append_new(
        graph,
        json_pack("{s:s, s:s, s:s, s:s, s:O, s:O}", "@id", "./", "@type", "Dataset", "name", name,
                  "description",
                  "A study of surfaces by square-root normal fields, as srnfd exported it; POST "
                  "/v1/imports restores it.",
                  "datePublished", json_object_get(export->manifest, "created"), "hasPart",
                  export->parts));
    (void)json_array_append_new(graph, json_pack("{s:s, s:s, s:s, s:s}", "@id", "#srnfd", "@type",
                                                 "SoftwareApplication", "name", "srnfd", "version",
                                                 SRNF_VERSION));
    (void)json_array_extend(graph, export->graph);
    return json_pack("{s:s, s:o}", "@context", "https://w3id.org/ro/crate/1.1/context", "@graph",
                     graph);
}

/* ---- What is listed -------------------------------------------------------------------------- */

static void list(struct export *export, const char *kind, json_t *entry)
{
    json_t *all = json_object_get(export->manifest, kind);

    (void)json_array_append_new(all, entry);
}

/* What files of this kind are called by. */
static const char *ending_of(struct export *export, const struct store_volume *volume)
{
    json_t *record = json_loads(volume->record ? volume->record : "{}", 0, NULL);
    const char *format = json_string_value(json_object_get(record, "format"));
    bool nifti = format && strcmp(format, "nifti") == 0, packed = false;
    unsigned char *bytes;
    size_t size;

    if (nifti && good(export, store_volume_content(store_of(export), volume->id, &bytes, &size))) {
        packed = size > 2 && bytes[0] == 0x1f && bytes[1] == 0x8b;
        free(bytes);
    }
    json_decref(record);
    return nifti ? (packed ? ".nii.gz" : ".nii") : ".nrrd";
}

static void list_volume(struct export *export, const char *id)
{
    struct store_volume volume;
    char path[STORE_ID_MAX + 32];

    if (!good(export, store_volume_get_as(store_of(export), export->study.owner, id, &volume))) {
        return;
    }
    (void)snprintf(path, sizeof path, "volumes/%s%s", id, ending_of(export, &volume));
    list(export, "volumes",
         json_pack("{s:s, s:s, s:s, s:s, s:o}", "id", id, "tags", volume.tags ? volume.tags : "[]",
                   "name", volume.name ? volume.name : "", "file", path, "created",
                   json_time(volume.created_ms)));
    describe_file(export, path, volume.name ? volume.name : "", "application/octet-stream");
    store_volume_clear(&volume);
}

static void list_mesh(struct export *export, const char *id)
{
    struct store_mesh mesh;
    char path[STORE_ID_MAX + 32];

    if (!good(export, store_mesh_get_as(store_of(export), export->study.owner, id, &mesh))) {
        return;
    }
    (void)snprintf(path, sizeof path, "meshes/%s.%.16s", id, mesh.format);
    list(export, "meshes",
         json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:o}", "id", id, "tags",
                   mesh.tags ? mesh.tags : "[]", "name", mesh.name, "format", mesh.format, "source",
                   mesh.source ? mesh.source : "", "file", path, "created",
                   json_time(mesh.created_ms)));
    describe_file(export, path, mesh.name, mesh_media_type(mesh.format));
    store_mesh_clear(&mesh);
}

static void list_surface(struct export *export, const char *id)
{
    struct store_surface surface;
    struct store_maps maps;
    char digest[65], path[STORE_ID_MAX + 32];
    json_t *names = json_array();
    int status;

    if (!good(export,
              store_surface_get_as(store_of(export), export->study.owner, id, false, &surface))) {
        json_decref(names);
        return;
    }
    status = store_surface_maps(store_of(export), id, &maps);
    if (status != STORE_NOT_FOUND) {
        (void)good(export, status);
    }
    for (size_t i = 0; i < maps.count; i++) {
        (void)json_array_append_new(names, json_string(maps.names[i]));
    }
    store_sha256_hex(digest, surface.record, strlen(surface.record));
    (void)snprintf(path, sizeof path, "surfaces/%s.npz", id);
    list(export, "surfaces",
         json_pack("{s:s, s:s, s:s, s:s, s:I, s:s, s:s, s:o, s:I, s:I, s:o}", "id", id, "tags",
                   surface.tags ? surface.tags : "[]", "sha256", digest, "name", surface.name,
                   "lmax", (json_int_t)surface.lmax, "record", surface.record, "file", path, "maps",
                   names, "nTheta", (json_int_t)maps.n_theta, "nPhi", (json_int_t)maps.n_phi,
                   "created", json_time(surface.created_ms)));
    describe_file(export, path, surface.name, "application/x-npz");
    (void)snprintf(path, sizeof path, "surfaces/%s.ply", id);
    describe_file(export, path, surface.name, "model/ply");
    store_maps_clear(&maps);
    store_surface_clear(&surface);
}

static void list_model(struct export *export, const char *id)
{
    struct store_model model;
    char path[STORE_ID_MAX + 32];

    if (!good(export, store_model_get_as(store_of(export), export->study.owner, id, 0, &model))) {
        return;
    }
    (void)snprintf(path, sizeof path, "models/%s.npz", id);
    list(export, "models",
         json_pack("{s:s, s:s, s:s, s:s, s:s, s:I, s:I, s:I, s:I, s:I, s:s, s:o}", "id", id, "name",
                   model.name ? model.name : "", "tags", model.tags ? model.tags : "[]", "mean",
                   model.mean, "record", model.record, "lmax", (json_int_t)model.lmax, "nTheta",
                   (json_int_t)model.n_theta, "nPhi", (json_int_t)model.n_phi, "subjects",
                   (json_int_t)model.subjects, "components", (json_int_t)model.components, "file",
                   path, "created", json_time(model.created_ms)));
    describe_file(export, path, id, "application/x-npz");
    (void)snprintf(path, sizeof path, "models/%s-scores.csv", id);
    describe_file(export, path, id, "text/csv");
    store_model_clear(&model);
}

/* What random numbers began with, where the process draws some; NULL: it does not. */
static json_t *seed_of(const char *text)
{
    size_t length = text ? strlen(text) : 0;
    json_t *inputs = text && strstr(text, "\"seed\"") ? json_loadb(text, length, 0, NULL) : NULL;
    json_t *seed = json_incref(json_object_get(inputs, "seed"));

    json_decref(inputs);
    return seed;
}

static void list_job(struct export *export, const char *id)
{
    struct store_job job;
    char digest[65], asked[65], *results;
    size_t size;
    char path[STORE_ID_MAX + 32];

    if (!good(export, store_job_get(store_of(export), id, &job))) {
        return;
    }
    if (!good(export, store_job_results(store_of(export), id, &results, &size))) {
        store_job_clear(&job);
        return;
    }
    store_sha256_hex(digest, results, size);
    free(results);
    study_job_digest(asked, job.process, job.numeric_build, job.inputs);
    (void)snprintf(path, sizeof path, "jobs/%s.json", id);
    list(export, "jobs",
         json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:s, s:s, s:s, s:o*, s:I, s:I, s:I}", "id", id,
                   "sha256", digest, "askedSha256", asked, "name", job.name ? job.name : "", "tags",
                   job.tags ? job.tags : "[]", "process", job.process, "inputs", job.inputs,
                   "numericBuild", job.numeric_build, "file", path, "seed", seed_of(job.inputs),
                   "createdMs", (json_int_t)job.created_ms, "startedMs", (json_int_t)job.started_ms,
                   "finishedMs", (json_int_t)job.finished_ms));
    describe_file(export, path, job.process, "application/json");
    describe_job(export, &job, path);
    store_job_clear(&job);
}

/* ---- Contents -------------------------------------------------------------------------------- */

/* What a handler of this service answers with to a GET with this query, as a file, where it has an
   answer. */
static void add_answer(struct export *export, api_handler *handler, const char *id,
                       const char *query, const char *path)
{
    const struct api_request *request = export->study.call->request;
    struct api_request one = {.method = "GET", .path = "", .caller = request->caller};
    struct api_response response = {.status = 0};
    struct api_call call = {.api = export->study.call->api,
                            .request = &one,
                            .response = &response,
                            .parameters = {id, "", "", ""}};

    one.query = query;
    handler(&call);
    if (response.status == 200 && response.body) {
        zip_add(&export->zip, path, response.body, response.body_size);
    }
    api_response_clear(&response);
}

static void add_array(struct zip_writer *npz, const char *name, const double *values, size_t n,
                      const size_t *shape)
{
    unsigned char *bytes;
    size_t size;

    if (npy_write(values, n, shape, &bytes, &size) == 0) {
        zip_add(npz, name, bytes, size);
        free(bytes);
    } else {
        npz->failed = true;
    }
}

/* A .npz that is made in memory. */
struct npz {
    struct zip_writer zip;
    FILE *out;
    char *bytes;
    size_t size;
};

static bool npz_open(struct npz *npz)
{
    *npz = (struct npz){.bytes = NULL};
    npz->out = open_memstream(&npz->bytes, &npz->size);
    return npz->out && zip_open(&npz->zip, npz->out, false);
}

static void npz_add_to(struct npz *npz, struct export *export, const char *path)
{
    bool whole = npz->out && zip_close(&npz->zip);

    if (npz->out && fclose(npz->out) == 0 && whole) {
        zip_add(&export->zip, path, npz->bytes, npz->size);
    } else {
        export->zip.failed = true;
    }
    free(npz->bytes);
}

static void add_surface(struct export *export, const char *id, const char *path)
{
    struct store_surface surface;
    struct store_maps maps;
    struct npz npz;
    char other[STORE_ID_MAX + 32];

    if (!good(export,
              store_surface_get_as(store_of(export), export->study.owner, id, true, &surface))) {
        return;
    }
    (void)store_surface_maps(store_of(export), id, &maps);
    if (npz_open(&npz)) {
        const size_t shape[2] = {3, (size_t)((surface.lmax + 1) * (surface.lmax + 1))};
        const size_t map_shape[3] = {maps.count, (size_t)maps.n_theta, (size_t)maps.n_phi};

        add_array(&npz.zip, "coefficients.npy", surface.coefficients, 2, shape);
        if (maps.count) {
            add_array(&npz.zip, "maps.npy", maps.values, 3, map_shape);
        }
    }
    npz_add_to(&npz, export, path);
    store_maps_clear(&maps);
    store_surface_clear(&surface);
    (void)snprintf(other, sizeof other, "surfaces/%s.ply", id);
    add_answer(export, surfaces_mesh, id, PLY_QUERY, other);
}

static const char *const array_files[STORE_MODEL_ARRAYS] = {
    [STORE_MODEL_MEAN_Q] = "mean_q.npy",           [STORE_MODEL_MODES] = "modes.npy",
    [STORE_MODEL_EIGENVALUES] = "eigenvalues.npy", [STORE_MODEL_SCORES] = "scores.npy",
    [STORE_MODEL_CALIBRATION] = "calibration.npy",
};

const char *study_array_file(size_t array)
{
    return array_files[array];
}

static void add_model(struct export *export, const char *id, const char *path)
{
    struct store_model model;
    struct npz npz;
    char other[STORE_ID_MAX + 32];

    if (!good(export, store_model_get_as(store_of(export), export->study.owner, id,
                                         (1u << STORE_MODEL_ARRAYS) - 1, &model))) {
        return;
    }
    if (npz_open(&npz)) {
        for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
            const size_t count = store_model_count(&model, (enum store_model_array)i);

            if (model.arrays[i]) {
                add_array(&npz.zip, array_files[i], model.arrays[i], 1, &count);
            }
        }
    }
    npz_add_to(&npz, export, path);
    store_model_clear(&model);
    (void)snprintf(other, sizeof other, "models/%s-scores.csv", id);
    add_answer(export, models_scores, id, "format=csv", other);
}

static void add_mesh(struct export *export, const char *id, const char *path)
{
    unsigned char *bytes;
    size_t size;

    if (good(export, store_mesh_content(store_of(export), id, &bytes, &size))) {
        zip_add(&export->zip, path, bytes, size);
        free(bytes);
    }
}

static void add_volume(struct export *export, const char *id, const char *path)
{
    unsigned char *bytes;
    size_t size;

    if (good(export, store_volume_content(store_of(export), id, &bytes, &size))) {
        zip_add(&export->zip, path, bytes, size);
        free(bytes);
    }
}

static void add_job(struct export *export, const char *id, const char *path)
{
    char *results, other[STORE_ID_MAX + 32];
    size_t size;

    if (good(export, store_job_results(store_of(export), id, &results, &size))) {
        zip_add(&export->zip, path, results, size);
        free(results);
        (void)snprintf(other, sizeof other, "jobs/%s.csv", id);
        add_answer(export, jobs_results, id, "format=csv", other);
    }
}

/* ---- The whole ------------------------------------------------------------------------------- */

static const struct {
    const char *prefix, *kind;
    void (*list)(struct export *export, const char *id);
    void (*add)(struct export *export, const char *id, const char *path);
} kinds[] = {
    {"vol-", "volumes", list_volume, add_volume}, /* before the meshes that need them */
    {"mesh-", "meshes", list_mesh, add_mesh},     {"surf-", "surfaces", list_surface, add_surface},
    {"model-", "models", list_model, add_model},  {"job-", "jobs", list_job, add_job},
};
#define KINDS (sizeof kinds / sizeof kinds[0])

/* When an entry of the manifest was made (new reference). */
static json_t *time_of(const json_t *entry)
{
    const json_t *finished = json_object_get(entry, "finishedMs"); /* of a job */

    return finished ? json_time(json_integer_value(finished))
                    : json_incref(json_object_get(entry, "created"));
}

/* When the newest of what is listed was made, or the cohort itself (new reference). Times are in
   the order of their texts. */
static json_t *newest(const struct export *export)
{
    json_t *last = json_time(export->cohort ? export->cohort->created_ms : 1);

    for (size_t i = 0; i < KINDS; i++) {
        const json_t *all = json_object_get(export->manifest, kinds[i].kind);

        for (size_t k = 0; k < json_array_size(all); k++) {
            json_t *time = time_of(json_array_get(all, k));
            const char *text = json_string_value(time), *before = json_string_value(last);

            if (text && before && strcmp(text, before) > 0) {
                json_decref(last);
                last = json_incref(time);
            }
            json_decref(time);
        }
    }
    return last;
}

/* Lists what was gathered, in the order in which it is restored. */
static void make_manifest(struct export *export)
{
    const char *id;
    json_t *value;

    export->manifest = json_pack("{s:s, s:i, s:s}", "format", STUDY_FORMAT, "version",
                                 STUDY_VERSION, "srnfd", SRNF_VERSION);
    if (export->cohort) {
        (void)json_object_set_new(export->manifest, "cohort",
                                  json_pack("{s:s, s:s}", "name", export->cohort->name, "members",
                                            export->cohort->record));
    }
    for (size_t i = 0; i < KINDS; i++) {
        (void)json_object_set_new(export->manifest, kinds[i].kind, json_array());
        json_object_foreach(i + 1 == KINDS ? export->study.jobs : export->study.ids, id, value)
        {
            if (strncmp(id, kinds[i].prefix, strlen(kinds[i].prefix)) == 0) {
                kinds[i].list(export, id);
            }
        }
    }
    (void)json_object_set_new(export->manifest, "created", newest(export));
}

static void add_members(struct export *export)
{
    char *bytes = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&bytes, &size);

    if (out) {
        cohort_write_table(out, export->cohort);
    }
    if (out && fclose(out) == 0) {
        zip_add(&export->zip, "cohort.csv", bytes, size);
    } else {
        export->zip.failed = true;
    }
    free(bytes);
}

static void write_all(struct export *export, const char *name)
{
    zip_add_json(&export->zip, STUDY_MANIFEST, json_incref(export->manifest));
    zip_add_json(&export->zip, "ro-crate-metadata.json", crate(export, name));
    if (export->cohort) {
        add_members(export);
    }
    for (size_t i = 0; i < KINDS; i++) {
        const json_t *all = json_object_get(export->manifest, kinds[i].kind);

        for (size_t k = 0; k < json_array_size(all) && export->study.status == STORE_OK &&
                           !export->zip.failed && !jobs_memory_told(jobs_memory_current());
             k++) {
            const json_t *one = json_array_get(all, k);

            kinds[i].add(export, json_string_value(json_object_get(one, "id")),
                         json_string_value(json_object_get(one, "file")));
        }
    }
}

/* The digest of the file; false where it cannot be read to its end. */
static bool digest_file(int fd, size_t size, char tag[2 * crypto_hash_sha256_BYTES + 1])
{
    unsigned char block[32768], digest[crypto_hash_sha256_BYTES];
    crypto_hash_sha256_state state;
    size_t at = 0;

    (void)crypto_hash_sha256_init(&state);
    while (at < size && !jobs_memory_told(jobs_memory_current())) {
        ssize_t n = pread(fd, block, sizeof block, (off_t)at);

        if (n <= 0) {
            return false;
        }
        (void)crypto_hash_sha256_update(&state, block, (size_t)n);
        at += (size_t)n;
    }
    (void)crypto_hash_sha256_final(&state, digest);
    (void)sodium_bin2hex(tag, 2 * sizeof digest + 1, digest, sizeof digest);
    return at == size;
}

/* Answers with the file that was written. */
static void respond_file(struct api_call *call, int fd, const char *name)
{
    off_t size = lseek(fd, 0, SEEK_END);
    char tag[2 * crypto_hash_sha256_BYTES + 1];

    if (!digest_file(fd, (size_t)size, tag)) {
        (void)close(fd);
        (void)problem_respond(call, "storage-unavailable", "The export could not be read back.");
        return;
    }
    if (respond_not_modified(call, tag)) {
        (void)close(fd);
        return;
    }
    call->response->status = 200;
    call->response->body_file = 1 + fd;
    call->response->body_size = (size_t)size;
    (void)api_response_header_text(call->response, "Content-Type", "application/zip");
    (void)api_response_header(call->response, "Content-Disposition",
                              "attachment; filename=\"%s.zip\"", name);
}

/* Writes the study that was gathered, and answers. */
static void respond_export(struct export *export, const char *name)
{
    struct api_call *call = export->study.call;
    int status = export->study.status;
    int fd = status == STORE_OK ? store_scratch_file(store_of(export), &status) : -1;
    int copy = fd < 0 ? -1 : dup(fd);
    FILE *out = copy < 0 ? NULL : fdopen(copy, "wb");
    bool whole = false;

    if (out && zip_open(&export->zip, out, true)) {
        make_manifest(export);
        write_all(export, name);
        whole = zip_close(&export->zip);
    }
    if (out) {
        whole = fclose(out) == 0 && whole;
    } else if (copy >= 0) {
        (void)close(copy);
    }
    status = status == STORE_OK ? export->study.status : status;
    if (status == STORE_OK && whole && !json_memory_failed() &&
        !jobs_memory_told(jobs_memory_current())) {
        respond_file(call, fd, name);
        return;
    }
    if (fd >= 0) {
        (void)close(fd);
    }
    (void)problem_respond_store(call, status == STORE_OK ? STORE_FULL : status, NULL,
                                "writing the export");
}

static void clear(struct export *export)
{
    study_end(&export->study);
    json_decref(export->manifest);
    json_decref(export->graph);
    json_decref(export->parts);
}

void cohorts_export(struct api_call *call)
{
    struct export export = {.graph = json_array(), .parts = json_array()};
    struct store_cohort cohort;
    char owner[STORE_OWNER_MAX];
    int status;

    if (!study_begin(&export.study, call, owner) || !cohort_find_owner(call, owner)) {
        clear(&export);
        return;
    }
    status = store_cohort_get_as(call->api->config.store, owner, call->parameters[0], &cohort);
    if (status == STORE_OK) {
        export.cohort = &cohort;
        for (size_t i = 0; i < cohort.n_members; i++) {
            study_add(&export.study, cohort.members[i]);
        }
        study_add_jobs(&export.study);
        respond_export(&export, cohort.name);
        store_cohort_clear(&cohort);
    } else {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
    }
    clear(&export);
}

void models_export(struct api_call *call)
{
    struct export export = {.graph = json_array(), .parts = json_array()};
    struct store_model model;
    int status = store_model_get_as(call->api->config.store, call->request->caller.name,
                                    call->parameters[0], 0, &model);

    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, "no-such-model", call->parameters[0]);
    } else if (study_begin(&export.study, call, call->request->caller.name)) {
        store_model_clear(&model);
        study_add(&export.study, call->parameters[0]);
        study_add_jobs(&export.study);
        respond_export(&export, call->parameters[0]);
    }
    clear(&export);
}
