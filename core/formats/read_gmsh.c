/*
 * read_gmsh.c - Gmsh's .msh, versions 2.2 and 4.1, as text and binary.
 *
 *     $MeshFormat  version type(0 text, 1 binary) size; in binary an int32 1
 *     $Nodes       2.2: n, then n times: tag x y z
 *                  4.1: blocks n min max, then for each block: dim entity parametric n, tags,
 *                    points
 *     $Elements    2.2: n, then: tag type ntags tags.. nodes..; in binary in groups: type n ntags
 *                  4.1: blocks n min max, then for each block: dim entity type n, and tag nodes..
 *
 * Source: Gmsh's reference manual, "Gmsh file formats". Read are triangles and quadrangles of the
 * first order. Points, lines and solids are passed over; triangles of higher order are refused,
 * since without their middle nodes they are another surface. Other sections are passed over. Nodes
 * have tags of any numbers, which are sorted where they do not rise.
 */
#include "fields.h"
#include "mesh/mesh_geometry.h"

#include <string.h>

struct gmsh {
    struct fields fields;
    bool is_4;
    int64_t *tags;   /* of the vertices, by mesh_alloc */
    uint32_t *order; /* vertices by tags; NULL: the tags rise */
    size_t n_tags, capacity, solids, faces;
};

/* Nodes of each type of element (1 to 31); 0: not known. */
static const unsigned char type_nodes[] = {0,  2,  3,  4,  4, 8, 6,  5,  3,  6, 9,
                                           10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10,
                                           12, 15, 15, 21, 4, 5, 6,  20, 35, 56};
#define TYPES (sizeof type_nodes)
#define NODES_MAX 64

enum { TYPE_TRIANGLE = 2, TYPE_QUADRANGLE = 3, TYPE_TETRAHEDRON = 4, TYPE_PYRAMID = 7 };

/* Two-dimensional elements of higher order. */
static bool is_curved(int64_t type)
{
    static const unsigned char curved[] = {9, 10, 16, 20, 21, 22, 23, 24, 25};

    for (size_t i = 0; i < sizeof curved; i++) {
        if (type == curved[i]) {
            return true;
        }
    }
    return false;
}

bool mesh_sniff_gmsh(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;

    scan_sniff(&scan, bytes, size);
    return scan_word(&scan, &word) &&
           (token_is(word, "$MeshFormat") || token_is(word, "$Comments") || token_is(word, "$NOD"));
}

/* ---- Nodes ----------------------------------------------------------------------------------- */

static bool less_tag(const void *subject, uint32_t a, uint32_t b)
{
    const int64_t *tags = subject;

    return tags[a] < tags[b];
}

static int keep_tags(struct gmsh *gmsh, size_t count)
{
    gmsh->tags = mesh_alloc(gmsh->fields.reader, count > 0 ? count : 1, sizeof *gmsh->tags);
    gmsh->capacity = count > 0 ? count : 1;
    return gmsh->tags ? SRNF_OK : gmsh->fields.reader->status;
}

static int sort_tags(struct gmsh *gmsh)
{
    struct mesh_reader *reader = gmsh->fields.reader;
    size_t n = gmsh->n_tags;
    uint32_t *scratch;
    bool rises = true;

    for (size_t i = 1; i < n && rises; i++) {
        rises = gmsh->tags[i - 1] < gmsh->tags[i];
    }
    if (rises) {
        return SRNF_OK;
    }
    gmsh->order = mesh_alloc(reader, n, sizeof *gmsh->order);
    scratch = gmsh->order ? mesh_alloc(reader, n, sizeof *scratch) : NULL;
    if (!scratch) {
        return reader->status;
    }
    for (size_t i = 0; i < n; i++) {
        gmsh->order[i] = (uint32_t)i;
    }
    srnf_sort_order(gmsh->order, scratch, n, less_tag, gmsh->tags, reader->limits.context);
    mesh_release(reader, scratch, n, sizeof *scratch);
    for (size_t i = 1; i < n; i++) {
        if (gmsh->tags[gmsh->order[i - 1]] == gmsh->tags[gmsh->order[i]]) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i, "two nodes have the tag %lld",
                             (long long)gmsh->tags[gmsh->order[i]]);
        }
    }
    return mesh_ask(reader);
}

/* The vertex of a tag, or -1. */
static int64_t vertex_of(const struct gmsh *gmsh, int64_t tag)
{
    size_t low = 0, high = gmsh->n_tags;

    while (low < high) {
        size_t middle = low + (high - low) / 2;
        size_t vertex = gmsh->order ? gmsh->order[middle] : middle;

        if (gmsh->tags[vertex] == tag) {
            return (int64_t)vertex;
        }
        if (gmsh->tags[vertex] < tag) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return -1;
}

static int read_position(struct gmsh *gmsh)
{
    size_t i = gmsh->fields.reader->mesh.n_vertices;
    double position[3] = {0, 0, 0};
    int status = SRNF_OK;

    for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
        status = fields_number(&gmsh->fields, SCALAR_FLOAT64, "vertex", i, &position[k]);
    }
    return status == SRNF_OK ? mesh_add_vertex(gmsh->fields.reader, position) : status;
}

static int read_nodes_2(struct gmsh *gmsh, size_t count)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        status = fields_index(&gmsh->fields, SCALAR_INT32, "node", i, &gmsh->tags[i]);
        gmsh->n_tags = i + 1;
        if (status == SRNF_OK) {
            status = read_position(gmsh);
        }
    }
    return status;
}

/* The four numbers at the head of a block: dimension, entity, and two more. */
static int read_block_head(struct gmsh *gmsh, const char *what, size_t block, int64_t head[4])
{
    int status = SRNF_OK;

    for (size_t k = 0; k < 4 && status == SRNF_OK; k++) {
        status = fields_index(&gmsh->fields, k < 3 ? SCALAR_INT32 : SCALAR_UINT64, what, block,
                              &head[k]);
    }
    return status;
}

static int read_node_block(struct gmsh *gmsh, size_t block)
{
    int64_t head[4] = {0, 0, 0, 0};
    int status = read_block_head(gmsh, "block of nodes", block, head);

    if (status == SRNF_OK &&
        (head[3] < 0 || (uint64_t)head[3] > gmsh->capacity - gmsh->n_tags || head[2] != 0)) {
        return srnf_fail(gmsh->fields.reader->error, SRNF_EPARSE, (int64_t)block,
                         "block of nodes %zu: it has more nodes than are left, or parameters",
                         block);
    }
    for (int64_t i = 0; i < head[3] && status == SRNF_OK; i++) {
        status = fields_index(&gmsh->fields, SCALAR_UINT64, "node", gmsh->n_tags,
                              &gmsh->tags[gmsh->n_tags]);
        gmsh->n_tags += status == SRNF_OK;
    }
    for (int64_t i = 0; i < head[3] && status == SRNF_OK; i++) {
        status = read_position(gmsh);
    }
    return status;
}

/* A number of nodes or elements. In 2.2 it is a line of text in binary files too. */
static int read_total(struct gmsh *gmsh, const char *what, size_t least, size_t words,
                      size_t *count)
{
    struct fields *fields = &gmsh->fields;
    bool binary = fields->binary;
    struct token line;
    int status;

    fields->binary = binary && gmsh->is_4;
    status =
        fields_count(fields, SCALAR_UINT64, what, least, fields->binary ? words : words / 2, count);
    fields->binary = binary;
    if (binary && !gmsh->is_4) {
        (void)scan_line(&fields->scan, &line);
    }
    return status;
}

static int read_nodes(struct gmsh *gmsh)
{
    struct fields *fields = &gmsh->fields;
    size_t blocks = 0, count = 0;
    int status = SRNF_OK;

    if (gmsh->tags) {
        return srnf_fail(fields->reader->error, SRNF_EPARSE, -1, "there are two sections $Nodes");
    }
    if (gmsh->is_4) {
        status = fields_count(fields, SCALAR_UINT64, "blocks of nodes", 20, 4, &blocks);
    }
    if (status == SRNF_OK) {
        status = read_total(gmsh, "vertices", 28, 4, &count);
    }
    if (status == SRNF_OK && gmsh->is_4) {
        status = fields_skip(fields, SCALAR_UINT64, "tag of a node", 2);
    }
    if (status == SRNF_OK) {
        status = mesh_expect(fields->reader, count, 0);
    }
    if (status == SRNF_OK) {
        status = keep_tags(gmsh, count);
    }
    if (status == SRNF_OK && !gmsh->is_4) {
        status = read_nodes_2(gmsh, count);
    }
    for (size_t i = 0; i < blocks && status == SRNF_OK; i++) {
        status = read_node_block(gmsh, i);
    }
    return status == SRNF_OK ? sort_tags(gmsh) : status;
}

/* ---- Elements -------------------------------------------------------------------------------- */

static int check_type(struct gmsh *gmsh, size_t element, int64_t type)
{
    struct srnf_error *error = gmsh->fields.reader->error;

    if (is_curved(type)) {
        return srnf_fail(
            error, SRNF_EPARSE, (int64_t)element,
            "element %zu is curved (type %lld); save the mesh with elements of order 1", element,
            (long long)type);
    }
    if (type < 1 || type >= (int64_t)TYPES || type_nodes[type] == 0) {
        return srnf_fail(error, SRNF_EPARSE, (int64_t)element,
                         "element %zu has the type %lld, which is not known", element,
                         (long long)type);
    }
    gmsh->solids += type >= TYPE_TETRAHEDRON && type <= TYPE_PYRAMID;
    return SRNF_OK;
}

/* The nodes of one element, and its face where it is one. */
static int read_corners(struct gmsh *gmsh, size_t element, int64_t type, enum scalar_type number)
{
    struct mesh_reader *reader = gmsh->fields.reader;
    bool is_face = type == TYPE_TRIANGLE || type == TYPE_QUADRANGLE;
    int status = SRNF_OK;

    for (size_t k = 0; k < type_nodes[type] && status == SRNF_OK; k++) {
        int64_t tag = 0, vertex;

        status = fields_index(&gmsh->fields, number, "element", element, &tag);
        vertex = status == SRNF_OK && is_face ? vertex_of(gmsh, tag) : -1;
        if (status == SRNF_OK && is_face && vertex < 0) {
            status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)element,
                               "element %zu: there is no node %lld", element, (long long)tag);
        } else if (status == SRNF_OK && is_face) {
            status = mesh_add_corner(reader, gmsh->faces, k, vertex);
        }
    }
    gmsh->faces += is_face;
    return status;
}

/* Elements of one type: `tags` numbers come before the nodes of each. */
static int read_group(struct gmsh *gmsh, size_t *element, int64_t type, int64_t count, int64_t tags,
                      enum scalar_type number)
{
    int status = check_type(gmsh, *element, type);

    for (int64_t i = 0; i < count && status == SRNF_OK; i++) {
        status = fields_skip(&gmsh->fields, number, "element", (size_t)tags);
        if (status == SRNF_OK) {
            status = read_corners(gmsh, *element, type, number);
        }
        ++*element;
    }
    return status;
}

static int read_elements_2(struct gmsh *gmsh, size_t count)
{
    struct fields *fields = &gmsh->fields;
    size_t element = 0;
    int status = SRNF_OK;

    while (element < count && status == SRNF_OK) {
        int64_t tag = 0, type = 0, follow = 1, tags = 0;

        if (!fields->binary) {
            status = fields_index(fields, SCALAR_INT32, "element", element, &tag);
        }
        if (status == SRNF_OK) {
            status = fields_index(fields, SCALAR_INT32, "element", element, &type);
        }
        if (status == SRNF_OK && fields->binary) {
            status = fields_index(fields, SCALAR_INT32, "element", element, &follow);
        }
        if (status == SRNF_OK) {
            status = fields_index(fields, SCALAR_INT32, "element", element, &tags);
        }
        if (status == SRNF_OK &&
            (tags < 0 || tags > NODES_MAX || follow < 1 || (uint64_t)follow > count - element)) {
            return srnf_fail(fields->reader->error, SRNF_EPARSE, (int64_t)element,
                             "element %zu: its number of tags or the size of its group is wrong",
                             element);
        }
        if (status == SRNF_OK) {
            status = read_group(gmsh, &element, type, follow, tags + fields->binary, SCALAR_INT32);
        }
    }
    return status;
}

static int read_elements(struct gmsh *gmsh)
{
    struct fields *fields = &gmsh->fields;
    size_t blocks = 0, count = 0, element = 0;
    int status = SRNF_OK;

    if (!gmsh->tags) {
        return srnf_fail(fields->reader->error, SRNF_EPARSE, -1, "$Elements stands before $Nodes");
    }
    if (gmsh->is_4) {
        status = fields_count(fields, SCALAR_UINT64, "blocks of elements", 20, 4, &blocks);
    }
    if (status == SRNF_OK) {
        status = read_total(gmsh, "elements", 8, 2, &count);
    }
    if (status == SRNF_OK && !gmsh->is_4) {
        return read_elements_2(gmsh, count);
    }
    if (status == SRNF_OK) {
        status = fields_skip(fields, SCALAR_UINT64, "tag of an element", 2);
    }
    for (size_t i = 0; i < blocks && status == SRNF_OK; i++) {
        int64_t head[4] = {0, 0, 0, 0};

        status = read_block_head(gmsh, "block of elements", i, head);
        if (status == SRNF_OK) {
            status = read_group(gmsh, &element, head[2], head[3], 1, SCALAR_UINT64);
        }
    }
    return status;
}

/* ---- The file -------------------------------------------------------------------------------- */

/* Passes the end of a section, which may hold anything before it. */
static int skip_section(struct gmsh *gmsh, struct token name)
{
    struct scan *scan = &gmsh->fields.scan;
    char end[40] = "$End";
    const unsigned char *found;

    if (name.size < 2 || name.size > 30 || name.text[0] != '$') {
        return srnf_fail(gmsh->fields.reader->error, SRNF_EPARSE,
                         (int64_t)(name.text - gmsh->fields.reader->bytes),
                         "byte %zu: '%s' stands where a section should begin",
                         (size_t)(name.text - gmsh->fields.reader->bytes), token_quote(name).text);
    }
    memcpy(end + 4, name.text + 1, name.size - 1);
    end[name.size + 3] = '\0';
    found = memmem(scan->at, scan_left(scan), end, strlen(end));
    if (!found) {
        return srnf_fail(gmsh->fields.reader->error, SRNF_EPARSE, -1, "the file ends before %s",
                         end);
    }
    scan->at = found + strlen(end);
    return mesh_step(gmsh->fields.reader);
}

static int read_format(struct gmsh *gmsh)
{
    struct fields *fields = &gmsh->fields;
    struct srnf_error *error = fields->reader->error;
    struct token version, word;
    int64_t kind = 0, size = 0, one = 0;

    if (!scan_word(&fields->scan, &version) || !scan_word(&fields->scan, &word) ||
        !token_integer(word, &kind) || !scan_word(&fields->scan, &word) ||
        !token_integer(word, &size)) {
        return srnf_fail(error, SRNF_EPARSE, 0, "$MeshFormat: version, type or size is missing");
    }
    gmsh->is_4 = token_is(version, "4.1");
    if (!gmsh->is_4 && !token_is(version, "2.2") && !token_is(version, "2") &&
        !token_is(version, "2.1") && !token_is(version, "2.0")) {
        return srnf_fail(error, SRNF_EFORMAT, 0,
                         "Gmsh's format %s is not read; save the mesh in version 4.1 or 2.2",
                         token_quote(version).text);
    }
    if (size != 8 || kind < 0 || kind > 1) {
        return srnf_fail(error, SRNF_EPARSE, 0, "$MeshFormat: type %lld and size %lld are not read",
                         (long long)kind, (long long)size);
    }
    if (kind == 1) {
        struct token line;

        (void)scan_line(&fields->scan, &line);
        if (scan_left(&fields->scan) < 4) {
            return srnf_fail(error, SRNF_EPARSE, 0, "the file ends in $MeshFormat");
        }
        (void)scalar_index(SCALAR_INT32, fields->scan.at, false, &one);
        fields->binary = true;
        fields->big_endian = one != 1;
    }
    return SRNF_OK;
}

static const struct {
    const char *name;
    int (*read)(struct gmsh *gmsh);
} sections[] = {{"$MeshFormat", read_format}, {"$Nodes", read_nodes}, {"$Elements", read_elements}};

static int read_section(struct gmsh *gmsh, struct token name)
{
    struct token line;
    int status = SRNF_OK;

    for (size_t i = 0; i < sizeof sections / sizeof sections[0]; i++) {
        if (token_is(name, sections[i].name)) {
            if (gmsh->fields.binary) {
                (void)scan_line(&gmsh->fields.scan, &line);
            }
            status = sections[i].read(gmsh);
            break;
        }
    }
    return status == SRNF_OK ? skip_section(gmsh, name) : status;
}

int mesh_read_gmsh(struct mesh_reader *reader)
{
    struct gmsh gmsh = {.fields = {.reader = reader}};
    struct token name;
    int status = SRNF_OK;

    scan_begin(&gmsh.fields.scan, reader->bytes, reader->size);
    while (status == SRNF_OK && scan_word(&gmsh.fields.scan, &name)) {
        status = token_is(name, "$NOD")
                     ? srnf_fail(reader->error, SRNF_EFORMAT, 0,
                                 "Gmsh's format 1 is not read; save the mesh in version 4.1 or 2.2")
                     : read_section(&gmsh, name);
    }
    if (status == SRNF_OK && reader->mesh.n_faces == 0 && gmsh.solids > 0) {
        status = srnf_fail(reader->error, SRNF_EPARSE, -1,
                           "the mesh has %zu solid elements, but no triangles; save its surface",
                           gmsh.solids);
    }
    mesh_release(reader, gmsh.tags, gmsh.capacity, sizeof *gmsh.tags);
    mesh_release(reader, gmsh.order, gmsh.n_tags, sizeof *gmsh.order);
    return status;
}
