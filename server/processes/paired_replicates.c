/*
 * paired_replicates.c - sides that were measured repeatedly: their means, and whether sides differ
 * by more than measurements do.
 */
#include "processes/paired.h"

#include <math.h>
#include <string.h>

#include "api/warnings.h"

void paired_average(struct jobs_run *run, const struct group_mean *mean, size_t from, size_t count,
                    struct paired_side *side)
{
    const struct compute_mean_outputs *made = &mean->outputs;
    size_t size = 3 * made->n_theta * made->n_phi;
    size_t coefficients = 3 * srnf_coefficient_count(made->group.degree);
    const double *q = made->mean.registered_q + from * size;

    side->size = process_scale(run, mean->members->ids[from], made->group.scales[from]);
    memcpy(side->q, q, size * sizeof(double));
    if (side->near) {
        memcpy(side->near, made->group.surfaces[from], coefficients * sizeof(double));
    }
    for (size_t m = 1; m < count; m++) { /* running means */
        double own = process_scale(run, mean->members->ids[from + m], made->group.scales[from + m]);
        double part = 1.0 / (double)(m + 1);

        for (size_t k = 0; k < size; k++) {
            side->q[k] += part * (q[m * size + k] - side->q[k]);
        }
        for (size_t k = 0; side->near && k < coefficients; k++) {
            side->near[k] += part * (made->group.surfaces[from + m][k] - side->near[k]);
        }
        side->size += part * (own - side->size);
    }
}

/* ---- The test -------------------------------------------------------------------------------- */

/* Sizes of all measurements; of shape alone those of a subject are brought to one area. */
static void fill_sizes(struct jobs_run *run, const struct paired *asked,
                       const struct group_mean *mean, const struct srnf_grid *grid, double *sizes,
                       double *lengths)
{
    const struct compute_mean_outputs *made = &mean->outputs;
    const size_t *subjects = asked->group.subjects;
    size_t n = asked->group.n, size = 3 * made->n_theta * made->n_phi;

    for (size_t i = 0; i < n; i++) {
        const double *q = made->mean.registered_q + i * size;

        sizes[i] = process_scale(run, asked->group.ids[i], made->group.scales[i]);
        lengths[i] = sizes[i] * sqrt(srnf_inner_product(grid, q, q));
    }
    for (size_t i = 0; asked->scale == PAIRED_SHAPE && i < n; i++) {
        double sum = 0.0, count = 0.0;

        for (size_t j = 0; j < n; j++) {
            sum += subjects[j] == subjects[i] ? lengths[j] : 0.0;
            count += subjects[j] == subjects[i] ? 1.0 : 0.0;
        }
        sizes[i] *= sum / count / lengths[i];
    }
}

static json_t *test_json(size_t measurements, const struct srnf_asymmetry_test *found)
{
    json_t *object = json_pack(
        "{s:I, s:I, s:f, s:f, s:f, s:f, s:[I, I], s:o, s:o, s:o, s:o}", "measurements",
        (json_int_t)measurements, "repeated", (json_int_t)found->repeated, "individual",
        found->individual, "side", found->side, "interaction", found->interaction, "error",
        found->error, "degreesOfFreedom", (json_int_t)found->freedom[0],
        (json_int_t)found->freedom[1], "f", json_estimate(&found->f, 1.0), "fluctuating",
        json_estimate(&found->fluctuating, 1.0), "measured", json_estimate(&found->measured, 1.0),
        "repeatability", json_estimate(&found->repeatability, 1.0));

    (void)json_object_set_new(object, "individualInterval",
                              json_vector(found->individual_interval, 2));
    (void)json_object_set_new(object, "interactionInterval",
                              json_vector(found->interaction_interval, 2));
    (void)json_object_set_new(object, "errorInterval", json_vector(found->error_interval, 2));
    permutation_set_p(object, "pValue", found->p_value, &found->test);
    (void)json_object_set_new(object, "permutations",
                              json_integer((json_int_t)found->test.permutations));
    (void)json_object_set_new(object, "relabellings", json_finite(found->test.relabellings));
    return object;
}

void paired_warn_replicates(json_t *document, const struct paired *asked, const json_t *replicates)
{
    const json_t *count = json_object_get(replicates, "repeated");
    json_int_t repeated = json_integer_value(count);

    if (asked->first_count && json_is_null(replicates)) {
        warning_add(warnings_of(document), "duplicate-content", NULL,
                    "All measurements of a side are equal, so that measurements have no error to "
                    "hold the sides against: replicates is null. Was each file given twice?");
    }
    if (count && repeated < (json_int_t)SRNF_PAIRS_MIN) {
        warning_add(
            warnings_of(document), "few-replicates",
            json_pack("{s:I, s:I}", "subjects", repeated, "needed", (json_int_t)SRNF_PAIRS_MIN),
            "Only %d of the subjects were measured repeatedly: how much the error of "
            "measurement differs between subjects is not known, so that what rests on it "
            "has no interval. Measure %zu subjects twice or more.",
            (int)repeated, SRNF_PAIRS_MIN);
    }
}

int paired_replicates(struct jobs_run *run, const struct paired *asked,
                      const struct group_mean *mean, const struct srnf_sht *sht, json_t **found,
                      struct jobs_result *result)
{
    struct srnf_paired_options options = srnf_paired_options_defaults();
    size_t n = asked->group.n;
    struct srnf_asymmetry_test test;
    struct srnf_error error = {0};
    double *sizes = asked->first_count ? srnf_alloc(2 * n, sizeof *sizes) : NULL;
    int *side = asked->first_count ? srnf_alloc(n, sizeof *side) : NULL;
    int status = sizes && side ? SRNF_OK : SRNF_ENOMEM;

    if (!asked->first_count) {
        *found = json_null();
        return SRNF_OK;
    }
    if (status == SRNF_OK) {
        const struct srnf_measurements given = {n, mean->outputs.mean.registered_q, sizes,
                                                asked->group.subjects, side};

        for (size_t i = 0; i < asked->n; i++) {
            for (size_t m = 0; m < asked->second_count[i]; m++) {
                side[asked->second[i] + m] = 1;
            }
        }
        fill_sizes(run, asked, mean, srnf_sht_grid(sht), sizes, sizes + n);
        options.permutations = (size_t)asked->permutations;
        options.bootstraps = (size_t)asked->bootstraps;
        options.seed = (uint64_t)asked->seed;
        status = srnf_test_asymmetry(sht, &given, &options, jobs_run_context(run), &test, &error);
    }
    srnf_free(sizes);
    srnf_free(side);
    if (status == SRNF_EDEGENERATE) { /* they have no error; all else does not need it */
        *found = json_null();
        return SRNF_OK;
    }
    if (status) {
        return compute_fail(result, status, &error, "testing the asymmetry");
    }
    *found = test_json(n, &test);
    return SRNF_OK;
}
