/*
 * read_vtk.c - VTK's legacy format, dataset POLYDATA, ASCII and BINARY (big-endian).
 *
 *     # vtk DataFile Version 3.0
 *     title
 *     ASCII | BINARY
 *     DATASET POLYDATA
 *     POINTS n type                 3 n numbers
 *     POLYGONS n size               n times: corners, index, index, ...   (size int32 in all)
 *     POLYGONS n+1 size             from version 5.1 on: OFFSETS type, n+1 numbers,
 *                                   CONNECTIVITY type, size numbers
 *     TRIANGLE_STRIPS ...           as POLYGONS
 *     POINT_DATA ..., CELL_DATA ... not read, nor is anything behind them
 *
 * Source: "VTK File Formats for VTK Version 4.2", section "Simple Legacy Formats", and the VTK 9
 * release notes on the new layout. VERTICES, LINES, FIELD and METADATA are passed over. The
 * sections are a table. Numbers are taken from a block, which is a cursor of its own, so that
 * offsets and connectivity are read side by side without being stored.
 */
#include "mesh/mesh_io.h"

#include <string.h>

static const struct scalar_name type_names[] = {
    {"char", SCALAR_INT8},
    {"signed_char", SCALAR_INT8},
    {"unsigned_char", SCALAR_UINT8},
    {"short", SCALAR_INT16},
    {"unsigned_short", SCALAR_UINT16},
    {"int", SCALAR_INT32},
    {"unsigned_int", SCALAR_UINT32},
    {"long", SCALAR_INT64},
    {"unsigned_long", SCALAR_UINT64},
    {"vtkidtype", SCALAR_INT32},
    {"vtktypeint64", SCALAR_INT64},
    {"vtktypeuint64", SCALAR_UINT64},
    {"float", SCALAR_FLOAT32},
    {"double", SCALAR_FLOAT64},
    {NULL, SCALAR_NONE},
};

struct vtk {
    struct mesh_reader *reader;
    struct scan scan;
    bool binary, has_points, done;
};

/* Numbers of one type, one after the other. */
struct block {
    const struct vtk *vtk;
    struct scan scan;
    enum scalar_type type;
};

/* How cells are joined into triangles. */
enum cell_kind { CELL_POLYGON, CELL_STRIP, CELL_IGNORED };

/* A cell section: its two counts, and its numbers in either layout. */
struct cells {
    enum cell_kind kind;
    const char *name; /* of one cell, in messages */
    size_t n, size;
    bool has_offsets;
    struct block offsets, corners;
    int64_t last_offset;
};

static int fail_at(const struct vtk *vtk, struct token word, const char *what)
{
    size_t byte = (size_t)(word.text - vtk->reader->bytes);

    return srnf_fail(vtk->reader->error, SRNF_EPARSE, (int64_t)byte, "byte %zu: '%s' %s", byte,
                     token_quote(word).text, what);
}

static int next_count(struct vtk *vtk, const char *section, size_t *count)
{
    struct token word;
    int64_t value;

    if (!scan_word_on_line(&vtk->scan, &word) || !token_integer(word, &value) || value < 0) {
        return srnf_fail(vtk->reader->error, SRNF_EPARSE, -1,
                         "%s: a number behind it is missing or wrong", section);
    }
    *count = (size_t)value;
    return SRNF_OK;
}

static int next_type(struct vtk *vtk, enum scalar_type *type)
{
    struct token word;

    if (!scan_word_on_line(&vtk->scan, &word)) {
        return fail_at(vtk, word, "stands where the type of an array should");
    }
    *type = token_scalar(word, type_names);
    return *type == SCALAR_NONE ? fail_at(vtk, word, "is no type of array that can be read")
                                : SRNF_OK;
}

/* Fewest bytes of a number. */
static size_t least_bytes(const struct vtk *vtk, enum scalar_type type)
{
    return vtk->binary ? scalar_size(type) : 2;
}

/* Opens a block of `count` numbers behind the current line and passes it. The check comes first:
   whatever is read from the block later is there, if binary. */
static int open_block(struct vtk *vtk, const char *what, enum scalar_type type, size_t count,
                      struct block *block)
{
    struct token word;
    size_t size = least_bytes(vtk, type);
    int status;

    (void)scan_line(&vtk->scan, &word);
    status =
        mesh_promise(vtk->reader, what, (int64_t)count, size, scan_left(&vtk->scan) + !vtk->binary);
    if (status != SRNF_OK) {
        return status;
    }
    block->vtk = vtk;
    block->scan = vtk->scan;
    block->type = type;
    if (vtk->binary) {
        vtk->scan.at += count * size;
        return SRNF_OK;
    }
    for (size_t i = 0; i < count; i++) {
        if (!scan_word(&vtk->scan, &word)) {
            return mesh_truncated(vtk->reader, what, i, count);
        }
    }
    return SRNF_OK;
}

/* The next number of a block; the element is for the message. */
static int block_number(struct block *block, const char *what, size_t element, double *value)
{
    struct mesh_reader *reader = block->vtk->reader;
    struct token word;

    if (block->vtk->binary) {
        *value = scalar_value(block->type, block->scan.at, true);
        block->scan.at += scalar_size(block->type);
        return SRNF_OK;
    }
    if (!scan_word(&block->scan, &word) || !token_number(word, reader->locale, value)) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)element,
                         "%s %zu: '%s' is not a number", what, element, token_quote(word).text);
    }
    return SRNF_OK;
}

static int block_index(struct block *block, const char *what, size_t element, int64_t *value)
{
    struct mesh_reader *reader = block->vtk->reader;
    struct token word;
    bool is_whole;

    if (block->vtk->binary) {
        is_whole = scalar_index(block->type, block->scan.at, true, value);
        block->scan.at += scalar_size(block->type);
    } else {
        is_whole = scan_word(&block->scan, &word) && token_integer(word, value);
    }
    return is_whole ? SRNF_OK
                    : srnf_fail(reader->error, SRNF_EPARSE, (int64_t)element,
                                "%s %zu: something is not a whole number", what, element);
}

/* ---- Sections ------------------------------------------------------------------------------- */

static int read_points(struct vtk *vtk)
{
    struct block block;
    enum scalar_type type = SCALAR_NONE;
    size_t count = 0;
    int status = next_count(vtk, "POINTS", &count);

    if (status == SRNF_OK) {
        status = next_type(vtk, &type);
    }
    if (status == SRNF_OK && vtk->has_points) {
        status =
            srnf_fail(vtk->reader->error, SRNF_EPARSE, -1, "POINTS: there are two such sections");
    }
    if (status == SRNF_OK) {
        status = mesh_promise(vtk->reader, "vertices", (int64_t)count, 3 * least_bytes(vtk, type),
                              scan_left(&vtk->scan));
    }
    if (status == SRNF_OK) {
        status = mesh_expect(vtk->reader, count, 0);
    }
    if (status == SRNF_OK) {
        status = open_block(vtk, "coordinate", type, 3 * count, &block);
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double position[3] = {0, 0, 0};

        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            status = block_number(&block, "vertex", i, &position[k]);
        }
        if (status == SRNF_OK) {
            status = mesh_add_vertex(vtk->reader, position);
        }
    }
    vtk->has_points = true;
    return status;
}

/* Reads "KEYWORD type" on a line of its own. */
static int named_block(struct vtk *vtk, const char *keyword, size_t count, struct block *block)
{
    enum scalar_type type = SCALAR_NONE;
    struct token word;
    int status;

    if (!scan_word(&vtk->scan, &word) || !token_is(word, keyword)) {
        return srnf_fail(vtk->reader->error, SRNF_EPARSE, -1, "%s is missing", keyword);
    }
    status = next_type(vtk, &type);
    return status == SRNF_OK ? open_block(vtk, keyword, type, count, block) : status;
}

/* Finds out the layout and opens the blocks. */
static int open_cells(struct vtk *vtk, struct cells *cells)
{
    struct scan ahead = vtk->scan;
    struct token word;
    int status;

    cells->has_offsets = scan_word(&ahead, &word) && token_is(word, "OFFSETS");
    if (!cells->has_offsets) {
        return open_block(vtk, "numbers of cells", SCALAR_INT32, cells->size, &cells->corners);
    }
    status = named_block(vtk, "OFFSETS", cells->n, &cells->offsets);
    if (status == SRNF_OK) {
        status = named_block(vtk, "CONNECTIVITY", cells->size, &cells->corners);
    }
    if (status == SRNF_OK && cells->n > 0) {
        cells->n--;
        status = block_index(&cells->offsets, "offset", 0, &cells->last_offset);
        if (status == SRNF_OK && cells->last_offset != 0) {
            status = srnf_fail(vtk->reader->error, SRNF_EPARSE, 0, "offset 0: it is not 0");
        }
    }
    return status;
}

/* Corners of cell i; the numbers they take leave *left. */
static int next_cell(struct cells *cells, size_t i, size_t *left, int64_t *corners)
{
    struct mesh_reader *reader = cells->corners.vtk->reader;
    int status;

    if (cells->has_offsets) {
        int64_t offset = 0;

        status = block_index(&cells->offsets, "offset", i + 1, &offset);
        /* Below the last one it is negative, and refused below. */
        *corners = offset < 0 ? -1 : offset - cells->last_offset;
        cells->last_offset = offset;
    } else {
        if (*left == 0) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                             "%s %zu: the numbers promised for the section end before it",
                             cells->name, i);
        }
        --*left;
        status = block_index(&cells->corners, cells->name, i, corners);
    }
    if (status == SRNF_OK && (*corners < 0 || (uint64_t)*corners > *left)) {
        status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                           "%s %zu: %lld corners, but the section has %zu numbers left",
                           cells->name, i, (long long)*corners, *left);
    }
    *left -= status == SRNF_OK ? (size_t)*corners : 0;
    return status;
}

static int read_cell(struct cells *cells, size_t i, int64_t corners)
{
    struct mesh_reader *reader = cells->corners.vtk->reader;
    int status = cells->kind == CELL_POLYGON ? mesh_check_corners(reader, i, corners) : SRNF_OK;

    for (size_t k = 0; k < (size_t)corners && status == SRNF_OK; k++) {
        int64_t index = 0;

        status = block_index(&cells->corners, cells->name, i, &index);
        if (status == SRNF_OK) {
            status = cells->kind == CELL_POLYGON ? mesh_add_corner(reader, i, k, index)
                                                 : mesh_add_strip_corner(reader, i, k, index);
        }
    }
    return status;
}

static int read_cells(struct vtk *vtk, const char *section, enum cell_kind kind, const char *name)
{
    struct mesh_reader *reader = vtk->reader;
    struct cells cells = {.kind = kind, .name = name};
    int status = next_count(vtk, section, &cells.n);
    size_t left;

    if (status == SRNF_OK) {
        status = next_count(vtk, section, &cells.size);
    }
    if (status == SRNF_OK) {
        status = open_cells(vtk, &cells);
    }
    if (status != SRNF_OK || kind == CELL_IGNORED) {
        return status;
    }
    left = cells.size;
    if (cells.n > left) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "%s: %zu numbers cannot make %zu cells",
                         section, left, cells.n);
    }
    if (kind == CELL_POLYGON) {
        status = mesh_expect(reader, reader->mesh.n_vertices, reader->mesh.n_faces + cells.n);
    }
    for (size_t i = 0; i < cells.n && status == SRNF_OK; i++) {
        int64_t corners = 0;

        status = next_cell(&cells, i, &left, &corners);
        if (status == SRNF_OK) {
            status = read_cell(&cells, i, corners);
        }
    }
    if (status == SRNF_OK && left > 0) {
        status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)cells.n,
                           "%s: %zu numbers are left behind the last cell", section, left);
    }
    return status;
}

static int read_polygons(struct vtk *vtk)
{
    return read_cells(vtk, "POLYGONS", CELL_POLYGON, "face");
}

static int read_strips(struct vtk *vtk)
{
    return read_cells(vtk, "TRIANGLE_STRIPS", CELL_STRIP, "strip");
}

static int skip_cells(struct vtk *vtk)
{
    return read_cells(vtk, "VERTICES or LINES", CELL_IGNORED, "cell");
}

/* Lines up to an empty one. */
static int skip_metadata(struct vtk *vtk)
{
    struct token line;

    (void)scan_line(&vtk->scan, &line);
    while (scan_line(&vtk->scan, &line) && line.size > 0) {
    }
    return SRNF_OK;
}

/* FIELD name n, and n times: name components tuples type, and the numbers. */
static int skip_field(struct vtk *vtk)
{
    struct token word;
    size_t arrays = 0;
    int status = scan_word_on_line(&vtk->scan, &word) ? next_count(vtk, "FIELD", &arrays) : SRNF_OK;

    for (size_t i = 0; i < arrays && status == SRNF_OK; i++) {
        size_t components = 0, tuples = 0, count = 0;
        enum scalar_type type = SCALAR_NONE;
        struct block block;

        if (!scan_word(&vtk->scan, &word)) {
            return mesh_truncated(vtk->reader, "field array", i, arrays);
        }
        if (token_is(word, "METADATA")) {
            status = skip_metadata(vtk);
            i--;
            continue;
        }
        status = next_count(vtk, "FIELD", &components);
        if (status == SRNF_OK) {
            status = next_count(vtk, "FIELD", &tuples);
        }
        if (status == SRNF_OK) {
            status = next_type(vtk, &type);
        }
        if (status == SRNF_OK && __builtin_mul_overflow(components, tuples, &count)) {
            count = SIZE_MAX;
        }
        if (status == SRNF_OK) {
            count = count > INT64_MAX ? INT64_MAX : count;
            status = open_block(vtk, "numbers of a field", type, count, &block);
        }
    }
    return status;
}

/* What follows belongs to the points or cells and is no part of the mesh. */
static int stop(struct vtk *vtk)
{
    vtk->done = true;
    return SRNF_OK;
}

static const struct {
    const char *keyword;
    bool needs_points;
    int (*read)(struct vtk *vtk);
} sections[] = {
    {"POINTS", false, read_points},
    {"POLYGONS", true, read_polygons},
    {"TRIANGLE_STRIPS", true, read_strips},
    {"VERTICES", false, skip_cells},
    {"LINES", false, skip_cells},
    {"FIELD", false, skip_field},
    {"METADATA", false, skip_metadata},
    {"POINT_DATA", false, stop},
    {"CELL_DATA", false, stop},
};

static int read_section(struct vtk *vtk, struct token word)
{
    for (size_t i = 0; i < sizeof sections / sizeof sections[0]; i++) {
        if (token_is(word, sections[i].keyword)) {
            return sections[i].needs_points && !vtk->has_points
                       ? fail_at(vtk, word, "stands before POINTS")
                       : sections[i].read(vtk);
        }
    }
    return fail_at(vtk, word, "stands where a section should begin");
}

/* ---- The file ------------------------------------------------------------------------------- */

bool mesh_sniff_vtk(const unsigned char *bytes, size_t size)
{
    struct token text = {bytes, size};

    return token_begins(text, "# vtk DataFile");
}

static int read_header(struct vtk *vtk)
{
    struct token line, word;

    (void)scan_line(&vtk->scan, &line);
    if (!token_begins(line, "# vtk DataFile")) {
        return srnf_fail(vtk->reader->error, SRNF_EPARSE, 0,
                         "a legacy VTK file begins with '# vtk DataFile Version'");
    }
    (void)scan_line(&vtk->scan, &line);
    if (!scan_word(&vtk->scan, &word)) {
        return srnf_fail(vtk->reader->error, SRNF_EPARSE, -1, "the file ends in the VTK header");
    }
    vtk->binary = token_is(word, "BINARY");
    if (!vtk->binary && !token_is(word, "ASCII")) {
        return fail_at(vtk, word, "stands where ASCII or BINARY should");
    }
    if (!scan_word(&vtk->scan, &word) || !token_is(word, "DATASET") ||
        !scan_word_on_line(&vtk->scan, &word)) {
        return fail_at(vtk, word, "stands where a DATASET should");
    }
    return token_is(word, "POLYDATA") ? SRNF_OK : fail_at(vtk, word, "is not the dataset POLYDATA");
}

int mesh_read_vtk(struct mesh_reader *reader)
{
    struct vtk vtk = {.reader = reader};
    struct token word;
    int status;

    scan_begin(&vtk.scan, reader->bytes, reader->size);
    status = read_header(&vtk);
    while (status == SRNF_OK && !vtk.done && scan_word(&vtk.scan, &word)) {
        status = read_section(&vtk, word);
    }
    return status;
}
