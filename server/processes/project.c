/*
 * project.c - the process project: the scores of a surface in a model that is not fitted
 * again, what the components cannot represent, and whether the surface is like those that the model
 * was made from (typicality.h).
 */
#include <string.h>

#include "toolkit/model.h"
#include "toolkit/seconds.h"
#include "toolkit/table.h"
#include "api/models.h"
#include "api/warnings.h"
#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"
#include "toolkit/group.h"
#include "toolkit/handedness.h"
#include "toolkit/typicality.h"

struct project {
    char model[STORE_ID_MAX], surface[STORE_ID_MAX];
};

static const struct process_input inputs[] = {
    MODEL_INPUT(project),
    {"surface", INPUT_SURFACE, offsetof(struct project, surface),
     "The surface; registered to the mean as those of the model were. A mesh is encoded with the "
     "default options.",
     .required = true},
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
     "limit, percentile}. A member is beyond a limit once in 200; null: the subjects are too few, "
     "or too unlike each other, to set one. percentile is the share of the subjects below, each "
     "counting once however many members it has. Of a member of the model the values are its own "
     "when its subject is left out. Null where the model has none."},
    {"registration", OUTPUT_OBJECT_OR_NULL,
     "How surfaces were registered: degree, penalty and all other options; null where they were "
     "not."},
    {NULL, NULL, NULL},
};

/* The members of a model, from its record; srnf_free releases what subjects points to. */
struct subjects {
    struct compute_subjects view;
    double *weights;
    const char **contents;
    double *numbers; /* residuals, then distances */
};

static void subjects_clear(struct subjects *subjects)
{
    srnf_free(subjects->weights);
    srnf_free(subjects->contents);
    srnf_free(subjects->numbers);
}

/* How much each member counts. A record that names no subjects is of members that are their own. */
static int read_weights(const json_t *made, size_t n, struct subjects *subjects)
{
    size_t largest;
    size_t *numbers = group_subject_numbers(json_object_get(made, "subjects"), n,
                                            &subjects->view.count, &largest);

    subjects->weights = numbers ? typicality_weights(n, numbers) : NULL;
    subjects->view.weights = subjects->weights;
    srnf_free(numbers);
    return subjects->weights ? 0 : SRNF_ENOMEM;
}

/* made is borrowed for as long as subjects is used. No contents where the record does not tell. */
static int read_subjects(const json_t *made, size_t n, struct subjects *subjects)
{
    const json_t *shapes = json_object_get(made, "shapes"); /* older models have none */
    const json_t *contents = shapes ? shapes : json_object_get(made, "contents");
    const json_t *residuals = json_object_get(made, "residuals");
    const json_t *distances = json_object_get(made, "distances");

    *subjects = (struct subjects){0};
    if (read_weights(made, n, subjects)) {
        return SRNF_ENOMEM;
    }
    if (json_array_size(contents) != n || json_array_size(residuals) != n ||
        json_array_size(distances) != n) {
        return 0;
    }
    subjects->contents = srnf_alloc(n, sizeof *subjects->contents);
    subjects->numbers = srnf_alloc(2 * n, sizeof(double));
    if (!subjects->contents || !subjects->numbers) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        const char *content = json_string_value(json_array_get(contents, i));

        subjects->contents[i] = content ? content : "";
        subjects->numbers[i] = json_number_value(json_array_get(residuals, i));
        subjects->numbers[n + i] = json_number_value(json_array_get(distances, i));
    }
    subjects->view.n = n;
    subjects->view.contents = subjects->contents;
    subjects->view.residuals = subjects->numbers;
    subjects->view.distances = subjects->numbers + n;
    return 0;
}

static json_t *document_of(const struct compute_model *model,
                           const struct srnf_register_options *registration,
                           const struct compute_projection *projection)
{
    json_t *document = json_pack(
        "{s:o, s:b, s:o, s:o, s:o, s:o}", "scores",
        json_vector(projection->scores, model->pca.components), "trainingSubject",
        projection->training_subject, "residual", json_finite(projection->residual), "distance",
        json_finite(projection->distance), "distanceBefore",
        json_finite(projection->distance_before), "registration", registration_json(registration));

    typicality_set_projection(document, projection);
    return document;
}

static json_t *run_project(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct project *project = typed;
    const struct srnf_register_options *registration = NULL;
    struct srnf_register_options options;
    struct compute_model model = {0};
    struct compute_projection projection = {0};
    struct subjects subjects = {0};
    json_t *made = NULL, *document = NULL;

    if (compute_model_load(run, project->model, &model, result)) {
        goto out;
    }
    made = model_made_from(&model.stored);
    if (registration_read(json_object_get(made, "registration"), &options)) {
        registration = &options;
    }
    if (read_subjects(made, model.pca.n, &subjects)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the model");
        goto out;
    }
    if (compute_project(run, &model, project->surface, registration, &subjects.view, &projection,
                        result) == 0 &&
        process_finite(model.pca.components, projection.scores, "the scores", result)) {
        json_t *surfaces = json_pack("[s]", project->surface);

        document = document_of(&model, registration, &projection);
        warnings_put(document, handedness_of_new(run, surfaces, NULL, made));
        json_decref(surfaces);
    }
out:
    srnf_free(projection.scores);
    subjects_clear(&subjects);
    json_decref(made);
    compute_model_clear(&model);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct project),
    .run = run_project,
};

const struct api_process project_process = {
    .id = "project",
    .title = "Project a surface into a model",
    .description = "The scores of a surface in a model that is not fitted again, and what its "
                   "components cannot represent.",
    .table = &table,
    .seconds = project_seconds,
};
