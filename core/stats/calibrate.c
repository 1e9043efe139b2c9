/*
 * calibrate.c - leave-one-out values of the members of a model, each left out with its subject.
 *
 * With the scores z_i of all n members on all components (not only those that the model keeps),
 * from the Gram matrix of the centred SRNFs: where the m members of subject s are left out, the
 * mean of the t = n - m others is at -d / t, d = sum over s of z_i, and their scatter matrix about
 * it is
 *
 *     S' = diag(lambda) - sum over s of z_i z_i' - d d' / t.
 *
 * Its eigenvalues mu_k and eigenvectors v_k give the scores s_k = <z_i + d / t, v_k> of a member of
 * s about the mean of the others, and, K components kept and c of them counted
 * (srnf_mahalanobis_components, for as many subjects as there are),
 *
 *     residual^2 = sum over k > K of s_k^2,        distance = |z_i + d / t|,
 *     mahalanobis^2 = (t - 1) sum over k <= c of s_k^2 / mu_k.
 *
 * For m = 1 that is a rank-one downdate, whose roots and scores downdate.c finds without an
 * eigenvector: n^2 divisions. For m > 1 it is a symmetric eigenproblem of size n: the removal of
 * one member after another by downdates would cost as many passes and their rounding, since scans
 * of a subject are nearly the same. A component of the others that rounding made (mu at most n eps
 * of the largest) counts as none.
 */
#include "downdate.h"
#include "linear/linear.h"
#include "subjects.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define SUBTRACTION_MARGIN 8.0 /* as in pca.c */
/* A root that is 0 but for rounding is off by this many times the roundings of one. */
#define ROOT_ROUNDING 64.0
#define RESIDUAL_ROUNDING 1e-9

struct calibration {
    struct subjects subjects;
    size_t n, rank, kept, counted;
    double norm;    /* of the mean */
    double *gram;   /* [n][n], then its eigenvectors, one a row */
    double *values; /* [n] increasing, then [rank] decreasing */
    double *z;      /* [n][rank] */
    double *size;   /* [n][rank] of the same without signs, none 0: stats_downdate_prepare */
    double *out;    /* [SRNF_CALIBRATION_TRAITS][n] */
};

void srnf_calibration_clear(struct srnf_calibration *calibration)
{
    srnf_free(calibration->values);
    *calibration = (struct srnf_calibration){0};
}

/* Eigenvalues and scores above rounding, by the rule of pca.c. */
static void keep_sound(struct calibration *c)
{
    size_t n = c->n;
    double noise = SUBTRACTION_MARGIN * DBL_EPSILON * c->norm;
    double floor =
        (double)n * fmax(DBL_EPSILON * c->values[n - 1], (double)(n - 1) * noise * noise);

    while (c->rank < n - 1 && c->values[n - 1 - c->rank] > floor) {
        c->rank++;
    }
    for (size_t k = 0; k < c->rank; k++) {
        double root = sqrt(c->values[n - 1 - k]);

        for (size_t i = 0; i < n; i++) {
            c->z[i * c->rank + k] = root * c->gram[(n - 1 - k) * n + i];
        }
    }
    for (size_t k = 0; k < n / 2; k++) {
        double value = c->values[k];

        c->values[k] = c->values[n - 1 - k];
        c->values[n - 1 - k] = value;
    }
}

static int find_spectrum(struct calibration *c, const struct srnf_grid *grid, const double *mean_q,
                         const double *registered_q)
{
    size_t size = 3 * stats_points(grid);
    double *weighted = srnf_alloc(c->n, size * sizeof(double));
    int status = SRNF_ENOMEM;

    if (weighted) {
        stats_weight(grid, c->n, registered_q, mean_q, weighted);
        status = stats_gram(c->n, size, weighted, c->gram, NULL);
    }
    srnf_free(weighted);
    status = status ? status : linear_eigenvalues(c->n, true, c->gram, c->values);
    if (status == SRNF_OK) {
        c->norm = sqrt(srnf_inner_product(grid, mean_q, mean_q));
        keep_sound(c);
    }
    return status;
}

/* Of one member: its distance from the mean of the others, and by component, largest first, their
   eigenvalues and its scores. t: how many others. */
static void set_values(const struct calibration *c, size_t i, size_t t, double distance2,
                       const double *root, const double *score)
{
    double floor = ROOT_ROUNDING * (double)c->n * DBL_EPSILON * c->values[0];
    double rest = 0.0;
    double mahalanobis = 0.0;

    for (size_t k = c->rank; k-- > 0;) {
        double square = score[k] * score[k];
        bool none = !(root[k] > floor); /* the others do not differ that way */

        rest += k >= c->kept || none ? square : 0.0;
        mahalanobis += k < c->counted && !none ? square / root[k] : 0.0;
    }
    c->out[SRNF_TRAIT_RESIDUAL * c->n + i] = fmax(sqrt(rest), RESIDUAL_ROUNDING * c->norm);
    c->out[SRNF_TRAIT_DISTANCE * c->n + i] = sqrt(distance2);
    c->out[SRNF_TRAIT_MAHALANOBIS * c->n + i] = sqrt((double)(t - 1) * mahalanobis);
}

/* The only member of a subject. */
static int leave_member_out(const struct calibration *c, size_t i)
{
    double *root = srnf_alloc(2 * c->rank + 1, sizeof(double));
    const double *z = c->size + i * c->rank;
    double scale = (double)c->n / (double)(c->n - 1);
    double distance2 = 0.0;

    if (!root) {
        return SRNF_ENOMEM;
    }
    stats_downdate(c->n, c->rank, c->values, z, root, root + c->rank);
    for (size_t k = c->rank; k-- > 0;) {
        distance2 += z[k] * z[k];
    }
    set_values(c, i, c->n - 1, scale * scale * distance2, root, root + c->rank);
    srnf_free(root);
    return SRNF_OK;
}

/* S' into a; sum: d. Only the triangle that dsyevd reads is filled. */
static void remove_members(const struct calibration *c, size_t subject, double *sum, double *a)
{
    const struct subjects *s = &c->subjects;
    size_t r = c->rank;
    double others = (double)(c->n - s->size[subject]);

    for (size_t k = 0; k < r; k++) {
        a[k * r + k] = c->values[k];
    }
    for (size_t m = s->start[subject]; m < s->start[subject + 1]; m++) {
        const double *z = c->z + s->members[m] * r;

        for (size_t k = 0; k < r; k++) {
            sum[k] += z[k];
            for (size_t l = k; l < r; l++) {
                a[k * r + l] -= z[k] * z[l];
            }
        }
    }
    for (size_t k = 0; k < r; k++) {
        for (size_t l = k; l < r; l++) {
            a[k * r + l] -= sum[k] * sum[l] / others;
        }
    }
}

/* A member without whose subject t are left. scratch: [5][rank], d, the eigenvalues of S' in
   increasing order, and room; vectors: [rank][rank], one a row. */
static void describe_member(const struct calibration *c, size_t i, size_t t, double *scratch,
                            const double *vectors)
{
    size_t r = c->rank;
    const double *sum = scratch;
    const double *increasing = scratch + r;
    double *root = scratch + 2 * r;
    double *score = scratch + 3 * r;
    double *y = scratch + 4 * r;
    double distance2 = 0.0;

    for (size_t k = 0; k < r; k++) {
        y[k] = c->z[i * r + k] + sum[k] / (double)t;
        distance2 += y[k] * y[k];
    }
    for (size_t k = 0; k < r; k++) {
        const double *vector = vectors + (r - 1 - k) * r;

        root[k] = increasing[r - 1 - k];
        score[k] = 0.0;
        for (size_t l = 0; l < r; l++) {
            score[k] += vector[l] * y[l];
        }
    }
    set_values(c, i, t, distance2, root, score);
}

/* All members of a subject of several. */
static int leave_members_out(const struct calibration *c, size_t subject)
{
    const struct subjects *s = &c->subjects;
    size_t r = c->rank;
    size_t t = c->n - s->size[subject];
    double *scratch = srnf_alloc((r + 5) * r + 1, sizeof(double));
    double *a;
    int status = SRNF_OK;

    if (!scratch) {
        return SRNF_ENOMEM;
    }
    a = scratch + 5 * r;
    if (r > 0) {
        remove_members(c, subject, scratch, a);
        status = linear_eigenvalues(r, true, a, scratch + r);
    }
    for (size_t m = s->start[subject]; m < s->start[subject + 1] && status == SRNF_OK; m++) {
        describe_member(c, s->members[m], t, scratch, a);
    }
    srnf_free(scratch);
    return status;
}

static int leave_out_body(void *argument, size_t subject, const struct srnf_context *context,
                          struct srnf_error *error)
{
    const struct calibration *c = argument;
    const struct subjects *s = &c->subjects;

    (void)context;
    (void)error;
    return s->size[subject] == 1 ? leave_member_out(c, s->members[s->start[subject]])
                                 : leave_members_out(c, subject);
}

static bool open_calibration(struct calibration *c)
{
    c->gram = srnf_alloc(c->n, c->n * sizeof(double));
    c->z = srnf_alloc(c->n, c->n * sizeof(double));
    c->size = srnf_alloc(c->n, c->n * sizeof(double));
    c->values = srnf_alloc(c->n, sizeof(double));
    c->out = srnf_alloc(c->n, SRNF_CALIBRATION_TRAITS * sizeof(double));
    return c->gram && c->z && c->size && c->values && c->out;
}

/* All but what is handed out. */
static void close_calibration(struct calibration *c)
{
    subjects_clear(&c->subjects);
    srnf_free(c->gram);
    srnf_free(c->z);
    srnf_free(c->size);
    srnf_free(c->values);
}

int srnf_calibrate(const struct srnf_grid *grid, const struct srnf_pca *pca, const double *mean_q,
                   const double *registered_q, const size_t *subjects,
                   const struct srnf_context *context, struct srnf_calibration *calibration)
{
    struct calibration c = {.n = pca->n};
    int status = subjects_open(&c.subjects, pca->n, subjects, NULL);

    if (status == SRNF_OK && c.subjects.count < 3) {
        status = SRNF_EINVAL;
    }
    if (status == SRNF_OK && !open_calibration(&c)) {
        status = SRNF_ENOMEM;
    }
    status = status ? status : find_spectrum(&c, grid, mean_q, registered_q);
    if (status == SRNF_OK) {
        c.kept = pca->components < c.rank ? pca->components : c.rank;
        c.counted =
            srnf_mahalanobis_components(c.subjects.count, pca->components, pca->eigenvalues);
        memcpy(c.size, c.z, c.n * c.rank * sizeof(double));
        stats_downdate_prepare(c.n, c.rank, c.values, c.size);
        status = stats_run(context, c.subjects.count, leave_out_body, &c,
                           (struct stats_progress){0}, NULL);
    }
    if (status == SRNF_OK) {
        status =
            srnf_pose_angles(grid, c.n, registered_q, subjects, c.out + SRNF_TRAIT_ANGLE * c.n);
    }
    close_calibration(&c);
    if (status) {
        srnf_free(c.out);
        return status;
    }
    *calibration = (struct srnf_calibration){.n = c.n, .values = c.out};
    return SRNF_OK;
}
