/*
 * test_index.c - the spatial index: no ray leaves a closed mesh unnoticed, not even through an edge
 * or a vertex; hits and distances agree with scanning every face and with closed formulas.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "mesh/index.h"
#include "support/compare.h"
#include "support/meshes.h"
#include "support/random.h"

static struct srnf_index *make_index(const struct srnf_mesh *mesh)
{
    struct srnf_index *index;

    assert_int_equal(srnf_index_create(&index, mesh), SRNF_OK);
    return index;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void subtract(const double a[3], const double b[3], double out[3])
{
    for (size_t k = 0; k < 3; k++) {
        out[k] = a[k] - b[k];
    }
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (size_t k = 0; k < 3; k++) {
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
}

static const double *corner(const struct srnf_mesh *mesh, size_t face, size_t k)
{
    return mesh->vertices + 3 * mesh->faces[3 * face + k];
}

/* Farthest hit by scanning all faces with Cramer's rule; *clear says that no face was hit or missed
   narrowly. */
static double scan_ray(const struct srnf_mesh *mesh, const double origin[3],
                       const double direction[3], bool *clear)
{
    double best = -1.0;

    *clear = true;
    for (size_t f = 0; f < mesh->n_faces; f++) {
        double ab[3], ac[3], from[3], p[3], q[3], determinant, u, v, t, margin;

        subtract(corner(mesh, f, 1), corner(mesh, f, 0), ab);
        subtract(corner(mesh, f, 2), corner(mesh, f, 0), ac);
        subtract(origin, corner(mesh, f, 0), from);
        cross(direction, ac, p);
        cross(from, ab, q);
        determinant = dot(ab, p);
        u = dot(from, p) / determinant;
        v = dot(direction, q) / determinant;
        t = dot(ac, q) / determinant;
        margin = compare_min(compare_min(u, v), compare_min(1.0 - u - v, t));
        *clear &= fabs(margin) > 1e-9;
        if (margin > 0.0) {
            best = compare_max(best, t);
        }
    }
    return best;
}

static void test_rays_against_scanning(void **state)
{
    struct srnf_mesh meshes[] = {meshes_bumpy(7, 1),           meshes_bent_capsule(9, 1, 4, 40, 12),
                                 meshes_torus(2, 0.7, 20, 12), meshes_two_spheres(5),
                                 meshes_box(1, 2, 3),          meshes_tetrahedron()};
    struct test_random random = test_random_seed(9);
    size_t compared = 0, hits = 0;
    (void)state;

    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
        struct srnf_index *index = make_index(&meshes[i]);

        for (size_t r = 0; r < 500; r++) {
            double origin[3], direction[3], t = -1.0, expected;
            uint32_t face = UINT32_MAX;
            bool clear, hit;

            test_random_direction(&random, direction);
            for (size_t k = 0; k < 3; k++) {
                origin[k] = test_random_uniform(&random, -2.0, 2.0);
                direction[k] *= 1.0 + (double)(r % 5); /* t counts in units of the direction */
            }
            expected = scan_ray(&meshes[i], origin, direction, &clear);
            hit = srnf_index_ray(index, origin, direction, &t, &face);
            if (clear) {
                compared++;
                hits += hit;
                assert_int_equal(hit, expected >= 0.0);
                assert_true(fabs(t - expected) < 1e-10);
                assert_true(!hit || face < meshes[i].n_faces);
            }
        }
        srnf_index_destroy(index);
        srnf_mesh_clear(&meshes[i]);
    }
    assert_true(compared > 2500 && hits > 500 && hits < compared - 500);
}

/* Rays from inside a closed mesh at its vertices, at points of its edges and at the middles of its
   faces. */
static void shoot_at_everything(const struct srnf_mesh *mesh, const double origin[3])
{
    struct srnf_index *index = make_index(mesh);
    struct test_random random = test_random_seed(3);

    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        const double *a = corner(mesh, c / 3, c % 3), *b = corner(mesh, c / 3, (c + 1) % 3);
        const double shares[] = {0.0, 0.5, 0.25, test_random_uniform(&random, 0.0, 1.0),
                                 test_random_uniform(&random, 0.0, 1.0)};

        for (size_t s = 0; s < sizeof shares / sizeof shares[0]; s++) {
            double direction[3], t = -1.0;

            for (size_t k = 0; k < 3; k++) {
                direction[k] = a[k] + shares[s] * (b[k] - a[k]) - origin[k];
            }
            assert_true(srnf_index_ray(index, origin, direction, &t, NULL));
            assert_true(t > 1.0 - 1e-9); /* the point aimed at, or one behind it */
        }
    }
    srnf_index_destroy(index);
}

static void test_watertight(void **state)
{
    const double scales[] = {1.0, 1e-9, 1e9, 1e-90, 1e90};
    const double origins[][3] = {{0, 0, 0}, {0.125, 0.25, -0.125}, {0.1, 0.03, 0.017}};
    (void)state;

    for (size_t i = 0; i < 5; i++) {
        for (size_t o = 0; o < 3; o++) {
            struct srnf_mesh meshes[] = {meshes_sphere(6), meshes_star(8), meshes_box(1, 1, 1),
                                         meshes_box(1, 2, 4), meshes_bumpy(6, o)};

            for (size_t m = 0; m < sizeof meshes / sizeof meshes[0]; m++) {
                double origin[3];

                for (size_t k = 0; k < 3; k++) {
                    origin[k] = scales[i] * origins[o][k];
                }
                meshes_scale(&meshes[m], scales[i]);
                shoot_at_everything(&meshes[m], origin);
                srnf_mesh_clear(&meshes[m]);
            }
        }
    }
}

/* The same in a needle of slivers, and far from the origin, where vertices have lost digits. */
static void test_watertight_slivers(void **state)
{
    const double stretches[] = {1e-4, 1e-8, 1e-12};
    const double center[3] = {0, 0, 0}, far_center[3] = {1e9, -2e9, 3e9};
    struct srnf_mesh far = meshes_sphere(8);
    (void)state;

    for (size_t i = 0; i < 3; i++) {
        struct srnf_mesh mesh = meshes_star(8);

        meshes_stretch(&mesh, stretches[i], 1, stretches[i]);
        shoot_at_everything(&mesh, center);
        srnf_mesh_clear(&mesh);
    }
    meshes_scale(&far, 1e4); /* where doubles are 5e-7 apart */
    meshes_move(&far, far_center[0], far_center[1], far_center[2]);
    shoot_at_everything(&far, far_center);
    srnf_mesh_clear(&far);
}

/* Is (0, 0) in the projection of the face along z, boundary included? Exact, for integer
   coordinates. */
static bool covers_origin(const struct srnf_mesh *mesh, size_t face)
{
    int positive = 0, negative = 0;

    for (size_t k = 0; k < 3; k++) {
        const double *a = corner(mesh, face, k), *b = corner(mesh, face, (k + 1) % 3);
        __int128 area = (__int128)a[0] * (__int128)b[1] - (__int128)a[1] * (__int128)b[0];

        positive += area > 0;
        negative += area < 0;
    }
    return (positive == 0) != (negative == 0);
}

/* A sphere drawn out to a ribbon 2^53 long and a few units wide, on integer coordinates, seen along
   z: every edge passes the ray within rounding. The index must decide as exact integer arithmetic
   does. */
static void test_signs_are_exact(void **state)
{
    struct test_random random = test_random_seed(17);
    size_t hits = 0, rays = 400;
    (void)state;

    for (size_t r = 0; r < rays; r++) {
        struct srnf_mesh mesh = meshes_sphere(3);
        struct srnf_index *index;
        const double origin[3] = {0, 0, -3000}, up[3] = {0, 0, 1};
        double angle = test_random_uniform(&random, 0.0, 6.28), lowest = INFINITY,
               highest = -INFINITY, t = -1;
        double along = test_random_uniform(&random, -0x1p51, 0x1p51);
        double across = test_random_uniform(&random, -1.0, 1.0);

        meshes_turn(&mesh, r);
        for (size_t i = 0; i < mesh.n_vertices; i++) {
            double *v = mesh.vertices + 3 * i, x = 0x1p52 * v[0] + along, y = v[1] + across;

            v[0] = rint(cos(angle) * x - sin(angle) * y);
            v[1] = rint(sin(angle) * x + cos(angle) * y);
            v[2] = rint(1000.0 * v[2]);
        }
        for (size_t f = 0; f < mesh.n_faces; f++) {
            for (size_t k = 0; k < 3 && covers_origin(&mesh, f); k++) {
                lowest = compare_min(lowest, corner(&mesh, f, k)[2]);
                highest = compare_max(highest, corner(&mesh, f, k)[2]);
            }
        }
        index = make_index(&mesh);
        assert_int_equal(srnf_index_ray(index, origin, up, &t, NULL), lowest < INFINITY);
        if (lowest < INFINITY) {
            hits++;
            assert_true(t >= 3000.0 + lowest && t <= 3000.0 + highest);
        }
        srnf_index_destroy(index);
        srnf_mesh_clear(&mesh);
    }
    assert_true(hits > rays / 5 && hits < rays);
}

/* Through the middle of a box along its axes and diagonals: t is known, and the farthest of two
   hits counts. */
static void test_box_rays(void **state)
{
    struct srnf_mesh box = meshes_box(2, 2, 2);
    struct srnf_index *index = make_index(&box);
    (void)state;

    for (int code = 0; code < 27; code++) {
        const double direction[3] = {code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1};
        const double before[3] = {-3 * direction[0], -3 * direction[1], -3 * direction[2]};
        const double after[3] = {3 * direction[0], 3 * direction[1], 3 * direction[2]};
        const double center[3] = {0, 0, 0};
        double t = 7.0;

        if (code == 13) { /* no direction at all */
            assert_false(srnf_index_ray(index, center, direction, &t, NULL));
            assert_true(t == 7.0);
            continue;
        }
        assert_true(srnf_index_ray(index, center, direction, &t, NULL) && t == 1.0);
        assert_true(srnf_index_ray(index, before, direction, &t, NULL) && t == 4.0);
        t = 7.0; /* and away from it */
        assert_false(srnf_index_ray(index, after, direction, &t, NULL));
        assert_true(t == 7.0);
    }
    srnf_index_destroy(index);
    srnf_mesh_clear(&box);
}

/* ---- Nearest points -------------------------------------------------------------------------- */

/* Squared distance to a segment, and to a triangle: the foot of the perpendicular if all three
   sides have it on their inner side, otherwise the sides. */
static double segment_distance2(const double p[3], const double a[3], const double b[3])
{
    double ab[3], ap[3], rest[3], share;

    subtract(b, a, ab);
    subtract(p, a, ap);
    share = compare_min(compare_max(dot(ap, ab) / compare_max(dot(ab, ab), 1e-300), 0.0), 1.0);
    for (size_t k = 0; k < 3; k++) {
        rest[k] = ap[k] - share * ab[k];
    }
    return dot(rest, rest);
}

static double triangle_distance2(const struct srnf_mesh *mesh, size_t f, const double p[3])
{
    double ab[3], ac[3], n[3], ap[3], best = INFINITY;
    bool inside = true;

    subtract(corner(mesh, f, 1), corner(mesh, f, 0), ab);
    subtract(corner(mesh, f, 2), corner(mesh, f, 0), ac);
    cross(ab, ac, n);
    for (size_t k = 0; k < 3; k++) {
        const double *from = corner(mesh, f, k), *to = corner(mesh, f, (k + 1) % 3);
        double side[3], inward[3];

        subtract(to, from, side);
        subtract(p, from, ap);
        cross(n, side, inward);
        inside &= dot(inward, ap) > 0.0;
        best = compare_min(best, segment_distance2(p, from, to));
    }
    return inside ? dot(ap, n) * dot(ap, n) / dot(n, n) : best;
}

static void test_distance_against_scanning(void **state)
{
    struct srnf_mesh meshes[] = {meshes_bumpy(7, 1), meshes_bent_capsule(9, 1, 4, 40, 12),
                                 meshes_two_spheres(5), meshes_tetrahedron(), meshes_fin()};
    struct test_random random = test_random_seed(21);
    (void)state;

    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
        struct srnf_index *index = make_index(&meshes[i]);

        for (size_t r = 0; r < 300; r++) {
            double point[3], nearest[3], difference[3], expected = INFINITY, distance2;
            uint32_t face = UINT32_MAX;

            for (size_t k = 0; k < 3; k++) {
                point[k] = test_random_uniform(&random, -4.0, 4.0);
            }
            for (size_t f = 0; f < meshes[i].n_faces; f++) {
                expected = compare_min(expected, triangle_distance2(&meshes[i], f, point));
            }
            distance2 = srnf_index_distance2(index, point, nearest, &face);
            assert_true(fabs(sqrt(distance2) - sqrt(expected)) < 1e-12);
            subtract(nearest, point, difference);
            assert_true(fabs(dot(difference, difference) - distance2) < 1e-12);
            assert_true(face < meshes[i].n_faces);
            assert_true(triangle_distance2(&meshes[i], face, nearest) < 1e-26);
            face = (uint32_t)(r % meshes[i].n_faces); /* from wherever the search begins */
            assert_true(fabs(sqrt(index_distance2_from(index, point, nearest, &face)) -
                             sqrt(expected)) < 1e-12);
            subtract(nearest, point, difference);
            assert_true(fabs(dot(difference, difference) - distance2) < 1e-12);
            assert_true(triangle_distance2(&meshes[i], face, nearest) < 1e-26);
        }
        srnf_index_destroy(index);
        srnf_mesh_clear(&meshes[i]);
    }
}

/* Against the formula for a box, at all scales; and on the surface the distance is zero. */
static void test_distance_to_box(void **state)
{
    const double scales[] = {1e-9, 1.0, 1e9};
    struct test_random random = test_random_seed(2);
    (void)state;

    for (size_t i = 0; i < 3; i++) {
        struct srnf_mesh box = meshes_box(1, 2, 3);
        struct srnf_index *index;

        meshes_scale(&box, scales[i]);
        index = make_index(&box);
        for (size_t r = 0; r < 1000; r++) {
            const double half[3] = {0.5, 1.0, 1.5};
            double point[3], outside = 0.0, inside = INFINITY, expected;

            for (size_t k = 0; k < 3; k++) {
                double x = test_random_uniform(&random, -2.0, 2.0), d = fabs(x) - half[k];

                point[k] = scales[i] * x;
                outside += d > 0.0 ? d * d : 0.0;
                inside = compare_min(inside, -d);
            }
            expected = outside > 0.0 ? sqrt(outside) : inside;
            assert_true(fabs(sqrt(srnf_index_distance2(index, point, NULL, NULL)) / scales[i] -
                             expected) < 1e-14);
        }
        for (size_t v = 0; v < box.n_vertices; v++) {
            assert_true(srnf_index_distance2(index, box.vertices + 3 * v, NULL, NULL) == 0.0);
        }
        srnf_index_destroy(index);
        srnf_mesh_clear(&box);
    }
}

/* ---- Awkward meshes -------------------------------------------------------------------------- */

/* Many copies on one spot, faces without area, all faces the same point: the tree stays balanced
   (its stack is bounded), and the answers are those of the mesh itself. */
static void test_crowded(void **state)
{
    struct srnf_mesh many = meshes_box(2, 2, 2), box = meshes_box(2, 2, 2),
                     dust = meshes_blank(3, 5000);
    struct srnf_index *index;
    const double origin[3] = {0.1, 0.2, 0.3}, direction[3] = {1, 0, 0};
    double t = 0.0;
    (void)state;

    for (size_t i = 0; i < 9; i++) {
        struct srnf_mesh twice = meshes_join(&many, &many);

        srnf_mesh_clear(&many);
        many = twice;
    }
    for (size_t f = 0; f < many.n_faces; f += 7) {
        many.faces[3 * f] = many.faces[3 * f + 1];
    }
    index = make_index(&many);
    assert_true(srnf_index_ray(index, origin, direction, &t, NULL));
    assert_true(fabs(t - 0.9) < 1e-15);
    assert_true(fabs(srnf_index_distance2(index, origin, NULL, NULL) - 0.49) < 1e-15);
    srnf_index_destroy(index);

    index = make_index(&dust); /* all at the origin */
    assert_false(srnf_index_ray(index, origin, direction, &t, NULL));
    assert_true(fabs(srnf_index_distance2(index, origin, NULL, NULL) - 0.14) < 1e-15);
    srnf_index_destroy(index);
    dust.n_faces = 0;
    assert_int_equal(srnf_index_create(&index, &dust), SRNF_EINVAL);
    assert_null(index);
    srnf_mesh_clear(&dust);
    srnf_mesh_clear(&box);
    srnf_mesh_clear(&many);
}

static void test_not_numbers(void **state)
{
    struct srnf_mesh box = meshes_box(2, 2, 2);
    struct srnf_index *index = make_index(&box);
    const double good[3] = {0.1, 0.2, 0.3}, bad[3] = {NAN, 0, 0}, endless[3] = {0, INFINITY, 0};
    double t = 7.0;
    (void)state;

    assert_false(srnf_index_ray(index, bad, good, &t, NULL));
    assert_false(srnf_index_ray(index, good, bad, &t, NULL));
    assert_false(srnf_index_ray(index, endless, good, &t, NULL));
    assert_false(srnf_index_ray(index, good, endless, &t, NULL));
    assert_true(t == 7.0);
    srnf_index_destroy(index);
    srnf_mesh_clear(&box);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rays_against_scanning),
        cmocka_unit_test(test_watertight),
        cmocka_unit_test(test_watertight_slivers),
        cmocka_unit_test(test_signs_are_exact),
        cmocka_unit_test(test_box_rays),
        cmocka_unit_test(test_distance_against_scanning),
        cmocka_unit_test(test_distance_to_box),
        cmocka_unit_test(test_crowded),
        cmocka_unit_test(test_not_numbers),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
