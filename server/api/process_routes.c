/*
 * process_routes.c - the routes of what a process compares: counted, refused where a group is known
 * to mix them, and told in the result.
 *
 * Which inputs are compared stands in one table for all processes. Those that start a search
 * (initial of invert) or only name what is encoded (mesh and sphere of encode) are not among them.
 */
#include "api/process_routes.h"

#include <stdio.h>
#include <string.h>

#include "api/warnings.h"

#define NAMED_MAX 4 /* members that a sentence names */

/* In the order of the counts; the last is for what is not known. */
static const char *const names[] = {"star", "area", "given"};
#define KNOWN (sizeof names / sizeof names[0])
#define UNKNOWN KNOWN

struct tally {
    size_t n[KNOWN + 1];
    const char *first[KNOWN + 1][NAMED_MAX]; /* borrowed from the inputs */
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

const char *surface_route(const struct store_surface *surface)
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

static void count_all(struct tally *tally, struct store *store, const char *owner,
                      const json_t *ids, const char *of_mesh)
{
    for (size_t i = 0; i < json_array_size(ids); i++) {
        const char *id = json_string_value(json_array_get(ids, i));

        if (id) {
            count_one(tally, find_route(store, owner, id, of_mesh), id);
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

const char *routes_common(struct jobs_run *run, size_t n, const char *const *ids,
                          const char *of_mesh)
{
    const char *common = NULL;

    for (size_t i = 0; i < n; i++) {
        const char *route = find_route(jobs_run_store(run), jobs_run_owner(run), ids[i], of_mesh);

        if (!route || (i > 0 && route != common)) {
            return NULL;
        }
        common = route;
    }
    return common;
}

bool inputs_routes(struct process_inputs *inputs, const json_t *surfaces)
{
    struct store_view view = call_view(inputs->call);
    struct tally tally = {{0}, {{NULL}}};
    char members[320];

    if (inputs_boolean(inputs, "mixedRoutes", false) || inputs->list->errors || inputs->answered) {
        return !inputs->answered;
    }
    count_all(&tally, inputs->call->api->config.store, view.owner, surfaces, NULL);
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

/* ---- Origins --------------------------------------------------------------------------------- */

/* What encode wrote down of a surface; mirrored ones are those of another mesh. */
static void read_origin(const json_t *record, struct compute_origin *origin)
{
    const json_t *source = json_object_get(record, "source");
    const char *process = json_string_value(json_object_get(source, "process"));
    const char *mesh = json_string_value(json_object_get(source, "mesh"));
    const char *route = json_string_value(json_object_get(record, "parameterization"));
    const json_t *center = json_object_get(json_object_get(record, "starShaped"), "center");
    bool star = route && strcmp(route, "star") == 0;

    if (!process || strcmp(process, "encode") != 0 || !mesh || strlen(mesh) >= STORE_ID_MAX ||
        json_is_true(json_object_get(record, "mirrored")) ||
        (star ? json_array_size(center) != 3 : !route || strcmp(route, "area") != 0)) {
        return;
    }
    origin->route = star ? SRNF_PARAMETERIZATION_STAR : SRNF_PARAMETERIZATION_AREA;
    for (size_t k = 0; star && k < 3; k++) {
        origin->center[k] = json_number_value(json_array_get(center, k));
    }
    memcpy(origin->mesh, mesh, strlen(mesh) + 1);
}

void routes_origin(struct jobs_run *run, const char *id, struct compute_origin *origin)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct store_surface surface = {0};
    json_t *record = NULL;

    *origin = (struct compute_origin){.mesh = ""};
    if (compute_is_mesh(id)) {
        (void)snprintf(origin->mesh, sizeof origin->mesh, "%s", id);
        origin->route = srnf_encode_route(&options);
        return;
    }
    if (process_read(
            store_surface_get_as(jobs_run_store(run), jobs_run_owner(run), id, false, &surface))) {
        record = json_loads(surface.record ? surface.record : "{}", 0, NULL);
        read_origin(record, origin);
    }
    json_decref(record);
    store_surface_clear(&surface);
}

struct compute_origin *routes_origins(struct jobs_run *run, size_t n, const char *const *ids)
{
    struct compute_origin *origins = srnf_alloc(n ? n : 1, sizeof *origins);

    for (size_t i = 0; origins && i < n; i++) {
        routes_origin(run, ids[i], &origins[i]);
    }
    return origins;
}

/* ---- In results ------------------------------------------------------------------------------ */

static void count_inputs(struct tally *tally, struct jobs_run *run, const json_t *inputs)
{
    static const char *const single[] = {"model",  "surface", "from",     "to",    "template",
                                         "moving", "source",  "deformed", "target"};
    static const char *const velocities[] = {"velocity", "vector"};
    const char *method = json_string_value(json_object_get(inputs, "method"));
    const char *of_mesh = method && strcmp(method, "closed-form") == 0 ? "star" : NULL;
    struct store *store = jobs_run_store(run);
    const char *owner = jobs_run_owner(run), *id;

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
}

void routes_warn(struct jobs_run *run, const json_t *inputs, json_t *document)
{
    struct tally tally = {{0}, {{NULL}}};
    char members[320];
    json_t *figures;

    if (json_is_true(json_object_get(document, "bridged"))) {
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
    warning_add(json_object_get(document, "warnings"), "mixed-routes", figures,
                "What is compared came to its sphere by different routes: %s. The distances hold "
                "the difference of the routes too: encode all meshes with one parameterization.",
                members);
}
