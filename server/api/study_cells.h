/*
 * study_cells.h - what a cell of the table of a study can be read as.
 */
#ifndef SRNFD_API_STUDY_CELLS_H
#define SRNFD_API_STUDY_CELLS_H

#include "api/study_table.h"

#define STUDY_NUMBER_MAX 64 /* bytes of the longest number that is read */

/* Empty, NA, N/A or NaN. */
bool study_cell_is_empty(const char *cell);
/* [+-]digits[mark digits][e[+-]digits] and nothing else. */
bool study_cell_is_number(const char *cell, char mark);
bool study_cell_is_boolean(const char *cell);
/* A cell that is a number, as C writes it; returns its value. */
double study_cell_number(const char *cell, bool comma, char copy[STUDY_NUMBER_MAX]);
/* Whether the column is a text whatever its cells look like. */
bool study_table_is_text(const struct study_table *table, size_t column);

#endif
