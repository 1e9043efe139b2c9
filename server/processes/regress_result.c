/*
 * regress_result.c - the result of the process regress: its document, the surfaces with their maps,
 * and what both are doubted for.
 */
#include "processes/regress.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/warnings.h"
#include "toolkit/answers.h"
#include "toolkit/collinearity.h"
#include "toolkit/outliers.h"
#include "toolkit/permutation_test.h"
#include "toolkit/spreads.h"
#include "toolkit/typicality.h"

struct document {
    struct jobs_run *run;
    const struct regress *asked;
    const struct group_mean *mean;
    const struct srnf_regression *found;
    const json_t *design;
    const struct regress_more *more;
    struct jobs_result *result;
    double scale; /* of the group: units of the input to those of the mean */
    json_t *root;
};

/* ---- Tests ----------------------------------------------------------------------------------- */

static double least_of(size_t count, const double *values)
{
    double least = 1.0;

    for (size_t k = 0; k < count; k++) {
        least = fmin(least, values[k]);
    }
    return least;
}

static size_t points_of(const struct document *d)
{
    return d->mean->outputs.n_theta * d->mean->outputs.n_phi;
}

static void set_share(json_t *object, const char *name, const struct srnf_share *share)
{
    char text[32];

    (void)snprintf(text, sizeof text, "%sInterval", name);
    (void)json_object_set_new(object, name, json_finite(share->value));
    (void)json_object_set_new(object, text, json_vector(share->interval, 2));
}

static struct srnf_permutation_test permutations_of(const struct document *d,
                                                    const struct srnf_regression_test *test)
{
    struct srnf_permutation_test all = d->found->test;

    all.least = test->least;
    return all;
}

/* What all tests tell, with the map where that is asked for. */
static json_t *test_json(const struct document *d, size_t t, bool with_map)
{
    const struct srnf_regression_test *test = &d->found->test_of[t];
    const struct srnf_permutation_test all = permutations_of(d, test);
    size_t points = points_of(d);
    json_t *object =
        json_pack("{s:I, s:I, s:o}", "degreesOfFreedom", (json_int_t)test->degrees,
                  "residualDegreesOfFreedom", (json_int_t)test->freedom, "f", json_finite(test->f));

    permutation_set_p(object, "pValue", test->p_value, &all);
    permutation_set_p(object, "leastSignificance", test->max_p_value, &all);
    (void)json_object_set_new(object, "leastFdr", json_finite(least_of(points, test->fdr)));
    (void)json_object_set_new(
        object, "level",
        json_string(d->more->weighted || d->asked->design.nested[t].reduced > 0 ? "asymptotic"
                                                                                : "exact"));
    set_share(object, "r2", &test->r2);
    set_share(object, "partialR2", &test->part);
    if (with_map) {
        (void)json_object_set_new(object, "map",
                                  json_pack("{s:I, s:I, s:o, s:o, s:o, s:o}", "nTheta",
                                            (json_int_t)d->mean->outputs.n_theta, "nPhi",
                                            (json_int_t)d->mean->outputs.n_phi, "significance",
                                            json_vector(test->significance, points), "fdr",
                                            json_vector(test->fdr, points), "pointwiseP",
                                            json_vector(test->p, points), "statistic",
                                            json_vector(test->statistic, points)));
    }
    return object;
}

static const json_t *test_at(const struct document *d, size_t t)
{
    return json_array_get(json_object_get(d->design, "tests"), t);
}

static bool is_kind(const struct document *d, size_t t, const char *kind)
{
    return strcmp(json_string_value(json_object_get(test_at(d, t), "kind")), kind) == 0;
}

static size_t term_of_test(const struct document *d, size_t t)
{
    return (size_t)json_integer_value(json_object_get(test_at(d, t), "term"));
}

static json_t *term_name(const struct document *d, size_t term)
{
    return json_object_get(json_array_get(json_object_get(d->design, "terms"), term), "name");
}

static void set_terms(const struct document *d)
{
    const json_t *columns = json_object_get(d->design, "columns");
    json_t *terms = json_array();

    for (size_t t = 0; t < d->found->tests; t++) {
        const json_t *tested = json_object_get(test_at(d, t), "tested");
        json_t *names = json_array(), *term;

        for (size_t k = 0; k < json_array_size(tested); k++) {
            size_t c = (size_t)json_integer_value(json_array_get(tested, k));

            (void)json_array_append(names, json_object_get(json_array_get(columns, c), "name"));
        }
        if (is_kind(d, t, "term")) {
            term = test_json(d, t, true);
            (void)json_object_set(term, "name", term_name(d, term_of_test(d, t)));
            (void)json_object_set(term, "columns", names);
            (void)json_array_append_new(terms, term);
        } else if (is_kind(d, t, "model")) {
            (void)json_object_set_new(d->root, "model", test_json(d, t, false));
        }
        json_decref(names);
    }
    (void)json_object_set_new(d->root, "terms", terms);
}

/* Holm's p of a pair among those of its term: S. Holm, "A simple sequentially rejective multiple
   test procedure", 1979. The largest of p times the number of those not smaller, over smaller p. */
static double holm(const struct document *d, size_t t)
{
    double corrected = 0.0, own = d->found->test_of[t].p_value;

    for (size_t s = 0; s < d->found->tests; s++) {
        double p = d->found->test_of[s].p_value;
        size_t not_smaller = 0;

        if (!is_kind(d, s, "pair") || term_of_test(d, s) != term_of_test(d, t) || p > own) {
            continue;
        }
        for (size_t u = 0; u < d->found->tests; u++) {
            not_smaller += is_kind(d, u, "pair") && term_of_test(d, u) == term_of_test(d, t) &&
                           d->found->test_of[u].p_value >= p;
        }
        corrected = fmax(corrected, fmin(1.0, (double)not_smaller * p));
    }
    return corrected;
}

static void set_pairs(const struct document *d)
{
    json_t *pairs = json_array();

    for (size_t t = 0; t < d->found->tests; t++) {
        if (is_kind(d, t, "pair")) {
            json_t *pair = test_json(d, t, false);

            (void)json_object_set(pair, "term", term_name(d, term_of_test(d, t)));
            (void)json_object_set(pair, "levels", json_object_get(test_at(d, t), "levels"));
            (void)json_object_set_new(pair, "correctedP", json_finite(holm(d, t)));
            (void)json_array_append_new(pairs, pair);
        }
    }
    (void)json_object_set_new(d->root, "pairwise", pairs);
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

/* Maps of the grid, each times its factor; count 0: no memory, with the problem set. */
static struct store_maps maps_of(const struct document *d, size_t count, const char *const *names,
                                 const double *const *values, size_t scaled)
{
    struct store_maps maps = {.n_theta = (int64_t)d->mean->outputs.n_theta,
                              .n_phi = (int64_t)d->mean->outputs.n_phi};
    size_t points = points_of(d);

    maps.values = malloc(count * points * sizeof(double));
    for (size_t k = 0; maps.values && k < count; k++) {
        (void)snprintf(maps.names[k], sizeof maps.names[k], "%s", names[k]);
        for (size_t p = 0; p < points; p++) {
            maps.values[k * points + p] = values[k][p] * (k < scaled ? d->scale : 1.0);
        }
    }
    maps.count = maps.values ? count : 0;
    if (!maps.values) {
        (void)compute_fail(d->result, SRNF_ENOMEM, NULL, "keeping the maps");
    }
    return maps;
}

/* q as the service writes fields: [nTheta][nPhi][3]. */
static json_t *field_json(const struct document *d, const double *q)
{
    size_t points = points_of(d);
    double *turned = srnf_alloc(3 * points, sizeof *turned);
    json_t *array;

    for (size_t k = 0; turned && k < 3 * points; k++) {
        turned[k] = q[k % 3 * points + k / 3];
    }
    array = turned ? json_vector(turned, 3 * points) : NULL;
    srnf_free(turned);
    return array;
}

/* The mean surface with the maps of a column, number c. */
static json_t *coefficient_surface(const struct document *d, size_t c, size_t term,
                                   const char *name)
{
    static const char *const names[] = {"effect", "normalEffect", "standardError", "significance",
                                        "fdr",    "pointwiseP",   "statistic"};
    const struct srnf_regression *found = d->found;
    const struct srnf_regression_test *test = &found->test_of[term]; /* terms come first */
    size_t points = points_of(d);
    const double *const values[] = {found->effect + c * points,
                                    found->normal + c * points,
                                    found->standard_error + c * points,
                                    test->significance,
                                    test->fdr,
                                    test->p,
                                    test->statistic};
    struct store_maps maps = maps_of(d, sizeof names / sizeof names[0], names, values, 3);
    char title[96];
    json_t *surface = NULL;

    (void)snprintf(title, sizeof title, "effect of %.60s", name);
    if (maps.count) {
        surface = mean_keep_surface(d->run, d->more->process, title, d->mean, &maps, d->result);
    }
    store_maps_clear(&maps);
    return surface;
}

static bool set_coefficients(const struct document *d)
{
    const json_t *columns = json_object_get(d->design, "columns");
    size_t points = points_of(d);
    json_t *array = json_array();

    (void)json_object_set_new(d->root, "coefficients", array);
    for (size_t k = 0; k <= d->found->columns; k++) {
        const json_t *column = k ? json_array_get(columns, k - 1) : NULL;
        const char *name = k ? json_string_value(json_object_get(column, "name")) : "Intercept";
        json_t *one =
            json_pack("{s:s, s:o, s:o}", "name", name, "norm", json_finite(d->found->norms[k]),
                      "normInterval", json_vector(d->found->norm_intervals + 2 * k, 2));

        if (column) {
            size_t term = (size_t)json_integer_value(json_object_get(column, "term"));
            json_t *surface = coefficient_surface(d, k - 1, term, name);
            double largest = 0.0;

            for (size_t p = 0; p < points; p++) {
                largest = fmax(largest, d->found->effect[(k - 1) * points + p] * d->scale);
            }
            (void)json_object_set(one, "term", term_name(d, term));
            (void)json_object_set_new(one, "largestEffect", json_finite(largest));
            if (!surface) {
                json_decref(one);
                return false;
            }
            (void)json_object_set_new(one, "surface", surface);
        }
        if (d->asked->fields) {
            (void)json_object_set_new(one, "q",
                                      field_json(d, d->found->coefficients + k * 3 * points));
        }
        (void)json_array_append_new(array, one);
    }
    return true;
}

/* A predicted surface, its centre where the others have theirs. */
static json_t *prediction_surface(const struct document *d, size_t k)
{
    static const char *const names[] = {"standardError", "confidence", "slope", "slopeError",
                                        "slopeConfidence"};
    const struct srnf_predicted_shape *point = &d->found->predicted[k];
    const struct srnf_predicted_slope none = {NULL, NULL, NULL};
    const struct srnf_predicted_slope *slope = d->more->slopes ? &d->more->slopes[k] : &none;
    const double *const values[] = {point->standard_error, point->confidence, slope->normal,
                                    slope->standard_error, slope->confidence};
    size_t count = d->more->slopes ? 5 : 2;
    const struct group_input *members = d->mean->members;
    const struct compute_group *group = &d->mean->outputs.group;
    const double origin[3] = {0.0, 0.0, 0.0};
    struct srnf_surface_measures measures;
    struct store_maps maps = {0};
    char title[64];
    json_t *surface = NULL;

    (void)snprintf(title, sizeof title, "prediction %zu", k + 1);
    if (compute_measure(d->run, group->degree, 1, point->coefficients, &measures, d->result)) {
        return NULL;
    }
    srnf_surface_move(group->degree, point->coefficients, &measures, origin);
    maps = maps_of(d, count, names, values, count);
    if (maps.count) {
        struct surface_description description = {
            .name = title,
            .degree = group->degree,
            .coefficients = point->coefficients,
            .scale = d->scale,
            .measures = &measures,
            .parameterization = "inherited",
            .route = routes_of_group(d->run, members->n, members->ids, group->bridged),
            .source = process_source(d->run, d->more->process, NULL, NULL),
            .maps = &maps,
        };

        surface = process_keep_surface(d->run, &description, "a predicted surface", d->result);
    }
    store_maps_clear(&maps);
    return surface;
}

static bool set_predictions(const struct document *d)
{
    json_t *array = json_array(), *energies = json_array();
    size_t points = points_of(d);
    bool good = true;

    (void)json_object_set_new(d->root, "predictions", array);
    for (size_t k = 0; k < d->found->points && good; k++) {
        const struct srnf_predicted_shape *point = &d->found->predicted[k];
        json_t *surface = prediction_surface(d, k);
        double widest = 0.0;

        for (size_t p = 0; p < points; p++) {
            widest = fmax(widest, point->confidence[p] * d->scale);
        }
        good = surface != NULL;
        (void)json_array_append_new(energies, json_finite(point->relative_energy));
        if (good) {
            (void)json_array_append_new(
                array,
                json_pack("{s:O, s:o, s:o, s:o, s:o}", "at",
                          json_array_get(json_object_get(d->design, "at"), k), "surface", surface,
                          "relativeEnergy", json_finite(point->relative_energy), "leverage",
                          json_finite(point->leverage), "largestConfidence", json_finite(widest)));
        }
    }
    answers_warn_energies(energies, d->root);
    json_decref(energies);
    return good;
}

/* ---- Warnings -------------------------------------------------------------------------------- */

static void warn_beyond(const struct document *d)
{
    const json_t *beyond = json_object_get(d->design, "beyond"), *first;

    first = json_array_get(beyond, 0);
    if (first) {
        double value = json_number_value(json_object_get(first, "value"));
        double lowest = json_number_value(json_object_get(first, "lowest"));
        double highest = json_number_value(json_object_get(first, "highest"));
        const char *name = json_string_value(json_object_get(first, "covariate"));

        warning_add(warnings_of(d->root), "extrapolated", json_deep_copy(first),
                    "Prediction %lld is at %.60s = %.6g, beyond the members, who have %.6g to "
                    "%.6g%s. There the model is nothing but a straight line; predict within.",
                    (long long)json_integer_value(json_object_get(first, "index")) + 1, name, value,
                    lowest, highest,
                    json_array_size(beyond) > 1 ? ", and it is not the only one" : "");
    }
}

static void warn_of_floors(const struct document *d)
{
    struct srnf_permutation_test worst = d->found->test;

    worst.least = 0.0;
    for (size_t t = 0; t < d->found->tests; t++) {
        worst.least = fmax(worst.least, d->found->test_of[t].least);
    }
    permutation_warn(warnings_of(d->root), &worst, "Some p-value of this result cannot be");
}

/* ---- The whole ------------------------------------------------------------------------------- */

static void set_figures(const struct document *d)
{
    const struct srnf_regression *found = d->found;

    (void)json_object_set_new(d->root, "residualVariance", json_finite(found->residual_variance));
    (void)json_object_set_new(d->root, "residualVarianceInterval",
                              json_vector(found->residual_interval, 2));
    (void)json_object_set_new(d->root, "variance", json_finite(found->variance));
    (void)json_object_set_new(d->root, "varianceInterval",
                              json_vector(found->variance_interval, 2));
    (void)json_object_set_new(d->root, "residualDegreesOfFreedom",
                              json_integer((json_int_t)found->freedom));
    (void)json_object_set_new(d->root, "members", json_integer((json_int_t)found->n));
    (void)json_object_set_new(d->root, "subjects", json_integer((json_int_t)found->subjects));
    (void)json_object_set_new(d->root, "bootstraps", json_integer(d->asked->bootstraps));
    permutation_set_test(d->root, &found->test);
    (void)json_object_set(d->root, "formula", json_object_get(d->design, "formula"));
}

json_t *regress_document(struct jobs_run *run, const struct regress *asked,
                         const struct group_mean *mean, const struct srnf_regression *found,
                         const struct regress_more *more, struct jobs_result *result)
{
    const struct group_input *members = mean->members;
    struct document d = {.run = run,
                         .asked = asked,
                         .mean = mean,
                         .found = found,
                         .more = more,
                         .scale = mean_scale(run, mean),
                         .design = json_object_get(members->cohort, "design"),
                         .result = result,
                         .root = json_object()};
    json_t *surface;

    surface = mean_keep_surface(run, more->process, more->title, mean, more->maps, result);
    if (!surface) {
        goto fail;
    }
    (void)json_object_set_new(d.root, "surface", surface);
    set_figures(&d);
    set_terms(&d);
    set_pairs(&d);
    if (!set_coefficients(&d) || !set_predictions(&d)) {
        goto fail;
    }
    mean_set_members(d.root, mean);
    warn_beyond(&d);
    outliers_warn_design(run, members->cohort, d.root);
    collinearity_warn(warnings_of(d.root), d.design, &asked->design.design, members->n,
                      members->subjects);
    spreads_warn_terms(warnings_of(d.root), d.design, &asked->design.design, members->n,
                       members->subjects, found);
    warn_of_floors(&d);
    mean_warn_members(run, mean, d.root);
    typicality_warn_poses(run, members, &mean->outputs, false, warnings_of(d.root));
    return mean_warn(run, mean, (struct group_doubts){.classes = NULL}, d.root, result);
fail:
    json_decref(d.root);
    return NULL;
}
