/*
 * test_folds_join.c - folds of subjects of several structures: one structure is itself, squared
 * distances and inner products of scores are weighted sums of those of the structures, the subject
 * left out leaves no trace, what is planted in two structures is told by both together, and wrong
 * arguments.
 *
 * srnfd-test: timeout 300
 * srnfd-test: slow
 * srnfd-test: no-asan (test_classify_allocation.c and api/test_standard.sh run its code)
 */
#include "group.h"

#include <fftw3.h>

#include "linear/linear.h"

#define DEGREE 4
#define N ((size_t)7)
#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

struct parts {
    struct group g[2];
    struct srnf_folds folds[2];
};

static void compare(struct parts *p, const size_t *subjects)
{
    struct srnf_folds_options options = srnf_folds_options_defaults();
    struct srnf_error error = {0};

    options.registration.degree = 4;
    options.registration.start = SRNF_START_RIGID;
    options.keep = true;
    options.subjects = subjects;
    for (size_t k = 0; k < 2; k++) {
        if (srnf_folds_compare(p->g[k].sht, SRNF_METRIC_SRNF, p->g[k].n, p->g[k].surfaces, &options,
                               NULL, &p->folds[k], &error)) {
            fail_msg("comparing: %s", error.message);
        }
    }
}

static void open_parts(struct parts *p)
{
    group_open_stars(&p->g[0], DEGREE, N, 0.3);
    group_open_stars(&p->g[1], DEGREE, N, 0.5);
}

static void close_folds(struct parts *p)
{
    srnf_folds_clear(&p->folds[0]);
    srnf_folds_clear(&p->folds[1]);
}

static void close_parts(struct parts *p)
{
    close_folds(p);
    group_close(&p->g[0]);
    group_close(&p->g[1]);
}

static struct srnf_folds join(const struct parts *p, size_t n_parts, const double *weights)
{
    struct srnf_folds joint;
    struct srnf_error error = {0};

    if (srnf_folds_join(n_parts, p->folds, weights, NULL, 0.0, 20, NULL, &joint, &error)) {
        fail_msg("joining: %s", error.message);
    }
    return joint;
}

static void one_part_is_itself(void **state)
{
    static const double weight[] = {1.0};
    struct srnf_folds joint;
    struct parts p;
    size_t size;
    (void)state;

    open_parts(&p);
    compare(&p, NULL);
    joint = join(&p, 1, weight);
    size = N * N * joint.components;
    assert_int_equal(joint.components, p.folds[0].components);
    assert_memory_equal(joint.scores, p.folds[0].scores, size * sizeof(double));
    assert_memory_equal(joint.distances, p.folds[0].distances, N * N * sizeof(double));
    assert_memory_equal(joint.spread, p.folds[0].spread, N * sizeof(double));
    srnf_folds_clear(&joint);
    close_parts(&p);
}

/* Squared distance of two training members in the fold of one by inner products. */
static double square_of(const struct srnf_folds *c, size_t fold, size_t i, size_t j)
{
    const double *k = c->products[c->templates[fold]];

    return k[i * c->n + i] + k[j * c->n + j] - 2.0 * k[i * c->n + j];
}

static void sums_the_parts(void **state)
{
    static const double weights[] = {2.0, 0.25};
    struct srnf_folds joint;
    struct parts p;
    (void)state;

    open_parts(&p);
    compare(&p, NULL);
    joint = join(&p, 2, weights);
    for (size_t i = 0; i < N; i++) {
        const double *scores = joint.scores + i * N * joint.components;

        for (size_t a = 0; a < N; a++) {
            double d = joint.distances[i * N + a];
            double first = p.folds[0].distances[i * N + a],
                   second = p.folds[1].distances[i * N + a];

            assert_near(d * d, 2.0 * first * first + 0.25 * second * second, 1e-12);
            for (size_t b = 0; b < a && a != i; b++) {
                double sum = 0.0;

                for (size_t k = 0; k < joint.components; k++) {
                    double x = scores[a * joint.components + k] - scores[b * joint.components + k];

                    sum += x * x;
                }
                if (b != i) { /* training members: the components are all that they span */
                    assert_near(sum,
                                2.0 * square_of(&p.folds[0], i, a, b) +
                                    0.25 * square_of(&p.folds[1], i, a, b),
                                1e-10);
                }
            }
        }
    }
    srnf_folds_clear(&joint);
    close_parts(&p);
}

/* Positions add their squared distances, of members in a fold and of those that are left out. */
static void positions_count(void **state)
{
    static const double weights[] = {1.0, 3.0};
    double positions[N][6];
    struct test_random random = test_random_seed(4);
    struct srnf_folds without, with;
    struct parts p;
    (void)state;

    open_parts(&p);
    compare(&p, NULL);
    test_random_normals(&random, 6 * N, &positions[0][0]);
    without = join(&p, 2, weights);
    assert_int_equal(
        srnf_folds_join(2, p.folds, weights, &positions[0][0], 2.0, 20, NULL, &with, NULL),
        SRNF_OK);
    for (size_t k = 0; k < N * N; k++) {
        double square = without.distances[k] * without.distances[k];

        for (size_t c = 0; c < 6; c++) {
            double d = positions[k / N][c] - positions[k % N][c];

            square += 2.0 * d * d;
        }
        assert_near(with.distances[k] * with.distances[k], square, 1e-10);
    }
    assert_true(with.spread[0] > without.spread[0]);
    srnf_folds_clear(&with);
    srnf_folds_clear(&without);
    close_parts(&p);
}

/* Another shape in the place of a subject's two members, in both parts: what its fold says of the
   others keeps its bits. */
static void the_subject_left_out_leaves_no_trace(void **state)
{
    static const double weights[] = {1.0, 3.0};
    static const size_t subjects[] = {0, 1, 2, 2, 4, 5, 6};
    struct srnf_folds before, after;
    struct shapes_surface other;
    struct parts p;
    size_t size;
    (void)state;

    open_parts(&p);
    compare(&p, subjects);
    before = join(&p, 2, weights);
    close_folds(&p);
    shapes_open(&other, DEGREE);
    for (size_t k = 0; k < 2; k++) {
        for (size_t i = 2; i < 4; i++) {
            shapes_fill_random_star(&other, 70 + 2 * k + i, NULL);
            memcpy(p.g[k].f[i], other.f, p.g[k].count * sizeof(double));
        }
    }
    shapes_close(&other);
    compare(&p, subjects);
    after = join(&p, 2, weights);
    size = N * before.components;
    for (size_t i = 0; i < N; i++) {
        if (subjects[i] != 2) {
            assert_memory_equal(before.scores + 2 * size + i * before.components,
                                after.scores + 2 * size + i * before.components,
                                before.components * sizeof(double));
        }
    }
    assert_true(before.spread[2] == after.spread[2]);
    assert_memory_equal(after.scores + 2 * size, after.scores + 3 * size, size * sizeof(double));
    assert_true(memcmp(before.scores, after.scores, size * sizeof(double)) != 0);
    srnf_folds_clear(&before);
    srnf_folds_clear(&after);
    close_parts(&p);
}

/* The classes differ by what two parts have in common: x + y of a normal x in one and y in the
   other is moved, x - y is spread far more. Fields that need no registration. */
static void tells_what_two_parts_have_together(void **state)
{
    enum { MEMBERS = 100 };
    struct test_random random = test_random_seed(5);
    struct srnf_classify_options options = srnf_classify_options_defaults();
    struct srnf_folds parts[2], joint;
    double x[2][MEMBERS], accuracy[3], weights[] = {1.0, 1.0};
    size_t labels[MEMBERS];
    (void)state;

    for (size_t i = 0; i < MEMBERS; i++) {
        double apart = 6.0 * test_random_normal(&random);
        double together = test_random_normal(&random) + (i % 2 ? 4.0 : 0.0);

        labels[i] = i % 2;
        x[0][i] = together + apart;
        x[1][i] = together - apart;
    }
    for (size_t k = 0; k < 2; k++) {
        parts[k] = (struct srnf_folds){.n = MEMBERS};
        parts[k].templates = srnf_alloc(MEMBERS, sizeof(size_t));
        parts[k].products = srnf_alloc(MEMBERS, sizeof(double *));
        parts[k].products[0] = srnf_alloc(MEMBERS * MEMBERS, sizeof(double));
        for (size_t i = 0; i < MEMBERS * MEMBERS; i++) {
            parts[k].products[0][i] = x[k][i / MEMBERS] * x[k][i % MEMBERS];
        }
    }
    options.components = 1;
    for (size_t way = 0; way < 3; way++) {
        struct srnf_classification found;

        options.components = way == 2 ? 2 : 1;
        assert_int_equal(srnf_folds_join(way == 2 ? 2 : 1, way == 1 ? parts + 1 : parts, weights,
                                         NULL, 0.0, options.components, NULL, &joint, NULL),
                         SRNF_OK);
        assert_int_equal(srnf_classify_gauss(&joint, labels, 2, &options, NULL, &found, NULL),
                         SRNF_OK);
        accuracy[way] = found.accuracy;
        srnf_classification_clear(&found);
        srnf_folds_clear(&joint);
    }
    printf("# alone %.2f and %.2f, together %.2f\n", accuracy[0], accuracy[1], accuracy[2]);
    assert_true(accuracy[0] < 0.85 && accuracy[1] < 0.85);
    assert_true(accuracy[2] > 0.9);
    srnf_folds_clear(&parts[0]);
    srnf_folds_clear(&parts[1]);
}

/* Two parts and a number that say nothing: p at or below .05 in 4 to 17 of 200 studies, as 95 % of
   such series have. */
static void finds_nothing_where_there_is_nothing(void **state)
{
    enum { MEMBERS = 20, STUDIES = 200 };
    static const double weights[] = {1.0, 2.0};
    size_t found[2] = {0, 0};
    (void)state;

    for (uint64_t study = 0; study < STUDIES; study++) {
        struct test_random random = test_random_seed(100 + study);
        struct srnf_classify_options options = srnf_classify_options_defaults();
        struct srnf_folds parts[2], joint;
        double features[MEMBERS];
        size_t labels[MEMBERS];

        for (size_t k = 0; k < 2; k++) {
            double x[MEMBERS][3];

            parts[k] = (struct srnf_folds){.n = MEMBERS};
            parts[k].templates = srnf_alloc(MEMBERS, sizeof(size_t));
            parts[k].products = srnf_alloc(MEMBERS, sizeof(double *));
            parts[k].products[0] = srnf_alloc(MEMBERS * MEMBERS, sizeof(double));
            test_random_normals(&random, 3 * MEMBERS, &x[0][0]);
            for (size_t i = 0; i < MEMBERS * MEMBERS; i++) {
                parts[k].products[0][i] = linear_dot(3, x[i / MEMBERS], x[i % MEMBERS]) +
                                          1e-3 * (double)(i % (MEMBERS + 1) == 0);
            }
        }
        for (size_t i = 0; i < MEMBERS; i++) {
            labels[i] = i % 2;
            features[i] = test_random_normal(&random);
        }
        assert_int_equal(srnf_folds_join(2, parts, weights, NULL, 0.0, 5, NULL, &joint, NULL),
                         SRNF_OK);
        options.components = 3;
        options.covariance = SRNF_COVARIANCE_POOLED;
        options.features = features;
        options.n_features = 1;
        options.permutations = 99;
        options.seed = study;
        for (int gauss = 0; gauss < 2; gauss++) {
            struct srnf_classification r;

            assert_int_equal((gauss ? srnf_classify_gauss : srnf_classify_nearest)(
                                 &joint, labels, 2, &options, NULL, &r, NULL),
                             SRNF_OK);
            found[gauss] += r.p_value <= 0.05;
            srnf_classification_clear(&r);
        }
        srnf_folds_clear(&joint);
        srnf_folds_clear(&parts[0]);
        srnf_folds_clear(&parts[1]);
    }
    printf("# of 200 studies: nearest %zu, Gauss %zu\n", found[0], found[1]);
    assert_true(found[0] <= 17 && found[1] <= 17); /* few right answers make p larger */
    assert_true(found[0] + found[1] > 0);
}

static void assert_refused(size_t n_parts, const struct srnf_folds *folds, const double *weights,
                           size_t components, const char *text)
{
    struct srnf_error error = {0};
    struct srnf_folds joint;

    assert_int_equal(
        srnf_folds_join(n_parts, folds, weights, NULL, 0.0, components, NULL, &joint, &error),
        SRNF_EINVAL);
    assert_null(joint.scores);
    assert_non_null(strstr(error.message, text));
}

static void wrong_arguments_are_refused(void **state)
{
    double weights[2] = {1.0, 1.0};
    struct srnf_folds other;
    struct parts p;
    (void)state;

    open_parts(&p);
    compare(&p, NULL);
    assert_refused(0, p.folds, weights, 5, "0 parts");
    assert_refused(2, p.folds, weights, 0, "components is 0");
    assert_refused(2, p.folds, weights, 65, "components is 65");
    weights[1] = 0.0;
    assert_refused(2, p.folds, weights, 5, "weight of part 1");
    weights[1] = NAN;
    assert_refused(2, p.folds, weights, 5, "weight of part 1");
    weights[1] = 1.0;
    other = p.folds[1];
    p.folds[1].n--;
    assert_refused(2, p.folds, weights, 5, "part 1");
    p.folds[1] = other;
    p.folds[1].templates = NULL;
    assert_refused(2, p.folds, weights, 5, "part 1");
    p.folds[1] = other;
    close_parts(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_part_is_itself),
        cmocka_unit_test(sums_the_parts),
        cmocka_unit_test(positions_count),
        cmocka_unit_test(the_subject_left_out_leaves_no_trace),
        cmocka_unit_test(tells_what_two_parts_have_together),
        cmocka_unit_test(finds_nothing_where_there_is_nothing),
        cmocka_unit_test(wrong_arguments_are_refused),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
