/*
 * index_box.c - boxes along axes of their own, for faces that boxes along the axes of space hold
 * badly.
 *
 * The axes are the principal ones of the corners: eigenvectors of C = sum (x - m)(x - m)', by
 * Jacobi's method (C. G. J. Jacobi 1846; G. Golub, C. Van Loan, Matrix Computations, 8.5). Slivers
 * that meet in a point fill a wedge, which a box holds badly near its point: there many boxes
 * would lie over each other. So two slabs more lie along the sides of the wedge. Their normals are
 * in the plane of the two longer axes, across those long edges that turn the farthest to the one
 * side and to the other.
 *
 * Any slab that holds all corners is a bound, whatever its direction. Hence axes are in
 * single precision, and only their limits, which are rounded outwards, have to be right.
 */
#include "index.h"

#include <float.h>

#define JACOBI_SWEEPS 12

/* Rounding of a coordinate in the box's axes, in units of the box; of its limits, relative; and of
   a squared distance, relative. */
#define BOX_ROUNDING 1e-14
#define LIMIT_ROUNDING 2e-7
#define DISTANCE_ROUNDING 1e-6

/* An edge counts as long from this part of the face's longest one on. */
#define LONG_EDGE 0.5

/* Turns rows and columns p and q of a, and rows of the vectors, so that a[p][q] vanishes. */
static void rotate(double a[3][3], double vectors[3][3], size_t p, size_t q)
{
    double theta, t, c, s;

    if (a[p][q] == 0.0) {
        return;
    }
    theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
    t = (theta >= 0.0 ? 1.0 : -1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
    c = 1.0 / sqrt(t * t + 1.0);
    s = t * c;
    for (size_t k = 0; k < 3; k++) {
        double x = a[k][p], y = a[k][q];

        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
    }
    for (size_t k = 0; k < 3; k++) {
        double x = a[p][k], y = a[q][k];
        double u = vectors[p][k], v = vectors[q][k];

        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
        vectors[p][k] = c * u - s * v;
        vectors[q][k] = s * u + c * v;
    }
}

/* Eigenvectors of the symmetric a, which is destroyed, as rows: that of the largest eigenvalue
   first, that of the least last. */
static void principal_axes(double a[3][3], double vectors[3][3])
{
    for (size_t i = 0; i < 9; i++) {
        vectors[i / 3][i % 3] = i % 4 == 0 ? 1.0 : 0.0;
    }
    for (int sweep = 0; sweep < JACOBI_SWEEPS; sweep++) {
        if (!(fabs(a[0][1]) + fabs(a[0][2]) + fabs(a[1][2]) > 0.0)) {
            break;
        }
        rotate(a, vectors, 0, 1);
        rotate(a, vectors, 0, 2);
        rotate(a, vectors, 1, 2);
    }
    for (size_t i = 0; i < 3; i++) { /* three exchanges sort three */
        size_t p = i % 2;

        if (a[p][p] < a[p + 1][p + 1]) {
            double value = a[p][p];

            a[p][p] = a[p + 1][p + 1];
            a[p + 1][p + 1] = value;
            for (size_t k = 0; k < 3; k++) {
                double x = vectors[p][k];

                vectors[p][k] = vectors[p + 1][k];
                vectors[p + 1][k] = x;
            }
        }
    }
}

/* A corner in the units of the box. */
static void place(const struct index_box *box, const double x[3], double out[3])
{
    for (size_t k = 0; k < 3; k++) {
        out[k] = (x[k] - box->origin[k]) / box->unit;
    }
}

static void find_axes(const struct srnf_mesh *mesh, const uint32_t *faces, size_t n,
                      struct index_box *box, double axes[3][3])
{
    double mean[3] = {0.0, 0.0, 0.0}, covariance[3][3] = {{0.0}};

    for (size_t i = 0; i < 3 * n; i++) {
        double x[3];

        place(box, mesh_corner(mesh, faces[i / 3], i % 3), x);
        for (size_t k = 0; k < 3; k++) {
            mean[k] += x[k] / (3.0 * (double)n);
        }
    }
    for (size_t i = 0; i < 3 * n; i++) {
        double x[3];

        place(box, mesh_corner(mesh, faces[i / 3], i % 3), x);
        for (size_t k = 0; k < 9; k++) {
            covariance[k / 3][k % 3] += (x[k / 3] - mean[k / 3]) * (x[k % 3] - mean[k % 3]);
        }
    }
    principal_axes(covariance, axes);
}

/* The least and the largest slope of long edges against the first axis, in the plane of the first
   two. */
static void find_slopes(const struct srnf_mesh *mesh, const uint32_t *faces, size_t n,
                        double axes[3][3], double slopes[2])
{
    slopes[0] = INFINITY;
    slopes[1] = -INFINITY;
    for (size_t i = 0; i < n; i++) {
        double edge[3][3], length[3], longest = 0.0;

        for (size_t k = 0; k < 3; k++) {
            vector_subtract(mesh_corner(mesh, faces[i], (k + 1) % 3),
                            mesh_corner(mesh, faces[i], k), edge[k]);
            length[k] = vector_norm(edge[k]);
            longest = larger(longest, length[k]);
        }
        for (size_t k = 0; k < 3; k++) {
            double along = vector_dot(edge[k], axes[0]), across = vector_dot(edge[k], axes[1]);

            if (length[k] >= LONG_EDGE * longest && fabs(across) < fabs(along)) {
                slopes[0] = smaller(slopes[0], across / along);
                slopes[1] = larger(slopes[1], across / along);
            }
        }
    }
    for (size_t s = 0; s < 2; s++) {
        slopes[s] = isfinite(slopes[s]) ? slopes[s] : 0.0;
    }
}

/* Limits that hold all corners. */
static void find_limits(const struct srnf_mesh *mesh, const uint32_t *faces, size_t n,
                        struct index_box *box)
{
    double low[INDEX_BOX_SLABS], high[INDEX_BOX_SLABS];

    for (size_t s = 0; s < INDEX_BOX_SLABS; s++) {
        low[s] = INFINITY;
        high[s] = -INFINITY;
    }
    for (size_t i = 0; i < 3 * n; i++) {
        double x[3];

        place(box, mesh_corner(mesh, faces[i / 3], i % 3), x);
        for (size_t s = 0; s < INDEX_BOX_SLABS; s++) {
            const float *a = box->axis[s];
            double at = x[0] * (double)a[0] + x[1] * (double)a[1] + x[2] * (double)a[2];

            low[s] = smaller(low[s], at);
            high[s] = larger(high[s], at);
        }
    }
    for (size_t s = 0; s < INDEX_BOX_SLABS; s++) {
        box->low[s] = (float)(low[s] - LIMIT_ROUNDING * fabs(low[s]) - BOX_ROUNDING);
        box->high[s] = (float)(high[s] + LIMIT_ROUNDING * fabs(high[s]) + BOX_ROUNDING);
    }
}

void index_box_fit(const struct srnf_mesh *mesh, const uint32_t *faces, size_t n,
                   struct index_box *box)
{
    const double *origin = mesh_corner(mesh, faces[0], 0);
    double axes[3][3], slopes[2];

    *box = (struct index_box){.origin = {origin[0], origin[1], origin[2]}};
    for (size_t i = 0; i < 3 * n; i++) {
        const double *x = mesh_corner(mesh, faces[i / 3], i % 3);

        for (size_t k = 0; k < 3; k++) {
            box->unit = larger(box->unit, fabs(x[k] - origin[k]));
        }
    }
    box->unit = box->unit > 0.0 ? box->unit : 1.0;
    find_axes(mesh, faces, n, box, axes);
    find_slopes(mesh, faces, n, axes, slopes);
    for (size_t k = 0; k < 3; k++) {
        for (size_t s = 0; s < INDEX_BOX_AXES; s++) {
            box->axis[s][k] = (float)axes[s][k];
        }
        for (size_t s = 0; s < 2; s++) {
            box->axis[INDEX_BOX_AXES + s][k] =
                (float)((axes[1][k] - slopes[s] * axes[0][k]) / sqrt(1.0 + slopes[s] * slopes[s]));
        }
    }
    find_limits(mesh, faces, n, box);
}

void index_box_clip(const struct index_box *box, const double origin[3], const double direction[3],
                    double padding, double *enter, double *leave)
{
    double from[3], along[3];

    place(box, origin, from);
    for (size_t k = 0; k < 3; k++) {
        along[k] = direction[k] / box->unit;
    }
    padding /= box->unit;
    for (size_t s = 0; s < INDEX_BOX_SLABS; s++) {
        const float *a = box->axis[s];
        double start = from[0] * (double)a[0] + from[1] * (double)a[1] + from[2] * (double)a[2];
        double speed = along[0] * (double)a[0] + along[1] * (double)a[1] + along[2] * (double)a[2];
        double low = (double)box->low[s] - padding - start;
        double high = (double)box->high[s] + padding - start;

        if (speed == 0.0) {
            if (low > 0.0 || high < 0.0) {
                *leave = -1.0;
            }
            continue;
        }
        *enter = larger(*enter, (speed > 0.0 ? low : high) / speed);
        *leave = smaller(*leave, (speed > 0.0 ? high : low) / speed);
    }
}

double index_box_distance2(const struct index_box *box, const double point[3])
{
    double from[3], sum = 0.0, most = 0.0, rounding;

    place(box, point, from);
    rounding = BOX_ROUNDING * (fabs(from[0]) + fabs(from[1]) + fabs(from[2]));
    for (size_t s = 0; s < INDEX_BOX_SLABS; s++) {
        const float *a = box->axis[s];
        double at = from[0] * (double)a[0] + from[1] * (double)a[1] + from[2] * (double)a[2];
        double outside = larger((double)box->low[s] - at, at - (double)box->high[s]) - rounding;

        outside = larger(outside, 0.0);
        if (s < INDEX_BOX_AXES) {
            sum += outside * outside;
        } else {
            most = larger(most, outside * outside);
        }
    }
    return larger(sum, most) * box->unit * box->unit * (1.0 - DISTANCE_ROUNDING);
}
