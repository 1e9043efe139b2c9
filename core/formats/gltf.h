/*
 * gltf.h - a glTF document: its tables by number, and accessors. read_gltf.c knows nodes,
 * gltf_mesh.c meshes and their primitives, gltf_data.c buffers and accessors.
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

/* Numbers of an accessor, in place. */
struct gltf_accessor {
    const unsigned char *bytes; /* of the first; NULL: all are zero */
    size_t count, stride;
    enum scalar_type type;
    double scale; /* of normalized integers, which are divided by their largest value */
};

enum { GLTF_MODE_TRIANGLES = 4, GLTF_MODE_STRIP = 5, GLTF_MODE_FAN = 6 };

struct gltf_primitive {
    size_t mode;
    bool indexed;
    struct gltf_accessor positions, indices;
    size_t triangles; /* those that only join parts of a strip among them */
};

/* A mesh: its primitives of triangles, without those of neither vertices nor triangles. */
struct gltf_mesh {
    bool known;
    struct gltf_primitive *primitives; /* [room], by mesh_alloc */
    size_t n, room;
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
    struct gltf_mesh *meshes; /* of their table; by mesh_alloc */
    size_t triangles;         /* shown so far */
};

/* Indexes the tables of a cut document, and finds its buffers. gltf_close releases all. */
SRNF_CHECKED int gltf_open(struct gltf *gltf);
void gltf_close(struct gltf *gltf);

/* The token of an entry; JSON_NONE beyond the end. */
uint32_t gltf_entry(const struct gltf *gltf, enum gltf_table table, size_t number);

/* An accessor of this shape ("VEC3" or "SCALAR"), whose numbers are all within its buffer. */
SRNF_CHECKED int gltf_accessor_of(struct gltf *gltf, size_t number, const char *shape,
                                  struct gltf_accessor *accessor);

/* A mesh by its number, which must be there. It is read when it is asked for first: many nodes may
   show it. gltf_meshes_close releases all. */
SRNF_CHECKED int gltf_mesh_of(struct gltf *gltf, size_t number, const struct gltf_mesh **mesh);
void gltf_meshes_close(struct gltf *gltf);

#endif
