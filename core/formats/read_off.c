/*
 * read_off.c - OFF, the object file format of Geomview, as text.
 *
 *     [ST][C][N]OFF
 *     VERTICES FACES [EDGES]
 *     x y z ...            one line each; normals, colours and texture coordinates may follow
 *     n i1 .. in ...       one line each; a colour may follow
 *
 * Source: The Geomview Manual, section "OFF Files". '#' hides the rest of a line, empty lines do
 * not count. Since programs disagree about how many numbers a colour has, each vertex and each
 * face has a line of its own and the rest of that line is not looked at. A file that cannot be read
 * so is read again with lines that mean nothing: then the letters before OFF say how many numbers a
 * vertex has, and faces have no colours. Some data sets write the
 * counts directly behind the word OFF. Binary OFF and OFF of other dimensions (4OFF, nOFF) are
 * refused by name.
 */
#include "formats.h"

#include <string.h>

/* The shortest lines, each with the end of the line before it: "0 0 0" and "3 0 0 0". */
#define VERTEX_LEAST ((size_t)6)
#define FACE_LEAST ((size_t)8)

struct off {
    struct mesh_reader *reader;
    struct scan scan;
    bool free;     /* lines mean nothing */
    size_t extras; /* numbers behind the position of a vertex, where lines mean nothing */
};

/* Splits the first word into prefix, "OFF" and what sticks to it; false if it is no OFF keyword. */
static bool split_keyword(struct token word, struct token *prefix, struct token *rest)
{
    for (size_t i = 0; i + 3 <= word.size && i <= 6; i++) {
        if (memcmp(word.text + i, "OFF", 3) == 0) {
            prefix->text = word.text;
            prefix->size = i;
            rest->text = word.text + i + 3;
            rest->size = word.size - i - 3;
            return rest->size == 0 || (rest->text[0] >= '0' && rest->text[0] <= '9');
        }
    }
    return false;
}

static bool is_prefix(struct token prefix, const char *letters)
{
    for (size_t i = 0; i < prefix.size; i++) {
        if (!strchr(letters, prefix.text[i])) {
            return false;
        }
    }
    return true;
}

static bool first_keyword(struct scan *scan, struct token *prefix, struct token *rest)
{
    struct token word;

    return scan_word(scan, &word) && split_keyword(word, prefix, rest) &&
           is_prefix(*prefix, "STCN4n");
}

bool mesh_sniff_off(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token prefix, rest;

    scan_sniff(&scan, bytes, size);
    scan.comments = true;
    return first_keyword(&scan, &prefix, &rest);
}

static int bad_counts(struct off *off)
{
    return srnf_fail(off->reader->error, SRNF_EPARSE, -1,
                     "OFF header: the numbers of vertices and faces are missing or wrong");
}

static int read_header(struct off *off, int64_t *n_vertices, int64_t *n_faces)
{
    struct token prefix, rest, word;

    if (!first_keyword(&off->scan, &prefix, &rest)) {
        return srnf_fail(off->reader->error, SRNF_EPARSE, 0,
                         "an OFF file begins with the word OFF");
    }
    if (!is_prefix(prefix, "STCN")) {
        return srnf_fail(off->reader->error, SRNF_EPARSE, 0,
                         "OFF header: '%s' has not three dimensions, as a surface must have",
                         token_quote(prefix).text);
    }
    if (rest.size == 0 && !scan_word(&off->scan, &rest)) {
        return bad_counts(off);
    }
    if (token_is(rest, "BINARY")) {
        return srnf_fail(off->reader->error, SRNF_EPARSE, 0, "OFF header: binary OFF is not read");
    }
    if (!token_integer(rest, n_vertices) || !scan_word(&off->scan, &word) ||
        !token_integer(word, n_faces)) {
        return bad_counts(off);
    }
    for (size_t i = 0; i < prefix.size; i++) {
        off->extras += prefix.text[i] == 'N' ? 3 : (prefix.text[i] == 'C' ? 4 : 0);
        off->extras += prefix.text[i] == 'T' ? 2 : 0;
    }
    if (off->free) {
        (void)scan_word(&off->scan, &word);
        return SRNF_OK;
    }
    while (scan_word_on_line(&off->scan, &word)) { /* the number of edges, which nobody needs */
    }
    return SRNF_OK;
}

/* Leaves this line; what is left on it is of no interest. */
static void finish_line(struct off *off)
{
    struct token line;

    if (!off->free) {
        (void)scan_line(&off->scan, &line);
    }
}

static int read_vertex(struct off *off, size_t index, size_t count)
{
    double position[3];
    struct token word;

    for (size_t k = 0; k < 3; k++) {
        bool found = k == 0 || off->free ? scan_word(&off->scan, &word)
                                         : scan_word_on_line(&off->scan, &word);

        if (!found) {
            return scan_left(&off->scan) == 0
                       ? mesh_truncated(off->reader, "vertex", index, count)
                       : srnf_fail(off->reader->error, SRNF_EPARSE, (int64_t)index,
                                   "vertex %zu: coordinate %c is missing", index, "xyz"[k]);
        }
        if (!token_number(word, off->reader->locale, &position[k])) {
            return srnf_fail(off->reader->error, SRNF_EPARSE, (int64_t)index,
                             "vertex %zu: '%s' is not a number", index, token_quote(word).text);
        }
    }
    for (size_t k = 0; k < off->extras && off->free; k++) {
        if (!scan_word(&off->scan, &word)) {
            return mesh_truncated(off->reader, "vertex", index, count);
        }
    }
    finish_line(off);
    return mesh_add_vertex(off->reader, position);
}

static int read_face(struct off *off, size_t index, size_t count)
{
    struct token word;
    int64_t corners;
    int status;

    if (!scan_word(&off->scan, &word)) {
        return mesh_truncated(off->reader, "face", index, count);
    }
    if (!token_integer(word, &corners)) {
        return srnf_fail(off->reader->error, SRNF_EPARSE, (int64_t)index,
                         "face %zu: '%s' is not a number of corners", index,
                         token_quote(word).text);
    }
    status = mesh_check_corners(off->reader, index, corners);
    for (int64_t k = 0; k < corners && status == SRNF_OK; k++) {
        int64_t corner;

        if (!(off->free ? scan_word(&off->scan, &word) : scan_word_on_line(&off->scan, &word))) {
            status = scan_left(&off->scan) == 0
                         ? mesh_truncated(off->reader, "face", index, count)
                         : srnf_fail(off->reader->error, SRNF_EPARSE, (int64_t)index,
                                     "face %zu: corner %lld of %lld is missing", index,
                                     (long long)k, (long long)corners);
        } else if (!token_integer(word, &corner)) {
            status = srnf_fail(off->reader->error, SRNF_EPARSE, (int64_t)index,
                               "face %zu: '%s' is not an index", index, token_quote(word).text);
        } else {
            status = mesh_add_corner(off->reader, index, (size_t)k, corner);
        }
    }
    finish_line(off);
    return status;
}

static int read_all(struct mesh_reader *reader, bool free)
{
    struct off off = {.reader = reader, .free = free};
    int64_t n_vertices = 0, n_faces = 0;
    size_t left = 0;
    int status;

    scan_begin(&off.scan, reader->bytes, reader->size);
    off.scan.comments = true;
    status = read_header(&off, &n_vertices, &n_faces);
    if (status == SRNF_OK) {
        left = scan_left(&off.scan);
        status = mesh_promise(reader, "vertices", n_vertices, VERTEX_LEAST, left);
    }
    if (status == SRNF_OK) {
        left -= VERTEX_LEAST * (size_t)n_vertices;
        status = mesh_promise(reader, "faces", n_faces, FACE_LEAST, left);
    }
    if (status == SRNF_OK) {
        status = mesh_expect(reader, (size_t)n_vertices, (size_t)n_faces);
    }
    for (size_t i = 0; i < (size_t)n_vertices && status == SRNF_OK; i++) {
        status = read_vertex(&off, i, (size_t)n_vertices);
    }
    for (size_t i = 0; i < (size_t)n_faces && status == SRNF_OK; i++) {
        status = read_face(&off, i, (size_t)n_faces);
    }
    if (status == SRNF_OK) {
        struct token word;

        status = scan_word(&off.scan, &word) ? mesh_no_more(reader, word.text) : SRNF_OK;
    }
    return status;
}

int mesh_read_off(struct mesh_reader *reader)
{
    struct srnf_error *error = reader->error, lines = {0};
    struct srnf_error unused = {0};
    int status, again;

    reader->error = &lines;
    status = read_all(reader, false);
    if (status == SRNF_EPARSE) {
        reader->error = &unused;
        reader->mesh.n_vertices = reader->mesh.n_faces = reader->n_polygons = 0;
        reader->info.polygons_triangulated = 0;
        again = read_all(reader, true);
        if (again != SRNF_EPARSE) {
            status = again;
            lines = unused;
        }
    }
    reader->error = error;
    if (status != SRNF_OK && error) {
        *error = lines;
    }
    return status;
}
