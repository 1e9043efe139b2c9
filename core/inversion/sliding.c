/*
 * sliding.c - a second part of the preconditioner of the damped normal equations: points that slide
 * along the surface and change no area.
 *
 * Q_* w has the gradient of the normal part of w and the divergence of its tangential part, so
 * J' W J grows like l (l + 1), as D = diag(1 + l (l + 1) / 4) does, but for tangential fields free
 * of divergence: those only turn the normals by the curvature k, and J' W J has no derivative of
 * them. After D alone their eigenvalues fall like 1 / l^2, a third of all, and conjugate gradients
 * spend most of their products on them.
 *
 * On a surface f these fields are, for a stream function u on the sphere,
 *
 *   (f_theta u_phi - f_phi u_theta) / |n|,
 *
 * whatever the map to the sphere is, and their energy is that of k grad u. So C psi is the field of
 * u = s psi with s = 1 / k, smoothed, k^2 the mean of the squared principal curvatures. D^-1 + C B
 * C' with B diagonal serves both kinds. B is twice the inverse of the mean of diag(C' (J' W J +
 * lambda D) C) over the harmonics of a degree: a multiple of l (l + 1) where the fields are
 * resolved, and more towards the highest degrees, where the expansion cuts C psi off and what is
 * left is not free of divergence. One product with a vector of signs estimates it.
 *
 * C need only be the same as the transpose of C', so it is taken on the least grid, where either
 * costs about .45 U.
 */
#include "inversion.h"

#include "harmonics/harmonics.h"
#include "harmonics/simd.h"

#include <math.h>

/* Of the inverse of the mean: of 1, 1.5, 2 and 2.5 on stars and capsules 2 takes least. */
#define WEIGHT 2.0
/* s = (k^2 / mean + FLOOR)^-1/2, its harmonics times exp(-SMOOTHING l (l + 1) / (L (L + 1))). Of
   .1, .3 and 1, and of 0, 1 and 3, these take least on thalami and random stars. */
#define FLOOR 0.3
#define SMOOTHING 3.0
#define DEGENERATE 1e-12 /* of |f_theta|^2 |f_phi|^2: there the normals have no curvature */

struct sliding {
    struct srnf_sht *sht; /* of the degree of the system */
    size_t degree, each, points;
    double share;                            /* of the points of the system's grid */
    double *memory;                          /* all that follows */
    double *theta, *phi;                     /* [3][points] f_theta and f_phi over |n|, weighted */
    double *field;                           /* [3][points] */
    double *d_theta, *d_phi, *value;         /* [points] */
    double *scale, *scale_theta, *scale_phi; /* [points] s; one after the other */
    double *stream, *image;                  /* [each] stream functions */
    double *vector, *probe;                  /* [3][each] */
    double *factor;                          /* [degree + 1] diagonal of B */
};

int sliding_create(struct sliding **out, const struct gauss_newton *system)
{
    size_t each = srnf_coefficient_count(system->degree);
    struct sliding *s = srnf_alloc(1, sizeof *s);
    size_t n;
    int status;

    *out = NULL;
    if (!s) {
        return SRNF_ENOMEM;
    }
    *s = (struct sliding){.degree = system->degree, .each = each};
    status = sphere_sht_least(&s->sht, system->sht);
    if (status) {
        sliding_destroy(s);
        return status;
    }
    n = s->points = srnf_sht_grid(s->sht)->n_theta * srnf_sht_grid(s->sht)->n_phi;
    s->share = (double)n / (double)system->points;
    s->memory = srnf_alloc(15 * n + 8 * each + system->degree + 1, sizeof(double));
    if (!s->memory) {
        sliding_destroy(s);
        return SRNF_ENOMEM;
    }
    s->theta = s->memory;
    s->phi = s->theta + 3 * n;
    s->field = s->phi + 3 * n;
    s->d_theta = s->field + 3 * n;
    s->d_phi = s->d_theta + n;
    s->value = s->d_phi + n;
    s->scale = s->value + n;
    s->scale_theta = s->scale + n;
    s->scale_phi = s->scale_theta + n;
    s->stream = s->scale_phi + n;
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
    srnf_free(s);
}

/* ---- C and its transpose, each the work of a gradient transform of three coordinates --------- */

/* y = s y + t x */
SRNF_HOT static void scale_gradient(size_t n, const double *restrict s, const double *restrict t,
                                    const double *restrict x, double *restrict y)
{
    for (size_t i = 0; i < n; i++) {
        y[i] = s[i] * y[i] + t[i] * x[i];
    }
}

SRNF_HOT static void cross(size_t n, const double *restrict theta, const double *restrict phi,
                           const double *restrict u_theta, const double *restrict u_phi,
                           double *restrict field)
{
    for (size_t i = 0; i < n; i++) {
        field[i] = theta[i] * u_phi[i] - phi[i] * u_theta[i];
    }
}

/* The transposes of both, of a field of three coordinates: u_theta and u_phi into d_theta, d_phi
   and value. */
SRNF_HOT static void gather_points(size_t n, const double *restrict field,
                                   const double *restrict theta, const double *restrict phi,
                                   const double *restrict scale, double *restrict d_theta,
                                   double *restrict d_phi, double *restrict value)
{
    const double *restrict scale_theta = scale + n;
    const double *restrict scale_phi = scale + 2 * n;

    for (size_t i = 0; i < n; i++) {
        double x = field[i];
        double y = field[n + i];
        double z = field[2 * n + i];
        double u_phi = x * theta[i] + y * theta[n + i] + z * theta[2 * n + i];
        double u_theta = -(x * phi[i] + y * phi[n + i] + z * phi[2 * n + i]);

        d_theta[i] = scale[i] * u_theta;
        d_phi[i] = scale[i] * u_phi;
        value[i] = scale_theta[i] * u_theta + scale_phi[i] * u_phi;
    }
}

/* out = C psi */
static void spread(struct sliding *s, struct gauss_newton *system, const double *psi, double *out)
{
    size_t n = s->points;

    srnf_sht_synthesis(s->sht, 1, psi, s->value, system->workspace);
    srnf_sht_gradient(s->sht, 1, psi, s->d_theta, s->d_phi, system->workspace);
    scale_gradient(n, s->scale, s->scale_theta, s->value, s->d_theta);
    scale_gradient(n, s->scale, s->scale_phi, s->value, s->d_phi);
    for (size_t c = 0; c < 3; c++) {
        cross(n, s->theta + c * n, s->phi + c * n, s->d_theta, s->d_phi, s->field + c * n);
    }
    srnf_sht_synthesis_adjoint(s->sht, 3, s->field, out, system->workspace);
    for (size_t c = 0; c < 3; c++) {
        out[c * s->each] = 0.0;
    }
    system->transforms += s->share;
}

/* psi = C' x. x may be probe, not vector. */
static void gather(struct sliding *s, struct gauss_newton *system, const double *x, double *psi)
{
    srnf_sht_synthesis(s->sht, 3, x, s->field, system->workspace);
    gather_points(s->points, s->field, s->theta, s->phi, s->scale, s->d_theta, s->d_phi, s->value);
    srnf_sht_gradient_adjoint(s->sht, 1, s->d_theta, s->d_phi, psi, system->workspace);
    srnf_sht_synthesis_adjoint(s->sht, 1, s->value, s->vector, system->workspace);
    linear_axpy(s->each, 1.0, s->vector, psi);
    system->transforms += s->share;
}

/* ---- Preparation ----------------------------------------------------------------------------- */

/* k^2 of one point from the first fundamental form and the derivatives of the normal. */
static double squared_curvature(size_t n, const double *a, const double *b, const double *n_theta,
                                const double *n_phi)
{
    double form[3] = {0.0, 0.0, 0.0};
    double turn[3] = {0.0, 0.0, 0.0};
    double determinant;

    for (size_t k = 0; k < 3 * n; k += n) {
        form[0] += a[k] * a[k];
        form[1] += a[k] * b[k];
        form[2] += b[k] * b[k];
        turn[0] += n_theta[k] * n_theta[k];
        turn[1] += n_theta[k] * n_phi[k];
        turn[2] += n_phi[k] * n_phi[k];
    }
    determinant = form[0] * form[2] - form[1] * form[1];
    return determinant > DEGENERATE * form[0] * form[2]
               ? 0.5 * (form[2] * turn[0] - 2.0 * form[1] * turn[1] + form[0] * turn[2]) /
                     determinant
               : 0.0;
}

/* theta, phi and s for the state of the system. The normals are expanded in harmonics. */
static void fill_scale(struct sliding *s, struct gauss_newton *system, const double *f)
{
    const struct srnf_grid *grid = srnf_sht_grid(s->sht);
    double *n_theta = system->w_theta;
    double *n_phi = system->w_phi;
    size_t n = s->points;
    double mean = 0.0;

    srnf_sht_analysis(system->sht, 3, system->state.unit, s->vector, system->workspace);
    srnf_sht_gradient(s->sht, 3, s->vector, n_theta, n_phi, system->workspace);
    srnf_sht_gradient(s->sht, 3, f, s->theta, s->phi, system->workspace);
    for (size_t i = 0; i < n; i++) {
        s->value[i] = squared_curvature(n, s->theta + i, s->phi + i, n_theta + i, n_phi + i);
        mean += grid->weight[i / grid->n_phi] / (4.0 * SRNF_PI) * s->value[i];
    }
    for (size_t i = 0; i < n; i++) {
        s->value[i] = 1.0 / sqrt((mean > 0.0 ? s->value[i] / mean : 1.0) + FLOOR);
    }
    srnf_sht_analysis(s->sht, 1, s->value, s->image, system->workspace);
    for (size_t l = 0; l <= s->degree; l++) {
        double part = (double)(l * (l + 1)) / (double)(s->degree * (s->degree + 1));

        linear_scale(2 * l + 1, exp(-SMOOTHING * part), s->image + l * l);
    }
    srnf_sht_synthesis(s->sht, 1, s->image, s->scale, system->workspace);
    srnf_sht_gradient(s->sht, 1, s->image, s->scale_theta, s->scale_phi, system->workspace);
    system->transforms += 0.5 + 8.0 / 3.0 * s->share;
}

/* Makes theta and phi of f_theta and f_phi: times the quadrature weight over |n|; 0 where n is. */
static void fill_tangents(struct sliding *s)
{
    const struct srnf_grid *grid = srnf_sht_grid(s->sht);
    size_t n = s->points;

    for (size_t i = 0; i < n; i++) {
        double *a = s->theta + i;
        double *b = s->phi + i;
        double x = a[n] * b[2 * n] - a[2 * n] * b[n];
        double y = a[2 * n] * b[0] - a[0] * b[2 * n];
        double z = a[0] * b[n] - a[n] * b[0];
        double length = sqrt(x * x + y * y + z * z);
        double factor = length > 0.0 ? grid->weight[i / grid->n_phi] / length : 0.0;

        for (size_t k = 0; k < 3 * n; k += n) {
            a[k] *= factor;
            b[k] *= factor;
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
    fill_scale(s, system, f);
    fill_tangents(s);
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

double sliding_turning(struct gauss_newton *system, double *work)
{
    size_t each = system->count / 3;
    double sum = 0.0;

    srnf_sht_analysis(system->sht, 3, system->state.unit, work, system->workspace);
    system->transforms += 0.5;
    for (size_t c = 0; c < 3; c++) {
        for (size_t l = 1; l <= system->degree; l++) {
            const double *part = work + c * each + l * l;

            sum += (double)(l * (l + 1)) * linear_dot(2 * l + 1, part, part);
        }
    }
    return sum / (8.0 * SRNF_PI);
}
