/*
 * nearest.c - where on a surface the point nearest to a given one lies.
 *
 * Minimizes |f(s) - x|^2 over s on the sphere. f is evaluated once at the nodes of a grid; for each
 * x the nodes that are nearer than their neighbours in the grid compete, since a surface that folds
 * has several places near x: the best few are refined by Newton's method in the tangent plane of s,
 *
 *   gradient g_a = <f - x, f_a>,  Hessian h_ab = <f_a, f_b> + <f - x, f_ab>,
 *
 * with the Hessian's second term left out where it is not positive definite with it, and steps
 * halved until the distance falls.
 *
 * Cost: 32 (L + 1)^2 evaluations of f together, and some ten for each x.
 */
#include "surface.h"
#include "harmonics/points.h"
#include "mesh/mesh_geometry.h"

#include <math.h>
#include <string.h>

#define ROWS_PER_DEGREE ((size_t)4)
#define CANDIDATES ((size_t)4)
#define STEPS_MAX 40
#define HALVINGS_MAX 20
#define STEP_LEAST 1e-14 /* radians */

struct nearest {
    const double *coefficients;
    size_t degree, rows, columns, nodes;
    struct sphere_jets plan;
    double *points; /* [nodes][3] on the sphere */
    double *images; /* [3][nodes] */
};

static void clear(struct nearest *s)
{
    sphere_jets_clear(&s->plan);
    srnf_free(s->points);
}

static int create(struct nearest *s, size_t degree, const double *coefficients,
                  const struct srnf_context *context)
{
    size_t rows = ROWS_PER_DEGREE * (degree + 1);
    int status = sphere_jets_create(&s->plan, degree, context);

    s->coefficients = coefficients;
    s->degree = degree;
    s->rows = rows;
    s->columns = 2 * rows;
    s->nodes = 2 * rows * rows;
    s->points = srnf_alloc(6 * s->nodes, sizeof(double));
    if (status || !s->points) {
        return status ? status : SRNF_ENOMEM;
    }
    s->images = s->points + 3 * s->nodes;
    for (size_t i = 0; i < s->nodes; i++) {
        double theta = SRNF_PI * ((double)(i / s->columns) + 0.5) / (double)rows;
        double phi = SRNF_PI * (double)(i % s->columns) / (double)rows;

        s->points[3 * i] = sin(theta) * cos(phi);
        s->points[3 * i + 1] = sin(theta) * sin(phi);
        s->points[3 * i + 2] = cos(theta);
    }
    return sphere_harmonics_at_points(context, degree, 3, coefficients, s->nodes, s->points,
                                      s->images, NULL);
}

static double node_distance2(const struct nearest *s, size_t i, const double *x)
{
    double sum = 0.0;

    for (size_t c = 0; c < 3; c++) {
        double d = s->images[c * s->nodes + i] - x[c];

        sum += d * d;
    }
    return sum;
}

/* Whether no neighbour in the grid is nearer. */
static bool is_lowest(const struct nearest *s, size_t i, const double *x, double here)
{
    size_t row = i / s->columns, column = i % s->columns;
    const size_t left = row * s->columns + (column + s->columns - 1) % s->columns;
    const size_t right = row * s->columns + (column + 1) % s->columns;

    return here <= node_distance2(s, left, x) && here <= node_distance2(s, right, x) &&
           (row == 0 || here <= node_distance2(s, i - s->columns, x)) &&
           (row + 1 == s->rows || here <= node_distance2(s, i + s->columns, x));
}

/* The best local minima of the grid, best first. */
static size_t find_candidates(const struct nearest *s, const double *x, size_t found[CANDIDATES])
{
    double values[CANDIDATES];
    size_t count = 0;

    for (size_t i = 0; i < s->nodes; i++) {
        double value = node_distance2(s, i, x);
        size_t at;

        if ((count == CANDIDATES && value >= values[count - 1]) || !is_lowest(s, i, x, value)) {
            continue;
        }
        at = count < CANDIDATES ? count++ : count - 1;
        for (; at > 0 && values[at - 1] > value; at--) {
            values[at] = values[at - 1];
            found[at] = found[at - 1];
        }
        values[at] = value;
        found[at] = i;
    }
    return count;
}

/* f - x and its derivatives at one point of the sphere. */
struct place {
    double p[3], t1[3], t2[3];
    double offset[3], jets[3 * JET_KINDS];
    double distance2;
};

static void place_at(const struct nearest *s, const double *x, struct place *at)
{
    double values[3];

    sphere_points_evaluate(&s->plan.points, 3, s->coefficients, 1, at->p, values, NULL);
    sphere_jets_evaluate(&s->plan, 3, s->coefficients, 1, at->p, at->jets, at->t1, at->t2);
    for (size_t c = 0; c < 3; c++) {
        at->offset[c] = values[c] - x[c];
    }
    at->distance2 = vector_dot(at->offset, at->offset);
}

/* The Newton step in the frame; false where the point is singular. */
static bool newton(const struct place *at, double step[2])
{
    double g[2] = {0.0, 0.0};
    double first[3] = {0.0, 0.0, 0.0}; /* <f_a, f_b>: 11, 12, 22 */
    double second[3] = {0.0, 0.0, 0.0};
    double h[3], determinant;

    for (size_t c = 0; c < 3; c++) {
        const double *jet = at->jets + c * JET_KINDS;

        g[0] += at->offset[c] * jet[JET_THETA];
        g[1] += at->offset[c] * jet[JET_PHI];
        first[0] += jet[JET_THETA] * jet[JET_THETA];
        first[1] += jet[JET_THETA] * jet[JET_PHI];
        first[2] += jet[JET_PHI] * jet[JET_PHI];
        second[0] += at->offset[c] * jet[JET_THETA_THETA];
        second[1] += at->offset[c] * jet[JET_THETA_PHI];
        second[2] += at->offset[c] * jet[JET_PHI_PHI];
    }
    for (size_t k = 0; k < 3; k++) {
        h[k] = first[k] + second[k];
    }
    determinant = h[0] * h[2] - h[1] * h[1];
    if (!(h[0] > 0.0) || !(determinant > 1e-3 * first[0] * first[2])) {
        memcpy(h, first, sizeof h);
        determinant = h[0] * h[2] - h[1] * h[1];
    }
    if (!(determinant > 0.0)) {
        return false;
    }
    step[0] = -(h[2] * g[0] - h[1] * g[1]) / determinant;
    step[1] = -(h[0] * g[1] - h[1] * g[0]) / determinant;
    return true;
}

/* to <- the point that a tangent vector leads to, normalized. */
static void move(const struct place *from, const double step[2], double part, double to[3])
{
    double norm;

    for (size_t c = 0; c < 3; c++) {
        to[c] = from->p[c] + part * (step[0] * from->t1[c] + step[1] * from->t2[c]);
    }
    norm = sqrt(vector_dot(to, to));
    for (size_t c = 0; c < 3; c++) {
        to[c] /= norm;
    }
}

static void refine(const struct nearest *s, const double *x, struct place *at)
{
    place_at(s, x, at);
    for (int k = 0; k < STEPS_MAX; k++) {
        struct place next;
        double step[2];
        double part = 1.0;
        int halvings = 0;

        if (!newton(at, step) || sqrt(step[0] * step[0] + step[1] * step[1]) < STEP_LEAST) {
            return;
        }
        do {
            move(at, step, part, next.p);
            place_at(s, x, &next);
            part *= 0.5;
        } while (!(next.distance2 < at->distance2) && ++halvings < HALVINGS_MAX);
        if (!(next.distance2 < at->distance2)) {
            return;
        }
        *at = next;
    }
}

static int check(size_t degree, const double *coefficients, size_t n, const double *positions)
{
    if (degree < 1 || degree > SRNF_DEGREE_MAX) {
        return SRNF_EINVAL;
    }
    for (size_t i = 0; i < 3 * srnf_coefficient_count(degree); i++) {
        if (!isfinite(coefficients[i])) {
            return SRNF_EINVAL;
        }
    }
    for (size_t i = 0; i < 3 * n; i++) {
        if (!isfinite(positions[i])) {
            return SRNF_EINVAL;
        }
    }
    return SRNF_OK;
}

int srnf_surface_nearest(size_t degree, const double *coefficients, size_t n,
                         const double *positions, const struct srnf_context *context,
                         double *points, double *distances)
{
    struct nearest s = {.points = NULL};
    int status = check(degree, coefficients, n, positions);

    if (status) {
        return status;
    }
    status = create(&s, degree, coefficients, context);
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        const double *x = positions + 3 * i;
        size_t found[CANDIDATES];
        size_t count = find_candidates(&s, x, found);

        distances[i] = INFINITY;
        for (size_t k = 0; k < count; k++) {
            struct place at;

            memcpy(at.p, s.points + 3 * found[k], sizeof at.p);
            refine(&s, x, &at);
            if (sqrt(at.distance2) < distances[i]) {
                distances[i] = sqrt(at.distance2);
                memcpy(points + 3 * i, at.p, sizeof at.p);
            }
        }
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    clear(&s);
    return status;
}
