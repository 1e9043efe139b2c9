/*
 * moving.c - the field of the moving surface, its SRNF or its square-root map, and the
 * derivative of that at arbitrary points.
 *
 * The jets of its three coordinates give the tangents f_1, f_2 and the covariant second derivatives
 * h_ij in the frame e_theta, e_phi, regular at the poles. Then n = f_1 x f_2, d_j n = h_1j x f_2 +
 * f_1 x h_2j, and d_j q = (d_j n - <n~, d_j n> n~ / 2) / |n|^(1/2).
 * The square-root map is q = |n|^(1/2) f, d_j q = |n|^(1/2) (f_j + <n, d_j n> f / (2 |n|^2)). Both
 * are acted on in the same way, so that all that follows does not ask which one it is.
 */
#include "tabulated.h"

#include <math.h>
#include <string.h>

#define BLOCK ((size_t)64) /* points whose jets are at hand together; a multiple of the lanes */

int moving_create(struct moving *moving, size_t from_degree, const double *coefficients,
                  size_t degree, const struct srnf_context *context)
{
    size_t from = srnf_coefficient_count(from_degree);
    size_t count;
    int status;

    degree = degree < from_degree ? degree : from_degree;
    count = srnf_coefficient_count(degree);
    *moving = (struct moving){.degree = degree};
    status = sphere_jets_create(&moving->plan, degree, context);
    if (status) {
        return status;
    }
    moving->coefficients = srnf_alloc(3 * count, sizeof(double));
    if (!moving->coefficients) {
        moving_clear(moving);
        return SRNF_ENOMEM;
    }
    for (size_t c = 0; c < 3; c++) {
        linear_copy(count, coefficients + c * from, moving->coefficients + c * count);
    }
    return SRNF_OK;
}

void moving_clear(struct moving *moving)
{
    srnf_free(moving->coefficients);
    sphere_jets_clear(&moving->plan);
    moving->coefficients = NULL;
}

int samples_create(struct samples *samples, size_t n)
{
    *samples = (struct samples){
        .n = n, .memory = srnf_alloc(15 * n + (3 * JET_KINDS + 3) * BLOCK, sizeof(double))};
    if (!samples->memory) {
        return SRNF_ENOMEM;
    }
    samples->q = samples->memory;
    samples->q_1 = samples->memory + 3 * n;
    samples->q_2 = samples->memory + 6 * n;
    samples->t1 = samples->memory + 9 * n;
    samples->t2 = samples->memory + 12 * n;
    samples->jets = samples->memory + 15 * n;
    samples->values = samples->jets + 3 * JET_KINDS * BLOCK;
    return SRNF_OK;
}

void samples_clear(struct samples *samples)
{
    srnf_free(samples->memory);
    *samples = (struct samples){0};
}

/* n at a point from the jets of the three coordinates, and its derivatives along the frame. */
static void normal_jet(double jet[JET_KINDS][3], double n[3], double n_1[3], double n_2[3])
{
    double *derivative[2] = {n_1, n_2};

    vector_cross(jet[JET_THETA], jet[JET_PHI], n);
    for (size_t b = 0; b < 2; b++) {
        double second[3];

        vector_cross(jet[b ? JET_THETA_PHI : JET_THETA_THETA], jet[JET_PHI], derivative[b]);
        vector_cross(jet[JET_THETA], jet[b ? JET_PHI_PHI : JET_THETA_PHI], second);
        for (size_t k = 0; k < 3; k++) {
            derivative[b][k] += second[k];
        }
    }
}

/* The SRNF and its derivatives. */
static void srnf_jet(double jet[JET_KINDS][3], double *q, double *q_1, double *q_2)
{
    double *derivative[2] = {q_1, q_2};
    double n[3];
    double d[2][3];
    double length;
    double root;
    double inverse;

    normal_jet(jet, n, d[0], d[1]);
    length = sqrt(vector_dot(n, n));
    root = length > 0.0 ? 1.0 / sqrt(length) : 0.0;
    inverse = length > 0.0 ? 0.5 / (length * length) : 0.0;
    for (size_t k = 0; k < 3; k++) {
        q[k] = n[k] * root;
    }
    for (size_t b = 0; b < 2; b++) {
        double along = inverse * vector_dot(d[b], n);

        for (size_t k = 0; k < 3; k++) {
            derivative[b][k] = (d[b][k] - along * n[k]) * root;
        }
    }
}

/* The square-root map and its derivatives; f: the point of the surface. */
static void srm_jet(double jet[JET_KINDS][3], const double f[3], double *q, double *q_1,
                    double *q_2)
{
    double *derivative[2] = {q_1, q_2};
    double n[3];
    double d[2][3];
    double length;
    double root;
    double inverse;

    normal_jet(jet, n, d[0], d[1]);
    length = sqrt(vector_dot(n, n));
    root = sqrt(length);
    inverse = length > 0.0 ? 0.5 / (length * length) : 0.0;
    for (size_t k = 0; k < 3; k++) {
        q[k] = root * f[k];
    }
    for (size_t b = 0; b < 2; b++) {
        const double *tangent = jet[b ? JET_PHI : JET_THETA];
        double along = inverse * vector_dot(d[b], n);

        for (size_t k = 0; k < 3; k++) {
            derivative[b][k] = root * (tangent[k] + along * f[k]);
        }
    }
}

static void evaluate_block(const struct moving *moving, const double *points, size_t first,
                           size_t n, struct samples *out)
{
    bool srm = moving->representation == SRNF_REPRESENTATION_SRM;

    sphere_jets_evaluate(&moving->plan, 3, moving->coefficients, n, points + 3 * first, out->jets,
                         out->t1 + 3 * first, out->t2 + 3 * first);
    if (srm) {
        sphere_points_evaluate(&moving->plan.points, 3, moving->coefficients, n, points + 3 * first,
                               out->values, NULL);
    }
    for (size_t i = 0; i < n; i++) {
        size_t at = 3 * (first + i);
        double jet[JET_KINDS][3];

        for (size_t c = 0; c < 3; c++) {
            for (size_t k = 0; k < JET_KINDS; k++) {
                jet[k][c] = out->jets[(c * JET_KINDS + k) * n + i];
            }
        }
        if (srm) {
            const double f[3] = {out->values[i], out->values[n + i], out->values[2 * n + i]};

            srm_jet(jet, f, out->q + at, out->q_1 + at, out->q_2 + at);
        } else {
            srnf_jet(jet, out->q + at, out->q_1 + at, out->q_2 + at);
        }
    }
}

/* n is p times the cross products of the coordinates' gradients, each with its component. */
static void value_block(const struct moving *moving, size_t n, const double *points, double *f,
                        double *q)
{
    double gradients[9 * BLOCK];

    sphere_points_evaluate(&moving->plan.points, 3, moving->coefficients, n, points, f, gradients);
    for (size_t i = 0; i < n; i++) {
        const double *p = points + 3 * i;
        const double values[3] = {f[i], f[n + i], f[2 * n + i]};
        double normal[3];
        double length;

        for (size_t k = 0; k < 3; k++) {
            double across[3];

            vector_cross(gradients + 3 * ((k + 1) % 3 * n + i),
                         gradients + 3 * ((k + 2) % 3 * n + i), across);
            normal[k] = vector_dot(p, across);
        }
        length = sqrt(vector_dot(normal, normal));
        for (size_t k = 0; k < 3; k++) {
            q[3 * i + k] = moving->representation == SRNF_REPRESENTATION_SRM
                               ? sqrt(length) * values[k]
                               : (length > 0.0 ? normal[k] / sqrt(length) : 0.0);
        }
    }
}

void moving_values(const struct moving *moving, size_t n, const double *points, double *f,
                   double *q)
{
    for (size_t first = 0; first < n && !srnf_is_canceled(moving_context(moving)); first += BLOCK) {
        size_t count = n - first < BLOCK ? n - first : BLOCK;
        double values[3 * BLOCK];

        value_block(moving, count, points + 3 * first, values, q + 3 * first);
        for (size_t c = 0; c < 3 && f; c++) {
            memcpy(f + c * n + first, values + c * count, count * sizeof *f);
        }
    }
}

void moving_evaluate(const struct moving *moving, const double *points, struct samples *out)
{
    if (moving->table) {
        tabulated_sample(moving->table, points, out);
        return;
    }
    for (size_t first = 0; first < out->n && !srnf_is_canceled(moving_context(moving));
         first += BLOCK) {
        evaluate_block(moving, points, first, out->n - first < BLOCK ? out->n - first : BLOCK, out);
    }
}
