/*
 * dates.h - numbers that are dates, as 20210304 and 202103 are.
 */
#ifndef SRNFD_TOOLKIT_DATES_H
#define SRNFD_TOOLKIT_DATES_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* Warns (covariate-is-date) where all of n numbers, not all the same, are days YYYYMMDD of the
   years 1900 to 2100, or months YYYYMM of these; returns whether it does. name: the covariate's. */
bool dates_warn(const char *name, size_t n, const double *values, json_t *warnings);

#endif
