/*
 * read_brainvisa.c - BrainVISA's meshes (.mesh), as text and binary.
 *
 *     ascii VOID 3 steps, and for each step:        binarABCD | binarDCBA, uint32 4, VOID, uint32
 *       3,
 *       instant                                     uint32 steps, and for each step the same
 *         numbers
 *       n (x ,y ,z) ...       vertices              as uint32 and float32
 *       n (x ,y ,z) ...       normals, as many or none
 *       0                     textures
 *       n (a ,b ,c) ...       triangles
 *
 * ABCD is big-endian, DCBA little-endian. Source: AIMS, "MESH format". A file of several steps is
 * refused: which of its surfaces is meant, only its sender knows.
 */
#include "fields.h"

#include <string.h>

#define MAGIC_SIZE ((size_t)9)

bool mesh_sniff_brainvisa(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;

    if (size >= MAGIC_SIZE && (memcmp(bytes, "binarABCD", MAGIC_SIZE) == 0 ||
                               memcmp(bytes, "binarDCBA", MAGIC_SIZE) == 0)) {
        return true;
    }
    scan_sniff(&scan, bytes, size);
    return scan_word(&scan, &word) && token_is(word, "ascii") && scan_word(&scan, &word) &&
           token_is(word, "VOID");
}

static int read_faces(struct fields *fields)
{
    size_t count = 0;
    int status = fields_count(fields, SCALAR_UINT32, "faces", 12, 3, &count);

    if (status == SRNF_OK) {
        status = mesh_expect(fields->reader, fields->reader->mesh.n_vertices, count);
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            int64_t index = 0;

            status = fields_index(fields, SCALAR_UINT32, "face", i, &index);
            if (status == SRNF_OK) {
                status = mesh_add_corner(fields->reader, i, k, index);
            }
        }
    }
    return status;
}

static int read_step(struct fields *fields)
{
    struct mesh_reader *reader = fields->reader;
    size_t count = 0, textures = 0;
    int64_t instant = 0;
    int status = fields_index(fields, SCALAR_UINT32, "instant", 0, &instant);

    if (status == SRNF_OK) {
        status = fields_count(fields, SCALAR_UINT32, "vertices", 12, 3, &count);
    }
    if (status == SRNF_OK) {
        status = fields_vertices(fields, SCALAR_FLOAT32, count);
    }
    if (status == SRNF_OK) {
        status = fields_count(fields, SCALAR_UINT32, "normals", 12, 3, &count);
    }
    if (status == SRNF_OK) {
        status = fields_skip(fields, SCALAR_FLOAT32, "normal", 3 * count);
    }
    if (status == SRNF_OK) {
        status = fields_count(fields, SCALAR_UINT32, "textures", 4, 1, &textures);
    }
    if (status == SRNF_OK && textures > 0) {
        status = srnf_fail(reader->error, SRNF_EPARSE, -1,
                           "the mesh has %zu textures, where VOID has none", textures);
    }
    return status == SRNF_OK ? read_faces(fields) : status;
}

/* Behind the header: the text type of the texture. */
static int read_header(struct fields *fields)
{
    struct mesh_reader *reader = fields->reader;
    struct token word;
    int64_t length = 0;
    int status = SRNF_OK;

    if (!fields->binary) {
        (void)scan_word(&fields->scan, &word);
        (void)scan_word(&fields->scan, &word);
        return SRNF_OK;
    }
    fields->big_endian = reader->bytes[5] == 'A';
    fields->scan.at += MAGIC_SIZE;
    status = fields_index(fields, SCALAR_UINT32, "header", 0, &length);
    if (status == SRNF_OK &&
        (length != 4 || scan_left(&fields->scan) < 4 || memcmp(fields->scan.at, "VOID", 4) != 0)) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)MAGIC_SIZE,
                         "a BrainVISA mesh has the texture VOID");
    }
    fields->scan.at += status == SRNF_OK ? 4 : 0;
    return status;
}

int mesh_read_brainvisa(struct mesh_reader *reader)
{
    struct fields fields = {.reader = reader, .blanks = "(),"};
    int64_t corners = 0, steps = 0;
    int status;

    if (!mesh_sniff_brainvisa(reader->bytes, reader->size)) {
        return srnf_fail(reader->error, SRNF_EPARSE, 0,
                         "a BrainVISA mesh begins with ascii VOID, binarABCD or binarDCBA");
    }
    fields.binary = reader->bytes[0] == 'b';
    scan_begin(&fields.scan, reader->bytes, reader->size);
    status = read_header(&fields);
    if (status == SRNF_OK) {
        status = fields_index(&fields, SCALAR_UINT32, "header", 0, &corners);
    }
    if (status == SRNF_OK) {
        status = fields_index(&fields, SCALAR_UINT32, "header", 0, &steps);
    }
    if (status == SRNF_OK && (corners != 3 || steps != 1)) {
        return srnf_fail(
            reader->error, SRNF_EPARSE, -1,
            "the BrainVISA mesh has polygons of %lld corners and %lld time steps; save "
            "one step of triangles",
            (long long)corners, (long long)steps);
    }
    return status == SRNF_OK ? read_step(&fields) : status;
}
