/*
 * near.c - "did you mean".
 *
 * Nearness is the number of letters that are added, left out, replaced or exchanged with their
 * neighbour (optimal string alignment), in small letters, with - and _ as one. A third of the
 * name's length is near, and so is a name that begins with what was given, or the other way round.
 */
#include "api/near.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#define LETTERS 40 /* of the longest names that are compared */
#define WHOLE 3    /* letters from which on a beginning is near */

static int letter(char c)
{
    return c == '_' ? '-' : tolower((unsigned char)c);
}

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

static size_t slips(const char *a, size_t n, const char *b, size_t m)
{
    size_t rows[3][LETTERS + 1]; /* the row before the last, the last, this one */
    size_t *before = rows[0], *last = rows[1], *now = rows[2];

    for (size_t j = 0; j <= m; j++) {
        last[j] = j;
        before[j] = 0;
    }
    for (size_t i = 1; i <= n; i++) {
        size_t *spare = before;

        now[0] = i;
        for (size_t j = 1; j <= m; j++) {
            bool same = letter(a[i - 1]) == letter(b[j - 1]);

            now[j] = least(last[j - 1] + !same, 1 + least(last[j], now[j - 1]));
            if (i > 1 && j > 1 && letter(a[i - 1]) == letter(b[j - 2]) &&
                letter(a[i - 2]) == letter(b[j - 1])) {
                now[j] = least(now[j], before[j - 2] + 1);
            }
        }
        before = last;
        last = now;
        now = spare;
    }
    return last[m];
}

static bool begins(const char *text, size_t n, const char *with, size_t m)
{
    size_t i = 0;

    while (i < m && i < n && letter(text[i]) == letter(with[i])) {
        i++;
    }
    return i == m && m >= WHOLE;
}

const char *near_name(const char *given, const char *const *names)
{
    size_t n = strlen(given), best = LETTERS + 1;
    const char *found = NULL;

    for (size_t i = 0; names[i] && n <= LETTERS; i++) {
        size_t m = strlen(names[i]), count;

        if (m > LETTERS) {
            continue;
        }
        count = slips(given, n, names[i], m);
        if ((3 * count <= (n > m ? n : m) || begins(names[i], m, given, n) ||
             begins(given, n, names[i], m)) &&
            count < best) {
            best = count;
            found = names[i];
        }
    }
    return found;
}

void near_sentence(char text[NEAR_SENTENCE_MAX], const char *begin, const char *given,
                   const char *const *names)
{
    const char *near = near_name(given, names);
    size_t used;

    (void)snprintf(text, NEAR_SENTENCE_MAX, "%s%s%s%s Known: ", begin,
                   near ? "; did you mean " : "", near ? near : "", near ? "?" : ".");
    used = strlen(text);
    for (size_t i = 0; names[i] && used < NEAR_SENTENCE_MAX - 1; i++) {
        (void)snprintf(text + used, NEAR_SENTENCE_MAX - used, "%s%s", i ? ", " : "", names[i]);
        used = strlen(text);
    }
}
