/*
 * distances.c - the process distances: the symmetric matrix of distances between the members of a
 * group, and that of a finished job as CSV and .npy.
 *
 * Registered distances are symmetric by construction: both ways of registering a pair are tried
 * and the better one counts. Degree and penalty stand in the result, since a distance means
 * nothing without them. The metrics harmonic and icp have no warps: register lets them rotate.
 *
 * Members that are left and right ones of the same by what they are called are tried mirrored too,
 * a bounded number of pairs (compute/mirror.h), unless handedness is ignore.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/tables.h"
#include "api/warnings.h"
#include "compute/distances.h"
#include "toolkit/group.h"
#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"

struct distances {
    struct group_input group;
    bool registered;
    int metric, handedness;
    long lmax;
};

static const char *const metrics[] = {"srnf", "harmonic", "srm", "icp", NULL};
static const enum srnf_metric metric_at[] = {SRNF_METRIC_SRNF, SRNF_METRIC_HARMONIC,
                                             SRNF_METRIC_SRM, SRNF_METRIC_ICP};

static const struct input_own surfaces =
    GROUP_SURFACES_OWN("\"array\"", PROCESS_GROUP_MIN, PROCESS_MATRIX_MAX);

static const struct process_input inputs[] = {
    GROUP_INPUTS_OF(distances, surfaces, PROCESS_MATRIX_MAX),
    REGISTER_INPUT(distances,
                   "Register, with the default options of register but both ways (symmetric); "
                   "false: as the surfaces are parameterized."),
    {"metric", INPUT_CHOICE, offsetof(struct distances, metric),
     "srnf: L2 over the sphere of the difference of SRNFs, whose squared norm is the area: in the "
     "coordinates' unit of length. harmonic: L2 over the sphere of the difference of the surfaces, "
     "centred, after a rotation in space that leaves their parameters as they are: in lengths too. "
     "srm: as srnf, by square-root maps |n|^(1/2) f: in squared lengths. icp: root mean square "
     "distance of closest points, after rigid alignment: in lengths. Surfaces of unit area have "
     "the "
     "root of their area as unit.",
     .choices = metrics},
    HANDEDNESS_INPUT(distances,
                     "members that are left and right ones of the same, by label, subject or name, "
                     "mirrored too, in 12 pairs at most, and two members alone, registered, by "
                     "metric srnf, whatever they are called; and to warn where that"),
    {"lmax", INPUT_INTEGER, offsetof(struct distances, lmax),
     "Degree of the comparison; the surfaces are cut or filled up to it. Default: the largest of "
     "theirs.",
     .lowest = SRNF_DEGREE_MIN, .highest = SRNF_DEGREE_MAX, .derived = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    GROUP_LABELS_OUTPUTS,
    {"matrix", OUTPUT_MATRIX,
     "Symmetric; also as CSV and .npy from the job's results. Of metric srnf, entries are the "
     "distance that geodesic tells of the pair, with the same register, where lmax is the larger "
     "degree of the two."},
    {"lmax", OUTPUT_INTEGER, "Degree of the comparison."},
    BRIDGED_GROUP_OUTPUTS,
    REGISTRATION_OUTPUT,
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    size_t n = json_array_size(json_object_get(given->canonical, "surfaces"));
    long degree = inputs_integer(given, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, given->degree);
    bool registered = !json_is_false(json_object_get(given->canonical, "register"));

    inputs_check_memory(given, n, degree, 1,
                        3.0 * 8.0 * (double)n * (double)n +
                            (registered ? srnf_distances_memory(n, (size_t)degree) : 0.0));
}

/* ---- Running --------------------------------------------------------------------------------- */

struct measured {
    enum srnf_metric metric;
    struct srnf_register_options options;
    const struct srnf_register_options *registration; /* NULL: as they are parameterized */
    struct group_sides sides;
    struct compute_handedness handedness;
    struct compute_group group;
    double *matrix; /* [n][n] */
};

static void clear(struct measured *measured)
{
    group_sides_clear(&measured->sides);
    compute_group_clear(&measured->group);
    srnf_free(measured->matrix);
}

/* Options, and which members may be left and right ones. */
static int prepare(struct jobs_run *run, const struct distances *asked, struct measured *measured,
                   struct jobs_result *result)
{
    *measured = (struct measured){.metric = metric_at[asked->metric],
                                  .options = registration_pair_defaults(false),
                                  .handedness = {.mirrored = asked->group.mirrored}};
    measured->registration = asked->registered ? &measured->options : NULL;
    if (asked->handedness == HANDEDNESS_IGNORE) {
        return 0;
    }
    measured->handedness.opposite = group_sides_opposite;
    measured->handedness.user = &measured->sides;
    return group_sides_read(run, asked->group.surfaces, asked->group.cohort, &measured->sides)
               ? 0
               : compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
}

/* The matrix, at one degree. Registered pairs are kept for a later attempt
   of the job. */
static int measure(struct jobs_run *run, struct measured *measured, struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    struct compute_group *group = &measured->group;
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = SRNF_ENOMEM;

    jobs_run_phase(run, 100.0);
    measured->matrix = srnf_alloc(group->n, group->n * sizeof(double));
    if (measured->matrix) {
        status = jobs_transform_acquire(jobs, group->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);
    }
    if (status == 0) {
        status = compute_distances(run, sht, measured->metric, group, measured->registration,
                                   measured->matrix, result, &error);
        if (status >= 0) {
            status = compute_mirror_group(run, sht, measured->metric, group, measured->registration,
                                          measured->matrix, &measured->handedness, &error);
        }
        jobs_transform_release(jobs, sht);
    }
    if (status == COMPUTE_FAILED) {
        return status;
    }
    return status < 0 ? compute_fail(result, status, &error, "computing the distances") : 0;
}

static json_t *document_of(struct jobs_run *run, const struct group_input *members,
                           const struct measured *measured)
{
    const size_t shape[2] = {members->n, members->n};
    const struct compute_handedness *handedness = &measured->handedness;
    json_t *labels =
        group_labels(run, members->surfaces, json_object_get(members->cohort, "subjects"));
    json_t *document = json_pack(
        "{s:O, s:o, s:o, s:I}", "labels", labels, "groups", group_groups(members->cohort), "matrix",
        json_nested(measured->matrix, 2, shape), "lmax", (json_int_t)measured->group.degree);

    routes_set_bridged(document, members->n, members->ids, measured->group.bridged);
    warnings_put(document, handedness->unnamed
                               ? handedness_of_pair(run, members->ids[0], members->ids[1], false,
                                                    &handedness->trials[0])
                               : handedness_of_trials(labels, handedness));
    json_decref(labels);
    /* harmonic and icp turn surfaces, and warp nothing */
    (void)json_object_set_new(
        document, "registration",
        registration_json(measured->metric <= SRNF_METRIC_SRM ? measured->registration : NULL));
    group_warn_duplicates(run, document, members->surfaces, members->cohort, NULL);
    return document;
}

static json_t *run_distances(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct distances *asked = typed;
    const struct group_input *members = &asked->group;
    struct measured measured;
    struct group_doubts doubts = {.surfaces = members->surfaces,
                                  .cohort = members->cohort,
                                  .rotates = asked->registered,
                                  .mirrors = asked->handedness == HANDEDNESS_CHECK};
    json_t *document = NULL;

    if (prepare(run, asked, &measured, result) == 0 &&
        group_load(run, members, asked->registered, (size_t)asked->lmax, &measured.group, result) ==
            0 &&
        measure(run, &measured, result) == 0 &&
        process_finite(members->n * members->n, measured.matrix, "the distances", result)) {
        document = document_of(run, members, &measured);
        doubts.group = &measured.group;
        doubts.pairs = measured.matrix;
    }
    if (document && !group_doubts_warn(run, &doubts, document, result)) {
        json_decref(document);
        document = NULL;
    }
    clear(&measured);
    return document;
}

/* ---- The matrix of a finished job ------------------------------------------------------------ */

static bool table_fits(const json_t *results, char why[API_WHY_MAX])
{
    size_t n = json_array_size(json_object_get(results, "labels"));

    (void)snprintf(why, API_WHY_MAX, "it has no labels");
    return n > 0 && table_rows_fit(results, "matrix", n, n, why);
}

/* double[n][n], malloc; NULL: no memory. */
static double *read_matrix(const json_t *document, size_t *n)
{
    const json_t *rows = json_object_get(document, "matrix");
    double *values;

    *n = json_array_size(rows);
    values = calloc(*n ? *n * *n : 1, sizeof *values);
    for (size_t i = 0; values && i < *n; i++) {
        for (size_t j = 0; j < *n; j++) {
            values[i * *n + j] = json_number_value(json_array_get(json_array_get(rows, i), j));
        }
    }
    return values;
}

static void respond_csv(struct api_call *call, const json_t *document, const double *values,
                        size_t n, const char *name)
{
    const json_t *labels = json_object_get(document, "labels");
    const json_t *given = json_object_get(document, "inputs");
    const json_t *subjects = json_object_get(json_object_get(given, "cohort"), "subjects");
    struct table_text text;

    if (!table_open(call, &text)) {
        return;
    }
    csv_member_heads(text.out);
    for (size_t j = 0; j < n; j++) {
        csv_text(text.out, false, json_string_value(json_array_get(labels, j)));
    }
    csv_end_line(text.out);
    for (size_t i = 0; i < n; i++) {
        csv_member(text.out, labels, subjects, json_object_get(given, "surfaces"), i);
        for (size_t j = 0; j < n; j++) {
            csv_number(text.out, false, values[i * n + j]);
        }
        csv_end_line(text.out);
    }
    table_respond_csv(call, &text, name);
}

/* ?condensed=true. False when a problem was answered. */
static bool choose_condensed(struct api_call *call, bool *condensed)
{
    struct problem_list problems = {.errors = NULL};
    bool refused = false;
    char text[8];

    *condensed = false;
    if (!query_get(call, "condensed", text, sizeof text, &refused)) {
        return !refused;
    }
    *condensed = strcmp(text, "true") == 0;
    if (*condensed || strcmp(text, "false") == 0) {
        return true;
    }
    problem_add(&problems, "/condensed", "condensed must be true or false");
    (void)problem_respond_list(call, "invalid-input", &problems);
    return false;
}

/* The entries above the diagonal, row by row, as scipy's squareform has them; in place. */
static size_t condense(double *values, size_t n)
{
    size_t count = 0;

    for (size_t i = 0; i < n; i++) {
        for (size_t j = i + 1; j < n; j++) {
            values[count++] = values[i * n + j];
        }
    }
    return count;
}

static void respond_table(struct api_call *call, const struct store_job *job, int form)
{
    char name[TABLE_NAME_MAX];
    double *values = NULL;
    json_t *document;
    bool condensed;
    size_t n = 0;

    if (!choose_condensed(call, &condensed)) {
        return;
    }
    document = table_results(call, job, "distances", name);
    if (!document) {
        return;
    }
    values = read_matrix(document, &n);
    if (!values) {
        (void)problem_respond(call, "out-of-memory", "The table does not fit into memory now.");
        goto out;
    }
    if (condensed) {
        const size_t count = condense(values, n);
        table_respond_npy(call, values, 1, &count, name);
    } else if (form == TABLE_NPY) {
        const size_t shape[2] = {n, n};
        table_respond_npy(call, values, 2, shape, name);
    } else {
        respond_csv(call, document, values, n, name);
    }
out:
    free(values);
    json_decref(document);
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct distances),
    .complete = complete,
    .run = run_distances,
};

const struct api_process distances_process = {
    .id = "distances",
    .title = "Distances between surfaces",
    .description = "The symmetric matrix of distances between the surfaces of a list or a cohort, "
                   "registered pair by pair or as they are parameterized.",
    .methods = "Shapes were compared pair by pair[ after elastic registration]",
    .table = &table,
    .seconds = distances_seconds,
    .respond_table = respond_table,
    .table_fits = table_fits,
    .condensed = true,
};
