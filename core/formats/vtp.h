/*
 * vtp.h - one data array of a VTP file: where its bytes are, and the decoder that turns them into
 * numbers. read_vtp.c knows the XML, vtp_array.c the encodings.
 */
#ifndef SRNF_FORMATS_VTP_H
#define SRNF_FORMATS_VTP_H

#include "formats.h"

enum vtp_encoding { VTP_NONE, VTP_ASCII, VTP_BINARY, VTP_APPENDED };

/* What holds of the whole file. */
struct vtp_file {
    struct mesh_reader *reader;
    bool big_endian, zip;          /* byte order; compressor vtkZLibDataCompressor */
    size_t header;                 /* bytes of a word of a header: 4 or 8 */
    bool raw;                      /* encoding of the appended data; otherwise base64 */
    const unsigned char *appended; /* behind its underscore; NULL: there are none */
};

/* A data array: its attributes, and, once it is loaded, its numbers. */
struct vtp_array {
    bool present;
    const char *what; /* "points", ... for messages */
    enum scalar_type type;
    enum vtp_encoding encoding;
    int64_t components;
    int64_t offset;                       /* into the appended data */
    const unsigned char *text, *text_end; /* between the tags */
    enum scalar_type stored;              /* type of the numbers in data: text is kept as doubles */
    unsigned char *data;
    size_t count, bytes;
};

/* Loads the numbers; count is their number, and `wanted` what it must be (SIZE_MAX: any).
   vtp_array_clear must follow in any case. */
SRNF_CHECKED int vtp_array_load(const struct vtp_file *file, struct vtp_array *array,
                                size_t wanted);
void vtp_array_clear(const struct vtp_file *file, struct vtp_array *array);

double vtp_array_number(const struct vtp_file *file, const struct vtp_array *array, size_t index);
/* false: no whole number. */
bool vtp_array_index(const struct vtp_file *file, const struct vtp_array *array, size_t index,
                     int64_t *value);

#endif
