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
#include "compute/mirror.h"
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

/* One member of each subject, and the other, as they stand in the canonical cohort: the one may be
   the second of the two. */
struct surfaces {
    const size_t *one, *other;             /* [n] */
    const size_t *one_count, *other_count; /* [n] measurements of each; NULL: one */
    double *near;                  /* [2 n][3][(L+1)^2] means of several measurements, or NULL */
    double *one_q, *other_q;       /* [n][3][P] */
    const double **ones, **others; /* [n] as they are, where nothing is registered */
    double *lengths;               /* [2][n] roots of areas, in units of the input */
    double *one_size, *other_size; /* [n] */
};

static void clear(struct surfaces *s)
{
    srnf_free(s->one_q);
    srnf_free(s->near);
    srnf_free(s->lengths);
    srnf_free(s->ones);
}

/* Whether differences are computed from the second of each subject to the first. */
static bool is_backwards(const struct paired *asked)
{
    return asked->n > 0 && asked->second[0] < asked->first[0];
}

/* A side as field and with its size: lengths of its field to those of the input, and the root of
   its area in these. near: [3][(L+1)^2] for the surface of several measurements, or NULL. Returns
   the surface that the field is searched from. */
static const double *take(struct jobs_run *run, const struct group_mean *mean,
                          const struct srnf_grid *grid, size_t member, size_t measurements,
                          double *near, double *q, double *size, double *length)
{
    struct paired_side side = {.q = q, .near = near};

    paired_average(run, mean, member, measurements, &side);
    *size = side.size;
    *length = *size * sqrt(srnf_inner_product(grid, q, q));
    return near ? near : mean->outputs.group.surfaces[member];
}

static bool open_surfaces(const struct paired *asked, size_t count, size_t coefficients,
                          struct surfaces *s)
{
    size_t n = asked->n;
    bool backwards = is_backwards(asked);

    *s = (struct surfaces){.one = backwards ? asked->second : asked->first,
                           .other = backwards ? asked->first : asked->second,
                           .one_count = backwards ? asked->second_count : asked->first_count,
                           .other_count = backwards ? asked->first_count : asked->second_count,
                           .one_q = srnf_alloc(2 * n, count * sizeof(double)),
                           .ones = srnf_alloc(2 * n, sizeof *s->ones),
                           .lengths = srnf_alloc(4 * n, sizeof(double))};
    if (s->one_count) {
        s->near = srnf_alloc(2 * n, coefficients * sizeof(double));
    }
    if (!s->one_q || !s->ones || !s->lengths || (s->one_count && !s->near)) {
        return false;
    }
    s->other_q = s->one_q + n * count;
    s->others = s->ones + n;
    s->one_size = s->lengths + 2 * n;
    s->other_size = s->one_size + n;
    return true;
}

static bool take_all(struct jobs_run *run, const struct paired *asked,
                     const struct group_mean *mean, const struct srnf_grid *grid,
                     struct surfaces *s)
{
    size_t n = asked->n, count = 3 * mean->outputs.n_theta * mean->outputs.n_phi;
    size_t coefficients = 3 * srnf_coefficient_count(mean->outputs.group.degree);

    if (!open_surfaces(asked, count, coefficients, s)) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        double *near = s->near ? s->near + 2 * i * coefficients : NULL;
        double middle;

        s->ones[i] = take(run, mean, grid, s->one[i], near ? s->one_count[i] : 1, near,
                          s->one_q + i * count, &s->one_size[i], &s->lengths[i]);
        s->others[i] = take(run, mean, grid, s->other[i], near ? s->other_count[i] : 1,
                            near ? near + coefficients : NULL, s->other_q + i * count,
                            &s->other_size[i], &s->lengths[n + i]);
        middle = 0.5 * (s->lengths[i] + s->lengths[n + i]);
        if (asked->scale == PAIRED_SHAPE) {
            s->one_size[i] *= middle / s->lengths[i];
            s->other_size[i] *= middle / s->lengths[n + i];
        }
    }
    return true;
}

/* From the order and the hand that was computed in to those that were asked for. */
static void set_right(const struct paired *asked, struct group_mean *mean,
                      struct srnf_paired *found)
{
    struct compute_mean_outputs *made = &mean->outputs;
    size_t points = made->n_theta * made->n_phi;
    double *const maps[] = {
        found->statistic, found->p,      found->significance,   found->fdr,
        found->effect,    found->normal, found->standard_error, found->confidence};

    if (is_backwards(asked)) {
        for (size_t k = 0; k < asked->n * points; k++) {
            found->normals[k] = 0.0 - found->normals[k];
        }
        for (size_t p = 0; p < points; p++) {
            found->normal[p] = 0.0 - found->normal[p];
        }
    }
    if (asked->turned) {
        srnf_surface_mirror(made->group.degree, made->mean.coefficients);
        compute_mirror_columns(asked->n * made->n_theta, made->n_phi, found->normals);
        for (size_t k = 0; k < sizeof maps / sizeof maps[0]; k++) {
            compute_mirror_columns(made->n_theta, made->n_phi, maps[k]);
        }
    }
}

static int compute(struct jobs_run *run, const struct paired *asked, struct group_mean *mean,
                   struct surfaces *s, struct srnf_paired *found, json_t **replicates,
                   struct jobs_result *result)
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
        bool lie = !mean->inputs.registration; /* as they are, so that theirs are the fields */
        const struct srnf_pairs pairs = {.n = asked->n,
                                         .mean = made->mean.coefficients,
                                         .first_q = s->one_q,
                                         .second_q = s->other_q,
                                         .first_size = s->one_size,
                                         .second_size = s->other_size,
                                         .first = lie ? s->ones : NULL,
                                         .second = lie ? s->others : NULL};

        status =
            srnf_paired_differences(sht, &pairs, &options, jobs_run_context(run), found, &error);
    } else {
        status = SRNF_ENOMEM;
    }
    if (status) {
        (void)compute_fail(result, status, &error, "comparing within subjects");
    } else {
        status = paired_replicates(run, asked, mean, sht, replicates, result);
    }
    jobs_transform_release(jobs_run_jobs(run), sht);
    if (status == SRNF_OK) {
        set_right(asked, mean, found);
    }
    return status;
}

/* ---- The result ------------------------------------------------------------------------------ */

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
    size_t first = is_backwards(asked) ? asked->n : 0;

    for (size_t i = 0; i < asked->n; i++) {
        json_t *one =
            json_pack("{s:O, s:[f, f], s:o, s:o, s:o, s:o}", "subject",
                      json_array_get(names, asked->first[i]), "sizes", s->lengths[first + i],
                      s->lengths[asked->n - first + i], "length", json_finite(found->length[i]),
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
    struct surfaces s = {.one = NULL};
    struct srnf_paired found = {0};
    json_t *document = NULL, *surface = NULL, *replicates = NULL;

    if (compute(run, asked, &mean, &s, &found, &replicates, result) == 0) {
        surface = keep_surface(run, &mean, &found, process, result);
    }
    if (surface) {
        size_t points = mean.outputs.n_theta * mean.outputs.n_phi;

        document = json_pack(
            "{s:o, s:o, s:o, s:I, s:o, s:o, s:o, s:o}", "surface", surface, "perSubject",
            subjects_json(asked, &s, points, &found), "distance", json_finite(found.norm),
            "subjects", (json_int_t)asked->n, difference, json_estimate(&found.change, 1.0), spread,
            json_estimate(&found.fluctuating, 1.0), "individual",
            json_estimate(&found.individual, 1.0), "share", json_estimate(&found.share, 1.0));
        (void)json_object_set_new(document, "distanceInterval",
                                  json_vector(found.norm_interval, 2));
        permutation_set_p(document, "pValue", found.p_value, &found.test);
        permutation_set_p(document, "leastSignificance", found.max_p_value, &found.test);
        permutation_set_test(document, &found.test);
        set_extremes(document, &found, points);
        if (strcmp(process, "asymmetry") == 0) {
            (void)json_object_set(document, "replicates", replicates);
            paired_warn_replicates(document, asked, replicates);
        } else {
            change_warn(asked, &mean, &found, document);
        }
        mean_set_members(document, &mean);
        permutation_warn(warnings_of(document), &found.test, "pValue cannot be");
        mean_warn_members(run, &mean, document);
        typicality_warn_poses(run, &asked->group, &mean.outputs, false, warnings_of(document));
        document = mean_warn(run, &mean, (struct group_doubts){.classes = NULL}, document, result);
    }
    json_decref(replicates);
    clear(&s);
    srnf_paired_clear(&found);
    group_mean_clear(&mean);
    return document;
}
