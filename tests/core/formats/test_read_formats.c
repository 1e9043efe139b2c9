/*
 * test_read_formats.c - every format and encoding is read right, is recognized, and loses its end
 * at every byte without harm. Format and encoding are those of support/mesh_files.h.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "srnf.h"
#include "support/mesh_files.h"

/* The same triangles with the same corners, to the last bit; indices may differ (STL). */
static void assert_same(const struct srnf_mesh *expected, const struct srnf_mesh *mesh, bool shares)
{
    assert_int_equal(mesh->n_faces, expected->n_faces);
    assert_int_equal(mesh->n_vertices, shares ? expected->n_vertices : 3 * expected->n_faces);
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        assert_true(mesh->faces[i] < mesh->n_vertices);
        assert_memory_equal(mesh->vertices + 3 * (size_t)mesh->faces[i],
                            expected->vertices + 3 * (size_t)expected->faces[i],
                            3 * sizeof(double));
    }
}

/* Reads a copy of exactly that size, so that the sanitizer sees every step beyond the end. */
static int read_exact(const void *bytes, size_t size, enum srnf_mesh_format format,
                      struct srnf_mesh *mesh, struct srnf_mesh_read_info *info,
                      struct srnf_error *error)
{
    unsigned char *copy = malloc(size > 0 ? size : 1);
    int status;

    assert_non_null(copy);
    memcpy(copy, bytes, size);
    status = srnf_mesh_read(copy, size, format, NULL, mesh, info, error);
    free(copy);
    return status;
}

/* What is an element's name elsewhere is nothing as the name of a property. */
static void test_ply_names_have_their_place(void **state)
{
    static const char text[] = "ply\nformat ascii 1.0\n"
                               "element camera 2\nproperty double vertex\nproperty double face\n"
                               "property double tristrips\nproperty double x\n"
                               "element vertex 3\nproperty float x\nproperty float face\n"
                               "property float y\nproperty float z\nproperty float vertex\n"
                               "element face 1\nproperty float vertex\n"
                               "property list uchar int vertex_indices\nproperty float face\n"
                               "end_header\n"
                               "71 72 73 74\n81 82 83 84\n"
                               "1 90 2 3 91\n4 92 5 6 93\n7 94 8 10 95\n"
                               "96 3 0 1 2 97\n";
    static const double vertices[] = {1, 2, 3, 4, 5, 6, 7, 8, 10};
    struct srnf_error error = {0};
    struct srnf_mesh mesh;

    (void)state;
    assert_int_equal(read_exact(text, sizeof text - 1, SRNF_MESH_PLY, &mesh, NULL, &error),
                     SRNF_OK);
    assert_int_equal(mesh.n_vertices, 3);
    assert_int_equal(mesh.n_faces, 1);
    assert_memory_equal(mesh.vertices, vertices, sizeof vertices);
    srnf_mesh_clear(&mesh);
}

static void test_every_kind(void **state)
{
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        enum srnf_mesh_format formats[] = {kind->format, SRNF_MESH_UNKNOWN};
        struct srnf_buffer file = {0};

        kind->make(&sample, &file);
        assert_int_equal(srnf_mesh_sniff(file.data, file.size), kind->format);
        for (size_t i = 0; i < 2; i++) {
            struct srnf_mesh mesh;
            struct srnf_mesh_read_info info;
            struct srnf_error error = {0};
            int status = read_exact(file.data, file.size, formats[i], &mesh, &info, &error);

            if (status != SRNF_OK) {
                fail_msg("%s: %s", kind->label, error.message);
            }
            assert_int_equal(info.format, kind->format);
            assert_int_equal(info.polygons_triangulated, 0);
            assert_same(&sample, &mesh, kind->shares_vertices);
            srnf_mesh_clear(&mesh);
        }
        srnf_buffer_clear(&file);
    }
    srnf_mesh_clear(&sample);
}

/* Whatever is left is an error with a sentence, or a mesh that keeps the promises of
   srnf_mesh_read. */
static void check_any(const void *bytes, size_t size, enum srnf_mesh_format format, bool must_fail)
{
    struct srnf_mesh mesh;
    struct srnf_error error = {0};
    int status = read_exact(bytes, size, format, &mesh, NULL, &error);

    if (status != SRNF_OK) {
        assert_true(status == SRNF_EPARSE || status == SRNF_EFORMAT || status == SRNF_ELIMIT);
        assert_int_equal(error.status, status);
        assert_true(strlen(error.message) > 0);
        assert_null(mesh.vertices);
        return;
    }
    assert_false(must_fail);
    for (size_t i = 0; i < 3 * mesh.n_vertices; i++) {
        assert_true(isfinite(mesh.vertices[i]));
    }
    for (size_t i = 0; i < 3 * mesh.n_faces; i++) {
        assert_true(mesh.faces[i] < mesh.n_vertices);
    }
    srnf_mesh_clear(&mesh);
}

/* Binary STL whose header promises another number, or with bytes behind the last triangle. */
static void test_stl_repairs(void **state)
{
    static const struct {
        double promised;
        size_t behind, faces, error, trailing;
    } cases[] = {{4, 0, 4, 0, 0},
                 {4, 1, 4, 0, 1},
                 {4, 123, 4, 0, 123},
                 {0, 0, 4, 4, 0},
                 {4e9, 0, 4, 3999999996, 0},
                 {3, 0, 4, 1, 0},
                 {4, 50, 4, 0, 50}};
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct srnf_buffer file = {0}, count = {0};
        struct srnf_mesh_read_info info = {0};
        struct srnf_error error = {0};
        struct srnf_mesh mesh;

        assert_int_equal(srnf_mesh_write(&sample, SRNF_MESH_STL, NULL, NULL, 0, &file), SRNF_OK);
        file_number(&count, FILE_U32, false, cases[i].promised);
        memcpy(file.data + 80, count.data, 4);
        for (size_t k = 0; k < cases[i].behind; k++) {
            file_number(&file, FILE_U8, false, 0);
        }
        assert_int_equal(read_exact(file.data, file.size, SRNF_MESH_UNKNOWN, &mesh, &info, &error),
                         SRNF_OK);
        assert_int_equal(info.format, SRNF_MESH_STL);
        assert_int_equal(mesh.n_faces, cases[i].faces);
        assert_int_equal(info.face_count_error, cases[i].error);
        assert_int_equal(info.trailing_bytes, cases[i].trailing);
        srnf_mesh_clear(&mesh);
        srnf_buffer_clear(&file);
        srnf_buffer_clear(&count);
    }
    srnf_mesh_clear(&sample);
}

/* What the bytes are instead, also of what is packed. */
static void test_strangers_by_name(void **state)
{
    char volume[400] = "";

    (void)state;
    memcpy(volume + 344, "n+1", 4);
    assert_string_equal(srnf_mesh_stranger(volume, sizeof volume), "nifti");
    assert_string_equal(srnf_mesh_stranger("PK\x03\x04 and more", 13), "zip");
    assert_string_equal(srnf_mesh_stranger("<?xml?> <X3D>", 13), "x3d");
    assert_string_equal(srnf_mesh_stranger("", 0), "empty");
    assert_null(srnf_mesh_stranger("some words", 10));
}

static void test_truncated_everywhere(void **state)
{
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        struct srnf_buffer file = {0};

        kind->make(&sample, &file);
        for (size_t size = 0; size < file.size; size++) {
            /* Whole triangles of binary STL are a file of another count. */
            bool whole = !kind->shares_vertices && file.data[0] != 0x1f && size > 84 &&
                         (size - 84) % 50 == 0;

            check_any(file.data, size, kind->format, !whole && file.size - size > kind->loose);
            check_any(file.data, size, SRNF_MESH_UNKNOWN, false);
        }
        srnf_buffer_clear(&file);
    }
    srnf_mesh_clear(&sample);
}

/* Each byte in turn becomes others that mean something in one of the formats. */
static void test_damaged_everywhere(void **state)
{
    static const unsigned char damage[] = {0x00, 0xff, '-', '9', ' ', '\n', '<', '\\'};
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        struct srnf_buffer file = {0};

        kind->make(&sample, &file);
        for (size_t i = 0; i < file.size; i++) {
            unsigned char kept = file.data[i];

            for (size_t k = 0; k < sizeof damage; k++) {
                file.data[i] = damage[k];
                check_any(file.data, file.size, kind->format, false);
            }
            file.data[i] = kept;
        }
        srnf_buffer_clear(&file);
    }
    srnf_mesh_clear(&sample);
}

static void test_names(void **state)
{
    static const struct {
        const char *name;
        enum srnf_mesh_format format;
    } names[] = {{"ply", SRNF_MESH_PLY},       {"PLY", SRNF_MESH_PLY},
                 {"gii", SRNF_MESH_GIFTI},     {"gifti", SRNF_MESH_GIFTI},
                 {"GIfTI", SRNF_MESH_GIFTI},   {"surf.gii", SRNF_MESH_GIFTI},
                 {"fs", SRNF_MESH_FREESURFER}, {"Freesurfer", SRNF_MESH_FREESURFER},
                 {"glb", SRNF_MESH_GLB},       {"", SRNF_MESH_UNKNOWN},
                 {"plyy", SRNF_MESH_UNKNOWN},  {NULL, SRNF_MESH_UNKNOWN}};

    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        assert_int_equal(srnf_mesh_format_from_name(names[i].name), names[i].format);
    }
    for (int format = SRNF_MESH_PLY; format <= SRNF_MESH_GLB; format++) {
        const char *name = srnf_mesh_format_name((enum srnf_mesh_format)format);

        assert_int_equal(srnf_mesh_format_from_name(name), format);
    }
    assert_string_equal(srnf_mesh_format_name(SRNF_MESH_UNKNOWN), "unknown");
}

/* ---- Files ----------------------------------------------------------------------------------- */

static struct srnf_buffer load(const char *path)
{
    struct srnf_buffer content = {0};
    unsigned char piece[4096];
    FILE *file = fopen(path, "rb");
    size_t size;

    if (!file) {
        return content;
    }
    while ((size = fread(piece, 1, sizeof piece, file)) > 0) {
        assert_int_equal(srnf_buffer_append(&content, piece, size), SRNF_OK);
    }
    (void)fclose(file);
    return content;
}

/* Calls visit for each file of a folder; returns how many there were. */
static size_t for_each_file(const char *folder,
                            void (*visit)(const char *path, enum srnf_mesh_format format),
                            enum srnf_mesh_format format)
{
    DIR *entries = opendir(folder);
    struct dirent *entry;
    size_t count = 0;

    while (entries && (entry = readdir(entries)) != NULL) {
        char path[1024];

        if (entry->d_name[0] != '.') {
            (void)snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
            visit(path, format);
            count++;
        }
    }
    if (entries) {
        (void)closedir(entries);
    }
    return count;
}

static void visit_real(const char *path, enum srnf_mesh_format format)
{
    struct srnf_buffer content = load(path);
    struct srnf_mesh mesh;
    struct srnf_mesh_report report;

    if (strstr(path, ".ply")) {
        assert_int_equal(read_exact(content.data, content.size, format, &mesh, NULL, NULL),
                         SRNF_OK);
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_int_equal(report.repairs.unreferenced_vertices_dropped, 0);
        assert_int_equal((int64_t)mesh.n_vertices - (int64_t)mesh.n_faces / 2, 2);
        srnf_mesh_clear(&mesh);
    }
    srnf_buffer_clear(&content);
}

static void test_real_meshes(void **state)
{
    (void)state;
    assert_true(for_each_file("tests/data/aal_subcortex", visit_real, SRNF_MESH_UNKNOWN) > 0);
}

static void visit_corpus(const char *path, enum srnf_mesh_format format)
{
    struct srnf_buffer content = load(path);

    check_any(content.data ? content.data : (const unsigned char *)"", content.size, format, false);
    check_any(content.data ? content.data : (const unsigned char *)"", content.size,
              SRNF_MESH_UNKNOWN, false);
    srnf_buffer_clear(&content);
}

/* What the fuzzers have found stays found. */
static void test_corpora(void **state)
{
    size_t count = 0;

    (void)state;
    for (int format = SRNF_MESH_PLY; format < SRNF_MESH_GLB; format++) {
        char folder[256];

        (void)snprintf(folder, sizeof folder, "tests/fuzz/corpus/%s",
                       srnf_mesh_format_name((enum srnf_mesh_format)format));
        count += for_each_file(folder, visit_corpus, (enum srnf_mesh_format)format);
    }
    assert_true(count >= 20);
}

/* Whether a tetrahedron in GIfTI with this matrix among its point set tells of it. */
static bool ignores(const char *matrix)
{
    struct srnf_mesh_read_info info;
    struct srnf_mesh mesh;
    char text[1200];
    int n = snprintf(
        text, sizeof text,
        "<GIFTI><DataArray Intent=\"NIFTI_INTENT_POINTSET\" DataType=\"NIFTI_TYPE_FLOAT32\" "
        "Encoding=\"ASCII\" Dim0=\"4\" Dim1=\"3\"><CoordinateSystemTransformMatrix>"
        "<MatrixData>%s</MatrixData></CoordinateSystemTransformMatrix>"
        "<Data>0 0 0 1 0 0 0 1 0 0 0 1</Data></DataArray><DataArray "
        "Intent=\"NIFTI_INTENT_TRIANGLE\" DataType=\"NIFTI_TYPE_INT32\" Encoding=\"ASCII\" "
        "Dim0=\"4\" Dim1=\"3\"><Data>0 2 1 0 1 3 1 2 3 0 3 2</Data></DataArray></GIFTI>",
        matrix);

    assert_true(n > 0 && (size_t)n < sizeof text);
    assert_int_equal(srnf_mesh_read(text, (size_t)n, SRNF_MESH_GIFTI, NULL, &mesh, &info, NULL),
                     SRNF_OK);
    assert_true(mesh.vertices[3] == 1.0); /* as they stand */
    srnf_mesh_clear(&mesh);
    return info.transform_ignored;
}

static void test_gifti_matrix(void **state)
{
    (void)state;
    assert_true(ignores("-2 0 0 0 0 3 0 0 0 0 1 0 0 0 0 1"));
    assert_true(ignores("0 -1 0 0\n1 0 0 0\n0 0 1 0\n0 0 0 1"));
    assert_false(ignores("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"));
    assert_false(ignores("1.0000001 0 0 5.4 0 1 0 -17 0 0 1 19 0 0 0 1")); /* moved only */
    assert_false(ignores("2 0 0"));
    assert_false(ignores(""));
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ply_names_have_their_place),
        cmocka_unit_test(test_every_kind),
        cmocka_unit_test(test_stl_repairs),
        cmocka_unit_test(test_strangers_by_name),
        cmocka_unit_test(test_truncated_everywhere),
        cmocka_unit_test(test_damaged_everywhere),
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_gifti_matrix),
        cmocka_unit_test(test_real_meshes),
        cmocka_unit_test(test_corpora),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
