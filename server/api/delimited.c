/*
 * delimited.c - tables as text (RFC 4180, and what programs make of it), from memory in one pass.
 *
 * The cells are unquoted into one copy of the text, in place since a cell never grows, and a list
 * of pointers into it has the rectangle. So a table takes its size, eight bytes a cell and four a
 * row, whatever it holds. A row with another number of cells than the head is an error, not
 * guessed at: a comma within a number that was not quoted shows so.
 */
#include "api/delimited.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "srnf.h"

struct reader {
    struct delimited *table;
    char *at; /* what is left; a zero ends it */
    size_t line, cells, capacity, row_capacity;
    char *problem;
};

static enum delimited_status wrong(struct reader *reader, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static enum delimited_status wrong(struct reader *reader, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(reader->problem, DELIMITED_PROBLEM_MAX, format, arguments);
    va_end(arguments);
    return DELIMITED_WRONG;
}

/* Length of the character in UTF-8 that begins here; 0: none does. Longer forms than needed,
   surrogates and what lies beyond U+10FFFF are none (RFC 3629). */
static size_t character(const unsigned char *at, size_t left)
{
    static const unsigned char least[5] = {0, 0, 0x80, 0xa0, 0x90};
    size_t length = at[0] < 0x80                    ? 1
                    : at[0] >= 0xc2 && at[0] < 0xe0 ? 2
                    : at[0] >= 0xe0 && at[0] < 0xf0 ? 3
                    : at[0] >= 0xf0 && at[0] < 0xf5 ? 4
                                                    : 0;

    if (length == 0 || length > left) {
        return 0;
    }
    if ((at[0] == 0xe0 || at[0] == 0xf0) && at[1] < least[length]) {
        return 0;
    }
    if ((at[0] == 0xed && at[1] > 0x9f) || (at[0] == 0xf4 && at[1] > 0x8f)) {
        return 0;
    }
    for (size_t i = 1; i < length; i++) {
        if ((at[i] & 0xc0) != 0x80) {
            return 0;
        }
    }
    return length;
}

bool delimited_utf8(const char *text, size_t size)
{
    const unsigned char *at = (const unsigned char *)text;

    for (size_t i = 0, length; i < size; i += length) {
        length = character(at + i, size - i);
        if (length == 0) {
            return false;
        }
    }
    return true;
}

/* Whether the bytes are a text that can be a table at all. */
static enum delimited_status check_text(struct reader *reader, const unsigned char *text,
                                        size_t size)
{
    size_t line = 1;

    if (size > DELIMITED_BYTES_MAX) {
        return wrong(reader, "the table has %zu bytes; at most %zu are taken", size,
                     DELIMITED_BYTES_MAX);
    }
    if (size >= 2 &&
        ((text[0] == 0xff && text[1] == 0xfe) || (text[0] == 0xfe && text[1] == 0xff))) {
        return wrong(reader, "the table is in UTF-16; save it as CSV in UTF-8");
    }
    for (size_t i = 0, length; i < size; i += length) {
        length = character(text + i, size - i);
        line += text[i] == '\n';
        if (length == 0) {
            return wrong(reader, "line %zu is not in UTF-8; save the table in that encoding", line);
        }
        if (text[i] < 0x20 && text[i] != '\n' && text[i] != '\r' && text[i] != '\t') {
            return wrong(reader, "line %zu has a control character", line);
        }
    }
    return DELIMITED_OK;
}

static bool ends_line(char c)
{
    return c == '\n' || c == '\r';
}

/* Over one end of a line. */
static void end_line(struct reader *reader)
{
    char first = *reader->at;

    reader->at += first != '\0';
    reader->at += first == '\r' && *reader->at == '\n';
    reader->line++;
}

/* Takes "sep=;" as spreadsheets write it before the head. */
static void pass_hint(struct reader *reader)
{
    char *at = reader->at;

    if (strncmp(at, "sep=", 4) == 0 && at[4] && strchr(",;\t", at[4]) &&
        (ends_line(at[5]) || !at[5])) {
        reader->at = at + 5;
        end_line(reader);
    }
}

static char choose_separator(const char *head)
{
    static const char candidates[] = "\t;,";
    size_t counts[3] = {0};
    bool quoted = false;
    size_t best = 2;

    for (; *head && (quoted || !ends_line(*head)); head++) {
        const char *candidate = strchr(candidates, *head);

        quoted = quoted != (*head == '"');
        if (candidate && !quoted) {
            counts[candidate - candidates]++;
        }
    }
    for (size_t i = 3; i-- > 0;) {
        best = counts[i] > counts[best] ? i : best;
    }
    return candidates[best];
}

/* Makes room for one more of `size` bytes each; the list is charged to the thread's account. */
static bool grow(void *list, size_t count, size_t *capacity, size_t size, void **grown)
{
    *grown = list;
    if (count < *capacity) {
        return true;
    }
    size_t more = *capacity ? 2 * *capacity : 256;

    *grown = srnf_alloc(more, size);
    if (!*grown) {
        *grown = list;
        return false;
    }
    if (count > 0) {
        memcpy(*grown, list, count * size);
    }
    srnf_free(list);
    *capacity = more;
    return true;
}

static bool add_cell(struct reader *reader, const char *cell)
{
    void *grown;
    bool room = grow(reader->table->cells, reader->cells, &reader->capacity,
                     sizeof *reader->table->cells, &grown);

    reader->table->cells = grown;
    if (room) {
        reader->table->cells[reader->cells++] = cell;
    }
    return room;
}

/* Reads one cell, in quotes or not, and leaves its end at reader->at; the text is ended by a zero
   only when what follows was seen. */
static enum delimited_status read_cell(struct reader *reader, char **cell, char **end)
{
    char *in = reader->at, *out = in;
    size_t line = reader->line;

    *cell = in;
    if (*in != '"') {
        while (*in && !ends_line(*in) && *in != reader->table->separator) {
            if (*in++ == '"') {
                return wrong(reader, "line %zu has a quote within a cell without quotes", line);
            }
        }
        reader->at = *end = in;
        return DELIMITED_OK;
    }
    for (in++; *in && (*in != '"' || in[1] == '"'); in++) {
        reader->line += *in == '\n';
        in += *in == '"';
        *out++ = *in;
    }
    if (!*in) {
        return wrong(reader, "a quote of line %zu is not closed", line);
    }
    in++;
    if (*in && !ends_line(*in) && *in != reader->table->separator) {
        return wrong(reader, "line %zu has text after a quoted cell", reader->line);
    }
    reader->at = in;
    *end = out;
    return DELIMITED_OK;
}

/* Cuts spaces at both ends. */
static char *trim(char *cell, char *end)
{
    while (end > cell && (end[-1] == ' ' || end[-1] == '\t')) {
        end--;
    }
    *end = '\0';
    return cell + strspn(cell, " \t");
}

/* One row, of which *columns gets the number of cells. */
static enum delimited_status read_row(struct reader *reader, size_t *columns)
{
    bool more = true;

    for (*columns = 0; more; ++*columns) {
        char *cell = reader->at, *end = cell;
        enum delimited_status status = read_cell(reader, &cell, &end);

        if (status != DELIMITED_OK) {
            return status;
        }
        more = *reader->at == reader->table->separator;
        if (more) {
            reader->at++;
        } else {
            end_line(reader);
        }
        if (*columns == DELIMITED_COLUMNS_MAX) {
            return wrong(reader, "the table has more than %d columns", DELIMITED_COLUMNS_MAX);
        }
        if (!add_cell(reader, trim(cell, end))) {
            return DELIMITED_NO_MEMORY;
        }
    }
    return DELIMITED_OK;
}

static bool add_line(struct reader *reader, size_t row)
{
    void *grown;
    bool room = grow(reader->table->lines, row, &reader->row_capacity, sizeof *reader->table->lines,
                     &grown);

    reader->table->lines = grown;
    if (room) {
        reader->table->lines[row] = (uint32_t)reader->line;
    }
    return room;
}

/* Whether all cells of the row that was read last are empty, as spreadsheets leave rows below a
   table. */
static bool is_empty(const struct reader *reader, size_t columns)
{
    for (size_t i = reader->cells - columns; i < reader->cells; i++) {
        if (reader->table->cells[i][0]) {
            return false;
        }
    }
    return true;
}

static enum delimited_status read_rows(struct reader *reader)
{
    struct delimited *table = reader->table;
    size_t rows = 0, columns;

    while (*reader->at) {
        size_t line = reader->line;
        enum delimited_status status =
            add_line(reader, rows) ? read_row(reader, &columns) : DELIMITED_NO_MEMORY;

        if (status != DELIMITED_OK) {
            return status;
        }
        if (is_empty(reader, columns)) {
            reader->cells -= columns;
            continue;
        }
        if (rows > 0 && columns != table->columns) {
            return wrong(reader, "line %zu has %zu cells, and the head has %zu", line, columns,
                         table->columns);
        }
        table->columns = columns;
        if (++rows > DELIMITED_ROWS_MAX) {
            return wrong(reader, "the table has more than %d rows", DELIMITED_ROWS_MAX - 1);
        }
    }
    if (rows == 0) {
        return wrong(reader, "the table is empty");
    }
    table->rows = rows - 1;
    return DELIMITED_OK;
}

enum delimited_status delimited_read(const void *text, size_t size, struct delimited *table,
                                     char problem[DELIMITED_PROBLEM_MAX])
{
    static const unsigned char mark[3] = {0xef, 0xbb, 0xbf};
    struct reader reader = {.table = table, .line = 1, .problem = problem};
    enum delimited_status status;

    *table = (struct delimited){0};
    problem[0] = '\0';
    status = check_text(&reader, text, size);
    if (status != DELIMITED_OK) {
        return status;
    }
    table->text = srnf_alloc(size + 1, 1);
    if (!table->text) {
        return DELIMITED_NO_MEMORY;
    }
    if (size > 0) {
        memcpy(table->text, text, size);
    }
    table->text[size] = '\0';
    reader.at = table->text;
    if (size >= sizeof mark && memcmp(text, mark, sizeof mark) == 0) {
        reader.at += sizeof mark;
    }
    pass_hint(&reader);
    table->separator = choose_separator(reader.at);
    return read_rows(&reader);
}

void delimited_clear(struct delimited *table)
{
    srnf_free(table->cells);
    srnf_free(table->lines);
    srnf_free(table->text);
    *table = (struct delimited){0};
}
