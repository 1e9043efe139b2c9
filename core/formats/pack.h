/*
 * pack.h - base64 and zlib, as several formats use them: GIfTI, VTP, glTF and files packed by gzip.
 */
#ifndef SRNF_FORMATS_PACK_H
#define SRNF_FORMATS_PACK_H

#define ZLIB_CONST /* input is not written to */
#include <zlib.h>

#include "formats.h"

/* zlib packs no better than 1 to 1032 (its documentation, "Maximum Compression Factor"). */
#define PACK_RATIO_MAX ((size_t)1032)
/* Window bits of inflateInit2 that take a zlib or a gzip header, whichever is there. */
#define PACK_ANY_HEADER (15 + 32)

/* Bytes that at most so many others can unpack to. */
size_t pack_most(size_t size);

/* Counts bytes that were unpacked, and asks whether to go on: 0, SRNF_ELIMIT or SRNF_ECANCELED. */
SRNF_CHECKED int pack_count(struct mesh_reader *reader, size_t bytes);

/* Unpacks a stream of zlib or gzip into exactly `capacity` bytes; false where it is damaged, or
   holds more or less. SRNF_ECANCELED, SRNF_ELIMIT and SRNF_ENOMEM are in *status; otherwise that
   stays. */
bool pack_inflate(struct mesh_reader *reader, const unsigned char *bytes, size_t size,
                  unsigned char *out, size_t capacity, int *status);

/* Appends the bytes as base64, packed by zlib before if `zip`. */
SRNF_CHECKED int pack_append_base64(struct srnf_buffer *out, const void *bytes, size_t size);
/* Replaces the content of `out` by the bytes, packed by zlib. */
SRNF_CHECKED int pack_deflate(struct srnf_buffer *out, const void *bytes, size_t size);

/* The value of a character of base64, or -1. */
int base64_value(unsigned char c);

/* A cursor over base64: white space is passed over, and where padding ends a group another may
   follow, as in files that encode a header of its own before the data. */
struct base64 {
    const unsigned char *at, *end;
    unsigned char spare[3]; /* decoded, not yet taken */
    unsigned n_spare, taken;
};

/* The next `size` bytes; false where the text ends before or is no base64. */
bool base64_take(struct base64 *cursor, unsigned char *out, size_t size);

/* Replaces the input by what is in it, where it is packed by gzip (one layer). The bytes are
   charged to the limit of memory, and released by pack_close. */
SRNF_CHECKED int pack_open(struct mesh_reader *reader);
void pack_close(struct mesh_reader *reader);

/* Is this a gzip file? Then its first bytes, at most `capacity`, are unpacked: their number. Total
   is what its last bytes say of its length, modulo 2^32. */
bool pack_is_gzip(const unsigned char *bytes, size_t size);
size_t pack_peek(const unsigned char *bytes, size_t size, unsigned char *out, size_t capacity,
                 size_t *total);

#endif
