/*
 * export_manifest.c - what an export says of each record: its entry in the manifest that an import
 * restores it from, and its files in the metadata for people and archives (RO-Crate 1.1).
 */
#include "api/export_study.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/respond.h"
#include "srnf.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"
#include "store/volume.h"

struct store *export_store(const struct export *export)
{
    return export->study.call->api->config.store;
}

bool export_good(struct export *export, int status)
{
    if (status != STORE_OK && export->study.status == STORE_OK) {
        export->study.status = status;
    }
    return status == STORE_OK;
}

void export_put(struct export *export, const char *path, const void *bytes, size_t size)
{
    char digest[65];

    store_sha256_hex(digest, bytes, size);
    (void)json_object_set_new(export->files, path, json_string(digest));
    zip_add(&export->zip, path, bytes, size);
}

void export_list_cohort(struct export *export)
{
    const struct store_cohort *cohort = export->cohort;
    char digest[65];

    store_sha256_hex(digest, cohort->record, strlen(cohort->record));
    (void)json_object_set_new(export->manifest, "cohort",
                              json_pack("{s:s, s:s, s:s}", "name", cohort->name, "sha256", digest,
                                        "members", cohort->record));
}

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

json_t *export_crate(struct export *export, const char *name)
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

    if (nifti && export_good(export, store_volume_content(export_store(export), volume->id, &bytes,
                                                          &size))) {
        packed = size > 2 && bytes[0] == 0x1f && bytes[1] == 0x8b;
        free(bytes);
    }
    json_decref(record);
    return nifti ? (packed ? ".nii.gz" : ".nii") : ".nrrd";
}

void export_list_volume(struct export *export, const char *id)
{
    struct store_volume volume;
    char path[STORE_ID_MAX + 32];

    if (!export_good(export,
                     store_volume_get_as(export_store(export), export->study.owner, id, &volume))) {
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

void export_list_mesh(struct export *export, const char *id)
{
    struct store_mesh mesh;
    char path[STORE_ID_MAX + 32];

    if (!export_good(export,
                     store_mesh_get_as(export_store(export), export->study.owner, id, &mesh))) {
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

void export_list_surface(struct export *export, const char *id)
{
    struct store_surface surface;
    struct store_maps maps;
    char digest[65], path[STORE_ID_MAX + 32];
    json_t *names = json_array();
    int status;

    if (!export_good(export, store_surface_get_as(export_store(export), export->study.owner, id,
                                                  false, &surface))) {
        json_decref(names);
        return;
    }
    status = store_surface_maps(export_store(export), id, &maps);
    if (status != STORE_NOT_FOUND) {
        (void)export_good(export, status);
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

void export_list_model(struct export *export, const char *id)
{
    struct store_model model;
    char path[STORE_ID_MAX + 32];

    if (!export_good(
            export, store_model_get_as(export_store(export), export->study.owner, id, 0, &model))) {
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

void export_list_job(struct export *export, const char *id)
{
    struct store_job job;
    char digest[65], asked[65], *results;
    size_t size;
    char path[STORE_ID_MAX + 32];

    if (!export_good(export, store_job_get(export_store(export), id, &job))) {
        return;
    }
    if (!export_good(export, store_job_results(export_store(export), id, &results, &size))) {
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
