/*
 * bench_register.c - registration of real pairs at degrees 15, 23 and 31: default, symmetric, rigid
 * and common pose.
 *
 * Processor seconds of one thread, in ms and in units of one gradient transform of three
 * coordinates at the same degree, timed in the same run; squared distances at unit area before and
 * after, the objective, the steps and the range of the Jacobian.
 */
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/timing.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define UNIT_SECONDS 0.01

extern void openblas_set_num_threads(int threads);

static const char *const pairs[][2] = {
    {"tests/data/aal_subcortex/L_thalamus.ply", "tests/data/aal_subcortex/R_thalamus.ply"},
    {"tests/data/aal_subcortex/L_thalamus.ply", "tests/data/aal_subcortex/L_amygdala.ply"},
    {"../shared/data/lv_endocardium_ed/lv_asymp_0083.ply",
     "../shared/data/lv_endocardium_ed/lv_asymp_0091.ply"},
    {"../shared/data/small_bodies/apophis.ply", "../shared/data/small_bodies/bacchus.ply"},
};

static const struct {
    const char *name;
    enum srnf_register_start start;
    bool reparameterization, symmetric, common_pose;
} ways[] = {
    {"default", SRNF_START_TOURNAMENT, true, false, false},
    {"symmetric", SRNF_START_TOURNAMENT, true, true, false},
    {"rigid", SRNF_START_RIGID, false, false, false},
    {"common pose", SRNF_START_IDENTITY, true, false, true},
};

static void must(int status)
{
    if (status < 0) {
        (void)fprintf(stderr, "%s\n", srnf_strerror(status));
        exit(EXIT_FAILURE);
    }
}

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
    must(srnf_mesh_prepare(&mesh, false, &report));
    must(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL));
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    shapes_update(s);
    return true;
}

static void one_transform(void *argument)
{
    struct shapes_surface *s = argument;

    srnf_field(s->sht, s->f, s->q, s->workspace);
}

/* Seconds of one gradient transform of three coordinates, with the field that follows from it. */
static double unit_seconds(struct shapes_surface *s)
{
    struct timing_case unit = {.body = one_transform, .argument = s};
    double seconds[5];

    timing_calibrate(&unit, UNIT_SECONDS);
    timing_interleave(&unit, 1, 5, seconds);
    return timing_median(5, seconds);
}

static void bench_pair(const struct shapes_surface *a, const struct shapes_surface *b, double unit)
{
    for (size_t k = 0; k < sizeof ways / sizeof ways[0]; k++) {
        struct srnf_register_options options = srnf_register_options_defaults();
        struct srnf_registration r;
        double seconds = timing_cpu();

        options.start = ways[k].start;
        options.reparameterization = ways[k].reparameterization;
        options.symmetric = ways[k].symmetric;
        options.common_pose = ways[k].common_pose;
        must(srnf_register(a->sht, a->f, NULL, b->f, &options, NULL, NULL, &r, NULL));
        seconds = timing_cpu() - seconds;
        printf("  %-12s %8.1f %9.0f  %8.5f %8.5f %8.5f  %5zu  %6.3f %6.2f\n", ways[k].name,
               1e3 * seconds, seconds / unit, r.distance_before * r.distance_before,
               r.distance * r.distance, r.objective, r.iterations, r.min_jacobian, r.max_jacobian);
        srnf_registration_clear(&r);
    }
}

int main(void)
{
    const size_t degrees[] = {15, 23, 31};

    openblas_set_num_threads(1);
    printf("Registration, one core, processor time; U: one gradient transform with its field\n");
    for (size_t d = 0; d < sizeof degrees / sizeof degrees[0]; d++) {
        struct shapes_surface a;
        struct shapes_surface b;

        shapes_open(&a, degrees[d]);
        shapes_open(&b, degrees[d]);
        printf("\ndegree %zu\n  %-12s %8s %9s  %8s %8s %8s  %5s  %6s %6s\n", degrees[d], "", "ms",
               "U", "before", "after", "objectiv", "steps", "min J", "max J");
        for (size_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
            if (load(&a, pairs[k][0]) && load(&b, pairs[k][1])) {
                printf("%s, %s\n", strrchr(pairs[k][0], '/') + 1, strrchr(pairs[k][1], '/') + 1);
                bench_pair(&a, &b, unit_seconds(&a));
            }
        }
        shapes_close(&a);
        shapes_close(&b);
    }
    return EXIT_SUCCESS;
}
