/*
 * test_geometry_allocation.c - preparation, star kernel, index, geodesic sphere and fit error when
 * memory runs out: each allocation in turn is refused; the call fails cleanly and nothing leaks.
 */
#include "surface/fit.h"
#include "support/meshes.h"
#include "support/refusing.h"

/* Each runs one function on a mesh and frees what it made. */
static int run_prepare(struct srnf_mesh *mesh)
{
    struct srnf_mesh_report report;

    return srnf_mesh_prepare(mesh, true, &report);
}

static struct srnf_mesh partner; /* the same soup, for functions of two meshes */

static int run_prepare_pair(struct srnf_mesh *mesh)
{
    struct srnf_mesh_report report;

    return srnf_mesh_prepare_pair(mesh, &partner, &report);
}

static int run_star_kernel(struct srnf_mesh *mesh)
{
    struct srnf_star star;

    return srnf_star_kernel(mesh, &star);
}

static int run_prepare_within(struct srnf_mesh *mesh)
{
    const struct srnf_context context = {.user = NULL};
    struct srnf_mesh_report report;

    return srnf_mesh_prepare_within(mesh, true, &context, &report);
}

static int run_prepare_pair_within(struct srnf_mesh *mesh)
{
    const struct srnf_context context = {.user = NULL};
    struct srnf_mesh_report report;

    return srnf_mesh_prepare_pair_within(mesh, &partner, &context, &report);
}

static int run_star_kernel_within(struct srnf_mesh *mesh)
{
    const struct srnf_context context = {.user = NULL};
    struct srnf_star star;

    return srnf_star_kernel_within(mesh, &context, &star);
}

static int run_star_at(struct srnf_mesh *mesh)
{
    const double center[3] = {0, 0, 0};
    struct srnf_star star;

    return srnf_star_at(mesh, center, &star);
}

static int run_index(struct srnf_mesh *mesh)
{
    struct srnf_index *index;
    int status = srnf_index_create(&index, mesh);

    assert_int_equal(index == NULL, status != SRNF_OK);
    srnf_index_destroy(index);
    return status;
}

static int run_icosphere(struct srnf_mesh *mesh)
{
    struct srnf_mesh sphere = {0};
    int status = srnf_mesh_icosphere(3, &sphere);

    (void)mesh;
    srnf_mesh_clear(&sphere);
    return status;
}

static int run_fit(struct srnf_mesh *mesh)
{
    struct srnf_index *index;
    struct srnf_fit fit;
    int status = srnf_index_create(&index, mesh);

    if (status == SRNF_OK) {
        status = srnf_fit_measure(mesh, index, mesh, NULL, &fit);
    }
    srnf_index_destroy(index);
    return status;
}

static int (*function)(struct srnf_mesh *mesh);

/* The mesh is made anew, as preparing changes it, and nothing of that is refused or counted. */
static int run_function(void)
{
    const size_t index = refusing.refused;
    struct srnf_mesh sphere, mesh;
    size_t before;
    int status;

    refusing_none();
    sphere = meshes_sphere(4);
    mesh = meshes_soup(&sphere);
    partner = meshes_soup(&sphere);
    before = refusing.alive;
    refusing_at(index);
    status = function(&mesh);
    assert_true(status == SRNF_OK || status == SRNF_ENOMEM);
    assert_int_equal(refusing.alive, before);
    srnf_mesh_clear(&partner);
    srnf_mesh_clear(&mesh);
    srnf_mesh_clear(&sphere);
    return status;
}

static struct srnf_mesh open_mesh; /* with near vertices, and without some faces */

static int run_mend(struct srnf_mesh *mesh)
{
    const struct srnf_mend_options options = {.orient = true,
                                              .islands = true,
                                              .duplicates = true,
                                              .degenerate = true,
                                              .merge = 1e-6,
                                              .holes = 10.0};
    struct srnf_mended mended;
    int status = srnf_mend(&open_mesh, &options, NULL, &mended, NULL);

    (void)mesh;
    assert_true(status != SRNF_OK || mended.n_changes >= 2);
    assert_true(status == SRNF_OK || !mended.mesh.vertices);
    srnf_mended_clear(&mended);
    return status;
}

static int run_distance(struct srnf_mesh *mesh)
{
    struct srnf_mesh_distance distance;

    return srnf_mesh_distance(mesh, &open_mesh, NULL, &distance);
}

static int run_crossings(struct srnf_mesh *mesh)
{
    struct srnf_mesh_crossings crossings;

    return srnf_mesh_find_crossings(mesh, NULL, &crossings);
}

static struct srnf_mesh torus;

static int run_handles(struct srnf_mesh *mesh)
{
    struct srnf_mended mended = {.n_changes = 0};
    int status = srnf_mend_handles(&torus, 16, NULL, &mended, NULL);

    (void)mesh;
    assert_true(status != SRNF_OK || mended.n_changes >= 2);
    srnf_mended_clear(&mended);
    return status;
}

static void each_refusal_is_survived(void **state)
{
    static const struct {
        const char *name;
        int (*run)(struct srnf_mesh *mesh);
    } subjects[] = {
        {"prepare", run_prepare},
        {"prepare a pair", run_prepare_pair},
        {"star kernel", run_star_kernel},
        {"prepare within", run_prepare_within},
        {"prepare a pair within", run_prepare_pair_within},
        {"star kernel within", run_star_kernel_within},
        {"star at", run_star_at},
        {"index", run_index},
        {"icosphere", run_icosphere},
        {"fit", run_fit},
        {"mend", run_mend},
        {"distance", run_distance},
        {"distance", run_crossings},
        {"handles", run_handles},
    };
    bool drop[180] = {[7] = true, [8] = true};
    struct srnf_mesh whole;
    (void)state;

    refusing_none();
    whole = meshes_sphere(3);
    open_mesh = meshes_without_faces(&whole, drop);
    srnf_mesh_clear(&whole);
    whole = open_mesh;
    open_mesh = meshes_soup(&whole);
    srnf_mesh_clear(&whole);
    open_mesh.vertices[0] += 1e-8;
    torus = meshes_torus(1.0, 0.4, 12, 8);

    for (size_t i = 0; i < sizeof subjects / sizeof subjects[0]; i++) {
        size_t total;

        function = subjects[i].run;
        total = refusing_sweep(subjects[i].name, run_function, 0, 1);
        assert_true(total > 1 && total < 200);
    }
    refusing_none();
    srnf_mesh_clear(&open_mesh);
    srnf_mesh_clear(&torus);
    assert_int_equal(refusing.alive, 0);
}

/* Queries are re-entrant and cost no memory. */
static void queries_allocate_nothing(void **state)
{
    const double origin[3] = {0, 0, 0}, direction[3] = {1, 2, 3};
    struct srnf_index *index;
    struct srnf_mesh mesh;
    double t;
    (void)state;

    refusing_none();
    mesh = meshes_sphere(4);
    assert_int_equal(srnf_index_create(&index, &mesh), SRNF_OK);
    refusing_at(0);
    assert_true(srnf_index_ray(index, origin, direction, &t, NULL));
    assert_true(srnf_index_distance2(index, direction, NULL, NULL) > 0.0);
    assert_int_equal(refusing.requests, 0);
    srnf_index_destroy(index);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_refusal_is_survived),
        cmocka_unit_test(queries_allocate_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
