/*
 * read_byu.c - Movie.BYU, as VTK, ParaView and CHARM of older labs write it.
 *
 *     parts vertices polygons corners        whole numbers
 *     first last                             of each part, among the polygons, from 1
 *     x y z ...                              FORTRAN's 6E12.5: two vertices a line
 *     a b -c ...                             corners from 1; the last of each polygon is negative
 *
 * Source: H. Christiansen and M. Stephenson, "MOVIE.BYU Training Text", 1986. All parts are one
 * mesh. Fields of twelve columns may touch each other: a sign that does not follow an exponent's e
 * begins another number.
 */
#include "fields.h"

#include <string.h>

#define HEADER_NUMBERS 4

static bool next_integer(struct scan *scan, int64_t *value)
{
    struct token word;

    return scan_word(scan, &word) && token_integer(word, value);
}

/* Four counts that fit each other, and parts that cover the polygons. */
bool mesh_sniff_byu(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    int64_t counts[HEADER_NUMBERS], first = 0, last = 0;

    scan_sniff(&scan, bytes, size);
    for (size_t i = 0; i < HEADER_NUMBERS; i++) {
        if (!next_integer(&scan, &counts[i])) {
            return false;
        }
    }
    return counts[0] >= 1 && counts[1] >= 3 && counts[2] >= 1 && counts[0] <= counts[2] &&
           counts[3] / 3 >= counts[2] && next_integer(&scan, &first) && first == 1 &&
           next_integer(&scan, &last) && last >= 1 && last <= counts[2];
}

/* The next number of a text whose columns may touch. */
static bool next_column(struct scan *scan, struct token *word)
{
    const unsigned char *at;

    while (scan->at < scan->end && (*scan->at == ' ' || (*scan->at >= '\t' && *scan->at <= '\r'))) {
        scan->at++;
    }
    word->text = at = scan->at;
    while (at<scan->end && * at> ' ') {
        bool sign = *at == '-' || *at == '+';

        if (sign && at > word->text && at[-1] != 'e' && at[-1] != 'E' && at[-1] != 'd' &&
            at[-1] != 'D') {
            break;
        }
        at++;
    }
    word->size = (size_t)(at - word->text);
    scan->at = at;
    return word->size > 0;
}

static int read_vertices(struct fields *fields, size_t count)
{
    struct mesh_reader *reader = fields->reader;
    struct token word;
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double position[3];

        for (size_t k = 0; k < 3; k++) {
            if (!next_column(&fields->scan, &word)) {
                return mesh_truncated(reader, "vertex", i, count);
            }
            if (!token_number(word, reader->locale, &position[k])) {
                return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                                 "vertex %zu: '%s' is not a number", i, token_quote(word).text);
            }
        }
        status = mesh_add_vertex(reader, position);
    }
    return status;
}

static int read_polygons(struct fields *fields, size_t count)
{
    struct mesh_reader *reader = fields->reader;
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        int64_t index = 1;
        size_t corner = 0;

        while (index > 0 && status == SRNF_OK) {
            status = fields_index(fields, SCALAR_INT64, "face", i, &index);
            if (status == SRNF_OK && (index == 0 || index == INT64_MIN)) {
                status =
                    srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                              "face %zu: index %lld, where BYU counts from 1", i, (long long)index);
            }
            if (status == SRNF_OK) {
                status = mesh_add_corner(reader, i, corner++, (index < 0 ? -index : index) - 1);
            }
        }
        status = status == SRNF_OK ? mesh_check_corners(reader, i, (int64_t)corner) : status;
    }
    return status;
}

int mesh_read_byu(struct mesh_reader *reader)
{
    struct fields fields = {.reader = reader};
    size_t parts = 0, n_vertices = 0, n_polygons = 0, corners = 0;
    int status;

    scan_begin(&fields.scan, reader->bytes, reader->size);
    status = fields_count(&fields, SCALAR_INT64, "parts", 8, 2, &parts);
    if (status == SRNF_OK) {
        status = fields_count(&fields, SCALAR_INT64, "vertices", 8, 3, &n_vertices);
    }
    if (status == SRNF_OK) {
        status = fields_count(&fields, SCALAR_INT64, "faces", 8, 3, &n_polygons);
    }
    if (status == SRNF_OK) {
        status = fields_count(&fields, SCALAR_INT64, "corners", 8, 1, &corners);
    }
    if (status == SRNF_OK) {
        status = fields_skip(&fields, SCALAR_INT64, "part", 2 * parts);
    }
    if (status == SRNF_OK) {
        status = mesh_expect(reader, n_vertices, n_polygons);
    }
    if (status == SRNF_OK) {
        status = read_vertices(&fields, n_vertices);
    }
    if (status == SRNF_OK) {
        status = read_polygons(&fields, n_polygons);
    }
    return status == SRNF_OK ? mesh_no_more(reader, fields.scan.at) : status;
}
