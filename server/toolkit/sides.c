/*
 * sides.c - words that name a side, in names that people and programs give to structures.
 *
 * A text is cut into words where people see them end:
 *
 *   at every byte that is no letter and no digit        L_hippocampus, lh.pial, (left)
 *   between a small letter and a capital                hippocampusL, leftThalamus
 *   before a capital that begins a word after capitals  LHippocampus, LHPial
 *   between a digit and a capital                       01L
 *   after two letters or more, before a digit           left2
 *
 * and not between a single letter and a digit: L5 is a vertebra, R2 a relaxation rate. Bytes from
 * 128 on are letters. A word is a side only as a whole, so that neither model, liver, bright nor
 * LV (a left ventricle, whose right one is another shape) tells of one.
 *
 * A side alone proves little: L and R are initials, groups and units too. So a text counts only
 * beside another one that differs in the side and in nothing else.
 */
#include "toolkit/sides.h"

#include <stddef.h>
#include <string.h>

static const struct {
    const char *word;
    enum side side;
} words[] = {
    {"l", SIDE_LEFT},        {"r", SIDE_RIGHT},      {"left", SIDE_LEFT}, {"right", SIDE_RIGHT},
    {"lh", SIDE_LEFT},       {"rh", SIDE_RIGHT},     {"lt", SIDE_LEFT},   {"rt", SIDE_RIGHT},
    {"lhemi", SIDE_LEFT},    {"rhemi", SIDE_RIGHT},  {"lhs", SIDE_LEFT},  {"rhs", SIDE_RIGHT},
    {"sinister", SIDE_LEFT}, {"dexter", SIDE_RIGHT},
};

/* By ASCII, whatever the locale. */
static bool is_capital(char c)
{
    return c >= 'A' && c <= 'Z';
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool is_small(char c)
{
    return (c >= 'a' && c <= 'z') || (unsigned char)c >= 128;
}

static bool is_part(char c)
{
    return is_capital(c) || is_digit(c) || is_small(c);
}

/* Whether a word ends before text[at]; it began at text[begin], and text[at] is part of a word. */
static bool ends_before(const char *text, size_t begin, size_t at)
{
    char before = text[at - 1], here = text[at];

    if (is_capital(here)) {
        return !is_capital(before) || is_small(text[at + 1]);
    }
    return is_digit(here) && !is_digit(before) && at - begin >= 2;
}

static enum side side_of(const char *word)
{
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strcmp(words[i].word, word) == 0) {
            return words[i].side;
        }
    }
    return SIDE_NONE;
}

/* The word that begins at text[*at] or after it, in small letters; false where there is none.
   word: [SIDES_REST_MAX], longer than any word of the text. */
static bool next_word(const char *text, size_t *at, char *word)
{
    size_t length = 0, begin;

    while (text[*at] && !is_part(text[*at])) {
        (*at)++;
    }
    begin = *at;
    while (is_part(text[*at]) && (*at == begin || !ends_before(text, begin, *at))) {
        char c = text[(*at)++];

        word[length++] = is_capital(c) ? (char)(c - 'A' + 'a') : c;
    }
    word[length] = '\0';
    return length > 0;
}

struct side_reading side_read(const char *text)
{
    struct side_reading reading = {SIDE_NONE, ""};
    char word[SIDES_REST_MAX];
    size_t at = 0, used = 0, length;

    if (!text || strlen(text) > SIDES_TEXT_MAX) {
        return reading;
    }
    while (next_word(text, &at, word)) {
        enum side side = side_of(word);

        if (side != SIDE_NONE && reading.side != SIDE_NONE && side != reading.side) {
            return (struct side_reading){SIDE_NONE, ""};
        }
        if (side != SIDE_NONE) {
            reading.side = side;
            continue;
        }
        if (used > 0) {
            reading.rest[used++] = ' ';
        }
        length = strlen(word);
        memcpy(reading.rest + used, word, length + 1);
        used += length;
    }
    if (reading.side == SIDE_NONE) {
        reading.rest[0] = '\0';
    }
    return reading;
}

bool sides_opposite(const struct side_reading *a, const struct side_reading *b)
{
    return a->side != SIDE_NONE && b->side != SIDE_NONE && a->side != b->side &&
           strcmp(a->rest, b->rest) == 0;
}
