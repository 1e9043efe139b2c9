/*
 * nrrd.h - the header of an NRRD file, which nrrd_fields.c and nrrd_names.c read and nrrd.c uses.
 */
#ifndef SRNF_VOLUME_NRRD_H
#define SRNF_VOLUME_NRRD_H

#include "formats/scan.h"
#include "volume.h"

#define NRRD_HEADER_MAX ((size_t)1 << 20) /* a segmentation names each segment in ten lines */
#define NRRD_AXES_MAX 4
#define NRRD_NAMES_MAX ((size_t)1024)

enum nrrd_encoding { ENCODING_NONE = 0, ENCODING_RAW, ENCODING_GZIP, ENCODING_ASCII };

struct nrrd_header {
    char *text; /* [NRRD_HEADER_MAX] */
    size_t size;
    uint32_t given; /* bit i: field i of the table in nrrd_fields.c was there */
    size_t n_axes;
    int64_t dimension; /* 0: not given */
    int64_t sizes[NRRD_AXES_MAX];
    bool spatial[NRRD_AXES_MAX]; /* has a direction; all, where none are given */
    double directions[NRRD_AXES_MAX][3], spacings[NRRD_AXES_MAX], origin[3];
    bool has_directions, has_origin, has_mins, has_endian;
    enum nrrd_encoding encoding;
    int64_t byte_skip, line_skip;
    double unit;
};

/* A line of the header, without its end: a field sets its member, a comment, a key or an unknown
   field nothing. */
SRNF_CHECKED int nrrd_read_field(struct volume_reader *reader, struct nrrd_header *header,
                                 struct token line);
/* Without spaces at its ends. */
struct token nrrd_trimmed(const unsigned char *text, size_t size);
/* A line that names a segment or gives its value goes to reader->names. */
void nrrd_read_name(struct volume_reader *reader, struct token line);

#endif
