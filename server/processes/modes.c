/*
 * modes.c - the process modes: surfaces along one component of a model.
 *
 * Points c sqrt(lambda_k) along one mode, c in units of its standard deviation. They are inverted
 * outwards from the mean on either side, each from its neighbour nearer to the mean. No point need
 * be the SRNF of a surface: relativeEnergy says how far from one it is.
 */
#include <math.h>
#include <stdio.h>

#include "toolkit/model.h"
#include "toolkit/seconds.h"
#include "toolkit/table.h"

struct modes {
    char model[STORE_ID_MAX];
    long mode;
    struct input_numbers coefficients;
};

static const struct input_numbers standard = {5, {-2.0, -1.0, 0.0, 1.0, 2.0}};

static const struct process_input inputs[] = {
    MODEL_INPUT(modes),
    {"mode", INPUT_INTEGER, offsetof(struct modes, mode),
     "Number of the component, from 1 to those that the model has.", .lowest = 1,
     .highest = PROCESS_COMPONENTS_MAX, .open = true, .fallback = 1},
    {"coefficients", INPUT_NUMBERS, offsetof(struct modes, coefficients),
     "Where along it, in standard deviations.", .highest = PROCESS_DEVIATIONS_MAX,
     .most = PROCESS_COEFFICIENTS_MAX, .numbers = &standard},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    MODEL_SURFACES,
    {"coefficients", OUTPUT_NUMBERS, "In standard deviations."},
    {"standardDeviation", OUTPUT_NUMBER, "Square root of the eigenvalue."},
    {"relativeEnergy", OUTPUT_NUMBERS_OR_NULLS,
     "Of each: squared distance of its SRNF from the point of the model, relative to the squared "
     "norm of that point: 0 where the shape exists. Its root, times that of the surface's area, is "
     "how far the surface is from the point, to be read against coefficient times "
     "standardDeviation, how far the point is from the mean: where it is a good part of it, the "
     "shape asked for does not exist, and the surface is only the one nearest to it."},
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    long components = model_components(given);

    (void)inputs_integer(given, "mode", 1, components ? components : PROCESS_COMPONENTS_MAX, 1);
}

/* Of the points on the same side of the mean, the farthest one that is nearer to it than point i;
   n: the mean itself. Of equal ones the first comes before the others. */
static size_t point_before(const double *coefficients, size_t n, size_t i)
{
    double own = fabs(coefficients[i]);
    size_t best = n;

    for (size_t j = 0; j < n; j++) {
        double other = fabs(coefficients[j]);
        bool same_side = coefficients[j] * coefficients[i] > 0.0;

        if (same_side && (other < own || (other == own && j < i)) &&
            (best == n || other >= fabs(coefficients[best]))) {
            best = j;
        }
    }
    return best;
}

/* Scores of all points, zero in all components but the mode: double[n][components]. */
static double *place(const struct modes *modes, size_t components, double deviation)
{
    size_t n = modes->coefficients.n;
    double *scores = srnf_alloc(n * components, sizeof(double));

    for (size_t i = 0; scores && i < n; i++) {
        scores[i * components + (size_t)modes->mode - 1] =
            modes->coefficients.values[i] * deviation;
    }
    return scores;
}

static json_t *document_of(const struct modes *modes, double deviation,
                           const struct model_shapes *shapes)
{
    return json_pack(
        "{s:O, s:O, s:o, s:o, s:O}", "surfaces", shapes->surfaces, "parts", shapes->parts,
        "coefficients", json_vector(modes->coefficients.values, modes->coefficients.n),
        "standardDeviation", json_finite(deviation), "relativeEnergy", shapes->energies);
}

static json_t *run_modes(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct modes *modes = typed;
    size_t n = modes->coefficients.n, before[PROCESS_COEFFICIENTS_MAX];
    char names[PROCESS_COEFFICIENTS_MAX][MODEL_NAME_MAX];
    struct compute_model model = {0};
    struct model_shapes shapes = {.surfaces = NULL};
    json_t *document = NULL;
    double deviation, *scores = NULL;

    if (model_load(run, modes->model, &model, result)) {
        goto out;
    }
    deviation = sqrt(model.pca.eigenvalues[modes->mode - 1]);
    scores = place(modes, model.pca.components, deviation);
    if (!scores) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "preparing the modes");
        goto out;
    }
    for (size_t i = 0; i < n; i++) {
        before[i] = point_before(modes->coefficients.values, n, i);
        (void)snprintf(names[i], sizeof names[i], "mode %ld, %+.4g sd", modes->mode,
                       modes->coefficients.values[i]);
    }
    if (model_shapes_make(run, "modes", &model, n, scores, before,
                          (const char(*)[MODEL_NAME_MAX])names, &shapes, result)) {
        document = document_of(modes, deviation, &shapes);
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
    .size = sizeof(struct modes),
    .complete = complete,
    .run = run_modes,
};

const struct api_process modes_process = {
    .id = "modes",
    .title = "Modes of variation",
    .description = "The surfaces along one principal component of a model, with how far each point "
                   "is from being a surface at all.",
    .table = &table,
    .seconds = modes_seconds,
};
