/*
 * test_spherical_allocation.c - the spherical parameterization when memory runs out: each
 * allocation in turn is refused; the call says so and nothing leaks.
 */
#include "support/meshes.h"
#include "support/refusing.h"
#include "support/triangulations.h"

#define REQUESTS_MAX 2000

static struct srnf_mesh mesh; /* what the map is of */

static int run_map(void)
{
    struct srnf_spherical_map map;
    struct srnf_error error = {0};
    int status = srnf_spherical_map(&mesh, NULL, &map, &error);

    if (status == SRNF_OK) {
        assert_non_null(map.points);
    } else {
        assert_int_equal(status, SRNF_ENOMEM);
        assert_int_equal(error.status, SRNF_ENOMEM);
        assert_null(map.points);
    }
    srnf_free(map.points);
    return status;
}

/* Clears the mesh. */
static void sweep(const char *name, struct srnf_mesh of)
{
    size_t total;

    mesh = of;
    total = refusing_sweep(name, run_map, 0, 1);
    assert_true(total > 9 && total < REQUESTS_MAX);
    srnf_mesh_clear(&mesh);
}

static void each_refusal_is_survived(void **state)
{
    (void)state;
    refusing_none();
    sweep("tetrahedron", meshes_tetrahedron());
    sweep("sphere", meshes_sphere(4));
    sweep("bumpy sphere", meshes_bumpy(8, 1));
    sweep("two hubs", triangulations_bipyramid(300)); /* rings and stars that have to grow */
    assert_int_equal(refusing.alive, 0);
}

/* When no attempt succeeds, each starts from nothing and leaves nothing. */
static void failure_leaves_nothing(void **state)
{
    struct test_random random = test_random_seed(1);
    struct srnf_spherical_map map;
    (void)state;

    refusing_none();
    mesh = triangulations_stacked(400, true, &random);
    assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), SRNF_ENUMERIC);
    assert_null(map.points);
    assert_true(map.attempts > 1);
    srnf_mesh_clear(&mesh);
    mesh = meshes_torus(2, 1, 8, 8);
    assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), SRNF_EGENUS);
    srnf_mesh_clear(&mesh);
    assert_int_equal(refusing.alive, 0);
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
