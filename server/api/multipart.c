/*
 * multipart.c - forms as curl -F and browsers send them, read where they lie.
 *
 * libmicrohttpd's post processor takes a connection, and copies; the body is here as a whole, so
 * that parts are slices found by their delimiters, and nothing is allocated. Names are taken as
 * browsers write them (the HTML standard's multipart/form-data encoding algorithm): %22, %0D and
 * %0A for a quote and the ends of a line; curl puts a backslash before quotes and backslashes.
 */
#include "api/multipart.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#define BOUNDARY_MAX 70 /* RFC 2046, 5.1.1 */
#define HEAD_MAX ((size_t)8 << 10)

bool multipart_open(struct multipart *form, const char *type, const void *body, size_t size)
{
    const char *at = type ? strcasestr(type, "boundary=") : NULL;
    size_t length;

    if (!at) {
        return false;
    }
    at += strlen("boundary=");
    length = *at == '"' ? strcspn(++at, "\"") : strcspn(at, "; \t");
    if (length == 0 || length > BOUNDARY_MAX) {
        return false;
    }
    (void)snprintf(form->delimiter, sizeof form->delimiter, "\r\n--%.*s", (int)length, at);
    form->at = body;
    form->end = form->at + size;
    return true;
}

/* Where the next delimiter begins, or NULL. At the beginning of the body it may lack its CRLF. */
static const unsigned char *find_delimiter(const struct multipart *form)
{
    return memmem(form->at, (size_t)(form->end - form->at), form->delimiter,
                  strlen(form->delimiter));
}

/* Reads the value that begins at *at, quoted or not, and leaves *at behind it; false where its
   quote is not closed, or it is too long for the buffer. */
static bool read_value(const char **at, char *value, size_t size)
{
    bool quoted = **at == '"';
    size_t n = 0;

    for (*at += quoted; **at && **at != (quoted ? '"' : ';'); ++*at) {
        if (n + 1 >= size) {
            return false;
        }
        *at += quoted && **at == '\\' && ((*at)[1] == '"' || (*at)[1] == '\\');
        if (strncmp(*at, "%22", 3) == 0) {
            value[n++] = '"';
            *at += 2;
        } else {
            value[n++] = **at;
        }
    }
    value[n] = '\0';
    quoted = quoted && **at != '"';
    *at += **at == '"';
    return !quoted;
}

/* Takes the parameters name and filename of Content-Disposition. */
static bool take_disposition(const char *line, struct multipart_part *part)
{
    char other[MULTIPART_TEXT_MAX];

    for (line += strcspn(line, ";"); *line == ';'; line += strcspn(line, ";")) {
        bool good;

        line += 1 + strspn(line + 1, " \t");
        if (strncasecmp(line, "name=", 5) == 0) {
            line += 5;
            good = read_value(&line, part->name, sizeof part->name);
        } else if (strncasecmp(line, "filename=", 9) == 0) {
            line += 9;
            good = read_value(&line, part->file, sizeof part->file);
        } else {
            line += strcspn(line, "=;");
            line += *line == '=';
            good = read_value(&line, other, sizeof other);
        }
        if (!good) {
            return false;
        }
    }
    return true;
}

/* Takes one line of a part's head. */
static bool take_line(char *line, struct multipart_part *part)
{
    static const char disposition[] = "Content-Disposition:", type[] = "Content-Type:";

    if (strncasecmp(line, disposition, sizeof disposition - 1) == 0) {
        return take_disposition(line + sizeof disposition - 1, part);
    }
    if (strncasecmp(line, type, sizeof type - 1) == 0) {
        const char *value = line + sizeof type - 1;

        value += strspn(value, " \t");
        (void)snprintf(part->type, sizeof part->type, "%.*s", (int)strcspn(value, "; \t"), value);
    }
    return true;
}

/* Reads the head that begins at form->at, and leaves that behind it. */
static bool read_head(struct multipart *form, struct multipart_part *part)
{
    size_t left = (size_t)(form->end - form->at);
    const unsigned char *end = memmem(form->at, left < HEAD_MAX ? left : HEAD_MAX, "\r\n\r\n", 4);
    char line[2 * MULTIPART_TEXT_MAX];

    while (end && form->at < end + 2) {
        const unsigned char *stop = memmem(form->at, (size_t)(end + 2 - form->at), "\r\n", 2);
        size_t length = (size_t)(stop - form->at);

        if (length >= sizeof line || memchr(form->at, '\0', length)) {
            return false;
        }
        memcpy(line, form->at, length);
        line[length] = '\0';
        if (!take_line(line, part)) {
            return false;
        }
        form->at = stop + 2;
    }
    form->at = end ? end + 4 : form->at;
    return end && part->name[0];
}

static enum multipart_status wrong(char problem[160], const char *text)
{
    (void)snprintf(problem, 160, "%s", text);
    return MULTIPART_WRONG;
}

enum multipart_status multipart_next(struct multipart *form, struct multipart_part *part,
                                     char problem[160])
{
    size_t length = strlen(form->delimiter), left = (size_t)(form->end - form->at);
    const unsigned char *at = form->at;

    *part = (struct multipart_part){.size = 0};
    /* Before the first part the delimiter stands at the beginning, or after a preamble. */
    if (left >= length - 2 && memcmp(at, form->delimiter + 2, length - 2) == 0) {
        at += length - 2;
    } else {
        at = find_delimiter(form);
        at = at ? at + length : NULL;
    }
    if (!at || form->end - at < 2) {
        return wrong(problem, "the form is cut off: its last delimiter is missing");
    }
    if (at[0] == '-' && at[1] == '-') {
        return MULTIPART_END;
    }
    while (at < form->end && (*at == ' ' || *at == '\t')) {
        at++;
    }
    if (form->end - at < 2 || at[0] != '\r' || at[1] != '\n') {
        return wrong(problem, "a delimiter of the form is not followed by the end of its line");
    }
    form->at = at + 2;
    if (!read_head(form, part)) {
        return wrong(problem, "a part of the form has no name, or a head that is too long or not "
                              "well formed");
    }
    part->bytes = form->at;
    at = find_delimiter(form);
    if (!at) {
        return wrong(problem, "the form is cut off within a part");
    }
    part->size = (size_t)(at - form->at);
    form->at = at;
    return MULTIPART_PART;
}
