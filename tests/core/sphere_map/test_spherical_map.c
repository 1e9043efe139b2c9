/*
 * test_spherical_map.c - the spherical parameterization of real meshes and of shapes whose map is
 * known: bijective and little distorted, by measures of its own.
 *
 * srnfd-test: timeout 300
 * srnfd-test: slow
 * srnfd-test: no-asan (core/registration/test_register_known.c runs its code)
 */
#include "spherical_checks.h"
#include "support/bodies.h"

/* ---- Real meshes, and such ------------------------------------------------------------------- */

/* Limits are what the method reached when it was found, to the last digit given. */
struct expectation {
    const char *what; /* as in bodies_list */
    size_t made;
    double median, most, deviation;
};

/* Every one of them; under a sanitizer a few of many, whose median is another. */
static void check_meshes(const struct expectation *expected)
{
    static char *names[FOLDERS_FILES_MAX];
    static double energies[FOLDERS_FILES_MAX];
    size_t n = bodies_list(expected->what, expected->made, names);
    size_t stride = CHECK_SLOW && n > 20 ? 10 : 1;
    size_t count = 0;
    double deviation = 0.0;

    assert_true(n > 0);
    for (size_t i = 0; i < n; i += stride) {
        struct srnf_mesh mesh;
        struct srnf_mesh_report report;
        struct srnf_spherical_map map;

        assert_true(bodies_load(names[i], &mesh));
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_int_equal(check_map(folders_name(names[i]), &mesh, &map), SRNF_OK);
        assert_int_equal(map.attempts, 1);
        energies[count++] = map.symmetric_dirichlet;
        deviation = compare_max(deviation, map.log_area_deviation);
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
    for (size_t i = 0; i < n; i++) {
        free(names[i]);
    }
    qsort(energies, count, sizeof *energies, compare_order);
    printf("# %s: %zu meshes, E median %.2f (%.2f), at most %.2f (%.2f), sd at most %.2f (%.2f)\n",
           expected->what, count, energies[count / 2], expected->median, energies[count - 1],
           expected->most, deviation, expected->deviation);
    assert_true(energies[count - 1] < expected->most + 0.005);
    assert_true(deviation < expected->deviation + 0.005);
    if (stride == 1) {
        assert_true(energies[count / 2] < expected->median + 0.005);
    }
}

static void test_brain_structures(void **state)
{
    (void)state;
    check_meshes(&(struct expectation){"tests/data/aal_subcortex", 0, 4.41, 5.74, 0.43});
}

static void test_ventricles(void **state)
{
    (void)state;
    check_meshes(&(struct expectation){"ventricle", 100, 4.24, 4.44, 0.26});
}

static void test_contracted_ventricles(void **state)
{
    (void)state;
    check_meshes(&(struct expectation){"contracted", 20, 4.65, 5.03, 0.35});
}

static void test_small_bodies(void **state)
{
    (void)state;
    check_meshes(&(struct expectation){"asteroid", BODIES_ASTEROIDS, 4.11, 8.75, 0.57});
}

/* ---- Known maps ------------------------------------------------------------------------------ */

/* How far a map of a mesh on the unit sphere is from a rotation: largest change of the products of
   the positions of two vertices. */
static double distance_from_rotation(const struct srnf_mesh *mesh, const double *points)
{
    double largest = 0.0;

    for (size_t a = 0; a < mesh->n_vertices; a++) {
        for (size_t b = 0; b < mesh->n_vertices; b += 97) {
            double before = 0.0;
            double after = 0.0;

            for (size_t k = 0; k < 3; k++) {
                before += mesh->vertices[3 * a + k] * mesh->vertices[3 * b + k];
                after += points[3 * a + k] * points[3 * b + k];
            }
            largest = compare_max(largest, fabs(before - after));
        }
    }
    return largest;
}

/* The map of a sphere is a rotation, up to what the relaxation leaves when no vertex gains more
   than 1e-5 of its energy any more. */
static void test_sphere(void **state)
{
    (void)state;

    for (size_t frequency = 4; frequency <= 32; frequency *= 2) {
        struct srnf_mesh mesh = meshes_sphere(frequency);
        struct srnf_spherical_map map;
        double distance;

        assert_int_equal(check_map("sphere", &mesh, &map), SRNF_OK);
        distance = distance_from_rotation(&mesh, map.points);
        printf("#   energy - 4: %.1e, products of positions off by %.1e\n",
               map.symmetric_dirichlet - 4.0, distance);
        assert_true(fabs(map.symmetric_dirichlet - 4.0) < 2.0 / (double)(frequency * frequency));
        assert_true(distance < 0.01);
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
}

/* The figures that come with a map are those of the map; no slivers here. */
static void test_figures(void **state)
{
    struct srnf_mesh meshes[] = {meshes_sphere(12), meshes_star(14), meshes_bumpy(12, 5),
                                 meshes_bent_capsule(6, 1, 4, 40, 16), meshes_tetrahedron()};
    (void)state;

    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
        struct srnf_spherical_map map;
        double deviation;
        double energy;

        assert_int_equal(check_map("figures", &meshes[i], &map), SRNF_OK);
        energy = check_distortion(&meshes[i], map.points, &deviation);
        assert_true(fabs(energy / map.symmetric_dirichlet - 1.0) < 1e-10);
        assert_true(fabs(deviation - map.log_area_deviation) < 1e-7);
        srnf_free(map.points);
        srnf_mesh_clear(&meshes[i]);
    }
}

/* Ellipsoids: the longer, the more distortion there must be; better than the obvious map along the
   rays, (x / a, y / b, z / c). */
static void test_ellipsoids(void **state)
{
    double last = 3.99;
    (void)state;

    for (double length = 1.0; length < 7.0; length += 1.0) {
        struct srnf_mesh sphere = meshes_sphere(16);
        struct srnf_mesh mesh = meshes_copy(&sphere);
        struct srnf_spherical_map map;
        double deviation;
        double obvious;

        meshes_stretch(&mesh, 1.0, 0.8, length);
        assert_int_equal(check_map("ellipsoid", &mesh, &map), SRNF_OK);
        obvious = check_distortion(&mesh, sphere.vertices, &deviation);
        printf("#   1 : 0.8 : %g, E %.3f, along the rays %.3f\n", length, map.symmetric_dirichlet,
               obvious);
        assert_true(map.symmetric_dirichlet < obvious);
        assert_true(length < 2.0 || map.symmetric_dirichlet > last);
        last = map.symmetric_dirichlet;
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
        srnf_mesh_clear(&sphere);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere),       cmocka_unit_test(test_figures),
        cmocka_unit_test(test_ellipsoids),   cmocka_unit_test(test_brain_structures),
        cmocka_unit_test(test_small_bodies), cmocka_unit_test(test_contracted_ventricles),
        cmocka_unit_test(test_ventricles),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
