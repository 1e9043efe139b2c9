/*
 * mesh_files.c - mesh files made in memory (see mesh_files.h). Each kind uses the less common
 * freedoms of its format too: extra elements and properties, comments, both byte orders,
 * column-major arrays, joined lines.
 */
#include "support/mesh_files.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

static void append(struct srnf_buffer *out, const void *bytes, size_t size)
{
    if (srnf_buffer_append(out, bytes, size) != SRNF_OK) {
        abort();
    }
}

void file_print(struct srnf_buffer *out, const char *format, ...)
{
    char text[1024];
    va_list arguments;
    int size;

    va_start(arguments, format);
    size = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (size < 0 || (size_t)size >= sizeof text) {
        abort();
    }
    append(out, text, (size_t)size);
}

void file_number(struct srnf_buffer *out, enum file_number type, bool big_endian, double value)
{
    static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 8, 4, 8};
    float single = (float)value;
    int64_t whole = type < FILE_F32 ? (int64_t)value : 0;
    unsigned char bytes[8];

    /* The low bytes of a two's complement number are the smaller number (little-endian machines).
       */
    memcpy(bytes, &whole, sizeof bytes);
    if (type == FILE_F32) {
        memcpy(bytes, &single, sizeof single);
    } else if (type == FILE_F64) {
        memcpy(bytes, &value, sizeof value);
    }
    for (size_t i = 0; i < sizes[type]; i++) {
        append(out, &bytes[big_endian ? sizes[type] - 1 - i : i], 1);
    }
}

struct srnf_mesh mesh_file_sample(void)
{
    static const double vertices[4][3] = {
        {0.125, -1.5, 0.25}, {1.0, 0.0078125, -0.5}, {-3.0, 1024.0, 2.5}, {0.5, 0.75, 100.0}};
    static const uint32_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    struct srnf_mesh mesh = {4, 4, srnf_alloc(4, 3 * sizeof(double)),
                             srnf_alloc(4, 3 * sizeof(uint32_t))};

    if (!mesh.vertices || !mesh.faces) {
        abort();
    }
    memcpy(mesh.vertices, vertices, sizeof vertices);
    memcpy(mesh.faces, faces, sizeof faces);
    return mesh;
}

static void print_vertices(const struct srnf_mesh *mesh, const char *before, const char *after,
                           struct srnf_buffer *out)
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const double *v = mesh->vertices + 3 * i;

        file_print(out, "%s%.17g %.17g %.17g%s\n", before, v[0], v[1], v[2], after);
    }
}

static void print_faces(const struct srnf_mesh *mesh, const char *before, struct srnf_buffer *out)
{
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, "%s%u %u %u\n", before, f[0], f[1], f[2]);
    }
}

static void put_vertices(const struct srnf_mesh *mesh, enum file_number type, bool big,
                         struct srnf_buffer *out)
{
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        file_number(out, type, big, mesh->vertices[i]);
    }
}

/* With the number of corners before each face, unless count is false. */
static void put_faces(const struct srnf_mesh *mesh, enum file_number type, bool big, bool count,
                      struct srnf_buffer *out)
{
    for (size_t i = 0; i < mesh->n_faces; i++) {
        if (count) {
            file_number(out, type, big, 3);
        }
        for (size_t k = 0; k < 3; k++) {
            file_number(out, type, big, mesh->faces[3 * i + k]);
        }
    }
}

/* ---- PLY ------------------------------------------------------------------------------------- */

static void make_ply_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "ply\r\nformat ascii 1.0\r\ncomment a b c\r\nobj_info x\r\n");
    file_print(out, "element vertex %zu\r\nproperty float x\r\nproperty float y\r\n",
               mesh->n_vertices);
    file_print(out, "property float z\r\nproperty uchar red\r\nelement face %zu\r\n",
               mesh->n_faces);
    file_print(out, "property list uchar int vertex_index\r\nend_header\r\n");
    print_vertices(mesh, "", " 255", out);
    print_faces(mesh, "3 ", out);
}

static void make_ply_little(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n", mesh->n_vertices);
    file_print(out, "property float32 x\nproperty float32 y\nproperty float32 z\n");
    file_print(out, "element face %zu\nproperty list uint8 uint32 vertex_indices\nend_header\n",
               mesh->n_faces);
    put_vertices(mesh, FILE_F32, false, out);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        file_number(out, FILE_U8, false, 3);
        for (size_t k = 0; k < 3; k++) {
            file_number(out, FILE_U32, false, mesh->faces[3 * i + k]);
        }
    }
}

/* Faces before vertices, an element of lists that nobody knows, properties between the
   coordinates. */
static void make_ply_big(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "ply\nformat binary_big_endian 1.0\nelement face %zu\n", mesh->n_faces);
    file_print(out, "property short flags\nproperty list int16 ushort vertex_indices\n");
    file_print(out, "property list uchar double weights\nelement thing 2\nproperty int8 a\n");
    file_print(out, "property list ushort double b\nelement vertex %zu\n", mesh->n_vertices);
    file_print(out,
               "property double z\nproperty uint16 id\nproperty double x\nproperty float64 y\n");
    file_print(out, "end_header\n");
    for (size_t i = 0; i < mesh->n_faces; i++) {
        file_number(out, FILE_I16, true, -7);
        file_number(out, FILE_I16, true, 3);
        for (size_t k = 0; k < 3; k++) {
            file_number(out, FILE_U16, true, mesh->faces[3 * i + k]);
        }
        file_number(out, FILE_U8, true, 1);
        file_number(out, FILE_F64, true, 0.5);
    }
    for (size_t i = 0; i < 2; i++) {
        file_number(out, FILE_I8, true, -1);
        file_number(out, FILE_U16, true, (double)i);
        for (size_t k = 0; k < i; k++) {
            file_number(out, FILE_F64, true, 1.25);
        }
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        file_number(out, FILE_F64, true, mesh->vertices[3 * i + 2]);
        file_number(out, FILE_U16, true, (double)i);
        file_number(out, FILE_F64, true, mesh->vertices[3 * i]);
        file_number(out, FILE_F64, true, mesh->vertices[3 * i + 1]);
    }
}

/* ---- OBJ and OFF ----------------------------------------------------------------------------- */

static void make_obj(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "# a comment\nmtllib a.mtl\no thing\n");
    print_vertices(mesh, "v ", "", out);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, "f %u %u %u\n", f[0] + 1, f[1] + 1, f[2] + 1);
    }
}

/* Faces before vertices, and behind them: counted back, with slashes, over two lines. */
static void make_obj_slashes(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    int64_t n = (int64_t)mesh->n_vertices;
    const uint32_t *f = mesh->faces;

    file_print(out, "f %u/1/1 %u//2 %u/3\n", f[0] + 1, f[1] + 1, f[2] + 1);
    print_vertices(mesh, "v ", " 1.0 # weight", out);
    file_print(out, "vt 0 0\nvn 0 0 1\ng a\ns off\nusemtl b\n");
    for (size_t i = 1; i < mesh->n_faces; i++) {
        f = mesh->faces + 3 * i;
        file_print(out, "f %lld/-1/-1 \\\n %lld//-1 \\\r\n%lld\n", (long long)((int64_t)f[0] - n),
                   (long long)((int64_t)f[1] - n), (long long)((int64_t)f[2] - n));
    }
}

static void make_off(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "# a comment\nOFF\n\n%zu %zu 0 # counts\n", mesh->n_vertices, mesh->n_faces);
    print_vertices(mesh, "", "", out);
    print_faces(mesh, "3 ", out);
}

static void make_off_colors(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "CNOFF%zu %zu 0\n", mesh->n_vertices, mesh->n_faces);
    print_vertices(mesh, "", " 0 0 1 255 0 0 255", out);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, "3 %u %u %u 0.5 0.5 0.5\n\n", f[0], f[1], f[2]);
    }
}

/* ---- STL ------------------------------------------------------------------------------------- */

static void make_stl_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "solid a name\n");
    for (size_t i = 0; i < mesh->n_faces; i++) {
        file_print(out, "  facet normal nan 0 0\n    OUTER LOOP\n");
        for (size_t k = 0; k < 3; k++) {
            const double *v = mesh->vertices + 3 * (size_t)mesh->faces[3 * i + k];

            file_print(out, "      vertex %.17g %.17g %.17g\n", v[0], v[1], v[2]);
        }
        file_print(out, "    endloop\n  endfacet\n");
    }
    file_print(out, "endsolid a name\n");
}

static void stl_binary(const struct srnf_mesh *mesh, const char *title, struct srnf_buffer *out)
{
    file_print(out, "%-80s", title);
    file_number(out, FILE_U32, false, (double)mesh->n_faces);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        for (size_t k = 0; k < 3; k++) {
            file_number(out, FILE_F32, false, 0);
        }
        for (size_t k = 0; k < 9; k++) {
            file_number(out, FILE_F32, false,
                        mesh->vertices[3 * (size_t)mesh->faces[3 * i + k / 3] + k % 3]);
        }
        file_number(out, FILE_U16, false, 0);
    }
}

static void make_stl_binary(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    stl_binary(mesh, "a title", out);
}

static void make_stl_solid(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    stl_binary(mesh, "solid but binary", out);
}

/* ---- VTK ------------------------------------------------------------------------------------- */

static void vtk_head(const struct srnf_mesh *mesh, const char *encoding, const char *type,
                     struct srnf_buffer *out)
{
    file_print(out, "# vtk DataFile Version 5.1\na title\n%s\nDATASET POLYDATA\n", encoding);
    file_print(out, "POINTS %zu %s\n", mesh->n_vertices, type);
}

static void make_vtk_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    vtk_head(mesh, "ASCII", "float", out);
    print_vertices(mesh, "", "", out);
    file_print(out, "METADATA\nINFORMATION 0\n\nVERTICES 1 2\n1 0\n");
    file_print(out, "POLYGONS %zu %zu\n", mesh->n_faces, 4 * mesh->n_faces);
    print_faces(mesh, "3 ", out);
    file_print(out, "POINT_DATA %zu\nSCALARS a float\n", mesh->n_vertices);
}

static void make_vtk_binary(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    vtk_head(mesh, "BINARY", "double", out);
    put_vertices(mesh, FILE_F64, true, out);
    file_print(out, "\nFIELD FieldData 1\nTIME 1 2 float\n");
    file_number(out, FILE_F32, true, 0);
    file_number(out, FILE_F32, true, 1);
    file_print(out, "\nPOLYGONS %zu %zu\n", mesh->n_faces, 4 * mesh->n_faces);
    put_faces(mesh, FILE_I32, true, true, out);
    file_print(out, "\nCELL_DATA 4\n");
}

static void make_vtk5_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    vtk_head(mesh, "ASCII", "double", out);
    print_vertices(mesh, "", "", out);
    file_print(out, "POLYGONS %zu %zu\nOFFSETS vtktypeint64\n", mesh->n_faces + 1,
               3 * mesh->n_faces);
    for (size_t i = 0; i <= mesh->n_faces; i++) {
        file_print(out, "%zu ", 3 * i);
    }
    file_print(out, "\nCONNECTIVITY vtktypeint64\n");
    print_faces(mesh, "", out);
}

static void make_vtk5_binary(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    vtk_head(mesh, "BINARY", "float", out);
    put_vertices(mesh, FILE_F32, true, out);
    file_print(out, "\nPOLYGONS %zu %zu\nOFFSETS vtktypeint64\n", mesh->n_faces + 1,
               3 * mesh->n_faces);
    for (size_t i = 0; i <= mesh->n_faces; i++) {
        file_number(out, FILE_I64, true, (double)(3 * i));
    }
    file_print(out, "\nCONNECTIVITY vtktypeint64\n");
    put_faces(mesh, FILE_I64, true, false, out);
    file_print(out, "\n");
}

/* ---- GIfTI ----------------------------------------------------------------------------------- */

static void put_base64(struct srnf_buffer *out, const unsigned char *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

    for (size_t i = 0; i < size; i += 3) {
        size_t n = size - i < 3 ? size - i : 3;
        uint32_t word = (uint32_t)bytes[i] << 16;

        word |= n > 1 ? (uint32_t)bytes[i + 1] << 8 : 0;
        word |= n > 2 ? (uint32_t)bytes[i + 2] : 0;
        file_print(out, "%c%c%c%c%s", digits[word >> 18], digits[(word >> 12) & 63],
                   n > 1 ? digits[(word >> 6) & 63] : '=', n > 2 ? digits[word & 63] : '=',
                   i % 57 == 54 ? "\n" : "");
    }
}

static void put_packed(struct srnf_buffer *out, const struct srnf_buffer *raw)
{
    uLongf size = compressBound((uLong)raw->size);
    unsigned char *packed = malloc(size);

    if (!packed || compress(packed, &size, raw->data, (uLong)raw->size) != Z_OK) {
        abort();
    }
    put_base64(out, packed, size);
    free(packed);
}

/* How a GIfTI file is written. */
struct gifti_style {
    const char *encoding, *point_type, *face_type;
    enum file_number points, faces;
    bool big, column_major, packed, text;
};

static void gifti_array(struct srnf_buffer *out, const struct gifti_style *style, bool is_points,
                        const struct srnf_mesh *mesh)
{
    size_t rows = is_points ? mesh->n_vertices : mesh->n_faces;
    struct srnf_buffer raw = {0};

    file_print(out, "<DataArray Intent=\"NIFTI_INTENT_%s\" DataType=\"%s\" Dimensionality=\"2\" ",
               is_points ? "POINTSET" : "TRIANGLE",
               is_points ? style->point_type : style->face_type);
    file_print(out, "ArrayIndexingOrder=\"%sMajorOrder\" Dim0=\"%zu\" Dim1=\"3\" ",
               style->column_major ? "Column" : "Row", rows);
    file_print(out, "Encoding=\"%s\" Endian=\"%sEndian\" ExternalFileName=\"\">\n", style->encoding,
               style->big ? "Big" : "Little");
    file_print(out,
               "<MetaData><MD><Name>a</Name><Value><![CDATA[b]]></Value></MD></MetaData>\n<Data>");
    for (size_t i = 0; i < 3 * rows; i++) {
        size_t place = style->column_major ? (i % rows) * 3 + i / rows : i;
        double value = is_points ? mesh->vertices[place] : (double)mesh->faces[place];

        if (style->text) {
            file_print(out, "%.17g%s", value, i % 3 == 2 ? "\n" : " ");
        } else {
            file_number(&raw, is_points ? style->points : style->faces, style->big, value);
        }
    }
    if (style->packed) {
        put_packed(out, &raw);
    } else if (!style->text) {
        put_base64(out, raw.data, raw.size);
    }
    file_print(out, "</Data>\n</DataArray>\n");
    srnf_buffer_clear(&raw);
}

static void make_gifti(const struct srnf_mesh *mesh, const struct gifti_style *style,
                       struct srnf_buffer *out)
{
    file_print(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    file_print(out, "<!DOCTYPE GIFTI SYSTEM \"gifti.dtd\">\n");
    file_print(out, "<GIFTI Version=\"1.0\" NumberOfDataArrays=\"3\">\n");
    file_print(
        out,
        "<DataArray Intent=\"NIFTI_INTENT_SHAPE\" Encoding=\"?\"><Data>!</Data></DataArray>\n");
    gifti_array(out, style, false, mesh);
    gifti_array(out, style, true, mesh);
    file_print(out, "</GIFTI>\n");
}

static const struct gifti_style gifti_styles[] = {
    {"ASCII", "NIFTI_TYPE_FLOAT32", "NIFTI_TYPE_INT32", FILE_F32, FILE_I32, false, false, false,
     true},
    {"Base64Binary", "NIFTI_TYPE_FLOAT32", "NIFTI_TYPE_INT32", FILE_F32, FILE_I32, false, false,
     false, false},
    {"Base64Binary", "NIFTI_TYPE_FLOAT64", "NIFTI_TYPE_INT64", FILE_F64, FILE_I64, true, true,
     false, false},
    {"GZipBase64Binary", "NIFTI_TYPE_FLOAT32", "NIFTI_TYPE_INT32", FILE_F32, FILE_I32, false, false,
     true, false},
    {"GZipBase64Binary", "NIFTI_TYPE_FLOAT32", "NIFTI_TYPE_UINT8", FILE_F32, FILE_U8, true, true,
     true, false},
};

static void make_gifti_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_gifti(mesh, &gifti_styles[0], out);
}

static void make_gifti_base64(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_gifti(mesh, &gifti_styles[1], out);
}

static void make_gifti_base64_big(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_gifti(mesh, &gifti_styles[2], out);
}

static void make_gifti_gzip(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_gifti(mesh, &gifti_styles[3], out);
}

static void make_gifti_gzip_big(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_gifti(mesh, &gifti_styles[4], out);
}

/* ---- FreeSurfer ------------------------------------------------------------------------------ */

static void make_freesurfer(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    append(out, "\xff\xff\xfe", 3);
    file_print(out, "created by nobody, never\n\n");
    file_number(out, FILE_I32, true, (double)mesh->n_vertices);
    file_number(out, FILE_I32, true, (double)mesh->n_faces);
    put_vertices(mesh, FILE_F32, true, out);
    put_faces(mesh, FILE_I32, true, false, out);
}

const struct mesh_file_kind mesh_file_kinds[] = {
    {"ply-ascii", SRNF_MESH_PLY, true, 2, make_ply_ascii},
    {"ply-little", SRNF_MESH_PLY, true, 0, make_ply_little},
    {"ply-big", SRNF_MESH_PLY, true, 0, make_ply_big},
    {"obj", SRNF_MESH_OBJ, true, SIZE_MAX, make_obj},
    {"obj-slashes", SRNF_MESH_OBJ, true, SIZE_MAX, make_obj_slashes},
    {"off", SRNF_MESH_OFF, true, 1, make_off},
    {"off-colors", SRNF_MESH_OFF, true, 14, make_off_colors},
    {"stl-ascii", SRNF_MESH_STL, false, 8, make_stl_ascii},
    {"stl-binary", SRNF_MESH_STL, false, 0, make_stl_binary},
    {"stl-solid", SRNF_MESH_STL, false, 0, make_stl_solid},
    {"vtk-ascii", SRNF_MESH_VTK, true, 30, make_vtk_ascii},
    {"vtk-binary", SRNF_MESH_VTK, true, 13, make_vtk_binary},
    {"vtk5-ascii", SRNF_MESH_VTK, true, 1, make_vtk5_ascii},
    {"vtk5-binary", SRNF_MESH_VTK, true, 1, make_vtk5_binary},
    {"gifti-ascii", SRNF_MESH_GIFTI, true, 1, make_gifti_ascii},
    {"gifti-base64", SRNF_MESH_GIFTI, true, 1, make_gifti_base64},
    {"gifti-base64-big", SRNF_MESH_GIFTI, true, 1, make_gifti_base64_big},
    {"gifti-gzip", SRNF_MESH_GIFTI, true, 1, make_gifti_gzip},
    {"gifti-gzip-big", SRNF_MESH_GIFTI, true, 1, make_gifti_gzip_big},
    {"freesurfer", SRNF_MESH_FREESURFER, true, 0, make_freesurfer},
    {"vtp-ascii", SRNF_MESH_VTP, true, 1, make_vtp_ascii},
    {"vtp-base64", SRNF_MESH_VTP, true, 1, make_vtp_base64},
    {"vtp-zlib", SRNF_MESH_VTP, true, 1, make_vtp_zlib},
    {"vtp-raw", SRNF_MESH_VTP, true, 27, make_vtp_raw},
    {"vtp-appended", SRNF_MESH_VTP, true, 27, make_vtp_appended},
    {"gltf", SRNF_MESH_GLTF, true, 1, make_gltf},
    {"glb", SRNF_MESH_GLB, true, 0, make_glb},
    {"mz3", SRNF_MESH_MZ3, true, 0, make_mz3},
    {"fsascii", SRNF_MESH_FREESURFER_ASCII, true, 1, make_fsascii},
    {"byu", SRNF_MESH_BYU, true, 1, make_byu},
    {"mniobj-ascii", SRNF_MESH_MNI_OBJ, true, 1, make_mniobj_ascii},
    {"mniobj-little", SRNF_MESH_MNI_OBJ, true, 0, make_mniobj_little},
    {"mniobj-big", SRNF_MESH_MNI_OBJ, true, 0, make_mniobj_big},
    {"brainvisa-ascii", SRNF_MESH_BRAINVISA, true, 2, make_brainvisa_ascii},
    {"brainvisa-little", SRNF_MESH_BRAINVISA, true, 0, make_brainvisa_little},
    {"brainvisa-big", SRNF_MESH_BRAINVISA, true, 0, make_brainvisa_big},
    {"gmsh2-ascii", SRNF_MESH_GMSH, true, 1, make_gmsh2_ascii},
    {"gmsh2-binary", SRNF_MESH_GMSH, true, 1, make_gmsh2_binary},
    {"gmsh4-ascii", SRNF_MESH_GMSH, true, 1, make_gmsh4_ascii},
    {"gmsh4-binary", SRNF_MESH_GMSH, true, 1, make_gmsh4_binary},
    {"vtk-grid", SRNF_MESH_VTK, true, 1, make_vtk_grid},
    {"ply-packed", SRNF_MESH_PLY, true, 0, make_ply_packed},
    {"stl-packed", SRNF_MESH_STL, false, 0, make_stl_packed},
    {"mz3-packed", SRNF_MESH_MZ3, true, 0, make_mz3_packed},
    {"off-free", SRNF_MESH_OFF, true, 0, make_off_free},
    {NULL, SRNF_MESH_UNKNOWN, false, 0, NULL},
};
