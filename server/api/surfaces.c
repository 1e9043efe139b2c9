/*
 * surfaces.c - GET of surfaces: record, list, coefficients, and the fields srnf and grid on a grid.
 *
 * A surface never changes but for its name and tags, so its id (and these, or what the query asks
 * for) is the entity tag. Fields are
 * computed at each request, on a request thread, with transforms shared by the whole service.
 * JSON answers have a limit on their numbers; .npy answers only the limit on rows.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/labels.h"
#include "api/npy.h"
#include "api/lists.h"
#include "api/respond.h"
#include "api/routes.h"
#include "api/surfaces_grid.h"
#include "store/surface.h"

static bool find_surface(struct api_call *call, bool with_coefficients,
                         struct store_surface *surface)
{
    int status = store_surface_get_as(call->api->config.store, call->request->caller.name,
                                      call->parameters[0], with_coefficients, surface);

    if (status) {
        (void)problem_respond_store(call, status, "no-such-surface", call->parameters[0]);
    }
    return status == 0;
}

void surfaces_get(struct api_call *call)
{
    struct store_surface surface = {0};
    char etag[LABELS_ETAG_MAX];

    if (find_surface(call, false, &surface)) {
        labels_etag(etag, surface.id, surface.name, surface.tags);
        if (!respond_not_modified(call, etag)) {
            respond_json(call, 200, surface_record(&surface));
        }
        store_surface_clear(&surface);
    }
}

static bool add_surface(void *user, const struct store_surface *surface)
{
    return list_add(user, surface_record(surface), surface->created_ms, surface->id);
}

void surfaces_list(struct api_call *call)
{
    struct list list;

    if (list_open(call, "surfaces", &list)) {
        list_respond(call, &list, "/v1/surfaces",
                     store_surface_list(call->api->config.store, &list.page, add_surface, &list));
    }
}

static bool refuse(struct api_call *call, const char *pointer, const char *detail)
{
    struct problem_list list = {.errors = NULL};

    problem_add(&list, pointer, "%s", detail);
    (void)problem_respond_list(call, "invalid-input", &list);
    return false;
}

/* ?format=json|npy, otherwise what Accept likes best. False when a problem was answered. */
static bool choose_npy(struct api_call *call, bool *npy)
{
    static const char *const types[] = {"application/json", NPY_CONTENT_TYPE, NULL};
    char text[16];
    bool refused = false;
    int best;

    if (query_get(call, "format", text, sizeof text, &refused)) {
        *npy = strcmp(text, "npy") == 0;
        return *npy || strcmp(text, "json") == 0
                   ? true
                   : refuse(call, "/format", "format must be json or npy");
    }
    if (refused) {
        return false;
    }
    best = accept_best(call->request, types);
    *npy = best == 1;
    if (best < 0) {
        (void)problem_respond(call, "not-acceptable", "This is served as %s and %s.", types[0],
                              types[1]);
    }
    return best >= 0;
}

static void respond_npy(struct api_call *call, const double *values, size_t n_dimensions,
                        const size_t *shape, const char *id, const char *what)
{
    unsigned char *bytes;
    size_t size;

    if (npy_write(values, n_dimensions, shape, &bytes, &size)) {
        (void)problem_respond(call, "out-of-memory", "The array does not fit into memory now.");
        return;
    }
    (void)api_response_header(call->response, "Content-Disposition",
                              "attachment; filename=\"%s-%s.npy\"", id, what);
    respond_bytes(call, 200, NPY_CONTENT_TYPE, bytes, size);
}

/* An entity tag of the surface, what is asked of it, and the representation; true when 304 was
   answered. */
static bool unchanged(struct api_call *call, const char *id, const char *what, bool npy)
{
    char tag[STORE_ID_MAX + 96];

    (void)snprintf(tag, sizeof tag, "%s.%s.%s", id, what, npy ? "npy" : "json");
    /* Coefficients are what the id is of; the rest is computed from them. */
    return strcmp(what, "coefficients") == 0 ? respond_not_modified_ever(call, tag)
                                             : respond_not_modified(call, tag);
}

void surfaces_coefficients(struct api_call *call)
{
    struct store_surface surface = {0};
    size_t shape[2] = {3, 0};
    bool npy;

    if (!choose_npy(call, &npy) || !find_surface(call, true, &surface)) {
        return;
    }
    shape[1] = srnf_coefficient_count((size_t)surface.lmax);
    (void)api_response_header_text(call->response, "Vary", "Accept");
    if (unchanged(call, surface.id, "coefficients", npy)) {
        goto out;
    }
    if (npy) {
        respond_npy(call, surface.coefficients, 2, shape, surface.id, "coefficients");
    } else {
        const double *c = surface.coefficients;
        respond_json(call, 200,
                     json_pack("{s:I, s:o, s:o, s:o}", "lmax", (json_int_t)surface.lmax, "x",
                               json_vector(c, shape[1]), "y", json_vector(c + shape[1], shape[1]),
                               "z", json_vector(c + 2 * shape[1], shape[1])));
    }
out:
    store_surface_clear(&surface);
}

/* ---- Fields on a grid ------------------------------------------------------------------------ */

/* A whole number of the query; 0 where it is absent. False when a problem was answered. */
static bool query_count(struct api_call *call, const char *name, size_t lowest, size_t highest,
                        size_t *value)
{
    char text[32], pointer[40], detail[120];
    bool refused = false;
    long number;

    *value = 0;
    if (!query_get(call, name, text, sizeof text, &refused)) {
        return !refused;
    }
    if (!query_whole(text, &number) || number < (long)lowest || number > (long)highest) {
        (void)snprintf(pointer, sizeof pointer, "/%s", name);
        (void)snprintf(detail, sizeof detail, "%s must be a whole number from %zu to %zu here",
                       name, lowest, highest);
        return refuse(call, pointer, detail);
    }
    *value = (size_t)number;
    return true;
}

/* The grid asked for; the working grid of the degree by default. */
static bool choose_grid(struct api_call *call, size_t degree, bool npy, struct surface_grid *grid)
{
    char text[32], detail[160];
    bool refused = false;
    size_t least;

    grid->kind = SRNF_GRID_GAUSS_LEGENDRE;
    if (query_get(call, "kind", text, sizeof text, &refused) &&
        !surface_grid_kind(text, &grid->kind)) {
        return refuse(call, "/kind", "kind must be gauss-legendre or equiangular");
    }
    least = grid->kind == SRNF_GRID_EQUIANGULAR ? 2 * degree + 1 : degree + 1;
    if (refused || !query_count(call, "nTheta", least, SURFACE_ROWS_MAX, &grid->n_theta) ||
        !query_count(call, "nPhi", 2 * degree + 1, 2 * SURFACE_ROWS_MAX, &grid->n_phi)) {
        return false;
    }
    if (grid->n_theta == 0) {
        grid->n_theta = srnf_working_rows(degree) > least ? srnf_working_rows(degree) : least;
    }
    if (grid->n_phi == 0) {
        grid->n_phi = 2 * grid->n_theta;
    }
    if (!npy && 3 * grid->n_theta * grid->n_phi > SURFACE_JSON_NUMBERS_MAX) {
        (void)snprintf(
            detail, sizeof detail,
            "a JSON answer has at most %zu numbers; ask for format=npy or a coarser grid",
            SURFACE_JSON_NUMBERS_MAX);
        return refuse(call, "/nTheta", detail);
    }
    return true;
}

/* Rows are those of the transform's grid; values is double[n_theta][n_phi][3]. */
static json_t *field_json(const struct srnf_grid *grid, const double *values)
{
    const size_t shape[3] = {grid->n_theta, grid->n_phi, 3};
    json_t *phi = json_array();

    for (size_t j = 0; j < grid->n_phi; j++) {
        const double two_pi = 6.28318530717958647692;
        (void)json_array_append_new(phi, json_real(two_pi * (double)j / (double)grid->n_phi));
    }
    return json_pack(
        "{s:s, s:I, s:I, s:o, s:o, s:o, s:o}", "kind", surface_grid_kind_name(grid->kind), "nTheta",
        (json_int_t)grid->n_theta, "nPhi", (json_int_t)grid->n_phi, "theta",
        json_vector(grid->theta, grid->n_theta), "phi", phi, "weights",
        json_vector(grid->weight, grid->n_theta), "values", json_nested(values, 3, shape));
}

/* A field of the surface on a grid: what computes it from the coefficients. */
struct field {
    const char *name;
    void (*compute)(const struct srnf_sht *sht, const double *coefficients, double *values,
                    void *workspace);
};

static void compute_positions(const struct srnf_sht *sht, const double *coefficients,
                              double *values, void *workspace)
{
    srnf_sht_synthesis(sht, 3, coefficients, values, workspace);
}

static const struct field srnf_of_surface = {"srnf", srnf_field};
static const struct field positions = {"grid", compute_positions};

static void respond_values(struct api_call *call, const struct store_surface *surface,
                           const struct field *field, const struct surface_grid *grid, bool npy)
{
    const size_t shape[3] = {grid->n_theta, grid->n_phi, 3};
    size_t count = grid->n_theta * grid->n_phi;
    double *blocks = srnf_alloc(count, 3 * sizeof(double));
    double *values = srnf_alloc(count, 3 * sizeof(double));
    struct surface_transform transform = {0};

    if (!blocks || !values) {
        (void)problem_respond(call, "out-of-memory", "The grid does not fit into memory now.");
        goto out;
    }
    if (!surface_transform_open(call, (size_t)surface->lmax, grid, &transform)) {
        goto out;
    }
    field->compute(transform.sht, surface->coefficients, blocks, transform.workspace);
    field_interleave(count, blocks, values);
    if (npy) {
        respond_npy(call, values, 3, shape, surface->id, field->name);
    } else {
        respond_json(call, 200, field_json(srnf_sht_grid(transform.sht), values));
    }
out:
    surface_transform_close(&transform);
    srnf_free(values);
    srnf_free(blocks);
}

static void respond_field(struct api_call *call, const struct field *field)
{
    struct store_surface surface = {0};
    struct surface_grid grid;
    char what[80];
    bool npy;

    if (!choose_npy(call, &npy) || !find_surface(call, true, &surface)) {
        return;
    }
    if (choose_grid(call, (size_t)surface.lmax, npy, &grid)) {
        (void)snprintf(what, sizeof what, "%s.%s.%zu.%zu", field->name,
                       surface_grid_kind_name(grid.kind), grid.n_theta, grid.n_phi);
        (void)api_response_header_text(call->response, "Vary", "Accept");
        if (!unchanged(call, surface.id, what, npy)) {
            respond_values(call, &surface, field, &grid, npy);
        }
    }
    store_surface_clear(&surface);
}

void surfaces_srnf(struct api_call *call)
{
    respond_field(call, &srnf_of_surface);
}

void surfaces_grid(struct api_call *call)
{
    respond_field(call, &positions);
}
