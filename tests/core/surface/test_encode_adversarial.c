/*
 * test_encode_adversarial.c - meshes that a map to the sphere may get wrong: surfaces as programs
 * of marching cubes write them, and slivers, gaps of 1e-9, spikes, a folded flap and a needle. Each
 * becomes the surface that it is, or is refused by name; none becomes another shape.
 *
 * srnfd-test: slow
 */
#include "core/figures.h"
#include "support/meshes.h"
#include "support/random.h"

#define FOLDER "tests/data/marching_cubes/"
#define CAUDATE "tests/data/aal_subcortex/L_caudate.ply"

static struct srnf_mesh load(const char *path)
{
    struct srnf_mesh mesh;

    assert_true(meshes_load(path, &mesh));
    return mesh;
}

/* Prepares, encodes by the route area and judges; the volume within the given part of the mesh's,
   the fit within the given part of the diagonal. */
static void must_be_right(struct srnf_mesh *mesh, bool weld, double volume, double fit)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;
    struct srnf_judgement judgement;
    struct srnf_error error = {0};

    options.parameterization = SRNF_PARAMETERIZATION_AREA;
    assert_int_equal(srnf_mesh_prepare(mesh, weld, &report), SRNF_OK);
    if (srnf_encode(mesh, &report, &options, NULL, &encoded, &error)) {
        fail_msg("%s", error.message);
    }
    (void)srnf_encode_judge(&encoded, &report, false, &judgement);
    print_message("# volume %.5f, area %.4f, fit %.4f %%, energy %.3g\n", judgement.volume,
                  judgement.area, 100.0 * judgement.fit, judgement.energy);
    assert_true(fabs(judgement.volume - 1.0) <= volume);
    assert_true(judgement.fit <= fit);
    assert_int_equal(judgement.verdict, SRNF_FAITHFUL);
    srnf_free(encoded.coefficients);
}

static void must_be_refused(struct srnf_mesh *mesh, int code)
{
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;
    struct srnf_error error = {0};

    assert_int_equal(srnf_mesh_prepare(mesh, true, &report), SRNF_OK);
    assert_int_equal(srnf_encode(mesh, &report, NULL, NULL, &encoded, &error), code);
    assert_non_null(strstr(error.message, ";")); /* it says what would help */
}

/* ---- Marching cubes -------------------------------------------------------------------------- */

/* As the tools wrote them (tests/data/marching_cubes/make.py), with the volume that their faces
   enclose. */
static void marching_cubes(void **state)
{
    static const struct {
        const char *file;
        double volume;
        size_t merged, collapsed, folded;
    } rows[] = {
        {FOLDER "bent-160-skimage-lewiner.ply", 981.198, 172, 344, 0},
        {FOLDER "bent-160-flying-edges.ply", 980.863, 196, 392, 0},
        {FOLDER "ellipsoid-160-vtk-normals.ply", 617.552, 456, 0, 0},
        {FOLDER "flat-130-flying-edges.ply", 1006.667, 408, 816, 0},
        {FOLDER "L_caudate-1-flying-edges.ply", 5841.0, 1865, 3730, 2},
    };
    (void)state;

    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct srnf_mesh mesh = load(rows[i].file), copy = meshes_copy(&mesh);
        struct srnf_mesh_report report;

        assert_int_equal(srnf_mesh_prepare(&copy, true, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_true(fabs(report.volume - rows[i].volume) < 1e-3);
        assert_int_equal(report.repairs.duplicate_vertices_merged, rows[i].merged);
        assert_int_equal(report.repairs.collapsed_faces_dropped, rows[i].collapsed);
        assert_int_equal(report.repairs.folded_faces_dropped, rows[i].folded);
        assert_int_equal(report.repairs.touching_vertices_kept_apart, 0);
        must_be_right(&mesh, true, 0.005, 0.003);
        srnf_mesh_clear(&copy);
        srnf_mesh_clear(&mesh);
    }
}

/* The map has no need of the merging: vertices on each other are no trouble to it. */
static void marching_cubes_unmerged(void **state)
{
    static const char *const files[] = {FOLDER "bent-160-skimage-lewiner.ply",
                                        FOLDER "bent-160-flying-edges.ply",
                                        FOLDER "flat-130-flying-edges.ply"};
    (void)state;

    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        struct srnf_mesh mesh = load(files[i]);

        must_be_right(&mesh, false, 0.005, 0.003);
        srnf_mesh_clear(&mesh);
    }
}

/* ---- Slivers and gaps ------------------------------------------------------------------------ */

/* A point on an edge of every third face or so, pulled off it by this part of the edge: a sliver on
   either side. */
static struct srnf_mesh with_slivers(const struct srnf_mesh *mesh, double width)
{
    struct srnf_mesh out = meshes_blank(mesh->n_vertices + mesh->n_faces, 3 * mesh->n_faces);
    size_t vertices = mesh->n_vertices, faces = 0;

    memcpy(out.vertices, mesh->vertices, 3 * vertices * sizeof *out.vertices);
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const uint32_t *v = mesh->faces + 3 * f;
        uint32_t middle = (uint32_t)vertices;

        if (f % 3 != 0) {
            memcpy(out.faces + 3 * faces++, v, 3 * sizeof *v);
            continue;
        }
        for (size_t k = 0; k < 3; k++) {
            const double *p = mesh->vertices;

            out.vertices[3 * vertices + k] =
                0.5 * (1.0 - width) * (p[3 * v[0] + k] + p[3 * v[1] + k]) + width * p[3 * v[2] + k];
        }
        for (size_t k = 0; k < 3; k++) {
            memcpy(out.faces + 3 * faces++, (uint32_t[3]){v[k], v[(k + 1) % 3], middle},
                   3 * sizeof *v);
        }
        vertices++;
    }
    out.n_vertices = vertices;
    out.n_faces = faces;
    return out;
}

static void slivers(void **state)
{
    static const double widths[] = {1e-3, 1e-6, 1e-9, 1e-12};
    struct srnf_mesh caudate = load(CAUDATE);
    (void)state;

    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        struct srnf_mesh mesh = with_slivers(&caudate, widths[i]);

        must_be_right(&mesh, true, 0.005, 0.003);
        srnf_mesh_clear(&mesh);
    }
    srnf_mesh_clear(&caudate);
}

/* Every third face or so in the middle gets a face of its own size times `gap`: three vertices
   nearly at one point, within slim triangles. */
static struct srnf_mesh with_gaps(const struct srnf_mesh *mesh, double gap)
{
    struct srnf_mesh out = meshes_blank(mesh->n_vertices + 3 * mesh->n_faces, 7 * mesh->n_faces);
    size_t vertices = mesh->n_vertices, faces = 0;

    memcpy(out.vertices, mesh->vertices, 3 * vertices * sizeof *out.vertices);
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const uint32_t *v = mesh->faces + 3 * f;

        if (f % 3 != 0) {
            memcpy(out.faces + 3 * faces++, v, 3 * sizeof *v);
            continue;
        }
        for (size_t c = 0; c < 9; c++) {
            const double *p = mesh->vertices + c % 3;
            double middle = (p[3 * v[0]] + p[3 * v[1]] + p[3 * v[2]]) / 3.0;

            out.vertices[3 * vertices + c] = middle + gap * (p[3 * v[c / 3]] - middle);
        }
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t a = v[k], b = v[(k + 1) % 3], base = (uint32_t)vertices;
            uint32_t inner_a = base + k, inner_b = base + (k + 1) % 3;

            memcpy(out.faces + 3 * faces++, (uint32_t[3]){a, b, inner_b}, 3 * sizeof *v);
            memcpy(out.faces + 3 * faces++, (uint32_t[3]){a, inner_b, inner_a}, 3 * sizeof *v);
        }
        memcpy(out.faces + 3 * faces++,
               (uint32_t[3]){(uint32_t)vertices, (uint32_t)vertices + 1, (uint32_t)vertices + 2},
               3 * sizeof *v);
        vertices += 3;
    }
    out.n_vertices = vertices;
    out.n_faces = faces;
    return out;
}

static void gaps(void **state)
{
    struct srnf_mesh caudate = load(CAUDATE), mesh, open;
    double *last;
    (void)state;

    mesh = with_gaps(&caudate, 1e-9);
    must_be_right(&mesh, true, 0.005, 0.003);
    srnf_mesh_clear(&mesh);
    mesh = with_gaps(&caudate, 0.0); /* joined */
    must_be_right(&mesh, true, 0.005, 0.003);
    srnf_mesh_clear(&mesh);
    mesh = with_gaps(&caudate, 0.0); /* and not */
    must_be_right(&mesh, false, 0.005, 0.003);
    srnf_mesh_clear(&mesh);

    /* A gap of 1e-9 that nothing closes is a hole. */
    open = meshes_blank(caudate.n_vertices + 1, caudate.n_faces);
    memcpy(open.vertices, caudate.vertices, 3 * caudate.n_vertices * sizeof *open.vertices);
    memcpy(open.faces, caudate.faces, 3 * caudate.n_faces * sizeof *open.faces);
    last = open.vertices + 3 * caudate.n_vertices;
    memcpy(last, open.vertices + 3 * (size_t)open.faces[0], 3 * sizeof *last);
    last[0] += 1e-9;
    open.faces[0] = (uint32_t)caudate.n_vertices;
    must_be_refused(&open, SRNF_ENOT_CLOSED);
    srnf_mesh_clear(&open);
    srnf_mesh_clear(&caudate);
}

/* ---- Spikes, flaps, needles ------------------------------------------------------------------ */

static void spikes(void **state)
{
    struct srnf_mesh mesh = meshes_sphere(20);
    struct test_random random = test_random_seed(4);
    (void)state;

    for (int i = 0; i < 6; i++) {
        double *p = mesh.vertices + 3 * test_random_below(&random, mesh.n_vertices);

        for (size_t k = 0; k < 3; k++) {
            p[k] *= 3.0;
        }
    }
    must_be_right(&mesh, true, 0.01, 0.008);
    srnf_mesh_clear(&mesh);
}

static void folded_flap(void **state)
{
    struct srnf_mesh sphere = meshes_sphere(10), mesh;
    uint32_t tip = (uint32_t)sphere.n_vertices, a = sphere.faces[0], b = sphere.faces[1];
    (void)state;

    mesh = meshes_blank(sphere.n_vertices + 1, sphere.n_faces + 2);
    memcpy(mesh.vertices, sphere.vertices, 3 * sphere.n_vertices * sizeof *mesh.vertices);
    memcpy(mesh.faces, sphere.faces, 3 * sphere.n_faces * sizeof *mesh.faces);
    for (size_t k = 0; k < 3; k++) {
        mesh.vertices[3 * tip + k] = 2.5 * sphere.vertices[3 * a + k];
    }
    memcpy(mesh.faces + 3 * sphere.n_faces, (uint32_t[6]){a, b, tip, b, a, tip}, 6 * sizeof tip);
    must_be_right(&mesh, true, 0.005, 0.003);
    assert_int_equal(mesh.n_faces, sphere.n_faces);
    srnf_mesh_clear(&mesh);

    /* Half a flap. */
    mesh = meshes_blank(sphere.n_vertices, sphere.n_faces + 1);
    memcpy(mesh.vertices, sphere.vertices, 3 * sphere.n_vertices * sizeof *mesh.vertices);
    memcpy(mesh.faces, sphere.faces, 3 * sphere.n_faces * sizeof *mesh.faces);
    memcpy(mesh.faces + 3 * sphere.n_faces, (uint32_t[3]){a, b, tip / 2}, 3 * sizeof tip);
    must_be_refused(&mesh, SRNF_ENOT_CLOSED);
    srnf_mesh_clear(&mesh);
    srnf_mesh_clear(&sphere);
}

/* The needle by the route area; by the route star it loses most of its volume, and is found out. */
static void needle(void **state)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh mesh = meshes_capsule(60, 1, 90, 12);
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;
    struct srnf_judgement judgement;
    (void)state;

    must_be_right(&mesh, true, 0.01, 0.003); /* the band limit rounds its ends off */
    options.parameterization = SRNF_PARAMETERIZATION_STAR;
    assert_int_equal(srnf_mesh_prepare(&mesh, true, &report), SRNF_OK);
    assert_int_equal(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL), SRNF_OK);
    assert_int_equal(srnf_encode_judge(&encoded, &report, false, &judgement), SRNF_UNFAITHFUL);
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(marching_cubes), cmocka_unit_test(marching_cubes_unmerged),
        cmocka_unit_test(slivers),        cmocka_unit_test(gaps),
        cmocka_unit_test(spikes),         cmocka_unit_test(folded_flap),
        cmocka_unit_test(needle),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
