/*
 * gltf.h - a glTF document: its tables by number, and accessors. read_gltf.c knows nodes and
 * primitives, gltf_data.c buffers and accessors.
 */
#ifndef SRNF_FORMATS_GLTF_H
#define SRNF_FORMATS_GLTF_H

#include "json.h"

/* The arrays at the root that others name by number. */
enum gltf_table {
    GLTF_NODES,
    GLTF_MESHES,
    GLTF_ACCESSORS,
    GLTF_VIEWS,
    GLTF_BUFFERS,
    GLTF_SCENES,
    GLTF_TABLES
};

struct gltf_buffer {
    const unsigned char *bytes;
    size_t size;
    unsigned char *owned; /* decoded from base64; by mesh_alloc */
};

struct gltf {
    struct mesh_reader *reader;
    struct json json;
    const unsigned char *binary; /* chunk BIN of a GLB; NULL: none */
    size_t binary_size;
    struct {
        uint32_t *tokens; /* by mesh_alloc */
        size_t n;
    } tables[GLTF_TABLES];
    struct gltf_buffer *buffers;
};

/* Numbers of an accessor, in place. */
struct gltf_accessor {
    const unsigned char *bytes; /* of the first; NULL: all are zero */
    size_t count, stride;
    enum scalar_type type;
    double scale; /* of normalized integers, which are divided by their largest value */
};

/* Indexes the tables of a cut document, and finds its buffers. gltf_close releases all. */
SRNF_CHECKED int gltf_open(struct gltf *gltf);
void gltf_close(struct gltf *gltf);

/* The token of an entry; JSON_NONE beyond the end. */
uint32_t gltf_entry(const struct gltf *gltf, enum gltf_table table, size_t number);

/* An accessor of this shape ("VEC3" or "SCALAR"), whose numbers are all within its buffer. */
SRNF_CHECKED int gltf_accessor_of(struct gltf *gltf, size_t number, const char *shape,
                                  struct gltf_accessor *accessor);

#endif
