/*
 * score_result.c - the result document of the process score, and the surface with its maps.
 */
#include "processes/score.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/models.h"
#include "api/warnings.h"
#include "store/surface.h"
#include "toolkit/outliers.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/typicality.h"

static json_t *rank_json(const struct srnf_norm_rank *rank)
{
    return json_pack("{s:o, s:f, s:[f, f], s:f, s:f}", "value", json_finite(rank->value),
                     "percentile", rank->percentile, "interval", rank->interval[0],
                     rank->interval[1], "asOdd", rank->as_odd, "pValue", rank->p_value);
}

static json_t *check_json(const struct srnf_norm_check *check)
{
    static const char *const names[SRNF_NORM_CHECKS] = {"residual", "mahalanobis", "overall"};
    json_t *object;

    if (check->n == 0) {
        return json_null();
    }
    object = json_pack("{s:I}", "subjects", (json_int_t)check->n);
    for (size_t c = 0; c < SRNF_NORM_CHECKS; c++) {
        (void)json_object_set_new(
            object, names[c],
            json_pack("{s:o, s:f, s:f}", "percentiles",
                      json_vector(check->percentiles + c * check->n, check->n), "distance",
                      check->distance[c], "pValue", check->p_value[c]));
    }
    return object;
}

/* ---- The surface ----------------------------------------------------------------------------- */

/* Lengths in units of the input; count 0: no memory, with the problem set. */
static struct store_maps maps_of(const struct compute_model *model, const struct srnf_score *found,
                                 double scale, struct jobs_result *result)
{
    static const char *const names[] = {"deviation", "spread", "zScore", "significance"};
    const double *const values[] = {found->deviation, found->spread, found->z, found->significance};
    const int64_t rows = (int64_t)compute_joint_rows(&model->joint, &model->stored);
    struct store_maps maps = {.n_theta = rows, .n_phi = model->stored.n_phi};
    size_t count = sizeof names / sizeof names[0], points = found->n_points;

    maps.values = malloc(count * points * sizeof(double));
    for (size_t k = 0; maps.values && k < count; k++) {
        (void)snprintf(maps.names[k], sizeof maps.names[k], "%s", names[k]);
        for (size_t p = 0; p < points; p++) {
            maps.values[k * points + p] = values[k][p] * (k < 2 ? scale : 1.0);
        }
    }
    maps.count = maps.values ? count : 0;
    if (!maps.values) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "keeping the maps");
    }
    return maps;
}

/* The surface of a model of one structure, or of a part of one; its record, or NULL with the
   problem set. mean: id of its mean surface. */
static json_t *keep_surface(struct jobs_run *run, const struct compute_model *model,
                            const char *mean, const char *part, struct srnf_score *found,
                            struct jobs_result *result)
{
    const double origin[3] = {0.0, 0.0, 0.0};
    size_t degree = (size_t)model->stored.lmax;
    struct srnf_surface_measures measures;
    char name[128];
    struct surface_description description = {
        .name = name,
        .degree = degree,
        .coefficients = found->coefficients,
        .scale = process_scale(run, mean, 0.0),
        .measures = &measures,
        .parameterization = "inherited",
        .route = routes_common(run, 1, &mean, NULL),
    };
    struct store_maps maps;
    json_t *surface = NULL;

    (void)snprintf(name, sizeof name, "%s%.60s beside the norm", part ? "" : "a surface",
                   part ? part : "");
    if (compute_measure(run, degree, 1, found->coefficients, &measures, result)) {
        return NULL;
    }
    srnf_surface_move(degree, found->coefficients, &measures, origin);
    maps = maps_of(model, found, description.scale, result);
    if (maps.count) {
        description.source = process_source(run, "score", NULL, mean);
        description.maps = &maps;
        surface = process_keep_surface(run, &description, "the surface", result);
    }
    store_maps_clear(&maps);
    return surface;
}

/* zMap, and of several structures that and largestZ of each part; false with the problem set. */
static bool keep_maps(struct jobs_run *run, const struct compute_model *model,
                      struct score_found *found, json_t *document, struct jobs_result *result)
{
    json_t *parts = json_object_get(document, "parts"), *part, *surface = json_null();
    size_t p;

    if (found->whole.n_points) {
        surface = keep_surface(run, model, model->stored.mean, NULL, &found->whole, result);
    }
    (void)json_object_set_new(document, "zMap", surface ? surface : json_null());
    json_array_foreach(parts, p, part)
    {
        struct srnf_score *map = &found->maps[p];

        if (surface && map->n_points) {
            surface = keep_surface(run, model, model->joint.means[p],
                                   json_string_value(json_object_get(part, "name")), map, result);
            (void)json_object_set_new(part, "zMap", surface ? surface : json_null());
        } else {
            (void)json_object_set_new(part, "zMap", json_null());
        }
        (void)json_object_set_new(part, "largestZ",
                                  map->n_points ? rank_json(&map->largest) : json_null());
    }
    return surface != NULL;
}

/* ---- The document ---------------------------------------------------------------------------- */

static void warn(struct jobs_run *run, const struct score *asked, const struct compute_model *model,
                 const struct compute_projection *projection, json_t *sides,
                 const struct score_found *all, json_t *document)
{
    const struct srnf_score *found = &all->whole;
    const json_t *beyond = json_array_get(json_object_get(asked->expected.told, "beyond"), 0);

    if (beyond) {
        warning_add(warnings_of(document), "extrapolated", json_deep_copy(beyond),
                    "The surface has %.60s = %.6g, beyond the members, who have %.6g to %.6g. What "
                    "is expected of it there is nothing but a straight line.",
                    json_string_value(json_object_get(beyond, "covariate")),
                    json_number_value(json_object_get(beyond, "value")),
                    json_number_value(json_object_get(beyond, "lowest")),
                    json_number_value(json_object_get(beyond, "highest")));
    }
    if (asked->expected.told) {
        json_t *made = model_made_from(&model->stored);
        json_t *members = json_pack("{s:O, s:O?, s:O?}", "design", asked->expected.told, "subjects",
                                    json_object_get(made, "subjects"), "surfaces",
                                    json_object_get(made, "surfaces"));

        outliers_warn_design(run, members, document);
        json_decref(members);
        json_decref(made);
    }
    if (asked->map && found->n_points == 0 && all->maps[0].n_points == 0) {
        warning_add(warnings_of(document), "components-missing",
                    json_pack("{s:I}", "members", (json_int_t)found->n),
                    "The model keeps a part of the components of its %zu members, so that their "
                    "shapes are not in it: there is no map and no calibration. Make it again "
                    "without the input components.",
                    found->n);
    }
    if (projection->training_subject) {
        warning_add(warnings_of(document), "training-subject", json_object(),
                    "The surface is a member of the model. It is judged as if it were not, but it "
                    "took part in the mean that it is registered to.");
    } else {
        typicality_warn_twin(warnings_of(document), model, projection->scores,
                             projection->residual);
    }
    warnings_put(document, sides);
}

static json_t *figures(const struct srnf_score *found)
{
    static const char *const names[SRNF_NORM_TRAITS] = {[SRNF_TRAIT_RESIDUAL] = "residual",
                                                        [SRNF_TRAIT_DISTANCE] = "distance",
                                                        [SRNF_TRAIT_MAHALANOBIS] = "mahalanobis"};
    json_t *ranks = json_object();
    json_t *document =
        json_pack("{s:f, s:[f, f], s:f, s:f, s:I, s:I}", "percentile", found->overall.percentile,
                  "percentileInterval", found->overall.interval[0], found->overall.interval[1],
                  "pValue", found->overall.p_value, "asOdd", found->overall.as_odd, "subjects",
                  (json_int_t)found->compared, "components", (json_int_t)found->counted);

    for (size_t t = 0; t < SRNF_NORM_TRAITS; t++) {
        (void)json_object_set_new(document, names[t], json_finite(found->trait[t].value));
        (void)json_object_set_new(ranks, names[t], rank_json(&found->trait[t]));
    }
    if (found->n_points) {
        (void)json_object_set_new(ranks, "largestZ", rank_json(&found->largest));
    }
    (void)json_object_set_new(document, "ranks", ranks);
    return document;
}

json_t *score_document(struct jobs_run *run, const struct score *asked,
                       const struct compute_model *model,
                       const struct compute_projection *projection,
                       const struct srnf_register_options *registration, json_t *sides,
                       struct score_found *found, struct jobs_result *result)
{
    json_t *at = json_array_get(json_object_get(asked->expected.told, "at"), 0);
    json_t *document = json_object(), *own = figures(&found->whole);

    subject_set_parts(document, &asked->subject, model, projection);
    if (!keep_maps(run, model, found, document, result)) {
        json_decref(document);
        json_decref(own);
        json_decref(sides);
        return NULL;
    }
    if (asked->expected.given) {
        (void)json_object_set_new(document, "typicality", json_null());
        typicality_warn_projection(document, projection, true);
    } else {
        typicality_set_projection(document, projection);
    }
    (void)json_object_update(document, own); /* of a member, mahalanobis without it */
    json_decref(own);
    (void)json_object_set_new(document, "calibration", check_json(&found->whole.check));
    (void)json_object_set_new(document, "trainingSubject",
                              json_boolean(projection->training_subject));
    (void)json_object_set_new(document, "at", at ? json_incref(at) : json_null());
    (void)json_object_set_new(document, "registration", registration_json(registration));
    warn(run, asked, model, projection, sides, found, document);
    return document;
}
