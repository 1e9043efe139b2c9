/*
 * pose.c - by how much a surface is turned against a group that shares a pose.
 *
 * The rotation of the values that brings q nearest to a mean SRNF m, max over O of <m, O q>, is in
 * closed form that of the cross moment B = integral m q' (registration_closest_rotation); its angle
 * is arccos((tr O - 1) / 2). A translation leaves q alone, and a warp of the domain that the two
 * were brought together by before has no part in it.
 *
 * The angle of a subject of a group is taken to the mean of the others. With B_i the moment with
 * the mean of all and A_i = integral q_i q_i', that with the mean of the others is
 * (n B_i - A_i) / (n - 1).
 */
#include "stats.h"
#include "shape/registration.h"

#include <math.h>

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

int srnf_pose_angles(const struct srnf_grid *grid, size_t n, const double *q, double *angles)
{
    size_t size = 3 * stats_points(grid);
    double *mean;

    if (n < 2) {
        return SRNF_EINVAL;
    }
    mean = srnf_alloc(size, sizeof(double));
    if (!mean) {
        return SRNF_ENOMEM;
    }
    stats_average(grid, n, q, mean);
    for (size_t i = 0; i < n; i++) {
        double own[9];
        double moment[9];

        cross_moment(grid, q + i * size, q + i * size, own);
        cross_moment(grid, mean, q + i * size, moment);
        for (size_t k = 0; k < 9; k++) {
            moment[k] = ((double)n * moment[k] - own[k]) / (double)(n - 1);
        }
        angles[i] = angle_of(moment, own);
    }
    srnf_free(mean);
    return SRNF_OK;
}
