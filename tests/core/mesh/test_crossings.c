/*
 * test_crossings.c - faces that go through each other: none on sound meshes, those that a plain
 * search over all pairs finds on others, and none where meshes only touch.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "srnf.h"

/* Two meshes as one, the second one moved. */
static struct srnf_mesh both(const struct srnf_mesh *a, const struct srnf_mesh *b,
                             const double shift[3])
{
    struct srnf_mesh mesh = {.n_vertices = a->n_vertices + b->n_vertices,
                             .n_faces = a->n_faces + b->n_faces};

    mesh.vertices = srnf_alloc(mesh.n_vertices, 3 * sizeof(double));
    mesh.faces = srnf_alloc(mesh.n_faces, 3 * sizeof *mesh.faces);
    assert_non_null(mesh.vertices);
    assert_non_null(mesh.faces);
    memcpy(mesh.vertices, a->vertices, 3 * a->n_vertices * sizeof(double));
    memcpy(mesh.faces, a->faces, 3 * a->n_faces * sizeof *mesh.faces);
    for (size_t i = 0; i < 3 * b->n_vertices; i++) {
        mesh.vertices[3 * a->n_vertices + i] = b->vertices[i] + shift[i % 3];
    }
    for (size_t c = 0; c < 3 * b->n_faces; c++) {
        mesh.faces[3 * a->n_faces + c] = b->faces[c] + (uint32_t)a->n_vertices;
    }
    return mesh;
}

static struct srnf_mesh sphere(size_t frequency)
{
    struct srnf_mesh mesh;

    assert_int_equal(srnf_mesh_icosphere(frequency, &mesh), SRNF_OK);
    return mesh;
}

static struct srnf_mesh_crossings crossings_of(const struct srnf_mesh *mesh)
{
    struct srnf_mesh_crossings crossings;

    assert_int_equal(srnf_mesh_find_crossings(mesh, NULL, &crossings), SRNF_OK);
    return crossings;
}

/* Where the line from p to q meets the plane of a face, by Cramer's rule, strictly inside both. */
static bool meets(const struct srnf_mesh *mesh, const double *p, const double *q, size_t face)
{
    const double *a = mesh->vertices + 3 * (size_t)mesh->faces[3 * face];
    const double *b = mesh->vertices + 3 * (size_t)mesh->faces[3 * face + 1];
    const double *c = mesh->vertices + 3 * (size_t)mesh->faces[3 * face + 2];
    long double u[3], v[3], d[3], s[3], h[3], g[3], det, x, y, t;

    for (size_t k = 0; k < 3; k++) {
        u[k] = (long double)b[k] - a[k];
        v[k] = (long double)c[k] - a[k];
        d[k] = (long double)q[k] - p[k];
        s[k] = (long double)p[k] - a[k];
    }
    for (size_t k = 0; k < 3; k++) {
        h[k] = d[(k + 1) % 3] * v[(k + 2) % 3] - d[(k + 2) % 3] * v[(k + 1) % 3];
        g[k] = s[(k + 1) % 3] * u[(k + 2) % 3] - s[(k + 2) % 3] * u[(k + 1) % 3];
    }
    det = u[0] * h[0] + u[1] * h[1] + u[2] * h[2];
    x = (s[0] * h[0] + s[1] * h[1] + s[2] * h[2]) / det;
    y = (d[0] * g[0] + d[1] * g[1] + d[2] * g[2]) / det;
    t = (v[0] * g[0] + v[1] * g[1] + v[2] * g[2]) / det;
    return x > 1e-12L && y > 1e-12L && x + y < 1.0L - 1e-12L && t > 1e-12L && t < 1.0L - 1e-12L;
}

/* Whether an edge of f meets g. One that ends in a corner of g does so there and nowhere else. */
static bool edge_meets(const struct srnf_mesh *mesh, size_t f, size_t g)
{
    const uint32_t *w = mesh->faces + 3 * g;
    bool any = false;

    for (size_t k = 0; k < 3; k++) {
        uint32_t p = mesh->faces[3 * f + k], q = mesh->faces[3 * f + (k + 1) % 3];
        bool ends = false;

        for (size_t c = 0; c < 3; c++) {
            ends = ends || p == w[c] || q == w[c];
        }
        any = any || (!ends && meets(mesh, mesh->vertices + 3 * (size_t)p,
                                     mesh->vertices + 3 * (size_t)q, g));
    }
    return any;
}

static bool pair_meets(const struct srnf_mesh *mesh, size_t f, size_t g)
{
    return edge_meets(mesh, f, g) || edge_meets(mesh, g, f);
}

static size_t all_pairs(const struct srnf_mesh *mesh)
{
    size_t count = 0;

    for (size_t f = 0; f < mesh->n_faces; f++) {
        for (size_t g = f + 1; g < mesh->n_faces; g++) {
            count += pair_meets(mesh, f, g);
        }
    }
    return count;
}

static void sound_meshes_have_none(void **state)
{
    struct srnf_mesh mesh = sphere(20), none = {.n_faces = 0};
    (void)state;

    assert_int_equal(crossings_of(&mesh).pairs, 0);
    assert_int_equal(crossings_of(&none).pairs, 0);
    /* Bumps, thin parts, and coordinates far away. */
    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double *x = mesh.vertices + 3 * i, r = 1.0 + 0.5 * x[0] * x[1] * x[2];

        x[0] = 1000.0 + 20.0 * r * x[0];
        x[1] = r * x[1];
        x[2] = 1e-3 * r * x[2];
    }
    assert_int_equal(crossings_of(&mesh).pairs, 0);
    srnf_mesh_clear(&mesh);
}

static void two_spheres_cross_where_all_pairs_say(void **state)
{
    const double near[3] = {0.61, 0.233, -0.17}, far[3] = {2.5, 0.0, 0.0}, touch[3] = {2.0, 0, 0};
    struct srnf_mesh a = sphere(6), b = sphere(5), mesh = both(&a, &b, near);
    struct srnf_mesh_crossings crossings = crossings_of(&mesh);
    (void)state;

    printf("# %zu pairs of %zu faces\n", crossings.pairs, mesh.n_faces);
    assert_int_equal(crossings.pairs, all_pairs(&mesh));
    assert_true(crossings.pairs > 50);
    assert_true(crossings.faces[0] < a.n_faces && crossings.faces[1] >= a.n_faces);
    assert_true(pair_meets(&mesh, crossings.faces[0], crossings.faces[1]));
    assert_true(
        fabs(hypot(hypot(crossings.position[0], crossings.position[1]), crossings.position[2]) -
             1.0) < 0.3);
    srnf_mesh_clear(&mesh);
    mesh = both(&a, &a, far);
    assert_int_equal(crossings_of(&mesh).pairs, 0);
    srnf_mesh_clear(&mesh);
    mesh = both(&a, &a, touch);
    assert_int_equal(crossings_of(&mesh).pairs, 0);
    srnf_mesh_clear(&mesh);
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
}

/* One vertex pulled through the other side: its own faces share it, and neighbours corners. */
static void a_spike_crosses_the_side_that_it_leaves(void **state)
{
    struct srnf_mesh mesh = sphere(7);
    (void)state;

    for (size_t k = 0; k < 3; k++) {
        mesh.vertices[k] *= -1.7;
    }
    mesh.vertices[1] += 0.011;
    assert_true(crossings_of(&mesh).pairs > 0);
    assert_int_equal(crossings_of(&mesh).pairs, all_pairs(&mesh));
    srnf_mesh_clear(&mesh);
}

/* Faces with one corner in common cross by the edges opposite to it. */
static void faces_that_share_a_corner_can_cross(void **state)
{
    double vertices[] = {0, 0, 0, 2, 1, 0, 2, -1, 0, 1, 0, 1, 1.2, 0.1, -1};
    uint32_t faces[] = {0, 1, 2, 0, 3, 4};
    struct srnf_mesh mesh = {.n_vertices = 5, .n_faces = 2, .vertices = vertices, .faces = faces};
    (void)state;

    assert_int_equal(crossings_of(&mesh).pairs, 1);
    vertices[14] = 0.5; /* above, like the other end: only the corner is common */
    assert_int_equal(crossings_of(&mesh).pairs, 0);
    faces[3] = 1; /* a corner and an end in the plane */
    assert_int_equal(crossings_of(&mesh).pairs, 0);
}

static bool stop(void *user)
{
    (void)user;
    return true;
}

static void refusals(void **state)
{
    const struct srnf_context canceled = {.canceled = stop};
    struct srnf_mesh mesh = sphere(3);
    struct srnf_mesh_crossings crossings;
    (void)state;

    assert_int_equal(srnf_mesh_find_crossings(&mesh, &canceled, &crossings), SRNF_ECANCELED);
    mesh.faces[4] = (uint32_t)mesh.n_vertices;
    assert_int_equal(srnf_mesh_find_crossings(&mesh, NULL, &crossings), SRNF_EINVAL);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sound_meshes_have_none),
        cmocka_unit_test(two_spheres_cross_where_all_pairs_say),
        cmocka_unit_test(a_spike_crosses_the_side_that_it_leaves),
        cmocka_unit_test(faces_that_share_a_corner_can_cross),
        cmocka_unit_test(refusals),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
