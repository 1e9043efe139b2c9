/*
 * test_polygon.c - polygons of a file become triangles that lie in them: concave ones, those that
 * are nearly a line, bent or crossing themselves, and ones of hostile size.
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
#include <time.h>

#include "srnf.h"

#define PI 3.14159265358979323846

/* An OBJ file of one polygon through n points, beginning at corner `start`. */
static char *polygon_file(const double (*points)[3], size_t n, size_t start)
{
    size_t room = 100 * n + 16, used = 0;
    char *text = malloc(room);

    assert_non_null(text);
    for (size_t i = 0; i < n; i++) {
        used += (size_t)snprintf(text + used, room - used, "v %.17g %.17g %.17g\n", points[i][0],
                                 points[i][1], points[i][2]);
    }
    used += (size_t)snprintf(text + used, room - used, "f");
    for (size_t i = 0; i < n; i++) {
        used += (size_t)snprintf(text + used, room - used, " %zu", (start + i) % n + 1);
    }
    (void)snprintf(text + used, room - used, "\n");
    return text;
}

static int read_text(const char *text, struct srnf_mesh *mesh)
{
    struct srnf_error error;
    int status = srnf_mesh_read(text, strlen(text), SRNF_MESH_OBJ, NULL, mesh, NULL, &error);

    if (status != SRNF_OK) {
        print_message("%s\n", error.message);
    }
    return status;
}

static struct srnf_mesh cut(const double (*points)[3], size_t n, size_t start)
{
    char *text = polygon_file(points, n, start);
    struct srnf_mesh mesh;

    assert_int_equal(read_text(text, &mesh), SRNF_OK);
    assert_int_equal(mesh.n_faces, n - 2);
    free(text);
    return mesh;
}

/* The area of all triangles, and with a sign that of the plane z = 0. */
static void areas(const struct srnf_mesh *mesh, double *sum, double *flat)
{
    *sum = *flat = 0;
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const double *p[3];
        double a[3], b[3], c[3];

        for (int k = 0; k < 3; k++) {
            p[k] = mesh->vertices + 3 * (size_t)mesh->faces[3 * f + (size_t)k];
        }
        for (int k = 0; k < 3; k++) {
            a[k] = p[1][k] - p[0][k];
            b[k] = p[2][k] - p[0][k];
        }
        c[0] = a[1] * b[2] - a[2] * b[1];
        c[1] = a[2] * b[0] - a[0] * b[2];
        c[2] = a[0] * b[1] - a[1] * b[0];
        *sum += sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) / 2;
        *flat += c[2] / 2;
    }
}

/* Every edge of the polygon bounds one triangle, run its way; all others are run both ways. */
static void assert_edges(const struct srnf_mesh *mesh, size_t n)
{
    int *runs = calloc(n * n, sizeof *runs);

    assert_non_null(runs);
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        size_t a = mesh->faces[c], b = mesh->faces[c % 3 == 2 ? c - 2 : c + 1];

        runs[a * n + b]++;
        runs[b * n + a]--;
    }
    for (size_t a = 0; a < n; a++) {
        for (size_t b = a; b < n; b++) {
            int expected = b == a + 1 ? 1 : a == 0 && b == n - 1 ? -1 : 0;

            assert_int_equal(runs[a * n + b], expected);
        }
    }
    free(runs);
}

static void assert_fan(const struct srnf_mesh *mesh, size_t n, size_t start)
{
    for (size_t f = 0; f < mesh->n_faces; f++) {
        assert_int_equal(mesh->faces[3 * f], start);
        assert_int_equal(mesh->faces[3 * f + 1], (start + f + 1) % n);
        assert_int_equal(mesh->faces[3 * f + 2], (start + f + 2) % n);
    }
}

/* Twice the area that the corners go round in z = 0. */
static double shoelace(const double (*points)[3], size_t n)
{
    double sum = 0;

    for (size_t i = 0; i < n; i++) {
        const double *p = points[i], *q = points[(i + 1) % n];

        sum += p[0] * q[1] - p[1] * q[0];
    }
    return sum;
}

/* From whichever corner it begins, either way round: the area of the triangles is the polygon's. */
static void assert_cut(double (*points)[3], size_t n, double tolerance)
{
    double expected = shoelace((const double(*)[3])points, n) / 2;

    for (size_t start = 0; start < n; start++) {
        struct srnf_mesh mesh = cut((const double(*)[3])points, n, start);
        double sum, flat;

        areas(&mesh, &sum, &flat);
        assert_true(fabs(sum - fabs(expected)) <= tolerance);
        assert_true(fabs(flat - expected) <= tolerance);
        assert_edges(&mesh, n);
        srnf_mesh_clear(&mesh);
    }
    for (size_t i = 0; i < n / 2; i++) {
        double swap[3];

        memcpy(swap, points[i], sizeof swap);
        memcpy(points[i], points[n - 1 - i], sizeof swap);
        memcpy(points[n - 1 - i], swap, sizeof swap);
    }
    if (expected > 0) {
        assert_cut(points, n, tolerance);
    }
}

static void concave_polygons(void **state)
{
    double dart[][3] = {{0, 0, 0}, {4, 1, 0}, {1, 1, 0}, {1, 4, 0}};
    double ell[][3] = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
    double star[16][3], comb[42][3];

    (void)state;
    for (size_t i = 0; i < 16; i++) {
        double radius = i % 2 ? 0.3 : 1;

        star[i][0] = radius * cos(PI * (double)i / 8);
        star[i][1] = radius * sin(PI * (double)i / 8);
        star[i][2] = 0;
    }
    for (size_t i = 0; i < 40; i++) {
        comb[i][0] = (double)(40 - i);
        comb[i][1] = i % 2 ? 9 : 1;
        comb[i][2] = 0;
    }
    memcpy(comb[40], (double[3]){0, 0, 0}, sizeof comb[40]);
    memcpy(comb[41], (double[3]){41, 0, 0}, sizeof comb[41]);
    assert_cut(dart, 4, 1e-14);
    assert_cut(ell, 6, 1e-14);
    assert_cut(star, 16, 1e-14);
    assert_cut(comb, 42, 1e-11);
}

/* A polygon that goes round its middle at chance radii, tilted and far from the origin. */
static void chance_polygons(void **state)
{
    unsigned seed = 1;

    (void)state;
    for (size_t n = 4; n < 40; n++) {
        double points[40][3], flat[40][3], sum, signed_sum;
        struct srnf_mesh mesh;

        for (size_t i = 0; i < n; i++) {
            double radius, angle = 2 * PI * (double)i / (double)n;

            seed = seed * 1103515245U + 12345U;
            radius = 0.1 + (double)(seed >> 16 & 0x7fff) / 32768;
            flat[i][0] = radius * cos(angle);
            flat[i][1] = radius * sin(angle);
            flat[i][2] = 0;
            points[i][0] = 100 + 0.6 * flat[i][0];
            points[i][1] = 20 - flat[i][1];
            points[i][2] = 0.8 * flat[i][0] - 50;
        }
        mesh = cut((const double(*)[3])points, n, 0);
        areas(&mesh, &sum, &signed_sum);
        assert_true(fabs(sum - shoelace((const double(*)[3])flat, n) / 2) < 1e-12);
        srnf_mesh_clear(&mesh);
    }
}

/* Convex polygons, and those that their first corner sees whole, keep the fan around it. */
static void fans_stay(void **state)
{
    const double quad[][3] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
    const double dart[][3] = {{0, 0, 0}, {4, 1, 0}, {1, 1, 0}, {1, 4, 0}};
    struct srnf_mesh mesh;
    size_t n = 100000;
    double(*circle)[3] = calloc(n, sizeof *circle);

    (void)state;
    assert_non_null(circle);
    for (size_t start = 0; start < 4; start++) {
        mesh = cut(quad, 4, start);
        assert_fan(&mesh, 4, start);
        srnf_mesh_clear(&mesh);
    }
    mesh = cut(dart, 4, 2);
    assert_fan(&mesh, 4, 2);
    srnf_mesh_clear(&mesh);
    for (size_t i = 0; i < n; i++) {
        circle[i][0] = cos(2 * PI * (double)i / (double)n);
        circle[i][1] = sin(2 * PI * (double)i / (double)n);
    }
    mesh = cut((const double(*)[3])circle, n, 0);
    assert_fan(&mesh, n, 0);
    srnf_mesh_clear(&mesh);
    free(circle);
}

/* A corner in the middle of a straight side: no triangle is a line. */
static void straight_corners(void **state)
{
    const double side[][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    const double needle[][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1e-9, 0}};
    const double line[][3] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}};

    (void)state;
    for (size_t start = 0; start < 5; start++) {
        struct srnf_mesh mesh = cut(side, 5, start);

        for (size_t f = 0; f < 3; f++) {
            struct srnf_mesh one = {.vertices = mesh.vertices,
                                    .faces = mesh.faces + 3 * f,
                                    .n_vertices = 5,
                                    .n_faces = 1};
            double sum, flat;

            areas(&one, &sum, &flat);
            assert_true(flat >= 0.5);
        }
        assert_edges(&mesh, 5);
        srnf_mesh_clear(&mesh);
    }
    for (size_t start = 0; start < 4; start++) {
        struct srnf_mesh mesh = cut(needle, 4, start);
        double sum, flat;

        areas(&mesh, &sum, &flat);
        assert_true(fabs(sum - 1e-9) < 1e-15 && fabs(flat - 1e-9) < 1e-15);
        assert_edges(&mesh, 4);
        srnf_mesh_clear(&mesh);
        mesh = cut(line, 4, start);
        assert_edges(&mesh, 4);
        srnf_mesh_clear(&mesh);
    }
}

/* What has no one right answer still gives triangles that close with the neighbours. */
static void bent_and_crossing(void **state)
{
    const double saddle[][3] = {{0, 0, 1}, {1, 0, -1}, {1, 1, 1}, {0, 1, -1}};
    const double bow[][3] = {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
    const double uneven[][3] = {{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}};
    double pentagram[5][3];

    (void)state;
    for (size_t i = 0; i < 5; i++) {
        pentagram[i][0] = cos(4 * PI * (double)i / 5);
        pentagram[i][1] = sin(4 * PI * (double)i / 5);
        pentagram[i][2] = 0;
    }
    for (size_t start = 0; start < 5; start++) {
        struct srnf_mesh mesh = cut((const double(*)[3])pentagram, 5, start);

        assert_edges(&mesh, 5);
        srnf_mesh_clear(&mesh);
    }
    for (size_t start = 0; start < 4; start++) {
        const double(*polygons[])[3] = {saddle, bow, uneven};

        for (size_t i = 0; i < 3; i++) {
            struct srnf_mesh mesh = cut(polygons[i], 4, start);

            assert_edges(&mesh, 4);
            if (i == 0) {
                assert_fan(&mesh, 4, start);
            }
            srnf_mesh_clear(&mesh);
        }
    }
}

/* A polygon whose corners are numbers of vertices that come after it. */
static void vertices_after_faces(void **state)
{
    struct srnf_mesh mesh;
    double sum, flat;

    (void)state;
    assert_int_equal(read_text("f 1 2 3 4\nv 0 0 0\nv 4 1 0\nv 1 1 0\nv 1 4 0\n", &mesh), SRNF_OK);
    areas(&mesh, &sum, &flat);
    assert_true(fabs(sum - flat) < 1e-14);
    srnf_mesh_clear(&mesh);
}

/* The outline of a comb with n teeth, whose every second corner turns the other way. */
static char *comb_file(size_t n)
{
    double(*points)[3] = calloc(2 * n + 2, sizeof *points);
    char *text;

    assert_non_null(points);
    for (size_t i = 0; i < 2 * n; i++) {
        points[i][0] = (double)(2 * n - i);
        points[i][1] = i % 2 ? 9 : 1 + 0.5 * sin((double)i);
    }
    points[2 * n + 1][0] = (double)(2 * n + 1);
    text = polygon_file((const double(*)[3])points, 2 * n + 2, 0);
    free(points);
    return text;
}

/* A concave polygon takes time with the square of its corners: past a bound it is refused. */
static void hostile_size(void **state)
{
    char *text = comb_file(2000);
    struct srnf_mesh mesh;
    struct srnf_error error;
    clock_t begin;

    (void)state;
    assert_int_equal(read_text(text, &mesh), SRNF_OK);
    srnf_mesh_clear(&mesh);
    free(text);
    text = comb_file(200000);
    begin = clock();
    assert_int_equal(srnf_mesh_read(text, strlen(text), SRNF_MESH_OBJ, NULL, &mesh, NULL, &error),
                     SRNF_ELIMIT);
    assert_true((double)(clock() - begin) / CLOCKS_PER_SEC < 60);
    assert_non_null(strstr(error.message, "400002"));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(concave_polygons),  cmocka_unit_test(chance_polygons),
        cmocka_unit_test(fans_stay),         cmocka_unit_test(straight_corners),
        cmocka_unit_test(bent_and_crossing), cmocka_unit_test(vertices_after_faces),
        cmocka_unit_test(hostile_size),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
