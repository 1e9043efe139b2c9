/*
 * test_surface.c - the triangulation of a surface: its vertices lie on it, its normals are exact,
 * its topology is that of a sphere.
 */
#include "core/figures.h"

#define PI 3.14159265358979323846

/* diag(a, b, c) e: the normal at a point is along (x / a^2, y / b^2, z / c^2). */
static void ellipsoid_has_exact_normals(void **state)
{
    const double axes[3] = {1.0, 1.3, 1.7};
    const size_t order[3] = {3, 1, 2};
    double f[3 * 25] = {0};
    struct srnf_mesh mesh = {0};
    double *normals = NULL;
    double worst_point = 0.0;
    double worst_normal = 0.0;
    (void)state;

    for (size_t c = 0; c < 3; c++) {
        f[25 * c + order[c]] = axes[c] * sqrt(4.0 * PI / 3.0);
    }
    assert_int_equal(srnf_surface_triangulate(4, f, 13, &mesh, &normals), SRNF_OK);
    assert_int_equal(mesh.n_vertices, 10 * 13 * 13 + 2);
    assert_int_equal(mesh.n_faces, 20 * 13 * 13);
    for (size_t i = 0; i < mesh.n_vertices; i++) {
        const double *x = mesh.vertices + 3 * i;
        double n[3];
        double on = 0.0;
        double length;

        for (size_t c = 0; c < 3; c++) {
            n[c] = x[c] / (axes[c] * axes[c]);
            on += n[c] * x[c];
        }
        length = figure_norm(3, n);
        worst_point = compare_max(worst_point, fabs(on - 1.0));
        for (size_t c = 0; c < 3; c++) {
            worst_normal = compare_max(worst_normal, fabs(normals[3 * i + c] - n[c] / length));
        }
    }
    figure_below("vertices off the ellipsoid", worst_point, 1e-13);
    figure_below("normals off the ellipsoid's", worst_normal, 1e-13);
    srnf_free(normals);
    srnf_mesh_clear(&mesh);
}

/* Face normals of ever finer triangulations approach the mean of the exact ones at their
   corners. */
static void normals_are_those_of_the_faces(void **state)
{
    const size_t frequencies[] = {16, 32, 64};
    double errors[3];
    struct shapes_surface s;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    for (size_t k = 0; k < 3; k++) {
        struct srnf_mesh mesh = {0};
        double *normals = NULL;
        double sum = 0.0;

        assert_int_equal(srnf_surface_triangulate(s.degree, s.f, frequencies[k], &mesh, &normals),
                         SRNF_OK);
        for (size_t i = 0; i < mesh.n_faces; i++) {
            const uint32_t *face = mesh.faces + 3 * i;
            const double *v[3];
            double mean[3];
            double n[3];

            for (size_t c = 0; c < 3; c++) {
                v[c] = mesh.vertices + 3 * (size_t)face[c];
                mean[c] = normals[3 * (size_t)face[0] + c] + normals[3 * (size_t)face[1] + c] +
                          normals[3 * (size_t)face[2] + c];
            }
            for (size_t c = 0; c < 3; c++) {
                size_t d = (c + 1) % 3;
                size_t e = (c + 2) % 3;

                n[c] = (v[1][d] - v[0][d]) * (v[2][e] - v[0][e]) -
                       (v[1][e] - v[0][e]) * (v[2][d] - v[0][d]);
            }
            sum += 1.0 - figure_dot(3, n, mean) / (figure_norm(3, n) * figure_norm(3, mean));
        }
        errors[k] = sqrt(sum / (double)mesh.n_faces);
        srnf_free(normals);
        srnf_mesh_clear(&mesh);
    }
    figure_order("angle between faces and normals", 3, errors, 2.0, 1.0, 0.1, 0.0, 2);
    shapes_close(&s);
}

static void topology_is_a_sphere(void **state)
{
    const char *const names[] = {"bumpy star", "bent capsule", "12 arms"};
    (void)state;

    for (size_t k = 0; k < 3; k++) {
        struct srnf_mesh mesh = {0};
        struct srnf_mesh_report report;
        struct shapes_surface s;

        shapes_open_case(&s, shapes_find(names[k]));
        assert_int_equal(srnf_surface_triangulate(s.degree, s.f, 20, &mesh, NULL), SRNF_OK);
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_int_equal(report.genus, 0);
        assert_int_equal(report.repairs.faces_flipped, 0);
        assert_true(report.volume > 0.0);
        srnf_mesh_clear(&mesh);
        shapes_close(&s);
    }
}

static void refuses_wrong_frequencies(void **state)
{
    double f[75] = {0};
    struct srnf_mesh mesh = {0};
    double *normals = NULL;
    (void)state;

    assert_int_equal(srnf_surface_triangulate(4, f, 0, &mesh, &normals), SRNF_EINVAL);
    assert_int_equal(srnf_surface_triangulate(4, f, 401, &mesh, &normals), SRNF_EINVAL);
    assert_int_equal(srnf_surface_triangulate(1001, f, 2, &mesh, &normals), SRNF_EINVAL);
    assert_null(normals);
    assert_null(mesh.vertices);
    assert_int_equal(srnf_surface_triangulate(4, f, 2, &mesh, &normals), SRNF_OK);
    assert_true(figure_norm(3 * mesh.n_vertices, normals) == 0.0); /* a point has no normal */
    srnf_free(normals);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ellipsoid_has_exact_normals),
        cmocka_unit_test(normals_are_those_of_the_faces),
        cmocka_unit_test(topology_is_a_sphere),
        cmocka_unit_test(refuses_wrong_frequencies),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
