/*
 * write_gifti.c - GIfTI 1.0: a point set, triangles, and a shape array for each field; float32 and
 * int32, base64 of zlib, little-endian.
 *
 * Source: "GIFTI Surface Data Format", version 1.0, 2008, which has no other types for them. What
 * the file says of itself is its metadata; name, unit and meaning of a field are those of its
 * array. The coordinate system is NIFTI_XFORM_UNKNOWN with the identity, since no input says in
 * which space of an atlas or a scanner its points are. Normals have no place here.
 */
#include "pack.h"

#include <float.h>
#include <math.h>

struct gifti_writer {
    struct srnf_buffer *out, bytes, packed;
};

static int print_metadata(struct srnf_buffer *out, const char *const texts[][2], size_t count)
{
    int status = mesh_buffer_print(out, "<MetaData>\n");

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        if (texts[i][1]) {
            status = mesh_buffer_print(
                out, "<MD><Name><![CDATA[%s]]></Name><Value><![CDATA[%s]]></Value></MD>\n",
                texts[i][0], texts[i][1]);
        }
    }
    return status == SRNF_OK ? mesh_buffer_print(out, "</MetaData>\n") : status;
}

static int begin_array(struct gifti_writer *writer, const char *intent, const char *type,
                       size_t rows, unsigned columns)
{
    int status =
        mesh_buffer_print(writer->out,
                          "<DataArray Intent=\"NIFTI_INTENT_%s\" DataType=\"NIFTI_TYPE_%s\" "
                          "ArrayIndexingOrder=\"RowMajorOrder\" Dimensionality=\"%u\" "
                          "Dim0=\"%zu\"",
                          intent, type, columns > 1 ? 2u : 1u, rows);

    if (status == SRNF_OK && columns > 1) {
        status = mesh_buffer_print(writer->out, " Dim1=\"%u\"", columns);
    }
    return status == SRNF_OK
               ? mesh_buffer_print(writer->out,
                                   " Encoding=\"GZipBase64Binary\" Endian=\"LittleEndian\" "
                                   "ExternalFileName=\"\" ExternalFileOffset=\"\">\n")
               : status;
}

static int end_array(struct gifti_writer *writer)
{
    int status = pack_deflate(&writer->packed, writer->bytes.data, writer->bytes.size);

    if (status == SRNF_OK) {
        status = mesh_buffer_print(writer->out, "<Data>");
    }
    if (status == SRNF_OK) {
        status = pack_append_base64(writer->out, writer->packed.data, writer->packed.size);
    }
    writer->bytes.size = 0;
    return status == SRNF_OK ? mesh_buffer_print(writer->out, "</Data>\n</DataArray>\n") : status;
}

static int put_floats(struct gifti_writer *writer, const double *values, size_t count)
{
    int status = mesh_buffer_reserve(&writer->bytes, 4 * count);

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        scalar_put_f32_le(writer->bytes.data + writer->bytes.size, (float)values[i]);
        writer->bytes.size += 4;
    }
    return status;
}

static int append_points(struct gifti_writer *writer, const struct mesh_output *output)
{
    static const char *const texts[1][2] = {{"GeometricType", "Anatomical"}};
    const struct srnf_mesh *mesh = output->mesh;
    int status = begin_array(writer, "POINTSET", "FLOAT32", mesh->n_vertices, 3);

    if (status == SRNF_OK) {
        status = print_metadata(writer->out, texts, 1);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(
            writer->out,
            "<CoordinateSystemTransformMatrix>\n<DataSpace><![CDATA[NIFTI_XFORM_UNKNOWN]]>"
            "</DataSpace>\n<TransformedSpace><![CDATA[NIFTI_XFORM_UNKNOWN]]></TransformedSpace>\n"
            "<MatrixData>1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1</MatrixData>\n"
            "</CoordinateSystemTransformMatrix>\n");
    }
    if (status == SRNF_OK) {
        status = put_floats(writer, mesh->vertices, 3 * mesh->n_vertices);
    }
    return status == SRNF_OK ? end_array(writer) : status;
}

static int append_triangles(struct gifti_writer *writer, const struct srnf_mesh *mesh)
{
    static const char *const texts[1][2] = {{"TopologicalType", "Closed"}};
    size_t count = 3 * mesh->n_faces;
    int status = begin_array(writer, "TRIANGLE", "INT32", mesh->n_faces, 3);

    if (status == SRNF_OK) {
        status = print_metadata(writer->out, texts, 1);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_reserve(&writer->bytes, 4 * count);
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        scalar_put_u32_le(writer->bytes.data + writer->bytes.size, mesh->faces[i]);
        writer->bytes.size += 4;
    }
    return status == SRNF_OK ? end_array(writer) : status;
}

static int append_field(struct gifti_writer *writer, const struct srnf_mesh_field *field,
                        size_t n_vertices)
{
    const char *const texts[3][2] = {
        {"Name", field->name}, {"Unit", field->unit}, {"Meaning", field->meaning}};
    int status = begin_array(writer, "SHAPE", "FLOAT32", n_vertices, 1);

    if (status == SRNF_OK) {
        status = print_metadata(writer->out, texts, 3);
    }
    if (status == SRNF_OK) {
        status = put_floats(writer, field->values, n_vertices);
    }
    return status == SRNF_OK ? end_array(writer) : status;
}

static bool fits_float(const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (fabs(values[i]) > (double)FLT_MAX) {
            return false;
        }
    }
    return true;
}

static int append_all(struct gifti_writer *writer, const struct mesh_output *output)
{
    const struct srnf_mesh_description *d = &output->description;
    const char *const texts[4][2] = {{"Program", "libsrnf " SRNF_VERSION},
                                     {"Name", d->name},
                                     {"Space", d->space},
                                     {"Comment", d->comment}};
    int status =
        mesh_buffer_print(writer->out,
                          "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                          "<!DOCTYPE GIFTI SYSTEM \"http://gifti.projects.nitrc.org/"
                          "gifti.dtd\">\n<GIFTI Version=\"1.0\" NumberOfDataArrays=\"%zu\">\n",
                          2 + output->n_fields);

    if (status == SRNF_OK) {
        status = print_metadata(writer->out, texts, 4);
    }
    if (status == SRNF_OK) {
        status = append_points(writer, output);
    }
    if (status == SRNF_OK) {
        status = append_triangles(writer, output->mesh);
    }
    for (size_t i = 0; i < output->n_fields && status == SRNF_OK; i++) {
        status = append_field(writer, &output->fields[i], output->mesh->n_vertices);
    }
    return status == SRNF_OK ? mesh_buffer_print(writer->out, "</GIFTI>\n") : status;
}

int mesh_write_gifti(const struct mesh_output *output)
{
    struct gifti_writer writer = {.out = output->out};
    const struct srnf_mesh *mesh = output->mesh;
    bool fits = fits_float(mesh->vertices, 3 * mesh->n_vertices);
    int status;

    for (size_t i = 0; i < output->n_fields && fits; i++) {
        fits = fits_float(output->fields[i].values, mesh->n_vertices);
    }
    writer.bytes.max = writer.packed.max = output->out->max;
    status = fits ? append_all(&writer, output) : SRNF_EINVAL;
    srnf_buffer_clear(&writer.bytes);
    srnf_buffer_clear(&writer.packed);
    return status;
}
