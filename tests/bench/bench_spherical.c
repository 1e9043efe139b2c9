/*
 * bench_spherical.c - what the spherical parameterization costs, on one core: real meshes, the same
 * meshes with every face cut into four, and spheres of up to 200,000 faces.
 *
 * Processor time of the fastest of a few runs. The first report of progress comes when the mesh has
 * been collapsed and the first vertices are back: the time until then is given as `collapse`
 * (checks of the mesh included), the rest as `insert` (insertion, relaxation, verification). One
 * unit is one gradient transform of three coordinates at degree 31, measured in the same run, so
 * that figures can be compared between machines.
 *
 * Required: 10,000 faces in at most 0.15 s; every mesh of 5,000 faces or more is held to it in
 * proportion.
 *
 * Exit status: 0 if the requirement is met, 1 otherwise.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/compare.h"
#include "support/folders.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/timing.h"
#include "support/triangulations.h"

#define RUNS 5
#define LARGE 50000 /* faces from which on one run must do */
#define UNIT_DEGREE 31
#define REQUIRED_FACES 10000.0
#define REQUIRED_SECONDS 0.15
#define COUNTED_FROM 5000
#define MESHES_MAX 64

/* Costs of meshes of one kind, in seconds for 10,000 faces. */
struct costs {
    size_t count;
    double seconds[MESHES_MAX];
};

struct clock {
    double start, first_report;
};

static void must(bool condition, const char *what)
{
    if (!condition) {
        fprintf(stderr, "bench_spherical: %s\n", what);
        exit(2);
    }
}

static void note_first_report(void *user, double fraction, const char *message)
{
    struct clock *clock = user;

    (void)fraction;
    (void)message;
    if (clock->first_report < clock->start) {
        clock->first_report = timing_cpu();
    }
}

static void bench_mesh(const char *name, const struct srnf_mesh *mesh, double unit,
                       struct costs *costs)
{
    double best = 1e9;
    double collapse = 0.0;
    double energy = 0.0;

    for (int run = 0; run < (mesh->n_faces < LARGE ? RUNS : 1); run++) {
        struct clock clock = {.start = timing_cpu(), .first_report = -1.0};
        struct srnf_context context = {.user = &clock, .progress = note_first_report};
        struct srnf_spherical_map map;
        double seconds;

        must(srnf_spherical_map(mesh, &context, &map, NULL) == SRNF_OK, "a mesh has no map");
        seconds = timing_cpu() - clock.start;
        best = compare_min(best, seconds);
        if (best == seconds) {
            collapse = clock.first_report - clock.start;
            energy = map.symmetric_dirichlet;
        }
        srnf_free(map.points);
    }
    printf("%-24s  %7zu  %9.1f  %9.1f  %9.1f  %9.0f  %9.1f  %6.2f\n", name, mesh->n_faces,
           1e3 * best, 1e3 * collapse, 1e3 * (best - collapse), best / unit,
           1e3 * best * REQUIRED_FACES / (double)mesh->n_faces, energy);
    if (mesh->n_faces >= COUNTED_FROM && costs->count < MESHES_MAX) {
        costs->seconds[costs->count++] = best * REQUIRED_FACES / (double)mesh->n_faces;
    }
}

/* Seconds of one gradient transform of three coordinates. */
struct transform {
    struct srnf_sht *sht;
    double *coefficients, *d_theta, *d_phi;
    void *workspace;
};

static void run_transform(void *argument)
{
    struct transform *t = argument;

    srnf_sht_gradient(t->sht, 3, t->coefficients, t->d_theta, t->d_phi, t->workspace);
}

static double measure_unit(void)
{
    struct test_random random = test_random_seed(1);
    struct transform t = {0};
    struct timing_case timed = {.body = run_transform, .argument = &t};
    double samples[21];
    size_t n = srnf_coefficient_count(UNIT_DEGREE);
    size_t points;

    must(srnf_sht_create(&t.sht, UNIT_DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0) == SRNF_OK,
         "no transform");
    points = srnf_sht_grid(t.sht)->n_theta * srnf_sht_grid(t.sht)->n_phi;
    t.coefficients = srnf_alloc(3 * n, sizeof(double));
    t.d_theta = srnf_alloc(3 * points, sizeof(double));
    t.d_phi = srnf_alloc(3 * points, sizeof(double));
    t.workspace = srnf_alloc(srnf_sht_workspace_size(t.sht, 3), 1);
    must(t.coefficients && t.d_theta && t.d_phi && t.workspace, "no memory");
    test_random_normals(&random, 3 * n, t.coefficients);
    timing_calibrate(&timed, 0.002);
    timing_interleave(&timed, 1, sizeof samples / sizeof samples[0], samples);
    srnf_free(t.workspace);
    srnf_free(t.d_phi);
    srnf_free(t.d_theta);
    srnf_free(t.coefficients);
    srnf_sht_destroy(t.sht);
    return timing_median(sizeof samples / sizeof samples[0], samples);
}

/* A real mesh as it is, and with four times the faces; nothing where there is no such file. */
static void bench_file(const char *folder, const char *name, double unit, struct costs *plain,
                       struct costs *fine)
{
    char path[200];
    struct srnf_mesh mesh;
    struct srnf_mesh subdivided;
    struct srnf_mesh_report report;

    (void)snprintf(path, sizeof path, "%s/%s.ply", folder, name);
    if (!meshes_load(path, &mesh)) {
        printf("%-24s  there is no %s\n", name, path);
        return;
    }
    must(srnf_mesh_prepare(&mesh, false, &report) == SRNF_OK && report.n_problems == 0,
         "a mesh is not closed");
    bench_mesh(name, &mesh, unit, plain);
    subdivided = triangulations_subdivided(&mesh);
    (void)snprintf(path, sizeof path, "%s, in four", name);
    bench_mesh(path, &subdivided, unit, fine);
    srnf_mesh_clear(&subdivided);
    srnf_mesh_clear(&mesh);
}

static bool conclude(const char *what, struct costs *costs)
{
    double median;
    double worst = 0.0;

    if (costs->count == 0) {
        return true;
    }
    for (size_t i = 0; i < costs->count; i++) {
        worst = compare_max(worst, costs->seconds[i]);
    }
    median = timing_median(costs->count, costs->seconds);
    printf("%s: 10,000 faces in %.0f ms, at worst %.0f ms (%zu meshes; required: %.0f ms)%s\n",
           what, 1e3 * median, 1e3 * worst, costs->count, 1e3 * REQUIRED_SECONDS,
           worst <= REQUIRED_SECONDS ? "" : " - NOT MET");
    return worst <= REQUIRED_SECONDS;
}

/* The energies of every mesh of the real folders, against what was reached when they were first
   measured. */
static bool bench_energies(void)
{
    static const struct {
        const char *folder;
        double median, most;
    } folders[] = {{"tests/data/aal_subcortex", 4.41, 5.74},
                   {"../shared/data/lv_endocardium_ed", 4.24, 4.54},
                   {"../shared/data/lv_pairs", 4.23, 4.95},
                   {"../shared/data/small_bodies", 4.10, 5.76}};
    bool met = true;

    printf("\nsymmetric Dirichlet energy              meshes  median  at most\n");
    for (size_t k = 0; k < sizeof folders / sizeof folders[0]; k++) {
        char *paths[FOLDERS_FILES_MAX];
        double energies[FOLDERS_FILES_MAX];
        size_t n = folders_list(folders[k].folder, paths);
        double most;
        double median;

        for (size_t i = 0; i < n; i++) {
            struct srnf_spherical_map map;
            struct srnf_mesh mesh;

            must(meshes_load(paths[i], &mesh) &&
                     srnf_spherical_map(&mesh, NULL, &map, NULL) == SRNF_OK,
                 "a mesh has no map");
            energies[i] = map.symmetric_dirichlet;
            srnf_free(map.points);
            srnf_mesh_clear(&mesh);
            free(paths[i]);
        }
        if (n == 0) {
            printf("%-38s  is not there\n", folders[k].folder);
            continue;
        }
        most = compare_largest(n, energies);
        median = timing_median(n, energies);
        printf("%-38s  %6zu  %6.2f  %7.2f\n", folders[k].folder, n, median, most);
        met &= median < folders[k].median + 0.005 && most < folders[k].most + 0.005;
    }
    return met;
}

int main(void)
{
    static const char *const names[][2] = {
        {"tests/data/aal_subcortex", "L_amygdala"},
        {"tests/data/aal_subcortex", "L_pallidum"},
        {"tests/data/aal_subcortex", "L_thalamus"},
        {"tests/data/aal_subcortex", "R_putamen"},
        {"tests/data/aal_subcortex", "L_caudate"},
        {"tests/data/aal_subcortex", "L_hippocampus"},
        {"tests/data/aal_subcortex", "R_hippocampus"},
        {"../shared/data/small_bodies", "kleopatra"},
        {"../shared/data/small_bodies", "geographos"},
        {"../shared/data/small_bodies", "toutatis"},
    };
    static struct costs real;
    static struct costs fine;
    static struct costs spheres;
    double unit = measure_unit();
    bool met;

    printf("Spherical parameterization, one core, processor time; one unit is %.1f us\n\n",
           1e6 * unit);
    printf("%-24s  %7s  %9s  %9s  %9s  %9s  %9s  %6s\n", "mesh", "faces", "ms", "collapse",
           "insert", "units", "ms/10,000", "E");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        bench_file(names[i][0], names[i][1], unit, &real, &fine);
    }
    for (size_t frequency = 5; frequency <= 100; frequency *= frequency == 5 ? 4 : 5) {
        struct srnf_mesh mesh = meshes_bumpy(frequency, 1);

        bench_mesh("bumpy sphere", &mesh, unit, &spheres);
        srnf_mesh_clear(&mesh);
    }
    printf("\n");
    met = bench_energies();
    met = conclude("real meshes", &real) && met;
    met = conclude("real meshes, in four", &fine) && met;
    met = conclude("bumpy spheres", &spheres) && met;
    return met ? EXIT_SUCCESS : EXIT_FAILURE;
}
