/*
 * encode.c - the process encode over HTTP: schemas, canonical inputs, result document.
 *
 * A mesh whose stored report has problems is refused at submission, without a job, as are options
 * that do not go together. What only the computation can find out fails the job: star on a mesh
 * that is not star-shaped, or from a centre that does not see it whole, and a sphere that is no map
 * of the mesh.
 */
#include <string.h>

#include "toolkit/process.h"
#include "api/surfaces.h"
#include "compute/encode.h"

static const char *const names[] = {"mesh",  "lmax",      "parameterization", "sphere", "center",
                                    "scale", "smoothing", "mirror",           NULL};
/* In the order of enum srnf_parameterization. */
static const char *const parameterizations[] = {"auto", "star", "area", "given", NULL};
static const char *const scales[] = {"unit-area", "none", NULL};

/* center: "auto" or three coordinates. */
static void read_center(struct process_inputs *inputs)
{
    const json_t *value = json_object_get(inputs->given, "center");
    const char *text = json_string_value(value);
    const size_t shape[1] = {3};
    double center[3];

    if (!value || (text && strcmp(text, "auto") == 0)) {
        (void)json_object_set_new(inputs->canonical, "center", json_string("auto"));
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
    (void)json_object_set_new(inputs->canonical, "center", json_vector(center, 3));
}

/* The mesh, and the sphere where the parameterization is given: null in the canonical inputs
   otherwise. References are looked up when everything else is in order. */
static void read_meshes(struct process_inputs *inputs, const char *parameterization)
{
    const json_t *sphere = json_object_get(inputs->given, "sphere");
    bool given = strcmp(parameterization, "given") == 0;

    if (!given && sphere && !json_is_null(sphere)) {
        problem_add(inputs->list, "/inputs/sphere",
                    "is for the parameterization given, and this is %s", parameterization);
    }
    if (inputs->list->errors) {
        return;
    }
    (void)inputs_mesh(inputs, "mesh");
    if (given) {
        (void)inputs_mesh(inputs, "sphere");
    } else {
        (void)json_object_set_new(inputs->canonical, "sphere", json_null());
    }
}

json_t *encode_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    const char *choice;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    (void)inputs_integer(&inputs, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, PROCESS_DEGREE_DEFAULT);
    choice = inputs_choice(&inputs, "parameterization", parameterizations);
    read_center(&inputs);
    if (json_is_array(json_object_get(inputs.canonical, "center")) &&
        (strcmp(choice, "area") == 0 || strcmp(choice, "given") == 0)) {
        problem_add(list, "/inputs/center", "the parameterization %s has no centre", choice);
    }
    (void)inputs_choice(&inputs, "scale", scales);
    (void)inputs_real(&inputs, "smoothing", 0.0, PROCESS_SMOOTHING_MAX, 0.0);
    (void)inputs_boolean(&inputs, "mirror", false);
    read_meshes(&inputs, choice);
    return inputs_close(&inputs);
}

static void copy_id(char id[STORE_ID_MAX], const json_t *value)
{
    const char *text = json_string_value(value);

    if (text && strlen(text) < STORE_ID_MAX) {
        memcpy(id, text, strlen(text) + 1);
    }
}

static enum srnf_parameterization parameterization_of(const char *name)
{
    for (int i = 0; name && parameterizations[i]; i++) {
        if (strcmp(name, parameterizations[i]) == 0) {
            return (enum srnf_parameterization)i;
        }
    }
    return SRNF_PARAMETERIZATION_AUTO;
}

/* Canonical inputs as the core's options. */
static struct compute_encode_inputs typed_inputs(const json_t *inputs)
{
    struct compute_encode_inputs typed = {.options = srnf_encode_options_defaults()};
    const char *scale = json_string_value(json_object_get(inputs, "scale"));
    const json_t *center = json_object_get(inputs, "center");

    copy_id(typed.mesh, json_object_get(inputs, "mesh"));
    copy_id(typed.sphere, json_object_get(inputs, "sphere"));
    typed.options.degree = (size_t)json_integer_value(json_object_get(inputs, "lmax"));
    typed.options.parameterization =
        parameterization_of(json_string_value(json_object_get(inputs, "parameterization")));
    typed.options.center_given = json_is_array(center);
    for (size_t k = 0; k < 3; k++) {
        typed.options.center[k] = json_number_value(json_array_get(center, k));
    }
    typed.options.unit_area = !scale || strcmp(scale, "none") != 0;
    typed.options.smoothing = json_number_value(json_object_get(inputs, "smoothing"));
    typed.mirror = json_is_true(json_object_get(inputs, "mirror"));
    return typed;
}

/* The fit, and by what part volume and area of the surface differ from those of its mesh. */
static json_t *fit_json(const struct srnf_encoded *encoded)
{
    json_t *fit = surface_fit_json(&encoded->fit);

    (void)json_object_set_new(fit, "volumeDifference", json_finite(encoded->volume_ratio - 1.0));
    (void)json_object_set_new(fit, "areaDifference", json_finite(encoded->area_ratio - 1.0));
    return fit;
}

/* The surface of the result, in the store, under the name of its mesh. */
static json_t *keep_surface(struct jobs_run *run, const struct compute_encode_inputs *typed,
                            const struct srnf_encoded *encoded, struct jobs_result *result)
{
    struct store_mesh mesh = {0};
    struct surface_description description = {
        .degree = encoded->degree,
        .coefficients = encoded->coefficients,
        .scale = encoded->scale,
        .measures = &encoded->measures,
        .parameterization = srnf_parameterization_name(encoded->route),
        .route = srnf_parameterization_name(encoded->route),
        .source = process_source(run, "encode", typed->mesh, NULL),
        .fit = fit_json(encoded),
        .star = surface_star_json(&encoded->star),
        .origin = encoded->origin,
        .mirrored = typed->mirror,
        .smoothing = &typed->options.smoothing,
        .warnings = process_doubts(run),
    };
    json_t *record;

    if (process_read(
            store_mesh_get_as(jobs_run_store(run), jobs_run_owner(run), typed->mesh, &mesh))) {
        description.name = mesh.name;
    }
    record = process_keep_surface(run, &description, "the surface", result);
    store_mesh_clear(&mesh);
    return record;
}

void encode_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document, *surface;
    struct compute_encode_inputs typed;
    struct srnf_encoded encoded = {0};

    (void)api;
    if (!inputs) {
        return;
    }
    typed = typed_inputs(inputs);
    if (compute_encode(run, jobs_run_context(run), &typed, &encoded, result)) {
        goto out;
    }
    surface = keep_surface(run, &typed, &encoded, result);
    if (!surface) {
        goto out;
    }
    document = json_object();
    (void)json_object_set_new(document, "surface", surface);
    (void)json_object_set_new(document, "fit", fit_json(&encoded));
    (void)json_object_set_new(document, "route",
                              json_string(srnf_parameterization_name(encoded.route)));
    (void)json_object_set_new(document, "reason", json_string(encoded.reason));
    (void)json_object_set_new(document, "starShaped", surface_star_json(&encoded.star));
    (void)json_object_set_new(document, "distortion", surface_distortion_json(&encoded.distortion));
    process_finish(run, document, inputs, result);
out:
    srnf_free(encoded.coefficients);
    json_decref(inputs);
}
