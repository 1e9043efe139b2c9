/*
 * numerals.c - see numerals.h.
 */
#include "api/numerals.h"

#include <stddef.h>
#include <string.h>

#define DIGITS "0123456789"
#define PLAIN_MAX 64

/* Behind one to three digits and groups of three with the mark before each; NULL: there is no
   group. */
static const char *skip_groups(const char *at, char mark)
{
    size_t digits = strspn(at, DIGITS), groups = 0;

    if (digits == 0 || digits > 3 || *at == '0') {
        return NULL;
    }
    at += digits;
    while (*at == mark && strspn(at + 1, DIGITS) == 3) {
        at += 4;
        groups++;
    }
    return groups > 0 ? at : NULL;
}

static const char *skip_sign(const char *at)
{
    return at + (*at == '+' || *at == '-');
}

bool numeral_is_grouped(const char *cell, char mark)
{
    const char *end = skip_groups(skip_sign(cell), mark);

    return end && !*end;
}

/* Digits with at most one mark among them or behind. */
static bool is_decimal(const char *at)
{
    size_t before = strspn(at, DIGITS), behind = 0;

    at += before;
    if (*at == '.' || *at == ',') {
        behind = strspn(++at, DIGITS);
    }
    return before + behind > 0 && !at[behind];
}

static bool is_grouped_decimal(const char *at, char mark, char decimal)
{
    const char *end = skip_groups(at, mark);

    return end && (!*end || (*end == decimal && !end[1 + strspn(end + 1, DIGITS)]));
}

/* The cell in plain[PLAIN_MAX] without what print puts around and between digits. */
static bool make_plain(const char *cell, char *plain)
{
    static const struct {
        const char *text, *plain;
    } signs[] = {{"\xc2\xa0", ""},     {"\xe2\x80\xaf", ""},  {"\xe2\x80\x89", ""}, {"'", ""},
                 {"\xe2\x80\x99", ""}, {"\xe2\x88\x92", "-"}, {" %", ""},           {"%", ""}};
    size_t length = 0;

    while (*cell) {
        size_t k = 0, count = sizeof signs / sizeof signs[0];

        while (k < count && strncmp(cell, signs[k].text, strlen(signs[k].text)) != 0) {
            k++;
        }
        if (length + 1 >= PLAIN_MAX) {
            return false;
        }
        if (k == count) {
            plain[length++] = *cell++;
            continue;
        }
        cell += strlen(signs[k].text);
        if (*signs[k].plain) {
            plain[length++] = *signs[k].plain;
        }
    }
    plain[length] = '\0';
    return true;
}

bool numeral_is_styled(const char *cell)
{
    char plain[PLAIN_MAX];
    const char *at;

    if (!make_plain(cell + strspn(cell, "<>~"), plain)) {
        return false;
    }
    at = skip_sign(plain + strspn(plain, " "));
    return is_decimal(at) || is_grouped_decimal(at, '.', ',') || is_grouped_decimal(at, ',', '.');
}
