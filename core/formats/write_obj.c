/*
 * write_obj.c - Wavefront OBJ: vertices in 17 digits, normals where given, faces from 1. Fields
 * have no place in this format.
 */
#include "formats.h"

static int write_vectors(struct srnf_buffer *out, const char *keyword, const double *vectors,
                         size_t count)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        char text[3][MESH_NUMBER_MAX];

        for (size_t k = 0; k < 3; k++) {
            mesh_number_text(text[k], vectors[3 * i + k]);
        }
        status = mesh_buffer_print(out, "%s %s %s %s\n", keyword, text[0], text[1], text[2]);
    }
    return status;
}

int mesh_write_obj(const struct mesh_output *output)
{
    const struct srnf_mesh *mesh = output->mesh;
    int status = mesh_buffer_print(output->out, "# libsrnf %s\n", SRNF_VERSION);

    if (status == SRNF_OK) {
        status = mesh_print_description(output, "#");
    }
    if (status == SRNF_OK) {
        status = write_vectors(output->out, "v", mesh->vertices, mesh->n_vertices);
    }
    if (status == SRNF_OK && output->normals) {
        status = write_vectors(output->out, "vn", output->normals, mesh->n_vertices);
    }
    for (size_t i = 0; i < mesh->n_faces && status == SRNF_OK; i++) {
        size_t a = (size_t)mesh->faces[3 * i] + 1, b = (size_t)mesh->faces[3 * i + 1] + 1,
               c = (size_t)mesh->faces[3 * i + 2] + 1;

        status = output->normals ? mesh_buffer_print(output->out, "f %zu//%zu %zu//%zu %zu//%zu\n",
                                                     a, a, b, b, c, c)
                                 : mesh_buffer_print(output->out, "f %zu %zu %zu\n", a, b, c);
    }
    return status;
}
