/*
 * neighbours.c - the k nearest neighbours of each surface of a group, without registering all
 * pairs.
 *
 * The distance is that of srnf_distances, pair by pair: ||q_1 - O sqrt(J) q_2 o gamma|| for the O
 * and gamma that registration finds. Whatever it finds, the distance is not below what holds for
 * every O and gamma. Let Phi: R^3 -> R^m be homogeneous of degree 1, with |Phi(x) - Phi(y)| <=
 * |x - y|, and turn with x: Phi(O x) = R(O) Phi(x), R(O) orthogonal. Then Phi(q) is a field of m
 * components whose second moments
 *
 *   M = integral of Phi(q) Phi(q)'
 *
 * do not see gamma, since J is what |Phi|^2 scales with, and are turned by O: their eigenvalues,
 * the squares of the singular values s_i of Phi(q), see neither. By Mirsky's inequality (L. Mirsky,
 * "Symmetric gauge functions and unitarily invariant norms", 1960),
 *
 *   distance^2 >= ||Phi(q_1) - Phi(O sqrt(J) q_2 o gamma)||^2 >= sum_i (s_i(q_1) - s_i(q_2))^2.
 *
 * Phi(x) = |x| (a_l Y_l(x / |x|)) with all harmonics of the degrees l, each scaled to |Y_l| = 1, is
 * such a map where the sum of a_l^2 and that of a_l^2 l (l + 1) / 2 are at most 1: these are the
 * squares of what it stretches radii and arcs by. The largest of the bounds of some maps is used,
 * less SLACK of the norms: integrals of warped fields are sums over a grid.
 *
 * The infimum over gamma is small where surfaces have the same areas of each normal (M. Bauer, E.
 * Hartman, E. Klassen, "The square root normal field distance and unbalanced optimal transport",
 * 2022), however different they look, and so is any bound for all gamma. What is pruned is what
 * differs in that. Landmarks prune nothing more: registration stops in local minima, so that the
 * triangle inequality does not hold of what it finds.
 *
 * Pairs are registered in rounds: of each surface the candidates of least bounds, as long as these
 * are not above its k-th distance so far. What comes out is what all pairs would give, equal
 * distances in the order of the surfaces.
 *
 * Cost: the registrations, and n^2 differences of bounds a round. Memory: n^2 numbers.
 */
#include "linear/linear.h"
#include "mesh/mesh_geometry.h"
#include "stats.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

#define SLACK 2e-3
#define UNKNOWN (-1.0) /* of a distance */
#define LISTED (-2.0)  /* it is measured in this round */
#define LEVELS 4       /* degrees of harmonics, from 0 */
#define COMPONENTS_MAX 9

/* a_l^2 of the maps. */
#define MAPS 4
static const double shares[MAPS][LEVELS] = {
    {0.0, 1.0},
    {2.0 / 3.0, 0.0, 1.0 / 3.0},
    {5.0 / 6.0, 0.0, 0.0, 1.0 / 6.0},
    {0.5, 0.25, 0.25},
};
#define FEATURES (MAPS * COMPONENTS_MAX)

/* ---- Bounds ---------------------------------------------------------------------------------- */

/* Harmonics of one degree at a unit vector, of unit length all together; returns how many. */
static size_t harmonics(size_t degree, const double u[3], double *out)
{
    double x = u[0], y = u[1], z = u[2];

    switch (degree) {
    case 0:
        out[0] = 1.0;
        break;
    case 1:
        memcpy(out, u, 3 * sizeof(double));
        break;
    case 2:
        out[0] = sqrt(3.0) * x * y;
        out[1] = sqrt(3.0) * y * z;
        out[2] = sqrt(3.0) * z * x;
        out[3] = 0.5 * sqrt(3.0) * (x * x - y * y);
        out[4] = 0.5 * (3.0 * z * z - 1.0);
        break;
    default:
        out[0] = sqrt(5.0 / 8.0) * y * (3.0 * x * x - y * y);
        out[1] = sqrt(15.0) * x * y * z;
        out[2] = sqrt(3.0 / 8.0) * y * (5.0 * z * z - 1.0);
        out[3] = 0.5 * z * (5.0 * z * z - 3.0);
        out[4] = sqrt(3.0 / 8.0) * x * (5.0 * z * z - 1.0);
        out[5] = 0.5 * sqrt(15.0) * z * (x * x - y * y);
        out[6] = sqrt(5.0 / 8.0) * x * (x * x - 3.0 * y * y);
        break;
    }
    return 2 * degree + 1;
}

/* Phi(x); returns m. */
static size_t apply(const double share[LEVELS], const double x[3], double *out)
{
    double length = sqrt(vector_dot(x, x));
    double u[3] = {0.0, 0.0, 1.0};
    size_t m = 0;

    for (size_t c = 0; c < 3 && length > 0.0; c++) {
        u[c] = x[c] / length;
    }
    for (size_t l = 0; l < LEVELS; l++) {
        if (share[l] > 0.0) {
            size_t count = harmonics(l, u, out + m);

            linear_scale(count, length * sqrt(share[l]), out + m);
            m += count;
        }
    }
    return m;
}

/* Singular values of Phi(q), in order; what is missing to COMPONENTS_MAX is 0. */
static int find_values(const struct srnf_grid *grid, const double *q, const double share[LEVELS],
                       double values[COMPONENTS_MAX])
{
    double moments[COMPONENTS_MAX * COMPONENTS_MAX] = {0.0}, phi[COMPONENTS_MAX] = {0.0};
    double work[4 * COMPONENTS_MAX];
    size_t points = stats_points(grid), m = 0;

    for (size_t k = 0; k < points; k++) {
        const double x[3] = {q[k], q[points + k], q[2 * points + k]};

        m = apply(share, x, phi);
        for (size_t i = 0; i < m; i++) {
            for (size_t j = 0; j < m; j++) {
                moments[i * m + j] += grid->weight[k / grid->n_phi] * phi[i] * phi[j];
            }
        }
    }
    memset(values, 0, COMPONENTS_MAX * sizeof(double));
    if (LAPACKE_dsyev_work(LAPACK_COL_MAJOR, 'N', 'L', (lapack_int)m, moments, (lapack_int)m,
                           values, work, 4 * COMPONENTS_MAX)) {
        return SRNF_ENUMERIC;
    }
    for (size_t i = 0; i < m; i++) {
        values[i] = sqrt(fmax(values[i], 0.0));
    }
    return SRNF_OK;
}

int stats_neighbour_features(const struct srnf_sht *sht, const double *surface, double *features)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    double *q = srnf_alloc(3 * stats_points(grid), sizeof(double));
    int status = q ? stats_fields(sht, 1, &surface, NULL, q, NULL) : SRNF_ENOMEM;

    for (size_t map = 0; map < MAPS && status == SRNF_OK; map++) {
        status = find_values(grid, q, shares[map], features + map * COMPONENTS_MAX);
    }
    if (status == SRNF_OK) {
        features[FEATURES] = sqrt(srnf_inner_product(grid, q, q));
    }
    srnf_free(q);
    return status;
}

double stats_neighbour_bound(const double *a, const double *b)
{
    double largest = 0.0;

    for (size_t map = 0; map < MAPS; map++) {
        double sum = 0.0;

        for (size_t i = map * COMPONENTS_MAX; i < (map + 1) * COMPONENTS_MAX; i++) {
            sum += (a[i] - b[i]) * (a[i] - b[i]);
        }
        largest = sum > largest ? sum : largest;
    }
    return fmax(sqrt(largest) - SLACK * (a[FEATURES] + b[FEATURES]), 0.0);
}

/* ---- The search ------------------------------------------------------------------------------ */

struct seeking {
    const struct srnf_sht *sht;
    const double *const *surfaces;
    struct srnf_register_options options;
    uint64_t series;
    size_t n, k;
    struct srnf_neighbours *out;
    double *features;   /* [n][STATS_NEIGHBOUR_FEATURES] */
    double *matrix;     /* [n][n], of pairs i < j */
    size_t *found;      /* [n] neighbours so far, at most k */
    size_t *candidates; /* [n][k] of a round, n where there are no more */
    size_t *pairs;      /* [n k] of a round, by their numbers */
    size_t count;
};

static double *entry(const struct seeking *s, size_t i, size_t j)
{
    return s->matrix + (i < j ? i * s->n + j : j * s->n + i);
}

static int describe_one(void *argument, size_t i, const struct srnf_context *context,
                        struct srnf_error *error)
{
    struct seeking *s = argument;

    (void)context;
    (void)error;
    return stats_neighbour_features(s->sht, s->surfaces[i],
                                    s->features + i * STATS_NEIGHBOUR_FEATURES);
}

/* The least bounds among what is not known of surface i, as long as these may be among its
   nearest. */
static int choose_one(void *argument, size_t i, const struct srnf_context *context,
                      struct srnf_error *error)
{
    const struct seeking *s = argument;
    const double *own = s->features + i * STATS_NEIGHBOUR_FEATURES;
    double limit = s->found[i] < s->k ? HUGE_VAL : s->out->distances[i * s->k + s->k - 1];
    size_t *list = s->candidates + i * s->k;
    double *bounds = srnf_alloc(s->k, sizeof(double));
    size_t count = 0;

    (void)error;
    if (!bounds) {
        return SRNF_ENOMEM;
    }
    for (size_t j = 0; j < s->n && !srnf_is_canceled(context); j++) {
        double bound;
        size_t at;

        if (j == i || *entry(s, i, j) >= 0.0) {
            continue;
        }
        bound = stats_neighbour_bound(own, s->features + j * STATS_NEIGHBOUR_FEATURES);
        if (bound > limit || (count == s->k && bound >= bounds[count - 1])) {
            continue;
        }
        for (at = count < s->k ? count++ : count - 1; at > 0 && bounds[at - 1] > bound; at--) {
            bounds[at] = bounds[at - 1];
            list[at] = list[at - 1];
        }
        bounds[at] = bound;
        list[at] = j;
    }
    for (; count < s->k; count++) {
        list[count] = s->n;
    }
    srnf_free(bounds);
    return SRNF_OK;
}

/* The candidates of all, each pair once. */
static void list_pairs(struct seeking *s)
{
    s->count = 0;
    for (size_t c = 0; c < s->n * s->k; c++) {
        size_t i = c / s->k, j = s->candidates[c];

        if (j < s->n && *entry(s, i, j) == UNKNOWN) {
            *entry(s, i, j) = LISTED;
            s->pairs[s->count++] = i < j ? j * (j - 1) / 2 + i : i * (i - 1) / 2 + j;
        }
    }
}

/* The pairs of the round on other machines; SRNF_SEARCH_HERE: the caller has none. */
static int measure_elsewhere(struct seeking *s, const struct srnf_context *context,
                             struct stats_progress progress, struct srnf_error *error)
{
    size_t(*ends)[2];
    double *distances;
    int status = SRNF_ENOMEM;

    if (!context || !context->measure || s->count == 0) {
        return SRNF_SEARCH_HERE;
    }
    ends = srnf_alloc(s->count, sizeof *ends);
    distances = srnf_alloc(s->count, sizeof *distances);
    if (ends && distances) {
        const struct srnf_pair_search asked = {.sht = s->sht,
                                               .options = &s->options,
                                               .n = s->n,
                                               .surfaces = s->surfaces,
                                               .count = s->count,
                                               .pairs = ends,
                                               .from = progress.from,
                                               .to = progress.to,
                                               .distances = distances};

        for (size_t c = 0; c < s->count; c++) {
            srnf_pair(s->pairs[c], &ends[c][0], &ends[c][1]);
        }
        status = context->measure(context->user, &asked, error);
    }
    for (size_t c = 0; c < s->count && status == SRNF_OK; c++) {
        *entry(s, ends[c][0], ends[c][1]) = distances[c];
    }
    srnf_free(ends);
    srnf_free(distances);
    return status;
}

static int measure_all(struct seeking *s, const struct srnf_context *context,
                       struct srnf_error *error)
{
    double all = (double)s->out->pairs;
    const struct stats_progress progress = {(double)s->out->registered / all,
                                            (double)(s->out->registered + s->count) / all,
                                            "registering neighbours"};
    const struct stats_registered asked = {s->sht, s->n, s->surfaces, &s->options, s->series, 0};
    int status = measure_elsewhere(s, context, progress, error);

    return status == SRNF_SEARCH_HERE
               ? stats_registered_distances(&asked, s->count, s->pairs, progress, context,
                                            s->matrix, error)
               : status;
}

/* j is a neighbour of i at that distance, if it is among the nearest. */
static void insert(struct seeking *s, size_t i, size_t j)
{
    double distance = *entry(s, i, j);
    double *distances = s->out->distances + i * s->k;
    size_t *indices = s->out->indices + i * s->k;
    size_t at = s->found[i];

    while (at > 0 && (distances[at - 1] > distance ||
                      (distances[at - 1] == distance && indices[at - 1] > j))) {
        at--;
    }
    if (at == s->k) {
        return;
    }
    s->found[i] += s->found[i] < s->k;
    for (size_t m = s->found[i] - 1; m > at; m--) {
        distances[m] = distances[m - 1];
        indices[m] = indices[m - 1];
    }
    distances[at] = distance;
    indices[at] = j;
}

/* Rounds until no candidate is left. */
static int seek(struct seeking *s, const struct srnf_context *context, struct srnf_error *error)
{
    const struct stats_progress quiet = {0};
    int status = SRNF_OK;

    do {
        status = stats_run(context, s->n, choose_one, s, quiet, error);
        if (status == SRNF_OK) {
            list_pairs(s);
            status = measure_all(s, context, error);
        }
        for (size_t c = 0; c < s->count && status == SRNF_OK; c++) {
            size_t i, j;

            srnf_pair(s->pairs[c], &i, &j);
            insert(s, i, j);
            insert(s, j, i);
        }
        s->out->registered += s->count;
    } while (status == SRNF_OK && s->count > 0);
    return status;
}

static int create(struct seeking *s)
{
    size_t all = s->n * s->k, squares;

    if (__builtin_mul_overflow(s->n, s->n, &squares)) {
        return SRNF_ENOMEM;
    }
    s->out->indices = srnf_alloc(all, sizeof *s->out->indices);
    s->out->distances = srnf_alloc(all, sizeof(double));
    s->features = srnf_alloc(s->n, STATS_NEIGHBOUR_FEATURES * sizeof(double));
    s->matrix = srnf_alloc(squares, sizeof(double));
    s->found = srnf_alloc(s->n, sizeof *s->found);
    s->candidates = srnf_alloc(all, sizeof *s->candidates);
    s->pairs = srnf_alloc(all, sizeof *s->pairs);
    if (!s->out->indices || !s->out->distances || !s->features || !s->matrix || !s->found ||
        !s->candidates || !s->pairs) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < squares; k++) {
        s->matrix[k] = UNKNOWN;
    }
    return SRNF_OK;
}

int srnf_nearest_neighbours(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                            size_t k, const struct srnf_register_options *options,
                            const struct srnf_context *context, struct srnf_neighbours *neighbours,
                            struct srnf_error *error)
{
    struct seeking s = {
        .sht = sht, .surfaces = surfaces, .n = n, .k = k, .options = *options, .out = neighbours};
    int status;

    *neighbours = (struct srnf_neighbours){.n = n, .k = k};
    if (k == 0 || k >= n) {
        return srnf_fail(error, SRNF_EINVAL, -1, "k is %zu; of %zu surfaces each has %zu others", k,
                         n, n ? n - 1 : 0);
    }
    if (options->representation != SRNF_REPRESENTATION_SRNF) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the bounds are those of SRNFs");
    }
    status = stats_check_surfaces(sht, n, surfaces, error);
    if (status) {
        return status;
    }
    s.options.symmetric = true;
    s.series = stats_series(sht, STATS_KEPT_DISTANCES, n, surfaces, &s.options);
    neighbours->pairs = n % 2 == 0 ? n / 2 * (n - 1) : (n - 1) / 2 * n;
    status = create(&s);
    if (status == SRNF_OK) {
        status = stats_run(context, n, describe_one, &s, (struct stats_progress){0}, error);
    }
    status = status ? status : seek(&s, context, error);
    srnf_free(s.features);
    srnf_free(s.matrix);
    srnf_free(s.found);
    srnf_free(s.candidates);
    srnf_free(s.pairs);
    if (status) {
        srnf_neighbours_clear(neighbours);
    }
    return status;
}

void srnf_neighbours_clear(struct srnf_neighbours *neighbours)
{
    srnf_free(neighbours->indices);
    srnf_free(neighbours->distances);
    *neighbours = (struct srnf_neighbours){0};
}
