/*
 * numerals.h - how spreadsheets and people write numbers, beyond those that a table is read with.
 */
#ifndef SRNFD_API_NUMERALS_H
#define SRNFD_API_NUMERALS_H

#include <stdbool.h>

/* Whether a number with this mark can as well have it between thousands, as 1.200 and 12,345,678
   can, but not 0.125 and 1.25. */
bool numeral_is_grouped(const char *cell, char mark);

/* Whether the cell is most likely meant to be a number, whatever it lacks to be read as one: with
   thousands apart (1.234,5), percent, a bound (<5), or the minus and the narrow spaces of print. */
bool numeral_is_styled(const char *cell);

#endif
