/*
 * delimited.h - tables as text: CSV with commas or semicolons, and TSV, as spreadsheets and
 * statistics programs write them.
 */
#ifndef SRNFD_API_DELIMITED_H
#define SRNFD_API_DELIMITED_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define DELIMITED_BYTES_MAX ((size_t)32 << 20)
#define DELIMITED_COLUMNS_MAX 80
#define DELIMITED_ROWS_MAX 100001 /* with the head */
#define DELIMITED_PROBLEM_MAX 200

/* A rectangle of texts in UTF-8. */
struct delimited {
    char separator;       /* , ; or a tab */
    size_t columns, rows; /* without the head */
    const char **cells;   /* [1 + rows][columns], the head first */
    uint32_t *lines;      /* [1 + rows] where each row begins, 1 the first */
    char *text;
};

enum delimited_status { DELIMITED_OK, DELIMITED_WRONG, DELIMITED_NO_MEMORY };

/*
 * Reads a table. Lines end in CRLF, LF or CR; a cell may stand in quotes, within which a quote is
 * doubled and lines may end; a byte order mark and a first line "sep=;" are passed over, and so are
 * lines with nothing in them. The separator is the one of tab, semicolon and comma that the head
 * has most of.
 *   text    [in]  size bytes, any
 *   table   [out] to be cleared, also on failure; charged to the thread's account
 *   problem [out] a sentence about what is wrong, where the status is DELIMITED_WRONG
 */
enum delimited_status delimited_read(const void *text, size_t size, struct delimited *table,
                                     char problem[DELIMITED_PROBLEM_MAX]);
void delimited_clear(struct delimited *table);

/* Row 0 is the first below the head. */
static inline const char *delimited_cell(const struct delimited *table, size_t row, size_t column)
{
    return table->cells[(row + 1) * table->columns + column];
}

/* Whether the text is valid UTF-8. */
bool delimited_utf8(const char *text, size_t size);

#endif
