/*
 * register.c - the process register: a moving surface laid on a template.
 *
 * Both are brought to the larger of their degrees. The registered surface stays where the rotation
 * about the origin has put it: stored surfaces are centred by convention, and a centred one stays
 * so up to its truncation.
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

#include "toolkit/group.h"
#include "toolkit/landmarks.h"
#include "toolkit/pair.h"
#include "toolkit/registration_options.h"
#include "toolkit/registration_report.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"
#include "toolkit/table.h"
#include "api/surfaces.h"
#include "api/warnings.h"

#define SHARE_END 15.0 /* percent of the job that encoding a mesh takes */

struct penalty {
    double jacobian, displacement;
};

struct registering {
    char fixed[STORE_ID_MAX], moving[STORE_ID_MAX];
    bool rotation, reparameterization, common_pose, symmetric, exact;
    long degree;
    int start, handedness;
    struct penalty penalty;
    struct landmarks_input landmarks;
};

/* ---- Penalty --------------------------------------------------------------------------------- */

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

static void read_penalty(struct process_inputs *inputs, const struct process_input *input)
{
    const struct srnf_register_options defaults = srnf_register_options_defaults();
    const json_t *value = json_object_get(inputs->given, input->name);
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
    (void)json_object_set_new(inputs->canonical, input->name, canonical);
}

/* From the canonical spelling. */
static bool type_penalty(const json_t *value, void *member)
{
    const struct srnf_register_options defaults = srnf_register_options_defaults();
    const char *text = json_string_value(value);
    struct penalty *penalty = member;

    if (text && strcmp(text, "none") == 0) {
        *penalty = (struct penalty){0.0, 0.0};
    } else if (text) {
        *penalty = (struct penalty){defaults.penalty_jacobian, defaults.penalty_displacement};
    } else {
        penalty->jacobian = json_number_value(json_object_get(value, "jacobian"));
        penalty->displacement = json_number_value(json_object_get(value, "displacement"));
    }
    return true;
}

#define WEIGHT_MAX PROCESS_TEXT(PROCESS_PENALTY_MAX)
#define WEIGHT "\"type\":\"number\",\"minimum\":0,\"maximum\":" WEIGHT_MAX ",\"default\":"
static const struct input_own penalty = {
    .schema = "\"oneOf\":[{\"enum\":[\"default\",\"none\"]},{\"type\":\"object\","
              "\"additionalProperties\":false,\"properties\":{\"jacobian\":{" WEIGHT "0.003},"
              "\"displacement\":{" WEIGHT "0.01}}}],\"default\":\"default\"",
    .read = read_penalty,
    .type = type_penalty,
};

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

#define AT(member) offsetof(struct registering, member)
static const struct process_input inputs[] = {
    {"template", INPUT_SURFACE, AT(fixed),
     "The surface to register to. A mesh is encoded with the default options.", .required = true},
    {"moving", INPUT_SURFACE, AT(moving),
     "The surface that is moved. A mesh is encoded with the default options.", .required = true},
    {"rotation", INPUT_BOOLEAN, AT(rotation), "Rotate the moving surface.", .fallback = 1},
    {"reparameterization", INPUT_BOOLEAN, AT(reparameterization), "Warp the sphere under it.",
     .fallback = 1},
    {"degree", INPUT_INTEGER, AT(degree), "Of the fields that generate the warp.", .lowest = 1,
     .highest = PROCESS_WARP_DEGREE_MAX, .fallback = PROCESS_WARP_DEGREE_DEFAULT},
    {"penalty", INPUT_OWN, AT(penalty),
     "Weights of the integrals of (1 + J) (log J)^4 and of the squared displacement, against the "
     "squared distance relative to the area of the template.",
     .own = &penalty},
    {"start", INPUT_CHOICE, AT(start),
     "tournament: many rotations, narrowed down while the warps grow; rigid: the best rotation; "
     "identity: as the surfaces are.",
     .choices = registration_starts},
    COMMON_POSE_INPUT(registering,
                      "The surfaces share a pose: nothing is rotated, the start is identity."),
    SYMMETRIC_INPUT(
        registering, 0,
        "Both ways, and the better one counts: the same distance from either side, "
        "that of distances and geodesic, in 1.3 to 2 times the time. false searches one "
        "way (of ten pairs of real surfaces the distance was up to 11 % larger)."),
    {"exact", INPUT_BOOLEAN, AT(exact),
     "For surfaces that differ by a warp alone: no penalty, up to degree 32.", .fallback = 0},
    LANDMARKS_INPUT(registering, landmarks_of_register),
    HANDEDNESS_INPUT(registering,
                     "the mirror image of the moving surface as well, registered where names or a "
                     "quick rigid match suggest two sides, and to warn where it"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"surface", OUTPUT_OBJECT, "Record of the moving surface, registered."},
    {"rotation", OUTPUT_MATRIX, "3x3, row by row: of the moving surface in space."},
    {"distance", OUTPUT_NUMBER_OR_NULL,
     "L2 distance of the template's SRNF from the registered SRNF of the moving surface, before "
     "its degree cuts anything off. 0 to 2 at unit area. It depends on degree and penalty "
     "(registration); with symmetric and the defaults it is that of distances and geodesic."},
    {"distanceBefore", OUTPUT_NUMBER_OR_NULL,
     "The same for the surfaces as they were given, in their poses and parameterizations: no "
     "measure of shape, and none of what registration achieved."},
    {"objective", OUTPUT_NUMBER_OR_NULL,
     "What was minimized: squared distance relative to the area of the template (with symmetric, "
     "to the geometric mean of both areas), and the penalties."},
    {"minJacobian", OUTPUT_NUMBER_OR_NULL,
     "Least factor by which the warp scales areas of the sphere, on a grid finer by half; above "
     "0, nothing folds. Ten pairs of brain structures, ventricles and asteroids, at degrees 8, 15 "
     "and 31, had 0.24 to 0.92. A tenth is doubtful: warning registration-distorted."},
    {"maxJacobian", OUTPUT_NUMBER_OR_NULL,
     "The largest factor. The same pairs had 1.1 to 3.4. Ten is doubtful: warning "
     "registration-distorted."},
    {"inverseConsistency", OUTPUT_NUMBER_OR_NULL,
     "Relative gap between the objectives of the two ways, before the better one was kept and "
     "improved: how much one search may miss. The same pairs had up to 0.07. null unless "
     "symmetric."},
    {"ambiguity", OUTPUT_OBJECT,
     "objective: of the best start in another basin, relative to the best, and angle, between the "
     "two maps in radians; null where there was none. rotationalCurvature: smallest eigenvalue of "
     "the energy over rotations of the sphere; null where none were tried. Up to 1.05, or a "
     "curvature below 0.02 (real ventricles, nearly of revolution, 0.04 to 0.08; other shapes "
     "above 0.1), pose and correspondence are one choice among several: warning "
     "registration-ambiguous."},
    {"truncationError", OUTPUT_NUMBER_OR_NULL,
     "Distance of the registered surface's own SRNF from the registered one, relative to the norm "
     "of that, 1 at unit area: what the degree of the surface cuts off. Read it against distance. "
     "Searched both ways, the same pairs had 0.24 to 2.4 of it at degree 8, 0.12 to 2.7 at 15 and "
     "0.08 to 1.8 at 31, ventricles at most 0.33, 0.22 and 0.14. Above half of it the registered "
     "surface, and paths to it, say little (warning registration-truncated): encode with a higher "
     "lmax. The distance is measured before the cut."},
    {"iterations", OUTPUT_INTEGER, "Steps over all starts, degrees and ways."},
    {"converged", OUTPUT_BOOLEAN,
     "False where stopped is maxIterations: the steps ran out (warning "
     "registration-not-converged)."},
    {"stopped",
     "\"enum\":[\"direct\",\"tolerance\",\"stationary\",\"stepRefused\",\"maxIterations\"]",
     "Why the search ended, at its highest degree; where symmetric, the worst reason of the "
     "searches that got there (of both ways up to degree 8, with landmarks, exact or start rigid, "
     "else of the better one alone), unless the one that is kept is registered to rounding. "
     "direct: there was none, nothing was warped or rotated; tolerance: registered to rounding; "
     "stationary: the last steps gained too little; stepRefused: no step, however short, gains "
     "anything; maxIterations: the steps of that degree ran out."},
    {"symmetric", OUTPUT_BOOLEAN,
     "Both ways were searched: the distance is the same from either side."},
    {"note", OUTPUT_STRING, "How it was searched, in a sentence."},
    BRIDGED_OUTPUT,
    {"registration", OUTPUT_OBJECT, "Degree, penalty and all other options."},
    LANDMARKS_OUTPUT,
    {"warp", OUTPUT_OBJECT,
     "links: maps of the sphere to be applied in order, each a rotation (matrix), or exp or "
     "exp-inverse (p to exp_p(w(p)), w = grad phi + p x grad psi, and its inverse; harmonic "
     "coefficients of phi and psi), or series (p to g(p)/|g(p)|; harmonic coefficients x, y and z "
     "of g); grid: where they take the nodes of the template's grid, and their Jacobian there."},
    {NULL, NULL, NULL},
};

/* ---- Result ---------------------------------------------------------------------------------- */

static const char *const link_kinds[] = {"rotation", "exp", "exp-inverse", "series"};

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

static json_t *warp_json(const struct pair *pair)
{
    const struct srnf_registration *registration = &pair->registration;
    const struct srnf_grid *grid = srnf_sht_grid(pair->sht);
    const size_t shape[3] = {grid->n_theta, grid->n_phi, 3};
    json_t *links = json_array();

    for (size_t i = 0; i < registration->warp.n_links; i++) {
        (void)json_array_append_new(links, link_json(&registration->warp.links[i]));
    }
    return json_pack("{s:o, s:{s:s, s:I, s:I, s:o, s:o}}", "links", links, "grid", "kind",
                     "gauss-legendre", "nTheta", (json_int_t)shape[0], "nPhi", (json_int_t)shape[1],
                     "points", json_nested(registration->points, 3, shape), "jacobian",
                     json_nested(registration->jacobian, 2, shape));
}

static void check(struct process_inputs *given)
{
    landmarks_exclude(given, "exact", true);
    landmarks_exclude(given, "reparameterization", false);
}

static void complete(struct process_inputs *given)
{
    landmarks_complete(given, "template", "moving",
                       (long)json_integer_value(json_object_get(given->canonical, "degree")));
}

static json_t *document_of(struct jobs_run *run, const struct pair *pair,
                           const struct srnf_register_options *options, json_t *surface)
{
    const struct srnf_registration *registration = &pair->registration;
    const size_t square[2] = {3, 3};
    json_t *document = registration_figures(registration, options);

    (void)json_object_set_new(document, "surface", surface);
    (void)json_object_set_new(document, "rotation", json_nested(registration->rotation, 2, square));
    registration_bridged(document, document, pair->bridged);
    (void)json_object_set_new(document, "registration", registration_json(options));
    (void)json_object_set_new(document, "warp", warp_json(pair));
    registration_warn(document, registration, "moving onto template");
    warnings_put(document, pair_warnings(run, pair));
    return document;
}

static json_t *keep_surface(struct jobs_run *run, const struct pair *pair,
                            const struct srnf_surface_measures *measures,
                            struct jobs_result *result)
{
    const struct compute_surface *fixed = &pair->ends[0], *moving = &pair->ends[1];
    bool stored = !compute_is_mesh(fixed->id) && fixed->degree == pair->degree;
    const char *mesh = compute_is_mesh(moving->id) ? moving->id : NULL;
    const char *ids[2] = {fixed->id, moving->id};
    const struct surface_place place = process_place(run, moving);
    json_t *own = group_name_of(run, moving->id), *kept;
    const char *name = json_string_value(own);
    bool named = name && strcmp(name, moving->id) != 0;
    double rotation[9];
    struct surface_description description = {
        .name = named ? name : "registered",
        .degree = pair->degree,
        .coefficients = pair->registration.coefficients,
        .scale = process_scale(run, moving->id, moving->scale),
        .measures = measures,
        .parameterization = "registered",
        .mirrored = process_mirrored(run, moving->id),
        .route = routes_common(run, pair->bridged ? 1 : 2, ids, NULL),
        .source = process_source(run, "register", mesh, stored ? fixed->id : NULL),
        .origin = place.known ? place.origin : NULL,
        .rotation = place.known ? rotation : NULL,
        .frame_mesh = place.mesh,
        .frame = place.known
                     ? process_frame(run, moving->id, &place,
                                     surface_frame_json(
                                         moving->id, "The coordinates that the moving surface came "
                                                     "from: it lies where it was before it was "
                                                     "registered."))
                     : NULL,
    };

    /* Turned by what the moving one was turned by before, and then by the registration. */
    for (size_t i = 0; i < 9; i++) {
        const double *row = pair->registration.rotation + i / 3 * 3;

        rotation[i] = row[0] * place.rotation[i % 3] + row[1] * place.rotation[3 + i % 3] +
                      row[2] * place.rotation[6 + i % 3];
    }
    kept = process_keep_surface(run, &description, "the surface", result);
    json_decref(own);
    return kept;
}

/* ---- Running --------------------------------------------------------------------------------- */

static struct srnf_register_options options_of(const struct registering *typed)
{
    struct srnf_register_options options = registration_defaults(typed->common_pose);

    options.degree = (size_t)typed->degree;
    options.reparameterization = typed->reparameterization;
    options.symmetric = typed->symmetric;
    options.exact = typed->exact;
    options.penalty_jacobian = typed->penalty.jacobian;
    options.penalty_displacement = typed->penalty.displacement;
    if (!typed->common_pose) {
        options.rotation = typed->rotation;
        options.start = (enum srnf_register_start)typed->start;
    }
    return options;
}

static json_t *run_register(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct registering *registering = typed;
    struct srnf_register_options options = options_of(registering);
    struct srnf_surface_measures measures;
    struct landmarks landmarks = {.n = 0};
    json_t *surface, *document = NULL;
    struct pair pair;

    if (pair_load(run, registering->fixed, registering->moving, SRNF_PARAMETERIZATION_AUTO,
                  SHARE_END, &pair, result)) {
        goto out;
    }
    jobs_run_phase(run, 100.0);
    if (landmarks_place(run, &registering->landmarks, &pair, &landmarks, result) ||
        pair_register(run, &pair, &options, (enum handedness)registering->handedness, result) ||
        compute_measure(run, pair.degree, 1, pair.registration.coefficients, &measures, result)) {
        goto out;
    }
    surface = keep_surface(run, &pair, &measures, result);
    document = surface ? document_of(run, &pair, &options, surface) : NULL;
    if (document && ((options.common_pose && pair_warn_pose(run, &pair, document, result)) ||
                     landmarks_report(run, &landmarks, &pair, document, result))) {
        json_decref(document);
        document = NULL;
    }
out:
    landmarks_clear(&landmarks);
    pair_clear(run, &pair);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct registering),
    .check = check,
    .complete = complete,
    .run = run_register,
};

const struct api_process register_process = {
    .id = "register",
    .title = "Register a surface to another",
    .description = "The rotation and the warp of the sphere that lay one surface on another, "
                   "elastically, by their SRNFs; the surface so laid, and how far it then is.",
    .table = &table,
    .seconds = register_seconds,
};
