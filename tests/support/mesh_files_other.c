/*
 * mesh_files_other.c - mesh files made in memory: VTP, glTF, MZ3, FreeSurfer's text, BYU, MNI obj,
 * Gmsh and BrainVISA (see mesh_files.h).
 */
#include "support/mesh_files.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

static void put_bytes(struct srnf_buffer *out, const void *bytes, size_t size)
{
    if (srnf_buffer_append(out, bytes, size) != SRNF_OK) {
        abort();
    }
}

static void put_vertices(const struct srnf_mesh *mesh, enum file_number type, bool big,
                         struct srnf_buffer *out)
{
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        file_number(out, type, big, mesh->vertices[i]);
    }
}

static void put_faces(const struct srnf_mesh *mesh, enum file_number type, bool big,
                      struct srnf_buffer *out)
{
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        file_number(out, type, big, mesh->faces[i]);
    }
}

static void print_vertices(const struct srnf_mesh *mesh, const char *format,
                           struct srnf_buffer *out)
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const double *v = mesh->vertices + 3 * i;

        file_print(out, "%s%.17g%s%.17g%s%.17g%s", format[0] == '(' ? "(" : "", v[0],
                   format[0] == '(' ? " ," : " ", v[1], format[0] == '(' ? " ," : " ", v[2],
                   format[0] == '(' ? ") " : format);
    }
}

/* ---- Base64 ---------------------------------------------------------------------------------- */

static void put_base64(struct srnf_buffer *out, const unsigned char *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

    for (size_t i = 0; i < size; i += 3) {
        size_t n = size - i < 3 ? size - i : 3;
        unsigned word = 0;

        for (size_t k = 0; k < 3; k++) {
            word = word << 8 | (k < n ? bytes[i + k] : 0u);
        }
        for (size_t k = 0; k < 4; k++) {
            file_print(out, "%c", k <= n ? digits[word >> (18 - 6 * k) & 63] : '=');
        }
    }
}

/* ---- VTP ------------------------------------------------------------------------------------- */

enum vtp_way { VTP_ASCII, VTP_BASE64, VTP_RAW, VTP_APPENDED64 };

struct vtp_file {
    enum vtp_way way;
    bool big, zip;
    enum file_number header;
    struct srnf_buffer *out, appended;
};

/* The numbers with their header: as the file has them. Packed ones are in two blocks. */
static void pack(const struct vtp_file *file, const struct srnf_buffer *raw,
                 struct srnf_buffer *header, struct srnf_buffer *data)
{
    size_t half = (raw->size + 1) / 2;

    if (!file->zip) {
        file_number(header, file->header, file->big, (double)raw->size);
        put_bytes(data, raw->data, raw->size);
        return;
    }
    file_number(header, file->header, file->big, 2);
    file_number(header, file->header, file->big, (double)half);
    file_number(header, file->header, file->big,
                half == raw->size - half ? 0 : (double)(raw->size - half));
    for (size_t i = 0; i < 2; i++) {
        uLong plain = (uLong)(i ? raw->size - half : half);
        uLongf size = compressBound(plain);
        unsigned char *packed = malloc(size);

        if (!packed || compress(packed, &size, raw->data + i * half, plain) != Z_OK) {
            abort();
        }
        file_number(header, file->header, file->big, (double)size);
        put_bytes(data, packed, size);
        free(packed);
    }
}

static void put_array(struct vtp_file *file, const char *attributes, struct srnf_buffer *raw)
{
    struct srnf_buffer header = {0}, data = {0};

    pack(file, raw, &header, &data);
    if (file->way == VTP_BASE64) {
        file_print(file->out, "<DataArray %s format=\"binary\">\n", attributes);
        if (!file->zip) { /* VTK encodes them together; packed, one by one */
            put_bytes(&header, data.data, data.size);
            data.size = 0;
        }
        put_base64(file->out, header.data, header.size);
        put_base64(file->out, data.data, data.size);
        file_print(file->out,
                   "\n<InformationKey name=\"a\"><Value index=\"0\">1</Value></InformationKey>"
                   "</DataArray>\n");
    } else {
        file_print(file->out,
                   "<DataArray %s format=\"appended\" offset=\"%zu\"><InformationKey "
                   "name=\"a\"/></DataArray>\n",
                   attributes, file->appended.size);
        if (file->way == VTP_RAW) {
            put_bytes(&file->appended, header.data, header.size);
            put_bytes(&file->appended, data.data, data.size);
        } else {
            put_base64(&file->appended, header.data, header.size);
            put_base64(&file->appended, data.data, data.size);
        }
    }
    srnf_buffer_clear(&header);
    srnf_buffer_clear(&data);
    srnf_buffer_clear(raw);
}

static void put_binary_piece(struct vtp_file *file, const struct srnf_mesh *mesh)
{
    struct srnf_buffer raw = {0};

    file_print(file->out, "<PointData><DataArray type=\"Float32\" format=\"ascii\">1 2"
                          "</DataArray></PointData><Points>\n");
    put_vertices(mesh, FILE_F64, file->big, &raw);
    put_array(file, "type=\"Float64\" NumberOfComponents=\"3\"", &raw);
    file_print(file->out, "</Points><Polys>\n");
    put_faces(mesh, FILE_I64, file->big, &raw);
    put_array(file, "type=\"Int64\" Name=\"connectivity\"", &raw);
    for (size_t i = 1; i <= mesh->n_faces; i++) {
        file_number(&raw, FILE_I32, file->big, (double)(3 * i));
    }
    put_array(file, "type=\"Int32\" Name=\"offsets\"", &raw);
    file_print(file->out, "</Polys>");
}

static void put_text_piece(struct vtp_file *file, const struct srnf_mesh *mesh)
{
    file_print(file->out, "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" "
                          "format=\"ascii\">\n");
    print_vertices(mesh, "\n", file->out);
    file_print(file->out, "</DataArray></Points><Polys><DataArray type=\"Int64\" "
                          "Name=\"connectivity\" format=\"ascii\">");
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        file_print(file->out, "%u ", mesh->faces[i]);
    }
    file_print(file->out,
               "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">");
    for (size_t i = 1; i <= mesh->n_faces; i++) {
        file_print(file->out, "%zu\n", 3 * i);
    }
    file_print(file->out, "</DataArray></Polys>");
}

static void make_vtp(const struct srnf_mesh *mesh, enum vtp_way way, bool big, bool zip,
                     enum file_number header, struct srnf_buffer *out)
{
    struct vtp_file file = {.way = way, .big = big, .zip = zip, .header = header, .out = out};

    file_print(out,
               "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
               "byte_order=\"%sEndian\"%s%s>\n<PolyData>\n<Piece NumberOfPoints=\"%zu\" "
               "NumberOfPolys=\"%zu\">\n",
               big ? "Big" : "Little", header == FILE_I64 ? " header_type=\"UInt64\"" : "",
               zip ? " compressor=\"vtkZLibDataCompressor\"" : "", mesh->n_vertices, mesh->n_faces);
    if (way == VTP_ASCII) {
        put_text_piece(&file, mesh);
    } else {
        put_binary_piece(&file, mesh);
    }
    file_print(out, "</Piece></PolyData>\n");
    if (file.appended.size > 0) {
        file_print(out, "<AppendedData encoding=\"%s\">\n _", way == VTP_RAW ? "raw" : "base64");
        put_bytes(out, file.appended.data, file.appended.size);
        file_print(out, "</AppendedData>");
    }
    file_print(out, "</VTKFile>\n");
    srnf_buffer_clear(&file.appended);
}

void make_vtp_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_vtp(mesh, VTP_ASCII, false, false, FILE_U32, out);
}

void make_vtp_base64(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_vtp(mesh, VTP_BASE64, true, false, FILE_U32, out);
}

void make_vtp_zlib(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_vtp(mesh, VTP_BASE64, false, true, FILE_I64, out);
}

void make_vtp_raw(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_vtp(mesh, VTP_RAW, false, false, FILE_I64, out);
}

void make_vtp_appended(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_vtp(mesh, VTP_APPENDED64, true, true, FILE_U32, out);
}

/* ---- glTF ------------------------------------------------------------------------------------ */

/* The corners, and a node above the mesh's own that takes back what that does. */
static void print_gltf(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out,
               "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[1]}],"
               "\"nodes\":[{\"mesh\":0,\"translation\":[1,-2,4]},{\"children\":[0],"
               "\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,-1,2,-4,1]}],"
               "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
               "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":%zu,"
               "\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5123,\"count\":%zu,"
               "\"type\":\"SCALAR\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":%zu},"
               "{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}],\"buffers\":[{"
               "\"byteLength\":%zu",
               mesh->n_vertices, 3 * mesh->n_faces, 12 * mesh->n_vertices, 12 * mesh->n_vertices,
               6 * mesh->n_faces, 12 * mesh->n_vertices + 6 * mesh->n_faces);
}

void make_gltf(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    struct srnf_buffer binary = {0};

    put_vertices(mesh, FILE_F32, false, &binary);
    put_faces(mesh, FILE_U16, false, &binary);
    print_gltf(mesh, out);
    file_print(out, ",\"uri\":\"data:application/octet-stream;base64,");
    put_base64(out, binary.data, binary.size);
    file_print(out, "\"}]}\n");
    srnf_buffer_clear(&binary);
}

void make_glb(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    struct srnf_buffer text = {0}, binary = {0};

    print_gltf(mesh, &text);
    file_print(&text, "}]}");
    while (text.size % 4) {
        file_print(&text, " ");
    }
    put_vertices(mesh, FILE_F32, false, &binary);
    put_faces(mesh, FILE_U16, false, &binary);
    file_print(out, "glTF");
    file_number(out, FILE_U32, false, 2);
    file_number(out, FILE_U32, false, (double)(28 + text.size + binary.size));
    file_number(out, FILE_U32, false, (double)text.size);
    file_print(out, "JSON");
    put_bytes(out, text.data, text.size);
    file_number(out, FILE_U32, false, (double)binary.size);
    put_bytes(out, "BIN", 4);
    put_bytes(out, binary.data, binary.size);
    srnf_buffer_clear(&text);
    srnf_buffer_clear(&binary);
}

/* ---- Smaller formats ------------------------------------------------------------------------- */

void make_mz3(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "MZ");
    file_number(out, FILE_U16, false, 3);
    file_number(out, FILE_U32, false, (double)mesh->n_faces);
    file_number(out, FILE_U32, false, (double)mesh->n_vertices);
    file_number(out, FILE_U32, false, 4);
    file_number(out, FILE_U32, false, 77);
    put_faces(mesh, FILE_I32, false, out);
    put_vertices(mesh, FILE_F32, false, out);
}

void make_fsascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "#!ascii version of lh.white\n%zu %zu\n", mesh->n_vertices, mesh->n_faces);
    print_vertices(mesh, " 0\n", out);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, "%u %u %u 0\n", f[0], f[1], f[2]);
    }
}

void make_byu(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "1 %zu %zu %zu\n1 %zu\n", mesh->n_vertices, mesh->n_faces, 3 * mesh->n_faces,
               mesh->n_faces);
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        /* The columns of some programs touch. */
        file_print(out, "%s%.11e%s", mesh->vertices[i] < 0 ? "" : " ", mesh->vertices[i],
                   i % 6 == 5 ? "\n" : "");
    }
    file_print(out, "\n");
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, "%u %u -%u\n", f[0] + 1, f[1] + 1, f[2] + 1);
    }
}

void make_mniobj_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "P 0.3 0.3 0.4 10 1 %zu\n", mesh->n_vertices);
    print_vertices(mesh, "\n", out);
    file_print(out, "\n");
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        file_print(out, "0 0 1\n");
    }
    file_print(out, "\n%zu\n0 1 1 1 1\n\n", mesh->n_faces);
    for (size_t i = 1; i <= mesh->n_faces; i++) {
        file_print(out, "%zu ", 3 * i);
    }
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        file_print(out, "\n%u", mesh->faces[i]);
    }
    file_print(out, "\n");
}

static void make_mniobj(const struct srnf_mesh *mesh, bool big, struct srnf_buffer *out)
{
    static const double properties[5] = {0.3, 0.3, 0.4, 10, 1};

    file_print(out, "p");
    for (size_t i = 0; i < 5; i++) {
        file_number(out, FILE_F32, big, properties[i]);
    }
    file_number(out, FILE_I32, big, (double)mesh->n_vertices);
    put_vertices(mesh, FILE_F32, big, out);
    put_vertices(mesh, FILE_F32, big, out);
    file_number(out, FILE_I32, big, (double)mesh->n_faces);
    file_number(out, FILE_I32, big, 2);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        put_bytes(out, "rgba", 4);
    }
    for (size_t i = 1; i <= mesh->n_faces; i++) {
        file_number(out, FILE_I32, big, (double)(3 * i));
    }
    put_faces(mesh, FILE_I32, big, out);
}

void make_mniobj_little(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_mniobj(mesh, false, out);
}

void make_mniobj_big(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_mniobj(mesh, true, out);
}

void make_brainvisa_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "ascii\nVOID\n3\n1\n0\n%zu\n", mesh->n_vertices);
    print_vertices(mesh, "(", out);
    file_print(out, "\n0\n0\n%zu\n", mesh->n_faces);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, "(%u ,%u ,%u) ", f[0], f[1], f[2]);
    }
}

static void make_brainvisa(const struct srnf_mesh *mesh, bool big, struct srnf_buffer *out)
{
    file_print(out, "binar%s", big ? "ABCD" : "DCBA");
    file_number(out, FILE_U32, big, 4);
    file_print(out, "VOID");
    file_number(out, FILE_U32, big, 3);
    file_number(out, FILE_U32, big, 1);
    file_number(out, FILE_U32, big, 0);
    file_number(out, FILE_U32, big, (double)mesh->n_vertices);
    put_vertices(mesh, FILE_F32, big, out);
    file_number(out, FILE_U32, big, (double)mesh->n_vertices);
    put_vertices(mesh, FILE_F32, big, out);
    file_number(out, FILE_U32, big, 0);
    file_number(out, FILE_U32, big, (double)mesh->n_faces);
    put_faces(mesh, FILE_U32, big, out);
}

void make_brainvisa_little(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_brainvisa(mesh, false, out);
}

void make_brainvisa_big(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_brainvisa(mesh, true, out);
}

/* ---- Gmsh ------------------------------------------------------------------------------------ */

void make_gmsh2_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out,
               "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"a\"\n"
               "$EndPhysicalNames\n$Nodes\n%zu\n",
               mesh->n_vertices);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const double *v = mesh->vertices + 3 * i;

        /* Tags that fall, and leave gaps. */
        file_print(out, "%zu %.17g %.17g %.17g\n", 7 * (mesh->n_vertices - i), v[0], v[1], v[2]);
    }
    file_print(out, "$EndNodes\n$Elements\n%zu\n1 15 2 0 1 7\n", mesh->n_faces + 1);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, "%zu 2 2 0 1 %zu %zu %zu\n", i + 2, 7 * (mesh->n_vertices - f[0]),
                   7 * (mesh->n_vertices - f[1]), 7 * (mesh->n_vertices - f[2]));
    }
    file_print(out, "$EndElements\n");
}

void make_gmsh2_binary(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "$MeshFormat\n2.2 1 8\n");
    file_number(out, FILE_I32, true, 1);
    file_print(out, "\n$EndMeshFormat\n$Nodes\n%zu\n", mesh->n_vertices);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        file_number(out, FILE_I32, true, (double)(i + 1));
        for (size_t k = 0; k < 3; k++) {
            file_number(out, FILE_F64, true, mesh->vertices[3 * i + k]);
        }
    }
    file_print(out, "\n$EndNodes\n$Elements\n%zu\n", mesh->n_faces);
    file_number(out, FILE_I32, true, 2);
    file_number(out, FILE_I32, true, (double)mesh->n_faces);
    file_number(out, FILE_I32, true, 1);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        file_number(out, FILE_I32, true, (double)(i + 1));
        file_number(out, FILE_I32, true, 99);
        for (size_t k = 0; k < 3; k++) {
            file_number(out, FILE_I32, true, mesh->faces[3 * i + k] + 1.0);
        }
    }
    file_print(out, "\n$EndElements\n");
}

static void make_gmsh4(const struct srnf_mesh *mesh, bool binary, struct srnf_buffer *out)
{
    size_t n = mesh->n_vertices, m = mesh->n_faces;

#define WORD(type, value)                                    \
    (binary ? file_number(out, type, false, (double)(value)) \
            : file_print(out, "%lld ", (long long)(value)))
    file_print(out, "$MeshFormat\n4.1 %d 8\n", binary);
    if (binary) {
        file_number(out, FILE_I32, false, 1);
    }
    file_print(out, "\n$EndMeshFormat\n$Entities\n0 0 0 0\n$EndEntities\n$Nodes\n");
    WORD(FILE_I64, 1);
    WORD(FILE_I64, n);
    WORD(FILE_I64, 1);
    WORD(FILE_I64, n);
    WORD(FILE_I32, 2);
    WORD(FILE_I32, 1);
    WORD(FILE_I32, 0);
    WORD(FILE_I64, n);
    for (size_t i = 0; i < n; i++) {
        WORD(FILE_I64, i + 1);
    }
    if (binary) {
        put_vertices(mesh, FILE_F64, false, out);
    } else {
        print_vertices(mesh, "\n", out);
    }
    file_print(out, "\n$EndNodes\n$Elements\n");
    WORD(FILE_I64, 1);
    WORD(FILE_I64, m);
    WORD(FILE_I64, 1);
    WORD(FILE_I64, m);
    WORD(FILE_I32, 2);
    WORD(FILE_I32, 1);
    WORD(FILE_I32, 2);
    WORD(FILE_I64, m);
    for (size_t i = 0; i < m; i++) {
        WORD(FILE_I64, i + 1);
        for (size_t k = 0; k < 3; k++) {
            WORD(FILE_I64, mesh->faces[3 * i + k] + 1);
        }
    }
#undef WORD
    file_print(out, "\n$EndElements\n");
}

void make_gmsh4_ascii(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_gmsh4(mesh, false, out);
}

void make_gmsh4_binary(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    make_gmsh4(mesh, true, out);
}

/* ---- VTK's grids, and gzip ------------------------------------------------------------------- */

void make_vtk_grid(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out,
               "# vtk DataFile Version 3.0\na title\nBINARY\nDATASET UNSTRUCTURED_GRID\n"
               "FIELD FieldData 2\nnames 1 2 string\n\xc1"
               "a\xc2"
               "bc\nbits 1 11 bit\n\x01\x02\nPOINTS %zu double\n",
               mesh->n_vertices);
    put_vertices(mesh, FILE_F64, true, out);
    file_print(out, "\nCELLS %zu %zu\n", mesh->n_faces + 1, 4 * mesh->n_faces + 2);
    file_number(out, FILE_I32, true, 1);
    file_number(out, FILE_I32, true, 0);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        file_number(out, FILE_I32, true, 3);
        for (size_t k = 0; k < 3; k++) {
            file_number(out, FILE_I32, true, mesh->faces[3 * i + k]);
        }
    }
    file_print(out, "\nCELL_TYPES %zu\n", mesh->n_faces + 1);
    file_number(out, FILE_I32, true, 1);
    for (size_t i = 0; i < mesh->n_faces; i++) {
        file_number(out, FILE_I32, true, 5);
    }
    file_print(out, "\n");
}

/* Packs what is in `raw`, and clears it. */
static void put_gzip(struct srnf_buffer *raw, struct srnf_buffer *out)
{
    z_stream stream = {0};
    unsigned char *packed;
    uLong bound;

    if (deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
        abort();
    }
    bound = deflateBound(&stream, (uLong)raw->size);
    packed = malloc(bound);
    stream.next_in = raw->data;
    stream.avail_in = (uInt)raw->size;
    stream.next_out = packed;
    stream.avail_out = (uInt)bound;
    if (!packed || deflate(&stream, Z_FINISH) != Z_STREAM_END) {
        abort();
    }
    put_bytes(out, packed, stream.total_out);
    (void)deflateEnd(&stream);
    free(packed);
    srnf_buffer_clear(raw);
}

void make_ply_packed(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    struct srnf_buffer raw = {0};

    if (srnf_mesh_write(mesh, SRNF_MESH_PLY, NULL, NULL, 0, &raw) != SRNF_OK) {
        abort();
    }
    put_gzip(&raw, out);
}

void make_stl_packed(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    struct srnf_buffer raw = {0};

    if (srnf_mesh_write(mesh, SRNF_MESH_STL, NULL, NULL, 0, &raw) != SRNF_OK) {
        abort();
    }
    put_gzip(&raw, out);
}

void make_mz3_packed(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    struct srnf_buffer raw = {0};

    make_mz3(mesh, &raw);
    put_gzip(&raw, out);
}

/* ---- OFF without lines ----------------------------------------------------------------------- */

void make_off_free(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    file_print(out, "COFF %zu %zu 0", mesh->n_vertices, mesh->n_faces);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const double *v = mesh->vertices + 3 * i;

        file_print(out, " %.17g\n%.17g %.17g 1 0 0 # a colour\n 1", v[0], v[1], v[2]);
    }
    for (size_t i = 0; i < mesh->n_faces; i++) {
        const uint32_t *f = mesh->faces + 3 * i;

        file_print(out, " 3 %u %u %u", f[0], f[1], f[2]);
    }
}
