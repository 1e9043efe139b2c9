/*
 * landmarks.c - the points of landmarks through the steps of a search, and the correction of a step
 * that they ask for (landmarks.h).
 *
 * Cost of a correction: 2 n solutions with the factor of M, and (2 n)^2 products of the length of
 * the unknowns.
 */
#include "landmarks.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

#define DIRECTIONS ((size_t)4) /* two of the frame, and the same turned */

/* ---- What is asked of landmarks -------------------------------------------------------------- */

double landmarks_angle(const double a[3], const double b[3])
{
    double cross[3];

    vector_cross(a, b, cross);
    return atan2(sqrt(vector_dot(cross, cross)), vector_dot(a, b));
}

/* The first of n points that coincides with one before it, which is *other; n: none does. */
static size_t coincident(size_t n, const double *points, size_t *other)
{
    for (size_t i = 0; i < n; i++) {
        for (*other = 0; *other < i; ++*other) {
            if (landmarks_angle(points + 3 * i, points + 3 * *other) < SRNF_LANDMARKS_APART) {
                return i;
            }
        }
    }
    return n;
}

bool landmarks_apart(size_t n, const double *points)
{
    size_t other;

    return coincident(n, points, &other) == n;
}

/* One list of points: unit vectors, apart from each other. */
static int check_points(size_t n, const double *points, const char *whose, struct srnf_error *error)
{
    size_t first, other;

    for (size_t i = 0; i < n; i++) {
        double length = vector_dot(points + 3 * i, points + 3 * i);

        if (!(fabs(length - 1.0) < 1e-6)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "landmark %zu of the %s is no unit vector", i, whose);
        }
    }
    first = coincident(n, points, &other);
    return first == n ? SRNF_OK
                      : srnf_fail(error, SRNF_EINVAL, (int64_t)first,
                                  "landmarks %zu and %zu of the %s coincide", other, first, whose);
}

int srnf_landmarks_check(const struct srnf_landmarks *landmarks, size_t degree,
                         struct srnf_error *error)
{
    size_t most = ((degree + 1) * (degree + 1) - 1) / 2;
    int status;

    if (landmarks->n < 1 || landmarks->n > SRNF_LANDMARKS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu landmarks are not 1 to %zu", landmarks->n,
                         SRNF_LANDMARKS_MAX);
    }
    if (landmarks->n > most) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu landmarks are too many for fields of degree %zu, which take %zu",
                         landmarks->n, degree, most);
    }
    if (!(landmarks->weight > 0.0)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the weight of the landmarks is not above 0");
    }
    status = check_points(landmarks->n, landmarks->fixed, "template", error);
    return status ? status : check_points(landmarks->n, landmarks->moving, "moving surface", error);
}

int srnf_landmarks_measure(const struct srnf_warp *warp, const struct srnf_landmarks *landmarks,
                           double *angles)
{
    double *points = srnf_alloc(3 * landmarks->n, sizeof(double));
    int status =
        points ? srnf_warp_apply(warp, landmarks->n, landmarks->fixed, points, NULL) : SRNF_ENOMEM;

    for (size_t i = 0; i < landmarks->n && status == SRNF_OK; i++) {
        angles[i] = landmarks_angle(points + 3 * i, landmarks->moving + 3 * i);
    }
    srnf_free(points);
    return status;
}

static double weight_of_each(const struct srnf_landmarks *landmarks)
{
    return isinf(landmarks->weight) ? 0.0 : landmarks->weight / (double)landmarks->n;
}

static double cost_at(const struct srnf_landmarks *landmarks, const double *points)
{
    double sum = 0.0;

    for (size_t i = 0; i < landmarks->n; i++) {
        double angle = landmarks_angle(points + 3 * i, landmarks->moving + 3 * i);

        sum += angle * angle;
    }
    return weight_of_each(landmarks) * sum;
}

int landmarks_cost(const struct srnf_landmarks *landmarks, const struct srnf_warp *chain,
                   double *cost)
{
    double *points = srnf_alloc(3 * landmarks->n, sizeof(double));
    int status =
        points ? srnf_warp_apply(chain, landmarks->n, landmarks->fixed, points, NULL) : SRNF_ENOMEM;

    *cost = status == SRNF_OK ? cost_at(landmarks, points) : 0.0;
    srnf_free(points);
    return status;
}

/* ---- The points ------------------------------------------------------------------------------ */

int landmark_track_create(struct landmark_track *t, const struct srnf_landmarks *landmarks,
                          const struct srnf_warp *chain, size_t degree,
                          const struct srnf_context *context)
{
    size_t n = landmarks->n;
    size_t unknowns = registration_unknowns(degree);
    size_t count = srnf_coefficient_count(degree);
    int status;

    *t = (struct landmark_track){
        .landmarks = landmarks, .weight = weight_of_each(landmarks), .unknowns = unknowns};
    status = fields_create(&t->fields, degree, context);
    t->memory = srnf_alloc(6 * n + 4 * n * unknowns + 4 * n * n + 4 * n + 5 * DIRECTIONS * count +
                               FIELDS_SCRATCH * n + 2 * n,
                           sizeof(double));
    if (status || !t->memory) {
        landmark_track_clear(t);
        return SRNF_ENOMEM;
    }
    t->at = t->memory;
    t->next = t->at + 3 * n;
    t->rows = t->next + 3 * n;
    t->solved = t->rows + 2 * n * unknowns;
    t->schur = t->solved + 2 * n * unknowns;
    t->residual = t->schur + 4 * n * n;
    t->gap = t->residual + 2 * n;
    t->scratch = t->gap + 2 * n;
    status = warp_apply(chain, context, n, landmarks->fixed, t->at, NULL);
    if (status) {
        landmark_track_clear(t);
    }
    return status;
}

void landmark_track_clear(struct landmark_track *t)
{
    fields_clear(&t->fields);
    srnf_free(t->memory);
    *t = (struct landmark_track){0};
}

void landmarks_frame(const double p[3], double t1[3], double t2[3])
{
    size_t least = 0;
    double axis[3] = {0.0, 0.0, 0.0};
    double length;

    for (size_t k = 1; k < 3; k++) {
        least = fabs(p[k]) < fabs(p[least]) ? k : least;
    }
    axis[least] = 1.0;
    vector_cross(p, axis, t1);
    length = sqrt(vector_dot(t1, t1));
    for (size_t k = 0; k < 3; k++) {
        t1[k] /= length;
    }
    vector_cross(p, t1, t2);
}

void landmarks_logarithm(const double p[3], const double b[3], const double t1[3],
                         const double t2[3], double out[2])
{
    double x = vector_dot(b, t1);
    double y = vector_dot(b, t2);
    double length = sqrt(x * x + y * y);
    double scale = length > 0.0 ? landmarks_angle(p, b) / length : 0.0;

    out[0] = scale * x;
    out[1] = scale * y;
}

/* Since <p x G, t> = <G, t x p>, both kinds of fields come from the gradients of the harmonics. */
void landmark_track_linearize(struct landmark_track *t)
{
    size_t count = t->fields.count;
    size_t each = count - 1;
    double *derivatives = t->scratch; /* [DIRECTIONS][count] */

    for (size_t j = 0; j < t->landmarks->n; j++) {
        const double *p = t->at + 3 * j;
        double directions[DIRECTIONS][3];

        landmarks_frame(p, directions[0], directions[1]);
        vector_cross(directions[0], p, directions[2]);
        vector_cross(directions[1], p, directions[3]);
        sphere_points_adjoint(&t->fields.plan.points, DIRECTIONS, 1, p, NULL, directions[0],
                              derivatives, derivatives + DIRECTIONS * count);
        for (size_t a = 0; a < 2; a++) {
            double *row = t->rows + (2 * j + a) * t->unknowns;

            for (size_t i = 1; i < count; i++) {
                row[i - 1] = t->fields.scale[i] * derivatives[a * count + i];
                row[each + i - 1] = t->fields.scale[i] * derivatives[(2 + a) * count + i];
            }
        }
        landmarks_logarithm(p, t->landmarks->moving + 3 * j, directions[0], directions[1],
                            t->residual + 2 * j);
    }
}

/* ---- The correction -------------------------------------------------------------------------- */

/* gap <- (A M^-1 A' + 1 / nu)^-1 (A c_u - part r); the step gets what follows from it. */
static bool solve_schur(struct landmark_track *t, double part, double *step)
{
    size_t m = 2 * t->landmarks->n;

    for (size_t i = 0; i < m; i++) {
        const double *row = t->rows + i * t->unknowns;

        t->gap[i] = linear_dot(t->unknowns, row, step) - part * t->residual[i];
        for (size_t k = 0; k <= i; k++) {
            t->schur[k * m + i] = linear_dot(t->unknowns, row, t->solved + k * t->unknowns);
        }
        t->schur[i * m + i] += t->weight > 0.0 ? 1.0 / t->weight : 0.0;
    }
    if (LAPACKE_dposv_work(LAPACK_COL_MAJOR, 'L', (lapack_int)m, 1, t->schur, (lapack_int)m, t->gap,
                           (lapack_int)m) != 0) {
        return false;
    }
    for (size_t k = 0; k < m; k++) {
        linear_axpy(t->unknowns, -t->gap[k], t->solved + k * t->unknowns, step);
    }
    return true;
}

bool landmark_track_correct(struct landmark_track *t, landmark_solver *solve, void *system,
                            double part, double *step, double *promise)
{
    size_t m = 2 * t->landmarks->n;

    for (size_t k = 0; k < m; k++) {
        if (!solve(system, t->rows + k * t->unknowns, t->solved + k * t->unknowns)) {
            return false;
        }
    }
    if (!solve_schur(t, part, step)) {
        return false;
    }
    for (size_t k = 0; promise && k < m; k++) {
        double reached = linear_dot(t->unknowns, t->rows + k * t->unknowns, step);
        double left = reached - t->residual[k];

        *promise = (k > 0 ? *promise : 0.0) + t->gap[k] * reached +
                   t->weight * (t->residual[k] * t->residual[k] - left * left);
    }
    return true;
}

double landmark_track_try(struct landmark_track *t, const double *potentials)
{
    size_t n = t->landmarks->n;
    double *jacobian = t->scratch + FIELDS_SCRATCH * n; /* that nobody asks for */

    for (size_t i = 0; i < n; i++) {
        jacobian[i] = 1.0;
    }
    (void)fields_apply(&t->fields, potentials, n, t->at, jacobian, t->next, jacobian, t->scratch);
    return cost_at(t->landmarks, t->next);
}

void landmark_track_accept(struct landmark_track *t)
{
    memcpy(t->at, t->next, 3 * t->landmarks->n * sizeof(double));
}

double landmark_track_cost(const struct landmark_track *t)
{
    return cost_at(t->landmarks, t->at);
}
