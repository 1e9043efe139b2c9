/*
 * read_obj.c - Wavefront OBJ: the polygonal part.
 *
 *     v x y z ...              a vertex; weight or colours may follow
 *     f a b c ...              a polygon of corners i, i/t, i//n or i/t/n, counted from 1;
 *                              negative ones count back from the newest vertex
 *
 * Source: Wavefront, "Advanced Visualizer Manual", appendix B1. '#' hides the rest of a line, a
 * backslash at its end joins the next one. All other statements (normals, texture coordinates,
 * groups, materials, free-form surfaces) are passed over. A first pass counts vertices and
 * triangles, so that the arrays are made once and a face may name a vertex that comes after it.
 */
#include "formats.h"

#include <string.h>

/* Statements by which a file is taken for OBJ. */
static const char *const keywords[] = {"v", "vt", "vn", "vp",     "f",      "o",     "g",
                                       "s", "l",  "p",  "cstype", "mtllib", "usemtl"};
#define SNIFF_LINES_MAX 10000

static void begin(struct scan *scan, const unsigned char *bytes, size_t size)
{
    scan_begin(scan, bytes, size);
    scan->comments = true;
    scan->continuation = true;
}

/* Passes the rest of the statement, joined lines included. */
static size_t count_words(struct mesh_reader *reader, struct scan *scan)
{
    struct token word;
    size_t count = 0;

    while (scan_word_on_line(scan, &word) && (!reader || mesh_step(reader) == SRNF_OK)) {
        count++;
    }
    return count;
}

static bool is_keyword(struct token word)
{
    for (size_t i = 0; i < sizeof keywords / sizeof keywords[0]; i++) {
        if (token_is(word, keywords[i])) {
            return true;
        }
    }
    return false;
}

/* Only OBJ statements, and a vertex of three numbers or more among the first lines. */
bool mesh_sniff_obj(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;

    begin(&scan, bytes, size);
    scan.most = SCAN_SNIFFED_MAX;
    for (size_t i = 0; i < SNIFF_LINES_MAX && scan_word(&scan, &word) && is_keyword(word); i++) {
        bool is_vertex = token_is(word, "v");
        size_t words = count_words(NULL, &scan);

        if (is_vertex) {
            return words >= 3;
        }
    }
    return false;
}

static int count_pass(struct mesh_reader *reader)
{
    struct scan scan;
    struct token word;
    size_t n_vertices = 0, n_faces = 0;

    begin(&scan, reader->bytes, reader->size);
    while (scan_word(&scan, &word)) {
        bool is_vertex = token_is(word, "v"), is_face = token_is(word, "f");
        size_t words = count_words(reader, &scan);
        int status = mesh_step(reader);

        if (status != SRNF_OK) {
            return status;
        }
        n_vertices += is_vertex;
        n_faces += is_face && words >= 3 ? words - 2 : 0;
    }
    return mesh_expect(reader, n_vertices, n_faces);
}

static int read_vertex(struct mesh_reader *reader, struct scan *scan)
{
    size_t index = reader->mesh.n_vertices;
    double position[3];
    struct token word;

    for (size_t k = 0; k < 3; k++) {
        if (!scan_word_on_line(scan, &word)) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)index,
                             "vertex %zu: coordinate %c is missing", index, "xyz"[k]);
        }
        if (!token_number(word, reader->locale, &position[k])) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)index,
                             "vertex %zu: '%s' is not a number", index, token_quote(word).text);
        }
    }
    return mesh_add_vertex(reader, position);
}

/* The index of a corner from 0, from its word; the parts behind a slash are not needed. */
static int read_corner(struct mesh_reader *reader, size_t face, struct token word, int64_t *index)
{
    const unsigned char *slash = memchr(word.text, '/', word.size);
    struct token number = {word.text, slash ? (size_t)(slash - word.text) : word.size};
    int64_t value;

    if (!token_integer(number, &value)) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face,
                         "face %zu: '%s' is not an index", face, token_quote(word).text);
    }
    *index = value > 0 ? value - 1 : (int64_t)reader->mesh.n_vertices + value;
    if (value == 0 || *index < 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face,
                         value == 0 ? "face %zu: index %lld, where OBJ counts from 1"
                                    : "face %zu: index %lld counts back beyond the first vertex",
                         face, (long long)value);
    }
    if ((uint64_t)*index >= reader->vertex_total) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face,
                         "face %zu: index %lld is above the %zu vertices", face, (long long)value,
                         reader->vertex_total);
    }
    return SRNF_OK;
}

static int read_face(struct mesh_reader *reader, struct scan *scan, size_t face)
{
    struct token word;
    size_t corners = 0;
    int status = SRNF_OK;

    while (status == SRNF_OK && scan_word_on_line(scan, &word)) {
        int64_t index = 0;

        status = read_corner(reader, face, word, &index);
        if (status == SRNF_OK) {
            status = mesh_add_corner(reader, face, corners++, index);
        }
    }
    return status == SRNF_OK ? mesh_check_corners(reader, face, (int64_t)corners) : status;
}

int mesh_read_obj(struct mesh_reader *reader)
{
    struct scan scan;
    struct token word;
    size_t faces = 0;
    int status = count_pass(reader);

    begin(&scan, reader->bytes, reader->size);
    while (status == SRNF_OK && scan_word(&scan, &word)) {
        if (token_is(word, "v")) {
            status = read_vertex(reader, &scan);
        } else if (token_is(word, "f")) {
            status = read_face(reader, &scan, faces++);
        }
        (void)count_words(reader, &scan);
        status = status == SRNF_OK ? mesh_step(reader) : status;
    }
    return status;
}
