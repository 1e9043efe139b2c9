/*
 * fields.c - numbers one after the other (see fields.h).
 */
#include "fields.h"

#include <string.h>

static bool is_blank(const struct fields *fields, unsigned char c)
{
    return scan_is_space(c) || (fields->blanks && c != '\0' && strchr(fields->blanks, c));
}

static bool next_word(struct fields *fields, struct token *word)
{
    struct scan *scan = &fields->scan;

    while (scan->at < scan->end && is_blank(fields, *scan->at)) {
        scan->at++;
    }
    word->text = scan->at;
    while (scan->at < scan->end && !is_blank(fields, *scan->at)) {
        scan->at++;
    }
    word->size = (size_t)(scan->at - word->text);
    return word->size > 0;
}

static int missing(const struct fields *fields, const char *what, size_t element, struct token word)
{
    return scan_left(&fields->scan) == 0 && word.size == 0
               ? srnf_fail(fields->reader->error, SRNF_EPARSE, (int64_t)element,
                           "the file ends in %s %zu", what, element)
               : srnf_fail(fields->reader->error, SRNF_EPARSE, (int64_t)element,
                           "%s %zu: '%s' is not the number that should stand there", what, element,
                           token_quote(word).text);
}

/* The bytes of a number, which are then passed; NULL where the file ends. */
static const unsigned char *next_bytes(struct fields *fields, enum scalar_type type)
{
    const unsigned char *at = fields->scan.at;

    if (scan_left(&fields->scan) < scalar_size(type)) {
        fields->scan.at = fields->scan.end;
        return NULL;
    }
    fields->scan.at += scalar_size(type);
    return at;
}

int fields_number(struct fields *fields, enum scalar_type type, const char *what, size_t element,
                  double *value)
{
    struct token word = {NULL, 0};

    if (fields->binary) {
        const unsigned char *bytes = next_bytes(fields, type);

        if (!bytes) {
            return missing(fields, what, element, word);
        }
        *value = scalar_value(type, bytes, fields->big_endian);
    } else if (!next_word(fields, &word) || !token_number(word, fields->reader->locale, value)) {
        return missing(fields, what, element, word);
    }
    return mesh_step(fields->reader);
}

int fields_index(struct fields *fields, enum scalar_type type, const char *what, size_t element,
                 int64_t *value)
{
    struct token word = {NULL, 0};

    if (fields->binary) {
        const unsigned char *bytes = next_bytes(fields, type);

        if (!bytes) {
            return missing(fields, what, element, word);
        }
        (void)scalar_index(type, bytes, fields->big_endian, value);
    } else if (!next_word(fields, &word) || !token_integer(word, value)) {
        return missing(fields, what, element, word);
    }
    return mesh_step(fields->reader);
}

int fields_count(struct fields *fields, enum scalar_type type, const char *what, size_t least,
                 size_t words, size_t *count)
{
    int64_t value = 0;
    int status = fields_index(fields, type, what, 0, &value);

    if (status == SRNF_OK) {
        status = mesh_promise(fields->reader, what, value, fields->binary ? least : 2 * words,
                              scan_left(&fields->scan) + 1);
    }
    *count = status == SRNF_OK ? (size_t)value : 0;
    return status;
}

int fields_skip(struct fields *fields, enum scalar_type type, const char *what, size_t count)
{
    double value;
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        status = fields_number(fields, type, what, i, &value);
    }
    return status;
}

int fields_vertices(struct fields *fields, enum scalar_type type, size_t count)
{
    struct mesh_reader *reader = fields->reader;
    size_t base = reader->mesh.n_vertices;
    int status = SRNF_OK;

    if (count > SIZE_MAX - base) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1, "there are too many vertices");
    }
    status = mesh_expect(reader, base + count, reader->mesh.n_faces);
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double position[3] = {0, 0, 0};

        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            status = fields_number(fields, type, "vertex", base + i, &position[k]);
        }
        if (status == SRNF_OK) {
            status = mesh_add_vertex(reader, position);
        }
    }
    return status;
}
