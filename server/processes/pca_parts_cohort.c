/*
 * pca_parts_cohort.c - cohorts with several structures of each subject: a covariate, "part" unless
 * another is named, says which structure a member is.
 *
 * In canonical form the cohort's members stand part after part, in the order in which the cohort
 * first has each, and within a part subject after subject, in the same order for all. parts has the
 * names, weights the weight of each.
 */
#include "processes/pca_parts.h"

#include "api/model_parts.h"
#include "toolkit/routes.h"

#include <stdio.h>
#include <string.h>

#define POINTER "/inputs/cohort"
#define NONE SIZE_MAX
#define NAME_MAX_BYTES 60

_Static_assert(PCA_PARTS_MAX == SRNF_PARTS_MAX, "as many as the core takes");

/* ---- Inputs ---------------------------------------------------------------------------------- */

static bool type_cohort(const json_t *value, void *member)
{
    struct pca_parts *asked = (void *)((char *)member - offsetof(struct pca_parts, group));
    const json_t *weights = json_object_get(value, "weights");

    asked->n_parts = json_array_size(weights);
    for (size_t p = 0; p < asked->n_parts && p < PCA_PARTS_MAX; p++) {
        asked->weights[p] = json_number_value(json_array_get(weights, p));
    }
    if (!group_type_members(value, &asked->group)) {
        return false;
    }
    asked->n = asked->n_parts ? asked->group.n / asked->n_parts : 0;
    return asked->n > 0 && asked->n_parts <= PCA_PARTS_MAX;
}

const struct input_own pca_parts_cohort = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members_apart,
    .type = type_cohort,
    .clear = group_input_clear,
};

static void read_by(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(value);

    if (!value) {
        text = "part";
    }
    if (!text || !text[0] || strlen(text) > NAME_MAX_BYTES) {
        problem_add(inputs->list, "/inputs/by", "must be the name of a covariate");
        return;
    }
    (void)json_object_set_new(inputs->canonical, input->name, json_string(text));
}

/* The members are in order by now. */
static bool type_text(const json_t *value, void *member)
{
    (void)member;
    return json_is_string(value);
}

const struct input_own pca_parts_by = {
    .schema = "\"type\":\"string\",\"minLength\":1,\"maxLength\":60,\"default\":\"part\"",
    .read = read_by,
    .type = type_text,
};

static void read_weights(struct process_inputs *inputs, const struct process_input *input)
{
    json_t *value = json_object_get(inputs->given, input->name), *weight;
    json_t *canonical = json_object();
    const char *name;

    if (value && !json_is_object(value)) {
        problem_add(inputs->list, "/inputs/weights",
                    "must be an object: a weight for each name of a part");
    }
    json_object_foreach(value, name, weight)
    {
        double number = json_number_value(weight);

        if (!json_is_number(weight) || !(number > 0.0 && number <= PCA_PARTS_WEIGHT_MAX)) {
            problem_add(inputs->list, "/inputs/weights",
                        "\"%.60s\" must be a number above 0 and up to %d", name,
                        PCA_PARTS_WEIGHT_MAX);
        }
        (void)json_object_set_new(canonical, name, json_real(number));
    }
    (void)json_object_set_new(inputs->canonical, input->name, canonical);
}

static bool type_weights(const json_t *value, void *member)
{
    (void)member;
    return json_is_object(value);
}

const struct input_own pca_parts_weights = {
    .schema =
        "\"type\":\"object\",\"additionalProperties\":{\"type\":\"number\","
        "\"exclusiveMinimum\":0,\"maximum\":" PROCESS_TEXT(PCA_PARTS_WEIGHT_MAX) "},\"default\":{}",
    .read = read_weights,
    .type = type_weights,
};

/* ---- Parts and subjects ---------------------------------------------------------------------- */

struct sorting {
    struct process_inputs *given;
    json_t *members;
    const json_t *known; /* names of all parts that there may be; NULL: those that there are */
    size_t n, n_parts, n_subjects;
    const char *parts[PCA_PARTS_MAX];
    size_t *of;    /* [n] subject number: the first member of the same */
    size_t *part;  /* [n] */
    size_t *place; /* [n_parts][n] by subject number: the member, or NONE */
};

static const char *text_of(const struct sorting *s, size_t i, const char *name)
{
    const char *text = json_string_value(json_object_get(json_array_get(s->members, i), name));

    return text ? text : "?";
}

/* The number of the part that a member is; false with a problem noted. */
static bool find_part(struct sorting *s, size_t i)
{
    const char *by = json_string_value(json_object_get(s->given->canonical, "by"));
    const json_t *member = json_array_get(s->members, i);
    const char *name =
        json_string_value(json_object_get(json_object_get(member, "covariates"), by));

    if (!name || !name[0]) {
        problem_add(s->given->list, POINTER,
                    "member %zu (%.40s) has no covariate \"%.60s\", a text that says which part "
                    "of its subject it is",
                    i, text_of(s, i, "id"), by);
        return false;
    }
    for (s->part[i] = 0; s->part[i] < s->n_parts; s->part[i]++) {
        if (strcmp(s->parts[s->part[i]], name) == 0) {
            return true;
        }
    }
    if (s->known) {
        char text[MODEL_NAMES_MAX];

        problem_add(s->given->list, POINTER,
                    "member %zu (%.40s) is part \"%.60s\", which is none of the model's parts: %s",
                    i, text_of(s, i, "id"), name, model_names_text(s->known, text));
        return false;
    }
    if (s->n_parts == PCA_PARTS_MAX) {
        problem_add(s->given->list, POINTER, "has more than %d parts by \"%.60s\"", PCA_PARTS_MAX,
                    by);
        return false;
    }
    s->parts[s->n_parts++] = name;
    return true;
}

static bool find_parts(struct sorting *s)
{
    for (size_t i = 0; i < s->n; i++) {
        if (!json_is_string(json_object_get(json_array_get(s->members, i), "subject"))) {
            problem_add(s->given->list, POINTER,
                        "member %zu (%.40s) has no subject: parts belong to subjects", i,
                        text_of(s, i, "id"));
            return false;
        }
        if (!find_part(s, i)) {
            return false;
        }
    }
    return true;
}

/* How many subjects have a part; the first of these, and the first who has not, or NONE. */
static size_t count_part(const struct sorting *s, size_t part, size_t *has, size_t *lacks)
{
    size_t have = 0;

    *has = *lacks = NONE;
    for (size_t i = s->n; i-- > 0;) {
        bool own = s->place[part * s->n + i] != NONE;

        if (s->of[i] == i) {
            have += own;
            *(own ? has : lacks) = i;
        }
    }
    return have;
}

/* Whether each subject has each part. A part that few have is most likely another one misspelt,
   and theirs is the mistake, not that of all others. */
static bool check_whole(struct sorting *s)
{
    size_t has, lacks, part = s->n_parts;

    for (size_t p = 0; p < s->n_parts; p++) {
        size_t have = count_part(s, p, &has, &lacks);

        if (!s->known && 2 * have < s->n_subjects) { /* what a model has is spelt well */
            problem_add(s->given->list, POINTER,
                        "%zu of %zu subjects %s a member of part \"%.60s\", subject \"%.60s\" "
                        "first: is it misspelt? Otherwise complete the others, or leave it out",
                        have, s->n_subjects, have == 1 ? "has" : "have", s->parts[p],
                        text_of(s, has, "subject"));
            return false;
        }
        part = have < s->n_subjects && part == s->n_parts ? p : part;
    }
    if (part < s->n_parts) {
        (void)count_part(s, part, &has, &lacks);
        problem_add(s->given->list, POINTER,
                    "subject \"%.60s\" has no member of part \"%.60s\": complete it, or take a "
                    "cohort without it",
                    text_of(s, lacks, "subject"), s->parts[part]);
    }
    return part == s->n_parts;
}

/* Each subject has each part once; otherwise a problem that names who has not. */
static bool find_places(struct sorting *s)
{
    for (size_t i = 0; i < s->n; i++) {
        size_t *place = &s->place[s->part[i] * s->n + s->of[i]];

        if (*place != NONE) {
            problem_add(s->given->list, POINTER,
                        "subject \"%.60s\" has two members of part \"%.60s\", %zu and %zu: take "
                        "one of them",
                        text_of(s, i, "subject"), s->parts[s->part[i]], *place, i);
            return false;
        }
        *place = i;
    }
    for (size_t i = 0; i < s->n; i++) {
        s->n_subjects += s->of[i] == i;
    }
    if (!check_whole(s)) {
        return false;
    }
    if (!s->known && s->n_subjects < PROCESS_GROUP_MIN) {
        problem_add(s->given->list, POINTER, "has %zu subject; %d are needed", s->n_subjects,
                    PROCESS_GROUP_MIN);
        return false;
    }
    return true;
}

/* The members of the canonical cohort, part after part. */
static void sort_members(const struct sorting *s)
{
    static const char *const arrays[] = {"surfaces", "labels", "subjects", "mirrored"};
    json_t *cohort = json_object_get(s->given->canonical, "cohort");

    for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) {
        const json_t *all = json_object_get(cohort, arrays[k]);
        json_t *sorted = json_array();

        for (size_t p = 0; p < s->n_parts; p++) {
            for (size_t i = 0; i < s->n; i++) {
                json_t *value = json_array_get(all, s->place[p * s->n + i]);

                if (s->of[i] == i) {
                    (void)json_array_append_new(sorted, value ? json_incref(value) : json_null());
                }
            }
        }
        (void)json_object_set_new(cohort, arrays[k], sorted);
    }
}

/* The routes of each part, which alone is compared with itself; false when answered. */
static bool check_routes(const struct sorting *s)
{
    const json_t *cohort = json_object_get(s->given->canonical, "cohort");
    const json_t *surfaces = json_object_get(cohort, "surfaces");
    bool good = true;

    for (size_t p = 0; p < s->n_parts && good; p++) {
        json_t *own = json_array();

        for (size_t i = 0; i < s->n_subjects; i++) {
            (void)json_array_append(own, json_array_get(surfaces, p * s->n_subjects + i));
        }
        good = inputs_routes(s->given, own);
        json_decref(own);
    }
    return good;
}

static void set_weights(const struct sorting *s)
{
    json_t *cohort = json_object_get(s->given->canonical, "cohort");
    json_t *weights = json_object_get(s->given->canonical, "weights");
    json_t *names = json_array(), *list = json_array();
    const char *name;
    json_t *unknown;

    for (size_t p = 0; p < s->n_parts; p++) {
        const json_t *weight = json_object_get(weights, s->parts[p]);

        (void)json_array_append_new(names, json_string(s->parts[p]));
        (void)json_array_append_new(list, json_real(weight ? json_number_value(weight) : 1.0));
    }
    json_object_foreach(weights, name, unknown)
    {
        char text[MODEL_NAMES_MAX];

        if (model_name_find(names, name) == s->n_parts) {
            problem_add(s->given->list, "/inputs/weights",
                        "names \"%.60s\", a part that no member is; the parts are %s", name,
                        model_names_text(names, text));
        }
    }
    (void)json_object_set_new(cohort, "parts", names);
    (void)json_object_set_new(cohort, "weights", list);
}

static bool open_sorting(struct sorting *s)
{
    const json_t *cohort = json_object_get(s->given->canonical, "cohort");
    size_t count, largest;

    s->n = json_array_size(s->members);
    s->of = group_subject_numbers(json_object_get(cohort, "subjects"), s->n, &count, &largest);
    s->part = srnf_alloc(s->n + 1, sizeof *s->part);
    s->place = srnf_alloc(PCA_PARTS_MAX * s->n + 1, sizeof *s->place);
    if (!s->of || !s->part || !s->place) {
        json_memory_fail();
        return false;
    }
    for (size_t i = 0; i < PCA_PARTS_MAX * s->n; i++) {
        s->place[i] = NONE;
    }
    return true;
}

/* known: as in struct sorting. */
static void sort_by_parts(struct process_inputs *given, const json_t *known)
{
    struct sorting s = {.given = given, .members = group_stored_members(given), .known = known};

    for (size_t p = 0; p < json_array_size(known) && p < PCA_PARTS_MAX; p++) {
        s.parts[s.n_parts++] = json_string_value(json_array_get(known, p));
    }
    if (!given->answered && open_sorting(&s) && find_parts(&s) && find_places(&s)) {
        sort_members(&s);
        if (check_routes(&s) && !known) {
            set_weights(&s);
        }
    }
    srnf_free(s.of);
    srnf_free(s.part);
    srnf_free(s.place);
    json_decref(s.members);
}

void pca_parts_complete(struct process_inputs *given)
{
    sort_by_parts(given, NULL);
}

void pca_parts_sort(struct process_inputs *given, const json_t *names)
{
    sort_by_parts(given, names);
}
