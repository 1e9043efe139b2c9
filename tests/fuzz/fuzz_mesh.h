/*
 * fuzz_mesh.h - what every fuzz target of a mesh reader does with the bytes it is given: reads
 * them, and holds the result against the promises of srnf.h. A mesh that was read is written in
 * every format and read back. The sanitizers see the rest.
 */
#ifndef TESTS_FUZZ_MESH_H
#define TESTS_FUZZ_MESH_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fuzz/fuzz_require.h"
#include "srnf.h"

#define FUZZ_MEMORY_MAX ((size_t)64 << 20)

static inline void fuzz_check_mesh(const struct srnf_mesh *mesh)
{
    fuzz_require(mesh->n_vertices > 0 && mesh->n_faces > 0);
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        fuzz_require(isfinite(mesh->vertices[i]));
    }
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        fuzz_require(mesh->faces[i] < mesh->n_vertices);
    }
}

/* Out and back through one format; false where it cannot be written (numbers too large for a
   float). */
static inline void fuzz_round_trip(const struct srnf_mesh *mesh, enum srnf_mesh_format format)
{
    struct srnf_buffer file = {0};
    struct srnf_mesh again;
    int status = srnf_mesh_write(mesh, format, NULL, NULL, 0, &file);

    fuzz_require(status == SRNF_OK || status == SRNF_EINVAL);
    if (status == SRNF_OK) {
        fuzz_require(srnf_mesh_read(file.data, file.size, SRNF_MESH_UNKNOWN, NULL, &again, NULL,
                                    NULL) == SRNF_OK);
        fuzz_require(again.n_faces == mesh->n_faces);
        srnf_mesh_clear(&again);
    }
    srnf_buffer_clear(&file);
}

static inline int fuzz_mesh(const uint8_t *data, size_t size, enum srnf_mesh_format format)
{
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
    struct srnf_mesh_read_info info;
    struct srnf_error error = {0};
    struct srnf_mesh mesh;
    int status;

    limits.max_memory = FUZZ_MEMORY_MAX;
    (void)srnf_mesh_sniff(data, size);
    status = srnf_mesh_read(data, size, format, &limits, &mesh, &info, &error);
    if (status != SRNF_OK) {
        fuzz_require(status == SRNF_EPARSE || status == SRNF_EFORMAT || status == SRNF_ELIMIT);
        fuzz_require(error.status == status && error.message[0] != '\0');
        fuzz_require(memchr(error.message, '\0', sizeof error.message) != NULL);
        return 0;
    }
    fuzz_require(info.format == format);
    fuzz_check_mesh(&mesh);
    for (int to = SRNF_MESH_PLY; to <= SRNF_MESH_BRAINVISA; to++) {
        fuzz_round_trip(&mesh, (enum srnf_mesh_format)to);
    }
    srnf_mesh_clear(&mesh);
    return 0;
}

#endif
