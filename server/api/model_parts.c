/*
 * model_parts.c - see model_parts.h.
 */
#include "api/model_parts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static bool read_part(const json_t *part, struct compute_joint *joint, size_t p)
{
    const char *mean = json_string_value(json_object_get(part, "mean"));

    joint->weights[p] = json_number_value(json_object_get(part, "weight"));
    if (!mean || strlen(mean) >= sizeof joint->means[p] ||
        !json_is_string(json_object_get(part, "name"))) {
        return false;
    }
    (void)snprintf(joint->means[p], sizeof joint->means[p], "%s", mean);
    return joint->weights[p] > 0.0 && isfinite(joint->weights[p]);
}

bool model_joint(const struct store_model *model, struct compute_joint *joint)
{
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    const json_t *parts = json_object_get(record, "parts");
    const json_t *positions = json_object_get(record, "positions");
    size_t n = json_array_size(parts);
    bool good = n <= SRNF_PARTS_MAX;

    *joint = compute_joint_of_one(model);
    if (n > 0 && good) {
        *joint = (struct compute_joint){.n_parts = n};
        joint->position_weight = json_number_value(json_object_get(positions, "weight"));
        good = joint->position_weight >= 0.0 && isfinite(joint->position_weight) &&
               compute_joint_rows(joint, model) > 0;
    }
    for (size_t p = 0; p < n && good; p++) {
        good = read_part(json_array_get(parts, p), joint, p);
    }
    good = good && (n == 0 || strcmp(joint->means[0], model->mean) == 0);
    json_decref(record);
    return good;
}

const char *model_template(const json_t *record, size_t part)
{
    const json_t *parts = json_object_get(record, "parts");
    const json_t *holder = json_array_size(parts) > 0 ? json_array_get(parts, part)
                                                      : json_object_get(record, "classifier");

    return json_string_value(json_object_get(json_object_get(holder, "template"), "surface"));
}

json_t *model_part_names(const struct store_model *model)
{
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    json_t *names = json_array(), *part;
    size_t i;

    json_array_foreach(json_object_get(record, "parts"), i, part)
    {
        json_t *name = json_object_get(part, "name");

        (void)json_array_append(names, json_is_string(name) ? name : json_null());
    }
    json_decref(record);
    return names;
}

const char *model_names_text(const json_t *names, char text[MODEL_NAMES_MAX])
{
    size_t length = 0, i;
    json_t *name;

    text[0] = '\0';
    json_array_foreach(names, i, name)
    {
        if (length < MODEL_NAMES_MAX) {
            length += (size_t)snprintf(text + length, MODEL_NAMES_MAX - length, "%s\"%.60s\"",
                                       i ? ", " : "", json_string_value(name));
        }
    }
    return text;
}

size_t model_name_find(const json_t *names, const char *name)
{
    size_t i = 0;

    while (i < json_array_size(names)) {
        const char *own = json_string_value(json_array_get(names, i));

        if (own && strcmp(own, name) == 0) {
            break;
        }
        i++;
    }
    return i;
}

static bool refuse(struct api_call *call, const char *what, const json_t *names)
{
    struct problem_list list = {.errors = NULL};
    char text[MODEL_NAMES_MAX];

    problem_add(&list, "/part", "%s%s", what, model_names_text(names, text));
    (void)problem_respond_list(call, "invalid-input", &list);
    return false;
}

bool model_choose_part(struct api_call *call, struct store_model *model, struct model_part *part)
{
    json_t *names = model_part_names(model);
    struct compute_joint joint;
    bool refused = false, good = false, given;

    *part = (struct model_part){.index = 0};
    given = query_get(call, "part", part->name, sizeof part->name, &refused);
    part->index = given ? model_name_find(names, part->name) : 0;
    if (refused) {
        good = false;
    } else if (json_array_size(names) == 0) {
        good = !given || refuse(call, "must be left out: the model is of one structure", names);
    } else if (!given || part->index == json_array_size(names)) {
        (void)refuse(call,
                     given ? "is none of the model's parts: "
                           : "is required: the model is of several structures: ",
                     names);
    } else if (!model_joint(model, &joint)) {
        (void)problem_respond_store(call, STORE_CORRUPT, "no-such-model", model->id);
    } else if (compute_joint_take(&joint, part->index, model)) {
        (void)problem_respond_store(call, STORE_NOMEM, "", "");
    } else {
        good = true;
    }
    json_decref(names);
    return good;
}
