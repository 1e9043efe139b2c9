/*
 * normals.h - a model of ellipsoids with noise, all parameterized alike and z growing with age, and
 * others of the same kind that it has not seen: for the tests of norms.
 */
#ifndef TESTS_STATS_NORMALS_H
#define TESTS_STATS_NORMALS_H

#include "group.h"
#include "srnf/norms.h"

#define NORMALS_DEGREE 4
#define NORMALS_NOISE_DEGREE 3
#define NORMALS_NOISE ((size_t)(NORMALS_NOISE_DEGREE + 1) * (NORMALS_NOISE_DEGREE + 1))

struct normals {
    struct group g; /* no surfaces of its own */
    size_t n, size; /* members; doubles of a field */
    double slope, noise;
    double *nodes, *scratch, *values;
    void *workspace;
    double *mean, *mean_q, *q; /* q: [n][size] */
    double *age;               /* [n] */
    struct srnf_pca pca;
    struct srnf_calibration calibration;
    struct test_random random;
};

/* One more of them, its field into q and its coefficients into f. bump: of the radius near +x. */
static inline void normals_draw(struct normals *a, double age, double bump, double *f, double *q)
{
    double noise[3 * NORMALS_NOISE];

    test_random_normals(&a->random, 3 * NORMALS_NOISE, noise);
    assert_int_equal(srnf_harmonics_at_points(NORMALS_NOISE_DEGREE, 3, noise, a->g.points, a->nodes,
                                              a->values, NULL),
                     SRNF_OK);
    for (size_t k = 0; k < a->size; k++) {
        size_t c = k / a->g.points;
        const double *node = a->nodes + 3 * (k % a->g.points);
        double axis = 1.2 - 0.2 * (double)c + (c == 2 ? a->slope * age : 0.0);

        a->scratch[k] =
            axis * node[c] + a->noise * a->values[k] + bump * node[c] * exp(4.0 * (node[0] - 1.0));
    }
    srnf_sht_analysis(a->g.sht, 3, a->scratch, f, a->workspace);
    srnf_field(a->g.sht, f, q, a->workspace);
}

static inline void normals_fit(struct normals *a, const size_t *subjects)
{
    stats_average(a->g.grid, a->n, a->q, a->mean_q);
    assert_int_equal(srnf_pca_fit(a->g.grid, a->n, a->mean_q, a->q, 0, &a->pca), SRNF_OK);
    assert_int_equal(
        srnf_calibrate(a->g.grid, &a->pca, a->mean_q, a->q, subjects, NULL, &a->calibration),
        SRNF_OK);
}

static inline void normals_open(struct normals *a, size_t n, double slope, uint64_t seed)
{
    *a = (struct normals){.n = n, .slope = slope, .noise = 0.02};
    a->random = test_random_seed(seed);
    group_open(&a->g, NORMALS_DEGREE, 0);
    a->size = 3 * a->g.points;
    a->nodes = shapes_doubles(a->size);
    a->scratch = shapes_doubles(a->size);
    a->values = shapes_doubles(a->size);
    a->workspace = srnf_alloc(1, srnf_surface_workspace_size(a->g.sht));
    a->mean = shapes_doubles(a->g.count);
    a->mean_q = shapes_doubles(a->size);
    a->q = shapes_doubles(n * a->size);
    a->age = shapes_doubles(n);
    assert_non_null(a->workspace);
    stats_nodes(a->g.grid, a->nodes);
    for (size_t i = 0; i < n; i++) {
        double *f = shapes_doubles(a->g.count);

        a->age[i] = 10.0 * test_random_normal(&a->random);
        normals_draw(a, a->age[i], 0.0, f, a->q + i * a->size);
        for (size_t k = 0; k < a->g.count; k++) {
            a->mean[k] += f[k] / (double)n;
        }
        srnf_free(f);
    }
}

static inline void normals_close(struct normals *a)
{
    srnf_calibration_clear(&a->calibration);
    srnf_pca_clear(&a->pca);
    srnf_free(a->nodes);
    srnf_free(a->scratch);
    srnf_free(a->values);
    srnf_free(a->workspace);
    srnf_free(a->mean);
    srnf_free(a->mean_q);
    srnf_free(a->q);
    srnf_free(a->age);
    group_close(&a->g);
}

static inline struct srnf_norm_model normals_model(const struct normals *a, bool covariates)
{
    return (struct srnf_norm_model){
        .pca = &a->pca,
        .mean = a->mean,
        .mean_q = a->mean_q,
        .calibration = &a->calibration,
        .complete = true,
        .columns = covariates ? 1 : 0,
        .values = covariates ? a->age : NULL,
    };
}

#endif
