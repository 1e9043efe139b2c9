/*
 * study_warnings.c - what is doubtful in the table of a study, and what its columns are read as.
 */
#include <stdio.h>
#include <string.h>

#include "api/alike.h"
#include "api/near.h"
#include "api/study_cells.h"
#include "api/warnings.h"
#include "text.h"

#define STRAYS_SHOWN 3 /* different texts among numbers that a warning quotes */

/* The first different texts among the numbers of a column, quoted; cells gets all of these. */
static void quote_strays(const struct study_table *table, size_t column, json_t *cells, char *text,
                         size_t size)
{
    size_t length = 0, more = 0;

    text[0] = '\0';
    for (size_t i = table->strays[column].row; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);
        bool told = study_cell_is_empty(cell) || study_cell_is_number(cell, '.') ||
                    study_cell_is_number(cell, ',');

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

        if (!study_cell_is_empty(cell)) {
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

static void warn_of_subjects(const struct study_table *table, json_t *warnings)
{
    json_t *collection = json_object();

    for (size_t i = 0; i < table->cells.rows && table->subject != STUDY_NO_COLUMN; i++) {
        const char *cell = delimited_cell(&table->cells, i, table->subject);

        if (!study_cell_is_empty(cell)) {
            alike_add_subject(collection, cell);
        }
    }
    alike_warn_subjects(warnings, collection);
    json_decref(collection);
}

/* No column "label": with the covariate that was most likely meant to be it. */
static void warn_unlabelled(const struct study_table *table, json_t *warnings)
{
    const char *names[DELIMITED_COLUMNS_MAX + 1] = {NULL}, *meant;
    char hint[140] = "";
    size_t n = 0;

    for (size_t i = 0; i < table->cells.columns; i++) {
        if (i != table->key && i != table->subject && i != table->time && i != table->side &&
            i != table->mirror && table->cells.cells[i][0]) {
            names[n++] = table->cells.cells[i];
        }
    }
    meant = near_name("label", names);
    if (meant) {
        (void)snprintf(hint, sizeof hint, " (did you mean \"%.80s\" to be it?)", meant);
    }
    warning_add(warnings, "no-label-column", meant ? json_pack("{s:s}", "column", meant) : NULL,
                "The table has no column \"label\"%s: the members have no labels, which "
                "classify and compare-groups need. Name the column of groups so, or give them "
                "later by PATCH or PUT of the cohort.",
                hint);
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
    warn_of_subjects(table, warnings);
    for (size_t i = 0; i < table->cells.columns; i++) {
        if (table->strays[i].others > 0 && !study_table_is_text(table, i)) {
            warn_of_strays(table, i, warnings);
        }
    }
    if (table->label == STUDY_NO_COLUMN) {
        warn_unlabelled(table, warnings);
    }
}

static json_int_t count_missing(const struct study_table *table, size_t column)
{
    json_int_t n = 0;

    for (size_t i = 0; i < table->cells.rows; i++) {
        const char *cell = delimited_cell(&table->cells, i, column);

        n += study_table_is_text(table, column) ? !cell[0] : study_cell_is_empty(cell);
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
                                   study_table_is_text(table, i) ? "text" : kinds[table->kinds[i]],
                                   "missing", count_missing(table, i)));
        }
    }
    return columns;
}
