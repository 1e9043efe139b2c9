/*
 * surfaces_create.c - POST /v1/surfaces: a surface given directly, as coefficients, as values on
 * a grid in JSON, or as a .npy body of shape (nTheta, nPhi, 3).
 *
 * The surface is kept as it is given, with scale 1, unless scale unit-area asks for the usual
 * pre-shape: centred at its area centroid and divided by the square root of its area, which
 * becomes the record's scale. A surface whose volume is negative is refused, since all that is
 * computed of it is that of a mirror image, unless orientation is any. Options stand in the JSON
 * body, or in the query where the body is .npy. Every problem of a member carries its JSON pointer,
 * of a query parameter its name as one.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compute/compute.h"
#include "api/auth.h"
#include "api/npy.h"
#include "api/respond.h"
#include "api/routes.h"
#include "api/surfaces_grid.h"
#include "api/warnings.h"
#include "owner.h"
#include "store/holdings.h"

/* What one request gives, once it is read. */
struct given {
    char name[NAME_SIZE];
    bool unit_area, any_orientation;
    size_t degree;
    double *coefficients; /* owned, srnf_free */
    struct srnf_fit fit;
    bool has_fit;
};

static const char *const body_names[] = {"coefficients", "grid",  "lmax", "name",
                                         "orientation",  "scale", NULL};
static const char *const coefficients_names[] = {"lmax", "x", "y", "z", NULL};
static const char *const grid_names[] = {"kind", "nTheta", "nPhi", "xyz", NULL};

/* Notes a problem for each member that the object should not have. */
static void check_names(const json_t *value, const char *const *names, const char *pointer,
                        struct problem_list *list)
{
    json_t *object = (json_t *)(uintptr_t)value;
    char text[160];

    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        size_t i = 0;
        while (names[i] && strcmp(names[i], json_object_iter_key(at)) != 0) {
            i++;
        }
        if (!names[i]) {
            (void)snprintf(text, sizeof text, "%s/%s", pointer, json_object_iter_key(at));
            problem_add(list, text, "there is no such member here");
        }
    }
}

/* A whole number within the limits, or 0 with a problem. */
static size_t read_count(const json_t *value, long lowest, long highest, const char *pointer,
                         struct problem_list *list)
{
    double number = json_number_value(value);

    if (!json_is_number(value) || !(number >= (double)lowest && number <= (double)highest) ||
        floor(number) != number) {
        problem_add(list, pointer, "must be a whole number from %ld to %ld", lowest, highest);
        return 0;
    }
    return (size_t)number;
}

static bool read_coefficients(struct api_call *call, const json_t *value, struct given *given,
                              struct problem_list *list)
{
    static const char *const axes[] = {"x", "y", "z"};
    char pointer[40];
    size_t count;

    check_names(value, coefficients_names, "/coefficients", list);
    given->degree = read_count(json_object_get(value, "lmax"), SRNF_DEGREE_MIN, SRNF_DEGREE_MAX,
                               "/coefficients/lmax", list);
    if (given->degree == 0) {
        return true;
    }
    count = srnf_coefficient_count(given->degree);
    given->coefficients = srnf_alloc(count, 3 * sizeof(double));
    if (!given->coefficients) {
        (void)problem_respond(call, "out-of-memory",
                              "The coefficients do not fit into memory now.");
        return false;
    }
    for (size_t k = 0; k < 3; k++) {
        (void)snprintf(pointer, sizeof pointer, "/coefficients/%s", axes[k]);
        (void)json_read_numbers(json_object_get(value, axes[k]), 1, &count,
                                given->coefficients + k * count, list, pointer);
    }
    return true;
}

/* Degree of a surface from a grid: as asked for (0: the default, or what the grid resolves if
   that is less). */
static void choose_degree(const struct surface_grid *grid, struct given *given,
                          struct problem_list *list)
{
    size_t limit = surface_grid_degree(grid);

    if (given->degree == 0) {
        given->degree = limit < SURFACE_DEGREE_DEFAULT ? limit : SURFACE_DEGREE_DEFAULT;
    }
    if (given->degree > limit || given->degree < SRNF_DEGREE_MIN) {
        problem_add(list, "/lmax",
                    "is %zu, but a %s grid of %zu x %zu resolves degree %zu at most, and the least "
                    "degree is %d",
                    given->degree, surface_grid_kind_name(grid->kind), grid->n_theta, grid->n_phi,
                    limit, SRNF_DEGREE_MIN);
    }
}

static bool analyse(struct api_call *call, const struct surface_grid *grid, const double *xyz,
                    struct given *given)
{
    given->coefficients = srnf_alloc(srnf_coefficient_count(given->degree), 3 * sizeof(double));
    if (!given->coefficients) {
        (void)problem_respond(call, "out-of-memory",
                              "The coefficients do not fit into memory now.");
        return false;
    }
    given->has_fit = true;
    return surface_from_grid(call, grid, given->degree, xyz, given->coefficients, &given->fit);
}

static bool read_grid(struct api_call *call, const json_t *value, struct given *given,
                      struct problem_list *list)
{
    struct surface_grid grid = {0};
    size_t shape[3];
    double *xyz;
    bool done = true;

    check_names(value, grid_names, "/grid", list);
    if (!surface_grid_kind(json_string_value(json_object_get(value, "kind")), &grid.kind)) {
        problem_add(list, "/grid/kind", "must be gauss-legendre or equiangular");
    }
    grid.n_theta =
        read_count(json_object_get(value, "nTheta"), 5, SURFACE_ROWS_MAX, "/grid/nTheta", list);
    grid.n_phi =
        read_count(json_object_get(value, "nPhi"), 9, 2 * SURFACE_ROWS_MAX, "/grid/nPhi", list);
    if (!list->errors) {
        choose_degree(&grid, given, list);
    }
    if (list->errors) {
        return true;
    }
    shape[0] = grid.n_theta;
    shape[1] = grid.n_phi;
    shape[2] = 3;
    xyz = srnf_alloc(shape[0] * shape[1], 3 * sizeof(double));
    if (!xyz) {
        (void)problem_respond(call, "out-of-memory", "The grid does not fit into memory now.");
        return false;
    }
    if (json_read_numbers(json_object_get(value, "xyz"), 3, shape, xyz, list, "/grid/xyz")) {
        done = analyse(call, &grid, xyz, given);
    }
    srnf_free(xyz);
    return done;
}

static void read_name(const char *text, struct given *given, struct problem_list *list)
{
    const char *problem = name_problem(text);

    if (problem) {
        problem_add(list, "/name", "%s", problem);
        return;
    }
    memcpy(given->name, text, strlen(text) + 1);
}

static void read_scale(const char *text, struct given *given, struct problem_list *list)
{
    given->unit_area = strcmp(text, "unit-area") == 0;
    if (!given->unit_area && strcmp(text, "none") != 0) {
        problem_add(list, "/scale", "must be none or unit-area");
    }
}

static void read_orientation(const char *text, struct given *given, struct problem_list *list)
{
    given->any_orientation = strcmp(text, "any") == 0;
    if (!given->any_orientation && strcmp(text, "outward") != 0) {
        problem_add(list, "/orientation", "must be outward or any");
    }
}

/* A member that is absent or a string; NULL where it is absent. */
static const char *text_member(const json_t *body, const char *name, const char *pointer,
                               struct problem_list *list)
{
    const json_t *value = json_object_get(body, name);

    if (value && !json_is_string(value)) {
        problem_add(list, pointer, "must be a string");
    }
    return json_string_value(value);
}

/* What the query says would be passed over where the options stand in the body. */
static void refuse_query(const struct api_call *call, struct problem_list *list)
{
    const char *cursor = call->request->query;
    struct query_pair pair;
    char pointer[40];

    while (query_next(&cursor, &pair)) {
        (void)snprintf(pointer, sizeof pointer, "/%.*s", (int)pair.name_length, pair.name);
        problem_add(list, pointer, "stands in the body where that is JSON, not in the query");
    }
}

/* False when a problem of its own was answered; otherwise problems are in list. */
static bool read_json(struct api_call *call, const json_t *body, struct given *given,
                      struct problem_list *list)
{
    const json_t *coefficients = json_object_get(body, "coefficients");
    const json_t *grid = json_object_get(body, "grid"), *lmax = json_object_get(body, "lmax");
    const char *name = text_member(body, "name", "/name", list);
    const char *scale = text_member(body, "scale", "/scale", list);
    const char *orientation = text_member(body, "orientation", "/orientation", list);

    refuse_query(call, list);
    check_names(body, body_names, "", list);
    if (name) {
        read_name(name, given, list);
    }
    if (scale) {
        read_scale(scale, given, list);
    }
    if (orientation) {
        read_orientation(orientation, given, list);
    }
    if (json_is_object(coefficients) == json_is_object(grid)) {
        problem_add(list, json_is_object(grid) ? "/coefficients" : "/grid",
                    "must be given as an object, or else coefficients: one of the two");
        return true;
    }
    if (coefficients && lmax) {
        problem_add(list, "/lmax", "belongs into coefficients where those are given");
    }
    if (coefficients) {
        return read_coefficients(call, coefficients, given, list);
    }
    if (lmax) {
        given->degree = read_count(lmax, SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, "/lmax", list);
    }
    return read_grid(call, grid, given, list);
}

/* The options in the query of a .npy body. False when a problem was answered. */
static bool read_query(struct api_call *call, struct surface_grid *grid, struct given *given,
                       struct problem_list *list)
{
    char text[NAME_SIZE];
    bool refused = false;

    if (query_get(call, "name", text, sizeof text, &refused)) {
        read_name(text, given, list);
    }
    if (!refused && query_get(call, "scale", text, sizeof text, &refused)) {
        read_scale(text, given, list);
    }
    if (!refused && query_get(call, "orientation", text, sizeof text, &refused)) {
        read_orientation(text, given, list);
    }
    if (!refused && query_get(call, "kind", text, sizeof text, &refused) &&
        !surface_grid_kind(text, &grid->kind)) {
        problem_add(list, "/kind", "must be gauss-legendre or equiangular");
    }
    if (!refused && query_get(call, "lmax", text, sizeof text, &refused)) {
        long number;
        if (!query_whole(text, &number) || number < SRNF_DEGREE_MIN || number > SRNF_DEGREE_MAX) {
            problem_add(list, "/lmax", "must be a whole number from %d to %d", SRNF_DEGREE_MIN,
                        SRNF_DEGREE_MAX);
        } else {
            given->degree = (size_t)number;
        }
    }
    return !refused;
}

static bool all_finite(const double *values, size_t count, struct problem_list *list)
{
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(values[i])) {
            problem_add(list, "/grid/xyz", "number %zu of the array is not finite", i);
            return false;
        }
    }
    return true;
}

static bool read_npy(struct api_call *call, struct given *given, struct problem_list *list)
{
    const struct api_request *request = call->request;
    size_t limit = (size_t)SURFACE_ROWS_MAX * 2 * SURFACE_ROWS_MAX * 3;
    struct surface_grid grid = {.kind = SRNF_GRID_GAUSS_LEGENDRE};
    struct npy_array array = {0};
    char message[240];
    bool done = true;

    if (!read_query(call, &grid, given, list)) {
        return false;
    }
    if (npy_read(request->body, request->body_size, limit, &array, message, sizeof message)) {
        problem_add(list, "/grid/xyz", "%s", message);
        return true;
    }
    if (array.n_dimensions != 3 || array.shape[2] != 3 || array.shape[0] < 5 ||
        array.shape[1] < 9 || array.shape[0] > SURFACE_ROWS_MAX ||
        array.shape[1] > 2 * SURFACE_ROWS_MAX) {
        problem_add(list, "/grid/xyz",
                    "the array must have the shape (nTheta, nPhi, 3) with nTheta from 5 to %d and "
                    "nPhi from 9 to %d",
                    SURFACE_ROWS_MAX, 2 * SURFACE_ROWS_MAX);
    } else if (all_finite(array.values, array.count, list)) {
        grid.n_theta = array.shape[0];
        grid.n_phi = array.shape[1];
        choose_degree(&grid, given, list);
        if (!list->errors) {
            done = analyse(call, &grid, array.values, given);
        }
    }
    npy_clear(&array);
    return done;
}

/* Centres and scales where that was asked for; returns the scale, or 0 when a problem was noted.
   place: where the surface's origin then is in the coordinates that were sent. */
static double normalize(struct given *given, struct srnf_surface_measures *measures,
                        double place[3], struct problem_list *list)
{
    const double origin[3] = {0.0, 0.0, 0.0};
    size_t count = 3 * srnf_coefficient_count(given->degree);
    double scale = sqrt(measures->area);

    memset(place, 0, sizeof origin);

    if (!isfinite(measures->area) || !isfinite(measures->volume) || !(measures->area > 0.0)) {
        problem_add(list, given->has_fit ? "/grid/xyz" : "/coefficients",
                    "the surface has no area, or one that is not finite");
        return 0.0;
    }
    if (!given->unit_area) {
        return 1.0;
    }
    memcpy(place, measures->centroid, sizeof origin);
    srnf_surface_move(given->degree, given->coefficients, measures, origin);
    for (size_t i = 0; i < count; i++) {
        given->coefficients[i] /= scale;
    }
    measures->area = 1.0;
    measures->volume /= scale * scale * scale;
    return scale;
}

static void keep(struct api_call *call, struct given *given, struct problem_list *list)
{
    const struct surface_grid grid = {.kind = SRNF_GRID_GAUSS_LEGENDRE};
    struct surface_transform transform;
    struct srnf_surface_measures measures;
    struct surface_description description = {.name = given->name,
                                              .degree = given->degree,
                                              .coefficients = given->coefficients,
                                              .measures = &measures,
                                              .parameterization = "given"};
    const struct store_owner owner = call_owner(call);
    json_t *record = NULL;
    double place[3];
    bool created = false;
    int status;

    if (!surface_transform_open(call, given->degree, &grid, &transform)) {
        return;
    }
    srnf_surface_measure(transform.sht, given->coefficients, &measures, transform.workspace);
    surface_transform_close(&transform);
    description.scale = normalize(given, &measures, place, list);
    description.origin = place;
    if (list->errors) {
        (void)problem_respond_list(call, "invalid-input", list);
        return;
    }
    if (!given->any_orientation &&
        warning_shape_of(measures.area, measures.volume) == SHAPE_INSIDE_OUT) {
        (void)problem_respond(
            call, "surface-inside-out",
            "The volume is %.6g: the normals f_theta x f_phi point inwards, and whatever is "
            "computed would be of a mirror image. Turn one axis of the parameters: the columns of "
            "a grid in reverse order, or the sign of the coefficients with m < 0. With orientation "
            "any the surface is taken as it is, with a warning.",
            measures.volume);
        return;
    }
    description.fit = given->has_fit ? surface_fit_json(&given->fit) : NULL;
    status = surface_save(call->api->config.store, &owner, &description, &record, &created);
    if (status) {
        (void)problem_respond_store(call, status, NULL, "keeping the surface");
        return;
    }
    (void)api_response_header(call->response, "Location", "/v1/surfaces/%s",
                              json_string_value(json_object_get(record, "id")));
    respond_json(call, created ? 201 : 200, record);
}

void surfaces_create(struct api_call *call)
{
    const struct api_request *request = call->request;
    struct problem_list list = {.errors = NULL};
    struct given given = {0};
    json_t *body = NULL;
    bool done;

    if (npy_sniff(request->body, request->body_size)) {
        done = read_npy(call, &given, &list);
    } else {
        body = body_json(call);
        done = body && read_json(call, body, &given, &list);
    }
    if (done && list.errors) {
        (void)problem_respond_list(call, "invalid-input", &list);
    } else if (done) {
        keep(call, &given, &list);
    }
    json_decref(list.errors);
    json_decref(body);
    srnf_free(given.coefficients);
}
