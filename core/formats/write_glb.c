/*
 * write_glb.c - glTF 2.0 in one binary file (GLB): for viewers.
 *
 *     magic "glTF", version 2, length
 *     chunk JSON, padded with spaces to four bytes
 *     chunk BIN, padded with zeros to four bytes:
 *         positions   float32 [n][3]      normals  float32 [n][3]
 *         colours     uint16 [n][4], normalized, linear: of the first field, if there is one
 *         fields      float32 [n] each: attribute _NAME
 *         indices     uint32 [faces][3]
 *
 * Source: Khronos Group, "glTF 2.0 Specification". Every part of BIN is a multiple of four bytes,
 * so every accessor is aligned. The bounds of positions and fields are those of the rounded
 * numbers, as the specification asks. What the file says of itself is in asset.extras (name, space,
 * comment), and what the fields are in extras.fields of the mesh (name, unit, meaning of each
 * attribute). Without normals, those of the faces around a vertex are
 * added, weighted by area.
 */
#include "formats.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define MAGIC 0x46546c67U
#define CHUNK_JSON 0x4e4f534aU
#define CHUNK_BIN 0x004e4942U
#define HEADER_SIZE ((size_t)12)
#define CHUNK_HEADER_SIZE ((size_t)8)
#define TARGET_VERTICES 34962
#define TARGET_INDICES 34963
#define TYPE_UNSIGNED_SHORT 5123
#define TYPE_UNSIGNED_INT 5125
#define TYPE_FLOAT 5126
#define PARTS_FIXED 4
#define FIELDS_MAX 64

/* One accessor with the buffer view of its own. */
struct part {
    const char *attribute; /* NULL: the indices */
    const double *values;  /* whose bounds are told; NULL: none */
    const char *shape;     /* "SCALAR", "VEC3", ... */
    size_t components, component_size;
    unsigned type;
    size_t count;
};

struct glb {
    const struct mesh_output *output;
    const double *normals; /* given, or made here */
    double *own_normals;
    struct srnf_buffer json;
    size_t n_parts;
    struct part parts[PARTS_FIXED + FIELDS_MAX];
    char names[FIELDS_MAX][72]; /* _NAME */
};

static size_t part_size(const struct part *part)
{
    return part->count * part->components * part->component_size;
}

static size_t padding(size_t size)
{
    return (4 - size % 4) % 4;
}

/* ---- Parts ----------------------------------------------------------------------------------- */

static void add_part(struct glb *glb, struct part part)
{
    glb->parts[glb->n_parts++] = part;
}

/* Upper case with an underscore before, as the specification advises for attributes of one's own.
   */
static void attribute_name(char *attribute, const char *name)
{
    size_t n = strlen(name);

    attribute[0] = '_';
    for (size_t i = 0; i < n; i++) {
        char c = name[i];

        attribute[i + 1] = c >= 'a' && c <= 'z' ? (char)(c - 'a' + 'A') : c;
    }
    attribute[n + 1] = '\0';
}

static void list_parts(struct glb *glb)
{
    const struct mesh_output *output = glb->output;
    size_t n = output->mesh->n_vertices;

    add_part(glb, (struct part){"POSITION", output->mesh->vertices, "VEC3", 3, 4, TYPE_FLOAT, n});
    add_part(glb, (struct part){"NORMAL", NULL, "VEC3", 3, 4, TYPE_FLOAT, n});
    if (output->n_fields > 0) {
        add_part(glb, (struct part){"COLOR_0", NULL, "VEC4", 4, 2, TYPE_UNSIGNED_SHORT, n});
    }
    for (size_t i = 0; i < output->n_fields; i++) {
        attribute_name(glb->names[i], output->fields[i].name);
        add_part(glb, (struct part){glb->names[i], output->fields[i].values, "SCALAR", 1, 4,
                                    TYPE_FLOAT, n});
    }
    add_part(glb, (struct part){NULL, NULL, "SCALAR", 1, 4, TYPE_UNSIGNED_INT,
                                3 * output->mesh->n_faces});
}

/* Sums of the faces' normals weighted by area: their cross products. */
static int make_normals(struct glb *glb)
{
    const struct srnf_mesh *mesh = glb->output->mesh;

    glb->normals = glb->output->normals;
    if (glb->normals) {
        return SRNF_OK;
    }
    glb->own_normals = srnf_alloc(mesh->n_vertices, 3 * sizeof(double));
    if (!glb->own_normals) {
        return SRNF_ENOMEM;
    }
    glb->normals = glb->own_normals;
    for (size_t i = 0; i < mesh->n_faces; i++) {
        double normal[3];

        mesh_face_cross(mesh, i, normal);
        for (size_t k = 0; k < 3; k++) {
            double *sum = glb->own_normals + 3 * (size_t)mesh->faces[3 * i + k];

            for (size_t d = 0; d < 3; d++) {
                sum[d] += normal[d];
            }
        }
    }
    return SRNF_OK;
}

/* ---- JSON ------------------------------------------------------------------------------------ */

/* ,"min":[..],"max":[..] of the values as they are stored. */
static int print_bounds(struct glb *glb, const struct part *part)
{
    static const char *const names[] = {"min", "max"};
    int status = SRNF_OK;

    for (size_t m = 0; m < 2; m++) {
        for (size_t k = 0; k < part->components && status == SRNF_OK; k++) {
            float bound = (float)part->values[k];
            char text[MESH_NUMBER_MAX];

            for (size_t i = 1; i < part->count; i++) {
                float value = (float)part->values[part->components * i + k];

                bound = (m == 0) == (value < bound) ? value : bound;
            }
            mesh_number_text(text, (double)bound);
            status = k == 0 ? mesh_buffer_print(&glb->json, ",\"%s\":[%s", names[m], text)
                            : mesh_buffer_print(&glb->json, ",%s", text);
        }
        if (status == SRNF_OK) {
            status = mesh_buffer_print(&glb->json, "]");
        }
    }
    return status;
}

/* "extras":{"name":"text",...} of the texts that are not NULL, after a comma; nothing where all
   are. */
static int print_texts(struct srnf_buffer *json, const char *before, const char *const texts[][2],
                       size_t count)
{
    bool first = true;
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        if (texts[i][1]) {
            status = mesh_buffer_print(json, "%s\"%s\":\"%s\"", first ? before : ",", texts[i][0],
                                       texts[i][1]);
            first = false;
        }
    }
    return status == SRNF_OK && !first ? mesh_buffer_print(json, "}") : status;
}

static int print_asset(struct glb *glb)
{
    const struct srnf_mesh_description *d = &glb->output->description;
    const char *const texts[3][2] = {
        {"name", d->name}, {"space", d->space}, {"comment", d->comment}};
    int status = mesh_buffer_print(
        &glb->json, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"libsrnf %s\"", SRNF_VERSION);

    if (status == SRNF_OK) {
        status = print_texts(&glb->json, ",\"extras\":{", texts, 3);
    }
    return status == SRNF_OK ? mesh_buffer_print(&glb->json, "},") : status;
}

/* What each field is, by the name of its attribute. */
static int print_fields(struct glb *glb)
{
    const struct mesh_output *output = glb->output;
    int status = mesh_buffer_print(&glb->json, "\"extras\":{\"fields\":{");

    for (size_t i = 0; i < output->n_fields && status == SRNF_OK; i++) {
        const struct srnf_mesh_field *field = &output->fields[i];
        const char *const texts[3][2] = {
            {"name", field->name}, {"unit", field->unit}, {"meaning", field->meaning}};

        status = mesh_buffer_print(&glb->json, "%s\"%s\":", i > 0 ? "," : "", glb->names[i]);
        if (status == SRNF_OK) {
            status = print_texts(&glb->json, "{", texts, 3);
        }
    }
    return status == SRNF_OK ? mesh_buffer_print(&glb->json, "}},") : status;
}

static int print_attributes(struct glb *glb)
{
    int status = print_asset(glb);

    if (status == SRNF_OK) {
        status = mesh_buffer_print(&glb->json, "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
                                               "\"nodes\":[{\"mesh\":0}],\"materials\":[{"
                                               "\"pbrMetallicRoughness\":"
                                               "{\"metallicFactor\":0,\"roughnessFactor\":0.6}}],"
                                               "\"meshes\":[{");
    }
    if (status == SRNF_OK && glb->output->n_fields > 0) {
        status = print_fields(glb);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(&glb->json, "\"primitives\":[{\"material\":0,\"attributes\":{");
    }
    for (size_t i = 0; i + 1 < glb->n_parts && status == SRNF_OK; i++) {
        status = mesh_buffer_print(&glb->json, "%s\"%s\":%zu", i > 0 ? "," : "",
                                   glb->parts[i].attribute, i);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(&glb->json, "},\"indices\":%zu}]}],\"accessors\":[",
                                   glb->n_parts - 1);
    }
    return status;
}

static int print_accessor(struct glb *glb, size_t i)
{
    const struct part *part = &glb->parts[i];
    int status = mesh_buffer_print(
        &glb->json, "%s{\"bufferView\":%zu,\"componentType\":%u,\"count\":%zu,\"type\":\"%s\"%s",
        i > 0 ? "," : "", i, part->type, part->count, part->shape,
        part->type == TYPE_UNSIGNED_SHORT ? ",\"normalized\":true" : "");

    if (status == SRNF_OK && part->values) {
        status = print_bounds(glb, part);
    }
    return status == SRNF_OK ? mesh_buffer_print(&glb->json, "}") : status;
}

static int print_json(struct glb *glb)
{
    size_t offset = 0;
    int status = print_attributes(glb);

    for (size_t i = 0; i < glb->n_parts && status == SRNF_OK; i++) {
        status = print_accessor(glb, i);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(&glb->json, "],\"bufferViews\":[");
    }
    for (size_t i = 0; i < glb->n_parts && status == SRNF_OK; i++) {
        size_t size = part_size(&glb->parts[i]);

        status = mesh_buffer_print(
            &glb->json, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":%d}",
            i > 0 ? "," : "", offset, size,
            glb->parts[i].attribute ? TARGET_VERTICES : TARGET_INDICES);
        offset += size;
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(&glb->json, "],\"buffers\":[{\"byteLength\":%zu}]}", offset);
    }
    return status == SRNF_OK ? srnf_buffer_append(&glb->json, "   ", padding(glb->json.size))
                             : status;
}

/* ---- Bytes; the room for them has been reserved ---------------------------------------------- */

static void put_u32(struct srnf_buffer *out, uint32_t value)
{
    scalar_put_u32_le(out->data + out->size, value);
    out->size += 4;
}

static void put_float(struct srnf_buffer *out, double value)
{
    scalar_put_f32_le(out->data + out->size, (float)value);
    out->size += 4;
}

static void put_floats(struct srnf_buffer *out, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        put_float(out, values[i]);
    }
}

/* Of length one, as the specification demands; where there is no direction, up. */
static void put_normals(struct srnf_buffer *out, const double *normals, size_t count)
{
    static const double up[3] = {0, 0, 1};

    for (size_t i = 0; i < count; i++) {
        double unit[3];

        mesh_unit_vector(normals + 3 * i, up, unit);
        put_floats(out, unit, 3);
    }
}

/* The field from its least to its largest value; the middle of the map where it is constant. */
static void put_colors(struct srnf_buffer *out, const double *values, size_t count)
{
    double least = values[0], largest = values[0];

    for (size_t i = 1; i < count; i++) {
        least = fmin(least, values[i]);
        largest = fmax(largest, values[i]);
    }
    for (size_t i = 0; i < count; i++) {
        double rgb[3];

        /* Halves keep the difference of two large values finite. */
        mesh_color_map(
            largest > least ? (values[i] / 2 - least / 2) / (largest / 2 - least / 2) : 0.5, rgb);
        for (size_t k = 0; k < 4; k++) {
            scalar_put_u16_le(out->data + out->size,
                              (uint16_t)lrint(65535.0 * (k < 3 ? rgb[k] : 1.0)));
            out->size += 2;
        }
    }
}

static void put_binary(struct glb *glb)
{
    const struct mesh_output *output = glb->output;
    size_t n = output->mesh->n_vertices;

    put_floats(output->out, output->mesh->vertices, 3 * n);
    put_normals(output->out, glb->normals, n);
    if (output->n_fields > 0) {
        put_colors(output->out, output->fields[0].values, n);
    }
    for (size_t i = 0; i < output->n_fields; i++) {
        put_floats(output->out, output->fields[i].values, n);
    }
    for (size_t i = 0; i < 3 * output->mesh->n_faces; i++) {
        put_u32(output->out, output->mesh->faces[i]);
    }
}

/* Everything that is stored as a float must be one. */
static bool fits_float(const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (fabs(values[i]) > (double)FLT_MAX) {
            return false;
        }
    }
    return true;
}

static bool can_be_written(const struct mesh_output *output)
{
    bool fits = output->n_fields <= FIELDS_MAX &&
                fits_float(output->mesh->vertices, 3 * output->mesh->n_vertices);

    for (size_t i = 0; fits && i < output->n_fields; i++) {
        fits = fits_float(output->fields[i].values, output->mesh->n_vertices);
    }
    return fits;
}

static int assemble(struct glb *glb)
{
    struct srnf_buffer *out = glb->output->out;
    size_t binary = 0, total;
    int status;

    for (size_t i = 0; i < glb->n_parts; i++) {
        binary += part_size(&glb->parts[i]);
    }
    total = HEADER_SIZE + 2 * CHUNK_HEADER_SIZE + glb->json.size + binary;
    if (total > UINT32_MAX) {
        return SRNF_ELIMIT;
    }
    status = mesh_buffer_reserve(out, total);
    if (status != SRNF_OK) {
        return status;
    }
    put_u32(out, MAGIC);
    put_u32(out, 2);
    put_u32(out, (uint32_t)total);
    put_u32(out, (uint32_t)glb->json.size);
    put_u32(out, CHUNK_JSON);
    memcpy(out->data + out->size, glb->json.data, glb->json.size);
    out->size += glb->json.size;
    put_u32(out, (uint32_t)binary);
    put_u32(out, CHUNK_BIN);
    put_binary(glb);
    return SRNF_OK;
}

int mesh_write_glb(const struct mesh_output *output)
{
    struct glb *glb;
    int status;

    if (!can_be_written(output)) {
        return SRNF_EINVAL;
    }
    glb = srnf_alloc(1, sizeof *glb);
    if (!glb) {
        return SRNF_ENOMEM;
    }
    glb->output = output;
    list_parts(glb);
    status = make_normals(glb);
    if (status == SRNF_OK) {
        status = print_json(glb);
    }
    if (status == SRNF_OK) {
        status = assemble(glb);
    }
    srnf_buffer_clear(&glb->json);
    srnf_free(glb->own_normals);
    srnf_free(glb);
    return status;
}
