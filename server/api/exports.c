/*
 * exports.c - GET /v1/cohorts/{name}/export and /v1/models/{id}/export: a study as one zip.
 *
 * The zip is written into a file of the data directory that has no name, one entry after another,
 * and sent from there: in memory is one mesh, surface, model or result at a time. It is dated by
 * the newest that is in it, so that the same study is the same bytes: their digest is its entity
 * tag, and who was cut off asks for the rest of them (transmit.c). What is in it, listed by
 * export_manifest.c and written by export_files.c:
 *
 *   ro-crate-metadata.json    the same for people and archives (RO-Crate 1.1, JSON-LD)
 *   cohort.csv                the members
 *   volumes/ID.FORMAT         the segmentations that meshes were extracted from, as they were sent
 *   meshes/ID.FORMAT          the bytes that were uploaded
 *   surfaces/ID.npz, ID.ply   coefficients and maps; a mesh of it, as fine as its degree asks
 *   models/ID.npz, ID-scores.csv
 *   jobs/ID.json, ID.csv      results as they were answered; a table where the process has one
 *   srnfd-study.json          what an import restores it from: ids, records, options, times,
 *                             builds, and the digests of all files before it
 */
#include "api/cohorts.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "api/export_study.h"
#include "api/json_memory.h"
#include "api/models.h"
#include "api/respond.h"
#include "api/routes.h"
#include "srnf.h"
#include "store/model.h"
#include "store/prepared.h"
#include "store/store.h"

static const struct {
    const char *prefix, *kind;
    void (*list)(struct export *export, const char *id);
    void (*add)(struct export *export, const char *id, const char *path);
} kinds[] = {
    /* Volumes come before the meshes that need them. */
    {"vol-", "volumes", export_list_volume, export_add_volume},
    {"mesh-", "meshes", export_list_mesh, export_add_mesh},
    {"surf-", "surfaces", export_list_surface, export_add_surface},
    {"model-", "models", export_list_model, export_add_model},
    {"job-", "jobs", export_list_job, export_add_job},
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
        export_list_cohort(export);
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
        export_put(export, "cohort.csv", bytes, size);
    } else {
        export->zip.failed = true;
    }
    free(bytes);
}

static void add_document(struct export *export, const char *path, json_t *document)
{
    char *text = zip_json(document);

    if (text) {
        export_put(export, path, text, strlen(text));
    } else {
        export->zip.failed = true;
    }
    free(text);
}

static void write_all(struct export *export, const char *name)
{
    add_document(export, "ro-crate-metadata.json", export_crate(export, name));
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
    (void)json_object_set(export->manifest, "files", export->files);
    add_document(export, STUDY_MANIFEST, json_incref(export->manifest));
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

/* ---- Room ------------------------------------------------------------------------------------ */

static void respond_beyond(struct api_call *call)
{
    (void)problem_respond(call, "server-busy",
                          "Exports of this token, or of this address, that are being written and "
                          "sent fill its share of the disk; try again when one has been taken.");
}

static void give_room_back(struct export *export)
{
    const struct api_share *share = &export->study.call->request->disk;

    if (share->release) {
        share->release(share->of, export->held);
    }
    export->held = 0;
}

static bool take_room(void *user, size_t bytes)
{
    struct export *export = user;
    const struct api_share *share = &export->study.call->request->disk;

    export->beyond = share->hold && !share->hold(share->of, bytes);
    if (export->beyond) {
        give_room_back(export); /* at once, so that another that is being written goes on */
        return false;
    }
    export->held += bytes;
    export->full = !store_scratch_fits(export_store(export), (int64_t)bytes);
    return !export->full;
}

/* The file could not be written: whether prepared meshes gave way, for twice its bytes so far, and
   it may be tried again. */
static bool found_room(struct export *export, int fd)
{
    struct stat about;

    return !export->full && fstat(fd, &about) == 0 &&
           store_prepared_give_way(export_store(export), 2 * (int64_t)about.st_size);
}

/* Writes the study that was gathered, and answers. False: it is to be tried again, as something of
   it has been deleted meanwhile or room was found, and nothing is answered. */
static bool respond_export(struct export *export, const char *name)
{
    struct api_call *call = export->study.call;
    int status = export->study.status;
    int fd = status == STORE_OK ? store_scratch_file(export_store(export), &status) : -1;
    int copy = fd < 0 ? -1 : dup(fd);
    FILE *out = copy < 0 ? NULL : fdopen(copy, "wb");
    bool whole = false, again;

    if (out && zip_open(&export->zip, out, true)) {
        export->zip.take = take_room;
        export->zip.user = export;
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
        if (!call->response->body_file) {
            give_room_back(export);
        }
        return true;
    }
    again = status == STORE_NOT_FOUND ||
            (status == STORE_OK && !whole && !export->beyond && found_room(export, fd));
    if (fd >= 0) {
        (void)close(fd);
    }
    give_room_back(export);
    if (again) {
        return false;
    }
    if (status == STORE_OK && export->beyond) {
        respond_beyond(call);
        return true;
    }
    (void)problem_respond_store(call, status == STORE_OK ? STORE_FULL : status, NULL,
                                "writing the export");
    return true;
}

static void clear(struct export *export)
{
    study_end(&export->study);
    json_decref(export->manifest);
    json_decref(export->graph);
    json_decref(export->parts);
    json_decref(export->files);
}

/* Once; as respond_export. */
static bool try_cohort(struct api_call *call)
{
    struct export export = {.graph = json_array(), .parts = json_array(), .files = json_object()};
    struct store_cohort cohort;
    char owner[STORE_OWNER_MAX];
    bool answered = true;
    int status;

    if (!study_begin(&export.study, call, owner) || !cohort_find_owner(call, owner)) {
        clear(&export);
        return true;
    }
    status = store_cohort_get_as(call->api->config.store, owner, call->parameters[0], &cohort);
    if (status == STORE_OK) {
        export.cohort = &cohort;
        for (size_t i = 0; i < cohort.n_members; i++) {
            study_add(&export.study, cohort.members[i]);
        }
        study_add_jobs(&export.study);
        answered = respond_export(&export, cohort.name);
        store_cohort_clear(&cohort);
    } else {
        (void)problem_respond_store(call, status, "no-such-cohort", call->parameters[0]);
    }
    clear(&export);
    return answered;
}

static bool try_model(struct api_call *call)
{
    struct export export = {.graph = json_array(), .parts = json_array(), .files = json_object()};
    struct store_model model;
    bool answered = true;
    int status = store_model_get_as(call->api->config.store, call->request->caller.name,
                                    call->parameters[0], 0, &model);

    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, "no-such-model", call->parameters[0]);
    } else if (study_begin(&export.study, call, call->request->caller.name)) {
        store_model_clear(&model);
        study_add(&export.study, call->parameters[0]);
        study_add_makers(&export.study);
        answered = respond_export(&export, call->parameters[0]);
    }
    clear(&export);
    return answered;
}

/* Anew while others delete what is being written: then it is there as a whole or not at all. */
static void export_with(struct api_call *call, bool (*try)(struct api_call *call),
                        const char *not_found_code)
{
    const struct api_share *share = &call->request->disk;
    bool answered;

    /* A byte for the file that is to be made: whose share is full need not gather the study. */
    if (share->hold && !share->hold(share->of, 1)) {
        respond_beyond(call);
        return;
    }
    answered = try(call);
    for (int again = 0; again < DELETED_MEANWHILE && !answered; again++) {
        answered = try(call);
    }
    if (!answered) {
        (void)problem_respond_store(call, STORE_NOT_FOUND, not_found_code, call->parameters[0]);
    }
}

void cohorts_export(struct api_call *call)
{
    export_with(call, try_cohort, "no-such-cohort");
}

void models_export(struct api_call *call)
{
    export_with(call, try_model, "no-such-model");
}
