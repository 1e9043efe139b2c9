/*
 * mesh_files.h - files in every mesh format and encoding, made in memory by code of their own, so
 * that the readers are tested against something other than the writers.
 */
#ifndef TESTS_MESH_FILES_H
#define TESTS_MESH_FILES_H

#include <stdarg.h>

#include "srnf.h"

enum file_number {
    FILE_I8,
    FILE_U8,
    FILE_I16,
    FILE_U16,
    FILE_I32,
    FILE_U32,
    FILE_I64,
    FILE_F32,
    FILE_F64
};

/* One way to write a mesh down. */
struct mesh_file_kind {
    const char *label;
    enum srnf_mesh_format format;
    bool shares_vertices; /* not so in STL */
    size_t
        loose; /* bytes at the end whose loss may go unseen: names, line ends, sections not read */
    void (*make)(const struct srnf_mesh *mesh, struct srnf_buffer *out);
};
extern const struct mesh_file_kind mesh_file_kinds[]; /* ended by label NULL */

/* Appending to a file in the making; they end the program when memory is short. */
__attribute__((format(printf, 2, 3))) void file_print(struct srnf_buffer *out, const char *format,
                                                      ...);
void file_number(struct srnf_buffer *out, enum file_number type, bool big_endian, double value);

/* In mesh_files_other.c. */
typedef void mesh_file_maker(const struct srnf_mesh *mesh, struct srnf_buffer *out);
mesh_file_maker make_vtp_ascii, make_vtp_base64, make_vtp_zlib, make_vtp_raw, make_vtp_appended,
    make_gltf, make_glb, make_mz3, make_fsascii, make_byu, make_mniobj_ascii, make_mniobj_little,
    make_mniobj_big, make_brainvisa_ascii, make_brainvisa_little, make_brainvisa_big,
    make_gmsh2_ascii, make_gmsh2_binary, make_gmsh4_ascii, make_gmsh4_binary, make_vtk_grid,
    make_ply_packed, make_stl_packed, make_mz3_packed, make_off_free;

/* A tetrahedron whose coordinates are exact in single precision; to be cleared by the caller. */
struct srnf_mesh mesh_file_sample(void);

#endif
