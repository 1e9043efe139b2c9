/*
 * test_spherical_stress.c - meshes on which a spherical parameterization may fail, and what is no
 * closed surface of genus zero at all: each call ends in a valid map or in an error that says why,
 * in bounded time, and never in a flipped map.
 *
 * srnfd-test: timeout 300
 * srnfd-test: slow
 * srnfd-test: no-asan (test_spherical_allocation.c and core/mesh/test_prepare.c run its code)
 */
#include "spherical_checks.h"

#ifndef RANDOM_MESHES /* test_spherical_stress_nightly.c has more */
#define RANDOM_MESHES (CHECK_SLOW ? 8 : 50)
#define HUB_VALENCE (CHECK_SLOW ? 4000 : 25000)
#endif
#define RANDOM_FACES 3000

/* Runs and frees; the mesh is one that the map must manage, in so many seconds. */
static void must_map(const char *name, struct srnf_mesh mesh, double seconds)
{
    struct srnf_spherical_map map;
    double start = timing_cpu();

    assert_int_equal(check_map(name, &mesh, &map), SRNF_OK);
    assert_true(CHECK_SLOW || timing_cpu() - start <= seconds);
    srnf_free(map.points);
    srnf_mesh_clear(&mesh);
}

/* The same where a clear error will do: true if there is a map. */
static bool may_map(const char *name, struct srnf_mesh mesh)
{
    struct srnf_spherical_map map;
    int status = check_map(name, &mesh, &map);

    assert_true(status == SRNF_OK || status == SRNF_ENUMERIC || status == SRNF_EDEGENERATE);
    srnf_free(map.points);
    srnf_mesh_clear(&mesh);
    return status == SRNF_OK;
}

/* ---- Shapes ---------------------------------------------------------------------------------- */

static struct srnf_mesh ellipsoid(double x, double y, double z)
{
    struct srnf_mesh mesh = meshes_sphere(16);

    meshes_stretch(&mesh, x, y, z);
    return mesh;
}

static void test_ellipsoids(void **state)
{
    (void)state;
    must_map("ellipsoid 1:1:100", ellipsoid(1, 1, 100), 10);
    must_map("ellipsoid 1:100:100", ellipsoid(1, 100, 100), 10);
    must_map("ellipsoid 1:10:100", ellipsoid(1, 10, 100), 10);
    must_map("ellipsoid 1:1e6:1e6", ellipsoid(1, 1e6, 1e6), 10);
    (void)may_map("ellipsoid 1:1:1e6", ellipsoid(1, 1, 1e6));
}

static void helix_path(double t, double x[3])
{
    x[0] = cos(31.4 * t);
    x[1] = sin(31.4 * t);
    x[2] = 3.0 * t;
}

static double helix_radius(double t)
{
    return 0.12 + 0.0 * t;
}

static void line_path(double t, double x[3])
{
    x[0] = t;
    x[1] = 0.0;
    x[2] = 0.0;
}

static double dumbbell_radius(double t)
{
    double end = compare_min(t, 1.0 - t); /* balls of radius 0.15 on a rod of 0.02 */

    return compare_max(0.02, end < 0.3 ? sqrt(compare_max(0.0, end * (0.3 - end))) : 0.0);
}

static void spiral_path(double t, double x[3])
{
    x[0] = (0.2 + t) * cos(25.0 * t);
    x[1] = (0.2 + t) * sin(25.0 * t);
    x[2] = 0.0;
}

static double spiral_radius(double t)
{
    return 0.05 + 0.03 * t;
}

static void test_tubes(void **state)
{
    (void)state;
    must_map("helix", triangulations_tube(helix_path, helix_radius, 200, 12), 10);
    must_map("dumbbell", triangulations_tube(line_path, dumbbell_radius, 100, 16), 10);
    must_map("spiral", triangulations_tube(spiral_path, spiral_radius, 200, 12), 10);
    must_map("three-sided tube", triangulations_tube(helix_path, helix_radius, 100, 3), 10);
}

/* Positions that coincide, along with triangles without area. */
static void test_coincident(void **state)
{
    struct test_random random = test_random_seed(1);
    struct srnf_mesh mesh = meshes_sphere(16);
    (void)state;

    for (size_t i = 0; i < mesh.n_vertices; i++) {
        mesh.vertices[i] = 0.5; /* the first third of the coordinates */
    }
    must_map("a third coincident", meshes_copy(&mesh), 10);
    for (size_t v = 0; v < mesh.n_vertices; v++) {
        for (size_t k = 0; k < 3; k++) {
            mesh.vertices[3 * v + k] = v % 300 == 0 ? test_random_normal(&random) : 0.0;
        }
    }
    (void)may_map("all coincident but nine", meshes_copy(&mesh));
    for (size_t i = 0; i < 3 * mesh.n_vertices; i++) {
        mesh.vertices[i] = i % 3 == 0 ? test_random_normal(&random) : 0.0;
    }
    mesh.vertices[1] = 1.0;
    (void)may_map("all but one on a line", meshes_copy(&mesh));
    for (size_t v = 0; v < mesh.n_vertices; v++) {
        mesh.vertices[3 * v + 2] = 0.0;
    }
    (void)may_map("flat", meshes_copy(&mesh));
    srnf_mesh_clear(&mesh);
}

/* ---- Valences -------------------------------------------------------------------------------- */

static void axis_path(double t, double x[3])
{
    x[0] = 0.0;
    x[1] = 0.0;
    x[2] = cos(3.14 * (0.002 + 0.996 * t));
}

static double sphere_radius(double t)
{
    return sin(3.14 * (0.002 + 0.996 * t));
}

/* Meridians and circles of latitude: common, and all meridians meet in two vertices. */
static void test_globes(void **state)
{
    (void)state;
    must_map("globe 32 x 64", triangulations_tube(axis_path, sphere_radius, 32, 64), 5);
    must_map("globe 50 x 200", triangulations_tube(axis_path, sphere_radius, 50, 200), 5);
    must_map("globe 5 x 500", triangulations_tube(axis_path, sphere_radius, 5, 500), 5);
}

/* Faces much slimmer than the metric lets them be pull the map in two directions: fans are worse
   the larger they are, and may end in an error. */
static void test_hubs(void **state)
{
    size_t large = HUB_VALENCE;
    (void)state;

    must_map("fan of valence 2,000", triangulations_fan(2000), 5);
    must_map("two hubs of valence 2,000", triangulations_bipyramid(2000), 5);
    must_map("two hubs of large valence", triangulations_bipyramid(large), 60);
    (void)may_map("fan of valence 3,000", triangulations_fan(3000));
    (void)may_map("fan of large valence", triangulations_fan(large / 5));
}

static void test_small(void **state)
{
    (void)state;
    must_map("tetrahedron", meshes_tetrahedron(), 1);
    must_map("box", meshes_box(1, 2, 3), 1);
    for (size_t n = 3; n < 12; n++) {
        char name[40];

        (void)snprintf(name, sizeof name, n == 4 ? "octahedron" : "bipyramid over %zu", n);
        must_map(name, triangulations_bipyramid(n), 1);
        (void)snprintf(name, sizeof name, "fan of valence %zu", n);
        must_map(name, triangulations_fan(n), 1);
    }
    for (size_t n = 5; n < 14; n++) {
        struct test_random random = test_random_seed(n);

        must_map("stacked, small", triangulations_stacked(n, false, &random), 1);
    }
}

/* Vertices over faces over faces: needles, many of valence 3, and separating triangles in which an
   edge must not be collapsed. Nested ones shrink beyond what doubles hold. */
static void test_stacked(void **state)
{
    struct test_random random = test_random_seed(5);
    (void)state;

    for (size_t n = 50; n <= 5000; n *= 10) {
        must_map("stacked", triangulations_stacked(n, false, &random), 10);
    }
    must_map("nested, 20", triangulations_stacked(20, true, &random), 10);
    (void)may_map("nested, 2000", triangulations_stacked(2000, true, &random));
}

/* ---- Connectivity at random ------------------------------------------------------------------ */

static void test_flips_and_jitter(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 4; seed++) {
        struct test_random random = test_random_seed(seed);
        struct srnf_mesh mesh = meshes_sphere(12);

        triangulations_jitter(&mesh, 0.02 * (double)(1 + seed), &random);
        triangulations_flip_edges(&mesh, mesh.n_faces << seed, &random);
        must_map("flips and jitter", mesh, 10);
    }
}

/* Positions without any relation to the connectivity: normal, on a line nearly, mostly one point,
   of wild sizes. */
static void scatter(struct srnf_mesh *mesh, size_t kind, struct test_random *random)
{
    size_t apart = 4 + test_random_below(random, 4);

    for (size_t v = 0; v < mesh->n_vertices; v++) {
        double *x = mesh->vertices + 3 * v;

        if (kind == 0) {
            continue;
        }
        test_random_normals(random, 3, x);
        for (size_t k = 0; k < 3; k++) {
            x[k] *= kind == 2 && k > 0 ? 1e-9 : 1.0;
            x[k] *= kind == 3 && v >= apart ? 0.0 : 1.0;
            x[k] *= kind == 4 ? exp(20.0 * test_random_normal(random)) : 1.0;
        }
    }
}

static void test_random_meshes(void **state)
{
    static const char *const kinds[] = {"as built", "normal", "nearly on a line",
                                        "mostly one point", "of wild sizes"};
    size_t mapped[5] = {0};
    size_t retried[5] = {0};
    size_t tried[5] = {0};
    (void)state;

    for (size_t i = 0; i < RANDOM_MESHES; i++) {
        struct test_random random = test_random_seed(100 + i);
        size_t n = 4 + test_random_below(&random, 4 + RANDOM_FACES / 2 / (1 + i % 17));
        struct srnf_mesh mesh = triangulations_stacked(n, false, &random);
        struct srnf_spherical_map map;
        size_t kind = i % 5;
        int status;

        triangulations_flip_edges(&mesh, test_random_below(&random, 10 * n), &random);
        scatter(&mesh, kind, &random);
        status = srnf_spherical_map(&mesh, NULL, &map, NULL);
        assert_true(status == SRNF_OK || status == SRNF_ENUMERIC || status == SRNF_EDEGENERATE);
        if (status == SRNF_OK) {
            check_bijection(&mesh, &map);
            mapped[kind]++;
            retried[kind] += map.attempts > 1;
        }
        tried[kind]++;
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
    for (size_t k = 0; k < 5; k++) {
        printf("# random triangulations, %-16s: %zu of %zu mapped, %zu not at once\n", kinds[k],
               mapped[k], tried[k], retried[k]);
    }
    assert_int_equal(mapped[0], tried[0]);
    assert_int_equal(mapped[1], tried[1]);
}

static void test_large(void **state)
{
    size_t frequency = CHECK_SLOW ? 20 : 100;
    struct srnf_mesh mesh = meshes_bumpy(frequency, 3);
    (void)state;

    printf("# %zu faces:\n", mesh.n_faces);
    must_map("bumpy sphere", mesh, 30);
}

/* ---- No closed surfaces of genus zero -------------------------------------------------------- */

/* The status a mesh must be refused with; it is cleared. */
static void must_refuse(const char *name, struct srnf_mesh mesh, int expected)
{
    struct srnf_spherical_map map;
    int status = check_map(name, &mesh, &map);

    assert_int_equal(status, expected);
    assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), expected);
    srnf_mesh_clear(&mesh);
}

/* Vertex `from` becomes vertex `to`, and the last vertex takes its number. */
static void merge(struct srnf_mesh *mesh, uint32_t from, uint32_t to)
{
    uint32_t last = (uint32_t)--mesh->n_vertices;

    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        mesh->faces[c] = mesh->faces[c] == from ? to : mesh->faces[c];
        mesh->faces[c] = mesh->faces[c] == last ? from : mesh->faces[c];
    }
    memcpy(mesh->vertices + 3 * (size_t)from, mesh->vertices + 3 * (size_t)last,
           3 * sizeof(double));
}

static struct srnf_mesh joined(struct srnf_mesh a, struct srnf_mesh b)
{
    struct srnf_mesh both = meshes_join(&a, &b);

    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
    return both;
}

static struct srnf_mesh with_unused_vertex(struct srnf_mesh mesh)
{
    struct srnf_mesh more = joined(mesh, meshes_blank(1, 0));

    return more;
}

/* Those whose numbers of vertices and faces do not fit. */
static void test_wrong_counts(void **state)
{
    struct srnf_mesh pillow = meshes_blank(3, 2);
    (void)state;

    memcpy(pillow.faces, (uint32_t[6]){0, 1, 2, 0, 2, 1}, 6 * sizeof(uint32_t));
    pillow.vertices[3] = 1.0;
    pillow.vertices[7] = 1.0;
    must_refuse("two triangles back to back", pillow, SRNF_EGENUS);
    must_refuse("torus", meshes_torus(2, 1, 12, 8), SRNF_EGENUS);
    must_refuse("projective plane", meshes_projective_plane(), SRNF_ENOT_ORIENTED);
    must_refuse("two spheres", meshes_two_spheres(3), SRNF_ECOMPONENTS);
    must_refuse("sphere with a hole", meshes_sphere_with_hole(3), SRNF_ENOT_CLOSED);
    must_refuse("nothing", (struct srnf_mesh){0}, SRNF_EGENUS);
}

/* Those that pass for genus zero by their counts. */
static void test_right_counts(void **state)
{
    struct srnf_mesh mesh;
    (void)state;

    must_refuse("sphere beside torus", joined(meshes_sphere(3), meshes_torus(2, 1, 12, 8)),
                SRNF_ECOMPONENTS);
    must_refuse("tetrahedron beside torus", joined(meshes_tetrahedron(), meshes_torus(2, 1, 12, 8)),
                SRNF_ECOMPONENTS);
    must_refuse("Klein bottle beside sphere", joined(meshes_klein_bottle(12, 8), meshes_sphere(3)),
                SRNF_ENOT_ORIENTED);
    must_refuse("two tetrahedra on an edge", meshes_shared_edge(), SRNF_ENOT_MANIFOLD);
    must_refuse("a face turned", meshes_one_face_turned(4), SRNF_ENOT_ORIENTED);
    mesh = meshes_two_spheres(4);
    merge(&mesh, (uint32_t)mesh.n_vertices - 1, 5);
    merge(&mesh, (uint32_t)mesh.n_vertices - 1, 50);
    must_refuse("two spheres that touch twice", mesh, SRNF_ENOT_MANIFOLD);
    mesh = meshes_sphere(4);
    merge(&mesh, 3, 100);
    must_refuse("pinched sphere and a lone vertex", with_unused_vertex(mesh), SRNF_ENOT_MANIFOLD);
    mesh = joined(meshes_sphere(2), meshes_blank(2, 4));
    memset(mesh.faces + 3 * (mesh.n_faces - 4), 0, 12 * sizeof(uint32_t));
    must_refuse("faces that are points", mesh, SRNF_EDEGENERATE);
    mesh = meshes_sphere(4);
    memcpy(mesh.faces, mesh.faces + 3, 3 * sizeof(uint32_t));
    must_refuse("a face twice", mesh, SRNF_ENOT_CLOSED);
    mesh = with_unused_vertex(meshes_sphere(2));
    mesh = joined(mesh, meshes_blank(1, 4));
    memcpy(mesh.faces + 3 * (mesh.n_faces - 4), (uint32_t[12]){0, 1, 2, 0, 2, 1, 3, 4, 5, 3, 5, 4},
           12 * sizeof(uint32_t));
    must_refuse("pairs of faces inside", mesh, SRNF_ENOT_MANIFOLD);
}

/* Any indices and any numbers at all. */
static void test_garbage(void **state)
{
    struct test_random random = test_random_seed(9);
    struct srnf_mesh mesh;
    (void)state;

    mesh = meshes_sphere(3);
    mesh.faces[7] = (uint32_t)mesh.n_vertices;
    must_refuse("an index out of range", mesh, SRNF_EINVAL);
    for (size_t i = 0; i < 4; i++) {
        mesh = meshes_sphere(3);
        mesh.vertices[100] = (double[4]){(double)NAN, (double)INFINITY, 1e300, -1e101}[i];
        must_refuse("a coordinate that is none", mesh, SRNF_EDEGENERATE);
    }
    mesh = meshes_sphere(3);
    meshes_scale(&mesh, 0.0);
    must_refuse("one point", mesh, SRNF_EDEGENERATE);
    mesh = meshes_sphere(3);
    meshes_stretch(&mesh, 1.0, 0.0, 0.0);
    must_refuse("a line", mesh, SRNF_EDEGENERATE);
    for (size_t i = 0; i < 1000; i++) {
        size_t n = 4 + test_random_below(&random, 30);
        struct srnf_spherical_map map;
        int status;

        mesh = triangulations_stacked(n, false, &random);
        for (size_t k = 0; k < 1 + i % 40; k++) {
            mesh.faces[test_random_below(&random, 3 * mesh.n_faces)] =
                (uint32_t)test_random_below(&random, n);
        }
        status = srnf_spherical_map(&mesh, NULL, &map, NULL);
        if (status == SRNF_OK) { /* a draw can leave the mesh as it was */
            check_bijection(&mesh, &map);
        }
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wrong_counts),
        cmocka_unit_test(test_right_counts),
        cmocka_unit_test(test_garbage),
        cmocka_unit_test(test_ellipsoids),
        cmocka_unit_test(test_tubes),
        cmocka_unit_test(test_coincident),
        cmocka_unit_test(test_small),
        cmocka_unit_test(test_stacked),
        cmocka_unit_test(test_flips_and_jitter),
        cmocka_unit_test(test_random_meshes),
        cmocka_unit_test(test_globes),
        cmocka_unit_test(test_hubs),
        cmocka_unit_test(test_large),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
