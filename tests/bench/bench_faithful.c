/*
 * bench_faithful.c - how far encodings of sound meshes are from their meshes: what the limits of
 * srnf_encode_judge (core/surface/judge.c) were set by.
 *
 *   bench_faithful [FILE ...]      rows for these meshes; without files: those of the project and,
 *                                  where they are at hand, of ../shared/data, and long thin shapes
 *
 * For each mesh, route (area; star where there is one) and degree: the root mean square and the
 * greatest distance of the fit against the bounding-box diagonal, volume and area of the surface
 * against those of the mesh, and the distortion of the map. At the end, for each route and degree,
 * the worst of each. A low degree fits worse on purpose: no limit may refuse it.
 *
 * Exit status: 1 if the route area is judged unfaithful for any of them, 0 otherwise.
 */
#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/meshes.h"
#include "support/compare.h"

static const size_t degrees[] = {4, 6, 8, 11, 15, 22, 31, 63};
#define DEGREES (sizeof degrees / sizeof degrees[0])

/* By degree: the worst of what was seen. */
struct worst {
    double fit, max, volume_low, volume_high, area_low, area_high, energy, deviation;
    size_t count, poor, unfaithful;
};
static struct worst worst[2][DEGREES];

static const char *const verdicts[] = {"", "poor", "unfaithful"};

static void note(struct worst *w, const struct srnf_encoded *e, const struct srnf_judgement *j)
{
    if (w->count++ == 0) {
        w->volume_low = w->area_low = 1e9;
    }
    w->fit = compare_max(w->fit, j->fit);
    w->max = compare_max(w->max, e->fit.max / e->fit.diagonal);
    w->volume_low = compare_min(w->volume_low, j->volume);
    w->volume_high = compare_max(w->volume_high, j->volume);
    w->area_low = compare_min(w->area_low, j->area);
    w->area_high = compare_max(w->area_high, j->area);
    w->energy = compare_max(w->energy, j->energy);
    w->deviation = compare_max(w->deviation, e->distortion.log_area_deviation);
    w->poor += j->verdict == SRNF_POOR;
    w->unfaithful += j->verdict == SRNF_UNFAITHFUL;
}

static void encode(const char *name, const struct srnf_mesh *mesh,
                   const struct srnf_mesh_report *report, size_t route, size_t d)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded e = {0};
    struct srnf_error error = {0};
    struct srnf_judgement judgement;

    options.degree = degrees[d];
    options.parameterization = route == 0 ? SRNF_PARAMETERIZATION_AREA : SRNF_PARAMETERIZATION_STAR;
    if (srnf_encode(mesh, report, &options, NULL, &e, &error)) {
        if (route == 0) {
            printf("%-28s %s\n", name, error.message);
        }
        return;
    }
    (void)srnf_encode_judge(&e, report, false, &judgement);
    note(&worst[route][d], &e, &judgement);
    printf("%-28.28s %-4s %3zu %8.3f %% %7.2f %% %8.4f %8.4f %9.3g %5.2f %s\n", name,
           srnf_parameterization_name(e.route), e.degree, 100.0 * judgement.fit,
           100.0 * e.fit.max / e.fit.diagonal, judgement.volume, judgement.area, judgement.energy,
           e.distortion.log_area_deviation, verdicts[judgement.verdict]);
    srnf_free(e.coefficients);
}

static void measure(const char *name, struct srnf_mesh mesh)
{
    struct srnf_mesh_report report;

    if (srnf_mesh_prepare(&mesh, true, &report) || report.n_problems > 0) {
        printf("%-28s %s\n", name, report.problems[0].detail);
    } else {
        for (size_t route = 0; route < 2; route++) {
            for (size_t d = 0; d < DEGREES; d++) {
                encode(name, &mesh, &report, route, d);
            }
        }
    }
    srnf_mesh_clear(&mesh);
}

static void measure_file(const char *path)
{
    struct srnf_mesh mesh = {0};
    const char *slash = strrchr(path, '/');

    if (meshes_load(path, &mesh)) {
        measure(slash ? slash + 1 : path, mesh);
    }
}

static void measure_files(const char *pattern, size_t step)
{
    glob_t found = {0};

    if (glob(pattern, 0, NULL, &found) == 0) {
        for (size_t i = 0; i < found.gl_pathc; i += step) {
            measure_file(found.gl_pathv[i]);
        }
    }
    globfree(&found);
}

static struct srnf_mesh ellipsoid(double x, double y, double z)
{
    struct srnf_mesh mesh = meshes_sphere(16);

    meshes_stretch(&mesh, x, y, z);
    return mesh;
}

static void measure_shapes(void)
{
    measure("ellipsoid 1:1:5", ellipsoid(1, 1, 5));
    measure("ellipsoid 1:1:10", ellipsoid(1, 1, 10));
    measure("ellipsoid 1:1:30", ellipsoid(1, 1, 30));
    measure("ellipsoid 1:1:100", ellipsoid(1, 1, 100));
    measure("ellipsoid 1:10:10", ellipsoid(1, 10, 10));
    measure("ellipsoid 1:30:30", ellipsoid(1, 30, 30));
    measure("box 1:2:8", meshes_box(1, 2, 8));
    measure("capsule 10:1", meshes_capsule(10, 1, 40, 16));
    measure("capsule 30:1", meshes_capsule(30, 1, 90, 12));
    measure("bent capsule 9:1", meshes_bent_capsule(9, 1, 4, 40, 16));
    measure("bent capsule 20:1", meshes_bent_capsule(20, 1, 5, 80, 16));
    measure("bumpy", meshes_bumpy(14, 3));
    measure("tetrahedron", meshes_tetrahedron());
}

int main(int argc, char **argv)
{
    size_t bad = 0;

    printf("%-28s %-4s %3s %10s %9s %8s %8s %9s %5s\n", "mesh", "by", "L", "rms", "max", "volume",
           "area", "energy", "sd");
    for (int i = 1; i < argc; i++) {
        measure_file(argv[i]);
    }
    if (argc == 1) {
        measure_shapes();
        measure_files("tests/data/aal_subcortex/*.ply", 1);
        measure_files("../shared/data/small_bodies/*.ply", 1);
        measure_files("../shared/data/lv_endocardium_ed/*.ply", 10);
        measure_files("../shared/data/lv_pairs/*.ply", 4);
    }
    printf("\nworst\n");
    for (size_t route = 0; route < 2; route++) {
        for (size_t d = 0; d < DEGREES; d++) {
            const struct worst *w = &worst[route][d];

            printf("%-4s %3zu  %3zu meshes %8.3f %% %7.2f %%  volume %.4f to %.4f  area %.4f to "
                   "%.4f  energy %.3g  sd %.2f  poor %zu  unfaithful %zu\n",
                   route == 0 ? "area" : "star", degrees[d], w->count, 100.0 * w->fit,
                   100.0 * w->max, w->volume_low, w->volume_high, w->area_low, w->area_high,
                   w->energy, w->deviation, w->poor, w->unfaithful);
            bad += route == 0 ? w->unfaithful : 0;
        }
    }
    return bad > 0;
}
