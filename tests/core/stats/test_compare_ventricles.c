/*
 * test_compare_ventricles.c - the comparison of groups on the variation of left ventricles,
 * divided by lot: a region planted in one of the groups is found, and nothing is found without it
 * more often than the level says.
 *
 * srnfd-test: release-only
 * srnfd-test: slow
 */
#include "group.h"

#include <fftw3.h>

#define DEGREE 8
#define N ((size_t)40)
#define SEEDS ((size_t)20)
#define LEVEL 0.05
#define PERMUTATIONS ((size_t)199)
#define HEIGHT 0.2 /* of what is planted, in radii */
#define SHARPNESS 12.0

struct cohort {
    struct group g;
    double *nodes;        /* [P][3] */
    double *mean;         /* [3][(L+1)^2] */
    double *registered_q; /* [N][3][P], as parameterized */
};

static void open_cohort(struct cohort *a)
{
    group_open_ventricles(&a->g, DEGREE, N);
    a->nodes = shapes_doubles(3 * a->g.points);
    a->mean = shapes_doubles(a->g.count);
    a->registered_q = shapes_doubles(N * 3 * a->g.points);
    stats_nodes(a->g.grid, a->nodes);
}

static void close_cohort(struct cohort *a)
{
    srnf_free(a->registered_q);
    srnf_free(a->mean);
    srnf_free(a->nodes);
    group_close(&a->g);
}

/* As many of either group as can be, by lot. */
static void draw_lots(uint64_t seed, int *labels)
{
    size_t order[N];

    srnf_permutation(seed, 0, N, order);
    for (size_t i = 0; i < N; i++) {
        labels[i] = (int)(order[i] % 2);
    }
}

/* Raises the surfaces of group 1 about the direction (1, 0, 0). */
static void plant(struct cohort *a, const int *labels)
{
    double *values = shapes_doubles(3 * a->g.points);
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(a->g.sht, 3));

    assert_non_null(workspace);
    for (size_t i = 0; i < N; i++) {
        srnf_sht_synthesis(a->g.sht, 3, a->g.f[i], values, workspace);
        for (size_t k = 0; k < 3 * a->g.points && labels[i]; k++) {
            double x = a->nodes[3 * (k % a->g.points)];

            values[k] *= 1.0 + HEIGHT * exp(-SHARPNESS * (1.0 - x));
        }
        srnf_sht_analysis(a->g.sht, 3, values, a->g.f[i], workspace);
    }
    srnf_free(workspace);
    srnf_free(values);
}

static void update(struct cohort *a)
{
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(a->g.sht));

    assert_non_null(workspace);
    memset(a->mean, 0, a->g.count * sizeof(double));
    for (size_t i = 0; i < N; i++) {
        srnf_field(a->g.sht, a->g.f[i], a->registered_q + i * 3 * a->g.points, workspace);
        for (size_t k = 0; k < a->g.count; k++) {
            a->mean[k] += a->g.f[i][k] / (double)N;
        }
    }
    srnf_free(workspace);
}

static void compare(const struct cohort *a, const int *labels, size_t permutations, uint64_t seed,
                    struct srnf_comparison *out)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();

    options.permutations = permutations;
    options.seed = seed;
    assert_int_equal(srnf_compare_groups(a->g.sht, N, a->mean, a->registered_q, labels, 0, NULL,
                                         &options, NULL, out, NULL),
                     SRNF_OK);
}

static void planted_region_is_found_where_it_is(void **state)
{
    struct cohort a;
    struct srnf_comparison out;
    int labels[N];
    size_t count[2] = {0, 0}; /* nodes of the region, and of the far half */
    size_t found[2] = {0, 0};

    (void)state;
    open_cohort(&a);
    draw_lots(77, labels);
    plant(&a, labels);
    update(&a);
    compare(&a, labels, 999, 1, &out);
    for (size_t p = 0; p < a.g.points; p++) {
        double x = a.nodes[3 * p];

        if (x > 0.9 || x < 0.0) {
            count[x < 0.0]++;
            assert_true(isfinite(out.significance[p]));
            found[x < 0.0] += out.significance[p] <= LEVEL;
        }
    }
    printf("# p %.3f, least significance %.3f; %zu of %zu nodes reported, far half %zu of %zu\n",
           out.p_value, out.max_p_value, found[0], count[0], found[1], count[1]);
    assert_true(out.max_p_value <= 0.005);
    assert_true(10 * found[0] >= 9 * count[0]);
    /* Raising a region moves the centroid, about which surfaces are compared: a true difference. */
    assert_true(4 * found[1] <= count[1]);
    srnf_comparison_clear(&out);
    close_cohort(&a);
}

static void groups_by_lot_are_not_told_apart(void **state)
{
    struct cohort a;
    size_t rejected = 0;
    size_t mapped = 0;

    (void)state;
    open_cohort(&a);
    update(&a);
    for (size_t seed = 0; seed < SEEDS; seed++) {
        struct srnf_comparison out;
        int labels[N];

        draw_lots(200 + seed, labels);
        compare(&a, labels, PERMUTATIONS, seed, &out);
        assert_true(isfinite(out.p_value) && isfinite(out.max_p_value));
        rejected += out.p_value <= LEVEL;
        mapped += out.max_p_value <= LEVEL;
        srnf_comparison_clear(&out);
    }
    printf("# of %zu labellings %zu rejected by the means, %zu by the map\n", SEEDS, rejected,
           mapped);
    assert_true(rejected <= 4); /* more than that: chance 3e-3 at the level */
    assert_true(mapped <= 4);
    close_cohort(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planted_region_is_found_where_it_is),
        cmocka_unit_test(groups_by_lot_are_not_told_apart),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
