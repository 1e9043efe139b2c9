/*
 * bench_pairs.c - what registration tells of ten pairs of real surfaces at degrees 8, 15 and 31, by
 * their area-preserving maps: the distance one way, from either side, and both ways; the truncation
 * error and its share of the distance; the range of the Jacobian; ambiguity; why it stopped. The
 * bounds of the warnings about registration (server/toolkit/registration_report.h) and the table in
 * core/README.md are from here.
 */
#include "support/meshes.h"
#include "support/shapes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SHARED "../shared/data/"

extern void openblas_set_num_threads(int threads);

static const char *const pairs[][2] = {
    {"tests/data/aal_subcortex/L_thalamus.ply", "tests/data/aal_subcortex/R_thalamus.ply"},
    {"tests/data/aal_subcortex/L_pallidum.ply", "tests/data/aal_subcortex/L_amygdala.ply"},
    {SHARED "lv_endocardium_ed/lv_asymp_0083.ply", SHARED "lv_endocardium_ed/lv_asymp_0091.ply"},
    {SHARED "lv_endocardium_ed/lv_asymp_0397.ply", SHARED "lv_endocardium_ed/lv_asymp_0421.ply"},
    {SHARED "lv_endocardium_ed/lv_asymp_0705.ply", SHARED "lv_pairs/lv_asymp_0705_es_endo.ply"},
    {SHARED "small_bodies/eugenia.ply", SHARED "small_bodies/psyche.ply"},
    {SHARED "small_bodies/geographos.ply", SHARED "small_bodies/bacchus.ply"},
    {SHARED "small_bodies/kleopatra.ply", SHARED "small_bodies/toutatis.ply"},
    {SHARED "small_bodies/gaspra.ply", SHARED "small_bodies/mathilde.ply"},
    {"tests/data/aal_subcortex/L_hippocampus.ply", "tests/data/aal_subcortex/R_hippocampus.ply"},
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
    options.parameterization = SRNF_PARAMETERIZATION_AREA;
    must(srnf_mesh_prepare(&mesh, false, &report));
    must(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL));
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    shapes_update(s);
    return true;
}

static void bench_way(const char *name, const struct shapes_surface *a,
                      const struct shapes_surface *b, bool symmetric)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;

    options.symmetric = symmetric;
    must(srnf_register(a->sht, a->f, NULL, b->f, &options, NULL, NULL, &r, NULL));
    printf("  %-9s %8.5f %8.5f  %6.4f %6.2f  %5.3f %5.2f  %6.3f %6.3f  %5zu %s\n", name, r.distance,
           r.objective, r.truncation_error, r.truncation_distance / r.distance, r.min_jacobian,
           r.max_jacobian, r.ambiguity_objective, r.rotational_curvature, r.iterations,
           srnf_register_stop_name(r.stopped));
    (void)fflush(stdout);
    srnf_registration_clear(&r);
}

int main(void)
{
    const size_t degrees[] = {8, 15, 31};

    openblas_set_num_threads(1);
    for (size_t d = 0; d < sizeof degrees / sizeof degrees[0]; d++) {
        struct shapes_surface a;
        struct shapes_surface b;

        shapes_open(&a, degrees[d]);
        shapes_open(&b, degrees[d]);
        printf("\ndegree %zu\n  %-9s %8s %8s  %6s %6s  %5s %5s  %6s %6s  %5s\n", degrees[d], "",
               "distance", "objectiv", "trunc", "/ dist", "min J", "max J", "other", "curv",
               "steps");
        for (size_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
            if (load(&a, pairs[k][0]) && load(&b, pairs[k][1])) {
                printf("%s, %s\n", strrchr(pairs[k][0], '/') + 1, strrchr(pairs[k][1], '/') + 1);
                bench_way("forth", &a, &b, false);
                bench_way("back", &b, &a, false);
                bench_way("both ways", &a, &b, true);
            }
        }
        shapes_close(&a);
        shapes_close(&b);
    }
    return EXIT_SUCCESS;
}
