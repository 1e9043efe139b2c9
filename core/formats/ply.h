/*
 * ply.h - the header of a PLY file, taken apart: elements in the order of the file, each with its
 * properties. Shared by ply_header.c, which fills it, and read_ply.c, which reads the body by it.
 */
#ifndef SRNF_FORMATS_PLY_H
#define SRNF_FORMATS_PLY_H

#include "formats.h"

#define PLY_ELEMENTS_MAX 32
#define PLY_PROPERTIES_MAX 512 /* of all elements together */

enum ply_encoding { PLY_ASCII, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN };

/* What an element or a property is to us; everything else is skipped. */
enum ply_role {
    PLY_OTHER = 0,
    PLY_VERTEX, /* elements */
    PLY_FACE,
    PLY_STRIPS,
    PLY_X, /* properties of a vertex */
    PLY_Y,
    PLY_Z,
    PLY_CORNERS, /* list property of a face or a strip */
};

struct ply_property {
    enum ply_role role;
    enum scalar_type count; /* of a list; SCALAR_NONE: one scalar */
    enum scalar_type type;
};

struct ply_element {
    enum ply_role role;
    struct quoted name;
    size_t count;
    size_t first_property, n_properties;
};

struct ply_header {
    enum ply_encoding encoding;
    size_t n_formats; /* lines that say so */
    size_t n_elements, n_properties;
    struct ply_element elements[PLY_ELEMENTS_MAX];
    struct ply_property properties[PLY_PROPERTIES_MAX];
    size_t n_vertices, n_faces;
    const unsigned char *body;
};

/* Parses and checks the header: the vertex has x, y and z, the face has one list of indices, and
   the body can hold what is promised. */
SRNF_CHECKED int ply_read_header(struct mesh_reader *reader, struct ply_header *header);

#endif
