/*
 * tabulated_fields.c - step fields on a table, and the transpose.
 *
 * In the frame of a node w = (phi_theta - psi_phi) e_theta + (phi_phi + psi_theta) e_phi and div w
 * = -sum l (l + 1) phi_lm Y_lm. The components that are tabulated, w's three in R^3 and the
 * divergence, are smooth at the poles.
 */
#include "tabulated.h"

#include <math.h>
#include <string.h>

#define FRAME ((size_t)5) /* e_theta, and x and y of e_phi */

static void place_frames(struct tabulated_fields *f)
{
    const struct sphere_spline *s = &f->table;
    size_t n = s->columns;

    for (size_t k = 0; k < n; k++) {
        double phi = SRNF_PI * (double)k / (double)s->rows;

        f->frames[FRAME * k + 3] = -sin(phi);
        f->frames[FRAME * k + 4] = cos(phi);
    }
    for (size_t row = 0; row <= s->rows; row++) {
        double theta = SRNF_PI * (double)row / (double)s->rows;
        double c = cos(theta);
        double sine = sin(theta);

        for (size_t k = 0; k < n; k++) {
            const double *first = f->frames + FRAME * k;
            double *frame = f->frames + FRAME * (row * n + k);

            frame[0] = c * first[4];
            frame[1] = -c * first[3];
            frame[2] = -sine;
            frame[3] = first[3];
            frame[4] = first[4];
        }
    }
    for (size_t l = 1; l <= f->degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            f->scale[i] = 1.0 / sqrt((double)(l * (l + 1)));
        }
    }
}

int tabulated_fields_create(struct tabulated_fields *f, size_t degree, size_t order, size_t rows)
{
    size_t count = srnf_coefficient_count(degree);
    size_t n = (rows + 1) * 2 * rows;
    int status = srnf_sht_create(&f->sht, degree, SRNF_GRID_EQUIANGULAR, rows + 1, 2 * rows);

    f->degree = degree;
    f->count = count;
    f->table = (struct sphere_spline){0};
    status = status ? status : sphere_spline_create(&f->table, order, rows);
    f->memory = srnf_alloc((FRAME + 5) * n + 5 * count, sizeof(double));
    f->workspace = status ? NULL : srnf_alloc(1, srnf_sht_workspace_size(f->sht, 2));
    if (status || !f->memory || !f->workspace) {
        tabulated_fields_clear(f);
        return status ? status : SRNF_ENOMEM;
    }
    f->frames = f->memory;
    f->gradients = f->frames + FRAME * n;
    f->divergence = f->gradients + 4 * n;
    f->scale = f->divergence + n;
    f->moments = f->scale + count;
    place_frames(f);
    return SRNF_OK;
}

void tabulated_fields_clear(struct tabulated_fields *f)
{
    srnf_sht_destroy(f->sht);
    sphere_spline_clear(&f->table);
    srnf_free(f->memory);
    srnf_free(f->workspace);
    *f = (struct tabulated_fields){0};
}

/* gradients: [2][phi, psi][n], along e_theta and e_phi. */
SRNF_HOT static void to_nodes(struct tabulated_fields *f)
{
    struct sphere_spline *s = &f->table;
    size_t n = (s->rows + 1) * s->columns;
    const double *a = f->gradients;
    const double *b = f->gradients + 2 * n;

    for (size_t row = 0, i = 0; row <= s->rows; row++) {
        double *node = sphere_spline_node(s, row, 0);

        for (size_t k = 0; k < s->columns; k++, i++, node += SPLINE_WIDTH) {
            const double *e = f->frames + FRAME * i;
            double along = a[i] - b[n + i];
            double across = b[i] + a[n + i];

            node[0] = along * e[0] + across * e[3];
            node[1] = along * e[1] + across * e[4];
            node[2] = along * e[2];
            node[3] = 0.0; /* no step asks for the divergence */
        }
    }
}

void tabulated_fields_fill(struct tabulated_fields *f, const double *potentials)
{
    size_t n = (f->table.rows + 1) * f->table.columns;

    srnf_sht_gradient(f->sht, 2, potentials, f->gradients, f->gradients + 2 * n, f->workspace);
    to_nodes(f);
    sphere_spline_filter(&f->table);
}

SRNF_HOT static void from_nodes(struct tabulated_fields *f)
{
    const struct sphere_spline *s = &f->table;
    size_t n = (s->rows + 1) * s->columns;
    double *a = f->gradients;
    double *b = f->gradients + 2 * n;

    for (size_t row = 0, i = 0; row <= s->rows; row++) {
        const double *node = sphere_spline_node(s, row, 0);

        for (size_t k = 0; k < s->columns; k++, i++, node += SPLINE_WIDTH) {
            const double *e = f->frames + FRAME * i;
            double along = node[0] * e[0] + node[1] * e[1] + node[2] * e[2];
            double across = node[0] * e[3] + node[1] * e[4];

            a[i] = along;
            b[i] = across;
            a[n + i] = across;
            b[n + i] = -along;
            f->divergence[i] = node[3];
        }
    }
}

void tabulated_fields_transpose(struct tabulated_fields *f, const double torque[3], double *rhs)
{
    size_t n = (f->table.rows + 1) * f->table.columns;
    size_t each = f->count - 1;
    double *divergence = f->moments + 2 * f->count;

    sphere_spline_fold(&f->table);
    from_nodes(f);
    srnf_sht_gradient_adjoint(f->sht, 2, f->gradients, f->gradients + 2 * n, f->moments,
                              f->workspace);
    srnf_sht_synthesis_adjoint(f->sht, 1, f->divergence, divergence, f->workspace);
    for (size_t l = 1; l <= f->degree; l++) {
        double eigen = (double)(l * (l + 1));

        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            rhs[i - 1] = f->scale[i] * (f->moments[i] - eigen * divergence[i]);
            rhs[each + i - 1] = f->scale[i] * f->moments[f->count + i];
        }
    }
    memcpy(rhs + 2 * each, torque, 3 * sizeof *torque);
}

void tabulated_fields_potentials(const struct tabulated_fields *f, const double *step,
                                 double *potentials)
{
    size_t each = f->count - 1;

    potentials[0] = potentials[f->count] = 0.0;
    for (size_t i = 1; i < f->count; i++) {
        potentials[i] = f->scale[i] * step[i - 1];
        potentials[f->count + i] = f->scale[i] * step[each + i - 1];
    }
}
