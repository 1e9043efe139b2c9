/*
 * scan.c - words, lines and numbers (see scan.h).
 *
 * Numbers: a decimal with at most 19 digits whose integer value is below 2^53, times a power of
 * ten of at most 22, is one correctly rounded operation on two exact doubles (W. Clinger, "How to
 * read floating point numbers accurately", PLDI 1990). That is nearly every number in a mesh file;
 * the others go to strtod_l with the "C" locale, from a copy that ends in a zero.
 */
#include "scan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EXACT_MANTISSA ((uint64_t)1 << 53)
#define EXACT_POWER 22
#define DIGITS_MAX 19          /* of which any uint64_t holds */
#define EXPONENT_CLAMP 1000000 /* beyond the range of double by far, and safe to add to */

static const double powers[EXACT_POWER + 1] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                               1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                               1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static bool is_blank(unsigned char c)
{
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

static bool is_line_end(unsigned char c)
{
    return c == '\n' || c == '\r';
}

static bool is_digit(unsigned char c)
{
    return c >= '0' && c <= '9';
}

static unsigned char lower(unsigned char c)
{
    return c >= 'A' && c <= 'Z' ? (unsigned char)(c - 'A' + 'a') : c;
}

void scan_begin(struct scan *scan, const unsigned char *bytes, size_t size)
{
    static const unsigned char mark[] = {0xef, 0xbb, 0xbf};

    memset(scan, 0, sizeof *scan);
    scan->at = bytes;
    scan->end = bytes + size;
    if (size >= sizeof mark && memcmp(bytes, mark, sizeof mark) == 0) {
        scan->at += sizeof mark;
    }
}

void scan_sniff(struct scan *scan, const unsigned char *bytes, size_t size)
{
    scan_begin(scan, bytes, size);
    scan->most = SCAN_SNIFFED_MAX;
}

size_t scan_left(const struct scan *scan)
{
    return (size_t)(scan->end - scan->at);
}

/* Length of the line end at p: 0 where there is none. */
static size_t line_end_size(const unsigned char *p, const unsigned char *end)
{
    if (p == end || !is_line_end(*p)) {
        return 0;
    }
    return *p == '\r' && end - p > 1 && p[1] == '\n' ? 2 : 1;
}

/* Passes blanks, a comment, and line ends behind a backslash: stops at a word, a line end or the
   end. */
static void skip_blanks(struct scan *scan)
{
    while (scan->at < scan->end) {
        size_t joined;

        if (is_blank(*scan->at)) {
            scan->at++;
        } else if (scan->comments && *scan->at == '#') {
            while (scan->at < scan->end && !is_line_end(*scan->at)) {
                scan->at++;
            }
        } else if (scan->continuation && *scan->at == '\\' &&
                   (joined = line_end_size(scan->at + 1, scan->end)) > 0) {
            scan->at += 1 + joined;
        } else {
            break;
        }
    }
}

bool scan_word_on_line(struct scan *scan, struct token *token)
{
    const unsigned char *at, *end;

    skip_blanks(scan);
    token->text = at = scan->at;
    end = scan->most && scan_left(scan) > scan->most ? at + scan->most : scan->end;
    while (at < end && !is_blank(*at) && !is_line_end(*at) &&
           !(scan->continuation && *at == '\\' && line_end_size(at + 1, scan->end))) {
        at++;
    }
    scan->at = at;
    token->size = (size_t)(at - token->text);
    return token->size > 0;
}

bool scan_word(struct scan *scan, struct token *token)
{
    for (;;) {
        skip_blanks(scan);
        if (scan->at == scan->end || !is_line_end(*scan->at)) {
            return scan_word_on_line(scan, token);
        }
        scan->at++;
    }
}

bool scan_line(struct scan *scan, struct token *line)
{
    line->text = scan->at;
    if (scan->at == scan->end) {
        line->size = 0;
        return false;
    }
    while (scan->at < scan->end && !is_line_end(*scan->at)) {
        scan->at++;
    }
    line->size = (size_t)(scan->at - line->text);
    scan->at += line_end_size(scan->at, scan->end);
    return true;
}

bool token_begins(struct token token, const char *text)
{
    size_t size = strlen(text);

    if (token.size < size) {
        return false;
    }
    for (size_t i = 0; i < size; i++) {
        if (lower(token.text[i]) != lower((unsigned char)text[i])) {
            return false;
        }
    }
    return true;
}

bool token_is(struct token token, const char *text)
{
    return token.size == strlen(text) && token_begins(token, text);
}

bool token_integer(struct token token, int64_t *value)
{
    size_t i = 0;
    bool negative = false;
    int64_t sum = 0;

    if (token.size > 0 && (token.text[0] == '-' || token.text[0] == '+')) {
        negative = token.text[0] == '-';
        i = 1;
    }
    if (i == token.size) {
        return false;
    }
    for (; i < token.size; i++) {
        if (!is_digit(token.text[i]) || __builtin_mul_overflow(sum, 10, &sum) ||
            __builtin_sub_overflow(sum, token.text[i] - '0', &sum)) {
            return false;
        }
    }
    if (!negative && sum == INT64_MIN) {
        return false;
    }
    *value = negative ? sum : -sum;
    return true;
}

/* A decimal number taken apart: (-1)^negative * mantissa * 10^exponent, or inexact where digits
   were lost. */
struct decimal {
    bool negative, inexact;
    uint64_t mantissa;
    int exponent;
};

static bool parse_exponent(struct token token, size_t i, int *exponent)
{
    struct token digits = {token.text + i, token.size - i};
    int64_t value = 0;

    if (!token_integer(digits, &value)) {
        return false;
    }
    *exponent = (int)(value > EXPONENT_CLAMP ? EXPONENT_CLAMP
                                             : (value < -EXPONENT_CLAMP ? -EXPONENT_CLAMP : value));
    return true;
}

static bool parse_decimal(struct token token, struct decimal *decimal)
{
    size_t i = 0, digits = 0, significant = 0;
    bool point = false;
    int exponent = 0;

    memset(decimal, 0, sizeof *decimal);
    if (token.text[0] == '-' || token.text[0] == '+') {
        decimal->negative = token.text[0] == '-';
        i = 1;
    }
    for (; i < token.size && (is_digit(token.text[i]) || (token.text[i] == '.' && !point)); i++) {
        if (token.text[i] == '.') {
            point = true;
            continue;
        }
        digits++;
        significant += significant > 0 || token.text[i] != '0';
        if (significant <= DIGITS_MAX) {
            decimal->mantissa = 10 * decimal->mantissa + (uint64_t)(token.text[i] - '0');
        } else {
            decimal->inexact = true;
        }
        decimal->exponent -= point;
    }
    if (digits == 0) {
        return false;
    }
    if (i < token.size && (token.text[i] == 'e' || token.text[i] == 'E')) {
        if (!parse_exponent(token, i + 1, &exponent)) {
            return false;
        }
        decimal->exponent += exponent;
        return true;
    }
    return i == token.size;
}

/* nan and inf are numbers, which the caller then refuses by their own name. */
static bool parse_special(struct token token, double *value)
{
    static const struct {
        const char *name;
        bool is_nan;
    } names[] = {{"nan", true},       {"inf", false},    {"infinity", false}, {"nan(ind)", true},
                 {"nan(snan)", true}, {"1.#inf", false}, {"1.#qnan", true},   {"1.#ind", true}};

    if (token.size > 0 && (token.text[0] == '-' || token.text[0] == '+')) {
        token.text++;
        token.size--;
    }
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (token_is(token, names[i].name)) {
            *value = names[i].is_nan ? (double)NAN : (double)INFINITY;
            return true;
        }
    }
    return false;
}

bool token_number(struct token token, locale_t locale, double *value)
{
    struct decimal decimal;
    char copy[SCAN_NUMBER_MAX + 1];

    if (token.size == 0 || token.size > SCAN_NUMBER_MAX) {
        return false;
    }
    if (!parse_decimal(token, &decimal)) {
        return parse_special(token, value);
    }
    if (!decimal.inexact && decimal.mantissa <= EXACT_MANTISSA &&
        decimal.exponent >= -EXACT_POWER && decimal.exponent <= EXACT_POWER) {
        double exact = (double)decimal.mantissa;

        exact = decimal.exponent < 0 ? exact / powers[-decimal.exponent]
                                     : exact * powers[decimal.exponent];
        *value = decimal.negative ? -exact : exact;
        return true;
    }
    memcpy(copy, token.text, token.size);
    copy[token.size] = '\0';
    *value = strtod_l(copy, NULL, locale);
    return true;
}

enum scalar_type token_scalar(struct token token, const struct scalar_name *table)
{
    for (; table->name; table++) {
        if (token_is(token, table->name)) {
            return table->type;
        }
    }
    return SCALAR_NONE;
}

struct quoted token_quote(struct token token)
{
    struct quoted quoted;
    size_t room = sizeof quoted.text - 4;
    size_t n = token.size < room ? token.size : room;

    for (size_t i = 0; i < n; i++) {
        unsigned char c = token.text[i];

        quoted.text[i] = (char)(c >= 0x20 && c < 0x7f ? c : '?');
    }
    memcpy(quoted.text + n, token.size > room ? "..." : "", token.size > room ? 4 : 1);
    return quoted;
}
