/*
 * train_parts.c - the process train-parts: a classifier of several structures of each subject
 * together, kept as a model. Members, labels and covariates are those of classify-parts, and what
 * the folds say of whom they leave out is what it says, to the last bit; all else is train.
 */
#include "processes/train.h"

#include <math.h>

#include "api/warnings.h"
#include "compute/seconds.h"
#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, TRAIN_AT(parts.group),
     "A cohort whose members have a label, a subject and, as a covariate, the name of the part of "
     "it that they are. Each subject has each part once, and one label; each label is that of "
     "five subjects at least. Fields of all members, and tables of the subjects for each part, "
     "are held in memory at once: what a job does not have (--job-memory) is refused.",
     .required = true, .own = &pca_parts_cohort},
    {"mixedRoutes", INPUT_BOOLEAN, TRAIN_AT(parts.group.mixed_routes), GROUP_MIXED_ROUTES_TEXT,
     .fallback = 0},
    {"by", INPUT_OWN, TRAIN_AT(parts.n), "The covariate that names the part.",
     .own = &pca_parts_by},
    {"weights", INPUT_OWN, TRAIN_AT(parts.n),
     "Of the squared distances of each part, of unit area, in those of subjects, by its name; 1 "
     "where none is given.",
     .own = &pca_parts_weights},
    PCA_PARTS_POSE_INPUTS(train, parts.relative_pose, parts.pose_weight, "(commonPose)"),
    TRAIN_INPUTS,
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"model", OUTPUT_OBJECT,
     "Record of the model, of kind classifier: what one of pca-parts has, about the templates, "
     "with the template {surface, member} of each of its parts, "
     "and " TRAIN_CLASSIFIER_TEXT " Its template is null: each part has its own."},
    {"parts", OUTPUT_OBJECTS,
     "For each part: name, weight, mean (id of its surface), relativeEnergy of that and template "
     "{surface, member}."},
    {"positions", OUTPUT_OBJECT_OR_NULL,
     "null without relativePose: weight, and mean (of each part, [x, y, z])."},
    TRAIN_OUTPUTS,
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    size_t members = json_array_size(json_object_get(cohort, "surfaces")), n_parts;

    classify_parts_complete_by(given, TRAIN_COPIES, SRNF_TRAIN_SUBJECTS_MIN, train_check_folds);
    n_parts = json_array_size(json_object_get(cohort, "parts"));
    if (n_parts > 0 && !given->answered && !given->list->errors) {
        long degree = (long)json_integer_value(json_object_get(given->canonical, "lmax"));

        train_check_names(given);
        inputs_check_memory(given, members, degree, TRAIN_COPIES,
                            train_bytes(given->canonical, members / n_parts, n_parts));
    }
}

static double seconds(const struct api_work *work, const json_t *canonical)
{
    double members = (double)(work->surfaces + work->meshes);
    double parts = fmax(1.0, (double)json_array_size(
                                 json_object_get(json_object_get(canonical, "cohort"), "parts")));
    double degree = json_number_value(json_object_get(canonical, "lmax"));

    return seconds_of_group(work, true) +
           parts * (seconds_of_folds(SRNF_METRIC_SRNF, members / parts, degree) +
                    seconds_of_inversion(degree)) +
           seconds_of_label_permutations(true, members / parts, 2.0, (double)SRNF_RELABELLINGS);
}

/* ---- Warnings -------------------------------------------------------------------------------- */

/* The members of a part, in a view. */
static struct compute_group group_of(const struct train_answer *answer, size_t part)
{
    struct compute_group own = answer->group;
    size_t from = part * answer->n;

    own.n = answer->n;
    own.coefficients += from * 3 * srnf_coefficient_count(own.degree);
    own.surfaces += from;
    own.scales += from;
    own.origins += from;
    own.bridged += from;
    own.contents += from;
    own.ids += from;
    return own;
}

bool train_parts_warn(struct jobs_run *run, const struct train *train,
                      const struct train_answer *answer, json_t *document,
                      struct jobs_result *result)
{
    const json_t *names = json_object_get(train->parts.group.cohort, "parts");
    bool good = true;

    for (size_t p = 0; p < answer->n_parts && good; p++) {
        struct group_input members = pca_parts_members(&train->parts, p);
        struct compute_group group = group_of(answer, p);
        const struct group_doubts doubts = {.surfaces = members.surfaces,
                                            .cohort = members.cohort,
                                            .group = &group,
                                            .pairs = answer->trained.pairs + p * group.n * group.n,
                                            .classes = answer->classes.labels,
                                            .n_classes = answer->classes.count,
                                            .names = answer->classes.names,
                                            .rotates = !train->parts.mean.common_pose,
                                            .positions = train->parts.relative_pose,
                                            .members = true,
                                            .mirrors = true};
        json_t *own = json_object();

        warnings_put(own, handedness_of_names(run, members.surfaces, members.cohort));
        good = group_doubts_warn(run, &doubts, own, result);
        pca_parts_tell(warnings_of(document), own, json_string_value(json_array_get(names, p)),
                       NULL);
        json_decref(members.surfaces);
        json_decref(members.cohort);
    }
    return good;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct train),
    .check = pca_parts_check_pose,
    .complete = complete,
    .run = train_run,
};

const struct api_process train_parts_process = {
    .id = "train-parts",
    .title = "Training of a classifier of several structures",
    .description = "A classifier of several structures of each subject together, with their sizes "
                   "and covariates if you like, kept as a model, with calibrated probabilities "
                   "and the nested validation of all that was chosen.",
    .methods = "A classifier was trained on the square-root normal fields (SRNFs) of all "
               "structures of a subject together, each registered to its own template and times "
               "the root of its weight, and assessed by nested cross-validation over subjects, in "
               "which all choices and the calibration of the probabilities were made anew in each "
               "fold",
    .table = &table,
    .seconds = seconds,
};
