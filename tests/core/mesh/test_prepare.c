/*
 * test_prepare.c - topology, measures and repairs: every fault is found, counted and placed;
 * nothing else is reported; repairs lose nothing.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "support/meshes.h"
#include "support/random.h"

#define PI 3.14159265358979323846

static struct srnf_mesh_report prepare(struct srnf_mesh *mesh, bool merge)
{
    struct srnf_mesh_report report;

    assert_int_equal(srnf_mesh_prepare(mesh, merge, &report), SRNF_OK);
    return report;
}

static const struct srnf_mesh_problem *find_problem(const struct srnf_mesh_report *report,
                                                    int status)
{
    for (size_t i = 0; i < report->n_problems; i++) {
        if (report->problems[i].status == status) {
            return &report->problems[i];
        }
    }
    return NULL;
}

static void assert_sound(const struct srnf_mesh_report *report)
{
    assert_int_equal(report->n_problems, 0);
    assert_true(report->closed && report->edge_manifold && report->vertex_manifold &&
                report->oriented);
    assert_int_equal(report->components, 1);
    assert_int_equal(report->euler_characteristic, 2);
    assert_int_equal(report->genus, 0);
    assert_true(report->volume > 0.0);
}

static void test_sound_shapes(void **state)
{
    struct srnf_mesh meshes[] = {meshes_sphere(1),
                                 meshes_sphere(7),
                                 meshes_star(12),
                                 meshes_bumpy(9, 3),
                                 meshes_box(1, 2, 3),
                                 meshes_tetrahedron(),
                                 meshes_capsule(3, 1, 9, 7),
                                 meshes_bent_capsule(9, 1, 4, 40, 12)};
    (void)state;

    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
        struct srnf_mesh_report report = prepare(&meshes[i], false);

        assert_sound(&report);
        assert_int_equal(report.repairs.faces_flipped, 0);
        assert_int_equal(report.repairs.unreferenced_vertices_dropped, 0);
        srnf_mesh_clear(&meshes[i]);
    }
}

/* What is known: a box; and a sphere, whose errors fall with the square of the frequency. */
static void test_measures(void **state)
{
    double scales[] = {1e-9, 1.0, 1e9};
    double last = 0.0;
    (void)state;

    for (size_t i = 0; i < 3; i++) {
        struct srnf_mesh box = meshes_box(1, 2, 3);
        struct srnf_mesh_report report;
        double s = scales[i];

        meshes_turn(&box, 5);
        meshes_move(&box, 10, -20, 30);
        meshes_scale(&box, s);
        report = prepare(&box, false);
        assert_sound(&report);
        assert_true(fabs(report.area / (22 * s * s) - 1.0) < 1e-13);
        assert_true(fabs(report.volume / (6 * s * s * s) - 1.0) < 1e-13);
        assert_true(fabs(report.centroid[1] / (-20 * s) - 1.0) < 1e-13);
        srnf_mesh_clear(&box);
    }
    for (size_t frequency = 8; frequency <= 32; frequency *= 2) {
        struct srnf_mesh sphere = meshes_sphere(frequency);
        struct srnf_mesh_report report = prepare(&sphere, false);
        double error = 1.0 - report.area / (4.0 * PI);

        assert_true(error > 0.0 && 1.0 - report.volume / (4.0 * PI / 3.0) > error);
        assert_true(fabs(report.centroid[0]) < 1e-12);
        if (last > 0.0) {
            assert_true(fabs(log2(last / error) - 2.0) < 0.05);
        }
        last = error;
        srnf_mesh_clear(&sphere);
    }
}

/* One row per fault: what must be reported, and that nothing else is. */
static void test_faults(void **state)
{
    struct {
        struct srnf_mesh mesh;
        int status;
        size_t count;
        int64_t first;
        int64_t euler;
        const char *words;
    } rows[] = {
        {meshes_torus(2, 0.5, 12, 8), SRNF_EGENUS, 1, -1, 0, "1 handle"},
        {meshes_sphere_with_hole(4), SRNF_ENOT_CLOSED, 3, -2, 1, "3 boundary edges"},
        {meshes_two_spheres(3), SRNF_ECOMPONENTS, 2, 180, 4, "face 180"},
        {meshes_bowtie(), SRNF_ENOT_MANIFOLD, 1, 0, 3, "vertex 0"},
        {meshes_shared_edge(), SRNF_ENOT_MANIFOLD, 1, 0, 3, "three faces or more"},
        {meshes_one_face_turned(3), SRNF_ENOT_ORIENTED, 3, -2, 2, "run the same way"},
        {meshes_flat(), SRNF_EDEGENERATE, 1, -1, 2, "no volume"},
    };
    (void)state;

    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct srnf_mesh_report report = prepare(&rows[i].mesh, false);
        const struct srnf_mesh_problem *problem = find_problem(&report, rows[i].status);

        assert_int_equal(report.n_problems, 1);
        assert_non_null(problem);
        assert_int_equal(problem->count, rows[i].count);
        if (rows[i].first >= -1) {
            assert_int_equal(problem->first, rows[i].first);
        }
        assert_int_equal(report.euler_characteristic, rows[i].euler);
        assert_non_null(strstr(problem->detail, rows[i].words));
        srnf_mesh_clear(&rows[i].mesh);
    }
}

static void test_several_faults_in_order(void **state)
{
    struct srnf_mesh mesh = meshes_fin();
    struct srnf_mesh_report report = prepare(&mesh, false);
    (void)state;

    assert_false(report.closed);
    assert_false(report.edge_manifold);
    assert_true(report.vertex_manifold);
    assert_int_equal(report.n_problems, 2);
    assert_int_equal(report.problems[0].status, SRNF_ENOT_CLOSED);
    assert_int_equal(report.problems[0].count, 2);
    assert_int_equal(report.problems[0].first, 4);
    assert_int_equal(report.problems[1].status, SRNF_ENOT_MANIFOLD);
    assert_int_equal(report.problems[1].count, 1);
    assert_int_equal(report.problems[1].first, 0);
    srnf_mesh_clear(&mesh);
}

static void test_one_sided(void **state)
{
    struct srnf_mesh meshes[] = {meshes_klein_bottle(14, 9), meshes_projective_plane()};
    const int64_t euler[] = {0, 1};
    (void)state;

    for (size_t i = 0; i < 2; i++) {
        struct srnf_mesh_report report = prepare(&meshes[i], false);

        assert_true(report.closed && report.edge_manifold && report.vertex_manifold);
        assert_false(report.oriented);
        assert_int_equal(report.euler_characteristic, euler[i]);
        assert_int_equal(report.genus, -1);
        assert_non_null(strstr(find_problem(&report, SRNF_ENOT_ORIENTED)->detail, "one-sided"));
        assert_int_equal(find_problem(&report, SRNF_EGENUS)->count, 2 - euler[i]);
        srnf_mesh_clear(&meshes[i]);
    }
}

/* The first offending face is the lowest that has a fault, wherever the hole is; and its vertices
   are named. */
static void test_hole_is_placed(void **state)
{
    enum { N = 320 };
    (void)state;

    for (size_t gone = 0; gone < N; gone += 37) {
        struct srnf_mesh sphere = meshes_sphere(4), mesh;
        bool drop[N] = {false};
        struct srnf_mesh_report report;
        unsigned face, from, to;
        size_t lowest = SIZE_MAX;

        drop[gone] = true;
        mesh = meshes_without_faces(&sphere, drop);
        for (size_t f = 0; f < mesh.n_faces && lowest == SIZE_MAX; f++) {
            size_t shared = 0;

            for (size_t c = 0; c < 9; c++) {
                shared += mesh.faces[3 * f + c / 3] == sphere.faces[3 * gone + c % 3];
            }
            lowest = shared == 2 ? f : SIZE_MAX;
        }
        report = prepare(&mesh, false);
        assert_int_equal(report.problems[0].first, lowest);
        assert_int_equal(
            sscanf(report.problems[0].detail,
                   "3 boundary edges; the first belongs to face %u, between vertices %u and %u",
                   &face, &from, &to),
            3);
        assert_int_equal(face, lowest);
        for (size_t c = 0, found = 0; c < 3; c++) {
            found += sphere.faces[3 * gone + c] == from || sphere.faces[3 * gone + c] == to;
            assert_true(c < 2 || found == 2);
        }
        srnf_mesh_clear(&mesh);
        srnf_mesh_clear(&sphere);
    }
}

static void test_degenerate_faces(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(3);
    struct srnf_mesh_report report;
    (void)state;

    /* A face that was collapsed onto an edge: its neighbours meet there, so that nothing else is
       wrong. */
    mesh.faces[3 * 100] = mesh.faces[3 * 99];
    mesh.faces[3 * 100 + 1] = mesh.faces[3 * 99];
    mesh.faces[3 * 100 + 2] = mesh.faces[3 * 99 + 1];
    report = prepare(&mesh, false);
    assert_int_equal(find_problem(&report, SRNF_EDEGENERATE)->count, 1);
    assert_int_equal(find_problem(&report, SRNF_EDEGENERATE)->first, 100);
    assert_int_equal(find_problem(&report, SRNF_ENOT_CLOSED)->count, 3);
    for (size_t c = 0; c < 3 * mesh.n_faces; c++) {
        mesh.faces[c] = (uint32_t)(c / 3 % 5);
    }
    report = prepare(&mesh, false);
    assert_int_equal(report.n_problems, 1);
    assert_int_equal(report.problems[0].status, SRNF_EDEGENERATE);
    assert_int_equal(report.problems[0].count, mesh.n_faces);
    assert_false(report.closed);
    srnf_mesh_clear(&mesh);
}

static void test_extent(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(2);
    struct srnf_mesh_report report;
    (void)state;

    meshes_stretch(&mesh, 1, 0, 0);
    report = prepare(&mesh, false);
    assert_int_equal(report.problems[0].status, SRNF_EDEGENERATE);
    assert_non_null(strstr(report.problems[0].detail, "no area"));
    meshes_scale(&mesh, 0);
    report = prepare(&mesh, false);
    assert_int_equal(report.n_problems, 1);
    assert_true(report.area == 0.0 && report.volume == 0.0 && report.bounding_box_diagonal == 0.0);
    mesh.vertices[4] = 1e300;
    report = prepare(&mesh, false);
    assert_non_null(strstr(report.problems[0].detail, "beyond"));
    assert_true(isfinite(report.area) && isfinite(report.volume) &&
                isfinite(report.bounding_box_diagonal));
    srnf_mesh_clear(&mesh);

    mesh = meshes_blank(0, 0);
    report = prepare(&mesh, true);
    assert_int_equal(report.n_problems, 1);
    assert_int_equal(report.problems[0].status, SRNF_EDEGENERATE);
    srnf_mesh_clear(&mesh);
}

static void test_inside_out(void **state)
{
    struct srnf_mesh mesh = meshes_star(6), right = meshes_star(6);
    struct srnf_mesh_report report, expected = prepare(&right, false);
    (void)state;

    meshes_flip(&mesh);
    report = prepare(&mesh, false);
    assert_sound(&report);
    assert_int_equal(report.repairs.faces_flipped, mesh.n_faces);
    assert_true(fabs(report.volume / expected.volume - 1.0) < 1e-14);
    report = prepare(&mesh, false); /* it is right now */
    assert_int_equal(report.repairs.faces_flipped, 0);
    assert_sound(&report);
    srnf_mesh_clear(&right);

    /* A mesh that has no inside is left as it is. */
    right = meshes_sphere_with_hole(3);
    meshes_flip(&right);
    report = prepare(&right, false);
    assert_int_equal(report.repairs.faces_flipped, 0);
    srnf_mesh_clear(&right);
    srnf_mesh_clear(&mesh);
}

/* A soup is merged back into the mesh it came from: every corner is where it was, and the mesh is
   closed. */
/* Coordinates rounded to floats far from the origin. */
static void test_coarseness(void **state)
{
    struct srnf_mesh_report report;
    double before = 0.0;
    (void)state;

    for (double shift = 1.0; shift < 1e9; shift *= 100.0) {
        struct srnf_mesh mesh = meshes_sphere(8), single;
        double edge = 0.15; /* about, of the unit sphere */

        meshes_move(&mesh, shift, 0, 0);
        single = meshes_copy(&mesh);
        for (size_t i = 0; i < 3 * single.n_vertices; i++) {
            single.vertices[i] = (double)(float)single.vertices[i];
        }
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        assert_true(report.coarseness < 1e-5);
        assert_int_equal(srnf_mesh_prepare(&single, false, &report), SRNF_OK);
        assert_true(report.coarseness > 20.0 * before);
        if (shift < 1e7) {
            assert_true(report.coarseness > 2e-8 * shift / edge);
            assert_true(report.coarseness < 5e-7 * (shift + 1.0) / edge);
        }
        before = report.coarseness;
        srnf_mesh_clear(&single);
        srnf_mesh_clear(&mesh);
    }
}

static void test_merge(void **state)
{
    struct srnf_mesh mesh = meshes_bumpy(8, 11), soup = meshes_soup(&mesh);
    struct srnf_mesh_report report;
    (void)state;

    for (size_t i = 0; i < 3 * soup.n_vertices; i += 2) { /* -0 is the same place as 0 */
        soup.vertices[i] = soup.vertices[i] == 0.0 ? -0.0 : soup.vertices[i];
    }
    report = prepare(&soup, false);
    assert_int_equal(report.components, soup.n_faces);
    assert_int_equal(find_problem(&report, SRNF_ENOT_CLOSED)->count, 3 * soup.n_faces);
    report = prepare(&soup, true);
    assert_sound(&report);
    assert_int_equal(soup.n_vertices, mesh.n_vertices);
    assert_int_equal(report.repairs.duplicate_vertices_merged, 3 * mesh.n_faces - mesh.n_vertices);
    for (size_t c = 0; c < 3 * mesh.n_faces; c++) {
        for (size_t k = 0; k < 3; k++) {
            assert_true(soup.vertices[3 * soup.faces[c] + k] ==
                        mesh.vertices[3 * mesh.faces[c] + k]);
        }
    }
    srnf_mesh_clear(&soup);
    srnf_mesh_clear(&mesh);
}

static void test_drop_unreferenced(void **state)
{
    struct srnf_mesh sphere = meshes_sphere(4), two = meshes_join(&sphere, &sphere);
    struct srnf_mesh_report report;
    (void)state;

    two.n_faces = sphere.n_faces;
    for (size_t c = 0; c < 3 * two.n_faces;
         c++) { /* every other vertex of the first copy is not used */
        two.faces[c] += two.faces[c] % 2 == 0 ? (uint32_t)sphere.n_vertices : 0;
    }
    report = prepare(&two, false);
    assert_sound(&report);
    assert_int_equal(report.repairs.unreferenced_vertices_dropped, sphere.n_vertices);
    assert_int_equal(two.n_vertices, sphere.n_vertices);
    for (size_t c = 0; c < 3 * sphere.n_faces; c++) {
        assert_memory_equal(two.vertices + 3 * two.faces[c], sphere.vertices + 3 * sphere.faces[c],
                            3 * sizeof(double));
    }
    srnf_mesh_clear(&two);
    srnf_mesh_clear(&sphere);
}

/* Topology does not depend on how vertices and faces are numbered. */
static void test_renumbering(void **state)
{
    struct srnf_mesh (*makers[])(void) = {meshes_bowtie, meshes_shared_edge, meshes_fin,
                                          meshes_projective_plane, meshes_flat};
    struct test_random random = test_random_seed(77);
    (void)state;

    for (size_t i = 0; i < 5 * 20; i++) {
        struct srnf_mesh mesh = makers[i % 5](), mixed = meshes_copy(&mesh);
        struct srnf_mesh_report expected = prepare(&mesh, false), report;
        uint32_t name[8];

        for (size_t v = 0; v < mesh.n_vertices; v++) {
            size_t other = test_random_below(&random, v + 1);

            name[v] = name[other];
            name[other] = (uint32_t)v;
        }
        for (size_t v = 0; v < mesh.n_vertices; v++) {
            memcpy(mixed.vertices + 3 * name[v], mesh.vertices + 3 * v, 3 * sizeof(double));
        }
        for (size_t c = 0; c < 3 * mesh.n_faces;
             c++) { /* faces backwards, each turned by one corner */
            mixed.faces[c] = name[mesh.faces[3 * (mesh.n_faces - 1 - c / 3) + (c + 1) % 3]];
        }
        report = prepare(&mixed, false);
        assert_int_equal(report.closed, expected.closed);
        assert_int_equal(report.edge_manifold, expected.edge_manifold);
        assert_int_equal(report.vertex_manifold, expected.vertex_manifold);
        assert_int_equal(report.oriented, expected.oriented);
        assert_int_equal(report.components, expected.components);
        assert_int_equal(report.euler_characteristic, expected.euler_characteristic);
        assert_int_equal(report.n_problems, expected.n_problems);
        for (size_t p = 0; p < report.n_problems; p++) {
            assert_int_equal(report.problems[p].status, expected.problems[p].status);
            assert_int_equal(report.problems[p].count, expected.problems[p].count);
        }
        srnf_mesh_clear(&mixed);
        srnf_mesh_clear(&mesh);
    }
}

/* Sizes whose squared areas would leave the range of a double are refused by name, the others are
   not. */
static void test_size(void **state)
{
    const double scales[] = {1e-120, 1e-95, 1e-31, 1e31, 1e80, 1e99};
    const double fine[] = {1e-29, 1e29};
    (void)state;

    for (size_t i = 0; i < 6; i++) {
        struct srnf_mesh mesh = meshes_sphere(5);
        struct srnf_mesh_report report;

        meshes_scale(&mesh, scales[i]);
        report = prepare(&mesh, false);
        assert_int_equal(report.n_problems, 1);
        assert_int_equal(report.problems[0].status, SRNF_EDEGENERATE);
        assert_non_null(strstr(report.problems[0].detail, "diagonal"));
        srnf_mesh_clear(&mesh);
    }
    for (size_t i = 0; i < 2; i++) {
        struct srnf_mesh mesh = meshes_sphere(5);
        struct srnf_mesh_report report;

        meshes_scale(&mesh, fine[i]);
        report = prepare(&mesh, false);
        assert_sound(&report);
        srnf_mesh_clear(&mesh);
    }
}

static void test_invalid(void **state)
{
    struct srnf_mesh mesh = meshes_tetrahedron();
    struct srnf_mesh_report report;
    (void)state;

    mesh.faces[5] = 4;
    assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_EINVAL);
    mesh.faces[5] = 3;
    mesh.vertices[2] = NAN;
    assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_EINVAL);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sound_shapes),
        cmocka_unit_test(test_measures),
        cmocka_unit_test(test_faults),
        cmocka_unit_test(test_several_faults_in_order),
        cmocka_unit_test(test_one_sided),
        cmocka_unit_test(test_hole_is_placed),
        cmocka_unit_test(test_degenerate_faces),
        cmocka_unit_test(test_extent),
        cmocka_unit_test(test_inside_out),
        cmocka_unit_test(test_coarseness),
        cmocka_unit_test(test_merge),
        cmocka_unit_test(test_drop_unreferenced),
        cmocka_unit_test(test_renumbering),
        cmocka_unit_test(test_size),
        cmocka_unit_test(test_invalid),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
