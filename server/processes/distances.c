/*
 * distances.c - the process distances over HTTP: canonical inputs, result document, and the
 * matrix of a finished job as CSV and .npy.
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

#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "toolkit/group.h"
#include "toolkit/routes.h"
#include "toolkit/registration_options.h"
#include "api/tables.h"
#include "api/warnings.h"
#include "compute/mean.h"

static const char *const names[] = {"surfaces",    "cohort",     "register", "metric",
                                    "mixedRoutes", "handedness", NULL};
static const char *const metrics[] = {"srnf", "harmonic", "srm", "icp", NULL};

json_t *distances_canonicalise(struct api_call *call, const json_t *given,
                               struct problem_list *list)
{
    struct process_inputs inputs;
    long degree;
    size_t n;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    (void)inputs_boolean(&inputs, "register", true);
    (void)inputs_choice(&inputs, "metric", metrics);
    inputs_handedness(&inputs);
    if (!list->errors) {
        n = inputs_group(&inputs, &degree);
        if (n) {
            inputs_check_memory(&inputs, n, degree, 1);
        }
    }
    return inputs_close(&inputs);
}

static enum srnf_metric metric_of(const json_t *inputs)
{
    const char *name = json_string_value(json_object_get(inputs, "metric"));
    size_t metric = SRNF_METRIC_SRNF;

    while (name && metric < SRNF_METRIC_ICP &&
           strcmp(name, srnf_metric_name((enum srnf_metric)metric)) != 0) {
        metric++;
    }
    return (enum srnf_metric)metric;
}

/* False without memory. */
static bool read_handedness(struct jobs_run *run, const json_t *inputs, struct group_sides *sides,
                            struct compute_handedness *handedness)
{
    *sides = (struct group_sides){0};
    *handedness =
        (struct compute_handedness){.mirrored = group_mirrored(json_object_get(inputs, "cohort"))};
    if (!handedness_checked(inputs)) {
        return true;
    }
    handedness->opposite = group_sides_opposite;
    handedness->user = sides;
    return group_sides_read(run, json_object_get(inputs, "surfaces"),
                            json_object_get(inputs, "cohort"), sides);
}

static json_t *result_document(struct jobs_run *run, const json_t *inputs, const char *const *ids,
                               const struct compute_distances_outputs *outputs,
                               const struct compute_handedness *handedness)
{
    size_t n = outputs->group.n;
    const size_t shape[2] = {n, n};
    json_t *document = json_object(),
           *labels = group_labels(run, json_object_get(inputs, "surfaces"),
                                  json_object_get(json_object_get(inputs, "cohort"), "subjects"));

    (void)json_object_set_new(document, "labels", labels);
    (void)json_object_set_new(document, "groups", group_groups(json_object_get(inputs, "cohort")));
    (void)json_object_set_new(document, "matrix", json_nested(outputs->matrix, 2, shape));
    (void)json_object_set_new(document, "lmax", json_integer((json_int_t)outputs->group.degree));
    routes_set_bridged(document, n, ids, outputs->group.bridged);
    warnings_put(document, handedness->unnamed ? handedness_of_pair(run, ids[0], ids[1], false,
                                                                    &handedness->trials[0])
                                               : handedness_of_trials(labels, handedness));
    return document;
}

void distances_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document;
    struct compute_handedness handedness;
    struct group_sides sides;
    struct srnf_register_options options = registration_pair_defaults(false);
    struct compute_distances_inputs typed = {.metric = SRNF_METRIC_SRNF};
    struct compute_distances_outputs outputs = {.matrix = NULL};
    struct compute_origin *origins = NULL;
    struct group_doubts doubts;
    const char **ids = NULL;

    (void)api;
    if (!inputs) {
        return;
    }
    doubts = (struct group_doubts){.surfaces = json_object_get(inputs, "surfaces"),
                                   .cohort = json_object_get(inputs, "cohort"),
                                   .mirrors = handedness_checked(inputs)};
    ids = group_ids(json_object_get(inputs, "surfaces"), &typed.n);
    if (!read_handedness(run, inputs, &sides, &handedness) || !ids ||
        !(origins = routes_bridges(run,
                                   json_is_true(json_object_get(inputs, "mixedRoutes")) &&
                                       json_is_true(json_object_get(inputs, "register")),
                                   typed.n, ids))) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
        goto out;
    }
    typed.registration = json_is_true(json_object_get(inputs, "register")) ? &options : NULL;
    typed.metric = metric_of(inputs);
    typed.ids = ids;
    typed.origins = origins;
    if (compute_distances(run, &typed, &handedness, &outputs, result) ||
        !process_finite(typed.n * typed.n, outputs.matrix, "the distances", result)) {
        goto out;
    }
    document = result_document(run, inputs, ids, &outputs, &handedness);
    /* harmonic and icp turn surfaces, and warp nothing */
    (void)json_object_set_new(
        document, "registration",
        registration_json(typed.metric <= SRNF_METRIC_SRM ? typed.registration : NULL));
    group_warn_duplicates(run, document, json_object_get(inputs, "surfaces"),
                          json_object_get(inputs, "cohort"), NULL);
    doubts.group = &outputs.group;
    doubts.pairs = outputs.matrix;
    doubts.rotates = typed.registration != NULL;
    if (group_doubts_warn(run, &doubts, document, result)) {
        process_finish(run, document, inputs, result);
    } else {
        json_decref(document);
    }
out:
    group_sides_clear(&sides);
    compute_distances_clear(&outputs);
    srnf_free(ids);
    srnf_free(origins);
    json_decref(inputs);
}

/* ---- The matrix of a finished job ------------------------------------------------------------ */

/* double[n][n], malloc; NULL where the document is not what distances_run writes. */
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
    struct table_text text;

    if (!table_open(call, &text)) {
        return;
    }
    csv_text(text.out, true, "label");
    for (size_t j = 0; j < n; j++) {
        csv_text(text.out, false, json_string_value(json_array_get(labels, j)));
    }
    csv_end_line(text.out);
    for (size_t i = 0; i < n; i++) {
        csv_text(text.out, true, json_string_value(json_array_get(labels, i)));
        for (size_t j = 0; j < n; j++) {
            csv_number(text.out, false, values[i * n + j]);
        }
        csv_end_line(text.out);
    }
    table_respond_csv(call, &text, name);
}

void distances_respond(struct api_call *call, const struct store_job *job, enum table_form form)
{
    json_t *document = NULL;
    double *values = NULL;
    char *text = NULL, name[STORE_ID_MAX + 16];
    size_t size = 0, n = 0;
    int status = store_job_results(call->api->config.store, job->id, &text, &size);

    if (status) {
        (void)problem_respond_store(call, status, "no-such-job", job->id);
        goto out;
    }
    document = json_loadb(text, size, 0, NULL);
    values = document ? read_matrix(document, &n) : NULL;
    if (!values || json_array_size(json_object_get(document, "labels")) != n) {
        (void)problem_respond(call, "internal-error", "The stored results cannot be read.");
        goto out;
    }
    (void)snprintf(name, sizeof name, "%s-distances", job->id);
    if (form == TABLE_NPY) {
        const size_t shape[2] = {n, n};
        table_respond_npy(call, values, 2, shape, name);
    } else {
        respond_csv(call, document, values, n, name);
    }
out:
    free(values);
    json_decref(document);
    free(text);
}
