/*
 * handler.h - what every handler works with: the service, the call that it answers, problems,
 * responses, parts of the request, records, and the table of processes. The handlers themselves are
 * listed in routes.h.
 */
#ifndef SRNFD_API_HANDLER_H
#define SRNFD_API_HANDLER_H

#include <jansson.h>

#include <pthread.h>

#include "api/api.h"
#include "jobs/jobs.h"
#include "jobs/memory.h"

struct compute_prepared; /* compute/prepared.h */
struct store_job;        /* store/job.h */
struct store_model;      /* store/model.h */
struct store_mesh;       /* store/mesh.h */
struct store_surface;    /* store/surface.h */

struct api_auth;     /* auth.c: tokens, and what each has used */
struct changes;      /* changes.h */
struct remote_rules; /* remote.h */
struct api_inflight; /* inflight.c: the Idempotency-Keys of requests in progress */

struct api {
    struct api_config config;
    struct api_inflight *inflight;
    struct api_auth *auth;
    struct changes *changes;
    struct remote_rules *remote; /* where links may lead */
    struct jobs_memory uploads;  /* what reading all uploads has in use */
    struct {                     /* of the last write that /readyz tried (monitoring.c) */
        pthread_mutex_t mutex;
        int64_t at_ms; /* monotonic; 0: none yet */
        int status;
    } probe;
};

/* What the inputs of an execution name, noted while they are read: what a job's expected time is
   computed from (toolkit/seconds.h). */
struct api_work {
    size_t surfaces, meshes; /* meshes are to be encoded */
    int64_t faces;           /* of these meshes together */
    long degree;             /* the highest of the surfaces and models */
    size_t bridges;          /* surfaces whose meshes are encoded again if they are registered */
    int64_t bridged_faces;   /* of these meshes together */
    int64_t voxels;          /* of volumes */
    int64_t labelled;        /* of them, in the labels that are asked for */
    double bytes;            /* that a job is judged to need; 0: it is not judged */
};

/* One parsed request; parameters are those of the path, in the order of the route's braces. */
struct api_call {
    struct api *api;
    const struct api_request *request;
    struct api_response *response;
    const char *parameters[4];
    struct api_work work;
    size_t
        *unpack_left; /* of an import: bytes that its packed files may still unpack to; or NULL */
};

/* ---- Problems (problem.c): one table of codes with status and title -------------------------- */

/* Fills the response with the problem of that code; detail is a sentence. Returns its HTTP status.
   */
int problem_respond(struct api_call *call, const char *code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Member errors [{pointer, detail}], collected while inputs are validated. */
#define PROBLEMS_MAX 20
struct problem_list {
    json_t *errors; /* array of the first PROBLEMS_MAX, or NULL while there are none */
    size_t count;   /* of all that were added */
};
/* Whether what is added is counted alone: nobody is shown more. */
bool problem_list_full(const struct problem_list *list);
/* Pointer to a member of what `at` points to: RFC 6901 has its own way to write tildes and slashes.
   What does not fit is cut. */
void problem_point(const char *at, const char *name, char *pointer, size_t size);
void problem_add(struct problem_list *list, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* The same with a document of problem_json that has more members; it is taken over. */
void problem_respond_document(struct api_call *call, json_t *document);
int problem_respond_list(struct api_call *call, const char *code, struct problem_list *list);
/* The problem of that code with one more member, which it takes over. */
int problem_respond_with(struct api_call *call, const char *code, const char *detail,
                         const char *member, json_t *value);
/* The stored problem of a failed job as a JSON object (new reference). */
json_t *problem_json(const char *code, const char *detail, const char *instance,
                     const char *request_id);
bool problem_known(const char *code);
/* The code as a static string; "internal-error" where there is no such code. */
const char *problem_static_code(const char *code);
/* HTTP status of a code, 500 for one that the table does not have. */
int problem_status(const char *code);
/* Answers what a failure of the store means: 404 with the code given, 503, 507 or 500. */
int problem_respond_store(struct api_call *call, int store_status, const char *not_found_code,
                          const char *what);
/* Times that a request is tried anew where another has deleted what it works on. */
#define DELETED_MEANWHILE 8
/* Answers that a quota is used up: 429 with Retry-After, or 507 for bytes. */
void quota_respond(struct api_call *call, enum store_quota quota, int retry_seconds);

/* ---- Responses (respond.c; less common ones in respond.h) ------------------------------------ */

/* Takes over the reference; NULL becomes a 500. */
void respond_json(struct api_call *call, int status, json_t *document);
/* Takes over bytes (malloc). */
void respond_bytes(struct api_call *call, int status, const char *content_type,
                   unsigned char *bytes, size_t size);
/* The same with bytes that outlive the service. */
void respond_static(struct api_call *call, int status, const char *content_type, const void *bytes,
                    size_t size);
/* "2026-01-31T12:00:00.123Z", or JSON null for 0. */
json_t *json_time(int64_t ms);
/* Sets ETag to the tag in quotes; of a GET or HEAD, answers 412 where If-Match does not name it,
   and 304 where If-None-Match does: then true, and nothing more is to be done. */
bool respond_not_modified(struct api_call *call, const char *tag);
/* Before a change: where If-Match does not name the tag, or If-None-Match does, answers 412: then
   true, and nothing more is to be done. NULL: it is there, but has no tag. */
bool respond_precondition_failed(struct api_call *call, const char *tag);

/* ---- Parts of the request -------------------------------------------------------------------- */

/* Value of a query parameter, percent-decoded into buffer; false if absent (or problem answered:
   *refused). respond.c; query_next is in respond.h. */
bool query_get(struct api_call *call, const char *name, char *buffer, size_t size, bool *refused);
/* Parses a JSON body strictly: duplicate keys, depth, trailing bytes and non-objects are problems,
   answered (body.c). */
json_t *body_json(struct api_call *call);
/*
 * Reads the mesh that is the body, and stores nothing (meshes_create.c).
 *   name     [in]  of the row, unless the owner has the mesh
 *   row      [out] as the store is to have it, with its report; or as the owner has it there
 *   prepared [out] the mesh as it was prepared; empty where the owner has it: it is not parsed then
 *   held     [out] whether the owner has it
 * False when a problem was answered. Row and prepared mesh are to be cleared in any case.
 */
bool mesh_read_body(struct api_call *call, const char *name, struct store_mesh *row,
                    struct compute_prepared *prepared, bool *held);
/* The same, and keeps it for the caller; *created: it is new there. False when a problem was
   answered. store_mesh_clear in any case. */
bool mesh_keep_body(struct api_call *call, const char *name, struct store_mesh *row, bool *created);
/* Index of the media type in the list (ended by NULL) that Accept likes best, the first of equals;
   -1: none (negotiate.c). */
int accept_best(const struct api_request *request, const char *const *media_types);

/* ---- Records of what is stored, as JSON (meshes.c, surfaces_record.c, jobs_record.c) --------- */

json_t *mesh_record(const struct store_mesh *mesh);
/* Whether its report has transform-not-applied. */
bool mesh_untransformed(const struct store_mesh *mesh);
/* The stored report of a mesh as it reads today (new reference), or NULL (mesh_report.c). */
json_t *mesh_report_load(const struct store_mesh *mesh);
/* Whether a stored mesh cannot be analysed, and the first reason with its element. */
bool mesh_first_problem(const struct store_mesh *mesh, char code[48], char detail[320]);
/* The media type of a mesh format: "model/stl", ... */
const char *mesh_media_type(const char *format);
json_t *surface_record(const struct store_surface *surface);
json_t *job_record(const struct store_job *job, const char *cache);

/* ---- Processes: what server/processes declares, as this layer sees it ------------------------ */

struct process_table; /* toolkit/table.h */

#define API_WHY_MAX 160 /* bytes of why a model or results cannot be used */
struct api_process {
    const char *id, *title, *description;
    /* Of an analysis: what was done, as sentences for a paper, without the last full stop. Words in
       square brackets hold where shapes were registered. NULL: it analyses nothing. */
    const char *methods;
    /* Its inputs and outputs: schemas, validation and typed inputs follow from it. */
    const struct process_table *table;
    /* Seconds that a job with these canonical inputs is expected to take. */
    double (*seconds)(const struct api_work *work, const json_t *inputs);
    bool guessed; /* that is no measured figure: it orders the queue, and nobody is told */
    /* Of a process whose results have a form as a table too: answers with the results of a
       successful job in this form (tables.h). Otherwise NULL. */
    void (*respond_table)(struct api_call *call, const struct store_job *job, int form);
    /* Of such a process: whether results that were made elsewhere have what its table needs; why:
       where they have not, a sentence's end. */
    bool (*table_fits)(const json_t *results, char why[API_WHY_MAX]);
    bool condensed; /* and that as .npy has a condensed form, which `condensed` asks for */
    /* Of a process that reads more of a model than its numbers: whether one that was made
       elsewhere, with all its arrays, has what the process needs, where it is of the kind that the
       process takes; why: where it has not, a sentence's end, or "". Otherwise NULL. */
    bool (*model_fits)(const struct store_model *model, char why[API_WHY_MAX]);
};
/* The processes that a service offers, and what is the same for each: this layer knows none of
   them by name. */
struct api_processes {
    const struct api_process *const *rows; /* ended by NULL */
    /* Validates inputs (an object), resolves references (mesh and surface ids must exist; a mesh
       where a surface is wanted is replaced as the contract says), fills defaults, and returns the
       canonical inputs (new reference, keys sorted when dumped), or NULL with problems in list or
       an answered problem in call->response. */
    json_t *(*canonicalize)(const struct process_table *table, struct api_call *call,
                            const json_t *inputs, struct problem_list *list);
    /* JSON Schemas with units, defaults and limits (new references). */
    json_t *(*inputs_schema)(const struct process_table *table);
    json_t *(*outputs_schema)(const struct process_table *table);
};
/* processes.c: by its id, or NULL. */
const struct api_process *api_process_find(const struct api *api, const char *id);
/* Their ids, ended by NULL, as many as fit. */
#define API_PROCESSES_MAX 64
void api_process_names(const struct api *api, const char *names[API_PROCESSES_MAX]);
/* Answers that there is none of the id in the path, and which are there. */
void api_process_missing(struct api_call *call);

/* A handler answers one route (routes.h). */
typedef void api_handler(struct api_call *call);

#endif
