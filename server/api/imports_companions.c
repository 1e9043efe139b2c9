/*
 * imports_companions.c - files that come with meshes and are none: texts for people, as README,
 * LICENSE and whatever ends on .txt or .md. They are passed over with a warning; what may be the
 * table under another name is none of them, since the cohort would silently lack what it says.
 */
#include "api/imports.h"

#include <string.h>
#include <strings.h>

#include "text.h"

#define KEY "file" /* the column that each table has */

/* Whether the line has the column, between commas, semicolons or tabs, or a tab at all. */
static bool heads_table(const char *line, size_t length)
{
    static const char around[] = " \"'";

    if (memchr(line, '\t', length)) {
        return true;
    }
    while (length > 0) {
        const char *cell = line;
        size_t size = 0;

        while (size < length && !strchr(",;", line[size])) {
            size++;
        }
        line += size < length ? size + 1 : size;
        length -= size < length ? size + 1 : size;
        while (size > 0 && strchr(around, *cell)) {
            cell++;
            size--;
        }
        while (size > 0 && strchr(around, cell[size - 1])) {
            size--;
        }
        if (size == sizeof KEY - 1 && strncasecmp(cell, KEY, size) == 0) {
            return true;
        }
    }
    return false;
}

/* Length of the first line, and how many commas and semicolons it has. */
static size_t line_of(const char *text, size_t size, size_t *separators)
{
    size_t length = 0;

    *separators = 0;
    while (length < size && text[length] != '\n' && text[length] != '\r') {
        *separators += text[length] == ',' || text[length] == ';';
        length++;
    }
    return length;
}

/* A text in UTF-8 that is no table: its first line has neither the column nor as many cells as the
   second, if it has several. */
static bool is_prose(const struct import_given *given)
{
    const char *text = (const char *)given->bytes;
    size_t size = given->size, first, next, cells, cells_next;

    if (size == 0) {
        return true;
    }
    if (!delimited_utf8(text, size) || memchr(text, '\0', size)) {
        return false;
    }
    if (size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) {
        text += 3;
        size -= 3;
    }
    next = first = line_of(text, size, &cells);
    while (next < size && (text[next] == '\n' || text[next] == '\r')) {
        next++;
    }
    (void)line_of(text + next, size - next, &cells_next);
    return !heads_table(text, first) && (cells == 0 || cells != cells_next);
}

static bool is_called_so(const char *path)
{
    static const char *const names[] = {"README", "LICENSE", "LICENCE", "COPYING", "CHANGES"};
    static const char *const endings[] = {".txt", ".md"};
    const char *base = text_base(path), *dot = strrchr(base, '.');

    for (size_t i = 0; dot && i < sizeof endings / sizeof endings[0]; i++) {
        if (strcasecmp(dot, endings[i]) == 0) {
            return true;
        }
    }
    for (size_t i = 0; !dot && i < sizeof names / sizeof names[0]; i++) {
        if (strcasecmp(base, names[i]) == 0) {
            return true;
        }
    }
    return false;
}

bool import_is_companion(const struct import_given *given)
{
    return is_called_so(given->path) && is_prose(given) &&
           srnf_mesh_sniff(given->bytes, given->size) == SRNF_MESH_UNKNOWN;
}
