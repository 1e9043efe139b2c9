/*
 * neighbours.c - the process neighbours: the k nearest of each member of a group by registered
 * distances, and their table as CSV and .npy.
 *
 * They are those that distances has in the rows of its matrix, with the metric srnf and handedness
 * ignore, to the bit. Pairs that a lower bound rules out are not registered
 * (core/stats/neighbours.c).
 */
#include <stdio.h>
#include <stdlib.h>

#include "api/tables.h"
#include "compute/distances.h"
#include "toolkit/group.h"
#include "toolkit/group_doubts.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"
#include "text.h"

#define K_DEFAULT 10
#define K_MAX 100

struct neighbours {
    struct group_input group;
    long k, lmax;
};

static const struct input_own surfaces =
    GROUP_SURFACES_OWN("\"array\"", PROCESS_GROUP_MIN, COMPUTE_PAIRS_MAX);

static const struct process_input inputs[] = {
    GROUP_INPUTS_OF(neighbours, surfaces, COMPUTE_PAIRS_MAX),
    {"k", INPUT_INTEGER, offsetof(struct neighbours, k),
     "How many of each member, up to all others and to " PROCESS_TEXT(
         K_MAX) ". Default: " PROCESS_TEXT(K_DEFAULT) ", or all others where there are fewer.",
     .lowest = 1, .highest = K_MAX, .open = true, .derived = true},
    {"lmax", INPUT_INTEGER, offsetof(struct neighbours, lmax),
     "Degree of the comparison; the surfaces are cut or filled up to it. Default: the largest of "
     "theirs.",
     .lowest = SRNF_DEGREE_MIN, .highest = SRNF_DEGREE_MAX, .derived = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    GROUP_LABELS_OUTPUTS,
    {"indices", OUTPUT_MATRIX,
     "Of each member the places of its neighbours among the members, from 0, nearest first; equal "
     "distances in the order of the members."},
    {"distances", OUTPUT_MATRIX,
     "To them, as distances has them with metric srnf; with indices also as a table, CSV, and by "
     "themselves as .npy from the job's results."},
    {"pairs", OUTPUT_OBJECT,
     "{all, registered, share}: how many pairs there are, how many were registered, and which "
     "share of them never was, since a lower bound on their distance rules them out."},
    {"lmax", OUTPUT_INTEGER, "Degree of the comparison."},
    BRIDGED_GROUP_OUTPUTS,
    REGISTRATION_OUTPUT,
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    size_t n = json_array_size(json_object_get(given->canonical, "surfaces"));
    long others = (long)n - 1;
    long k = inputs_integer(given, "k", 1, K_MAX, others < K_DEFAULT ? others : K_DEFAULT);
    long degree = inputs_integer(given, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, given->degree);

    if (k > others) {
        problem_add(given->list, "/inputs/k", "is %ld; each member has %ld other%s", k, others,
                    plural((size_t)others));
    }
    inputs_check_memory(given, n, degree, 1,
                        8.0 * (double)n * ((double)n + 2000.0) +
                            srnf_distances_memory(n, (size_t)degree));
}

/* ---- Running --------------------------------------------------------------------------------- */

/* Registered pairs are tasks of workers, or kept for a later attempt of the job. */
static int find(struct jobs_run *run, const struct compute_group *group, size_t k,
                const struct srnf_register_options *options, struct srnf_neighbours *found,
                struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = jobs_transform_acquire(jobs, group->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);

    jobs_run_phase(run, 100.0);
    compute_pairs_measured(run);
    if (status == 0) {
        status = srnf_nearest_neighbours(sht, group->n, group->surfaces, k, options,
                                         jobs_run_context(run), found, &error);
        jobs_transform_release(jobs, sht);
    }
    return status < 0 ? compute_fail(result, status, &error, "finding the neighbours") : 0;
}

static json_t *indices_json(const struct srnf_neighbours *found)
{
    json_t *rows = json_array();

    for (size_t i = 0; i < found->n; i++) {
        json_t *row = json_array();

        for (size_t m = 0; m < found->k; m++) {
            (void)json_array_append_new(row,
                                        json_integer((json_int_t)found->indices[i * found->k + m]));
        }
        (void)json_array_append_new(rows, row);
    }
    return rows;
}

static json_t *document_of(struct jobs_run *run, const struct group_input *members,
                           const struct compute_group *group,
                           const struct srnf_register_options *options,
                           const struct srnf_neighbours *found)
{
    const size_t shape[2] = {found->n, found->k};
    double left = (double)(found->pairs - found->registered) / (double)found->pairs;
    json_t *pairs = json_pack("{s:I, s:I, s:o}", "all", (json_int_t)found->pairs, "registered",
                              (json_int_t)found->registered, "share", json_finite(left));
    json_t *document = json_pack(
        "{s:o, s:o, s:o, s:o, s:o, s:I}", "labels",
        group_labels(run, members->surfaces, json_object_get(members->cohort, "subjects")),
        "groups", group_groups(members->cohort), "indices", indices_json(found), "distances",
        json_nested(found->distances, 2, shape), "pairs", pairs, "lmax", (json_int_t)group->degree);

    routes_set_bridged(document, members->n, members->ids, group->bridged);
    (void)json_object_set_new(document, "registration", registration_json(options));
    group_warn_duplicates(run, document, members->surfaces, members->cohort, NULL);
    return document;
}

static json_t *run_neighbours(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct neighbours *asked = typed;
    const struct group_input *members = &asked->group;
    const struct srnf_register_options options = registration_pair_defaults(false);
    size_t k = (size_t)asked->k < members->n ? (size_t)asked->k : members->n - 1; /* older rows */
    struct group_doubts doubts = {
        .surfaces = members->surfaces, .cohort = members->cohort, .rotates = true};
    struct compute_group group = {.n = 0};
    struct srnf_neighbours found = {.n = 0};
    json_t *document = NULL;

    if (group_load(run, members, true, (size_t)asked->lmax, &group, result) == 0 &&
        find(run, &group, k, &options, &found, result) == 0 &&
        process_finite(found.n * found.k, found.distances, "the distances", result)) {
        document = document_of(run, members, &group, &options, &found);
        doubts.group = &group;
    }
    if (document && !group_doubts_warn(run, &doubts, document, result)) {
        json_decref(document);
        document = NULL;
    }
    srnf_neighbours_clear(&found);
    compute_group_clear(&group);
    return document;
}

/* ---- The table of a finished job ------------------------------------------------------------- */

static const json_t *cell(const json_t *document, const char *table, size_t i, size_t m)
{
    return json_array_get(json_array_get(json_object_get(document, table), i), m);
}

static bool table_fits(const json_t *results, char why[API_WHY_MAX])
{
    const json_t *row, *indices = json_object_get(results, "indices");
    size_t n = json_array_size(json_object_get(results, "labels"));
    size_t i, k = json_array_size(json_array_get(indices, 0));

    (void)snprintf(why, API_WHY_MAX, n == 0 ? "it has no labels" : "it has no neighbours");
    if (n == 0 || k == 0 || !table_rows_fit(results, "indices", n, k, why) ||
        !table_rows_fit(results, "distances", n, k, why)) {
        return false;
    }
    json_array_foreach(indices, i, row)
    {
        for (size_t m = 0; m < k; m++) {
            const json_t *index = json_array_get(row, m);

            if (!json_is_integer(index) || json_integer_value(index) < 0 ||
                (size_t)json_integer_value(index) >= n) {
                (void)snprintf(why, API_WHY_MAX, "row %zu of indices names none of %zu members",
                               i + 1, n);
                return false;
            }
        }
    }
    return true;
}

/* A line for each member and neighbour. */
static void respond_csv(struct api_call *call, const json_t *document, size_t n, size_t k,
                        const char *name)
{
    const json_t *labels = json_object_get(document, "labels");
    const json_t *given = json_object_get(document, "inputs");
    const json_t *subjects = json_object_get(json_object_get(given, "cohort"), "subjects");
    struct table_text text;

    if (!table_open(call, &text)) {
        return;
    }
    csv_member_heads(text.out);
    csv_text(text.out, false, "rank");
    csv_text(text.out, false, "neighbour");
    csv_text(text.out, false, "distance");
    csv_end_line(text.out);
    for (size_t i = 0; i < n; i++) {
        for (size_t m = 0; m < k; m++) {
            size_t j = (size_t)json_integer_value(cell(document, "indices", i, m));

            csv_member(text.out, labels, subjects, json_object_get(given, "surfaces"), i);
            csv_number(text.out, false, (double)(m + 1));
            csv_text(text.out, false, json_string_value(json_array_get(labels, j)));
            csv_number(text.out, false, json_number_value(cell(document, "distances", i, m)));
            csv_end_line(text.out);
        }
    }
    table_respond_csv(call, &text, name);
}

static void respond_npy(struct api_call *call, const json_t *document, size_t n, size_t k,
                        const char *name)
{
    const size_t shape[2] = {n, k};
    double *values = calloc(n * k, sizeof *values);

    if (!values) {
        (void)problem_respond(call, "out-of-memory", "The table does not fit into memory now.");
        return;
    }
    for (size_t c = 0; c < n * k; c++) {
        values[c] = json_number_value(cell(document, "distances", c / k, c % k));
    }
    table_respond_npy(call, values, 2, shape, name);
    free(values);
}

static void respond_table(struct api_call *call, const struct store_job *job, int form)
{
    char name[TABLE_NAME_MAX];
    json_t *document = table_results(call, job, "neighbours", name);
    size_t n, k;

    if (!document) {
        return;
    }
    n = json_array_size(json_object_get(document, "labels"));
    k = json_array_size(json_array_get(json_object_get(document, "indices"), 0));
    if (form == TABLE_NPY) {
        respond_npy(call, document, n, k, name);
    } else {
        respond_csv(call, document, n, k, name);
    }
    json_decref(document);
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct neighbours),
    .complete = complete,
    .run = run_neighbours,
};

const struct api_process neighbours_process = {
    .id = "neighbours",
    .title = "Nearest neighbours in a group",
    .description = "The nearest other members of each member of a list or a cohort, by registered "
                   "distances, without registering pairs that a lower bound rules out.",
    .methods = "The nearest neighbours of each shape were found by distances of square-root normal "
               "fields (SRNFs)[ after elastic registration]",
    .table = &table,
    .seconds = neighbours_seconds,
    .guessed = true, /* the shapes decide how many pairs the bound rules out */
    .respond_table = respond_table,
    .table_fits = table_fits,
};
