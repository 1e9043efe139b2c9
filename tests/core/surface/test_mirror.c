/*
 * test_mirror.c - mirror images of surfaces and meshes: what they keep, how their SRNFs are
 * related, that they are those that the mirrored mesh has, and that left and right structures match
 * each other's mirror images.
 *
 * srnfd-test: no-asan (core/registration/test_register_known.c runs its code)
 */
#include "core/figures.h"
#include "support/compare.h"
#include "support/meshes.h"

#define DEGREE 12

static double *mirror_of(const struct shapes_surface *s)
{
    double *image = shapes_doubles(s->count);

    memcpy(image, s->f, s->count * sizeof(double));
    srnf_surface_mirror(s->degree, image);
    return image;
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

/* Against f*(e) = M f(M e) evaluated at points. */
static void image_is_the_surface_reflected_twice(void **state)
{
    enum { N = 50 };
    struct test_random random = test_random_seed(11);
    double points[3 * N], reflected[3 * N], values[3 * N], wanted[3 * N], worst[3 * N];
    struct shapes_surface s;
    double *image;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    shapes_move(&s, &random);
    image = mirror_of(&s);
    for (size_t i = 0; i < N; i++) {
        test_random_direction(&random, points + 3 * i);
        memcpy(reflected + 3 * i, points + 3 * i, 3 * sizeof(double));
        reflected[3 * i] = -reflected[3 * i];
    }
    assert_int_equal(srnf_harmonics_at_points(s.degree, 3, image, N, points, values, NULL),
                     SRNF_OK);
    assert_int_equal(srnf_harmonics_at_points(s.degree, 3, s.f, N, reflected, wanted, NULL),
                     SRNF_OK);
    for (size_t i = 0; i < 3 * N; i++) {
        worst[i] = values[i] - (i < N ? -wanted[i] : wanted[i]);
    }
    figure_below("the image off M f(M e)", figure_norm(3 * N, worst), 1e-12);
    srnf_free(image);
    shapes_close(&s);
}

static void image_of_the_image_is_the_surface(void **state)
{
    struct shapes_surface s;
    double *image;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    image = mirror_of(&s);
    assert_memory_not_equal(image, s.f, s.count * sizeof(double));
    srnf_surface_mirror(s.degree, image);
    for (size_t i = 0; i < s.count; i++) {
        assert_true(image[i] == s.f[i]);
    }
    srnf_free(image);
    shapes_close(&s);
}

/* In another plane: H f(M e) with H = I - 2 n n', of a surface and of a mesh, back to rounding;
   along x the same bits as without a normal. */
static void planes_are_chosen_by_their_normals(void **state)
{
    const double along_x[3] = {1.0, 0.0, 0.0}, normal[3] = {2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0};
    const double point[3] = {0.48, -0.6, 0.64}, reflected[3] = {-0.48, -0.6, 0.64};
    double value[3], wanted[3], along, worst = 0.0;
    struct shapes_surface s;
    struct srnf_mesh mesh, image;
    double *plain, *turned;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    plain = mirror_of(&s);
    turned = shapes_doubles(s.count);
    memcpy(turned, s.f, s.count * sizeof(double));
    srnf_surface_mirror_in(s.degree, turned, along_x);
    assert_memory_equal(turned, plain, s.count * sizeof(double));

    memcpy(turned, s.f, s.count * sizeof(double));
    srnf_surface_mirror_in(s.degree, turned, normal);
    assert_int_equal(srnf_harmonics_at_points(s.degree, 3, turned, 1, point, value, NULL), SRNF_OK);
    assert_int_equal(srnf_harmonics_at_points(s.degree, 3, s.f, 1, reflected, wanted, NULL),
                     SRNF_OK);
    along = normal[0] * wanted[0] + normal[1] * wanted[1] + normal[2] * wanted[2];
    for (size_t k = 0; k < 3; k++) {
        worst = compare_max(worst, fabs(value[k] - (wanted[k] - 2.0 * along * normal[k])));
    }
    srnf_surface_mirror_in(s.degree, turned, normal);
    for (size_t i = 0; i < s.count; i++) {
        worst = compare_max(worst, fabs(turned[i] - s.f[i]));
    }
    figure_below("the image in another plane, and its own", worst, 1e-12);

    assert_int_equal(srnf_mesh_icosphere(3, &mesh), SRNF_OK);
    assert_int_equal(srnf_mesh_icosphere(3, &image), SRNF_OK);
    srnf_mesh_mirror_in(&image, normal);
    assert_int_not_equal(image.faces[1], mesh.faces[1]);
    for (size_t i = 0; i < 3 * mesh.n_vertices; i += 3) {
        const double *a = mesh.vertices + i, *b = image.vertices + i;
        double d =
            normal[0] * (a[0] + b[0]) + normal[1] * (a[1] + b[1]) + normal[2] * (a[2] + b[2]);

        worst = compare_max(worst, fabs(d));
    }
    srnf_mesh_mirror_in(&image, normal);
    for (size_t i = 0; i < 3 * mesh.n_vertices; i++) {
        worst = compare_max(worst, fabs(image.vertices[i] - mesh.vertices[i]));
    }
    assert_memory_equal(image.faces, mesh.faces, 3 * mesh.n_faces * sizeof *mesh.faces);
    figure_below("a mesh in another plane, and back", worst, 1e-12);
    srnf_mesh_clear(&mesh);
    srnf_mesh_clear(&image);
    srnf_free(plain);
    srnf_free(turned);
    shapes_close(&s);
}

/* Area and volume with its sign; q* = M q o M, which on the grid takes column j to n/2 - j. */
static void image_keeps_measures_and_reflects_the_srnf(void **state)
{
    struct srnf_surface_measures measures[2];
    struct shapes_surface s;
    double *image, *q, *difference;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    image = mirror_of(&s);
    q = shapes_doubles(3 * s.points);
    difference = shapes_doubles(3 * s.points);
    srnf_surface_measure(s.sht, s.f, &measures[0], s.workspace);
    srnf_surface_measure(s.sht, image, &measures[1], s.workspace);
    assert_true(measures[0].volume > 0.0);
    figure_below("area", fabs(measures[1].area / measures[0].area - 1.0), 1e-13);
    figure_below("volume", fabs(measures[1].volume / measures[0].volume - 1.0), 1e-13);
    figure_below("centroid", fabs(measures[1].centroid[0] + measures[0].centroid[0]), 1e-13);
    srnf_field(s.sht, image, q, s.workspace);
    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 0; i < s.points; i++) {
            size_t n = s.grid->n_phi, row = i / n, column = (n / 2 + n - i % n) % n;
            double wanted = s.q[k * s.points + row * n + column];

            difference[k * s.points + i] = q[k * s.points + i] - (k == 0 ? -wanted : wanted);
        }
    }
    assert_int_equal(s.grid->n_phi % 2, 0);
    figure_below("the SRNF off M q(M e)",
                 figure_norm(3 * s.points, difference) / figure_norm(3 * s.points, s.q), 1e-12);
    srnf_free(difference);
    srnf_free(q);
    srnf_free(image);
    shapes_close(&s);
}

/* ---- Meshes ---------------------------------------------------------------------------------- */

static void mirrored_mesh_stays_outward(void **state)
{
    struct srnf_mesh mesh = meshes_bumpy(12, 3), copy = meshes_copy(&mesh);
    struct srnf_mesh_report before, after;
    (void)state;

    meshes_move(&mesh, 3.0, 1.0, 2.0);
    meshes_move(&copy, 3.0, 1.0, 2.0);
    assert_int_equal(srnf_mesh_prepare(&copy, false, &before), SRNF_OK);
    srnf_mesh_mirror(&mesh);
    assert_int_equal(srnf_mesh_prepare(&mesh, false, &after), SRNF_OK);
    assert_int_equal(after.repairs.faces_flipped, 0);
    assert_int_equal(after.n_problems, 0);
    figure_below("volume", fabs(after.volume / before.volume - 1.0), 1e-12);
    figure_below("centroid", fabs(after.centroid[0] + before.centroid[0]), 1e-12);
    srnf_mesh_mirror(&mesh);
    assert_memory_equal(mesh.vertices, copy.vertices, 3 * mesh.n_vertices * sizeof(double));
    assert_memory_equal(mesh.faces, copy.faces, 3 * mesh.n_faces * sizeof(uint32_t));
    srnf_mesh_clear(&copy);
    srnf_mesh_clear(&mesh);
}

/* The surface of a mesh, mirrored before encoding or after. */
static void encode(const struct srnf_mesh *mesh, bool before,
                   enum srnf_parameterization parameterization, double *f)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh copy = meshes_copy(mesh);
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;

    options.degree = DEGREE;
    options.parameterization = parameterization;
    if (before) {
        srnf_mesh_mirror(&copy);
    }
    assert_int_equal(srnf_mesh_prepare(&copy, false, &report), SRNF_OK);
    assert_int_equal(srnf_encode(&copy, &report, &options, NULL, &encoded, NULL), SRNF_OK);
    memcpy(f, encoded.coefficients, 3 * srnf_coefficient_count(DEGREE) * sizeof(double));
    if (!before) {
        srnf_surface_mirror(DEGREE, f);
    }
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&copy);
}

static double registered(const struct shapes_surface *s, const double *a, const double *b,
                         enum srnf_register_start start)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration registration;
    double distance;

    options.start = start;
    options.degree = 6;
    assert_true(srnf_register(s->sht, a, NULL, b, &options, NULL, NULL, &registration, NULL) >= 0);
    distance = registration.distance;
    srnf_registration_clear(&registration);
    return distance;
}

/* Rays do not know left from right: by the route star the two ways give the same surface. The map
   of the route area is another one, of the same shape. */
static void encoding_the_mirrored_mesh_gives_the_image(void **state)
{
    struct srnf_mesh star = meshes_bumpy(24, 5), thalamus = {0};
    struct shapes_surface s;
    double *a, *b;
    (void)state;

    shapes_open(&s, DEGREE);
    a = shapes_doubles(s.count);
    b = shapes_doubles(s.count);
    encode(&star, false, SRNF_PARAMETERIZATION_STAR, a);
    encode(&star, true, SRNF_PARAMETERIZATION_STAR, b);
    figure_below("star: encoded mirrored, and mirrored then", shapes_distance(DEGREE, a, b), 1e-9);
    assert_true(meshes_load("tests/data/aal_subcortex/L_thalamus.ply", &thalamus));
    encode(&thalamus, false, SRNF_PARAMETERIZATION_AREA, a);
    encode(&thalamus, true, SRNF_PARAMETERIZATION_AREA, b);
    figure_below("area: the same, registered", registered(&s, a, b, SRNF_START_RIGID), 0.02);
    srnf_free(b);
    srnf_free(a);
    srnf_mesh_clear(&thalamus);
    srnf_mesh_clear(&star);
    shapes_close(&s);
}

/* ---- Left and right -------------------------------------------------------------------------- */

static void homologues_match_mirrored(void **state)
{
    static const char *const names[2][2] = {{"L_caudate", "R_caudate"}, {"L_putamen", "R_putamen"}};
    (void)state;

    for (size_t k = 0; k < 2; k++) {
        struct shapes_surface s[3];
        double plain, mirrored, other;

        for (size_t i = 0; i < 3; i++) {
            shapes_open(&s[i], DEGREE);
            assert_true(shapes_fill_structure(&s[i], i < 2 ? names[k][i] : names[1 - k][0],
                                              SRNF_PARAMETERIZATION_AREA));
        }
        plain = registered(&s[0], s[0].f, s[1].f, SRNF_START_TOURNAMENT);
        srnf_surface_mirror(DEGREE, s[1].f);
        mirrored = registered(&s[0], s[0].f, s[1].f, SRNF_START_TOURNAMENT);
        other = registered(&s[0], s[0].f, s[2].f, SRNF_START_TOURNAMENT);
        printf("# %s, %s: %.4f as they are, %.4f mirrored; %.4f to %s\n", names[k][0], names[k][1],
               plain, mirrored, other, names[1 - k][0]);
        assert_true(mirrored < 0.9 * plain && mirrored < other);
        for (size_t i = 0; i < 3; i++) {
            shapes_close(&s[i]);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(image_is_the_surface_reflected_twice),
        cmocka_unit_test(image_of_the_image_is_the_surface),
        cmocka_unit_test(planes_are_chosen_by_their_normals),
        cmocka_unit_test(image_keeps_measures_and_reflects_the_srnf),
        cmocka_unit_test(mirrored_mesh_stays_outward),
        cmocka_unit_test(encoding_the_mirrored_mesh_gives_the_image),
        cmocka_unit_test(homologues_match_mirrored),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
