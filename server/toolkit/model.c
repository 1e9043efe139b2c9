/*
 * model.c - what the processes that use a model share: the input that names it, and the
 * surfaces that are made from it. Each names the mean as its reference, from which the deformation
 * in its mesh is measured.
 */
#include "toolkit/model.h"

#include <string.h>

#include "api/auth.h"
#include "api/models.h"
#include "api/surfaces.h"
#include "store/model.h"
#include "toolkit/group.h"
#include "toolkit/routes.h"

/* A model of another kind is a problem that says who takes it. */
static bool check_kind(struct process_inputs *inputs, const char *kind,
                       const struct store_model *model)
{
    bool classifier = strcmp(model_kind(model), "classifier") == 0;
    bool wanted = kind && strcmp(kind, "classifier") == 0;

    if (classifier == wanted) {
        return true;
    }
    problem_add(inputs->list, "/inputs/model",
                classifier ? "is a classifier, made by train, which predict takes; here a model of "
                             "principal components is needed, made by pca"
                           : "is a model of principal components, made by pca; here a classifier "
                             "is needed, made by train");
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

json_t *model_keep_surfaces(struct jobs_run *run, const char *process,
                            const struct compute_model *model,
                            const struct compute_reconstruction *points,
                            const char (*names)[MODEL_NAME_MAX], struct jobs_result *result)
{
    size_t degree = (size_t)model->stored.lmax, count = 3 * srnf_coefficient_count(degree);
    double scale = process_scale(run, model->stored.mean, 0.0);
    const char *mean = model->stored.mean, *route = routes_common(run, 1, &mean, NULL);
    json_t *records = json_array(), *record;

    for (size_t i = 0; i < points->n; i++) {
        struct surface_description description = {
            .name = names[i],
            .degree = degree,
            .coefficients = points->coefficients + i * count,
            .scale = scale,
            .measures = &points->measures[i],
            .parameterization = "inherited",
            .route = route,
            .source = process_source(run, process, NULL, model->stored.mean),
        };

        record = process_keep_surface(run, &description, "a surface of the model", result);
        if (!record) {
            json_decref(records);
            return NULL;
        }
        (void)json_array_append_new(records, record);
    }
    return records;
}
