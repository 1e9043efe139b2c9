/*
 * test_spherical_map.c - the spherical parameterisation of real meshes and of shapes whose map is
 * known: bijective and little distorted, by measures of its own.
 *
 * srnfd-test: timeout 300
 */
#include "spherical_checks.h"

#define SHARED "../shared/data/"

/* ---- Real meshes ----------------------------------------------------------------------------- */

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a;
    double y = *(const double *)b;

    return (x > y) - (x < y);
}

/* Limits are what the method reached when it was found, to the last digit given; `whole` says that
   this was measured on just these meshes, so that the medians are comparable. */
struct expectation {
    const char *folder;
    double median, most, deviation;
    bool whole;
};

/* Every mesh of a folder; under a sanitizer a few of many. */
static void check_folder(const struct expectation *expected)
{
    static char *paths[FOLDERS_FILES_MAX];
    static double energies[FOLDERS_FILES_MAX];
    size_t n = folders_list(expected->folder, paths);
    size_t stride = CHECK_SLOW && n > 20 ? 10 : 1;
    size_t count = 0;
    double deviation = 0.0;

    if (n == 0) {
        printf("# there is no folder %s\n", expected->folder);
        skip();
    }
    for (size_t i = 0; i < n; i += stride) {
        struct srnf_mesh mesh;
        struct srnf_mesh_report report;
        struct srnf_spherical_map map;

        assert_true(meshes_load(paths[i], &mesh));
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_int_equal(check_map(strrchr(paths[i], '/') + 1, &mesh, &map), SRNF_OK);
        assert_int_equal(map.attempts, 1);
        energies[count++] = map.symmetric_dirichlet;
        deviation = fmax(deviation, map.log_area_deviation);
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
    for (size_t i = 0; i < n; i++) {
        free(paths[i]);
    }
    qsort(energies, count, sizeof *energies, by_value);
    printf("# %s: %zu meshes, E median %.2f (%.2f), at most %.2f (%.2f), sd at most %.2f (%.2f)\n",
           expected->folder, count, energies[count / 2], expected->median, energies[count - 1],
           expected->most, deviation, expected->deviation);
    assert_true(energies[count - 1] < expected->most + 0.005);
    assert_true(deviation < expected->deviation + 0.005);
    if (expected->whole) {
        assert_true(energies[count / 2] < expected->median + 0.005);
    }
}

static void test_brain_structures(void **state)
{
    (void)state;
    check_folder(&(struct expectation){"tests/data/aal_subcortex", 4.41, 5.74, 0.43, true});
}

static void test_ventricles(void **state)
{
    (void)state;
    check_folder(&(struct expectation){SHARED "lv_endocardium_ed", 4.23, 4.95, 0.35, false});
}

static void test_ventricle_pairs(void **state)
{
    (void)state;
    check_folder(&(struct expectation){SHARED "lv_pairs", 4.23, 4.95, 0.35, false});
}

static void test_small_bodies(void **state)
{
    (void)state;
    check_folder(&(struct expectation){SHARED "small_bodies", 4.07, 5.76, 0.46, false});
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
            largest = fmax(largest, fabs(before - after));
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
        cmocka_unit_test(test_small_bodies), cmocka_unit_test(test_ventricle_pairs),
        cmocka_unit_test(test_ventricles),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
