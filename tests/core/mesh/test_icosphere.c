/*
 * test_icosphere.c - the geodesic sphere: counts, unit vertices, closed and oriented, evenly
 * spread.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "support/compare.h"
#include "support/meshes.h"

static void test_counts_and_topology(void **state)
{
    const size_t frequencies[] = {1, 2, 3, 4, 5, 8, 13, 31};
    (void)state;

    for (size_t i = 0; i < sizeof frequencies / sizeof frequencies[0]; i++) {
        size_t n = frequencies[i];
        struct srnf_mesh mesh;
        struct srnf_mesh_report report;

        assert_int_equal(srnf_mesh_icosphere(n, &mesh), SRNF_OK);
        assert_int_equal(mesh.n_vertices, 10 * n * n + 2);
        assert_int_equal(mesh.n_faces, 20 * n * n);
        assert_int_equal(srnf_mesh_prepare(&mesh, true, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_int_equal(report.repairs.duplicate_vertices_merged, 0);
        assert_int_equal(report.repairs.unreferenced_vertices_dropped, 0);
        assert_int_equal(report.repairs.faces_flipped, 0);
        srnf_mesh_clear(&mesh);
    }
}

static void test_vertices_and_faces(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(10);
    double least = INFINITY, most = 0.0;
    (void)state;

    for (size_t i = 0; i < mesh.n_vertices; i++) {
        const double *v = mesh.vertices + 3 * i;

        assert_true(fabs(sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) - 1.0) < 1e-15);
    }
    for (size_t c = 0; c < 3 * mesh.n_faces; c++) { /* edges */
        const double *a = mesh.vertices + 3 * mesh.faces[c];
        const double *b = mesh.vertices + 3 * mesh.faces[c % 3 == 2 ? c - 2 : c + 1];
        double length = sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                             (a[2] - b[2]) * (a[2] - b[2]));

        least = compare_min(least, length);
        most = compare_max(most, length);
    }
    assert_true(most < 2.0 * least);
    for (size_t i = 0; i < mesh.n_vertices; i++) { /* each point's antipode is a vertex too */
        bool found = false;

        for (size_t j = 0; j < mesh.n_vertices && !found; j++) {
            found = fabs(mesh.vertices[3 * i] + mesh.vertices[3 * j]) < 1e-14 &&
                    fabs(mesh.vertices[3 * i + 1] + mesh.vertices[3 * j + 1]) < 1e-14 &&
                    fabs(mesh.vertices[3 * i + 2] + mesh.vertices[3 * j + 2]) < 1e-14;
        }
        assert_true(found);
    }
    srnf_mesh_clear(&mesh);
}

static void test_range(void **state)
{
    struct srnf_mesh mesh = {.n_vertices = 7};
    (void)state;

    assert_int_equal(srnf_mesh_icosphere(0, &mesh), SRNF_EINVAL);
    assert_int_equal(srnf_mesh_icosphere(401, &mesh), SRNF_EINVAL);
    assert_int_equal(mesh.n_vertices, 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_counts_and_topology),
        cmocka_unit_test(test_vertices_and_faces),
        cmocka_unit_test(test_range),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
