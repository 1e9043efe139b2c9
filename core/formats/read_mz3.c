/*
 * read_mz3.c - MZ3, the meshes of Surf Ice (usually packed by gzip, which pack.c opens).
 *
 *     uint16 0x5a4d ("MZ"), uint16 attributes (1 faces, 2 vertices, ...),
 *     uint32 faces, uint32 vertices, uint32 bytes to skip
 *     int32 [faces][3], float32 [vertices][3], colours and scalars; all little-endian
 *
 * Source: C. Rorden, "MZ3 mesh format", in the documentation of Surf Ice. What follows the vertices
 * is not read.
 */
#include "fields.h"

#include <string.h>

#define HEADER_SIZE ((size_t)16)
#define FACES_BIT 1
#define VERTICES_BIT 2
#define ATTRIBUTES_MAX 0xff

bool mesh_sniff_mz3(const unsigned char *bytes, size_t size)
{
    int64_t attributes = 0;

    if (size < HEADER_SIZE || bytes[0] != 'M' || bytes[1] != 'Z') {
        return false;
    }
    (void)scalar_index(SCALAR_UINT16, bytes + 2, false, &attributes);
    return attributes > 0 && attributes <= ATTRIBUTES_MAX;
}

static int read_faces(struct fields *fields, size_t count)
{
    int status = mesh_expect(fields->reader, fields->reader->mesh.n_vertices, count);

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            int64_t index = 0;

            status = fields_index(fields, SCALAR_INT32, "face", i, &index);
            if (status == SRNF_OK) {
                status = mesh_add_corner(fields->reader, i, k, index);
            }
        }
    }
    return status;
}

int mesh_read_mz3(struct mesh_reader *reader)
{
    const unsigned char *end = reader->bytes + reader->size;
    struct fields fields = {.reader = reader, .binary = true};
    int64_t attributes = 0, counts[3];
    const unsigned char *faces;
    int status;

    if (!mesh_sniff_mz3(reader->bytes, reader->size)) {
        return srnf_fail(reader->error, SRNF_EPARSE, 0,
                         "an MZ3 file begins with MZ and its header");
    }
    (void)scalar_index(SCALAR_UINT16, reader->bytes + 2, false, &attributes);
    for (size_t i = 0; i < 3; i++) {
        (void)scalar_index(SCALAR_UINT32, reader->bytes + 4 + 4 * i, false, &counts[i]);
    }
    if (!(attributes & FACES_BIT) || !(attributes & VERTICES_BIT)) {
        return srnf_fail(reader->error, SRNF_EPARSE, 2,
                         "the MZ3 file has colours or scalars of a mesh, but not the mesh itself");
    }
    if (counts[2] > (int64_t)(reader->size - HEADER_SIZE)) {
        return srnf_fail(reader->error, SRNF_EPARSE, 12,
                         "the MZ3 file skips %lld bytes, beyond its end", (long long)counts[2]);
    }
    faces = reader->bytes + HEADER_SIZE + counts[2];
    status = mesh_promise(reader, "faces", counts[0], 12, (size_t)(end - faces));
    if (status == SRNF_OK) {
        fields.scan.at = faces + 12 * counts[0];
        fields.scan.end = end;
        status = mesh_promise(reader, "vertices", counts[1], 12, (size_t)(end - fields.scan.at));
    }
    if (status == SRNF_OK) {
        status = fields_vertices(&fields, SCALAR_FLOAT32, (size_t)counts[1]);
    }
    fields.scan.at = faces;
    return status == SRNF_OK ? read_faces(&fields, (size_t)counts[0]) : status;
}
