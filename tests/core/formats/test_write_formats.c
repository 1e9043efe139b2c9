/*
 * test_write_formats.c - what is written reads back the same, carries its normals and fields, and,
 * for GLB, keeps the rules of glTF 2.0. Also the buffer underneath.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <float.h>
#include <jansson.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "formats/formats.h"
#include "srnf.h"
#include "support/compare.h"

#define FREQUENCY 4
#define VERTICES ((size_t)(10 * FREQUENCY * FREQUENCY + 2))

/* An ellipsoid whose coordinates use all digits of a double, with normals and two fields. */
struct sample {
    struct srnf_mesh mesh;
    double normals[VERTICES][3], height[VERTICES], flat[VERTICES];
    struct srnf_mesh_field fields[2];
};

static int set_up(void **state)
{
    struct sample *sample = calloc(1, sizeof *sample);

    assert_non_null(sample);
    assert_int_equal(srnf_mesh_icosphere(FREQUENCY, &sample->mesh), SRNF_OK);
    assert_int_equal(sample->mesh.n_vertices, VERTICES);
    for (size_t i = 0; i < VERTICES; i++) {
        double *v = sample->mesh.vertices + 3 * i;

        memcpy(sample->normals[i], v, sizeof sample->normals[i]);
        v[0] *= 3.0;
        v[1] *= -1.0 / 7.0;
        v[2] += 1e-3;
        sample->height[i] = v[2];
        sample->flat[i] = -1e300;
    }
    sample->fields[0] = (struct srnf_mesh_field){.name = "height", .values = sample->height};
    sample->fields[1] = (struct srnf_mesh_field){.name = "flat_2", .values = sample->flat};
    *state = sample;
    return 0;
}

static int tear_down(void **state)
{
    struct sample *sample = *state;

    srnf_mesh_clear(&sample->mesh);
    free(sample);
    return 0;
}

static bool contains(const struct srnf_buffer *file, const void *bytes, size_t size)
{
    return memmem(file->data, file->size, bytes, size) != NULL;
}

static struct srnf_mesh read_back(const struct srnf_buffer *file, enum srnf_mesh_format format)
{
    struct srnf_mesh mesh;
    struct srnf_mesh_read_info info;
    struct srnf_error error = {0};

    if (srnf_mesh_read(file->data, file->size, SRNF_MESH_UNKNOWN, NULL, &mesh, &info, &error) !=
        SRNF_OK) {
        fail_msg("%s: %s", srnf_mesh_format_name(format), error.message);
    }
    assert_int_equal(info.format, format);
    return mesh;
}

/* Double precision: the mesh comes back to the last bit, with or without normals and fields. */
static void test_exact_round_trips(void **state)
{
    static const enum srnf_mesh_format formats[] = {SRNF_MESH_PLY, SRNF_MESH_OBJ, SRNF_MESH_VTK,
                                                    SRNF_MESH_VTP};
    const struct sample *sample = *state;

    for (size_t i = 0; i < 8 * (sizeof formats / sizeof formats[0]); i++) {
        enum srnf_mesh_format format = formats[i / 8];
        bool with_normals = i % 2 == 1;
        size_t n_fields = i / 2 % 4 == 3 ? 2 : i / 2 % 4;
        struct srnf_buffer file = {0};
        struct srnf_mesh mesh;

        /* Where a locale with a decimal comma is installed, it must change nothing. */
        (void)setlocale(LC_ALL, i % 2 == 0 ? "C" : "de_DE.UTF-8");
        assert_int_equal(srnf_mesh_write(&sample->mesh, format,
                                         with_normals ? sample->normals[0] : NULL, sample->fields,
                                         n_fields, &file),
                         SRNF_OK);
        mesh = read_back(&file, format);
        assert_int_equal(mesh.n_vertices, VERTICES);
        assert_int_equal(mesh.n_faces, sample->mesh.n_faces);
        assert_memory_equal(mesh.vertices, sample->mesh.vertices, 3 * VERTICES * sizeof(double));
        assert_memory_equal(mesh.faces, sample->mesh.faces, 3 * mesh.n_faces * sizeof(uint32_t));
        srnf_mesh_clear(&mesh);
        srnf_buffer_clear(&file);
    }
    (void)setlocale(LC_ALL, "C");
}

/* Single precision, vertices not shared; the normal of each triangle is its own. */
static void test_stl(void **state)
{
    const struct sample *sample = *state;
    struct srnf_buffer file = {0};
    struct srnf_mesh mesh;

    assert_int_equal(srnf_mesh_write(&sample->mesh, SRNF_MESH_STL, NULL, sample->fields, 2, &file),
                     SRNF_OK);
    assert_int_equal(file.size, 84 + 50 * sample->mesh.n_faces);
    mesh = read_back(&file, SRNF_MESH_STL);
    assert_int_equal(mesh.n_vertices, 3 * mesh.n_faces);
    for (size_t i = 0; i < 3 * mesh.n_faces; i++) {
        for (size_t k = 0; k < 3; k++) {
            double expected = sample->mesh.vertices[3 * (size_t)sample->mesh.faces[i] + k];

            assert_true(mesh.vertices[3 * i + k] == (double)(float)expected);
        }
    }
    for (size_t i = 0; i < mesh.n_faces; i++) {
        double cross[3], dot = 0, length = 0;

        mesh_face_cross(&sample->mesh, i, cross);
        for (size_t k = 0; k < 3; k++) {
            double n = scalar_value(SCALAR_FLOAT32, file.data + 84 + 50 * i + 4 * k, false);

            dot += n * cross[k];
            length += n * n;
        }
        assert_true(fabs(length - 1.0) < 1e-6);
        assert_true(dot > 0);
    }
    srnf_mesh_clear(&mesh);
    srnf_buffer_clear(&file);
}

/* Normals and fields of the binary formats are there, with their names and all their digits. */
static void test_fields(void **state)
{
    const struct sample *sample = *state;
    struct srnf_buffer file = {0};
    unsigned char record[8 * sizeof(double)];

    assert_int_equal(
        srnf_mesh_write(&sample->mesh, SRNF_MESH_PLY, sample->normals[0], sample->fields, 2, &file),
        SRNF_OK);
    assert_true(contains(&file, "property double height\nproperty double flat_2\n", 46));
    for (size_t i = 0; i < VERTICES; i++) {
        memcpy(record, sample->mesh.vertices + 3 * i, 24);
        memcpy(record + 24, sample->normals[i], 24);
        memcpy(record + 48, &sample->height[i], 8);
        memcpy(record + 56, &sample->flat[i], 8);
        assert_true(contains(&file, record, sizeof record));
    }
    srnf_buffer_clear(&file);
    assert_int_equal(
        srnf_mesh_write(&sample->mesh, SRNF_MESH_VTK, sample->normals[0], sample->fields, 2, &file),
        SRNF_OK);
    assert_true(
        contains(&file, "POINT_DATA 162\nSCALARS height double 1\nLOOKUP_TABLE default\n", 60));
    assert_true(contains(&file, "SCALARS flat_2 double 1\n", 24));
    assert_true(contains(&file, "NORMALS normals double\n", 23));
    scalar_put_f64_be(record, sample->height[17]);
    assert_true(contains(&file, record, 8));
    srnf_buffer_clear(&file);
}

/* ---- GLB ------------------------------------------------------------------------------------- */

static json_int_t integer(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);

    assert_true(json_is_integer(value));
    return json_integer_value(value);
}

static uint32_t word(const unsigned char *bytes)
{
    return (uint32_t)scalar_value(SCALAR_UINT32, bytes, false);
}

/* The JSON of a GLB, whose container is checked; *binary is its second chunk. */
static json_t *open_glb(const struct srnf_buffer *file, const unsigned char **binary,
                        size_t *binary_size)
{
    size_t json_size;
    json_t *json;

    assert_true(file->size >= 28 && file->size % 4 == 0);
    assert_memory_equal(file->data, "glTF", 4);
    assert_int_equal(word(file->data + 4), 2);
    assert_int_equal(word(file->data + 8), file->size);
    json_size = word(file->data + 12);
    assert_int_equal(json_size % 4, 0);
    assert_memory_equal(file->data + 16, "JSON", 4);
    *binary_size = word(file->data + 20 + json_size);
    assert_int_equal(28 + json_size + *binary_size, file->size);
    assert_memory_equal(file->data + 24 + json_size, "BIN\0", 4);
    *binary = file->data + 28 + json_size;
    json = json_loadb((const char *)file->data + 20, json_size, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(json);
    return json;
}

/* Where the numbers of an accessor begin, after its place and size have been checked. */
static const unsigned char *accessor_bytes(const json_t *json, json_int_t index, size_t stride,
                                           size_t count, const unsigned char *binary,
                                           size_t binary_size)
{
    const json_t *accessor = json_array_get(json_object_get(json, "accessors"), (size_t)index);
    const json_t *view = json_array_get(json_object_get(json, "bufferViews"),
                                        (size_t)integer(accessor, "bufferView"));
    size_t offset = (size_t)integer(view, "byteOffset");

    assert_int_equal(integer(accessor, "count"), count);
    assert_int_equal(integer(view, "byteLength"), count * stride);
    assert_int_equal(offset % 4, 0);
    assert_true(offset + count * stride <= binary_size);
    return binary + offset;
}

static void check_bounds(const json_t *json, json_int_t index, const unsigned char *bytes,
                         size_t components, size_t count)
{
    const json_t *accessor = json_array_get(json_object_get(json, "accessors"), (size_t)index);

    for (size_t k = 0; k < components; k++) {
        double least = INFINITY, largest = -INFINITY;

        for (size_t i = 0; i < count; i++) {
            double value = scalar_value(SCALAR_FLOAT32, bytes + 4 * (components * i + k), false);

            least = compare_min(least, value);
            largest = compare_max(largest, value);
        }
        assert_true(json_number_value(json_array_get(json_object_get(accessor, "min"), k)) ==
                    least);
        assert_true(json_number_value(json_array_get(json_object_get(accessor, "max"), k)) ==
                    largest);
    }
}

static void test_glb(void **state)
{
    struct sample *sample = *state;
    struct srnf_buffer file = {0};
    const unsigned char *binary, *bytes;
    size_t binary_size;
    json_t *json, *primitive, *attributes;
    struct srnf_mesh_field fields[2] = {sample->fields[0],
                                        {.name = "Other", .values = sample->height}};

    assert_int_equal(srnf_mesh_write(&sample->mesh, SRNF_MESH_GLB, NULL, fields, 2, &file),
                     SRNF_OK);
    json = open_glb(&file, &binary, &binary_size);
    assert_string_equal(
        json_string_value(json_object_get(json_object_get(json, "asset"), "version")), "2.0");
    assert_int_equal(integer(json_array_get(json_object_get(json, "buffers"), 0), "byteLength"),
                     binary_size);
    primitive = json_array_get(
        json_object_get(json_array_get(json_object_get(json, "meshes"), 0), "primitives"), 0);
    attributes = json_object_get(primitive, "attributes");
    assert_int_equal(json_object_size(attributes), 5);

    bytes =
        accessor_bytes(json, integer(attributes, "POSITION"), 12, VERTICES, binary, binary_size);
    check_bounds(json, integer(attributes, "POSITION"), bytes, 3, VERTICES);
    for (size_t i = 0; i < 3 * VERTICES; i++) {
        assert_true(scalar_value(SCALAR_FLOAT32, bytes + 4 * i, false) ==
                    (double)(float)sample->mesh.vertices[i]);
    }
    bytes = accessor_bytes(json, integer(attributes, "NORMAL"), 12, VERTICES, binary, binary_size);
    for (size_t i = 0; i < VERTICES; i++) {
        double length = 0;

        for (size_t k = 0; k < 3; k++) {
            length += pow(scalar_value(SCALAR_FLOAT32, bytes + 12 * i + 4 * k, false), 2);
        }
        assert_true(fabs(length - 1) < 1e-6);
    }
    (void)accessor_bytes(json, integer(attributes, "COLOR_0"), 8, VERTICES, binary, binary_size);
    bytes = accessor_bytes(json, integer(attributes, "_OTHER"), 4, VERTICES, binary, binary_size);
    check_bounds(json, integer(attributes, "_OTHER"), bytes, 1, VERTICES);
    (void)accessor_bytes(json, integer(attributes, "_HEIGHT"), 4, VERTICES, binary, binary_size);
    bytes = accessor_bytes(json, integer(primitive, "indices"), 4, 3 * sample->mesh.n_faces, binary,
                           binary_size);
    assert_memory_equal(bytes, sample->mesh.faces, 12 * sample->mesh.n_faces);
    json_decref(json);
    srnf_buffer_clear(&file);
}

/* Equal steps of the field are equal steps of colour, in the space where that is what the eye
   sees; the map stays inside sRGB, or clipping would break that. */
static void test_color_map(void **state)
{
    static const double to_cones[3][3] = {{0.4122214708, 0.5363325363, 0.0514459929},
                                          {0.2119034982, 0.6806995451, 0.1073969566},
                                          {0.0883024619, 0.2817188376, 0.6299787005}};
    static const double to_lab[3][3] = {{0.2104542553, 0.7936177850, -0.0040720468},
                                        {1.9779984951, -2.4285922050, 0.4505937099},
                                        {0.0259040371, 0.7827717662, -0.8086757660}};
    double last[3] = {0, 0, 0}, first_step = 0;

    (void)state;
    for (size_t i = 0; i <= 64; i++) {
        double rgb[3], cones[3], lab[3], step = 0;

        mesh_color_map((double)i / 64, rgb);
        for (size_t k = 0; k < 3; k++) {
            assert_true(rgb[k] > 0 && rgb[k] < 1);
        }
        for (size_t k = 0; k < 3; k++) {
            cones[k] =
                cbrt(to_cones[k][0] * rgb[0] + to_cones[k][1] * rgb[1] + to_cones[k][2] * rgb[2]);
        }
        for (size_t k = 0; k < 3; k++) {
            lab[k] = to_lab[k][0] * cones[0] + to_lab[k][1] * cones[1] + to_lab[k][2] * cones[2];
            step += (lab[k] - last[k]) * (lab[k] - last[k]);
        }
        if (i == 1) {
            first_step = step;
        }
        /* The published matrices are inverse to each other to about 1e-7. */
        assert_true(i < 2 || fabs(sqrt(step / first_step) - 1) < 1e-4);
        assert_true(i == 0 || lab[0] > last[0]);
        memcpy(last, lab, sizeof last);
    }
}

/* ---- What cannot be written ------------------------------------------------------------------ */

/* What the file says of itself, and what its texts may be. */
static void test_described(void **state)
{
    static const char *const wrong[] = {"a \"b\"", "two\nlines", "<b>", "a & b", "\xc3\xa9", "\\"};
    static const enum srnf_mesh_format formats[] = {SRNF_MESH_PLY, SRNF_MESH_OBJ, SRNF_MESH_STL,
                                                    SRNF_MESH_VTK, SRNF_MESH_VTP, SRNF_MESH_GIFTI,
                                                    SRNF_MESH_GLB};
    const struct sample *sample = *state;
    struct srnf_mesh_description description = {
        .name = "surf-1", .space = "original", .comment = "units of the input"};
    struct srnf_mesh_field field = {
        .name = "height", .values = sample->height, .unit = "mm", .meaning = "above the sea"};

    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++) {
        struct srnf_buffer file = {0};
        struct srnf_mesh mesh;

        assert_int_equal(srnf_mesh_write_described(&sample->mesh, formats[i], NULL, &field, 1,
                                                   &description, &file),
                         SRNF_OK);
        /* VTP has strings as the codes of their characters. */
        assert_true(contains(&file, "original", 8) ||
                    contains(&file, "111 114 105 103 105 110 97 108 0", 32));
        if (formats[i] == SRNF_MESH_GLB || formats[i] == SRNF_MESH_GIFTI) {
            assert_true(contains(&file, "above the sea", 13) && contains(&file, "mm", 2));
        }
        mesh = read_back(&file, formats[i]);
        assert_int_equal(mesh.n_faces, sample->mesh.n_faces);
        srnf_mesh_clear(&mesh);
        srnf_buffer_clear(&file);
    }
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct srnf_buffer file = {0};

        description.comment = wrong[i];
        assert_int_equal(srnf_mesh_write_described(&sample->mesh, SRNF_MESH_PLY, NULL, &field, 1,
                                                   &description, &file),
                         SRNF_EINVAL);
        description.comment = NULL;
        field.unit = wrong[i];
        assert_int_equal(srnf_mesh_write_described(&sample->mesh, SRNF_MESH_GLB, NULL, &field, 1,
                                                   &description, &file),
                         SRNF_EINVAL);
        field.unit = NULL;
    }
}

static void test_refusals(void **state)
{
    static const char *const names[] = {"", "a b", "a-b", "x", "NZ", "\xc3\xa9", "Height", NULL};
    struct sample *sample = *state;
    struct srnf_buffer file = {0};
    struct srnf_mesh_field fields[2] = {sample->fields[0], sample->fields[0]};
    double kept = sample->mesh.vertices[5];

    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        fields[1].name = names[i];
        assert_int_equal(srnf_mesh_write(&sample->mesh, SRNF_MESH_PLY, NULL, fields, 2, &file),
                         SRNF_EINVAL);
    }
    for (int format = SRNF_MESH_UNKNOWN; format <= SRNF_MESH_BRAINVISA; format++) {
        bool is_single =
            format == SRNF_MESH_STL || format == SRNF_MESH_GLB || format == SRNF_MESH_GIFTI;
        bool is_written = is_single || format == SRNF_MESH_PLY || format == SRNF_MESH_OBJ ||
                          format == SRNF_MESH_VTK || format == SRNF_MESH_VTP;
        enum srnf_mesh_format to = (enum srnf_mesh_format)format;

        sample->mesh.vertices[5] = NAN;
        assert_int_equal(srnf_mesh_write(&sample->mesh, to, NULL, NULL, 0, &file), SRNF_EINVAL);
        sample->mesh.vertices[5] = 2.0 * (double)FLT_MAX;
        assert_int_equal(srnf_mesh_write(&sample->mesh, to, NULL, NULL, 0, &file),
                         is_written && !is_single ? SRNF_OK : SRNF_EINVAL);
        sample->mesh.vertices[5] = kept;
        assert_int_equal(srnf_mesh_write(&sample->mesh, to, NULL, NULL, 0, &file),
                         is_written ? SRNF_OK : SRNF_EINVAL);
        srnf_buffer_clear(&file);
        file.max = 100;
        assert_int_equal(srnf_mesh_write(&sample->mesh, to, NULL, NULL, 0, &file),
                         is_written ? SRNF_ELIMIT : SRNF_EINVAL);
        assert_int_equal(file.size, 0);
        srnf_buffer_clear(&file);
        file.max = 0;
    }
}

static void test_buffer(void **state)
{
    struct srnf_buffer buffer = {.max = 1000};
    unsigned char bytes[7] = {1, 2, 3, 4, 5, 6, 7};
    size_t growths = 0, capacity = 0;

    (void)state;
    while (buffer.size + sizeof bytes <= buffer.max) {
        assert_int_equal(srnf_buffer_append(&buffer, bytes, sizeof bytes), SRNF_OK);
        growths += buffer.capacity != capacity;
        capacity = buffer.capacity;
        assert_true(buffer.capacity <= buffer.max);
    }
    assert_true(growths <= 4);
    assert_int_equal(srnf_buffer_append(&buffer, bytes, sizeof bytes), SRNF_ELIMIT);
    assert_int_equal(srnf_buffer_append(&buffer, bytes, SIZE_MAX), SRNF_ELIMIT);
    assert_int_equal(srnf_buffer_append(&buffer, bytes, buffer.max - buffer.size), SRNF_OK);
    for (size_t i = 0; i < buffer.size; i++) {
        assert_int_equal(buffer.data[i], 1 + i % 7);
    }
    srnf_buffer_clear(&buffer);
    assert_null(buffer.data);
    assert_int_equal(srnf_buffer_append(&buffer, NULL, 0), SRNF_OK);
    srnf_buffer_clear(&buffer);
    srnf_buffer_clear(NULL);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_exact_round_trips, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_stl, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_fields, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_glb, set_up, tear_down),
        cmocka_unit_test(test_color_map),
        cmocka_unit_test_setup_teardown(test_described, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_refusals, set_up, tear_down),
        cmocka_unit_test(test_buffer),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
