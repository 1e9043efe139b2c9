/*
 * pca_parts_result.c - the result of pca-parts, and the surfaces that it keeps.
 */
#include "processes/pca_parts.h"

#include <stdio.h>
#include <string.h>

#include "api/surfaces.h"

#define NAME_BYTES 128

struct results {
    struct jobs_run *run;
    const struct pca_parts *asked;
    const struct compute_parts_inputs *inputs;
    const struct compute_parts_outputs *found;
    struct jobs_result *result;
    const json_t *names; /* of the parts */
};

/* A description of a surface of part p, whose scale is the mean of those of its members. */
static struct surface_description describe(const struct results *r, size_t p, const char *name,
                                           const char *reference)
{
    const struct group_input *group = &r->asked->group;
    const struct compute_group *loaded = &r->found->group;
    size_t n = r->asked->n;
    struct surface_description description = {
        .name = name,
        .degree = loaded->degree,
        .parameterization = "inherited",
        .route = routes_of_group(r->run, n, group->ids + p * n, loaded->bridged + p * n),
        .source = process_source(r->run, "pca-parts", NULL, reference),
    };

    for (size_t i = p * n; i < (p + 1) * n; i++) {
        description.scale += process_scale(r->run, group->ids[i], loaded->scales[i]) / (double)n;
    }
    return description;
}

static const char *part_name(const struct results *r, size_t p)
{
    return json_string_value(json_array_get(r->names, p));
}

/* Record of the mean of a part, or NULL with the problem set. */
static json_t *keep_mean(const struct results *r, size_t p)
{
    char name[NAME_BYTES];
    struct surface_description description;

    (void)snprintf(name, sizeof name, "mean of %.60s", part_name(r, p));
    description = describe(r, p, name, NULL);
    description.coefficients = r->found->means[p].mean.coefficients;
    description.measures = &r->found->means[p].measures;
    return process_keep_surface(r->run, &description, "the mean of a part", r->result);
}

/* One entry of modes, or NULL with the problem set. mean: id of the part's mean. */
static json_t *keep_mode(const struct results *r, size_t index, const char *mean)
{
    const struct compute_parts_outputs *found = r->found;
    size_t p = index % found->n_parts, mode = index / found->n_parts / 2;
    double deviations = (index / found->n_parts % 2 ? 1.0 : -1.0) * r->inputs->deviations;
    size_t count = 3 * srnf_coefficient_count(found->group.degree);
    char name[NAME_BYTES];
    struct surface_description description;
    json_t *record;

    (void)snprintf(name, sizeof name, "%.60s, joint mode %zu, %+.4g sd", part_name(r, p), mode + 1,
                   deviations);
    description = describe(r, p, name, mean);
    description.coefficients = found->coefficients + index * count;
    description.measures = &found->mode_measures[index];
    record = process_keep_surface(r->run, &description, "a surface of a mode", r->result);
    return record ? json_pack("{s:I, s:s, s:f, s:o, s:o}", "component", (json_int_t)mode + 1,
                              "part", part_name(r, p), "deviations", deviations, "surface", record,
                              "relativeEnergy", json_finite(found->relative_energy[index]))
                  : NULL;
}

static json_t *part_json(const struct results *r, size_t p, json_t *mean)
{
    const struct srnf_mean *own = &r->found->means[p].mean;
    double variance = r->found->joint.part_variances[p];

    return json_pack("{s:s, s:f, s:o, s:o, s:I, s:b, s:o, s:o, s:o}", "name", part_name(r, p),
                     "weight", r->asked->weights[p], "mean", mean, "relativeEnergy",
                     json_finite(own->relative_energy), "iterations", (json_int_t)own->iterations,
                     "converged", (int)own->converged, "variance", json_finite(variance), "share",
                     json_finite(variance / r->found->joint.total_variance), "distances",
                     json_vector(own->distances, own->n));
}

/* parts and modes into the document; false with the problem set. */
static bool keep_surfaces(const struct results *r, json_t *document)
{
    size_t n_parts = r->found->n_parts;
    json_t *parts = json_array(), *modes = json_array();

    (void)json_object_set_new(document, "parts", parts);
    (void)json_object_set_new(document, "modes", modes);
    for (size_t p = 0; p < n_parts; p++) {
        json_t *mean = keep_mean(r, p);

        if (!mean) {
            return false;
        }
        (void)json_array_append_new(parts, part_json(r, p, mean));
    }
    for (size_t i = 0; i < 2 * r->found->modes * n_parts; i++) {
        const json_t *mean = json_object_get(json_array_get(parts, i % n_parts), "mean");
        json_t *mode = keep_mode(r, i, json_string_value(json_object_get(mean, "id")));

        if (!mode) {
            return false;
        }
        (void)json_array_append_new(modes, mode);
    }
    return true;
}

/* ---- Numbers --------------------------------------------------------------------------------- */

static json_t *positions_json(const struct results *r)
{
    const struct srnf_joint_pca *joint = &r->found->joint;
    const size_t shape[3] = {joint->components, joint->parts, 3};
    double mean[3 * PCA_PARTS_MAX] = {0.0};

    if (!joint->positions) {
        return json_null();
    }
    for (size_t k = 0; k < 3 * joint->parts * joint->n; k++) {
        mean[k % (3 * joint->parts)] += r->inputs->positions[k] / (double)joint->n;
    }
    return json_pack("{s:f, s:o, s:o, s:o, s:o}", "weight", r->inputs->position_weight, "variance",
                     json_finite(joint->position_variance), "share",
                     json_finite(joint->position_variance / joint->total_variance), "mean",
                     json_nested(mean, 2, shape + 1), "components",
                     json_nested(joint->positions, 3, shape));
}

static json_t *cumulative_json(const struct srnf_joint_pca *joint)
{
    json_t *array = json_array();
    double sum = 0.0;

    for (size_t k = 0; k < joint->components; k++) {
        sum += joint->eigenvalues[k];
        (void)json_array_append_new(array, json_finite(sum / joint->total_variance));
    }
    return array;
}

/* The first of the cohort's arrays: one part has each subject once. */
static json_t *first_of_each(const struct results *r, const char *name)
{
    const json_t *all = json_object_get(r->asked->group.cohort, name);
    json_t *list = json_array();

    for (size_t i = 0; i < r->asked->n; i++) {
        json_t *value = json_array_get(all, i);

        (void)json_array_append_new(list, value ? json_incref(value) : json_null());
    }
    return list;
}

static json_t *numbers_json(const struct results *r)
{
    const struct srnf_joint_pca *joint = &r->found->joint;
    const size_t scores[2] = {joint->n, joint->components};
    const size_t shares[2] = {joint->components, joint->parts + 1};

    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "subjects",
                     first_of_each(r, "subjects"), "groups", first_of_each(r, "labels"),
                     "eigenvalues", json_vector(joint->eigenvalues, joint->components), "explained",
                     json_vector(joint->explained, joint->components), "cumulative",
                     cumulative_json(joint), "totalVariance", json_finite(joint->total_variance),
                     "scores", json_nested(joint->scores, 2, scores), "shares",
                     json_nested(joint->shares, 2, shares), "positions", positions_json(r),
                     "registration", registration_json(r->inputs->registration));
}

json_t *pca_parts_document(struct jobs_run *run, const struct pca_parts *asked,
                           const struct compute_parts_inputs *inputs,
                           const struct compute_parts_outputs *found, struct jobs_result *result)
{
    const struct group_input *group = &asked->group;
    const struct results r = {run,   asked,  inputs,
                              found, result, json_object_get(group->cohort, "parts")};
    json_t *document, *model;

    if (!process_finite(found->joint.components * found->joint.n, found->joint.scores, "the scores",
                        result)) {
        return NULL;
    }
    document = numbers_json(&r);
    if (!document || !keep_surfaces(&r, document)) {
        json_decref(document);
        return NULL;
    }
    model = pca_parts_keep(run, asked, inputs, found, document, result);
    if (!model) {
        json_decref(document);
        return NULL;
    }
    (void)json_object_set_new(document, "model", model);
    group_warn_duplicates(run, document, group->surfaces, group->cohort,
                          (const char(*)[STORE_ID_MAX])found->group.contents);
    if (!pca_parts_warn(run, asked, inputs, found, document, result)) {
        json_decref(document);
        return NULL;
    }
    return document;
}
