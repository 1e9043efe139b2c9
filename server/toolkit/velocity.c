/*
 * velocity.c - velocities and vectors as inputs, and the registration of what is compared.
 *
 * A velocity has three forms: toward a surface, the motion of a surface's points as harmonic
 * coefficients, and a field in the space of SRNFs. The last is what transport answers and leaves
 * unchanged, so that a vector can be carried on, or back, without loss. It belongs to one grid, and
 * so to surfaces as they are parameterised.
 */
#include "toolkit/velocity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "toolkit/routes.h"
#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"
#include "api/surfaces.h"

static const char *const axes[] = {"x", "y", "z"};
static const char *const methods[] = {"srnf", "pullback", NULL};

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

/* A field on the working grid of that degree, for surfaces as they are parameterised. */
static json_t *read_field(struct process_inputs *inputs, const json_t *value, const char *pointer,
                          long degree)
{
    long own = 0;
    long rows = (long)srnf_working_rows((size_t)degree);
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
                    "must be false with srnf, which belongs to surfaces as they are parameterised");
    }
    return canonical;
}

void inputs_velocity(struct process_inputs *inputs, const char *name, long degree)
{
    const json_t *value = json_object_get(inputs->given, name), *toward, *motion, *field;
    json_t *form = NULL;
    char pointer[80];
    const char *id;
    long own;

    toward = json_object_get(value, "toward");
    motion = json_object_get(value, "coefficients");
    field = json_object_get(value, "srnf");
    (void)snprintf(pointer, sizeof pointer, "/inputs/%s", name);
    if (json_object_size(value) != 1 || (!toward && !motion && !field)) {
        problem_add(inputs->list, pointer,
                    "%s {\"toward\": id}, {\"coefficients\": {lmax, x, y, z}} or {\"srnf\": {lmax, "
                    "nTheta, nPhi, q}}",
                    value ? "must be one of" : "is required: one of");
        return;
    }
    if (toward) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s/toward", name);
        id = inputs_surface_at(inputs, toward, pointer, &own);
        form = id ? json_pack("{s:s}", "toward", id) : NULL;
    } else if (motion) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s/coefficients", name);
        form = json_pack("{s:o*}", "coefficients", read_motion(inputs, motion, pointer, degree));
    } else {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s/srnf", name);
        form = json_pack("{s:o*}", "srnf", read_field(inputs, field, pointer, degree));
    }
    (void)json_object_set_new(inputs->canonical, name, form ? form : json_null());
}

void inputs_alignment(struct process_inputs *inputs)
{
    bool registered = inputs_boolean(inputs, "register", true);
    bool common_pose = inputs_boolean(inputs, "commonPose", false);

    (void)inputs_choice(inputs, "method", methods);
    if (!registered && common_pose) { /* one spelling: there is nothing to be posed */
        (void)json_object_set_new(inputs->canonical, "commonPose", json_false());
    }
}

/* ---- Running --------------------------------------------------------------------------------- */

bool velocity_read(const json_t *value, struct compute_velocity *velocity, double **numbers,
                   struct jobs_result *result)
{
    const json_t *motion = json_object_get(value, "coefficients");
    const json_t *field = json_object_get(value, "srnf"), *q = json_object_get(field, "q");
    size_t count, nodes;

    *velocity =
        (struct compute_velocity){.toward = json_string_value(json_object_get(value, "toward"))};
    if (velocity->toward) {
        return true;
    }
    velocity->degree = (size_t)json_integer_value(json_object_get(motion, "lmax"));
    count = motion ? srnf_coefficient_count(velocity->degree) : 0;
    nodes = json_array_size(q) / 3;
    *numbers = srnf_alloc(motion ? count : nodes, 3 * sizeof(double));
    if (!*numbers) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the velocity");
        return false;
    }
    for (size_t k = 0; k < 3; k++) {
        const json_t *axis = json_object_get(motion, axes[k]);

        for (size_t i = 0; i < count; i++) {
            (*numbers)[k * count + i] = json_number_value(json_array_get(axis, i));
        }
        for (size_t i = 0; i < nodes; i++) {
            (*numbers)[k * nodes + i] = json_number_value(json_array_get(q, 3 * i + k));
        }
    }
    velocity->coefficients = motion ? *numbers : NULL;
    velocity->field = motion ? NULL : *numbers;
    return true;
}

bool alignment_pullback(const json_t *inputs)
{
    const char *method = json_string_value(json_object_get(inputs, "method"));

    return method && strcmp(method, "pullback") == 0;
}

const struct srnf_register_options *alignment_read(const json_t *inputs,
                                                   struct srnf_register_options *options)
{
    *options = registration_pair_defaults(json_is_true(json_object_get(inputs, "commonPose")));
    return json_is_true(json_object_get(inputs, "register")) ? options : NULL;
}

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

json_t *pullback_leg_json(const struct compute_pullback_leg *leg)
{
    if (leg->segments == 0) {
        return json_null();
    }
    return json_pack(
        "{s:I, s:o, s:o, s:o, s:I, s:o, s:b}", "segments", (json_int_t)leg->segments, "energy",
        json_finite(leg->path.energy), "length", json_finite(leg->path.length), "speedVariation",
        json_finite(leg->path.speed_variation), "iterations", (json_int_t)leg->iterations,
        "residual", json_finite(leg->residual), "converged", leg->converged);
}

json_t *pullback_shots_json(const struct compute_pullback *pullback)
{
    json_t *shots = json_array();

    for (size_t i = 0; i < pullback->n; i++) {
        (void)json_array_append_new(shots, pullback_leg_json(&pullback->shots[i]));
    }
    return shots;
}

json_t *keep_reached(struct jobs_run *run, const char *process, const char *name, size_t degree,
                     const double *coefficients, double scale,
                     const struct srnf_surface_measures *measures, const char *reference,
                     struct jobs_result *result)
{
    bool stored = reference && strncmp(reference, "surf-", 5) == 0;
    struct surface_description description = {
        .name = name,
        .degree = degree,
        .coefficients = coefficients,
        .scale = scale,
        .measures = measures,
        .parameterization = "inherited",
        .route = reference ? routes_common(run, 1, &reference, NULL) : NULL,
        .source = process_source(run, process, NULL, stored ? reference : NULL),
    };

    return process_keep_surface(run, &description, "the surface", result);
}

json_t *velocity_inputs_for_results(const json_t *inputs, const char *name)
{
    json_t *copy = json_deep_copy(inputs);

    field_by_digest(json_object_get(json_object_get(copy, name), "srnf"));
    return copy;
}
