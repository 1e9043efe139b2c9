/*
 * gltf_data.c - buffers and accessors of a glTF document (see gltf.h).
 *
 * A buffer is the chunk BIN or a data URI in base64; one that is another file is refused, since
 * only one is sent. Source: Khronos Group, "glTF 2.0 Specification", 3.6.
 */
#include "gltf.h"
#include "pack.h"

#include <string.h>

#define MEMBERS_MAX 64 /* of an accessor or a view */

static const char *const table_names[GLTF_TABLES] = {
    [GLTF_NODES] = "nodes",       [GLTF_MESHES] = "meshes",   [GLTF_ACCESSORS] = "accessors",
    [GLTF_VIEWS] = "bufferViews", [GLTF_BUFFERS] = "buffers", [GLTF_SCENES] = "scenes",
};

static int fail(struct gltf *gltf, size_t number, const char *what)
{
    return srnf_fail(gltf->reader->error, SRNF_EPARSE, (int64_t)number, "glTF %s", what);
}

/* What many may name must not take long to look into: glTF knows 12 members of an accessor, and 8
   of a view. */
static bool is_crowded(const struct json *json, enum gltf_table table, uint32_t entry)
{
    size_t n = 0;

    if ((table != GLTF_ACCESSORS && table != GLTF_VIEWS) ||
        json->tokens[entry].type != JSON_OBJECT) {
        return false;
    }
    for (uint32_t at = entry + 1; at < json->tokens[entry].after && n <= MEMBERS_MAX; n++) {
        at = json->tokens[at + 1].after;
    }
    return n > MEMBERS_MAX;
}

static int index_table(struct gltf *gltf, enum gltf_table table)
{
    const struct json *json = &gltf->json;
    uint32_t array = json_member(json, 0, table_names[table]);
    size_t n = json_length(json, array), i = 0;

    if (n == 0) {
        return SRNF_OK;
    }
    gltf->tables[table].tokens = mesh_alloc(gltf->reader, n, sizeof(uint32_t));
    if (!gltf->tables[table].tokens) {
        return gltf->reader->status;
    }
    gltf->tables[table].n = n;
    for (uint32_t at = json_first(json, array); at != JSON_NONE; at = json_next(json, array, at)) {
        if (is_crowded(json, table, at)) {
            return srnf_fail(gltf->reader->error, SRNF_EPARSE, (int64_t)i,
                             "glTF %s: entry %zu has more than %d members", table_names[table], i,
                             MEMBERS_MAX);
        }
        gltf->tables[table].tokens[i++] = at;
    }
    return mesh_ask(gltf->reader);
}

/* The text behind the comma of "data:TYPE;base64,TEXT". */
static int decode_uri(struct gltf *gltf, size_t number, struct token uri)
{
    struct gltf_buffer *buffer = &gltf->buffers[number];
    const unsigned char *comma = memchr(uri.text, ',', uri.size < 200 ? uri.size : 200);
    struct base64 cursor = {.end = uri.text + uri.size};

    if (!token_begins(uri, "data:") || !comma) {
        return srnf_fail(
            gltf->reader->error, SRNF_EFORMAT, (int64_t)number,
            "glTF buffer %zu is another file ('%s'); save the model as one binary file "
            "(.glb)",
            number, token_quote(uri).text);
    }
    cursor.at = comma + 1;
    if (buffer->size > (size_t)(cursor.end - cursor.at) / 4 * 3 + 3) {
        return fail(gltf, number, "buffer: its data are shorter than its byteLength");
    }
    buffer->owned = mesh_alloc(gltf->reader, buffer->size + 1, 1);
    if (!buffer->owned) {
        return gltf->reader->status;
    }
    if (!base64_take(&cursor, buffer->owned, buffer->size)) {
        return fail(gltf, number, "buffer: its data end early or are no base64");
    }
    buffer->bytes = buffer->owned;
    return mesh_ask(gltf->reader);
}

static int open_buffer(struct gltf *gltf, size_t number)
{
    const struct json *json = &gltf->json;
    uint32_t entry = gltf_entry(gltf, GLTF_BUFFERS, number);
    uint32_t uri = json_member(json, entry, "uri");
    struct gltf_buffer *buffer = &gltf->buffers[number];

    if (!json_count(json, json_member(json, entry, "byteLength"), &buffer->size)) {
        return fail(gltf, number, "buffer: its byteLength is no count");
    }
    if (uri != JSON_NONE) {
        return decode_uri(gltf, number, json_text(json, uri));
    }
    if (number > 0 || !gltf->binary || buffer->size > gltf->binary_size) {
        return fail(gltf, number, "buffer: it has no data, or less than its byteLength");
    }
    buffer->bytes = gltf->binary;
    return SRNF_OK;
}

int gltf_open(struct gltf *gltf)
{
    int status = SRNF_OK;

    for (int table = 0; table < GLTF_TABLES && status == SRNF_OK; table++) {
        status = index_table(gltf, (enum gltf_table)table);
    }
    if (status == SRNF_OK && gltf->tables[GLTF_BUFFERS].n > 0) {
        gltf->buffers =
            mesh_alloc(gltf->reader, gltf->tables[GLTF_BUFFERS].n, sizeof *gltf->buffers);
        status = gltf->buffers ? SRNF_OK : gltf->reader->status;
    }
    for (size_t i = 0; i < gltf->tables[GLTF_BUFFERS].n && status == SRNF_OK; i++) {
        status = open_buffer(gltf, i);
    }
    return status;
}

void gltf_close(struct gltf *gltf)
{
    size_t n = gltf->tables[GLTF_BUFFERS].n;

    for (size_t i = 0; gltf->buffers && i < n; i++) {
        mesh_release(gltf->reader, gltf->buffers[i].owned, gltf->buffers[i].size + 1, 1);
    }
    mesh_release(gltf->reader, gltf->buffers, n, sizeof *gltf->buffers);
    for (size_t i = 0; i < GLTF_TABLES; i++) {
        mesh_release(gltf->reader, gltf->tables[i].tokens, gltf->tables[i].n, sizeof(uint32_t));
    }
}

uint32_t gltf_entry(const struct gltf *gltf, enum gltf_table table, size_t number)
{
    return number < gltf->tables[table].n ? gltf->tables[table].tokens[number] : JSON_NONE;
}

static const struct {
    size_t code;
    enum scalar_type type;
    double largest; /* of normalized integers */
} types[] = {
    {5120, SCALAR_INT8, 127.0},     {5121, SCALAR_UINT8, 255.0}, {5122, SCALAR_INT16, 32767.0},
    {5123, SCALAR_UINT16, 65535.0}, {5125, SCALAR_UINT32, 1.0},  {5126, SCALAR_FLOAT32, 1.0},
};

static bool set_type(const struct json *json, uint32_t entry, struct gltf_accessor *accessor)
{
    size_t code = 0;
    uint32_t normalized = json_member(json, entry, "normalized");

    if (!json_count(json, json_member(json, entry, "componentType"), &code)) {
        return false;
    }
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        if (types[i].code == code) {
            bool divided = normalized != JSON_NONE && token_is(json_text(json, normalized), "true");

            accessor->type = types[i].type;
            accessor->scale = divided ? 1.0 / types[i].largest : 1.0;
            return true;
        }
    }
    return false;
}

/* The bytes of the view that the accessor names, from its own offset on. */
static bool find_bytes(const struct gltf *gltf, uint32_t entry, size_t element,
                       struct gltf_accessor *accessor)
{
    const struct json *json = &gltf->json;
    uint32_t named = json_member(json, entry, "bufferView"), view;
    size_t number = 0, offset = 0, buffer = SIZE_MAX, view_offset = 0, length = 0, needed;

    if (named == JSON_NONE) {
        return true; /* zeros, which no surface is made of */
    }
    if (!json_count(json, named, &number) ||
        !json_count(json, json_member(json, entry, "byteOffset"), &offset)) {
        return false;
    }
    view = gltf_entry(gltf, GLTF_VIEWS, number);
    accessor->stride = element;
    if (!json_count(json, json_member(json, view, "buffer"), &buffer) ||
        !json_count(json, json_member(json, view, "byteOffset"), &view_offset) ||
        !json_count(json, json_member(json, view, "byteLength"), &length) ||
        !json_count(json, json_member(json, view, "byteStride"), &accessor->stride) ||
        buffer >= gltf->tables[GLTF_BUFFERS].n || accessor->stride < element) {
        return false;
    }
    if (view_offset > gltf->buffers[buffer].size ||
        length > gltf->buffers[buffer].size - view_offset || offset > length ||
        __builtin_mul_overflow(accessor->count - (accessor->count > 0), accessor->stride,
                               &needed) ||
        __builtin_add_overflow(needed, accessor->count > 0 ? element : 0, &needed) ||
        needed > length - offset) {
        return false;
    }
    accessor->bytes = gltf->buffers[buffer].bytes + view_offset + offset;
    return true;
}

int gltf_accessor_of(struct gltf *gltf, size_t number, const char *shape,
                     struct gltf_accessor *accessor)
{
    const struct json *json = &gltf->json;
    uint32_t entry = gltf_entry(gltf, GLTF_ACCESSORS, number);
    size_t components = strcmp(shape, "VEC3") == 0 ? 3 : 1;

    memset(accessor, 0, sizeof *accessor);
    if (!json_is(json, json_member(json, entry, "type"), shape) ||
        !json_count(json, json_member(json, entry, "count"), &accessor->count) ||
        !set_type(json, entry, accessor)) {
        return srnf_fail(gltf->reader->error, SRNF_EPARSE, (int64_t)number,
                         "glTF accessor %zu: it is no %s with a count and a type", number, shape);
    }
    if (json_member(json, entry, "sparse") != JSON_NONE) {
        return srnf_fail(gltf->reader->error, SRNF_EFORMAT, (int64_t)number,
                         "glTF accessor %zu is sparse, which is not read; export it dense", number);
    }
    if (!find_bytes(gltf, entry, components * scalar_size(accessor->type), accessor)) {
        return srnf_fail(gltf->reader->error, SRNF_EPARSE, (int64_t)number,
                         "glTF accessor %zu: its %zu elements are not all within its buffer",
                         number, accessor->count);
    }
    if (!accessor->bytes && accessor->count > 0) {
        return srnf_fail(gltf->reader->error, SRNF_EPARSE, (int64_t)number,
                         "glTF accessor %zu: it has no data", number);
    }
    return SRNF_OK;
}
