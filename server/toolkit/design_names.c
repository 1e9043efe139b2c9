/*
 * design_names.c - see design_names.h.
 */
#include "toolkit/design_names.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/formula_scan.h"

/* Bytes of a combining mark of U+0300 to U+036F; 0: there is none. */
static size_t mark_at(const char *text)
{
    unsigned char a = (unsigned char)text[0], b = a ? (unsigned char)text[1] : 0;

    return (a == 0xcc && b >= 0x80) || (a == 0xcd && b >= 0x80 && b <= 0xaf) ? 2 : 0;
}

/* Letters U+00C0 to U+00FF without their marks; ? where there is none to take off. */
static const char latin[] = "AAAAAA?CEEEEIIII?NOOOOO??UUUUY??aaaaaa?ceeeeiiii?nooooo??uuuuy?y";

struct letter {
    char base;   /* 0: not known */
    bool marked; /* composed, or with marks of its own */
    size_t marks;
};

static struct letter take_letter(const char **text)
{
    const char *at = *text;
    unsigned char first = (unsigned char)*at;
    struct letter letter = {.base = first < 0x80 ? *at : '\0', .marked = first >= 0x80};

    if (first == 0xc3) {
        letter.base = latin[(unsigned char)at[1] & 0x3f];
    }
    do {
        at++;
    } while (((unsigned char)*at & 0xc0) == 0x80);
    while (mark_at(at) > 0) {
        at += mark_at(at);
        letter.marked = true;
        letter.marks++;
    }
    *text = at;
    return letter;
}

/* Whether they are the same letters, as far as these are known, and one has more marks that stand
   apart. */
static bool are_composed_apart(const char *a, const char *b)
{
    size_t marks[2] = {0, 0};

    while (*a && *b) {
        struct letter x = take_letter(&a), y = take_letter(&b);

        if (x.marked != y.marked || (x.base && y.base && x.base != y.base)) {
            return false;
        }
        marks[0] += x.marks;
        marks[1] += y.marks;
    }
    return !*a && !*b && marks[0] != marks[1];
}

static bool is_plain(const char *name)
{
    for (size_t i = 0; name[i]; i++) {
        if (!formula_is_name(name[i], i == 0)) {
            return false;
        }
    }
    return true;
}

void design_name_advice(const json_t *covariates, const char *formula, const char *name, char *text,
                        size_t size)
{
    json_t *object = (json_t *)(uintptr_t)covariates;

    text[0] = '\0';
    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        const char *own = json_object_iter_key(at);

        if (are_composed_apart(own, name)) {
            (void)snprintf(
                text, size,
                ". \"%.60s\" of the cohort looks the same, and differs in how its "
                "letters are composed (Unicode NFC and NFD): write it as the cohort does",
                own);
            return;
        }
        if (strncmp(own, name, strlen(name)) == 0 && !is_plain(own) && strstr(formula, own)) {
            char quote = strchr(own, '"') ? '\'' : '"';

            (void)snprintf(text, size, ". If \"%.60s\" is meant, write Q(%c%.60s%c)", own, quote,
                           own, quote);
            return;
        }
    }
}
