/*
 * nulls.h - cohorts in which nothing differs but the subjects, some of them scanned twice, with
 * labels drawn by subject: how often the tests of two groups and of a classifier reject.
 *
 * Subjects are ellipsoids with noise of low degree; a second scan has a tenth of that noise anew.
 * All are parameterized alike and in one pose. Labels are fair coins, one a subject, thrown again
 * until each side has three.
 */
#ifndef TESTS_STATS_NULLS_H
#define TESTS_STATS_NULLS_H

#include "group.h"

#define NULLS_DEGREE 4
#define NULLS_NOISE ((size_t)(3 + 1) * (3 + 1))
#define NULLS_MEMBERS ((size_t)24)
#define NULLS_LEVEL 0.05

struct nulls {
    struct group g;
    size_t subjects[NULLS_MEMBERS], labels[NULLS_MEMBERS];
    int group[NULLS_MEMBERS];
    double age
        [NULLS_MEMBERS]; /* of the subjects: larger in the second group, nothing to do with shape */
    double *mean, *q;    /* [3][(L+1)^2], [n][3][P] */
};

/* How often 200 or fewer cohorts were rejected, and what accuracies they had. */
struct nulls_counts {
    size_t cohorts, global, map;            /* of the comparison */
    size_t fdr;                             /* maps that report any node by false discovery rate */
    size_t gauss, nearest;                  /* of the classifiers */
    size_t mcnemar;                         /* of one against the other */
    double accuracy[2], accuracy_square[2]; /* gauss, nearest: sums over cohorts */
};

static inline void nulls_labels(struct nulls *a, size_t repeats, struct test_random *random)
{
    size_t ones;

    do {
        ones = 0;
        for (size_t i = 0; i < NULLS_MEMBERS; i++) {
            a->subjects[i] = i / repeats;
            a->labels[i] = i % repeats ? a->labels[i - 1] : test_random_normal(random) > 0.0;
            a->group[i] = (int)a->labels[i];
            ones += i % repeats == 0 && a->labels[i] == 1;
        }
    } while (ones < 3 || ones + 3 > NULLS_MEMBERS / repeats);
    for (size_t i = 0; i < NULLS_MEMBERS; i++) {
        a->age[i] = i % repeats ? a->age[i - 1]
                                : 60.0 + 10.0 * ((double)a->labels[i] + test_random_normal(random));
    }
}

static inline void nulls_open(struct nulls *a, size_t repeats, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double own[3 * NULLS_NOISE];
    double noise[3 * NULLS_NOISE];
    double *nodes;
    double *values;
    void *workspace;

    group_open(&a->g, NULLS_DEGREE, NULLS_MEMBERS);
    nodes = shapes_doubles(3 * a->g.points);
    values = shapes_doubles(3 * a->g.points);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(a->g.sht));
    assert_non_null(workspace);
    stats_nodes(a->g.grid, nodes);
    a->mean = shapes_doubles(a->g.count);
    a->q = shapes_doubles(NULLS_MEMBERS * 3 * a->g.points);
    for (size_t i = 0; i < NULLS_MEMBERS; i++) {
        test_random_normals(&random, 3 * NULLS_NOISE, noise);
        for (size_t k = 0; k < 3 * NULLS_NOISE; k++) {
            own[k] = i % repeats ? own[k] : noise[k];
            noise[k] = own[k] + (repeats > 1 ? 0.1 : 0.0) * noise[k];
        }
        assert_int_equal(srnf_harmonics_at_points(3, 3, noise, a->g.points, nodes, values, NULL),
                         SRNF_OK);
        for (size_t p = 0; p < a->g.points; p++) {
            for (size_t c = 0; c < 3; c++) {
                size_t k = c * a->g.points + p;

                values[k] = (1.2 - 0.2 * (double)c) * nodes[3 * p + c] + 0.03 * values[k];
            }
        }
        srnf_sht_analysis(a->g.sht, 3, values, a->g.f[i], workspace);
        srnf_field(a->g.sht, a->g.f[i], a->q + i * 3 * a->g.points, workspace);
        for (size_t k = 0; k < a->g.count; k++) {
            a->mean[k] += a->g.f[i][k] / (double)NULLS_MEMBERS;
        }
    }
    nulls_labels(a, repeats, &random);
    srnf_free(workspace);
    srnf_free(values);
    srnf_free(nodes);
}

static inline void nulls_close(struct nulls *a)
{
    srnf_free(a->q);
    srnf_free(a->mean);
    group_close(&a->g);
}

/* ages: whether they are regressed out. */
static inline void nulls_compare(const struct nulls *a, const size_t *subjects, bool ages,
                                 size_t permutations, uint64_t seed, struct nulls_counts *counts)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct srnf_comparison out;

    options.permutations = permutations;
    options.seed = seed;
    options.subjects = subjects;
    assert_int_equal(srnf_compare_groups(a->g.sht, NULLS_MEMBERS, a->mean, a->q, a->group, ages,
                                         ages ? a->age : NULL, &options, NULL, &out, NULL),
                     SRNF_OK);
    counts->global += out.p_value <= NULLS_LEVEL;
    counts->map += out.max_p_value <= NULLS_LEVEL;
    counts->fdr += group_least(a->g.points, out.fdr) <= NULLS_LEVEL;
    srnf_comparison_clear(&out);
}

static inline void nulls_classify(const struct nulls *a, const size_t *subjects,
                                  enum srnf_refit refit, size_t permutations, uint64_t seed,
                                  struct nulls_counts *counts)
{
    struct srnf_folds_options folds = srnf_folds_options_defaults();
    struct srnf_classify_options options = srnf_classify_options_defaults();
    bool right[2][NULLS_MEMBERS];
    struct srnf_folds c;
    size_t only[2];
    double p;

    folds.registration.degree = 2;
    folds.registration.common_pose = true;
    folds.max_components = 4;
    folds.refit = refit;
    folds.subjects = subjects;
    options.permutations = permutations;
    options.relabellings = 0;
    options.seed = seed;
    assert_int_equal(srnf_folds_compare(a->g.sht, SRNF_METRIC_SRNF, NULLS_MEMBERS, a->g.surfaces,
                                        &folds, NULL, &c, NULL),
                     SRNF_OK);
    for (size_t nearest = 0; nearest < 2; nearest++) {
        struct srnf_classification r;

        assert_int_equal((nearest ? srnf_classify_nearest : srnf_classify_gauss)(
                             &c, a->labels, 2, &options, NULL, &r, NULL),
                         SRNF_OK);
        *(nearest ? &counts->nearest : &counts->gauss) += r.p_value <= NULLS_LEVEL;
        counts->accuracy[nearest] += r.accuracy;
        counts->accuracy_square[nearest] += r.accuracy * r.accuracy;
        for (size_t i = 0; i < NULLS_MEMBERS; i++) {
            right[nearest][i] = r.predicted[i] == a->labels[i];
        }
        srnf_classification_clear(&r);
    }
    assert_int_equal(srnf_mcnemar(NULLS_MEMBERS, subjects, right[0], right[1], only, &p), SRNF_OK);
    counts->mcnemar += p <= NULLS_LEVEL;
    srnf_folds_clear(&c);
}

/* Mean of the accuracies and its standard error. */
static inline double nulls_accuracy(const struct nulls_counts *c, size_t nearest, double *error)
{
    double n = (double)c->cohorts;
    double mean = c->accuracy[nearest] / n;

    *error = sqrt((c->accuracy_square[nearest] / n - mean * mean) / (n - 1.0));
    return mean;
}

/* `cohorts` cohorts, each subject scanned `repeats` times; heed: whether the subjects are told.
   refit: of the classifiers' folds. */
static inline struct nulls_counts nulls_run(size_t cohorts, size_t repeats, bool heed,
                                            size_t permutations, enum srnf_refit refit)
{
    struct nulls_counts counts = {.cohorts = cohorts};

    for (size_t k = 0; k < cohorts; k++) {
        struct nulls a;

        nulls_open(&a, repeats, 4000 + k);
        nulls_compare(&a, heed ? a.subjects : NULL, false, permutations, k, &counts);
        nulls_classify(&a, heed ? a.subjects : NULL, refit, permutations, k, &counts);
        nulls_close(&a);
    }
    printf("# %zu cohorts, %zu scans a subject, subjects %s: p <= .05 of the groups %zu, their map "
           "%zu, by false discovery rate %zu; of a classifier against the other %zu\n",
           cohorts, repeats, heed ? "told" : "not told", counts.global, counts.map, counts.fdr,
           counts.mcnemar);
    for (size_t nearest = 0; nearest < 2; nearest++) {
        double error;
        double mean = nulls_accuracy(&counts, nearest, &error);

        printf("#   %s: p <= .05 %zu, accuracy %.3f +- %.3f\n", nearest ? "nearest" : "Gauss",
               nearest ? counts.nearest : counts.gauss, mean, error);
    }
    return counts;
}

#endif
