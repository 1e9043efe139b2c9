/*
 * ply_header.c - the header of a PLY file.
 *
 *     ply
 *     format ascii | binary_little_endian | binary_big_endian 1.0
 *     comment ...          obj_info ...
 *     element NAME COUNT
 *     property TYPE NAME
 *     property list COUNT-TYPE TYPE NAME
 *     end_header
 *
 * Source: G. Turk, "The PLY Polygon File Format", 1994; the sized names of types (int8 .. float64)
 * are a later habit of several programs. Every keyword is a row of a table. Lines end in \n, \r\n
 * or \r.
 */
#include "ply.h"

#include <string.h>

#define CORNERS_MIN 3

static const struct scalar_name type_names[] = {
    {"char", SCALAR_INT8},       {"uchar", SCALAR_UINT8},    {"short", SCALAR_INT16},
    {"ushort", SCALAR_UINT16},   {"int", SCALAR_INT32},      {"uint", SCALAR_UINT32},
    {"float", SCALAR_FLOAT32},   {"double", SCALAR_FLOAT64}, {"int8", SCALAR_INT8},
    {"uint8", SCALAR_UINT8},     {"int16", SCALAR_INT16},    {"uint16", SCALAR_UINT16},
    {"int32", SCALAR_INT32},     {"uint32", SCALAR_UINT32},  {"float32", SCALAR_FLOAT32},
    {"float64", SCALAR_FLOAT64}, {NULL, SCALAR_NONE},
};

static const struct {
    const char *name;
    enum ply_encoding encoding;
} encodings[] = {
    {"ascii", PLY_ASCII},
    {"binary_little_endian", PLY_LITTLE_ENDIAN},
    {"binary_big_endian", PLY_BIG_ENDIAN},
};

/* Names that mean something to us: of elements, and of the properties of these. */
static const struct {
    const char *name;
    enum ply_role role;
} element_roles[] = {
    {"vertex", PLY_VERTEX},
    {"face", PLY_FACE},
    {"tristrips", PLY_STRIPS},
};
static const struct {
    enum ply_role owner;
    const char *name;
    bool is_list;
    enum ply_role role;
} property_roles[] = {
    {PLY_VERTEX, "x", false, PLY_X},
    {PLY_VERTEX, "y", false, PLY_Y},
    {PLY_VERTEX, "z", false, PLY_Z},
    {PLY_FACE, "vertex_indices", true, PLY_CORNERS},
    {PLY_FACE, "vertex_index", true, PLY_CORNERS},
    {PLY_STRIPS, "vertex_indices", true, PLY_CORNERS},
    {PLY_STRIPS, "vertex_index", true, PLY_CORNERS},
};

static enum ply_role element_role(struct token name)
{
    for (size_t i = 0; i < sizeof element_roles / sizeof element_roles[0]; i++) {
        if (token_is(name, element_roles[i].name)) {
            return element_roles[i].role;
        }
    }
    return PLY_OTHER;
}

static enum ply_role property_role(enum ply_role owner, bool is_list, struct token name)
{
    for (size_t i = 0; i < sizeof property_roles / sizeof property_roles[0]; i++) {
        if (property_roles[i].owner == owner && property_roles[i].is_list == is_list &&
            token_is(name, property_roles[i].name)) {
            return property_roles[i].role;
        }
    }
    return PLY_OTHER;
}

static int parse_format(struct mesh_reader *reader, struct ply_header *header, struct scan *line)
{
    struct token name, version;

    if (scan_word_on_line(line, &name) && scan_word_on_line(line, &version)) {
        for (size_t i = 0; i < sizeof encodings / sizeof encodings[0]; i++) {
            if (token_is(name, encodings[i].name) && token_is(version, "1.0")) {
                header->encoding = encodings[i].encoding;
                header->n_formats++;
                return SRNF_OK;
            }
        }
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "PLY header: format '%s' version '%s' is not known",
                         token_quote(name).text, token_quote(version).text);
    }
    return srnf_fail(reader->error, SRNF_EPARSE, -1, "PLY header: the format line is incomplete");
}

static int parse_element(struct mesh_reader *reader, struct ply_header *header, struct scan *line)
{
    struct ply_element *element;
    struct token name, count;
    int64_t value;

    if (header->n_elements == PLY_ELEMENTS_MAX) {
        return srnf_fail(reader->error, SRNF_ELIMIT, PLY_ELEMENTS_MAX,
                         "PLY header: more than %d elements", PLY_ELEMENTS_MAX);
    }
    if (!scan_word_on_line(line, &name) || !scan_word_on_line(line, &count) ||
        !token_integer(count, &value) || value < 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)header->n_elements,
                         "PLY header: element %zu has no name or no proper count",
                         header->n_elements);
    }
    element = &header->elements[header->n_elements++];
    element->role = element_role(name);
    element->name = token_quote(name);
    element->count = (size_t)value;
    element->first_property = header->n_properties;
    return SRNF_OK;
}

static int parse_property(struct mesh_reader *reader, struct ply_header *header, struct scan *line)
{
    struct ply_element *element;
    struct ply_property *property;
    struct token word = {NULL, 0}, name = {NULL, 0};

    if (header->n_elements == 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "PLY header: a property stands before any element");
    }
    if (header->n_properties == PLY_PROPERTIES_MAX) {
        return srnf_fail(reader->error, SRNF_ELIMIT, PLY_PROPERTIES_MAX,
                         "PLY header: more than %d properties", PLY_PROPERTIES_MAX);
    }
    element = &header->elements[header->n_elements - 1];
    property = &header->properties[header->n_properties++];
    element->n_properties++;
    if (!scan_word_on_line(line, &word)) {
        goto bad;
    }
    if (token_is(word, "list")) {
        if (!scan_word_on_line(line, &word)) {
            goto bad;
        }
        property->count = token_scalar(word, type_names);
        if (property->count == SCALAR_NONE || !scan_word_on_line(line, &word)) {
            goto bad;
        }
    }
    property->type = token_scalar(word, type_names);
    if (property->type == SCALAR_NONE || !scan_word_on_line(line, &name)) {
        goto bad;
    }
    property->role = property_role(element->role, property->count != SCALAR_NONE, name);
    return SRNF_OK;
bad:
    return srnf_fail(
        reader->error, SRNF_EPARSE, (int64_t)header->n_properties - 1,
        "PLY header: a property of element '%s' has the type '%s', which is not known, or no name",
        element->name.text, token_quote(word).text);
}

static int parse_nothing(struct mesh_reader *reader, struct ply_header *header, struct scan *line)
{
    (void)reader;
    (void)header;
    (void)line;
    return SRNF_OK;
}

static const struct {
    const char *name;
    int (*parse)(struct mesh_reader *reader, struct ply_header *header, struct scan *line);
} keywords[] = {
    {"format", parse_format},   {"element", parse_element},  {"property", parse_property},
    {"comment", parse_nothing}, {"obj_info", parse_nothing},
};

/* One line of the header; *done after end_header. */
static int parse_line(struct mesh_reader *reader, struct ply_header *header, struct token text,
                      bool *done)
{
    struct scan line;
    struct token word;

    scan_begin(&line, text.text, text.size);
    if (!scan_word_on_line(&line, &word)) {
        return SRNF_OK;
    }
    *done = token_is(word, "end_header");
    if (*done) {
        return SRNF_OK;
    }
    for (size_t i = 0; i < sizeof keywords / sizeof keywords[0]; i++) {
        if (token_is(word, keywords[i].name)) {
            return keywords[i].parse(reader, header, &line);
        }
    }
    return srnf_fail(reader->error, SRNF_EPARSE, -1, "PLY header: '%s' is no keyword",
                     token_quote(word).text);
}

/* How often an element (its own role) or a property of it (another role) occurs. */
static size_t count_role(const struct ply_header *header, const struct ply_element *element,
                         enum ply_role role)
{
    size_t count = 0;

    for (size_t i = 0; i < element->n_properties; i++) {
        count += header->properties[element->first_property + i].role == role;
    }
    return count;
}

static int check_properties(struct mesh_reader *reader, const struct ply_header *header,
                            const struct ply_element *element)
{
    if (element->role == PLY_VERTEX &&
        (count_role(header, element, PLY_X) != 1 || count_role(header, element, PLY_Y) != 1 ||
         count_role(header, element, PLY_Z) != 1)) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "PLY header: element vertex needs the properties x, y and z, once each");
    }
    if ((element->role == PLY_FACE || element->role == PLY_STRIPS) &&
        count_role(header, element, PLY_CORNERS) != 1) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "PLY header: element %s needs one list property vertex_indices",
                         element->name.text);
    }
    return SRNF_OK;
}

/* Bytes that one instance takes at least: in text, a digit and a space for each number. A face has
   three corners or it is refused anyway. */
static size_t least_bytes(const struct ply_header *header, const struct ply_element *element)
{
    bool text = header->encoding == PLY_ASCII;
    size_t least = 0;

    for (size_t i = 0; i < element->n_properties; i++) {
        const struct ply_property *property = &header->properties[element->first_property + i];
        size_t binary =
            scalar_size(property->count != SCALAR_NONE ? property->count : property->type);

        least += text ? 2 : binary;
        if (element->role == PLY_FACE && property->role == PLY_CORNERS) {
            least += CORNERS_MIN * (text ? 2 : scalar_size(property->type));
        }
    }
    return least;
}

/* Each element in turn must fit into what the ones before it leave. */
static int check_room(struct mesh_reader *reader, const struct ply_header *header,
                      const struct ply_element *element, size_t *left)
{
    static const char *const plurals[] = {[PLY_OTHER] = "elements",
                                          [PLY_VERTEX] = "vertices",
                                          [PLY_FACE] = "faces",
                                          [PLY_STRIPS] = "strips"};
    size_t least = least_bytes(header, element);
    int status = SRNF_OK;

    if (least > 0) {
        status =
            mesh_promise(reader, plurals[element->role], (int64_t)element->count, least, *left);
        *left -= status == SRNF_OK ? least * element->count : 0;
    }
    return status;
}

/* What the elements are comes before how many there are. */
static int check_elements(struct mesh_reader *reader, struct ply_header *header)
{
    size_t seen[PLY_STRIPS + 1] = {0};
    size_t left = (size_t)(reader->bytes + reader->size - header->body);
    int status = SRNF_OK;

    for (size_t i = 0; i < header->n_elements && status == SRNF_OK; i++) {
        const struct ply_element *element = &header->elements[i];

        seen[element->role]++;
        header->n_vertices += element->role == PLY_VERTEX ? element->count : 0;
        header->n_faces += element->role == PLY_FACE ? element->count : 0;
        status = check_properties(reader, header, element);
    }
    if (status == SRNF_OK && (seen[PLY_VERTEX] != 1 || seen[PLY_FACE] + seen[PLY_STRIPS] != 1)) {
        status = srnf_fail(reader->error, SRNF_EPARSE, -1,
                           "PLY header: there must be one element vertex and one element face (or "
                           "tristrips)");
    }
    left += header->encoding == PLY_ASCII; /* The last number of a text needs no space behind it. */
    for (size_t i = 0; i < header->n_elements && status == SRNF_OK; i++) {
        status = check_room(reader, header, &header->elements[i], &left);
    }
    return status;
}

int ply_read_header(struct mesh_reader *reader, struct ply_header *header)
{
    struct scan scan;
    struct token line;
    bool done = false;

    scan_begin(&scan, reader->bytes, reader->size);
    if (!mesh_sniff_ply(reader->bytes, reader->size) || !scan_line(&scan, &line)) {
        return srnf_fail(reader->error, SRNF_EPARSE, 0, "a PLY file begins with the line 'ply'");
    }
    while (!done && scan_line(&scan, &line)) {
        int status = parse_line(reader, header, line, &done);

        if (status != SRNF_OK) {
            return status;
        }
    }
    if (!done || header->n_formats != 1) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         done ? "PLY header: there must be one format line"
                              : "PLY header: the file ends before end_header");
    }
    header->body = scan.at;
    return check_elements(reader, header);
}
