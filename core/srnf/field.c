/*
 * field.c - SRNF and square-root map of a surface, the differential of the former, the energy and
 * its derivative, and the closed-form inverse.
 *
 * Closed form (the paper, Eq. 9): for f = c + r e with r > 0 one has <q, e> = r^2 / |n|^(1/2) and
 * |q|^2 = |n|, hence r = sqrt(|q| <q, e>), without a derivative.
 *
 * Workspace, in doubles: the transform's, then 15 fields of one double a point.
 */
#include "linear/linear.h"
#include "field.h"

#include <math.h>

#define WORK_FIELDS ((size_t)23)

struct field_work {
    void *transform;
    double *f_theta, *f_phi, *unit, *root, *inverse, *weight, *w_theta, *w_phi, *field;
};

static size_t points_of(const struct srnf_sht *sht)
{
    return srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
}

/* Rounded up so that every part stays aligned to 64 bytes. */
static size_t transform_doubles(const struct srnf_sht *sht)
{
    return (srnf_sht_workspace_size(sht, 3) / sizeof(double) + 7) / 8 * 8;
}

size_t srnf_surface_workspace_size(const struct srnf_sht *sht)
{
    return (transform_doubles(sht) + WORK_FIELDS * points_of(sht)) * sizeof(double);
}

static struct field_work split(const struct srnf_sht *sht, void *workspace)
{
    size_t n = points_of(sht);
    double *next = (double *)workspace + transform_doubles(sht);
    struct field_work work = {.transform = workspace,
                              .f_theta = next,
                              .f_phi = next + 3 * n,
                              .unit = next + 6 * n,
                              .root = next + 9 * n,
                              .inverse = next + 10 * n,
                              .weight = next + 11 * n,
                              .w_theta = next + 12 * n,
                              .w_phi = next + 15 * n,
                              .field = next + 18 * n};

    return work;
}

/* Gradient and normals of a surface. */
static void linearize(const struct srnf_sht *sht, const double *coefficients,
                      const struct field_work *w)
{
    srnf_sht_gradient(sht, 3, coefficients, w->f_theta, w->f_phi, w->transform);
    pointwise_normals(points_of(sht), w->f_theta, w->f_phi, w->unit, w->root, w->inverse);
}

void srnf_field(const struct srnf_sht *sht, const double *coefficients, double *q, void *workspace)
{
    struct field_work work = split(sht, workspace);
    size_t n = points_of(sht);

    linearize(sht, coefficients, &work);
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < n; i++) {
            q[c * n + i] = work.unit[c * n + i] * work.root[i];
        }
    }
}

void srnf_square_root_map(const struct srnf_sht *sht, const double *coefficients, double *q,
                          void *workspace)
{
    struct field_work work = split(sht, workspace);
    size_t n = points_of(sht);

    linearize(sht, coefficients, &work);
    srnf_sht_synthesis(sht, 3, coefficients, work.field, work.transform);
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < n; i++) {
            q[c * n + i] = work.root[i] * work.field[c * n + i];
        }
    }
}

void field_represent(const struct srnf_sht *sht, enum srnf_representation representation,
                     const double *coefficients, double *q, void *workspace)
{
    if (representation == SRNF_REPRESENTATION_SRM) {
        srnf_square_root_map(sht, coefficients, q, workspace);
    } else {
        srnf_field(sht, coefficients, q, workspace);
    }
}

void srnf_field_differential(const struct srnf_sht *sht, const double *coefficients,
                             const double *direction, double *out, void *workspace)
{
    struct field_work work = split(sht, workspace);

    linearize(sht, coefficients, &work);
    srnf_sht_gradient(sht, 3, direction, work.w_theta, work.w_phi, work.transform);
    pointwise_differential(points_of(sht), work.f_theta, work.f_phi, work.unit, work.inverse,
                           work.w_theta, work.w_phi, out);
}

double srnf_energy(const struct srnf_sht *sht, const double *coefficients, const double *q,
                   double *gradient, void *workspace)
{
    struct field_work work = split(sht, workspace);
    size_t n = points_of(sht);
    double energy;

    linearize(sht, coefficients, &work);
    pointwise_weights(srnf_sht_grid(sht), work.weight);
    pointwise_residual(n, work.unit, work.root, q, work.field);
    energy = pointwise_norm2(n, work.weight, work.field);
    if (gradient) {
        size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));

        pointwise_differential_adjoint(n, work.f_theta, work.f_phi, work.unit, work.inverse,
                                       work.weight, work.field, work.w_theta, work.w_phi);
        srnf_sht_gradient_adjoint(sht, 3, work.w_theta, work.w_phi, gradient, work.transform);
        linear_scale(count, 2.0, gradient);
    }
    return energy;
}

double srnf_inner_product(const struct srnf_grid *grid, const double *a, const double *b)
{
    size_t n = grid->n_theta * grid->n_phi;
    double sum = 0.0;

    for (size_t row = 0; row < grid->n_theta; row++) {
        size_t first = row * grid->n_phi;
        double line = 0.0;

        for (size_t c = 0; c < 3; c++) {
            line += linear_dot(grid->n_phi, a + c * n + first, b + c * n + first);
        }
        sum += grid->weight[row] * line;
    }
    return sum;
}

void srnf_surface_measure(const struct srnf_sht *sht, const double *coefficients,
                          struct srnf_surface_measures *measures, void *workspace)
{
    struct field_work work = split(sht, workspace);
    size_t n = points_of(sht);
    double *x = work.field;
    double area = 0.0;
    double volume = 0.0;
    double first[3] = {0.0, 0.0, 0.0};

    linearize(sht, coefficients, &work);
    srnf_sht_synthesis(sht, 3, coefficients, x, work.transform);
    pointwise_weights(srnf_sht_grid(sht), work.weight);
    for (size_t i = 0; i < n; i++) {
        double element = work.weight[i] * work.root[i] * work.root[i];

        area += element;
        for (size_t c = 0; c < 3; c++) {
            first[c] += element * x[c * n + i];
            volume += element * x[c * n + i] * work.unit[c * n + i] / 3.0;
        }
    }
    measures->area = area;
    measures->volume = volume;
    for (size_t c = 0; c < 3; c++) {
        measures->centroid[c] = area > 0.0 ? first[c] / area : 0.0;
    }
}

void srnf_invert_closed_form(const struct srnf_sht *sht, const double *q, double *coefficients,
                             double *relative_energy, void *workspace)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct field_work work = split(sht, workspace);
    size_t n = points_of(sht);
    double *x = work.field;
    double norm2;

    for (size_t i = 0; i < n; i++) {
        size_t row = i / grid->n_phi;
        double phi = 2.0 * SRNF_PI * (double)(i % grid->n_phi) / (double)grid->n_phi;
        double e[3] = {grid->sin_theta[row] * cos(phi), grid->sin_theta[row] * sin(phi),
                       grid->cos_theta[row]};
        double along = q[i] * e[0] + q[n + i] * e[1] + q[2 * n + i] * e[2];
        double length = sqrt(q[i] * q[i] + q[n + i] * q[n + i] + q[2 * n + i] * q[2 * n + i]);
        double r = along > 0.0 ? sqrt(length * along) : 0.0;

        for (size_t c = 0; c < 3; c++) {
            x[c * n + i] = r * e[c];
        }
    }
    srnf_sht_analysis(sht, 3, x, coefficients, work.transform);
    pointwise_weights(grid, work.weight);
    norm2 = pointwise_norm2(n, work.weight, q);
    *relative_energy =
        norm2 > 0.0 ? srnf_energy(sht, coefficients, q, NULL, workspace) / norm2 : 1.0;
}
