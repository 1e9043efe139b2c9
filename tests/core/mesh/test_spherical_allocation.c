/*
 * test_spherical_allocation.c - the spherical parameterisation when memory runs out: each
 * allocation in turn is refused; the call says so and nothing leaks.
 *
 * This program brings its own srnf_alloc and srnf_free, which the linker prefers to those of the
 * library. They count what is alive and refuse the n-th request.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/meshes.h"
#include "support/triangulations.h"

#define REQUESTS_MAX 2000

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

/* Refuses the 0th, 1st, .. request of a map until one is not made any more; clears the mesh. */
static void sweep(const char *name, struct srnf_mesh mesh)
{
    size_t before = alive;
    int status = SRNF_ENOMEM;
    size_t n = 0;

    for (; status == SRNF_ENOMEM && n < REQUESTS_MAX; n++) {
        struct srnf_spherical_map map;
        struct srnf_error error = {0};

        reset(n);
        status = srnf_spherical_map(&mesh, NULL, &map, &error);
        reset(SIZE_MAX);
        if (status == SRNF_OK) {
            assert_non_null(map.points);
        } else {
            assert_int_equal(status, SRNF_ENOMEM);
            assert_int_equal(error.status, SRNF_ENOMEM);
            assert_null(map.points);
        }
        srnf_free(map.points);
        assert_int_equal(alive, before);
    }
    assert_int_equal(status, SRNF_OK);
    printf("# %s: %zu requests, each refused once\n", name, n - 1);
    assert_true(n > 10);
    srnf_mesh_clear(&mesh);
}

static void each_refusal_is_survived(void **state)
{
    (void)state;
    reset(SIZE_MAX);
    sweep("tetrahedron", meshes_tetrahedron());
    sweep("sphere", meshes_sphere(4));
    sweep("bumpy sphere", meshes_bumpy(8, 1));
    sweep("two hubs", triangulations_bipyramid(300)); /* rings and stars that have to grow */
    assert_int_equal(alive, 0);
}

/* When no attempt succeeds, each starts from nothing and leaves nothing. */
static void failure_leaves_nothing(void **state)
{
    struct test_random random = test_random_seed(1);
    struct srnf_spherical_map map;
    struct srnf_mesh mesh;
    (void)state;

    reset(SIZE_MAX);
    mesh = triangulations_stacked(400, true, &random);
    assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), SRNF_ENUMERIC);
    assert_null(map.points);
    assert_true(map.attempts > 1);
    srnf_mesh_clear(&mesh);
    mesh = meshes_torus(2, 1, 8, 8);
    assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), SRNF_EGENUS);
    srnf_mesh_clear(&mesh);
    assert_int_equal(alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_refusal_is_survived),
        cmocka_unit_test(failure_leaves_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
