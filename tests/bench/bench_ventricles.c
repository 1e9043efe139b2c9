/*
 * bench_ventricles.c - mean and principal components of a hundred real left ventricles at degree
 * 15, in one run: as they are parameterized, and registered in a common pose; the spectra side by
 * side.
 *
 * Skips, saying so, where the data are not there. Seconds are processor time of one thread.
 */
#include <stdio.h>
#include <stdlib.h>

#include <fftw3.h>

#include "bench/ventricles.h"

#define N ((size_t)100)
#define DEGREE 15
#define SHOWN ((size_t)16)
#define MODES ((size_t)12) /* the meshes were rebuilt from that many */
#define LEAST_SHARE 0.9

static double processor_seconds(void *user)
{
    (void)user;
    return timing_cpu();
}

static void fit(const struct group *g, const struct srnf_register_options *registration,
                double cumulative[SHOWN])
{
    struct srnf_context context = {.seconds = processor_seconds};
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    struct srnf_pca pca;
    double start = timing_cpu();
    double sum = 0.0;

    options.registration = registration;
    if (srnf_karcher_mean(g->sht, g->n, g->surfaces, &options, &context, &mean, NULL) < 0 ||
        srnf_pca_fit(g->grid, g->n, mean.mean_q, mean.registered_q, 0, &pca) < 0) {
        fputs("bench_ventricles: the mean or its components failed\n", stderr);
        exit(2);
    }
    printf("%s: %zu surfaces, %zu iterations, %s, %.2f s in all\n",
           registration ? "registered in a common pose" : "as parameterized", g->n, mean.iterations,
           mean.converged ? "converged" : "not converged", timing_cpu() - start);
    for (size_t k = 0; k < mean.iterations; k++) {
        printf("  iteration %2zu  change %.2e  variance %.5e  objective %.5e  %7.3f s\n", k + 1,
               mean.history[k].change, mean.history[k].variance, mean.history[k].objective,
               mean.history[k].seconds - (k > 0 ? mean.history[k - 1].seconds : 0.0));
    }
    printf("  relative energy of the inverse %.1e, total variance %.4e\n", mean.relative_energy,
           pca.total_variance);
    for (size_t k = 0; k < SHOWN; k++) {
        sum += k < pca.components ? pca.explained[k] : 0.0;
        cumulative[k] = sum;
    }
    srnf_pca_clear(&pca);
    srnf_mean_clear(&mean);
}

int main(void)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct group g;
    double plain[SHOWN];
    double registered[SHOWN];

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    if (!ventricles_open(&g, DEGREE, N, SRNF_PARAMETERIZATION_STAR)) {
        return EXIT_SUCCESS;
    }
    registration.common_pose = true;
    fit(&g, NULL, plain);
    fit(&g, &registration, registered);
    printf("components  cumulative share of the variance: as parameterized, registered\n");
    for (size_t k = 0; k < SHOWN; k++) {
        printf("  %8zu  %.5f  %.5f\n", k + 1, plain[k], registered[k]);
    }
    group_close(&g);
    if (!(plain[MODES - 1] >= LEAST_SHARE)) {
        printf("the first %zu of the parameterized are below %.2f\n", MODES, LEAST_SHARE);
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}
