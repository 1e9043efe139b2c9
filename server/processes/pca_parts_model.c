/*
 * pca_parts_model.c - the model that pca-parts keeps: stacked fields (srnf/parts.h), with the parts
 * and their positions in its record (api/model_parts.h).
 *
 * What the record tells of members is of subjects, but for their surfaces and what stands for
 * those, which are part after part. All of it is part of the model's id.
 */
#include "processes/pca_parts.h"

#include <math.h>

#include "toolkit/model_keep.h"

/* The first n of an array, or nulls. */
static json_t *first(const json_t *all, size_t n)
{
    json_t *list = json_array();

    for (size_t i = 0; i < n; i++) {
        json_t *value = json_array_get(all, i);

        (void)json_array_append_new(list, value ? json_incref(value) : json_null());
    }
    return list;
}

json_t *pca_parts_making(struct jobs_run *run, const char *process, const struct group_input *group,
                         size_t n, const struct model_parts *numbers,
                         const struct srnf_register_options *registration)
{
    const struct compute_group *loaded = numbers->group;
    json_t *made = model_making(run, process, group, numbers, registration,
                                (const char(*)[STORE_ID_MAX])loaded->ids);

    (void)json_object_set_new(made, "shapes",
                              model_ids(loaded->n, (const char(*)[STORE_ID_MAX])loaded->contents));
    (void)json_object_set_new(made, "subjects",
                              first(json_object_get(group->cohort, "subjects"), n));
    (void)json_object_set_new(made, "labels", first(json_object_get(group->cohort, "subjects"), n));
    (void)json_object_set_new(made, "groups", first(json_object_get(group->cohort, "labels"), n));
    return made;
}

/* The parts of the result, with the ids of their means. */
static json_t *parts_of(const json_t *told)
{
    static const char *const same[] = {"name", "weight", "relativeEnergy", "variance", "share"};
    json_t *parts = json_array(), *part;
    size_t i;

    json_array_foreach(told, i, part)
    {
        const json_t *mean = json_object_get(part, "mean");
        double scale = json_number_value(json_object_get(mean, "scale"));
        double area = json_number_value(json_object_get(mean, "area"));
        json_t *own = json_pack("{s:O, s:o}", "mean", json_object_get(mean, "id"), "size",
                                json_finite(scale * sqrt(area)));

        for (size_t k = 0; k < sizeof same / sizeof same[0]; k++) {
            (void)json_object_set(own, same[k], json_object_get(part, same[k]));
        }
        (void)json_array_append_new(parts, own);
    }
    return parts;
}

static json_t *positions_of(const json_t *told)
{
    return json_is_object(told) ? json_pack("{s:O, s:O}", "weight", json_object_get(told, "weight"),
                                            "mean", json_object_get(told, "mean"))
                                : json_null();
}

json_t *pca_parts_keep(struct jobs_run *run, const struct pca_parts *asked,
                       const struct compute_parts_inputs *inputs,
                       const struct compute_parts_outputs *found, const json_t *document,
                       struct jobs_result *result)
{
    const struct srnf_joint_pca *joint = &found->joint;
    const struct srnf_pca pca = {.n = joint->n,
                                 .components = joint->components,
                                 .eigenvalues = joint->eigenvalues,
                                 .modes = found->kept.modes,
                                 .scores = joint->scores,
                                 .total_variance = joint->total_variance};
    const struct model_parts numbers = {.group = &found->group,
                                        .n_theta = found->kept.n_theta,
                                        .n_phi = found->means[0].n_phi,
                                        .pca = &pca,
                                        .mean_q = found->kept.mean_q,
                                        .residuals = found->kept.residuals,
                                        .distances = found->kept.distances,
                                        .calibration = &found->kept.calibration};
    const json_t *parts = json_object_get(document, "parts");
    json_t *mean = json_object_get(json_array_get(parts, 0), "mean"), *record;

    if (!model_is_sound(&numbers, result)) {
        return NULL;
    }
    record = json_pack("{s:o, s:o, s:o, s:o}", "totalVariance", json_finite(joint->total_variance),
                       "parts", parts_of(parts), "positions",
                       positions_of(json_object_get(document, "positions")), "madeFrom",
                       pca_parts_making(run, "pca-parts", &asked->group, asked->n, &numbers,
                                        inputs->registration));
    return model_keep(run, &numbers, record, json_deep_copy(mean), result);
}
