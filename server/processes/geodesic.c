/*
 * geodesic.c - the process geodesic: the path between two surfaces.
 *
 * The second end is registered to the first, with the default options and both ways unless
 * symmetric is false; where register is false the ends are joined as they are parameterized. Ends
 * of different degree are joined at the larger one. distance is that of distances for the same two
 * surfaces, whichever is from: of a registration, before the registered surface is cut to its
 * degree. The line that is followed ends at the cut surface, so that its length (lineLength) is
 * another by about that.
 *
 * The geodesic of the pulled-back metric takes the place of the surfaces of the straight line
 * between the surfaces, for which the curves of energy are computed.
 *
 * Every surface of the path is stored. Its scale goes on the straight line between the scales of
 * the ends, and its source names the first surface as the reference, from which the deformation
 * magnitude in its mesh is measured.
 */
#include <stdio.h>
#include <string.h>

#include "toolkit/landmarks.h"
#include "toolkit/pair.h"
#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"
#include "toolkit/table.h"
#include "toolkit/velocity.h"
#include "api/surfaces.h"
#include "api/warnings.h"

#define PULLBACK_STEPS_MIN 3
/* Percent of the job: encoding a mesh, and registering one end to the other. */
#define SHARE_END 15.0
#define SHARE_REGISTRATION 50.0

struct joining {
    char from[STORE_ID_MAX], to[STORE_ID_MAX];
    long steps;
    bool registered, symmetric;
    int method, handedness;
    struct landmarks_input landmarks;
};

/* In the order of enum srnf_geodesic_method; pullback, after those, is another metric. */
static const char *const methods[] = {"srnf", "closed-form", "linear", "pullback", NULL};
#define PULLBACK (SRNF_GEODESIC_LINEAR + 1)

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

#define AT(member) offsetof(struct joining, member)
static const struct process_input inputs[] = {
    {"from", INPUT_SURFACE, AT(from),
     "Surface at t = 0; a mesh is encoded with the default options.", .required = true},
    {"to", INPUT_SURFACE, AT(to), "Surface at t = 1; a mesh is encoded with the default options.",
     .required = true},
    {"steps", INPUT_INTEGER, AT(steps), "Surfaces, both ends included.",
     .lowest = PROCESS_STEPS_MIN, .highest = PROCESS_STEPS_MAX, .fallback = PROCESS_STEPS_DEFAULT},
    REGISTER_INPUT(joining, "Register the second end to the first, with the default options of "
                            "register; false: both as they are parameterized."),
    SYMMETRIC_INPUT(joining, 1,
                    "Search the registration both ways, as distances does: the same distance from "
                    "either side. false, one way: faster, and the warp is smoother, so that less "
                    "of the registered surface is cut off (truncationError)."),
    {"method", INPUT_CHOICE, AT(method),
     "srnf inverts the points of the straight line between the SRNFs numerically, closed-form by "
     "the formula for star-shaped surfaces (a mesh is encoded by star for it), linear blends the "
     "surfaces. pullback is the geodesic within the space of surfaces, by straightening the path "
     "in the metric that the SRNF pulls back to it; it takes 3 surfaces or more.",
     .choices = methods},
    LANDMARKS_INPUT(joining, landmarks_of_geodesic),
    HANDEDNESS_INPUT(joining, "the mirror image of the second end as well, registered where names "
                              "or a quick rigid match suggest two sides, and to warn where it"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"surfaces", OUTPUT_OBJECTS, "Records of the surfaces from t = 0 to t = 1."},
    {"times", OUTPUT_NUMBERS, "Of the surfaces, from 0 to 1."},
    {"distance", OUTPUT_NUMBER,
     "Of the two surfaces in the space of SRNFs: what distances has for them (metric srnf, the "
     "same register, lmax the larger of their degrees), and the same with from and to exchanged. "
     "Registered, it is measured before the degree cuts off the registered surface "
     "(truncationError)."},
    {"lineLength", OUTPUT_NUMBER,
     "Length of the straight line in the space of SRNFs that is followed, between the surfaces at "
     "t = 0 and t = 1. Where nothing was registered it is distance; otherwise it differs from it, "
     "and between the two directions, by what the degree cuts off."},
    {"length", OUTPUT_NUMBER, "Sum of the distances between neighbouring surfaces."},
    {"energies", OUTPUT_OBJECT,
     "geodesic, closedForm, linear: squared distance of each surface's SRNF from the straight "
     "line, for the surfaces returned, the closed form and the linear blend. closedForm is null "
     "where the formula does not apply: it does not give both ends back to a relative energy of "
     "1e-4, since they are not star-shaped, or not in their radial parameterization, which a "
     "registered surface is not."},
    {"relativeEnergies", OUTPUT_OBJECT,
     "The same divided by the squared norm of the point on the line."},
    {"transforms", OUTPUT_NUMBER, "Cost in gradient transforms."},
    {"pullback", OUTPUT_OBJECT_OR_NULL,
     "Of method pullback, null otherwise: energy, length and speedVariation (standard deviation "
     "over mean) of the path in the pulled-back metric, speeds of its segments; the same three of "
     "the straight line between the surfaces (linear) and of the inverted straight line between "
     "the SRNFs (inverted); iterations, converged, gradient (relative)."},
    {"registration", OUTPUT_OBJECT_OR_NULL, "As" REGISTRATION_FIGURES_TEXT},
    BRIDGED_OUTPUT,
    LANDMARKS_OUTPUT,
    {NULL, NULL, NULL},
};

static void check(struct process_inputs *given)
{
    const json_t *method = json_object_get(given->canonical, "method");
    const json_t *steps = json_object_get(given->canonical, "steps");

    registration_one_spelling(given);
    landmarks_exclude(given, "register", false);
    if (steps && method && strcmp(json_string_value(method), methods[PULLBACK]) == 0 &&
        json_integer_value(steps) < PULLBACK_STEPS_MIN) {
        problem_add(given->list, "/inputs/steps", "pullback takes a path of %d surfaces or more",
                    PULLBACK_STEPS_MIN);
    }
}

static void complete(struct process_inputs *given)
{
    landmarks_complete(given, "from", "to", PROCESS_WARP_DEGREE_DEFAULT);
}

/* ---- The path -------------------------------------------------------------------------------- */

struct path {
    struct pair pair;
    struct srnf_register_options options;   /* of the registration */
    struct srnf_geodesic geodesic;          /* at the larger degree of the two */
    struct srnf_pullback_geodesic pullback; /* its figures, when asked for; steps 0 otherwise */
    struct srnf_surface_measures *measures; /* [steps] */
    double *squared_norms;                  /* [steps] of the straight line in Q */
    json_t *landmarks; /* what the registration leaves between them, and warnings */
};

static void path_clear(struct jobs_run *run, struct path *path)
{
    pair_clear(run, &path->pair);
    srnf_geodesic_clear(&path->geodesic);
    srnf_pullback_geodesic_clear(&path->pullback);
    srnf_free(path->measures);
    srnf_free(path->squared_norms);
    json_decref(path->landmarks);
}

/* Registers the second end to the first, whose place the registered one takes. */
static int register_end(struct jobs_run *run, const struct joining *joining, struct path *path,
                        struct jobs_result *result)
{
    struct pair *pair = &path->pair;
    struct landmarks landmarks = {.n = 0};
    int status;

    path->options = registration_pair_defaults(false);
    path->options.symmetric = joining->symmetric;
    jobs_run_phase(run, SHARE_REGISTRATION);
    status = landmarks_place(run, &joining->landmarks, pair, &landmarks, result);
    status = status ? status
                    : pair_register(run, pair, &path->options, (enum handedness)joining->handedness,
                                    result);
    status = status ? status : landmarks_report(run, &landmarks, pair, path->landmarks, result);
    landmarks_clear(&landmarks);
    if (status == 0) {
        memcpy(pair->coefficients + pair->count, pair->registration.coefficients,
               pair->count * sizeof(double));
    }
    return status;
}

/* The path between the ends. One in the pulled-back metric that was not straight in time is a
   result too. */
static int follow(struct jobs_run *run, const struct joining *joining, struct path *path,
                  struct jobs_result *result)
{
    const double *from = path->pair.coefficients, *to = from + path->pair.count;
    struct srnf_geodesic_options options = {.method = (enum srnf_geodesic_method)joining->method,
                                            .steps = (size_t)joining->steps};
    struct srnf_pullback_options pullback = srnf_pullback_options_defaults();
    const struct srnf_context *context = jobs_run_context(run);
    struct srnf_error error = {0};
    int status;

    pullback.segments = options.steps - 1;
    jobs_run_phase(run, 100.0);
    status =
        joining->method == PULLBACK
            ? srnf_pullback_curves(path->pair.sht, from, to, &pullback, context, &path->geodesic,
                                   &path->pullback, &error)
            : srnf_geodesic(path->pair.sht, from, to, &options, context, &path->geodesic, &error);
    return status < 0 ? compute_fail(result, status, &error, "following the geodesic") : 0;
}

/* Measures of the surfaces, which are then placed in space. */
static int measure(struct jobs_run *run, struct path *path, struct jobs_result *result)
{
    struct srnf_geodesic *geodesic = &path->geodesic;
    int status = SRNF_ENOMEM;

    path->measures = srnf_alloc(geodesic->steps, sizeof *path->measures);
    path->squared_norms = srnf_alloc(geodesic->steps, sizeof(double));
    if (path->measures && path->squared_norms) {
        status = srnf_surfaces_measure(path->pair.sht, geodesic->steps, geodesic->coefficients,
                                       jobs_run_context(run), path->measures);
    }
    if (status) {
        return compute_fail(result, status, NULL, "measuring the path");
    }
    srnf_geodesic_squared_norms(geodesic, path->measures[0].area,
                                path->measures[geodesic->steps - 1].area, path->squared_norms);
    srnf_geodesic_place(geodesic, path->measures);
    return 0;
}

static int compute(struct jobs_run *run, const struct joining *joining, struct path *path,
                   struct jobs_result *result)
{
    bool closed_form = joining->method == SRNF_GEODESIC_CLOSED_FORM;
    /* The closed form holds for star. */
    enum srnf_parameterization route =
        closed_form ? SRNF_PARAMETERIZATION_STAR : SRNF_PARAMETERIZATION_AUTO;
    int status = pair_load(run, joining->from, joining->to, route, SHARE_END, &path->pair, result);

    if (status == 0 && joining->registered) {
        status = register_end(run, joining, path, result);
    }
    if (status == 0) {
        status = follow(run, joining, path, result);
    }
    return status ? status : measure(run, path, result);
}

/* ---- Result ---------------------------------------------------------------------------------- */

/* The mesh that a surface of the path is the encoding of: only the ends have one. */
static const char *mesh_of(const struct path *path, size_t i)
{
    const struct compute_surface *end = &path->pair.ends[i > 0];
    bool is_end = i == 0 || i + 1 == path->geodesic.steps;

    return is_end && compute_is_mesh(end->id) ? end->id : NULL;
}

/* A mesh at an end was laid on the sphere by the route of its encoding, until it is registered. */
static const char *parameterization_of(const struct path *path, size_t i)
{
    if (i > 0 && i + 1 == path->geodesic.steps && path->pair.registration.coefficients) {
        return "registered";
    }
    return mesh_of(path, i) ? path->pair.ends[i > 0].route : "inherited";
}

/* The ends have their own routes, unless registered; the others what both have in common. */
static const char *route_of(struct jobs_run *run, const struct path *path, size_t i)
{
    const char *ids[2] = {path->pair.ends[0].id, path->pair.ends[1].id};
    const char *meshes =
        path->pair.ends[0].route ? path->pair.ends[0].route : path->pair.ends[1].route;
    bool last = i + 1 == path->geodesic.steps && !path->pair.registration.coefficients;

    if (i == 0 || last) {
        return routes_common(run, 1, ids + (i > 0), meshes);
    }
    return routes_common(run, path->pair.bridged ? 1 : 2, ids, meshes);
}

static json_t *frame_of(struct jobs_run *run, const struct path *path,
                        const struct surface_place *place, size_t i)
{
    const char *first = path->pair.ends[0].id;
    json_t *frame =
        i == 0
            ? surface_frame_json(first, "The coordinates that this surface came from.")
            : surface_frame_json(first, "The coordinates that the first surface of the path came "
                                        "from: the path stays where that was, and its last "
                                        "surface is not where its own mesh was.");

    return process_frame(run, first, place, frame);
}

/* Stores the surfaces of the path; their records, or NULL with the problem set. */
static json_t *keep_surfaces(struct jobs_run *run, const struct path *path,
                             struct jobs_result *result)
{
    const struct srnf_geodesic *geodesic = &path->geodesic;
    size_t count = 3 * srnf_coefficient_count(geodesic->degree);
    double scales[2] = {process_scale(run, path->pair.ends[0].id, path->pair.ends[0].scale),
                        process_scale(run, path->pair.ends[1].id, path->pair.ends[1].scale)};
    bool mirrored[2] = {process_mirrored(run, path->pair.ends[0].id),
                        process_mirrored(run, path->pair.ends[1].id)};
    /* The path is in the frame of its first surface. */
    const struct surface_place place = process_place(run, &path->pair.ends[0]);
    char name[64], reference[STORE_ID_MAX] = "";
    json_t *records = json_array(), *record;

    for (size_t i = 0; i < geodesic->steps; i++) {
        double t = geodesic->times[i];
        struct surface_description description = {
            .name = name,
            .degree = geodesic->degree,
            .coefficients = geodesic->coefficients + i * count,
            .scale = (1.0 - t) * scales[0] + t * scales[1],
            .measures = &path->measures[i],
            .parameterization = parameterization_of(path, i),
            .mirrored = (i + 1 == geodesic->steps || mirrored[0]) && (i == 0 || mirrored[1]),
            .route = route_of(run, path, i),
            .source = process_source(run, "geodesic", mesh_of(path, i), i ? reference : NULL),
            .origin = place.known ? place.origin : NULL,
            .rotation = place.known ? place.rotation : NULL,
            .frame_mesh = place.mesh,
            .frame = place.known ? frame_of(run, path, &place, i) : NULL,
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
    (void)json_object_update_new(
        document,
        json_pack("{s:o, s:o, s:o, s:I, s:b, s:o}", "speeds",
                  json_vector(pullback->speeds, pullback->steps - 1), "linear",
                  path_figures(&pullback->linear), "inverted", path_figures(&pullback->inverted),
                  "iterations", (json_int_t)pullback->iterations, "converged", pullback->converged,
                  "gradient", json_finite(pullback->gradient)));
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

static json_t *document_of(struct jobs_run *run, const struct joining *joining,
                           const struct path *path, json_t *surfaces)
{
    const struct srnf_geodesic *geodesic = &path->geodesic;
    double distance = joining->registered ? path->pair.registration.distance : geodesic->distance;
    json_t *warnings = json_array();
    json_t *document =
        json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "surfaces", surfaces,
                  "times", json_vector(geodesic->times, geodesic->steps), "distance",
                  json_finite(distance), "lineLength", json_finite(geodesic->distance), "length",
                  json_finite(geodesic->length), "energies", curves(geodesic, NULL),
                  "relativeEnergies", curves(geodesic, path->squared_norms), "transforms",
                  json_finite(geodesic->transforms), "pullback", pullback_document(&path->pullback),
                  "registration", alignment_json(&path->pair.registration, &path->options));

    registration_warn(document, &path->pair.registration, "to onto from");
    if (joining->method == SRNF_GEODESIC_CLOSED_FORM && !geodesic->closed_form_applies) {
        warning_add(warnings, "closed-form-inapplicable", NULL,
                    "The closed form does not give the ends themselves back: it is for star-shaped "
                    "surfaces in their radial parameterization, which a registered one is not. The "
                    "surfaces between have nothing to do with the ends; use method srnf.");
    }
    warnings_put(document, warnings);
    warnings_put(document, json_incref(json_object_get(path->landmarks, "warnings")));
    landmarks_settle(document);
    (void)json_object_set(document, "landmarks",
                          joining->registered ? json_object_get(path->landmarks, "landmarks")
                                              : json_null());
    registration_bridged(document, json_object_get(document, "registration"), path->pair.bridged);
    warnings_put(document, pair_warnings(run, &path->pair));
    return document;
}

/* ---- The process ----------------------------------------------------------------------------- */

static json_t *run_geodesic(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct joining *joining = typed;
    struct path path = {.landmarks = json_object()};
    json_t *surfaces, *document = NULL;

    if (compute(run, joining, &path, result) == 0) {
        surfaces = keep_surfaces(run, &path, result);
        document = surfaces ? document_of(run, joining, &path, surfaces) : NULL;
    }
    if (document && !joining->registered &&
        pair_warn_unregistered(run, path.pair.degree, path.pair.coefficients,
                               path.pair.coefficients + path.pair.count, "from and to", document,
                               result)) {
        json_decref(document);
        document = NULL;
    }
    path_clear(run, &path);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct joining),
    .check = check,
    .complete = complete,
    .run = run_geodesic,
};

const struct api_process geodesic_process = {
    .id = "geodesic",
    .title = "Geodesic between two surfaces",
    .description = "The path between two surfaces, the second registered to the first unless that "
                   "is not wanted: each point of the straight line between their SRNFs, inverted.",
    .methods = "A path between both shapes[, which were registered elastically,] was computed",
    .table = &table,
    .seconds = geodesic_seconds,
};
