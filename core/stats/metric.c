/*
 * metric.c - matrices of distances by the metrics that do not come from SRNFs, and the table of
 * all.
 *
 *   srm       as distances.c, with square-root maps q = |n|^(1/2) f about the area centroid
 *   harmonic  d(i, j)^2 = min over O of ||f_i - O f_j||^2 = ||f_i||^2 + ||f_j||^2 - 2 tr(O' B),
 *             B = the sum of f_i f_j' over coefficients: a 3 x 3 problem in closed form, a metric
 *             on the orbits of SO(3)
 *   spharm    ||f_i - T f_j|| after srnf_align_ellipsoid, the least over the turns T by pi about
 *             the axes, f -> D f(D e). D is diagonal, so that T only changes signs of coefficients
 *   icp       srnf_icp between triangulations
 *
 * Norms are those of L2 on the sphere, sums over coefficients with l > 0 (Parseval). One task a
 * pair, as in distances.c.
 */
#include "stats.h"
#include "registration/registration.h"
#include "surface/surface.h"

#include <math.h>

#define TURNS 4

struct comparison {
    const struct srnf_sht *sht;
    const struct srnf_context *context;
    size_t n, each;
    bool aligned;
    double *surfaces;         /* [n][3][each] as the metric wants them; NULL for icp */
    struct srnf_mesh *meshes; /* [n] of icp */
    const double *const *given;
    double *matrix;
};

typedef int prepare_one(struct comparison *c, size_t i);
typedef int measure_one(const struct comparison *c, size_t i, size_t j,
                        const struct srnf_context *context, double *distance,
                        struct srnf_error *error);

/* ---- What each metric compares --------------------------------------------------------------- */

/* As given, the l = 0 terms left out. */
static int prepare_harmonic(struct comparison *c, size_t i)
{
    double *f = c->surfaces + 3 * i * c->each;

    linear_copy(3 * c->each, c->given[i], f);
    f[0] = f[c->each] = f[2 * c->each] = 0.0;
    return SRNF_OK;
}

static int prepare_spharm(struct comparison *c, size_t i)
{
    double *f = c->surfaces + 3 * i * c->each;
    int status = prepare_harmonic(c, i);

    return status || !c->aligned ? status : srnf_align_ellipsoid(c->sht, f, f);
}

static int prepare_srm(struct comparison *c, size_t i)
{
    double *f = c->surfaces + 3 * i * c->each;
    double log_scale = 0.0;
    int status = srnf_normalize(c->sht, c->given[i], f, &log_scale);

    if (status == SRNF_OK) {
        linear_scale(3 * c->each, exp(log_scale), f);
    }
    return status;
}

static int prepare_icp(struct comparison *c, size_t i)
{
    return surface_triangulate(c->context, srnf_sht_degree(c->sht), c->given[i], SRNF_ICP_FREQUENCY,
                               &c->meshes[i], NULL);
}

/* ---- Distances of a pair --------------------------------------------------------------------- */

static int measure_harmonic(const struct comparison *c, size_t i, size_t j,
                            const struct srnf_context *context, double *distance,
                            struct srnf_error *error)
{
    const double *a = c->surfaces + 3 * i * c->each;
    const double *b = c->surfaces + 3 * j * c->each;
    double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double moments[9];
    double sum = 0.0;

    (void)context;
    (void)error;
    for (size_t k = 0; k < 9; k++) {
        moments[k] = linear_dot(c->each, a + k / 3 * c->each, b + k % 3 * c->each);
    }
    if (c->aligned) {
        (void)registration_closest_rotation(moments, rotation);
    }
    for (size_t k = 0; k < 3; k++) {
        const double *o = rotation + 3 * k;

        for (size_t m = 0; m < c->each; m++) {
            double d = a[k * c->each + m] - o[0] * b[m] - o[1] * b[c->each + m] -
                       o[2] * b[2 * c->each + m];

            sum += d * d;
        }
    }
    *distance = sqrt(sum);
    return SRNF_OK;
}

/* Sign that turn t gives to the coefficient (l, m) of coordinate k: about no axis, z, x, y. */
static double turn_sign(size_t t, size_t k, size_t l, long m)
{
    static const double values[TURNS][3] = {{1, 1, 1}, {-1, -1, 1}, {1, -1, -1}, {-1, 1, -1}};
    size_t order = (size_t)(m < 0 ? -m : m);
    double odd = m < 0 ? -1.0 : 1.0;
    double sign = 1.0;

    if (t == 1) {
        sign = order % 2 ? -1.0 : 1.0;
    } else if (t == 2) {
        sign = odd * ((l + order) % 2 ? -1.0 : 1.0);
    } else if (t == 3) {
        sign = odd * (l % 2 ? -1.0 : 1.0);
    }
    return sign * values[t][k];
}

static int measure_spharm(const struct comparison *c, size_t i, size_t j,
                          const struct srnf_context *context, double *distance,
                          struct srnf_error *error)
{
    const double *a = c->surfaces + 3 * i * c->each;
    const double *b = c->surfaces + 3 * j * c->each;
    double least = INFINITY;

    (void)context;
    (void)error;
    for (size_t t = 0; t < (c->aligned ? TURNS : 1); t++) {
        double sum = 0.0;

        for (size_t k = 0; k < 3; k++) {
            for (size_t l = 0; l <= srnf_sht_degree(c->sht); l++) {
                for (long m = -(long)l; m <= (long)l; m++) {
                    size_t at = k * c->each + (size_t)((long)(l * l + l) + m);
                    double d = a[at] - turn_sign(t, k, l, m) * b[at];

                    sum += d * d;
                }
            }
        }
        least = fmin(least, sum);
    }
    *distance = sqrt(least);
    return SRNF_OK;
}

static int measure_icp(const struct comparison *c, size_t i, size_t j,
                       const struct srnf_context *context, double *distance,
                       struct srnf_error *error)
{
    struct srnf_icp_options options = srnf_icp_options_defaults();
    struct srnf_icp result;
    int status;

    options.max_iterations = c->aligned ? options.max_iterations : 0;
    status = srnf_icp(&c->meshes[i], &c->meshes[j], &options, context, &result, error);
    *distance = result.distance;
    return status;
}

/* ---- The table, and the loop over pairs ------------------------------------------------------ */

static const struct {
    const char *name;
    prepare_one *prepare;
    measure_one *measure; /* NULL: distances.c */
} metrics[] = {
    [SRNF_METRIC_SRNF] = {"srnf", NULL, NULL},
    [SRNF_METRIC_SRM] = {"srm", prepare_srm, NULL},
    [SRNF_METRIC_HARMONIC] = {"harmonic", prepare_harmonic, measure_harmonic},
    [SRNF_METRIC_ICP] = {"icp", prepare_icp, measure_icp},
    [SRNF_METRIC_SPHARM] = {"spharm", prepare_spharm, measure_spharm},
};
#define METRICS (sizeof metrics / sizeof metrics[0])

const char *srnf_metric_name(enum srnf_metric metric)
{
    return (size_t)metric < METRICS ? metrics[metric].name : "unknown";
}

struct loop {
    struct comparison *c;
    enum srnf_metric metric;
};

static int prepare_body(void *argument, size_t i, const struct srnf_context *context,
                        struct srnf_error *error)
{
    struct loop *loop = argument;
    int status = metrics[loop->metric].prepare(loop->c, i);

    (void)context;
    return status
               ? srnf_fail(error, status, (int64_t)i, "surface %zu: %s", i, srnf_strerror(status))
               : SRNF_OK;
}

static int measure_body(void *argument, size_t index, const struct srnf_context *context,
                        struct srnf_error *error)
{
    struct loop *loop = argument;
    struct comparison *c = loop->c;
    double distance = 0.0;
    size_t i;
    size_t j;
    int status;

    srnf_pair(index, &i, &j);
    status = metrics[loop->metric].measure(c, i, j, context, &distance, error);
    c->matrix[i * c->n + j] = distance;
    c->matrix[j * c->n + i] = distance;
    return status;
}

static int compare_all(struct comparison *c, enum srnf_metric metric,
                       const struct srnf_register_options *registration,
                       const struct srnf_context *context, struct srnf_error *error)
{
    struct stats_progress progress = {0.0, 1.0, "measuring distances"};
    struct loop loop = {c, metric};
    int status = stats_run(context, c->n, prepare_body, &loop, (struct stats_progress){0}, error);

    if (status == SRNF_OK && metric == SRNF_METRIC_SRM) {
        const double **surfaces = srnf_alloc(c->n, sizeof *surfaces);

        for (size_t i = 0; surfaces && i < c->n; i++) {
            surfaces[i] = c->surfaces + 3 * i * c->each;
        }
        status = surfaces ? stats_field_distances(c->sht, SRNF_REPRESENTATION_SRM, c->n, surfaces,
                                                  registration, context, c->matrix, error)
                          : stats_fail(error, SRNF_ENOMEM, NULL);
        srnf_free(surfaces);
        return status;
    }
    for (size_t i = 0; i < c->n; i++) {
        c->matrix[i * c->n + i] = 0.0;
    }
    return status ? status
                  : stats_run(context, c->n * (c->n - 1) / 2, measure_body, &loop, progress, error);
}

int srnf_metric_distances(const struct srnf_sht *sht, enum srnf_metric metric, size_t n,
                          const double *const *surfaces,
                          const struct srnf_register_options *registration,
                          const struct srnf_context *context, double *matrix,
                          struct srnf_error *error)
{
    struct comparison c = {.sht = sht,
                           .context = context,
                           .n = n,
                           .each = srnf_coefficient_count(srnf_sht_degree(sht)),
                           .aligned = registration != NULL,
                           .given = surfaces,
                           .matrix = matrix};
    size_t entries;
    int status;

    if ((size_t)metric >= METRICS) {
        return srnf_fail(error, SRNF_EINVAL, -1, "there is no metric %d", (int)metric);
    }
    if (metric == SRNF_METRIC_SRNF) {
        return stats_field_distances(sht, SRNF_REPRESENTATION_SRNF, n, surfaces, registration,
                                     context, matrix, error);
    }
    status = stats_check_surfaces(sht, n, surfaces, error);
    if (status) {
        return status;
    }
    if (__builtin_mul_overflow(n, 3 * c.each, &entries) || n > SIZE_MAX / 2 / n) {
        return srnf_fail(error, SRNF_ELIMIT, -1, "%zu surfaces have too many pairs", n);
    }
    if (metric == SRNF_METRIC_ICP) {
        c.meshes = srnf_alloc(n, sizeof *c.meshes);
    } else {
        c.surfaces = srnf_alloc(entries, sizeof(double));
    }
    status = c.meshes || c.surfaces
                 ? compare_all(&c, metric, registration, context, error)
                 : srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
    for (size_t i = 0; c.meshes && i < n; i++) {
        srnf_mesh_clear(&c.meshes[i]);
    }
    srnf_free(c.meshes);
    srnf_free(c.surfaces);
    return status;
}
