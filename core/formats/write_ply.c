/*
 * write_ply.c - PLY, binary little-endian: double coordinates, double normals and fields as vertex
 * properties, faces as lists of three.
 */
#include "formats.h"

#include <string.h>

#define FACE_SIZE ((size_t)13) /* one byte 3, three int32 */

static int write_header(const struct mesh_output *output)
{
    const struct srnf_mesh *mesh = output->mesh;
    int status = mesh_buffer_print(
        output->out, "ply\nformat binary_little_endian 1.0\ncomment libsrnf %s\n", SRNF_VERSION);

    if (status == SRNF_OK) {
        status = mesh_print_description(output, "comment");
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(output->out,
                                   "element vertex %zu\n"
                                   "property double x\nproperty double y\nproperty double z\n",
                                   mesh->n_vertices);
    }
    if (status == SRNF_OK && output->normals) {
        status = mesh_buffer_print(output->out,
                                   "property double nx\nproperty double ny\nproperty double nz\n");
    }
    for (size_t i = 0; i < output->n_fields && status == SRNF_OK; i++) {
        status = mesh_buffer_print(output->out, "property double %s\n", output->fields[i].name);
    }
    if (status == SRNF_OK) {
        status = mesh_buffer_print(output->out,
                                   "element face %zu\nproperty list uchar int vertex_indices\n"
                                   "end_header\n",
                                   mesh->n_faces);
    }
    return status;
}

/* Appends doubles to the room that has been reserved. */
static void put_doubles(struct srnf_buffer *out, const double *values, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        scalar_put_f64_le(out->data + out->size, values[k]);
        out->size += sizeof(double);
    }
}

int mesh_write_ply(const struct mesh_output *output)
{
    const struct srnf_mesh *mesh = output->mesh;
    struct srnf_buffer *out = output->out;
    size_t doubles = (output->normals ? 6u : 3u) + output->n_fields;
    int status = write_header(output);

    if (status == SRNF_OK) {
        status = mesh_buffer_reserve(out, mesh->n_vertices * doubles * sizeof(double) +
                                              mesh->n_faces * FACE_SIZE);
    }
    if (status != SRNF_OK) {
        return status;
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        put_doubles(out, mesh->vertices + 3 * i, 3);
        if (output->normals) {
            put_doubles(out, output->normals + 3 * i, 3);
        }
        for (size_t k = 0; k < output->n_fields; k++) {
            put_doubles(out, &output->fields[k].values[i], 1);
        }
    }
    for (size_t i = 0; i < mesh->n_faces; i++) {
        out->data[out->size] = 3;
        for (size_t k = 0; k < 3; k++) {
            scalar_put_u32_le(out->data + out->size + 1 + 4 * k, mesh->faces[3 * i + k]);
        }
        out->size += FACE_SIZE;
    }
    return SRNF_OK;
}
