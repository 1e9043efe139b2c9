/*
 * trajectories_inputs.c - the inputs of the process trajectories that have a shape of their own:
 * visits with their times, a formula that may be left out, and points with a time.
 */
#include "processes/trajectories.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define POINTER "/inputs/cohort"

/* ---- The formula ----------------------------------------------------------------------------- */

static bool names_time(const struct formula *formula)
{
    bool named = false;

    for (size_t f = 0; f < formula->factors; f++) {
        named = named || strcmp(formula->factor[f].name, "time") == 0;
    }
    return named;
}

static void read_formula(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    struct formula *formula = srnf_alloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];

    if (!formula) {
        json_memory_fail();
    } else if (!value || json_is_null(value)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
    } else if (!json_is_string(value)) {
        problem_add(inputs->list, "/inputs/formula",
                    "must be a formula, as shape ~ group + age, or null");
    } else if (!formula_parse(json_string_value(value), formula, problem)) {
        problem_add(inputs->list, "/inputs/formula", "%s", problem);
    } else if (names_time(formula)) {
        problem_add(inputs->list, "/inputs/formula",
                    "has time, which slopes are of already: name covariates of the subjects alone");
    } else {
        (void)json_object_set_new(inputs->canonical, input->name,
                                  json_string(json_string_value(value)));
    }
    srnf_free(formula);
}

static bool type_formula(const json_t *value, void *member)
{
    (void)member; /* what the computation needs of it is in the design */
    return json_is_string(value) || json_is_null(value);
}

const struct input_own trajectories_formula = {
    .schema = "\"type\":[\"string\",\"null\"],\"minLength\":3,\"maxLength\":" PROCESS_TEXT(
        FORMULA_TEXT_MAX) ",\"default\":null",
    .read = read_formula,
    .type = type_formula,
};

/* ---- The cohort ------------------------------------------------------------------------------ */

static double *type_numbers(const json_t *array)
{
    size_t n = json_array_size(array);
    double *values = srnf_alloc(n + 1, sizeof *values);

    for (size_t i = 0; values && i < n; i++) {
        values[i] = json_number_value(json_array_get(array, i));
    }
    return values;
}

static struct trajectories *of_member(void *member)
{
    return (void *)((char *)member - offsetof(struct trajectories, model.group));
}

static bool type_cohort(const json_t *value, void *member)
{
    struct trajectories *asked = of_member(member);
    const json_t *design = json_object_get(value, "design");

    asked->times = type_numbers(json_object_get(value, "times"));
    asked->at_times = type_numbers(json_object_get(design, "atTimes"));
    return asked->times && asked->at_times && group_type_members(value, &asked->model.group) &&
           design_type(design, asked->model.group.n, &asked->model.design);
}

static void clear_cohort(void *member)
{
    struct trajectories *asked = of_member(member);

    srnf_free(asked->times);
    srnf_free(asked->at_times);
    group_input_clear(&asked->model.group);
    design_clear(&asked->model.design);
}

/* As that of regress. */
static void echo_cohort(json_t *cohort)
{
    regress_cohort.echo(cohort);
    (void)json_object_del(json_object_get(cohort, "design"), "atTimes");
}

const struct input_own trajectories_cohort = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members,
    .type = type_cohort,
    .clear = clear_cohort,
    .echo = echo_cohort,
};

/* ---- Visits ---------------------------------------------------------------------------------- */

static const char *text_of(const json_t *members, size_t i, const char *name)
{
    const char *text = json_string_value(json_object_get(json_array_get(members, i), name));

    return text ? text : "?";
}

static double time_of(const json_t *members, size_t i)
{
    return json_number_value(json_object_get(json_array_get(members, i), "time"));
}

/* Every member needs a subject and a time. */
static bool check_members(struct process_inputs *given, const json_t *members)
{
    char who[GROUP_MEMBER_TEXT];

    for (size_t i = 0; i < json_array_size(members); i++) {
        const json_t *member = json_array_get(members, i);

        if (!json_is_string(json_object_get(member, "subject"))) {
            group_member_text(given, members, i, who);
            problem_add(
                given->list, POINTER,
                "%s has no subject, and slopes are those of subjects: name it in the cohort, or "
                "take a cohort without this member",
                who);
            return false;
        }
        if (!json_is_number(json_object_get(member, "time"))) {
            group_member_text(given, members, i, who);
            problem_add(given->list, POINTER,
                        "%s has no time, or one that is no number: give it one in the cohort, in "
                        "the same unit as the others, or take a cohort without this member",
                        who);
            return false;
        }
    }
    return true;
}

/* The first and the last of all members by time; false where they lie too far apart. */
static bool find_span(struct process_inputs *given, const json_t *members, double span[2])
{
    size_t first = 0, last = 0;

    for (size_t i = 0; i < json_array_size(members); i++) {
        first = time_of(members, i) < time_of(members, first) ? i : first;
        last = time_of(members, i) > time_of(members, last) ? i : last;
    }
    span[0] = time_of(members, first);
    span[1] = time_of(members, last);
    if (!(span[1] - span[0] <= SRNF_TIMES_APART_MAX)) {
        problem_add(given->list, POINTER,
                    "member %zu (%.40s) is at the time %g and member %zu (%.40s) at %g, more than "
                    "%g apart: give times in a larger unit",
                    first, text_of(members, first, "id"), span[0], last,
                    text_of(members, last, "id"), span[1], SRNF_TIMES_APART_MAX);
        return false;
    }
    return true;
}

/* Whether the visits of subject i, its first member, lie far enough apart for a slope. of: [n]
   first member of the same subject. */
static bool check_visits(struct process_inputs *given, const json_t *members, const size_t *of,
                         size_t i)
{
    double first = time_of(members, i), last = first;
    size_t visits = 0;

    for (size_t j = i; j < json_array_size(members); j++) {
        if (of[j] == i) {
            first = fmin(first, time_of(members, j));
            last = fmax(last, time_of(members, j));
            visits++;
        }
    }
    if (!(last > first)) {
        problem_add(given->list, POINTER,
                    visits == 1 ? "subject \"%.60s\" has one visit, member %zu; a slope needs "
                                  "two: take a cohort without it"
                                : "all visits of subject \"%.60s\" are at one time, as member "
                                  "%zu; a slope needs two",
                    text_of(members, i, "subject"), i);
        return false;
    }
    if (!(last - first >= SRNF_TIMES_APART_MIN)) {
        problem_add(given->list, POINTER,
                    "subject \"%.60s\", member %zu, is seen from the time %g to %g, less than %g: "
                    "give times in a smaller unit",
                    text_of(members, i, "subject"), i, first, last, SRNF_TIMES_APART_MIN);
        return false;
    }
    return true;
}

/* Every subject needs two times, and there must be subjects enough. of: [n] first member of the
   same subject. */
static bool check_subjects(struct process_inputs *given, const json_t *members, const size_t *of)
{
    size_t n = json_array_size(members), subjects = 0;

    for (size_t i = 0; i < n; i++) {
        if (of[i] == i && !check_visits(given, members, of, i)) {
            return false;
        }
        subjects += of[i] == i;
    }
    if (subjects < SRNF_PAIRS_MIN) {
        problem_add(given->list, POINTER, "has %zu subject%s; %zu are needed", subjects,
                    plural(subjects), SRNF_PAIRS_MIN);
    }
    return subjects >= SRNF_PAIRS_MIN;
}

/* ---- Points ---------------------------------------------------------------------------------- */

/* The points without their times, which go to `times`; false with problems noted. */
static bool split_points(struct process_inputs *given, json_t *points, json_t *times)
{
    const json_t *at = json_object_get(given->canonical, "at");
    bool good = true;

    for (size_t k = 0; k < json_array_size(at); k++) {
        json_t *point = json_deep_copy(json_array_get(at, k));
        const json_t *time = json_object_get(point, "time");
        char pointer[64];

        if (!json_is_number(time)) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/at/%zu", k);
            problem_add(given->list, pointer, "needs a time, a number");
            good = false;
        }
        (void)json_array_append_new(times, json_real(json_number_value(time) + 0.0));
        (void)json_object_del(point, "time");
        (void)json_array_append_new(points, point);
    }
    return good;
}

/* Predictions are not so far from the visits that nothing is left of these. */
static void check_beyond(struct process_inputs *given, const double span[2], const json_t *times)
{
    for (size_t k = 0; k < json_array_size(times); k++) {
        double at = json_number_value(json_array_get(times, k));
        char pointer[64];

        if (!(fmax(span[0] - at, at - span[1]) <= SRNF_TIMES_BEYOND_MAX * (span[1] - span[0]))) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/at/%zu/time", k);
            problem_add(given->list, pointer,
                        "is %g, more than %g times the span of the visits, %g to %g, away from "
                        "them",
                        at, SRNF_TIMES_BEYOND_MAX, span[0], span[1]);
        }
    }
}

/* Gives the points of a design their times, and tells those beyond the visits. */
static void set_times(const double span[2], json_t *design, json_t *times)
{
    json_t *at = json_object_get(design, "at"), *beyond = json_object_get(design, "beyond");

    for (size_t k = 0; k < json_array_size(times); k++) {
        json_t *time = json_array_get(times, k);
        double value = json_number_value(time);

        (void)json_object_set(json_array_get(at, k), "time", time);
        if (value < span[0] || value > span[1]) {
            (void)json_array_append_new(
                beyond, json_pack("{s:I, s:s, s:f, s:f, s:f}", "index", (json_int_t)k, "covariate",
                                  "time", "value", value, "lowest", span[0], "highest", span[1]));
        }
    }
    (void)json_object_set(design, "atTimes", times);
}

/* The design without a formula: the constant alone. */
static void set_constant(struct process_inputs *given, const json_t *members, json_t *cohort,
                         const json_t *points)
{
    json_t *rows = json_array(), *at_rows = json_array();

    for (size_t i = 0; i < json_array_size(members); i++) {
        (void)json_array_append_new(rows, json_array());
    }
    for (size_t k = 0; k < json_array_size(points); k++) {
        const json_t *point = json_array_get(points, k);
        char pointer[64];

        (void)json_array_append_new(at_rows, json_array());
        if (json_object_size(point) > 0) {
            (void)snprintf(pointer, sizeof pointer, "/inputs/at/%zu", k);
            problem_add(given->list, pointer, "has more than a time, and there is no formula");
        }
    }
    (void)json_object_set_new(cohort, "design",
                              json_pack("{s:n, s:[], s:[], s:o, s:O, s:o, s:[], s:[]}", "formula",
                                        "terms", "columns", "rows", rows, "at", points, "atRows",
                                        at_rows, "beyond", "tests"));
}

/* times and design of the canonical cohort, of its members as they are there. */
static void describe(struct process_inputs *given, const json_t *members, const double span[2],
                     json_t *cohort)
{
    const char *text = json_string_value(json_object_get(given->canonical, "formula"));
    struct formula *formula = srnf_alloc(1, sizeof *formula);
    json_t *points = json_array(), *times = json_array(), *visits = json_array();
    char problem[FORMULA_PROBLEM_MAX];

    for (size_t i = 0; i < json_array_size(members); i++) {
        (void)json_array_append_new(visits, json_real(time_of(members, i) + 0.0));
    }
    (void)json_object_set_new(cohort, "times", visits);
    if (!formula) {
        json_memory_fail();
    } else if (split_points(given, points, times)) {
        if (text && formula_parse(text, formula, problem)) {
            design_describe(given, formula, members, cohort, points, "/inputs/at/");
        } else {
            set_constant(given, members, cohort, points);
        }
        check_beyond(given, span, times);
        set_times(span, json_object_get(cohort, "design"), times);
    }
    srnf_free(formula);
    json_decref(points);
    json_decref(times);
}

void trajectories_describe(struct process_inputs *given)
{
    json_t *cohort = json_object_get(given->canonical, "cohort"), *ordered = NULL;
    json_t *members = group_stored_members(given);
    size_t n = json_array_size(members), count = 0, largest = 0;
    size_t *of = NULL;
    double span[2];

    of = group_subject_numbers(json_object_get(cohort, "subjects"), n, &count, &largest);
    if (!of) {
        json_memory_fail();
    } else if (check_members(given, members) && find_span(given, members, span) &&
               check_subjects(given, members, of)) {
        describe(given, members, span, cohort); /* which numbers members as the cohort does */
        if (!given->list->errors) {
            ordered = trajectories_order(cohort, members);
            if (ordered) {
                describe(given, ordered, span, cohort);
            } else {
                json_memory_fail();
            }
        }
    }
    srnf_free(of);
    json_decref(ordered);
    json_decref(members);
}
