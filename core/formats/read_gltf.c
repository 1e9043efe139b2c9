/*
 * read_gltf.c - glTF 2.0, as one binary file (GLB) or as JSON with its buffers inside.
 *
 *     GLB: magic "glTF", version 2, length; chunk JSON; chunk BIN
 *
 * Read are the triangles (lists, strips and fans) of the meshes that the default scene shows, each
 * with the transforms of its node and of the nodes above it; where these mirror, the corners are
 * turned. Several meshes are joined. Coordinates are those of the scene, whatever its unit and axes
 * mean to others. Materials, colours, cameras and animations are passed over. Refused by name are
 * compression (Draco, meshopt), skins and morph targets, which would change the shape, and buffers
 * in other files. Source: Khronos Group, "glTF 2.0 Specification".
 *
 * A node may have one parent only, so a walk over the nodes ends; a mesh may be shown by several
 * nodes, which the limits of vertices and faces bound.
 */
#include "gltf.h"

#include <string.h>

#define MAGIC_SIZE 4
#define HEADER_SIZE ((size_t)12)
#define CHUNK_HEADER_SIZE ((size_t)8)
#define CHUNK_JSON 0x4e4f534a
#define CHUNK_BIN 0x004e4942
#define NODE_DEPTH_MAX 256
#define SNIFF_BYTES ((size_t)65536)

/* Column-major, as in the file: x' = m[0] x + m[4] y + m[8] z + m[12], ... */
struct matrix {
    double m[16];
};

static const struct matrix identity = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};

bool mesh_sniff_glb(const unsigned char *bytes, size_t size)
{
    return size >= MAGIC_SIZE && memcmp(bytes, "glTF", MAGIC_SIZE) == 0;
}

bool mesh_sniff_gltf(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;

    scan_sniff(&scan, bytes, size);
    if (!scan_word(&scan, &word) || word.text[0] != '{') {
        return false;
    }
    size = size < SNIFF_BYTES ? size : SNIFF_BYTES;
    return memmem(bytes, size, "\"asset\"", 7) != NULL &&
           (memmem(bytes, size, "\"version\"", 9) != NULL ||
            memmem(bytes, size, "\"meshes\"", 8) != NULL);
}

/* ---- Transforms ------------------------------------------------------------------------------ */

static struct matrix multiply(const struct matrix *a, const struct matrix *b)
{
    struct matrix product = {{0}};

    for (size_t column = 0; column < 4; column++) {
        for (size_t row = 0; row < 4; row++) {
            for (size_t k = 0; k < 4; k++) {
                product.m[4 * column + row] += a->m[4 * k + row] * b->m[4 * column + k];
            }
        }
    }
    return product;
}

static void apply(const struct matrix *matrix, const double in[3], double out[3])
{
    for (size_t k = 0; k < 3; k++) {
        out[k] = matrix->m[k] * in[0] + matrix->m[4 + k] * in[1] + matrix->m[8 + k] * in[2] +
                 matrix->m[12 + k];
    }
}

static bool mirrors(const struct matrix *matrix)
{
    const double *m = matrix->m;

    return m[0] * (m[5] * m[10] - m[9] * m[6]) - m[4] * (m[1] * m[10] - m[9] * m[2]) +
               m[8] * (m[1] * m[6] - m[5] * m[2]) <
           0.0;
}

/* The numbers of an array of that many, where there is one; false if it is another. */
static bool read_numbers(const struct json *json, uint32_t array, double *numbers, size_t count)
{
    size_t i = 0;

    if (array == JSON_NONE) {
        return true;
    }
    if (json_length(json, array) != count) {
        return false;
    }
    for (uint32_t at = json_first(json, array); at != JSON_NONE; at = json_next(json, array, at)) {
        if (!json_number(json, at, &numbers[i++])) {
            return false;
        }
    }
    return true;
}

/* matrix, or translation * rotation * scale. */
static bool node_matrix(const struct json *json, uint32_t node, struct matrix *matrix)
{
    double t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    uint32_t given = json_member(json, node, "matrix");

    *matrix = identity;
    if (given != JSON_NONE) {
        return read_numbers(json, given, matrix->m, 16);
    }
    if (!read_numbers(json, json_member(json, node, "translation"), t, 3) ||
        !read_numbers(json, json_member(json, node, "rotation"), q, 4) ||
        !read_numbers(json, json_member(json, node, "scale"), s, 3)) {
        return false;
    }
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w),     2 * (x * z - y * w),
                         2 * (x * y - z * w),     1 - 2 * (x * x + z * z), 2 * (y * z + x * w),
                         2 * (x * z + y * w),     2 * (y * z - x * w),     1 - 2 * (x * x + y * y)};

    for (size_t column = 0; column < 3; column++) {
        for (size_t row = 0; row < 3; row++) {
            matrix->m[4 * column + row] = r[3 * column + row] * s[column];
        }
        matrix->m[12 + column] = t[column];
    }
    return true;
}

/* ---- Primitives ------------------------------------------------------------------------------ */

static int add_positions(struct gltf *gltf, const struct gltf_accessor *positions,
                         const struct matrix *matrix)
{
    struct mesh_reader *reader = gltf->reader;
    size_t size = scalar_size(positions->type);
    int status = SRNF_OK;

    for (size_t i = 0; i < positions->count && status == SRNF_OK; i++) {
        double position[3], moved[3];

        for (size_t k = 0; k < 3; k++) {
            position[k] = positions->scale *
                          scalar_value(positions->type,
                                       positions->bytes + positions->stride * i + size * k, false);
        }
        apply(matrix, position, moved);
        status = mesh_add_vertex(reader, moved);
    }
    return status;
}

/* A primitive where a node shows it. */
struct shown {
    const struct gltf_primitive *primitive;
    size_t base; /* its first vertex */
    bool mirrored;
};

static int64_t corner_of(const struct gltf_primitive *primitive, size_t i)
{
    int64_t index = (int64_t)i;

    if (primitive->indexed) {
        (void)scalar_index(primitive->indices.type,
                           primitive->indices.bytes + primitive->indices.stride * i, false, &index);
    }
    return index;
}

/* Places of the corners of triangle i among the primitive's corners. */
static void triangle_of(const struct shown *shown, size_t i, size_t corners[3])
{
    size_t mode = shown->primitive->mode;
    bool odd = mode == GLTF_MODE_STRIP && i % 2 == 1;

    if (mode == GLTF_MODE_TRIANGLES) {
        corners[0] = 3 * i;
        corners[1] = 3 * i + 1;
        corners[2] = 3 * i + 2;
    } else {
        corners[0] = mode == GLTF_MODE_FAN ? 0 : i;
        corners[1] = odd ? i + 2 : i + 1;
        corners[2] = odd ? i + 1 : i + 2;
    }
    if (shown->mirrored) {
        size_t swapped = corners[1];

        corners[1] = corners[2];
        corners[2] = swapped;
    }
}

static int add_triangles(struct gltf *gltf, const struct shown *shown)
{
    struct mesh_reader *reader = gltf->reader;
    const struct gltf_primitive *primitive = shown->primitive;
    int status = SRNF_OK;

    if (primitive->triangles > reader->limits.max_faces - gltf->triangles) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1, "the faces exceed the limit of %zu faces",
                         reader->limits.max_faces);
    }
    gltf->triangles += primitive->triangles;
    for (size_t i = 0; i < primitive->triangles && status == SRNF_OK; i++) {
        size_t face = reader->mesh.n_faces, corners[3];
        int64_t index[3];

        triangle_of(shown, i, corners);
        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            index[k] = corner_of(primitive, corners[k]);
            if (index[k] < 0 || (uint64_t)index[k] >= primitive->positions.count) {
                status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face,
                                   "face %zu: index %lld is not below the %zu vertices", face,
                                   (long long)index[k], primitive->positions.count);
            }
        }
        if (status == SRNF_OK && primitive->mode == GLTF_MODE_STRIP &&
            (index[0] == index[1] || index[1] == index[2] || index[2] == index[0])) {
            continue; /* it only joins parts of the strip */
        }
        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            status = mesh_add_corner(reader, face, k, (int64_t)shown->base + index[k]);
        }
    }
    return status;
}

static int add_primitive(struct gltf *gltf, const struct gltf_primitive *primitive,
                         const struct matrix *matrix)
{
    struct mesh_reader *reader = gltf->reader;
    const struct shown shown = {
        .primitive = primitive, .base = reader->mesh.n_vertices, .mirrored = mirrors(matrix)};
    int status = mesh_expect(reader, shown.base + primitive->positions.count, reader->mesh.n_faces);

    if (status == SRNF_OK) {
        status = add_positions(gltf, &primitive->positions, matrix);
    }
    return status == SRNF_OK ? add_triangles(gltf, &shown) : status;
}

static int add_mesh(struct gltf *gltf, size_t number, const struct matrix *matrix)
{
    const struct gltf_mesh *mesh = NULL;
    int status = gltf_mesh_of(gltf, number, &mesh);

    for (size_t i = 0; status == SRNF_OK && i < mesh->n; i++) {
        status = add_primitive(gltf, &mesh->primitives[i], matrix);
    }
    return status;
}

/* ---- Nodes ----------------------------------------------------------------------------------- */

struct walk {
    struct gltf *gltf;
    unsigned char *seen; /* [nodes], by mesh_alloc */
};

static int add_node(struct walk *walk, uint32_t reference, const struct matrix *above, size_t depth)
{
    struct gltf *gltf = walk->gltf;
    const struct json *json = &gltf->json;
    struct matrix own, matrix;
    size_t number = SIZE_MAX, mesh = 0;
    uint32_t node, children, shown;
    int status = mesh_step(gltf->reader);

    if (status != SRNF_OK) {
        return status;
    }
    if (!json_count(json, reference, &number) || number >= gltf->tables[GLTF_NODES].n ||
        walk->seen[number] || depth > NODE_DEPTH_MAX) {
        return srnf_fail(gltf->reader->error, SRNF_EPARSE, -1,
                         "glTF: a node is not there, below itself or two others, or too deep");
    }
    walk->seen[number] = 1;
    node = gltf_entry(gltf, GLTF_NODES, number);
    children = json_member(json, node, "children");
    shown = json_member(json, node, "mesh");
    if (!node_matrix(json, node, &own) || !json_count(json, shown, &mesh)) {
        return srnf_fail(gltf->reader->error, SRNF_EPARSE, (int64_t)number,
                         "glTF node %zu: its transform or mesh cannot be read", number);
    }
    if (shown != JSON_NONE && json_member(json, node, "skin") != JSON_NONE) {
        return srnf_fail(gltf->reader->error, SRNF_EFORMAT, (int64_t)number,
                         "glTF node %zu has a skin; apply the pose and export it without", number);
    }
    matrix = multiply(above, &own);
    status = shown == JSON_NONE ? SRNF_OK : add_mesh(gltf, mesh, &matrix);
    for (uint32_t at = json_first(json, children); at != JSON_NONE && status == SRNF_OK;
         at = json_next(json, children, at)) {
        status = add_node(walk, at, &matrix, depth + 1);
    }
    return status;
}

/* The default scene, or the first; without scenes all meshes as they are. */
static int add_scene(struct gltf *gltf)
{
    const struct json *json = &gltf->json;
    struct walk walk = {.gltf = gltf};
    size_t number = 0, n_nodes = gltf->tables[GLTF_NODES].n;
    uint32_t nodes;
    int status = SRNF_OK;

    if (!json_count(json, json_member(json, 0, "scene"), &number)) {
        return srnf_fail(gltf->reader->error, SRNF_EPARSE, -1, "glTF: scene is no number");
    }
    if (gltf->tables[GLTF_SCENES].n == 0) {
        for (size_t i = 0; i < gltf->tables[GLTF_MESHES].n && status == SRNF_OK; i++) {
            status = add_mesh(gltf, i, &identity);
        }
        return status;
    }
    nodes = json_member(json, gltf_entry(gltf, GLTF_SCENES, number), "nodes");
    walk.seen = mesh_alloc(gltf->reader, n_nodes + 1, 1);
    if (!walk.seen) {
        return gltf->reader->status;
    }
    for (uint32_t at = json_first(json, nodes); at != JSON_NONE && status == SRNF_OK;
         at = json_next(json, nodes, at)) {
        status = add_node(&walk, at, &identity, 0);
    }
    mesh_release(gltf->reader, walk.seen, n_nodes + 1, 1);
    return status;
}

/* ---- Files ----------------------------------------------------------------------------------- */

static int check_document(struct gltf *gltf)
{
    const struct json *json = &gltf->json;
    uint32_t asset = json_member(json, 0, "asset"), version = json_member(json, asset, "version");
    uint32_t required = json_member(json, 0, "extensionsRequired");

    if (version == JSON_NONE || !token_begins(json_text(json, version), "2.")) {
        return srnf_fail(gltf->reader->error, SRNF_EFORMAT, -1,
                         "this is not glTF 2.0; export it in that version");
    }
    for (uint32_t at = json_first(json, required); at != JSON_NONE;
         at = json_next(json, required, at)) {
        if (json_is(json, at, "EXT_meshopt_compression") ||
            json_is(json, at, "KHR_draco_mesh_compression")) {
            return srnf_fail(gltf->reader->error, SRNF_EFORMAT, -1,
                             "the glTF model is compressed ('%s'); export it without compression",
                             token_quote(json_text(json, at)).text);
        }
    }
    return SRNF_OK;
}

static int read_document(struct gltf *gltf, const unsigned char *text, size_t size)
{
    int status = json_open(&gltf->json, gltf->reader, text, size);

    if (status == SRNF_OK) {
        status = check_document(gltf);
    }
    if (status == SRNF_OK) {
        status = gltf_open(gltf);
    }
    if (status == SRNF_OK) {
        status = add_scene(gltf);
    }
    gltf_meshes_close(gltf);
    gltf_close(gltf);
    json_close(&gltf->json);
    return status;
}

int mesh_read_gltf(struct mesh_reader *reader)
{
    struct gltf gltf = {.reader = reader};
    struct scan scan;

    scan_begin(&scan, reader->bytes, reader->size); /* behind a byte order mark */
    return read_document(&gltf, scan.at, scan_left(&scan));
}

/* The chunk at an offset; false where it is not whole. */
static bool find_chunk(const struct mesh_reader *reader, size_t offset, int64_t kind,
                       const unsigned char **bytes, size_t *size)
{
    int64_t length = 0, type = 0;

    if (offset > reader->size || reader->size - offset < CHUNK_HEADER_SIZE) {
        return false;
    }
    (void)scalar_index(SCALAR_UINT32, reader->bytes + offset, false, &length);
    (void)scalar_index(SCALAR_UINT32, reader->bytes + offset + 4, false, &type);
    if (type != kind || (uint64_t)length > reader->size - offset - CHUNK_HEADER_SIZE) {
        return false;
    }
    *bytes = reader->bytes + offset + CHUNK_HEADER_SIZE;
    *size = (size_t)length;
    return true;
}

int mesh_read_glb(struct mesh_reader *reader)
{
    struct gltf gltf = {.reader = reader};
    const unsigned char *text = NULL;
    size_t size = 0, binary;
    int64_t version = 0;

    if (!mesh_sniff_glb(reader->bytes, reader->size) || reader->size < HEADER_SIZE) {
        return srnf_fail(reader->error, SRNF_EPARSE, 0, "a GLB file begins with glTF and a length");
    }
    (void)scalar_index(SCALAR_UINT32, reader->bytes + 4, false, &version);
    if (version != 2) {
        return srnf_fail(reader->error, SRNF_EFORMAT, 4,
                         "this is GLB of version %lld; export glTF 2.0", (long long)version);
    }
    if (!find_chunk(reader, HEADER_SIZE, CHUNK_JSON, &text, &size)) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)HEADER_SIZE,
                         "GLB: the chunk of JSON is missing or cut");
    }
    binary = HEADER_SIZE + CHUNK_HEADER_SIZE + size;
    if (reader->size - binary >= CHUNK_HEADER_SIZE &&
        !find_chunk(reader, binary, CHUNK_BIN, &gltf.binary, &gltf.binary_size)) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)binary,
                         "GLB: the binary chunk is cut");
    }
    return read_document(&gltf, text, size);
}
