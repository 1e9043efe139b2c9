/*
 * group_landmarks_inputs.c - reading the input "landmarks" of a group.
 *
 * Canonical: null, or an object with vertices or points, weight ("exact" or a number) and heldOut,
 * in rising order.
 */
#include "text.h"
#include "toolkit/group_landmarks.h"

#include <math.h>
#include <stdio.h>

#define POINTER "/inputs/landmarks"

/* ---- Reading --------------------------------------------------------------------------------- */

/* One list of vertices (new reference), or NULL with a problem noted. */
static json_t *read_vertices(struct process_inputs *inputs, const json_t *value)
{
    json_t *points = landmarks_read_points(inputs, value, "vertices");

    for (size_t i = 0; i < json_array_size(points); i++) {
        if (!json_is_integer(json_array_get(points, i))) {
            problem_add(inputs->list, POINTER "/vertices",
                        "must be numbers of vertices: positions differ from member to member, and "
                        "are given as points");
            json_decref(points);
            return NULL;
        }
    }
    return points;
}

/* A list of points for each member (new reference), or NULL with a problem noted. */
static json_t *read_lists(struct process_inputs *inputs, const json_t *value)
{
    json_t *lists = json_array();

    if (!json_is_array(value) || json_array_size(value) > PROCESS_LARGE_GROUP_MAX ||
        json_array_size(value) == 0) {
        problem_add(inputs->list, POINTER "/points", "must be a list of points for each member");
        json_decref(lists);
        return NULL;
    }
    for (size_t i = 0; i < json_array_size(value); i++) {
        char name[32];
        json_t *points;

        (void)snprintf(name, sizeof name, "points/%zu", i);
        points = landmarks_read_points(inputs, json_array_get(value, i), name);
        if (points && json_array_size(points) != json_array_size(json_array_get(value, 0))) {
            char pointer[64];

            (void)snprintf(pointer, sizeof pointer, POINTER "/%s", name);
            problem_add(inputs->list, pointer, "has %zu point%s, and the list before all has %zu",
                        json_array_size(points), plural(json_array_size(points)),
                        json_array_size(json_array_get(value, 0)));
            json_decref(points);
            points = NULL;
        }
        if (!points) {
            json_decref(lists);
            return NULL;
        }
        (void)json_array_append_new(lists, points);
    }
    return lists;
}

static bool knows_members(const json_t *value)
{
    static const char *const names[] = {"vertices", "points", "weight", "heldOut"};
    size_t known = 0;

    for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
        known += json_object_get(value, names[k]) != NULL;
    }
    return known == json_object_size(value);
}

static void read_landmarks(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const json_t *vertices = json_object_get(value, "vertices");
    json_t *lists, *weight, *held = NULL;

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
        return;
    }
    if (!json_is_object(value) || !knows_members(value) ||
        !vertices == !json_object_get(value, "points")) {
        problem_add(inputs->list, POINTER,
                    "must be an object with either vertices or points, and, if you like, weight "
                    "and heldOut");
        return;
    }
    lists = vertices ? read_vertices(inputs, vertices)
                     : read_lists(inputs, json_object_get(value, "points"));
    weight = landmarks_read_weight(inputs, json_object_get(value, "weight"));
    if (lists) {
        held =
            landmarks_read_held_out(inputs, json_object_get(value, "heldOut"),
                                    json_array_size(vertices ? lists : json_array_get(lists, 0)));
    }
    if (held && weight) {
        (void)json_object_set_new(inputs->canonical, input->name,
                                  json_pack("{s:O, s:O, s:O}", vertices ? "vertices" : "points",
                                            lists, "weight", weight, "heldOut", held));
    }
    json_decref(lists);
    json_decref(weight);
    json_decref(held);
}

/* ---- Typed ----------------------------------------------------------------------------------- */

static bool type_landmarks(const json_t *value, void *member)
{
    struct group_landmarks_input *input = member;
    json_t *vertices = json_object_get(value, "vertices");
    const json_t *weight = json_object_get(value, "weight");
    const json_t *held = json_object_get(value, "heldOut");

    *input = (struct group_landmarks_input){.n = 0};
    if (!json_is_object(value)) {
        return true;
    }
    input->points =
        vertices ? json_pack("[O]", vertices) : json_incref(json_object_get(value, "points"));
    input->n = json_array_size(json_array_get(input->points, 0));
    input->weight = json_is_string(weight) ? INFINITY : json_number_value(weight);
    for (size_t i = 0; i < json_array_size(held); i++) {
        input->held_out[json_integer_value(json_array_get(held, i))] = true;
    }
    return input->points != NULL;
}

static void clear_landmarks(void *member)
{
    struct group_landmarks_input *input = member;

    json_decref(input->points);
    *input = (struct group_landmarks_input){.n = 0};
}

const struct input_own group_landmarks_own = {
    .schema = "\"type\":[\"object\",\"null\"],\"default\":null,\"additionalProperties\":false,"
              "\"properties\":{\"vertices\":{\"type\":\"array\",\"minItems\":1,"
              "\"maxItems\":" PROCESS_TEXT(
                  LANDMARKS_GIVEN_MAX) ",\"items\":{\"type\":\"integer\","
                                       "\"minimum\":0}},\"points\":{\"type\":\"array\","
                                       "\"minItems\":1,\"items\":" LANDMARKS_POINTS_SCHEMA
                                       "}," LANDMARKS_MORE_SCHEMA "}",
    .read = read_landmarks,
    .type = type_landmarks,
    .clear = clear_landmarks,
};

/* ---- What they ask of the other inputs ------------------------------------------------------- */

static const json_t *group_of(const struct process_inputs *inputs)
{
    const json_t *surfaces = json_object_get(inputs->canonical, "surfaces");

    return json_is_array(surfaces)
               ? surfaces
               : json_object_get(json_object_get(inputs->canonical, "cohort"), "surfaces");
}

/* The list of one member, and its name. */
static const json_t *list_of(const json_t *landmarks, size_t i, char name[32])
{
    const json_t *vertices = json_object_get(landmarks, "vertices");

    if (vertices) {
        (void)snprintf(name, 32, "vertices");
        return vertices;
    }
    (void)snprintf(name, 32, "points/%zu", i);
    return json_array_get(json_object_get(landmarks, "points"), i);
}

static void check_members(struct process_inputs *inputs, const json_t *landmarks)
{
    const json_t *surfaces = group_of(inputs);
    const json_t *mirrored =
        json_object_get(json_object_get(inputs->canonical, "cohort"), "mirrored");

    for (size_t i = 0; i < json_array_size(surfaces) && !inputs->answered; i++) {
        char name[32], whose[48];

        (void)snprintf(whose, sizeof whose, "member %zu", i);
        if (json_is_true(json_array_get(mirrored, i))) {
            problem_add(inputs->list, POINTER,
                        "cannot be given where members are taken mirrored, as %s is: encode their "
                        "mirror images first, and give positions in those",
                        whose);
            return;
        }
        landmarks_check_vertices(inputs, list_of(landmarks, i, name), name,
                                 json_string_value(json_array_get(surfaces, i)), whose);
        if (inputs->list->errors) {
            return; /* the first member is enough */
        }
    }
}

void group_landmarks_complete(struct process_inputs *inputs)
{
    const json_t *landmarks = json_object_get(inputs->canonical, "landmarks");
    const json_t *points = json_object_get(landmarks, "points");
    size_t n = json_array_size(group_of(inputs));

    if (!json_is_object(landmarks)) {
        return;
    }
    landmarks_exclude(inputs, "register", false);
    if (points && json_array_size(points) != n) {
        problem_add(inputs->list, POINTER "/points", "has %zu list%s for %zu members",
                    json_array_size(points), plural(json_array_size(points)), n);
        return;
    }
    check_members(inputs, landmarks);
}
