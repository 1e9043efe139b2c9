/*
 * imports_files.c - one file of an import: a mesh or a volume, read as an upload of its own, or the
 * table.
 */
#include "api/imports.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "api/auth.h"
#include "api/respond.h"
#include "api/routes.h"
#include "api/volumes.h"
#include "store/batch.h"
#include "store/holdings.h"
#include "store/mesh.h"
#include "store/store.h"
#include "store/volume.h"
#include "text.h"

#define COST ((size_t)3072) /* of the row and the answer of a file */

static bool ends_with(const char *path, const char *ending)
{
    size_t length = strlen(path), wanted = strlen(ending);

    return length >= wanted && strcasecmp(path + length - wanted, ending) == 0;
}

static bool is_table(const struct import_given *given)
{
    return ends_with(given->path, ".csv") || ends_with(given->path, ".tsv") ||
           strcasecmp(given->type, "text/csv") == 0 ||
           strcasecmp(given->type, "text/tab-separated-values") == 0;
}

bool import_is_volume(const struct import_given *given)
{
    static const char *const endings[] = {".nii", ".nii.gz", ".nrrd", ".nhdr", ".mgz", ".mgh"};
    const char *kind = srnf_mesh_stranger(given->bytes, given->size);

    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        if (ends_with(given->path, endings[i])) {
            return true;
        }
    }
    return kind && (strcmp(kind, "nifti") == 0 || strcmp(kind, "nrrd") == 0);
}

static void take_table(struct import *import, const struct import_given *given)
{
    char problem[DELIMITED_PROBLEM_MAX];

    if (import->table_path) {
        import_refuse(import, given->path, "second-table",
                      "an import has one table, and this one has %.200s", import->table_path);
        return;
    }
    import->table_path = strdup(given->path);
    switch (study_table_read(given->bytes, given->size, "file", &import->table, problem)) {
    case DELIMITED_OK:
        break;
    case DELIMITED_WRONG:
        (void)problem_respond(import->call, "invalid-input", "%.200s: %s.", given->path, problem);
        import->answered = true;
        break;
    case DELIMITED_NO_MEMORY:
        (void)problem_respond(import->call, "out-of-memory", "The table does not fit into memory.");
        import->answered = true;
    }
}

void import_name_of(const char *path, char name[NAME_SIZE])
{
    const char *base = text_base(path);
    const char *dot = strrchr(base, '.');
    size_t length = dot && dot > base ? (size_t)(dot - base) : strlen(base);

    length = length < NAME_SIZE ? length : NAME_SIZE - 1;
    memcpy(name, base, length);
    name[length] = '\0';
    if (ends_with(name, ".nii")) { /* of .nii.gz */
        name[strlen(name) - 4] = '\0';
    }
    if (name_problem(name)) {
        name[0] = '\0';
    }
}

/* flaw: gets the first problem in words, where there is one (free). */
static json_t *answer_of(const char *path, const struct store_mesh *row, bool held, char **flaw)
{
    char code[48], detail[320], link[STORE_ID_MAX + 16];
    bool problem = mesh_first_problem(row, code, detail);
    json_t *one = json_object(), *links = json_object();

    (void)snprintf(link, sizeof link, "/v1/meshes/%s", row->id);
    (void)json_object_set_new(links, "self", json_string(link));
    (void)json_object_set_new(one, "file", json_string(path));
    (void)json_object_set_new(one, "id", json_string(row->id));
    (void)json_object_set_new(one, "name", json_string(row->name ? row->name : ""));
    (void)json_object_set_new(one, "format", json_string(row->format ? row->format : ""));
    (void)json_object_set_new(one, "bytes", json_integer(row->bytes));
    (void)json_object_set_new(one, "vertices", json_integer(row->vertices));
    (void)json_object_set_new(one, "faces", json_integer(row->faces));
    (void)json_object_set_new(one, "new", json_boolean(!held));
    (void)json_object_set_new(one, "analysable", json_boolean(!problem));
    (void)json_object_set_new(one, "problem", problem ? json_string(code) : json_null());
    (void)json_object_set_new(one, "links", links);
    *flaw = problem ? strdup(detail) : NULL;
    return one;
}

/* Room for one more file, and its cost. */
static struct import_file *add_file(struct import *import, const char *path)
{
    struct import_file *file;

    if (import->n_files == import->capacity) {
        size_t capacity = import->capacity ? 2 * import->capacity : 64;
        struct import_file *grown = reallocarray(import->files, capacity, sizeof *grown);

        if (!grown) {
            return NULL;
        }
        import->files = grown;
        import->capacity = capacity;
    }
    if (!jobs_memory_charge(jobs_memory_current(), COST)) {
        return NULL;
    }
    import->charged += COST;
    file = &import->files[import->n_files];
    *file = (struct import_file){.path = strdup(path), .put = SIZE_MAX, .number = import->n_files};
    if (!file->path) {
        return NULL;
    }
    file->base = text_base(file->path);
    import->n_files++;
    return file;
}

/* What came of adding the file to the batch. */
static void note_put(struct import *import, struct import_file *file, struct import_given *given,
                     int status, bool kept)
{
    if (status != STORE_OK) {
        (void)problem_respond_store(import->call, status, NULL, "keeping a file");
        import->answered = true;
    }
    if (store_batch_count(import->batch) == file->put) {
        file->put = SIZE_MAX;
    }
    if (kept) {
        file->bytes = given->own;
        given->own = NULL;
    }
}

/* Takes over what was prepared, as long as there is room for it. */
static void hold_prepared(struct import *import, const char *id, struct compute_prepared *prepared)
{
    size_t bytes = 3 * (prepared->mesh.n_vertices * sizeof(double) +
                        prepared->mesh.n_faces * sizeof *prepared->mesh.faces);
    struct import_prepared *grown;

    if (bytes > IMPORT_PREPARED_MAX - import->prepared_bytes) {
        return;
    }
    grown = reallocarray(import->prepared, import->n_prepared + 1, sizeof *grown);
    if (grown) {
        import->prepared = grown;
        grown += import->n_prepared++;
        memcpy(grown->id, id, sizeof grown->id);
        grown->mesh = *prepared;
        *prepared = (struct compute_prepared){.kernel_known = false};
        import->prepared_bytes += bytes;
    }
}

/* Adds the mesh to what is stored at the end. */
static void keep_mesh(struct import *import, struct store_mesh *row, bool held,
                      struct import_given *given, struct compute_prepared *prepared)
{
    struct import_file *file = add_file(import, given->path);
    int64_t bytes = row->bytes;
    bool kept = false;
    int status;

    if (!file) {
        import_answer_memory(import);
        return;
    }
    if (!held && import->room >= 0 && (import->room -= bytes) < 0) {
        quota_respond(import->call, STORE_QUOTA_BYTES, 0);
        import->answered = true;
        return;
    }
    memcpy(file->id, row->id, sizeof file->id);
    row->owner = call_owner(import->call); /* its name outlives the batch */
    file->answer = answer_of(given->path, row, held, &file->flaw);
    file->untransformed = mesh_untransformed(row);
    file->put = store_batch_count(import->batch);
    status = store_batch_add_mesh(import->batch, row, given->bytes, &kept);
    note_put(import, file, given, status, kept);
    if (!held) {
        hold_prepared(import, file->id, prepared);
    }
}

/* Refuses a file, and keeps its name so that a row about it does not miss it. */
static void refuse_file(struct import *import, const char *path, const char *code,
                        const char *detail)
{
    struct import_file *file = add_file(import, path);

    if (file) {
        file->refused = true;
        import_refuse(import, path, code, "%s", detail);
    } else {
        import_answer_memory(import);
    }
}

/* Its name is kept likewise. */
static void pass_over(struct import *import, const char *path)
{
    struct import_file *file = add_file(import, path);

    if (file) {
        file->refused = file->passed = true;
    } else {
        import_answer_memory(import);
    }
}

/* The detail of the problem that was answered. */
static void refuse_answered(struct import *import, const char *path,
                            const struct api_response *response)
{
    json_t *problem = response->body
                          ? json_loadb((const char *)response->body, response->body_size, 0, NULL)
                          : NULL;
    const char *code = json_string_value(json_object_get(problem, "code"));
    const char *detail = json_string_value(json_object_get(problem, "detail"));

    if (import->unpack_left == 0) { /* what it is of no matter: nothing more could be read */
        import_answer_growth(import, path);
    } else if (problem_status(code) < 500 && problem_status(code) != 413 && code) {
        refuse_file(import, path, code, detail ? detail : "");
    } else {
        (void)problem_respond(import->call, code && problem_known(code) ? code : "out-of-memory",
                              "%.200s: %.280s", path, detail ? detail : "no memory");
        import->answered = true;
    }
    json_decref(problem);
}

/* A file as a request of its own. */
struct upload {
    struct api_request request;
    struct api_response response;
    struct api_call call;
};

static void open_upload(struct upload *upload, struct import *import,
                        const struct import_given *given)
{
    const struct api_call *of = import->call;

    *upload = (struct upload){.request = {.method = "POST",
                                          .path = of->request->path,
                                          .query = "",
                                          .body = given->bytes,
                                          .body_size = given->size,
                                          .caller = of->request->caller}};
    upload->call = (struct api_call){.api = of->api,
                                     .request = &upload->request,
                                     .response = &upload->response,
                                     .unpack_left = &import->unpack_left};
}

/* Reads a mesh as an upload of its own; its format is that of the bytes, or else of the name. */
static void take_mesh(struct import *import, struct import_given *given)
{
    const char *dot = strrchr(given->path, '.');
    struct upload upload;
    struct compute_prepared prepared;
    struct store_mesh row;
    char name[NAME_SIZE], query[48];
    bool held;

    open_upload(&upload, import, given);
    if (dot && strlen(dot) < 16 &&
        srnf_mesh_sniff(given->bytes, given->size) == SRNF_MESH_UNKNOWN &&
        srnf_mesh_format_from_name(dot + 1) != SRNF_MESH_UNKNOWN) {
        (void)snprintf(query, sizeof query, "format=%s", dot + 1);
        upload.request.query = query;
    }
    if (import->manifest && import->format && strlen(import->format) < 16) {
        (void)snprintf(query, sizeof query, "format=%s", import->format);
        upload.request.query = query;
    }
    import_name_of(given->path, name);
    if (import->manifest && import->name && strlen(import->name) < sizeof name &&
        !name_problem(import->name)) {
        (void)snprintf(name, sizeof name, "%s", import->name);
    }
    if (!mesh_read_body(&upload.call, name, &row, &prepared, &held)) {
        refuse_answered(import, given->path, &upload.response);
    } else if (import->manifest && strcmp(row.id, import->id) != 0) {
        import_refuse(import, given->path, "not-as-described", IMPORT_CHANGED);
    } else {
        if (import->manifest && import->source && !held) {
            free(row.source);
            row.source = strdup(import->source);
        }
        keep_mesh(import, &row, held, given, &prepared);
    }
    compute_prepared_clear(&prepared);
    store_mesh_clear(&row);
    api_response_clear(&upload.response);
}

static json_t *answer_of_volume(const char *path, const struct store_volume *row, bool held)
{
    json_t *record = volume_record(row, false), *one = json_object();
    static const char *const members[] = {"id",    "name",    "format",     "bytes",
                                          "shape", "spacing", "labelCount", "links"};

    (void)json_object_set_new(one, "file", json_string(path));
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        (void)json_object_set(one, members[i], json_object_get(record, members[i]));
    }
    (void)json_object_set_new(one, "new", json_boolean(!held));
    json_decref(record);
    return one;
}

/* Reads a label volume as an upload of its own. */
static void take_volume(struct import *import, struct import_given *given)
{
    struct upload upload;
    struct store_volume row;
    struct import_file *file;
    char name[NAME_SIZE];
    bool held, kept = false;
    int status;

    open_upload(&upload, import, given);
    import_name_of(given->path, name);
    if (import->manifest && import->name && strlen(import->name) < sizeof name &&
        !name_problem(import->name)) {
        (void)snprintf(name, sizeof name, "%s", import->name);
    }
    if (!volume_read_body(&upload.call, name, &row, &held)) {
        refuse_answered(import, given->path, &upload.response);
    } else if (import->manifest && strcmp(row.id, import->id) != 0) {
        import_refuse(import, given->path, "not-as-described", IMPORT_CHANGED);
    } else if (!held && import->room >= 0 && (import->room -= row.bytes) < 0) {
        quota_respond(import->call, STORE_QUOTA_BYTES, 0);
        import->answered = true;
    } else if ((file = add_file(import, given->path)) == NULL) {
        import_answer_memory(import);
    } else {
        memcpy(file->id, row.id, sizeof file->id);
        row.owner = call_owner(import->call); /* its name outlives the batch */
        row.created_ms = store_now_ms();
        file->volume = true;
        file->answer = answer_of_volume(given->path, &row, held);
        file->put = store_batch_count(import->batch);
        status = store_batch_add_volume(import->batch, &row, given->bytes, &kept);
        note_put(import, file, given, status, kept);
    }
    store_volume_clear(&row);
    api_response_clear(&upload.response);
}

void import_take(struct import *import, struct import_given *given)
{
    if (import_take_manifest(import, given) ||
        (import->manifest && import_take_study(import, given))) {
        return;
    }
    if (import->manifest) {
        (import->volume ? take_volume : take_mesh)(import, given);
    } else if (is_table(given)) {
        take_table(import, given);
    } else if (import_is_volume(given)) {
        take_volume(import, given);
    } else if (import_is_companion(given)) {
        pass_over(import, given->path);
    } else {
        take_mesh(import, given);
    }
}
