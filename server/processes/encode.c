/*
 * encode.c - the process encode: from a stored mesh to the coefficients of its surface.
 *
 * A mesh whose stored report has problems is refused at submission, without a job, as are options
 * that do not go together. What only the computation can find out fails the job: star on a mesh
 * that is not star-shaped, or from a centre that does not see it whole, and a sphere that is no map
 * of the mesh.
 */
#include "processes/encode.h"

#include <string.h>

#include "toolkit/seconds.h"
#include "toolkit/table.h"
#include "api/surfaces.h"
#include "store/mesh.h"

/* In the order of enum srnf_parameterization. */
static const char *const parameterizations[] = {"auto", "star", "area", "given", NULL};
enum { UNIT_AREA, NO_SCALE };
static const char *const scales[] = {"unit-area", "none", NULL};

/* ---- Centre ---------------------------------------------------------------------------------- */

/* "auto" or three coordinates. */
static void read_center(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(value);
    const size_t shape[1] = {3};
    double center[3];

    if (!value || (text && strcmp(text, "auto") == 0)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_string("auto"));
        return;
    }
    if (!json_is_array(value)) {
        problem_add(inputs->list, "/inputs/center", "must be \"auto\" or three numbers");
        return;
    }
    if (!json_read_numbers(value, 1, shape, center, inputs->list, "/inputs/center")) {
        return;
    }
    for (size_t k = 0; k < 3; k++) {
        center[k] += 0.0;
        if (!(center[k] >= -PROCESS_COORDINATE_MAX && center[k] <= PROCESS_COORDINATE_MAX)) {
            problem_add(inputs->list, "/inputs/center", "coordinate %zu must be from %g to %g", k,
                        -PROCESS_COORDINATE_MAX, PROCESS_COORDINATE_MAX);
            return;
        }
    }
    (void)json_object_set_new(inputs->canonical, input->name, json_vector(center, 3));
}

static bool type_center(const json_t *value, void *member)
{
    struct encode_center *given = member;

    given->given = json_is_array(value);
    for (size_t k = 0; k < 3; k++) {
        given->at[k] = json_number_value(json_array_get(value, k));
    }
    return true;
}

#define COORDINATE_MAX_TEXT PROCESS_TEXT(PROCESS_COORDINATE_MAX)
static const struct input_own center = {
    .schema = "\"oneOf\":[{\"const\":\"auto\"},{\"type\":\"array\",\"items\":{\"type\":\"number\","
              "\"minimum\":-" COORDINATE_MAX_TEXT ",\"maximum\":" COORDINATE_MAX_TEXT
              "},\"minItems\":3,\"maxItems\":3}],\"default\":\"auto\"",
    .read = read_center,
    .type = type_center,
};

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

#define AT(member) offsetof(struct encoding, member)
static const struct process_input inputs[] = {
    {"mesh", INPUT_MESH, AT(mesh),
     "The mesh to encode; its report must have no problems. Or a cohort instead.", .nullable = true,
     .unless = "cohort"},
    {"cohort", INPUT_OWN, AT(cohort),
     "Name of a cohort of at most " PROCESS_TEXT(
         ENCODE_MEMBERS_MAX) " members, whose meshes are "
                             "encoded with the same options, those that it says to mirror "
                             "mirrored. Surfaces among them "
                             "stay as they are. A mesh that cannot be encoded does not fail the "
                             "others, unless none is "
                             "left. Surfaces that are made stay, also of a job that is cancelled.",
     .own = &encode_cohort},
    {"lmax", INPUT_INTEGER, AT(degree),
     "Degree of the harmonic series; (lmax + 1)^2 coefficients a coordinate.",
     .lowest = SRNF_DEGREE_MIN, .highest = SRNF_DEGREE_MAX, .fallback = PROCESS_DEGREE_DEFAULT},
    {"parameterization", INPUT_CHOICE, AT(parameterization),
     "How the sphere is laid on the surface. star: radially from a centre that sees the whole "
     "surface; area: by a bijection of low distortion, for any surface; given: by a sphere that "
     "comes with the mesh. auto takes area for every mesh, so that all surfaces by default can be "
     "compared, and star only where a center is given.",
     .choices = parameterizations},
    {"sphere", INPUT_MESH, AT(sphere),
     "For the parameterization given: a mesh of the same faces in the same order, whose vertices "
     "lie on a sphere.",
     .nullable = true},
    {"center", INPUT_OWN, AT(center),
     "Centre of the rays of star in the units of the mesh; auto: the centre of the largest ball "
     "of points that see the whole surface.",
     .own = &center},
    {"mirror", INPUT_BOOLEAN, AT(mirror),
     "Encode the mirror image instead: x of the mesh, and of the sphere if one is given, becomes "
     "-x, and faces are turned to stay outward, before everything else; center and all answers "
     "stay in the coordinates of the mesh as it was uploaded. Left and right structures are "
     "mirror images of each other, and no registration brings one onto the other before one side "
     "is mirrored. Which plane matters only for data in a common pose: it is the sagittal one "
     "where x runs from one side of the body to the other, as in RAS and LPS coordinates.",
     .fallback = 0},
    {"scale", INPUT_CHOICE, AT(scale),
     "unit-area divides by the square root of the area, kept as scale in the record.",
     .choices = scales},
    {"smoothing", INPUT_REAL, AT(smoothing),
     "Sigma of the heat kernel exp(-sigma l (l + 1)) on the coefficients (of the radius for "
     "star), on the unit sphere.",
     .lowest = 0, .highest = PROCESS_SMOOTHING_MAX},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"cohort", OUTPUT_STRING,
     "Its name. Of a cohort the result has this, encoded, failed and rows."},
    {"encoded", OUTPUT_INTEGER, "Of a cohort: meshes that were."},
    {"failed", OUTPUT_INTEGER, "Of a cohort: members that have a problem."},
    {"rows", OUTPUT_OBJECTS,
     "Of a cohort, for each member: member (its number), id, label, subject, encoded (false of a "
     "surface, which is taken as it is), surface (the id, or null), lmax, route, scale, area, "
     "volume, mirrored and fit of its record, problem (code and detail, or null) and warnings. "
     "Also as CSV from the job's results."},
    {"surface", OUTPUT_OBJECT, "Record of the surface. This and the rest are of one mesh."},
    {"fit", OUTPUT_OBJECT,
     "Distances between mesh and surface from both sides, area-weighted: rms, p95, max in the "
     "units of the mesh, and relativeToDiagonal; volumeDifference and areaDifference: those of "
     "the surface less those of the mesh, over those of the mesh."},
    {"route", "\"enum\":[\"star\",\"area\",\"given\"]", "How the sphere was laid on the surface."},
    {"reason", OUTPUT_STRING, "Why this route, in a sentence."},
    {"starShaped", OUTPUT_OBJECT,
     "value, center, margin (units of the mesh), violatingAreaFraction (of the faces that the "
     "centre sees from behind)."},
    {"distortion", OUTPUT_OBJECT,
     "Of the map to the sphere: symmetricDirichlet (energy / 4 pi, 4 for an isometry), "
     "logAreaDeviation (standard deviation of the log of the area ratio), flipped (faces turned "
     "over: 0)."},
    {NULL, NULL, NULL},
};

/* What belongs to one mesh is not for a cohort. */
static void check_cohort(struct process_inputs *given, bool by_sphere)
{
    const json_t *sphere = json_object_get(given->given, "sphere");

    if (by_sphere) {
        problem_add(given->list, "/inputs/parameterization",
                    "given needs a sphere for each mesh: encode them one by one");
    }
    if (sphere && !json_is_null(sphere)) {
        problem_add(given->list, "/inputs/sphere", "is for one mesh, and not for a cohort");
    }
    if (json_is_array(json_object_get(given->canonical, "center"))) {
        problem_add(given->list, "/inputs/center", "is for one mesh, and not for a cohort");
    }
}

/* A sphere is for the parameterization given, a centre for the others. */
static void check(struct process_inputs *given)
{
    const char *choice = json_string_value(json_object_get(given->canonical, "parameterization"));
    const json_t *sphere = json_object_get(given->given, "sphere");
    bool has_sphere = sphere && !json_is_null(sphere);
    bool by_sphere = choice && strcmp(choice, parameterizations[SRNF_PARAMETERIZATION_GIVEN]) == 0;
    bool by_area = choice && strcmp(choice, parameterizations[SRNF_PARAMETERIZATION_AREA]) == 0;

    const json_t *mesh = json_object_get(given->given, "mesh");
    const json_t *cohort = json_object_get(given->given, "cohort");

    if (cohort && !json_is_null(cohort)) {
        check_cohort(given, by_sphere);
        return;
    }
    if (!mesh || json_is_null(mesh)) {
        problem_add(given->list, "/inputs/mesh", "a mesh or a cohort is required");
    }
    if (json_is_array(json_object_get(given->canonical, "center")) && (by_area || by_sphere)) {
        problem_add(given->list, "/inputs/center", "the parameterization %s has no centre", choice);
    }
    if (choice && has_sphere && !by_sphere) {
        problem_add(given->list, "/inputs/sphere",
                    "is for the parameterization given, and this is %s", choice);
    }
    if (by_sphere && !has_sphere) {
        problem_add(given->list, "/inputs/sphere", "is required: the id of a mesh");
    }
}

/* ---- Running --------------------------------------------------------------------------------- */

struct compute_encode_inputs encode_inputs_of(const struct encoding *encoding, const char *mesh,
                                              bool mirror)
{
    struct compute_encode_inputs of = {.options = srnf_encode_options_defaults(), .mirror = mirror};

    (void)snprintf(of.mesh, sizeof of.mesh, "%s", mesh);
    memcpy(of.sphere, encoding->sphere, sizeof of.sphere);
    memcpy(of.options.center, encoding->center.at, sizeof of.options.center);
    of.options.center_given = encoding->center.given;
    of.options.degree = (size_t)encoding->degree;
    of.options.parameterization = (enum srnf_parameterization)encoding->parameterization;
    of.options.unit_area = encoding->scale == UNIT_AREA;
    of.options.smoothing = encoding->smoothing;
    return of;
}

/* The fit, and by what part volume and area of the surface differ from those of its mesh. */
static json_t *fit_json(const struct srnf_encoded *encoded)
{
    json_t *fit = surface_fit_json(&encoded->fit);

    (void)json_object_set_new(fit, "volumeDifference", json_finite(encoded->volume_ratio - 1.0));
    (void)json_object_set_new(fit, "areaDifference", json_finite(encoded->area_ratio - 1.0));
    return fit;
}

static json_t *frame_of(const char *mesh, bool mirror, const struct srnf_encoded *encoded)
{
    return mirror
               ? surface_frame_json(mesh,
                                    "The coordinates of the mesh, in which the mirror image lies "
                                    "where the surface was: it is reflected in the plane x = %.9g "
                                    "through its own centroid.",
                                    encoded->origin[0])
               : surface_frame_json(mesh, "The coordinates of the mesh.");
}

json_t *encode_keep_surface(struct jobs_run *run, const struct compute_encode_inputs *of,
                            const struct srnf_encoded *encoded, json_t *warnings,
                            struct jobs_result *result)
{
    struct store_mesh mesh = {0};
    struct surface_description description = {
        .degree = encoded->degree,
        .coefficients = encoded->coefficients,
        .scale = encoded->scale,
        .measures = &encoded->measures,
        .parameterization = srnf_parameterization_name(encoded->route),
        .route = srnf_parameterization_name(encoded->route),
        .source = process_source(run, "encode", of->mesh, NULL),
        .fit = fit_json(encoded),
        .star = surface_star_json(&encoded->star),
        .origin = encoded->origin,
        .frame = frame_of(of->mesh, of->mirror, encoded),
        .frame_mesh = of->mesh,
        .mirrored = of->mirror != process_mirrored(run, of->mesh),
        .smoothing = &of->options.smoothing,
        .warnings = warnings,
        .of_mesh_alone = !of->sphere[0],
    };
    json_t *record;

    if (process_read(
            store_mesh_get_as(jobs_run_store(run), jobs_run_owner(run), of->mesh, &mesh))) {
        description.name = mesh.name;
    }
    record = process_keep_surface(run, &description, "the surface", result);
    store_mesh_clear(&mesh);
    return record;
}

static json_t *run_encode(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct encoding *encoding = typed;
    struct compute_encode_inputs of = encode_inputs_of(encoding, encoding->mesh, encoding->mirror);
    struct srnf_encoded encoded = {0};
    json_t *surface = NULL, *document = NULL;

    if (encoding->cohort.n > 0) {
        return encode_run_cohort(run, encoding, result);
    }
    if (compute_encode(run, jobs_run_context(run), &of, &encoded, result) == 0) {
        surface = encode_keep_surface(run, &of, &encoded, process_doubts(run), result);
    }
    if (surface) {
        document =
            json_pack("{s:o, s:o, s:s, s:s, s:o, s:o}", "surface", surface, "fit",
                      fit_json(&encoded), "route", srnf_parameterization_name(encoded.route),
                      "reason", encoded.reason, "starShaped", surface_star_json(&encoded.star),
                      "distortion", surface_distortion_json(&encoded.distortion));
    }
    srnf_free(encoded.coefficients);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct encoding),
    .check = check,
    .run = run_encode,
};

const struct api_process encode_process = {
    .id = "encode",
    .title = "Encode a mesh, or those of a cohort",
    .description =
        "From a triangle mesh of genus zero to a surface: harmonic coefficients over the sphere, "
        "centred and scaled, with the distance between the two.",
    .table = &table,
    .seconds = encode_seconds,
    .respond_table = encode_respond_table,
    .table_fits = encode_table_fits,
};
