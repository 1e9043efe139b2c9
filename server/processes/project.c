/*
 * project.c - the process project: the scores of a surface in a model that is not fitted
 * again, what the components cannot represent, and whether the surface is like those that the model
 * was made from (typicality.h).
 */
#include <string.h>

#include "toolkit/model.h"
#include "toolkit/seconds.h"
#include "toolkit/projected.h"
#include "toolkit/subject.h"
#include "toolkit/table.h"
#include "api/warnings.h"
#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"
#include "toolkit/handedness.h"
#include "toolkit/typicality.h"

struct project {
    char model[STORE_ID_MAX];
    struct subject_input subject;
    int handedness; /* enum handedness */
};

static const struct process_input inputs[] = {
    MODEL_INPUT(project),
    SUBJECT_INPUTS(project),
    HANDEDNESS_INPUT(project, "the mirror image of the surface as well, and to warn where it"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"scores", OUTPUT_NUMBERS_OR_NULLS, "One for each component."},
    {"trainingSubject", OUTPUT_BOOLEAN,
     "Whether the model was made from this surface. In a registered model it then has the scores, "
     "residual and distance of its registration within the group, and is not registered anew."},
    {"residual", OUTPUT_NUMBER_OR_NULL, "Norm of what the components cannot represent."},
    {"distance", OUTPUT_NUMBER_OR_NULL, "From the mean SRNF."},
    {"distanceBefore", OUTPUT_NUMBER_OR_NULL, "The same before registration."},
    {"mahalanobis", OUTPUT_NUMBER_OR_NULL,
     "Root of the sum of squared scores over their variances, of the first components: those that "
     "typicality tells."},
    {"typicality", OUTPUT_OBJECT_OR_NULL,
     "How the surface compares with the subjects of the model, each left out in turn: subjects, "
     "how many; components, how many mahalanobis counts; residual, distance, mahalanobis and angle "
     "(degrees by which it is turned against the mean; null where the model rotates), each {value, "
     "limit, percentile, percentileInterval}. A member is beyond a limit once in 200; null: the "
     "subjects are too few, "
     "or too unlike each other, to set one. percentile is the share of the subjects below, each "
     "counting once however many members it has; percentileInterval (Wilson, 95 %) is that "
     "of the share of all others who would be below, judged by this model: it counts that the "
     "subjects are few, not that mean and components are estimated from them. Of a "
     "member of the model the values are its own when its subject is left out. Null where the "
     "model has none."},
    SUBJECT_OUTPUTS,
    {"registration", OUTPUT_OBJECT_OR_NULL,
     "How surfaces were registered: degree, penalty and all other options; null where they were "
     "not."},
    {NULL, NULL, NULL},
};

static json_t *document_of(const struct project *project, const struct compute_model *model,
                           const struct srnf_register_options *registration,
                           const struct compute_projection *projection)
{
    json_t *document = json_pack(
        "{s:o, s:b, s:o, s:o, s:o, s:o}", "scores",
        json_vector(projection->scores, model->pca.components), "trainingSubject",
        projection->training_subject, "residual", json_finite(projection->residual), "distance",
        json_finite(projection->distance), "distanceBefore",
        json_finite(projection->distance_before), "registration", registration_json(registration));

    subject_set_parts(document, &project->subject, model, projection);
    typicality_set_projection(document, projection);
    return document;
}

static json_t *run_project(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct project *project = typed;
    struct projected projected;
    json_t *document = NULL;

    if (projected_make(run, project->model, &project->subject, &projected, result) == 0 &&
        process_finite(projected.model.pca.components, projected.projection.scores, "the scores",
                       result) &&
        projected_try_mirrored(run, project->handedness, &projected, result) == 0) {
        document =
            document_of(project, &projected.model, projected.registration, &projected.projection);
        warnings_put(document, handedness_of_projection(run, project->subject.surface,
                                                        projected.made, &projected.trial));
    }
    projected_clear(&projected);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct project),
    .complete = subject_check,
    .run = run_project,
};

const struct api_process project_process = {
    .id = "project",
    .title = "Project a surface into a model",
    .description = "The scores of a surface, or of the structures of a subject, in a model that is "
                   "not fitted again, and what its components cannot represent.",
    .table = &table,
    .seconds = project_seconds,
};
