/*
 * compare_groups_result.c - the result of the process compare-groups: its maps, its document, and
 * what it is doubted for.
 */
#include "processes/compare_groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/warnings.h"
#include "toolkit/covariates.h"
#include "toolkit/permutation_test.h"
#include "toolkit/spreads.h"
#include "toolkit/typicality.h"

#define MAPS_TOLD 3     /* of the maps, in the document; all of them ride along in meshes */
#define MAP_POINTWISE 4 /* is told as well */

struct store_maps compare_groups_maps(const struct compute_mean_outputs *mean,
                                      const struct srnf_comparison *comparison)
{
    static const char *const titles[] = {"significance", "fdr",        "effect",
                                         "normalEffect", "pointwiseP", "statistic"};
    const double *const values[] = {
        comparison->significance, comparison->fdr, comparison->effect,
        comparison->normal,       comparison->p,   comparison->statistic};
    struct store_maps maps = {.n_theta = (int64_t)mean->n_theta, .n_phi = (int64_t)mean->n_phi};
    size_t count = sizeof titles / sizeof titles[0], points = mean->n_theta * mean->n_phi;

    maps.values = malloc(count * points * sizeof(double));
    if (!maps.values) {
        return maps;
    }
    maps.count = count;
    for (size_t i = 0; i < count; i++) {
        (void)snprintf(maps.names[i], sizeof maps.names[i], "%s", titles[i]);
        memcpy(maps.values + i * points, values[i], points * sizeof(double));
    }
    return maps;
}

/* The ends of the maps, for those who do not draw them. */
static json_t *summary(const struct compute_mean_outputs *mean,
                       const struct srnf_comparison *comparison)
{
    size_t points = mean->n_theta * mean->n_phi;
    double least = 1.0, least_fdr = 1.0, largest = 0.0;
    json_t *document;

    for (size_t p = 0; p < points; p++) {
        least = comparison->significance[p] < least ? comparison->significance[p] : least;
        least_fdr = comparison->fdr[p] < least_fdr ? comparison->fdr[p] : least_fdr;
        largest = comparison->effect[p] > largest ? comparison->effect[p] : largest;
    }
    document = json_pack("{s:o, s:o}", "leastFdr", json_finite(least_fdr), "largestEffect",
                         json_finite(largest));
    permutation_set_p(document, "leastSignificance", least, &comparison->test);
    return document;
}

static json_t *map_json(const struct store_maps *maps)
{
    size_t points = (size_t)maps->n_theta * (size_t)maps->n_phi;
    json_t *map = json_pack("{s:I, s:I}", "nTheta", (json_int_t)maps->n_theta, "nPhi",
                            (json_int_t)maps->n_phi);

    for (size_t i = 0; i < MAPS_TOLD && i < maps->count; i++) {
        (void)json_object_set_new(map, maps->names[i],
                                  json_vector(maps->values + i * points, points));
    }
    (void)json_object_set_new(map, "pointwiseP",
                              json_vector(maps->values + MAP_POINTWISE * points, points));
    return map;
}

static void warn_of_spreads(json_t *document, const struct srnf_comparison *comparison)
{
    const struct spreads spreads = {
        json_object_get(document, "groups"),
        json_object_get(json_object_get(document, "groupSizes"), "subjects"),
        comparison->spread,
        comparison->inflation,
        "The test asks whether the two groups differ",
        isfinite(comparison->distance_interval[0]) ? "distanceInterval allows" : NULL};

    spreads_warn(warnings_of(document), &spreads, NULL);
}

json_t *compare_groups_document(const struct compare *asked,
                                const struct compute_mean_outputs *mean,
                                const struct srnf_comparison *comparison,
                                const struct store_maps *maps)
{
    const json_t *cohort = asked->cohort.group.cohort;
    json_t *document = summary(mean, comparison);

    permutation_set_p(document, "pValue", comparison->p_value, &comparison->test);
    permutation_set_test(document, &comparison->test);
    (void)json_object_set_new(document, "level",
                              json_string(comparison->asymptotic ? "asymptotic" : "exact"));
    permutation_warn(warnings_of(document), &comparison->test, "No p-value of this result can be");
    (void)json_object_set_new(document, "members", json_integer((json_int_t)comparison->n));
    (void)json_object_set_new(document, "subjects", json_integer((json_int_t)comparison->subjects));
    (void)json_object_set(document, "groupSizes", json_object_get(cohort, "sizes"));
    (void)json_object_set_new(document, "distance", json_finite(comparison->distance));
    (void)json_object_set_new(document, "distanceInterval",
                              json_vector(comparison->distance_interval, 2));
    (void)json_object_set_new(document, "spreads", json_vector(comparison->spread, 2));
    (void)json_object_set(document, "groups", json_object_get(cohort, "groups"));
    (void)json_object_set(document, "regressedOut", asked->covariates);
    (void)json_object_set_new(document, "map", map_json(maps));
    warn_of_spreads(document, comparison);
    return document;
}

json_t *compare_groups_warn(struct jobs_run *run, const struct compare *asked,
                            const struct group_mean *mean, json_t *document,
                            struct jobs_result *result)
{
    const struct compared *cohort = &asked->cohort;
    const json_t *groups = json_object_get(cohort->group.cohort, "groups");
    const char *titles[2] = {json_string_value(json_array_get(groups, 0)),
                             json_string_value(json_array_get(groups, 1))};
    size_t n = cohort->group.n, *classes = srnf_alloc(n, sizeof *classes);
    const struct group_doubts doubts = {.classes = classes, .n_classes = 2, .names = titles};

    mean_warn_members(run, mean, document);
    typicality_warn_poses(run, &cohort->group, &mean->outputs, false, warnings_of(document));
    covariates_warn(warnings_of(document), asked->covariates, n, cohort->group.subjects,
                    cohort->which, cohort->covariates);
    for (size_t i = 0; classes && i < n; i++) {
        classes[i] = (size_t)cohort->which[i];
    }
    if (classes) {
        document = mean_warn(run, mean, doubts, document, result);
    } else {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "comparing the members");
        json_decref(document);
        document = NULL;
    }
    srnf_free(classes);
    return document;
}
