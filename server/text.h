/*
 * text.h - sentences in UTF-8 that have no room for all of them, nouns after a number, names of
 * files.
 */
#ifndef SRNFD_TEXT_H
#define SRNFD_TEXT_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* What a noun ends on after a number: "s" but for one. */
static inline const char *plural(size_t n)
{
    return n == 1 ? "" : "s";
}

/* What follows the last slash of a path. */
static inline const char *text_base(const char *path)
{
    const char *slash = strrchr(path, '/');

    return slash ? slash + 1 : path;
}

#define TEXT_EACH(byte) (UINT64_C(0x0101010101010101) * (byte)) /* eight of the byte */

/* A bit set where one of the eight bytes is below least, which is at most 128, and none where none
   is. */
static inline uint64_t text_any_below(uint64_t bytes, unsigned char least)
{
    return (bytes - TEXT_EACH(least)) & ~bytes & TEXT_EACH(0x80);
}

/* The same where one is that byte. */
static inline uint64_t text_any_is(uint64_t bytes, unsigned char byte)
{
    return text_any_below(bytes ^ TEXT_EACH(byte), 1);
}

static inline uint64_t text_eight(const char *text)
{
    uint64_t bytes;

    memcpy(&bytes, text, sizeof bytes);
    return bytes;
}

/* Takes away what is left of a character at the end of a text that was cut. Other bytes that are no
   UTF-8 stay. */
void text_trim_cut(char *text);

#endif
