/*
 * test_ventricles.c - mean and principal components of left ventricles with twelve
 * known modes: the spectrum without
 * and with registration, what registration gains, and what it costs.
 *
 * srnfd-test: timeout 600
 *
 * The vertices of the meshes correspond and have rank 12 (bodies.h). Surfaces that are interpolated
 * between them, all over the same directions, keep that rank; their SRNFs nearly do, for Q is
 * smooth. In the radial parameterization of each mesh the correspondence is lost, and the rank with
 * it. Real ventricles are in bench_ventricles.
 * srnfd-test: slow
 * srnfd-test: release-only
 * It measures; under the sanitizers test_mean.c and test_pca.c run the same code.
 */
#include "group.h"
#include "support/correspondence.h"

#include <fftw3.h>

#define DEGREE 15
#define PLAIN (FIGURES_SLOW ? (size_t)24 : (size_t)100)
#define POSED (FIGURES_SLOW ? (size_t)4 : (size_t)24)
#define FREE (FIGURES_SLOW ? (size_t)2 : (size_t)4)
#define RANK ((size_t)12)

/* The mean and its components, told in full; returns the total variance. */
static double analyse(const char *name, size_t n, const struct srnf_register_options *registration,
                      double *first_twelve, double *relative_energy)
{
    struct group g;
    struct group_watch watch;
    struct srnf_context context = group_context(&watch, 2);
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    struct srnf_pca pca;
    double total;
    double sum = 0.0;
    double seconds;

    group_open_ventricles(&g, DEGREE, n);
    options.registration = registration;
    seconds = timing_monotonic();
    assert_true(srnf_karcher_mean(g.sht, n, g.surfaces, &options, &context, &mean, NULL) >= 0);
    seconds = timing_monotonic() - seconds;
    printf("# %s: %zu ventricles, %.2f s on two threads, relative energy of the mean %.1e\n", name,
           n, seconds, mean.relative_energy);
    for (size_t k = 0; k < mean.iterations; k++) {
        printf("#   iteration %zu: change %.2e, variance %.5e, %.2f s\n", k + 1,
               mean.history[k].change, mean.history[k].variance,
               mean.history[k].seconds - (k > 0 ? mean.history[k - 1].seconds : 0.0));
    }
    assert_true(mean.converged);
    assert_int_equal(srnf_pca_fit(g.grid, n, mean.mean_q, mean.registered_q, 0, &pca), SRNF_OK);
    printf("#   %zu components, total variance %.4e, cumulative:", pca.components,
           pca.total_variance);
    *first_twelve = 0.0;
    for (size_t k = 0; k < pca.components; k++) {
        sum += pca.explained[k];
        *first_twelve = k < RANK ? sum : *first_twelve;
        if (k < 16) {
            printf(" %.4f", sum);
        }
    }
    printf("\n");
    assert_true(fabs(sum - 1.0) <= 1e-6);
    total = pca.total_variance;
    *relative_energy = mean.relative_energy;
    srnf_pca_clear(&pca);
    srnf_mean_clear(&mean);
    group_close(&g);
    return total;
}

/* ---- With the correspondence of the vertices ------------------------------------------------- */

static void nearly_keep_the_rank_of_the_vertices(void **state)
{
    struct group g;
    struct srnf_mesh meshes[GROUP_MAX];
    struct srnf_mean mean;
    struct srnf_pca pca;
    double sum = 0.0;

    (void)state;
    group_open_ventricles(&g, DEGREE, PLAIN);
    for (size_t i = 0; i < g.n; i++) {
        meshes[i] = bodies_ventricle(i);
        assert_int_equal(meshes[i].n_vertices, meshes[0].n_vertices);
    }
    assert_true(correspondence_surfaces(g.sht, g.n, meshes, 100.0, g.f));
    assert_int_equal(srnf_karcher_mean(g.sht, g.n, g.surfaces, NULL, NULL, &mean, NULL), SRNF_OK);
    assert_int_equal(srnf_pca_fit(g.grid, g.n, mean.mean_q, mean.registered_q, 0, &pca), SRNF_OK);
    printf("# vertices in correspondence: cumulative");
    for (size_t k = 0; k < RANK; k++) {
        sum += pca.explained[k];
        printf(" %.5f", sum);
    }
    printf("\n# the first twelve leave %.2e of the variance\n", 1.0 - sum);
    assert_true(sum >= 0.99);
    for (size_t i = 0; i < g.n; i++) {
        srnf_mesh_clear(&meshes[i]);
    }
    srnf_pca_clear(&pca);
    srnf_mean_clear(&mean);
    group_close(&g);
}

/* ---- As they are encoded --------------------------------------------------------------------- */

static void as_parameterized(void **state)
{
    double first_twelve;
    double relative_energy;

    (void)state;
    (void)analyse("as parameterized", PLAIN, NULL, &first_twelve, &relative_energy);
    printf("# the first twelve leave %.2e of the variance\n", 1.0 - first_twelve);
    assert_true(first_twelve >= 0.9);
    assert_true(relative_energy <= 1e-3);
}

static void registered(void **state)
{
    static const struct {
        const char *name;
        bool common_pose;
    } cases[] = {{"in a common pose", true}, {"in any pose", false}};

    (void)state;
    for (size_t k = 0; k < 2; k++) {
        struct srnf_register_options registration = srnf_register_options_defaults();
        size_t n = cases[k].common_pose ? POSED : FREE;
        double first_twelve;
        double relative_energy;
        double plain = analyse("as parameterized", n, NULL, &first_twelve, &relative_energy);
        double total;

        registration.common_pose = cases[k].common_pose;
        total = analyse(cases[k].name, n, &registration, &first_twelve, &relative_energy);
        printf("# %s: %.3f of the variance is left\n", cases[k].name, total / plain);
        assert_true(total < 0.8 * plain);
        assert_true(relative_energy <= 1e-3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nearly_keep_the_rank_of_the_vertices),
        cmocka_unit_test(as_parameterized),
        cmocka_unit_test(registered),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
