/*
 * design_factors.c - the covariates that a formula names, as numbers and as levels.
 */
#include "toolkit/design_factors.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/alike.h"
#include "api/cohorts.h"
#include "text.h"
#include "toolkit/covariates.h"
#include "toolkit/design_names.h"
#include "toolkit/group.h"

#define NAMES_SHOWN 240
#define ADVICE_TEXT 320
#define MIXED_TEXT 240
#define LEVELS_SHOWN 400
#define POINTER "/inputs/formula"

/* What a name means for a member: a covariate, its label, time or side; NULL or null: nothing. */
static const json_t *value_of(const json_t *member, const char *name)
{
    const json_t *value = json_object_get(json_object_get(member, "covariates"), name);

    if (value) {
        return value;
    }
    if (strcmp(name, "label") == 0 || strcmp(name, "group") == 0) {
        return json_object_get(member, "label");
    }
    return strcmp(name, "time") == 0 || strcmp(name, "side") == 0 ? json_object_get(member, name)
                                                                  : NULL;
}

bool design_level(const json_t *value, size_t size, char *text)
{
    int written = -1;

    if (json_is_string(value)) {
        written = snprintf(text, size, "%s", json_string_value(value));
    } else if (json_is_boolean(value)) {
        written = snprintf(text, size, "%s", json_is_true(value) ? "true" : "false");
    } else if (json_is_number(value)) {
        written = snprintf(text, size, "%.15g", json_number_value(value) + 0.0);
    }
    return written > 0 && (size_t)written < size;
}

size_t design_find_level(const struct design_factor *factor, const char *text)
{
    size_t i = 0;

    while (i < json_array_size(factor->levels) &&
           strcmp(json_string_value(json_array_get(factor->levels, i)), text) != 0) {
        i++;
    }
    return i;
}

/* ---- What is wrong --------------------------------------------------------------------------- */

static const char *id_of(const struct design_build *build, size_t i)
{
    const char *id = json_string_value(json_object_get(json_array_get(build->members, i), "id"));

    return id ? id : "";
}

/* Members without the covariate, and the names there are where nobody has it. */
static void refuse_missing(const struct design_build *build, const char *name)
{
    char there[NAMES_SHOWN], advice[ADVICE_TEXT];
    json_t *seen = json_object();
    size_t missing = 0, first = 0;

    for (size_t i = build->n; i-- > 0;) {
        const json_t *member = json_array_get(build->members, i);
        const json_t *value = value_of(member, name);

        (void)json_object_update_missing(seen, json_object_get(member, "covariates"));
        if (cohort_says_nothing(value)) {
            missing++;
            first = i;
        }
    }
    cohort_list_names(seen, there, sizeof there);
    design_name_advice(seen, json_string_value(json_object_get(build->given->canonical, "formula")),
                       name, advice, sizeof advice);
    json_decref(seen);
    if (missing == build->n) {
        problem_add(build->given->list, POINTER,
                    "no member of the cohort has a covariate \"%.60s\"; %s%s%s", name,
                    there[0] ? "the cohort has " : "the cohort has none", there, advice);
    } else {
        problem_add(build->given->list, POINTER,
                    "%zu of %zu members have no \"%.60s\", member %zu (%.40s) first: complete the "
                    "covariate, or take a cohort without them",
                    missing, build->n, name, first, id_of(build, first));
    }
}

static bool looks_like_number(const char *text)
{
    return alike_written(text) == ALIKE_NUMBERS;
}

/* ---- Numbers --------------------------------------------------------------------------------- */

/* A covariate of a member and what the functions make of it. */
static bool check_number(const struct design_build *build, const struct design_factor *factor,
                         size_t i)
{
    const char *name = factor->source->name;
    double x = json_number_value(value_of(json_array_get(build->members, i), name)) + 0.0;

    if (!isfinite(factor->value[i])) {
        char why[FORMULA_WHY_MAX];

        formula_why(factor->source, &factor->state, x, why);
        problem_add(build->given->list, POINTER, "%.80s of member %zu (%.40s) is not finite: %s",
                    factor->source->text, i, id_of(build, i), why);
        return false;
    }
    if (!(covariate_takes(x) && covariate_takes(factor->value[i]))) {
        problem_add(build->given->list, POINTER,
                    "%.80s of member %zu (%.40s) is %.6g, \"%.60s\" %.6g there; " COVARIATE_TAKEN,
                    factor->source->text, i, id_of(build, i), factor->value[i], name, x);
        return false;
    }
    return true;
}

static bool read_numbers(const struct design_build *build, struct design_factor *factor)
{
    const char *name = factor->source->name;

    for (size_t i = 0; i < build->n; i++) {
        double x = json_number_value(value_of(json_array_get(build->members, i), name)) + 0.0;

        factor->lowest = i == 0 ? x : fmin(factor->lowest, x);
        factor->highest = i == 0 ? x : fmax(factor->highest, x);
        factor->mean += (x - factor->mean) / (double)(i + 1);
        factor->value[i] = x;
    }
    formula_learn(factor->source, build->n, factor->value, &factor->state);
    for (size_t i = 0; i < build->n; i++) {
        if (!check_number(build, factor, i)) {
            return false;
        }
    }
    if (!(factor->highest > factor->lowest)) {
        problem_add(build->given->list, POINTER,
                    "\"%.60s\" is the same for all members: leave it out", name);
        return false;
    }
    return true;
}

/* ---- Levels ---------------------------------------------------------------------------------- */

static int compare_levels(const void *a, const void *b)
{
    const char *x = *(const char *const *)a;
    const char *y = *(const char *const *)b;

    if (looks_like_number(x) && looks_like_number(y)) {
        double u = strtod(x, NULL), v = strtod(y, NULL);

        return (u > v) - (u < v);
    }
    return strcmp(x, y);
}

/* Notes a factor of texts that was most likely meant to be numbers. */
static void note_mixed(struct design_build *build, const struct design_factor *factor)
{
    const char *other = NULL, *number = NULL;
    size_t numbers = 0, others = 0;
    bool different = false;

    for (size_t i = 0; i < build->n; i++) {
        const json_t *all = json_object_get(json_array_get(build->members, i), "covariates");
        const char *text = json_string_value(json_object_get(all, factor->source->name));
        bool is_number = text && looks_like_number(text);

        numbers += is_number;
        others += text && !is_number;
        different = different || (is_number && number && strcmp(text, number) != 0);
        number = is_number ? text : number;
        other = text && !is_number && !other ? text : other;
    }
    if (other && (numbers > others || (numbers == others && different))) {
        build->mixed = build->mixed ? build->mixed : json_array();
        (void)json_array_append_new(build->mixed,
                                    json_pack("{s:s, s:s, s:I, s:I}", "column",
                                              factor->source->name, "cell", other, "numbers",
                                              (json_int_t)numbers, "others", (json_int_t)others));
    }
}

/* Notes levels that are all numbers or dates in quotes. Labels are always texts. */
static void note_written(struct design_build *build, const struct design_factor *factor,
                         json_t *texts)
{
    const char *name = factor->source->name;
    const json_t *first = json_object_get(json_array_get(build->members, 0), "covariates");
    enum alike_written written = alike_written_all(texts);
    bool numbers = written != ALIKE_DATES;

    if (written == ALIKE_TEXTS || factor->source->levels || !json_object_get(first, name)) {
        return;
    }
    build->mixed = build->mixed ? build->mixed : json_array();
    (void)json_array_append_new(
        build->mixed, json_pack("{s:s, s:O, s:s, s:I, s:I, s:O}", "column", name, "cell",
                                json_array_get(texts, 0), "written", alike_written_name(written),
                                "numbers", (json_int_t)(numbers ? build->n : 0), "others",
                                (json_int_t)(numbers ? 0 : build->n), "cells", texts));
}

/* Notes levels that differ in case or white space alone, that say that nothing is known, and
   numbers with their unit behind or in quotes, which are texts. seen: the levels. */
static void note_texts(struct design_build *build, const struct design_factor *factor, json_t *seen)
{
    const char *name = factor->source->name, *key, *unit;
    json_t *collection = json_object(), *texts = json_array(), *found, *missing, *value;

    json_object_foreach(seen, key, value)
    {
        alike_add(collection, key);
        (void)json_array_append_new(texts, json_string(key));
    }
    found = alike_found(collection);
    if (found) {
        build->alike = build->alike ? build->alike : json_array();
        (void)json_array_append_new(build->alike,
                                    json_pack("{s:s, s:O}", "of", name, "found", found));
    }
    missing = alike_missing(texts);
    if (missing) {
        build->missing = build->missing ? build->missing : json_array();
        (void)json_array_append_new(build->missing,
                                    json_pack("{s:s, s:o}", "of", name, "found", missing));
    }
    unit = factor->source->levels ? NULL : alike_unit(texts);
    if (unit) {
        build->mixed = build->mixed ? build->mixed : json_array();
        (void)json_array_append_new(
            build->mixed, json_pack("{s:s, s:O, s:s, s:i, s:I, s:O}", "column", name, "cell",
                                    json_array_get(texts, 0), "unit", unit, "numbers", 0, "others",
                                    (json_int_t)build->n, "cells", texts));
    }
    note_written(build, factor, texts);
    json_decref(found);
    json_decref(texts);
    json_decref(collection);
}

/* Why a factor is one of levels, for the end of a sentence: "" where it is meant to be. */
static const char *why_levels(const struct design_build *build, const struct design_factor *factor,
                              char text[MIXED_TEXT])
{
    const char *name = factor->source->name;
    const json_t *one;
    size_t i;

    text[0] = '\0';
    json_array_foreach(build->mixed, i, one)
    {
        const char *unit = json_string_value(json_object_get(one, "unit"));
        const char *cell = json_string_value(json_object_get(one, "cell"));
        const char *written = json_string_value(json_object_get(one, "written"));

        if (strcmp(json_string_value(json_object_get(one, "column")), name) != 0) {
            continue;
        }
        if (unit) {
            (void)snprintf(text, MIXED_TEXT,
                           ". It is text in the cohort, numbers with the unit \"%.20s\", "
                           "\"%.60s\" first: give numbers alone",
                           unit, cell);
        } else if (written) {
            (void)snprintf(text, MIXED_TEXT, ". \"%.60s\" and the others are %s", cell,
                           alike_written_advice(written));
        } else {
            (void)snprintf(text, MIXED_TEXT,
                           ". It is text in the cohort, since \"%.60s\" is no number; %lld of its "
                           "values are: correct the others, or leave their members out",
                           cell, (long long)json_integer_value(json_object_get(one, "numbers")));
        }
    }
    json_array_foreach(build->alike, i, one)
    {
        char quoted[MIXED_TEXT / 2];

        if (!text[0] && strcmp(json_string_value(json_object_get(one, "of")), name) == 0) {
            alike_quote(json_array_get(json_object_get(one, "found"), 0), quoted, sizeof quoted);
            (void)snprintf(text, MIXED_TEXT,
                           ". %s differ in case or white space alone: write them in one way if "
                           "they mean the same",
                           quoted);
        }
    }
    return text;
}

static void refuse_reference(const struct design_build *build, const struct design_factor *factor,
                             size_t count, const char *const *levels)
{
    char quoted[LEVELS_SHOWN];
    json_t *all = json_array();

    for (size_t k = 0; k < count; k++) {
        (void)json_array_append_new(all, json_string(levels[k]));
    }
    alike_quote(all, quoted, sizeof quoted);
    json_decref(all);
    problem_add(build->given->list, POINTER, "\"%.60s\" has no level \"%.60s\"; it has %s",
                factor->source->name, factor->source->reference, quoted);
}

/* The levels in order, the reference first. False with a problem noted. */
static bool sort_levels(const struct design_build *build, struct design_factor *factor,
                        json_t *seen)
{
    const char *levels[DESIGN_LEVELS_MAX], *key, *reference = factor->source->reference;
    size_t count = 0;
    json_t *value;
    bool found = !reference[0];

    json_object_foreach(seen, key, value)
    {
        levels[count++] = key;
        found = found || strcmp(key, reference) == 0;
    }
    qsort(levels, count, sizeof *levels, compare_levels);
    if (!found) {
        refuse_reference(build, factor, count, levels);
        return false;
    }
    if (reference[0]) {
        (void)json_array_append_new(factor->levels, json_string(reference));
    }
    for (size_t k = 0; k < count; k++) {
        if (strcmp(levels[k], reference) != 0) {
            (void)json_array_append_new(factor->levels, json_string(levels[k]));
        }
    }
    return true;
}

/* Each level needs two subjects, and a subject one level. */
static bool count_subjects(const struct design_build *build, const struct design_factor *factor)
{
    const json_t *cohort = json_object_get(build->given->canonical, "cohort");
    size_t subjects, most, count[DESIGN_LEVELS_MAX] = {0};
    size_t *of =
        group_subject_numbers(json_object_get(cohort, "subjects"), build->n, &subjects, &most);
    bool good = of != NULL;
    char why[MIXED_TEXT];

    for (size_t i = 0; good && i < build->n; i++) {
        size_t level = (size_t)factor->value[i], first = of[i];

        count[level] += first == i;
        if (level != (size_t)factor->value[first]) {
            problem_add(build->given->list, POINTER,
                        "members %zu and %zu of one subject have different levels of \"%.60s\": "
                        "regress compares subjects, whose members are averaged. Take members of "
                        "one level of each.",
                        first, i, factor->source->name);
            good = false;
        }
    }
    for (size_t k = 0; good && k < json_array_size(factor->levels); k++) {
        if (count[k] < 2) {
            problem_add(build->given->list, POINTER,
                        "level \"%.60s\" of \"%.60s\" has one subject; each level needs two%s",
                        json_string_value(json_array_get(factor->levels, k)), factor->source->name,
                        why_levels(build, factor, why));
            good = false;
        }
    }
    srnf_free(of);
    return good;
}

static bool read_levels(struct design_build *build, struct design_factor *factor)
{
    char text[FORMULA_NAME_MAX], why[MIXED_TEXT];
    json_t *seen = json_object();
    bool good = true;

    factor->levels = json_array();
    if (!factor->source->levels) {
        note_mixed(build, factor);
    }
    for (size_t i = 0; i < build->n; i++) {
        const json_t *member = json_array_get(build->members, i);

        if (design_level(value_of(member, factor->source->name), sizeof text, text)) {
            (void)json_object_set_new(seen, text, json_true());
        }
    }
    note_texts(build, factor, seen);
    if (json_object_size(seen) < 2 || json_object_size(seen) > DESIGN_LEVELS_MAX) {
        problem_add(build->given->list, POINTER, "\"%.60s\" has %zu level%s; 2 to %d are needed%s",
                    factor->source->name, json_object_size(seen), plural(json_object_size(seen)),
                    DESIGN_LEVELS_MAX, why_levels(build, factor, why));
        good = false;
    }
    good = good && sort_levels(build, factor, seen);
    json_decref(seen);
    for (size_t i = 0; good && i < build->n; i++) {
        const json_t *member = json_array_get(build->members, i);

        good = design_level(value_of(member, factor->source->name), sizeof text, text);
        factor->value[i] = (double)(good ? design_find_level(factor, text) : 0);
    }
    return good && count_subjects(build, factor);
}

/* ---- All ------------------------------------------------------------------------------------- */

/* Some members have numbers; one of the others is quoted, with what to do about it. */
static void refuse_kinds(const struct design_build *build, const char *name, size_t texts,
                         size_t member)
{
    const json_t *value = value_of(json_array_get(build->members, member), name);
    char text[FORMULA_NAME_MAX], advice[ADVICE_TEXT];
    bool written = design_level(value, sizeof text, text) && json_is_string(value);

    if (written && looks_like_number(text)) {
        (void)snprintf(advice, sizeof advice,
                       "a number in quotes: send it as a number, without the quotes");
    } else if (written && 2 * texts < build->n) {
        (void)snprintf(advice, sizeof advice,
                       "a text: send a number, or null where nothing is known, and leave such "
                       "members out");
    } else {
        (void)snprintf(advice, sizeof advice, "%s: write C(%.60s) to take all as levels",
                       written ? "a text" : "none", name);
    }
    problem_add(build->given->list, POINTER,
                "\"%.60s\" is a number for some members and not for %zu of %zu. Of member %zu "
                "(%.40s) it is %s%.60s%s, %s",
                name, texts, build->n, member, id_of(build, member), written ? "\"" : "", text,
                written ? "\"" : "", advice);
}

/* Whether the values are levels; false in *good with a problem noted where they are neither. */
static bool is_categorical(const struct design_build *build, const struct design_factor *factor,
                           bool *good)
{
    const char *name = factor->source->name;
    size_t texts = 0, last = 0;

    for (size_t i = 0; i < build->n; i++) {
        const json_t *value = value_of(json_array_get(build->members, i), name);

        if (!json_is_number(value)) {
            texts++;
            last = i;
        }
    }
    if (factor->source->levels) {
        return true;
    }
    if (texts > 0 && factor->source->steps > 0) {
        problem_add(build->given->list, POINTER,
                    "%.80s needs numbers, and \"%.60s\" of member %zu (%.40s) is none",
                    factor->source->text, name, last, id_of(build, last));
        *good = false;
    } else if (texts > 0 && texts < build->n) {
        refuse_kinds(build, name, texts, last);
        *good = false;
    }
    return texts > 0;
}

static bool read_factor(struct design_build *build, struct design_factor *factor)
{
    bool good = true;

    for (size_t i = 0; i < build->n; i++) {
        const json_t *value = value_of(json_array_get(build->members, i), factor->source->name);

        if (cohort_says_nothing(value)) {
            refuse_missing(build, factor->source->name);
            return false;
        }
    }
    factor->value = srnf_alloc(build->n, sizeof *factor->value);
    if (!factor->value) {
        json_memory_fail();
        return false;
    }
    factor->categorical = is_categorical(build, factor, &good);
    if (!good) {
        return false;
    }
    return factor->categorical ? read_levels(build, factor) : read_numbers(build, factor);
}

bool design_factors_read(struct design_build *build)
{
    bool good = build->n > 0;

    for (size_t f = 0; f < build->formula->factors; f++) {
        bool used = false;

        for (size_t t = 0; t < build->formula->terms; t++) {
            used = used || build->formula->term[t] >> f & 1;
        }
        build->factor[f].source = &build->formula->factor[f];
        good = (!used || read_factor(build, &build->factor[f])) && good;
    }
    return good;
}

void design_factors_clear(struct design_build *build)
{
    for (size_t f = 0; f < FORMULA_FACTORS_MAX; f++) {
        srnf_free(build->factor[f].value);
        json_decref(build->factor[f].levels);
    }
    json_decref(build->mixed);
    json_decref(build->alike);
    json_decref(build->missing);
}
