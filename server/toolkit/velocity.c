/*
 * velocity.c - velocities and vectors as inputs, and the surfaces that they are used with.
 *
 * A velocity has three forms: toward a surface, the motion of a surface's points as harmonic
 * coefficients, and a field in the space of SRNFs. The last is what transport answers and leaves
 * unchanged, so that a vector can be carried on, or back, without loss. It belongs to one grid, and
 * so to surfaces as they are parameterized.
 */
#include "toolkit/velocity.h"

#include <stdio.h>
#include <string.h>

#include "api/surfaces.h"
#include "toolkit/pair.h"
#include "toolkit/routes.h"

#define SHARE_MESHES 50.0 /* percent of the job that encoding stands for, if all are meshes */

static const char *const axes[] = {"x", "y", "z"};
const char *const deformation_methods[] = {"srnf", "pullback", NULL};

/* ---- Reading --------------------------------------------------------------------------------- */

/* coefficients {lmax, x, y, z}; the canonical object, or NULL with a problem. */
static json_t *read_motion(struct process_inputs *inputs, const json_t *value, const char *pointer,
                           long highest)
{
    double lmax = json_number_value(json_object_get(value, "lmax"));
    json_t *canonical = NULL;
    char at[96];
    size_t count;
    double *numbers;

    if (!json_is_object(value) || json_object_size(value) != 4 ||
        !(lmax >= SRNF_DEGREE_MIN && lmax <= (double)highest) || lmax != (double)(long)lmax) {
        problem_add(inputs->list, pointer,
                    "must be {lmax, x, y, z} with a whole lmax from %d to %ld, the degree of the "
                    "surfaces",
                    SRNF_DEGREE_MIN, highest);
        return NULL;
    }
    count = srnf_coefficient_count((size_t)lmax);
    numbers = srnf_alloc(count, sizeof(double));
    canonical = json_pack("{s:I}", "lmax", (json_int_t)lmax);
    for (size_t k = 0; numbers && k < 3; k++) {
        (void)snprintf(at, sizeof at, "%s/%s", pointer, axes[k]);
        if (json_read_numbers(json_object_get(value, axes[k]), 1, &count, numbers, inputs->list,
                              at)) {
            (void)json_object_set_new(canonical, axes[k], json_vector(numbers, count));
        }
    }
    srnf_free(numbers);
    return canonical;
}

/* A field on the working grid of that degree, for surfaces as they are parameterized. */
static json_t *read_field(struct process_inputs *inputs, const json_t *value, const char *pointer,
                          long degree)
{
    long own = 0;
    long rows = (long)srnf_working_rows((size_t)(degree ? degree : SRNF_DEGREE_MAX));
    json_t *canonical = inputs_field(inputs, value, pointer, &own);
    bool same = json_integer_value(json_object_get(canonical, "nTheta")) == rows &&
                json_integer_value(json_object_get(canonical, "nPhi")) == 2 * rows;

    if (!inputs->list->errors && (own != degree || !same)) {
        problem_add(inputs->list, pointer,
                    "must have lmax %ld, nTheta %ld and nPhi %ld: the degree of the surfaces and "
                    "its grid",
                    degree, rows, 2 * rows);
    }
    if (json_is_true(json_object_get(inputs->canonical, "register"))) {
        problem_add(inputs->list, "/inputs/register",
                    "must be false with srnf, which belongs to surfaces as they are parameterized");
    }
    return canonical;
}

static void read_velocity(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name), *toward, *motion, *field;
    json_t *form = NULL;
    char pointer[80];
    const char *id;
    long own, highest = inputs->degree ? inputs->degree : SRNF_DEGREE_MAX;

    toward = json_object_get(value, "toward");
    motion = json_object_get(value, "coefficients");
    field = json_object_get(value, "srnf");
    (void)snprintf(pointer, sizeof pointer, "/inputs/%s", input->name);
    if (json_object_size(value) != 1 || (!toward && !motion && !field)) {
        problem_add(inputs->list, pointer,
                    "%s {\"toward\": id}, {\"coefficients\": {lmax, x, y, z}} or {\"srnf\": {lmax, "
                    "nTheta, nPhi, q}}",
                    value ? "must be one of" : "is required: one of");
        return;
    }
    if (toward) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s/toward", input->name);
        id = inputs_surface_at(inputs, toward, pointer, &own);
        form = id ? json_pack("{s:s}", "toward", id) : NULL;
    } else if (motion) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s/coefficients", input->name);
        form = json_pack("{s:o*}", "coefficients", read_motion(inputs, motion, pointer, highest));
    } else {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s/srnf", input->name);
        form = json_pack("{s:o*}", "srnf", read_field(inputs, field, pointer, highest));
    }
    (void)json_object_set_new(inputs->canonical, input->name, form ? form : json_null());
}

/* [3][(degree+1)^2] of {lmax, x, y, z}, or NULL without memory. */
static double *type_motion(const json_t *motion, size_t degree)
{
    size_t count = srnf_coefficient_count(degree);
    double *numbers = srnf_alloc(count, 3 * sizeof(double));

    for (size_t k = 0; numbers && k < 3; k++) {
        const json_t *axis = json_object_get(motion, axes[k]);

        for (size_t i = 0; i < count; i++) {
            numbers[k * count + i] = json_number_value(json_array_get(axis, i));
        }
    }
    return numbers;
}

/* [3][n_theta][n_phi] of q, [n_theta n_phi][3] flat, or NULL without memory. */
static double *type_field(const json_t *q)
{
    size_t nodes = json_array_size(q) / 3;
    double *numbers = srnf_alloc(nodes, 3 * sizeof(double));

    for (size_t k = 0; numbers && k < 3; k++) {
        for (size_t i = 0; i < nodes; i++) {
            numbers[k * nodes + i] = json_number_value(json_array_get(q, 3 * i + k));
        }
    }
    return numbers;
}

static bool type_velocity(const json_t *value, void *member)
{
    struct velocity *velocity = member;
    const char *toward = json_string_value(json_object_get(value, "toward"));
    const json_t *motion = json_object_get(value, "coefficients");

    if (toward) {
        (void)snprintf(velocity->toward, sizeof velocity->toward, "%s", toward);
        return true;
    }
    if (motion) {
        velocity->degree = (size_t)json_integer_value(json_object_get(motion, "lmax"));
        velocity->motion = type_motion(motion, velocity->degree);
    } else {
        velocity->field = type_field(json_object_get(json_object_get(value, "srnf"), "q"));
    }
    return velocity->motion || velocity->field;
}

static void clear_velocity(void *member)
{
    struct velocity *velocity = member;

    srnf_free(velocity->motion);
    srnf_free(velocity->field);
}

static void echo_velocity(json_t *value)
{
    field_by_digest(json_object_get(value, "srnf"));
}

const struct input_own velocity_own = {
    .schema = "\"oneOf\":[{\"type\":\"object\",\"additionalProperties\":false,"
              "\"required\":[\"toward\"],\"properties\":{\"toward\":{\"type\":\"string\","
              "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}}},{\"type\":\"object\","
              "\"additionalProperties\":false,\"required\":[\"coefficients\"],"
              "\"properties\":{\"coefficients\":{\"type\":\"object\",\"required\":[\"lmax\",\"x\","
              "\"y\",\"z\"]}}},{\"type\":\"object\",\"additionalProperties\":false,"
              "\"required\":[\"srnf\"],\"properties\":{\"srnf\":{\"type\":\"object\","
              "\"required\":[\"lmax\",\"nTheta\",\"nPhi\",\"q\"]}}}]",
    .refers = true,
    .read = read_velocity,
    .type = type_velocity,
    .clear = clear_velocity,
    .echo = echo_velocity,
};

/* ---- Running --------------------------------------------------------------------------------- */

/* The velocity at the degree of the surfaces. */
static int set_velocity(const struct velocity *given, struct deformation *deformation)
{
    const struct compute_group *group = &deformation->group;

    if (given->motion) {
        deformation->motion = srnf_alloc(srnf_coefficient_count(group->degree), 3 * sizeof(double));
        if (!deformation->motion) {
            return SRNF_ENOMEM;
        }
        srnf_surface_change_degree(given->degree, given->motion, group->degree,
                                   deformation->motion);
    }
    deformation->velocity =
        (struct srnf_velocity){.motion = deformation->motion,
                               .toward = given->toward[0] ? group->surfaces[group->n - 1] : NULL,
                               .field = given->field};
    return 0;
}

int deformation_open(struct jobs_run *run, size_t n, const char *const *ids,
                     const struct velocity *velocity, bool registered, bool common_pose,
                     enum deformation_method method, struct deformation *deformation,
                     struct jobs_result *result)
{
    struct compute_group *group = &deformation->group;
    int status;

    *deformation = (struct deformation){.jobs = jobs_run_jobs(run)};
    deformation->registration = registration_pair_defaults(common_pose);
    deformation->options.registration = registered ? &deformation->registration : NULL;
    deformation->options.pullback = method == DEFORMATION_PULLBACK;
    status = compute_group_load(run, n, ids, NULL, NULL, 0, 0, SHARE_MESHES, group, result);
    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    deformation->surfaces = group->surfaces;
    status = jobs_transform_acquire(deformation->jobs, group->degree, SRNF_GRID_GAUSS_LEGENDRE, 0,
                                    0, &deformation->sht);
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    status = velocity ? set_velocity(velocity, deformation) : 0;
    return status ? compute_fail(result, status, NULL, "preparing the surfaces") : 0;
}

void deformation_close(struct deformation *deformation)
{
    if (deformation->sht) {
        jobs_transform_release(deformation->jobs, deformation->sht);
    }
    compute_group_clear(&deformation->group);
    srnf_free(deformation->motion);
}

json_t *deformation_warn_pose(struct jobs_run *run, const struct deformation *deformation,
                              size_t first, size_t second, const char *what, json_t *document,
                              struct jobs_result *result)
{
    const double *const *surfaces = deformation->surfaces;

    if (document && !deformation->options.registration &&
        pair_warn_unregistered(run, deformation->group.degree, surfaces[first], surfaces[second],
                               what, document, result)) {
        json_decref(document);
        return NULL;
    }
    return document;
}

json_t *keep_reached(struct jobs_run *run, const char *process, const char *name, size_t degree,
                     const double *coefficients, double scale,
                     const struct srnf_surface_measures *measures, const char *reference,
                     struct jobs_result *result)
{
    bool stored = reference && strncmp(reference, "surf-", 5) == 0;
    struct compute_surface of = {.scale = 0.0};
    struct surface_place place = {.known = false};
    struct surface_description description = {
        .name = name,
        .degree = degree,
        .coefficients = coefficients,
        .scale = scale,
        .measures = measures,
        .parameterization = "inherited",
        .route = reference ? routes_common(run, 1, &reference, NULL) : NULL,
        .source = process_source(run, process, NULL, stored ? reference : NULL),
        .mirrored = reference && process_mirrored(run, reference),
    };

    /* In the frame of the surface that it was reached from. */
    if (stored) {
        (void)snprintf(of.id, sizeof of.id, "%s", reference);
        place = process_place(run, &of);
    }
    if (place.known) {
        description.origin = place.origin;
        description.rotation = place.rotation;
        description.frame_mesh = place.mesh;
        description.frame = process_frame(
            run, reference, &place,
            surface_frame_json(
                reference,
                "The coordinates that the surface came from which this one was reached from."));
    }
    return process_keep_surface(run, &description, "the surface", result);
}

/* ---- Results --------------------------------------------------------------------------------- */

json_t *alignment_json(const struct srnf_registration *registration,
                       const struct srnf_register_options *options)
{
    json_t *document;

    if (!registration->coefficients) {
        return json_null();
    }
    document = registration_figures(registration, options);
    (void)json_object_set_new(document, "options", registration_json(options));
    return document;
}

json_t *path_json(const struct srnf_deform_path *path)
{
    if (path->segments == 0) {
        return json_null();
    }
    return json_pack("{s:I, s:o, s:o, s:o, s:I, s:o, s:b}", "segments", (json_int_t)path->segments,
                     "energy", json_finite(path->figures.energy), "length",
                     json_finite(path->figures.length), "speedVariation",
                     json_finite(path->figures.speed_variation), "iterations",
                     (json_int_t)path->iterations, "residual", json_finite(path->residual),
                     "converged", path->converged);
}

json_t *path_shots_json(const struct srnf_deform_paths *paths)
{
    json_t *shots = json_array();

    for (size_t i = 0; i < paths->n; i++) {
        (void)json_array_append_new(shots, path_json(&paths->shots[i]));
    }
    return shots;
}
