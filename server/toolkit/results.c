/*
 * results.c - what the results of all processes have in common: the inputs after
 * defaulting, the numeric build that made them, and the parts of surface records.
 */
#include "toolkit/process.h"
#include "api/json_memory.h"
#include "toolkit/answers.h"
#include "toolkit/giveaways.h"
#include "toolkit/outliers.h"
#include "toolkit/routes.h"
#include "toolkit/scales.h"
#include "toolkit/sizes.h"
#include "api/surfaces.h"
#include "api/warnings.h"
#include "store/mesh.h"
#include "store/surface.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

json_t *process_parse(const char *inputs, struct jobs_result *result)
{
    json_t *document;

    process_read_begin();
    document = json_memory_load(inputs, strlen(inputs), 0, NULL, NULL);
    if (!document) {
        result->problem_code = json_memory_failed() ? "out-of-memory" : "internal-error";
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "The stored inputs of the job cannot be read.");
    }
    return document;
}

static void warn_poor(json_t *warnings, const struct jobs_doubt *doubt)
{
    const struct srnf_judgement *j = &doubt->judgement;
    const char *surface = doubt->surface;

    warning_add(
        warnings, "encoding-poor",
        json_pack("{s:s, s:s*, s:I, s:o, s:o, s:o, s:o, s:o}", "mesh", doubt->mesh, "standsFor",
                  surface[0] ? surface : NULL, "lmax", (json_int_t)doubt->degree, "fit",
                  json_finite(j->fit), "max", json_finite(j->max), "volume", json_finite(j->volume),
                  "area", json_finite(j->area), "energy", json_finite(j->energy)),
        "%s%sThe surface of %s at degree %zu%s is %.3g %% of the diagonal from it (root mean "
        "square; %.3g %% at most), with %.3g times its volume and %.3g times its area, and the map "
        "to the sphere has an energy of %.3g (4 is least). A higher lmax, less smoothing or "
        "another "
        "parameterization may do better.",
        surface, surface[0] ? " is compared through its mesh by area. " : "", doubt->mesh,
        doubt->degree, surface[0] ? " by area" : "", 100.0 * j->fit, 100.0 * j->max, j->volume,
        j->area, j->energy);
}

static void warn_of(json_t *warnings, const struct jobs_doubt *doubt)
{
    if (doubt->coarseness >= JOBS_COARSE) {
        warning_coarse(warnings, doubt->mesh, doubt->coarseness);
    }
    if (doubt->judgement.verdict != SRNF_FAITHFUL) {
        warn_poor(warnings, doubt);
    }
}

json_t *process_doubt(const struct jobs_doubt *doubt)
{
    json_t *warnings = json_array();

    warn_of(warnings, doubt);
    if (doubt->untransformed) {
        warning_untransformed(warnings, doubt->mesh, 1);
    }
    return warnings;
}

/* One for all meshes: a study has its files from one program. The doubts are sorted by mesh. */
static void warn_untransformed(json_t *warnings, size_t count, const struct jobs_doubt *doubts)
{
    const char *first = NULL, *last = "";
    size_t meshes = 0;

    for (size_t i = 0; i < count; i++) {
        if (doubts[i].untransformed && strcmp(doubts[i].mesh, last) != 0) {
            last = doubts[i].mesh;
            first = first ? first : last;
            meshes++;
        }
    }
    if (meshes > 0) {
        warning_untransformed(warnings, first, meshes);
    }
}

json_t *process_doubts(struct jobs_run *run)
{
    const struct jobs_doubt *doubts;
    size_t count = jobs_run_doubts(run, &doubts);
    json_t *warnings = json_array();

    for (size_t i = 0; i < count; i++) {
        warn_of(warnings, &doubts[i]);
    }
    warn_untransformed(warnings, count, doubts);
    return warnings;
}

void process_finish(struct jobs_run *run, json_t *document, json_t *inputs,
                    struct jobs_result *result)
{
    json_t *doubts = process_doubts(run);

    routes_warn(run, inputs, document);
    degrees_warn(run, inputs, document);
    units_warn(run, inputs, document);
    shapes_warn(run, inputs, document);
    outliers_warn(run, inputs, document);
    giveaways_warn(inputs, document);
    giveaways_warn_labels(inputs, document);
    giveaways_warn_subjects(inputs, document);
    answers_warn(inputs, document);
    warnings_merge(warnings_of(document), doubts);
    json_decref(doubts);
    (void)json_object_set_new(document, "numericBuild", json_string(jobs_run_numeric_build(run)));
    (void)json_object_set(document, "inputs", inputs);
    result->results =
        document ? json_memory_dumps(document, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    if (!result->results) {
        process_fail_document(result, "writing the results");
    }
    json_decref(document);
}

bool process_finite(size_t count, const double *values, const char *what,
                    struct jobs_result *result)
{
    bool finite = true;

    for (size_t i = 0; i < count && finite; i++) {
        finite = isfinite(values[i]);
    }
    if (!finite) {
        result->problem_code = "numerical-failure";
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "%s: there are numbers beyond the range of double precision.", what);
    }
    return finite;
}

/* Finite numbers and an area. */
static bool surface_sound(const struct surface_description *description, const char *what,
                          struct jobs_result *result)
{
    const struct srnf_surface_measures *measures = description->measures;
    const double sizes[] = {measures->area, measures->volume, description->scale};

    if (!process_finite(3, sizes, what, result) ||
        !process_finite(3 * srnf_coefficient_count(description->degree), description->coefficients,
                        what, result)) {
        return false;
    }
    if (!(measures->area > DBL_MIN)) {
        result->problem_code = "not-converged";
        (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                       "%s: the surface that was reached has shrunk to a point.", what);
        return false;
    }
    return true;
}

json_t *process_keep_surface(struct jobs_run *run, struct surface_description *description,
                             const char *what, struct jobs_result *result)
{
    struct store_owner owner = {.name = NULL};
    json_t *record = NULL;
    int status;

    if (!surface_sound(description, what, result)) {
        json_decref(description->source);
        json_decref(description->fit);
        json_decref(description->star);
        json_decref(description->warnings);
        json_decref(description->frame);
        return NULL;
    }
    owner.name = jobs_run_owner(run);
    owner.bytes_max = STORE_BYTES_KEPT;
    status = surface_save(jobs_run_store(run), &owner, description, &record, NULL);
    if (status) {
        (void)compute_fail_kept(run, result, status, what);
    }
    return record;
}

json_t *process_keep_mesh(struct jobs_run *run, struct mesh_description *description,
                          const char *what, struct jobs_result *result)
{
    const struct store_owner owner = {.name = jobs_run_owner(run), .bytes_max = STORE_BYTES_KEPT};
    json_t *record = NULL;
    int failed = 0;
    int status = mesh_save(jobs_run_jobs(run), jobs_run_store(run), &owner, description,
                           jobs_run_context(run), &record, &failed);

    if (failed < 0) {
        (void)compute_fail(result, failed, NULL, what);
    } else if (status) {
        (void)compute_fail_kept(run, result, status, what);
    }
    return record;
}

json_t *process_source(struct jobs_run *run, const char *process, const char *mesh,
                       const char *reference)
{
    json_t *source = json_object();

    (void)json_object_set_new(source, "mesh", mesh ? json_string(mesh) : json_null());
    (void)json_object_set_new(source, "process", json_string(process));
    (void)json_object_set_new(source, "job", json_string(jobs_run_job_id(run)));
    if (reference) {
        (void)json_object_set_new(source, "reference", json_string(reference));
    }
    return source;
}

double process_scale(struct jobs_run *run, const char *id, double known)
{
    struct store_surface surface = {0};
    double scale = known;

    if (scale > 0.0) {
        return scale;
    }
    if (process_read(store_surface_get(jobs_run_store(run), id, false, &surface))) {
        scale = surface_record_number(&surface, "scale", 1.0);
    }
    store_surface_clear(&surface);
    return scale > 0.0 ? scale : 1.0;
}

struct surface_place process_place(struct jobs_run *run, const struct compute_surface *surface)
{
    struct surface_place place = {.scale = surface->scale > 0.0 ? surface->scale : 1.0,
                                  .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    struct store_surface stored = {0};

    if (compute_is_mesh(surface->id)) {
        (void)snprintf(place.mesh, sizeof place.mesh, "%s", surface->id);
    } else if (process_read(store_surface_get_as(jobs_run_store(run), jobs_run_owner(run),
                                                 surface->id, false, &stored))) {
        struct surface_place kept = surface_record_place(&stored);

        (void)snprintf(place.mesh, sizeof place.mesh, "%s", kept.mesh);
        place = surface->scale > 0.0 ? place : kept;
    }
    if (surface->scale > 0.0) {
        memcpy(place.origin, surface->origin, sizeof place.origin);
        place.known = true;
    }
    store_surface_clear(&stored);
    return place;
}

bool process_mirrored(struct jobs_run *run, const char *id)
{
    struct store *store = jobs_run_store(run);
    const char *owner = jobs_run_owner(run);
    struct store_surface surface = {0};
    struct store_mesh mesh = {.name = NULL};
    bool mirrored = false;

    if (compute_is_mesh(id)) {
        mirrored = process_read(store_mesh_get_as(store, owner, id, &mesh)) && mesh_mirrored(&mesh);
    } else if (process_read(store_surface_get_as(store, owner, id, false, &surface))) {
        mirrored = surface_record_mirrored(&surface);
    }
    store_mesh_clear(&mesh);
    store_surface_clear(&surface);
    return mirrored;
}

bool process_reflected(struct jobs_run *run, const char *id, const struct surface_place *place)
{
    if (compute_is_mesh(id)) {
        return false;
    }
    return place->told ? place->reflected
                       : process_mirrored(run, id) !=
                             (place->mesh[0] && process_mirrored(run, place->mesh));
}

json_t *process_frame(struct jobs_run *run, const char *id, const struct surface_place *place,
                      json_t *frame)
{
    (void)json_object_set_new(frame, "reflected", json_boolean(process_reflected(run, id, place)));
    return frame;
}
