/*
 * test_register_known.c - warps that a mesh knows: between two maps of it to the sphere, and what
 * they bring onto each other.
 */
#include "registrations.h"
#include "support/compare.h"

#define DEGREE 15
#define WARP_DEGREE 63

static struct srnf_encode_options by(enum srnf_parameterization route, size_t degree)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();

    options.degree = degree;
    options.parameterization = route;
    return options;
}

struct routes {
    struct srnf_mesh mesh;
    struct srnf_mesh_report report;
    double *points[2]; /* star, area */
};
static const enum srnf_parameterization both[] = {SRNF_PARAMETERIZATION_STAR,
                                                  SRNF_PARAMETERIZATION_AREA};

static void routes_open(struct routes *r, struct srnf_mesh mesh)
{
    r->mesh = mesh;
    assert_int_equal(srnf_mesh_prepare(&r->mesh, false, &r->report), SRNF_OK);
    for (size_t k = 0; k < 2; k++) {
        struct srnf_encode_options options = by(both[k], DEGREE);

        r->points[k] = shapes_doubles(3 * r->mesh.n_vertices);
        assert_int_equal(
            srnf_encode_points(&r->mesh, &r->report, &options, NULL, r->points[k], NULL), SRNF_OK);
    }
}

static void routes_close(struct routes *r)
{
    srnf_free(r->points[0]);
    srnf_free(r->points[1]);
    srnf_mesh_clear(&r->mesh);
}

static void encode(struct routes *r, size_t route, struct shapes_surface *s)
{
    struct srnf_encode_options options = by(both[route], s->degree);
    struct srnf_encoded encoded;

    assert_int_equal(srnf_encode(&r->mesh, &r->report, &options, NULL, &encoded, NULL), SRNF_OK);
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    shapes_update(s);
}

/* The direction of a vertex by one map goes to that by the other, as well as the series can. */
static void vertices_go_to_vertices(void **state)
{
    struct routes r;
    (void)state;

    routes_open(&r, meshes_star(24));
    for (size_t way = 0; way < 2; way++) {
        struct srnf_warp warp;
        double *points = shapes_doubles(7 * r.mesh.n_vertices);
        double *jacobian = points + 6 * r.mesh.n_vertices;
        double worst = 0.0;
        double least = INFINITY;

        assert_int_equal(
            srnf_warp_between(&r.mesh, r.points[way], r.points[1 - way], WARP_DEGREE, NULL, &warp),
            SRNF_OK);
        for (size_t i = 0; i < r.mesh.n_vertices; i++) {
            const double *v = r.points[way] + 3 * i;
            double length = figure_norm(3, v);

            for (size_t k = 0; k < 3; k++) {
                points[3 * i + k] = v[k] / length;
            }
        }
        assert_int_equal(srnf_warp_apply(&warp, r.mesh.n_vertices, points,
                                         points + 3 * r.mesh.n_vertices, jacobian),
                         SRNF_OK);
        for (size_t i = 0; i < r.mesh.n_vertices; i++) {
            const double *v = r.points[1 - way] + 3 * i;
            double apart[3];

            for (size_t k = 0; k < 3; k++) {
                apart[k] = points[3 * (r.mesh.n_vertices + i) + k] - v[k] / figure_norm(3, v);
            }
            worst = compare_max(worst, figure_norm(3, apart));
            least = compare_min(least, jacobian[i]);
        }
        printf("# from %s: vertices off by %.1e, J > %.2f\n", srnf_parameterization_name(both[way]),
               worst, least);
        assert_true(worst < 2e-3);
        assert_true(least > 0.1);
        srnf_warp_clear(&warp);
        srnf_free(points);
    }
    routes_close(&r);
}

/* J is the derivative of the map: areas of small triangles. */
static void jacobian_is_that_of_the_map(void **state)
{
    const double step = 1e-5;
    struct routes r;
    struct srnf_warp warp;
    struct test_random random = test_random_seed(3);
    double worst = 0.0;
    (void)state;

    routes_open(&r, meshes_star(12));
    assert_int_equal(srnf_warp_between(&r.mesh, r.points[0], r.points[1], 15, NULL, &warp),
                     SRNF_OK);
    for (size_t trial = 0; trial < 50; trial++) {
        double p[9];
        double q[9];
        double jacobian[3];
        double rotation[9];
        double area[2];

        shapes_random_rotation(&random, rotation);
        for (size_t k = 0; k < 3; k++) { /* rows of a rotation: t1, t2 and p = t1 x t2 */
            p[k] = rotation[6 + k];
            p[3 + k] = rotation[6 + k] * cos(step) + rotation[k] * sin(step);
            p[6 + k] = rotation[6 + k] * cos(step) + rotation[3 + k] * sin(step);
        }
        assert_int_equal(srnf_warp_apply(&warp, 3, p, q, jacobian), SRNF_OK);
        for (size_t k = 0; k < 2; k++) {
            const double *x = k ? q : p;

            area[k] = x[0] * (x[4] * x[8] - x[5] * x[7]) - x[1] * (x[3] * x[8] - x[5] * x[6]) +
                      x[2] * (x[3] * x[7] - x[4] * x[6]);
        }
        worst = compare_max(worst, fabs(area[1] / area[0] / jacobian[0] - 1.0));
    }
    printf("# J off by %.1e\n", worst);
    assert_true(worst < 1e-3);
    srnf_warp_clear(&warp);
    routes_close(&r);
}

/* Nearer than a search brings them, whichever is the template; warps join. */
static void surfaces_lie_on_each_other(void **state)
{
    static const double still[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    struct shapes_surface s[2];
    struct routes r;
    struct srnf_mesh mesh;
    (void)state;

    assert_true(meshes_load(REGISTRATIONS_LOCAL "L_thalamus.ply", &mesh));
    routes_open(&r, mesh);
    for (size_t k = 0; k < 2; k++) {
        shapes_open(&s[k], DEGREE);
        encode(&r, k, &s[k]);
    }
    for (size_t way = 0; way < 2; way++) {
        struct srnf_registration known;
        struct srnf_registration searched;
        struct srnf_warp warp;
        struct srnf_warp joined = {0};

        assert_int_equal(
            srnf_warp_between(&r.mesh, r.points[way], r.points[1 - way], WARP_DEGREE, NULL, &warp),
            SRNF_OK);
        assert_int_equal(warp_append(&joined, SRNF_WARP_ROTATION, 0, still), SRNF_OK);
        assert_int_equal(srnf_warp_join(&warp, &joined), SRNF_OK);
        assert_int_equal(srnf_register_known(s[way].sht, s[way].f, s[1 - way].f, NULL, &joined,
                                             NULL, &known, NULL),
                         SRNF_OK);
        registrations_run(&s[way], NULL, s[1 - way].f, NULL, &searched);
        printf("# template %s: known %.4f, searched %.4f, before %.4f; J > %.2f\n",
               srnf_parameterization_name(both[way]), known.distance, searched.distance,
               known.distance_before, known.min_jacobian);
        assert_true(known.distance < searched.distance);
        assert_true(known.min_jacobian > 0.0);
        assert_int_equal(known.warp.n_links, 2);
        assert_int_equal(known.warp.links[1].kind, SRNF_WARP_SERIES);
        srnf_registration_clear(&known);
        srnf_registration_clear(&searched);
        srnf_warp_clear(&joined);
        srnf_warp_clear(&warp);
    }
    shapes_close(&s[0]);
    shapes_close(&s[1]);
    routes_close(&r);
}

static void refuses_what_it_cannot_do(void **state)
{
    struct routes r;
    struct shapes_surface s;
    struct srnf_warp warp;
    struct srnf_warp inverse = {0};
    struct srnf_registration registration;
    struct srnf_encode_options options = by(SRNF_PARAMETERIZATION_GIVEN, DEGREE);
    struct srnf_error error = {0};
    (void)state;

    routes_open(&r, meshes_star(8));
    shapes_open(&s, DEGREE);
    encode(&r, 0, &s);
    assert_int_equal(srnf_warp_between(&r.mesh, r.points[0], r.points[1], 0, NULL, &warp),
                     SRNF_EINVAL);
    assert_int_equal(srnf_warp_between(&r.mesh, r.points[0], r.points[1], 256, NULL, &warp),
                     SRNF_EINVAL);
    assert_int_equal(srnf_encode_points(&r.mesh, &r.report, &options, NULL, r.points[0], &error),
                     SRNF_EINVAL);
    assert_int_equal(error.status, SRNF_EINVAL);
    assert_int_equal(srnf_warp_between(&r.mesh, r.points[1], r.points[1], 7, NULL, &warp), SRNF_OK);
    assert_int_equal(warp_invert(&warp, &inverse), SRNF_ENUMERIC);
    srnf_warp_clear(&warp);
    for (size_t i = 0; i < 3 * r.mesh.n_vertices; i++) { /* inside out: every face is turned */
        r.points[0][i] = -r.points[1][i];
    }
    assert_int_equal(srnf_warp_between(&r.mesh, r.points[1], r.points[0], 7, NULL, &warp),
                     SRNF_ENUMERIC);
    assert_int_equal(warp.n_links, 0);
    r.points[0][0] = r.points[0][1] = r.points[0][2] = 0.0;
    assert_int_equal(srnf_warp_between(&r.mesh, r.points[0], r.points[1], 7, NULL, &warp),
                     SRNF_ENUMERIC);
    assert_int_equal(srnf_register_known(s.sht, s.f, s.f, NULL, &warp, NULL, &registration, &error),
                     SRNF_EINVAL);
    s.f[5] = NAN;
    assert_int_equal(srnf_register_known(s.sht, s.f, s.f, NULL, &warp, NULL, &registration, &error),
                     SRNF_EINVAL);
    shapes_close(&s);
    routes_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vertices_go_to_vertices),
        cmocka_unit_test(jacobian_is_that_of_the_map),
        cmocka_unit_test(surfaces_lie_on_each_other),
        cmocka_unit_test(refuses_what_it_cannot_do),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
