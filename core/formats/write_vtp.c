/*
 * write_vtp.c - VTK's XML polydata, version 1.0: double points, int32 triangles, normals and fields
 * as point data; each array base64 in place, packed by zlib.
 *
 *     <VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64"
 *         compressor="vtkZLibDataCompressor"> <PolyData> <FieldData> ... </FieldData>
 *       <Piece NumberOfPoints= NumberOfPolys= ...> <PointData> <Points> <Polys> </Piece>
 *
 * An array is base64 of a header (blocks, bytes of a block, bytes of a last one that is shorter,
 * and for each block its packed bytes) and, encoded on its own, of the packed blocks. Here there is
 * one block. Source: VTK's wiki, "VTK XML Formats". What the file says of itself is field data:
 * arrays of strings, which are written as the codes of their characters with a zero behind. Unit
 * and meaning of a field are in an array of that kind too.
 */
#include "pack.h"

#include <string.h>

#define HEADER_WORDS 4

/* Where an array's bytes and their packed form are made. */
struct vtp_writer {
    struct srnf_buffer *out, bytes, packed;
};

static int append_array(struct vtp_writer *writer, const char *type, const char *name,
                        unsigned components)
{
    unsigned char header[8 * HEADER_WORDS];
    const uint64_t words[HEADER_WORDS] = {1, writer->bytes.size, 0, 0};
    int status = pack_deflate(&writer->packed, writer->bytes.data, writer->bytes.size);

    for (size_t i = 0; i < HEADER_WORDS; i++) {
        scalar_put_u64_le(header + 8 * i, i == 3 ? writer->packed.size : words[i]);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(writer->out,
                                   "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%u\" "
                                   "format=\"binary\">\n",
                                   type, name, components);
    }
    if (status == SRNF_OK) {
        status = pack_append_base64(writer->out, header, sizeof header);
    }
    if (status == SRNF_OK) {
        status = pack_append_base64(writer->out, writer->packed.data, writer->packed.size);
    }
    writer->bytes.size = 0;
    return status == SRNF_OK ? mesh_buffer_print(writer->out, "\n</DataArray>\n") : status;
}

static int append_doubles(struct vtp_writer *writer, const char *name, const double *values,
                          size_t count, unsigned components)
{
    int status = mesh_buffer_reserve(&writer->bytes, count * sizeof(double));

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        scalar_put_f64_le(writer->bytes.data + writer->bytes.size, values[i]);
        writer->bytes.size += sizeof(double);
    }
    return status == SRNF_OK ? append_array(writer, "Float64", name, components) : status;
}

/* Corners of the faces, or where each face ends among them. */
static int append_integers(struct vtp_writer *writer, const char *name, const uint32_t *corners,
                           size_t count)
{
    int status = mesh_buffer_reserve(&writer->bytes, 4 * count);

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        scalar_put_u32_le(writer->bytes.data + writer->bytes.size,
                          corners ? corners[i] : (uint32_t)(3 * (i + 1)));
        writer->bytes.size += 4;
    }
    return status == SRNF_OK ? append_array(writer, "Int32", name, 1) : status;
}

/* A string of the file; nothing for NULL. */
static int append_text(struct vtp_writer *writer, const char *name, const char *suffix,
                       const char *text)
{
    int status = SRNF_OK;

    if (!text) {
        return SRNF_OK;
    }
    status = mesh_buffer_print(writer->out,
                               "<DataArray type=\"String\" Name=\"%s%s\" NumberOfTuples=\"1\" "
                               "format=\"ascii\">\n",
                               name, suffix);
    for (size_t i = 0; i <= strlen(text) && status == SRNF_OK; i++) {
        status = mesh_buffer_print(writer->out, "%u ", (unsigned)(unsigned char)text[i]);
    }
    return status == SRNF_OK ? mesh_buffer_print(writer->out, "\n</DataArray>\n") : status;
}

static int append_texts(struct vtp_writer *writer, const struct mesh_output *output)
{
    const struct srnf_mesh_description *d = &output->description;
    int status = mesh_buffer_print(writer->out, "<FieldData>\n");

    if (status == SRNF_OK) {
        status = append_text(writer, "name", "", d->name);
    }
    if (status == SRNF_OK) {
        status = append_text(writer, "space", "", d->space);
    }
    if (status == SRNF_OK) {
        status = append_text(writer, "comment", "", d->comment);
    }
    for (size_t i = 0; i < output->n_fields && status == SRNF_OK; i++) {
        const struct srnf_mesh_field *field = &output->fields[i];

        status = append_text(writer, field->name, "_unit", field->unit);
        if (status == SRNF_OK) {
            status = append_text(writer, field->name, "_meaning", field->meaning);
        }
    }
    return status == SRNF_OK ? mesh_buffer_print(writer->out, "</FieldData>\n") : status;
}

static int append_point_data(struct vtp_writer *writer, const struct mesh_output *output)
{
    size_t n = output->mesh->n_vertices;
    const char *first = output->n_fields > 0 ? output->fields[0].name : NULL;
    int status = mesh_buffer_print(writer->out, "<PointData%s%s%s%s>\n", first ? " Scalars=\"" : "",
                                   first ? first : "", first ? "\"" : "",
                                   output->normals ? " Normals=\"normals\"" : "");

    for (size_t i = 0; i < output->n_fields && status == SRNF_OK; i++) {
        status = append_doubles(writer, output->fields[i].name, output->fields[i].values, n, 1);
    }
    if (status == SRNF_OK && output->normals) {
        status = append_doubles(writer, "normals", output->normals, 3 * n, 3);
    }
    return status == SRNF_OK ? mesh_buffer_print(writer->out, "</PointData>\n") : status;
}

static int append_piece(struct vtp_writer *writer, const struct mesh_output *output)
{
    const struct srnf_mesh *mesh = output->mesh;
    int status = mesh_buffer_print(writer->out,
                                   "<Piece NumberOfPoints=\"%zu\" NumberOfVerts=\"0\" "
                                   "NumberOfLines=\"0\" NumberOfStrips=\"0\" "
                                   "NumberOfPolys=\"%zu\">\n",
                                   mesh->n_vertices, mesh->n_faces);

    if (status == SRNF_OK) {
        status = append_point_data(writer, output);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(writer->out, "<Points>\n");
    }
    if (status == SRNF_OK) {
        status = append_doubles(writer, "Points", mesh->vertices, 3 * mesh->n_vertices, 3);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(writer->out, "</Points>\n<Polys>\n");
    }
    if (status == SRNF_OK) {
        status = append_integers(writer, "connectivity", mesh->faces, 3 * mesh->n_faces);
    }
    if (status == SRNF_OK) {
        status = append_integers(writer, "offsets", NULL, mesh->n_faces);
    }
    return status == SRNF_OK ? mesh_buffer_print(writer->out, "</Polys>\n</Piece>\n") : status;
}

int mesh_write_vtp(const struct mesh_output *output)
{
    struct vtp_writer writer = {.out = output->out};
    int status = mesh_buffer_print(
        output->out,
        "<?xml version=\"1.0\"?>\n<!-- libsrnf %s -->\n<VTKFile type=\"PolyData\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" header_type=\"UInt64\" "
        "compressor=\"vtkZLibDataCompressor\">\n<PolyData>\n",
        SRNF_VERSION);

    writer.bytes.max = writer.packed.max = output->out->max;
    if (status == SRNF_OK) {
        status = append_texts(&writer, output);
    }
    if (status == SRNF_OK) {
        status = append_piece(&writer, output);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(output->out, "</PolyData>\n</VTKFile>\n");
    }
    srnf_buffer_clear(&writer.bytes);
    srnf_buffer_clear(&writer.packed);
    return status;
}
