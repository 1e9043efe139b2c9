/*
 * fields.h - numbers one after the other, as words of a text or as bytes: what the readers of
 * BrainVISA, MNI, Gmsh, BYU, MZ3 and FreeSurfer's text share.
 */
#ifndef SRNF_FORMATS_FIELDS_H
#define SRNF_FORMATS_FIELDS_H

#include "formats.h"

struct fields {
    struct mesh_reader *reader;
    struct scan scan; /* at the next byte, text or not */
    bool binary, big_endian;
    const char *blanks; /* characters that count as white space in text, beside it; or NULL */
};

/* The next number. What and element are for the message; SRNF_EPARSE where there is none. */
SRNF_CHECKED int fields_number(struct fields *fields, enum scalar_type type, const char *what,
                               size_t element, double *value);
/* The next whole number. */
SRNF_CHECKED int fields_index(struct fields *fields, enum scalar_type type, const char *what,
                              size_t element, int64_t *value);
/* The next whole number, of `what`, each of which needs `least` bytes of the file when it is
   binary, and two for each of `words` in text. */
SRNF_CHECKED int fields_count(struct fields *fields, enum scalar_type type, const char *what,
                              size_t least, size_t words, size_t *count);
/* Passes so many numbers. */
SRNF_CHECKED int fields_skip(struct fields *fields, enum scalar_type type, const char *what,
                             size_t count);
/* The next `count` triples are vertices; room is made first. */
SRNF_CHECKED int fields_vertices(struct fields *fields, enum scalar_type type, size_t count);

#endif
