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

static json_t *document_of(const struct sample *sample, const struct compute_model *model,
                           const double *scores, const struct model_shapes *shapes)
{
    size_t shape[2] = {(size_t)sample->count, model->pca.components};

    return json_pack("{s:O, s:O, s:o, s:O}", "surfaces", shapes->surfaces, "parts", shapes->parts,
                     "scores", json_nested(scores, 2, shape), "relativeEnergy", shapes->energies);
}

static json_t *run_sample(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct sample *sample = typed;
    size_t n = (size_t)sample->count, before[PROCESS_SAMPLES_MAX];
    char names[PROCESS_SAMPLES_MAX][MODEL_NAME_MAX];
    struct compute_model model = {0};
    struct model_shapes shapes = {.surfaces = NULL};
    json_t *document = NULL;
    double *scores = NULL;

    if (model_load(run, sample->model, &model, result)) {
        goto out;
    }
    scores = draw(&model, (uint64_t)sample->seed, n, (size_t)sample->components);
    if (!scores) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "drawing the samples");
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        before[i] = n; /* the mean */
        (void)snprintf(names[i], sizeof names[i], "sample %zu, seed %ld", i + 1, sample->seed);
    }
    if (model_shapes_make(run, "sample", &model, n, scores, before,
                          (const char(*)[MODEL_NAME_MAX])names, &shapes, result)) {
        document = document_of(sample, &model, scores, &shapes);
    }
out:
    model_shapes_clear(&shapes);
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
