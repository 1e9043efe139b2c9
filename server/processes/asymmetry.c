/*
 * asymmetry.c - the process asymmetry: how the left and the right side of subjects differ, one of
 * them mirrored.
 *
 * What all subjects have in common is directional asymmetry, what is left fluctuating asymmetry.
 * Differences go from the left side to the right one, on the side that is not mirrored.
 */
#include "processes/paired.h"

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, offsetof(struct paired, group),
     "A cohort whose members have a subject and a side: a left and a right one of each subject, or "
     "several measurements of sides, each with a covariate replicate that tells it from the "
     "others. "
     "Where the cohort does not bring all to one hand by mirror, the right ones are mirrored.",
     .required = true, .own = &paired_cohort},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct paired, group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .fallback = 0},
    PAIRED_INPUTS("asymmetry"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"directional", PAIRED_ESTIMATE,
     "{value, interval}: root of the mean square over the surface of the mean displacement from "
     "left to right, in the units of the input, 95 %, free of what noise adds."},
    {"fluctuating", PAIRED_ESTIMATE,
     "{value, interval}: standard deviation of the subjects' displacements about it, as those. "
     "What each surface is measured wrongly by is in it: see replicates."},
    {"replicates", OUTPUT_OBJECT_OR_NULL,
     "Where sides were measured repeatedly, the analysis of variance of individuals and sides, of "
     "all measurements as they are registered to their mean: {measurements, repeated (subjects "
     "with a side that was), individual, side, "
     "interaction and error (mean squares, of squared L2 norms of SRNFs), individualInterval, "
     "interactionInterval and errorInterval (95 %; side has one degree of freedom, and distance "
     "has the interval of what it tells), degreesOfFreedom (of interaction and error), f {value, "
     "interval} (interaction over error), pValue, pValueIsFloor, "
     "pValueInterval, permutations (of measurements within subjects), relabellings, fluctuating "
     "(standard deviation of a subject's difference of sides about their mean, without error), "
     "measured (that of one measurement) and repeatability (share of the former in the variance of "
     "a difference of two measurements), each {value, interval}, the lengths in L2 of SRNFs}; "
     "the ends of intervals are null where fewer than 5 subjects were measured repeatedly. The "
     "differences of the sides above are those of the means of their measurements. null: one "
     "each."},
    PAIRED_OUTPUTS("asymmetry", "the sides of a subject"),
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    mean_complete(given, PAIRED_COPIES);
    if (!given->list->errors) {
        paired_describe_sides(given);
    }
}

static json_t *run_asymmetry(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    return paired_run(run, typed, "asymmetry", "directional", "fluctuating", result);
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct paired),
    .complete = complete,
    .run = run_asymmetry,
};

const struct api_process asymmetry_process = {
    .id = "asymmetry",
    .title = "Asymmetry of sides",
    .description = "Differences between the left and the right side of each subject, one of them "
                   "mirrored, after registering the two: directional asymmetry with a test by sign "
                   "flips and a map, fluctuating asymmetry, and what each subject has.",
    .methods =
        "The left and the right side of each subject, one of them mirrored, were [registered "
        "to their mean and to each other, and ]compared. Directional asymmetry, the mean of "
        "the differences, was tested by flipping the signs of whole subjects' differences; p at "
        "each point of the map is corrected for all points by the maximum statistic; intervals "
        "come from a bootstrap of subjects, that of the mean from the distribution of its norm",
    .table = &table,
    .seconds = paired_seconds,
};
