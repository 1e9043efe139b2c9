/*
 * model.c - what the processes that use a model share: the input that names it, and the
 * surfaces that are made from it. Each names the mean as its reference, from which the deformation
 * in its mesh is measured.
 */
#include "toolkit/model.h"

#include <stdio.h>
#include <string.h>

#include "api/auth.h"
#include "api/model_parts.h"
#include "api/models.h"
#include "api/surfaces.h"
#include "store/model.h"
#include "toolkit/group.h"
#include "toolkit/routes.h"

/* What a model of another kind is, and who takes it. */
static const char *about(const char *own)
{
    return strcmp(own, "classifier") == 0 ? "is a classifier, made by train or "
                                            "train-parts, which predict takes"
           : strcmp(own, "parts") == 0
               ? "is a model of several structures, made by pca-parts, which project, score, modes "
                 "and sample take"
               : "is a model of principal components, made by pca";
}

/* A model of another kind is a problem that says who takes it. */
static bool check_kind(struct process_inputs *inputs, const char *kind,
                       const struct store_model *model)
{
    const char *own = model_kind(model);
    bool any = kind && strcmp(kind, MODEL_OF_ANY_PARTS) == 0;
    bool wants_classifier = kind && strcmp(kind, "classifier") == 0;

    if (any ? strcmp(own, "classifier") != 0
            : strcmp(own, wants_classifier ? "classifier" : "components") == 0) {
        return true;
    }
    problem_add(inputs->list, "/inputs/model", "%s; here %s is needed", about(own),
                wants_classifier ? "a classifier, made by train or train-parts,"
                : any            ? "a model of principal components, made by pca or pca-parts,"
                                 : "a model of principal components, made by pca,");
    return false;
}

bool inputs_model(struct process_inputs *inputs, const char *kind, struct store_model *model)
{
    const char *id = json_string_value(json_object_get(inputs->given, "model"));
    int status;

    *model = (struct store_model){.record = NULL};
    if (!id || strncmp(id, "model-", 6) != 0 || strlen(id) != 38 ||
        strspn(id + 6, "0123456789abcdef") != 32) {
        problem_add(inputs->list, "/inputs/model",
                    "must be the id of a model: model- and 32 hexadecimal digits");
        return false;
    }
    if (inputs->shape_only) {
        return false;
    }
    status = call_sees(inputs->call, id);
    if (status == 0) {
        status = store_model_get_as(inputs->call->api->config.store,
                                    inputs->call->request->caller.name, id, 0, model);
    }
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-model", id);
        inputs->answered = true;
        return false;
    }
    if (!check_kind(inputs, kind, model)) {
        store_model_clear(model);
        return false;
    }
    inputs->call->work.degree = (long)model->lmax;
    (void)json_object_set_new(inputs->canonical, "model", json_string(id));
    return true;
}

int model_load(struct jobs_run *run, const char *id, struct compute_model *model,
               struct jobs_result *result)
{
    int status = compute_model_load(run, id, model, result);

    if (status == 0 && !model_joint(&model->stored, &model->joint)) {
        status = compute_fail_store(result, STORE_CORRUPT, id);
    }
    return status;
}

size_t model_mesh_degree(const struct store_model *model, const json_t *made)
{
    const json_t *surfaces = json_object_get(made, "surfaces"), *surface;
    size_t i;

    json_array_foreach(surfaces, i, surface)
    {
        if (!json_is_string(surface) || compute_is_mesh(json_string_value(surface))) {
            return 0;
        }
    }
    return (size_t)model->lmax;
}

long model_components(struct process_inputs *inputs)
{
    const char *id = json_string_value(json_object_get(inputs->canonical, "model"));
    struct store_model model = {.record = NULL};
    long components = 0;

    if (store_model_get_as(inputs->call->api->config.store, inputs->call->request->caller.name, id,
                           0, &model) == 0) {
        components = (long)model.components;
    }
    store_model_clear(&model);
    return components;
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

/* Stores those of one part; false with the problem set. */
static bool keep_surfaces(struct jobs_run *run, const char *process,
                          const struct compute_model *model, const char *part,
                          const struct compute_reconstruction *points,
                          const char (*names)[MODEL_NAME_MAX], struct model_shapes *shapes,
                          struct jobs_result *result)
{
    size_t degree = (size_t)model->stored.lmax, count = 3 * srnf_coefficient_count(degree);
    double scale = process_scale(run, model->stored.mean, 0.0);
    const char *mean = model->stored.mean, *route = routes_common(run, 1, &mean, NULL);
    char name[2 * MODEL_NAME_MAX];

    for (size_t i = 0; i < points->n; i++) {
        struct surface_description description = {
            .name = name,
            .degree = degree,
            .coefficients = points->coefficients + i * count,
            .scale = scale,
            .measures = &points->measures[i],
            .parameterization = "inherited",
            .route = route,
            .source = process_source(run, process, NULL, model->stored.mean),
        };
        json_t *record;

        (void)snprintf(name, sizeof name, "%s%s%.60s", names[i], part ? ", " : "",
                       part ? part : "");
        record = process_keep_surface(run, &description, "a surface of the model", result);
        if (!record) {
            return false;
        }
        (void)json_array_append_new(shapes->surfaces, record);
        (void)json_array_append_new(shapes->energies, json_finite(points->relative_energy[i]));
        if (part) {
            (void)json_array_append_new(shapes->parts, json_string(part));
        }
    }
    return true;
}

bool model_shapes_make(struct jobs_run *run, const char *process, const struct compute_model *model,
                       size_t n, const double *scores, const size_t *before,
                       const char (*names)[MODEL_NAME_MAX], struct model_shapes *shapes,
                       struct jobs_result *result)
{
    json_t *parts = model_part_names(&model->stored);
    bool several = json_array_size(parts) > 0, good = true;

    *shapes =
        (struct model_shapes){json_array(), several ? json_array() : json_null(), json_array()};
    for (size_t p = 0; p < model->joint.n_parts && good; p++) {
        struct compute_reconstruction points = {0};
        struct compute_model part = {.pca = {.n = 0}};

        good = !several || compute_model_part(run, model, p, &part, result) == 0;
        good = good && compute_reconstruct(run, several ? &part : model, n, scores, before, &points,
                                           result) == 0;
        good = good && keep_surfaces(run, process, several ? &part : model,
                                     json_string_value(json_array_get(parts, p)), &points, names,
                                     shapes, result);
        compute_reconstruction_clear(&points);
        compute_model_clear(&part);
    }
    json_decref(parts);
    return good;
}

void model_shapes_clear(struct model_shapes *shapes)
{
    json_decref(shapes->surfaces);
    json_decref(shapes->parts);
    json_decref(shapes->energies);
    *shapes = (struct model_shapes){.surfaces = NULL};
}
