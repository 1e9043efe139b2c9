/*
 * paired_cohort.c - cohorts with two surfaces of each subject: which two they are, by the times or
 * the sides of the members.
 *
 * The canonical cohort is cut to the members that are compared, with first and second, the places
 * of each subject's two. Of sides, all members are taken as being of one hand.
 */
#include "processes/paired.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "store/mesh.h"
#include "store/surface.h"

#define POINTER "/inputs/cohort"
#define NONE SIZE_MAX

const char *const paired_scales[] = {"shape-and-size", "shape", NULL};

/* ---- Typed ----------------------------------------------------------------------------------- */

static size_t *type_places(const json_t *places, size_t n)
{
    size_t *typed = srnf_alloc(n ? n : 1, sizeof *typed);

    for (size_t i = 0; typed && i < n; i++) {
        typed[i] = (size_t)json_integer_value(json_array_get(places, i));
    }
    return typed;
}

static bool type_cohort(const json_t *value, void *member)
{
    struct paired *asked = (void *)((char *)member - offsetof(struct paired, group));

    asked->n = json_array_size(json_object_get(value, "first"));
    asked->first = type_places(json_object_get(value, "first"), asked->n);
    asked->second = type_places(json_object_get(value, "second"), asked->n);
    return asked->first && asked->second && group_type_members(value, &asked->group);
}

static void clear_cohort(void *member)
{
    struct paired *asked = (void *)((char *)member - offsetof(struct paired, group));

    group_input_clear(&asked->group);
    srnf_free(asked->first);
    srnf_free(asked->second);
}

const struct input_own paired_cohort = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members,
    .type = type_cohort,
    .clear = clear_cohort,
};

static void read_time(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    char pointer[64];

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
    } else if (json_is_number(value) && isfinite(json_number_value(value))) {
        (void)json_object_set_new(inputs->canonical, input->name,
                                  json_real(json_number_value(value) + 0.0));
    } else {
        (void)snprintf(pointer, sizeof pointer, "/inputs/%s", input->name);
        problem_add(inputs->list, pointer, "must be a number, a time of members, or null");
    }
}

/* The computation has the places of the members. */
static bool type_time(const json_t *value, void *member)
{
    (void)member;
    return json_is_number(value) || json_is_null(value);
}

const struct input_own paired_time = {
    .schema = "\"type\":[\"number\",\"null\"],\"default\":null",
    .read = read_time,
    .type = type_time,
};

/* ---- Pairs ----------------------------------------------------------------------------------- */

struct pairing {
    struct process_inputs *given;
    const json_t *members;
    size_t n, count;  /* members; subjects */
    size_t *of;       /* [n] number of its subject: the first member of the same */
    int *which;       /* [n] 0: first, 1: second, -1: neither */
    size_t *place[2]; /* [n] by subject number: the member, or NONE */
};

static bool open_pairing(struct pairing *p, struct process_inputs *given, const json_t *members)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    size_t largest;

    *p = (struct pairing){.given = given, .members = members, .n = json_array_size(members)};
    p->of = group_subject_numbers(json_object_get(cohort, "subjects"), p->n, &p->count, &largest);
    p->which = srnf_alloc(p->n + 1, sizeof *p->which);
    p->place[0] = srnf_alloc(2 * p->n + 1, sizeof(size_t));
    if (!p->of || !p->which || !p->place[0]) {
        json_memory_fail();
        return false;
    }
    p->place[1] = p->place[0] + p->n;
    for (size_t i = 0; i < 2 * p->n; i++) {
        p->place[0][i] = NONE;
    }
    return true;
}

static void close_pairing(struct pairing *p)
{
    srnf_free(p->of);
    srnf_free(p->which);
    srnf_free(p->place[0]);
}

static const char *text_of(const struct pairing *p, size_t i, const char *name)
{
    const char *text = json_string_value(json_object_get(json_array_get(p->members, i), name));

    return text ? text : "?";
}

/* Every member needs a subject. */
static bool check_subjects(const struct pairing *p)
{
    for (size_t i = 0; i < p->n; i++) {
        if (p->which[i] >= 0 &&
            !json_is_string(json_object_get(json_array_get(p->members, i), "subject"))) {
            problem_add(p->given->list, POINTER,
                        "member %zu (%.40s) has no subject: surfaces are compared within subjects",
                        i, text_of(p, i, "id"));
            return false;
        }
    }
    return true;
}

/* The places of each subject; false with a problem that names who lacks one or has two. */
static bool find_places(struct pairing *p, const char *const names[2])
{
    size_t lacking = 0, first = NONE, missing = 0, whole = 0;

    for (size_t i = 0; i < p->n; i++) {
        size_t *place = p->which[i] >= 0 ? &p->place[p->which[i]][p->of[i]] : NULL;

        if (place && *place != NONE) {
            problem_add(p->given->list, POINTER,
                        "subject \"%.60s\" has two members of %s, %zu and %zu: take one of them",
                        text_of(p, i, "subject"), names[p->which[i]], *place, i);
            return false;
        }
        if (place) {
            *place = i;
        }
    }
    for (size_t i = 0; i < p->n; i++) {
        bool has[2] = {p->place[0][p->of[i]] != NONE, p->place[1][p->of[i]] != NONE};

        if (p->of[i] == i && has[0] != has[1]) {
            lacking++;
            missing = first == NONE ? has[0] : missing;
            first = first == NONE ? i : first;
        }
        whole += p->of[i] == i && has[0] && has[1];
    }
    if (lacking) {
        problem_add(p->given->list, POINTER,
                    "%zu subject%s no pair, \"%.60s\" first, which has no member of %s: complete "
                    "them, or take a cohort without them",
                    lacking, lacking == 1 ? " has" : "s have", text_of(p, first, "subject"),
                    names[missing]);
        return false;
    }
    if (whole < SRNF_PAIRS_MIN) {
        problem_add(p->given->list, POINTER, "has %zu pairs of %s and %s; %zu are needed", whole,
                    names[0], names[1], SRNF_PAIRS_MIN);
    }
    return whole >= SRNF_PAIRS_MIN;
}

/* Cuts the canonical cohort to the pairs: subject after subject, the first before the second. */
static void set_pairs(struct pairing *p, const bool *mirrored)
{
    json_t *cohort = json_object_get(p->given->canonical, "cohort");
    static const char *const arrays[] = {"surfaces", "labels", "subjects"};
    json_t *first = json_array(), *second = json_array(), *mirror = json_array();
    size_t at = 0;

    for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) {
        const json_t *all = json_object_get(cohort, arrays[k]);
        json_t *kept = json_array();

        for (size_t i = 0; i < p->n; i++) {
            for (size_t side = 0; side < 2 && p->of[i] == i; side++) {
                if (p->place[side][i] != NONE) {
                    (void)json_array_append(kept, json_array_get(all, p->place[side][i]));
                }
            }
        }
        (void)json_object_set_new(cohort, arrays[k], kept);
    }
    for (size_t i = 0; i < p->n; i++) {
        for (size_t side = 0; side < 2 && p->of[i] == i; side++) {
            if (p->place[side][i] != NONE) {
                (void)json_array_append_new(mirror, json_boolean(mirrored[p->place[side][i]]));
                (void)json_array_append_new(side ? second : first, json_integer((json_int_t)at++));
            }
        }
    }
    (void)json_object_set_new(cohort, "mirrored", mirror);
    (void)json_object_set_new(cohort, "first", first);
    (void)json_object_set_new(cohort, "second", second);
}

/* The members as they are stored, with a pairing open; false with the problem noted. */
static bool begin(struct process_inputs *given, struct pairing *p, json_t **members)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");

    *p = (struct pairing){.given = given};
    *members = group_stored_members(given);
    if (given->answered) {
        return false;
    }
    if (json_array_size(*members) != json_array_size(json_object_get(cohort, "surfaces"))) {
        problem_add(given->list, POINTER, "has changed while it was read: send it again");
        return false;
    }
    return open_pairing(p, given, *members);
}

/* ---- Visits ---------------------------------------------------------------------------------- */

/* The two times that are compared; false with a problem noted. */
static bool find_times(const struct pairing *p, double times[2])
{
    static const char *const names[2] = {"from", "to"};
    double lowest = INFINITY, highest = -INFINITY;
    size_t others = 0;

    for (size_t i = 0; i < p->n; i++) {
        const json_t *time = json_object_get(json_array_get(p->members, i), "time");

        if (!json_is_number(time)) {
            problem_add(p->given->list, POINTER, "member %zu (%.40s) has no time", i,
                        text_of(p, i, "id"));
            return false;
        }
        lowest = fmin(lowest, json_number_value(time));
        highest = fmax(highest, json_number_value(time));
    }
    for (size_t i = 0; i < p->n; i++) {
        double time = json_number_value(json_object_get(json_array_get(p->members, i), "time"));

        others += time != lowest && time != highest;
    }
    times[0] = lowest;
    times[1] = highest;
    for (size_t k = 0; k < 2; k++) {
        const json_t *asked = json_object_get(p->given->canonical, names[k]);

        times[k] = json_is_number(asked) ? json_number_value(asked) : times[k];
        if (others && !json_is_number(asked)) {
            problem_add(p->given->list, POINTER,
                        "has more than two times, from %g to %g: say by from and to which two are "
                        "compared",
                        lowest, highest);
            return false;
        }
    }
    if (!(times[0] != times[1])) {
        problem_add(p->given->list, POINTER, "has one time only, %g; two are compared", times[0]);
    }
    return times[0] != times[1];
}

void paired_describe_visits(struct process_inputs *given)
{
    json_t *members, *cohort = json_object_get(given->canonical, "cohort");
    const json_t *flags = json_object_get(cohort, "mirrored");
    struct pairing p;
    double times[2];
    char texts[2][48];
    const char *const names[2] = {texts[0], texts[1]};
    bool mirrored[PROCESS_GROUP_MAX] = {false};

    if (begin(given, &p, &members) && find_times(&p, times)) {
        for (size_t i = 0; i < p.n; i++) {
            double time = json_number_value(json_object_get(json_array_get(members, i), "time"));

            p.which[i] = time == times[0] ? 0 : time == times[1] ? 1 : -1;
            mirrored[i] = json_is_true(json_array_get(flags, i));
        }
        for (size_t k = 0; k < 2; k++) {
            (void)snprintf(texts[k], sizeof texts[k], "time %.10g", times[k]);
        }
        if (check_subjects(&p) && find_places(&p, names)) {
            set_pairs(&p, mirrored);
            (void)json_object_set_new(cohort, "times", json_pack("[f, f]", times[0], times[1]));
        }
    }
    close_pairing(&p);
    json_decref(members);
}

/* ---- Sides ----------------------------------------------------------------------------------- */

/* Whether the surface or mesh is a mirror image already. */
static bool is_mirrored(struct process_inputs *given, const char *id)
{
    struct store *store = given->call->api->config.store;
    const char *owner = given->call->request->caller.name;
    struct store_surface surface = {0};
    struct store_mesh mesh = {0};
    bool mirrored = false;

    if (compute_is_mesh(id)) {
        mirrored = store_mesh_get_as(store, owner, id, &mesh) == STORE_OK && mesh_mirrored(&mesh);
        store_mesh_clear(&mesh);
    } else {
        mirrored = store_surface_get_as(store, owner, id, false, &surface) == STORE_OK &&
                   surface_record_mirrored(&surface);
        store_surface_clear(&surface);
    }
    return mirrored;
}

/* Which members are taken mirrored, so that all are of one hand: as the cohort says, if they are so
   then, or else the right ones. */
static void set_hands(const struct pairing *p, bool *mirrored)
{
    const json_t *cohort = json_object_get(p->given->canonical, "cohort");
    const json_t *flags = json_object_get(cohort, "mirrored");
    bool as_right[PROCESS_GROUP_MAX], one_hand = true;

    for (size_t i = 0; i < p->n; i++) {
        as_right[i] = (p->which[i] == 1) != is_mirrored(p->given, text_of(p, i, "id"));
        mirrored[i] = json_is_true(json_array_get(flags, i));
        one_hand = one_hand && (as_right[i] != mirrored[i]) == (as_right[0] != mirrored[0]);
    }
    for (size_t i = 0; i < p->n && !one_hand; i++) {
        mirrored[i] = as_right[i];
    }
}

void paired_describe_sides(struct process_inputs *given)
{
    static const char *const names[2] = {"the left side", "the right side"};
    json_t *members;
    struct pairing p;
    bool mirrored[PROCESS_GROUP_MAX] = {false}, good = begin(given, &p, &members);

    for (size_t i = 0; good && i < p.n; i++) {
        const json_t *side = json_object_get(json_array_get(members, i), "side");

        good = json_is_string(side);
        p.which[i] = good && strcmp(json_string_value(side), "right") == 0;
        if (!good) {
            problem_add(given->list, POINTER, "member %zu (%.40s) has no side: left or right", i,
                        text_of(&p, i, "id"));
        }
    }
    if (good && check_subjects(&p) && find_places(&p, names)) {
        set_hands(&p, mirrored);
        set_pairs(&p, mirrored);
    }
    close_pairing(&p);
    json_decref(members);
}
