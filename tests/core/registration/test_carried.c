/*
 * test_carried.c - points that a search carries from step to step by splines, against its chain
 * followed exactly, from which they may be off by what is promised; and the energy that is told of
 * them.
 */
#include "registrations.h"
#include "registration/tabulated.h"

#define DEGREE ((size_t)15)
#define LONG ((size_t)25) /* links: a chain of more carries its errors further */
#define SHORT_POINTS 2e-8 /* off the chain, on the unit sphere */
#define LONG_POINTS 1e-5
#define ENERGY 5e-8 /* relative */

static const struct {
    const char *from, *to;
    bool common_pose;
} pairs[] = {
    {REGISTRATIONS_LOCAL "L_thalamus.ply", REGISTRATIONS_LOCAL "L_amygdala.ply", false},
    {REGISTRATIONS_LOCAL "R_pallidum.ply", REGISTRATIONS_LOCAL "L_putamen.ply", false},
    {REGISTRATIONS_LOCAL "R_putamen.ply", REGISTRATIONS_LOCAL "R_caudate.ply", true},
    {"asteroid 1", "asteroid 2", false},
    {"3 arms", "bumpy star", false},
    {REGISTRATIONS_LOCAL "L_hippocampus.ply", REGISTRATIONS_LOCAL "L_caudate.ply", false},
    {"ventricle 0", REGISTRATIONS_LOCAL "R_thalamus.ply", true},
    {"asteroid 1", "asteroid 2", true},
};
#define PAIRS (FIGURES_SLOW ? 1 : sizeof pairs / sizeof pairs[0])

/* The largest distance of a point, and the relative difference of the energies. */
static void compare(const struct search *s, const struct search_result *found, double *distance,
                    double *energy)
{
    const struct warp *warp = &found->warp;
    struct search_result exact = {.iterations = 0};

    assert_int_equal(search_evaluate(s, &warp->chain, &exact), SRNF_OK);
    assert_int_equal(exact.warp.n, warp->n);
    *distance = 0.0;
    for (size_t i = 0; i < warp->n; i++) {
        const double *a = exact.warp.points + 3 * i, *b = warp->points + 3 * i;

        *distance = compare_max(*distance, hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]));
    }
    *energy = fabs(warp->energy / exact.warp.energy - 1.0);
    search_result_clear(&exact);
}

/* The points of a search are the bits that its chain gives by tables from the nodes: means go on
   from them as from a chain that is read again. */
static void compare_with_tables(const struct search *s, const struct search_result *found)
{
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const struct warp *warp = &found->warp;
    struct tabulated_target target;
    struct cloud cloud;
    size_t different = 0;

    assert_true(found->carried);
    assert_int_equal(tabulated_target_create(&target, &s->full.target), SRNF_OK);
    assert_int_equal(cloud_create(&cloud, target.n), SRNF_OK);
    cloud_rotate(&cloud, &target, identity);
    assert_int_equal(cloud_follow(&cloud, &warp->chain, &follow_table, NULL, NULL), SRNF_OK);
    for (size_t i = 0; i < warp->n; i++) {
        const double point[4] = {cloud.point[0][i], cloud.point[1][i], cloud.point[2][i],
                                 cloud.jacobian[i]};

        different += memcmp(point, warp->points + 3 * i, 3 * sizeof *point) != 0 ||
                     memcmp(point + 3, warp->jacobian + i, sizeof *point) != 0;
    }
    assert_int_equal(different, 0);
    cloud_clear(&cloud);
    tabulated_target_clear(&target);
}

static void carried_points_are_those_of_the_chain(void **state)
{
    (void)state;
    for (size_t k = 0; k < PAIRS; k++) {
        struct srnf_register_options options = srnf_register_options_defaults();
        struct shapes_surface a, b;
        struct search search;
        struct search_result found;
        double distance, energy;

        assert_true(registrations_open(&a, DEGREE, pairs[k].from));
        assert_true(registrations_open(&b, DEGREE, pairs[k].to));
        options.common_pose = pairs[k].common_pose;
        assert_int_equal(search_create(&search, a.sht, a.q, a.f, b.f, &options, NULL, NULL, NULL),
                         SRNF_OK);
        assert_int_equal(search_run(&search, &found), SRNF_OK);
        compare(&search, &found, &distance, &energy);
        compare_with_tables(&search, &found);
        printf("# %s, %s, %s: %zu links\n", pairs[k].from, pairs[k].to,
               pairs[k].common_pose ? "common pose" : "any pose", found.warp.chain.n_links);
        figure_below("points", distance,
                     found.warp.chain.n_links > LONG ? LONG_POINTS : SHORT_POINTS);
        figure_below("energy", energy, ENERGY);
        search_result_clear(&found);
        search_clear(&search);
        shapes_close(&b);
        shapes_close(&a);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(carried_points_are_those_of_the_chain),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
