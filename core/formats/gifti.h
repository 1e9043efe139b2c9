/*
 * gifti.h - one data array of a GIfTI file: its attributes, and the decoder that turns its
 * characters into numbers. gifti_attributes.c reads those, gifti_data.c decodes, read_gifti.c knows
 * the XML.
 */
#ifndef SRNF_FORMATS_GIFTI_H
#define SRNF_FORMATS_GIFTI_H

#include <zlib.h>

#include "formats.h"

enum gifti_encoding { GIFTI_ENCODING_NONE, GIFTI_ASCII, GIFTI_BASE64, GIFTI_GZIP_BASE64 };

/* Attributes of <DataArray>, and its numbers as far as they have been decoded. */
struct gifti_array {
    size_t number; /* in the file, for messages */
    enum scalar_type type;
    enum gifti_encoding encoding;
    bool big_endian, column_major;
    int64_t dimensions, rows, columns;

    unsigned char
        *raw; /* [rows][columns] of type, in the byte order of the file; text: as doubles */
    size_t size, filled;
};

/* State between two pieces of one array's characters. */
struct gifti_decoder {
    struct mesh_reader *reader;
    struct gifti_array *array;
    uint32_t bits;    /* of a base64 group of four */
    unsigned n_bits;  /* characters in it, 0 .. 3 */
    unsigned padding; /* '=' seen */
    size_t n_word;    /* characters of a number that may go on in the next piece */
    unsigned char word[SCAN_NUMBER_MAX + 1];
    bool inflating, stream_ended;
    z_stream stream;
};

/* Takes an attribute into the array; those that do not matter are passed over. */
SRNF_CHECKED int gifti_set_attribute(struct mesh_reader *reader, struct gifti_array *array,
                                     const char *name, const char *value);
/* Are all that are needed there? */
SRNF_CHECKED int gifti_check_attributes(struct mesh_reader *reader,
                                        const struct gifti_array *array);

/* Starts on an array whose attributes are known: allocates raw, for at most `limit` rows, which
   are called `what` in messages. gifti_decode_close must follow in any case. */
SRNF_CHECKED int gifti_decode_open(struct gifti_decoder *decoder, struct mesh_reader *reader,
                                   struct gifti_array *array, size_t limit, const char *what);
SRNF_CHECKED int gifti_decode(struct gifti_decoder *decoder, const unsigned char *text,
                              size_t size);
/* Checks that the array is complete. */
SRNF_CHECKED int gifti_decode_end(struct gifti_decoder *decoder);
void gifti_decode_close(struct gifti_decoder *decoder);

/* Element (row, column) as a number, and as an index (false: not a whole number). */
double gifti_value(const struct gifti_array *array, size_t row, size_t column);
bool gifti_index(const struct gifti_array *array, size_t row, size_t column, int64_t *index);

#endif
