/*
 * imports.c - POST /v1/imports: a whole study in one request.
 *
 * Each file is read as if it had been sent by itself to POST /v1/meshes, with the same checks and
 * the same id. Large ones then lie on the disk under temporary names, small ones in memory, and the
 * table is matched with them. Only then all meshes and the cohort are stored, in one transaction
 * (store/batch.h): all or, where anything was refused, nothing; with partial=true what was not
 * refused. What makes an archive unreadable as a whole refuses it as a whole.
 *
 * Runs on the threads for uploads and is charged as an upload is: what is read, what waits for the
 * transaction, and COST for the row and the answer of each file.
 */
#include "api/imports.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "api/auth.h"
#include "api/json_memory.h"
#include "api/respond.h"
#include "api/routes.h"
#include "compute/prepared.h"
#include "store/batch.h"
#include "store/cohort.h"
#include "store/holdings.h"
#include "store/mesh.h"

#define COST ((size_t)3072)

/* ---- Refusals -------------------------------------------------------------------------------- */

void import_refuse(struct import *import, const char *path, const char *code, const char *format,
                   ...)
{
    char detail[700];
    va_list arguments;
    json_t *entry, *name;

    if (++import->n_refused > IMPORT_REFUSALS_MAX) {
        return;
    }
    va_start(arguments, format);
    (void)vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    entry = json_object();
    name = delimited_utf8(path, strlen(path)) ? json_string(path) : json_string("?");
    (void)json_object_set_new(entry, "file", name);
    (void)json_object_set_new(entry, "code", json_string(code));
    (void)json_object_set_new(entry, "detail",
                              delimited_utf8(detail, strlen(detail)) ? json_string(detail)
                                                                     : json_string("not readable"));
    (void)json_array_append_new(import->refused, entry);
}

void import_drop(struct import *import, struct import_file *file, const char *code,
                 const char *detail)
{
    if (code) {
        import_refuse(import, file->path, code, "%s", detail);
    }
    if (!file->refused && file->put != SIZE_MAX) {
        store_batch_drop(import->batch, file->put);
    }
    file->refused = true;
}

/* ---- One file -------------------------------------------------------------------------------- */

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

/* By the names of label volumes, which are another resource. */
static bool is_volume(const char *path)
{
    static const char *const endings[] = {".nii", ".nii.gz", ".nrrd", ".nhdr", ".mgz", ".mgh"};

    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        if (ends_with(path, endings[i])) {
            return true;
        }
    }
    return false;
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

/* The base name without its last ending: what the mesh is called. */
static void name_of(const char *base, char name[NAME_SIZE])
{
    const char *dot = strrchr(base, '.');
    size_t length = dot && dot > base ? (size_t)(dot - base) : strlen(base);

    length = length < NAME_SIZE ? length : NAME_SIZE - 1;
    memcpy(name, base, length);
    name[length] = '\0';
    if (name_problem(name)) {
        name[0] = '\0';
    }
}

static json_t *answer_of(const char *path, const struct store_mesh *row, bool held)
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
    file->base = strrchr(file->path, '/') ? strrchr(file->path, '/') + 1 : file->path;
    import->n_files++;
    return file;
}

static void answer_memory(struct import *import)
{
    (void)problem_respond(import->call, "out-of-memory", "The import does not fit into memory.");
    import->answered = true;
}

/* Adds the mesh to what is stored at the end. */
static void keep_mesh(struct import *import, struct store_mesh *row, bool held,
                      struct import_given *given)
{
    struct import_file *file = add_file(import, given->path);
    int64_t bytes = row->bytes;
    bool kept = false;
    int status;

    if (!file) {
        answer_memory(import);
        return;
    }
    if (!held && import->room >= 0 && (import->room -= bytes) < 0) {
        quota_respond(import->call, STORE_QUOTA_BYTES, 0);
        import->answered = true;
        return;
    }
    memcpy(file->id, row->id, sizeof file->id);
    row->owner = call_owner(import->call); /* its name outlives the batch */
    file->answer = answer_of(given->path, row, held);
    file->put = store_batch_count(import->batch);
    status = store_batch_add_mesh(import->batch, row, given->bytes, &kept);
    if (status != STORE_OK) {
        (void)problem_respond_store(import->call, status, NULL, "keeping the mesh");
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

/* Refuses a file, and keeps its name so that a row about it does not miss it. */
static void refuse_file(struct import *import, const char *path, const char *code,
                        const char *detail)
{
    struct import_file *file = add_file(import, path);

    if (file) {
        file->refused = true;
        import_refuse(import, path, code, "%s", detail);
    } else {
        answer_memory(import);
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

    if (problem_status(code) < 500 && problem_status(code) != 413 && code) {
        refuse_file(import, path, code, detail ? detail : "");
    } else {
        (void)problem_respond(import->call, code && problem_known(code) ? code : "out-of-memory",
                              "%.200s: %.280s", path, detail ? detail : "no memory");
        import->answered = true;
    }
    json_decref(problem);
}

/* Reads a mesh as an upload of its own; its format is that of the bytes, or else of the name. */
static void take_mesh(struct import *import, struct import_given *given)
{
    const char *dot = strrchr(given->path, '.');
    struct api_request request = {.method = "POST",
                                  .path = import->call->request->path,
                                  .query = "",
                                  .body = given->bytes,
                                  .body_size = given->size,
                                  .caller = import->call->request->caller};
    struct api_response response = {0};
    struct api_call call = {.api = import->call->api, .request = &request, .response = &response};
    struct compute_prepared prepared;
    struct store_mesh row;
    char name[NAME_SIZE], query[48];
    bool held;

    if (dot && strlen(dot) < 16 &&
        srnf_mesh_sniff(given->bytes, given->size) == SRNF_MESH_UNKNOWN &&
        srnf_mesh_format_from_name(dot + 1) != SRNF_MESH_UNKNOWN) {
        (void)snprintf(query, sizeof query, "format=%s", dot + 1);
        request.query = query;
    }
    if (import->manifest && import->format && strlen(import->format) < 16) {
        (void)snprintf(query, sizeof query, "format=%s", import->format);
        request.query = query;
    }
    name_of(strrchr(given->path, '/') ? strrchr(given->path, '/') + 1 : given->path, name);
    if (import->manifest && import->name && strlen(import->name) < sizeof name &&
        !name_problem(import->name)) {
        (void)snprintf(name, sizeof name, "%s", import->name);
    }
    if (!mesh_read_body(&call, name, &row, &prepared, &held)) {
        refuse_answered(import, given->path, &response);
    } else if (import->manifest && strcmp(row.id, import->id) != 0) {
        import_refuse(import, given->path, "not-as-described", IMPORT_CHANGED);
    } else {
        if (import->manifest && import->source && !held) {
            free(row.source);
            row.source = strdup(import->source);
        }
        keep_mesh(import, &row, held, given);
    }
    compute_prepared_clear(&prepared);
    store_mesh_clear(&row);
    api_response_clear(&response);
}

void import_take(struct import *import, struct import_given *given)
{
    if (import_take_manifest(import, given) ||
        (import->manifest && import_take_study(import, given))) {
        return;
    }
    if (import->manifest) {
        take_mesh(import, given);
    } else if (is_table(given)) {
        take_table(import, given);
    } else if (is_volume(given->path)) {
        refuse_file(import, given->path, "volume",
                    "it is a volume; POST /v1/volumes takes it, and the process extract makes "
                    "meshes of its labels");
    } else {
        take_mesh(import, given);
    }
}

/* ---- The whole ------------------------------------------------------------------------------- */

/* What the query asks for; false when a problem was answered. */
static bool read_query(struct import *import)
{
    struct problem_list list = {.errors = NULL};
    char text[STORE_COHORT_NAME_MAX];
    bool refused;

    if (query_get(import->call, "cohort", text, sizeof text, &refused)) {
        memcpy(import->cohort, text, sizeof text);
        if (!cohort_name_valid(text)) {
            problem_add(&list, "/cohort",
                        "must be 1 to 100 letters, digits, dots, hyphens or underscores, and not . "
                        "or ..");
        }
    }
    if (!refused && query_get(import->call, "partial", text, sizeof text, &refused)) {
        import->partial = strcmp(text, "true") == 0;
        if (!import->partial && strcmp(text, "false") != 0) {
            problem_add(&list, "/partial", "must be true or false");
        }
    }
    if (!refused && list.errors) {
        (void)problem_respond_list(import->call, "invalid-input", &list);
        return false;
    }
    return !refused;
}

/* How much the owner may still take. */
static bool read_room(struct import *import)
{
    struct api_call *call = import->call;
    int64_t held, most = call_owner(call).bytes_max;
    int status = store_owner_bytes(call->api->config.store, call_owner(call).name, &held, NULL);

    import->room = most > 0 ? (most > held ? most - held : 0) : -1;
    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, NULL, "looking at the quota");
    }
    return status == STORE_OK;
}

/* Nothing is kept: says why. */
static void respond_refused(struct import *import)
{
    const json_t *first = json_array_get(import->refused, 0);
    const char *file = json_string_value(json_object_get(first, "file"));
    const char *detail = json_string_value(json_object_get(first, "detail"));
    bool one = import->n_refused == 1;
    size_t length = detail ? strlen(detail) : 0;
    char text[600];

    length -= length > 0 && detail[length - 1] == '.'; /* the detail of a problem is a sentence */
    (void)snprintf(text, sizeof text,
                   "%zu of what came %s refused, and nothing was kept. The first, %.150s: %.*s. "
                   "Correct %s, or send ?partial=true to keep the rest.",
                   import->n_refused, one ? "was" : "were", file ? file : "",
                   length < 250 ? (int)length : 250, detail ? detail : "", one ? "it" : "them");
    (void)problem_respond_with(import->call, "import-refused", text, "refused",
                               json_incref(import->refused));
}

static void respond_taken(struct import *import, const struct store_cohort *cohort, bool created)
{
    json_t *answer = json_object(), *meshes = json_array();

    for (size_t i = 0; i < import->n_files; i++) {
        if (!import->files[i].refused) {
            created = created || json_is_true(json_object_get(import->files[i].answer, "new"));
            (void)json_array_append(meshes, import->files[i].answer);
        }
    }
    (void)json_object_set_new(answer, "meshes", meshes);
    (void)json_object_set_new(answer, "cohort",
                              cohort ? cohort_summary(import->call, cohort) : json_null());
    if (import->manifest) {
        (void)json_object_set_new(answer, "restored",
                                  json_pack("{s:I, s:I, s:I}", "surfaces",
                                            (json_int_t)import->n_restored[0], "models",
                                            (json_int_t)import->n_restored[1], "jobs",
                                            (json_int_t)import->n_restored[2]));
    }
    (void)json_object_set(answer, "refused", import->refused);
    (void)json_object_set_new(answer, "refusedCount", json_integer((json_int_t)import->n_refused));
    if (cohort) {
        (void)api_response_header(import->call->response, "Location", "/v1/cohorts/%s",
                                  cohort->name);
    }
    respond_json(import->call, created ? 201 : 200, answer);
}

/* Stores what was taken, and answers. */
static void commit(struct import *import, struct cohort_text *members)
{
    struct store_cohort cohort = {.view = call_view(import->call),
                                  .bytes_max = call_owner(import->call).bytes_max};
    bool created = false, named = import->cohort[0] != '\0';
    size_t missing = 0, failed = 0;
    int status = STORE_OK;

    memcpy(cohort.name, import->cohort, sizeof cohort.name);
    memcpy(cohort.owner, import->call->request->caller.name, sizeof cohort.owner);
    if (named) {
        status = cohort_text_finish(members, &cohort)
                     ? store_batch_add_cohort(import->batch, &cohort, &created, &missing)
                     : STORE_NOMEM;
    }
    if (status == STORE_OK) {
        status = store_batch_commit(import->batch, &failed);
    }
    if (status == STORE_OK) {
        respond_taken(import, named ? &cohort : NULL, created);
    } else if (named) {
        cohort_respond_refused(import->call, &cohort, status, missing);
    } else {
        (void)problem_respond_store(import->call, status, NULL, "keeping the meshes");
    }
    store_batch_destroy(import->batch);
    import->batch = NULL;
    store_cohort_clear(&cohort);
}

/* All files are there: matches them, and decides. */
static void finish(struct import *import)
{
    struct cohort_text members = {.text = NULL};
    bool full;

    if (import->table_path && !import->cohort[0]) {
        (void)problem_respond(import->call, "invalid-input",
                              "/cohort: a table tells of the members of a cohort; name it by "
                              "?cohort=, or leave %.200s out.",
                              import->table_path);
        return;
    }
    if (!import->manifest) {
        import_match(import, &members);
    } else if (!import_study_members(import, &members)) {
        cohort_text_clear(&members);
        return;
    }
    full = members.count <= COHORT_MEMBERS_MAX;
    if (json_memory_failed() || members.failed) {
        answer_memory(import);
    } else if (!full) {
        (void)problem_respond(import->call, "limit-exceeded",
                              "The import has %zu meshes; a cohort has at most %d members.",
                              members.count, COHORT_MEMBERS_MAX);
    } else if (import->n_refused > 0 &&
               (!import->partial || members.count == 0 || import->manifest)) {
        respond_refused(import);
    } else if (members.count == 0 && !import->manifest) {
        (void)problem_respond(import->call, "unparsable-archive", "There is no mesh in the body.");
    } else {
        commit(import, &members);
    }
    cohort_text_clear(&members);
}

static void clear(struct import *import)
{
    store_batch_destroy(import->batch);
    for (size_t i = 0; i < import->n_files; i++) {
        free(import->files[i].path);
        json_decref(import->files[i].answer);
        srnf_free(import->files[i].bytes);
    }
    free(import->files);
    free(import->table_path);
    study_table_clear(&import->table);
    json_decref(import->refused);
    json_decref(import->manifest);
    json_decref(import->by_path);
    json_decref(import->seen);
    jobs_memory_discharge(jobs_memory_current(), import->charged);
}

void imports_create(struct api_call *call)
{
    struct import import = {.call = call,
                            .batch = store_batch_create(call->api->config.store),
                            .refused = json_array()};

    if (!import.batch || !import.refused) {
        answer_memory(&import);
    } else if (read_query(&import) && read_room(&import)) {
        import_read_body(&import);
        if (!import.answered) {
            finish(&import);
        }
    }
    clear(&import);
}
