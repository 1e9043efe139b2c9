/*
 * read_vtk.c - VTK's legacy format, datasets POLYDATA and UNSTRUCTURED_GRID, ASCII and BINARY
 * (big-endian).
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
 *     CELLS n size, CELL_TYPES n    of an unstructured grid: cells as POLYGONS, and then what each
 *                                   is: triangle, strip, polygon, pixel, quadrangle; points and
 *                                   lines are passed over, solids refused
 *     POINT_DATA ..., CELL_DATA ... not read, nor is anything behind them
 *
 * Source: "VTK File Formats for VTK Version 4.2", section "Simple Legacy Formats", and the VTK 9
 * release notes on the new layout. VERTICES, LINES, FIELD and METADATA are passed over. The
 * sections are a table. Numbers are taken from a block, which is a cursor of its own, so that
 * offsets and connectivity are read side by side without being stored.
 */
#include "vtk.h"

/* How cells are joined into triangles. */
enum cell_kind { CELL_POLYGON, CELL_STRIP, CELL_IGNORED, CELL_PIXEL };

/* A cell section: its two counts, and its numbers in either layout. */
struct vtk_cells {
    enum cell_kind kind;
    const char *name; /* of one cell, in messages */
    size_t n, size;
    bool has_offsets;
    struct vtk_block offsets, corners;
    int64_t last_offset;
};

/* ---- Sections -------------------------------------------------------------------------------- */

static int read_points(struct vtk *vtk)
{
    struct vtk_block block;
    enum scalar_type type = SCALAR_NONE;
    size_t count = 0;
    int status = vtk_next_count(vtk, "POINTS", &count);

    if (status == SRNF_OK) {
        status = vtk_next_type(vtk, &type);
    }
    if (status == SRNF_OK && vtk->has_points) {
        status =
            srnf_fail(vtk->reader->error, SRNF_EPARSE, -1, "POINTS: there are two such sections");
    }
    if (status == SRNF_OK) {
        status = mesh_promise(vtk->reader, "vertices", (int64_t)count,
                              3 * vtk_least_bytes(vtk, type), scan_left(&vtk->scan));
    }
    if (status == SRNF_OK) {
        status = mesh_expect(vtk->reader, count, 0);
    }
    if (status == SRNF_OK) {
        status = vtk_open_block(vtk, "coordinate", type, 3 * count, &block);
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double position[3] = {0, 0, 0};

        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            status = vtk_block_number(&block, "vertex", i, &position[k]);
        }
        if (status == SRNF_OK) {
            status = mesh_add_vertex(vtk->reader, position);
        }
    }
    vtk->has_points = true;
    return status;
}

/* Reads "KEYWORD type" on a line of its own. */
static int named_block(struct vtk *vtk, const char *keyword, size_t count, struct vtk_block *block)
{
    enum scalar_type type = SCALAR_NONE;
    struct token word;
    int status;

    if (!scan_word(&vtk->scan, &word) || !token_is(word, keyword)) {
        return srnf_fail(vtk->reader->error, SRNF_EPARSE, -1, "%s is missing", keyword);
    }
    status = vtk_next_type(vtk, &type);
    return status == SRNF_OK ? vtk_open_block(vtk, keyword, type, count, block) : status;
}

/* Finds out the layout and opens the blocks. */
static int open_cells(struct vtk *vtk, struct vtk_cells *cells)
{
    struct scan ahead = vtk->scan;
    struct token word;
    int status;

    cells->has_offsets = scan_word(&ahead, &word) && token_is(word, "OFFSETS");
    if (!cells->has_offsets) {
        return vtk_open_block(vtk, "numbers of cells", SCALAR_INT32, cells->size, &cells->corners);
    }
    status = named_block(vtk, "OFFSETS", cells->n, &cells->offsets);
    if (status == SRNF_OK) {
        status = named_block(vtk, "CONNECTIVITY", cells->size, &cells->corners);
    }
    if (status == SRNF_OK && cells->n > 0) {
        cells->n--;
        status = vtk_block_index(&cells->offsets, "offset", 0, &cells->last_offset);
        if (status == SRNF_OK && cells->last_offset != 0) {
            status = srnf_fail(vtk->reader->error, SRNF_EPARSE, 0, "offset 0: it is not 0");
        }
    }
    return status;
}

/* Corners of cell i; the numbers they take leave *left. */
static int next_cell(struct vtk_cells *cells, size_t i, size_t *left, int64_t *corners)
{
    struct mesh_reader *reader = cells->corners.vtk->reader;
    int status;

    if (cells->has_offsets) {
        int64_t offset = 0;

        status = vtk_block_index(&cells->offsets, "offset", i + 1, &offset);
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
        status = vtk_block_index(&cells->corners, cells->name, i, corners);
    }
    if (status == SRNF_OK && (*corners < 0 || (uint64_t)*corners > *left)) {
        status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                           "%s %zu: %lld corners, but the section has %zu numbers left",
                           cells->name, i, (long long)*corners, *left);
    }
    *left -= status == SRNF_OK ? (size_t)*corners : 0;
    return status;
}

static int read_cell(struct vtk_cells *cells, size_t i, int64_t corners)
{
    struct mesh_reader *reader = cells->corners.vtk->reader;
    int status = cells->kind == CELL_POLYGON ? mesh_check_corners(reader, i, corners) : SRNF_OK;

    for (size_t k = 0; k < (size_t)corners && status == SRNF_OK; k++) {
        int64_t index = 0;

        status = vtk_block_index(&cells->corners, cells->name, i, &index);
        if (status == SRNF_OK && cells->kind != CELL_IGNORED) {
            status = cells->kind == CELL_POLYGON ? mesh_add_corner(reader, i, k, index)
                                                 : mesh_add_strip_corner(reader, i, k, index);
        }
    }
    return status;
}

static int read_cells(struct vtk *vtk, const char *section, enum cell_kind kind, const char *name)
{
    struct mesh_reader *reader = vtk->reader;
    struct vtk_cells cells = {.kind = kind, .name = name};
    int status = vtk_next_count(vtk, section, &cells.n);
    size_t left;

    if (status == SRNF_OK) {
        status = vtk_next_count(vtk, section, &cells.size);
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

/* ---- Unstructured grids ---------------------------------------------------------------------- */

/* What the numbers of CELL_TYPES stand for; other cells are solids, or curved. */
static const struct {
    int64_t type;
    enum cell_kind kind;
} cell_types[] = {
    {1, CELL_IGNORED}, {2, CELL_IGNORED}, {3, CELL_IGNORED}, {4, CELL_IGNORED}, {5, CELL_POLYGON},
    {6, CELL_STRIP},   {7, CELL_POLYGON}, {8, CELL_PIXEL},   {9, CELL_POLYGON},
};

static int open_grid_cells(struct vtk *vtk)
{
    struct vtk_cells *cells = vtk->pending;
    int status = cells->corners.vtk ? srnf_fail(vtk->reader->error, SRNF_EPARSE, -1,
                                                "CELLS: there are two such sections")
                                    : vtk_next_count(vtk, "CELLS", &cells->n);

    if (status == SRNF_OK) {
        status = vtk_next_count(vtk, "CELLS", &cells->size);
    }
    cells->name = "cell";
    return status == SRNF_OK ? open_cells(vtk, cells) : status;
}

static int kind_of(struct vtk *vtk, size_t cell, int64_t type, enum cell_kind *kind)
{
    for (size_t i = 0; i < sizeof cell_types / sizeof cell_types[0]; i++) {
        if (cell_types[i].type == type) {
            *kind = cell_types[i].kind;
            return SRNF_OK;
        }
    }
    return srnf_fail(
        vtk->reader->error, SRNF_EPARSE, (int64_t)cell,
        "cell %zu is of type %lld, no polygon; extract the surface of the grid and save "
        "that",
        cell, (long long)type);
}

/* A pixel is a quadrangle whose last two corners are exchanged. */
static int read_pixel(struct vtk_cells *cells, size_t i, int64_t corners)
{
    static const size_t order[4] = {0, 1, 3, 2};
    struct mesh_reader *reader = cells->corners.vtk->reader;
    int64_t index[4];
    int status = corners == 4 ? SRNF_OK
                              : srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                                          "cell %zu: a pixel has 4 corners", i);

    for (size_t k = 0; k < 4 && status == SRNF_OK; k++) {
        status = vtk_block_index(&cells->corners, cells->name, i, &index[k]);
    }
    for (size_t k = 0; k < 4 && status == SRNF_OK; k++) {
        status = mesh_add_corner(reader, i, k, index[order[k]]);
    }
    return status;
}

static int read_types(struct vtk *vtk)
{
    struct vtk_cells *cells = vtk->pending;
    struct vtk_block types;
    size_t n = 0, left = cells->size;
    int status = vtk_next_count(vtk, "CELL_TYPES", &n);

    if (status == SRNF_OK && (!cells->corners.vtk || n != cells->n || n > left)) {
        status = srnf_fail(vtk->reader->error, SRNF_EPARSE, -1,
                           "CELL_TYPES: %zu types for %zu cells of %zu numbers", n, cells->n, left);
    }
    if (status == SRNF_OK) {
        status = vtk_open_block(vtk, "types of cells", SCALAR_INT32, n, &types);
    }
    if (status == SRNF_OK) {
        status = mesh_expect(vtk->reader, vtk->reader->mesh.n_vertices, n);
    }
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        int64_t type = 0, corners = 0;

        status = vtk_block_index(&types, "type of cell", i, &type);
        if (status == SRNF_OK) {
            status = kind_of(vtk, i, type, &cells->kind);
        }
        if (status == SRNF_OK) {
            status = next_cell(cells, i, &left, &corners);
        }
        if (status == SRNF_OK) {
            status = cells->kind == CELL_PIXEL ? read_pixel(cells, i, corners)
                                               : read_cell(cells, i, corners);
        }
    }
    cells->n = 0;
    vtk->done = true;
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
    int status = SRNF_OK;

    (void)scan_line(&vtk->scan, &line);
    while (status == SRNF_OK && scan_line(&vtk->scan, &line) && line.size > 0) {
        status = mesh_step(vtk->reader);
    }
    return status == SRNF_OK ? mesh_step(vtk->reader) : status;
}

/* FIELD name n, and n times: name components tuples type, and the numbers. */
static int skip_field(struct vtk *vtk)
{
    struct token word;
    size_t arrays = 0;
    int status =
        scan_word_on_line(&vtk->scan, &word) ? vtk_next_count(vtk, "FIELD", &arrays) : SRNF_OK;

    for (size_t i = 0; i < arrays && status == SRNF_OK; i++) {
        size_t components = 0, tuples = 0, count = 0;

        if (!scan_word(&vtk->scan, &word)) {
            return mesh_truncated(vtk->reader, "field array", i, arrays);
        }
        if (token_is(word, "METADATA")) {
            status = skip_metadata(vtk);
            i--;
            continue;
        }
        status = mesh_step(vtk->reader);
        if (status == SRNF_OK) {
            status = vtk_next_count(vtk, "FIELD", &components);
        }
        if (status == SRNF_OK) {
            status = vtk_next_count(vtk, "FIELD", &tuples);
        }
        if (status == SRNF_OK && __builtin_mul_overflow(components, tuples, &count)) {
            count = SIZE_MAX;
        }
        count = count > INT64_MAX ? INT64_MAX : count;
        if (status == SRNF_OK) {
            status = vtk_skip_array(vtk, count);
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
    {"CELLS", true, open_grid_cells},
    {"CELL_TYPES", true, read_types},
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
                       ? vtk_fail_at(vtk, word, "stands before POINTS")
                       : sections[i].read(vtk);
        }
    }
    return vtk_fail_at(vtk, word, "stands where a section should begin");
}

/* ---- The file -------------------------------------------------------------------------------- */

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
        return vtk_fail_at(vtk, word, "stands where ASCII or BINARY should");
    }
    if (!scan_word(&vtk->scan, &word) || !token_is(word, "DATASET") ||
        !scan_word_on_line(&vtk->scan, &word)) {
        return vtk_fail_at(vtk, word, "stands where a DATASET should");
    }
    return token_is(word, "POLYDATA") || token_is(word, "UNSTRUCTURED_GRID")
               ? SRNF_OK
               : vtk_fail_at(
                     vtk, word,
                     "is not the dataset POLYDATA or UNSTRUCTURED_GRID; extract the surface");
}

int mesh_read_vtk(struct mesh_reader *reader)
{
    struct vtk_cells cells = {.kind = CELL_IGNORED};
    struct vtk vtk = {.reader = reader, .pending = &cells};
    struct token word;
    int status;

    scan_begin(&vtk.scan, reader->bytes, reader->size);
    status = read_header(&vtk);
    while (status == SRNF_OK && !vtk.done && scan_word(&vtk.scan, &word)) {
        status = read_section(&vtk, word);
        status = status == SRNF_OK ? mesh_step(reader) : status;
    }
    return status;
}
