/*
 * study_cells.c - what a cell of the table of a study can be read as.
 */
#include "api/study_cells.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool study_cell_is_empty(const char *cell)
{
    return !cell[0] || strcasecmp(cell, "NA") == 0 || strcasecmp(cell, "N/A") == 0 ||
           strcasecmp(cell, "NaN") == 0;
}

bool study_cell_is_number(const char *cell, char mark)
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
    return digits > 0 && !*at && strlen(cell) < STUDY_NUMBER_MAX;
}

bool study_cell_is_boolean(const char *cell)
{
    return strcasecmp(cell, "true") == 0 || strcasecmp(cell, "false") == 0;
}

double study_cell_number(const char *cell, bool comma, char copy[STUDY_NUMBER_MAX])
{
    (void)snprintf(copy, STUDY_NUMBER_MAX, "%s", cell);
    if (comma && strchr(copy, ',')) {
        *strchr(copy, ',') = '.';
    }
    return strtod(copy, NULL);
}

bool study_table_is_text(const struct study_table *table, size_t column)
{
    return column == table->key || column == table->label || column == table->subject ||
           column == table->side;
}
