/*
 * test_read_memory.c - reading and writing when memory is short: the n-th allocation fails, for
 * every n, in every format. The result is SRNF_ENOMEM, nothing is lost, and what was held is
 * within the limit.
 *
 * This program has its own srnf_alloc and srnf_free, which take the place of core/memory.c.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "srnf.h"
#include "support/mesh_files.h"

#define HEADER 64 /* keeps the alignment; holds the size */

static size_t allocations;        /* since the last reset */
static size_t fail_at = SIZE_MAX; /* index of the one that fails */
static size_t live_blocks, live_bytes, peak_bytes;
static size_t asked_bytes; /* by all allocations since the last reset */

void *srnf_alloc(size_t count, size_t size)
{
    size_t bytes;
    unsigned char *block;

    if (allocations++ == fail_at || __builtin_mul_overflow(count, size, &bytes)) {
        return NULL;
    }
    block = calloc(1, bytes + HEADER);
    if (!block) {
        return NULL;
    }
    memcpy(block, &bytes, sizeof bytes);
    live_blocks++;
    live_bytes += bytes;
    asked_bytes += bytes;
    peak_bytes = live_bytes > peak_bytes ? live_bytes : peak_bytes;
    return block + HEADER;
}

void srnf_free(void *pointer)
{
    size_t bytes;

    if (pointer) {
        memcpy(&bytes, (unsigned char *)pointer - HEADER, sizeof bytes);
        live_blocks--;
        live_bytes -= bytes;
        free((unsigned char *)pointer - HEADER);
    }
}

static void reset(size_t index)
{
    allocations = 0;
    asked_bytes = 0;
    fail_at = index;
}

static void test_reading(void **state)
{
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        struct srnf_buffer file = {0};
        struct srnf_mesh mesh;
        struct srnf_error error;
        size_t before, needed;

        reset(SIZE_MAX);
        kind->make(&sample, &file);
        before = live_blocks;
        reset(SIZE_MAX);
        assert_int_equal(
            srnf_mesh_read(file.data, file.size, kind->format, NULL, &mesh, NULL, &error), SRNF_OK);
        needed = allocations;
        srnf_mesh_clear(&mesh);
        assert_int_equal(live_blocks, before);
        assert_true(needed >= 2);
        for (size_t n = 0; n < needed; n++) {
            reset(n);
            memset(&error, 0, sizeof error);
            assert_int_equal(
                srnf_mesh_read(file.data, file.size, kind->format, NULL, &mesh, NULL, &error),
                SRNF_ENOMEM);
            assert_int_equal(error.status, SRNF_ENOMEM);
            assert_null(mesh.vertices);
            assert_int_equal(live_blocks, before);
        }
        reset(SIZE_MAX);
        srnf_buffer_clear(&file);
    }
    srnf_mesh_clear(&sample);
    assert_int_equal(live_blocks, 0);
}

/* A concave polygon needs memory of its own to be cut. */
static void test_polygons(void **state)
{
    static const char text[] = "v 0 0 0\nv 4 1 0\nv 1 1 0\nv 1 4 0\nf 1 2 3 4\n";
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
    struct srnf_mesh mesh;
    size_t needed;

    (void)state;
    reset(SIZE_MAX);
    assert_int_equal(srnf_mesh_read(text, sizeof text - 1, SRNF_MESH_OBJ, NULL, &mesh, NULL, NULL),
                     SRNF_OK);
    needed = allocations;
    srnf_mesh_clear(&mesh);
    assert_true(needed >= 7);
    for (size_t n = 0; n < needed; n++) {
        reset(n);
        assert_int_equal(
            srnf_mesh_read(text, sizeof text - 1, SRNF_MESH_OBJ, NULL, &mesh, NULL, NULL),
            SRNF_ENOMEM);
        assert_int_equal(live_blocks, 0);
    }
    reset(SIZE_MAX);
    limits.max_memory = 400;
    assert_int_equal(
        srnf_mesh_read(text, sizeof text - 1, SRNF_MESH_OBJ, &limits, &mesh, NULL, NULL),
        SRNF_ELIMIT);
    assert_int_equal(live_blocks, 0);
}

static void test_writing(void **state)
{
    struct srnf_mesh sample = mesh_file_sample();
    double values[] = {1, 2, 3, 4};
    struct srnf_mesh_field field = {.name = "value", .values = values};

    (void)state;
    for (int format = SRNF_MESH_PLY; format <= SRNF_MESH_BRAINVISA; format++) {
        struct srnf_buffer file = {0};
        int status;

        reset(SIZE_MAX);
        status = srnf_mesh_write(&sample, (enum srnf_mesh_format)format, NULL, &field, 1, &file);
        for (size_t n = 0, needed = allocations; status == SRNF_OK && n < needed; n++) {
            struct srnf_buffer short_file = {0};

            reset(n);
            assert_int_equal(srnf_mesh_write_described(&sample, (enum srnf_mesh_format)format, NULL,
                                                       &field, 1, NULL, &short_file),
                             SRNF_ENOMEM);
            assert_int_equal(short_file.size, 0);
            srnf_buffer_clear(&short_file);
        }
        srnf_buffer_clear(&file);
    }
    reset(SIZE_MAX);
    srnf_mesh_clear(&sample);
    assert_int_equal(live_blocks, 0);
}

static bool keeps_more(const struct mesh_file_kind *kind, const struct srnf_buffer *file)
{
    return kind->format == SRNF_MESH_GIFTI || kind->format == SRNF_MESH_VTP ||
           file->data[0] == 0x1f;
}

/* max_memory is kept: with each ceiling a read ends in success or SRNF_ELIMIT, and never holds
   more. What expat and zlib keep for themselves is not counted, so GIfTI, VTP and what is packed
   are left out. */
static void test_ceiling(void **state)
{
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
        struct srnf_buffer file = {0};
        int status = SRNF_ELIMIT;

        reset(SIZE_MAX);
        kind->make(&sample, &file);
        for (limits.max_memory = 0; status != SRNF_OK && !keeps_more(kind, &file);
             limits.max_memory += 16) {
            struct srnf_mesh mesh;
            size_t before = live_bytes;

            peak_bytes = live_bytes;
            status = srnf_mesh_read(file.data, file.size, kind->format, &limits, &mesh, NULL, NULL);
            assert_true(status == SRNF_OK || status == SRNF_ELIMIT);
            assert_true(peak_bytes - before <= limits.max_memory);
            srnf_mesh_clear(&mesh);
        }
        srnf_buffer_clear(&file);
    }
    srnf_mesh_clear(&sample);
}

/* ---- Files of many small parts --------------------------------------------------------------- */

/* A mesh of so many such primitives, which so many nodes show. Accessor 0 has 12 vertices, 1 none;
   2 is 36 corners, all of them vertex 0. `members` stand in accessor 0, too. */
static void put_scene(size_t nodes, size_t primitives, const char *primitive, size_t members,
                      struct srnf_buffer *out)
{
    file_print(out, "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":36,\"uri\":"
                    "\"data:;base64,AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA\"}],"
                    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"accessors\":[{");
    for (size_t i = 0; i < members; i++) {
        file_print(out, "\"x%zu\":0,", i);
    }
    file_print(out, "\"bufferView\":0,\"componentType\":5121,\"count\":12,\"type\":\"VEC3\"},"
                    "{\"bufferView\":0,\"componentType\":5121,\"count\":0,\"type\":\"VEC3\"},"
                    "{\"bufferView\":0,\"componentType\":5121,\"count\":36,\"type\":\"SCALAR\"}],"
                    "\"meshes\":[{\"primitives\":[");
    for (size_t i = 0; i < primitives; i++) {
        file_print(out, "%s%s", i > 0 ? "," : "", primitive);
    }
    file_print(out, "]}],\"nodes\":[");
    for (size_t i = 0; i < nodes; i++) {
        file_print(out, "%s{\"mesh\":0}", i > 0 ? "," : "");
    }
    file_print(out, "],\"scenes\":[{\"nodes\":[");
    for (size_t i = 0; i < nodes; i++) {
        file_print(out, "%s%zu", i > 0 ? "," : "", i);
    }
    file_print(out, "]}]}");
}

static void put_nodes(size_t parts, struct srnf_buffer *out)
{
    put_scene(parts, 1, "{\"attributes\":{\"POSITION\":0}}", 0, out);
}

static void put_objects(size_t parts, struct srnf_buffer *out)
{
    struct srnf_mesh sample = mesh_file_sample();

    for (size_t i = 0; i < parts; i++) {
        make_mniobj_ascii(&sample, out);
    }
    srnf_mesh_clear(&sample);
}

/* Bytes that reading the file asks for, one allocation after the other. */
static size_t bytes_to_read(void (*put)(size_t parts, struct srnf_buffer *out), size_t parts,
                            enum srnf_mesh_format format)
{
    struct srnf_buffer file = {0};
    struct srnf_mesh mesh;

    put(parts, &file);
    reset(SIZE_MAX);
    assert_int_equal(srnf_mesh_read(file.data, file.size, format, NULL, &mesh, NULL, NULL),
                     SRNF_OK);
    assert_int_equal(mesh.n_faces, 4 * parts);
    srnf_mesh_clear(&mesh);
    srnf_buffer_clear(&file);
    return asked_bytes;
}

/* Four times the parts need four times the memory to be moved in, give or take a growth by half. */
static void test_parts(void **state)
{
    (void)state;
    assert_true(bytes_to_read(put_nodes, 4000, SRNF_MESH_GLTF) <
                8 * bytes_to_read(put_nodes, 1000, SRNF_MESH_GLTF));
    assert_true(bytes_to_read(put_objects, 4000, SRNF_MESH_MNI_OBJ) <
                8 * bytes_to_read(put_objects, 1000, SRNF_MESH_MNI_OBJ));
}

static bool count_asked(void *user)
{
    ++*(size_t *)user;
    return false;
}

/* How often reading asked whether to go on: every few thousand steps. */
static size_t asks_of_reading(size_t primitives, const char *primitive, size_t members,
                              size_t max_faces, int wanted)
{
    size_t asked = 0;
    const struct srnf_context context = {.user = &asked, .canceled = count_asked};
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
    struct srnf_buffer file = {0};
    struct srnf_mesh mesh;

    limits.context = &context;
    limits.max_faces = max_faces;
    put_scene(2000, primitives, primitive, members, &file);
    reset(SIZE_MAX);
    assert_int_equal(
        srnf_mesh_read(file.data, file.size, SRNF_MESH_GLTF, &limits, &mesh, NULL, NULL), wanted);
    srnf_mesh_clear(&mesh);
    srnf_buffer_clear(&file);
    return asked;
}

/* Nodes that show a mesh of nothing, or of what makes no face, take no time for what it has; and no
   accessor has more members to be searched than there are names. */
static void test_nothing(void **state)
{
    static const char points[] = "{\"mode\":0,\"attributes\":{\"POSITION\":0}}",
                      none[] = "{\"attributes\":{\"POSITION\":1}}",
                      faces[] = "{\"attributes\":{\"POSITION\":0}}",
                      flat[] = "{\"mode\":5,\"attributes\":{\"POSITION\":0},\"indices\":2}";
    (void)state;

    assert_true(asks_of_reading(2000, points, 0, 1000000, SRNF_EPARSE) < 50);
    assert_true(asks_of_reading(2000, none, 0, 1000000, SRNF_EPARSE) < 50);
    assert_true(asks_of_reading(1, flat, 0, 60000, SRNF_ELIMIT) < 50);
    assert_true(asks_of_reading(1, faces, 60, 1000000, SRNF_OK) < 50);
    assert_true(asks_of_reading(1, faces, 61, 1000000, SRNF_EPARSE) < 50);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reading), cmocka_unit_test(test_polygons),
        cmocka_unit_test(test_writing), cmocka_unit_test(test_ceiling),
        cmocka_unit_test(test_parts),   cmocka_unit_test(test_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
