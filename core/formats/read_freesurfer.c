/*
 * read_freesurfer.c - FreeSurfer's binary triangle surfaces (lh.white, rh.pial, ...).
 *
 *     ff ff fe                       magic
 *     text \n text \n                who made it and when; the second line is empty
 *     int32 vertices, int32 faces
 *     float32 [vertices][3]          in mm
 *     int32 [faces][3]               all big-endian
 *
 * Source: FreeSurfer's wiki, "FileFormats: surface". What follows the faces (tags with the
 * geometry of the volume) is allowed and not read, and so coordinates are those of the surface
 * itself, without c_ras. The older quadrangle surfaces (ff ff ff, ff ff fd) are refused.
 */
#include "formats.h"

#include <string.h>

#define MAGIC_SIZE 3
#define VERTEX_SIZE ((size_t)12)
#define FACE_SIZE ((size_t)12)

bool mesh_sniff_freesurfer(const unsigned char *bytes, size_t size)
{
    static const unsigned char magic[MAGIC_SIZE] = {0xff, 0xff, 0xfe};

    return size >= MAGIC_SIZE && memcmp(bytes, magic, MAGIC_SIZE) == 0;
}

/* Behind the two lines of text, or NULL. */
static const unsigned char *skip_text(const unsigned char *at, const unsigned char *end)
{
    for (size_t lines = 0; lines < 2; lines++) {
        at = memchr(at, '\n', (size_t)(end - at));
        if (!at) {
            return NULL;
        }
        at++;
    }
    return at;
}

static int read_vertices(struct mesh_reader *reader, const unsigned char *at, size_t count)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double position[3];

        for (size_t k = 0; k < 3; k++) {
            position[k] = scalar_value(SCALAR_FLOAT32, at + VERTEX_SIZE * i + 4 * k, true);
        }
        status = mesh_add_vertex(reader, position);
    }
    return status;
}

static int read_faces(struct mesh_reader *reader, const unsigned char *at, size_t count)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            int64_t index = 0;

            (void)scalar_index(SCALAR_INT32, at + FACE_SIZE * i + 4 * k, true, &index);
            status = mesh_add_corner(reader, i, k, index);
        }
    }
    return status;
}

int mesh_read_freesurfer(struct mesh_reader *reader)
{
    const unsigned char *at, *end = reader->bytes + reader->size;
    int64_t n_vertices = 0, n_faces = 0;
    size_t vertex_bytes;
    int status;

    if (!mesh_sniff_freesurfer(reader->bytes, reader->size)) {
        return srnf_fail(reader->error, SRNF_EPARSE, 0,
                         "a FreeSurfer triangle surface begins with the bytes ff ff fe");
    }
    at = skip_text(reader->bytes + MAGIC_SIZE, end);
    if (!at || end - at < 8) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->size,
                         "the file ends in the FreeSurfer header");
    }
    (void)scalar_index(SCALAR_INT32, at, true, &n_vertices);
    (void)scalar_index(SCALAR_INT32, at + 4, true, &n_faces);
    at += 8;
    status = mesh_promise(reader, "vertices", n_vertices, VERTEX_SIZE, (size_t)(end - at));
    if (status != SRNF_OK) {
        return status;
    }
    vertex_bytes = VERTEX_SIZE * (size_t)n_vertices;
    status = mesh_promise(reader, "faces", n_faces, FACE_SIZE, (size_t)(end - at) - vertex_bytes);
    if (status == SRNF_OK) {
        status = mesh_expect(reader, (size_t)n_vertices, (size_t)n_faces);
    }
    if (status == SRNF_OK) {
        status = read_vertices(reader, at, (size_t)n_vertices);
    }
    if (status == SRNF_OK) {
        status = read_faces(reader, at + vertex_bytes, (size_t)n_faces);
    }
    return status;
}
