/*
 * read_mniobj.c - MNI obj: polygons of the Montreal Neurological Institute's tools (CIVET, BICPL),
 * as text and binary. The ending .obj is that of Wavefront's format too; the first letter tells.
 *
 *     P a d s e t n            surface properties and number of points;   binary: p, float32 x 5,
 *       int32
 *     x y z ...                n points, then n normals                   float32
 *     m                        polygons                                   int32
 *     flag  r g b a ...        0: one colour, 1: one a polygon, 2: a point    int32, 4 bytes each
 *     e1 .. em                 where each polygon ends among the corners  int32
 *     i ...                    corners from 0                             int32
 *
 * Source: D. MacDonald, "MNI Object File Format", and the order in which BICPL writes. Binary files
 * are in the byte order of the machine that wrote them: it is the one in which the number of points
 * fits the file. Several objects P are joined; lines and other objects are refused.
 */
#include "fields.h"

#include <string.h>

#define BINARY_HEADER ((size_t)25) /* the letter, five properties, the number of points */
#define POINT_SIZE ((size_t)24)    /* with its normal */

/* Does the number of points fit, in this byte order? */
static bool fits(const unsigned char *bytes, size_t size, bool big_endian)
{
    int64_t count = 0;

    (void)scalar_index(SCALAR_INT32, bytes + BINARY_HEADER - 4, big_endian, &count);
    return count >= 3 && (uint64_t)count <= (size - BINARY_HEADER) / POINT_SIZE;
}

static bool is_binary(const unsigned char *bytes, size_t size)
{
    if (size <= BINARY_HEADER || bytes[0] != 'p') {
        return false;
    }
    for (size_t order = 0; order < 2; order++) {
        bool sane = fits(bytes, size, order == 1);

        for (size_t i = 0; i < 5 && sane; i++) {
            double value = scalar_value(SCALAR_FLOAT32, bytes + 1 + 4 * i, order == 1);

            sane = value >= 0.0 && value <= 1000.0;
        }
        if (sane) {
            return true;
        }
    }
    return false;
}

bool mesh_sniff_mniobj(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;
    int64_t count = 0;

    if (is_binary(bytes, size)) {
        return true;
    }
    scan_sniff(&scan, bytes, size);
    if (!scan_word(&scan, &word) || word.size != 1 || *word.text != 'P') {
        return false;
    }
    for (size_t i = 0; i < 6; i++) {
        if (!scan_word(&scan, &word)) {
            return false;
        }
    }
    return token_integer(word, &count);
}

static int skip_colors(struct fields *fields, size_t n_points, size_t n_polygons)
{
    int64_t flag = 0;
    size_t colors;
    int status = fields_index(fields, SCALAR_INT32, "colour flag", 0, &flag);

    if (status == SRNF_OK && (flag < 0 || flag > 2)) {
        return srnf_fail(fields->reader->error, SRNF_EPARSE, -1,
                         "the colour flag is %lld, not 0 to 2", (long long)flag);
    }
    if (status != SRNF_OK) {
        return status;
    }
    colors = flag == 0 ? 1 : (flag == 1 ? n_polygons : n_points);
    return fields_skip(fields, fields->binary ? SCALAR_UINT32 : SCALAR_FLOAT64, "colour",
                       fields->binary ? colors : 4 * colors);
}

/* Corners of all polygons; `ends` stands where the first end is. */
static int read_corners(struct fields *fields, struct fields ends, size_t n_polygons, size_t base,
                        size_t n_points)
{
    struct mesh_reader *reader = fields->reader;
    int64_t begin = 0, end = 0;
    int status = SRNF_OK;

    for (size_t i = 0; i < n_polygons && status == SRNF_OK; i++) {
        status = fields_index(&ends, SCALAR_INT32, "end of face", i, &end);
        if (status == SRNF_OK) {
            status = mesh_check_corners(reader, i, end < begin ? -1 : end - begin);
        }
        for (int64_t k = begin; k < end && status == SRNF_OK; k++) {
            int64_t index = 0;

            status = fields_index(fields, SCALAR_INT32, "face", i, &index);
            if (status == SRNF_OK && (index < 0 || (uint64_t)index >= n_points)) {
                status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                                   "face %zu: index %lld is not below the %zu vertices", i,
                                   (long long)index, n_points);
            }
            if (status == SRNF_OK) {
                status = mesh_add_corner(reader, i, (size_t)(k - begin), (int64_t)base + index);
            }
        }
        begin = end;
    }
    return status;
}

/* One object, behind its letter. */
static int read_polygons(struct fields *fields)
{
    struct mesh_reader *reader = fields->reader;
    size_t base = reader->mesh.n_vertices, n_points = 0, n_polygons = 0;
    struct fields ends;
    int status = fields_skip(fields, SCALAR_FLOAT32, "property", 5);

    if (status == SRNF_OK) {
        status = fields_count(fields, SCALAR_INT32, "vertices", POINT_SIZE, 6, &n_points);
    }
    if (status == SRNF_OK) {
        status = fields_vertices(fields, SCALAR_FLOAT32, n_points);
    }
    if (status == SRNF_OK) {
        status = fields_skip(fields, SCALAR_FLOAT32, "normal", 3 * n_points);
    }
    if (status == SRNF_OK) {
        status = fields_count(fields, SCALAR_INT32, "faces", 16, 4, &n_polygons);
    }
    if (status == SRNF_OK) {
        status = skip_colors(fields, n_points, n_polygons);
    }
    if (status == SRNF_OK) {
        status = mesh_expect(reader, base + n_points, reader->mesh.n_faces + n_polygons);
    }
    ends = *fields;
    if (status == SRNF_OK) {
        status = fields_skip(fields, SCALAR_INT32, "end of face", n_polygons);
    }
    return status == SRNF_OK ? read_corners(fields, ends, n_polygons, base, n_points) : status;
}

/* The letter of the next object; 0 at the end of the file. */
static unsigned char next_letter(struct fields *fields)
{
    while (scan_left(&fields->scan) > 0 && !fields->binary &&
           (*fields->scan.at == ' ' || (*fields->scan.at >= '\t' && *fields->scan.at <= '\r'))) {
        fields->scan.at++;
    }
    return scan_left(&fields->scan) > 0 ? *fields->scan.at++ : 0;
}

int mesh_read_mniobj(struct mesh_reader *reader)
{
    struct fields fields = {.reader = reader};
    int status = SRNF_OK;

    scan_begin(&fields.scan, reader->bytes, reader->size);
    fields.binary = reader->size > BINARY_HEADER && reader->bytes[0] == 'p';
    fields.big_endian = fields.binary && fits(reader->bytes, reader->size, true) &&
                        !fits(reader->bytes, reader->size, false);
    while (status == SRNF_OK) {
        unsigned char letter = next_letter(&fields);

        if (letter == 0) {
            break;
        }
        status = letter == (fields.binary ? 'p' : 'P')
                     ? read_polygons(&fields)
                     : srnf_fail(reader->error, SRNF_EPARSE,
                                 (int64_t)(fields.scan.at - reader->bytes) - 1,
                                 "byte %zu: an object other than polygons (P) stands there",
                                 (size_t)(fields.scan.at - reader->bytes) - 1);
    }
    return status;
}
