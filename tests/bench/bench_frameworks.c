/*
 * bench_frameworks.c - the two frameworks side by side on the same eight surfaces, in one run (the
 * paper, Table 1): mean, parallel transport, deformation transfer (support/frameworks.h).
 *
 * The surfaces are real left ventricles where the data are there, otherwise random stars,
 * registered to the first; registration is the same for both and not timed. Transport and transfer
 * are those of all eight i at degree 15, of one at degree 31. Times are processor time of one
 * thread for one answer; U counts gradient transforms. The paper's ratios are 2.3 to more than 80.
 *
 * Exit status: 0.
 */
#include <stdio.h>
#include <stdlib.h>

#include <fftw3.h>

#include "bench/ventricles.h"
#include "support/frameworks.h"

#define N ((size_t)8)
#define REPEATS ((size_t)3)

static const struct {
    size_t degree, answers;
} runs[] = {{15, N}, {31, 1}};

static void register_group(const struct group *g)
{
    for (size_t i = 1; i < g->n; i++) {
        struct srnf_registration registration;

        if (srnf_register(g->sht, g->f[0], NULL, g->f[i], NULL, NULL, NULL, &registration, NULL) <
            0) {
            (void)fprintf(stderr, "bench_frameworks: registration failed\n");
            exit(2);
        }
        memcpy(g->f[i], registration.coefficients, g->count * sizeof(double));
        srnf_registration_clear(&registration);
    }
}

static void bench_degree(size_t degree, size_t answers)
{
    struct frameworks_row rows[FRAMEWORKS_ROWS];
    struct group g;

    if (!ventricles_open(&g, degree, N, SRNF_PARAMETERIZATION_STAR)) {
        group_open_stars(&g, degree, N, 0.3);
    }
    register_group(&g);
    frameworks_compare(g.sht, g.n, g.surfaces, answers, REPEATS, rows);
    for (size_t k = 0; k < FRAMEWORKS_ROWS; k++) {
        const struct frameworks_row *row = &rows[k];

        printf("%6zu  %-14s  %9.2f ms  %9.2f ms  %6.1f  %.2e  %.4f  %8.0f  %9.0f%s\n", degree,
               row->operation, 1e3 * row->seconds_srnf, 1e3 * row->seconds_pullback, row->ratio,
               row->distance, row->size, row->transforms_srnf, row->transforms_pullback,
               row->converged ? "" : "  not converged");
    }
    (void)fflush(stdout);
    group_close(&g);
}

int main(void)
{
    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    printf("%zu surfaces, registered to the first; apart: the largest distance of two answers\n\n"
           "%6s  %-14s  %12s  %12s  %6s  %-8s  %-6s  %8s  %9s\n",
           N, "degree", "operation", "SRNF", "pull-back", "ratio", "apart", "size", "U", "U");
    for (size_t k = 0; k < sizeof runs / sizeof runs[0]; k++) {
        bench_degree(runs[k].degree, runs[k].answers);
    }
    return EXIT_SUCCESS;
}
