/*
 * tabulated_moving.c - the table of a moving surface.
 *
 * One gradient transform on the table's nodes, a cross product, and the filter.
 */
#include "tabulated.h"

#include <math.h>
#include <string.h>

#define ROWS_MIN ((size_t)16)
#define BLOCK ((size_t)64) /* points that are sampled together */

/* Copies values [3][nodes] into the table. */
static void fill(struct sphere_spline *s, const double *values)
{
    size_t n = (s->rows + 1) * s->columns;

    for (size_t i = 0; i < n; i++) {
        double *node = sphere_spline_node(s, i / s->columns, i % s->columns);

        for (size_t c = 0; c < 3; c++) {
            node[c] = values[c * n + i];
        }
        node[3] = 0.0;
    }
    sphere_spline_filter(s);
}

/* d_theta <- d_theta x d_phi */
static void cross_all(size_t n, double *d_theta, const double *d_phi)
{
    for (size_t i = 0; i < n; i++) {
        const double a[3] = {d_theta[i], d_theta[n + i], d_theta[2 * n + i]};
        const double b[3] = {d_phi[i], d_phi[n + i], d_phi[2 * n + i]};
        double normal[3];

        vector_cross(a, b, normal);
        for (size_t c = 0; c < 3; c++) {
            d_theta[c * n + i] = normal[c];
        }
    }
}

size_t tabulated_moving_rows(size_t degree, double fineness)
{
    size_t rows = ((size_t)ceil(2.0 * fineness * (double)degree) + 3) / 4 * 4;

    return rows < ROWS_MIN ? ROWS_MIN : rows;
}

int tabulated_moving_create(struct tabulated_moving *m, enum srnf_representation representation,
                            size_t from_degree, const double *coefficients, size_t degree,
                            size_t order, double fineness, struct tabulated_tools *tools)
{
    size_t from = srnf_coefficient_count(from_degree);
    size_t count, rows, n;
    struct nodes_of nodes;
    struct srnf_sht *sht = NULL;
    double *memory = NULL;
    void *workspace = NULL;
    int status;

    degree = degree < from_degree ? degree : from_degree;
    count = srnf_coefficient_count(degree);
    rows = tabulated_moving_rows(degree, fineness);
    *m = (struct tabulated_moving){.representation = representation, .degree = degree};
    n = (rows + 1) * 2 * rows;
    nodes = (struct nodes_of){SRNF_GRID_EQUIANGULAR, rows + 1, 2 * rows};
    status = tools_transform(tools, degree, &nodes, &sht);
    status = status ? status : sphere_spline_create(&m->normal, order, rows);
    if (status == SRNF_OK && representation == SRNF_REPRESENTATION_SRM) {
        status = sphere_spline_create(&m->position, order, rows);
    }
    memory = srnf_alloc(6 * n + 3 * count, sizeof(double));
    workspace = sht ? srnf_alloc(1, srnf_sht_workspace_size(sht, 3)) : NULL;
    if (status == SRNF_OK && memory && workspace) {
        double *cut = memory + 6 * n;

        for (size_t c = 0; c < 3; c++) {
            memcpy(cut + c * count, coefficients + c * from, count * sizeof(double));
        }
        if (representation == SRNF_REPRESENTATION_SRM) {
            srnf_sht_synthesis(sht, 3, cut, memory, workspace);
            fill(&m->position, memory);
        }
        srnf_sht_gradient(sht, 3, cut, memory, memory + 3 * n, workspace);
        cross_all(n, memory, memory + 3 * n);
        fill(&m->normal, memory);
    } else {
        status = status ? status : SRNF_ENOMEM;
        tabulated_moving_clear(m);
    }
    srnf_free(workspace);
    srnf_free(memory);
    tools_return_transform(tools, sht);
    return status;
}

/* One of three components. */
static void interleave(size_t n, const double *values, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[3 * i] = values[i];
    }
}

void tabulated_sample(const struct tabulated_moving *m, const double *points, struct samples *out)
{
    double arrays[CLOUD_ARRAYS * BLOCK] = {0.0};
    struct cloud cloud = {.n = BLOCK};

    cloud_place(&cloud, BLOCK, arrays);
    for (size_t first = 0; first < out->n; first += BLOCK) {
        size_t n = out->n - first < BLOCK ? out->n - first : BLOCK;

        for (size_t i = 0; i < BLOCK; i++) {
            const double *p = points + 3 * (first + (i < n ? i : n - 1));
            double sine = sqrt(p[0] * p[0] + p[1] * p[1]);
            double cos_phi = sine > 0.0 ? p[0] / sine : 1.0;
            double sin_phi = sine > 0.0 ? p[1] / sine : 0.0;
            for (size_t c = 0; c < 3; c++) {
                cloud.point[c][i] = p[c];
            }
            if (i < n) {
                double *t1 = out->t1 + 3 * (first + i);
                double *t2 = out->t2 + 3 * (first + i);

                t1[0] = p[2] * cos_phi;
                t1[1] = p[2] * sin_phi;
                t1[2] = -sine;
                t2[0] = -sin_phi;
                t2[1] = cos_phi;
                t2[2] = 0.0;
            }
        }
        cloud_evaluate(m, &cloud);
        for (size_t c = 0; c < 3; c++) {
            interleave(n, cloud.q[c], out->q + 3 * first + c);
            interleave(n, cloud.q_1[c], out->q_1 + 3 * first + c);
            interleave(n, cloud.q_2[c], out->q_2 + 3 * first + c);
        }
    }
}

void tabulated_moving_clear(struct tabulated_moving *m)
{
    sphere_spline_clear(&m->normal);
    sphere_spline_clear(&m->position);
    sphere_spline_clear(&m->carried);
}
