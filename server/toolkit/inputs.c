/*
 * inputs.c - readers of inputs: each takes one member, checks it against its limits,
 * notes a problem with a JSON pointer or sets the canonical member.
 *
 * null is a value like any other, and refused where the schema does not list it: it means what
 * absence does only for inputs that may have no value (sphere, cohort, components and
 * maxIterations), which are null in the canonical inputs too.
 *
 * A reference to a mesh or surface is looked up in the store at once: a missing one answers 404 by
 * itself, a mesh that cannot be analysed 422 with the code of its first problem, and no job is
 * made.
 */
#include "toolkit/process.h"
#include "api/auth.h"
#include "api/near.h"
#include "store/mesh.h"
#include "store/surface.h"
#include "toolkit/scales.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define POINTER_MAX 160

static void pointer_to(char pointer[POINTER_MAX], const char *name)
{
    size_t n = (size_t)snprintf(pointer, POINTER_MAX, "/inputs/");

    /* RFC 6901: ~ and / are escaped. Names are the client's where they are unknown ones. */
    for (; *name && n < POINTER_MAX - 3; name++) {
        if (*name == '~' || *name == '/') {
            pointer[n++] = '~';
            pointer[n++] = *name == '~' ? '0' : '1';
        } else {
            pointer[n++] = *name;
        }
    }
    pointer[n] = '\0';
}

static const json_t *member(const struct process_inputs *inputs, const char *name)
{
    return json_object_get(inputs->given, name);
}

static void set(struct process_inputs *inputs, const char *name, json_t *value)
{
    (void)json_object_set_new(inputs->canonical, name, value);
}

static bool is_listed(const char *name, const char *const *names)
{
    for (size_t i = 0; names[i]; i++) {
        if (strcmp(names[i], name) == 0) {
            return true;
        }
    }
    return false;
}

bool inputs_open(struct process_inputs *inputs, struct api_call *call, const json_t *given,
                 struct problem_list *list, const char *const *names)
{
    /* jansson's iterators take an object that is not const; they do not change it. */
    json_t *object = (json_t *)(uintptr_t)given;
    char pointer[POINTER_MAX], sentence[NEAR_SENTENCE_MAX];

    *inputs = (struct process_inputs){.call = call, .given = given, .list = list};
    if (!json_is_object(given)) {
        problem_add(list, "/inputs", "must be an object");
        return false;
    }
    inputs->canonical = json_object();
    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        if (problem_list_full(list)) {
            break; /* a million names more would take seconds */
        }
        if (!is_listed(json_object_iter_key(at), names)) {
            pointer_to(pointer, json_object_iter_key(at));
            near_sentence(sentence, "this process has no such input", json_object_iter_key(at),
                          names);
            problem_add(list, pointer, "%s", sentence);
        }
    }
    return true;
}

json_t *inputs_canonical(struct process_inputs *inputs)
{
    json_decref(inputs->members);
    inputs->members = NULL;
    if (inputs->answered || inputs->list->errors || !inputs->canonical || !inputs_scales(inputs)) {
        json_decref(inputs->canonical);
        return NULL;
    }
    return inputs->canonical;
}

/* A whole number within [lowest, highest], or a problem; 3.0 is whole, as in JSON Schema. */
static bool whole_number(struct process_inputs *inputs, const char *name, const json_t *value,
                         long lowest, long highest, long *number)
{
    double real = json_number_value(value);
    char pointer[POINTER_MAX];

    pointer_to(pointer, name);
    if (!json_is_number(value) || floor(real) != real) {
        problem_add(inputs->list, pointer, "must be a whole number from %ld to %ld", lowest,
                    highest);
        return false;
    }
    if (!(real >= (double)lowest && real <= (double)highest)) {
        problem_add(inputs->list, pointer, "is %.17g; it must be from %ld to %ld", real, lowest,
                    highest);
        return false;
    }
    *number = (long)real;
    return true;
}

long inputs_integer(struct process_inputs *inputs, const char *name, long lowest, long highest,
                    long fallback)
{
    const json_t *value = member(inputs, name);
    long number = fallback;

    if (!value || whole_number(inputs, name, value, lowest, highest, &number)) {
        set(inputs, name, json_integer(number));
    }
    return number;
}

long inputs_integer_or_null(struct process_inputs *inputs, const char *name, long lowest,
                            long highest)
{
    const json_t *value = member(inputs, name);
    long number = 0;

    if (!value || json_is_null(value)) {
        set(inputs, name, json_null());
    } else if (whole_number(inputs, name, value, lowest, highest, &number)) {
        set(inputs, name, json_integer(number));
    }
    return number;
}

double inputs_real(struct process_inputs *inputs, const char *name, double lowest, double highest,
                   double fallback)
{
    const json_t *value = member(inputs, name);
    double number = value ? json_number_value(value) : fallback;
    char pointer[POINTER_MAX];

    pointer_to(pointer, name);
    if (value && !json_is_number(value)) {
        problem_add(inputs->list, pointer, "must be a number from %g to %g", lowest, highest);
        return fallback;
    }
    if (!(number >= lowest && number <= highest)) {
        problem_add(inputs->list, pointer, "is %.17g; it must be from %g to %g", number, lowest,
                    highest);
        return fallback;
    }
    /* + 0.0 turns -0 into 0, which means the same and must have the same digest. */
    set(inputs, name, json_real(number + 0.0));
    return number;
}

void inputs_numbers(struct process_inputs *inputs, const char *name, size_t most, double limit,
                    size_t n_fallback, const double *fallback)
{
    const json_t *value = member(inputs, name);
    double numbers[INPUTS_NUMBERS_MAX];
    size_t count = json_array_size(value);
    char pointer[POINTER_MAX];

    pointer_to(pointer, name);
    if (!value) {
        set(inputs, name, json_vector(fallback, n_fallback));
        return;
    }
    if (!json_is_array(value) || count < 1 || count > most) {
        problem_add(inputs->list, pointer, "must be an array of 1 to %zu numbers", most);
        return;
    }
    if (!json_read_numbers(value, 1, &count, numbers, inputs->list, pointer)) {
        return;
    }
    for (size_t i = 0; i < count; i++) {
        numbers[i] += 0.0;
        if (!(fabs(numbers[i]) <= limit)) {
            problem_add(inputs->list, pointer, "element %zu is %g; it must be from -%g to %g", i,
                        numbers[i], limit, limit);
            return;
        }
    }
    set(inputs, name, json_vector(numbers, count));
}

bool inputs_boolean(struct process_inputs *inputs, const char *name, bool fallback)
{
    const json_t *value = member(inputs, name);
    char pointer[POINTER_MAX];

    if (value && !json_is_boolean(value)) {
        pointer_to(pointer, name);
        problem_add(inputs->list, pointer, "must be true or false");
        return fallback;
    }
    fallback = value ? json_is_true(value) : fallback;
    set(inputs, name, json_boolean(fallback));
    return fallback;
}

const char *inputs_choice(struct process_inputs *inputs, const char *name,
                          const char *const *choices)
{
    const json_t *value = member(inputs, name);
    const char *text = json_string_value(value);
    char pointer[POINTER_MAX], list[200] = "";
    size_t used = 0;

    for (size_t i = 0; choices[i]; i++) {
        if (!value || (text && strcmp(text, choices[i]) == 0)) {
            set(inputs, name, json_string(choices[i]));
            return choices[i];
        }
        if (used < sizeof list) {
            used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "",
                                     choices[i]);
        }
    }
    pointer_to(pointer, name);
    problem_add(inputs->list, pointer, "must be one of: %s", list);
    return choices[0];
}

bool inputs_chose(const json_t *canonical, const char *name, const char *choice)
{
    const char *text = json_string_value(json_object_get(canonical, name));

    return text && strcmp(text, choice) == 0;
}

/* prefix and 32 lower-case hex digits? */
static bool is_content_id(const char *id, const char *prefix)
{
    size_t length = strlen(prefix);

    return id && strncmp(id, prefix, length) == 0 && strlen(id) == length + 32 &&
           strspn(id + length, "0123456789abcdef") == 32;
}

/* The work that inputs make (api_work). */
static void note_surface(struct process_inputs *inputs, long degree)
{
    struct api_work *work = &inputs->call->work;

    work->surfaces++;
    work->degree = degree > work->degree ? degree : work->degree;
}

static void note_degree(struct process_inputs *inputs, long degree)
{
    inputs->degree = degree > inputs->degree ? degree : inputs->degree;
}

static void note_mesh(struct process_inputs *inputs, int64_t faces)
{
    struct api_work *work = &inputs->call->work;

    work->meshes++;
    work->faces += faces;
    work->degree = work->degree > PROCESS_DEGREE_DEFAULT ? work->degree : PROCESS_DEGREE_DEFAULT;
}

void inputs_name_of(struct process_inputs *inputs, const char *id, size_t size, char *name)
{
    struct store *store = inputs->call->api->config.store;
    const char *owner = inputs->call->request->caller.name;
    struct store_surface surface = {0};
    struct store_mesh mesh = {0};
    const char *found = NULL;

    if (compute_is_mesh(id)) {
        found = store_mesh_get_as(store, owner, id, &mesh) == STORE_OK ? mesh.name : NULL;
    } else if (store_surface_get_as(store, owner, id, false, &surface) == STORE_OK) {
        found = surface.name;
    }
    (void)snprintf(name, size, "%.60s", found ? found : "");
    store_mesh_clear(&mesh);
    store_surface_clear(&surface);
}

static void refuse_mesh(struct process_inputs *inputs, const char *id, const char *code,
                        const char *detail)
{
    char name[64], who[160];

    inputs_name_of(inputs, id, sizeof name, name);
    (void)snprintf(who, sizeof who, "%s%s%s%s", id, name[0] ? ", \"" : "", name,
                   name[0] ? "\"" : "");
    if (inputs->place) {
        (void)problem_respond(inputs->call, code, "Member %zu (%s) cannot be analysed: %s",
                              inputs->place - 1, who, detail);
    } else {
        (void)problem_respond(inputs->call, code, "%s%s cannot be analysed: %s", who,
                              name[0] ? "," : "", detail);
    }
    inputs->answered = true;
}

/* The mesh exists and can be analysed; otherwise a problem is answered. */
static bool check_mesh(struct process_inputs *inputs, const char *id)
{
    struct store_mesh mesh = {0};
    char code[48], detail[320];
    int status;

    if (inputs->answered || inputs->shape_only) {
        return false;
    }
    status = call_sees(inputs->call, id);
    if (status == 0) {
        status = store_mesh_get(inputs->call->api->config.store, id, &mesh);
    }
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-mesh", id);
        inputs->answered = true;
    } else if (mesh_first_problem(&mesh, code, detail)) {
        refuse_mesh(inputs, id, code, detail);
    } else {
        note_mesh(inputs, mesh.faces);
    }
    store_mesh_clear(&mesh);
    return !inputs->answered;
}

bool inputs_mesh(struct process_inputs *inputs, const char *name)
{
    const json_t *value = member(inputs, name);
    const char *id = json_string_value(value);
    char pointer[POINTER_MAX];

    if (!is_content_id(id, "mesh-")) {
        pointer_to(pointer, name);
        problem_add(inputs->list, pointer,
                    value && !json_is_null(value)
                        ? "must be the id of a mesh: mesh- and 32 hexadecimal digits"
                        : "is required: the id of a mesh");
        return false;
    }
    if (!check_mesh(inputs, id)) {
        return false;
    }
    set(inputs, name, json_string(id));
    return true;
}

const char *inputs_surface_at(struct process_inputs *inputs, const json_t *value,
                              const char *pointer, long *degree)
{
    const char *id = json_string_value(value);
    struct store_surface surface = {0};
    int status;

    if (is_content_id(id, "mesh-")) {
        *degree = PROCESS_DEGREE_DEFAULT;
        note_degree(inputs, *degree);
        return check_mesh(inputs, id) ? id : NULL;
    }
    if (!is_content_id(id, "surf-")) {
        problem_add(inputs->list, pointer,
                    "must be the id of a surface or a mesh: surf- or mesh- and 32 hexadecimal "
                    "digits");
        return NULL;
    }
    if (inputs->answered || inputs->shape_only) {
        return NULL;
    }
    status = call_sees(inputs->call, id);
    if (status == 0) {
        status = store_surface_get(inputs->call->api->config.store, id, false, &surface);
    }
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-surface", id);
        inputs->answered = true;
        return NULL;
    }
    *degree = (long)surface.lmax;
    note_surface(inputs, *degree);
    note_degree(inputs, *degree);
    store_surface_clear(&surface);
    return id;
}

bool inputs_surface(struct process_inputs *inputs, const char *name, long *degree)
{
    const json_t *value = member(inputs, name);
    char pointer[POINTER_MAX];
    const char *id;

    pointer_to(pointer, name);
    if (!value) {
        problem_add(inputs->list, pointer, "is required: the id of a surface or a mesh");
        return false;
    }
    id = inputs_surface_at(inputs, value, pointer, degree);
    if (id) {
        set(inputs, name, json_string(id));
    }
    return id != NULL;
}
