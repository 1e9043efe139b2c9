/*
 * libsharp.c - libsharp on our grids and our coefficients; the mapping is derived in libsharp.h.
 */
#include "support/libsharp.h"

#include <math.h>
#include <stdlib.h>

static void *must(void *pointer)
{
    if (!pointer) {
        abort();
    }
    return pointer;
}

/* Index of a_lm. */
static size_t place(size_t degree, size_t l, size_t m)
{
    return m * (2 * degree + 1 - m) / 2 + l;
}

void libsharp_open(struct libsharp *sharp, size_t degree, const struct srnf_grid *grid,
                   bool weighted)
{
    size_t rows = grid->n_theta;
    ptrdiff_t *start = must(calloc(degree + 1, sizeof *start));
    ptrdiff_t *offset = must(calloc(rows, sizeof *offset));
    int *columns = must(calloc(rows, sizeof *columns));
    int *stride = must(calloc(rows, sizeof *stride));
    double *phi0 = must(calloc(rows, sizeof *phi0));

    for (size_t m = 0; m <= degree; m++) {
        start[m] = (ptrdiff_t)place(degree, 0, m);
    }
    for (size_t row = 0; row < rows; row++) {
        offset[row] = (ptrdiff_t)(row * grid->n_phi);
        columns[row] = (int)grid->n_phi;
        stride[row] = 1;
    }
    sharp_make_alm_info((int)degree, (int)degree, 1, start, &sharp->layout);
    sharp_make_geom_info((int)rows, columns, offset, stride, phi0, grid->theta,
                         weighted ? grid->weight : NULL, &sharp->geometry);
    sharp->degree = degree;
    sharp->a = must(calloc((degree + 1) * (degree + 2), sizeof(double)));
    free(start);
    free(offset);
    free(columns);
    free(stride);
    free(phi0);
}

void libsharp_close(struct libsharp *sharp)
{
    sharp_destroy_alm_info(sharp->layout);
    sharp_destroy_geom_info(sharp->geometry);
    free(sharp->a);
}

void libsharp_from_coefficients(struct libsharp *sharp, const double *c)
{
    for (size_t m = 0; m <= sharp->degree; m++) {
        double factor = m == 0 ? 1.0 : (m % 2 == 0 ? sqrt(0.5) : -sqrt(0.5));

        for (size_t l = m; l <= sharp->degree; l++) {
            double *a = sharp->a + 2 * place(sharp->degree, l, m);

            a[0] = factor * c[l * l + l + m];
            a[1] = m == 0 ? 0.0 : -factor * c[l * l + l - m];
        }
    }
}

void libsharp_to_coefficients(const struct libsharp *sharp, double *c)
{
    for (size_t m = 0; m <= sharp->degree; m++) {
        double factor = m == 0 ? 1.0 : (m % 2 == 0 ? sqrt(2.0) : -sqrt(2.0));

        for (size_t l = m; l <= sharp->degree; l++) {
            const double *a = sharp->a + 2 * place(sharp->degree, l, m);

            c[l * l + l + m] = factor * a[0];
            if (m > 0) {
                c[l * l + l - m] = -factor * a[1];
            }
        }
    }
}

void libsharp_run(const struct libsharp *sharp, sharp_jobtype job, double *first, double *second)
{
    void *a[1] = {sharp->a};
    void *fields[2] = {first, second};

    sharp_execute(job, job == SHARP_ALM2MAP_DERIV1 ? 1 : 0, a, fields, sharp->geometry,
                  sharp->layout, SHARP_DP | SHARP_NO_OPENMP, NULL, NULL);
}
