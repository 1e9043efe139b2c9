/*
 * bench_pullback.c - the pulled-back metric at degree 15.
 *
 * 1. Geodesics: energy and length of the straight line between the surfaces, of the inverted
 *    straight line in L2, and of the geodesic, with its speed variation, cost for each interior
 *    surface and steps; from the straight line at once, and by halving. U counts gradient
 *    transforms of three coordinates and adjoints.
 * 2. Logarithms by tight paths, and how far exp(log) ends from where it should.
 *
 * bench_frameworks.c compares both frameworks.
 *
 * Exit status: 0 if on every pair chord <= length of the geodesic and its energy is at most that of
 * the straight line, and on near pairs energy and length are at most those of the inverted line; 1
 * otherwise.
 */
#include <stdio.h>
#include <stdlib.h>

#include <fftw3.h>

#include "core/stats/group.h"

#define DEGREE ((size_t)15)
#define SEGMENTS ((size_t)8)
#define BODIES "../shared/data/small_bodies/"
#define VENTRICLES "../shared/data/lv_endocardium_ed/"

static void must(int status, const char *what)
{
    if (status < 0) {
        (void)fprintf(stderr, "bench_pullback: %s: %s\n", what, srnf_strerror(status));
        exit(2);
    }
}

/* ---- Pairs ----------------------------------------------------------------------------------- */

struct pair {
    const char *name;
    const char *from, *to; /* files; NULL: made */
    bool registered, hard;
};

static const struct pair pairs[] = {
    {"random stars", NULL, NULL, false, false},
    {"ventricles", VENTRICLES "lv_asymp_0083.ply", VENTRICLES "lv_asymp_0091.ply", true, false},
    {"apophis-bacchus", BODIES "apophis.ply", BODIES "bacchus.ply", true, false},
    {"gaspra-mathilde", BODIES "gaspra.ply", BODIES "mathilde.ply", true, false},
    {"geographos-thebe", BODIES "geographos.ply", BODIES "thebe.ply", true, true},
    {"kleopatra-gaspra", BODIES "kleopatra.ply", BODIES "gaspra.ply", false, true},
    {"8 arms-5 arms", NULL, NULL, false, true},
};

static bool load(const struct shapes_surface *s, const char *file)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;
    struct srnf_mesh mesh;

    if (!meshes_load(file, &mesh)) {
        return false;
    }
    options.degree = DEGREE;
    must(srnf_mesh_prepare(&mesh, false, &report), file);
    must(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL), file);
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    return true;
}

static bool open_pair(const struct pair *pair, struct shapes_surface ends[2])
{
    bool there = true;

    shapes_open(&ends[0], DEGREE);
    shapes_open(&ends[1], DEGREE);
    if (pair->from) {
        there = load(&ends[0], pair->from) && load(&ends[1], pair->to);
    } else if (pair->hard) {
        shapes_fill(&ends[0], shapes_arms, 8.0);
        shapes_fill(&ends[1], shapes_arms, 5.0);
    } else {
        shapes_fill_random_star(&ends[0], 1, NULL);
        shapes_fill_random_star(&ends[1], 2, NULL);
    }
    if (there && pair->registered) {
        struct srnf_registration registration;

        must(srnf_register(ends[0].sht, ends[0].f, NULL, ends[1].f, NULL, NULL, NULL, &registration,
                           NULL),
             pair->name);
        memcpy(ends[1].f, registration.coefficients, ends[1].count * sizeof(double));
        srnf_registration_clear(&registration);
    }
    return there;
}

/* ---- Paths ----------------------------------------------------------------------------------- */

static bool bench_path(const struct pair *pair, const struct shapes_surface ends[2], bool halving)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_geodesic g;
    double start = timing_cpu();
    double own;
    bool met;

    options.segments = SEGMENTS;
    options.halving = halving;
    options.compare = false;
    must(srnf_pullback_geodesic(ends[0].sht, ends[0].f, ends[1].f, &options, NULL, &g, NULL),
         pair->name);
    own = timing_cpu() - start;
    srnf_pullback_geodesic_clear(&g);
    options.compare = true;
    must(srnf_pullback_geodesic(ends[0].sht, ends[0].f, ends[1].f, &options, NULL, &g, NULL),
         pair->name);
    met =
        g.distance <= g.path.length && g.path.energy <= g.linear.energy &&
        (pair->hard || (g.path.energy <= g.inverted.energy && g.path.length <= g.inverted.length));
    printf(
        "%-17s %-7s %.4f  %.5f/%.5f  %.5f/%.5f  %.6f/%.6f  %9.2e  %.0e  %5.0f  %3zu%s  %.3f s%s\n",
        pair->name, halving ? "halving" : "line", g.distance, g.linear.energy, g.linear.length,
        g.inverted.energy, g.inverted.length, g.path.energy, g.path.length,
        g.inverted.energy - g.path.energy, g.path.speed_variation,
        g.transforms / (double)(SEGMENTS - 1), g.iterations, g.converged ? " " : "*", own,
        met ? "" : "  NOT MET");
    srnf_pullback_geodesic_clear(&g);
    return met;
}

/* ---- Exponential ----------------------------------------------------------------------------- */

static double field_distance(const struct shapes_surface *s, const double *a, const double *b)
{
    double *qa = shapes_doubles(9 * s->points);
    double *qb = qa + 3 * s->points;
    double *d = qa + 6 * s->points;
    double distance;

    srnf_field(s->sht, a, qa, s->workspace);
    srnf_field(s->sht, b, qb, s->workspace);
    for (size_t i = 0; i < 3 * s->points; i++) {
        d[i] = qa[i] - qb[i];
    }
    distance = sqrt(srnf_inner_product(s->grid, d, d));
    srnf_free(qa);
    return distance;
}

static void bench_exp(const struct pair *pair, const struct shapes_surface ends[2], size_t m)
{
    const struct shapes_surface *s = &ends[0];
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    double *velocity = shapes_doubles(s->count);
    struct srnf_pullback_geodesic g;
    struct srnf_pullback_shot shot;
    double start = timing_cpu();
    double middle;

    options.segments = m;
    options.gradient = 1e-9;
    options.compare = false;
    must(srnf_pullback_geodesic(s->sht, s->f, ends[1].f, &options, NULL, &g, NULL), pair->name);
    for (size_t i = 0; i < s->count; i++) {
        velocity[i] = (double)m * (g.coefficients[s->count + i] - s->f[i]);
    }
    middle = timing_cpu();
    must(srnf_pullback_exp(s->sht, s->f, velocity, m, NULL, &shot, NULL), pair->name);
    printf("%-17s %3zu  %.0e  %6.0f  %4zu  %.3f s  %.1e  %.1e  %6.0f  %4zu  %.3f s\n", pair->name,
           m, g.gradient, g.transforms / (double)(m - 1), g.iterations, middle - start,
           field_distance(s, shot.coefficients + m * s->count, ends[1].f), shot.residual,
           shot.transforms / (double)(m - 1), shot.iterations, timing_cpu() - middle);
    srnf_pullback_geodesic_clear(&g);
    srnf_pullback_shot_clear(&shot);
    srnf_free(velocity);
}

/* Tight paths and exponentials of every near pair, by segments. */
static void bench_exps(void)
{
    printf("\n%-17s %3s  %-7s %6s  %5s  %7s  %-7s  %-7s  %6s  %s\n", "logarithm and", "m",
           "gradient", "U", "steps", "time", "exp-end", "residual", "U", "Newton steps, time");
    for (size_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
        struct shapes_surface ends[2];
        bool there;

        if (pairs[k].hard) {
            continue;
        }
        there = open_pair(&pairs[k], ends);
        for (size_t m = 4; there && m <= 16; m *= 2) {
            bench_exp(&pairs[k], ends, m);
        }
        shapes_close(&ends[0]);
        shapes_close(&ends[1]);
    }
}

int main(void)
{
    bool met = true;

    openblas_set_num_threads(1);
    printf("Geodesics of %zu segments at degree %zu; E / length\n\n", SEGMENTS, DEGREE);
    printf("%-25s %-7s %-15s  %-15s  %-17s  %-9s  %-5s  %5s  %s\n", "pair, start", "chord",
           "straight line", "inverted line", "geodesic", "gain in E", "cv", "U",
           "steps (*: limit)");
    for (size_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
        struct shapes_surface ends[2];

        if (open_pair(&pairs[k], ends)) {
            met = bench_path(&pairs[k], ends, false) && met;
            met = bench_path(&pairs[k], ends, true) && met;
        } else {
            printf("%-17s skipped: no data\n", pairs[k].name);
        }
        shapes_close(&ends[0]);
        shapes_close(&ends[1]);
    }
    bench_exps();
    return met ? EXIT_SUCCESS : EXIT_FAILURE;
}
