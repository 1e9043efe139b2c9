/*
 * trajectories_subjects.c - subjects beside the others: each against what the model of all the
 * others predicts for its slope.
 *
 * With H the projection on the weighted design, h_i its diagonal and s_i the roots of the weights,
 * the slope of subject i less what the others predict is a sum of all slopes,
 *
 *     e_i = sum over j of D_ij b_j,     D_ij = (s_i [i = j] - H_ij s_j) / ((1 - h_i) s_i),
 *
 * (R. Cook, S. Weisberg, "Residuals and influence in regression", 1982, 2.2), and its variance is
 * 1 / (1 - h_i) of what one of a weight s_i^2 has. D_ii is 1: the prediction p_i = b_i - e_i is one
 * of the others alone. Ranks of |e_i| s_i sqrt(1 - h_i) and of the speeds <b_i, p_i> / |p_i|^2 are
 * those of subjects who were all treated alike.
 */
#include "trajectories.h"

#include <cblas.h>
#include <math.h>

#define CERTAIN 1e-10 /* 1 - h of a subject whose slope the design fixes: it is as predicted */

/* D, [n][n], and 1 - h of each. */
static int fill_deletion(const struct trajectory_run *run, double *d, double *room,
                         struct srnf_error *error)
{
    struct regress_fit fit = {0};
    size_t n = run->n;
    const double *s = run->roots;
    int status = regress_fit_create(&fit, n, run->weighted ? run->roots : NULL,
                                    run->design->columns, run->scaled, error);

    if (status == SRNF_OK) {
        cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)n, (int)n, (int)fit.basis.count,
                    -1.0, fit.basis.vectors, (int)n, fit.basis.vectors, (int)n, 0.0, d, (int)n);
        for (size_t i = 0; i < n; i++) {
            room[i] = fmax(1.0 + d[i * n + i], CERTAIN);
            for (size_t j = 0; j < n; j++) {
                d[i * n + j] = i == j ? 1.0 : d[i * n + j] * s[j] / (room[i] * s[i]);
            }
        }
    }
    regress_fit_clear(&fit);
    return status;
}

static void describe(struct trajectory_run *run, const double *const gram[2], const double *d,
                     const double *room, double *scratch, double *odd)
{
    struct srnf_paired *out = &run->out->slope;
    size_t n = run->n;

    for (size_t i = 0; i < n; i++) {
        const double *row = d + i * n;
        double own = gram[1][i * n + i];
        double along;   /* <b, e> */
        double square;  /* |e|^2 */
        double others2; /* |p|^2 */

        cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)n, (int)n, 1.0, gram[0], (int)n, row, 1, 0.0,
                    scratch, 1);
        odd[i] = sqrt(fmax(cblas_ddot((int)n, scratch, 1, row, 1), 0.0) * room[i]) * run->roots[i];
        cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)n, (int)n, 1.0, gram[1], (int)n, row, 1, 0.0,
                    scratch, 1);
        square = fmax(cblas_ddot((int)n, scratch, 1, row, 1), 0.0);
        along = scratch[i];
        others2 = fmax(own - 2.0 * along + square, 0.0);
        out->length[i] = sqrt(own);
        out->deviation[i] = sqrt(square);
        out->along[i] = others2 > 0.0 ? (own - along) / sqrt(others2) : 0.0;
        out->distance[i] = sqrt(gram[0][i * n + i]);
        run->out->subject[i].turned =
            square > 0.0 ? sqrt(fmax(4.0 * (own - along) + square, 0.0) / square) : INFINITY;
        run->out->subject[i].speed = others2 > 0.0 ? (own - along) / others2 : 0.0;
    }
}

/* Of each among all others; others: [2][n] of scratch. */
static int rank_all(struct trajectory_run *run, const double *odd, double *others)
{
    size_t n = run->n;
    int status = SRNF_OK;

    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        struct srnf_subject_trajectory *subject = &run->out->subject[i];
        size_t at = 0;

        for (size_t j = 0; j < n; j++) {
            if (j != i) {
                others[at] = odd[j];
                others[n + at++] = run->out->subject[j].speed;
            }
        }
        status = srnf_norm_rank(at, others, NULL, odd[i], &subject->odd);
        status = status ? status
                        : srnf_norm_rank(at, others + n, NULL, subject->speed, &subject->faster);
    }
    return status;
}

int trajectory_subjects(struct trajectory_run *run, const double *const gram[2],
                        struct srnf_error *error)
{
    size_t n = run->n;
    double *d = srnf_alloc(n + 4, n * sizeof(double));
    double *room = d ? d + n * n : NULL;
    double *odd = d ? room + n : NULL;
    double *scratch = d ? odd + n : NULL;
    double square = 0.0;
    int status = d ? fill_deletion(run, d, room, error) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        size_t freedom = n - run->design->columns - 1;

        describe(run, gram, d, room, scratch, odd);
        for (size_t i = 0; i < n; i++) { /* the residual is e times 1 - h */
            square += odd[i] * odd[i] * room[i];
        }
        for (size_t i = 0; i < n && square > 0.0; i++) {
            odd[i] /= sqrt(square / (double)freedom);
        }
        status = rank_all(run, odd, scratch);
    }
    srnf_free(d);
    return status;
}
