/*
 * test_twins.c - members that repeat: distances by the Gram matrix, and the pairs that are far
 * nearer to each other than the others.
 */
#include "group.h"
#include "support/random.h"

#define DEGREE 5
#define N ((size_t)8)

/* SRNFs of stars as they are parameterized, [N][3][P]. */
static double *fields(const struct group *g)
{
    double *q = shapes_doubles(N * 3 * g->points);
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(g->sht));

    assert_non_null(workspace);
    for (size_t i = 0; i < N; i++) {
        srnf_field(g->sht, g->f[i], q + i * 3 * g->points, workspace);
    }
    srnf_free(workspace);
    return q;
}

static void test_distances(void **state)
{
    struct group g;
    double pairs[N * N];
    double *q;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.3);
    q = fields(&g);
    memcpy(q + 3 * 3 * g.points, q, 3 * g.points * sizeof(double));
    assert_int_equal(srnf_twins_distances(g.grid, N, q, pairs), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < N; j++) {
            double d2 = stats_distance2(g.grid, q + i * 3 * g.points, q + j * 3 * g.points);

            assert_true(fabs(pairs[i * N + j] * pairs[i * N + j] - d2) < 1e-13);
            assert_true(pairs[i * N + j] == pairs[j * N + i]);
        }
    }
    assert_true(pairs[3] < 1e-7);
    srnf_free(q);
    group_close(&g);
}

/* Points on a line at these places. */
static void fill(const double *places, size_t n, double *pairs)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            pairs[i * n + j] = fabs(places[i] - places[j]);
        }
    }
}

static void test_find(void **state)
{
    static const double apart[N] = {0, 1, 2, 3, 4, 5, 6, 7};
    static const double twins_at[N] = {0, 1, 2.05, 2, 4, 5, 6, 6.02};
    static const size_t subjects[N] = {0, 1, 2, 2, 4, 5, 6, 7};
    struct srnf_twins twins;
    double pairs[N * N];

    (void)state;
    fill(apart, N, pairs);
    assert_int_equal(srnf_twins_find(N, pairs, NULL, NULL, &twins), SRNF_OK);
    assert_int_equal(twins.count, 0);
    assert_true(twins.nearest == 1.0 && twins.quartile == 2.0 && twins.median == 3.0);
    fill(twins_at, N, pairs);
    assert_int_equal(srnf_twins_find(N, pairs, NULL, NULL, &twins), SRNF_OK);
    assert_int_equal(twins.count, 2);
    assert_int_equal(twins.first, 6);
    assert_int_equal(twins.second, 7);
    assert_int_equal(srnf_twins_find(N, pairs, subjects, NULL, &twins), SRNF_OK);
    assert_int_equal(twins.count, 1); /* the other two are one subject */
    pairs[6 * N + 7] = pairs[7 * N + 6] = NAN;
    assert_int_equal(srnf_twins_find(N, pairs, subjects, NULL, &twins), SRNF_OK);
    assert_int_equal(twins.count, 0);
}

/* Two kinds far from each other: members of one kind are near, and no twins. */
static void test_classes(void **state)
{
    static const double places[N] = {0, 1, 2, 3, 100, 101, 102, 103};
    static const size_t classes[N] = {0, 0, 0, 0, 1, 1, 1, 1};
    struct srnf_twins twins;
    double pairs[N * N];

    (void)state;
    fill(places, N, pairs);
    assert_int_equal(srnf_twins_find(N, pairs, NULL, classes, &twins), SRNF_OK);
    assert_int_equal(twins.count, 0);
    pairs[4 * N] = pairs[4] = 0.001; /* a scan of each kind, of one subject */
    assert_int_equal(srnf_twins_find(N, pairs, NULL, classes, &twins), SRNF_OK);
    assert_int_equal(twins.count, 1);
}

/* Points in a square: near pairs come by chance, and are not told of. */
static void test_dimension(void **state)
{
    enum { MANY = 60 };
    static double pairs[MANY * MANY];
    struct srnf_twins twins;
    double at[MANY][2];
    size_t told = 0;

    (void)state;
    for (uint64_t seed = 0; seed < 20; seed++) {
        struct test_random random = test_random_seed(seed);

        for (size_t i = 0; i < MANY; i++) {
            at[i][0] = test_random_normal(&random);
            at[i][1] = test_random_normal(&random);
        }
        for (size_t i = 0; i < MANY; i++) {
            for (size_t j = 0; j < MANY; j++) {
                pairs[i * MANY + j] = hypot(at[i][0] - at[j][0], at[i][1] - at[j][1]);
            }
        }
        assert_int_equal(srnf_twins_find(MANY, pairs, NULL, NULL, &twins), SRNF_OK);
        assert_true(twins.nearest < 0.25 * twins.quartile);
        told += twins.count > 0;
    }
    assert_true(told <= 2);
}

static void test_refusals(void **state)
{
    struct srnf_twins twins;
    struct srnf_sht *sht;
    double pairs[1];

    (void)state;
    assert_int_equal(srnf_sht_create(&sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), SRNF_OK);
    assert_int_equal(srnf_twins_distances(srnf_sht_grid(sht), 0, pairs, pairs), SRNF_EINVAL);
    assert_int_equal(srnf_twins_distances(srnf_sht_grid(sht), 30001, pairs, pairs), SRNF_EINVAL);
    assert_int_equal(srnf_twins_find(30001, pairs, NULL, NULL, &twins), SRNF_EINVAL);
    assert_int_equal(srnf_twins_find(0, pairs, NULL, NULL, &twins), SRNF_OK);
    assert_int_equal(twins.count, 0);
    srnf_sht_destroy(sht);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_distances), cmocka_unit_test(test_find),
        cmocka_unit_test(test_classes),   cmocka_unit_test(test_dimension),
        cmocka_unit_test(test_refusals),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
