/*
 * process.h - what the files of the processes share: reading inputs into canonical form, and
 * writing results.
 *
 * A process declares its inputs and outputs in tables (toolkit/table.h), which use what is here.
 *
 * Canonical inputs are an object that holds every option after defaulting, in one spelling for each
 * meaning (whole numbers as integers, real ones as reals), and the ids of what they refer to.
 * Dumped with sorted keys they are the text whose digest finds cached results.
 */
#ifndef SRNFD_TOOLKIT_PROCESS_H
#define SRNFD_TOOLKIT_PROCESS_H

#include "api/handler.h"
#include "api/json_memory.h"
#include "api/json_numbers.h"
#include "api/meshes.h"
#include "api/surfaces.h"
#include "compute/compute.h"

/* A macro's value as a string, for schemas. */
#define PROCESS_TEXT_OF(x) #x
#define PROCESS_TEXT(x) PROCESS_TEXT_OF(x)

/* Defaults and limits that the schemas name. The degrees are those of srnf.h. */
#define PROCESS_DEGREE_DEFAULT SURFACE_DEGREE_DEFAULT
#define PROCESS_SMOOTHING_MAX 1
#define PROCESS_COORDINATE_MAX 1e9
#define PROCESS_TOLERANCE_DEFAULT 1e-12
#define PROCESS_TOLERANCE_MIN 1e-30
#define PROCESS_TOLERANCE_MAX 1
#define PROCESS_ITERATIONS_MAX 100000
#define PROCESS_STEPS_DEFAULT 7
#define PROCESS_STEPS_MIN 2
#define PROCESS_STEPS_MAX 101
#define PROCESS_ROWS_MAX 384 /* of a grid that is given: twice the working grid of degree 127 */
#define PROCESS_COLUMNS_MAX 768

#define PROCESS_WARP_DEGREE_DEFAULT 12
#define PROCESS_WARP_DEGREE_MAX 32
#define PROCESS_PENALTY_MAX 1000
#define PROCESS_GROUP_MIN 2 /* surfaces of a group */
#define PROCESS_GROUP_MAX 500
#define PROCESS_LARGE_GROUP_MAX 10000  /* where a surface more costs the same as those before */
#define PROCESS_MATRIX_MAX 1000        /* surfaces of a matrix in a result: a million numbers */
#define PROCESS_PULLBACK_GROUP_MAX 100 /* surfaces of a pulled-back mean */
#define PROCESS_MEAN_TOLERANCE_DEFAULT 1e-3
#define PROCESS_MEAN_TOLERANCE_MIN 1e-8
#define PROCESS_MEAN_TOLERANCE_MAX 1
#define PROCESS_MEAN_ITERATIONS_DEFAULT 20
#define PROCESS_MEAN_ITERATIONS_MAX 100
#define PROCESS_COMPONENTS_MAX 499
#define PROCESS_COEFFICIENTS_MAX 41 /* points along a mode */
#define PROCESS_DEVIATIONS_MAX 10   /* how far out they may be */
#define PROCESS_SAMPLES_MAX 200
#define PROCESS_QUALITY_SAMPLES_DEFAULT 1000
#define PROCESS_QUALITY_SAMPLES_MAX 10000
#define PROCESS_PERMUTATIONS_DEFAULT 10000
#define PROCESS_PERMUTATIONS_MAX 1000000
#define PROCESS_TIMES_MAX 101 /* of shooting; SRNF_SHOOT_TIMES_MAX, SRNF_SHOOT_TIME_MAX */
#define PROCESS_TIME_MAX 10
#define PROCESS_CLASSIFY_COMPONENTS_MAX 64
#define PROCESS_SIZE_WEIGHT_MAX 1000
#define PROCESS_SEED_MAX 9007199254740991 /* 2^53 - 1: what every JSON reader keeps */

/* Patterns of ids in schemas. */
#define PROCESS_MESH_PATTERN "^mesh-[0-9a-f]{32}$"
#define PROCESS_VOLUME_PATTERN "^vol-[0-9a-f]{32}$"
#define PROCESS_SURFACE_PATTERN "^(surf|mesh)-[0-9a-f]{32}$"
#define PROCESS_MODEL_PATTERN "^model-[0-9a-f]{32}$"

/* One reading of inputs. */
struct process_inputs {
    struct api_call *call;
    const json_t *given;
    struct problem_list *list;
    json_t *canonical; /* filled member by member */
    bool answered;     /* a problem of its own status (404, 422) is already the response */
    bool shape_only;   /* ids are judged by their form alone, and not looked up */
    long degree;       /* the largest of the surfaces that were looked up */
    json_t *members;   /* of the cohort, as they were when it was read; NULL without one */
    size_t place;      /* of the surface that is read, in a group: its number and 1; 0: in none */
};

/* ---- Reading (inputs.c). A problem leaves the member out of the canonical inputs. ---- */

/* names ends with NULL; members of other names are problems. False when given is no object. */
bool inputs_open(struct process_inputs *inputs, struct api_call *call, const json_t *given,
                 struct problem_list *list, const char *const *names);
/* Ends the reading: the canonical object (new reference), or NULL where there was any problem, as
   inputs whose units are mixed (scales.h). */
json_t *inputs_canonical(struct process_inputs *inputs);

/* A whole number from lowest to highest; absent: fallback. Returns the number. */
long inputs_integer(struct process_inputs *inputs, const char *name, long lowest, long highest,
                    long fallback);
/* The same where absence, or null, means something: canonical null, returned as 0. */
long inputs_integer_or_null(struct process_inputs *inputs, const char *name, long lowest,
                            long highest);
double inputs_real(struct process_inputs *inputs, const char *name, double lowest, double highest,
                   double fallback);
/* An array of 1 to `most` numbers, at most INPUTS_NUMBERS_MAX, of at most `limit` in size; absent
   or null: fallback. */
#define INPUTS_NUMBERS_MAX 101
void inputs_numbers(struct process_inputs *inputs, const char *name, size_t most, double limit,
                    size_t n_fallback, const double *fallback);
bool inputs_boolean(struct process_inputs *inputs, const char *name, bool fallback);
/* One of the choices (ended by NULL); absent: the first. */
const char *inputs_choice(struct process_inputs *inputs, const char *name,
                          const char *const *choices);

/* The name that the caller has for a mesh or surface, as that of its file; empty without one. */
void inputs_name_of(struct process_inputs *inputs, const char *id, size_t size, char *name);

/* Whether canonical inputs have this choice. */
bool inputs_chose(const json_t *canonical, const char *name, const char *choice);

/* The id of a mesh that exists and can be analysed; otherwise answers 404, or 422 with the code of
   the mesh's first problem. */
bool inputs_mesh(struct process_inputs *inputs, const char *name);
/* The id of a surface, or of a mesh that can be encoded; degree gets that of the surface. pointer
   is where the id stands. Returns the id to be put into the canonical inputs, or NULL. */
const char *inputs_surface_at(struct process_inputs *inputs, const json_t *value,
                              const char *pointer, long *degree);
/* The same for a required member, which is set. */
bool inputs_surface(struct process_inputs *inputs, const char *name, long *degree);

/* ---- Vector fields (field.c) --------------------------------------------------------- */

/* Reads {lmax, nTheta, nPhi, q} on a Gauss-Legendre grid, q [nTheta][nPhi][3], nested or flat,
   nTheta at least lmax + 1 and nPhi at least 2 lmax + 1. pointer is where it stands. Returns the
   canonical object (new reference), which lacks what has a problem. */
json_t *inputs_field(struct process_inputs *inputs, const json_t *value, const char *pointer,
                     long *degree);
/* Puts the digest of q, as qDigest, in its place; NULL is left alone. */
void field_by_digest(json_t *field);

/* ---- Results (results.c) ------------------------------------------------------------- */

/* Adds inputs, numericBuild and warnings (warnings.h) to the document, which is taken over, and
   makes it the result of the run. inputs is borrowed. To the warnings that the document has come
   those of process_doubts, of routes, degrees, units and shapes of what the inputs name, and of
   what the figures say (results.c). */
void process_finish(struct jobs_run *run, json_t *document, json_t *inputs,
                    struct jobs_result *result);
/* A new array with the warnings of one mesh that was encoded poorly, is coarse, or was not brought
   to where its file has a transform to. */
json_t *process_doubt(const struct jobs_doubt *doubt);
/* The same of all meshes of the run. */
json_t *process_doubts(struct jobs_run *run);
/* Parses the canonical inputs of a run; NULL with the problem set. */
json_t *process_parse(const char *inputs, struct jobs_result *result);
/* {"mesh", "process", "job"} of a surface record; mesh and reference may be NULL. reference is the
   surface that deformation is measured from. */
json_t *process_source(struct jobs_run *run, const char *process, const char *mesh,
                       const char *reference);
/* Whether all numbers are finite. Otherwise sets the problem of the run: what ("the scores") has
   numbers beyond the range. */
bool process_finite(size_t count, const double *values, const char *what,
                    struct jobs_result *result);
/*
 * Stores a surface that a process made, if it can be kept: finite numbers and an area. Otherwise,
 * and where the store fails, the problem of the run is set.
 *   description [in] source, fit and star are taken over in any case
 *   what        [in] "the mean": the surface in the problem's detail
 * Returns its record (new reference), or NULL.
 */
json_t *process_keep_surface(struct jobs_run *run, struct surface_description *description,
                             const char *what, struct jobs_result *result);
/*
 * Stores a mesh that a process made, as if its file had been uploaded (api/meshes.h). Otherwise,
 * and where it cannot be kept, the problem of the run is set.
 *   description [in] source is taken over in any case
 *   what        [in] "the mesh": in the problem's detail
 * Returns its record (new reference), or NULL. Its report says whether it can be analysed.
 */
json_t *process_keep_mesh(struct jobs_run *run, struct mesh_description *description,
                          const char *what, struct jobs_result *result);
/* Whether a row was read, by the status of the store. Where it could not be, and not because it is
   not there, nothing is made of the results: they would lack what it tells. */
bool process_read(int status);
/* Nothing is unread, and no memory was short: a run of the thread begins. */
void process_read_begin(void);
/* The problem of a run whose document could not be made: what process_read could not read since
   process_parse, or memory. what: "writing the results". */
void process_fail_document(struct jobs_result *result, const char *what);
/* The scale of a surface: `known` where that is positive, since it was encoded here, otherwise that
   of its record; 1 where there is none. */
double process_scale(struct jobs_run *run, const char *id, double known);
/* Where a surface was that a process has loaded (api/surfaces.h). */
struct surface_place process_place(struct jobs_run *run, const struct compute_surface *surface);
/* Whether the record of a surface or mesh says that it is a mirror image. */
bool process_mirrored(struct jobs_run *run, const char *id);
/* Whether a surface or mesh lies where the mirror image of what its place tells does: it was
   encoded so, or reached from what was. */
bool process_reflected(struct jobs_run *run, const char *id, const struct surface_place *place);
/* The frame of what is in the place of that surface or mesh: the document, which tells it. */
json_t *process_frame(struct jobs_run *run, const char *id, const struct surface_place *place,
                      json_t *frame);

#endif
