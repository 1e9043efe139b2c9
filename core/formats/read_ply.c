/*
 * read_ply.c - PLY: text and both binary encodings (header: ply_header.c).
 *
 * The body holds the elements in the order of the header. One walk serves all three encodings: it
 * asks a source, text or binary, for the next number, and hands it on by the role of its property;
 * what has no role is skipped. In text, numbers are separated by white space, whatever the lines.
 * Triangle strips are the list of the element tristrips, in which -1 starts a new strip.
 */
#include "ply.h"

#include <math.h>
#include <string.h>

struct body {
    struct mesh_reader *reader;
    const struct ply_header *header;
    const struct ply_element *element;
    size_t index;     /* of the instance within its element */
    struct scan scan; /* its cursor serves binary bodies too */
};

bool mesh_sniff_ply(const unsigned char *bytes, size_t size)
{
    return size >= 4 && memcmp(bytes, "ply", 3) == 0 &&
           (bytes[3] == '\n' || bytes[3] == '\r' || bytes[3] == ' ');
}

static int truncated(const struct body *body)
{
    return mesh_truncated(body->reader, body->element->name.text, body->index,
                          body->element->count);
}

static int not_a_number(const struct body *body, struct token word)
{
    return srnf_fail(body->reader->error, SRNF_EPARSE, (int64_t)body->index,
                     "%s %zu: '%s' is not a number", body->element->name.text, body->index,
                     token_quote(word).text);
}

/* The next number as a double; exact for every type of PLY. */
static int next_number(struct body *body, enum scalar_type type, double *value)
{
    struct token word;
    size_t size = scalar_size(type);

    if (body->header->encoding == PLY_ASCII) {
        if (!scan_word(&body->scan, &word)) {
            return truncated(body);
        }
        return token_number(word, body->reader->locale, value) ? SRNF_OK : not_a_number(body, word);
    }
    if (scan_left(&body->scan) < size) {
        return truncated(body);
    }
    *value = scalar_value(type, body->scan.at, body->header->encoding == PLY_BIG_ENDIAN);
    body->scan.at += size;
    return SRNF_OK;
}

/* Passes `count` numbers without looking at them. */
static int skip_numbers(struct body *body, enum scalar_type type, size_t count)
{
    struct token word;
    size_t size = scalar_size(type);
    int status = SRNF_OK;

    if (body->header->encoding != PLY_ASCII) {
        if (count > scan_left(&body->scan) / size) {
            return truncated(body);
        }
        body->scan.at += count * size;
        return SRNF_OK;
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        if (!scan_word(&body->scan, &word)) {
            return truncated(body);
        }
        status = mesh_step(body->reader);
    }
    return status;
}

static int next_whole(struct body *body, enum scalar_type type, const char *what, int64_t *value)
{
    double number = 0;
    int status = next_number(body, type, &number);

    if (status == SRNF_OK && !scalar_whole(number, value)) {
        status = srnf_fail(body->reader->error, SRNF_EPARSE, (int64_t)body->index,
                           "%s %zu: %s is not a whole number", body->element->name.text,
                           body->index, what);
    }
    return status;
}

static int read_polygon(struct body *body, enum scalar_type type, int64_t count)
{
    int status = mesh_check_corners(body->reader, body->index, count);

    for (int64_t k = 0; k < count && status == SRNF_OK; k++) {
        int64_t index = 0;

        status = next_whole(body, type, "an index", &index);
        if (status == SRNF_OK) {
            status = mesh_add_corner(body->reader, body->index, (size_t)k, index);
        }
    }
    return status;
}

static int read_strip(struct body *body, enum scalar_type type, int64_t count)
{
    int status = SRNF_OK;
    size_t corner = 0;

    for (int64_t k = 0; k < count && status == SRNF_OK; k++) {
        int64_t index = 0;

        status = next_whole(body, type, "an index", &index);
        if (status == SRNF_OK && index == -1) {
            corner = 0;
            status = mesh_step(body->reader);
        } else if (status == SRNF_OK) {
            status = mesh_add_strip_corner(body->reader, body->index, corner++, index);
        }
    }
    return status;
}

static int read_list(struct body *body, const struct ply_property *property)
{
    int64_t count = 0;
    size_t least = body->header->encoding == PLY_ASCII ? 2 : scalar_size(property->type);
    int status = next_whole(body, property->count, "the length of a list", &count);

    if (status != SRNF_OK) {
        return status;
    }
    if (count < 0) {
        return srnf_fail(body->reader->error, SRNF_EPARSE, (int64_t)body->index,
                         "%s %zu: the length of a list is negative", body->element->name.text,
                         body->index);
    }
    if ((uint64_t)count > (scan_left(&body->scan) + 1) / least) {
        return truncated(body);
    }
    if (property->role != PLY_CORNERS) {
        return skip_numbers(body, property->type, (size_t)count);
    }
    return body->element->role == PLY_STRIPS ? read_strip(body, property->type, count)
                                             : read_polygon(body, property->type, count);
}

/* One vertex, face, ... with all its properties. */
static int read_instance(struct body *body)
{
    double position[3] = {0, 0, 0};
    int status = SRNF_OK;

    for (size_t i = 0; i < body->element->n_properties && status == SRNF_OK; i++) {
        const struct ply_property *property =
            &body->header->properties[body->element->first_property + i];

        if (property->count != SCALAR_NONE) {
            status = read_list(body, property);
        } else if (property->role == PLY_OTHER) {
            status = skip_numbers(body, property->type, 1);
        } else {
            status = next_number(body, property->type, &position[property->role - PLY_X]);
        }
    }
    if (status == SRNF_OK && body->element->role == PLY_VERTEX) {
        status = mesh_add_vertex(body->reader, position);
    }
    return status == SRNF_OK ? mesh_step(body->reader) : status;
}

static int read_body(struct mesh_reader *reader, const struct ply_header *header)
{
    struct body body = {.reader = reader, .header = header};
    int status = mesh_expect(reader, header->n_vertices, header->n_faces);

    scan_begin(&body.scan, header->body, 0);
    body.scan.end = reader->bytes + reader->size;
    for (size_t i = 0; i < header->n_elements && status == SRNF_OK; i++) {
        body.element = &header->elements[i];
        if (body.element->n_properties == 0) {
            continue; /* An element without properties takes no bytes, however many are promised. */
        }
        for (body.index = 0; body.index < body.element->count && status == SRNF_OK; body.index++) {
            status = read_instance(&body);
        }
    }
    return status == SRNF_OK ? mesh_no_more(reader, body.scan.at) : status;
}

int mesh_read_ply(struct mesh_reader *reader)
{
    struct ply_header *header = mesh_alloc(reader, 1, sizeof *header);
    int status;

    if (!header) {
        return reader->status;
    }
    status = ply_read_header(reader, header);
    if (status == SRNF_OK) {
        status = read_body(reader, header);
    }
    mesh_release(reader, header, 1, sizeof *header);
    return status;
}
