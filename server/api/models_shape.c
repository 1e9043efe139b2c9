/*
 * models_shape.c - GET /v1/models/{id}/shape: the surface at a point of a model, given by several
 * coefficients at once; of a model of several structures that of the part that is asked for.
 *
 * The process modes answers the same for one component, as a job whose surfaces are kept. This is
 * for a page on which somebody moves sliders: nothing is stored, and nothing waits behind jobs. It
 * inverts on the threads for uploads (ROUTE_LONG), where owners take turns and the memory has a
 * bound, starting from the mean surface. A client that goes away stops it.
 */
#include "api/mesh_export.h"
#include "api/model_parts.h"
#include "api/models.h"
#include "api/respond.h"
#include "api/routes.h"

#include "api/json_numbers.h"
#include "api/meshes.h"
#include "compute/compute.h"
#include "compute/model.h"
#include "store/digest.h"
#include "store/surface.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEVIATIONS_MAX 10.0 /* how far out a point may be: as far as in modes */
#define TEXT_MAX 4096       /* of the coefficients */
#define DEGREE_MAX 31       /* an inversion takes a second or two there, and minutes at 127 */
#define ARRAYS ((1u << STORE_MODEL_ARRAYS) - 1)

/* What is asked for, and what was found. */
struct shape {
    struct store_model model;
    struct store_surface mean;
    size_t n;             /* coefficients that are given */
    double *coefficients; /* [components] in standard deviations */
    double *scores;       /* [components] */
    struct model_part part;
    bool json;
    struct mesh_export choice;
    size_t resolution;
    struct srnf_inversion inversion;
    double offset; /* of the surface from the point, over that of the point from the mean */
};

static void clear(struct shape *shape)
{
    srnf_inversion_clear(&shape->inversion);
    srnf_free(shape->coefficients);
    srnf_free(shape->scores);
    store_surface_clear(&shape->mean);
    store_model_clear(&shape->model);
}

static bool refuse(struct api_call *call, const char *detail)
{
    struct problem_list list = {.errors = NULL};

    problem_add(&list, "/coefficients", "%s", detail);
    (void)problem_respond_list(call, "invalid-input", &list);
    return false;
}

/* ?coefficients=1.5,0,-2. False when a problem was answered. */
static bool read_coefficients(struct api_call *call, struct shape *shape)
{
    size_t components = (size_t)shape->model.components;
    char text[TEXT_MAX];
    bool refused = false;
    const char *at = text;

    if (!query_get(call, "coefficients", text, sizeof text, &refused)) {
        return !refused &&
               refuse(call, "coefficients must be given, as in 1.5,0,-2: one for each of "
                            "the first components, in standard deviations");
    }
    for (;; at++) {
        double value;

        if (!query_number(&at, &value) || !(fabs(value) <= DEVIATIONS_MAX) || (*at && *at != ',')) {
            return refuse(call, "coefficients must be numbers from -10 to 10, with commas between "
                                "them");
        }
        if (shape->n == components) {
            return refuse(call,
                          "there must not be more coefficients than the model has components");
        }
        shape->coefficients[shape->n++] = value;
        if (!*at) {
            return true;
        }
    }
}

/* ?format= and ?resolution=. False when a problem was answered. */
static bool read_format(struct api_call *call, struct shape *shape)
{
    bool refused = false;
    char text[16];
    bool given = query_get(call, "format", text, sizeof text, &refused);

    shape->json = !given || strcmp(text, "json") == 0;
    if (refused || (!shape->json && !mesh_export_choose(call, &shape->choice))) {
        return false;
    }
    shape->resolution = mesh_export_resolution(call, (size_t)shape->model.lmax);
    return shape->resolution > 0;
}

/* The surface at the point, about its centroid. */
static int find_surface(struct api_call *call, struct shape *shape, struct srnf_error *error)
{
    const struct store_model *model = &shape->model;
    const double *eigenvalues = model->arrays[STORE_MODEL_EIGENVALUES];
    const double origin[3] = {0.0, 0.0, 0.0};
    struct jobs *jobs = call->api->config.jobs;
    const struct srnf_sht *sht = NULL;
    struct srnf_surface_measures measures;
    double far = 0.0;
    int status = jobs_transform_acquire(jobs, (size_t)model->lmax, SRNF_GRID_GAUSS_LEGENDRE,
                                        (size_t)model->n_theta, (size_t)model->n_phi, &sht);

    for (size_t k = 0; status == 0 && k < shape->n; k++) {
        shape->scores[k] = shape->coefficients[k] * sqrt(eigenvalues[k]);
        far += shape->scores[k] * shape->scores[k];
    }
    if (status == 0 && shape->part.name[0]) {
        status = compute_point_norm2(sht, model, shape->scores, &far);
    }
    if (status == 0) {
        status = compute_invert_point(sht, model, shape->mean.coefficients, shape->scores,
                                      &upload_context, &shape->inversion, error);
    }
    if (status >= 0) {
        shape->offset = far > 0.0 ? sqrt(shape->inversion.energy / far) : 0.0;
        status = srnf_surfaces_measure(sht, 1, shape->inversion.coefficients, &upload_context,
                                       &measures);
    }
    if (status == 0) {
        srnf_surface_move((size_t)model->lmax, shape->inversion.coefficients, &measures, origin);
    }
    if (sht) {
        jobs_transform_release(jobs, sht);
    }
    return status;
}

static void answer_json(struct api_call *call, const struct shape *shape)
{
    size_t degree = (size_t)shape->model.lmax, count = srnf_coefficient_count(degree);
    const double *c = shape->inversion.coefficients;

    respond_json(call, 200,
                 json_pack("{s:s, s:o, s:o, s:o, s:o, s:{s:I, s:o, s:o, s:o}}", "model",
                           shape->model.id, "part",
                           shape->part.name[0] ? json_string(shape->part.name) : json_null(),
                           "coefficients", json_vector(shape->coefficients, shape->n),
                           "relativeEnergy", json_finite(shape->inversion.relative_energy),
                           "offset", json_finite(shape->offset), "surface", "lmax",
                           (json_int_t)degree, "x", json_vector(c, count), "y",
                           json_vector(c + count, count), "z", json_vector(c + 2 * count, count)));
}

static void answer_mesh(struct api_call *call, const struct shape *shape)
{
    const struct srnf_mesh_description description = {
        .name = shape->model.id,
        .space = "normalized",
        .comment = "a point of a model, about its centroid, in the scale of the model",
    };
    struct srnf_mesh mesh = {0};
    double *normals = NULL;
    int status = srnf_surface_triangulate((size_t)shape->model.lmax, shape->inversion.coefficients,
                                          shape->resolution, &mesh, &normals);

    if (status == 0) {
        (void)api_response_header(call->response, "Srnfd-Relative-Energy", "%.6g",
                                  shape->inversion.relative_energy);
        (void)api_response_header(call->response, "Srnfd-Offset", "%.6g", shape->offset);
        mesh_export_respond(call, &shape->choice, shape->model.id, &mesh, normals, NULL, 0,
                            &description);
    } else {
        (void)problem_respond(call, compute_problem_code(status), "%s.", srnf_strerror(status));
    }
    srnf_free(normals);
    srnf_mesh_clear(&mesh);
}

/* What is answered at once must be short: nobody can cancel it. False when a problem was
   answered. */
static bool is_answerable(struct api_call *call, const struct store_model *model)
{
    struct problem_list list = {.errors = NULL};

    if (strcmp(model_kind(model), "classifier") == 0) {
        problem_add(&list, "/id",
                    "is a classifier, made by train: it has no components to move "
                    "along");
    } else if (model->lmax > DEGREE_MAX) {
        problem_add(&list, "/id",
                    "is of degree %d, and shapes are answered at once up to degree %d only: the "
                    "process modes computes them as a job",
                    (int)model->lmax, DEGREE_MAX);
    } else {
        return true;
    }
    (void)problem_respond_list(call, "invalid-input", &list);
    return false;
}

/* Model, mean, and what is asked for. False when a problem was answered. */
static bool prepare(struct api_call *call, struct shape *shape)
{
    struct store *store = call->api->config.store;
    int status = store_model_get_as(store, call->request->caller.name, call->parameters[0], ARRAYS,
                                    &shape->model);

    if (status) {
        (void)problem_respond_store(call, status, "no-such-model", call->parameters[0]);
        return false;
    }
    if (!is_answerable(call, &shape->model) ||
        !model_choose_part(call, &shape->model, &shape->part)) {
        return false;
    }
    status = store_surface_get(store, shape->model.mean, true, &shape->mean);
    if (status) {
        (void)problem_respond_store(call, status, "no-such-surface", shape->model.mean);
        return false;
    }
    shape->coefficients = srnf_alloc((size_t)shape->model.components, sizeof(double));
    shape->scores = srnf_alloc((size_t)shape->model.components, sizeof(double));
    status = !shape->coefficients || !shape->scores  ? STORE_NOMEM
             : shape->mean.lmax != shape->model.lmax ? STORE_CORRUPT
                                                     : STORE_OK;
    if (status) {
        (void)problem_respond_store(call, status, "", shape->model.id);
        return false;
    }
    return read_coefficients(call, shape) && read_format(call, shape);
}

void models_shape(struct api_call *call)
{
    struct shape shape = {.json = false};
    struct srnf_error error = {.element = -1};
    char tag[STORE_ID_MAX + 96], digest[65];
    int status;

    if (!prepare(call, &shape)) {
        goto out;
    }
    store_sha256_hex(digest, shape.coefficients, shape.n * sizeof(double));
    (void)snprintf(tag, sizeof tag, "%s.%.24s.%zu.%zu.%s", shape.model.id, digest, shape.part.index,
                   shape.resolution, shape.json ? "json" : shape.choice.format);
    if (respond_not_modified(call, tag)) {
        goto out;
    }
    status = find_surface(call, &shape, &error);
    if (status) {
        (void)problem_respond(call, compute_problem_code(status), "The point of the model: %s.",
                              srnf_strerror(status));
    } else if (shape.json) {
        answer_json(call, &shape);
    } else {
        answer_mesh(call, &shape);
    }
out:
    clear(&shape);
}
