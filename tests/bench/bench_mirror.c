/*
 * bench_mirror.c - left and right: the 12 nuclei of tests/data/aal_subcortex as they are, and with
 * the right ones mirrored. Degree 15, route area, symmetric registered distances at unit area.
 *
 * For how many nuclei is the homologue of the other side the nearest? And does a cheaper
 * registration decide whether the mirrored match is better? Each pair of a left and a right nucleus
 * is registered as it is and mirrored, by the symmetric registration and by cheaper ones; so are
 * pairs of shapes that have no side, for which mirroring should not matter much.
 */
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/timing.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE 15
#define KINDS 6
#define N (2 * KINDS)
#define CLEARLY 0.9 /* of the distance as it is */

extern void openblas_set_num_threads(int threads);

static const char *const kinds[KINDS] = {"amygdala", "caudate", "hippocampus",
                                         "pallidum", "putamen", "thalamus"};

static const char *const others[][2] = {
    {"lv_endocardium_ed/lv_asymp_0083", "lv_endocardium_ed/lv_asymp_0335"},
    {"lv_endocardium_ed/lv_asymp_0335", "lv_endocardium_ed/lv_asymp_0659"},
    {"lv_endocardium_ed/lv_asymp_0659", "lv_endocardium_ed/lv_asymp_1184"},
    {"lv_endocardium_ed/lv_asymp_1184", "lv_endocardium_ed/lv_asymp_1621"},
    {"lv_endocardium_ed/lv_asymp_1621", "lv_endocardium_ed/lv_asymp_1791"},
    {"lv_endocardium_ed/lv_asymp_1791", "lv_endocardium_ed/lv_mi_2016"},
    {"lv_endocardium_ed/lv_mi_2016", "lv_endocardium_ed/lv_mi_2068"},
    {"lv_endocardium_ed/lv_mi_2068", "lv_endocardium_ed/lv_mi_2130"},
    {"lv_endocardium_ed/lv_mi_2130", "lv_endocardium_ed/lv_mi_2166"},
    {"small_bodies/apophis", "small_bodies/bacchus"},
    {"small_bodies/gaspra", "small_bodies/kleopatra"},
    {"small_bodies/geographos", "small_bodies/thebe"},
    {"small_bodies/mathilde", "small_bodies/eugenia"},
};

static const struct {
    const char *name;
    size_t lmax; /* surfaces are cut to it */
    enum srnf_register_start start;
    size_t degree;
    bool reparameterization, symmetric;
} ways[] = {
    {"symmetric", DEGREE, SRNF_START_TOURNAMENT, 12, true, true},
    {"one way", DEGREE, SRNF_START_TOURNAMENT, 12, true, false},
    {"rigid", DEGREE, SRNF_START_RIGID, 12, false, false},
    {"cut, degree 4", 8, SRNF_START_RIGID, 4, true, false},
    {"cut, rigid", 8, SRNF_START_RIGID, 12, false, false},
};
#define WAYS (sizeof ways / sizeof ways[0])

static void must(int status)
{
    if (status < 0) {
        (void)fprintf(stderr, "%s\n", srnf_strerror(status));
        exit(EXIT_FAILURE);
    }
}

/* False where there is no such mesh. */
static bool load(struct shapes_surface *s, const char *path)
{
    struct srnf_mesh mesh = {0};
    struct srnf_mesh_report report;
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded;

    if (!meshes_load(path, &mesh)) {
        printf("%s is not there\n", path);
        return false;
    }
    options.degree = s->degree;
    options.parameterization = SRNF_PARAMETERIZATION_AREA;
    must(srnf_mesh_prepare(&mesh, false, &report));
    must(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL));
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    return true;
}

static void cut(const double *f, struct shapes_surface *s)
{
    size_t from = srnf_coefficient_count(DEGREE);

    for (size_t k = 0; k < 3; k++) {
        memcpy(s->f + k * s->each, f + k * from, s->each * sizeof(double));
    }
}

static double distance(const double *a, const double *b, size_t way, double *seconds)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct shapes_surface ends[2];
    struct srnf_registration r;
    double begin, d;

    for (size_t i = 0; i < 2; i++) {
        shapes_open(&ends[i], ways[way].lmax);
        cut(i ? b : a, &ends[i]);
    }
    options.start = ways[way].start;
    options.degree = ways[way].degree;
    options.reparameterization = ways[way].reparameterization;
    options.symmetric = ways[way].symmetric;
    begin = timing_cpu();
    must(srnf_register(ends[0].sht, ends[0].f, NULL, ends[1].f, &options, NULL, NULL, &r, NULL));
    *seconds += timing_cpu() - begin;
    d = r.distance;
    srnf_registration_clear(&r);
    shapes_close(&ends[0]);
    shapes_close(&ends[1]);
    return d;
}

/* For how many of the nuclei the nearest other one is the homologue; d: [N][N], L before R. */
static size_t nearest(double d[N][N])
{
    size_t count = 0;

    for (size_t i = 0; i < N; i++) {
        size_t best = i == 0;

        for (size_t j = 0; j < N; j++) {
            best = j != i && d[i][j] < d[i][best] ? j : best;
        }
        count += best == (i + KINDS) % N;
    }
    return count;
}

static size_t pairs_nearest(double d[N][N])
{
    size_t count = 0;

    for (size_t i = 0; i < KINDS; i++) {
        bool nearest_both = true;

        for (size_t j = 0; j < N; j++) {
            nearest_both = nearest_both && (j == i || d[i][j] >= d[i][i + KINDS]) &&
                           (j == i + KINDS || d[i + KINDS][j] >= d[i][i + KINDS]);
        }
        count += nearest_both;
    }
    return count;
}

/* One line for each pair; ratios of the mirrored distance to that as they are. */
static void bench_others(void)
{
    struct shapes_surface s[2];

    printf("\nshapes that have no side: mirrored / as it is\n");
    shapes_open(&s[0], DEGREE);
    shapes_open(&s[1], DEGREE);
    for (size_t k = 0; k < sizeof others / sizeof others[0]; k++) {
        char path[2][160];

        for (size_t i = 0; i < 2; i++) {
            (void)snprintf(path[i], sizeof path[i], "../shared/data/%s.ply", others[k][i]);
        }
        if (!load(&s[0], path[0]) || !load(&s[1], path[1])) {
            continue;
        }
        printf("%-70s", strrchr(others[k][0], '/') + 1);
        for (size_t way = 1; way < WAYS; way++) {
            double rest = 0.0, plain = distance(s[0].f, s[1].f, way, &rest);

            srnf_surface_mirror(DEGREE, s[1].f);
            printf(" %6.3f", distance(s[0].f, s[1].f, way, &rest) / plain);
            srnf_surface_mirror(DEGREE, s[1].f);
        }
        printf("\n");
    }
    shapes_close(&s[0]);
    shapes_close(&s[1]);
}

struct figures {
    double plain[N][N], mirrored[N][N]; /* symmetric, L before R */
    double of[WAYS][2][KINDS][KINDS];   /* L and R by each way: as they are, mirrored */
    double seconds[WAYS];
};

/* Mirroring both changes no distance: those on one side are the same both times. */
static void measure(struct shapes_surface s[N], struct figures *figures)
{
    double rest = 0.0;

    for (size_t i = 0; i < N; i++) {
        for (size_t j = i < KINDS ? 0 : KINDS; j < i; j++) {
            double d = distance(s[i].f, s[j].f, 0, &rest);

            figures->plain[i][j] = figures->plain[j][i] = d;
            figures->mirrored[i][j] = figures->mirrored[j][i] = d;
        }
    }
    for (size_t k = 0; k < 2 * KINDS * KINDS; k++) {
        size_t m = k / (KINDS * KINDS), j = KINDS + k / KINDS % KINDS, i = k % KINDS;
        double(*matrix)[N] = m ? figures->mirrored : figures->plain;

        if (m == 1 && i == 0) {
            srnf_surface_mirror(DEGREE, s[j].f);
        }
        for (size_t way = 0; way < WAYS; way++) {
            figures->of[way][m][i][j - KINDS] =
                distance(s[i].f, s[j].f, way, &figures->seconds[way]);
        }
        matrix[i][j] = matrix[j][i] = figures->of[0][m][i][j - KINDS];
    }
}

static bool clearly(const struct figures *figures, size_t way, size_t l, size_t r)
{
    return figures->of[way][1][l][r] < CLEARLY * figures->of[way][0][l][r];
}

static void print_figures(struct figures *figures)
{
    printf(
        "homologues nearest: as they are %zu of %d nuclei (both ways: %zu of %d pairs), mirrored "
        "%zu (%zu)\n",
        nearest(figures->plain), N, pairs_nearest(figures->plain), KINDS,
        nearest(figures->mirrored), pairs_nearest(figures->mirrored));
    for (size_t way = 0; way < WAYS; way++) {
        size_t agree = 0, better = 0;

        for (size_t i = 0; i < KINDS * KINDS; i++) {
            bool cheap = clearly(figures, way, i / KINDS, i % KINDS);

            agree += cheap == clearly(figures, 0, i / KINDS, i % KINDS);
            better += cheap;
        }
        printf("%-14s %6.0f ms a registration; mirrored below %g: %zu of %d; agrees for %zu\n",
               ways[way].name, 1e3 * figures->seconds[way] / (2 * KINDS * KINDS), CLEARLY, better,
               KINDS * KINDS, agree);
    }
    printf("%-26s", "L, R: as it is, mirrored");
    for (size_t way = 0; way < WAYS; way++) {
        printf(" %15s", ways[way].name);
    }
    printf("\n");
    for (size_t i = 0; i < KINDS * KINDS; i++) {
        printf("%-12s %-13s", kinds[i / KINDS], kinds[i % KINDS]);
        for (size_t way = 0; way < WAYS; way++) {
            printf("   %6.4f %6.4f", figures->of[way][0][i / KINDS][i % KINDS],
                   figures->of[way][1][i / KINDS][i % KINDS]);
        }
        printf("\n");
    }
}

int main(void)
{
    static struct shapes_surface s[N];
    static struct figures figures;

    openblas_set_num_threads(1);
    for (size_t i = 0; i < N; i++) {
        char path[120];

        shapes_open(&s[i], DEGREE);
        (void)snprintf(path, sizeof path, "tests/data/aal_subcortex/%s_%s.ply",
                       i < KINDS ? "L" : "R", kinds[i % KINDS]);
        if (!load(&s[i], path)) {
            return EXIT_FAILURE;
        }
    }
    measure(s, &figures);
    print_figures(&figures);
    for (size_t i = 0; i < N; i++) {
        shapes_close(&s[i]);
    }
    bench_others();
    return EXIT_SUCCESS;
}
