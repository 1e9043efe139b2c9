/*
 * sort.c - numbers in order.
 */
#include "stats.h"

#include <stdlib.h>

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a;
    double y = *(const double *)b;

    return (x > y) - (x < y);
}

void stats_sort(size_t n, double *values)
{
    qsort(values, n, sizeof *values, compare_doubles);
}
