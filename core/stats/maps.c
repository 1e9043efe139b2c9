/*
 * maps.c - maps of a local statistic with their p-values by permutation: how compare.c and
 * regress.c come from counts to p, corrected for all points and by false discovery rate. The
 * methods and their sources are in compare.c.
 */
#include "maps.h"

#include <math.h>
#include <stdlib.h>

/* A covariance whose pivot falls below this part of its trace is singular: nothing moves there, or
   only in a plane, and the point is given no statistic. */
#define SINGULAR 1e-12

double stats_quadratic_form(const double e[6], const double b[3])
{
    double floor = SINGULAR * (e[0] + e[3] + e[5]);
    double a = e[0];
    double l10;
    double l20;
    double p;
    double l21;
    double q;
    double x1;
    double x2;

    if (!(a > floor)) {
        return 0.0;
    }
    l10 = e[1] / a;
    l20 = e[2] / a;
    p = e[3] - l10 * e[1];
    if (!(p > floor)) {
        return 0.0;
    }
    l21 = (e[4] - l10 * e[2]) / p;
    q = e[5] - l20 * e[2] - l21 * l21 * p;
    if (!(q > floor)) {
        return 0.0;
    }
    x1 = b[1] - l10 * b[0];
    x2 = b[2] - l20 * b[0] - l21 * x1;
    return b[0] * b[0] / a + x1 * x1 / p + x2 * x2 / q;
}

/* How many of the m sorted values are as large as the observed one. */
static size_t count_as_large(size_t m, const double *sorted, double observed)
{
    size_t low = 0;
    size_t high = m;

    while (low < high) {
        size_t middle = low + (high - low) / 2;

        if (stats_as_large(sorted[middle], observed)) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return m - low;
}

struct ranked {
    double p, area;
    size_t node;
};

static int compare_ranked(const void *a, const void *b)
{
    const struct ranked *x = a;
    const struct ranked *y = b;

    if (x->p != y->p) {
        return x->p < y->p ? -1 : 1;
    }
    return (x->node > y->node) - (x->node < y->node);
}

/* The step-up procedure as adjusted p: the least over larger p of p / (share of area up to it). */
static int control_discoveries(const struct stats_map *map)
{
    struct ranked *ranked = srnf_alloc(map->points, sizeof *ranked);
    double area = 0.0;
    double least = 1.0;

    if (!ranked) {
        return SRNF_ENOMEM;
    }
    for (size_t p = 0; p < map->points; p++) {
        ranked[p] = (struct ranked){map->p[p], map->root[p] * map->root[p], p};
        area += ranked[p].area;
    }
    qsort(ranked, map->points, sizeof *ranked, compare_ranked);
    for (size_t k = map->points; k-- > 0;) {
        if (area > 0.0) {
            least = fmin(least, ranked[k].p / fmin(area, 1.0));
        }
        area -= ranked[k].area;
        map->fdr[ranked[k].node] = least;
    }
    srnf_free(ranked);
    return SRNF_OK;
}

int stats_map_conclude(const struct stats_map *map, size_t m, double *largest,
                       const atomic_uint *count, double *max_p)
{
    double all = 1.0 + (double)m;

    stats_sort(m, largest + 1);
    *max_p = (1.0 + (double)count_as_large(m, largest + 1, largest[0])) / all;
    for (size_t p = 0; p < map->points; p++) {
        size_t above = count_as_large(m, largest + 1, map->statistic[p]);

        map->p[p] = (1.0 + (double)atomic_load(&count[p])) / all;
        map->significance[p] = (1.0 + (double)above) / all;
    }
    return control_discoveries(map);
}
