/*
 * test_shape_memory.c - what the core does when memory runs out: each allocation in turn is
 * refused.
 */
#include "core/figures.h"
#include "support/meshes.h"
#include "support/refusing.h"

/* One computation; it leaves nothing allocated, and finds its outputs empty when it fails. */
struct subject {
    const char *name;
    int (*run)(const struct shapes_surface *s);
};

static int run_invert(const struct shapes_surface *s)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    struct srnf_error error = {0};
    int status;

    options.initial = SRNF_INITIAL_SPHERE;
    status = srnf_invert(s->sht, s->q, &options, NULL, &result, &error);
    if (status < 0) {
        assert_null(result.coefficients);
        assert_null(result.history);
        assert_int_equal(error.status, status);
    }
    srnf_inversion_clear(&result);
    return status;
}

static int run_spectral(const struct shapes_surface *s)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    int status;

    options.method = SRNF_INVERT_SPECTRAL;
    status = srnf_invert(s->sht, s->q, &options, NULL, &result, NULL);
    srnf_inversion_clear(&result);
    return status;
}

static int run_gradient(const struct shapes_surface *s)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    int status;

    options.method = SRNF_INVERT_GRADIENT;
    options.initial = SRNF_INITIAL_SPHERE;
    options.max_iterations = 5;
    options.certify = false;
    status = srnf_invert(s->sht, s->q, &options, NULL, &result, NULL);
    srnf_inversion_clear(&result);
    return status;
}

static int run_geodesic(const struct shapes_surface *s)
{
    struct srnf_geodesic_options options = {.method = SRNF_GEODESIC_SRNF, .steps = 3};
    struct srnf_geodesic result;
    double *to = malloc(s->count * sizeof *to);
    struct srnf_error error = {0};
    int status;

    assert_non_null(to);
    for (size_t i = 0; i < s->count; i++) {
        to[i] = (1.0 + 0.1 * (double)(i % 3)) * s->f[i];
    }
    status = srnf_geodesic(s->sht, s->f, to, &options, NULL, &result, &error);
    if (status < 0) {
        assert_null(result.coefficients);
        assert_null(result.times);
        assert_int_equal(error.status, status);
    }
    srnf_geodesic_clear(&result);
    free(to);
    return status;
}

/* A deformed copy, each coordinate stretched by its own factor. */
static double *stretched(const struct shapes_surface *s, double step)
{
    double *f = malloc(s->count * sizeof *f);

    assert_non_null(f);
    for (size_t i = 0; i < s->count; i++) {
        f[i] = (1.0 + step * (double)(i / s->each)) * s->f[i];
    }
    return f;
}

static int run_shoot(const struct shapes_surface *s)
{
    const double times[] = {0.5, -0.5};
    struct srnf_shot shot;
    struct srnf_error error = {0};
    double *to = stretched(s, 0.1);
    double *velocity = malloc(3 * s->points * sizeof *velocity);
    int status;

    assert_non_null(velocity);
    status = srnf_velocity_toward(s->sht, s->f, to, velocity);
    if (status == SRNF_OK) {
        status = srnf_shoot(s->sht, s->f, velocity, 2, times, NULL, &shot, &error);
        assert_int_equal(error.status, status);
        assert_true(status == SRNF_OK || (!shot.coefficients && !shot.energy));
        srnf_shot_clear(&shot);
    }
    free(velocity);
    free(to);
    return status;
}

static int run_transport(const struct shapes_surface *s)
{
    struct srnf_tangent tangent;
    struct srnf_error error = {0};
    int status = srnf_transport(s->sht, s->f, s->q, NULL, &tangent, &error);

    assert_true(status >= 0 || (!tangent.coefficients && error.status == status));
    srnf_tangent_clear(&tangent);
    return status;
}

static int run_transfer(const struct shapes_surface *s)
{
    struct srnf_transferred transferred;
    struct srnf_error error = {0};
    double *deformed = stretched(s, 0.1);
    double *target = stretched(s, -0.2);
    int status = srnf_transfer(s->sht, s->f, deformed, target, SRNF_TRANSFER_RATIO, NULL,
                               &transferred, &error);

    assert_true(status >= 0 || (!transferred.coefficients && error.status == status));
    srnf_transferred_clear(&transferred);
    free(target);
    free(deformed);
    return status;
}

/* given: by the map that area finds. */
static int encode_by(enum srnf_parameterization route)
{
    const size_t index = refusing.refused;
    struct srnf_mesh mesh;
    struct srnf_mesh sphere;
    struct srnf_mesh_report report;
    struct srnf_spherical_map map;
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded;
    struct srnf_error error = {0};
    int status;

    refusing_none();
    mesh = meshes_star(4);
    assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
    assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), SRNF_OK);
    sphere = mesh;
    sphere.vertices = map.points;
    options.sphere = &sphere;
    options.parameterization = route;
    options.degree = 6;
    refusing_at(index);
    status = srnf_encode(&mesh, &report, &options, NULL, &encoded, &error);
    if (status < 0) {
        assert_null(encoded.coefficients);
        assert_int_equal(error.status, status);
    }
    srnf_free(encoded.coefficients);
    srnf_free(map.points);
    srnf_mesh_clear(&mesh);
    return status;
}

static int run_encode(const struct shapes_surface *s)
{
    (void)s;
    return encode_by(SRNF_PARAMETERIZATION_STAR);
}

static int run_encode_area(const struct shapes_surface *s)
{
    (void)s;
    return encode_by(SRNF_PARAMETERIZATION_AREA);
}

static int run_encode_given(const struct shapes_surface *s)
{
    (void)s;
    return encode_by(SRNF_PARAMETERIZATION_GIVEN);
}

static int run_triangulate(const struct shapes_surface *s)
{
    struct srnf_mesh mesh = {0};
    double *normals = NULL;
    int status = srnf_surface_triangulate(s->degree, s->f, 3, &mesh, &normals);

    if (status < 0) {
        assert_null(mesh.vertices);
        assert_null(normals);
    }
    srnf_free(normals);
    srnf_mesh_clear(&mesh);
    return status;
}

static struct shapes_surface surface;
static const struct subject *subject;

static int run_subject(void)
{
    return subject->run(&surface);
}

static void survives_each_refusal(void **state)
{
    const struct subject subjects[] = {
        {"srnf_invert, auto, certified", run_invert},
        {"srnf_invert, spectral", run_spectral},
        {"srnf_invert, gradient", run_gradient},
        {"srnf_geodesic", run_geodesic},
        {"srnf_shoot", run_shoot},
        {"srnf_transport", run_transport},
        {"srnf_transfer", run_transfer},
        {"srnf_encode, auto", run_encode},
        {"srnf_encode, area", run_encode_area},
        {"srnf_encode, given", run_encode_given},
        {"srnf_surface_triangulate", run_triangulate},
    };
    (void)state;

    shapes_open(&surface, 6);
    shapes_fill(&surface, shapes_arms, 3.0);
    for (size_t k = 0; k < sizeof subjects / sizeof subjects[0]; k++) {
        size_t total;

        subject = &subjects[k];
        total = refusing_sweep(subject->name, run_subject, 0, 1);
        assert_true(total > 3 && total < 2000);
    }
    shapes_close(&surface);
    assert_int_equal(refusing.alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(survives_each_refusal),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
