/*
 * surfaces_record.c - the record of a surface: how it is written when a surface is stored, and
 * read back.
 *
 * The store keeps the record as a text beside the coefficients. A surface is named by its content
 * (degree, coefficients, scale) and by its place, so one that is made again keeps the record of the
 * first time: its source names the job that made it first. The results of a job still tell of that
 * job: its own name and source, whoever made the surface before. A moved copy of a mesh has the
 * same content in another place, and is another surface.
 */
#include "api/surfaces.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/labels.h"
#include "api/json_numbers.h"
#include "api/warnings.h"
#include "store/holdings.h"
#include "store/store.h"
#include "store/surface.h"

static const struct {
    const char *relation, *suffix;
} links[] = {
    {"self", ""},      {"coefficients", "/coefficients"}, {"srnf", "/srnf"}, {"grid", "/grid"},
    {"mesh", "/mesh"},
};

static json_t *links_json(const char *id)
{
    json_t *object = json_object();
    char path[STORE_ID_MAX + 40];

    for (size_t i = 0; object && i < sizeof links / sizeof links[0]; i++) {
        (void)snprintf(path, sizeof path, "/v1/surfaces/%s%s", id, links[i].suffix);
        (void)json_object_set_new(object, links[i].relation, json_string(path));
    }
    return object;
}

/* Told of any record, whenever it was kept. */
static void warn_of_shape(json_t *record)
{
    const json_t *area = json_object_get(record, "area"),
                 *volume = json_object_get(record, "volume");
    json_t *warnings = json_array();

    if (json_is_number(area) && json_is_number(volume)) {
        warning_shape(warnings, NULL, 1, json_number_value(area), json_number_value(volume));
    }
    if (json_array_size(warnings) > 0) {
        warnings_put(record, json_incref(warnings));
    }
    json_decref(warnings);
}

json_t *surface_record(const struct store_surface *surface)
{
    static const char *const kept[] = {
        "area",     "volume", "centroid", "scale",      "parameterization",
        "route",    "source", "fit",      "starShaped", "origin",
        "rotation", "frame",  "mirrored", "smoothing",  "warnings"};
    json_t *stored = json_loads(surface->record ? surface->record : "{}", 0, NULL), *record = NULL;

    if (!json_is_object(stored)) {
        json_decref(stored);
        return NULL;
    }
    record = json_object();
    (void)json_object_set_new(record, "id", json_string(surface->id));
    (void)json_object_set_new(record, "name", json_string(surface->name ? surface->name : ""));
    labels_set_tags(record, surface->tags);
    (void)json_object_set_new(record, "lmax", json_integer(surface->lmax));
    /* The members of the contract in its order, then whatever else was kept. */
    for (size_t i = 0; i < sizeof kept / sizeof kept[0]; i++) {
        if (json_object_get(stored, kept[i])) {
            (void)json_object_set(record, kept[i], json_object_get(stored, kept[i]));
        }
    }
    (void)json_object_update_missing(record, stored);
    warn_of_shape(record);
    if (!json_object_get(record, "frame")) {
        (void)json_object_set_new(record, "frame", json_null());
    }
    if (!json_object_get(record, "mirrored")) { /* kept before there were mirror images */
        (void)json_object_set_new(record, "mirrored", json_false());
    }
    (void)json_object_set_new(record, "created", json_time(surface->created_ms));
    (void)json_object_set_new(record, "links", links_json(surface->id));
    json_decref(stored);
    return record;
}

double surface_record_number(const struct store_surface *surface, const char *name, double fallback)
{
    json_t *record = json_loads(surface->record ? surface->record : "{}", 0, NULL);
    const json_t *value = json_object_get(record, name);
    double number = json_is_number(value) ? json_number_value(value) : fallback;

    json_decref(record);
    return number;
}

/* Three numbers of a record; false where there are not. */
static bool read_vector(const json_t *array, double vector[3])
{
    bool found = json_array_size(array) == 3;

    for (size_t i = 0; i < 3 && found; i++) {
        found = json_is_number(json_array_get(array, i));
        vector[i] = json_number_value(json_array_get(array, i));
    }
    return found;
}

/* The mesh whose coordinates a surface is in. Records that were kept before their frame said so
   have it as what the frame is of or, before there were frames, as the source. */
static void read_mesh(const json_t *record, char mesh[STORE_ID_MAX])
{
    const json_t *frame = json_object_get(record, "frame");
    const char *id = json_string_value(json_object_get(frame, "mesh"));

    if (!id) {
        id = json_string_value(frame ? json_object_get(frame, "of")
                                     : json_object_get(json_object_get(record, "source"), "mesh"));
    }
    if (id && strncmp(id, "mesh-", 5) == 0 && strlen(id) < STORE_ID_MAX) {
        (void)snprintf(mesh, STORE_ID_MAX, "%s", id);
    }
}

struct surface_place surface_record_place(const struct store_surface *surface)
{
    struct surface_place place = {.scale = surface_record_number(surface, "scale", 1.0),
                                  .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    json_t *record = json_loads(surface->record ? surface->record : "{}", 0, NULL);
    const json_t *rows = json_object_get(record, "rotation");
    const char *process =
        json_string_value(json_object_get(json_object_get(record, "source"), "process"));
    const json_t *reflected = json_object_get(json_object_get(record, "frame"), "reflected");
    double rotation[9], origin[3], centroid[3];

    if (!(place.scale > 0.0)) {
        place.scale = 1.0;
    }
    place.known = read_vector(json_object_get(record, "origin"), origin);
    if (place.known) {
        memcpy(place.origin, origin, sizeof origin);
        /* The process mirror reflects origin as well; its older records do not say so. */
        place.told = json_is_boolean(reflected) || (process && strcmp(process, "mirror") == 0);
        place.reflected = json_is_true(reflected);
        read_mesh(record, place.mesh);
    }
    if (read_vector(json_object_get(record, "centroid"), centroid)) {
        memcpy(place.centroid, centroid, sizeof centroid);
    }
    if (place.known && json_array_size(rows) == 3 &&
        read_vector(json_array_get(rows, 0), rotation) &&
        read_vector(json_array_get(rows, 1), rotation + 3) &&
        read_vector(json_array_get(rows, 2), rotation + 6)) {
        memcpy(place.rotation, rotation, sizeof rotation);
    }
    json_decref(record);
    return place;
}

void surface_record_id(const struct store_surface *surface, bool older, char id[STORE_ID_MAX])
{
    const struct surface_place place = surface_record_place(surface);

    store_surface_id(id, surface->lmax, surface->coefficients,
                     surface_record_number(surface, "scale", 0.0));
    if (place.known && !older) {
        store_surface_id_place(id, place.origin, place.rotation, place.mesh);
    }
    if (surface->maps.count) {
        store_surface_id_maps(id, &surface->maps);
    }
}

bool surface_record_mirrored(const struct store_surface *surface)
{
    json_t *record = json_loads(surface->record ? surface->record : "{}", 0, NULL);
    bool mirrored = json_is_true(json_object_get(record, "mirrored"));

    json_decref(record);
    return mirrored;
}

json_t *surface_frame_json(const char *of, const char *format, ...)
{
    char detail[300];
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    return json_pack("{s:s, s:s}", "of", of, "detail", detail);
}

void surface_record_frame(const struct store_surface *surface, char *detail, size_t size)
{
    json_t *record = json_loads(surface->record ? surface->record : "{}", 0, NULL);
    const char *text =
        json_string_value(json_object_get(json_object_get(record, "frame"), "detail"));

    (void)snprintf(detail, size, "%s", text ? text : "");
    json_decref(record);
}

static json_t *or_null(json_t *value)
{
    return value ? value : json_null();
}

static json_t *map_names(const struct store_maps *maps)
{
    json_t *names = json_array();

    for (size_t i = 0; i < maps->count; i++) {
        (void)json_array_append_new(names, json_string(maps->names[i]));
    }
    return names;
}

/* A copy of the maps that the store can own; false without memory. */
static bool copy_maps(struct store_maps *copy, const struct store_maps *maps)
{
    size_t size = store_maps_values(maps) * sizeof(double);

    *copy = *maps;
    copy->values = malloc(size ? size : 1);
    if (copy->values) {
        memcpy(copy->values, maps->values, size);
    }
    return copy->values != NULL;
}

static json_t *json_rows(const double matrix[9])
{
    json_t *rows = json_array();

    for (size_t i = 0; i < 3; i++) {
        (void)json_array_append_new(rows, json_vector(matrix + 3 * i, 3));
    }
    return rows;
}

/* What the store keeps beside id, name, degree and time. */
static char *record_text(struct surface_description *d)
{
    json_t *record = json_object();
    char *text;

    (void)json_object_set_new(record, "area", json_finite(d->measures->area));
    (void)json_object_set_new(record, "volume", json_finite(d->measures->volume));
    (void)json_object_set_new(record, "centroid", json_vector(d->measures->centroid, 3));
    (void)json_object_set_new(record, "scale", json_finite(d->scale));
    (void)json_object_set_new(record, "parameterization", json_string(d->parameterization));
    (void)json_object_set_new(record, "route", d->route ? json_string(d->route) : json_null());
    (void)json_object_set_new(record, "source", or_null(d->source));
    (void)json_object_set_new(record, "fit", or_null(d->fit));
    (void)json_object_set_new(record, "starShaped", or_null(d->star));
    (void)json_object_set_new(record, "origin",
                              d->origin ? json_vector(d->origin, 3) : json_null());
    if (d->rotation) {
        (void)json_object_set_new(record, "rotation", json_rows(d->rotation));
    }
    if (d->frame) {
        (void)json_object_set_new(d->frame, "mesh",
                                  d->frame_mesh && d->frame_mesh[0] ? json_string(d->frame_mesh)
                                                                    : json_null());
        (void)json_object_set_new(record, "frame", d->frame);
    }
    (void)json_object_set_new(record, "mirrored", json_boolean(d->mirrored));
    if (d->smoothing) {
        (void)json_object_set_new(record, "smoothing", json_finite(*d->smoothing));
    }
    if (d->maps) {
        (void)json_object_set_new(record, "maps", map_names(d->maps));
    }
    if (d->warnings) {
        (void)json_object_set_new(record, "warnings", d->warnings);
    }
    d->source = d->fit = d->star = d->warnings = d->frame = NULL;
    text = json_memory_dumps(record, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    json_decref(record);
    return text;
}

static bool is_same_place(const struct surface_place *a, const struct surface_place *b)
{
    return a->known == b->known && memcmp(a->origin, b->origin, sizeof a->origin) == 0 &&
           memcmp(a->rotation, b->rotation, sizeof a->rotation) == 0 &&
           strcmp(a->mesh, b->mesh) == 0;
}

/* Sets the surface's id: that of its content and place or, where the owner has it from before there
   were places in ids, the one that it has, under which answers are kept. */
static int identify(struct store *store, struct store_surface *surface)
{
    char older[STORE_ID_MAX];
    struct store_surface held = {.name = NULL};
    int status;

    surface_record_id(surface, false, surface->id);
    surface_record_id(surface, true, older);
    if (strcmp(older, surface->id) == 0) {
        return STORE_OK;
    }
    status = store_owner_has(store, surface->owner.name, older);
    if (status == STORE_OK) {
        status = store_surface_get_as(store, surface->owner.name ? surface->owner.name : "", older,
                                      false, &held);
    }
    if (status == STORE_OK) {
        const struct surface_place own = surface_record_place(surface),
                                   had = surface_record_place(&held);

        if (is_same_place(&own, &had)) {
            (void)snprintf(surface->id, sizeof surface->id, "%s", older);
        }
    }
    store_surface_clear(&held);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

int surface_save(struct store *store, const struct store_owner *owner,
                 struct surface_description *description, json_t **record, bool *created)
{
    struct store_surface surface = {.owner = *owner};
    size_t count = 3 * srnf_coefficient_count(description->degree);
    bool is_new = false, of_job = description->source != NULL;
    json_t *own = NULL;
    int status = STORE_NOMEM;

    *record = NULL;
    surface.lmax = (int64_t)description->degree;
    surface.name = strdup(description->name ? description->name : "");
    surface.record = record_text(description);
    surface.coefficients = malloc(count * sizeof(double));
    surface.coefficient_count = count;
    if (!surface.name || !surface.record || !surface.coefficients) {
        goto out;
    }
    memcpy(surface.coefficients, description->coefficients, count * sizeof(double));
    if (description->maps && !copy_maps(&surface.maps, description->maps)) {
        goto out;
    }
    status = identify(store, &surface);
    if (status != STORE_OK) {
        goto out;
    }
    surface.alone = description->of_mesh_alone;
    surface.created_ms = store_now_ms();
    own = of_job ? surface_record(&surface) : NULL;
    status = store_surface_put(store, &surface, &is_new);
    if (status == 0) {
        *record = surface_record(&surface);
        if (*record && own) {
            (void)json_object_set(own, "created", json_object_get(*record, "created"));
            (void)json_object_update_existing(*record, own);
        }
        status = *record ? 0 : STORE_NOMEM;
    }
    if (created) {
        *created = is_new;
    }
out:
    json_decref(own);
    store_surface_clear(&surface);
    return status;
}

json_t *surface_fit_json(const struct srnf_fit *fit)
{
    double scale = fit->diagonal > 0.0 ? 1.0 / fit->diagonal : 0.0;

    return json_pack("{s:o, s:o, s:o, s:{s:o, s:o, s:o}}", "rms", json_finite(fit->rms), "p95",
                     json_finite(fit->p95), "max", json_finite(fit->max), "relativeToDiagonal",
                     "rms", json_finite(fit->rms * scale), "p95", json_finite(fit->p95 * scale),
                     "max", json_finite(fit->max * scale));
}

json_t *surface_star_json(const struct srnf_star *star)
{
    return json_pack("{s:b, s:o, s:o, s:o}", "value", star->value, "center",
                     json_vector(star->center, 3), "margin", json_finite(star->margin),
                     "violatingAreaFraction", json_finite(star->violating_area_fraction));
}

json_t *surface_distortion_json(const struct srnf_distortion *distortion)
{
    return json_pack("{s:o, s:o, s:I}", "symmetricDirichlet",
                     json_finite(distortion->symmetric_dirichlet), "logAreaDeviation",
                     json_finite(distortion->log_area_deviation), "flipped",
                     (json_int_t)distortion->flipped);
}
