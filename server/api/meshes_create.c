/*
 * meshes_create.c - POST /v1/meshes: parses a body, repairs what can be repaired without loss,
 * reports on it and keeps it.
 *
 * The same file sent twice is one resource: the second time the record is found by its id before
 * anything is parsed. What another owner has sent is parsed all the same, and is new: name, time
 * and status tell nothing of others. A body that does not parse is refused and not kept; a mesh
 * that parses but cannot be analysed is kept, and its report says why. What was prepared here is
 * kept for the jobs that need it. Runs on the threads of uploads (http/lane.c): reading is linear
 * in the size of the body, topology n log n, and the star kernel a linear program of four unknowns.
 */
#include "api/meshes.h"
#include "api/labels.h"
#include "api/respond.h"
#include "api/routes.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "api/auth.h"
#include "compute/compute.h"
#include "compute/prepared.h"
#include "jobs/memory.h"
#include "store/holdings.h"
#include "store/mesh.h"
#include "store/store.h"

/* Where to go with what is no mesh. */
static const char *way_out(const struct api_call *call)
{
    static const struct {
        const char *kinds, *sentence;
    } ways[] = {
        {"zip,tar", "; a whole archive of meshes goes to POST /v1/imports"},
        {"nifti,nrrd", "; POST it to /v1/volumes"},
        {"npy", "; points of a surface on a grid go to POST /v1/surfaces"},
    };
    const char *kind = srnf_mesh_stranger(call->request->body, call->request->body_size);

    if (!kind) {
        return "; name the format by ?format= or Content-Type if it is one";
    }
    for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
        if (list_has(ways[i].kinds, kind)) {
            return ways[i].sentence;
        }
    }
    return "";
}

/* What makes a whole file look damaged: the type of curl -d, and a body without the line ends that
   it takes out. */
static const char *line_ends(const struct api_call *call)
{
    const char *type = api_request_header(call->request, "Content-Type");
    const void *body = call->request->body;
    size_t size = call->request->body_size;
    bool form = type && strncmp(type, "application/x-www-form-urlencoded", 33) == 0;

    return form && !memchr(body, '\n', size) && !memchr(body, '\r', size)
               ? "; the body has no line ends: curl -d takes them out, and --data-binary sends a "
                 "file as it is"
               : "";
}

/* The format asked for by ?format= or Content-Type, or sniffed. False when a problem was answered.
 */
static bool choose_format(struct api_call *call, enum srnf_mesh_format *format)
{
    const char *value = api_request_header(call->request, "Content-Type");
    struct problem_list problems = {.errors = NULL};
    const char *named = NULL;
    char text[96], formats[MESH_FORMATS_TEXT];
    bool refused;

    *format = SRNF_MESH_UNKNOWN;
    if (query_get(call, "format", text, sizeof text, &refused)) {
        *format = srnf_mesh_format_from_name(text);
        if (*format == SRNF_MESH_UNKNOWN) {
            mesh_formats_named(formats);
            problem_add(&problems, "/format", "format must be %s, not \"%s\".", formats, text);
            (void)problem_respond_list(call, "invalid-input", &problems);
            return false;
        }
        return true;
    }
    if (refused) {
        return false;
    }
    if (value) {
        named = mesh_type_format(value, strcspn(value, "; \t"));
    }
    *format = named ? srnf_mesh_format_from_name(named)
                    : srnf_mesh_sniff(call->request->body, call->request->body_size);
    if (*format == SRNF_MESH_UNKNOWN) {
        struct srnf_error error = {0}; /* what the bytes look like instead */
        struct srnf_mesh none;

        if (srnf_mesh_read(call->request->body, call->request->body_size, SRNF_MESH_UNKNOWN, NULL,
                           &none, NULL, &error) == SRNF_OK) {
            srnf_mesh_clear(&none);
        }
        (void)problem_respond(call, "unparsable-mesh", "%s%s%s.", error.message, way_out(call),
                              line_ends(call));
        return false;
    }
    return true;
}

bool query_name(struct api_call *call, char *name)
{
    struct problem_list problems = {.errors = NULL};
    const char *problem;
    json_t *string;
    bool refused;

    name[0] = '\0';
    if (!query_get(call, "name", name, NAME_SIZE, &refused)) {
        return !refused;
    }
    string = json_string(name);
    problem = string ? name_problem(name) : "must be UTF-8";
    json_decref(string);
    if (problem) {
        problem_add(&problems, "/name", "%s", problem);
        (void)problem_respond_list(call, "invalid-input", &problems);
    }
    return !problem;
}

static bool is_told(void *user)
{
    (void)user;
    return jobs_memory_told(jobs_memory_current());
}

/* Reading goes on until the upload is told to stop, as with memory that is refused (api.c). */
const struct srnf_context upload_context = {.canceled = is_told};

/* Parses, prepares and reports; fills the row but for its content. False when a problem was
   answered. */
static bool parse_mesh(struct api_call *call, enum srnf_mesh_format format, struct store_mesh *row,
                       struct compute_prepared *prepared)
{
    struct srnf_mesh_read_info info = {0};
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
    struct srnf_error error = {.element = -1};
    bool parsed = false;
    int status;

    limits.context = &upload_context;
    limits.unpack_left = call->unpack_left;
    status = srnf_mesh_read(call->request->body, call->request->body_size, format, &limits,
                            &prepared->mesh, &info, &error);
    if (status < 0) {
        const char *code = status == SRNF_ENOMEM ? "out-of-memory" : "unparsable-mesh";

        if (status == SRNF_EFORMAT) {
            (void)problem_respond(call, code, "%s (as %s)%s%s.", error.message, row->format,
                                  way_out(call), line_ends(call));
        } else { /* the message names the byte, the line or the vertex */
            (void)problem_respond(call, code, "%s (as %s)%s.",
                                  error.message[0] ? error.message : srnf_strerror(status),
                                  row->format, line_ends(call));
        }
        return false;
    }
    info.format = format;
    status = mesh_examine(prepared, &info, &upload_context, &row->report);
    if (status < 0) {
        (void)problem_respond(call, compute_problem_code(status), "%s.", srnf_strerror(status));
    }
    parsed = status == 0;
    row->vertices = (int64_t)prepared->mesh.n_vertices;
    row->faces = (int64_t)prepared->mesh.n_faces;
    return parsed;
}

static void respond_mesh(struct api_call *call, int status, const struct store_mesh *mesh)
{
    (void)api_response_header(call->response, "Location", "/v1/meshes/%s", mesh->id);
    respond_json(call, status, mesh_record(mesh));
}

bool mesh_read_body(struct api_call *call, const char *name, struct store_mesh *row,
                    struct compute_prepared *prepared, bool *held)
{
    const struct api_request *request = call->request;
    const struct store_owner owner = call_owner(call);
    struct store *store = call->api->config.store;
    enum srnf_mesh_format format;
    char id[STORE_ID_MAX];

    *row = (struct store_mesh){0};
    *prepared = (struct compute_prepared){.kernel_known = false};
    *held = false;
    if (request->body_size == 0) {
        (void)problem_respond(call, "unparsable-mesh", "The body is empty.");
        return false;
    }
    if (!choose_format(call, &format)) {
        return false;
    }
    mesh_id(id, srnf_mesh_format_name(format), request->body, request->body_size);
    *held = store_owner_has(store, owner.name, id) == 0 &&
            store_mesh_get_as(store, owner.name, id, row) == 0;
    row->owner = owner;
    if (*held) {
        return true;
    }
    memcpy(row->id, id, sizeof id);
    row->name = strdup(name);
    row->format = strdup(srnf_mesh_format_name(format));
    row->bytes = (int64_t)request->body_size;
    row->created_ms = store_now_ms();
    if (!row->name || !row->format) {
        (void)problem_respond(call, "out-of-memory", "The record could not be allocated.");
        return false;
    }
    return parse_mesh(call, format, row, prepared);
}

/* Once. False: answered, or *status, which is nothing to answer with where another request has
   deleted the mesh meanwhile. */
static bool keep_once(struct api_call *call, const char *name, struct store_mesh *row,
                      bool *created, int *status)
{
    struct store *store = call->api->config.store;
    struct compute_prepared prepared;
    bool held;

    *created = false;
    *status = STORE_OK;
    if (!mesh_read_body(call, name, row, &prepared, &held)) {
        compute_prepared_clear(&prepared);
        return false;
    }
    *status = held ? store_mesh_mend(store, call->request->body, call->request->body_size)
                   : store_mesh_put(store, row, call->request->body, created);
    if (*status == 0 && held) {
        *status = labels_rename(store, row->owner.name, row->id, name, &row->name);
    }
    if (*status == 0 && !held) {
        compute_prepared_keep(call->api->config.jobs, store, row->owner.name, row->id, &prepared);
    }
    compute_prepared_clear(&prepared);
    return *status == 0;
}

bool mesh_keep_body(struct api_call *call, const char *name, struct store_mesh *row, bool *created)
{
    int status;
    bool kept = keep_once(call, name, row, created, &status);

    for (int again = 0; again < DELETED_MEANWHILE && status == STORE_NOT_FOUND; again++) {
        store_mesh_clear(row);
        kept = keep_once(call, name, row, created, &status);
    }
    if (status != 0) {
        (void)problem_respond_store(call, status, NULL, "keeping the mesh");
    }
    return kept;
}

void meshes_create(struct api_call *call)
{
    struct store_mesh row = {0};
    char name[NAME_SIZE];
    bool created;

    if (query_name(call, name) && mesh_keep_body(call, name, &row, &created)) {
        respond_mesh(call, created ? 201 : 200, &row);
    }
    store_mesh_clear(&row);
}
