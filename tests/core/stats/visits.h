/*
 * visits.h - ellipsoids with noise of the subject and of the visit, all parameterized alike, seen
 * twice: for the tests of differences within subjects.
 */
#ifndef TESTS_STATS_VISITS_H
#define TESTS_STATS_VISITS_H

#include "group.h"
#include "srnf/paired.h"

#define VISITS_DEGREE 4
#define VISITS_NOISE ((size_t)16) /* coefficients of each coordinate that have some */

struct visits {
    struct group g; /* 2 n surfaces, the first of each subject before all second ones */
    size_t n, size;
    double *mean, *q, *sizes;
    struct srnf_pairs pairs;
};

/* growth: of the z axis from the first visit to the second, which varies by `spread`. */
static inline void visits_open(struct visits *v, size_t n, double growth, double spread,
                               uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    void *workspace;

    *v = (struct visits){.n = n};
    group_open(&v->g, VISITS_DEGREE, 2 * n);
    v->size = 3 * v->g.points;
    v->mean = shapes_doubles(v->g.count);
    v->q = shapes_doubles(2 * n * v->size);
    v->sizes = shapes_doubles(2 * n);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(v->g.sht));
    assert_non_null(workspace);
    for (size_t i = 0; i < n; i++) {
        double own[3 * VISITS_NOISE];
        double more = growth + spread * test_random_normal(&random);

        test_random_normals(&random, 3 * VISITS_NOISE, own);
        for (size_t visit = 0; visit < 2; visit++) {
            double *f = v->g.f[visit * n + i];
            double noise[3 * VISITS_NOISE];

            test_random_normals(&random, 3 * VISITS_NOISE, noise);
            f[3] = 2.4;
            f[v->g.each + 1] = 2.0;
            f[2 * v->g.each + 2] = 1.6 + (visit ? more : 0.0);
            for (size_t k = 0; k < 3 * VISITS_NOISE; k++) {
                f[k / VISITS_NOISE * v->g.each + k % VISITS_NOISE] +=
                    0.03 * own[k] + 0.01 * noise[k];
            }
            srnf_field(v->g.sht, f, v->q + (visit * n + i) * v->size, workspace);
            v->sizes[visit * n + i] = 1.0;
            for (size_t k = 0; k < v->g.count; k++) {
                v->mean[k] += f[k] / (double)(2 * n);
            }
        }
    }
    srnf_free(workspace);
    v->pairs = (struct srnf_pairs){.n = n,
                                   .mean = v->mean,
                                   .first_q = v->q,
                                   .second_q = v->q + n * v->size,
                                   .first_size = v->sizes,
                                   .second_size = v->sizes + n};
}

static inline void visits_close(struct visits *v)
{
    srnf_free(v->mean);
    srnf_free(v->q);
    srnf_free(v->sizes);
    group_close(&v->g);
}

#endif
