/*
 * landmarks_start.c - rotations of the domain from which a search that landmarks guide starts.
 *
 * R maximizes sum <b_j, R a_j>, by the singular value decomposition of sum b_j a_j'. With S = R'
 * sum b_j a_j', turning further about an axis u by a small angle costs (tr S - u' S u) / 2 times
 * its square: where that is nearly 0 for some u, as for a single landmark or several that lie close
 * together, the landmarks leave the turn about u open. Then turns all around are measured on the
 * surfaces.
 */
#include "landmarks.h"

#include <math.h>
#include <string.h>

#define OPEN_CURVATURE 0.1 /* of one landmark: less leaves a turn open */
#define TURNS ((size_t)24)
#define APART ((size_t)3) /* turns between two that are kept */
#define POWER_STEPS 60

/* The axis of least curvature, and that curvature relative to the number of landmarks. */
static double open_axis(const struct srnf_landmarks *landmarks, const double rotation[9],
                        double axis[3])
{
    double s[9] = {0};
    double value = 0.0;

    for (size_t j = 0; j < landmarks->n; j++) {
        const double *a = landmarks->fixed + 3 * j, *b = landmarks->moving + 3 * j;
        double back[3];

        for (size_t k = 0; k < 3; k++) {
            back[k] = rotation[k] * b[0] + rotation[3 + k] * b[1] + rotation[6 + k] * b[2];
        }
        for (size_t k = 0; k < 9; k++) {
            s[k] += 0.5 * (back[k / 3] * a[k % 3] + a[k / 3] * back[k % 3]) / (double)landmarks->n;
        }
    }
    /* S + 1 is positive: its largest eigenvalue, from the first landmark on. */
    memcpy(axis, landmarks->fixed, 3 * sizeof *axis);
    for (int step = 0; step < POWER_STEPS; step++) {
        double next[3];

        for (size_t k = 0; k < 3; k++) {
            next[k] = axis[k] + vector_dot(s + 3 * k, axis);
        }
        value = sqrt(vector_dot(next, next));
        for (size_t k = 0; k < 3; k++) {
            axis[k] = next[k] / value;
        }
    }
    return s[0] + s[4] + s[8] - (value - 1.0);
}

/* out = r times the turn about an axis. */
static void turn_about(const double r[9], const double axis[3], double angle, double out[9])
{
    double c = cos(angle), s = sin(angle);
    double turn[9] = {
        c, -s * axis[2], s * axis[1], s * axis[2], c, -s * axis[0], -s * axis[1], s * axis[0], c};

    for (size_t k = 0; k < 9; k++) {
        turn[k] += (1.0 - c) * axis[k / 3] * axis[k % 3];
    }
    for (size_t k = 0; k < 9; k++) {
        const double *row = r + k / 3 * 3;

        out[k] = row[0] * turn[k % 3] + row[1] * turn[3 + k % 3] + row[2] * turn[6 + k % 3];
    }
}

/* What a rotation costs: the objective of the surfaces, and the mean squared angle. */
static int measure(const struct search *s, const double rotation[9], struct warp *warp,
                   double *value)
{
    const struct srnf_landmarks *given = &s->landmarks->pairs;
    const struct srnf_landmarks mean = {given->n, given->fixed, given->moving, 1.0};
    double angles = 0.0;
    int status = warp_rotate(warp, &s->full.target, rotation);

    status = status ? status : search_measure(s, warp);
    status = status ? status : landmarks_cost(&mean, &warp->chain, &angles);
    *value = warp->objective + angles;
    return status;
}

/* The lowest of the turns that no lower one is near to. */
static void keep_lowest(const double values[TURNS], const double turned[TURNS][9],
                        double rotations[LANDMARK_STARTS][9], size_t *count)
{
    bool out[TURNS] = {false};

    for (*count = 0; *count < LANDMARK_STARTS; (*count)++) {
        size_t best = TURNS;

        for (size_t k = 0; k < TURNS; k++) {
            best = !out[k] && (best == TURNS || values[k] < values[best]) ? k : best;
        }
        memcpy(rotations[*count], turned[best], 9 * sizeof(double));
        for (size_t k = 0; k <= 2 * APART; k++) {
            out[(best + TURNS - APART + k) % TURNS] = true;
        }
    }
}

int landmarks_start(const struct search *s, double rotations[LANDMARK_STARTS][9], size_t *count)
{
    const struct srnf_landmarks *landmarks = &s->landmarks->pairs;
    double moments[9] = {0}, values[TURNS], turned[TURNS][9], axis[3];
    struct warp warp = {0};
    int status;

    for (size_t j = 0; j < landmarks->n; j++) {
        for (size_t k = 0; k < 9; k++) {
            moments[k] += landmarks->moving[3 * j + k / 3] * landmarks->fixed[3 * j + k % 3];
        }
    }
    (void)registration_closest_rotation(moments, rotations[0]);
    *count = 1;
    if (open_axis(landmarks, rotations[0], axis) >= OPEN_CURVATURE) {
        return SRNF_OK;
    }
    status = warp_create(&warp, &s->full.target);
    for (size_t k = 0; k < TURNS && status == SRNF_OK; k++) {
        turn_about(rotations[0], axis, 2.0 * SRNF_PI * (double)k / (double)TURNS, turned[k]);
        status = measure(s, turned[k], &warp, &values[k]);
    }
    warp_clear(&warp);
    if (status == SRNF_OK) {
        keep_lowest(values, turned, rotations, count);
    }
    return status;
}
