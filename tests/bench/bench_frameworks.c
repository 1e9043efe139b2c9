/*
 * bench_frameworks.c - the algorithms of the frameworks side by side on the same eight surfaces, in
 * one run (the paper, Table 1): mean, parallel transport, deformation transfer.
 *
 * The surfaces are real left ventricles where the data are there, otherwise random stars, all as
 * they are parameterised: registration is the same for every framework and left out. The mean is
 * that of all eight. Transport carries the vector from surface i toward surface i + 1 to surface
 * i + 2, transfer the deformation between the first two to the third, for all i in turn; their time
 * is that of one. Times are processor time of one thread, the least of several runs.
 *
 * A framework is a row of the table below, and so is another one that is added.
 *
 * Exit status: 0.
 */
#include <stdio.h>
#include <stdlib.h>

#include <fftw3.h>

#include "core/stats/group.h"

#define N ((size_t)8)
#define REPEATS ((size_t)3)

static const size_t degrees[] = {15, 31};
#define DEGREES (sizeof degrees / sizeof degrees[0])

static void must(int status, const char *what)
{
    if (status < 0) {
        (void)fprintf(stderr, "bench_frameworks: %s failed: %s\n", what, srnf_strerror(status));
        exit(2);
    }
}

/* Each computes its part once for surface i; the mean takes all at i = 0. Returns gradient
   transforms, 0 where they are not counted. */

static double srnf_mean_once(const struct group *g, size_t i)
{
    struct srnf_mean mean;

    if (i == 0) {
        must(srnf_karcher_mean(g->sht, g->n, g->surfaces, NULL, NULL, &mean, NULL), "the mean");
        srnf_mean_clear(&mean);
    }
    return 0.0;
}

static double srnf_transport_once(const struct group *g, size_t i)
{
    double *velocity = shapes_doubles(3 * g->points);
    struct srnf_tangent tangent;
    double transforms;

    must(srnf_velocity_toward(g->sht, g->f[i], g->f[(i + 1) % N], velocity), "the velocity");
    must(srnf_transport(g->sht, g->f[(i + 2) % N], velocity, NULL, &tangent, NULL), "transport");
    transforms = tangent.transforms;
    srnf_tangent_clear(&tangent);
    srnf_free(velocity);
    return transforms;
}

static double srnf_transfer_once(const struct group *g, size_t i)
{
    struct srnf_transferred transferred;
    double transforms;

    must(srnf_transfer(g->sht, g->f[i], g->f[(i + 1) % N], g->f[(i + 2) % N], SRNF_TRANSFER_RATIO,
                       NULL, &transferred, NULL),
         "transfer");
    transforms = transferred.transforms;
    srnf_transferred_clear(&transferred);
    return transforms;
}

static const struct {
    const char *framework, *algorithm;
    double (*once)(const struct group *g, size_t i);
    size_t per_run; /* answers that one run over all i gives */
} rows[] = {
    {"srnf", "mean", srnf_mean_once, 1},
    {"srnf", "transport", srnf_transport_once, N},
    {"srnf", "transfer", srnf_transfer_once, N},
};
#define ROWS (sizeof rows / sizeof rows[0])

static void bench_degree(const struct group *g)
{
    for (size_t k = 0; k < ROWS; k++) {
        double seconds[REPEATS];
        double transforms = 0.0;

        for (size_t r = 0; r < REPEATS; r++) {
            double start = timing_cpu();

            transforms = 0.0;
            for (size_t i = 0; i < N; i++) {
                transforms += rows[k].once(g, i);
            }
            seconds[r] = (timing_cpu() - start) / (double)rows[k].per_run;
        }
        printf("%6zu  %-10s  %-10s  %10.2f ms", g->degree, rows[k].framework, rows[k].algorithm,
               1e3 * timing_minimum(REPEATS, seconds));
        if (transforms > 0.0) {
            printf("  %8.0f U", transforms / (double)rows[k].per_run);
        }
        printf("\n");
    }
}

int main(void)
{
    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    printf("%zu surfaces, as they are parameterised\n\n%6s  %-10s  %-10s  %13s  %10s\n", N,
           "degree", "framework", "algorithm", "one answer", "transforms");
    for (size_t k = 0; k < DEGREES; k++) {
        struct group g;

        if (!group_open_ventricles(&g, degrees[k], N)) {
            group_open_stars(&g, degrees[k], N, 0.3);
        }
        bench_degree(&g);
        group_close(&g);
    }
    return EXIT_SUCCESS;
}
