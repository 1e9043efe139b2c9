/*
 * invert.c - the process invert: from an SRNF to the surface that has it.
 *
 * What counts as a result: a surface whose relative energy reached the tolerance has converged
 * true. One that stopped at a minimum of positive energy ("stationary") is a result too, with
 * converged false: q then is not the SRNF of a surface of that degree, and the surface is a local
 * best. Where the iterations ran out, it depends on who set their number: an explicit
 * maxIterations asks how far that many lead and gives a result with converged false and stopped
 * "maxIterations"; the method's own limit is a failure, not-converged, which says how far it got.
 * closed-form gives what the formula does, with stopped "closedForm" where above the tolerance.
 *
 * The result is moved to its area centroid: an SRNF does not know translations, and stored surfaces
 * are centred by convention. Its orientation follows the core: positive volume.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/answers.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"
#include "toolkit/table.h"
#include "toolkit/target.h"
#include "api/surfaces.h"
#include "api/warnings.h"

#define SHARE_MESH 30.0 /* percent of the job that encoding a mesh takes */

struct start {
    enum srnf_initial initial;
    char surface[STORE_ID_MAX]; /* of SRNF_INITIAL_SURFACE */
};

struct inverting {
    struct target target;
    struct start start;
    int method, certificate;
    long degree, max_iterations;
    double tolerance;
};

/* In the order of enum srnf_inversion_method and of enum srnf_initial. */
static const char *const methods[] = {"auto",     "gauss-newton", "spectral",
                                      "gradient", "closed-form",  NULL};
static const char *const initials[] = {"auto", "sphere", "star", NULL};
enum certificate { CERTIFICATE_AUTO, CERTIFICATE_NONE, CERTIFICATE_REQUIRE };
static const char *const certificates[] = {"auto", "none", "require", NULL};

/* ---- The input initial ----------------------------------------------------------------------- */

static enum srnf_initial initial_of(const char *name)
{
    int i = 0;

    while (initials[i] && strcmp(name, initials[i]) != 0) {
        i++;
    }
    return initials[i] ? (enum srnf_initial)i : SRNF_INITIAL_SURFACE;
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

/* A word or an id. */
static void read_start(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(value);
    long degree;

    if (text && (strncmp(text, "surf-", 5) == 0 || strncmp(text, "mesh-", 5) == 0)) {
        text = inputs_surface_at(inputs, value, "/inputs/initial", &degree);
        if (text) {
            (void)json_object_set_new(inputs->canonical, input->name, json_string(text));
        }
    } else if (value && (!text || initial_of(text) == SRNF_INITIAL_SURFACE)) {
        problem_add(inputs->list, "/inputs/initial",
                    "must be auto, sphere, star or the id of a surface or a mesh");
    } else {
        (void)inputs_choice(inputs, input->name, initials);
    }
    check_initial(inputs);
}

static bool type_start(const json_t *value, void *member)
{
    const char *text = json_string_value(value);
    struct start *start = member;

    start->initial = text ? initial_of(text) : SRNF_INITIAL_AUTO;
    if (start->initial == SRNF_INITIAL_SURFACE) {
        (void)snprintf(start->surface, sizeof start->surface, "%s", text);
    }
    return text != NULL;
}

static const struct input_own start_input = {
    .schema = "\"oneOf\":[{\"enum\":[\"auto\",\"sphere\",\"star\"]},{\"type\":\"string\","
              "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}],\"default\":\"auto\"",
    .read = read_start,
    .type = type_start,
    .refers = true,
};

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

#define AT(member) offsetof(struct inverting, member)
static const struct process_input inputs[] = {
    {"srnf", INPUT_OWN, AT(target),
     "The SRNF: of a surface (or of a mesh, encoded with the default options, for the method "
     "closed-form by star), or its values q [nTheta][nPhi][3], nested or flat, on the "
     "Gauss-Legendre grid with nTheta at least lmax + 1 and nPhi at least 2 lmax + 1.",
     .required = true, .own = &target_input},
    {"initial", INPUT_OWN, AT(start),
     "Where the search starts: the unit sphere, turned to fit; the closed form; a surface. auto "
     "takes the closed form where it is good and the sphere otherwise. Of the methods that search "
     "only: with closed-form and spectral it is left out or auto.",
     .own = &start_input},
    {"method", INPUT_CHOICE, AT(method),
     "gauss-newton: Levenberg-Marquardt with conjugate gradients; spectral: the linear "
     "eigenproblem, for exact SRNFs; gradient: descent as in the paper; closed-form: for "
     "star-shaped surfaces in their radial parameterization.",
     .choices = methods},
    {"lmax", INPUT_INTEGER, AT(degree),
     "Degree of the result. Default: that of the surface, or of srnf.", .lowest = SRNF_DEGREE_MIN,
     .highest = SRNF_DEGREE_MAX, .derived = true},
    {"tolerance", INPUT_REAL, AT(tolerance), "On the energy relative to the squared norm of q.",
     .lowest = PROCESS_TOLERANCE_MIN, .highest = PROCESS_TOLERANCE_MAX,
     .fallback = PROCESS_TOLERANCE_DEFAULT},
    {"maxIterations", INPUT_INTEGER, AT(max_iterations),
     "Of iterations, in all searches together; the eigenproblem, which auto and spectral solve "
     "besides, has none. null: the method's own limit, which is a failure when it is reached. A "
     "number given here makes the surface reached by then a result, with converged false.",
     .lowest = 1, .highest = PROCESS_ITERATIONS_MAX, .nullable = true},
    {"certificate", INPUT_CHOICE, AT(certificate),
     "auto: how far off the surface can be, and whether it is the only one of its degree, where "
     "that can be computed; none: neither, in less time; require, up to degree " PROCESS_TEXT(
         SRNF_CERTIFIED_DEGREE_MAX) ": a failure, not-certified, unless the surface is "
                                    "proved to be the only one.",
     .choices = certificates},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"surface", OUTPUT_OBJECT,
     "Record of the surface: positive volume, centred at its area centroid."},
    {"energy", OUTPUT_NUMBER, "||Q(f) - q||^2."},
    {"relativeEnergy", OUTPUT_NUMBER, "The same divided by ||q||^2."},
    {"gradientNorm", OUTPUT_NUMBER_OR_NULL, "Of the energy in the coefficients: 0 at a minimum."},
    {"iterations", OUTPUT_INTEGER,
     "Steps that were tried, accepted or refused, in all searches together, and those that take a "
     "solution on beyond the tolerance; without the work of the eigenproblem."},
    {"transforms", OUTPUT_NUMBER, "Cost in gradient transforms of three coordinates."},
    {"converged", OUTPUT_BOOLEAN,
     "Whether relativeEnergy reached the tolerance (stopped is then tolerance)."},
    {"stopped", "\"enum\":[\"tolerance\",\"stationary\",\"maxIterations\",\"closedForm\"]",
     "tolerance: solved; stationary: a minimum of positive energy; maxIterations: it was still "
     "falling; closedForm: what the method closed-form gives, above the tolerance."},
    {"method", OUTPUT_STRING, "The method that produced the result."},
    {"history", OUTPUT_OBJECTS,
     "[{iteration, energy, seconds, transforms}]: the start, each step that was accepted, and each "
     "surface of the eigenproblem that was kept. iteration numbers these, from 0; the last may "
     "differ from iterations."},
    {"certificate", OUTPUT_OBJECT_OR_NULL,
     "residual, secondEigenvalue, threshold, unique; null where it was not computed. Where unique "
     "is false, secondEigenvalue is a bound from above."},
    {"smallestSingularValue", OUTPUT_NUMBER_OR_NULL,
     "Of the differential of Q at the surface, translations left out; null where it was not "
     "computed."},
    {"surfaceErrorBound", OUTPUT_NUMBER_OR_NULL,
     "L2 distance to the true surface, in the units of q."},
    {"surfaceError", OUTPUT_NUMBER_OR_NULL,
     "L2 distance to the surface given, translations left out, at unit area; null where there is "
     "none of this degree."},
    {"flipped", OUTPUT_BOOLEAN, "The mirror image was found first."},
    {"closedForm", OUTPUT_OBJECT,
     "relativeEnergy of the closed form; null above 1e-4, where it does not apply: q is not the "
     "SRNF of a star-shaped surface in its radial parameterization."},
    {NULL, NULL, NULL},
};

/* No job is made that can end in no other way than not-certified. */
static void complete(struct process_inputs *given)
{
    long degree = (long)json_integer_value(json_object_get(given->canonical, "lmax"));

    if (degree > SRNF_CERTIFIED_DEGREE_MAX &&
        inputs_chose(given->canonical, "certificate", "require")) {
        problem_add(given->list, "/inputs/certificate",
                    "cannot be require: there is a certificate up to degree %d, and lmax is %ld",
                    SRNF_CERTIFIED_DEGREE_MAX, degree);
    }
}

/* ---- Inverting ------------------------------------------------------------------------------- */

struct inverted {
    struct sampled sampled;
    struct srnf_inversion inversion;
    struct srnf_surface_measures measures; /* of the result, centred at its area centroid */
    double surface_error; /* from the surface given; below 0 where there is none of this degree */
};

/* The surface to start from, at the degree of the result: [3][(degree+1)^2], srnf_free. */
static int load_start(struct jobs_run *run, const char *id, size_t degree, double **start,
                      struct jobs_result *result)
{
    struct compute_surface surface = {0};
    int status = compute_surface_load(run, id, SHARE_MESH, &surface, result);

    if (status == 0) {
        *start = srnf_alloc(srnf_coefficient_count(degree), 3 * sizeof(double));
        if (*start) {
            srnf_surface_change_degree(surface.degree, surface.coefficients, degree, *start);
        } else {
            status = compute_fail(result, SRNF_ENOMEM, NULL, "preparing the initial surface");
        }
    }
    compute_surface_clear(&surface);
    return status;
}

static double error_of(const struct inverted *inverted, size_t degree)
{
    const struct sampled *sampled = &inverted->sampled;
    struct srnf_surface_measures measures;

    if (!sampled->truth.coefficients || sampled->truth.degree != degree) {
        return -1.0;
    }
    srnf_surface_measure(sampled->forward, sampled->truth.coefficients, &measures,
                         sampled->workspace);
    return srnf_surface_error(degree, sampled->truth.coefficients, &measures,
                              inverted->inversion.coefficients);
}

static int search(struct jobs_run *run, const struct inverting *inverting, const double *start,
                  struct inverted *inverted, struct jobs_result *result)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    const double origin[3] = {0.0, 0.0, 0.0};
    struct srnf_inversion *inversion = &inverted->inversion;
    size_t degree = (size_t)inverting->degree;
    struct srnf_error error = {0};
    int status;

    options.method = (enum srnf_inversion_method)inverting->method;
    options.initial = inverting->start.initial;
    options.surface = start;
    options.tolerance = inverting->tolerance;
    options.max_iterations = (size_t)inverting->max_iterations;
    options.certify = inverting->certificate != CERTIFICATE_NONE;
    jobs_run_phase(run, 100.0);
    status = srnf_invert(inverted->sampled.sht, inverted->sampled.q, &options,
                         jobs_run_context(run), inversion, &error);
    if (status < 0) {
        return compute_fail(result, status, &error, "inverting the SRNF");
    }
    status = compute_measure(run, degree, 1, inversion->coefficients, &inverted->measures, result);
    if (status == 0) {
        srnf_surface_move(degree, inversion->coefficients, &inverted->measures, origin);
        inverted->surface_error = error_of(inverted, degree);
    }
    return status;
}

static int compute(struct jobs_run *run, const struct inverting *inverting,
                   struct inverted *inverted, struct jobs_result *result)
{
    /* The closed form holds for star. */
    enum srnf_parameterization route = inverting->method == SRNF_INVERT_CLOSED_FORM
                                           ? SRNF_PARAMETERIZATION_STAR
                                           : SRNF_PARAMETERIZATION_AUTO;
    size_t degree = (size_t)inverting->degree;
    double *start = NULL;
    int status =
        target_open(run, &inverting->target, degree, route, SHARE_MESH, &inverted->sampled, result);

    if (status == 0 && inverting->start.surface[0]) {
        status = load_start(run, inverting->start.surface, degree, &start, result);
    }
    if (status == 0) {
        status = search(run, inverting, start, inverted, result);
    }
    srnf_free(start);
    return status;
}

/* ---- Result ---------------------------------------------------------------------------------- */

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

/* null where it was not computed. */
static json_t *where(bool computed, double number)
{
    return computed ? json_finite(number) : json_null();
}

/* Where the tolerance was not reached, and not-reached does not tell of more. */
static void warn_converged(const struct inverting *inverting,
                           const struct srnf_inversion *inversion, json_t *warnings)
{
    bool fell = inversion->stopped == SRNF_STOP_MAX_ITERATIONS;

    if (inversion->converged || inversion->stopped == SRNF_STOP_CLOSED_FORM ||
        inversion->relative_energy > ANSWERS_REACHED) {
        return;
    }
    warning_add(
        warnings, "inversion-not-converged",
        json_pack("{s:o, s:f, s:s}", "relativeEnergy", json_finite(inversion->relative_energy),
                  "tolerance", inverting->tolerance, "stopped", srnf_stop_name(inversion->stopped)),
        "No surface with this SRNF was found: that of the surface is %.2g %% of its norm from it "
        "(relativeEnergy %.3g, where the tolerance is %.2g). %s",
        100.0 * sqrt(inversion->relative_energy), inversion->relative_energy, inverting->tolerance,
        fell ? "The iterations ran out while that still fell: raise maxIterations, or take another "
               "method."
             : "It is the nearest one around: no surface of this degree may have the SRNF, as "
               "where noise was added to it or the surface had a higher degree (raise lmax), or "
               "one is to be found from another start (initial) or by another method.");
}

static json_t *document_of(const struct inverting *inverting, const struct inverted *inverted,
                           json_t *surface)
{
    const struct srnf_inversion *inversion = &inverted->inversion;
    bool applies = inversion->closed_form_relative_energy <= SRNF_CLOSED_FORM_APPLIES;
    json_t *warnings = json_array();
    json_t *document = json_pack(
        "{s:o, s:o, s:o, s:o, s:I, s:o, s:b, s:s, s:s, s:o, s:o, s:o, s:o, s:o, s:b, s:{s:o}}",
        "surface", surface, "energy", json_finite(inversion->energy), "relativeEnergy",
        json_finite(inversion->relative_energy), "gradientNorm",
        json_finite(inversion->gradient_norm), "iterations", (json_int_t)inversion->iterations,
        "transforms", json_finite(inversion->transforms), "converged", inversion->converged,
        "stopped", srnf_stop_name(inversion->stopped), "method", methods[inversion->method],
        "history", history_json(inversion), "certificate",
        certificate_json(&inversion->certificate), "smallestSingularValue",
        where(inversion->smallest_singular_value > 0.0, inversion->smallest_singular_value),
        "surfaceErrorBound",
        where(inversion->surface_error_bound >= 0.0, inversion->surface_error_bound),
        "surfaceError", where(inverted->surface_error >= 0.0, inverted->surface_error), "flipped",
        inversion->flipped, "closedForm", "relativeEnergy",
        where(applies, inversion->closed_form_relative_energy));

    if (inversion->stopped == SRNF_STOP_CLOSED_FORM && !applies) {
        warning_add(
            warnings, "closed-form-inapplicable",
            json_pack("{s:f}", "relativeEnergy", inversion->relative_energy),
            "The closed form does not give this SRNF back: it is for star-shaped surfaces in "
            "their radial parameterization. The surface has nothing to do with q; use method "
            "auto.");
    }
    warn_converged(inverting, inversion, warnings);
    warnings_put(document, warnings);
    return document;
}

/* The method's own limit was reached: a failure that says how far it got. */
static bool ran_out(const struct inverting *inverting, const struct srnf_inversion *inversion,
                    struct jobs_result *result)
{
    if (inversion->converged || inversion->stopped != SRNF_STOP_MAX_ITERATIONS ||
        inverting->max_iterations > 0 || !isfinite(inversion->relative_energy)) {
        return false;
    }
    result->problem_code = "not-converged";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "The relative energy is %.3g after %zu iterations of %s and still falling; the "
                   "tolerance is %.3g. Give maxIterations to get the surface as it is then.",
                   inversion->relative_energy, inversion->iterations, methods[inversion->method],
                   inverting->tolerance);
    return true;
}

/* A proof was asked for, and there is none: a failure that says why. */
static bool lacks_proof(const struct inverting *inverting, const struct srnf_inversion *inversion,
                        struct jobs_result *result)
{
    const struct srnf_certificate *certificate = &inversion->certificate;

    if (inverting->certificate != CERTIFICATE_REQUIRE || certificate->unique) {
        return false;
    }
    result->problem_code = "not-certified";
    if (certificate->computed) {
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "The surface may have neighbours with the same normals: the second "
                       "eigenvalue is at most %.2g, and means something only above %.2g. Convex "
                       "surfaces and those near them cannot be certified.",
                       certificate->second_eigenvalue, certificate->threshold);
    } else if (inversion->stopped == SRNF_STOP_CLOSED_FORM &&
               inversion->closed_form_relative_energy > SRNF_CLOSED_FORM_APPLIES) {
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "The closed form does not give this SRNF back: it is for star-shaped "
                       "surfaces in their radial parameterization. There is a certificate only of "
                       "an inversion that reaches its tolerance; the relative energy that is left "
                       "is %.2g, the tolerance %.2g. Use method auto.",
                       inversion->relative_energy, inverting->tolerance);
    } else if (!inversion->converged) {
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "There is a certificate only of an inversion that reaches its tolerance; "
                       "the relative energy that is left is %.2g, the tolerance %.2g.",
                       inversion->relative_energy, inverting->tolerance);
    } else {
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "There is a certificate only up to degree %d and for exact SRNFs; here the "
                       "degree is %ld and the relative energy that is left %.2g.",
                       SRNF_CERTIFIED_DEGREE_MAX, inverting->degree, inversion->relative_energy);
    }
    return true;
}

static json_t *keep_surface(struct jobs_run *run, const struct inverting *inverting,
                            const struct inverted *inverted, struct jobs_result *result)
{
    const char *id = inverting->target.surface;
    const struct compute_surface *truth = &inverted->sampled.truth;
    struct surface_description description = {
        .name = "inverted",
        .degree = (size_t)inverting->degree,
        .coefficients = inverted->inversion.coefficients,
        /* q has the units of the surface given */
        .scale = truth->coefficients ? process_scale(run, truth->id, truth->scale) : 1.0,
        .measures = &inverted->measures,
        .parameterization = "inherited",
        .route = id[0] ? routes_common(run, 1, &id, truth->route) : NULL,
        .source = process_source(run, "invert", NULL, NULL),
    };

    return process_keep_surface(run, &description, "the surface", result);
}

static json_t *run_invert(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct inverting *inverting = typed;
    struct inverted inverted = {.surface_error = -1.0};
    json_t *surface, *document = NULL;

    if (compute(run, inverting, &inverted, result) == 0 &&
        !ran_out(inverting, &inverted.inversion, result) &&
        !lacks_proof(inverting, &inverted.inversion, result)) {
        surface = keep_surface(run, inverting, &inverted, result);
        document = surface ? document_of(inverting, &inverted, surface) : NULL;
    }
    target_close(run, &inverted.sampled);
    srnf_inversion_clear(&inverted.inversion);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct inverting),
    .complete = complete,
    .run = run_invert,
};

const struct api_process invert_process = {
    .id = "invert",
    .title = "Invert a square-root normal field",
    .description = "From an SRNF to the surface that has it, with the energy that is left, what "
                   "proves the surface right and how far off it can be.",
    .table = &table,
    .seconds = invert_seconds,
    .guessed = true, /* it goes on until a tolerance is met */
};
