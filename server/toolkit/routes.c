/*
 * routes.c - the routes of what a process compares: counted, refused where a group is known
 * to mix them, and told in the result.
 *
 * Which inputs are compared stands in one table for all processes. Those that start a search
 * (initial of invert) or only name what is encoded (mesh and sphere of encode) are not among them.
 */
#include "toolkit/routes.h"

#include <stdio.h>
#include <string.h>

#include "api/auth.h"
#include "api/warnings.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"

#define NAMED_MAX 4 /* members that a sentence names */

/* In the order of the counts; the last is for what is not known. */
static const char *const names[] = {"star", "area", "given"};
#define KNOWN (sizeof names / sizeof names[0])
#define UNKNOWN KNOWN
enum { STAR, AREA };

struct tally {
    size_t n[KNOWN + 1];
    const char *first[KNOWN + 1][NAMED_MAX]; /* borrowed from the inputs */
    const json_t *bridged;                   /* ids of members that go by area; or NULL */
};

/* ---- Of one surface -------------------------------------------------------------------------- */

static const char *known_name(const char *text)
{
    for (size_t i = 0; text && i < KNOWN; i++) {
        if (strcmp(text, names[i]) == 0) {
            return names[i];
        }
    }
    return NULL;
}

/* Records of a time before they told of the route: encode's parameterization is one, and "given" is
   one where a process made the surface. */
static const char *route_of_old(const json_t *record)
{
    const char *text = json_string_value(json_object_get(record, "parameterization"));

    if (text && strcmp(text, "given") == 0 && !json_is_object(json_object_get(record, "source"))) {
        return NULL;
    }
    return known_name(text);
}

static const char *surface_route(const struct store_surface *surface)
{
    json_t *record = json_loads(surface->record ? surface->record : "{}", 0, NULL);
    const json_t *route = json_object_get(record, "route");
    const char *name = route ? known_name(json_string_value(route)) : route_of_old(record);

    json_decref(record);
    return name;
}

static const char *default_route(void)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();

    return known_name(srnf_parameterization_name(srnf_encode_route(&options)));
}

static const char *stored_route(struct store *store, const char *owner, const char *id)
{
    struct store_surface surface = {0};
    const char *route = NULL;

    if (process_read(store_surface_get_as(store, owner, id, false, &surface))) {
        route = surface_route(&surface);
    }
    store_surface_clear(&surface);
    return route;
}

/* Of a surface, a mesh, or a model, which is where its mean is. */
static const char *find_route(struct store *store, const char *owner, const char *id,
                              const char *of_mesh)
{
    struct store_model model = {.record = NULL};
    const char *route = NULL;

    if (compute_is_mesh(id)) {
        return of_mesh ? known_name(of_mesh) : default_route();
    }
    if (strncmp(id, "model-", 6) != 0) {
        return stored_route(store, owner, id);
    }
    if (process_read(store_model_get_as(store, owner, id, 0, &model))) {
        route = stored_route(store, owner, model.mean);
    }
    store_model_clear(&model);
    return route;
}

/* ---- Of several ------------------------------------------------------------------------------ */

static size_t index_of(const char *route)
{
    size_t i = 0;

    while (i < KNOWN && route != names[i]) {
        i++;
    }
    return i;
}

static void count_one(struct tally *tally, const char *route, const char *id)
{
    size_t i = index_of(route);

    if (tally->n[i] < NAMED_MAX) {
        tally->first[i][tally->n[i]] = id;
    }
    tally->n[i]++;
}

static bool is_among(const json_t *ids, const char *id)
{
    for (size_t i = 0; i < json_array_size(ids); i++) {
        if (strcmp(json_string_value(json_array_get(ids, i)), id) == 0) {
            return true;
        }
    }
    return false;
}

static void count_all(struct tally *tally, struct store *store, const char *owner,
                      const json_t *ids, const char *of_mesh)
{
    for (size_t i = 0; i < json_array_size(ids); i++) {
        const char *id = json_string_value(json_array_get(ids, i));

        if (id) {
            count_one(tally,
                      is_among(tally->bridged, id) ? names[AREA]
                                                   : find_route(store, owner, id, of_mesh),
                      id);
        }
    }
}

static size_t kinds(const struct tally *tally, size_t among)
{
    size_t n = 0;

    for (size_t i = 0; i < among; i++) {
        n += tally->n[i] > 0;
    }
    return n;
}

/* "3 by star (surf-.., surf-.., surf-..), 12 by area": all kinds but the most frequent with their
   first members. */
static void describe(const struct tally *tally, char *text, size_t size)
{
    size_t most = 0, used = 0;

    for (size_t i = 1; i <= KNOWN; i++) {
        most = tally->n[i] > tally->n[most] ? i : most;
    }
    text[0] = '\0';
    for (size_t i = 0; i <= KNOWN && used < size; i++) {
        size_t shown = tally->n[i] < NAMED_MAX ? tally->n[i] : NAMED_MAX;

        if (tally->n[i] == 0) {
            continue;
        }
        used += (size_t)snprintf(text + used, size - used, "%s%zu by %s", used ? ", " : "",
                                 tally->n[i], i < KNOWN ? names[i] : "a route that is not known");
        for (size_t k = 0; i != most && k < shown && used < size; k++) {
            used += (size_t)snprintf(text + used, size - used, "%s%s%s", k ? ", " : " (",
                                     tally->first[i][k],
                                     k + 1 < shown         ? ""
                                     : shown < tally->n[i] ? ", ..)"
                                                           : ")");
        }
    }
}

/* bridged may be NULL. */
static const char *find_common(struct jobs_run *run, size_t n, const char *const *ids,
                               const char *of_mesh, const bool *bridged)
{
    const char *common = NULL;

    for (size_t i = 0; i < n; i++) {
        const char *route =
            bridged && bridged[i]
                ? names[AREA]
                : find_route(jobs_run_store(run), jobs_run_owner(run), ids[i], of_mesh);

        if (!route || (i > 0 && route != common)) {
            return NULL;
        }
        common = route;
    }
    return common;
}

const char *routes_common(struct jobs_run *run, size_t n, const char *const *ids,
                          const char *of_mesh)
{
    return find_common(run, n, ids, of_mesh, NULL);
}

const char *routes_of_group(struct jobs_run *run, size_t n, const char *const *ids,
                            const bool *bridged)
{
    return find_common(run, n, ids, NULL, bridged);
}

/* ---- Origins --------------------------------------------------------------------------------- */

/* The smoothing that encode was asked for: in the record, or, where that is of an older time, in
   the inputs of the job. False where neither tells. */
static bool read_smoothing(struct store *store, const json_t *record, double *smoothing)
{
    const char *id = json_string_value(json_object_get(json_object_get(record, "source"), "job"));
    const json_t *value = json_object_get(record, "smoothing");
    struct store_job job = {.inputs = NULL};
    json_t *inputs = NULL;
    bool known;

    if (!value && id && process_read(store_job_get(store, id, &job))) {
        inputs = json_loads(job.inputs ? job.inputs : "{}", 0, NULL);
        value = json_object_get(inputs, "smoothing");
    }
    known = json_is_number(value);
    *smoothing = known ? json_number_value(value) : 0.0;
    json_decref(inputs);
    store_job_clear(&job);
    return known;
}

static bool is_mirrored_mesh(struct store *store, const char *owner, const char *id)
{
    struct store_mesh mesh = {.name = NULL};
    bool mirrored =
        process_read(store_mesh_get_as(store, owner, id, &mesh)) && mesh_mirrored(&mesh);

    store_mesh_clear(&mesh);
    return mirrored;
}

/* What encode wrote down of a surface. */
static void read_origin(struct store *store, const char *owner, const char *id,
                        const json_t *record, struct compute_origin *origin)
{
    const json_t *source = json_object_get(record, "source");
    const char *process = json_string_value(json_object_get(source, "process"));
    const char *mesh = json_string_value(json_object_get(source, "mesh"));
    const char *route = json_string_value(json_object_get(record, "parameterization"));
    const json_t *center = json_object_get(json_object_get(record, "starShaped"), "center");
    bool star = route && strcmp(route, names[STAR]) == 0;

    if (!process || strcmp(process, "encode") != 0 || !mesh || strlen(mesh) >= STORE_ID_MAX ||
        (star ? json_array_size(center) != 3 : !route || strcmp(route, names[AREA]) != 0) ||
        !read_smoothing(store, record, &origin->smoothing)) {
        return;
    }
    origin->route = star ? SRNF_PARAMETERIZATION_STAR : SRNF_PARAMETERIZATION_AREA;
    for (size_t k = 0; star && k < 3; k++) {
        origin->center[k] = json_number_value(json_array_get(center, k));
    }
    /* What encode was asked for: the mesh may be a mirror image itself. */
    origin->mirrored =
        json_is_true(json_object_get(record, "mirrored")) != is_mirrored_mesh(store, owner, mesh);
    /* The unit of the mesh is scale 1: the root of an area is that by the rarest of chances. */
    origin->unit_area = json_number_value(json_object_get(record, "scale")) != 1.0;
    (void)snprintf(origin->surface, sizeof origin->surface, "%s", id);
    memcpy(origin->mesh, mesh, strlen(mesh) + 1);
}

static void find_origin(struct store *store, const char *owner, const char *id,
                        struct compute_origin *origin)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct store_surface surface = {0};
    json_t *record = NULL;

    *origin = (struct compute_origin){.mesh = "", .unit_area = true};
    if (compute_is_mesh(id)) {
        (void)snprintf(origin->mesh, sizeof origin->mesh, "%s", id);
        origin->route = srnf_encode_route(&options);
        return;
    }
    if (process_read(store_surface_get_as(store, owner, id, false, &surface))) {
        record = json_loads(surface.record ? surface.record : "{}", 0, NULL);
        read_origin(store, owner, id, record, origin);
    }
    json_decref(record);
    store_surface_clear(&surface);
}

void routes_origin(struct jobs_run *run, const char *id, struct compute_origin *origin)
{
    find_origin(jobs_run_store(run), jobs_run_owner(run), id, origin);
}

/* ---- Bridges --------------------------------------------------------------------------------- */

/* Star leads to area, where there is somebody. */
static bool is_bridged(const struct tally *tally)
{
    return tally->n[STAR] > 0 && tally->n[AREA] > 0;
}

static bool find_bridge(struct store *store, const char *owner, const char *id,
                        struct compute_origin *origin)
{
    find_origin(store, owner, id, origin);
    if (origin->mesh[0] && origin->surface[0] && origin->route == SRNF_PARAMETERIZATION_STAR) {
        return true;
    }
    *origin = (struct compute_origin){.mesh = ""};
    return false;
}

/* Encodings that bridge the routes are work of the job. */
static void note_bridges(struct process_inputs *inputs, const struct tally *tally,
                         const json_t *surfaces)
{
    struct store *store = inputs->call->api->config.store;
    struct api_work *work = &inputs->call->work;
    struct compute_origin origin;

    for (size_t i = 0; is_bridged(tally) && i < json_array_size(surfaces); i++) {
        const char *id = json_string_value(json_array_get(surfaces, i));
        struct store_mesh mesh = {0};

        if (find_bridge(store, call_view(inputs->call).owner, id ? id : "", &origin)) {
            work->bridges++;
            if (store_mesh_get(store, origin.mesh, &mesh) == STORE_OK) {
                work->bridged_faces += mesh.faces;
            }
            store_mesh_clear(&mesh);
        }
    }
}

struct compute_origin *routes_bridges(struct jobs_run *run, bool allowed, size_t n,
                                      const char *const *ids)
{
    struct compute_origin *origins = srnf_alloc(n ? n : 1, sizeof *origins);
    struct store *store = jobs_run_store(run);
    struct tally tally = {.bridged = NULL};

    if (!origins || !allowed) {
        return origins;
    }
    for (size_t i = 0; i < n; i++) {
        count_one(&tally, find_route(store, jobs_run_owner(run), ids[i], NULL), ids[i]);
    }
    for (size_t i = 0; is_bridged(&tally) && i < n; i++) {
        (void)find_bridge(store, jobs_run_owner(run), ids[i], &origins[i]);
    }
    return origins;
}

/* ---- In inputs ------------------------------------------------------------------------------- */

bool inputs_routes(struct process_inputs *inputs, const json_t *surfaces)
{
    struct store_view view = call_view(inputs->call);
    struct tally tally = {.bridged = NULL};
    bool mixed = json_is_true(json_object_get(inputs->canonical, "mixedRoutes"));
    char members[320];

    if (inputs->list->errors || inputs->answered) {
        return !inputs->answered;
    }
    count_all(&tally, inputs->call->api->config.store, view.owner, surfaces, NULL);
    if (mixed) {
        note_bridges(inputs, &tally, surfaces);
        return true;
    }
    if (kinds(&tally, KNOWN) < 2) {
        return true;
    }
    describe(&tally, members, sizeof members);
    (void)problem_respond(inputs->call, "mixed-routes",
                          "The surfaces came to their sphere by different routes: %s. Encode all "
                          "meshes with one parameterization, or set mixedRoutes to true.",
                          members);
    inputs->answered = true;
    return false;
}

/* ---- In results ------------------------------------------------------------------------------ */

void routes_set_bridged(json_t *document, size_t n, const char *const *ids, const bool *bridged)
{
    json_t *surfaces = json_array();

    for (size_t i = 0; i < n; i++) {
        if (bridged[i]) {
            (void)json_array_append_new(surfaces, json_string(ids[i]));
        }
    }
    (void)json_object_set_new(document, "bridged", json_boolean(json_array_size(surfaces) > 0));
    (void)json_object_set_new(document, "bridgedSurfaces", surfaces);
}

static void count_inputs(struct tally *tally, struct jobs_run *run, const json_t *inputs)
{
    static const char *const single[] = {"model",  "surface", "from",     "to",    "template",
                                         "moving", "source",  "deformed", "target"};
    static const char *const velocities[] = {"velocity", "vector"};
    const char *method = json_string_value(json_object_get(inputs, "method"));
    const char *of_mesh = method && strcmp(method, "closed-form") == 0 ? "star" : NULL;
    struct store *store = jobs_run_store(run);
    const char *owner = jobs_run_owner(run), *id, *part;
    json_t *surface;

    for (size_t i = 0; i < sizeof single / sizeof single[0]; i++) {
        id = json_string_value(json_object_get(inputs, single[i]));
        if (id) {
            count_one(tally, find_route(store, owner, id, of_mesh), id);
        }
    }
    for (size_t i = 0; i < sizeof velocities / sizeof velocities[0]; i++) {
        id = json_string_value(json_object_get(json_object_get(inputs, velocities[i]), "toward"));
        if (id) {
            count_one(tally, find_route(store, owner, id, of_mesh), id);
        }
    }
    count_all(tally, store, owner, json_object_get(inputs, "surfaces"), of_mesh);
    count_all(tally, store, owner, json_object_get(json_object_get(inputs, "cohort"), "surfaces"),
              of_mesh);
    json_object_foreach(json_object_get(inputs, "parts"), part, surface)
    {
        id = json_string_value(surface);
        if (id) {
            count_one(tally, find_route(store, owner, id, of_mesh), id);
        }
    }
}

void routes_warn(struct jobs_run *run, const json_t *inputs, json_t *document)
{
    struct tally tally = {.bridged = NULL};
    char members[320];
    json_t *figures;

    tally.bridged = json_object_get(document, "bridgedSurfaces");
    if (!tally.bridged && json_is_true(json_object_get(document, "bridged"))) {
        return;
    }
    count_inputs(&tally, run, inputs);
    if (kinds(&tally, KNOWN + 1) < 2) {
        return;
    }
    describe(&tally, members, sizeof members);
    figures = json_object();
    for (size_t i = 0; i <= KNOWN; i++) {
        (void)json_object_set_new(figures, i < KNOWN ? names[i] : "unknown",
                                  json_integer((json_int_t)tally.n[i]));
    }
    (void)json_object_set_new(figures, "bridged",
                              json_integer((json_int_t)json_array_size(tally.bridged)));
    warning_add(json_object_get(document, "warnings"), "mixed-routes", figures,
                "What is compared came to its sphere by different routes: %s. The distances hold "
                "the difference of the routes too: encode all meshes with one parameterization.",
                members);
}
