/*
 * test_encode.c - from meshes to surfaces by the star route: spheres anywhere, a star whose
 * radius is known, real structures, independence of pose, scale and threads, and what is refused.
 */
#include "core/figures.h"
#include "support/meshes.h"
#include "support/parallel.h"

#define PI 3.14159265358979323846

static int encode(struct srnf_mesh *mesh, const struct srnf_encode_options *options,
                  const struct srnf_context *context, struct srnf_encoded *encoded,
                  struct srnf_error *error)
{
    struct srnf_mesh_report report;

    assert_int_equal(srnf_mesh_prepare(mesh, false, &report), SRNF_OK);
    return srnf_encode(mesh, &report, options, context, encoded, error);
}

static struct srnf_encode_options of_degree(size_t degree)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();

    options.degree = degree;
    options.parameterization = SRNF_PARAMETERIZATION_STAR;
    return options;
}

/* ---- Known surfaces -------------------------------------------------------------------------- */

static void spheres_anywhere(void **state)
{
    const double radii[] = {1e-3, 1.0, 42.0, 1e4};
    struct test_random random = test_random_seed(1);
    struct srnf_encode_options options = of_degree(15);
    (void)state;

    for (size_t k = 0; k < 4; k++) {
        struct srnf_mesh mesh = meshes_sphere(48);
        struct srnf_encoded encoded;
        double radius = radii[k];
        double origin[3];
        double rest = 0.0;

        for (size_t c = 0; c < 3; c++) {
            origin[c] = 5.0 * radius * test_random_normal(&random);
        }
        meshes_scale(&mesh, radius);
        meshes_move(&mesh, origin[0], origin[1], origin[2]);
        assert_int_equal(encode(&mesh, &options, NULL, &encoded, NULL), SRNF_OK);
        for (size_t c = 0; c < 3; c++) {
            origin[c] -= encoded.origin[c];
        }
        for (size_t i = 4; i < 256; i++) {
            for (size_t c = 0; c < 3; c++) {
                rest = compare_max(rest, fabs(encoded.coefficients[256 * c + i]));
            }
        }
        printf(
            "# sphere of radius %g: scale %.6f sqrt(4 pi) R, origin off by %.1e R, degrees above "
            "1 %.1e, rms %.1e of the diagonal\n",
            radius, encoded.scale / (radius * sqrt(4.0 * PI)), figure_norm(3, origin) / radius,
            rest, encoded.fit.rms / encoded.fit.diagonal);
        assert_true(fabs(encoded.scale / (radius * sqrt(4.0 * PI)) - 1.0) < 1e-3);
        assert_true(figure_norm(3, origin) < 1e-3 * radius);
        assert_true(rest < 1e-3);
        assert_true(encoded.fit.rms < 1e-3 * encoded.fit.diagonal);
        assert_true(fabs(encoded.measures.area - 1.0) < 1e-12);
        assert_true(figure_norm(3, encoded.measures.centroid) < 1e-12);
        assert_true(encoded.route == SRNF_PARAMETERIZATION_STAR && encoded.star.value);
        srnf_free(encoded.coefficients);
        srnf_mesh_clear(&mesh);
    }
}

/* The largest distance of scale f + origin from the bumpy star on the grid, the rays being those of
   the origin. */
static double bumpy_error(const struct shapes_surface *s, const struct srnf_encoded *encoded)
{
    double *x = shapes_doubles(3 * s->points);
    double worst = 0.0;

    srnf_sht_synthesis(s->sht, 3, encoded->coefficients, x, s->workspace);
    for (size_t i = 0; i < s->points; i++) {
        size_t row = i / s->grid->n_phi;
        double phi = 2.0 * PI * (double)(i % s->grid->n_phi) / (double)s->grid->n_phi;
        double e[3] = {s->grid->sin_theta[row] * cos(phi), s->grid->sin_theta[row] * sin(phi),
                       s->grid->cos_theta[row]};
        double truth[3];

        shapes_bumpy(e, 0.0, truth);
        for (size_t c = 0; c < 3; c++) {
            double value = encoded->scale * x[c * s->points + i] + encoded->origin[c];

            worst = compare_max(worst, fabs(value - truth[c]));
        }
    }
    srnf_free(x);
    return worst;
}

/* Facets lie inside by a part of h^2, so the radius converges with the square of the spacing. */
static void star_is_recovered_with_order_two(void **state)
{
    const size_t frequencies[] = {12, 24, 48, 96};
    struct srnf_encode_options options = of_degree(15);
    struct shapes_surface s;
    double errors[4];
    double fits[4];
    (void)state;

    shapes_open(&s, 15);
    options.center_given = true; /* the origin */
    for (size_t k = 0; k < 4; k++) {
        struct srnf_mesh mesh = meshes_star(frequencies[k]);
        struct srnf_encoded encoded;

        assert_int_equal(encode(&mesh, &options, NULL, &encoded, NULL), SRNF_OK);
        errors[k] = bumpy_error(&s, &encoded);
        fits[k] = encoded.fit.rms / encoded.fit.diagonal;
        srnf_free(encoded.coefficients);
        srnf_mesh_clear(&mesh);
    }
    figure_order("largest error of the radius", 4, errors, 2.0, 2.0, 0.3, 0.0, 3);
    printf("# fit, rms of the diagonal: %.1e %.1e %.1e %.1e\n", fits[0], fits[1], fits[2], fits[3]);
    shapes_close(&s);
}

/* ---- Real structures ------------------------------------------------------------------------- */

static const char *const structures[] = {
    "L_thalamus", "R_thalamus", "L_pallidum", "R_pallidum", "L_amygdala",    "R_amygdala",
    "L_putamen",  "R_putamen",  "L_caudate",  "R_caudate",  "L_hippocampus", "R_hippocampus"};

static bool load(const char *structure, struct srnf_mesh *mesh)
{
    char path[128];

    (void)snprintf(path, sizeof path, "tests/data/aal_subcortex/%s.ply", structure);
    return meshes_load(path, mesh);
}

static void real_structures_fit(void **state)
{
    struct srnf_encode_options options = of_degree(31);
    size_t stars = 0;
    (void)state;

    options.parameterization = SRNF_PARAMETERIZATION_STAR;
    for (size_t k = 0; k < sizeof structures / sizeof structures[0]; k++) {
        struct srnf_mesh mesh = {0};
        struct srnf_star star;
        struct srnf_encoded encoded;
        struct srnf_error error = {0};
        int status;

        assert_true(load(structures[k], &mesh));
        status = encode(&mesh, &options, NULL, &encoded, &error);
        assert_int_equal(srnf_star_kernel(&mesh, &star), SRNF_OK);
        if (star.value) {
            const struct srnf_fit *fit = &encoded.fit;

            assert_int_equal(status, SRNF_OK);
            printf("# %-13s fit rms %.3f %%, p95 %.3f %%, max %.3f %% of the diagonal\n",
                   structures[k], 100.0 * fit->rms / fit->diagonal,
                   100.0 * fit->p95 / fit->diagonal, 100.0 * fit->max / fit->diagonal);
            assert_true(fit->rms < 2e-3 * fit->diagonal);
            assert_true(fit->rms <= fit->max && fit->p95 <= fit->max);
            srnf_free(encoded.coefficients);
            stars++;
        } else {
            printf("# %-13s is not star-shaped: %s\n", structures[k], error.message);
            assert_int_equal(status, SRNF_ENOT_STAR);
            assert_int_equal(error.status, SRNF_ENOT_STAR);
            assert_null(encoded.coefficients);
        }
        srnf_mesh_clear(&mesh);
    }
    assert_true(stars >= 4); /* thalami and pallida */
}

/* A mesh moved and scaled is the same surface; turned it is another sampling of it. */
static void pose_and_scale_do_not_matter(void **state)
{
    const double scales[] = {1e-3, 1.0, 1e3};
    struct srnf_encode_options options = of_degree(31);
    struct srnf_mesh mesh = {0};
    struct srnf_encoded still;
    (void)state;

    assert_true(load("L_thalamus", &mesh));
    assert_int_equal(encode(&mesh, &options, NULL, &still, NULL), SRNF_OK);
    for (size_t k = 0; k < 3; k++) {
        struct srnf_mesh moved = meshes_copy(&mesh);
        struct srnf_encoded encoded;
        double shift[3] = {100.0, -40.0, 7.0};
        double apart;

        meshes_move(&moved, shift[0], shift[1], shift[2]);
        meshes_scale(&moved, scales[k]);
        assert_int_equal(encode(&moved, &options, NULL, &encoded, NULL), SRNF_OK);
        apart = shapes_distance(31, still.coefficients, encoded.coefficients);
        printf("# scaled by %g: surfaces %.1e apart, scale off by %.1e\n", scales[k], apart,
               fabs(encoded.scale / (scales[k] * still.scale) - 1.0));
        assert_true(apart < 1e-7);
        assert_true(fabs(encoded.scale / (scales[k] * still.scale) - 1.0) < 1e-7);
        assert_true(fabs(encoded.fit.rms / (scales[k] * still.fit.rms) - 1.0) < 1e-5);
        for (size_t c = 0; c < 3; c++) {
            assert_true(fabs(encoded.origin[c] / scales[k] - still.origin[c] - shift[c]) <
                        1e-6 * still.scale);
        }
        srnf_free(encoded.coefficients);
        srnf_mesh_clear(&moved);
    }
    srnf_free(still.coefficients);
    srnf_mesh_clear(&mesh);
}

/* ---- Options --------------------------------------------------------------------------------- */

/* The surface in the units of the mesh is r e about the centre; what the heat kernel does to r
   shows in the roughness of f. */
static double roughness(size_t degree, const double *f)
{
    size_t each = srnf_coefficient_count(degree);
    double high = 0.0;
    double all = 0.0;

    for (size_t l = 1; l <= degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            for (size_t c = 0; c < 3; c++) {
                double square = f[c * each + i] * f[c * each + i];

                all += square;
                high += (double)(l * (l + 1)) * square;
            }
        }
    }
    return high / all;
}

static void smoothing_damps(void **state)
{
    const double sigmas[] = {0.0, 1e-3, 1e-2, 1e-1, 10.0};
    struct srnf_mesh mesh = {0};
    struct srnf_encode_options options = of_degree(31);
    double before = INFINITY;
    double fit = 0.0;
    (void)state;

    assert_true(load("R_pallidum", &mesh));
    for (size_t k = 0; k < 5; k++) {
        struct srnf_encoded encoded;
        double rough;

        options.smoothing = sigmas[k];
        assert_int_equal(encode(&mesh, &options, NULL, &encoded, NULL), SRNF_OK);
        rough = roughness(31, encoded.coefficients);
        printf("# sigma %g: roughness %.4f, rms %.3f %%\n", sigmas[k], rough,
               100.0 * encoded.fit.rms / encoded.fit.diagonal);
        assert_true(rough < before && encoded.fit.rms > fit);
        before = rough;
        fit = encoded.fit.rms;
        srnf_free(encoded.coefficients);
    }
    assert_true(fabs(before - 2.0) < 1e-3); /* what is left is a sphere: degree 1 alone */
    srnf_mesh_clear(&mesh);
}

static void scale_can_stay(void **state)
{
    struct srnf_mesh mesh = {0};
    struct srnf_encode_options options = of_degree(31);
    struct srnf_encoded unit;
    struct srnf_encoded own;
    double worst = 0.0;
    (void)state;

    assert_true(load("R_pallidum", &mesh));
    assert_int_equal(encode(&mesh, &options, NULL, &unit, NULL), SRNF_OK);
    options.unit_area = false;
    assert_int_equal(encode(&mesh, &options, NULL, &own, NULL), SRNF_OK);
    assert_true(own.scale == 1.0);
    assert_true(fabs(own.measures.area / (unit.scale * unit.scale) - 1.0) < 1e-12);
    for (size_t i = 0; i < 3 * srnf_coefficient_count(31); i++) {
        worst = compare_max(worst, fabs(own.coefficients[i] - unit.scale * unit.coefficients[i]));
    }
    assert_true(worst < 1e-12 * unit.scale);
    srnf_free(own.coefficients);
    srnf_free(unit.coefficients);
    srnf_mesh_clear(&mesh);
}

/* Another centre in the kernel gives another parameterization of the same body; one outside is
   refused. */
static void centers_are_checked(void **state)
{
    struct srnf_mesh mesh = meshes_star(48);
    struct srnf_encode_options options = of_degree(31);
    const double inside[][3] = {{0, 0, 0}, {0.1, 0, 0}, {0, -0.1, 0.1}};
    const double outside[][3] = {{3, 0, 0}, {-2, 1, 0}, {0, 0, 1.15}};
    struct srnf_encoded encoded;
    (void)state;

    options.center_given = true;
    for (size_t k = 0; k < 3; k++) {
        memcpy(options.center, inside[k], sizeof inside[k]);
        assert_int_equal(encode(&mesh, &options, NULL, &encoded, NULL), SRNF_OK);
        assert_memory_equal(encoded.star.center, inside[k], sizeof inside[k]);
        assert_true(encoded.fit.rms < 1e-3 * encoded.fit.diagonal);
        srnf_free(encoded.coefficients);
    }
    for (size_t k = 0; k < 3; k++) {
        struct srnf_error error = {0};

        memcpy(options.center, outside[k], sizeof outside[k]);
        assert_int_equal(encode(&mesh, &options, NULL, &encoded, &error), SRNF_ENOT_STAR);
        assert_non_null(strstr(error.message, "given centre"));
    }
    srnf_mesh_clear(&mesh);
}

static void refuses_what_it_cannot_do(void **state)
{
    const size_t degrees[] = {0, 3, 128};
    const double smoothings[] = {-1e-9, NAN, INFINITY};
    struct srnf_mesh good = meshes_sphere(6);
    struct srnf_mesh bad[] = {meshes_bent_capsule(6.0, 0.4, 4.0, 60, 24),
                              meshes_torus(2, 0.5, 20, 10), meshes_sphere_with_hole(6),
                              meshes_two_spheres(5)};
    const int statuses[] = {SRNF_ENOT_STAR, SRNF_EGENUS, SRNF_ENOT_CLOSED, SRNF_ECOMPONENTS};
    struct srnf_encode_options options;
    struct srnf_encode_options star = of_degree(31);
    struct srnf_encoded encoded;
    (void)state;

    star.parameterization = SRNF_PARAMETERIZATION_STAR;
    for (size_t k = 0; k < 3; k++) {
        options = of_degree(degrees[k]);
        assert_int_equal(encode(&good, &options, NULL, &encoded, NULL), SRNF_EINVAL);
        assert_null(encoded.coefficients);
        options = of_degree(15);
        options.smoothing = smoothings[k];
        assert_int_equal(encode(&good, &options, NULL, &encoded, NULL), SRNF_EINVAL);
    }
    options = of_degree(15);
    options.parameterization = (enum srnf_parameterization)9;
    assert_int_equal(encode(&good, &options, NULL, &encoded, NULL), SRNF_EINVAL);
    for (size_t k = 0; k < 4; k++) {
        struct srnf_error error = {0};

        assert_int_equal(encode(&bad[k], &star, NULL, &encoded, &error), statuses[k]);
        assert_int_equal(error.status, statuses[k]);
        assert_true(strlen(error.message) > 10);
        srnf_mesh_clear(&bad[k]);
    }
    srnf_mesh_clear(&good);
}

/* ---- Context --------------------------------------------------------------------------------- */

static bool always(void *user)
{
    (void)user;
    return true;
}

static void same_result_on_any_threads(void **state)
{
    const struct srnf_context contexts[] = {{.parallel_for = parallel_backwards},
                                            {.parallel_for = parallel_threads}};
    const struct srnf_context canceled = {.canceled = always};
    struct srnf_mesh mesh = {0};
    struct srnf_encoded alone;
    struct srnf_encoded encoded;
    (void)state;

    assert_true(load("L_pallidum", &mesh));
    assert_int_equal(encode(&mesh, NULL, NULL, &alone, NULL), SRNF_OK);
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(encode(&mesh, NULL, &contexts[k], &encoded, NULL), SRNF_OK);
        assert_memory_equal(encoded.coefficients, alone.coefficients,
                            3 * srnf_coefficient_count(31) * sizeof(double));
        assert_memory_equal(&encoded.fit, &alone.fit, sizeof alone.fit);
        srnf_free(encoded.coefficients);
    }
    assert_int_equal(encode(&mesh, NULL, &canceled, &encoded, NULL), SRNF_ECANCELED);
    assert_null(encoded.coefficients);
    srnf_free(alone.coefficients);
    srnf_mesh_clear(&mesh);
}

/* ---- A kernel that is known ------------------------------------------------------------------ */

/* It is taken instead of being solved: the same bits where it is that of the mesh. */
static void a_known_kernel_is_taken(void **state)
{
    struct srnf_encode_options options = of_degree(8);
    struct srnf_mesh mesh = meshes_star(12);
    struct srnf_encoded solved, known, moved;
    struct srnf_star kernel;
    size_t count = 3 * srnf_coefficient_count(options.degree);
    (void)state;

    assert_int_equal(encode(&mesh, &options, NULL, &solved, NULL), SRNF_OK);
    assert_int_equal(srnf_star_kernel(&mesh, &kernel), SRNF_OK);
    options.kernel = &kernel;
    assert_int_equal(encode(&mesh, &options, NULL, &known, NULL), SRNF_OK);
    assert_memory_equal(known.coefficients, solved.coefficients, count * sizeof(double));
    assert_memory_equal(known.star.center, solved.star.center, sizeof kernel.center);
    srnf_free(known.coefficients);
    kernel.center[0] += 0.25 * kernel.margin;
    assert_int_equal(encode(&mesh, &options, NULL, &moved, NULL), SRNF_OK);
    assert_true(moved.star.center[0] == kernel.center[0]);
    assert_memory_not_equal(moved.coefficients, solved.coefficients, count * sizeof(double));
    srnf_free(moved.coefficients);
    options.center_given = true; /* the origin: a kernel has no say */
    assert_int_equal(encode(&mesh, &options, NULL, &known, NULL), SRNF_OK);
    assert_true(known.star.center[0] == 0.0);
    srnf_free(known.coefficients);
    srnf_free(solved.coefficients);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_known_kernel_is_taken),
        cmocka_unit_test(spheres_anywhere),
        cmocka_unit_test(star_is_recovered_with_order_two),
        cmocka_unit_test(real_structures_fit),
        cmocka_unit_test(pose_and_scale_do_not_matter),
        cmocka_unit_test(smoothing_damps),
        cmocka_unit_test(scale_can_stay),
        cmocka_unit_test(centers_are_checked),
        cmocka_unit_test(refuses_what_it_cannot_do),
        cmocka_unit_test(same_result_on_any_threads),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
