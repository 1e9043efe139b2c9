/*
 * paired_cohort.c - cohorts with two surfaces of each subject: which two they are, by the times or
 * the sides of the members.
 *
 * The canonical cohort is cut to the members that are compared, with first and second, the places
 * of each subject's two. Of sides, all members are taken as being of one hand.
 *
 * Registrations and inversions end near a minimum, not in it, and where depends on how sums are
 * rounded, and on the hand that shapes are seen in. So the members are computed with in an order
 * and a hand that are theirs alone: subjects by name; of each the earlier visit first, or the side
 * of which the first subject has the lesser id, which is a digest of its content; and that member
 * is never mirrored. What is called left or comes first in the cohort then changes the sign of the
 * differences, and not a bit of anything else.
 */
#include "processes/paired.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "store/mesh.h"
#include "store/surface.h"
#include "text.h"

#define POINTER "/inputs/cohort"
#define NONE SIZE_MAX

/* ---- Pairs ----------------------------------------------------------------------------------- */

struct pairing {
    struct process_inputs *given;
    const json_t *members;
    size_t n, count; /* members; subjects */
    size_t *of;      /* [n] number of its subject: the first member of the same */
    int *which;      /* [n] 0: first, 1: second, -1: neither */
    size_t
        *place[2]; /* [n] by subject number: the member, or NONE; of several the one of least id */
    size_t *next;  /* [n] the next measurement of the same side, by id, or NONE */
    bool measured; /* sides may be measured repeatedly */
    size_t *order; /* [pairs] numbers of the subjects that have both, by name */
    size_t pairs;
};

static bool open_pairing(struct pairing *p, struct process_inputs *given, const json_t *members)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    size_t largest;

    *p = (struct pairing){.given = given, .members = members, .n = json_array_size(members)};
    p->of = group_subject_numbers(json_object_get(cohort, "subjects"), p->n, &p->count, &largest);
    p->which = srnf_alloc(p->n + 1, sizeof *p->which);
    p->place[0] = srnf_alloc(4 * p->n + 1, sizeof(size_t));
    if (!p->of || !p->which || !p->place[0]) {
        json_memory_fail();
        return false;
    }
    p->place[1] = p->place[0] + p->n;
    p->next = p->place[1] + p->n;
    p->order = p->next + p->n;
    for (size_t i = 0; i < 3 * p->n; i++) {
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
    char who[GROUP_MEMBER_TEXT];

    for (size_t i = 0; i < p->n; i++) {
        if (p->which[i] >= 0 &&
            !json_is_string(json_object_get(json_array_get(p->members, i), "subject"))) {
            group_member_text(p->given, p->members, i, who);
            problem_add(p->given->list, POINTER,
                        "%s has no subject: surfaces are compared within subjects", who);
            return false;
        }
    }
    return true;
}

static const json_t *replicate_of(const struct pairing *p, size_t i)
{
    const json_t *all = json_object_get(json_array_get(p->members, i), "covariates");

    return json_object_get(all, "replicate");
}

/* 1 and 1.0 are the same, though not the same JSON. */
static bool same_replicate(const json_t *a, const json_t *b)
{
    return json_is_number(a) && json_is_number(b) ? json_number_value(a) == json_number_value(b)
                                                  : json_equal(a, b);
}

/* Member i beside the measurements of its side so far, by id; false with the problem noted. */
static bool add_measurement(struct pairing *p, size_t *place, size_t i, const char *name)
{
    const json_t *own = replicate_of(p, i);

    for (size_t m = *place; m != NONE; m = p->next[m]) {
        const json_t *other = replicate_of(p, m);

        if (!p->measured || !own || json_is_null(own) || !other || json_is_null(other)) {
            problem_add(p->given->list, POINTER,
                        "subject \"%.60s\" has two members of %s, %zu and %zu: take one of them%s",
                        text_of(p, i, "subject"), name, m, i,
                        p->measured ? ", or number all measurements of a side by the covariate "
                                      "replicate"
                                    : "");
            return false;
        }
        if (same_replicate(own, other)) {
            problem_add(p->given->list, POINTER,
                        "members %zu and %zu are the same replicate of %s of subject \"%.60s\"", m,
                        i, name, text_of(p, i, "subject"));
            return false;
        }
    }
    while (*place != NONE && strcmp(text_of(p, *place, "id"), text_of(p, i, "id")) < 0) {
        place = &p->next[*place];
    }
    p->next[i] = *place;
    *place = i;
    return true;
}

/* The places of each subject; false with a problem that names who lacks one or has two. */
static bool find_places(struct pairing *p, const char *const names[2])
{
    size_t lacking = 0, first = NONE, missing = 0, whole = 0;

    for (size_t i = 0; i < p->n; i++) {
        size_t *place = p->which[i] >= 0 ? &p->place[p->which[i]][p->of[i]] : NULL;

        if (place && !add_measurement(p, place, i, names[p->which[i]])) {
            return false;
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
        problem_add(p->given->list, POINTER, "has %zu pair%s of %s and %s; %zu are needed", whole,
                    plural(whole), names[0], names[1], SRNF_PAIRS_MIN);
    }
    return whole >= SRNF_PAIRS_MIN;
}

static int compare_subjects(const void *a, const void *b, void *user)
{
    const struct pairing *p = user;

    return strcmp(text_of(p, *(const size_t *)a, "subject"),
                  text_of(p, *(const size_t *)b, "subject"));
}

static void order_subjects(struct pairing *p)
{
    for (size_t i = 0; i < p->n; i++) {
        if (p->of[i] == i && p->place[0][i] != NONE && p->place[1][i] != NONE) {
            p->order[p->pairs++] = i;
        }
    }
    qsort_r(p->order, p->pairs, sizeof *p->order, compare_subjects, p);
}

/* The side that is computed with as the first one: of the first subject whose two differ, that of
   the lesser id. */
static size_t find_lead(const struct pairing *p)
{
    int order = 0;

    for (size_t k = 0; k < p->pairs && order == 0; k++) {
        order = strcmp(text_of(p, p->place[0][p->order[k]], "id"),
                       text_of(p, p->place[1][p->order[k]], "id"));
    }
    return order > 0 ? 1 : 0;
}

/* Cuts the canonical cohort to the pairs: subject after subject, the one of `lead` before the
   other, measurements of a side by id. Where there are such, firstCount and secondCount tell how
   many. */
static void set_pairs(struct pairing *p, size_t lead, const bool *mirrored)
{
    json_t *cohort = json_object_get(p->given->canonical, "cohort");
    static const char *const arrays[] = {"surfaces", "labels", "subjects"};
    static const char *const names[2][2] = {{"first", "firstCount"}, {"second", "secondCount"}};
    json_t *kept[3] = {json_array(), json_array(), json_array()}, *mirror = json_array();
    json_t *places[2] = {json_array(), json_array()}, *counts[2] = {json_array(), json_array()};

    for (size_t m = 0; m < 2 * p->pairs; m++) {
        size_t which = m % 2 ? 1 - lead : lead, from = json_array_size(mirror);

        for (size_t i = p->place[which][p->order[m / 2]]; i != NONE; i = p->next[i]) {
            for (size_t k = 0; k < 3; k++) {
                (void)json_array_append(kept[k],
                                        json_array_get(json_object_get(cohort, arrays[k]), i));
            }
            (void)json_array_append_new(mirror, json_boolean(mirrored[i]));
        }
        (void)json_array_append_new(places[which], json_integer((json_int_t)from));
        (void)json_array_append_new(counts[which],
                                    json_integer((json_int_t)(json_array_size(mirror) - from)));
    }
    for (size_t k = 0; k < 3; k++) {
        (void)json_object_set_new(cohort, arrays[k], kept[k]);
    }
    for (size_t k = 0; k < 2; k++) {
        (void)json_object_set_new(cohort, names[k][0], places[k]);
        if (json_array_size(mirror) > 2 * p->pairs) {
            (void)json_object_set(cohort, names[k][1], counts[k]);
        }
        json_decref(counts[k]);
    }
    (void)json_object_set_new(cohort, "mirrored", mirror);
}

/* The members as they are stored, with a pairing open; false with the problem noted. */
static bool begin(struct process_inputs *given, struct pairing *p, json_t **members)
{
    *members = group_stored_members(given);
    return open_pairing(p, given, *members);
}

/* ---- Visits ---------------------------------------------------------------------------------- */

static void refuse_times(const struct pairing *p, double lowest, double highest)
{
    bool share = paired_share_times(p->members, p->of);

    problem_add(
        p->given->list, POINTER, "has more than two times, from %g to %g: %s", lowest, highest,
        share ? "say by from and to which two are compared, or ask trajectories, where each "
                "subject has times of its own"
              : "no two subjects have the same two, so that no two times can be compared. "
                "Ask trajectories, where each subject has times of its own, or number the "
                "visits (time 0 and 1)");
}

/* The two times that are compared; false with a problem noted. */
static bool find_times(const struct pairing *p, double times[2])
{
    static const char *const names[2] = {"from", "to"};
    double lowest = INFINITY, highest = -INFINITY;
    char who[GROUP_MEMBER_TEXT];
    size_t others = 0;

    for (size_t i = 0; i < p->n; i++) {
        const json_t *time = json_object_get(json_array_get(p->members, i), "time");

        if (!json_is_number(time)) {
            group_member_text(p->given, p->members, i, who);
            problem_add(p->given->list, POINTER, "%s has no time", who);
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
            refuse_times(p, lowest, highest);
            return false;
        }
    }
    if (!(times[0] != times[1]) && lowest < highest) {
        problem_add(p->given->list, "/inputs/to",
                    "and from are both %g; two different times are compared", times[0]);
    } else if (!(times[0] != times[1])) {
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
            order_subjects(&p);
            set_pairs(&p, times[0] < times[1] ? 0 : 1, mirrored);
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
    char who[GROUP_MEMBER_TEXT];
    bool mirrored[PROCESS_GROUP_MAX] = {false}, good = begin(given, &p, &members);

    for (size_t i = 0; good && i < p.n; i++) {
        const json_t *side = json_object_get(json_array_get(members, i), "side");

        good = json_is_string(side);
        p.which[i] = good && strcmp(json_string_value(side), "right") == 0;
        if (!good) {
            group_member_text(given, members, i, who);
            problem_add(given->list, POINTER, "%s has no side: left or right", who);
        }
    }
    p.measured = true;
    if (good && check_subjects(&p) && find_places(&p, names)) {
        json_t *cohort = json_object_get(given->canonical, "cohort");
        size_t lead;

        order_subjects(&p);
        lead = find_lead(&p);
        set_hands(&p, mirrored);
        set_pairs(&p, lead, mirrored);
        (void)json_object_set_new(cohort, "turned",
                                  json_boolean(mirrored[p.place[lead][p.order[0]]]));
    }
    close_pairing(&p);
    json_decref(members);
}
