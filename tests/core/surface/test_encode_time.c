/*
 * srnfd-test: nightly
 * srnfd-test: release-only
 * srnfd-test: alone
 * srnfd-test: timeout 5400
 *
 * test_encode_time.c - encoding takes a bounded time for each face of whatever mesh: even ones and
 * slivers, fans, needles and hubs, stretched and with edges flipped at random, of a million faces.
 * No mesh costs more than twenty times the median a face, with preparation, by either route.
 *
 *   SRNFD_TIME_MESHES=24    meshes    SRNFD_TIME_FACES=1000000    of so many faces each
 *   SRNFD_TIME_SEED=1       of what is drawn      SRNFD_TIME_FAMILY=stacked      of one family
 * alone
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/compare.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/slivers.h"
#include "support/timing.h"
#include "support/triangulations.h"

#define RATIO_MAX 20.0
#define MESHES_MAX ((size_t)1000)
#define STRETCH_MAX 1000.0
#define DEGREE 31

static size_t setting(const char *name, size_t fallback)
{
    const char *value = getenv(name);

    return value ? strtoul(value, NULL, 10) : fallback;
}

static struct srnf_mesh draw(struct test_random *random, size_t number, size_t faces,
                             const char **name)
{
    const char *only = getenv("SRNFD_TIME_FAMILY");
    size_t families = 0, family;
    struct srnf_mesh mesh;

    while (sliver_families[families].name) {
        families++;
    }
    family = number % families;
    for (size_t i = 0; only && i < families; i++) {
        if (strcmp(sliver_families[i].name, only) == 0) {
            family = i;
        }
    }
    *name = sliver_families[family].name;
    mesh = sliver_families[family].make(faces);
    if (number >= families) { /* the first of each family is as it is */
        if (test_random_below(random, 2) > 0) {
            triangulations_flip_edges(&mesh, faces / 20, random);
        }
        meshes_stretch(&mesh, exp(test_random_uniform(random, 0.0, log(STRETCH_MAX))),
                       exp(test_random_uniform(random, 0.0, log(STRETCH_MAX))), 1.0);
        meshes_turn(&mesh, test_random_bits(random));
    }
    return mesh;
}

/* Processor seconds a face; negative where the route does not take the mesh. */
static double encode(const struct srnf_mesh *mesh, const struct srnf_mesh_report *report,
                     enum srnf_parameterization route, double prepared)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded = {0};
    double start = timing_cpu();
    int status;

    options.degree = DEGREE;
    options.parameterization = route;
    status = srnf_encode(mesh, report, &options, NULL, &encoded, NULL);
    srnf_free(encoded.coefficients);
    assert_true(status != SRNF_ENOMEM && status != SRNF_ECANCELED);
    return (timing_cpu() - start + prepared) / (double)mesh->n_faces * (status < 0 ? -1.0 : 1.0);
}

static void test_cost_of_a_face(void **state)
{
    static const enum srnf_parameterization routes[] = {SRNF_PARAMETERIZATION_AREA,
                                                        SRNF_PARAMETERIZATION_STAR};
    struct test_random random = test_random_seed(setting("SRNFD_TIME_SEED", 1));
    size_t count = setting("SRNFD_TIME_MESHES", 24), faces = setting("SRNFD_TIME_FACES", 1000000);
    double costs[2 * MESHES_MAX], worst = 0.0, median;
    size_t n = 0;
    (void)state;

    assert_true(count > 0 && count <= MESHES_MAX);
    for (size_t i = 0; i < count; i++) {
        const char *name;
        struct srnf_mesh mesh = draw(&random, i, faces, &name);
        struct srnf_mesh_report report;
        double start = timing_cpu(), prepared;

        assert_int_equal(srnf_mesh_prepare(&mesh, true, &report), SRNF_OK);
        prepared = timing_cpu() - start;
        for (size_t r = 0; r < 2; r++) {
            double cost = encode(&mesh, &report, routes[r], prepared);

            print_message("# %-12s %s %7.2f us a face (%.2f to prepare)%s\n", name,
                          srnf_parameterization_name(routes[r]), 1e6 * fabs(cost),
                          1e6 * prepared / (double)mesh.n_faces, cost < 0.0 ? ", refused" : "");
            costs[n++] = fabs(cost);
            worst = compare_max(worst, fabs(cost));
        }
        srnf_mesh_clear(&mesh);
    }
    median = timing_median(n, costs);
    print_message("# median %.2f us, largest %.2f us: %.1f times\n", 1e6 * median, 1e6 * worst,
                  worst / median);
    assert_true(worst <= RATIO_MAX * median);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_cost_of_a_face)};

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
