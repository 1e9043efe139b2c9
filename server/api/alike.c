/*
 * alike.c - see alike.h.
 */
#include "api/alike.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "api/study_cells.h"
#include "api/warnings.h"

#define QUOTED_MAX 5
#define TEXT_MAX 512

/* Length of the white space that a text begins with, a no-break space counted. */
static size_t space_at(const char *text)
{
    if (strncmp(text, "\xc2\xa0", 2) == 0) {
        return 2;
    }
    return isspace((unsigned char)*text) ? 1 : 0;
}

static void fold(const char *text, char folded[TEXT_MAX])
{
    size_t length = 0;

    while (*text && length + 1 < TEXT_MAX) {
        size_t space = space_at(text);

        if (space > 0) {
            text += space;
        } else {
            char c = *text++;

            folded[length++] = (char)(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
        }
    }
    folded[length] = '\0';
}

/* Takes the zeros before whole numbers away. */
static void drop_zeros(char *folded)
{
    size_t length = 0;
    char last = '\0';

    for (const char *at = folded; *at; at++) {
        bool leads = *at == '0' && !isdigit((unsigned char)last) && last != '.';

        if (!leads || !isdigit((unsigned char)at[1])) {
            last = folded[length++] = *at;
        }
    }
    folded[length] = '\0';
}

static void add(json_t *collection, const char *text, bool subject)
{
    char folded[TEXT_MAX];
    json_t *own;
    size_t i = 0;

    if (strlen(text) >= TEXT_MAX) {
        return;
    }
    fold(text, folded);
    if (subject) {
        drop_zeros(folded);
    }
    own = json_object_get(collection, folded);
    if (!own) {
        own = json_array();
        (void)json_object_set_new(collection, folded, own);
    }
    while (i < json_array_size(own) &&
           strcmp(json_string_value(json_array_get(own, i)), text) != 0) {
        i++;
    }
    if (i == json_array_size(own)) {
        (void)json_array_append_new(own, json_string(text));
    }
}

void alike_add(json_t *collection, const char *text)
{
    add(collection, text, false);
}

void alike_add_subject(json_t *collection, const char *text)
{
    add(collection, text, true);
}

json_t *alike_found(json_t *collection)
{
    json_t *found = NULL, *texts;
    const char *key;

    json_object_foreach(collection, key, texts)
    {
        if (json_array_size(texts) > 1) {
            found = found ? found : json_array();
            (void)json_array_append(found, texts);
        }
    }
    return found;
}

void alike_quote(const json_t *texts, char *quoted, size_t size)
{
    size_t length = 0, count = json_array_size(texts);

    quoted[0] = '\0';
    for (size_t i = 0; i < count && i < QUOTED_MAX && length < size; i++) {
        (void)snprintf(quoted + length, size - length, "%s\"%.60s\"", i ? ", " : "",
                       json_string_value(json_array_get(texts, i)));
        length = strlen(quoted);
    }
    if (count > QUOTED_MAX) {
        (void)snprintf(quoted + length, size - length, " and %zu more", count - QUOTED_MAX);
    }
}

void alike_warn(json_t *warnings, const char *of, const json_t *found)
{
    char quoted[80 * QUOTED_MAX];
    const json_t *texts;
    size_t i;

    json_array_foreach(found, i, texts)
    {
        alike_quote(texts, quoted, sizeof quoted);
        warning_add(warnings, "labels-alike", json_pack("{s:s, s:O}", "of", of, "texts", texts),
                    "\"%.60s\" has texts that differ in case or white space alone: %s. Each is a "
                    "group of its own. Write them in one way if they mean the same.",
                    of, quoted);
    }
}

void alike_warn_subjects(json_t *warnings, json_t *collection)
{
    json_t *found = alike_found(collection), *texts = json_array_get(found, 0);
    size_t count = json_array_size(found);
    char quoted[80 * QUOTED_MAX], others[48] = "";

    if (found) {
        alike_quote(texts, quoted, sizeof quoted);
        if (count > 1) {
            (void)snprintf(others, sizeof others, ", and so %zu more", count - 1);
        }
        warning_add(warnings, "subjects-alike",
                    json_pack("{s:O, s:I}", "texts", texts, "count", (json_int_t)count),
                    "Subjects differ in case, white space or zeros before a number alone: %s%s. "
                    "Each counts as a subject of its own. Write them in one way if they are the "
                    "same.",
                    quoted, others);
    }
    json_decref(found);
}

json_t *alike_missing(const json_t *texts)
{
    static const char *const missing[] = {"na", "n/a", "#n/a", "n.a.", "nan", "null",   "missing",
                                          "?",  "-",   "--",   ".",    "",    "unknown"};
    json_t *found = NULL, *text;
    size_t i;

    json_array_foreach(texts, i, text)
    {
        char folded[TEXT_MAX];

        fold(json_string_value(text), folded);
        for (size_t k = 0; k < sizeof missing / sizeof missing[0]; k++) {
            if (strcmp(folded, missing[k]) == 0) {
                found = found ? found : json_array();
                (void)json_array_append(found, text);
            }
        }
    }
    return found;
}

void alike_warn_missing(json_t *warnings, const char *of, const json_t *found)
{
    char quoted[80 * QUOTED_MAX];

    if (found) {
        alike_quote(found, quoted, sizeof quoted);
        warning_add(
            warnings, "level-says-missing", json_pack("{s:s, s:O}", "of", of, "texts", found),
            "%s of \"%.60s\" is a group of its own, though many programs write it for what is "
            "missing. Give null for what is not known, and leave those members out.",
            quoted, of);
    }
}

/* What stands behind a number, without the space before it; NULL: it is no number with a unit. */
static const char *unit_of(const char *text, double *number)
{
    char *end;

    *number = strtod(text, &end);
    if (end == text || !(isdigit((unsigned char)end[-1]) || end[-1] == '.')) {
        return NULL;
    }
    while (space_at(end) > 0) {
        end += space_at(end);
    }
    return isalpha((unsigned char)*end) || *end == '%' || (unsigned char)*end >= 0x80 ? end : NULL;
}

const char *alike_unit(const json_t *texts)
{
    const char *unit = NULL;
    bool different = false;
    double first = 0.0;

    for (size_t i = 0; i < json_array_size(texts); i++) {
        const char *text = json_string_value(json_array_get(texts, i));
        double number = 0.0;
        const char *own = text ? unit_of(text, &number) : NULL;

        if (!own || (unit && strcasecmp(own, unit) != 0)) {
            return NULL;
        }
        first = unit ? first : number;
        different = different || number > first || number < first;
        unit = unit ? unit : own;
    }
    return different ? unit : NULL;
}

/* ---- Numbers in quotes ----------------------------------------------------------------------- */

/* Three numbers with the same mark between them, one of four digits first or last: the year. */
static bool is_date(const char *text)
{
    size_t digits[3], length = 0;
    long value[3], other;

    for (size_t k = 0; k < 3; k++) {
        digits[k] = strspn(text + length, "0123456789");
        value[k] = strtol(text + length, NULL, 10);
        length += digits[k];
        if (digits[k] == 0 || (k < 2 && (!text[length] || !strchr("-/.", text[length])))) {
            return false;
        }
        length += k < 2;
    }
    other = digits[0] == 4 ? value[2] : value[0];
    return (digits[0] == 4) != (digits[2] == 4) &&
           text[digits[0]] == text[digits[0] + 1 + digits[1]] &&
           (!text[length] || text[length] == 'T' || text[length] == ' ') && other >= 1 &&
           other <= 31 && value[1] >= 1 && value[1] <= 31 && (other <= 12 || value[1] <= 12);
}

enum alike_written alike_written(const char *text)
{
    size_t digits = strcspn(text, "0123456789");
    char *end;

    (void)strtod(text, &end);
    if (!text[digits]) { /* neither "inf" nor "nan" */
        return ALIKE_TEXTS;
    }
    if (end != text && !*end) {
        return ALIKE_NUMBERS;
    }
    return study_cell_is_number(text, ',') ? ALIKE_COMMAS
           : is_date(text)                 ? ALIKE_DATES
                                           : ALIKE_TEXTS;
}

enum alike_written alike_written_all(const json_t *texts)
{
    enum alike_written all = ALIKE_TEXTS;

    for (size_t i = 0; i < json_array_size(texts); i++) {
        enum alike_written own = alike_written(json_string_value(json_array_get(texts, i)));
        bool numbers = own == ALIKE_NUMBERS || own == ALIKE_COMMAS;

        if (own == ALIKE_TEXTS || (i > 0 && numbers == (all == ALIKE_DATES))) {
            return ALIKE_TEXTS;
        }
        all = i == 0 || own == ALIKE_COMMAS ? own : all; /* 11 stands beside 11,5 */
    }
    return all;
}

const char *alike_written_name(enum alike_written written)
{
    return written == ALIKE_COMMAS ? "decimal-comma" : written == ALIKE_DATES ? "date" : "number";
}

const char *alike_written_advice(const char *name)
{
    return strcmp(name, "date") == 0
               ? "dates in quotes. Send how long after a common day each is, as a number"
           : strcmp(name, "number") == 0
               ? "numbers in quotes. Send them as numbers, without the quotes"
               : "numbers in quotes, with a decimal comma. Send them as numbers, with a point "
                 "and without the quotes";
}
