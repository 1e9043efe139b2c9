/*
 * write_stl.c - binary STL: per triangle its normal and its corners in single precision. Vertex
 * normals and fields have no place in this format. The header must not begin with "solid", which
 * means text.
 */
#include "formats.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define HEADER_SIZE ((size_t)80)
#define RECORD_SIZE ((size_t)50)

int mesh_write_stl(const struct mesh_output *output)
{
    const struct srnf_mesh *mesh = output->mesh;
    struct srnf_buffer *out = output->out;
    char header[HEADER_SIZE + 1] = "binary STL by libsrnf " SRNF_VERSION;
    const char *space = output->description.space;
    static const double none[3] = {0, 0, 0};
    unsigned char count[4];
    int status;

    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        if (fabs(mesh->vertices[i]) > (double)FLT_MAX) {
            return SRNF_EINVAL;
        }
    }
    if (space) {
        (void)snprintf(header, sizeof header, "binary STL by libsrnf %s, space: %s", SRNF_VERSION,
                       space);
    }
    scalar_put_u32_le(count, (uint32_t)mesh->n_faces);
    status = mesh_buffer_reserve(out, HEADER_SIZE + sizeof count + RECORD_SIZE * mesh->n_faces);
    if (status == SRNF_OK) {
        status = srnf_buffer_append(out, header, HEADER_SIZE);
    }
    if (status == SRNF_OK) {
        status = srnf_buffer_append(out, count, sizeof count);
    }
    for (size_t i = 0; i < mesh->n_faces && status == SRNF_OK; i++) {
        unsigned char record[RECORD_SIZE] = {0};
        double normal[3];

        mesh_face_cross(mesh, i, normal);
        mesh_unit_vector(normal, none, normal);
        for (size_t d = 0; d < 3; d++) {
            scalar_put_f32_le(record + 4 * d, (float)normal[d]);
        }
        for (size_t k = 0; k < 3; k++) {
            const double *corner = mesh->vertices + 3 * (size_t)mesh->faces[3 * i + k];

            for (size_t d = 0; d < 3; d++) {
                scalar_put_f32_le(record + 12 * (k + 1) + 4 * d, (float)corner[d]);
            }
        }
        status = srnf_buffer_append(out, record, RECORD_SIZE);
    }
    return status;
}
