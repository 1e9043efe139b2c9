/*
 * sliding.c - a second part of the preconditioner of the damped normal equations: points that slide
 * along the surface and change no area.
 *
 * Q_* w has the gradient of the normal part of w and the divergence of its tangential part, so
 * J' W J grows like l (l + 1), as D = diag(1 + l (l + 1) / 4) does, but for tangential fields free
 * of divergence: those only carry the normals along, and J' W J has no derivative of them. After D
 * alone their eigenvalues fall like 1 / l^2, a third of all, and conjugate gradients spend most of
 * their products on them.
 *
 * On a surface f these fields are, for a stream function psi on the sphere,
 *
 *   C psi = (f_theta psi_phi - f_phi psi_theta) / |n|,
 *
 * whatever the map to the sphere is. D^-1 + C B C' with B diagonal serves both kinds. B is twice
 * the inverse of the mean of diag(C' (J' W J + lambda D) C) over the harmonics of a degree: a
 * multiple of l (l + 1) where the fields are resolved, and more towards the highest degrees, where
 * the expansion cuts C psi off and what is left is not free of divergence. One product with a
 * vector of signs estimates it.
 *
 * C need only be the same as the transpose of C', so it is taken on the smallest grid, of L + 1
 * rows, where both cost .9 U together instead of 2.
 */
#include "inversion.h"

#include <math.h>

/* Of the inverse of the mean: of 1, 1.5, 2 and 2.5 on stars and capsules 2 takes least. */
#define WEIGHT 2.0

struct sliding {
    struct srnf_sht *sht; /* of the degree of the system, on its own grid */
    size_t degree, each, points;
    double grid_share;       /* of the points of the system's grid */
    double *memory;          /* all that follows */
    double *theta, *phi;     /* [3][points] f_theta and f_phi, times quadrature weight over |n| */
    double *field;           /* [3][points] */
    double *d_theta, *d_phi; /* [points] */
    double *stream, *image;  /* [each] stream functions */
    double *vector, *probe;  /* [3][each] */
    double *factor;          /* [degree + 1] diagonal of B */
    void *workspace;
};

int sliding_create(struct sliding **out, const struct gauss_newton *system)
{
    size_t each = srnf_coefficient_count(system->degree);
    size_t rows = system->degree + 1, n = 2 * rows * rows;
    struct sliding *s = srnf_alloc(1, sizeof *s);
    int status;

    *out = NULL;
    if (!s) {
        return SRNF_ENOMEM;
    }
    *s = (struct sliding){.degree = system->degree,
                          .each = each,
                          .points = n,
                          .grid_share = (double)n / (double)system->points};
    status = srnf_sht_create(&s->sht, s->degree, SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows);
    if (status) {
        sliding_destroy(s);
        return status;
    }
    s->memory = srnf_alloc(11 * n + 8 * each + rows, sizeof(double));
    s->workspace = srnf_alloc(1, srnf_sht_workspace_size(s->sht, 3));
    if (!s->memory || !s->workspace) {
        sliding_destroy(s);
        return SRNF_ENOMEM;
    }
    s->theta = s->memory;
    s->phi = s->memory + 3 * n;
    s->field = s->memory + 6 * n;
    s->d_theta = s->memory + 9 * n;
    s->d_phi = s->memory + 10 * n;
    s->stream = s->memory + 11 * n;
    s->image = s->stream + each;
    s->vector = s->image + each;
    s->probe = s->vector + 3 * each;
    s->factor = s->probe + 3 * each;
    *out = s;
    return SRNF_OK;
}

void sliding_destroy(struct sliding *s)
{
    if (!s) {
        return;
    }
    srnf_sht_destroy(s->sht);
    srnf_free(s->memory);
    srnf_free(s->workspace);
    srnf_free(s);
}

/* out = C stream. A gradient of one coordinate and an analysis of three count as one transform. */
static void spread(struct sliding *s, struct gauss_newton *system, const double *stream,
                   double *out)
{
    srnf_sht_gradient(s->sht, 1, stream, s->d_theta, s->d_phi, s->workspace);
    for (size_t c = 0; c < 3; c++) {
        const double *theta = s->theta + c * s->points, *phi = s->phi + c * s->points;
        double *field = s->field + c * s->points;

        for (size_t i = 0; i < s->points; i++) {
            field[i] = theta[i] * s->d_phi[i] - phi[i] * s->d_theta[i];
        }
    }
    srnf_sht_synthesis_adjoint(s->sht, 3, s->field, out, s->workspace);
    for (size_t c = 0; c < 3; c++) {
        out[c * s->each] = 0.0;
    }
    system->transforms += s->grid_share;
}

/* stream = C' x */
static void gather(struct sliding *s, struct gauss_newton *system, const double *x, double *stream)
{
    const double *field = s->field, *theta = s->theta, *phi = s->phi;
    size_t n = s->points;

    srnf_sht_synthesis(s->sht, 3, x, s->field, s->workspace);
    for (size_t i = 0; i < n; i++) {
        s->d_phi[i] =
            field[i] * theta[i] + field[n + i] * theta[n + i] + field[2 * n + i] * theta[2 * n + i];
        s->d_theta[i] =
            -(field[i] * phi[i] + field[n + i] * phi[n + i] + field[2 * n + i] * phi[2 * n + i]);
    }
    srnf_sht_gradient_adjoint(s->sht, 1, s->d_theta, s->d_phi, stream, s->workspace);
    system->transforms += s->grid_share;
}

/* Tangents of f, times the quadrature weight over |n|; 0 where n is. */
static void fill_tangents(struct sliding *s, struct gauss_newton *system, const double *f)
{
    const struct srnf_grid *grid = srnf_sht_grid(s->sht);
    size_t n = s->points;

    srnf_sht_gradient(s->sht, 3, f, s->theta, s->phi, s->workspace);
    system->transforms += s->grid_share;
    for (size_t i = 0; i < n; i++) {
        double *a = s->theta + i, *b = s->phi + i;
        double x = a[n] * b[2 * n] - a[2 * n] * b[n];
        double y = a[2 * n] * b[0] - a[0] * b[2 * n];
        double z = a[0] * b[n] - a[n] * b[0];
        double length = sqrt(x * x + y * y + z * z);
        double scale = length > 0.0 ? grid->weight[i / grid->n_phi] / length : 0.0;

        for (size_t c = 0; c < 3; c++) {
            a[c * n] *= scale;
            b[c * n] *= scale;
        }
    }
}

/* Signs over sqrt(l (l + 1)), the same on every machine. */
static void fill_signs(struct sliding *s)
{
    uint64_t state = 0x9e3779b97f4a7c15U;

    s->stream[0] = 0.0;
    for (size_t l = 1; l <= s->degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            state = state * 6364136223846793005U + 1442695040888963407U;
            s->stream[i] = (state >> 63 ? 1.0 : -1.0) / sqrt((double)(l * (l + 1)));
        }
    }
}

/* B from the signs and their image: its inverse over l (l + 1) is the same for all degrees in the
   lower half, and no less in the upper. B is 0 where that is not positive. */
static void fill_factor(struct sliding *s)
{
    size_t half = (s->degree + 1) / 2;
    double low = 0.0;

    s->factor[0] = 0.0;
    for (size_t l = 1; l <= s->degree; l++) {
        double sum = linear_dot(2 * l + 1, s->stream + l * l, s->image + l * l);

        s->factor[l] = sum / (double)(2 * l + 1);
        low += l <= half ? sum : 0.0;
    }
    low /= (double)((half + 1) * (half + 1) - 1);
    for (size_t l = 1; l <= s->degree; l++) {
        double mean = l > half && s->factor[l] > low ? s->factor[l] : low;

        s->factor[l] = mean > 0.0 ? WEIGHT / (mean * (double)(l * (l + 1))) : 0.0;
    }
}

void sliding_prepare(struct sliding *s, struct gauss_newton *system, const double *f,
                     const double *diagonal, double lambda)
{
    fill_tangents(s, system, f);
    fill_signs(s);
    spread(s, system, s->stream, s->vector);
    gauss_newton_product(system, s->vector, s->probe);
    for (size_t i = 0; i < 3 * s->each; i++) {
        s->probe[i] += lambda * diagonal[i] * s->vector[i];
    }
    gather(s, system, s->probe, s->image);
    fill_factor(s);
}

void sliding_precondition(struct sliding *s, struct gauss_newton *system, const double *r,
                          double *z)
{
    gather(s, system, r, s->stream);
    for (size_t l = 0; l <= s->degree; l++) {
        linear_scale(2 * l + 1, s->factor[l], s->stream + l * l);
    }
    spread(s, system, s->stream, s->vector);
    linear_axpy(3 * s->each, 1.0, s->vector, z);
}
