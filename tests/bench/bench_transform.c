/*
 * bench_transform.c - the transforms of three coordinates on one core, beside libsharp on the same
 * working grids.
 *
 * Every sample is processor time; the cases of one degree are measured in turn, so that each sample
 * of ours has one of libsharp's beside it, and the median of the ratios of such pairs is what is
 * required: the gradient twice as fast as three calls of SHARP_ALM2MAP_DERIV1 at degrees 15, 31 and
 * 63, and not slower at 127. libsharp is called as its interface wants it, one field at a time and
 * without OpenMP; both sides have their tables and geometry made before. It has no adjoint of the
 * gradient; that is measured against its gradient too.
 *
 * Exit status: 0 if the requirement is met, 1 otherwise.
 */
#include <stdio.h>
#include <stdlib.h>

#include "support/libsharp.h"
#include "support/random.h"
#include "support/timing.h"

#define FIELDS ((size_t)3)
#define SAMPLES ((size_t)41)
#define SAMPLE_SECONDS 0.003

static const struct {
    size_t degree;
    double required; /* gradient: times as fast as libsharp */
} degrees[] = {{15, 2.0}, {31, 2.0}, {63, 2.0}, {127, 1.0}};
#define DEGREES (sizeof degrees / sizeof degrees[0])

/* Both sides of one degree. */
struct bench {
    struct srnf_sht *sht;
    const struct srnf_grid *grid;
    size_t coefficients, points;
    double *c, *a, *b; /* input: coefficients, two sets of fields, of three coordinates */
    double *c_out, *a_out, *b_out; /* output */
    void *workspace;
    struct libsharp sharp[3]; /* one for each coordinate, holding the coefficients */
    struct libsharp sums[3];  /* for jobs that write coefficients */
};

static void *must(void *pointer)
{
    if (!pointer) {
        fputs("bench_transform: out of memory\n", stderr);
        exit(2);
    }
    return pointer;
}

static double *normals(struct test_random *random, size_t n)
{
    double *out = must(srnf_alloc(n, sizeof(double)));

    test_random_normals(random, n, out);
    return out;
}

static void bench_open(struct bench *bench, size_t degree)
{
    struct test_random random = test_random_seed(degree);

    if (srnf_sht_create(&bench->sht, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0)) {
        must(NULL);
    }
    bench->grid = srnf_sht_grid(bench->sht);
    bench->coefficients = srnf_coefficient_count(degree);
    bench->points = bench->grid->n_theta * bench->grid->n_phi;
    bench->c = normals(&random, FIELDS * bench->coefficients);
    bench->a = normals(&random, FIELDS * bench->points);
    bench->b = normals(&random, FIELDS * bench->points);
    bench->c_out = normals(&random, FIELDS * bench->coefficients);
    bench->a_out = normals(&random, FIELDS * bench->points);
    bench->b_out = normals(&random, FIELDS * bench->points);
    bench->workspace = must(srnf_alloc(srnf_sht_workspace_size(bench->sht, FIELDS), 1));
    for (size_t i = 0; i < FIELDS; i++) {
        libsharp_open(&bench->sharp[i], degree, bench->grid, false);
        libsharp_open(&bench->sums[i], degree, bench->grid, true);
        libsharp_from_coefficients(&bench->sharp[i], bench->c + i * bench->coefficients);
    }
}

static void bench_close(struct bench *bench)
{
    for (size_t i = 0; i < FIELDS; i++) {
        libsharp_close(&bench->sums[i]);
        libsharp_close(&bench->sharp[i]);
    }
    srnf_free(bench->workspace);
    srnf_free(bench->b_out);
    srnf_free(bench->a_out);
    srnf_free(bench->c_out);
    srnf_free(bench->b);
    srnf_free(bench->a);
    srnf_free(bench->c);
    srnf_sht_destroy(bench->sht);
}

static void our_gradient(void *argument)
{
    struct bench *t = argument;

    srnf_sht_gradient(t->sht, FIELDS, t->c, t->a_out, t->b_out, t->workspace);
}

static void our_gradient_adjoint(void *argument)
{
    struct bench *t = argument;

    srnf_sht_gradient_adjoint(t->sht, FIELDS, t->a, t->b, t->c_out, t->workspace);
}

static void our_synthesis(void *argument)
{
    struct bench *t = argument;

    srnf_sht_synthesis(t->sht, FIELDS, t->c, t->a_out, t->workspace);
}

static void our_analysis(void *argument)
{
    struct bench *t = argument;

    srnf_sht_analysis(t->sht, FIELDS, t->a, t->c_out, t->workspace);
}

static void their_gradient(void *argument)
{
    struct bench *t = argument;

    for (size_t i = 0; i < FIELDS; i++) {
        libsharp_run(&t->sharp[i], SHARP_ALM2MAP_DERIV1, t->a_out + i * t->points,
                     t->b_out + i * t->points);
    }
}

static void their_synthesis(void *argument)
{
    struct bench *t = argument;

    for (size_t i = 0; i < FIELDS; i++) {
        libsharp_run(&t->sharp[i], SHARP_ALM2MAP, t->a_out + i * t->points, NULL);
    }
}

static void their_analysis(void *argument)
{
    struct bench *t = argument;

    for (size_t i = 0; i < FIELDS; i++) {
        libsharp_run(&t->sums[i], SHARP_MAP2ALM, t->a + i * t->points, NULL);
    }
}

enum { GRADIENT, ADJOINT, SYNTHESIS, ANALYSIS, SHARP_GRADIENT, SHARP_SYNTHESIS, SHARP_ANALYSIS };

/* against: the case of libsharp that a row is compared with; itself for libsharp's own rows. */
static const struct {
    const char *name;
    void (*body)(void *argument);
    size_t against;
} cases[] = {
    [GRADIENT] = {"gradient", our_gradient, SHARP_GRADIENT},
    [ADJOINT] = {"gradient adjoint", our_gradient_adjoint, SHARP_GRADIENT},
    [SYNTHESIS] = {"synthesis", our_synthesis, SHARP_SYNTHESIS},
    [ANALYSIS] = {"analysis", our_analysis, SHARP_ANALYSIS},
    [SHARP_GRADIENT] = {"libsharp 3 x DERIV1", their_gradient, SHARP_GRADIENT},
    [SHARP_SYNTHESIS] = {"libsharp 3 x ALM2MAP", their_synthesis, SHARP_SYNTHESIS},
    [SHARP_ANALYSIS] = {"libsharp 3 x MAP2ALM", their_analysis, SHARP_ANALYSIS},
};
#define CASES (sizeof cases / sizeof cases[0])

/* Median over the samples of the time of `other` in units of the time of `own`. */
static double median_ratio(const double *other, const double *own)
{
    double ratios[SAMPLES];

    for (size_t i = 0; i < SAMPLES; i++) {
        ratios[i] = other[i] / own[i];
    }
    return timing_median(SAMPLES, ratios);
}

/* Measures one degree and prints its rows. Returns how often the gradient fits into libsharp's. */
static double bench_degree(size_t degree)
{
    static double seconds[CASES][SAMPLES];
    struct timing_case timed[CASES];
    double ratios[CASES];
    struct bench bench;

    bench_open(&bench, degree);
    for (size_t i = 0; i < CASES; i++) {
        timed[i].body = cases[i].body;
        timed[i].argument = &bench;
        timing_calibrate(&timed[i], SAMPLE_SECONDS);
    }
    timing_interleave(timed, CASES, SAMPLES, seconds[0]);
    for (size_t i = 0; i < CASES; i++) {
        ratios[i] = median_ratio(seconds[cases[i].against], seconds[i]);
    }
    for (size_t i = 0; i < CASES; i++) {
        double least = timing_minimum(SAMPLES, seconds[i]);

        printf("%6zu  %4zu x %-4zu  %-20s  %10.1f  %10.1f  %8.2f\n", degree, bench.grid->n_theta,
               bench.grid->n_phi, cases[i].name, 1e6 * least,
               1e6 * timing_median(SAMPLES, seconds[i]), ratios[i]);
    }
    bench_close(&bench);
    return ratios[GRADIENT];
}

int main(void)
{
    double fast[DEGREES];
    bool met = true;

    printf("Transforms of three coordinates, one core, processor time, %zu samples\n\n", SAMPLES);
    printf("%6s  %-11s  %-20s  %10s  %10s  %8s\n", "degree", "grid", "transform", "min us",
           "median us", "libsharp");
    for (size_t i = 0; i < DEGREES; i++) {
        fast[i] = bench_degree(degrees[i].degree);
    }
    printf("\nThe last column is the median ratio of libsharp's time to that of the row.\n\n");
    for (size_t i = 0; i < DEGREES; i++) {
        printf("gradient vs libsharp at L=%zu: %.2f times as fast (required: %g)%s\n",
               degrees[i].degree, fast[i], degrees[i].required,
               fast[i] >= degrees[i].required ? "" : " - NOT MET");
        met = met && fast[i] >= degrees[i].required;
    }
    return met ? EXIT_SUCCESS : EXIT_FAILURE;
}
