/*
 * geodesic.c - the process geodesic over HTTP: schemas, canonical inputs, result document.
 *
 * The second end is registered to the first, with the default options and both ways unless
 * symmetric is false; where register is false the ends are joined as they are parameterised. Ends
 * of different degree are joined at the larger one. distance is that of distances for the same two
 * surfaces, whichever is from: of a registration, before the registered surface is cut to its
 * degree. The line that is followed ends at the cut surface, so that its length (lineLength) is
 * another by about that.
 *
 * The closed form is told of where it applies to both ends.
 *
 * Every surface of the path is stored. Its scale goes on the straight line between the scales of
 * the ends, and its source names the first surface as the reference, from which the deformation
 * magnitude in its mesh is measured.
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
#include "compute/geodesic.h"

#define PULLBACK_STEPS_MIN 3

static const char *const names[] = {"from",      "to",     "steps",      "register",
                                    "symmetric", "method", "handedness", NULL};

/* In the order of enum srnf_geodesic_method; pullback, after those, is another metric. */
static const char *const methods[] = {"srnf", "closed-form", "linear", "pullback", NULL};

json_t *geodesic_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    long degree, steps;
    bool registered;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    steps = inputs_integer(&inputs, "steps", PROCESS_STEPS_MIN, PROCESS_STEPS_MAX,
                           PROCESS_STEPS_DEFAULT);
    registered = inputs_boolean(&inputs, "register", true);
    if (!inputs_boolean(&inputs, "symmetric", true) && !registered) { /* one spelling */
        (void)json_object_set_new(inputs.canonical, "symmetric", json_true());
    }
    inputs_handedness(&inputs);
    if (strcmp(inputs_choice(&inputs, "method", methods), "pullback") == 0 &&
        steps < PULLBACK_STEPS_MIN) {
        problem_add(list, "/inputs/steps", "pullback takes a path of %d surfaces or more",
                    PULLBACK_STEPS_MIN);
    }
    if (!list->errors) {
        (void)inputs_surface(&inputs, "from", &degree);
        (void)inputs_surface(&inputs, "to", &degree);
    }
    return inputs_close(&inputs);
}

static enum srnf_geodesic_method method_of(const json_t *inputs)
{
    const char *name = json_string_value(json_object_get(inputs, "method"));

    for (int i = 0; name && i <= SRNF_GEODESIC_LINEAR; i++) {
        if (strcmp(name, methods[i]) == 0) {
            return (enum srnf_geodesic_method)i;
        }
    }
    return SRNF_GEODESIC_SRNF;
}

static bool is_pullback(const json_t *inputs)
{
    const char *name = json_string_value(json_object_get(inputs, "method"));

    return name && strcmp(name, "pullback") == 0;
}

/* The mesh that a surface of the path is the encoding of: only the ends have one. */
static const char *mesh_of(const struct compute_geodesic_outputs *outputs, size_t i)
{
    const struct compute_surface *end = &outputs->ends[i > 0];
    bool is_end = i == 0 || i + 1 == outputs->geodesic.steps;

    return is_end && strncmp(end->id, "mesh-", 5) == 0 ? end->id : NULL;
}

/* A mesh at an end was laid on the sphere by the route of its encoding, until it is registered. */
static const char *parameterization_of(const struct compute_geodesic_outputs *outputs, size_t i)
{
    if (i > 0 && i + 1 == outputs->geodesic.steps && outputs->registration.coefficients) {
        return "registered";
    }
    return mesh_of(outputs, i) ? outputs->ends[i > 0].route : "inherited";
}

/* The ends have their own routes, unless registered; the others what both have in common. */
static const char *route_of(struct jobs_run *run, const struct compute_geodesic_outputs *outputs,
                            size_t i)
{
    const char *ids[2] = {outputs->ends[0].id, outputs->ends[1].id};
    const char *meshes = outputs->ends[0].route ? outputs->ends[0].route : outputs->ends[1].route;
    bool last = i + 1 == outputs->geodesic.steps && !outputs->registration.coefficients;

    if (i == 0 || last) {
        return routes_common(run, 1, ids + (i > 0), meshes);
    }
    return routes_common(run, outputs->bridged ? 1 : 2, ids, meshes);
}

/* What registration came to; null where there was none. */
static json_t *registration_document(const struct compute_geodesic_inputs *typed,
                                     const struct compute_geodesic_outputs *outputs)
{
    json_t *document;

    if (!typed->registration) {
        return json_null();
    }
    document = registration_figures(&outputs->registration, typed->registration);
    (void)json_object_set_new(document, "options", registration_json(typed->registration));
    return document;
}

/* Stores the surfaces of the path; their records, or NULL with the problem set. */
static json_t *keep_surfaces(struct jobs_run *run, const struct compute_geodesic_outputs *outputs,
                             struct jobs_result *result)
{
    const struct srnf_geodesic *geodesic = &outputs->geodesic;
    size_t count = 3 * srnf_coefficient_count(geodesic->degree);
    double scales[2] = {process_scale(run, outputs->ends[0].id, outputs->ends[0].scale),
                        process_scale(run, outputs->ends[1].id, outputs->ends[1].scale)};
    bool mirrored[2] = {process_mirrored(run, outputs->ends[0].id),
                        process_mirrored(run, outputs->ends[1].id)};
    char name[64], reference[STORE_ID_MAX] = "";
    json_t *records = json_array(), *record;

    for (size_t i = 0; i < geodesic->steps; i++) {
        double t = geodesic->times[i];
        struct surface_description description = {
            .name = name,
            .degree = geodesic->degree,
            .coefficients = geodesic->coefficients + i * count,
            .scale = (1.0 - t) * scales[0] + t * scales[1],
            .measures = &outputs->measures[i],
            .parameterization = parameterization_of(outputs, i),
            .mirrored = (i + 1 == geodesic->steps || mirrored[0]) && (i == 0 || mirrored[1]),
            .route = route_of(run, outputs, i),
            .source = process_source(run, "geodesic", mesh_of(outputs, i), i ? reference : NULL),
        };

        (void)snprintf(name, sizeof name, "geodesic, t = %.4g", t);
        record = process_keep_surface(run, &description, "a surface of the path", result);
        if (!record) {
            json_decref(records);
            return NULL;
        }
        if (i == 0) {
            (void)snprintf(reference, sizeof reference, "%s",
                           json_string_value(json_object_get(record, "id")));
        }
        (void)json_array_append_new(records, record);
    }
    return records;
}

static json_t *path_figures(const struct srnf_path_figures *figures)
{
    return json_pack("{s:o, s:o, s:o}", "energy", json_finite(figures->energy), "length",
                     json_finite(figures->length), "speedVariation",
                     json_finite(figures->speed_variation));
}

/* The path in the pulled-back metric beside the two others; null for the other methods. */
static json_t *pullback_document(const struct srnf_pullback_geodesic *pullback)
{
    json_t *document;

    if (pullback->steps == 0) {
        return json_null();
    }
    document = path_figures(&pullback->path);
    (void)json_object_set_new(document, "speeds",
                              json_vector(pullback->speeds, pullback->steps - 1));
    (void)json_object_set_new(document, "linear", path_figures(&pullback->linear));
    (void)json_object_set_new(document, "inverted", path_figures(&pullback->inverted));
    (void)json_object_set_new(document, "iterations",
                              json_integer((json_int_t)pullback->iterations));
    (void)json_object_set_new(document, "converged", json_boolean(pullback->converged));
    (void)json_object_set_new(document, "gradient", json_finite(pullback->gradient));
    return document;
}

/* The three curves, divided by the norms where these are given; null where one means nothing. */
static json_t *curves(const struct srnf_geodesic *geodesic, const double *norms)
{
    static const char *const labels[] = {"geodesic", "closedForm", "linear"};
    const double *energies[] = {geodesic->energy_geodesic,
                                geodesic->closed_form_applies ? geodesic->energy_closed_form : NULL,
                                geodesic->energy_linear};
    json_t *object = json_object();

    for (size_t k = 0; k < 3; k++) {
        json_t *curve = energies[k] ? json_array() : json_null();
        for (size_t i = 0; energies[k] && i < geodesic->steps; i++) {
            double unit = norms ? norms[i] : 1.0;
            (void)json_array_append_new(curve, json_finite(energies[k][i] / unit));
        }
        (void)json_object_set_new(object, labels[k], curve);
    }
    return object;
}

static json_t *result_document(const struct compute_geodesic_inputs *typed,
                               const struct compute_geodesic_outputs *outputs, json_t *surfaces)
{
    const struct srnf_geodesic *geodesic = &outputs->geodesic;
    double distance = typed->registration ? outputs->registration.distance : geodesic->distance;
    json_t *document = json_object(), *warnings = json_array();

    (void)json_object_set_new(document, "surfaces", surfaces);
    (void)json_object_set_new(document, "times", json_vector(geodesic->times, geodesic->steps));
    (void)json_object_set_new(document, "distance", json_finite(distance));
    (void)json_object_set_new(document, "lineLength", json_finite(geodesic->distance));
    (void)json_object_set_new(document, "length", json_finite(geodesic->length));
    (void)json_object_set_new(document, "energies", curves(geodesic, NULL));
    (void)json_object_set_new(document, "relativeEnergies",
                              curves(geodesic, outputs->squared_norm));
    (void)json_object_set_new(document, "transforms", json_finite(geodesic->transforms));
    (void)json_object_set_new(document, "pullback", pullback_document(&outputs->pullback));
    (void)json_object_set_new(document, "registration", registration_document(typed, outputs));
    registration_warn(document, &outputs->registration, "to onto from");
    if (!typed->pullback && typed->options.method == SRNF_GEODESIC_CLOSED_FORM &&
        !geodesic->closed_form_applies) {
        warning_add(warnings, "closed-form-inapplicable", NULL,
                    "The closed form does not give the ends themselves back: it is for star-shaped "
                    "surfaces in their radial parameterisation, which a registered one is not. The "
                    "surfaces between have nothing to do with the ends; use method srnf.");
    }
    warnings_put(document, warnings);
    return document;
}

void geodesic_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *surfaces, *document;
    struct compute_geodesic_inputs typed = {.options = srnf_geodesic_options_defaults()};
    struct compute_geodesic_outputs outputs = {0};
    struct srnf_register_options registration = registration_pair_defaults(false);

    (void)api;
    if (!inputs) {
        return;
    }
    typed.from = json_string_value(json_object_get(inputs, "from"));
    typed.to = json_string_value(json_object_get(inputs, "to"));
    typed.options.steps = (size_t)json_integer_value(json_object_get(inputs, "steps"));
    typed.options.method = method_of(inputs);
    typed.pullback = is_pullback(inputs);
    typed.handedness = handedness_checked(inputs);
    typed.opposite = typed.handedness && handedness_opposite(run, typed.from, typed.to);
    typed.registration = json_is_true(json_object_get(inputs, "register")) ? &registration : NULL;
    registration.symmetric = json_is_true(json_object_get(inputs, "symmetric"));
    if (typed.options.method != SRNF_GEODESIC_CLOSED_FORM) {
        routes_origin(run, typed.from, &typed.origins[0]);
        routes_origin(run, typed.to, &typed.origins[1]);
    }
    if (compute_geodesic(run, &typed, &outputs, result)) {
        goto out;
    }
    surfaces = keep_surfaces(run, &outputs, result);
    if (!surfaces) {
        goto out;
    }
    document = result_document(&typed, &outputs, surfaces);
    registration_bridged(document, json_object_get(document, "registration"), outputs.bridged);
    warnings_put(document,
                 handedness_of_pair(run, typed.from, typed.to, typed.opposite, &outputs.mirror));
    process_finish(run, document, inputs, result);
out:
    compute_geodesic_clear(&outputs);
    json_decref(inputs);
}
