/*
 * group.c - the members of a group: loaded, and in results: what they are called, whose they are,
 * and which of them have the same content.
 */
#include "toolkit/group.h"

#include <stdio.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/warnings.h"
#include "toolkit/routes.h"
#include "store/mesh.h"
#include "store/surface.h"

/* Percent of a job that encoding its meshes takes, before registration or without it: half a
   second each at degree 31, where a registration takes two and more. */
#define SHARE_REGISTERED 20.0
#define SHARE_PLAIN 80.0

int group_load(struct jobs_run *run, const struct group_input *members, bool registered,
               size_t degree, struct compute_group *group, struct jobs_result *result)
{
    struct compute_origin *origins =
        routes_bridges(run, members->mixed_routes && registered, members->n, members->ids);
    int status;

    if (!origins) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    }
    status = compute_group_load(run, members->n, members->ids, &members->mirrored, origins, degree,
                                registered ? SHARE_REGISTERED : SHARE_PLAIN, group, result);
    srnf_free(origins);
    return status;
}

/* The name that a mesh or surface has, or its id. */
static json_t *name_of(struct jobs_run *run, const char *id)
{
    struct store *store = jobs_run_store(run);
    const char *owner = jobs_run_owner(run);
    struct store_surface surface = {0};
    struct store_mesh mesh = {0};
    json_t *name = NULL;

    if (strncmp(id, "mesh-", 5) == 0) {
        if (store_mesh_get_as(store, owner, id, &mesh) == 0 && mesh.name && mesh.name[0]) {
            name = json_string(mesh.name);
        }
        store_mesh_clear(&mesh);
    } else {
        if (store_surface_get_as(store, owner, id, false, &surface) == 0 && surface.name &&
            surface.name[0]) {
            name = json_string(surface.name);
        }
        store_surface_clear(&surface);
    }
    return name ? name : json_string(id);
}

/* Whether another name is the same as the i-th. */
static bool is_taken(const json_t *names, size_t i)
{
    for (size_t k = 0; k < json_array_size(names); k++) {
        if (k != i && json_equal(json_array_get(names, k), json_array_get(names, i))) {
            return true;
        }
    }
    return false;
}

/* Names that several members have, each with what follows it in brackets, and that which is still
   the same with the number of the member. */
static json_t *part_names(struct jobs_run *run, const json_t *surfaces, const json_t *names)
{
    json_t *parted = json_array(), *distinct = json_array();

    for (size_t i = 0; i < json_array_size(names); i++) {
        json_t *name = json_array_get(names, i);
        const char *id = json_string_value(json_array_get(surfaces, i));

        if (is_taken(names, i)) {
            json_t *own = name_of(run, id);

            (void)json_array_append_new(
                parted, json_sprintf("%s (%s)", json_string_value(name),
                                     json_equal(own, name) ? id : json_string_value(own)));
            json_decref(own);
        } else {
            (void)json_array_append(parted, name);
        }
    }
    for (size_t i = 0; i < json_array_size(parted); i++) {
        json_t *name = json_array_get(parted, i);

        if (is_taken(parted, i)) {
            name = json_sprintf("%s #%zu", json_string_value(name), i);
            (void)json_array_append_new(distinct, name);
        } else {
            (void)json_array_append(distinct, name);
        }
    }
    json_decref(parted);
    return distinct;
}

json_t *group_subjects(struct jobs_run *run, const json_t *surfaces, const json_t *subjects)
{
    json_t *names = json_array();

    for (size_t i = 0; i < json_array_size(surfaces); i++) {
        json_t *subject = json_array_get(subjects, i);

        if (json_is_string(subject)) {
            (void)json_array_append(names, subject);
        } else {
            (void)json_array_append_new(
                names, name_of(run, json_string_value(json_array_get(surfaces, i))));
        }
    }
    return names;
}

json_t *group_labels(struct jobs_run *run, const json_t *surfaces, const json_t *subjects)
{
    json_t *names = group_subjects(run, surfaces, subjects);
    json_t *labels = part_names(run, surfaces, names);

    json_decref(names);
    return labels;
}

json_t *group_groups(const json_t *cohort)
{
    json_t *labels = json_object_get(cohort, "labels");

    return json_is_array(labels) ? json_incref(labels) : json_null();
}

/* ---- Subjects -------------------------------------------------------------------------------- */

size_t *group_subject_numbers(const json_t *subjects, size_t n, size_t *count, size_t *largest)
{
    size_t *numbers = srnf_alloc(n ? n : 1, 2 * sizeof *numbers);
    size_t *sizes = numbers ? numbers + n : NULL;

    *count = *largest = 0;
    for (size_t i = 0; numbers && i < n; i++) {
        const char *own = json_string_value(json_array_get(subjects, i));
        size_t first = own ? 0 : i;

        while (first < i) {
            const char *other = json_string_value(json_array_get(subjects, first));

            if (other && strcmp(own, other) == 0) {
                break;
            }
            first++;
        }
        numbers[i] = first;
        *count += first == i;
        sizes[first]++;
        *largest = sizes[first] > *largest ? sizes[first] : *largest;
    }
    return numbers;
}

bool group_check_labels(struct process_inputs *inputs, const json_t *subjects, const json_t *labels,
                        const char *advice)
{
    size_t n = json_array_size(labels), count, largest;
    size_t *numbers = group_subject_numbers(subjects, n, &count, &largest);
    bool good = numbers != NULL;

    for (size_t i = 0; good && i < n; i++) {
        const char *own = json_string_value(json_array_get(labels, i));
        const char *first = json_string_value(json_array_get(labels, numbers[i]));

        if (own && first && strcmp(own, first) != 0) {
            (void)problem_respond(
                inputs->call, "labels-within-subject",
                "Members %zu and %zu are the same subject, \"%.60s\", with the labels "
                "\"%.60s\" and \"%.60s\". %s",
                numbers[i], i, json_string_value(json_array_get(subjects, i)), first, own, advice);
            inputs->answered = true;
            good = false;
        }
    }
    if (!numbers) {
        problem_add(inputs->list, "/inputs/cohort", "is too large for the memory there is");
    }
    srnf_free(numbers);
    return good;
}

/* What two members are compared by: a sign, - for a mirror image, and an id or a hash; or empty. */
struct content {
    char surface[STORE_ID_MAX + 1]; /* of the coefficients: copies in several places are the same */
    char mesh[STORE_ID_MAX + 1];    /* that it is, or comes from */
};

static void set_content(char out[STORE_ID_MAX + 1], bool mirrored, const char *id)
{
    if (id) {
        (void)snprintf(out, STORE_ID_MAX + 1, "%c%.*s", mirrored ? '-' : '+', STORE_ID_MAX - 1, id);
    }
}

/* known: content of compute_surface, mirrored as it is computed with; or NULL. */
static void find_content(struct jobs_run *run, const char *id, bool mirrored, const char *known,
                         struct content *content)
{
    struct store_surface surface = {0};
    json_t *record = NULL;
    const char *mesh;

    set_content(content->surface, false, known);
    if (strncmp(id, "mesh-", 5) == 0) {
        set_content(content->mesh, mirrored, id);
        return;
    }
    if (process_read(
            store_surface_get_as(jobs_run_store(run), jobs_run_owner(run), id, false, &surface))) {
        if (!known) {
            set_content(content->surface, mirrored, surface.hash);
        }
        record = json_loads(surface.record ? surface.record : "{}", 0, NULL);
        mesh = json_string_value(json_object_get(json_object_get(record, "source"), "mesh"));
        /* Of the mesh, which may be a mirror image itself. */
        mirrored = mirrored != json_is_true(json_object_get(record, "mirrored"));
        set_content(content->mesh, mirrored != (mesh && process_mirrored(run, mesh)), mesh);
    }
    json_decref(record);
    store_surface_clear(&surface);
}

static bool is_same(const char *a, const char *b)
{
    return a[0] && strcmp(a, b) == 0;
}

static void warn_duplicate(json_t *warnings, const json_t *subjects, size_t first, size_t i,
                           const char *content)
{
    const char *a = json_string_value(json_array_get(subjects, first));
    const char *b = json_string_value(json_array_get(subjects, i));
    json_t *figures = json_pack("{s:[I, I], s:s}", "members", (json_int_t)first, (json_int_t)i,
                                "content", content);

    if (a && b && strcmp(a, b) == 0) {
        warning_add(warnings, "duplicate-content", figures,
                    "Members %zu and %zu, both of subject %.60s, have the same content, %s: it "
                    "counts twice. Take one of them out, unless that is meant.",
                    first, i, a, content);
    } else if (a && b) {
        warning_add(warnings, "duplicate-content", figures,
                    "Members %zu and %zu have the same content, %s, under two subjects, %.60s and "
                    "%.60s: one of them is likely mistaken, and what is left out under one name "
                    "stays in under the other.",
                    first, i, content, a, b);
    } else {
        warning_add(warnings, "duplicate-content", figures,
                    "Members %zu and %zu have the same content, %s, and count as two subjects. "
                    "Take one of them out, or give both the same subject in a cohort.",
                    first, i, content);
    }
}

void group_warn_duplicates(struct jobs_run *run, json_t *document, const json_t *surfaces,
                           const json_t *cohort, const char (*contents)[STORE_ID_MAX])
{
    const json_t *mirrored = json_object_get(cohort, "mirrored");
    size_t n = json_array_size(surfaces);
    struct content *all = srnf_alloc(n ? n : 1, sizeof *all);

    if (!all) {
        json_memory_fail(); /* a warning may be missing */
    }
    for (size_t i = 0; all && i < n; i++) {
        const char *id = json_string_value(json_array_get(surfaces, i));
        size_t first = 0;

        find_content(run, id ? id : "", json_is_true(json_array_get(mirrored, i)),
                     contents ? contents[i] : NULL, &all[i]);
        while (first < i && !is_same(all[first].surface, all[i].surface) &&
               !is_same(all[first].mesh, all[i].mesh)) {
            first++;
        }
        if (first < i) {
            bool surface = is_same(all[first].surface, all[i].surface);

            warn_duplicate(warnings_of(document), json_object_get(cohort, "subjects"), first, i,
                           surface ? json_string_value(json_array_get(surfaces, first))
                                   : all[i].mesh + 1);
        }
    }
    srnf_free(all);
}
