/*
 * mean_landmarks.c - landmarks of a group mean: points that correspond in all of its subjects.
 *
 * The mean has a point a_j for each landmark, and subject i its own b_ij. Those that guide add to G
 * (mean.h), for each subject,
 *
 *   (nu / m) sum_j angle(gamma_i(a_j), b_ij)^2,
 *
 * or, for nu = infinity, every gamma_i takes every a_j to b_ij. Both the first registrations and
 * the steps after them are corrected for it as those of a pair are (registration/landmarks.h); a
 * step of exact landmarks is zero at the b_ij, so that parts of it keep them too.
 *
 * They start at the averages of the b_ij, or, where two of those coincide, at those of one subject.
 * Where the a_j are is a matter of the common warp of all subjects, which no distance sees: exact
 * ones stay where the start of the mean has them, and the centre (mean_center.c) moves under them.
 * The others follow the warps: after each step a_j <- exp_a_j(x), x the Gauss-Newton step of
 * sum_i angle(gamma_i(a_j), b_ij)^2, unless that does not fall. So G never rises. Landmarks that
 * are held out follow in the same way and have no part in G: what is left of them measures how well
 * the warps correspond.
 *
 * Cost: gamma_i and its derivative at the landmarks, by differences, from the whole chain: for m
 * landmarks and a chain of k links 5 m k evaluations of a field. In an iteration the steps of the
 * working grid take as many as that for its P nodes and a link.
 */
#include "mean.h"

#include "registration/landmarks.h"

#include <math.h>
#include <string.h>

#define DIFFERENCE 1e-4 /* radians: the error of central differences is its square */
#define STEP_MAX 0.5    /* radians */
#define REST 1e-9       /* radians: no landmark moves further */
#define ROUNDS_IN_THE_END 60
#define AROUND ((size_t)5) /* a landmark, and four points about it */
#define SYSTEM ((size_t)5) /* three entries of D'D, two of D'r */

/* ---- Which there are ------------------------------------------------------------------------- */

bool mean_is_guided(const struct mean_run *run)
{
    return run->landmarks && run->landmarks->guiding > 0;
}

static const double *own(const struct mean_run *run, size_t i)
{
    return run->landmarks->points + 3 * i * run->landmarks->n;
}

struct srnf_landmarks mean_landmarks_of(const struct mean_run *run, size_t i)
{
    return (struct srnf_landmarks){run->landmarks->guiding, run->marks, own(run, i),
                                   run->landmarks->weight};
}

/* The first that has a part in what moves; all before it are exact. */
static size_t first_moving(const struct mean_run *run)
{
    return isinf(run->landmarks->weight) ? run->landmarks->guiding : 0;
}

static int check_units(const struct mean_run *run, struct srnf_error *error)
{
    for (size_t i = 0; i < run->n; i++) {
        for (size_t j = 0; j < run->landmarks->n; j++) {
            const double *b = own(run, i) + 3 * j;

            if (!(fabs(vector_dot(b, b) - 1.0) < 1e-6)) {
                return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                                 "landmark %zu of surface %zu is no unit vector", j, i);
            }
        }
    }
    return SRNF_OK;
}

int mean_landmarks_create(struct mean_run *run, struct srnf_error *error)
{
    const struct srnf_group_landmarks *l = run->landmarks;
    struct srnf_error first = {0};
    int status;

    if (!l) {
        return SRNF_OK;
    }
    if (l->n < 1 || l->n > SRNF_LANDMARKS_MAX || l->guiding > l->n) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "%zu landmarks, %zu of which guide, are not 1 to %zu", l->n, l->guiding,
                         SRNF_LANDMARKS_MAX);
    }
    if (l->guiding > 0 && (!mean_is_warped(run) || run->registration.exact)) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "landmarks guide warps that are sought, and here none are");
    }
    status = check_units(run, error);
    for (size_t i = 0; i < run->n && status == SRNF_OK && l->guiding > 0; i++) {
        const struct srnf_landmarks both = {l->guiding, own(run, i), own(run, i), l->weight};

        if (srnf_landmarks_check(&both, run->degree, &first)) {
            status = srnf_fail(error, SRNF_EINVAL, (int64_t)i, "surface %zu: %s", i, first.message);
        }
    }
    run->marks = srnf_alloc(3 * l->n, sizeof(double));
    return status ? status : run->marks ? SRNF_OK : SRNF_ENOMEM;
}

/* ---- Where those of the mean are ------------------------------------------------------------- */

/* The mean of landmark j over all subjects, on the sphere; where that has no direction it stays. */
static void average(const struct mean_run *run, size_t j, double a[3])
{
    double sum[3] = {0.0, 0.0, 0.0}, length;

    for (size_t i = 0; i < run->n; i++) {
        for (size_t c = 0; c < 3; c++) {
            sum[c] += own(run, i)[3 * j + c] / (double)run->n;
        }
    }
    length = sqrt(vector_dot(sum, sum));
    for (size_t c = 0; c < 3 && length > REST; c++) {
        a[c] = sum[c] / length;
    }
}

void mean_landmarks_start(struct mean_run *run, size_t start)
{
    bool plain = start == STATS_START_DEFAULT; /* the plain mean: all alike */
    const double *from = run->landmarks ? own(run, plain ? 0 : start) : NULL;
    size_t size = run->landmarks ? 3 * run->landmarks->n * sizeof *run->marks : 0;

    if (!from) {
        return;
    }
    memcpy(run->marks, from, size);
    for (size_t j = 0; plain && j < run->landmarks->n; j++) {
        average(run, j, run->marks + 3 * j);
    }
    /* One point cannot be taken to two: averages that coincide give way to the first subject's. */
    if (!landmarks_apart(run->landmarks->guiding, run->marks)) {
        memcpy(run->marks, from, size);
    }
}

/* Where points of the mean lie on subject i. */
static int carry(const struct mean_run *run, size_t i, size_t n, double *points)
{
    struct srnf_warp chain = {0};
    int status = mean_chain_open(run, i, &chain);

    if (status == SRNF_OK) {
        status = warp_apply(&chain, run->context, n, points, points, NULL);
        mean_chain_close(run, &chain);
    }
    return status;
}

/* ---- Their part in G ------------------------------------------------------------------------- */

int mean_landmarks_measure(const struct mean_run *run, size_t i, const double *step)
{
    struct mean_stand *at = &run->subjects[i].at;
    size_t m = mean_is_guided(run) && !isinf(run->landmarks->weight) ? run->landmarks->guiding : 0;
    double *points = m ? srnf_alloc((4 + FIELDS_SCRATCH) * m, sizeof(double)) : NULL;
    double *jacobian = points ? points + 3 * m : NULL;
    struct fields fields = {0};
    int status = m && !points ? SRNF_ENOMEM : SRNF_OK;

    at->apart = 0.0;
    if (m == 0 || status) {
        return status;
    }
    memcpy(points, run->marks, 3 * m * sizeof(double));
    status = carry(run, i, m, points);
    if (status == SRNF_OK && step) {
        status = fields_create(&fields, run->degree, run->context);
    }
    if (status == SRNF_OK && step) {
        for (size_t j = 0; j < m; j++) {
            jacobian[j] = 1.0; /* that nobody asks for */
        }
        (void)fields_apply(&fields, step, m, points, jacobian, points, jacobian, jacobian + m);
    }
    fields_clear(&fields);
    for (size_t j = 0; j < m && status == SRNF_OK; j++) {
        double angle = landmarks_angle(points + 3 * j, own(run, i) + 3 * j);

        at->apart += run->landmarks->weight / (double)m * angle * angle;
    }
    srnf_free(points);
    return status;
}

struct factored {
    const struct mean_run *run;
    struct mean_matrix *matrix;
    double curvature;
};

static bool solve_factored(void *system, const double *rhs, double *out)
{
    const struct factored *f = system;

    return mean_matrix_solve(f->run, f->matrix, f->curvature, rhs, out);
}

int mean_landmarks_correct(const struct mean_run *run, size_t i, struct mean_matrix *matrix,
                           double curvature, double *step)
{
    const struct srnf_landmarks pairs = mean_landmarks_of(run, i);
    struct factored system = {run, matrix, curvature};
    struct landmark_track track = {.landmarks = NULL};
    struct srnf_warp chain = {0};
    int status = mean_chain_open(run, i, &chain);

    if (status) {
        return status;
    }
    status = landmark_track_create(&track, &pairs, &chain, run->degree, run->context);
    mean_chain_close(run, &chain);
    if (status) {
        return status;
    }
    landmark_track_linearize(&track);
    status = landmark_track_correct(&track, solve_factored, &system, 1.0, step, NULL)
                 ? SRNF_OK
                 : SRNF_ENUMERIC;
    landmark_track_clear(&track);
    return status;
}

/* ---- Following the warps --------------------------------------------------------------------- */

struct following {
    struct mean_run *run;
    size_t first, count; /* landmarks that follow */
    bool sloped;         /* systems as well */
    const double *at;    /* [count][3] */
    double *squares;     /* [subjects][count] of the angles */
    double *systems;     /* [subjects][count][SYSTEM] */
};

/* exp_a of x t1 + y t2 */
static void move_along(const double a[3], const double t1[3], const double t2[3], double x,
                       double y, double out[3])
{
    double length = sqrt(x * x + y * y);
    double scale = length > 0.0 ? sin(length) / length : 1.0;

    for (size_t c = 0; c < 3; c++) {
        out[c] = cos(length) * a[c] + scale * (x * t1[c] + y * t2[c]);
    }
}

/* a, and the ends of two differences across it */
static void place_around(const double a[3], double points[3 * AROUND])
{
    double t1[3], t2[3];

    landmarks_frame(a, t1, t2);
    memcpy(points, a, 3 * sizeof *points);
    move_along(a, t1, t2, DIFFERENCE, 0.0, points + 3);
    move_along(a, t1, t2, -DIFFERENCE, 0.0, points + 6);
    move_along(a, t1, t2, 0.0, DIFFERENCE, points + 9);
    move_along(a, t1, t2, 0.0, -DIFFERENCE, points + 12);
}

/* D'D and D'r of one landmark of one subject, D the derivative of gamma there. */
static void fill_system(const double points[3 * AROUND], const double b[3], double system[SYSTEM])
{
    double t1[3], t2[3], r[2], d[2][2];

    landmarks_frame(points, t1, t2);
    landmarks_logarithm(points, b, t1, t2, r);
    for (size_t k = 0; k < 2; k++) {
        double across[3];

        for (size_t c = 0; c < 3; c++) {
            across[c] = (points[3 + 6 * k + c] - points[6 + 6 * k + c]) / (2.0 * sin(DIFFERENCE));
        }
        d[k][0] = vector_dot(across, t1);
        d[k][1] = vector_dot(across, t2);
    }
    system[0] = d[0][0] * d[0][0] + d[0][1] * d[0][1];
    system[1] = d[0][0] * d[1][0] + d[0][1] * d[1][1];
    system[2] = d[1][0] * d[1][0] + d[1][1] * d[1][1];
    system[3] = d[0][0] * r[0] + d[0][1] * r[1];
    system[4] = d[1][0] * r[0] + d[1][1] * r[1];
}

static int look_one(void *argument, size_t i, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct following *f = argument;
    size_t each = f->sloped ? AROUND : 1;
    double *points = srnf_alloc(3 * each * f->count, sizeof(double));
    int status = points ? SRNF_OK : SRNF_ENOMEM;

    (void)context;
    (void)error;
    for (size_t j = 0; j < f->count && status == SRNF_OK; j++) {
        if (f->sloped) {
            place_around(f->at + 3 * j, points + 3 * AROUND * j);
        } else {
            memcpy(points + 3 * j, f->at + 3 * j, 3 * sizeof(double));
        }
    }
    status = status ? status : carry(f->run, i, each * f->count, points);
    for (size_t j = 0; j < f->count && status == SRNF_OK; j++) {
        const double *b = own(f->run, i) + 3 * (f->first + j);
        double angle = landmarks_angle(points + 3 * each * j, b);

        f->squares[i * f->count + j] = angle * angle;
        if (f->sloped) {
            fill_system(points + 3 * each * j, b, f->systems + SYSTEM * (i * f->count + j));
        }
    }
    srnf_free(points);
    return status;
}

static double sum_over(const struct following *f, const double *values, size_t stride, size_t at)
{
    double sum = 0.0;

    for (size_t i = 0; i < f->run->n; i++) {
        sum += values[i * f->count * stride + at];
    }
    return sum;
}

/* The step of landmark j, a part of it at later tries; returns its length. */
static double step_of(const struct following *f, size_t j, double part, double out[3])
{
    const double *a = f->run->marks + 3 * (f->first + j);
    double s[SYSTEM], t1[3], t2[3], x, y, length, determinant;

    for (size_t k = 0; k < SYSTEM; k++) {
        s[k] = sum_over(f, f->systems, SYSTEM, SYSTEM * j + k);
    }
    determinant = s[0] * s[2] - s[1] * s[1]; /* positive: no warp folds */
    x = part * (s[2] * s[3] - s[1] * s[4]) / determinant;
    y = part * (s[0] * s[4] - s[1] * s[3]) / determinant;
    length = sqrt(x * x + y * y);
    if (!(length > 0.0) || !isfinite(length)) {
        memcpy(out, a, 3 * sizeof *out);
        return 0.0;
    }
    if (length > STEP_MAX) {
        x *= STEP_MAX / length;
        y *= STEP_MAX / length;
    }
    landmarks_frame(a, t1, t2);
    move_along(a, t1, t2, x, y, out);
    return length;
}

/* What is left of those with a weight, as last looked at. */
static void tell_apart(const struct following *f)
{
    size_t m = f->first == 0 ? f->run->landmarks->guiding : 0;

    for (size_t i = 0; m > 0 && i < f->run->n; i++) {
        double sum = 0.0;

        for (size_t j = 0; j < m; j++) {
            sum += f->squares[i * f->count + j];
        }
        f->run->subjects[i].at.apart = f->run->landmarks->weight / (double)m * sum;
    }
}

/* One round: all that fall move. parts: of the steps, halved where one was refused. next: room for
   the places and the sums before. */
static int follow_once(struct following *f, double *parts, double *next, double *moved,
                       struct srnf_error *error)
{
    const struct stats_progress quiet = {0};
    struct mean_run *run = f->run;
    double *before = next + 3 * f->count;
    int status;

    f->at = run->marks + 3 * f->first;
    f->sloped = true;
    status = stats_run(run->context, run->n, look_one, f, quiet, error);
    for (size_t j = 0; j < f->count && status == SRNF_OK; j++) {
        double length = step_of(f, j, parts[j], next + 3 * j);

        *moved = length > *moved ? length : *moved;
        before[j] = sum_over(f, f->squares, 1, j);
    }
    f->at = next;
    f->sloped = false;
    status = status ? status : stats_run(run->context, run->n, look_one, f, quiet, error);
    for (size_t j = 0; j < f->count && status == SRNF_OK; j++) {
        bool falls = sum_over(f, f->squares, 1, j) < before[j];

        parts[j] = falls ? 1.0 : 0.5 * parts[j];
        if (falls) {
            memcpy(run->marks + 3 * (f->first + j), next + 3 * j, 3 * sizeof(double));
        }
    }
    return status;
}

int mean_landmarks_follow(struct mean_run *run, bool to_the_end, struct srnf_error *error)
{
    struct following f = {.run = run};
    size_t rounds = to_the_end ? ROUNDS_IN_THE_END : 1;
    double *parts, moved = INFINITY;
    int status = SRNF_ENOMEM;

    f.first = run->landmarks ? first_moving(run) : 0;
    f.count = run->landmarks ? run->landmarks->n - f.first : 0;
    if (f.count == 0) {
        return SRNF_OK;
    }
    f.squares = srnf_alloc(run->n * f.count, (1 + SYSTEM) * sizeof(double));
    parts = srnf_alloc(5 * f.count, sizeof(double));
    if (f.squares && parts) {
        f.systems = f.squares + run->n * f.count;
        status = SRNF_OK;
    }
    for (size_t j = 0; j < f.count && status == SRNF_OK; j++) {
        parts[j] = 1.0;
    }
    for (size_t k = 0; k < rounds && moved > REST && status == SRNF_OK; k++) {
        moved = 0.0;
        status = follow_once(&f, parts, parts + f.count, &moved, error);
    }
    if (status == SRNF_OK) { /* where they are now */
        f.at = run->marks + 3 * f.first;
        f.sloped = false;
        status = stats_run(run->context, run->n, look_one, &f, (struct stats_progress){0}, error);
    }
    if (status == SRNF_OK) {
        tell_apart(&f);
    }
    srnf_free(parts);
    srnf_free(f.squares);
    return status;
}

/* ---- In the end ------------------------------------------------------------------------------ */

int mean_landmarks_hand_over(struct mean_run *run, struct srnf_mean *mean, struct srnf_error *error)
{
    size_t m = run->landmarks ? run->landmarks->n : 0;
    int status = mean_landmarks_follow(run, true, error);

    if (m == 0 || status) {
        return status;
    }
    mean->landmarks = srnf_alloc(3 * m, sizeof(double));
    mean->landmark_points = srnf_alloc(run->n, 3 * m * sizeof(double));
    if (!mean->landmarks || !mean->landmark_points) {
        return SRNF_ENOMEM;
    }
    mean->n_landmarks = m;
    for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
        double *points = mean->landmark_points + 3 * i * m;

        memcpy(points, run->marks, 3 * m * sizeof(double));
        status = carry(run, i, m, points);
    }
    /* The mean is parameterized from its centre. */
    return status ? status
                  : warp_apply(&run->centring, run->context, m, run->marks, mean->landmarks, NULL);
}
