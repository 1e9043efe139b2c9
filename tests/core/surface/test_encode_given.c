/*
 * test_encode_given.c - encoding by a sphere that comes with the mesh: the library's own map given
 * back, spheres of other radius, place and rotation, and every sphere that is none, refused by
 * name.
 */
#include "core/figures.h"
#include "sphere_map/sphere_map.h"
#include "support/meshes.h"
#include "support/triangulations.h"

#define DEGREE 23
#define CAUDATE "tests/data/aal_subcortex/L_caudate.ply"

/* A mesh and a map of it, as a mesh. */
struct pair {
    struct srnf_mesh mesh, sphere;
    struct srnf_mesh_report report;
    struct srnf_encode_options options;
};

static void open_pair(struct pair *pair)
{
    struct srnf_mesh_report of_sphere;
    struct srnf_spherical_map map;

    assert_true(meshes_load(CAUDATE, &pair->mesh));
    assert_int_equal(srnf_mesh_prepare(&pair->mesh, false, &pair->report), SRNF_OK);
    assert_int_equal(srnf_spherical_map(&pair->mesh, NULL, &map, NULL), SRNF_OK);
    pair->sphere = meshes_copy(&pair->mesh);
    memcpy(pair->sphere.vertices, map.points, 3 * pair->mesh.n_vertices * sizeof(double));
    srnf_free(map.points);
    assert_int_equal(srnf_mesh_prepare(&pair->sphere, false, &of_sphere), SRNF_OK);
    assert_int_equal(of_sphere.n_problems, 0);
    pair->options = srnf_encode_options_defaults();
    pair->options.degree = DEGREE;
    pair->options.parameterization = SRNF_PARAMETERIZATION_GIVEN;
    pair->options.sphere = &pair->sphere;
}

static void close_pair(struct pair *pair)
{
    srnf_mesh_clear(&pair->mesh);
    srnf_mesh_clear(&pair->sphere);
}

static void encode(const struct pair *pair, struct srnf_encoded *encoded)
{
    struct srnf_error error = {0};
    int status = srnf_encode(&pair->mesh, &pair->report, &pair->options, NULL, encoded, &error);

    if (status != SRNF_OK) {
        fail_msg("status %d: %s", status, error.message);
    }
}

/* ---- What is accepted ------------------------------------------------------------------------ */

static void own_map_given_back(void **state)
{
    struct pair pair;
    struct srnf_encoded given;
    struct srnf_encoded area;
    double apart;
    (void)state;

    open_pair(&pair);
    encode(&pair, &given);
    assert_int_equal(given.route, SRNF_PARAMETERIZATION_GIVEN);
    pair.options.parameterization = SRNF_PARAMETERIZATION_AREA;
    encode(&pair, &area);
    apart = shapes_distance(DEGREE, given.coefficients, area.coefficients);
    figure_below("surfaces apart", apart, 1e-10);
    figure_below("energy off by",
                 fabs(given.distortion.symmetric_dirichlet - area.distortion.symmetric_dirichlet),
                 1e-9);
    figure_below("deviation off by",
                 fabs(given.distortion.log_area_deviation - area.distortion.log_area_deviation),
                 1e-9);
    assert_int_equal(given.distortion.flipped, 0);
    srnf_free(given.coefficients);
    srnf_free(area.coefficients);
    close_pair(&pair);
}

/* As FreeSurfer writes them: radius 100, single precision; here with another centre, too. */
static void radius_and_place_do_not_matter(void **state)
{
    struct pair pair;
    struct srnf_encoded still;
    struct srnf_encoded moved;
    (void)state;

    open_pair(&pair);
    encode(&pair, &still);
    meshes_scale(&pair.sphere, 100.0);
    meshes_move(&pair.sphere, 7.0, -30.0, 2.5);
    for (size_t i = 0; i < 3 * pair.sphere.n_vertices; i++) {
        pair.sphere.vertices[i] = (float)pair.sphere.vertices[i];
    }
    encode(&pair, &moved);
    figure_below("radius 100, moved, in single precision: surfaces apart",
                 shapes_distance(DEGREE, still.coefficients, moved.coefficients), 1e-5);
    srnf_free(still.coefficients);
    srnf_free(moved.coefficients);
    close_pair(&pair);
}

/* f'(R s) = f(s): the same surface, its parameters turned with the sphere. */
static void rotation_is_kept(void **state)
{
    struct test_random random = test_random_seed(8);
    struct pair pair;
    struct srnf_encoded still;
    struct srnf_encoded turned;
    double rotation[9];
    double points[2][300];
    double values[2][300];
    double square = 0.0;
    (void)state;

    open_pair(&pair);
    encode(&pair, &still);
    shapes_random_rotation(&random, rotation);
    for (size_t i = 0; i < pair.sphere.n_vertices; i++) {
        shapes_rotate(rotation, 1, pair.sphere.vertices + 3 * i);
    }
    encode(&pair, &turned);
    for (size_t i = 0; i < 100; i++) {
        test_random_direction(&random, points[0] + 3 * i);
        memcpy(points[1] + 3 * i, points[0] + 3 * i, 3 * sizeof(double));
        shapes_rotate(rotation, 1, points[1] + 3 * i);
    }
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(srnf_harmonics_at_points(DEGREE, 3,
                                                  k == 0 ? still.coefficients : turned.coefficients,
                                                  100, points[k], values[k], NULL),
                         SRNF_OK);
    }
    for (size_t i = 0; i < 300; i++) {
        square += (values[0][i] - values[1][i]) * (values[0][i] - values[1][i]);
    }
    /* The mesh has detail beyond the degree, which the grid sees otherwise when it is turned. */
    figure_below("turned sphere: points of equal parameter apart, at area 1", sqrt(square / 100.0),
                 1e-3);
    srnf_free(still.coefficients);
    srnf_free(turned.coefficients);
    close_pair(&pair);
}

/* ---- What is refused ------------------------------------------------------------------------- */

/* Encoding fails with SRNF_EINVAL, a sentence that contains `words`, and this element. */
static void refused(struct pair *pair, const char *words, int64_t element)
{
    struct srnf_error error = {0};
    struct srnf_encoded encoded;

    assert_int_equal(
        srnf_encode(&pair->mesh, &pair->report, &pair->options, NULL, &encoded, &error),
        SRNF_EINVAL);
    printf("# %s\n", error.message);
    assert_int_equal(error.status, SRNF_EINVAL);
    assert_non_null(strstr(error.message, words));
    assert_int_equal(error.element, element);
    assert_null(encoded.coefficients);
}

/* A vertex carried across a far edge of one of its faces turns that face over, and others. */
static void flipped_face(void **state)
{
    struct pair pair;
    const uint32_t *face;
    size_t moved = 500;
    double *p;
    int64_t first = -1;
    (void)state;

    open_pair(&pair);
    face = pair.sphere.faces + 3 * moved;
    p = pair.sphere.vertices + 3 * (size_t)face[0];
    for (size_t c = 0; c < 3; c++) {
        double middle = pair.sphere.vertices[3 * (size_t)face[1] + c] +
                        pair.sphere.vertices[3 * (size_t)face[2] + c];

        p[c] = middle - p[c];
    }
    {
        double length = figure_norm(3, p);

        for (size_t c = 0; c < 3; c++) {
            p[c] /= length;
        }
    }
    for (size_t f = 0; f < pair.sphere.n_faces && first < 0; f++) {
        const uint32_t *v = pair.sphere.faces + 3 * f;
        const double *a = pair.sphere.vertices + 3 * (size_t)v[0];
        const double *b = pair.sphere.vertices + 3 * (size_t)v[1];
        const double *c = pair.sphere.vertices + 3 * (size_t)v[2];

        if (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                a[2] * (b[0] * c[1] - b[1] * c[0]) <
            -1e-12) {
            first = (int64_t)f;
        }
    }
    assert_true(first >= 0 && first <= (int64_t)moved);
    refused(&pair, "turned over", first);
    close_pair(&pair);
}

static void vertex_off_the_sphere(void **state)
{
    struct pair pair;
    (void)state;

    open_pair(&pair);
    for (size_t c = 0; c < 3; c++) {
        pair.sphere.vertices[3 * 123 + c] *= 1.03;
    }
    refused(&pair, "vertex 123", 123);
    close_pair(&pair);
}

static void other_faces(void **state)
{
    struct pair pair;
    uint32_t kept;
    (void)state;

    open_pair(&pair);
    kept = pair.sphere.faces[3 * 77];
    pair.sphere.faces[3 * 77] = pair.sphere.faces[3 * 77 + 1];
    refused(&pair, "face 77", 77);
    pair.sphere.faces[3 * 77] = kept;
    pair.sphere.n_faces--;
    refused(&pair, "faces", -1);
    pair.sphere.n_faces++;
    pair.options.sphere = NULL;
    refused(&pair, "needs a sphere", -1);
    close_pair(&pair);
}

/* No sphere at all: the mesh itself; one whose vertices are all one point; one in a plane. */
static void no_sphere(void **state)
{
    struct pair pair;
    size_t n;
    (void)state;

    open_pair(&pair);
    n = pair.mesh.n_vertices;
    memcpy(pair.sphere.vertices, pair.mesh.vertices, 3 * n * sizeof(double));
    refused(&pair, "vertex 0", 0);
    for (size_t i = 0; i < n; i++) {
        pair.sphere.vertices[3 * i + 2] = 0.0;
    }
    refused(&pair, "on none", -1);
    memset(pair.sphere.vertices, 0, 3 * n * sizeof(double));
    refused(&pair, "on none", -1);
    close_pair(&pair);
}

/* Longitudes doubled: every face is positively oriented, and the sphere is covered twice. */
static void covered_twice(void **state)
{
    struct pair pair = {.mesh = triangulations_bipyramid(24)};
    (void)state;

    assert_int_equal(srnf_mesh_prepare(&pair.mesh, false, &pair.report), SRNF_OK);
    pair.options = srnf_encode_options_defaults();
    pair.options.degree = DEGREE;
    pair.options.parameterization = SRNF_PARAMETERIZATION_GIVEN;
    pair.sphere = meshes_copy(&pair.mesh);
    pair.options.sphere = &pair.sphere;
    for (size_t i = 0; i < pair.sphere.n_vertices; i++) {
        double *p = pair.sphere.vertices + 3 * i;
        double x = p[0];

        if (fabs(p[2]) < 0.5) {
            p[0] = x * x - p[1] * p[1];
            p[1] = 2.0 * x * p[1];
        } else {
            p[2] /= fabs(p[2]);
        }
    }
    refused(&pair, "more than once", -1);
    close_pair(&pair);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(own_map_given_back),
        cmocka_unit_test(radius_and_place_do_not_matter),
        cmocka_unit_test(rotation_is_kept),
        cmocka_unit_test(flipped_face),
        cmocka_unit_test(vertex_off_the_sphere),
        cmocka_unit_test(other_faces),
        cmocka_unit_test(no_sphere),
        cmocka_unit_test(covered_twice),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
