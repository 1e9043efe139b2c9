/*
 * read_fsascii.c - FreeSurfer's surfaces as text (mris_convert to .asc).
 *
 *     #!ascii version of lh.pial
 *     vertices faces
 *     x y z ripflag       one line each
 *     a b c ripflag       one line each
 *
 * Source: FreeSurfer's wiki, "FileFormats: ASCII surface". The flags, which mark what FreeSurfer
 * has cut away for the moment, are not read.
 */
#include "fields.h"

bool mesh_sniff_fsascii(const unsigned char *bytes, size_t size)
{
    return token_begins((struct token){bytes, size}, "#!ascii");
}

static int read_vertices(struct fields *fields, size_t count)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double numbers[4] = {0, 0, 0, 0};

        for (size_t k = 0; k < 4 && status == SRNF_OK; k++) {
            status = fields_number(fields, SCALAR_FLOAT64, "vertex", i, &numbers[k]);
        }
        if (status == SRNF_OK) {
            status = mesh_add_vertex(fields->reader, numbers);
        }
    }
    return status;
}

static int read_faces(struct fields *fields, size_t count)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        for (size_t k = 0; k < 4 && status == SRNF_OK; k++) {
            int64_t index = 0;

            status = fields_index(fields, SCALAR_INT64, "face", i, &index);
            if (status == SRNF_OK && k < 3) {
                status = mesh_add_corner(fields->reader, i, k, index);
            }
        }
    }
    return status;
}

int mesh_read_fsascii(struct mesh_reader *reader)
{
    struct fields fields = {.reader = reader};
    struct token line;
    size_t n_vertices = 0;
    int64_t n_faces = 0;
    int status;

    scan_begin(&fields.scan, reader->bytes, reader->size);
    if (!scan_line(&fields.scan, &line) || !token_begins(line, "#!ascii")) {
        return srnf_fail(reader->error, SRNF_EPARSE, 0,
                         "a FreeSurfer surface as text begins with #!ascii");
    }
    status = fields_count(&fields, SCALAR_INT64, "vertices", 8, 4, &n_vertices);
    if (status == SRNF_OK) {
        status = fields_index(&fields, SCALAR_INT64, "number of faces", 0, &n_faces);
    }
    if (status == SRNF_OK) {
        status = mesh_promise(reader, "faces", n_faces, 8, scan_left(&fields.scan) + 1);
    }
    if (status == SRNF_OK) {
        status = mesh_expect(reader, n_vertices, (size_t)n_faces);
    }
    if (status == SRNF_OK) {
        status = read_vertices(&fields, n_vertices);
    }
    if (status == SRNF_OK) {
        status = read_faces(&fields, (size_t)n_faces);
    }
    return status == SRNF_OK ? mesh_no_more(reader, fields.scan.at) : status;
}
