/*
 * formats.h - what the readers and writers of core/mesh share.
 *
 * A reader is one function over a struct mesh_reader: it looks at the bytes, announces what their
 * header promises, and hands over vertices and faces one by one. Everything that all formats need
 * is done here once: limits, memory, finite coordinates, indices in range, cutting polygons and
 * strips into triangles, and the sentences of the errors. The table of formats is in
 * format.c.
 */
#ifndef SRNF_FORMATS_INTERNAL_H
#define SRNF_FORMATS_INTERNAL_H

#include "internal.h"
#include "scalar.h"
#include "scan.h"

/* A polygon of more than three corners: where its fan begins among the faces. */
struct mesh_polygon {
    size_t first_face, corners;
};

struct mesh_reader {
    const unsigned char *bytes; /* the input; not owned */
    size_t size;
    struct srnf_mesh_limits limits;
    struct srnf_mesh_read_info info;
    struct srnf_error *error; /* may be NULL */
    locale_t locale;          /* "C", for numbers */
    size_t memory;            /* held at the moment, by mesh_alloc */
    int status;               /* why the last mesh_alloc returned NULL */
    size_t steps;             /* counted by mesh_step */
    bool canceled;            /* mesh_step goes on saying so */
    unsigned char *unpacked;  /* what a gzip file holds: then bytes and size are these */
    size_t unpacked_capacity;

    struct srnf_mesh mesh; /* what has been read so far */
    size_t vertex_capacity, face_capacity;
    size_t vertex_total;      /* what every index must stay below */
    uint32_t first, previous; /* corners of the polygon or strip that is being read */

    struct mesh_polygon *polygons; /* of more than three corners, in the order of the file */
    size_t n_polygons, polygon_capacity;
};

/* Memory within limits.max_memory; NULL with reader->status and the error set. mesh_release gives
   it back with the same count and size. */
void *mesh_alloc(struct mesh_reader *reader, size_t count, size_t size);
void mesh_release(struct mesh_reader *reader, void *pointer, size_t count, size_t size);

/* To be called for every few words or numbers that are read: asks limits.context every few thousand
   calls, and returns SRNF_ECANCELED once it has said so. Adding a vertex or a corner calls it. */
SRNF_CHECKED int mesh_step(struct mesh_reader *reader);
/* Asks at once. */
SRNF_CHECKED int mesh_ask(struct mesh_reader *reader);

/* Can `left` bytes hold `count` things of at least `least` bytes each? SRNF_EPARSE if not, with a
   sentence about what ("vertices", "faces", ...) the header promises. A negative count is an error
   too. */
SRNF_CHECKED int mesh_promise(struct mesh_reader *reader, const char *what, int64_t count,
                              size_t least, size_t left);

/* Checks the limits, sets vertex_total and makes room for that many vertices and triangles at
   once. */
SRNF_CHECKED int mesh_expect(struct mesh_reader *reader, size_t n_vertices, size_t n_faces);

/* Appends a vertex; SRNF_EPARSE when a coordinate is not finite. */
SRNF_CHECKED int mesh_add_vertex(struct mesh_reader *reader, const double position[3]);

/* Corner number `corner` of polygon `face`, in order from 0: each one from the third on makes a
   triangle with the first and the one before, until mesh_cut_polygons (polygon.h) sees the polygon
   whole. SRNF_EPARSE when the index is out of range. */
SRNF_CHECKED int mesh_add_corner(struct mesh_reader *reader, size_t face, size_t corner,
                                 int64_t index);

/* The same for a triangle strip: every second triangle is turned; those that name a vertex twice
   only join the parts of a strip and are left out. */
SRNF_CHECKED int mesh_add_strip_corner(struct mesh_reader *reader, size_t strip, size_t corner,
                                       int64_t index);

/* A polygon's number of corners: SRNF_EPARSE below 3. */
SRNF_CHECKED int mesh_check_corners(struct mesh_reader *reader, size_t face, int64_t corners);

/* "the file ends in vertex 120 of 2250". */
SRNF_CHECKED int mesh_truncated(struct mesh_reader *reader, const char *what, size_t index,
                                size_t count);

/* SRNF_EPARSE for anything but white space behind the last face. */
SRNF_CHECKED int mesh_no_more(struct mesh_reader *reader, const unsigned char *at);

/* ---- Formats: each in the file of its name --------------------------------------------------- */

typedef bool mesh_sniff_function(const unsigned char *bytes, size_t size);
typedef int mesh_read_function(struct mesh_reader *reader);

mesh_sniff_function mesh_sniff_ply, mesh_sniff_obj, mesh_sniff_off, mesh_sniff_stl, mesh_sniff_vtk,
    mesh_sniff_gifti, mesh_sniff_freesurfer, mesh_sniff_vtp, mesh_sniff_glb, mesh_sniff_gltf,
    mesh_sniff_mz3, mesh_sniff_fsascii, mesh_sniff_byu, mesh_sniff_mniobj, mesh_sniff_brainvisa,
    mesh_sniff_gmsh;
mesh_read_function mesh_read_ply, mesh_read_obj, mesh_read_off, mesh_read_stl, mesh_read_vtk,
    mesh_read_gifti, mesh_read_freesurfer, mesh_read_vtp, mesh_read_glb, mesh_read_gltf,
    mesh_read_mz3, mesh_read_fsascii, mesh_read_byu, mesh_read_mniobj, mesh_read_brainvisa,
    mesh_read_gmsh;

/* The sentence for bytes that are certainly no mesh that can be read, and their kind; or NULL
   (strangers.c). */
const char *mesh_stranger(const unsigned char *bytes, size_t size, const char **kind);

/* Could the bytes be binary STL of another length than its header promises? (read_stl.c) */
bool mesh_is_cut_stl(const unsigned char *bytes, size_t size);
/* Are these the first bytes of a binary STL file of that size, modulo 2^32? */
bool mesh_is_stl_of(const unsigned char *first, size_t n, size_t size);

/* What a writer is given, checked: finite numbers, proper names, indices in range. */
struct mesh_output {
    const struct srnf_mesh *mesh;
    const double *normals; /* NULL: none */
    const struct srnf_mesh_field *fields;
    size_t n_fields;
    struct srnf_mesh_description description; /* its members may be NULL */
    struct srnf_buffer *out;
};
typedef int mesh_write_function(const struct mesh_output *output);

mesh_write_function mesh_write_ply, mesh_write_obj, mesh_write_stl, mesh_write_vtk, mesh_write_glb,
    mesh_write_vtp, mesh_write_gifti;

/* Lines that say what the file is, each between `before` and a line end: of PLY and OBJ. */
SRNF_CHECKED int mesh_print_description(const struct mesh_output *output, const char *before);

/* ---- Buffers (buffer.c) ---------------------------------------------------------------------- */

/* Makes room for `extra` bytes more, so that appending them cannot fail. */
SRNF_CHECKED int mesh_buffer_reserve(struct srnf_buffer *buffer, size_t extra);
/* Appends formatted text of at most 500 bytes. Only for conversions that no locale changes: %s,
   %zu, %u. */
__attribute__((format(printf, 2, 3))) SRNF_CHECKED int mesh_buffer_print(struct srnf_buffer *buffer,
                                                                         const char *format, ...);

/* A double in 17 significant digits, which read back to the same double, in every locale. */
#define MESH_NUMBER_MAX 32
void mesh_number_text(char text[MESH_NUMBER_MAX], double value);

/* Cross product of two edges of a face: its normal by the right-hand rule, twice its area long. */
void mesh_face_cross(const struct srnf_mesh *mesh, size_t face, double cross[3]);

/* v / |v|, or the fallback where that is no direction. */
void mesh_unit_vector(const double v[3], const double fallback[3], double unit[3]);

/* ---- Colours (color_map.c) ------------------------------------------------------------------- */

/* Linear (not gamma-encoded) red, green and blue in 0 .. 1 of a position t in 0 .. 1. */
void mesh_color_map(double t, double rgb[3]);

#endif
