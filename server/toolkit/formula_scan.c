/*
 * formula_scan.c - the words of a formula, and what is said of one that has others. See
 * formula_scan.h.
 */
#include "toolkit/formula_scan.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void formula_fail(struct formula_parser *p, const char *format, ...)
{
    va_list arguments;

    if (!p->failed) {
        va_start(arguments, format);
        (void)vsnprintf(p->problem, FORMULA_PROBLEM_MAX, format, arguments);
        va_end(arguments);
    }
    p->failed = true;
}

void formula_skip(struct formula_parser *p)
{
    while (*p->at && isspace((unsigned char)*p->at)) {
        p->at++;
    }
}

bool formula_take(struct formula_parser *p, const char *what)
{
    formula_skip(p);
    if (p->failed || strncmp(p->at, what, strlen(what)) != 0) {
        return false;
    }
    p->at += strlen(what);
    return true;
}

/* The word before and the word here, where nothing but white space is between them, as in "my x";
   0: it is not so. */
static size_t words_here(const struct formula_parser *p, char *both, size_t size)
{
    const char *end = p->at, *start = p->at;

    while (end > p->start && isspace((unsigned char)end[-1])) {
        end--;
    }
    start = end;
    while (start > p->start && formula_is_name(start[-1], false)) {
        start--;
    }
    end = p->at;
    while (*end && formula_is_name(*end, end == p->at)) {
        end++;
    }
    if (start == p->at || end == p->at || !formula_is_name(*start, true)) {
        return 0;
    }
    (void)snprintf(both, size, "%.*s", (int)(end - start), start);
    return (size_t)(end - start);
}

void formula_fail_here(struct formula_parser *p, const char *expected)
{
    size_t words;
    char both[2 * FORMULA_NAME_MAX];

    formula_skip(p);
    words = words_here(p, both, sizeof both);
    if (*p->at == '|') {
        formula_fail(p,
                     "has \"%.20s\" at character %zu: there are no random effects. Members of a "
                     "subject count as one in regress, and have a line each in trajectories",
                     p->at, (size_t)(p->at - p->start) + 1);
    } else if (*p->at && words > 0) {
        formula_fail(p,
                     "has \"%.20s\" at character %zu where %s is expected. A name of several words "
                     "is written Q(\"%.40s\")",
                     p->at, (size_t)(p->at - p->start) + 1, expected, both);
    } else if (*p->at) {
        formula_fail(p, "has \"%.20s\" at character %zu where %s is expected", p->at,
                     (size_t)(p->at - p->start) + 1, expected);
    } else {
        formula_fail(p, "ends where %s is expected", expected);
    }
}

bool formula_is_name(char c, bool first)
{
    unsigned char u = (unsigned char)c;

    return isalpha(u) || c == '_' || u >= 0x80 || (!first && (isdigit(u) || c == '.'));
}

bool formula_take_quoted(struct formula_parser *p, char quote, char name[FORMULA_NAME_MAX])
{
    const char *at = p->at;
    size_t length = 0;

    while (*at && *at != quote && length < FORMULA_NAME_MAX - 1) {
        bool escaped = quote != '`' && *at == '\\' && at[1] && strchr("\\\"'", at[1]);

        name[length++] = at[escaped];
        at += escaped ? 2 : 1;
    }
    name[length] = '\0';
    if (*at != quote || length == 0) {
        formula_fail(p, "has a quotation at character %zu that does not end, or is empty",
                     (size_t)(p->at - p->start));
        return false;
    }
    p->at = at + 1;
    return true;
}

bool formula_take_word(struct formula_parser *p, char name[FORMULA_NAME_MAX])
{
    size_t length = 0;

    formula_skip(p);
    if (!formula_is_name(*p->at, true)) {
        return false;
    }
    while (formula_is_name(p->at[length], length == 0)) {
        length++;
    }
    if (length >= FORMULA_NAME_MAX) {
        formula_fail(p, "has a name of %zu bytes; the most is %d, as of covariates", length,
                     FORMULA_NAME_MAX - 1);
        return false;
    }
    memcpy(name, p->at, length);
    name[length] = '\0';
    p->at += length;
    return true;
}

bool formula_take_text(struct formula_parser *p, char text[FORMULA_NAME_MAX])
{
    formula_skip(p);
    return (formula_take(p, "\"") && formula_take_quoted(p, '"', text)) ||
           (formula_take(p, "'") && formula_take_quoted(p, '\'', text));
}

bool formula_take_number(struct formula_parser *p, char text[FORMULA_NAME_MAX])
{
    char *end;
    double value;

    formula_skip(p);
    if (!isdigit((unsigned char)*p->at) && *p->at != '-' && *p->at != '.') {
        return false;
    }
    value = strtod(p->at, &end);
    if (end == p->at) {
        return false;
    }
    (void)snprintf(text, FORMULA_NAME_MAX, "%.15g", value + 0.0);
    p->at = end;
    return true;
}
