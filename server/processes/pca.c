/*
 * pca.c - the process pca: the mean and the principal components of the registered SRNFs about it.
 *
 * It makes a model: mean SRNF, modes, eigenvalues and scores, stored under the hash of their
 * content. Its record keeps what it was made from and how its members were registered, which is
 * how project registers others; and for each member the id of its surface, its distance from the
 * mean and its residual, by which project knows the member again.
 */
#include <math.h>

#include "toolkit/mean.h"
#include "toolkit/model_keep.h"
#include "toolkit/seconds.h"

struct pca {
    struct group_input group;
    struct mean_input mean;
    long components; /* 0: all above rounding */
};

static const struct process_input inputs[] = {
    GROUP_INPUTS(pca),
    MEAN_INPUTS(pca, NULL),
    MEAN_LANDMARKS_INPUT(pca),
    MEAN_SRNF_METHOD(pca, "srnf: components are straight lines in the space of SRNFs.", NULL),
    {"components", INPUT_INTEGER, offsetof(struct pca, components),
     "How many to keep at most; null: all above rounding, 499 of them at most.", .lowest = 1,
     .highest = PROCESS_COMPONENTS_MAX, .nullable = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"model", OUTPUT_OBJECT,
     "Record of the model: mean, eigenvalues, explained, cumulative, scores."},
    {"compactness", OUTPUT_OBJECTS,
     "[{components, value}]: variance of the first components together."},
    {"eigenvalueBound", OUTPUT_NUMBER,
     "Within it of each eigenvalue there is one of the covariance. 0 where they are those of the "
     "Gram matrix, to rounding; above 4000 members they are found by randomized subspace "
     "iteration."},
    MEAN_RESULT_OUTPUTS,
    {NULL, NULL, NULL},
};

/* Fields of each surface: registered, modes, and as the model is kept a copy and the bytes of
   these. While they are fitted there are three: registered, weighted, modes. */
#define COPIES 4
/* n x n numbers of the calibration, beside those of a mean (toolkit/mean.c), and of each thread
   that leaves out a subject of several members. */
#define SQUARES 1.0
#define SQUARES_OUT 3.0
#define BATCH 128.0 /* fields that a thread takes at a time of a large group */

static bool measured_again(const struct process_inputs *given, size_t n)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    size_t count = 0, largest = 0;
    size_t *subjects =
        group_subject_numbers(json_object_get(cohort, "subjects"), n, &count, &largest);

    srnf_free(subjects);
    return largest > 1;
}

/* Beside the fields: of the calibration (core/stats/calibrate.c); of a large group of two blocks of
   vectors, half as many again as components, with modes and scores (core/stats/pca_largest.c). */
static double bytes_of_components(const struct process_inputs *given, size_t n, long degree)
{
    const struct jobs *jobs = given->call->api->config.jobs;
    double threads = jobs ? 1.0 + (double)jobs_worker_count(jobs) : 1.0;
    double rows = (double)srnf_working_rows((size_t)degree), field = 6.0 * rows * rows;
    double members = (double)n, rank = fmin(members, field);
    json_int_t asked = json_integer_value(json_object_get(given->canonical, "components"));
    double most = asked > 0 ? (double)asked : PROCESS_COMPONENTS_MAX;
    double block = most + fmax(20.0, most / 2.0);

    if (n > COMPUTE_PAIRS_MAX) {
        return 8.0 * (3.0 * block * (field + members) + threads * BATCH * field);
    }
    return 8.0 * (SQUARES * members * members +
                  (measured_again(given, n) ? threads * SQUARES_OUT * rank * rank : 0.0));
}

static void complete(struct process_inputs *given)
{
    mean_complete_beside(given, mean_copies(given, COPIES), bytes_of_components);
}

/* ---- The model ------------------------------------------------------------------------------- */

static struct model_parts parts_of(const struct compute_mean_outputs *found)
{
    return (struct model_parts){.group = &found->group,
                                .n_theta = found->n_theta,
                                .n_phi = found->n_phi,
                                .pca = &found->pca,
                                .mean_q = found->mean.mean_q,
                                .residuals = found->residuals,
                                .distances = found->mean.distances,
                                .calibration = &found->calibration};
}

/* What the record of the model holds beside its numbers. */
static json_t *record_of(struct jobs_run *run, const struct group_mean *mean,
                         const struct model_parts *parts)
{
    const struct compute_group *group = &mean->outputs.group;
    json_t *made_from = model_making(run, "pca", mean->members, parts, mean->inputs.registration,
                                     (const char(*)[STORE_ID_MAX])group->ids);

    (void)json_object_set_new(made_from, "shapes",
                              model_ids(group->n, (const char(*)[STORE_ID_MAX])group->contents));
    return json_pack("{s:o, s:o}", "totalVariance", json_finite(parts->pca->total_variance),
                     "madeFrom", made_from);
}

/* Variance of the first components together, as Davies has it. */
static json_t *compactness_json(const struct srnf_pca *pca)
{
    json_t *array = json_array();
    double sum = 0.0;

    for (size_t i = 0; i < pca->components; i++) {
        sum += pca->eigenvalues[i];
        (void)json_array_append_new(array, json_pack("{s:I, s:o}", "components", (json_int_t)i + 1,
                                                     "value", json_finite(sum)));
    }
    return array;
}

static json_t *run_pca(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct pca *asked = typed;
    /* All that there are of groups that have no more. */
    size_t most = asked->group.n > PROCESS_COMPONENTS_MAX + 1 ? PROCESS_COMPONENTS_MAX : 0;
    const struct compute_mean_inputs more = {
        .fit = true, .components = asked->components > 0 ? (size_t)asked->components : most};
    struct group_mean mean;
    struct model_parts parts;
    json_t *document = NULL, *record = NULL;

    if (group_mean_compute(run, &asked->group, &asked->mean, more, &mean, result) == 0) {
        parts = parts_of(&mean.outputs);
        if (model_is_sound(&parts, result)) {
            record = mean_keep_surface(run, "pca", "mean", &mean, NULL, result);
        }
    }
    if (record) {
        record = model_keep(run, &parts, record_of(run, &mean, &parts), record, result);
    }
    if (record) {
        document = json_pack("{s:o, s:o, s:o}", "model", record, "compactness",
                             compactness_json(&mean.outputs.pca), "eigenvalueBound",
                             json_finite(mean.outputs.eigenvalue_bound));
        document = mean_finish(run, &mean, document, result);
    }
    group_mean_clear(&mean);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct pca),
    .complete = complete,
    .run = run_pca,
};

const struct api_process pca_process = {
    .id = "pca",
    .title = "Principal components of a group",
    .description = "The mean and the principal components of the registered SRNFs about it, as a "
                   "model that is kept.",
    .methods =
        "Principal components were taken of the square-root normal fields (SRNFs) of the shapes "
        "about their mean[, to which the shapes were registered elastically]",
    .table = &table,
    .seconds = mean_seconds,
};
