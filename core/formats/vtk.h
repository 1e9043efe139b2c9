/*
 * vtk.h - words and numbers of a legacy VTK file: what read_vtk.c, which knows the sections, asks
 * of vtk_block.c.
 */
#ifndef SRNF_FORMATS_VTK_H
#define SRNF_FORMATS_VTK_H

#include "formats.h"

struct vtk {
    struct mesh_reader *reader;
    struct scan scan;
    bool binary, has_points, done;
    struct vtk_cells *pending; /* section CELLS, until CELL_TYPES tells what they are */
};

/* Numbers of one type, one after the other. */
struct vtk_block {
    const struct vtk *vtk;
    struct scan scan;
    enum scalar_type type;
};

/* SRNF_EPARSE at the byte where the word stands: "byte N: 'WORD' WHAT". */
SRNF_CHECKED int vtk_fail_at(const struct vtk *vtk, struct token word, const char *what);

/* The next word of the line as a count, or as the type of an array. */
SRNF_CHECKED int vtk_next_count(struct vtk *vtk, const char *section, size_t *count);
SRNF_CHECKED int vtk_next_type(struct vtk *vtk, enum scalar_type *type);

/* Fewest bytes of a number. */
size_t vtk_least_bytes(const struct vtk *vtk, enum scalar_type type);

/* Opens a block of `count` numbers behind the current line and passes it. The check comes first:
   whatever is read from the block later is there. */
SRNF_CHECKED int vtk_open_block(struct vtk *vtk, const char *what, enum scalar_type type,
                                size_t count, struct vtk_block *block);

/* Passes an array of `count` elements whose type is the next word of the line: one of the numbers,
   bit (packed in binary, eight to a byte), or a string. */
SRNF_CHECKED int vtk_skip_array(struct vtk *vtk, size_t count);

/* The next number of a block, at most as many as it was opened with; what and element are for the
   message. */
SRNF_CHECKED int vtk_block_number(struct vtk_block *block, const char *what, size_t element,
                                  double *value);
SRNF_CHECKED int vtk_block_index(struct vtk_block *block, const char *what, size_t element,
                                 int64_t *value);

#endif
