/*
 * study_rows.c - from rows of the table of a study to members of a cohort.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "api/cohorts.h"
#include "api/study_cells.h"

static json_t *number_of(const char *cell, bool comma)
{
    char copy[STUDY_NUMBER_MAX];
    double value = study_cell_number(cell, comma, copy);

    if (strlen(copy) < 16 && !strpbrk(copy, ".eE")) {
        return json_integer(strtoll(copy, NULL, 10));
    }
    return json_real(value + 0.0);
}

/* The cell as its column is read (new reference); NULL where it says nothing. */
static json_t *value_of(const struct study_table *table, size_t row, size_t column)
{
    const char *cell = delimited_cell(&table->cells, row, column);

    if (study_cell_is_empty(cell)) {
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
    bool comma = table->cells.separator != ',' && !study_cell_is_number(cell, '.');
    char copy[STUDY_NUMBER_MAX];

    if (study_cell_is_empty(cell) || table->kinds[column] != STUDY_TEXT) {
        return column == STUDY_NO_COLUMN ? NULL : value_of(table, row, column);
    }
    if (study_cell_is_boolean(cell)) {
        return json_boolean(strcasecmp(cell, "true") == 0);
    }
    return study_cell_is_number(cell, comma ? ',' : '.') &&
                   isfinite(study_cell_number(cell, comma, copy))
               ? number_of(cell, comma)
               : json_string(cell);
}

static void set_strictly(json_t *member, const char *name, json_t *value)
{
    if (value) {
        (void)json_object_set_new(member, name, value);
    }
}

/* Of a member of this table: true and false, also as 1 and 0. */
static void set_mirror(json_t *member, const struct study_table *table, size_t row,
                       struct problem_list *list)
{
    const char *cell =
        table->mirror == STUDY_NO_COLUMN ? "" : delimited_cell(&table->cells, row, table->mirror);

    if (study_cell_is_boolean(cell) || strcmp(cell, "1") == 0 || strcmp(cell, "0") == 0) {
        (void)json_object_set_new(member, "mirror",
                                  json_boolean(*cell == '1' || strcasecmp(cell, "true") == 0));
    } else if (!study_cell_is_empty(cell)) {
        problem_add(list, "/mirror", "must be true or false, or 1 or 0, not \"%.40s\"", cell);
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
    set_text(given, "side", study_cell_is_empty(side ? side : "") ? NULL : side_of(side));
    set_strictly(given, "time", strict_value_of(table, row, table->time));
    set_mirror(given, table, row, list);
    (void)json_object_set_new(given, "covariates", covariates_of(table, row));
    member = cohort_read_member(given, "", list);
    json_decref(given);
    return member;
}
