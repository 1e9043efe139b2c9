/*
 * fixture.h - what the tests of core/harmonics share: transforms on many grids, buffers that betray
 * what was not written, and comparison of arrays.
 *
 * The workspace of a fixture starts as NaN and ends in a strip that must stay untouched; closing it
 * checks that.
 */
#ifndef TESTS_SPHERE_FIXTURE_H
#define TESTS_SPHERE_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "internal.h"
#include "support/compare.h"
#include "support/random.h"

/* A grid for every degree: rows = a L + b, columns = c L + d; all zero: the working grid. */
struct grid_shape {
    const char *name;
    enum srnf_grid_kind kind;
    size_t rows_slope, rows_constant, columns_slope, columns_constant;
};

static const struct grid_shape grid_shapes[] = {
    {"working grid", SRNF_GRID_GAUSS_LEGENDRE, 0, 0, 0, 0},
    {"Gauss-Legendre, least", SRNF_GRID_GAUSS_LEGENDRE, 1, 1, 2, 1},
    {"Gauss-Legendre, one more", SRNF_GRID_GAUSS_LEGENDRE, 1, 2, 2, 2},
    {"Gauss-Legendre, fine, odd", SRNF_GRID_GAUSS_LEGENDRE, 2, 3, 3, 5},
    {"equiangular, least", SRNF_GRID_EQUIANGULAR, 2, 1, 2, 1},
    {"equiangular, even rows", SRNF_GRID_EQUIANGULAR, 2, 2, 3, 4},
};
#define GRID_SHAPES (sizeof grid_shapes / sizeof grid_shapes[0])

/* Fails with the numbers unless value <= bound; a NaN fails. */
#define assert_at_most(value, bound) fixture_at_most((value), (bound), #value, __FILE__, __LINE__)

static inline void fixture_at_most(double value, double bound, const char *what, const char *file,
                                   int line)
{
    if (!(value <= bound)) {
        print_error("%s:%d: %s is %.3g, above %.3g\n", file, line, what, value, bound);
        _fail(file, line);
    }
}

/* n doubles, all NaN: what a transform does not write stays one. Freed with srnf_free. */
static inline double *fixture_doubles(size_t n)
{
    double *memory = srnf_alloc(n, sizeof(double));

    assert_non_null(memory);
    for (size_t i = 0; i < n; i++) {
        memory[i] = NAN;
    }
    return memory;
}

static inline double *fixture_normals(struct test_random *random, size_t n)
{
    double *memory = fixture_doubles(n);

    test_random_normals(random, n, memory);
    return memory;
}

struct fixture {
    struct srnf_sht *sht;
    const struct srnf_grid *grid;
    size_t degree;
    size_t coefficients; /* (L + 1)^2 */
    size_t points;       /* n_theta n_phi */
    size_t workspace_size;
    unsigned char *workspace;
};

#define FIXTURE_STRIP ((size_t)4096)

static inline void fixture_open(struct fixture *fixture, size_t degree,
                                const struct grid_shape *shape)
{
    size_t rows = shape->rows_slope * degree + shape->rows_constant;
    size_t columns = shape->columns_slope * degree + shape->columns_constant;

    assert_int_equal(srnf_sht_create(&fixture->sht, degree, shape->kind, rows, columns), SRNF_OK);
    fixture->grid = srnf_sht_grid(fixture->sht);
    fixture->degree = degree;
    fixture->coefficients = srnf_coefficient_count(degree);
    fixture->points = fixture->grid->n_theta * fixture->grid->n_phi;
    fixture->workspace_size = srnf_sht_workspace_size(fixture->sht, 7);
    fixture->workspace = srnf_alloc(fixture->workspace_size + FIXTURE_STRIP, 1);
    assert_non_null(fixture->workspace);
    memset(fixture->workspace, 0xff, fixture->workspace_size + FIXTURE_STRIP);
}

static inline void fixture_close(struct fixture *fixture)
{
    for (size_t i = 0; i < FIXTURE_STRIP; i++) {
        assert_int_equal(fixture->workspace[fixture->workspace_size + i], 0xff);
    }
    srnf_free(fixture->workspace);
    srnf_sht_destroy(fixture->sht);
}

/* Unit vector of a node of the grid. */
static inline void fixture_node(const struct srnf_grid *grid, size_t row, size_t column,
                                double node[3])
{
    double phi = 2.0 * SRNF_PI * (double)column / (double)grid->n_phi;

    node[0] = grid->sin_theta[row] * cos(phi);
    node[1] = grid->sin_theta[row] * sin(phi);
    node[2] = grid->cos_theta[row];
}

/* e_theta and e_phi at a node. */
static inline void fixture_frame(const struct srnf_grid *grid, size_t row, size_t column,
                                 double e_theta[3], double e_phi[3])
{
    double phi = 2.0 * SRNF_PI * (double)column / (double)grid->n_phi;

    e_theta[0] = grid->cos_theta[row] * cos(phi);
    e_theta[1] = grid->cos_theta[row] * sin(phi);
    e_theta[2] = -grid->sin_theta[row];
    e_phi[0] = -sin(phi);
    e_phi[1] = cos(phi);
    e_phi[2] = 0.0;
}

static inline double fixture_dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Inner product in extended precision, so that a test sees the error of what it tests only. */
static inline double fixture_dot(size_t n, const double *a, const double *b)
{
    long double sum = 0.0L;

    for (size_t i = 0; i < n; i++) {
        sum += (long double)a[i] * (long double)b[i];
    }
    return (double)sum;
}

/* P_n(x) by its recurrence, in extended precision: the tests' own. */
static inline long double fixture_legendre(size_t n, long double x)
{
    long double before = 1.0L;
    long double current = x;

    if (n == 0) {
        return before;
    }
    for (size_t k = 2; k <= n; k++) {
        long double next =
            ((long double)(2 * k - 1) * x * current - (long double)(k - 1) * before) /
            (long double)k;

        before = current;
        current = next;
    }
    return current;
}

#endif
