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
    status = compute_group_load(run, members->n, members->ids, &members->mirrored, origins,
                                members->mesh_degree, degree,
                                registered ? SHARE_REGISTERED : SHARE_PLAIN, group, result);
    srnf_free(origins);
    return status;
}

/* How often each of the names is there (new reference). */
static json_t *count_names(const json_t *names)
{
    json_t *counts = json_object();

    for (size_t i = 0; i < json_array_size(names); i++) {
        const char *name = json_string_value(json_array_get(names, i));
        json_int_t count = json_integer_value(json_object_get(counts, name));

        (void)json_object_set_new(counts, name, json_integer(count + 1));
    }
    return counts;
}

static bool is_shared(const json_t *counts, const json_t *name)
{
    return json_integer_value(json_object_get(counts, json_string_value(name))) > 1;
}

/* Names that several members have, each with what follows it in brackets, and that which is still
   the same with the number of the member. */
static json_t *part_names(struct jobs_run *run, const json_t *surfaces, const json_t *names)
{
    json_t *parted = json_array(), *distinct = json_array(), *counts = count_names(names);

    for (size_t i = 0; i < json_array_size(names); i++) {
        json_t *name = json_array_get(names, i);
        const char *id = json_string_value(json_array_get(surfaces, i));

        if (is_shared(counts, name)) {
            json_t *own = group_name_of(run, id);

            (void)json_array_append_new(
                parted, json_sprintf("%s (%s)", json_string_value(name),
                                     json_equal(own, name) ? id : json_string_value(own)));
            json_decref(own);
        } else {
            (void)json_array_append(parted, name);
        }
    }
    json_decref(counts);
    counts = count_names(parted);
    for (size_t i = 0; i < json_array_size(parted); i++) {
        json_t *name = json_array_get(parted, i);

        if (is_shared(counts, name)) {
            name = json_sprintf("%s #%zu", json_string_value(name), i);
            (void)json_array_append_new(distinct, name);
        } else {
            (void)json_array_append(distinct, name);
        }
    }
    json_decref(counts);
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
                names, group_name_of(run, json_string_value(json_array_get(surfaces, i))));
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

/* The member that a name came with first: i, where it is new or NULL. good: false without
   memory. */
static size_t first_of(json_t *firsts, const char *name, size_t i, bool *good)
{
    const json_t *known = name ? json_object_get(firsts, name) : NULL;

    if (known) {
        return (size_t)json_integer_value(known);
    }
    if (name && json_object_set_new(firsts, name, json_integer((json_int_t)i))) {
        *good = false;
    }
    return i;
}

size_t *group_subject_numbers(const json_t *subjects, size_t n, size_t *count, size_t *largest)
{
    size_t *numbers = srnf_alloc(n ? n : 1, 2 * sizeof *numbers);
    size_t *sizes = numbers ? numbers + n : NULL;
    json_t *firsts = json_object(); /* member that a subject came with first */
    bool good = numbers && firsts;

    *count = *largest = 0;
    for (size_t i = 0; good && i < n; i++) {
        const char *own = json_string_value(json_array_get(subjects, i));
        size_t first = first_of(firsts, own, i, &good);

        numbers[i] = first;
        *count += first == i;
        sizes[first]++;
        *largest = sizes[first] > *largest ? sizes[first] : *largest;
    }
    json_decref(firsts);
    if (!good) {
        srnf_free(numbers);
        return NULL;
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

static void warn_duplicate(struct jobs_run *run, const json_t *surfaces, const json_t *subjects,
                           size_t first, size_t i, const char *content, json_t *warnings)
{
    const char *a = json_string_value(json_array_get(subjects, first));
    const char *b = json_string_value(json_array_get(subjects, i));
    json_t *figures = json_pack("{s:[I, I], s:s}", "members", (json_int_t)first, (json_int_t)i,
                                "content", content);
    char one[GROUP_WHO], other[GROUP_WHO];

    group_who(run, surfaces, subjects, first, one);
    group_who(run, surfaces, subjects, i, other);
    other[0] = 'm';
    if (a && b && strcmp(a, b) == 0) {
        warning_add(warnings, "duplicate-content", figures,
                    "%s and %s, both of subject %.60s, have the same content, %s: it "
                    "counts twice. Take one of them out, unless that is meant.",
                    one, other, a, content);
    } else if (a && b) {
        warning_add(warnings, "duplicate-content", figures,
                    "%s and %s have the same content, %s, under two subjects, %.60s and "
                    "%.60s: one of them is likely mistaken, and what is left out under one name "
                    "stays in under the other.",
                    one, other, content, a, b);
    } else {
        warning_add(warnings, "duplicate-content", figures,
                    "%s and %s have the same content, %s, and count as two subjects. "
                    "Take one of them out, or give both the same subject in a cohort.",
                    one, other, content);
    }
}

void group_warn_duplicates(struct jobs_run *run, json_t *document, const json_t *surfaces,
                           const json_t *cohort, const char (*contents)[STORE_ID_MAX])
{
    const json_t *mirrored = json_object_get(cohort, "mirrored");
    size_t n = json_array_size(surfaces);
    json_t *of_surface = json_object(), *of_mesh = json_object();
    bool good = of_surface && of_mesh;

    for (size_t i = 0; good && i < n; i++) {
        const char *id = json_string_value(json_array_get(surfaces, i));
        struct content content = {.surface = ""};
        size_t surface, mesh, first;

        find_content(run, id ? id : "", json_is_true(json_array_get(mirrored, i)),
                     contents ? contents[i] : NULL, &content);
        surface = first_of(of_surface, content.surface[0] ? content.surface : NULL, i, &good);
        mesh = first_of(of_mesh, content.mesh[0] ? content.mesh : NULL, i, &good);
        first = surface < mesh ? surface : mesh;
        if (good && first < i) {
            warn_duplicate(run, surfaces, json_object_get(cohort, "subjects"), first, i,
                           surface == first ? json_string_value(json_array_get(surfaces, first))
                                            : content.mesh + 1,
                           warnings_of(document));
        }
    }
    if (!good) {
        json_memory_fail(); /* a warning may be missing */
    }
    json_decref(of_surface);
    json_decref(of_mesh);
}
