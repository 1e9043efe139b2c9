/*
 * study_table.c - reading the table of a study.
 *
 * A column is read as a whole: 1 and 2 among words are words, and a subject 007 keeps its zeros. A
 * comma within a number is a decimal comma where cells are separated by semicolons or tabs, as
 * spreadsheets in most of Europe write them. Between commas, in quotes, "1,234" can be either of
 * two numbers, and is refused; so is a column with points in some cells and commas in others, and
 * one of 1.200 beside one of 1,5.
 */
#include "api/study_cells.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "api/cohorts.h"
#include "api/numerals.h"

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

        if (!study_cell_is_number(cell, '.') && !study_cell_is_number(cell, ',')) {
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

        if (study_cell_is_empty(cell)) {
            continue;
        }
        said++;
        booleans += study_cell_is_boolean(cell);
        if (study_cell_is_number(cell, '.')) {
            whole += study_cell_is_number(cell, ',');
            points += !study_cell_is_number(cell, ',');
        } else if (study_cell_is_number(cell, ',')) {
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
        char copy[STUDY_NUMBER_MAX];

        if (!study_cell_is_empty(cell) &&
            !isfinite(study_cell_number(cell, kind == STUDY_COMMA_NUMBER, copy))) {
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

/* No column has the key: names those that there are, and one that begins or ends as it ("filename",
   "mesh_id") and has no meaning of its own. */
static bool refuse_keyless(struct study_table *table, const char *key,
                           char problem[DELIMITED_PROBLEM_MAX])
{
    json_t *names = json_object();
    const char *likely = NULL;
    size_t length = strlen(key);
    char there[88], rename[64] = "";

    for (size_t i = 0; i < table->cells.columns; i++) {
        const char *name = table->cells.cells[i];
        size_t own = strlen(name);

        if (!likely && own > length && !place_of(table, name, key) &&
            (strncasecmp(name, key, length) == 0 || strcasecmp(name + own - length, key) == 0)) {
            likely = name;
        }
        (void)json_object_set_new(names, name, json_null());
    }
    cohort_list_names(names, there, sizeof there);
    json_decref(names);
    if (likely) {
        (void)snprintf(rename, sizeof rename, ": rename \"%.30s\" if it is that one", likely);
    }
    return wrong(problem, "it has no column \"%s\"; its first line has %s%s", key, there, rename);
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
        if (!study_table_is_text(table, i) &&
            (!judge_column(table, i, problem) || !check_numbers(table, i, problem))) {
            return false;
        }
    }
    if (table->key == STUDY_NO_COLUMN) {
        return refuse_keyless(table, key, problem);
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
