/*
 * change.c - the process change: what happens to surfaces between two times, within subjects.
 */
#include "processes/paired.h"

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, offsetof(struct paired, group),
     "A cohort whose members have a subject and a time: two visits of each subject.",
     .required = true, .own = &paired_cohort},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct paired, group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .fallback = 0},
    {"from", INPUT_OWN, offsetof(struct paired, scale),
     "The time from which the change is measured. null: the first of two.", .own = &paired_time},
    {"to", INPUT_OWN, offsetof(struct paired, scale),
     "The time to which it is. null: the last of two.", .own = &paired_time},
    PAIRED_INPUTS("change"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"change", PAIRED_ESTIMATE,
     "{value, interval}: root of the mean square over the surface of the mean displacement from "
     "the first time to the second, in the units of the input, 95 %, free of what noise adds."},
    {"variation", PAIRED_ESTIMATE,
     "{value, interval}: standard deviation of the subjects' displacements about it, as those."},
    PAIRED_OUTPUTS("change", "the visits of a subject"),
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    mean_complete(given, PAIRED_COPIES);
    if (!given->list->errors) {
        paired_describe_visits(given);
    }
}

static json_t *run_change(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    return paired_run(run, typed, "change", "change", "variation", result);
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct paired),
    .complete = complete,
    .run = run_change,
};

const struct api_process change_process = {
    .id = "change",
    .title = "Change within subjects",
    .description = "Differences between two visits of each subject, after registering its two "
                   "surfaces: a test by sign flips, a map of the change in the units of the input "
                   "with its region of confidence, and what each subject does.",
    .methods =
        "[The two surfaces of each subject were registered to their mean and to each "
        "other. ]The mean of the changes within subjects was tested by flipping the signs of "
        "whole subjects' changes; p at each point of the map is corrected for all points "
        "by the maximum statistic; intervals come from a bootstrap of subjects, that of the mean "
        "change from the distribution of its norm",
    .table = &table,
    .seconds = paired_seconds,
};
