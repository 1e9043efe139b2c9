/*
 * icp.c - rigid alignment of two meshes by iterated closest points (P. Besl, N. McKay, "A method
 * for registration of 3-D shapes", IEEE TPAMI 1992), counted both ways.
 *
 * With a_i the vertices of the fixed mesh A and b_j those of the moving one B, weighted by a third
 * of the area around them (summing to 1), minimized over R in SO(3) and t is
 *
 *   r(R, t) = 1/2 [sum w_i min over y in B of |a_i - (R y + t)|^2
 *                + sum v_j min over x in A of |x - (R b_j + t)|^2].
 *
 * Each iteration finds the closest points on the triangles by the bounding-volume hierarchies of
 * both meshes, and then the best R and t for all pairs at once: centroids, and the closest rotation
 * to the cross moments (W. Kabsch, Acta Cryst. 1976). Neither half can raise r. Exchanging A and B
 * inverts all poses and changes nothing else.
 *
 * Starts: the pose at hand, and the four rotations that lay the principal axes of the weighted
 * vertices on one another. Each gets a few iterations, and the best goes on.
 *
 * Cost of an iteration: one query of O(log faces) for every vertex of either mesh, which begins at
 * the face that was closest before.
 */
#include "registration.h"

#include "mesh/index.h"

#include <lapacke.h>
#include <math.h>

#define ITERATIONS 100
#define ITERATIONS_MAX 10000
#define TOLERANCE 1e-3
#define TRIAL_ITERATIONS 3
#define STARTS 5

struct srnf_icp_options srnf_icp_options_defaults(void)
{
    return (struct srnf_icp_options){.max_iterations = ITERATIONS, .tolerance = TOLERANCE};
}

struct side {
    const struct srnf_mesh *mesh;
    struct srnf_index *index;
    double *weight;  /* [n_vertices], sum 1 */
    double *nearest; /* [n_vertices][3] on the other mesh, in that one's frame */
    uint32_t *face;  /* [n_vertices] of the other mesh, on which that lies */
    double centroid[3];
    double axes[9]; /* rows: principal axes, right-handed */
};

struct pose {
    double rotation[9], translation[3];
    double residual;
};

struct run {
    struct side fixed, moving;
    const struct srnf_context *context;
};

/* ---- Preparation ----------------------------------------------------------------------------- */

static int check_mesh(const struct srnf_mesh *mesh, const char *name, struct srnf_error *error)
{
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        if (!(fabs(mesh->vertices[i]) <= SRNF_MESH_COORDINATE_MAX)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(i / 3),
                             "vertex %zu of the %s mesh has a coordinate out of range", i / 3,
                             name);
        }
    }
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        if (mesh->faces[i] >= mesh->n_vertices) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(i / 3),
                             "face %zu of the %s mesh names a vertex that it does not have", i / 3,
                             name);
        }
    }
    return SRNF_OK;
}

/* A third of the area of its faces to each vertex, in all 1. */
static int weigh(struct side *side)
{
    const struct srnf_mesh *mesh = side->mesh;
    double total = 0.0;

    for (size_t f = 0; f < mesh->n_faces; f++) {
        double ab[3];
        double ac[3];
        double normal[3];
        double area;

        vector_subtract(mesh_corner(mesh, f, 1), mesh_corner(mesh, f, 0), ab);
        vector_subtract(mesh_corner(mesh, f, 2), mesh_corner(mesh, f, 0), ac);
        vector_cross(ab, ac, normal);
        area = vector_norm(normal) / 2.0;
        total += area;
        for (size_t k = 0; k < 3; k++) {
            side->weight[mesh->faces[3 * f + k]] += area / 3.0;
        }
    }
    if (!(total > 0.0) || !isfinite(total)) {
        return SRNF_EDEGENERATE;
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        side->weight[i] /= total;
        for (size_t k = 0; k < 3; k++) {
            side->centroid[k] += side->weight[i] * mesh->vertices[3 * i + k];
        }
    }
    return SRNF_OK;
}

static int find_axes(struct side *side)
{
    double values[3];
    double work[64];

    for (size_t i = 0; i < side->mesh->n_vertices; i++) {
        double x[3];

        vector_subtract(side->mesh->vertices + 3 * i, side->centroid, x);
        for (size_t k = 0; k < 9; k++) {
            side->axes[k] += side->weight[i] * x[k / 3] * x[k % 3];
        }
    }
    if (LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'V', 'L', 3, side->axes, 3, values, work, 64) != 0) {
        return SRNF_ENUMERIC;
    }
    vector_cross(side->axes, side->axes + 3, side->axes + 6);
    return SRNF_OK;
}

static int side_create(struct side *side, const struct srnf_mesh *mesh)
{
    int status;

    side->mesh = mesh;
    side->weight = srnf_alloc(mesh->n_vertices, sizeof(double));
    side->nearest = srnf_alloc(mesh->n_vertices, 3 * sizeof(double));
    side->face = srnf_alloc(mesh->n_vertices, sizeof *side->face);
    if (!side->weight || !side->nearest || !side->face) {
        return SRNF_ENOMEM;
    }
    status = weigh(side);
    status = status ? status : find_axes(side);
    return status ? status : srnf_index_create(&side->index, mesh);
}

static void side_clear(struct side *side)
{
    srnf_index_destroy(side->index);
    srnf_free(side->weight);
    srnf_free(side->nearest);
    srnf_free(side->face);
}

/* ---- One iteration --------------------------------------------------------------------------- */

/* out = R x + t, or R' (x - t) */
static void carry(const struct pose *pose, bool back, const double x[3], double out[3])
{
    const double *r = pose->rotation;

    if (back) {
        double y[3];

        vector_subtract(x, pose->translation, y);
        for (size_t k = 0; k < 3; k++) {
            out[k] = r[k] * y[0] + r[3 + k] * y[1] + r[6 + k] * y[2];
        }
        return;
    }
    for (size_t k = 0; k < 3; k++) {
        out[k] = vector_dot(r + 3 * k, x) + pose->translation[k];
    }
}

/* Closest points of both meshes at a pose, and the residual. */
static void pair_up(struct run *run, struct pose *pose)
{
    struct side *sides[2] = {&run->fixed, &run->moving};

    pose->residual = 0.0;
    for (size_t s = 0; s < 2; s++) {
        struct side *own = sides[s];

        for (size_t i = 0; i < own->mesh->n_vertices; i++) {
            double there[3];

            carry(pose, s == 0, own->mesh->vertices + 3 * i, there);
            pose->residual += 0.5 * own->weight[i] *
                              index_distance2_from(sides[1 - s]->index, there, own->nearest + 3 * i,
                                                   &own->face[i]);
        }
    }
}

/* The pose that brings all pairs together best. */
static void solve_pose(const struct run *run, struct pose *pose)
{
    const struct side *sides[2] = {&run->fixed, &run->moving};
    double center[2][3] = {{0.0}, {0.0}}; /* of the fixed and of the moving points */
    double moments[9] = {0.0};

    for (size_t s = 0; s < 2; s++) {
        for (size_t i = 0; i < sides[s]->mesh->n_vertices; i++) {
            for (size_t k = 0; k < 3; k++) {
                center[s][k] += 0.5 * sides[s]->weight[i] * sides[s]->mesh->vertices[3 * i + k];
                center[1 - s][k] += 0.5 * sides[s]->weight[i] * sides[s]->nearest[3 * i + k];
            }
        }
    }
    for (size_t s = 0; s < 2; s++) {
        for (size_t i = 0; i < sides[s]->mesh->n_vertices; i++) {
            const double *own = sides[s]->mesh->vertices + 3 * i;
            const double *other = sides[s]->nearest + 3 * i;
            double a[3];
            double b[3];

            vector_subtract(s == 0 ? own : other, center[0], a);
            vector_subtract(s == 0 ? other : own, center[1], b);
            for (size_t k = 0; k < 9; k++) {
                moments[k] += sides[s]->weight[i] * a[k / 3] * b[k % 3];
            }
        }
    }
    (void)registration_closest_rotation(moments, pose->rotation);
    for (size_t k = 0; k < 3; k++) {
        pose->translation[k] = center[0][k] - vector_dot(pose->rotation + 3 * k, center[1]);
    }
}

/* Iterates from a pose that has been paired up, and leaves it so. */
static int iterate(struct run *run, size_t most, double tolerance, struct pose *pose,
                   struct srnf_icp *result)
{
    result->converged = false;
    for (size_t k = 0; k < most && !result->converged; k++) {
        double before = pose->residual;

        if (srnf_is_canceled(run->context)) {
            return SRNF_ECANCELED;
        }
        solve_pose(run, pose);
        pair_up(run, pose);
        result->iterations++;
        result->converged = !(before - pose->residual > tolerance * before);
    }
    return SRNF_OK;
}

/* ---- Starts ---------------------------------------------------------------------------------- */

/* Start 0 is where the meshes stand; start k lays the axes on one another, two of them turned
   except for k = 1. */
static void start_pose(const struct run *run, size_t k, struct pose *pose)
{
    *pose = (struct pose){.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    if (k == 0) {
        return;
    }
    for (size_t i = 0; i < 9; i++) {
        pose->rotation[i] = 0.0;
        for (size_t axis = 0; axis < 3; axis++) {
            double sign = k == 1 || axis == k - 2 ? 1.0 : -1.0;

            pose->rotation[i] +=
                sign * run->fixed.axes[3 * axis + i / 3] * run->moving.axes[3 * axis + i % 3];
        }
    }
    for (size_t i = 0; i < 3; i++) {
        pose->translation[i] =
            run->fixed.centroid[i] - vector_dot(pose->rotation + 3 * i, run->moving.centroid);
    }
}

static int align(struct run *run, const struct srnf_icp_options *options, struct srnf_icp *result)
{
    size_t starts = options->max_iterations > 0 ? STARTS : 1;
    size_t trial =
        options->max_iterations < TRIAL_ITERATIONS ? options->max_iterations : TRIAL_ITERATIONS;
    struct pose best;
    int status = SRNF_OK;

    for (size_t k = 0; k < starts && status == SRNF_OK; k++) {
        struct pose pose;

        start_pose(run, k, &pose);
        pair_up(run, &pose);
        status = iterate(run, trial, options->tolerance, &pose, result);
        if (k == 0 || pose.residual < best.residual) {
            best = pose;
        }
    }
    if (status == SRNF_OK) {
        pair_up(run, &best);
        result->iterations = 0;
        status = iterate(run, options->max_iterations, options->tolerance, &best, result);
        result->distance = sqrt(best.residual);
        linear_copy(9, best.rotation, result->rotation);
        linear_copy(3, best.translation, result->translation);
    }
    return status;
}

int srnf_icp(const struct srnf_mesh *fixed, const struct srnf_mesh *moving,
             const struct srnf_icp_options *options, const struct srnf_context *context,
             struct srnf_icp *result, struct srnf_error *error)
{
    struct srnf_icp_options defaults = srnf_icp_options_defaults();
    struct run run = {.context = context};
    int status;

    options = options ? options : &defaults;
    *result = (struct srnf_icp){0};
    if (options->max_iterations > ITERATIONS_MAX || !(options->tolerance >= 0.0) ||
        !isfinite(options->tolerance)) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "max_iterations is not 0 to %d, or tolerance not a number from 0 up",
                         ITERATIONS_MAX);
    }
    status = check_mesh(fixed, "fixed", error);
    status = status ? status : check_mesh(moving, "moving", error);
    if (status) {
        return status;
    }
    status = side_create(&run.fixed, fixed);
    status = status ? status : side_create(&run.moving, moving);
    status = status ? status : align(&run, options, result);
    if (status) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
    }
    side_clear(&run.fixed);
    side_clear(&run.moving);
    return status;
}
