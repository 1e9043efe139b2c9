/*
 * trajectories_order.c - the members of a cohort of visits in an order that is theirs alone:
 * subjects by name, the visits of each by time.
 *
 * Registrations and inversions end near a minimum, not in it, and where depends on how sums are
 * rounded. In an order of their own the same members have the same results, bit for bit, in
 * whatever order the cohort has them.
 */
#include "processes/trajectories.h"

#include <stdlib.h>
#include <string.h>

struct visit {
    const json_t *member;
    const char *subject, *id;
    double time;
    char *text; /* all that is said of it, for members that are the same up to here */
    size_t place;
};

static int compare_visits(const void *a, const void *b)
{
    const struct visit *x = a, *y = b;
    int order = strcmp(x->subject, y->subject);

    order = order ? order : (x->time > y->time) - (x->time < y->time);
    order = order ? order : strcmp(x->id, y->id);
    return order ? order : strcmp(x->text, y->text);
}

static const char *text_of(const json_t *member, const char *name)
{
    const char *text = json_string_value(json_object_get(member, name));

    return text ? text : "";
}

static void move(json_t *object, const char *name, const struct visit *visits, size_t n)
{
    const json_t *array = json_object_get(object, name);
    json_t *moved = json_array();

    for (size_t i = 0; i < n; i++) {
        (void)json_array_append(moved, json_array_get(array, visits[i].place));
    }
    if (json_array_size(array) == n) {
        (void)json_object_set(object, name, moved);
    }
    json_decref(moved);
}

json_t *trajectories_order(json_t *cohort, const json_t *members)
{
    static const char *const arrays[] = {"surfaces", "labels", "subjects", "mirrored"};
    size_t n = json_array_size(members);
    struct visit *visits = srnf_alloc(n + 1, sizeof *visits);
    json_t *ordered = NULL;
    bool good = visits != NULL;

    for (size_t i = 0; good && i < n; i++) {
        const json_t *member = json_array_get(members, i);

        visits[i] = (struct visit){.member = member,
                                   .subject = text_of(member, "subject"),
                                   .id = text_of(member, "id"),
                                   .time = json_number_value(json_object_get(member, "time")),
                                   .text = json_memory_dumps(member, JSON_SORT_KEYS | JSON_COMPACT),
                                   .place = i};
        good = visits[i].text != NULL;
    }
    if (good) {
        qsort(visits, n, sizeof *visits, compare_visits);
        for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) {
            move(cohort, arrays[k], visits, n);
        }
        ordered = json_array();
        for (size_t i = 0; i < n; i++) {
            (void)json_array_append_new(ordered, json_deep_copy(visits[i].member));
        }
    }
    for (size_t i = 0; visits && i < n; i++) {
        free(visits[i].text);
    }
    srnf_free(visits);
    return ordered;
}
