/*
 * test_weld.c - points that a file gives several vertices: joined where that makes one closed
 * surface, with the faces that vanish by it dropped and counted, and kept apart where the surface
 * touches itself, so that joining never makes a sound mesh unsound.
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

#include "support/meshes.h"

static struct srnf_mesh_report prepare(struct srnf_mesh *mesh, bool weld)
{
    struct srnf_mesh_report report;

    assert_int_equal(srnf_mesh_prepare(mesh, weld, &report), SRNF_OK);
    return report;
}

static void assert_sound(const struct srnf_mesh_report *report)
{
    if (report->n_problems > 0) {
        fail_msg("%s", report->problems[0].detail);
    }
    assert_int_equal(report->euler_characteristic, 2);
    assert_true(report->volume > 0.0);
}

static void assert_repairs(const struct srnf_mesh_report *report, size_t merged, size_t collapsed,
                           size_t duplicate, size_t folded, size_t touching)
{
    assert_int_equal(report->repairs.duplicate_vertices_merged, merged);
    assert_int_equal(report->repairs.collapsed_faces_dropped, collapsed);
    assert_int_equal(report->repairs.duplicate_faces_dropped, duplicate);
    assert_int_equal(report->repairs.folded_faces_dropped, folded);
    assert_int_equal(report->repairs.touching_vertices_kept_apart, touching);
}

static void put(struct srnf_mesh *mesh, size_t vertex, const double at[3])
{
    memcpy(mesh->vertices + 3 * vertex, at, 3 * sizeof *at);
}

static void lay_on(struct srnf_mesh *mesh, size_t vertex, size_t other)
{
    const double *p = mesh->vertices + 3 * other;

    put(mesh, vertex, (const double[3]){p[0], p[1], p[2]});
}

/* The vertex farthest from the first one, and a neighbour of a vertex. */
static size_t farthest(const struct srnf_mesh *mesh)
{
    size_t best = 0;
    double most = 0.0;

    for (size_t i = 1; i < mesh->n_vertices; i++) {
        double d = 0.0;

        for (size_t k = 0; k < 3; k++) {
            d += pow(mesh->vertices[3 * i + k] - mesh->vertices[k], 2.0);
        }
        if (d > most) {
            best = i;
            most = d;
        }
    }
    return best;
}

static size_t neighbour(const struct srnf_mesh *mesh, size_t vertex)
{
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        if (mesh->faces[c] == vertex) {
            return mesh->faces[c % 3 == 2 ? c - 2 : c + 1];
        }
    }
    fail();
    return 0;
}

/* Adds a triangle of new vertices at three points. */
static void add_loose_face(struct srnf_mesh *mesh, const double a[3], const double b[3],
                           const double c[3])
{
    struct srnf_mesh face = meshes_blank(3, 1), joined;

    put(&face, 0, a);
    put(&face, 1, b);
    put(&face, 2, c);
    for (uint32_t k = 0; k < 3; k++) {
        face.faces[k] = k;
    }
    joined = meshes_join(mesh, &face);
    srnf_mesh_clear(&face);
    srnf_mesh_clear(mesh);
    *mesh = joined;
}

/* As marching cubes does where a voxel has the level: every vertex on one of a coarse grid that is
   so near that faces collapse, and nothing else. */
static void collapsed_faces_go(void **state)
{
    struct srnf_mesh mesh = meshes_bumpy(8, 5), plain = meshes_copy(&mesh);
    struct srnf_mesh_report report, before;
    size_t faces = mesh.n_faces, vertices = mesh.n_vertices, moved = 0;
    bool *taken = calloc(vertices, sizeof *taken);
    (void)state;

    assert_non_null(taken);
    for (size_t f = 0; f < faces; f += 7) {
        const uint32_t *v = mesh.faces + 3 * f;
        bool free_ring = true;

        /* No two of the edges that shrink lie near each other. */
        for (size_t g = 0; g < faces && free_ring; g++) {
            const uint32_t *w = mesh.faces + 3 * g;

            for (size_t k = 0; k < 9 && free_ring; k++) {
                if (w[k % 3] == v[k / 3]) {
                    free_ring = !taken[w[0]] && !taken[w[1]] && !taken[w[2]];
                }
            }
        }
        if (free_ring) {
            lay_on(&mesh, v[1], v[0]);
            taken[v[0]] = taken[v[1]] = taken[v[2]] = true;
            moved++;
        }
    }
    free(taken);
    assert_true(moved > 10);
    srnf_mesh_clear(&plain);
    plain = meshes_copy(&mesh);
    before = prepare(&plain, false);
    report = prepare(&mesh, true);
    assert_sound(&report);
    assert_repairs(&report, moved, 2 * moved, 0, 0, 0);
    assert_int_equal(mesh.n_vertices, vertices - moved);
    assert_int_equal(mesh.n_faces, faces - 2 * moved);
    assert_true(fabs(report.volume / before.volume - 1.0) < 1e-13);
    assert_true(fabs(report.area / before.area - 1.0) < 1e-13);
    srnf_mesh_clear(&plain);
    srnf_mesh_clear(&mesh);
}

/* A crease: the vertices along it have a copy for either side. */
static void split_creases_close(void **state)
{
    struct srnf_mesh mesh = meshes_star(8), two = meshes_join(&mesh, &mesh);
    struct srnf_mesh_report report, expected = prepare(&mesh, false);
    (void)state;

    two.n_faces = mesh.n_faces;
    for (size_t f = 0; f < two.n_faces; f++) {
        double middle = 0.0;

        for (size_t k = 0; k < 3; k++) {
            middle += mesh.vertices[3 * mesh.faces[3 * f + k] + 2];
        }
        for (size_t k = 0; k < 3 && middle > 0.0; k++) {
            two.faces[3 * f + k] += (uint32_t)mesh.n_vertices;
        }
    }
    report = prepare(&two, true);
    assert_sound(&report);
    assert_true(report.repairs.duplicate_vertices_merged > 0);
    assert_int_equal(two.n_vertices, mesh.n_vertices);
    assert_true(fabs(report.volume / expected.volume - 1.0) < 1e-13);
    srnf_mesh_clear(&two);
    srnf_mesh_clear(&mesh);
}

static void twice_is_once(void **state)
{
    struct srnf_mesh mesh = meshes_star(5), two = meshes_join(&mesh, &mesh);
    struct srnf_mesh three = meshes_join(&two, &mesh);
    struct srnf_mesh_report report = prepare(&three, true);
    (void)state;

    assert_sound(&report);
    assert_repairs(&report, 2 * mesh.n_vertices, 0, 2 * mesh.n_faces, 0, 0);
    srnf_mesh_clear(&three);

    /* With its own inside as well nothing would be left: two surfaces then. */
    meshes_flip(&mesh);
    three = meshes_join(&two, &mesh);
    srnf_mesh_clear(&two);
    two = meshes_copy(&three);
    two.n_faces = 2 * mesh.n_faces;
    memmove(two.faces, three.faces + 3 * mesh.n_faces, 6 * mesh.n_faces * sizeof *two.faces);
    report = prepare(&two, true);
    assert_int_equal(report.problems[0].status, SRNF_ECOMPONENTS);
    assert_non_null(strstr(report.problems[0].detail, "alone"));
    srnf_mesh_clear(&three);
    srnf_mesh_clear(&two);
    srnf_mesh_clear(&mesh);
}

static void folded_flap_goes(void **state)
{
    const double tip[3] = {2.0, 0.5, 0.3};
    struct srnf_mesh mesh = meshes_sphere(4);
    struct srnf_mesh_report report, expected = prepare(&mesh, false);
    double a[3], b[3];
    size_t faces = mesh.n_faces;
    (void)state;

    memcpy(a, mesh.vertices + 3 * (size_t)mesh.faces[0], sizeof a);
    memcpy(b, mesh.vertices + 3 * (size_t)mesh.faces[1], sizeof b);
    add_loose_face(&mesh, a, b, tip);
    add_loose_face(&mesh, b, a, tip);
    report = prepare(&mesh, true);
    assert_sound(&report);
    assert_repairs(&report, 5, 0, 0, 2, 0);
    assert_int_equal(mesh.n_faces, faces);
    assert_true(report.volume == expected.volume);

    /* One side of it alone is no flap, and is named. */
    add_loose_face(&mesh, a, b, tip);
    report = prepare(&mesh, true);
    assert_int_equal(report.problems[0].status, SRNF_ENOT_CLOSED);
    assert_int_equal(report.problems[1].status, SRNF_ENOT_MANIFOLD);
    assert_non_null(strstr(report.problems[1].detail, "remove inner walls"));
    srnf_mesh_clear(&mesh);
}

/* Faces that the file repeats in reverse, one here, patches there: the surface stays whole. */
static void reversed_repeats_go(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(6), twice = meshes_join(&mesh, &mesh);
    struct srnf_mesh_report report, expected = prepare(&mesh, false);
    (void)state;

    for (size_t every = 1; every < 40; every += 3) {
        size_t n = mesh.n_faces, repeated = 0;
        struct srnf_mesh some = meshes_copy(&twice);

        some.n_faces = n;
        for (size_t f = 0; f < n; f++) {
            if (f % every == 0 || (f > n / 2 && f < n / 2 + 9 * every && every > 1)) {
                uint32_t *face = some.faces + 3 * some.n_faces++;

                memcpy(face, mesh.faces + 3 * f, 3 * sizeof *face);
                face[1] = mesh.faces[3 * f + 2];
                face[2] = mesh.faces[3 * f + 1];
                repeated++;
            }
        }
        report = prepare(&some, true);
        if (every == 1) {
            /* All of it twice over, inside out: nothing says which is the surface. */
            assert_true(report.n_problems > 0);
        } else {
            assert_sound(&report);
            assert_int_equal(report.repairs.folded_faces_dropped, repeated);
            assert_int_equal(some.n_faces, n);
            assert_true(fabs(report.volume - expected.volume) < 1e-12);
        }
        srnf_mesh_clear(&some);
    }
    srnf_mesh_clear(&twice);
    srnf_mesh_clear(&mesh);
}

static void wall_between_solids_goes(void **state)
{
    struct srnf_mesh one = meshes_tetrahedron(), other = meshes_tetrahedron(), both;
    struct srnf_mesh_report report;
    (void)state;

    meshes_stretch(&other, -1, 1, 1);
    meshes_flip(&other);
    both = meshes_join(&one, &other);
    report = prepare(&both, true);
    assert_sound(&report);
    assert_repairs(&report, 3, 0, 0, 2, 0);
    assert_true(fabs(report.volume - 1.0 / 3.0) < 1e-15);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&other);
    srnf_mesh_clear(&one);
}

/* A sphere that touches itself in a point, or along an edge, stays the sphere that it is; also when
   it comes as a soup, in the first case. */
static void touching_stays_apart(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(5), soup;
    struct srnf_mesh_report report;
    size_t vertices = mesh.n_vertices, faces = mesh.n_faces, far = farthest(&mesh);
    size_t here = neighbour(&mesh, 0), there = neighbour(&mesh, far);
    (void)state;

    lay_on(&mesh, far, 0);
    soup = meshes_soup(&mesh);
    report = prepare(&mesh, true);
    assert_sound(&report);
    assert_repairs(&report, 0, 0, 0, 0, 1);
    assert_true(mesh.n_vertices == vertices && mesh.n_faces == faces);
    report = prepare(&soup, true);
    assert_sound(&report);
    assert_repairs(&report, 3 * faces - vertices, 0, 0, 0, 1);
    assert_true(soup.n_vertices == vertices && soup.n_faces == faces);
    srnf_mesh_clear(&soup);
    srnf_mesh_clear(&mesh);

    mesh = meshes_sphere(5);
    lay_on(&mesh, far, 0);
    lay_on(&mesh, there, here);
    soup = meshes_soup(&mesh);
    report = prepare(&mesh, true);
    assert_sound(&report);
    assert_repairs(&report, 0, 0, 0, 0, 2);
    report = prepare(&soup, true); /* which faces belong together nothing tells */
    assert_int_equal(report.problems[0].status, SRNF_ENOT_MANIFOLD);
    srnf_mesh_clear(&soup);
    srnf_mesh_clear(&mesh);
}

/* A neck of no width: joining its ring would make two spheres of one. */
static void closed_neck_stays_open(void **state)
{
    struct srnf_mesh mesh = meshes_capsule(4, 1, 8, 6);
    struct srnf_mesh_report report;
    size_t ring = 0;
    double nearest = 9.0;
    (void)state;

    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double x = fabs(mesh.vertices[3 * i] - 0.5);

        nearest = x < fabs(nearest - 0.5) ? mesh.vertices[3 * i] : nearest;
    }
    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double *p = mesh.vertices + 3 * i;

        if (fabs(p[0] - nearest) < 1e-9) {
            p[1] = p[2] = 0.0;
            p[0] = nearest;
            ring++;
        }
    }
    assert_int_equal(ring, 6);
    report = prepare(&mesh, true);
    assert_sound(&report);
    assert_repairs(&report, 0, 0, 0, 0, 5);
    srnf_mesh_clear(&mesh);
}

/* Two solids that touch are two, however they touch. */
static void touching_solids_are_two(void **state)
{
    struct srnf_mesh one = meshes_tetrahedron(), other = meshes_tetrahedron(), both;
    struct srnf_mesh_report report;
    (void)state;

    meshes_stretch(&other, -1, -1, -1);
    meshes_flip(&other);
    both = meshes_join(&one, &other);
    report = prepare(&both, true);
    assert_int_equal(report.n_problems, 1);
    assert_int_equal(report.problems[0].status, SRNF_ECOMPONENTS);
    assert_int_equal(report.problems[0].count, 2);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&other);
    srnf_mesh_clear(&one);
}

/* What marching cubes leaves of a single voxel at the level: a closed surface of no size. */
static void specks_go(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(3), speck = meshes_tetrahedron(), both;
    struct srnf_mesh_report report;
    (void)state;

    meshes_scale(&speck, 0.0);
    meshes_move(&speck, 3, 4, 5);
    both = meshes_join(&speck, &mesh);
    report = prepare(&both, true);
    assert_sound(&report);
    assert_repairs(&report, 3, 4, 0, 0, 0);
    assert_int_equal(both.n_vertices, mesh.n_vertices);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&speck);
    srnf_mesh_clear(&mesh);
}

/* A problem names faces and vertices by their numbers in the file, not by those that are left after
   the repairs: here a speck of three points and four faces, and a vertex that no face names, come
   before a sphere that misses its last face. */
static void problems_name_the_file(void **state)
{
    struct srnf_mesh sphere = meshes_sphere(3), speck = meshes_tetrahedron(), lone, both, all;
    struct srnf_mesh_report report;
    const uint32_t *missing = sphere.faces + 3 * (sphere.n_faces - 1);
    const char *detail;
    char place[64];
    bool named = false;
    uint32_t across = 0;
    (void)state;

    sphere.n_faces--;
    for (uint32_t f = 0; f < sphere.n_faces && across == 0; f++) { /* the lowest along the hole */
        for (size_t k = 0; k < 9; k++) {
            const uint32_t *v = sphere.faces + 3 * (size_t)f;

            if (v[k % 3] == missing[(k / 3 + 1) % 3] && v[(k % 3 + 1) % 3] == missing[k / 3]) {
                across = f;
            }
        }
    }
    assert_true(across > 0);
    meshes_scale(&speck, 0.0);
    meshes_move(&speck, 3, 4, 5);
    lone = meshes_blank(1, 0);
    both = meshes_join(&speck, &lone);
    all = meshes_join(&both, &sphere);
    report = prepare(&all, true);
    assert_int_equal(report.repairs.collapsed_faces_dropped, 4);
    assert_int_equal(report.n_problems, 1);
    assert_int_equal(report.problems[0].status, SRNF_ENOT_CLOSED);
    assert_int_equal(report.problems[0].count, 3);
    assert_int_equal(report.problems[0].first, across + 4);
    detail = report.problems[0].detail;
    (void)snprintf(place, sizeof place, "face %u,", across + 4);
    assert_non_null(strstr(detail, place));
    for (size_t k = 0; k < 3; k++) {
        (void)snprintf(place, sizeof place, "between vertices %u and %u;", missing[(k + 1) % 3] + 5,
                       missing[k] + 5);
        named = named || strstr(detail, place);
    }
    if (!named) {
        fail_msg("%s", detail);
    }
    srnf_mesh_clear(&all);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&lone);
    srnf_mesh_clear(&speck);
    srnf_mesh_clear(&sphere);
}

/* Of several components, the first face of another one is the file's. */
static void components_name_the_file(void **state)
{
    struct srnf_mesh one = meshes_sphere(2), other = meshes_sphere(2), both, speck, all;
    struct srnf_mesh_report report;
    (void)state;

    meshes_move(&other, 9, 0, 0);
    speck = meshes_tetrahedron();
    meshes_scale(&speck, 0.0);
    both = meshes_join(&speck, &one);
    all = meshes_join(&both, &other);
    report = prepare(&all, true);
    assert_int_equal(report.n_problems, 1);
    assert_int_equal(report.problems[0].status, SRNF_ECOMPONENTS);
    assert_int_equal(report.problems[0].first, speck.n_faces + one.n_faces);
    assert_non_null(strstr(report.problems[0].detail, "that of face 4;"));
    srnf_mesh_clear(&all);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&speck);
    srnf_mesh_clear(&other);
    srnf_mesh_clear(&one);
}

/* Sound meshes whose points are all different come out as they went in. */
static void distinct_points_stay(void **state)
{
    struct srnf_mesh mesh = meshes_bent_capsule(9, 1, 4, 30, 9), copy = meshes_copy(&mesh);
    struct srnf_mesh_report report;
    (void)state;

    for (size_t i = 0; i < 3 * mesh.n_vertices; i++) { /* the next numbers are not the same */
        mesh.vertices[i] = nextafter(mesh.vertices[i], 9.0);
    }
    memcpy(copy.vertices, mesh.vertices, 3 * mesh.n_vertices * sizeof *mesh.vertices);
    report = prepare(&mesh, true);
    assert_sound(&report);
    assert_repairs(&report, 0, 0, 0, 0, 0);
    assert_int_equal(mesh.n_vertices, copy.n_vertices);
    assert_memory_equal(mesh.vertices, copy.vertices, 3 * copy.n_vertices * sizeof(double));
    assert_memory_equal(mesh.faces, copy.faces, 3 * copy.n_faces * sizeof(uint32_t));
    srnf_mesh_clear(&copy);
    srnf_mesh_clear(&mesh);
}

/* ---- A mesh and its sphere ------------------------------------------------------------------- */

/* Every vertex of the sphere is the one that came with the vertex of the mesh: both are given the
   same number as their first coordinate. */
static void sphere_follows(void **state)
{
    struct srnf_mesh made = meshes_star(5), mesh = meshes_soup(&made), sphere = meshes_copy(&mesh);
    struct srnf_mesh_report report;
    (void)state;

    for (size_t i = 0; i < sphere.n_vertices; i++) {
        double *p = sphere.vertices + 3 * i;

        p[1] = mesh.vertices[3 * i + 2] + 1.0;
        p[2] = (double)i; /* nothing in the sphere is equal */
    }
    assert_int_equal(srnf_mesh_prepare_pair(&mesh, &sphere, &report), SRNF_OK);
    assert_sound(&report);
    assert_int_equal(sphere.n_vertices, made.n_vertices);
    assert_int_equal(sphere.n_faces, mesh.n_faces);
    assert_memory_equal(sphere.faces, mesh.faces, 3 * mesh.n_faces * sizeof *mesh.faces);
    for (size_t i = 0; i < mesh.n_vertices; i++) {
        assert_true(sphere.vertices[3 * i] == mesh.vertices[3 * i]);
        assert_true(sphere.vertices[3 * i + 1] == mesh.vertices[3 * i + 2] + 1.0);
    }
    srnf_mesh_clear(&sphere);
    srnf_mesh_clear(&mesh);

    /* A mesh that can be encoded as it is keeps all its vertices: the sphere has a place for each.
     */
    mesh = meshes_copy(&made);
    sphere = meshes_copy(&made);
    lay_on(&mesh, mesh.faces[0], mesh.faces[1]);
    assert_int_equal(srnf_mesh_prepare_pair(&mesh, &sphere, &report), SRNF_OK);
    assert_sound(&report);
    assert_repairs(&report, 0, 0, 0, 0, 0);
    assert_int_equal(mesh.n_vertices, made.n_vertices);
    assert_memory_equal(sphere.vertices, made.vertices, 3 * made.n_vertices * sizeof(double));
    srnf_mesh_clear(&sphere);
    srnf_mesh_clear(&mesh);
    srnf_mesh_clear(&made);
}

/* What does not correspond is prepared one by one. */
static void strangers_are_prepared_alone(void **state)
{
    struct srnf_mesh mesh = meshes_star(5), sphere = meshes_sphere(5);
    struct srnf_mesh_report report;
    (void)state;

    meshes_flip(&sphere);
    assert_int_equal(srnf_mesh_prepare_pair(&mesh, &sphere, &report), SRNF_OK);
    assert_sound(&report);
    report = prepare(&sphere, true);
    assert_int_equal(report.repairs.faces_flipped, 0); /* it was turned before */
    sphere.faces[0] = 100000;
    assert_int_equal(srnf_mesh_prepare_pair(&mesh, &sphere, &report), SRNF_EINVAL);
    srnf_mesh_clear(&sphere);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(collapsed_faces_go),
        cmocka_unit_test(split_creases_close),
        cmocka_unit_test(twice_is_once),
        cmocka_unit_test(folded_flap_goes),
        cmocka_unit_test(reversed_repeats_go),
        cmocka_unit_test(wall_between_solids_goes),
        cmocka_unit_test(touching_stays_apart),
        cmocka_unit_test(closed_neck_stays_open),
        cmocka_unit_test(touching_solids_are_two),
        cmocka_unit_test(specks_go),
        cmocka_unit_test(problems_name_the_file),
        cmocka_unit_test(components_name_the_file),
        cmocka_unit_test(distinct_points_stay),
        cmocka_unit_test(sphere_follows),
        cmocka_unit_test(strangers_are_prepared_alone),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
