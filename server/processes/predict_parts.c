/*
 * predict_parts.c - subjects of several structures that a classifier is asked about: named one by
 * one, with a surface for each part, or by a cohort whose members say which part they are.
 *
 * In canonical form surfaces has the members part after part, in the order of the model's parts,
 * and within a part subject after subject, in both cases. A cohort has subjectLabels beside its
 * labels, and in parts the names of these.
 */
#include "processes/predict.h"

#include <stdio.h>
#include <string.h>

#include "api/model_parts.h"
#include "processes/pca_parts.h"
#include "toolkit/routes.h"
#include "toolkit/subject.h"

#define POINTER_MAX 64
#define NAME_MAX_BYTES 60

/* ---- Inputs ---------------------------------------------------------------------------------- */

static bool is_given(const struct process_inputs *inputs, const char *name)
{
    const json_t *value = json_object_get(inputs->given, name);

    return value && !json_is_null(value);
}

static void read_surfaces(struct process_inputs *inputs, const struct process_input *input)
{
    static const char *const others[] = {"surfaces", "cohort"};
    char pointer[POINTER_MAX];

    if (!is_given(inputs, "parts")) {
        group_read_surfaces(inputs, input);
        return;
    }
    for (size_t i = 0; i < 2; i++) {
        if (is_given(inputs, others[i])) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/%s", others[i]);
            problem_add(inputs->list, pointer, "must be left out where parts is given");
        }
    }
    (void)json_object_set_new(inputs->canonical, "cohort", json_null());
}

/* The routes of its members are judged by complete, which knows whether they are compared. */
static void read_cohort(struct process_inputs *inputs, const struct process_input *input)
{
    json_t *cohort;

    if (is_given(inputs, "parts") || !is_given(inputs, "cohort") ||
        json_object_get(inputs->given, "surfaces")) {
        return;
    }
    group_read_members_apart(inputs, input);
    cohort = json_object_get(inputs->canonical, "cohort");
    (void)json_object_set(inputs->canonical, "surfaces", json_object_get(cohort, "surfaces"));
    (void)json_object_del(cohort, "surfaces");
}

static void read_list(struct process_inputs *inputs, json_t *value, json_t *canonical)
{
    char pointer[POINTER_MAX];

    for (size_t i = 0; i < json_array_size(value) && !inputs->answered; i++) {
        json_t *own;

        (void)snprintf(pointer, sizeof pointer, "/inputs/parts/%zu", i);
        own = subject_read_parts(inputs, json_array_get(value, i), pointer);
        if (own) {
            (void)json_array_append_new(canonical, own);
        }
    }
}

static void read_parts(struct process_inputs *inputs, const struct process_input *input)
{
    json_t *value = json_object_get(inputs->given, input->name);
    size_t count = json_array_size(value);
    json_t *canonical;

    if (!is_given(inputs, input->name)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
        return;
    }
    canonical = json_array();
    if (json_is_object(value)) {
        json_t *own = subject_read_parts(inputs, value, "/inputs/parts");

        (void)json_array_append_new(canonical, own ? own : json_null());
    } else if (json_is_array(value) && count >= 1 && count <= PROCESS_GROUP_MAX) {
        read_list(inputs, value, canonical);
    } else {
        problem_add(inputs->list, "/inputs/parts",
                    "must be an object, a surface for each name of a part, or a list of 1 to %d "
                    "such objects, one for each subject",
                    PROCESS_GROUP_MAX);
    }
    (void)json_object_set_new(inputs->canonical, input->name, canonical);
}

/* What is asked about stands in surfaces by now. */
static bool type_any(const json_t *value, void *member)
{
    (void)member;
    return value != NULL;
}

static void read_by(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(value);

    if (is_given(inputs, input->name) && (!text || !text[0] || strlen(text) > NAME_MAX_BYTES)) {
        problem_add(inputs->list, "/inputs/by", "must be null or the name of a covariate");
    }
    (void)json_object_set_new(inputs->canonical, input->name,
                              text ? json_string(text) : json_null());
}

const struct input_own predict_surfaces = {
    .schema = "\"type\":\"array\",\"minItems\":1,\"maxItems\":" PROCESS_TEXT(
        PROCESS_GROUP_MAX) ",\"items\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN
                           "\"}",
    .refers = true,
    .read = read_surfaces,
    .type = group_type_surfaces,
    .clear = group_input_clear,
};
const struct input_own predict_cohort = {
    .schema =
        "\"type\":[\"string\",\"null\"],\"pattern\":\"" COHORT_NAME_PATTERN "\",\"default\":null",
    .refers = true,
    .read = read_cohort,
    .type = group_type_cohort,
    .clear = group_input_clear,
};
#define PARTS_SCHEMA                                                                          \
    "\"minProperties\":1,\"maxProperties\":32,\"additionalProperties\":{\"type\":\"string\"," \
    "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}"
const struct input_own predict_parts = {
    .schema = "\"oneOf\":[{\"type\":[\"object\",\"null\"]," PARTS_SCHEMA
              "},{\"type\":\"array\",\"minItems\":1,\"items\":{\"type\":\"object\"," PARTS_SCHEMA
              "}}],\"default\":null",
    .refers = true,
    .read = read_parts,
    .type = type_any,
};
const struct input_own predict_by = {
    .schema = "\"type\":[\"string\",\"null\"],\"minLength\":1,\"maxLength\":60,\"default\":null",
    .read = read_by,
    .type = type_any,
};

/* ---- What holds between them ----------------------------------------------------------------- */

static void refuse_on(struct process_inputs *given, const char *name, const char *why)
{
    char pointer[POINTER_MAX];

    if (!json_is_null(json_object_get(given->canonical, name))) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s", name);
        problem_add(given->list, pointer, "must be left out: %s", why);
    }
}

/* The label that the members of each subject have; those of one are the same or missing. */
static void set_labels(struct process_inputs *given, size_t n)
{
    json_t *cohort = json_object_get(given->canonical, "cohort");
    const json_t *labels = json_object_get(cohort, "labels");
    json_t *own = json_array();

    for (size_t i = 0; i < n; i++) {
        json_t *known = json_null();

        for (size_t m = i; m < json_array_size(labels); m += n) {
            json_t *label = json_array_get(labels, m);

            if (json_is_string(label) && json_is_string(known) && !json_equal(label, known)) {
                const json_t *subject = json_array_get(json_object_get(cohort, "subjects"), i);

                problem_add(given->list, "/inputs/cohort",
                            "subject \"%.60s\" has members of different labels: give all its "
                            "parts one, or others of them another subject",
                            json_string_value(subject));
            }
            known = json_is_string(label) ? label : known;
        }
        (void)json_array_append(own, known);
    }
    (void)json_object_set_new(cohort, "subjectLabels", own);
}

/* The members of the cohort part after part; false with a problem noted or answered. */
static bool sort_cohort(struct process_inputs *given, const json_t *names)
{
    json_t *cohort = json_object_get(given->canonical, "cohort");

    if (json_is_null(json_object_get(given->canonical, "by"))) {
        (void)json_object_set_new(given->canonical, "by", json_string("part"));
    }
    (void)json_object_set(cohort, "surfaces", json_object_get(given->canonical, "surfaces"));
    pca_parts_sort(given, names);
    (void)json_object_set(given->canonical, "surfaces", json_object_get(cohort, "surfaces"));
    (void)json_object_del(cohort, "surfaces");
    (void)json_object_set_new(cohort, "parts", json_copy((json_t *)(uintptr_t)names));
    if (given->answered || given->list->errors) {
        return false;
    }
    set_labels(given, json_array_size(json_object_get(given->canonical, "surfaces")) /
                          json_array_size(names));
    return !given->list->errors;
}

/* Whether each subject has the parts and no others. */
static bool check_subjects(struct process_inputs *given, const json_t *names)
{
    const json_t *subjects = json_object_get(given->canonical, "parts");
    bool one = json_is_object(json_object_get(given->given, "parts"));
    size_t n = json_array_size(subjects);

    if (n * json_array_size(names) > PROCESS_GROUP_MAX) {
        problem_add(given->list, "/inputs/parts", "has %zu surfaces; it must have from 1 to %d",
                    n * json_array_size(names), PROCESS_GROUP_MAX);
    }
    for (size_t i = 0; i < n; i++) {
        char pointer[POINTER_MAX] = "/inputs/parts";

        if (!one) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/parts/%zu", i);
        }
        subject_check_names(given, names, json_array_get(subjects, i), pointer);
    }
    return !given->list->errors;
}

/* The same of subjects that are named one by one. */
static bool sort_subjects(struct process_inputs *given, const json_t *names)
{
    const json_t *subjects = json_object_get(given->canonical, "parts");
    json_t *surfaces;
    bool good = true;

    refuse_on(given, "by", "it names the parts of a cohort");
    if (!check_subjects(given, names)) {
        return false;
    }
    surfaces = json_array();
    for (size_t p = 0; p < json_array_size(names) && good; p++) {
        const char *name = json_string_value(json_array_get(names, p));
        json_t *own = json_array();

        for (size_t i = 0; i < json_array_size(subjects); i++) {
            (void)json_array_append(own, json_object_get(json_array_get(subjects, i), name));
        }
        (void)json_array_extend(surfaces, own);
        good = inputs_routes(given, own);
        json_decref(own);
    }
    (void)json_object_set_new(given->canonical, "surfaces", surfaces);
    return good;
}

/* Of a classifier of one structure. */
static bool check_one(struct process_inputs *given)
{
    const json_t *surfaces = json_object_get(given->canonical, "surfaces");

    refuse_on(given, "parts", "the classifier is of one structure, and needs surfaces or a cohort");
    refuse_on(given, "by", "the classifier is of one structure");
    return !given->list->errors && (!json_is_object(json_object_get(given->canonical, "cohort")) ||
                                    inputs_routes(given, surfaces));
}

bool predict_check_parts(struct process_inputs *given, const struct store_model *model)
{
    json_t *names = model_part_names(model);
    char text[MODEL_NAMES_MAX];
    struct compute_joint joint;
    bool good = false;

    if (!model_joint(model, &joint)) {
        (void)problem_respond_store(given->call, STORE_CORRUPT, "no-such-model", model->id);
        given->answered = true;
    } else if (json_array_size(names) == 0) {
        good = check_one(given);
    } else if (!json_is_null(json_object_get(given->canonical, "parts"))) {
        good = sort_subjects(given, names);
    } else if (json_is_object(json_object_get(given->canonical, "cohort"))) {
        good = sort_cohort(given, names);
    } else {
        problem_add(
            given->list, "/inputs/surfaces",
            "are single surfaces: the classifier is of several structures, and needs parts, "
            "a surface for each of %s, or a cohort",
            model_names_text(names, text));
    }
    json_decref(names);
    return good;
}

/* ---- Running --------------------------------------------------------------------------------- */

static json_t *first(const json_t *all, size_t n)
{
    json_t *list = json_array();

    for (size_t i = 0; i < n && json_is_array(all); i++) {
        (void)json_array_append(list, json_array_get(all, i));
    }
    return list;
}

struct group_input predict_subjects(const struct group_input *group, size_t n_parts)
{
    static const char *const arrays[] = {"subjects", "mirrored"};
    struct group_input view = *group;
    const json_t *labels = json_object_get(group->cohort, "subjectLabels");

    view.n = group->n / n_parts;
    if (n_parts == 1 && !labels) {
        (void)json_incref(view.surfaces);
        (void)json_incref(view.cohort);
        return view;
    }
    view.surfaces = first(group->surfaces, view.n);
    view.cohort = group->cohort ? json_object() : NULL;
    if (view.cohort) {
        (void)json_object_set_new(view.cohort, "labels", first(labels, view.n));
    }
    for (size_t k = 0; k < 2 && view.cohort; k++) {
        (void)json_object_set_new(view.cohort, arrays[k],
                                  first(json_object_get(group->cohort, arrays[k]), view.n));
    }
    return view;
}

int predict_place(struct jobs_run *run, const struct group_input *group, const struct kept *kept,
                  struct predict_answer *answer, struct jobs_result *result)
{
    const struct compute_joint *joint = &kept->model.joint;

    if (!(joint->position_weight > 0.0)) {
        return 0;
    }
    answer->positions =
        pca_parts_positions(run, group, answer->n, joint->n_parts, &answer->group, result);
    return answer->positions ? 0 : -1;
}

json_t *predict_parts_json(const struct group_input *group, const struct kept *kept,
                           const struct srnf_class_prediction *prediction, size_t i)
{
    json_t *parts = kept->parts ? json_array() : json_null();

    for (size_t p = 0; p < json_array_size(kept->parts); p++) {
        const struct srnf_part_prediction *own = &prediction->parts[p];

        (void)json_array_append_new(
            parts, json_pack("{s:O, s:s, s:o, s:o}", "name",
                             json_object_get(json_array_get(kept->parts, p), "name"), "surface",
                             group->ids[p * group->n + i], "distance", json_finite(own->distance),
                             "residual", json_finite(own->residual)));
    }
    return parts;
}

json_t *predict_position_json(const struct kept *kept,
                              const struct srnf_class_prediction *prediction)
{
    return kept->model.joint.position_weight > 0.0
               ? json_pack("{s:o, s:o}", "distance", json_finite(prediction->position.distance),
                           "residual", json_finite(prediction->position.residual))
               : json_null();
}
