/*
 * mesh_report.c - the pre-flight report of a mesh: how it is made of the mesh, as JSON, and how a
 * stored one is read.
 *
 * A mesh is analysable when the topology is that of a sphere and the faces agree about the outside.
 * The route is the one that encode takes by default, the same for every mesh. starShaped says how
 * far the mesh is from being star-shaped, which the route star needs.
 */
#include "api/meshes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/warnings.h"
#include "compute/compute.h"
#include "compute/prepared.h"
#include "store/mesh.h"

static void set_repair(json_t *repairs, const char *code, size_t count)
{
    json_t *entry;

    if (count == 0) {
        return;
    }
    entry = json_object();
    (void)json_object_set_new(entry, "code", json_string(code));
    (void)json_object_set_new(entry, "count", json_integer((json_int_t)count));
    (void)json_array_append_new(repairs, entry);
}

static json_t *repairs_json(const struct srnf_mesh_repairs *repairs,
                            const struct srnf_mesh_read_info *info)
{
    json_t *list = json_array();

    set_repair(list, "duplicate-vertices-merged", repairs->duplicate_vertices_merged);
    set_repair(list, "collapsed-faces-dropped", repairs->collapsed_faces_dropped);
    set_repair(list, "duplicate-faces-dropped", repairs->duplicate_faces_dropped);
    set_repair(list, "folded-faces-dropped", repairs->folded_faces_dropped);
    set_repair(list, "touching-vertices-kept-apart", repairs->touching_vertices_kept_apart);
    set_repair(list, "unreferenced-vertices-dropped", repairs->unreferenced_vertices_dropped);
    set_repair(list, "faces-flipped", repairs->faces_flipped);
    set_repair(list, "polygons-triangulated", info ? info->polygons_triangulated : 0);
    set_repair(list, "face-count-corrected", info ? info->face_count_error : 0);
    set_repair(list, "trailing-bytes-ignored", info ? info->trailing_bytes : 0);
    return list;
}

static json_t *problem_entry(const char *code, size_t count, int64_t first, const char *detail)
{
    json_t *entry = json_object();

    (void)json_object_set_new(entry, "code", json_string(code));
    (void)json_object_set_new(entry, "count", json_integer((json_int_t)count));
    (void)json_object_set_new(entry, "first", first < 0 ? json_null() : json_integer(first));
    (void)json_object_set_new(entry, "detail", json_string(detail));
    return entry;
}

static json_t *problems_json(const struct srnf_mesh_report *report)
{
    json_t *list = json_array();

    for (size_t i = 0; i < report->n_problems; i++) {
        const struct srnf_mesh_problem *problem = &report->problems[i];

        (void)json_array_append_new(list,
                                    problem_entry(compute_problem_code(problem->status),
                                                  problem->count, problem->first, problem->detail));
    }
    return list;
}

/* JSON has no infinities: a measure beyond the range of double precision is null. */
static json_t *real_json(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *star_json(const struct srnf_star *star)
{
    if (!star) {
        return json_null();
    }
    return json_pack("{s:b,s:[o,o,o],s:o,s:o}", "value", star->value, "center",
                     real_json(star->center[0]), real_json(star->center[1]),
                     real_json(star->center[2]), "margin", real_json(star->margin),
                     "violatingAreaFraction", real_json(star->violating_area_fraction));
}

/* The route that encode takes by default. */
static json_t *route_json(bool analysable)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();

    return analysable ? json_string(srnf_parameterization_name(srnf_encode_route(&options)))
                      : json_null();
}

/* star: NULL where it was not asked for because the topology already failed, or where the search
   for a centre broke down. */
static json_t *report_json(const struct srnf_mesh_report *report, const struct srnf_star *star,
                           const struct srnf_mesh_read_info *info)
{
    json_t *document = json_object();

    (void)json_object_set_new(document, "closed", json_boolean(report->closed));
    (void)json_object_set_new(document, "manifold",
                              json_boolean(report->edge_manifold && report->vertex_manifold));
    (void)json_object_set_new(document, "oriented", json_boolean(report->oriented));
    (void)json_object_set_new(document, "components", json_integer((json_int_t)report->components));
    (void)json_object_set_new(document, "eulerCharacteristic",
                              json_integer(report->euler_characteristic));
    (void)json_object_set_new(document, "genus",
                              report->genus < 0 ? json_null() : json_integer(report->genus));
    (void)json_object_set_new(document, "area", real_json(report->area));
    (void)json_object_set_new(document, "volume", real_json(report->volume));
    (void)json_object_set_new(document, "boundingBoxDiagonal",
                              real_json(report->bounding_box_diagonal));
    (void)json_object_set_new(document, "analysable", json_boolean(report->n_problems == 0));
    (void)json_object_set_new(document, "route", route_json(report->n_problems == 0));
    (void)json_object_set_new(document, "starShaped", star_json(star));
    (void)json_object_set_new(document, "repairs", repairs_json(&report->repairs, info));
    (void)json_object_set_new(document, "problems", problems_json(report));
    if (report->coarseness >= JOBS_COARSE) {
        warning_coarse(warnings_of(document), NULL, report->coarseness);
    }
    if (report->n_problems == 0 && warning_shape_of(report->area, report->volume) != SHAPE_SOUND) {
        warning_shape(warnings_of(document), NULL, 1, report->area, report->volume);
    }
    if (info && info->transform_ignored) {
        warning_untransformed(warnings_of(document), NULL, 1);
    }
    return document;
}

/* Where the search for a centre finds the mesh degenerate, it cannot be analysed either. */
static void add_degenerate(struct srnf_mesh_report *report)
{
    report->problems[0] =
        (struct srnf_mesh_problem){.status = SRNF_EDEGENERATE, .count = 1, .first = -1};
    (void)snprintf(report->problems[0].detail, sizeof report->problems[0].detail,
                   "the search for a centre that sees the whole surface failed: %s",
                   srnf_strerror(SRNF_EDEGENERATE));
    report->n_problems = 1;
}

int mesh_examine(struct compute_prepared *mesh, const struct srnf_mesh_read_info *info,
                 const struct srnf_context *context, char **text)
{
    struct srnf_mesh_report report;
    json_t *document;
    int kernel, status = compute_prepare(mesh, context, &kernel);

    *text = NULL;
    if (status < 0) {
        return status;
    }
    if (kernel == SRNF_ENOMEM || kernel == SRNF_ECANCELED) {
        return kernel;
    }
    report = mesh->report;
    mesh->untransformed = info && info->transform_ignored;
    if (kernel == SRNF_EDEGENERATE) {
        add_degenerate(&report);
    }
    document = report_json(&report, mesh->kernel_known ? &mesh->kernel : NULL, info);
    *text = json_memory_dumps(document, JSON_COMPACT);
    json_decref(document);
    return *text ? 0 : SRNF_ENOMEM;
}

/* Reports of a time when star was the only route say of other meshes that they cannot be analysed,
   and those of a time when the mesh decided name the route of then; neither is so any longer. */
static void renew(json_t *report)
{
    json_t *problems = json_object_get(report, "problems");
    const char *code = json_string_value(json_object_get(json_array_get(problems, 0), "code"));

    if (code && strcmp(code, "not-star-shaped") == 0) {
        (void)json_object_set_new(report, "analysable", json_true());
        (void)json_array_clear(problems);
    }
    if (json_is_object(report)) {
        (void)json_object_set_new(report, "route",
                                  route_json(json_is_true(json_object_get(report, "analysable"))));
    }
}

json_t *mesh_report_load(const struct store_mesh *mesh)
{
    json_t *report = mesh->report ? json_loads(mesh->report, 0, NULL) : NULL;

    renew(report);
    return report;
}

bool mesh_untransformed(const struct store_mesh *mesh)
{
    json_t *report = mesh_report_load(mesh), *entry;
    bool found = false;
    size_t i;

    json_array_foreach(json_object_get(report, "warnings"), i, entry)
    {
        const char *code = json_string_value(json_object_get(entry, "code"));

        found = found || (code && strcmp(code, "transform-not-applied") == 0);
    }
    json_decref(report);
    return found;
}

/* Whether a sentence of a problem says which face or vertex its first is. */
static bool names_first(const char *sentence, json_int_t first)
{
    static const char *const elements[] = {"face", "vertex"};

    for (size_t i = 0; i < sizeof elements / sizeof elements[0]; i++) {
        char words[32];
        const char *at = sentence;
        size_t length;

        (void)snprintf(words, sizeof words, "%s %lld", elements[i], (long long)first);
        length = strlen(words);
        while ((at = strstr(at, words)) != NULL) {
            at += length;
            if (*at < '0' || *at > '9') {
                return true;
            }
        }
    }
    return false;
}

bool mesh_first_problem(const struct store_mesh *mesh, char code[48], char detail[320])
{
    json_t *report = mesh_report_load(mesh);
    const json_t *problem = json_array_get(json_object_get(report, "problems"), 0);
    const char *text = json_string_value(json_object_get(problem, "code"));
    const char *sentence = json_string_value(json_object_get(problem, "detail"));
    const json_t *first = json_object_get(problem, "first");
    bool found = problem || !json_is_true(json_object_get(report, "analysable"));

    if (found) {
        (void)snprintf(code, 48, "%s", text ? text : "mesh-degenerate");
        if (json_is_integer(first) &&
            !(sentence && names_first(sentence, json_integer_value(first)))) {
            (void)snprintf(detail, 320, "%s (the first at %lld)", sentence ? sentence : code,
                           (long long)json_integer_value(first));
        } else {
            (void)snprintf(detail, 320, "%s", sentence ? sentence : "its report gives no reason");
        }
    }
    json_decref(report);
    return found;
}
