/*
 * bench_power.c - power of the tests of shape statistics: how many of 100 studies are found at the
 * level .05, as a whole and anywhere on the map, against the amplitude of what is planted and the
 * number of subjects; and how much of a planted region the map of two groups reports.
 *
 * Ellipsoids of degree 6 with the axes 1.2, 1 and .8 and noise of .01 in each coefficient of the
 * points up to degree 4, all parameterized alike, so that nothing is lost by registration. Planted
 * is a bump about +x, an amplitude times exp(8 (cos angle - 1)) of the radius: with a covariate, in
 * one group with a covariate, from visit to visit, per unit of time in one of two groups, from side
 * to side, between two groups. Rows of amplitude 0 are rates of false findings: 1 to 9 in 95 % of
 * series.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/stats/group.h"
#include "srnf/paired.h"
#include "srnf/trajectories.h"

#define DEGREE 6
#define NOISE_DEGREE 4
#define NOISE ((size_t)(NOISE_DEGREE + 1) * (NOISE_DEGREE + 1))
#define STUDIES ((size_t)100)
#define PERMUTATIONS ((size_t)99)
#define MEMBERS_MAX ((size_t)96)
#define VISITS ((size_t)3)

struct study {
    struct group g;
    size_t size;
    double *nodes, *bump, *points, *values, *f, *mean, *q; /* bump: [P]; q: [MEMBERS_MAX][3][P] */
    void *workspace;
    struct test_random random;
};

static void open_study(struct study *s)
{
    group_open(&s->g, DEGREE, 0);
    s->size = 3 * s->g.points;
    s->nodes = shapes_doubles(s->size);
    s->bump = shapes_doubles(s->g.points);
    s->points = shapes_doubles(s->size);
    s->values = shapes_doubles(s->size);
    s->f = shapes_doubles(s->g.count);
    s->mean = shapes_doubles(s->g.count);
    s->q = shapes_doubles(MEMBERS_MAX * s->size);
    s->workspace = srnf_alloc(1, srnf_surface_workspace_size(s->g.sht));
    assert_non_null(s->workspace);
    stats_nodes(s->g.grid, s->nodes);
    for (size_t p = 0; p < s->g.points; p++) {
        s->bump[p] = exp(8.0 * (s->nodes[3 * p] - 1.0));
    }
}

static void close_study(struct study *s)
{
    srnf_free(s->nodes);
    srnf_free(s->bump);
    srnf_free(s->points);
    srnf_free(s->values);
    srnf_free(s->f);
    srnf_free(s->mean);
    srnf_free(s->q);
    srnf_free(s->workspace);
    group_close(&s->g);
}

/* Noise of the points, double[3 NOISE]. */
static void draw_noise(struct study *s, double *noise)
{
    test_random_normals(&s->random, 3 * NOISE, noise);
}

/* Surface `index` of n: the ellipsoid with `height` times the bump and .01 of the noise. */
static void put(struct study *s, size_t n, size_t index, double height, const double *noise)
{
    if (index == 0) {
        memset(s->mean, 0, s->g.count * sizeof(double));
    }
    assert_int_equal(
        srnf_harmonics_at_points(NOISE_DEGREE, 3, noise, s->g.points, s->nodes, s->values, NULL),
        SRNF_OK);
    for (size_t k = 0; k < s->size; k++) {
        size_t c = k / s->g.points;
        size_t p = k % s->g.points;

        s->points[k] = (1.2 - 0.2 * (double)c) * (1.0 + height * s->bump[p]) * s->nodes[3 * p + c] +
                       0.01 * s->values[k];
    }
    srnf_sht_analysis(s->g.sht, 3, s->points, s->f, s->workspace);
    srnf_field(s->g.sht, s->f, s->q + index * s->size, s->workspace);
    for (size_t k = 0; k < s->g.count; k++) {
        s->mean[k] += s->f[k] / (double)n;
    }
}

/* ---- One study of each kind: p as a whole and of the map ------------------------------------- */

typedef void study_run(struct study *s, size_t n, double amplitude, double p[2]);

/* An effect of age on all; or on every second subject alone, beside age and group. */
static void run_model(struct study *s, size_t n, double amplitude, bool interaction, double p[2])
{
    double values[3 * MEMBERS_MAX];
    double beside[2 * MEMBERS_MAX];
    double tested[MEMBERS_MAX];
    struct srnf_nested nested = {interaction ? 2 : 0, 1, beside, tested};
    struct srnf_regress_design design = {interaction ? 3 : 1, values, 1, &nested, 0, NULL};
    struct srnf_regress_options options = srnf_regress_options_defaults();
    struct srnf_regression out;

    for (size_t i = 0; i < n; i++) {
        double noise[3 * NOISE];
        double age = test_random_normal(&s->random);
        double group = (double)(i % 2);

        draw_noise(s, noise);
        put(s, n, i, amplitude * age * (interaction ? group : 1.0), noise);
        tested[i] = interaction ? age * group : age;
        beside[2 * i] = age;
        beside[2 * i + 1] = group;
        values[design.columns * i] = age;
        if (interaction) {
            values[3 * i + 1] = group;
            values[3 * i + 2] = age * group;
        }
    }
    options.permutations = PERMUTATIONS;
    options.bootstraps = 100;
    assert_int_equal(srnf_regress(s->g.sht, n, s->mean, s->q, &design, &options, NULL, &out, NULL),
                     SRNF_OK);
    p[0] = out.test_of[0].p_value;
    p[1] = out.test_of[0].max_p_value;
    srnf_regression_clear(&out);
}

static void run_covariate(struct study *s, size_t n, double amplitude, double p[2])
{
    run_model(s, n, amplitude, false, p);
}

static void run_interaction(struct study *s, size_t n, double amplitude, double p[2])
{
    run_model(s, n, amplitude, true, p);
}

/* Two surfaces of each subject, that share seven eighths of the variance of their noise. */
static void run_pairs(struct study *s, size_t n, double amplitude, double p[2])
{
    double ones[MEMBERS_MAX];
    const struct srnf_pairs pairs = {.n = n,
                                     .mean = s->mean,
                                     .first_q = s->q,
                                     .second_q = s->q + n * s->size,
                                     .first_size = ones,
                                     .second_size = ones};
    struct srnf_paired_options options = srnf_paired_options_defaults();
    struct srnf_paired out;

    memset(s->mean, 0, s->g.count * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        double own[3 * NOISE];
        double noise[3 * NOISE];

        ones[i] = 1.0;
        draw_noise(s, own);
        for (size_t visit = 0; visit < 2; visit++) {
            draw_noise(s, noise);
            for (size_t k = 0; k < 3 * NOISE; k++) {
                noise[k] = sqrt(0.875) * own[k] + sqrt(0.125) * noise[k];
            }
            put(s, 2 * n, visit * n + i, visit ? amplitude : 0.0, noise);
        }
    }
    options.permutations = PERMUTATIONS;
    options.bootstraps = 100;
    assert_int_equal(srnf_paired_differences(s->g.sht, &pairs, &options, NULL, &out, NULL),
                     SRNF_OK);
    p[0] = out.p_value;
    p[1] = out.max_p_value;
    srnf_paired_clear(&out);
}

/* Three visits; the slope of every second subject is larger by the amplitude. */
static void run_slopes(struct study *s, size_t n, double amplitude, double p[2])
{
    double ones[MEMBERS_MAX];
    double times[MEMBERS_MAX];
    double column[MEMBERS_MAX];
    size_t subjects[MEMBERS_MAX];
    const struct srnf_nested nested = {0, 1, NULL, column};
    const struct srnf_regress_design design = {1, column, 1, &nested, 0, NULL};
    const struct srnf_visits visits = {.n = VISITS * n,
                                       .mean = s->mean,
                                       .q = s->q,
                                       .sizes = ones,
                                       .times = times,
                                       .subjects = subjects};
    struct srnf_trajectories_options options = srnf_trajectories_options_defaults();
    struct srnf_trajectories out;

    for (size_t i = 0; i < VISITS * n; i++) {
        static double own[3 * NOISE];
        double noise[3 * NOISE];
        size_t subject = i / VISITS;

        if (i % VISITS == 0) {
            draw_noise(s, own);
        }
        draw_noise(s, noise);
        for (size_t k = 0; k < 3 * NOISE; k++) {
            noise[k] = sqrt(0.875) * own[k] + sqrt(0.125) * noise[k];
        }
        ones[i] = 1.0;
        times[i] = (double)(i % VISITS);
        column[i] = (double)(subject % 2);
        subjects[i] = subject * VISITS;
        put(s, VISITS * n, i, amplitude * times[i] * column[i], noise);
    }
    options.permutations = PERMUTATIONS;
    options.bootstraps = 100;
    assert_int_equal(srnf_fit_trajectories(s->g.sht, &visits, &design, &options, NULL, &out, NULL),
                     SRNF_OK);
    p[0] = out.model.test_of[0].p_value;
    p[1] = out.model.test_of[0].max_p_value;
    srnf_trajectories_clear(&out);
}

static void compare(struct study *s, size_t n, double amplitude, struct srnf_comparison *out)
{
    int group[MEMBERS_MAX];
    struct srnf_compare_options options = srnf_compare_options_defaults();

    for (size_t i = 0; i < n; i++) {
        double noise[3 * NOISE];

        group[i] = i % 2 == 1;
        draw_noise(s, noise);
        put(s, n, i, group[i] ? amplitude : 0.0, noise);
    }
    options.permutations = PERMUTATIONS;
    assert_int_equal(
        srnf_compare_groups(s->g.sht, n, s->mean, s->q, group, 0, NULL, &options, NULL, out, NULL),
        SRNF_OK);
}

static void run_groups(struct study *s, size_t n, double amplitude, double p[2])
{
    struct srnf_comparison out;

    compare(s, n, amplitude, &out);
    p[0] = out.p_value;
    p[1] = out.max_p_value;
    srnf_comparison_clear(&out);
}

/* ---- Tables ---------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    study_run *run;
} kinds[] = {
    {"regress, covariate", run_covariate}, {"regress, interaction", run_interaction},
    {"change, asymmetry", run_pairs},      {"trajectories, two groups", run_slopes},
    {"compare-groups", run_groups},
};
static const double amplitudes[] = {0.0, 0.01, 0.02, 0.04};
static const size_t numbers[] = {12, 24};

static void print_power(struct study *s)
{
    printf("%-26s %3s", "found of 100: whole, map", "n");
    for (size_t a = 0; a < sizeof amplitudes / sizeof amplitudes[0]; a++) {
        printf("      %.2f", amplitudes[a]);
    }
    printf("\n");
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        for (size_t j = 0; j < sizeof numbers / sizeof numbers[0]; j++) {
            printf("%-26s %3zu", kinds[k].name, numbers[j]);
            for (size_t a = 0; a < sizeof amplitudes / sizeof amplitudes[0]; a++) {
                size_t found[2] = {0, 0};

                for (size_t study = 0; study < STUDIES; study++) {
                    double p[2];

                    s->random = test_random_seed(10000 * k + 100 * j + study);
                    kinds[k].run(s, numbers[j], amplitudes[a], p);
                    found[0] += p[0] <= 0.05;
                    found[1] += p[1] <= 0.05;
                }
                printf("  %3zu %3zu", found[0], found[1]);
                (void)fflush(stdout);
            }
            printf("\n");
        }
    }
}

/* Shares of the nodes in three rings about +x, by how much of the amplitude they have, that the map
   reports. */
static void print_region(struct study *s)
{
    static const double heights[] = {0.02, 0.04, 0.08, 0.15};

    printf("\n%-26s %3s   %% of nodes reported with at least 3/4, 1/2, 1/4 of it; with less than a "
           "hundredth\n",
           "region of two groups", "n");
    for (size_t a = 0; a < sizeof heights / sizeof heights[0]; a++) {
        for (size_t j = 0; j < sizeof numbers / sizeof numbers[0]; j++) {
            size_t inside[4] = {0};
            size_t found[4] = {0};

            for (size_t study = 0; study < STUDIES / 4; study++) {
                struct srnf_comparison out;

                s->random = test_random_seed(90000 + 100 * j + study);
                compare(s, numbers[j], heights[a], &out);
                for (size_t p = 0; p < s->g.points; p++) {
                    double b = s->bump[p];
                    size_t ring = b >= 0.75 ? 0 : b >= 0.5 ? 1 : b >= 0.25 ? 2 : 3;

                    if (ring < 3 || b < 0.01) {
                        inside[ring]++;
                        found[ring] += out.significance[p] <= 0.05;
                    }
                }
                srnf_comparison_clear(&out);
            }
            printf("raised by %4.0f %%            %3zu  ", 100.0 * heights[a], numbers[j]);
            for (size_t ring = 0; ring < 4; ring++) {
                printf(" %5.1f", 100.0 * (double)found[ring] / (double)inside[ring]);
            }
            printf("\n");
        }
    }
}

int main(void)
{
    struct study study;

    openblas_set_num_threads(1);
    open_study(&study);
    print_power(&study);
    print_region(&study);
    close_study(&study);
    return 0;
}
