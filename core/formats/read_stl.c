/*
 * read_stl.c - STL, text and binary.
 *
 *     solid NAME                                  80 bytes of anything
 *       facet normal nx ny nz                     uint32 number of triangles
 *         outer loop                              each: float32 normal[3], corners[3][3],
 *           vertex x y z    three times           uint16 attribute; all little-endian
 *         endloop
 *       endfacet
 *     endsolid NAME
 *
 * Source: 3D Systems, "StereoLithography Interface Specification", 1988. Many binary files begin
 * with "solid" too: the size, which follows from the number of triangles, tells, and failing that
 * a zero byte near the beginning. Each triangle comes with three vertices of its own; joining them
 * is the work of srnf_mesh_prepare. A count that does not fit the bytes that are there, and bytes
 * behind the last triangle, are no error where the triangles are whole; the reader notes them.
 * Normals are not read: they follow from the corners. Words may be in either case, and several
 * solids one after the other are one mesh.
 */
#include "formats.h"

#include <math.h>
#include <string.h>

#define HEADER_SIZE ((size_t)84)
#define RECORD_SIZE ((size_t)50)
#define RECORD_CORNERS ((size_t)12) /* offset of the first corner */
#define TEXT_PROBE ((size_t)1024)

static bool has_binary_size(const unsigned char *bytes, size_t size)
{
    int64_t count = 0;

    return size >= HEADER_SIZE &&
           scalar_index(SCALAR_UINT32, bytes + HEADER_SIZE - 4, false, &count) &&
           (size - HEADER_SIZE) % RECORD_SIZE == 0 &&
           (size - HEADER_SIZE) / RECORD_SIZE == (size_t)count;
}

static bool is_text(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;

    scan_sniff(&scan, bytes, size);
    return !has_binary_size(bytes, size) && scan_word(&scan, &word) && token_is(word, "solid") &&
           !memchr(bytes, '\0', size < TEXT_PROBE ? size : TEXT_PROBE);
}

#define LOOKED_AT ((size_t)8) /* triangles by which a file is known */
#define COORDINATE_MAX 1e30   /* beyond it bytes are no coordinates that anyone wrote */
#define UNIT_TOLERANCE 0.02   /* of the length of a normal */

/* Could this be a triangle: a normal of length one or zero, and sane corners that are not all 0? */
static bool is_record(const unsigned char *record)
{
    double length = 0.0, largest = 0.0;

    for (size_t k = 0; k < 12; k++) {
        double value = scalar_value(SCALAR_FLOAT32, record + 4 * k, false);

        if (!(fabs(value) < COORDINATE_MAX)) {
            return false;
        }
        length += k < 3 ? value * value : 0.0;
        largest = k >= 3 ? fmax(largest, fabs(value)) : largest;
    }
    return largest > 0.0 && (length == 0.0 || fabs(sqrt(length) - 1.0) < UNIT_TOLERANCE);
}

/* Triangles of a binary file whose count or end may be wrong, as VTK reads them: where the bytes
   behind the header are whole triangles, they count, unless what is behind the promised ones is
   none; otherwise the count does, and what follows is ignored. 0: it is cut. */
static size_t loose_count(const unsigned char *bytes, size_t size)
{
    size_t there = (size - HEADER_SIZE) / RECORD_SIZE;
    bool whole = (size - HEADER_SIZE) % RECORD_SIZE == 0;
    int64_t count = 0;

    (void)scalar_index(SCALAR_UINT32, bytes + HEADER_SIZE - 4, false, &count);
    if ((size_t)count > there) {
        return whole ? there : 0;
    }
    return whole && (size_t)count < there &&
                   is_record(bytes + HEADER_SIZE + RECORD_SIZE * (size_t)count)
               ? there
               : (size_t)count;
}

static bool is_loose(const unsigned char *bytes, size_t size)
{
    size_t n = size > HEADER_SIZE ? loose_count(bytes, size) : 0;

    for (size_t i = 0; i < n && i < LOOKED_AT; i++) {
        if (!is_record(bytes + HEADER_SIZE + RECORD_SIZE * i)) {
            return false;
        }
    }
    return n > 0;
}

/* A binary file of no triangles is 84 bytes with four zeros: too little to know it by. */
bool mesh_sniff_stl(const unsigned char *bytes, size_t size)
{
    return (size > HEADER_SIZE && has_binary_size(bytes, size)) || is_text(bytes, size) ||
           is_loose(bytes, size);
}

bool mesh_is_stl_of(const unsigned char *first, size_t n, size_t size)
{
    int64_t count = 0;

    return n > HEADER_SIZE && scalar_index(SCALAR_UINT32, first + HEADER_SIZE - 4, false, &count) &&
           HEADER_SIZE + RECORD_SIZE * (uint64_t)count == size;
}

#define CUT_FACTOR 4 /* between what is there and what is promised: else the promise is chance */

bool mesh_is_cut_stl(const unsigned char *bytes, size_t size)
{
    int64_t count = 0;
    size_t there = size > HEADER_SIZE ? (size - HEADER_SIZE) / RECORD_SIZE : 0;

    if (there == 0 || !scalar_index(SCALAR_UINT32, bytes + HEADER_SIZE - 4, false, &count)) {
        return false;
    }
    return (size_t)count / CUT_FACTOR <= there && there <= (size_t)count * CUT_FACTOR &&
           memchr(bytes, '\0', size < TEXT_PROBE ? size : TEXT_PROBE) != NULL;
}

static int add_corners(struct mesh_reader *reader, size_t face)
{
    int status = SRNF_OK;

    reader->vertex_total = reader->mesh.n_vertices;
    for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
        status = mesh_add_corner(reader, face, k, (int64_t)(3 * face + k));
    }
    return status;
}

static int read_binary(struct mesh_reader *reader)
{
    const unsigned char *record = reader->bytes + HEADER_SIZE;
    int64_t promised = 0;
    size_t count;
    int status;

    if (reader->size < HEADER_SIZE) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->size,
                         "the file ends at byte %zu of the STL header of %zu bytes", reader->size,
                         HEADER_SIZE);
    }
    (void)scalar_index(SCALAR_UINT32, record - 4, false, &promised);
    count = loose_count(reader->bytes, reader->size);
    if (count == 0) {
        return mesh_promise(reader, "faces", promised, RECORD_SIZE, reader->size - HEADER_SIZE);
    }
    reader->info.face_count_error =
        (size_t)promised > count ? (size_t)promised - count : count - (size_t)promised;
    reader->info.trailing_bytes = reader->size - HEADER_SIZE - RECORD_SIZE * count;
    status = mesh_expect(reader, 3 * count, count);
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            const unsigned char *corner = record + RECORD_CORNERS + 12 * k;
            double position[3];

            for (size_t d = 0; d < 3; d++) {
                position[d] = scalar_value(SCALAR_FLOAT32, corner + 4 * d, false);
            }
            status = mesh_add_vertex(reader, position);
        }
        if (status == SRNF_OK) {
            status = add_corners(reader, i);
        }
        record += RECORD_SIZE;
    }
    return status;
}

/* ---- Text ------------------------------------------------------------------------------------ */

/* A word of a facet: a keyword that must stand there, or, where NULL, a number: of a normal, which
   is not looked at, or of a corner. */
static const struct {
    const char *keyword;
    bool is_coordinate;
} facet_words[] = {
    {"normal", false}, {NULL, false},     {NULL, false}, {NULL, false},      {"outer", false},
    {"loop", false},   {"vertex", false}, {NULL, true},  {NULL, true},       {NULL, true},
    {"vertex", false}, {NULL, true},      {NULL, true},  {NULL, true},       {"vertex", false},
    {NULL, true},      {NULL, true},      {NULL, true},  {"endloop", false}, {"endfacet", false},
};
#define FACET_WORDS (sizeof facet_words / sizeof facet_words[0])

static int read_facet(struct mesh_reader *reader, struct scan *scan, size_t face)
{
    double position[3];
    size_t coordinate = 0;
    struct token word;

    for (size_t i = 0; i < FACET_WORDS; i++) {
        const char *keyword = facet_words[i].keyword;

        if (!scan_word(scan, &word)) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face, "the file ends in face %zu",
                             face);
        }
        if (keyword && !token_is(word, keyword)) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face,
                             "face %zu: '%s' stands where '%s' should", face,
                             token_quote(word).text, keyword);
        }
        if (!facet_words[i].is_coordinate) {
            continue;
        }
        if (!token_number(word, reader->locale, &position[coordinate % 3])) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face,
                             "face %zu: '%s' is not a number", face, token_quote(word).text);
        }
        coordinate++;
        if (coordinate % 3 == 0) {
            int status = mesh_add_vertex(reader, position);

            if (status != SRNF_OK) {
                return status;
            }
        }
    }
    return add_corners(reader, face);
}

static int read_text(struct mesh_reader *reader)
{
    struct scan scan;
    struct token word, line;
    size_t faces = 0;
    bool in_solid = false;
    int status = SRNF_OK;

    scan_begin(&scan, reader->bytes, reader->size);
    while (status == SRNF_OK && scan_word(&scan, &word)) {
        if (token_is(word, in_solid ? "endsolid" : "solid")) {
            in_solid = !in_solid;
            status = mesh_step(reader);
            (void)scan_line(&scan, &line);
        } else if (in_solid && token_is(word, "facet")) {
            status = read_facet(reader, &scan, faces++);
        } else {
            status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)(word.text - reader->bytes),
                               "byte %zu: '%s' stands between faces %s a solid",
                               (size_t)(word.text - reader->bytes), token_quote(word).text,
                               in_solid ? "of" : "outside");
        }
    }
    if (status == SRNF_OK && in_solid) {
        status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)faces,
                           "the file ends behind face %zu without 'endsolid'", faces);
    }
    return status;
}

int mesh_read_stl(struct mesh_reader *reader)
{
    return is_text(reader->bytes, reader->size) ? read_text(reader) : read_binary(reader);
}
