/*
 * test_geometry_allocation.c - preparation, star kernel, index, geodesic sphere and fit error when
 * memory runs out: each allocation in turn is refused; the call fails cleanly and nothing leaks.
 *
 * This program brings its own srnf_alloc and srnf_free, which the linker prefers to those of the
 * library. They count what is alive and refuse the n-th request.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "shape/fit.h"
#include "support/meshes.h"

static size_t requests; /* since the last reset */
static size_t refused;  /* index of the request to refuse; SIZE_MAX: none */
static size_t alive;

void *srnf_alloc(size_t count, size_t size)
{
    void *pointer;

    if (requests++ == refused || (size > 0 && count > PTRDIFF_MAX / size - 64)) {
        return NULL;
    }
    pointer = aligned_alloc(64, (count * size + 64) / 64 * 64);
    if (pointer) {
        memset(pointer, 0, count * size);
        alive++;
    }
    return pointer;
}

void srnf_free(void *pointer)
{
    alive -= pointer != NULL;
    free(pointer);
}

static void reset(size_t refuse)
{
    requests = 0;
    refused = refuse;
}

/* Each runs one function on a mesh and frees what it made. */
static int run_prepare(struct srnf_mesh *mesh)
{
    struct srnf_mesh_report report;

    return srnf_mesh_prepare(mesh, true, &report);
}

static int run_star_kernel(struct srnf_mesh *mesh)
{
    struct srnf_star star;

    return srnf_star_kernel(mesh, &star);
}

static int run_star_at(struct srnf_mesh *mesh)
{
    const double center[3] = {0, 0, 0};
    struct srnf_star star;

    return srnf_star_at(mesh, center, &star);
}

static int run_index(struct srnf_mesh *mesh)
{
    struct srnf_index *index;
    int status = srnf_index_create(&index, mesh);

    assert_int_equal(index == NULL, status != SRNF_OK);
    srnf_index_destroy(index);
    return status;
}

static int run_icosphere(struct srnf_mesh *mesh)
{
    struct srnf_mesh sphere = {0};
    int status = srnf_mesh_icosphere(3, &sphere);

    (void)mesh;
    srnf_mesh_clear(&sphere);
    return status;
}

static int run_fit(struct srnf_mesh *mesh)
{
    struct srnf_index *index;
    struct srnf_fit fit;
    int status = srnf_index_create(&index, mesh);

    if (status == SRNF_OK) {
        status = srnf_fit_measure(mesh, index, mesh, NULL, &fit);
    }
    srnf_index_destroy(index);
    return status;
}

static void each_refusal_is_survived(void **state)
{
    int (*const functions[])(struct srnf_mesh *) = {run_prepare, run_star_kernel, run_star_at,
                                                    run_index,   run_icosphere,   run_fit};
    (void)state;

    for (size_t i = 0; i < sizeof functions / sizeof functions[0]; i++) {
        int status = SRNF_ENOMEM;

        for (size_t n = 0; status == SRNF_ENOMEM && n < 100; n++) {
            struct srnf_mesh sphere, mesh;
            size_t before;

            reset(SIZE_MAX);
            sphere = meshes_sphere(4);
            mesh = meshes_soup(&sphere);
            before = alive;
            reset(n);
            status = functions[i](&mesh);
            assert_true(status == SRNF_OK ? n > 1 : status == SRNF_ENOMEM);
            assert_int_equal(alive, before);
            srnf_mesh_clear(&mesh);
            srnf_mesh_clear(&sphere);
        }
        assert_int_equal(status, SRNF_OK);
    }
    assert_int_equal(alive, 0);
}

/* Queries are re-entrant and cost no memory. */
static void queries_allocate_nothing(void **state)
{
    const double origin[3] = {0, 0, 0}, direction[3] = {1, 2, 3};
    struct srnf_index *index;
    struct srnf_mesh mesh;
    double t;
    (void)state;

    reset(SIZE_MAX);
    mesh = meshes_sphere(4);
    assert_int_equal(srnf_index_create(&index, &mesh), SRNF_OK);
    reset(0);
    assert_true(srnf_index_ray(index, origin, direction, &t, NULL));
    assert_true(srnf_index_distance2(index, direction, NULL, NULL) > 0.0);
    assert_int_equal(requests, 0);
    srnf_index_destroy(index);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_refusal_is_survived),
        cmocka_unit_test(queries_allocate_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
