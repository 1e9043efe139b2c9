/*
 * vtp.h - the pieces of a VTP file and their data arrays: where the bytes are, and what they
 * become.
 * read_vtp.c knows the XML, vtp_array.c the encodings, vtp_piece.c the vertices and faces.
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

/* The value of format="..", which may be NULL. */
enum vtp_encoding vtp_encoding_named(const char *format);

/* Loads the numbers; count is their number, and `wanted` what it must be (SIZE_MAX: any).
   vtp_array_clear must follow in any case. */
SRNF_CHECKED int vtp_array_load(const struct vtp_file *file, struct vtp_array *array,
                                size_t wanted);
void vtp_array_clear(const struct vtp_file *file, struct vtp_array *array);

double vtp_array_number(const struct vtp_file *file, const struct vtp_array *array, size_t index);
/* False: no whole number. */
bool vtp_array_index(const struct vtp_file *file, const struct vtp_array *array, size_t index,
                     int64_t *value);

enum { VTP_POINTS, VTP_POLY_CORNERS, VTP_POLY_ENDS, VTP_STRIP_CORNERS, VTP_STRIP_ENDS, VTP_COUNT };

struct vtp_piece {
    int64_t points, polys, strips; /* how many it has */
    struct vtp_array arrays[VTP_COUNT];
};

/* Adds the piece to the reader's mesh, behind what that has. */
SRNF_CHECKED int vtp_piece_load(const struct vtp_file *file, struct vtp_piece *piece);

#endif
