/*
 * registration_moving.c - the SRNF of the moving surface and its derivative at arbitrary points.
 *
 * The jets of its three coordinates give the tangents f_1, f_2 and the covariant second derivatives
 * h_ij in the frame e_theta, e_phi, regular at the poles. Then n = f_1 x f_2, d_j n = h_1j x f_2 +
 * f_1 x h_2j, and d_j q = (d_j n - <n~, d_j n> n~ / 2) / |n|^(1/2).
 */
#include "registration.h"

#include <math.h>

#define BLOCK ((size_t)64) /* points whose jets are at hand together; a multiple of the lanes */

int moving_create(struct moving *moving, size_t from_degree, const double *coefficients,
                  size_t degree)
{
    size_t from = srnf_coefficient_count(from_degree);
    size_t count;
    int status;

    degree = degree < from_degree ? degree : from_degree;
    count = srnf_coefficient_count(degree);
    *moving = (struct moving){.degree = degree};
    status = sphere_jets_create(&moving->plan, degree);
    if (status) {
        return status;
    }
    moving->coefficients = srnf_alloc(3 * count, sizeof(double));
    if (!moving->coefficients) {
        moving_clear(moving);
        return SRNF_ENOMEM;
    }
    for (size_t c = 0; c < 3; c++) {
        shape_copy(count, coefficients + c * from, moving->coefficients + c * count);
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
        .n = n, .memory = srnf_alloc(15 * n + 3 * JET_KINDS * BLOCK, sizeof(double))};
    if (!samples->memory) {
        return SRNF_ENOMEM;
    }
    samples->q = samples->memory;
    samples->q_1 = samples->memory + 3 * n;
    samples->q_2 = samples->memory + 6 * n;
    samples->t1 = samples->memory + 9 * n;
    samples->t2 = samples->memory + 12 * n;
    samples->jets = samples->memory + 15 * n;
    return SRNF_OK;
}

void samples_clear(struct samples *samples)
{
    srnf_free(samples->memory);
    *samples = (struct samples){0};
}

/* q and its derivatives at a point from the jets of the three coordinates. */
static void srnf_jet(double jet[JET_KINDS][3], double *q, double *q_1, double *q_2)
{
    double *derivative[2] = {q_1, q_2};
    double n[3];
    double length;
    double root;
    double inverse;

    vector_cross(jet[JET_THETA], jet[JET_PHI], n);
    length = sqrt(vector_dot(n, n));
    root = length > 0.0 ? 1.0 / sqrt(length) : 0.0;
    inverse = length > 0.0 ? 0.5 / (length * length) : 0.0;
    for (size_t k = 0; k < 3; k++) {
        q[k] = n[k] * root;
    }
    for (size_t b = 0; b < 2; b++) {
        double first[3];
        double second[3];
        double along;

        vector_cross(jet[b ? JET_THETA_PHI : JET_THETA_THETA], jet[JET_PHI], first);
        vector_cross(jet[JET_THETA], jet[b ? JET_PHI_PHI : JET_THETA_PHI], second);
        for (size_t k = 0; k < 3; k++) {
            first[k] += second[k];
        }
        along = inverse * vector_dot(first, n);
        for (size_t k = 0; k < 3; k++) {
            derivative[b][k] = (first[k] - along * n[k]) * root;
        }
    }
}

static void evaluate_block(const struct moving *moving, const double *points, size_t first,
                           size_t n, struct samples *out)
{
    sphere_jets_evaluate(&moving->plan, 3, moving->coefficients, n, points + 3 * first, out->jets,
                         out->t1 + 3 * first, out->t2 + 3 * first);
    for (size_t i = 0; i < n; i++) {
        size_t at = 3 * (first + i);
        double jet[JET_KINDS][3];

        for (size_t c = 0; c < 3; c++) {
            for (size_t k = 0; k < JET_KINDS; k++) {
                jet[k][c] = out->jets[(c * JET_KINDS + k) * n + i];
            }
        }
        srnf_jet(jet, out->q + at, out->q_1 + at, out->q_2 + at);
    }
}

void moving_evaluate(const struct moving *moving, const double *points, struct samples *out)
{
    for (size_t first = 0; first < out->n; first += BLOCK) {
        evaluate_block(moving, points, first, out->n - first < BLOCK ? out->n - first : BLOCK, out);
    }
}
