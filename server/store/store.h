/*
 * store.h - everything durable: one SQLite database and a folder of content-addressed blobs under
 * the data directory. The only part of the daemon that knows SQLite or writes files.
 *
 * Design
 *   One writer thread owns the only read-write connection: it executes queued writes in groups
 *   (one transaction, one fsync for all that wait), runs the checkpoints when idle, and wakes the
 *   callers. Every writing function below blocks until its group is committed with
 *   synchronous=FULL: what it returns is a promise that survives kill -9. Readers use read-only
 *   connections, one per calling thread at a time, kept in a pool. A group that fails as a whole
 *   is retried one write at a time, so that one bad write does not spoil its neighbours.
 *
 *   Values up to STORE_INLINE_MAX bytes live in the database; larger ones are files under
 *   blobs/ab/abcdef... named by their SHA-256: written under a temporary name, fsync, rename,
 *   fsync of the folder, and only then the row.
 *
 * Functions return 0 or a negative STORE_* code. Every struct store_x filled by a function owns
 * its strings and is released by the matching store_x_clear. Any function may be called from any
 * thread.
 */
#ifndef SRNFD_STORE_H
#define SRNFD_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STORE_INLINE_MAX ((size_t)256 * 1024)
#define STORE_ID_MAX 64 /* bytes of the longest id with its zero */

enum store_status {
    STORE_OK = 0,
    STORE_NOT_FOUND = -1,
    STORE_CONFLICT = -2, /* the row is not in the state that the write asks for */
    STORE_FULL = -3,     /* no space left on the device */
    STORE_IO = -4,       /* any other failure of the device */
    STORE_CORRUPT = -5,  /* not our database, damaged, or a blob that does not match its name */
    STORE_NEWER = -6,    /* written by a newer version */
    STORE_BUSY = -7,     /* another daemon holds the data directory */
    STORE_NOMEM = -8,
    STORE_CLOSED = -9,  /* the store is shutting down */
    STORE_QUOTA = -10,  /* the owner holds as many bytes as it may */
    STORE_QUEUED = -11, /* the owner has as many jobs waiting as it may */
};
const char *store_strerror(int status);

struct store;

/* Creates or opens the data directory, migrates the database (each migration in one transaction),
   takes the lock that keeps a second daemon out, and starts the writer thread. message gets a
   sentence on failure. */
int store_open(struct store **out, const char *directory, char *message, size_t message_size);
void store_close(struct store *store);

/* Content ids: prefix + 32 hex digits of SHA-256. */
void store_content_id(char id[STORE_ID_MAX], const char *prefix, const void *bytes, size_t size);
void store_sha256_hex(char hex[65], const void *bytes, size_t size);

/* Milliseconds since the epoch: the only clock that rows carry. */
int64_t store_now_ms(void);

/* ---- Owners ---------------------------------------------------------------------------------- */

/* Bytes of the longest name of an owner with its zero. An owner is the name of a token; "" is the
   one owner of a service without tokens. */
#define STORE_OWNER_MAX 65

/* For whom something is stored. */
struct store_owner {
    const char *name;  /* borrowed; NULL: "" */
    int64_t bytes_max; /* that the owner may hold with it, otherwise STORE_QUOTA; 0: no limit;
                          STORE_BYTES_KEPT: as was said the last time */
};
#define STORE_BYTES_KEPT INT64_C(-1)

/* Who asks: what belongs to the owner is seen, with `all` what belongs to anyone. */
struct store_view {
    const char *owner; /* NULL: "" */
    bool all;
};

/* Whether the mesh, surface, model or job of this id belongs to the owner (NULL: ""): STORE_OK or
   STORE_NOT_FOUND. */
int store_owner_has(struct store *store, const char *owner, const char *id);
/* Bytes that the owner holds: meshes, coefficients, the arrays of models, what jobs were given,
   results and checkpoints, cohorts, and for each row something for itself. What several owners have
   counts for each. most: what it may hold, as was said last (0: any number); may be NULL. */
int store_owner_bytes(struct store *store, const char *owner, int64_t *bytes, int64_t *most);
/* Remembers when a token was last used, by its id. */
int store_token_used(struct store *store, const char *token, int64_t when_ms);

/* ---- Meshes ---------------------------------------------------------------------------------- */

struct store_mesh {
    char id[STORE_ID_MAX]; /* mesh-..., of the bytes and the format */
    char *name;            /* may be empty */
    char *format;
    char *report; /* JSON text, opaque here */
    int64_t bytes, vertices, faces, created_ms;
    struct store_owner owner; /* to be set for put; not set by get */
};

/* Stores the mesh for its owner, unless the owner has it; *created says which. Where the owner has
   it and its content is damaged, the content is replaced. content has mesh->bytes bytes, mesh->id
   is set. On return mesh->created_ms and mesh->name are what the store holds for that owner. */
int store_mesh_put(struct store *store, struct store_mesh *mesh, const void *content,
                   bool *created);
/* For a mesh that is there: content replaces what is stored of it, where that is damaged. */
int store_mesh_mend(struct store *store, const void *content, size_t size);
int store_mesh_get(struct store *store, const char *id, struct store_mesh *mesh);
/* The same as this owner (NULL: nobody) knows it: with the owner's name and time, where the owner
   has it. Whether the owner may see it is not asked: store_owner_has does. */
int store_mesh_get_as(struct store *store, const char *owner, const char *id,
                      struct store_mesh *mesh);
/* content is allocated with malloc. */
int store_mesh_content(struct store *store, const char *id, unsigned char **content, size_t *size);
void store_mesh_clear(struct store_mesh *mesh);

/* ---- Surfaces -------------------------------------------------------------------------------- */

#define STORE_MAPS_MAX 8
#define STORE_MAP_NAME_MAX 32 /* bytes of the longest name with its zero */

/* Scalar maps on a Gauss-Legendre grid of the sphere. Names: letters, digits, underscores. */
struct store_maps {
    size_t count; /* 0: none */
    int64_t n_theta, n_phi;
    char names[STORE_MAPS_MAX][STORE_MAP_NAME_MAX];
    double *values; /* [count][n_theta][n_phi], malloc */
};
void store_maps_clear(struct store_maps *maps);
size_t store_maps_values(const struct store_maps *maps);

struct store_surface {
    char id[STORE_ID_MAX]; /* surf-..., of lmax, the coefficients and scale, and of the maps */
    char *name;
    char *record; /* JSON text of everything else in the record, opaque here */
    int64_t lmax, created_ms;
    double *coefficients; /* [3][(lmax+1)^2], malloc; NULL where only the record was asked for */
    size_t coefficient_count;
    struct store_maps maps;   /* to be put with it; store_surface_maps reads them */
    struct store_owner owner; /* to be set for put; not set by get */
};

/* Canonical content: int64 lmax, the doubles of the coefficients (-0 as 0), the double scale,
   little-endian. */
void store_surface_id(char id[STORE_ID_MAX], int64_t lmax, const double *coefficients,
                      double scale);
/* The id of a surface with maps from the id that it has without. */
void store_surface_id_maps(char id[STORE_ID_MAX], const struct store_maps *maps);
/* As store_mesh_put, damaged content included (of the coefficients); coefficient_count must be 3
   (lmax + 1)^2. On return name, record and created_ms are what the store holds. */
int store_surface_put(struct store *store, struct store_surface *surface, bool *created);
int store_surface_get(struct store *store, const char *id, bool with_coefficients,
                      struct store_surface *surface);
/* The maps of a surface; STORE_NOT_FOUND: it has none. */
int store_surface_maps(struct store *store, const char *id, struct store_maps *maps);
/* As store_mesh_get_as: name, record and time are the owner's. */
int store_surface_get_as(struct store *store, const char *owner, const char *id,
                         bool with_coefficients, struct store_surface *surface);
void store_surface_clear(struct store_surface *surface);

/* ---- Cohorts --------------------------------------------------------------------------------- */

#define STORE_COHORT_NAME_MAX 101 /* bytes of the longest name with its zero */

struct store_cohort {
    char name[STORE_COHORT_NAME_MAX];
    char owner[STORE_OWNER_MAX]; /* set by get and in lists */
    char *record;                /* JSON text, opaque here; the same content is the same text */
    char digest[65];             /* SHA-256 of the record: set by put and get */
    int64_t created_ms;
    size_t n_members;
    char (*members)[STORE_ID_MAX]; /* [n_members] mesh-... or surf-..., malloc; NULL in lists */
    struct store_view view;        /* for put: whose it is, and whether members may be others' */
    int64_t bytes_max;             /* for put: as of struct store_owner */
};
void store_cohort_clear(struct store_cohort *cohort);

/* Stores the cohort; *created is false where it is there with this very record. What it names
   stays as long as the cohort does. STORE_CONFLICT: the name is taken by another record.
   STORE_NOT_FOUND: member number *missing does not exist. */
int store_cohort_put(struct store *store, struct store_cohort *cohort, bool *created,
                     size_t *missing);
int store_cohort_get(struct store *store, const char *name, struct store_cohort *cohort);
int store_cohort_delete(struct store *store, const char *name);
/* Names are each owner's own; the functions above are for the owner "". */
int store_cohort_get_as(struct store *store, const char *owner, const char *name,
                        struct store_cohort *cohort);
int store_cohort_delete_as(struct store *store, const char *owner, const char *name);
/* Who has a cohort of that name: the first `most` of them by name, and how many there are. */
int store_cohort_owners(struct store *store, const char *name, char (*owners)[STORE_OWNER_MAX],
                        size_t most, size_t *count);

/* ---- Models ---------------------------------------------------------------------------------- */

/* The arrays of a model, by index. */
enum store_model_array {
    STORE_MODEL_MEAN_Q,      /* [3][n_theta][n_phi] */
    STORE_MODEL_MODES,       /* [components][3][n_theta][n_phi] */
    STORE_MODEL_EIGENVALUES, /* [components] */
    STORE_MODEL_SCORES,      /* [subjects][components] */
    STORE_MODEL_CALIBRATION, /* [STORE_CALIBRATION_VALUES][subjects] leave-one-out values */
};
#define STORE_MODEL_ARRAYS 5
#define STORE_CALIBRATION_VALUES 4

struct store_model {
    char id[STORE_ID_MAX];   /* model-..., set by put */
    char mean[STORE_ID_MAX]; /* the mean surface, which stays as long as the model */
    char *record;            /* JSON text of everything else in the record, opaque here */
    int64_t lmax, n_theta, n_phi, subjects, components, created_ms;
    /* malloc; NULL where not asked for, and the calibration also where the model has none: those
       made before migration 7 */
    double *arrays[STORE_MODEL_ARRAYS];
    /* What else the model is made of, as a text that is part of its id: two models of the same
       arrays are one only if that is the same. Borrowed by put; NULL: nothing, as of those made
       before there was this text. */
    const char *identity;
    struct store_owner owner; /* to be set for put; not set by get */
};
void store_model_clear(struct store_model *model);
/* Numbers in one of the arrays. */
size_t store_model_count(const struct store_model *model, enum store_model_array array);

/* Stores the model, with all its arrays, unless it is there. Its id is made of the canonical
   content: the sizes in the order above, the id of the mean, the doubles of the arrays (-0 as 0),
   little-endian, and the identity. On return id, record and created_ms are what the store holds.
   STORE_NOT_FOUND: there is no such mean. */
int store_model_put(struct store *store, struct store_model *model, bool *created);
/* arrays: a bit 1 << enum store_model_array for each that is wanted. */
int store_model_get(struct store *store, const char *id, unsigned arrays,
                    struct store_model *model);
/* As store_mesh_get_as: record and time are the owner's. */
int store_model_get_as(struct store *store, const char *owner, const char *id, unsigned arrays,
                       struct store_model *model);

/* ---- Lists ----------------------------------------------------------------------------------- */

/* Newest first. A cursor is (created_ms, id) of the last item seen; after_id NULL or "" starts at
   the top. visit is called once per row with a struct of the kind that is valid only during the
   call; it returns false to stop. */
struct store_page {
    size_t limit;
    int64_t after_ms;
    const char *after_id;
    const char *process, *status; /* filters, for jobs only; NULL: all */
    const char *owner;            /* what belongs to this owner; NULL: to anyone */
};
int store_mesh_list(struct store *store, const struct store_page *page,
                    bool (*visit)(void *user, const struct store_mesh *mesh), void *user);
int store_surface_list(struct store *store, const struct store_page *page,
                       bool (*visit)(void *user, const struct store_surface *surface), void *user);
/* after_id is a name here. */
int store_cohort_list(struct store *store, const struct store_page *page,
                      bool (*visit)(void *user, const struct store_cohort *cohort), void *user);
int store_model_list(struct store *store, const struct store_page *page,
                     bool (*visit)(void *user, const struct store_model *model), void *user);

/* ---- Jobs ------------------------------------------------------------------------------------ */

enum store_job_status {
    STORE_JOB_ACCEPTED,
    STORE_JOB_RUNNING,
    STORE_JOB_SUCCESSFUL,
    STORE_JOB_FAILED,
    STORE_JOB_DISMISSED,
};
/* "accepted", "running", "successful", "failed", "dismissed". */
const char *store_job_status_name(enum store_job_status status);

#define STORE_TRACE_MAX 56 /* bytes of a traceparent (W3C Trace Context) with its zero */

struct store_job {
    char id[STORE_ID_MAX]; /* job- + UUIDv7 */
    char *process;
    enum store_job_status status;
    char *inputs;    /* canonical text after defaulting */
    char digest[65]; /* cache key: SHA-256 of process, inputs, numeric build id */
    char *message;   /* may be empty */
    double progress; /* 0 .. 100; < 0: unknown */
    int64_t created_ms, started_ms, finished_ms, updated_ms; /* 0: not yet */
    int64_t attempt;                                         /* 0 before the first claim */
    bool cancel_requested;
    char *problem_code; /* of a failed job, otherwise NULL */
    char *problem_detail;
    char *numeric_build;
    char owner[STORE_OWNER_MAX];
    char trace[STORE_TRACE_MAX]; /* traceparent of the submission, or "" */
    int64_t expected_ms;         /* how long it is expected to take; 0: not known */
    bool express;                /* so short that store_job_claim_express may take it */
    /* Of no row; 0 and below 0 as the store reads a job. What is told of it at this moment
       (jobs/live.c): its place among accepted jobs, 1 the next, and the seconds that a running one
       still takes. */
    size_t queue_position;
    double seconds_left;
};
void store_job_clear(struct store_job *job);

/* Adds an accepted job, with its Idempotency-Key if that is not NULL. STORE_CONFLICT: the id or
   the key is taken, or a job with this digest is accepted, running or successful already (those
   being cancelled do not count). */
int store_job_insert(struct store *store, const struct store_job *job, const char *idempotency_key,
                     const char *body_digest);
/* The same within what the owner of the job may have: STORE_QUEUED where so many of the owner's
   jobs are waiting, STORE_QUOTA where the owner holds more bytes. running is kept with the owner,
   for claims. 0: no limit. */
struct store_job_limits {
    size_t queued, running;
    int64_t bytes;
};
int store_job_insert_within(struct store *store, const struct store_job *job,
                            const struct store_job_limits *limits, const char *idempotency_key,
                            const char *body_digest);
int store_job_get(struct store *store, const char *id, struct store_job *job);
/* Newest job with this digest that is accepted, running (and not being cancelled) or successful. */
int store_job_find(struct store *store, const char *digest, struct store_job *job);
/* results is allocated with malloc; STORE_CONFLICT when the job is not successful. */
int store_job_results(struct store *store, const char *id, char **results, size_t *size);
/* The same from memory, for small results that were read since the last write (recent.c):
   STORE_NOT_FOUND where they are not there. Costs a lock and a copy; results NULL: only asks. */
int store_job_results_recent(struct store *store, const char *id, char **results, size_t *size);
/* The next job becomes running, attempt + 1: of the owner whose turn it is, the accepted one whose
   created_ms + expected_ms comes first. STORE_NOT_FOUND when no job waits, STORE_CONFLICT when
   those that do belong to owners who have as many running as they may. */
int store_job_claim(struct store *store, struct store_job *job);
/* The same among express jobs only. `except`, unless NULL, is an owner to be passed over, if there
   are others: STORE_CONFLICT when only jobs of that one wait. */
int store_job_claim_express(struct store *store, const char *except, struct store_job *job);
/* The same among the jobs that are to run with no other job beside them, which the two above leave
   out; and how many of these wait. */
int store_job_claim_alone(struct store *store, struct store_job *job);
int store_job_count_alone(struct store *store, size_t *count);
/* The place of an accepted job in the order of claims as things stand, 1 the next; 0 for a job that
   does not wait, or is not there. Owners' limits on running jobs and express claims are left out.
   O(jobs that wait), each a step along an index. */
int store_job_position(struct store *store, const char *id, size_t *position);
/* The same of all that wait, in their order, until visit returns false: one look at the queue. No
   call into the store from inside visit. */
int store_job_places(struct store *store,
                     bool (*visit)(void *user, const char *id, size_t position), void *user);
/* The one function in which a job ends or goes back: a transition table and one UPDATE guarded by
   status and attempt; STORE_CONFLICT when the guard does not hold. results only with SUCCESSFUL,
   a problem only with FAILED. Going back to ACCEPTED gives the attempt back. STORE_QUOTA: the owner
   may not hold the results; nothing has changed. */
int store_job_transition(struct store *store, const char *id, int64_t attempt,
                         enum store_job_status to, const char *results, const char *problem_code,
                         const char *problem_detail);
/* accepted becomes dismissed, running gets cancel_requested, an ended job stays as it is. */
int store_job_request_cancel(struct store *store, const char *id, struct store_job *job);
/* Ended jobs only, otherwise STORE_CONFLICT. */
int store_job_delete(struct store *store, const char *id);
int store_job_list(struct store *store, const struct store_page *page,
                   bool (*visit)(void *user, const struct store_job *job), void *user);
int store_job_count(struct store *store, enum store_job_status status, size_t *count);
/* At start: what the rows call running the daemon has died with. running -> accepted, from the
   deaths_max-th death on to run alone; running alone -> failed (attempts-exhausted). Counts both.
   What was being cancelled is dismissed. */
int store_job_recover(struct store *store, int64_t deaths_max, size_t *requeued, size_t *failed);
/* The same, where the fault has named a job (NULL, "": none). If it ran it alone has failed
   (job-crashed); the others are put back as they were, and no death is counted. */
int store_job_recover_named(struct store *store, int64_t deaths_max, const char *named,
                            size_t *requeued, size_t *failed);
/* The job that an Idempotency-Key of the last 24 h named; STORE_NOT_FOUND otherwise. */
int store_idempotency_find(struct store *store, const char *key, char job_id[STORE_ID_MAX],
                           char body_digest[65]);

/* Remembers a key for a job that exists; STORE_CONFLICT when the key is taken. */
int store_idempotency_put(struct store *store, const char *key, const char *job_id,
                          const char *body_digest);

/* What a running job needs to go on from where it is, should the daemon end: replaced as a whole,
   and dropped when the job ends. STORE_CONFLICT: this attempt of the job does not run. */
int store_checkpoint_put(struct store *store, const char *job, int64_t attempt, const void *bytes,
                         size_t size);
/* bytes is allocated with malloc; STORE_NOT_FOUND when there is none. */
int store_checkpoint_get(struct store *store, const char *job, unsigned char **bytes, size_t *size);

/* ---- Encodings ------------------------------------------------------------------------------- */

/*
 * A cache of what meshes were encoded to. Values are opaque here.
 *   name   64 hex digits, of all that decides the value
 *   mesh   that was encoded; the encoding goes with it
 *   limit  bytes of all values together, beyond which the oldest go; a few dozen may be more at
 *          times
 */
int store_encoding_put(struct store *store, const char *name, const char *mesh, const void *value,
                       size_t size, int64_t limit);
/* value is allocated with malloc. STORE_NOT_FOUND: there is none, or it is damaged. */
int store_encoding_get(struct store *store, const char *name, unsigned char **value, size_t *size);

/* ---- Retention ------------------------------------------------------------------------------- */

/* Removes the jobs that ended before this moment, as store_job_delete does. */
int store_expire_jobs(struct store *store, int64_t before_ms, size_t *removed);
/* Removes files below blobs/ that no row names, unless a backup is being made. */
int store_sweep_files(struct store *store, size_t *removed);

/* ---- Whether it works ------------------------------------------------------------------------ */

/* STORE_OK, or why nothing that needs room is taken at present: STORE_FULL, STORE_IO. What frees
   room (deletions, cancellations) is done all the same. */
int store_room(const struct store *store);
/* SELECT 1 through a reader: is the database there? */
int store_ping(struct store *store);

/* ---- For monitoring (usage.c) ---------------------------------------------------------------- */

/* Whether a write gets through to the disk: commits one that changes nothing. */
int store_probe(struct store *store);

struct store_usage {
    int64_t database, log, blobs; /* bytes */
    int64_t free;                 /* bytes left on the file system */
};
int store_usage(struct store *store, struct store_usage *usage);
int store_free_bytes(struct store *store, int64_t *bytes);

/* The jobs of one process that are accepted, or running. */
struct store_load {
    const char *process, *status;
    size_t count;
    int64_t oldest_ms; /* when the oldest of them was created */
};
int store_job_load(struct store *store, void (*visit)(void *user, const struct store_load *load),
                   void *user);

#endif
