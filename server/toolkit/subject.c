/*
 * subject.c - see subject.h.
 */
#include "toolkit/subject.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/model_parts.h"
#include "api/models.h"
#include "toolkit/positions.h"

#define NAME_MAX_BYTES 60

/* ---- Inputs ---------------------------------------------------------------------------------- */

json_t *subject_read_parts(struct process_inputs *inputs, json_t *value, const char *at)
{
    json_t *canonical, *surface;
    const char *name;
    long degree;

    if (!json_is_object(value) || json_object_size(value) == 0 ||
        json_object_size(value) > SRNF_PARTS_MAX) {
        problem_add(inputs->list, at,
                    "must be an object of 1 to %d members: a surface for each name of a part",
                    (int)SRNF_PARTS_MAX);
        return NULL;
    }
    canonical = json_object();
    json_object_foreach(value, name, surface)
    {
        char pointer[2 * NAME_MAX_BYTES];
        const char *id;

        problem_point(at, name, pointer, sizeof pointer);
        id = inputs_surface_at(inputs, surface, pointer, &degree);
        if (id) {
            (void)json_object_set_new(canonical, name, json_string(id));
        }
    }
    return canonical;
}

static void read_parts(struct process_inputs *inputs, const struct process_input *input)
{
    json_t *value = json_object_get(inputs->given, input->name);
    bool given = value && !json_is_null(value);
    json_t *canonical = given ? subject_read_parts(inputs, value, "/inputs/parts") : json_null();

    if (canonical) {
        (void)json_object_set_new(inputs->canonical, input->name, canonical);
    }
}

static bool type_parts(const json_t *value, void *member)
{
    json_t **parts = member;

    *parts = json_is_object(value) ? json_deep_copy(value) : NULL;
    return *parts || json_is_null(value);
}

static void clear_parts(void *member)
{
    json_t **parts = member;

    json_decref(*parts);
    *parts = NULL;
}

const struct input_own subject_parts = {
    .schema = "\"type\":[\"object\",\"null\"],\"minProperties\":1,\"maxProperties\":32,"
              "\"additionalProperties\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN
              "\"},\"default\":null",
    .refers = true,
    .read = read_parts,
    .type = type_parts,
    .clear = clear_parts,
};

/* ---- What holds between them ----------------------------------------------------------------- */

void subject_check_names(struct process_inputs *given, const json_t *names, json_t *parts,
                         const char *at)
{
    char text[MODEL_NAMES_MAX];
    const char *name;
    json_t *id;

    for (size_t p = 0; p < json_array_size(names); p++) {
        const char *wanted = json_string_value(json_array_get(names, p));

        if (wanted && !json_object_get(parts, wanted)) {
            problem_add(given->list, at,
                        "has no \"%.60s\": the model's parts are %s, and each is needed", wanted,
                        model_names_text(names, text));
        }
    }
    json_object_foreach(parts, name, id)
    {
        if (model_name_find(names, name) == json_array_size(names)) {
            problem_add(given->list, at, "has \"%.60s\", which is none of the model's parts: %s",
                        name, model_names_text(names, text));
        }
    }
}

void subject_check(struct process_inputs *given)
{
    const char *id = json_string_value(json_object_get(given->canonical, "model"));
    json_t *parts = json_object_get(given->canonical, "parts"), *names;
    bool has_parts = json_is_object(parts);
    bool has_surface = json_is_string(json_object_get(given->canonical, "surface"));
    struct store_model model = {.record = NULL};
    char text[MODEL_NAMES_MAX];

    if (!id || store_model_get_as(given->call->api->config.store, given->call->request->caller.name,
                                  id, 0, &model)) {
        return;
    }
    names = model_part_names(&model);
    if (json_array_size(names) > 0 && has_parts) {
        subject_check_names(given, names, parts, "/inputs/parts");
    } else if (json_array_size(names) > 0) {
        problem_add(given->list, has_surface ? "/inputs/surface" : "/inputs/parts",
                    "%s: the model is of several structures, and needs parts, a surface for each "
                    "of %s",
                    has_surface ? "is one surface" : "is required", model_names_text(names, text));
    } else if (has_parts) {
        problem_add(given->list, "/inputs/parts",
                    "must be left out: the model is of one structure, and needs surface");
    } else if (!has_surface) {
        problem_add(given->list, "/inputs/surface", "is required: the id of a surface or a mesh");
    }
    json_decref(names);
    store_model_clear(&model);
}

/* ---- Running --------------------------------------------------------------------------------- */

bool subject_open(const struct subject_input *subject, const struct compute_model *model,
                  struct compute_projected *projected, struct jobs_result *result)
{
    json_t *names = model_part_names(&model->stored), *made = model_made_from(&model->stored);

    *projected = (struct compute_projected){.surfaces = {subject->surface},
                                            .mesh_degree = model_mesh_degree(&model->stored, made),
                                            .place = positions_find};
    json_decref(made);
    for (size_t p = 0; p < json_array_size(names); p++) {
        const char *name = json_string_value(json_array_get(names, p));

        projected->surfaces[p] = json_string_value(json_object_get(subject->parts, name));
        if (!projected->surfaces[p]) {
            (void)compute_fail(result, SRNF_EINVAL, NULL, "reading the parts");
            json_decref(names);
            return false;
        }
    }
    json_decref(names);
    return true;
}

/* ---- Results --------------------------------------------------------------------------------- */

void subject_set_parts(json_t *document, const struct subject_input *subject,
                       const struct compute_model *model,
                       const struct compute_projection *projection)
{
    json_t *names = model_part_names(&model->stored);
    size_t n = json_array_size(names);
    const struct compute_contribution *position = &projection->parts[n];
    json_t *parts = n > 0 ? json_array() : json_null();

    for (size_t p = 0; p < n; p++) {
        const struct compute_contribution *own = &projection->parts[p];
        json_t *name = json_array_get(names, p);

        (void)json_array_append_new(
            parts,
            json_pack("{s:O, s:O, s:o, s:o, s:o, s:o}", "name", name, "surface",
                      json_object_get(subject->parts, json_string_value(name)), "distance",
                      json_finite(own->distance), "distanceBefore",
                      json_finite(own->distance_before), "residual", json_finite(own->residual),
                      "mahalanobisShare", json_finite(own->share)));
    }
    (void)json_object_set_new(document, "parts", parts);
    (void)json_object_set_new(document, "position",
                              model->joint.position_weight > 0.0
                                  ? json_pack("{s:o, s:o, s:o}", "distance",
                                              json_finite(position->distance), "residual",
                                              json_finite(position->residual), "mahalanobisShare",
                                              json_finite(position->share))
                                  : json_null());
    json_decref(names);
}
