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
 *   SRNFD_TIME_FIRST=0      number of the first   SRNFD_TIME_THREADS=2           at once
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <fftw3.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/compare.h"
#include "support/meshes.h"
#include "support/parallel.h"
#include "support/random.h"
#include "support/slivers.h"
#include "support/timing.h"
#include "support/triangulations.h"

#define RATIO_MAX 20.0
#define MESHES_MAX ((size_t)1000)
#define STRETCH_MAX 1000.0
#define DEGREE 31
#define AT_ONCE ((size_t)2) /* meshes; each takes up to 2 GB */

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

/* One mesh by both routes. */
struct timed {
    const char *name;
    int status;         /* of preparing it, or of encoding where that ran out of memory */
    double cost[2];     /* processor seconds a face; negative where the route does not take it */
    double preparation; /* a face, part of cost */
};

struct study {
    size_t faces, first;
    uint64_t seed;
    struct timed *timed;
};

static const enum srnf_parameterization routes[2] = {SRNF_PARAMETERIZATION_AREA,
                                                     SRNF_PARAMETERIZATION_STAR};

static void encode(const struct srnf_mesh *mesh, const struct srnf_mesh_report *report, size_t r,
                   struct timed *timed)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded = {0};
    double start = timing_cpu();
    int status;

    options.degree = DEGREE;
    options.parameterization = routes[r];
    status = srnf_encode(mesh, report, &options, NULL, &encoded, NULL);
    srnf_free(encoded.coefficients);
    timed->status = status == SRNF_ENOMEM || status == SRNF_ECANCELED ? status : timed->status;
    timed->cost[r] = ((timing_cpu() - start) / (double)mesh->n_faces + timed->preparation) *
                     (status < 0 ? -1.0 : 1.0);
}

/* A body of a loop over threads, so it asserts nothing. */
static void time_mesh(void *argument, size_t i)
{
    const struct study *study = argument;
    struct timed *timed = &study->timed[i];
    struct test_random random = test_random_seed(study->seed + study->first + i);
    struct srnf_mesh mesh = draw(&random, study->first + i, study->faces, &timed->name);
    struct srnf_mesh_report report;
    double start = timing_cpu();

    timed->status = srnf_mesh_prepare(&mesh, true, &report);
    timed->preparation = (timing_cpu() - start) / (double)mesh.n_faces;
    for (size_t r = 0; r < 2 && timed->status == SRNF_OK; r++) {
        encode(&mesh, &report, r, timed);
    }
    srnf_mesh_clear(&mesh);
}

static void test_cost_of_a_face(void **state)
{
    static struct timed timed[MESHES_MAX];
    struct study study = {setting("SRNFD_TIME_FACES", 1000000), setting("SRNFD_TIME_FIRST", 0),
                          setting("SRNFD_TIME_SEED", 1), timed};
    size_t count = setting("SRNFD_TIME_MESHES", 24);
    double costs[2 * MESHES_MAX], worst = 0.0, median;
    (void)state;

    assert_true(count > 0 && count <= MESHES_MAX);
    fftw_make_planner_thread_safe();
    parallel_spread(setting("SRNFD_TIME_THREADS", AT_ONCE), count, time_mesh, &study);
    for (size_t i = 0; i < count; i++) {
        assert_int_equal(timed[i].status, SRNF_OK);
        for (size_t r = 0; r < 2; r++) {
            print_message("# %-12s %s %7.2f us a face (%.2f to prepare)%s\n", timed[i].name,
                          srnf_parameterization_name(routes[r]), 1e6 * fabs(timed[i].cost[r]),
                          1e6 * timed[i].preparation, timed[i].cost[r] < 0.0 ? ", refused" : "");
            costs[2 * i + r] = fabs(timed[i].cost[r]);
            worst = compare_max(worst, costs[2 * i + r]);
        }
    }
    median = timing_median(2 * count, costs);
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
