/*
 * vtk_block.c - words and numbers of a legacy VTK file (see vtk.h).
 *
 * A block is a run of numbers of one type. Opening it makes sure that it is there and leaves the
 * cursor of the file behind it; its numbers are then taken by a cursor of its own. In text the
 * words are passed twice, which is the price of reading two blocks side by side without storing
 * either.
 */
#include "vtk.h"

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

int vtk_fail_at(const struct vtk *vtk, struct token word, const char *what)
{
    size_t byte = (size_t)(word.text - vtk->reader->bytes);

    return srnf_fail(vtk->reader->error, SRNF_EPARSE, (int64_t)byte, "byte %zu: '%s' %s", byte,
                     token_quote(word).text, what);
}

int vtk_next_count(struct vtk *vtk, const char *section, size_t *count)
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

int vtk_next_type(struct vtk *vtk, enum scalar_type *type)
{
    struct token word;

    if (!scan_word_on_line(&vtk->scan, &word)) {
        return vtk_fail_at(vtk, word, "stands where the type of an array should");
    }
    *type = token_scalar(word, type_names);
    return *type == SCALAR_NONE ? vtk_fail_at(vtk, word, "is no type of array that can be read")
                                : SRNF_OK;
}

size_t vtk_least_bytes(const struct vtk *vtk, enum scalar_type type)
{
    return vtk->binary ? scalar_size(type) : 2;
}

int vtk_open_block(struct vtk *vtk, const char *what, enum scalar_type type, size_t count,
                   struct vtk_block *block)
{
    struct token word;
    size_t size = vtk_least_bytes(vtk, type);
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
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        if (!scan_word(&vtk->scan, &word)) {
            return mesh_truncated(vtk->reader, what, i, count);
        }
        status = mesh_step(vtk->reader);
    }
    return status;
}

/* A string of a binary file: its length in one, two, four or eight bytes, big-endian, whose first
   two bits tell which; then its bytes. */
static bool skip_binary_string(struct scan *scan)
{
    static const size_t sizes[4] = {8, 4, 2, 1};
    size_t n = scan_left(scan) > 0 ? sizes[*scan->at >> 6] : 1;
    uint64_t length = 0;

    if (scan_left(scan) < n) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        length = (length << 8) | (i == 0 ? scan->at[i] & 0x3fu : scan->at[i]);
    }
    scan->at += n;
    if (length > scan_left(scan)) {
        return false;
    }
    scan->at += length;
    return true;
}

/* In text each string is a line. */
static int skip_strings(struct vtk *vtk, size_t count)
{
    struct token line;
    int status = SRNF_OK;

    (void)scan_line(&vtk->scan, &line);
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        if (!(vtk->binary ? skip_binary_string(&vtk->scan) : scan_line(&vtk->scan, &line))) {
            return mesh_truncated(vtk->reader, "string", i, count);
        }
        status = mesh_step(vtk->reader);
    }
    return status;
}

int vtk_skip_array(struct vtk *vtk, size_t count)
{
    struct scan ahead = vtk->scan;
    struct vtk_block block;
    struct token word;
    enum scalar_type type;
    int status;

    if (scan_word_on_line(&ahead, &word) &&
        (token_is(word, "string") || token_is(word, "utf8_string"))) {
        vtk->scan = ahead;
        return skip_strings(vtk, count);
    }
    if (token_is(word, "bit")) {
        vtk->scan = ahead;
        return vtk_open_block(vtk, "bits of a field", SCALAR_UINT8,
                              vtk->binary ? count / 8 + (count % 8 > 0) : count, &block);
    }
    status = vtk_next_type(vtk, &type);
    return status == SRNF_OK ? vtk_open_block(vtk, "numbers of a field", type, count, &block)
                             : status;
}

int vtk_block_number(struct vtk_block *block, const char *what, size_t element, double *value)
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

int vtk_block_index(struct vtk_block *block, const char *what, size_t element, int64_t *value)
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
    return is_whole ? mesh_step(reader)
                    : srnf_fail(reader->error, SRNF_EPARSE, (int64_t)element,
                                "%s %zu: something is not a whole number", what, element);
}
