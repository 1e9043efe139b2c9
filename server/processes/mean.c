/*
 * mean.c - the process mean: the Karcher mean of a group, or its mean in the pulled-back metric.
 */
#include <string.h>

#include "toolkit/mean.h"
#include "toolkit/seconds.h"

struct mean {
    struct group_input group;
    struct mean_input mean;
};

enum { METHOD_SRNF, METHOD_PULLBACK };
static const char *const methods[] = {[METHOD_SRNF] = "srnf", [METHOD_PULLBACK] = "pullback", NULL};

static const struct process_input inputs[] = {
    GROUP_INPUTS(mean),
    MEAN_INPUTS(mean, NULL),
    MEAN_LANDMARKS_INPUT(mean),
    {"method", INPUT_CHOICE, offsetof(struct mean, mean.method),
     "srnf: the surface of the mean SRNF. pullback: the surface with the least sum of squared "
     "lengths of geodesics within the space of surfaces, of at most " PROCESS_TEXT(
         PROCESS_PULLBACK_GROUP_MAX) " surfaces, at many times the cost; they are registered to "
                                     "the mean of srnf first, where register is true.",
     .choices = methods},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"surface", OUTPUT_OBJECT, "Record of the mean surface, centred at its area centroid."},
    {"pullback", OUTPUT_OBJECT_OR_NULL,
     "Of method pullback, null otherwise: segments of each geodesic, variance (mean squared "
     "length), meanVelocity (norm of the mean logarithm at the mean: 0 at a minimum), moved "
     "(distance from the surface of the mean SRNF), iterations, converged, transforms. distances "
     "are then the lengths, relativeEnergy is of that surface; iterations, history and seconds are "
     "of the mean SRNF that it starts from."},
    MEAN_RESULT_OUTPUTS,
    {NULL, NULL, NULL},
};

/* Fields that are held for each surface: registered, and weighted. */
#define COPIES 3
/* Of the pulled-back mean: 200 bytes for each point of each surface of its 8 segments
   (srnf_pullback_mean), in fields of 24. */
#define COPIES_PULLBACK (COPIES + 8 * 200 / 24)

static void complete(struct process_inputs *given)
{
    const json_t *method = json_object_get(given->canonical, "method");
    size_t n = json_array_size(json_object_get(given->canonical, "surfaces"));
    bool pullback = strcmp(json_string_value(method), methods[METHOD_PULLBACK]) == 0;

    mean_complete(given, pullback ? COPIES_PULLBACK : mean_copies(given, COPIES));
    if (pullback && json_is_object(json_object_get(given->canonical, "landmarks"))) {
        problem_add(given->list, "/inputs/landmarks",
                    "cannot be given with method pullback, which registers to its surface without");
    }
    if (pullback && n > PROCESS_PULLBACK_GROUP_MAX) {
        problem_add(given->list, "/inputs/method",
                    "pullback takes up to %d surfaces; there are %zu", PROCESS_PULLBACK_GROUP_MAX,
                    n);
    }
}

/* What the mean in the pulled-back metric came to; null for the other method. */
static json_t *pullback_document(const struct srnf_pullback_mean *pullback)
{
    if (pullback->n == 0) {
        return json_null();
    }
    return json_pack("{s:I, s:o, s:o, s:o, s:I, s:b, s:o}", "segments",
                     (json_int_t)srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH).segments,
                     "variance", json_finite(pullback->variance), "meanVelocity",
                     json_finite(pullback->mean_velocity), "moved", json_finite(pullback->moved),
                     "iterations", (json_int_t)pullback->iterations, "converged",
                     pullback->converged, "transforms", json_finite(pullback->transforms));
}

static json_t *run_mean(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct mean *asked = typed;
    const struct compute_mean_inputs more = {.pullback = asked->mean.method == METHOD_PULLBACK};
    struct group_mean mean;
    json_t *document = NULL, *surface = NULL;

    if (group_mean_compute(run, &asked->group, &asked->mean, more, &mean, result) == 0) {
        surface = mean_keep_surface(run, "mean", "mean", &mean, NULL, result);
    }
    if (surface) {
        document = json_pack("{s:o, s:o}", "surface", surface, "pullback",
                             pullback_document(&mean.outputs.pullback));
        document = mean_finish(run, &mean, document, result);
    }
    group_mean_clear(&mean);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct mean),
    .complete = complete,
    .run = run_mean,
};

const struct api_process mean_process = {
    .id = "mean",
    .title = "Mean of a group",
    .description = "The Karcher mean: all surfaces registered to the mean SRNF, averaged, and so "
                   "on until it rests; then inverted once.",
    .methods = "The mean of the shapes was taken in the space of square-root normal fields "
               "(SRNFs)[, with all shapes registered to it elastically]",
    .table = &table,
    .seconds = mean_seconds,
};
