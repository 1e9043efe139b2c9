/*
 * study_table.c - from a table to members of a cohort.
 *
 * A column is read as a whole: 1 and 2 among words are words, and a subject 007 keeps its zeros. A
 * comma within a number is a decimal comma where cells are separated by semicolons or tabs, as
 * spreadsheets in most of Europe write them. Between commas, in quotes, "1,234" can be either of
 * two numbers, and is refused; so is a column with points in some cells and commas in others, and
 * one of 1.200 beside one of 1,5.
 */
#include "api/study_table.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "api/alike.h"
#include "api/cohorts.h"
#include "api/numerals.h"
#include "api/warnings.h"
#include "text.h"

#define NUMBER_MAX 64  /* bytes of the longest number that is read */
#define STRAYS_SHOWN 3 /* different texts among numbers that a warning quotes */

static bool wrong(char problem[DELIMITED_PROBLEM_MAX], const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static bool wrong(char problem[DELIMITED_PROBLEM_MAX], const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(problem, DELIMITED_PROBLEM_MAX, format, arguments);
    va_end(arguments);
    return false;
}

static bool says_nothing(const char *cell)
{
    return !cell[0] || strcasecmp(cell, "NA") == 0 || strcasecmp(cell, "N/A") == 0 ||
           strcasecmp(cell, "NaN") == 0;
}

/* [+-]digits[mark digits][e[+-]digits] and nothing else. */
static bool is_number(const char *cell, char mark)
{
    const char *at = cell + (*cell == '+' || *cell == '-');
    size_t digits = strspn(at, "0123456789");

    at += digits;
    if (*at == mark) {
        size_t more = strspn(++at, "0123456789");

        digits += more;
        at += more;
    }
    if (digits > 0 && (*at == 'e' || *at == 'E')) {
        at += 1 + (at[1] == '+' || at[1] == '-');
        if (!isdigit((unsigned char)*at)) {
            return false;
        }
        at += strspn(at, "0123456789");
    }
    return digits > 0 && !*at && strlen(cell) < NUMBER_MAX;
}

static bool is_boolean(const char *cell)
{
    return strcasecmp(cell, "true") == 0 || strcasecmp(cell, "false") == 0;
}

/* What people write where nothing is known. It is no number, and no text of a column of texts
   either; what it stands for is not guessed. */
static bool is_placeholder(const char *cell)
{
    static const char *const all[] = {"-",    "--",   ".",       "?",       "x",    "n.a.",
                                      "none", "null", "missing", "unknown", "n.d.", "nd"};

    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        if (strcasecmp(cell, all[i]) == 0) {
            return true;
        }
    }
    return false;
}

/* Whether two cells of a column are different numbers. */
static bool has_numbers(const struct study_table *table, size_t column)
{
    const char *number = NULL;

    for (size_t i = 0; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);

        if (!is_number(cell, '.') && !is_number(cell, ',')) {
            continue;
        }
        if (number && strcmp(number, cell) != 0) {
            return true;
        }
        number = cell;
    }
    return false;
}

/* A column of numbers was most likely meant to be one where most cells are, or all but those that
   stand for nothing or are numbers in a spelling that is not read (styled), or half of them and not
   the same number each time. */
static void note_strays(struct study_table *table, size_t column, size_t numbers, size_t said,
                        size_t placeholders, size_t styled, size_t first)
{
    size_t others = said - numbers;

    if (others > 0 && numbers + styled > 1 &&
        (numbers > others || others == placeholders + styled ||
         (numbers == others && has_numbers(table, column)))) {
        table->strays[column] =
            (struct study_strays){.numbers = numbers, .others = others, .row = first};
    }
}

/* What all cells of a column can be read as; false with a problem where that is not clear. */
static bool judge_column(struct study_table *table, size_t column,
                         char problem[DELIMITED_PROBLEM_MAX])
{
    size_t said = 0, points = 0, commas = 0, whole = 0, booleans = 0, first = SIZE_MAX;
    size_t placeholders = 0, styled = 0;
    const char *name = table->cells.cells[column];

    for (size_t i = 0; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);

        if (says_nothing(cell)) {
            continue;
        }
        said++;
        booleans += is_boolean(cell);
        if (is_number(cell, '.')) {
            whole += is_number(cell, ',');
            points += !is_number(cell, ',');
        } else if (is_number(cell, ',')) {
            commas++;
        } else {
            first = first == SIZE_MAX ? i : first;
            placeholders += is_placeholder(cell);
            styled += !is_placeholder(cell) && numeral_is_styled(cell);
        }
    }
    note_strays(table, column, points + commas + whole, said, placeholders, styled, first);
    table->kinds[column] = said == 0                ? STUDY_EMPTY
                           : booleans == said       ? STUDY_BOOLEAN
                           : points + whole == said ? STUDY_NUMBER
                           : commas + whole == said ? STUDY_COMMA_NUMBER
                                                    : STUDY_TEXT;
    if (commas > 0 && points + commas + whole == said &&
        (points > 0 || table->cells.separator == ',')) {
        (void)snprintf(problem, DELIMITED_PROBLEM_MAX,
                       points > 0 ? "column %.80s has numbers with points and with commas"
                                  : "column %.80s has commas in its numbers, and the table is "
                                    "separated by commas; write decimals with points",
                       name);
        return false;
    }
    return true;
}

/* A cell that is a number, as C writes it; returns its value. */
static double read_number(const char *cell, bool comma, char copy[NUMBER_MAX])
{
    (void)snprintf(copy, NUMBER_MAX, "%s", cell);
    if (comma && strchr(copy, ',')) {
        *strchr(copy, ',') = '.';
    }
    return strtod(copy, NULL);
}

/* Whether all numbers of a column are doubles. One that is not must not pass for a cell that says
   nothing. */
static bool check_numbers(const struct study_table *table, size_t column,
                          char problem[DELIMITED_PROBLEM_MAX])
{
    enum study_kind kind = table->kinds[column];

    if (kind != STUDY_NUMBER && kind != STUDY_COMMA_NUMBER) {
        return true;
    }
    for (size_t i = 0; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);
        char copy[NUMBER_MAX];

        if (!says_nothing(cell) && !isfinite(read_number(cell, kind == STUDY_COMMA_NUMBER, copy))) {
            return wrong(problem, "line %u, column %.80s: the number %.64s is too large",
                         table->cells.lines[i + 1], table->cells.cells[column], cell);
        }
    }
    return true;
}

/* The first number of a column that has the mark; NULL: none has. *grouped: in all that have it, it
   can stand between thousands. */
static const char *first_marked(const struct study_table *table, size_t column, char mark,
                                bool *grouped)
{
    enum study_kind kind = table->kinds[column];
    const char *first = NULL;

    *grouped = true;
    for (size_t i = 0; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);

        if ((kind == STUDY_NUMBER || kind == STUDY_COMMA_NUMBER) && strchr(cell, mark)) {
            *grouped = *grouped && numeral_is_grouped(cell, mark);
            first = first ? first : cell;
        }
    }
    return first;
}

/* Refuses a column of which each mark can stand between thousands, where another column has the
   other mark: 1.200 beside 41,5 is more likely a thousand than one and a fifth. */
static bool check_marks(const struct study_table *table, char problem[DELIMITED_PROBLEM_MAX])
{
    static const char marks[2][2] = {{'.', ','}, {',', '.'}};

    for (size_t k = 0; k < 2; k++) {
        for (size_t i = 0; i < table->cells.columns; i++) {
            bool grouped, any;
            const char *cell = first_marked(table, i, marks[k][0], &grouped);

            for (size_t j = 0; j < table->cells.columns && cell && grouped; j++) {
                const char *other = first_marked(table, j, marks[k][1], &any);

                if (other) {
                    return wrong(problem,
                                 "\"%.40s\" of column %.80s can be two numbers, since column %.80s "
                                 "has \"%.40s\"; write all numbers with the same decimal mark, and "
                                 "thousands without one",
                                 cell, table->cells.cells[i], table->cells.cells[j], other);
                }
            }
        }
    }
    return true;
}

/* The place of a column with a meaning of its own; NULL: it is a covariate. participant_id is what
   BIDS calls subjects: scans of one that passed for several would make p-values too good. */
static size_t *place_of(struct study_table *table, const char *name, const char *key)
{
    const struct {
        const char *name;
        size_t *column;
    } places[] = {{key, &table->key},
                  {"label", &table->label},
                  {"subject", &table->subject},
                  {"time", &table->time},
                  {"side", &table->side},
                  {"mirror", &table->mirror},
                  {"participant_id", &table->subject}};

    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        if (strcasecmp(name, places[i].name) == 0) {
            return places[i].column;
        }
    }
    return NULL;
}

static bool is_column_empty(const struct study_table *table, size_t column)
{
    for (size_t i = 0; i < table->cells.rows; i++) {
        if (delimited_cell(&table->cells, i, column)[0]) {
            return false;
        }
    }
    return true;
}

/* Whether the column is a text whatever its cells look like. */
static bool is_text_column(const struct study_table *table, size_t column)
{
    return column == table->key || column == table->label || column == table->subject ||
           column == table->side;
}

/* Finds out what each column is. */
static bool read_head(struct study_table *table, const char *key,
                      char problem[DELIMITED_PROBLEM_MAX])
{
    const char **head = table->cells.cells;
    size_t covariates = 0;

    for (size_t i = 0; i < table->cells.columns; i++) {
        size_t *place = place_of(table, head[i], key);

        for (size_t j = 0; j < i; j++) {
            if (head[i][0] && strcasecmp(head[i], head[j]) == 0) {
                return wrong(problem, "there are two columns %.80s", head[i]);
            }
        }
        if (place && *place != STUDY_NO_COLUMN) {
            return wrong(problem, "%.80s and %.80s are both the subject", head[*place], head[i]);
        }
        if (place) {
            *place = i;
        } else if (strlen(head[i]) > COHORT_TEXT_MAX) {
            return wrong(problem, "the name of column %.80s.. is too long", head[i]);
        } else if (!head[i][0] && !is_column_empty(table, i)) {
            return wrong(problem, "a column has no name");
        }
        covariates += !place && head[i][0];
        table->kinds[i] = STUDY_TEXT;
        if (!is_text_column(table, i) &&
            (!judge_column(table, i, problem) || !check_numbers(table, i, problem))) {
            return false;
        }
    }
    if (table->key == STUDY_NO_COLUMN) {
        return wrong(problem, "it has no column \"%s\" in its first line", key);
    }
    if (covariates > COHORT_COVARIATES_MAX) {
        return wrong(problem, "it has more than %d covariates", COHORT_COVARIATES_MAX);
    }
    return check_marks(table, problem);
}

enum delimited_status study_table_read(const void *text, size_t size, const char *key,
                                       struct study_table *table,
                                       char problem[DELIMITED_PROBLEM_MAX])
{
    enum delimited_status status;

    *table = (struct study_table){.key = STUDY_NO_COLUMN,
                                  .label = STUDY_NO_COLUMN,
                                  .subject = STUDY_NO_COLUMN,
                                  .time = STUDY_NO_COLUMN,
                                  .side = STUDY_NO_COLUMN,
                                  .mirror = STUDY_NO_COLUMN};
    status = delimited_read(text, size, &table->cells, problem);
    return status == DELIMITED_OK && !read_head(table, key, problem) ? DELIMITED_WRONG : status;
}

void study_table_clear(struct study_table *table)
{
    delimited_clear(&table->cells);
}

const char *study_table_key(const struct study_table *table, size_t row)
{
    return delimited_cell(&table->cells, row, table->key);
}

/* ---- Warnings -------------------------------------------------------------------------------- */

/* The first different texts among the numbers of a column, quoted; cells gets all of these. */
static void quote_strays(const struct study_table *table, size_t column, json_t *cells, char *text,
                         size_t size)
{
    size_t length = 0, more = 0;

    text[0] = '\0';
    for (size_t i = table->strays[column].row; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);
        bool told = says_nothing(cell) || is_number(cell, '.') || is_number(cell, ',');

        for (size_t k = 0; k < json_array_size(cells) && !told; k++) {
            told = strcmp(json_string_value(json_array_get(cells, k)), cell) == 0;
        }
        if (!told && json_array_size(cells) == STRAYS_SHOWN) {
            more = 1;
        } else if (!told) {
            (void)snprintf(text + length, size - length, "%s\"%.40s\"", length ? ", " : "", cell);
            length = strlen(text);
            (void)json_array_append_new(cells, json_string(cell));
        }
    }
    (void)snprintf(text + length, size - length, "%s", more ? " and others" : "");
}

static void warn_of_strays(const struct study_table *table, size_t column, json_t *warnings)
{
    const struct study_strays *strays = &table->strays[column];
    const char *name = table->cells.cells[column];
    unsigned line = table->cells.lines[strays->row + 1];
    json_t *cells = json_array(), *figures;
    char quoted[64 * STRAYS_SHOWN];

    quote_strays(table, column, cells, quoted, sizeof quoted);
    figures =
        json_pack("{s:s, s:I, s:s, s:o, s:I, s:I}", "column", name, "line", (json_int_t)line,
                  "cell", delimited_cell(&table->cells, strays->row, column), "cells", cells,
                  "numbers", (json_int_t)strays->numbers, "others", (json_int_t)strays->others);
    if (strays->numbers == 0) {
        warning_add(warnings, "column-is-text", figures,
                    "Column %.80s is read as text, since its numbers are written as no number is "
                    "read: %s, line %u first. Write them with digits and one decimal mark alone.",
                    name, quoted, line);
        return;
    }
    warning_add(warnings, "column-is-text", figures,
                "Column %.80s is read as text, since %zu of its cells %s no number%s: %s, line %u "
                "first. Its other %zu cells are numbers. Correct %s, or leave cells empty or NA "
                "where nothing is known.",
                name, strays->others, strays->others == 1 ? "is" : "are", plural(strays->others),
                quoted, line, strays->numbers, strays->others == 1 ? "it" : "them");
}

/* A column of texts: those that may be meant to be the same, and numbers with their unit behind.
   A label says nothing where its cell is empty alone. */
static void warn_of_texts(const struct study_table *table, size_t column, json_t *warnings)
{
    const char *name = table->cells.cells[column], *unit;
    json_t *collection = json_object(), *texts = json_array(), *found;
    char quoted[400];

    for (size_t i = 0; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);

        if (!says_nothing(cell)) {
            alike_add(collection, cell);
            (void)json_array_append_new(texts, json_string(cell));
        }
    }
    found = alike_found(collection);
    alike_warn(warnings, name, found);
    unit = column == table->label || table->strays[column].others > 0 ? NULL : alike_unit(texts);
    if (unit) {
        alike_quote(texts, quoted, sizeof quoted);
        warning_add(warnings, "column-is-text",
                    json_pack("{s:s, s:I, s:O, s:s, s:i, s:I}", "column", name, "line",
                              (json_int_t)table->cells.lines[1], "cell", json_array_get(texts, 0),
                              "unit", unit, "numbers", 0, "others",
                              (json_int_t)json_array_size(texts)),
                    "Column %.80s is read as text, since the unit \"%.20s\" stands behind its "
                    "numbers: %s. Give numbers alone for it to count as one.",
                    name, unit, quoted);
    }
    json_decref(found);
    json_decref(texts);
    json_decref(collection);
}

void study_table_warn(const struct study_table *table, json_t *warnings)
{
    for (size_t i = 0; i < table->cells.columns; i++) {
        bool named = table->cells.cells[i][0] && i != table->key && i != table->subject;

        if (named && (i == table->label || table->kinds[i] == STUDY_TEXT) && i != table->side &&
            i != table->mirror) {
            warn_of_texts(table, i, warnings);
        }
    }
    for (size_t i = 0; i < table->cells.columns; i++) {
        if (table->strays[i].others > 0 && !is_text_column(table, i)) {
            warn_of_strays(table, i, warnings);
        }
    }
    if (table->label == STUDY_NO_COLUMN) {
        warning_add(warnings, "no-label-column", NULL,
                    "The table has no column \"label\": the members have no labels, which "
                    "classify and compare-groups need. Name the column of groups so, or give them "
                    "later by PATCH or PUT of the cohort.");
    }
}

static json_int_t count_missing(const struct study_table *table, size_t column)
{
    json_int_t n = 0;

    for (size_t i = 0; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);

        n += is_text_column(table, column) ? !cell[0] : says_nothing(cell);
    }
    return n;
}

json_t *study_table_columns(const struct study_table *table)
{
    static const char *const kinds[] = {"empty", "text", "number", "number", "boolean"};
    json_t *columns = json_array();

    for (size_t i = 0; i < table->cells.columns; i++) {
        const char *name = table->cells.cells[i];

        if (name[0]) {
            (void)json_array_append_new(
                columns, json_pack("{s:s, s:s, s:I}", "name", name, "kind",
                                   is_text_column(table, i) ? "text" : kinds[table->kinds[i]],
                                   "missing", count_missing(table, i)));
        }
    }
    return columns;
}

/* ---- Rows ------------------------------------------------------------------------------------ */

static json_t *number_of(const char *cell, bool comma)
{
    char copy[NUMBER_MAX];
    double value = read_number(cell, comma, copy);

    if (strlen(copy) < 16 && !strpbrk(copy, ".eE")) {
        return json_integer(strtoll(copy, NULL, 10));
    }
    return json_real(value + 0.0);
}

/* The cell as its column is read (new reference); NULL where it says nothing. */
static json_t *value_of(const struct study_table *table, size_t row, size_t column)
{
    const char *cell = delimited_cell(&table->cells, row, column);

    if (says_nothing(cell)) {
        return NULL;
    }
    switch (table->kinds[column]) {
    case STUDY_NUMBER:
        return number_of(cell, false);
    case STUDY_COMMA_NUMBER:
        return number_of(cell, true);
    case STUDY_BOOLEAN:
        return json_boolean(strcasecmp(cell, "true") == 0);
    case STUDY_EMPTY:
    case STUDY_TEXT:
        break;
    }
    return json_string(cell);
}

/* The cell of a column that must have numbers or booleans: read by itself where others make the
   column a text, so that only these are refused (new reference); NULL where it says nothing. */
static json_t *strict_value_of(const struct study_table *table, size_t row, size_t column)
{
    const char *cell = column == STUDY_NO_COLUMN ? "" : delimited_cell(&table->cells, row, column);
    bool comma = table->cells.separator != ',' && !is_number(cell, '.');
    char copy[NUMBER_MAX];

    if (says_nothing(cell) || table->kinds[column] != STUDY_TEXT) {
        return column == STUDY_NO_COLUMN ? NULL : value_of(table, row, column);
    }
    if (is_boolean(cell)) {
        return json_boolean(strcasecmp(cell, "true") == 0);
    }
    return is_number(cell, comma ? ',' : '.') && isfinite(read_number(cell, comma, copy))
               ? number_of(cell, comma)
               : json_string(cell);
}

static void set_strictly(json_t *member, const char *name, json_t *value)
{
    if (value) {
        (void)json_object_set_new(member, name, value);
    }
}

/* The text of a cell that is one whatever it looks like, or NULL. */
static const char *text_of(const struct study_table *table, size_t row, size_t column)
{
    const char *cell = column == STUDY_NO_COLUMN ? "" : delimited_cell(&table->cells, row, column);

    return cell[0] ? cell : NULL;
}

/* "left" and "right", as people write them. */
static const char *side_of(const char *text)
{
    static const char *const names[][2] = {{"l", "left"},  {"lh", "left"},  {"left", "left"},
                                           {"r", "right"}, {"rh", "right"}, {"right", "right"}};

    for (size_t i = 0; text && i < sizeof names / sizeof names[0]; i++) {
        if (strcasecmp(text, names[i][0]) == 0) {
            return names[i][1];
        }
    }
    return text;
}

static void set_text(json_t *member, const char *name, const char *text)
{
    if (text) {
        (void)json_object_set_new(member, name, json_string(text));
    }
}

static json_t *covariates_of(const struct study_table *table, size_t row)
{
    const size_t placed[] = {table->key,  table->label, table->subject,
                             table->time, table->side,  table->mirror};
    json_t *covariates = json_object();

    for (size_t i = 0; i < table->cells.columns; i++) {
        bool other = table->cells.cells[i][0] != '\0';
        json_t *value;

        for (size_t k = 0; k < sizeof placed / sizeof placed[0]; k++) {
            other = other && placed[k] != i;
        }
        value = other ? value_of(table, row, i) : NULL;
        if (value) {
            (void)json_object_set_new(covariates, table->cells.cells[i], value);
        }
    }
    return covariates;
}

json_t *study_table_member(const struct study_table *table, size_t row, const char *id,
                           struct problem_list *list)
{
    json_t *given = json_object(), *member;
    const char *side = text_of(table, row, table->side);

    set_text(given, "id", id);
    set_text(given, "label", text_of(table, row, table->label));
    set_text(given, "subject", text_of(table, row, table->subject));
    set_text(given, "side", says_nothing(side ? side : "") ? NULL : side_of(side));
    set_strictly(given, "time", strict_value_of(table, row, table->time));
    set_strictly(given, "mirror", strict_value_of(table, row, table->mirror));
    (void)json_object_set_new(given, "covariates", covariates_of(table, row));
    member = cohort_read_member(given, "", list);
    json_decref(given);
    return member;
}
