/*
 * paired.c - what change and asymmetry compute, and its result: the mean of all surfaces, to which
 * both of each subject are registered, then the two to each other, and their differences
 * (srnf/paired.h).
 */
#include "processes/paired.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/warnings.h"
#include "compute/seconds.h"
#include "store/surface.h"
#include "toolkit/seconds.h"
#include "toolkit/typicality.h"

#define SHARE_MEAN 40.0 /* percent of the job that the mean is */

double paired_seconds(const struct api_work *work, const json_t *canonical)
{
    double n = (double)(work->surfaces + work->meshes);
    bool registered = json_is_true(json_object_get(canonical, "register"));

    return mean_seconds(work, canonical) + n * seconds_of_inversion((double)work->degree) +
           (registered ? n * seconds_of_registration((double)work->degree) : 0.0);
}

/* ---- What the core gets ---------------------------------------------------------------------- */

struct surfaces {
    double *first_q, *second_q;       /* [n][3][P] */
    double *lengths;                  /* [2][n] roots of areas, in units of the input */
    double *first_size, *second_size; /* [n] */
};

static void clear(struct surfaces *s)
{
    srnf_free(s->first_q);
    srnf_free(s->lengths);
}

/* The member as field and with its size: lengths of its field to those of the input, and the root
   of its area in these. */
static void take(struct jobs_run *run, const struct group_mean *mean, const struct srnf_grid *grid,
                 size_t member, double *q, double *size, double *length)
{
    size_t count = 3 * mean->outputs.n_theta * mean->outputs.n_phi;

    memcpy(q, mean->outputs.mean.registered_q + member * count, count * sizeof(double));
    *size = process_scale(run, mean->members->ids[member], mean->outputs.group.scales[member]);
    *length = *size * sqrt(srnf_inner_product(grid, q, q));
}

static bool take_all(struct jobs_run *run, const struct paired *asked,
                     const struct group_mean *mean, const struct srnf_grid *grid,
                     struct surfaces *s)
{
    size_t n = asked->n, count = 3 * mean->outputs.n_theta * mean->outputs.n_phi;

    *s = (struct surfaces){.first_q = srnf_alloc(2 * n, count * sizeof(double)),
                           .lengths = srnf_alloc(4 * n, sizeof(double))};
    if (!s->first_q || !s->lengths) {
        return false;
    }
    s->second_q = s->first_q + n * count;
    s->first_size = s->lengths + 2 * n;
    s->second_size = s->first_size + n;
    for (size_t i = 0; i < n; i++) {
        double middle;

        take(run, mean, grid, asked->first[i], s->first_q + i * count, &s->first_size[i],
             &s->lengths[i]);
        take(run, mean, grid, asked->second[i], s->second_q + i * count, &s->second_size[i],
             &s->lengths[n + i]);
        middle = 0.5 * (s->lengths[i] + s->lengths[n + i]);
        if (asked->scale == PAIRED_SHAPE) {
            s->first_size[i] *= middle / s->lengths[i];
            s->second_size[i] *= middle / s->lengths[n + i];
        }
    }
    return true;
}

static int compute(struct jobs_run *run, const struct paired *asked, struct group_mean *mean,
                   struct surfaces *s, struct srnf_paired *found, struct jobs_result *result)
{
    const struct compute_mean_inputs more = {.share = SHARE_MEAN};
    struct srnf_paired_options options = srnf_paired_options_defaults();
    struct srnf_register_options within;
    const struct compute_mean_outputs *made = &mean->outputs;
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = group_mean_compute(run, &asked->group, &asked->mean, more, mean, result);

    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    status = jobs_transform_acquire(jobs_run_jobs(run), made->group.degree,
                                    SRNF_GRID_GAUSS_LEGENDRE, made->n_theta, made->n_phi, &sht);
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    if (mean->inputs.registration) { /* they lie near each other by now */
        within = *mean->inputs.registration;
        within.start = SRNF_START_IDENTITY;
        options.registration = &within;
    }
    options.permutations = (size_t)asked->permutations;
    options.bootstraps = (size_t)asked->bootstraps;
    options.seed = (uint64_t)asked->seed;
    if (take_all(run, asked, mean, srnf_sht_grid(sht), s)) {
        const struct srnf_pairs pairs = {asked->n,    made->mean.coefficients, s->first_q,
                                         s->second_q, s->first_size,           s->second_size};

        status =
            srnf_paired_differences(sht, &pairs, &options, jobs_run_context(run), found, &error);
    } else {
        status = SRNF_ENOMEM;
    }
    jobs_transform_release(jobs_run_jobs(run), sht);
    return status ? compute_fail(result, status, &error, "comparing within subjects") : 0;
}

/* ---- The result ------------------------------------------------------------------------------ */

static json_t *estimate_json(const struct srnf_estimate *estimate)
{
    return json_pack("{s:o, s:[f, f]}", "value", json_finite(estimate->value), "interval",
                     estimate->interval[0], estimate->interval[1]);
}

static json_t *keep_surface(struct jobs_run *run, const struct group_mean *mean,
                            const struct srnf_paired *found, const char *process,
                            struct jobs_result *result)
{
    const struct {
        const char *name;
        const double *values;
    } rows[] = {{"effect", found->effect},
                {"normalEffect", found->normal},
                {"standardError", found->standard_error},
                {"confidence", found->confidence},
                {"significance", found->significance},
                {"fdr", found->fdr},
                {"pointwiseP", found->p},
                {"statistic", found->statistic}};
    size_t count = sizeof rows / sizeof rows[0];
    size_t points = mean->outputs.n_theta * mean->outputs.n_phi;
    struct store_maps maps = {.count = count,
                              .n_theta = (int64_t)mean->outputs.n_theta,
                              .n_phi = (int64_t)mean->outputs.n_phi,
                              .values = malloc(count * points * sizeof(double))};
    json_t *surface;

    if (!maps.values) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "keeping the maps");
        return NULL;
    }
    for (size_t k = 0; k < count; k++) {
        (void)snprintf(maps.names[k], sizeof maps.names[k], "%s", rows[k].name);
        memcpy(maps.values + k * points, rows[k].values, points * sizeof(double));
    }
    surface =
        mean_keep_surface(run, process, "mean of differences within subjects", mean, &maps, result);
    store_maps_clear(&maps);
    return surface;
}

static json_t *subjects_json(const struct paired *asked, const struct surfaces *s, size_t points,
                             const struct srnf_paired *found)
{
    const json_t *names = json_object_get(asked->group.cohort, "subjects");
    json_t *array = json_array();

    for (size_t i = 0; i < asked->n; i++) {
        json_t *one =
            json_pack("{s:O, s:[f, f], s:o, s:o, s:o, s:o}", "subject",
                      json_array_get(names, asked->first[i]), "sizes", s->lengths[i],
                      s->lengths[asked->n + i], "length", json_finite(found->length[i]),
                      "deviation", json_finite(found->deviation[i]), "along",
                      json_finite(found->along[i]), "distance", json_finite(found->distance[i]));

        if (asked->fields) {
            (void)json_object_set_new(one, "field",
                                      json_vector(found->normals + i * points, points));
        }
        (void)json_array_append_new(array, one);
    }
    return array;
}

static void set_extremes(json_t *document, const struct srnf_paired *found, size_t points)
{
    double fdr = 1.0, effect = 0.0, confidence = 0.0;

    for (size_t p = 0; p < points; p++) {
        fdr = fmin(fdr, found->fdr[p]);
        effect = fmax(effect, found->effect[p]);
        confidence = fmax(confidence, found->confidence[p]);
    }
    (void)json_object_set_new(document, "leastFdr", json_finite(fdr));
    (void)json_object_set_new(document, "largestEffect", json_finite(effect));
    (void)json_object_set_new(document, "largestConfidence", json_finite(confidence));
}

json_t *paired_run(struct jobs_run *run, const struct paired *asked, const char *process,
                   const char *difference, const char *spread, struct jobs_result *result)
{
    struct group_mean mean;
    struct surfaces s = {.first_q = NULL};
    struct srnf_paired found = {0};
    json_t *document = NULL, *surface = NULL;

    if (compute(run, asked, &mean, &s, &found, result) == 0) {
        surface = keep_surface(run, &mean, &found, process, result);
    }
    if (surface) {
        size_t points = mean.outputs.n_theta * mean.outputs.n_phi;

        document =
            json_pack("{s:o, s:o, s:o, s:I, s:o, s:o, s:o, s:o}", "surface", surface, "perSubject",
                      subjects_json(asked, &s, points, &found), "distance", json_finite(found.norm),
                      "subjects", (json_int_t)asked->n, difference, estimate_json(&found.change),
                      spread, estimate_json(&found.fluctuating), "individual",
                      estimate_json(&found.individual), "share", estimate_json(&found.share));
        permutation_set_p(document, "pValue", found.p_value, &found.test);
        permutation_set_p(document, "leastSignificance", found.max_p_value, &found.test);
        permutation_set_test(document, &found.test);
        set_extremes(document, &found, points);
        mean_set_members(document, &mean);
        permutation_warn(warnings_of(document), &found.test, "pValue cannot be");
        mean_warn_members(run, &mean, document);
        typicality_warn_poses(warnings_of(document), &mean.outputs, asked->group.subjects, NULL);
        document = mean_warn(run, &mean, (struct group_doubts){.classes = NULL}, document, result);
    }
    clear(&s);
    srnf_paired_clear(&found);
    group_mean_clear(&mean);
    return document;
}
