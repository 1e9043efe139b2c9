/*
 * write_vtk.c - VTK's legacy format 3.0, POLYDATA, BINARY (big-endian): double points, and normals
 * and fields as point data.
 */
#include "formats.h"

static int write_doubles(struct srnf_buffer *out, const double *values, size_t count)
{
    int status = mesh_buffer_reserve(out, count * sizeof(double) + 1);

    if (status != SRNF_OK) {
        return status;
    }
    for (size_t i = 0; i < count; i++) {
        scalar_put_f64_be(out->data + out->size, values[i]);
        out->size += sizeof(double);
    }
    return srnf_buffer_append(out, "\n", 1);
}

static int write_faces(struct srnf_buffer *out, const struct srnf_mesh *mesh)
{
    int status = mesh_buffer_print(out, "POLYGONS %zu %zu\n", mesh->n_faces, 4 * mesh->n_faces);

    for (size_t i = 0; i < mesh->n_faces && status == SRNF_OK; i++) {
        unsigned char record[16];

        scalar_put_u32_be(record, 3);
        for (size_t k = 0; k < 3; k++) {
            scalar_put_u32_be(record + 4 * (k + 1), mesh->faces[3 * i + k]);
        }
        status = srnf_buffer_append(out, record, sizeof record);
    }
    return status == SRNF_OK ? srnf_buffer_append(out, "\n", 1) : status;
}

static int write_point_data(const struct mesh_output *output)
{
    struct srnf_buffer *out = output->out;
    size_t n = output->mesh->n_vertices;
    int status = SRNF_OK;

    if (output->n_fields > 0 || output->normals) {
        status = mesh_buffer_print(out, "POINT_DATA %zu\n", n);
    }
    for (size_t i = 0; i < output->n_fields && status == SRNF_OK; i++) {
        status = mesh_buffer_print(out, "SCALARS %s double 1\nLOOKUP_TABLE default\n",
                                   output->fields[i].name);
        if (status == SRNF_OK) {
            status = write_doubles(out, output->fields[i].values, n);
        }
    }
    if (status == SRNF_OK && output->normals) {
        status = mesh_buffer_print(out, "NORMALS normals double\n");
        if (status == SRNF_OK) {
            status = write_doubles(out, output->normals, 3 * n);
        }
    }
    return status;
}

int mesh_write_vtk(const struct mesh_output *output)
{
    struct srnf_buffer *out = output->out;
    const struct srnf_mesh *mesh = output->mesh;
    const char *space = output->description.space, *comment = output->description.comment;
    /* The title may have 255 characters. */
    int status = mesh_buffer_print(out, "# vtk DataFile Version 3.0\nlibsrnf %s%s%.60s%s%.150s\n",
                                   SRNF_VERSION, space ? ", space: " : "", space ? space : "",
                                   comment ? "; " : "", comment ? comment : "");

    if (status == SRNF_OK) {
        status = mesh_buffer_print(out, "BINARY\nDATASET POLYDATA\nPOINTS %zu double\n",
                                   mesh->n_vertices);
    }
    if (status == SRNF_OK) {
        status = write_doubles(out, mesh->vertices, 3 * mesh->n_vertices);
    }
    if (status == SRNF_OK) {
        status = write_faces(out, mesh);
    }
    return status == SRNF_OK ? write_point_data(output) : status;
}
