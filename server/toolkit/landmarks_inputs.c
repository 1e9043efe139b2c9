/*
 * landmarks_inputs.c - reading the input "landmarks".
 *
 * Canonical: null, or an object with both lists, weight ("exact" or a number) and heldOut, in
 * rising order. Vertices are whole numbers, positions three real ones.
 */
#include "toolkit/landmarks.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/auth.h"
#include "store/mesh.h"
#include "store/surface.h"
#include "text.h"

#define POINTER "/inputs/landmarks"
#define VERTEX_MAX 2147483647

_Static_assert(LANDMARKS_GIVEN_MAX == SRNF_LANDMARKS_MAX, "as many as the core takes");

/* ---- Reading --------------------------------------------------------------------------------- */

/* One point in canonical form (new reference), or NULL. */
static json_t *read_point(const json_t *value)
{
    json_t *position;

    if (json_is_integer(value)) {
        json_int_t vertex = json_integer_value(value);

        return vertex >= 0 && vertex <= VERTEX_MAX ? json_integer(vertex) : NULL;
    }
    if (!json_is_array(value) || json_array_size(value) != 3) {
        return NULL;
    }
    position = json_array();
    for (size_t c = 0; c < 3; c++) {
        const json_t *x = json_array_get(value, c);
        double number = json_number_value(x);

        if (!json_is_number(x) || !(fabs(number) <= PROCESS_COORDINATE_MAX)) {
            json_decref(position);
            return NULL;
        }
        (void)json_array_append_new(position, json_real(number + 0.0));
    }
    return position;
}

json_t *landmarks_read_points(struct process_inputs *inputs, const json_t *value, const char *name)
{
    char pointer[64];
    json_t *points;

    (void)snprintf(pointer, sizeof pointer, POINTER "/%s", name);
    if (!json_is_array(value) || json_array_size(value) < 1 ||
        json_array_size(value) > LANDMARKS_GIVEN_MAX) {
        problem_add(inputs->list, pointer, "must be a list of 1 to %d points", LANDMARKS_GIVEN_MAX);
        return NULL;
    }
    points = json_array();
    for (size_t i = 0; i < json_array_size(value); i++) {
        json_t *point = read_point(json_array_get(value, i));

        if (!point) {
            (void)snprintf(pointer, sizeof pointer, POINTER "/%s/%zu", name, i);
            problem_add(inputs->list, pointer,
                        "must be the number of a vertex, from 0, or a position [x, y, z] of "
                        "numbers up to %g in size",
                        (double)PROCESS_COORDINATE_MAX);
            json_decref(points);
            return NULL;
        }
        for (size_t k = 0; k < i; k++) {
            if (json_equal(json_array_get(points, k), point)) {
                (void)snprintf(pointer, sizeof pointer, POINTER "/%s/%zu", name, i);
                problem_add(inputs->list, pointer,
                            "is the same point as landmark %zu: landmarks must not coincide", k);
            }
        }
        (void)json_array_append_new(points, point);
    }
    return points;
}

json_t *landmarks_read_weight(struct process_inputs *inputs, const json_t *value)
{
    const char *text = json_string_value(value);
    double number = json_number_value(value);

    if (!value || (text && strcmp(text, "exact") == 0)) {
        return json_string("exact");
    }
    if (json_is_number(value) && number > 0.0 && number <= LANDMARKS_WEIGHT_MAX) {
        return json_real(number);
    }
    problem_add(inputs->list, POINTER "/weight", "must be exact, or a number above 0 and up to %d",
                LANDMARKS_WEIGHT_MAX);
    return NULL;
}

json_t *landmarks_read_held_out(struct process_inputs *inputs, const json_t *value, size_t n)
{
    bool held[LANDMARKS_GIVEN_MAX] = {false};
    json_t *list;

    if (value && !json_is_array(value)) {
        problem_add(inputs->list, POINTER "/heldOut", "must be a list of numbers of landmarks");
        return NULL;
    }
    for (size_t i = 0; i < json_array_size(value); i++) {
        const json_t *item = json_array_get(value, i);
        json_int_t number = json_integer_value(item);

        if (!json_is_integer(item) || number < 0 || number >= (json_int_t)n || held[number]) {
            problem_add(inputs->list, POINTER "/heldOut",
                        "must have numbers of landmarks, 0 to %zu, each once", n ? n - 1 : 0);
            return NULL;
        }
        held[number] = true;
    }
    list = json_array();
    for (size_t i = 0; i < n; i++) {
        if (held[i]) {
            (void)json_array_append_new(list, json_integer((json_int_t)i));
        }
    }
    return list;
}

/* Whether it has no members but those. */
static bool knows_members(const json_t *value, const char *const names[2])
{
    size_t known = 0;

    known += json_object_get(value, names[0]) != NULL;
    known += json_object_get(value, names[1]) != NULL;
    known += json_object_get(value, "weight") != NULL;
    known += json_object_get(value, "heldOut") != NULL;
    return known == json_object_size(value);
}

static json_t *read_members(struct process_inputs *inputs, const json_t *value,
                            const char *const names[2])
{
    json_t *lists[2] = {landmarks_read_points(inputs, json_object_get(value, names[0]), names[0]),
                        landmarks_read_points(inputs, json_object_get(value, names[1]), names[1])};
    json_t *weight = landmarks_read_weight(inputs, json_object_get(value, "weight"));
    json_t *held = NULL, *all = NULL;

    if (lists[0] && lists[1] && json_array_size(lists[0]) != json_array_size(lists[1])) {
        problem_add(inputs->list, POINTER, "has %zu point%s of %s and %zu of %s: they correspond",
                    json_array_size(lists[0]), plural(json_array_size(lists[0])), names[0],
                    json_array_size(lists[1]), names[1]);
    } else if (lists[0] && lists[1]) {
        held = landmarks_read_held_out(inputs, json_object_get(value, "heldOut"),
                                       json_array_size(lists[0]));
    }
    if (held && weight) {
        all = json_pack("{s:O, s:O, s:O, s:O}", names[0], lists[0], names[1], lists[1], "weight",
                        weight, "heldOut", held);
    }
    json_decref(lists[0]);
    json_decref(lists[1]);
    json_decref(weight);
    json_decref(held);
    return all;
}

static void read_landmarks(struct process_inputs *inputs, const char *const names[2])
{
    const json_t *value = json_object_get(inputs->given, "landmarks");
    json_t *canonical;

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(inputs->canonical, "landmarks", json_null());
        return;
    }
    if (!json_is_object(value) || !knows_members(value, names)) {
        problem_add(inputs->list, POINTER,
                    "must be an object with %s and %s, and, if you like, weight and heldOut",
                    names[0], names[1]);
        return;
    }
    canonical = read_members(inputs, value, names);
    if (canonical) {
        (void)json_object_set_new(inputs->canonical, "landmarks", canonical);
    }
}

/* ---- Typed ----------------------------------------------------------------------------------- */

static bool type_landmarks(const json_t *value, const char *const names[2],
                           struct landmarks_input *input)
{
    const json_t *weight = json_object_get(value, "weight");
    const json_t *held = json_object_get(value, "heldOut");

    *input = (struct landmarks_input){.names = {names[0], names[1]}};
    for (size_t end = 0; end < 2 && json_is_object(value); end++) {
        input->ends[end] = json_incref(json_object_get(value, names[end]));
    }
    input->n = json_array_size(input->ends[0]);
    input->weight = json_is_string(weight) ? INFINITY : json_number_value(weight);
    for (size_t i = 0; i < json_array_size(held); i++) {
        input->held_out[json_integer_value(json_array_get(held, i))] = true;
    }
    return true;
}

static void clear_landmarks(void *member)
{
    struct landmarks_input *input = member;

    json_decref(input->ends[0]);
    json_decref(input->ends[1]);
    *input = (struct landmarks_input){.n = 0};
}

static const char *const of_register[2] = {"template", "moving"};
static const char *const of_geodesic[2] = {"from", "to"};

static void read_of_register(struct process_inputs *inputs, const struct process_input *input)
{
    (void)input;
    read_landmarks(inputs, of_register);
}

static bool type_of_register(const json_t *value, void *member)
{
    return type_landmarks(value, of_register, member);
}

static void read_of_geodesic(struct process_inputs *inputs, const struct process_input *input)
{
    (void)input;
    read_landmarks(inputs, of_geodesic);
}

static bool type_of_geodesic(const json_t *value, void *member)
{
    return type_landmarks(value, of_geodesic, member);
}

#define LANDMARKS_SCHEMA(first, second)                                               \
    "\"type\":[\"object\",\"null\"],\"default\":null,\"additionalProperties\":false," \
    "\"required\":[\"" first "\",\"" second "\"],\"properties\":{\"" first            \
    "\":" LANDMARKS_POINTS_SCHEMA ",\"" second "\":" LANDMARKS_POINTS_SCHEMA          \
    "," LANDMARKS_MORE_SCHEMA "}"

const struct input_own landmarks_of_register = {
    .schema = LANDMARKS_SCHEMA("template", "moving"),
    .read = read_of_register,
    .type = type_of_register,
    .clear = clear_landmarks,
};

const struct input_own landmarks_of_geodesic = {
    .schema = LANDMARKS_SCHEMA("from", "to"),
    .read = read_of_geodesic,
    .type = type_of_geodesic,
    .clear = clear_landmarks,
};

/* ---- What they ask of the other inputs ------------------------------------------------------- */

/* How many of the canonical landmarks guide the search. */
static size_t count_guiding(const json_t *landmarks, const char *name)
{
    return json_array_size(json_object_get(landmarks, name)) -
           json_array_size(json_object_get(landmarks, "heldOut"));
}

void landmarks_exclude(struct process_inputs *inputs, const char *name, bool value)
{
    const json_t *landmarks = json_object_get(inputs->canonical, "landmarks");
    const json_t *other = json_object_get(inputs->canonical, name);

    if (json_is_object(landmarks) && other && json_is_true(other) == value) {
        problem_add(inputs->list, POINTER, "cannot be given where %s is %s: no warp is sought %s",
                    name, value ? "true" : "false",
                    value ? "beyond the one that the surfaces differ by" : "then");
    }
}

/* The mesh whose vertices stand for points of a surface; false with the problem noted or answered.
   vertices: how many it has. */
static bool find_mesh(struct process_inputs *inputs, const char *id, const char *pointer,
                      int64_t *vertices)
{
    struct store *store = inputs->call->api->config.store;
    struct store_surface surface = {0};
    struct store_mesh mesh = {0};
    struct surface_place place = {.known = false};
    const char *of = id;
    int status = 0;

    if (!compute_is_mesh(id)) {
        status = store_surface_get(store, id, false, &surface);
        place = status ? place : surface_record_place(&surface);
        if (status == 0 && (!place.mesh[0] || surface_record_mirrored(&surface))) {
            problem_add(inputs->list, pointer,
                        "is a vertex, but %s %s: give positions in its coordinates instead", id,
                        place.mesh[0] ? "is a mirror image of its mesh" : "comes from no mesh");
            store_surface_clear(&surface);
            return false;
        }
        of = place.mesh;
    }
    status = status ? status : call_sees(inputs->call, of);
    status = status ? status : store_mesh_get(store, of, &mesh);
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-mesh", of);
        inputs->answered = true;
    }
    *vertices = mesh.vertices;
    store_mesh_clear(&mesh);
    store_surface_clear(&surface);
    return status == 0;
}

void landmarks_check_vertices(struct process_inputs *inputs, const json_t *points, const char *name,
                              const char *id, const char *whose)
{
    int64_t vertices = -1;

    for (size_t i = 0; id && i < json_array_size(points) && !inputs->answered; i++) {
        const json_t *point = json_array_get(points, i);
        char pointer[64];

        (void)snprintf(pointer, sizeof pointer, POINTER "/%s/%zu", name, i);
        if (!json_is_integer(point)) {
            continue;
        }
        if (vertices < 0 && !find_mesh(inputs, id, pointer, &vertices)) {
            return;
        }
        if (json_integer_value(point) >= vertices) {
            problem_add(inputs->list, pointer,
                        "is vertex %lld, and the mesh of %s has the vertices 0 to %lld",
                        (long long)json_integer_value(point), whose, (long long)vertices - 1);
        }
    }
}

/* One of the two lists against the mesh of its surface. */
static void check_end(struct process_inputs *inputs, const json_t *landmarks, const char *name)
{
    landmarks_check_vertices(inputs, json_object_get(landmarks, name), name,
                             json_string_value(json_object_get(inputs->canonical, name)), name);
}

void landmarks_complete(struct process_inputs *inputs, const char *first, const char *second,
                        long degree)
{
    const json_t *landmarks = json_object_get(inputs->canonical, "landmarks");
    long most = ((degree + 1) * (degree + 1) - 1) / 2;

    if (!json_is_object(landmarks)) {
        return;
    }
    if ((long)count_guiding(landmarks, first) > most) {
        problem_add(inputs->list, POINTER,
                    "has %zu points that guide the search: warps of degree %ld take %ld",
                    count_guiding(landmarks, first), degree, most);
    }
    check_end(inputs, landmarks, first);
    if (!inputs->answered) {
        check_end(inputs, landmarks, second);
    }
}
