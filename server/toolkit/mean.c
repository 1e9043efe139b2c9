/*
 * mean.c - the mean of a group as several processes begin with it: see mean.h.
 *
 * A mean that has not converged within maxIterations is a result, with converged false. Its scale
 * is the mean of its members' scales.
 */
#include "toolkit/mean.h"

#include <math.h>
#include <stdio.h>

#include "api/surfaces.h"
#include "api/warnings.h"
#include "toolkit/handedness.h"
#include "toolkit/typicality.h"
#include "store/surface.h"

const char *const mean_srnf_methods[] = {"srnf", NULL};

/* Of the chains that warps of registered members were made by: nuclei at degree 15 have 0.02 to
   0.09 MB. */
#define BYTES_CHAIN 1e5
#define WARP_ROWS 48.0      /* of the grid of a mean, at least: 4 times the degree of its fields */
#define WARP_UNKNOWNS 336.0 /* of its fields, of degree 12 */
#define BYTES_HELD 134217728.0 /* without an engine to ask */
/* Of their steps, and of fields that are made in batches. */
#define BYTES_STEPS 6e3
#define BYTES_BATCHES 5e7
#define BYTES_KEPT_MOST 268435456.0
#define SQUARES 5.0 /* matrices of n x n numbers: distances, and a Gram matrix with its vectors */

static size_t group_size(const struct process_inputs *inputs)
{
    const json_t *surfaces = json_object_get(inputs->canonical, "surfaces");
    const json_t *cohort = json_object_get(inputs->canonical, "cohort");

    return json_array_size(surfaces ? surfaces : json_object_get(cohort, "surfaces"));
}

/* Nodes of the grid that a mean is registered on: that of lmax, where it is finer. */
static double warp_nodes(long degree)
{
    double rows = fmax(WARP_ROWS, 1.5 * (double)(degree + 1));

    return 2.0 * rows * rows;
}

/* Of the warp of a member, as far as it is in memory (core/stats/mean_spill.c): points, Jacobians
   and chain. */
static double bytes_of_warp(long degree)
{
    return 32.0 * warp_nodes(degree) + BYTES_CHAIN;
}

/* And of what evaluating and moving it takes, as far as it is kept (core/stats/mean_tools.c). */
static double bytes_of_tools(long degree)
{
    double rows = 4.0 * (double)degree + 16.0;

    return 8.0 * (WARP_UNKNOWNS * WARP_UNKNOWNS + 8.0 * rows * rows + 9.0 * warp_nodes(degree));
}

static double bytes_beside_fields(const struct process_inputs *inputs, size_t n, long degree)
{
    const struct jobs *jobs = inputs->call->api->config.jobs;
    double members = (double)n;
    double coefficients = 24.0 * (double)srnf_coefficient_count((size_t)degree);
    double cache = jobs ? (double)jobs_cache_limit(jobs) : BYTES_HELD;
    double bytes = n <= COMPUTE_PAIRS_MAX ? SQUARES * 8.0 * members * members : 0.0;

    bytes += 2.0 * members * coefficients;
    if (json_is_true(json_object_get(inputs->canonical, "register"))) {
        bytes += fmin(members * bytes_of_warp(degree), cache) + members * BYTES_STEPS +
                 fmin(members * bytes_of_tools(degree), BYTES_KEPT_MOST) + BYTES_BATCHES;
    }
    return bytes;
}

size_t mean_copies(const struct process_inputs *inputs, size_t copies)
{
    return group_size(inputs) > COMPUTE_PAIRS_MAX ? 1 : copies;
}

void mean_complete_beside(struct process_inputs *inputs, size_t copies, mean_bytes *more)
{
    size_t n = group_size(inputs);
    long degree = inputs_integer(inputs, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, inputs->degree);
    double bytes = bytes_beside_fields(inputs, n, degree);

    inputs_check_memory(inputs, n, degree, copies, bytes + (more ? more(inputs, n, degree) : 0.0));
    group_landmarks_complete(inputs);
}

void mean_complete(struct process_inputs *inputs, size_t copies)
{
    mean_complete_beside(inputs, copies, NULL);
}

/* ---- The mean -------------------------------------------------------------------------------- */

int group_mean_compute(struct jobs_run *run, const struct group_input *members,
                       const struct mean_input *asked, struct compute_mean_inputs more,
                       struct group_mean *mean, struct jobs_result *result)
{
    int status;

    *mean = (struct group_mean){
        .members = members,
        .options = registration_defaults(asked->common_pose),
        .inputs = more,
    };
    mean->inputs.registration = asked->registered ? &mean->options : NULL;
    mean->inputs.tolerance = asked->tolerance;
    mean->inputs.max_iterations = (size_t)asked->max_iterations;
    mean->inputs.subjects = members->subjects;
    status = group_load(run, members, asked->registered, (size_t)asked->lmax, &mean->outputs.group,
                        result);
    if (status == 0 && asked->landmarks.n > 0) {
        status = group_landmarks_place(run, &asked->landmarks, members, &mean->outputs.group,
                                       &mean->landmarks, result);
        mean->inputs.landmarks = &mean->landmarks.group;
    }
    return status ? status : compute_mean(run, &mean->inputs, &mean->outputs, result);
}

void group_mean_clear(struct group_mean *mean)
{
    compute_mean_clear(&mean->outputs);
    group_landmarks_clear(&mean->landmarks);
}

const double *const *mean_surfaces(const struct group_mean *mean)
{
    return mean->inputs.registration ? NULL : mean->outputs.group.surfaces;
}

/* ---- Results --------------------------------------------------------------------------------- */

double mean_scale(struct jobs_run *run, const struct group_mean *mean)
{
    const struct group_input *members = mean->members;
    double scale = 0.0;

    for (size_t i = 0; i < members->n; i++) {
        scale +=
            process_scale(run, members->ids[i], mean->outputs.group.scales[i]) / (double)members->n;
    }
    return scale;
}

json_t *mean_keep_surface(struct jobs_run *run, const char *process, const char *name,
                          const struct group_mean *mean, const struct store_maps *maps,
                          struct jobs_result *result)
{
    const struct group_input *members = mean->members;
    const struct compute_mean_outputs *outputs = &mean->outputs;
    struct surface_description description = {
        .name = name,
        .degree = outputs->group.degree,
        .coefficients = outputs->mean.coefficients,
        .measures = &outputs->measures,
        .parameterization = "inherited",
        .route = routes_of_group(run, members->n, members->ids, outputs->group.bridged),
        .source = process_source(run, process, NULL, NULL),
        .maps = maps,
    };

    description.scale = mean_scale(run, mean);
    return process_keep_surface(run, &description, "the mean", result);
}

static json_t *history_json(const struct srnf_mean *mean)
{
    json_t *history = json_array();

    for (size_t i = 0; i < mean->iterations; i++) {
        const struct srnf_mean_iteration *step = &mean->history[i];
        (void)json_array_append_new(history, json_pack("{s:I, s:o, s:o, s:o, s:o}", "iteration",
                                                       (json_int_t)i + 1, "change",
                                                       json_finite(step->change), "variance",
                                                       json_finite(step->variance), "objective",
                                                       json_finite(step->objective), "seconds",
                                                       json_finite(step->seconds)));
    }
    return history;
}

void mean_set_members(json_t *document, const struct group_mean *mean)
{
    const struct srnf_mean *found = &mean->outputs.mean;

    (void)json_object_set_new(document, "iterations", json_integer((json_int_t)found->iterations));
    (void)json_object_set_new(document, "converged", json_boolean(found->converged));
    (void)json_object_set_new(document, "history", history_json(found));
    (void)json_object_set_new(document, "relativeEnergy", json_finite(found->relative_energy));
    (void)json_object_set_new(document, "seconds", json_finite(mean->outputs.seconds));
    (void)json_object_set_new(document, "registration",
                              registration_json(mean->inputs.registration));
    routes_set_bridged(document, mean->members->n, mean->members->ids, mean->outputs.group.bridged);
}

void mean_warn_converged(const struct group_mean *mean, json_t *document)
{
    const struct srnf_mean *found = &mean->outputs.mean;
    const struct srnf_mean_iteration *last =
        found->iterations ? &found->history[found->iterations - 1] : NULL;

    if (found->converged || !last || mean->inputs.max_iterations == 1) {
        return;
    }
    warning_add(warnings_of(document), "mean-not-converged",
                json_pack("{s:I, s:o}", "iterations", (json_int_t)found->iterations, "change",
                          json_finite(last->change)),
                "The mean still moved when its iterations ran out: by %.2g of its norm in the last "
                "of %zu. What rests on it moves with it. Raise maxIterations; where it does not "
                "come to rest then, the members do not correspond: see the other warnings, or %s.",
                last->change, found->iterations, doubts_rotations(mean->positions));
}

/* Members of one subject that the mean says are turned otherwise than they say of each other. */
static void warn_apart(const struct group_mean *mean, json_t *document)
{
    const json_t *names = json_object_get(mean->members->cohort, "subjects");
    const bool *apart = mean->outputs.mean.apart;
    json_t *subjects = json_array();
    char more[64] = "";
    size_t count;

    for (size_t i = 0; apart && i < mean->members->n; i++) {
        if (apart[i] && mean->members->subjects[i] == i) {
            (void)json_array_append(subjects, json_array_get(names, i));
        }
    }
    count = json_array_size(subjects);
    if (count > 1) {
        (void)snprintf(more, sizeof more, " (and of %zu more)", count - 1);
    }
    if (count > 0) {
        warning_add(warnings_of(document), "visits-apart", json_pack("{s:O}", "subjects", subjects),
                    "The surfaces of subject \"%.60s\"%s lie on the mean in different ways: turned "
                    "to match each other they are nearer than as they match the mean. What differs "
                    "between them as they lie, a change above all, may be that turn. See how they "
                    "match with register; in one pose, commonPose rules turns out.",
                    json_string_value(json_array_get(subjects, 0)), more);
    }
    json_decref(subjects);
}

void mean_warn_members(struct jobs_run *run, const struct group_mean *mean, json_t *document)
{
    const struct group_input *members = mean->members;

    mean_warn_converged(mean, document);
    warn_apart(mean, document);
    warnings_put(document, handedness_of_names(run, members->surfaces, members->cohort));
    group_warn_duplicates(run, document, members->surfaces, members->cohort,
                          (const char(*)[STORE_ID_MAX])mean->outputs.group.contents);
}

json_t *mean_warn(struct jobs_run *run, const struct group_mean *mean, struct group_doubts doubts,
                  json_t *document, struct jobs_result *result)
{
    const struct srnf_register_options *registration = mean->inputs.registration;

    doubts.surfaces = mean->members->surfaces;
    doubts.cohort = mean->members->cohort;
    doubts.group = &mean->outputs.group;
    doubts.pairs = mean->outputs.pairs;
    doubts.rotates = registration && !registration->common_pose;
    doubts.members = doubts.mirrors = true;
    doubts.positions = mean->positions;
    if (!doubts.pairs) {
        warning_add(
            warnings_of(document), "members-not-compared",
            json_pack("{s:I, s:I}", "members", (json_int_t)mean->members->n, "limit",
                      (json_int_t)COMPUTE_PAIRS_MAX),
            "With more than %d members, pairs of them were not compared: nothing is said of "
            "members that are there twice under two names, are mirror images of others, or "
            "stand out. distances of parts of the cohort compares them.",
            COMPUTE_PAIRS_MAX);
    }
    if (!group_doubts_warn(run, &doubts, document, result)) {
        json_decref(document);
        return NULL;
    }
    return document;
}

json_t *mean_finish(struct jobs_run *run, const struct group_mean *mean, json_t *document,
                    struct jobs_result *result)
{
    const struct group_input *members = mean->members;
    const struct srnf_mean *found = &mean->outputs.mean;
    json_t *labels =
        group_labels(run, members->surfaces, json_object_get(members->cohort, "subjects"));

    mean_set_members(document, mean);
    typicality_warn_poses(run, members, &mean->outputs, mean->positions, warnings_of(document));
    (void)json_object_set_new(document, "labels", labels);
    (void)json_object_set_new(document, "groups", group_groups(members->cohort));
    (void)json_object_set_new(document, "distances", json_vector(found->distances, found->n));
    if (group_landmarks_report(run, &mean->landmarks, &mean->outputs, mean_scale(run, mean),
                               document, result)) {
        json_decref(document);
        return NULL;
    }
    mean_warn_members(run, mean, document);
    return mean_warn(run, mean, (struct group_doubts){.classes = NULL}, document, result);
}
