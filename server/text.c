/*
 * text.c - where a text in UTF-8 may end (text.h).
 */
#include "text.h"

#include <stddef.h>
#include <string.h>

void text_trim_cut(char *text)
{
    size_t length = strlen(text), begin = length;
    unsigned char first;
    size_t whole;

    while (begin > 0 && length - begin < 4 && ((unsigned char)text[begin - 1] & 0xc0) == 0x80) {
        begin--;
    }
    if (begin == 0) {
        return;
    }
    first = (unsigned char)text[--begin];
    whole = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc0 ? 2 : 1;
    if (length - begin < whole) {
        text[begin] = '\0';
    }
}
