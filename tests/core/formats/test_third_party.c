/*
 * test_third_party.c - files that other programs wrote, most of them packed by gzip: each is the
 * same surface, in the same place (tests/data/third_party).
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "srnf.h"
#include "support/compare.h"

#define FOLDER "tests/data/third_party/"
#define VERTICES 258
#define FACES 512
/* Of the surface that third_party.py makes. */
#define AREA 4827.2077131
#define VOLUME 26521.771567
static const double centroid[3] = {10.5, -20.2556994571, 36.0990330122};
#define CLOSE 3e-6 /* of single precision, and of six decimals */

static const struct {
    const char *name;
    enum srnf_mesh_format format;
} files[] = {
    {"assimp_glb2.glb.gz", SRNF_MESH_GLB},           {"gltf-transform.glb.gz", SRNF_MESH_GLB},
    {"gmsh_2.2_1.msh.gz", SRNF_MESH_GMSH},           {"meshio_41b.msh.gz", SRNF_MESH_GMSH},
    {"nibabel.surf.gii.gz", SRNF_MESH_GIFTI},        {"open3d.gltf.gz", SRNF_MESH_GLTF},
    {"three_nodes.glb.gz", SRNF_MESH_GLB},           {"vtk_ascii.byu.gz", SRNF_MESH_BYU},
    {"vtk_binary_little32_zlib.vtp", SRNF_MESH_VTP}, {"vtk_grid_binary.vtk.gz", SRNF_MESH_VTK},
    {"vtk_mni_binary.obj.gz", SRNF_MESH_MNI_OBJ},    {"vtk_raw_little64_zlib.vtp", SRNF_MESH_VTP},
    {"vtk_strips_binary_51.vtk.gz", SRNF_MESH_VTK},
};

static void check_file(const char *name, enum srnf_mesh_format format)
{
    static unsigned char bytes[1 << 16];
    struct srnf_mesh_report report;
    struct srnf_mesh_read_info info = {0};
    struct srnf_error error = {0};
    struct srnf_mesh mesh;
    char path[200];
    size_t size;
    FILE *file;

    (void)snprintf(path, sizeof path, FOLDER "%s", name);
    file = fopen(path, "rb");
    assert_non_null(file);
    size = fread(bytes, 1, sizeof bytes, file);
    (void)fclose(file);
    if (srnf_mesh_read(bytes, size, SRNF_MESH_UNKNOWN, NULL, &mesh, &info, &error) != SRNF_OK) {
        fail_msg("%s: %s", name, error.message);
    }
    assert_int_equal(info.format, format);
    assert_int_equal(srnf_mesh_sniff(bytes, size), format);
    assert_int_equal(srnf_mesh_prepare(&mesh, true, &report), SRNF_OK);
    if (mesh.n_vertices != VERTICES || mesh.n_faces != FACES || report.n_problems != 0) {
        fail_msg("%s: %zu vertices, %zu faces, %zu problems", name, mesh.n_vertices, mesh.n_faces,
                 report.n_problems);
    }
    assert_true(fabs(report.area / AREA - 1.0) < CLOSE);
    assert_true(fabs(report.volume / VOLUME - 1.0) < CLOSE);
    for (size_t k = 0; k < 3; k++) {
        assert_true(fabs(report.centroid[k] - centroid[k]) < 1e-4);
    }
    assert_int_equal(report.repairs.faces_flipped, 0);
    srnf_mesh_clear(&mesh);
}

static void test_files(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        check_file(files[i].name, files[i].format);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_files)};

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
