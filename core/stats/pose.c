/*
 * pose.c - by how much a surface is turned against a group that shares a pose.
 *
 * The rotation of the values that brings q nearest to a mean SRNF m, max over O of <m, O q>, is in
 * closed form that of the cross moment B = integral m q' (registration_closest_rotation); its angle
 * is arccos((tr O - 1) / 2). A translation leaves q alone, and a warp of the domain that the two
 * were brought together by before has no part in it.
 *
 * The angle of a member of a group is taken to the mean of those of other subjects. With B_i the
 * moment with the mean of all n and A_i = integral d q_i', d the sum of the m members of its
 * subject, that with the mean of the others is (n B_i - A_i) / (n - m).
 */
#include "stats.h"
#include "subjects.h"
#include "registration/registration.h"

#include <math.h>
#include <string.h>

/* out = integral of a b', row-major. */
static void cross_moment(const struct srnf_grid *grid, const double *a, const double *b,
                         double out[9])
{
    size_t points = stats_points(grid);

    for (size_t r = 0; r < 3; r++) {
        for (size_t c = 0; c < 3; c++) {
            double sum = 0.0;

            for (size_t row = 0; row < grid->n_theta; row++) {
                size_t first = row * grid->n_phi;
                double line = 0.0;

                for (size_t k = first; k < first + grid->n_phi; k++) {
                    line += a[r * points + k] * b[c * points + k];
                }
                sum += grid->weight[row] * line;
            }
            out[3 * r + c] = sum;
        }
    }
}

/* Of the closest rotation o; by sine and cosine, as the cosine alone loses small angles. */
static double angle_of(const double moment[9], double o[9])
{
    double sine;

    (void)registration_closest_rotation(moment, o);
    sine = sqrt((o[7] - o[5]) * (o[7] - o[5]) + (o[2] - o[6]) * (o[2] - o[6]) +
                (o[3] - o[1]) * (o[3] - o[1]));
    return atan2(sine, o[0] + o[4] + o[8] - 1.0);
}

double srnf_pose_angle(const struct srnf_grid *grid, const double *mean_q, const double *q,
                       double rotation[9])
{
    double moment[9];
    double own[9];

    cross_moment(grid, mean_q, q, moment);
    return angle_of(moment, rotation ? rotation : own);
}

/* The angles of the members of one subject. mean: of all; sum: scratch. Both [3][P]. */
static void subject_angles(const struct srnf_grid *grid, const struct subjects *s, size_t subject,
                           const double *q, const double *mean, double *sum, double *angles)
{
    size_t size = 3 * stats_points(grid);
    size_t m = s->size[subject];

    memset(sum, 0, size * sizeof(double));
    for (size_t j = s->start[subject]; j < s->start[subject + 1]; j++) {
        for (size_t k = 0; k < size; k++) {
            sum[k] += q[s->members[j] * size + k];
        }
    }
    for (size_t j = s->start[subject]; j < s->start[subject + 1]; j++) {
        size_t i = s->members[j];
        double own[9];
        double moment[9];

        cross_moment(grid, sum, q + i * size, own);
        cross_moment(grid, mean, q + i * size, moment);
        for (size_t k = 0; k < 9; k++) {
            moment[k] = ((double)s->n * moment[k] - own[k]) / (double)(s->n - m);
        }
        angles[i] = angle_of(moment, own);
    }
}

int srnf_pose_angles(const struct srnf_grid *grid, size_t n, const double *q,
                     const size_t *subjects, double *angles)
{
    size_t size = 3 * stats_points(grid);
    double *fields = srnf_alloc(2 * size, sizeof(double));
    struct subjects s = {0};
    int status = fields ? subjects_open(&s, n, subjects, NULL) : SRNF_ENOMEM;

    if (status == SRNF_OK && s.count < 2) {
        status = SRNF_EINVAL;
    }
    if (status == SRNF_OK) {
        stats_average(grid, n, q, fields);
        for (size_t k = 0; k < s.count; k++) {
            subject_angles(grid, &s, k, q, fields, fields + size, angles);
        }
    }
    subjects_clear(&s);
    srnf_free(fields);
    return status;
}
