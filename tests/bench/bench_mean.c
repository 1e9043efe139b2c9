/*
 * bench_mean.c - the group mean of eight surfaces: one iteration, the inversion of the mean, and
 * what two threads bring, in seconds and in units of one gradient transform of three coordinates
 * measured in the same run.
 *
 * The surfaces are real left ventricles where the data are there, otherwise random stars. The first
 * iteration registers from nothing; the later ones go on from there, and the least of them counts.
 * The paper reports 174 s for an iteration and 6 s for an inversion; how many times less it is here
 * is printed. Times of one thread are processor time. Parallel efficiency is elapsed time on one
 * thread over twice that on two, the best of several runs taken in turn; it means nothing while
 * other programs take the processors.
 *
 * Exit status: 0 if the efficiency is what is required, or there is one processor; 1 otherwise.
 */
#include <stdio.h>
#include <stdlib.h>

#include <fftw3.h>
#include <unistd.h>

#include "bench/ventricles.h"

#define N ((size_t)8)
#define ITERATIONS ((size_t)4)
#define REPEATS ((size_t)3)
#define PAPER_ITERATION 174.0
#define PAPER_INVERSION 6.0
#define EFFICIENCY 0.8
#define SAMPLES ((size_t)21)

static const size_t degrees[] = {15, 31};
#define DEGREES (sizeof degrees / sizeof degrees[0])

/* ---- The unit -------------------------------------------------------------------------------- */

struct unit {
    const struct group *g;
    double *a, *b;
    void *workspace;
};

static void gradient(void *argument)
{
    struct unit *unit = argument;

    srnf_sht_gradient(unit->g->sht, 3, unit->g->f[0], unit->a, unit->b, unit->workspace);
}

static double measure_unit(const struct group *g)
{
    struct unit unit = {g, shapes_doubles(3 * g->points), shapes_doubles(3 * g->points),
                        srnf_alloc(1, srnf_sht_workspace_size(g->sht, 3))};
    struct timing_case subject = {.body = gradient, .argument = &unit};
    double seconds[SAMPLES];

    if (!unit.workspace) {
        exit(2);
    }
    timing_calibrate(&subject, 0.002);
    timing_interleave(&subject, 1, SAMPLES, seconds);
    srnf_free(unit.a);
    srnf_free(unit.b);
    srnf_free(unit.workspace);
    return timing_minimum(SAMPLES, seconds);
}

/* ---- The mean -------------------------------------------------------------------------------- */

static double processor_seconds(void *user)
{
    (void)user;
    return timing_cpu();
}

struct figures {
    double first, later, inversion, change, relative_energy;
};

static struct figures run(const struct group *g, const struct srnf_context *context,
                          bool common_pose)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    struct figures figures = {.later = INFINITY};
    double start = context->seconds(context->user);

    registration.common_pose = common_pose;
    options.registration = &registration;
    options.tolerance = 0.0;
    options.max_iterations = ITERATIONS;
    if (srnf_karcher_mean(g->sht, N, g->surfaces, &options, context, &mean, NULL) < 0) {
        fputs("bench_mean: the mean failed\n", stderr);
        exit(2);
    }
    figures.first = mean.history[0].seconds;
    for (size_t k = 1; k < ITERATIONS; k++) {
        figures.later =
            compare_min(figures.later, mean.history[k].seconds - mean.history[k - 1].seconds);
    }
    figures.inversion =
        context->seconds(context->user) - start - mean.history[ITERATIONS - 1].seconds;
    figures.change = mean.history[ITERATIONS - 1].change;
    figures.relative_energy = mean.relative_energy;
    srnf_mean_clear(&mean);
    return figures;
}

static void bench_degree(const struct group *g)
{
    struct srnf_context context = {.seconds = processor_seconds};
    double unit = measure_unit(g);

    printf("%6zu  one gradient transform: %.1f us\n", g->degree, 1e6 * unit);
    for (int pose = 1; pose >= 0; pose--) {
        struct figures f = run(g, &context, pose);
        const struct {
            const char *name;
            double seconds, paper;
        } rows[] = {
            {"first iteration", f.first, PAPER_ITERATION},
            {"later iteration", f.later, PAPER_ITERATION},
            {"inversion", f.inversion, PAPER_INVERSION},
        };

        for (size_t k = 0; k < 3; k++) {
            printf("%6zu  %-11s  %-16s  %9.4f s  %9.0f U  1/%.0f of the paper's\n", g->degree,
                   pose ? "common pose" : "any pose", rows[k].name, rows[k].seconds,
                   rows[k].seconds / unit, rows[k].paper / rows[k].seconds);
        }
        printf("%6zu  %-11s  change after %zu: %.1e, relative energy of the inverse: %.1e\n",
               g->degree, pose ? "common pose" : "any pose", ITERATIONS, f.change,
               f.relative_energy);
    }
}

/* ---- Two threads ----------------------------------------------------------------------------- */

static void run_mean(const struct group *g, const struct srnf_context *context)
{
    (void)run(g, context, true);
}

static void run_distances(const struct group *g, const struct srnf_context *context)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    double matrix[N * N];

    registration.common_pose = true;
    if (srnf_distances(g->sht, N / 2, g->surfaces, &registration, context, matrix, NULL)) {
        fputs("bench_mean: the distances failed\n", stderr);
        exit(2);
    }
}

static bool bench_threads(const struct group *g, const char *name,
                          void (*body)(const struct group *, const struct srnf_context *))
{
    double best[2] = {INFINITY, INFINITY};
    double efficiency;

    for (size_t k = 0; k < 2 * REPEATS; k++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, 1 + k % 2);
        double start = timing_monotonic();

        body(g, &context);
        best[k % 2] = compare_min(best[k % 2], timing_monotonic() - start);
    }
    efficiency = best[0] / (2.0 * best[1]);
    printf("%6zu  %-11s  %.3f s on one thread, %.3f s on two: efficiency %.2f (required: %.2f)%s\n",
           g->degree, name, best[0], best[1], efficiency, EFFICIENCY,
           efficiency >= EFFICIENCY ? "" : " - NOT MET");
    return efficiency >= EFFICIENCY;
}

int main(void)
{
    bool met = true;

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    printf("Group mean of %zu surfaces, fields of degree 12, default penalty\n\n", N);
    for (size_t k = 0; k < DEGREES; k++) {
        struct group g;

        if (!ventricles_open(&g, degrees[k], N, SRNF_PARAMETERIZATION_STAR)) {
            group_open_stars(&g, degrees[k], N, 0.3);
        }
        bench_degree(&g);
        if (k == 0 && sysconf(_SC_NPROCESSORS_ONLN) >= 2) {
            met = bench_threads(&g, "mean", run_mean) && met;
            met = bench_threads(&g, "distances", run_distances) && met;
        }
        group_close(&g);
    }
    return met ? EXIT_SUCCESS : EXIT_FAILURE;
}
