/*
 * register.c - the process register over HTTP: canonical inputs and result document.
 *
 * penalty has one spelling for each meaning: "default" and "none" where the two weights are
 * those, otherwise both weights. In a common pose nothing is rotated, and the registration starts
 * from the identity, whatever rotation and start say.
 *
 * The warp in the result is the chain of maps that makes it up, to be applied in order to any
 * point of the sphere: a rotation (nine numbers, row by row), or exp and its inverse along the
 * field w = grad phi + p x grad psi (the harmonic coefficients of phi, then those of psi). Beside
 * it stands where it takes the nodes of the template's grid.
 */
#include <stdio.h>
#include <string.h>

#include "toolkit/handedness.h"
#include "toolkit/process.h"
#include "toolkit/routes.h"
#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"
#include "api/surfaces.h"
#include "api/warnings.h"
#include "compute/register.h"

static const char *const names[] = {"template",  "moving",  "rotation",   "reparameterization",
                                    "degree",    "penalty", "start",      "commonPose",
                                    "symmetric", "exact",   "handedness", NULL};
static const char *const link_kinds[] = {"rotation", "exp", "exp-inverse", "series"};

/* ---- Canonical inputs ------------------------------------------------------------------------ */

/* One weight of {"jacobian", "displacement"}; the default where it is absent. */
static double read_weight(struct process_inputs *inputs, const json_t *penalty, const char *name,
                          double fallback)
{
    const json_t *value = json_object_get(penalty, name);
    double number = value ? json_number_value(value) : fallback;
    char pointer[64];

    if ((value && !json_is_number(value)) || !(number >= 0.0 && number <= PROCESS_PENALTY_MAX)) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/penalty/%s", name);
        problem_add(inputs->list, pointer, "must be a number from 0 to %g",
                    (double)PROCESS_PENALTY_MAX);
    }
    return number + 0.0;
}

static void read_penalty(struct process_inputs *inputs)
{
    const struct srnf_register_options defaults = srnf_register_options_defaults();
    const json_t *value = json_object_get(inputs->given, "penalty");
    const char *text = json_string_value(value);
    double jacobian = defaults.penalty_jacobian, displacement = defaults.penalty_displacement;
    json_t *canonical;

    if (text && strcmp(text, "none") == 0) {
        jacobian = displacement = 0.0;
    } else if (json_is_object(value)) {
        size_t known = (json_object_get(value, "jacobian") != NULL) +
                       (size_t)(json_object_get(value, "displacement") != NULL);

        if (known != json_object_size(value)) {
            problem_add(inputs->list, "/inputs/penalty",
                        "has the members jacobian and displacement, and no others");
        }
        jacobian = read_weight(inputs, value, "jacobian", jacobian);
        displacement = read_weight(inputs, value, "displacement", displacement);
    } else if (value && !(text && strcmp(text, "default") == 0)) {
        problem_add(inputs->list, "/inputs/penalty",
                    "must be default, none or {\"jacobian\", \"displacement\"}");
    }
    if (jacobian == 0.0 && displacement == 0.0) {
        canonical = json_string("none");
    } else if (jacobian == defaults.penalty_jacobian &&
               displacement == defaults.penalty_displacement) {
        canonical = json_string("default");
    } else {
        canonical = json_pack("{s:f, s:f}", "jacobian", jacobian, "displacement", displacement);
    }
    (void)json_object_set_new(inputs->canonical, "penalty", canonical);
}

json_t *register_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    long degree;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    (void)inputs_boolean(&inputs, "rotation", true);
    (void)inputs_boolean(&inputs, "reparameterization", true);
    (void)inputs_integer(&inputs, "degree", 1, PROCESS_WARP_DEGREE_MAX,
                         PROCESS_WARP_DEGREE_DEFAULT);
    read_penalty(&inputs);
    (void)inputs_choice(&inputs, "start", registration_starts);
    (void)inputs_boolean(&inputs, "commonPose", false);
    (void)inputs_boolean(&inputs, "symmetric", false);
    (void)inputs_boolean(&inputs, "exact", false);
    inputs_handedness(&inputs);
    if (!list->errors) {
        (void)inputs_surface(&inputs, "template", &degree);
        (void)inputs_surface(&inputs, "moving", &degree);
    }
    return inputs_close(&inputs);
}

/* ---- Running --------------------------------------------------------------------------------- */

static struct compute_register_inputs typed_inputs(const json_t *inputs)
{
    bool common_pose = json_is_true(json_object_get(inputs, "commonPose"));
    struct compute_register_inputs typed = {.options = registration_defaults(common_pose)};
    const char *start = json_string_value(json_object_get(inputs, "start"));
    const json_t *penalty = json_object_get(inputs, "penalty");

    typed.template_id = json_string_value(json_object_get(inputs, "template"));
    typed.moving = json_string_value(json_object_get(inputs, "moving"));
    typed.handedness = handedness_checked(inputs);
    typed.options.degree = (size_t)json_integer_value(json_object_get(inputs, "degree"));
    typed.options.reparameterization = json_is_true(json_object_get(inputs, "reparameterization"));
    typed.options.symmetric = json_is_true(json_object_get(inputs, "symmetric"));
    typed.options.exact = json_is_true(json_object_get(inputs, "exact"));
    if (!common_pose) {
        typed.options.rotation = json_is_true(json_object_get(inputs, "rotation"));
        for (int i = 0; start && registration_starts[i]; i++) {
            if (strcmp(start, registration_starts[i]) == 0) {
                typed.options.start = (enum srnf_register_start)i;
            }
        }
    }
    if (json_is_object(penalty)) {
        typed.options.penalty_jacobian = json_number_value(json_object_get(penalty, "jacobian"));
        typed.options.penalty_displacement =
            json_number_value(json_object_get(penalty, "displacement"));
    } else if (json_string_value(penalty) && strcmp(json_string_value(penalty), "none") == 0) {
        typed.options.penalty_jacobian = typed.options.penalty_displacement = 0.0;
    }
    return typed;
}

static json_t *link_json(const struct srnf_warp_link *link)
{
    json_t *object = json_pack("{s:s}", "kind", link_kinds[link->kind]);
    size_t count = srnf_coefficient_count(link->degree);

    if (link->kind == SRNF_WARP_ROTATION) {
        (void)json_object_set_new(object, "matrix", json_vector(link->values, 9));
        return object;
    }
    (void)json_object_set_new(object, "degree", json_integer((json_int_t)link->degree));
    if (link->kind == SRNF_WARP_SERIES) {
        (void)json_object_set_new(object, "x", json_vector(link->values, count));
        (void)json_object_set_new(object, "y", json_vector(link->values + count, count));
        (void)json_object_set_new(object, "z", json_vector(link->values + 2 * count, count));
        return object;
    }
    (void)json_object_set_new(object, "phi", json_vector(link->values, count));
    (void)json_object_set_new(object, "psi", json_vector(link->values + count, count));
    return object;
}

static json_t *warp_json(const struct compute_register_outputs *outputs)
{
    const struct srnf_registration *registration = &outputs->registration;
    const size_t shape[3] = {outputs->n_theta, outputs->n_phi, 3};
    json_t *links = json_array();

    for (size_t i = 0; i < registration->warp.n_links; i++) {
        (void)json_array_append_new(links, link_json(&registration->warp.links[i]));
    }
    return json_pack("{s:o, s:{s:s, s:I, s:I, s:o, s:o}}", "links", links, "grid", "kind",
                     "gauss-legendre", "nTheta", (json_int_t)shape[0], "nPhi", (json_int_t)shape[1],
                     "points", json_nested(registration->points, 3, shape), "jacobian",
                     json_nested(registration->jacobian, 2, shape));
}

static json_t *result_document(const struct compute_register_inputs *typed,
                               const struct compute_register_outputs *outputs, json_t *surface)
{
    const struct srnf_registration *registration = &outputs->registration;
    const size_t square[2] = {3, 3};
    json_t *document = registration_figures(registration, &typed->options);

    (void)json_object_set_new(document, "surface", surface);
    (void)json_object_set_new(document, "rotation", json_nested(registration->rotation, 2, square));
    registration_bridged(document, document, outputs->bridged);
    (void)json_object_set_new(document, "registration", registration_json(&typed->options));
    (void)json_object_set_new(document, "warp", warp_json(outputs));
    registration_warn(document, registration, "moving onto template");
    return document;
}

static json_t *keep_surface(struct jobs_run *run, const struct compute_register_outputs *outputs,
                            struct jobs_result *result)
{
    const struct compute_surface *fixed = &outputs->ends[0], *moving = &outputs->ends[1];
    bool stored = strncmp(fixed->id, "surf-", 5) == 0 && fixed->degree == outputs->degree;
    const char *mesh = strncmp(moving->id, "mesh-", 5) == 0 ? moving->id : NULL;
    const char *ids[2] = {fixed->id, moving->id};
    struct surface_description description = {
        .name = "registered",
        .degree = outputs->degree,
        .coefficients = outputs->registration.coefficients,
        .scale = process_scale(run, moving->id, moving->scale),
        .measures = &outputs->measures,
        .parameterization = "registered",
        .mirrored = process_mirrored(run, moving->id),
        .route = routes_common(run, outputs->bridged ? 1 : 2, ids, NULL),
        .source = process_source(run, "register", mesh, stored ? fixed->id : NULL),
    };

    return process_keep_surface(run, &description, "the surface", result);
}

void register_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *surface;
    struct compute_register_inputs typed;
    struct compute_register_outputs outputs = {0};

    (void)api;
    if (!inputs) {
        return;
    }
    typed = typed_inputs(inputs);
    typed.opposite = typed.handedness && handedness_opposite(run, typed.template_id, typed.moving);
    routes_origin(run, typed.template_id, &typed.origins[0]);
    routes_origin(run, typed.moving, &typed.origins[1]);
    if (compute_register(run, &typed, &outputs, result) == 0) {
        surface = keep_surface(run, &outputs, result);
        if (surface) {
            json_t *document = result_document(&typed, &outputs, surface);

            warnings_put(document, handedness_of_pair(run, typed.template_id, typed.moving,
                                                      typed.opposite, &outputs.mirror));
            process_finish(run, document, inputs, result);
        }
    }
    compute_register_clear(&outputs);
    json_decref(inputs);
}
