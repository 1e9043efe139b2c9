/*
 * invert.c - the process invert over HTTP: schemas, canonical inputs, result document.
 *
 * What counts as a result: a surface whose relative energy reached the tolerance has converged
 * true. One that stopped at a minimum of positive energy ("stationary") is a result too, with
 * converged false: q then is not the SRNF of a surface of that degree, and the surface is a local
 * best. Where the iterations ran out, it depends on who set their number: an explicit
 * maxIterations asks how far that many lead and gives a result with converged false and stopped
 * "maxIterations"; the method's own limit is a failure, not-converged, which says how far it got.
 * The method closed-form gives what the formula does, with stopped "closedForm" where that is above
 * the tolerance.
 *
 * A q that is given is read by toolkit/field.c.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "toolkit/process.h"
#include "toolkit/routes.h"
#include "api/surfaces.h"
#include "api/warnings.h"
#include "compute/invert.h"

static const char *const names[] = {"srnf",      "initial",       "method", "lmax",
                                    "tolerance", "maxIterations", NULL};

/* In the order of enum srnf_inversion_method and of enum srnf_initial. */
static const char *const methods[] = {"auto",     "gauss-newton", "spectral",
                                      "gradient", "closed-form",  NULL};
static const char *const initials[] = {"auto", "sphere", "star", NULL};

static int index_of(const char *name, const char *const *choices)
{
    for (int i = 0; name && choices[i]; i++) {
        if (strcmp(name, choices[i]) == 0) {
            return i;
        }
    }
    return -1;
}

/* ---- Canonical inputs ------------------------------------------------------------------------ */

/* srnf in either form; returns the degree that lmax defaults to. */
static long read_srnf(struct process_inputs *inputs)
{
    const json_t *srnf = json_object_get(inputs->given, "srnf");
    const json_t *surface = json_object_get(srnf, "surface");
    long degree = PROCESS_DEGREE_DEFAULT;
    const char *id;

    if (!json_is_object(srnf)) {
        problem_add(inputs->list, "/inputs/srnf",
                    "is required: {\"surface\": id} or {\"lmax\", \"nTheta\", \"nPhi\", \"q\"}");
    } else if (!surface) {
        (void)json_object_set_new(inputs->canonical, "srnf",
                                  inputs_field(inputs, srnf, "/inputs/srnf", &degree));
    } else if (json_object_size(srnf) != 1) {
        problem_add(inputs->list, "/inputs/srnf",
                    "has either surface, or lmax, nTheta, nPhi and q, and nothing else");
    } else {
        id = inputs_surface_at(inputs, surface, "/inputs/srnf/surface", &degree);
        if (id) {
            (void)json_object_set_new(inputs->canonical, "srnf", json_pack("{s:s}", "surface", id));
        }
    }
    return degree;
}

/* initial: a word or an id. */
static void read_initial(struct process_inputs *inputs)
{
    const json_t *value = json_object_get(inputs->given, "initial");
    const char *text = json_string_value(value);
    long degree;

    if (text && (strncmp(text, "surf-", 5) == 0 || strncmp(text, "mesh-", 5) == 0)) {
        text = inputs_surface_at(inputs, value, "/inputs/initial", &degree);
        if (text) {
            (void)json_object_set_new(inputs->canonical, "initial", json_string(text));
        }
    } else if (text && index_of(text, initials) < 0) {
        problem_add(inputs->list, "/inputs/initial",
                    "must be auto, sphere, star or the id of a surface or a mesh");
    } else {
        (void)inputs_choice(inputs, "initial", initials);
    }
}

/* The methods that do not search have no place to start from. */
static void check_initial(struct process_inputs *inputs)
{
    const char *method = json_string_value(json_object_get(inputs->canonical, "method"));
    const char *initial = json_string_value(json_object_get(inputs->canonical, "initial"));
    bool direct = method && (strcmp(method, "closed-form") == 0 || strcmp(method, "spectral") == 0);

    if (direct && initial && strcmp(initial, "auto") != 0) {
        problem_add(inputs->list, "/inputs/initial",
                    "does not apply to the method %s, which starts from nothing; leave it out",
                    method);
    }
}

/* A q on a grid must resolve the degree asked for. */
static void check_grid(struct process_inputs *inputs, long lmax)
{
    const json_t *srnf = json_object_get(inputs->canonical, "srnf");
    json_int_t rows = json_integer_value(json_object_get(srnf, "nTheta"));
    json_int_t columns = json_integer_value(json_object_get(srnf, "nPhi"));

    if (rows && columns && (rows < lmax + 1 || columns < 2 * lmax + 1)) {
        problem_add(inputs->list, "/inputs/lmax",
                    "is %ld, but a grid of %lld x %lld resolves degree %lld at most", lmax,
                    (long long)rows, (long long)columns,
                    (long long)(rows - 1 < (columns - 1) / 2 ? rows - 1 : (columns - 1) / 2));
    }
}

json_t *invert_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    long degree;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    (void)inputs_choice(&inputs, "method", methods);
    (void)inputs_real(&inputs, "tolerance", PROCESS_TOLERANCE_MIN, PROCESS_TOLERANCE_MAX,
                      PROCESS_TOLERANCE_DEFAULT);
    (void)inputs_integer_or_null(&inputs, "maxIterations", 1, PROCESS_ITERATIONS_MAX);
    degree = read_srnf(&inputs);
    degree = inputs_integer(&inputs, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, degree);
    check_grid(&inputs, degree);
    read_initial(&inputs);
    check_initial(&inputs);
    return inputs_close(&inputs);
}

/* ---- Running --------------------------------------------------------------------------------- */

/* Fills typed from canonical inputs; *q is owned by the caller. False with the problem set. */
static bool typed_inputs(const json_t *inputs, struct compute_invert_inputs *typed, double **q,
                         struct jobs_result *result)
{
    const json_t *srnf = json_object_get(inputs, "srnf"), *values = json_object_get(srnf, "q");
    const char *initial = json_string_value(json_object_get(inputs, "initial"));
    int start = index_of(initial, initials);
    size_t nodes;

    typed->options = srnf_invert_options_defaults();
    typed->options.method = (enum srnf_inversion_method)index_of(
        json_string_value(json_object_get(inputs, "method")), methods);
    typed->options.initial = start < 0 ? SRNF_INITIAL_SURFACE : (enum srnf_initial)start;
    typed->initial_surface = start < 0 ? initial : NULL;
    typed->options.tolerance = json_number_value(json_object_get(inputs, "tolerance"));
    typed->options.max_iterations =
        (size_t)json_integer_value(json_object_get(inputs, "maxIterations"));
    typed->degree = (size_t)json_integer_value(json_object_get(inputs, "lmax"));
    typed->surface = json_string_value(json_object_get(srnf, "surface"));
    if (typed->surface) {
        return true;
    }
    typed->n_theta = (size_t)json_integer_value(json_object_get(srnf, "nTheta"));
    typed->n_phi = (size_t)json_integer_value(json_object_get(srnf, "nPhi"));
    nodes = typed->n_theta * typed->n_phi;
    *q = srnf_alloc(nodes, 3 * sizeof(double));
    if (!*q) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading q");
        return false;
    }
    for (size_t i = 0; i < nodes; i++) {
        for (size_t k = 0; k < 3; k++) {
            (*q)[k * nodes + i] = json_number_value(json_array_get(values, 3 * i + k));
        }
    }
    typed->q = *q;
    return true;
}

static json_t *history_json(const struct srnf_inversion *inversion)
{
    json_t *history = json_array();

    for (size_t i = 0; i < inversion->n_history; i++) {
        const struct srnf_iteration *step = &inversion->history[i];
        (void)json_array_append_new(
            history, json_pack("{s:I, s:o, s:o, s:o}", "iteration", (json_int_t)i, "energy",
                               json_finite(step->energy), "seconds", json_finite(step->seconds),
                               "transforms", json_finite(step->transforms)));
    }
    return history;
}

static json_t *certificate_json(const struct srnf_certificate *certificate)
{
    if (!certificate->computed) {
        return json_null();
    }
    return json_pack("{s:o, s:o, s:o, s:b}", "residual", json_finite(certificate->residual),
                     "secondEigenvalue", json_finite(certificate->second_eigenvalue), "threshold",
                     json_finite(certificate->threshold), "unique", certificate->unique);
}

static json_t *result_document(const struct compute_invert_outputs *outputs, json_t *surface)
{
    const struct srnf_inversion *inversion = &outputs->inversion;
    json_t *document = json_object(), *warnings = json_array();
    bool applies = inversion->closed_form_relative_energy <= SRNF_CLOSED_FORM_APPLIES;
    const struct {
        const char *name;
        json_t *value;
    } members[] = {
        {"surface", surface},
        {"energy", json_finite(inversion->energy)},
        {"relativeEnergy", json_finite(inversion->relative_energy)},
        {"gradientNorm", json_finite(inversion->gradient_norm)},
        {"iterations", json_integer((json_int_t)inversion->iterations)},
        {"transforms", json_finite(inversion->transforms)},
        {"converged", json_boolean(inversion->converged)},
        {"stopped", json_string(srnf_stop_name(inversion->stopped))},
        {"method", json_string(methods[inversion->method])},
        {"history", history_json(inversion)},
        {"certificate", certificate_json(&inversion->certificate)},
        {"smallestSingularValue", inversion->smallest_singular_value > 0.0
                                      ? json_finite(inversion->smallest_singular_value)
                                      : json_null()},
        {"surfaceErrorBound", inversion->surface_error_bound >= 0.0
                                  ? json_finite(inversion->surface_error_bound)
                                  : json_null()},
        {"surfaceError",
         outputs->surface_error >= 0.0 ? json_finite(outputs->surface_error) : json_null()},
        {"flipped", json_boolean(inversion->flipped)},
        {"closedForm",
         json_pack("{s:o}", "relativeEnergy",
                   applies ? json_finite(inversion->closed_form_relative_energy) : json_null())},
    };

    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        (void)json_object_set_new(document, members[i].name, members[i].value);
    }
    if (inversion->stopped == SRNF_STOP_CLOSED_FORM && !applies) {
        warning_add(
            warnings, "closed-form-inapplicable",
            json_pack("{s:f}", "relativeEnergy", inversion->relative_energy),
            "The closed form does not give this SRNF back: it is for star-shaped surfaces in "
            "their radial parameterisation. The surface has nothing to do with q; use method "
            "auto.");
    }
    warnings_put(document, warnings);
    return document;
}

/* The method's own limit was reached: a failure that says how far it got. */
static bool ran_out(const struct compute_invert_inputs *typed,
                    const struct srnf_inversion *inversion, struct jobs_result *result)
{
    if (inversion->converged || inversion->stopped != SRNF_STOP_MAX_ITERATIONS ||
        typed->options.max_iterations > 0 || !isfinite(inversion->relative_energy)) {
        return false;
    }
    result->problem_code = "not-converged";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "The relative energy is %.3g after %zu iterations of %s and still falling; the "
                   "tolerance is %.3g. Give maxIterations to get the surface as it is then.",
                   inversion->relative_energy, inversion->iterations, methods[inversion->method],
                   typed->options.tolerance);
    return true;
}

/* The scale of a surface given carries over to its reconstruction: q has the units of that
   surface. */
static double scale_of(struct jobs_run *run, const struct compute_surface *truth)
{
    if (truth->coefficients) {
        return process_scale(run, truth->id, truth->scale);
    }
    return truth->scale > 0.0 ? truth->scale : 1.0;
}

static json_t *keep_surface(struct jobs_run *run, const struct compute_invert_inputs *typed,
                            const struct compute_invert_outputs *outputs,
                            struct jobs_result *result)
{
    const char *id = typed->surface;
    struct surface_description description = {
        .name = "inverted",
        .degree = typed->degree,
        .coefficients = outputs->inversion.coefficients,
        .scale = scale_of(run, &outputs->truth),
        .measures = &outputs->measures,
        .parameterization = "inherited",
        .route = id ? routes_common(run, 1, &id, outputs->truth.route) : NULL,
        .source = process_source(run, "invert", NULL, NULL),
    };

    return process_keep_surface(run, &description, "the surface", result);
}

/* The inputs of the results document: q by its digest. */
static json_t *inputs_for_results(const json_t *inputs)
{
    json_t *copy = json_deep_copy(inputs);

    field_by_digest(json_object_get(copy, "srnf"));
    return copy;
}

void invert_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *surface, *echoed;
    struct compute_invert_inputs typed = {0};
    struct compute_invert_outputs outputs = {0};
    double *q = NULL;

    (void)api;
    if (!inputs) {
        return;
    }
    if (!typed_inputs(inputs, &typed, &q, result) ||
        compute_invert(run, &typed, &outputs, result) ||
        ran_out(&typed, &outputs.inversion, result)) {
        goto out;
    }
    surface = keep_surface(run, &typed, &outputs, result);
    if (surface) {
        echoed = inputs_for_results(inputs);
        process_finish(run, result_document(&outputs, surface), echoed, result);
        json_decref(echoed);
    }
out:
    compute_invert_clear(&outputs);
    srnf_free(q);
    json_decref(inputs);
}
