/*
 * study_table.h - the table of a study: one row for each member of a cohort, columns for what is
 * known of it.
 */
#ifndef SRNFD_API_STUDY_TABLE_H
#define SRNFD_API_STUDY_TABLE_H

#include "api/delimited.h"
#include "api/handler.h"

/* What the cells of a column are read as. */
enum study_kind { STUDY_EMPTY, STUDY_TEXT, STUDY_NUMBER, STUDY_COMMA_NUMBER, STUDY_BOOLEAN };

#define STUDY_NO_COLUMN SIZE_MAX

/* Of a column that is text because of few cells: the others are numbers. */
struct study_strays {
    size_t numbers, others; /* cells; others 0: it is none of these */
    size_t row;             /* of the first of the others */
};

struct study_table {
    struct delimited cells;
    size_t key;                                   /* the column of files or ids */
    size_t label, subject, time, side, mirror;    /* columns, or STUDY_NO_COLUMN */
    enum study_kind kinds[DELIMITED_COLUMNS_MAX]; /* of each column that is a covariate, or time */
    struct study_strays strays[DELIMITED_COLUMNS_MAX];
};

/*
 * Reads a table whose column `key` ("file", "id") names what each row is about. The columns label,
 * subject, time, side and mirror have their meaning, and all others are covariates: true or false,
 * numbers or texts, as all cells of the column can be read. An empty cell, NA, N/A and NaN say
 * nothing. Decimal commas are read where the separator is none. Names of columns are compared
 * without regard to case; a column without a name must be empty.
 *   problem [out] a sentence about what is wrong, where the status is DELIMITED_WRONG
 * The table is to be cleared in any case.
 */
enum delimited_status study_table_read(const void *text, size_t size, const char *key,
                                       struct study_table *table,
                                       char problem[DELIMITED_PROBLEM_MAX]);
void study_table_clear(struct study_table *table);

/* Adds warnings to the array: of covariates that are text because of few cells or of a unit
   (column-is-text), of texts that may be meant to be the same (labels-alike, subjects-alike),
   and of a table without labels (no-label-column). */
void study_table_warn(const struct study_table *table, json_t *warnings);
/* The columns with what their cells are read as, and how many say nothing:
   [{"name", "kind", "missing"}] (new reference). */
json_t *study_table_columns(const struct study_table *table);
/* What a row says of a member with this id, in its canonical spelling (new reference); what is
   wrong with it goes into the list, with pointers that name columns. */
json_t *study_table_member(const struct study_table *table, size_t row, const char *id,
                           struct problem_list *list);
/* The key of a row. */
const char *study_table_key(const struct study_table *table, size_t row);

#endif
