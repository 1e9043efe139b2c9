/*
 * group_inputs.c - a group of surfaces among the inputs of a process: named one by one, or by the
 * cohort that they make up.
 *
 * The canonical surfaces are the ids of the members in both cases. The canonical cohort has what it
 * says of them as well, as it is now: a cohort may be deleted, and its name given to another.
 */
#include "toolkit/group.h"

#include <stdio.h>
#include <string.h>

#include "api/cohorts.h"
#include "text.h"
#include "toolkit/routes.h"
#include "store/cohort.h"

#define MIB 1048576.0
#define MEMORY_WITHOUT_ENGINE (2048.0 * MIB) /* of a job that nothing would run */

/* ---- Reading --------------------------------------------------------------------------------- */

/* Checks one id; it goes into the canonical surfaces. */
static bool add_surface(struct process_inputs *inputs, const json_t *value, const char *pointer,
                        json_t *surfaces)
{
    long degree;
    const char *id = inputs_surface_at(inputs, value, pointer, &degree);

    if (!id) {
        return false;
    }
    (void)json_array_append_new(surfaces, json_string(id));
    return true;
}

/* The fewest surfaces of the input: lowest of its row, where that is set. */
static size_t least_of(const struct process_input *input)
{
    return input->lowest > 0.0 ? (size_t)input->lowest : PROCESS_GROUP_MIN;
}

/* The most of them: highest, where that is set. */
static size_t most_of(const struct process_input *input)
{
    return input->highest > 0.0 ? (size_t)input->highest : PROCESS_GROUP_MAX;
}

static bool check_count(struct process_inputs *inputs, const struct process_input *input,
                        const char *pointer, size_t count)
{
    if (count < least_of(input) || count > most_of(input)) {
        problem_add(inputs->list, pointer, "has %zu surface%s; it must have from %zu to %zu", count,
                    plural(count), least_of(input), most_of(input));
        return false;
    }
    return true;
}

static void read_list(struct process_inputs *inputs, const struct process_input *input,
                      const json_t *value, json_t *surfaces)
{
    char pointer[64];
    size_t count = json_array_size(value);

    if (!json_is_array(value)) {
        problem_add(inputs->list, "/inputs/surfaces", "must be an array of ids");
        return;
    }
    if (!check_count(inputs, input, "/inputs/surfaces", count)) {
        return;
    }
    for (size_t i = 0; i < count && !inputs->answered; i++) {
        (void)snprintf(pointer, sizeof pointer, "/inputs/surfaces/%zu", i);
        inputs->place = i + 1;
        (void)add_surface(inputs, json_array_get(value, i), pointer, surfaces);
    }
    inputs->place = 0;
}

bool group_find_cohort(struct process_inputs *inputs, const json_t *value,
                       struct store_cohort *cohort)
{
    const char *name = json_string_value(value);
    char owner[STORE_OWNER_MAX];
    int status;

    if (!cohort_name_valid(name)) {
        problem_add(inputs->list, "/inputs/cohort", "must be the name of a cohort");
        return false;
    }
    if (inputs->answered || inputs->shape_only) {
        return false;
    }
    if (!cohort_owner(inputs->call, name, true, owner)) {
        inputs->answered = true;
        return false;
    }
    status = store_cohort_get_as(inputs->call->api->config.store, owner, name, cohort);
    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-cohort", name);
        inputs->answered = true;
    }
    return status == 0;
}

static void read_cohort(struct process_inputs *inputs, const struct process_input *input,
                        const json_t *value, json_t *surfaces)
{
    struct store_cohort cohort = {.record = NULL};
    json_t *members = NULL, *labels = json_array(), *subjects = json_array();
    json_t *mirrored = json_array();
    bool good = group_find_cohort(inputs, value, &cohort) &&
                check_count(inputs, input, "/inputs/cohort", cohort.n_members);

    if (good) {
        members = cohort_members(&cohort);
    }
    for (size_t i = 0; good && i < json_array_size(members); i++) {
        const json_t *member = json_array_get(members, i);

        inputs->place = i + 1;
        good = add_surface(inputs, json_object_get(member, "id"), "/inputs/cohort", surfaces);
        (void)json_array_append(labels, json_object_get(member, "label"));
        (void)json_array_append(subjects, json_object_get(member, "subject"));
        (void)json_array_append(mirrored, json_object_get(member, "mirror"));
    }
    inputs->place = 0;
    (void)json_object_set_new(inputs->canonical, "cohort",
                              json_pack("{s:s, s:o, s:o, s:o}", "name", cohort.name, "labels",
                                        labels, "subjects", subjects, "mirrored", mirrored));
    json_decref(inputs->members);
    inputs->members = members;
    store_cohort_clear(&cohort);
}

static const json_t *given_cohort(const struct process_inputs *inputs)
{
    const json_t *cohort = json_object_get(inputs->given, "cohort");

    return json_is_null(cohort) ? NULL : cohort;
}

void group_read_surfaces(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *listed = json_object_get(inputs->given, "surfaces");
    json_t *surfaces;

    if ((listed != NULL) == (given_cohort(inputs) != NULL)) {
        problem_add(inputs->list, listed ? "/inputs/cohort" : "/inputs/surfaces",
                    "surfaces or a cohort must be given, and not both");
    } else if (listed) {
        surfaces = json_array();
        read_list(inputs, input, listed, surfaces);
        (void)inputs_routes(inputs, surfaces);
        (void)json_object_set_new(inputs->canonical, "cohort", json_null());
        (void)json_object_set_new(inputs->canonical, "surfaces", surfaces);
    }
}

static void group_read_cohort(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *cohort = given_cohort(inputs);
    json_t *surfaces;

    if (cohort && !json_object_get(inputs->given, "surfaces")) {
        surfaces = json_array();
        read_cohort(inputs, input, cohort, surfaces);
        (void)inputs_routes(inputs, surfaces);
        (void)json_object_set_new(inputs->canonical, "surfaces", surfaces);
    }
}

void group_read_members_apart(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *cohort = given_cohort(inputs);
    json_t *surfaces;

    if (!cohort) {
        problem_add(inputs->list, "/inputs/cohort", "is required: the name of a cohort");
        return;
    }
    surfaces = json_array();
    read_cohort(inputs, input, cohort, surfaces);
    (void)json_object_set_new(json_object_get(inputs->canonical, "cohort"), "surfaces", surfaces);
}

void group_read_members(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *cohort;

    group_read_members_apart(inputs, input);
    cohort = json_object_get(inputs->canonical, "cohort");
    if (cohort) {
        (void)inputs_routes(inputs, json_object_get(cohort, "surfaces"));
    }
}

json_t *group_stored_members(const struct process_inputs *inputs)
{
    return json_incref(inputs->members);
}

void group_member_text(struct process_inputs *inputs, const json_t *members, size_t i,
                       char text[GROUP_MEMBER_TEXT])
{
    const json_t *member = json_array_get(members, i);
    const char *id = json_string_value(json_object_get(member, "id"));
    const char *subject = json_string_value(json_object_get(member, "subject"));
    char name[64];

    inputs_name_of(inputs, id ? id : "?", sizeof name, name);
    (void)snprintf(text, GROUP_MEMBER_TEXT, "member %zu (%.40s%s%s%s%s%.60s%s)", i, id ? id : "?",
                   name[0] ? ", \"" : "", name, name[0] ? "\"" : "",
                   subject ? ", of subject \"" : "", subject ? subject : "", subject ? "\"" : "");
}

void inputs_check_memory(struct process_inputs *inputs, size_t n, long degree, size_t copies,
                         double more)
{
    const struct jobs *jobs = inputs->call->api->config.jobs;
    double limit = jobs ? (double)jobs_memory_limit(jobs) : MEMORY_WITHOUT_ENGINE;
    size_t rows = srnf_working_rows((size_t)degree);
    double bytes =
        (double)n * (double)copies * 3.0 * (double)rows * 2.0 * (double)rows * 8.0 + more;

    inputs->call->work.bytes = bytes;
    if (bytes > limit) {
        problem_add(inputs->list, "/inputs",
                    "%zu surfaces of degree %ld need about %.0f MiB; a job may have %.0f MiB: take "
                    "fewer of them or a lower degree, or let jobs have more (--job-memory)",
                    n, degree, bytes / MIB, limit / MIB);
    }
}

/* ---- Typed inputs ---------------------------------------------------------------------------- */

static const char **group_ids(const json_t *surfaces, size_t *n)
{
    const char **ids;

    *n = json_array_size(surfaces);
    ids = srnf_alloc(*n ? *n : 1, sizeof *ids);
    for (size_t i = 0; ids && i < *n; i++) {
        const char *id = json_string_value(json_array_get(surfaces, i));
        ids[i] = id ? id : "";
    }
    return ids;
}

static struct compute_mirrored group_mirrored(const json_t *cohort)
{
    const json_t *flags = json_object_get(cohort, "mirrored");
    struct compute_mirrored mirrored = {{false}};

    for (size_t i = 0; i < json_array_size(flags) && i < COMPUTE_GROUP_MAX; i++) {
        mirrored.member[i] = json_is_true(json_array_get(flags, i));
    }
    return mirrored;
}

/* Whose the members are, by the subjects of the cohort that was typed; without one, each is its
   own. */
static bool type_subjects(struct group_input *group)
{
    srnf_free(group->subjects);
    group->subjects = group_subject_numbers(json_object_get(group->cohort, "subjects"), group->n,
                                            &group->n_subjects, &group->largest);
    return group->subjects != NULL;
}

bool group_type_surfaces(const json_t *value, void *member)
{
    struct group_input *group = member;

    group->surfaces = json_is_array(value) ? json_deep_copy(value) : NULL;
    group->ids = group->surfaces ? group_ids(group->surfaces, &group->n) : NULL;
    return group->ids && group->n > 0 && group->n <= COMPUTE_GROUP_MAX && type_subjects(group);
}

bool group_type_cohort(const json_t *value, void *member)
{
    struct group_input *group = member;

    if (json_is_null(value)) {
        return true;
    }
    group->cohort = json_is_object(value) ? json_deep_copy(value) : NULL;
    group->mirrored = group_mirrored(group->cohort);
    return group->cohort && type_subjects(group);
}

bool group_type_members(const json_t *value, void *member)
{
    return group_type_cohort(value, member) &&
           group_type_surfaces(json_object_get(value, "surfaces"), member);
}

void group_input_clear(void *member)
{
    struct group_input *group = member;

    srnf_free(group->ids);
    srnf_free(group->subjects);
    json_decref(group->surfaces);
    json_decref(group->cohort);
    *group = (struct group_input){0};
}

const struct input_own group_surfaces =
    GROUP_SURFACES_OWN("\"array\"", PROCESS_GROUP_MIN, PROCESS_LARGE_GROUP_MAX);
const struct input_own group_cohort = {
    .schema =
        "\"type\":[\"string\",\"null\"],\"pattern\":\"" COHORT_NAME_PATTERN "\",\"default\":null",
    .refers = true,
    .read = group_read_cohort,
    .type = group_type_cohort,
    .clear = group_input_clear,
};
const struct input_own group_members = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members,
    .type = group_type_members,
    .clear = group_input_clear,
};
