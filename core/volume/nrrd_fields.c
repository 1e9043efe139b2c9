/*
 * nrrd_fields.c - the fields of an NRRD header.
 */
#include "nrrd.h"

#include <math.h>
#include <string.h>

static const struct scalar_name types[] = {
    {"signed char", SCALAR_INT8},
    {"int8", SCALAR_INT8},
    {"int8_t", SCALAR_INT8},
    {"uchar", SCALAR_UINT8},
    {"unsigned char", SCALAR_UINT8},
    {"uint8", SCALAR_UINT8},
    {"uint8_t", SCALAR_UINT8},
    {"short", SCALAR_INT16},
    {"short int", SCALAR_INT16},
    {"signed short", SCALAR_INT16},
    {"signed short int", SCALAR_INT16},
    {"int16", SCALAR_INT16},
    {"int16_t", SCALAR_INT16},
    {"ushort", SCALAR_UINT16},
    {"unsigned short", SCALAR_UINT16},
    {"unsigned short int", SCALAR_UINT16},
    {"uint16", SCALAR_UINT16},
    {"uint16_t", SCALAR_UINT16},
    {"int", SCALAR_INT32},
    {"signed int", SCALAR_INT32},
    {"int32", SCALAR_INT32},
    {"int32_t", SCALAR_INT32},
    {"uint", SCALAR_UINT32},
    {"unsigned int", SCALAR_UINT32},
    {"uint32", SCALAR_UINT32},
    {"uint32_t", SCALAR_UINT32},
    {"longlong", SCALAR_INT64},
    {"long long", SCALAR_INT64},
    {"long long int", SCALAR_INT64},
    {"signed long long", SCALAR_INT64},
    {"signed long long int", SCALAR_INT64},
    {"int64", SCALAR_INT64},
    {"int64_t", SCALAR_INT64},
    {"ulonglong", SCALAR_UINT64},
    {"unsigned long long", SCALAR_UINT64},
    {"unsigned long long int", SCALAR_UINT64},
    {"uint64", SCALAR_UINT64},
    {"uint64_t", SCALAR_UINT64},
    {"float", SCALAR_FLOAT32},
    {"double", SCALAR_FLOAT64},
    {NULL, SCALAR_NONE},
};

/* ---- Words of a field ------------------------------------------------------------------------ */

static int refuse(struct volume_reader *reader, const char *field, struct token value)
{
    return srnf_fail(reader->error, SRNF_EPARSE, -1, "the field \"%s\" cannot be \"%s\"", field,
                     token_quote(value).text);
}

static struct scan scan_of(struct token value)
{
    return (struct scan){.at = value.text, .end = value.text + value.size};
}

static int read_dimension(struct volume_reader *reader, struct nrrd_header *header,
                          struct token value)
{
    return token_integer(value, &header->dimension) && header->dimension > 0
               ? SRNF_OK
               : refuse(reader, "dimension", value);
}

static int read_sizes(struct volume_reader *reader, struct nrrd_header *header, struct token value)
{
    struct scan scan = scan_of(value);
    struct token word;

    header->n_axes = 0;
    while (scan_word(&scan, &word)) {
        if (header->n_axes == NRRD_AXES_MAX ||
            !token_integer(word, &header->sizes[header->n_axes])) {
            return refuse(reader, "sizes", value);
        }
        header->n_axes++;
    }
    return SRNF_OK;
}

static int read_spacings(struct volume_reader *reader, struct nrrd_header *header,
                         struct token value)
{
    struct scan scan = scan_of(value);
    struct token word;

    for (size_t n = 0; scan_word(&scan, &word); n++) {
        if (n == NRRD_AXES_MAX || !token_number(word, reader->locale, &header->spacings[n])) {
            return refuse(reader, "spacings", value);
        }
        if (isnan(header->spacings[n])) {
            header->spacings[n] = 1.0; /* NaN: the axis has none */
        }
    }
    return SRNF_OK;
}

/* Where the first sample is, or its edge; 0 and NaN say nothing. */
static int read_mins(struct volume_reader *reader, struct nrrd_header *header, struct token value)
{
    struct scan scan = scan_of(value);
    struct token word;
    double least;

    while (scan_word(&scan, &word)) {
        if (!token_number(word, reader->locale, &least)) {
            return refuse(reader, "axis mins", value);
        }
        header->has_mins = header->has_mins || fabs(least) > 0.0;
    }
    return SRNF_OK;
}

/* "(x,y,z)" at *at, with spaces anywhere. */
static bool read_vector(struct volume_reader *reader, struct token *left, double vector[3])
{
    const unsigned char *end = memchr(left->text, ')', left->size);
    struct token inner = {left->text + 1, 0};

    if (!end || left->text[0] != '(') {
        return false;
    }
    for (size_t k = 0; k < 3; k++) {
        const unsigned char *stop =
            k < 2 ? memchr(inner.text, ',', (size_t)(end - inner.text)) : end;
        struct scan scan;
        struct token word;

        if (!stop) {
            return false;
        }
        scan = (struct scan){.at = inner.text, .end = stop};
        if (!scan_word(&scan, &word) || !token_number(word, reader->locale, &vector[k]) ||
            !isfinite(vector[k])) {
            return false;
        }
        inner.text = stop < end ? stop + 1 : stop;
    }
    left->size -= (size_t)(end + 1 - left->text);
    left->text = end + 1;
    return true;
}

static void skip_spaces(struct token *left)
{
    while (left->size > 0 && (left->text[0] == ' ' || left->text[0] == '\t')) {
        left->text++;
        left->size--;
    }
}

static int read_directions(struct volume_reader *reader, struct nrrd_header *header,
                           struct token value)
{
    struct token left = value;

    header->has_directions = true;
    memset(header->spatial, 0, sizeof header->spatial);
    for (size_t n = 0; skip_spaces(&left), left.size > 0; n++) {
        if (n == NRRD_AXES_MAX) {
            return refuse(reader, "space directions", value);
        }
        if (left.size >= 4 && memcmp(left.text, "none", 4) == 0) {
            left.text += 4;
            left.size -= 4;
        } else if (read_vector(reader, &left, header->directions[n])) {
            header->spatial[n] = true;
        } else {
            return refuse(reader, "space directions", value);
        }
    }
    return SRNF_OK;
}

/* ---- Fields ---------------------------------------------------------------------------------- */

static int read_type(struct volume_reader *reader, struct nrrd_header *header, struct token value)
{
    (void)header;
    reader->type = token_scalar(value, types);
    return reader->type != SCALAR_NONE ? SRNF_OK : refuse(reader, "type", value);
}

static int read_encoding(struct volume_reader *reader, struct nrrd_header *header,
                         struct token value)
{
    bool text = token_is(value, "ascii") || token_is(value, "text") || token_is(value, "txt");

    header->encoding = token_is(value, "raw")                             ? ENCODING_RAW
                       : token_is(value, "gzip") || token_is(value, "gz") ? ENCODING_GZIP
                       : text                                             ? ENCODING_ASCII
                                                                          : ENCODING_NONE;
    return header->encoding != ENCODING_NONE
               ? SRNF_OK
               : srnf_fail(reader->error, SRNF_EPARSE, -1,
                           "the encoding \"%s\" is not read; save it as raw, gzip or ascii",
                           token_quote(value).text);
}

static int read_endian(struct volume_reader *reader, struct nrrd_header *header, struct token value)
{
    header->has_endian = true;
    reader->big_endian = token_is(value, "big");
    return reader->big_endian || token_is(value, "little") ? SRNF_OK
                                                           : refuse(reader, "endian", value);
}

static int read_space(struct volume_reader *reader, struct nrrd_header *header, struct token value)
{
    static const struct {
        const char *name;
        enum srnf_volume_space space;
    } spaces[] = {
        {"right-anterior-superior", SRNF_SPACE_RAS}, {"RAS", SRNF_SPACE_RAS},
        {"left-posterior-superior", SRNF_SPACE_LPS}, {"LPS", SRNF_SPACE_LPS},
        {"left-anterior-superior", SRNF_SPACE_LAS},  {"LAS", SRNF_SPACE_LAS},
        {"scanner-xyz", SRNF_SPACE_OTHER},           {"3D-right-handed", SRNF_SPACE_OTHER},
    };

    (void)header;
    for (size_t i = 0; i < sizeof spaces / sizeof spaces[0]; i++) {
        if (token_is(value, spaces[i].name)) {
            reader->volume.space = spaces[i].space;
            return SRNF_OK;
        }
    }
    return refuse(reader, "space", value);
}

static int read_space_dimension(struct volume_reader *reader, struct nrrd_header *header,
                                struct token value)
{
    (void)header;
    reader->volume.space = SRNF_SPACE_OTHER;
    return token_is(value, "3") ? SRNF_OK : refuse(reader, "space dimension", value);
}

static int read_origin(struct volume_reader *reader, struct nrrd_header *header, struct token value)
{
    struct token left = value;

    header->has_origin = true;
    return read_vector(reader, &left, header->origin) ? SRNF_OK
                                                      : refuse(reader, "space origin", value);
}

/* "mm" "mm" "mm": the first counts. */
static int read_units(struct volume_reader *reader, struct nrrd_header *header, struct token value)
{
    static const struct {
        const char *quoted, *name;
        double millimetres;
    } units[] = {
        {"\"mm\"", "millimetres", 1.0},
        {"\"cm\"", "centimetres", 10.0},
        {"\"m\"", "metres", 1000.0},
        {"\"um\"", "micrometres", 0.001},
    };
    struct scan scan = scan_of(value);
    struct token word;

    if (!scan_word(&scan, &word)) {
        return SRNF_OK;
    }
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        if (token_is(word, units[i].quoted)) {
            reader->volume.units = units[i].name;
            header->unit = units[i].millimetres;
        }
    }
    return SRNF_OK;
}

static int read_byte_skip(struct volume_reader *reader, struct nrrd_header *header,
                          struct token value)
{
    return token_integer(value, &header->byte_skip) && header->byte_skip >= -1
               ? SRNF_OK
               : refuse(reader, "byte skip", value);
}

static int read_line_skip(struct volume_reader *reader, struct nrrd_header *header,
                          struct token value)
{
    return token_integer(value, &header->line_skip) && header->line_skip >= 0
               ? SRNF_OK
               : refuse(reader, "line skip", value);
}

static int read_detached(struct volume_reader *reader, struct nrrd_header *header,
                         struct token value)
{
    (void)header;
    return srnf_fail(reader->error, SRNF_EPARSE, -1,
                     "the voxels are in another file (\"%s\"); save header and voxels as one .nrrd",
                     token_quote(value).text);
}

static const struct {
    const char *name, *other; /* and its other spelling, or NULL */
    int (*read)(struct volume_reader *reader, struct nrrd_header *header, struct token value);
} fields[] = {
    {"type", NULL, read_type},
    {"dimension", NULL, read_dimension},
    {"sizes", NULL, read_sizes},
    {"encoding", NULL, read_encoding},
    {"endian", NULL, read_endian},
    {"space", NULL, read_space},
    {"space dimension", NULL, read_space_dimension},
    {"space directions", NULL, read_directions},
    {"space origin", NULL, read_origin},
    {"space units", NULL, read_units},
    {"units", NULL, read_units},
    {"spacings", NULL, read_spacings},
    {"axis mins", "axismins", read_mins},
    {"byte skip", "byteskip", read_byte_skip},
    {"line skip", "lineskip", read_line_skip},
    {"data file", "datafile", read_detached},
};

struct token nrrd_trimmed(const unsigned char *text, size_t size)
{
    struct token token = {text, size};

    skip_spaces(&token);
    while (token.size > 0 &&
           (token.text[token.size - 1] == ' ' || token.text[token.size - 1] == '\t' ||
            token.text[token.size - 1] == '\r')) {
        token.size--;
    }
    return token;
}

int nrrd_read_field(struct volume_reader *reader, struct nrrd_header *header, struct token line)
{
    const unsigned char *colon = memchr(line.text, ':', line.size);
    struct token name, value;

    if (line.size == 0 || line.text[0] == '#' || !colon ||
        (colon + 1 < line.text + line.size && colon[1] == '=')) {
        return SRNF_OK;
    }
    name = nrrd_trimmed(line.text, (size_t)(colon - line.text));
    value = nrrd_trimmed(colon + 1, (size_t)(line.text + line.size - colon - 1));
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        if (!token_is(name, fields[i].name) &&
            !(fields[i].other && token_is(name, fields[i].other))) {
            continue;
        }
        if (header->given & (uint32_t)1 << i) {
            return srnf_fail(reader->error, SRNF_EPARSE, -1, "the field \"%s\" is given twice",
                             fields[i].name);
        }
        header->given |= (uint32_t)1 << i;
        return fields[i].read(reader, header, value);
    }
    return SRNF_OK;
}
