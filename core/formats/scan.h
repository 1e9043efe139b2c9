/*
 * scan.h - a cursor over text: words, lines, and numbers free of any locale. Nothing here reads
 * past the end of its bytes, needs a terminating zero, or looks at a byte more than a fixed number
 * of times.
 */
#ifndef SRNF_FORMATS_SCAN_H
#define SRNF_FORMATS_SCAN_H

#include <locale.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "scalar.h"

/* Longest word that is taken for a number; more digits than any double has. */
#define SCAN_NUMBER_MAX 127
/* Longer than any word that a format is known by. */
#define SCAN_SNIFFED_MAX 4096

struct scan {
    const unsigned char *at, *end;
    size_t most;       /* bytes of the longest word, what is longer is several; 0: any */
    bool comments;     /* '#' at the start of a word hides the rest of its line */
    bool continuation; /* a backslash before the end of a line joins the next one to it */
};

/* A word: bytes between white space, inside the input. */
struct token {
    const unsigned char *text;
    size_t size;
};

/* A word made fit for a message: printable, and not long. */
struct quoted {
    char text[28];
};

/* White space as C's isspace has it in the locale "C". */
static inline bool scan_is_space(unsigned char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Starts at the first byte behind a UTF-8 byte order mark, should there be one. */
void scan_begin(struct scan *scan, const unsigned char *bytes, size_t size);

/* The same for a look at what the bytes may be: a word ends after SCAN_SNIFFED_MAX bytes, so that
   what is not text at all is not read to its end. */
void scan_sniff(struct scan *scan, const unsigned char *bytes, size_t size);

/* The next word, on whatever line; false at the end of the input. */
bool scan_word(struct scan *scan, struct token *token);

/* The next word of this line; false, without leaving the line, where it has no more. */
bool scan_word_on_line(struct scan *scan, struct token *token);

/* The rest of this line without its end (\n, \r\n or \r), which is passed; false at the end of the
   input. */
bool scan_line(struct scan *scan, struct token *line);

/* Bytes not yet read. */
size_t scan_left(const struct scan *scan);

/* Is the word this one (in ASCII), whatever the case of its letters? */
bool token_is(struct token token, const char *text);
bool token_begins(struct token token, const char *text);

/* Decimal integer with an optional sign; false for anything else and where it does not fit. */
bool token_integer(struct token token, int64_t *value);

/* Decimal number as in C, and nan and inf in their usual spellings; correctly rounded. locale: of
   "C". */
bool token_number(struct token token, locale_t locale, double *value);

/* Row of a table of type names, or SCALAR_NONE. */
enum scalar_type token_scalar(struct token token, const struct scalar_name *table);

struct quoted token_quote(struct token token);

#endif
