/*
 * sample.c - the process sample: random surfaces from the normal distribution of a model.
 *
 * Scores are drawn by a counter-based generator, the same ones from the same seed on every machine,
 * and each point is inverted from the mean.
 */
#include <stdio.h>
#include <string.h>

#include "toolkit/model.h"
#include "toolkit/seconds.h"
#include "toolkit/table.h"

struct sample {
    char model[STORE_ID_MAX];
    long count, seed, components;
};

static const struct process_input inputs[] = {
    MODEL_INPUT(sample),
    {"count", INPUT_INTEGER, offsetof(struct sample, count), "Samples.", .lowest = 1,
     .highest = PROCESS_SAMPLES_MAX, .fallback = 1},
    {"seed", INPUT_INTEGER, offsetof(struct sample, seed),
     "The same seed gives the same scores on every machine.", .highest = PROCESS_SEED_MAX},
    {"components", INPUT_INTEGER, offsetof(struct sample, components),
     "How many of the model's to vary; default: all.", .lowest = 1,
     .highest = PROCESS_COMPONENTS_MAX, .open = true, .derived = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    MODEL_SURFACES,
    {"scores", OUTPUT_MATRIX, "[count][components of the model]; 0 in those that are not varied."},
    {"relativeEnergy", OUTPUT_NUMBERS_OR_NULLS, "Of each, as in modes."},
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    long components = model_components(given);

    components = components ? components : PROCESS_COMPONENTS_MAX;
    (void)inputs_integer(given, "components", 1, components, components);
}

/* Scores of all samples in all components, zero beyond those that are drawn: double[n][k]. */
static double *draw(const struct compute_model *model, uint64_t seed, size_t n, size_t components)
{
    size_t all = model->pca.components;
    double *scores = srnf_alloc(n * all, sizeof(double));
    double *drawn = srnf_alloc(n * components, sizeof(double));

    if (scores && drawn) {
        srnf_pca_sample(&model->pca, seed, n, components, drawn);
        for (size_t i = 0; i < n; i++) {
            memcpy(scores + i * all, drawn + i * components, components * sizeof(double));
        }
    } else {
        srnf_free(scores);
        scores = NULL;
    }
    srnf_free(drawn);
    return scores;
}

static json_t *document_of(struct jobs_run *run, const struct sample *sample,
                           const struct compute_model *model,
                           const struct compute_reconstruction *points, const double *scores,
                           struct jobs_result *result)
{
    size_t n = (size_t)sample->count, shape[2] = {n, model->pca.components};
    char names[PROCESS_SAMPLES_MAX][MODEL_NAME_MAX];
    json_t *surfaces;

    for (size_t i = 0; i < n; i++) {
        (void)snprintf(names[i], sizeof names[i], "sample %zu, seed %ld", i + 1, sample->seed);
    }
    surfaces = model_keep_surfaces(run, "sample", model, points, names, result);
    return surfaces ? json_pack("{s:o, s:o, s:o}", "surfaces", surfaces, "scores",
                                json_nested(scores, 2, shape), "relativeEnergy",
                                json_vector(points->relative_energy, n))
                    : NULL;
}

static json_t *run_sample(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct sample *sample = typed;
    size_t n = (size_t)sample->count, before[PROCESS_SAMPLES_MAX];
    struct compute_model model = {0};
    struct compute_reconstruction points = {0};
    json_t *document = NULL;
    double *scores = NULL;

    if (compute_model_load(run, sample->model, &model, result)) {
        goto out;
    }
    scores = draw(&model, (uint64_t)sample->seed, n, (size_t)sample->components);
    if (!scores) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "drawing the samples");
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        before[i] = n; /* the mean */
    }
    if (compute_reconstruct(run, &model, n, scores, before, &points, result) == 0) {
        document = document_of(run, sample, &model, &points, scores, result);
    }
out:
    compute_reconstruction_clear(&points);
    srnf_free(scores);
    compute_model_clear(&model);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct sample),
    .complete = complete,
    .run = run_sample,
};

const struct api_process sample_process = {
    .id = "sample",
    .title = "Samples of a model",
    .description = "Random surfaces from the normal distribution of a model, the same ones from "
                   "the same seed.",
    .table = &table,
    .seconds = sample_seconds,
};
