/*
 * files.h - what both examples need: a mesh file in, a surface out, a surface written as a mesh.
 * The library itself touches no files.
 */
#ifndef FILES_H
#define FILES_H

#include <srnf.h>

#include <stdio.h>
#include <stdlib.h>

#define DEGREE 15 /* of the surfaces: 3 (15 + 1)^2 coefficients each */

/* Ends the program where a call of the library failed. */
static inline void demand(int status, const char *what, const struct srnf_error *error)
{
    if (status < 0) {
        const char *why = error && error->message[0] ? error->message : srnf_strerror(status);

        (void)fprintf(stderr, "%s: %s\n", what, why);
        exit(EXIT_FAILURE);
    }
}

static inline unsigned char *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    unsigned char *bytes = NULL;
    long length = -1;

    if (file && fseek(file, 0, SEEK_END) == 0) {
        length = ftell(file);
        rewind(file);
    }
    if (length > 0) {
        bytes = malloc((size_t)length);
    }
    if (!bytes || fread(bytes, 1, (size_t)length, file) != (size_t)length) {
        perror(path);
        exit(EXIT_FAILURE);
    }
    (void)fclose(file);
    *size = (size_t)length;
    return bytes;
}

/* The mesh in a file as a surface of unit area about its centroid: coefficients[3][(L+1)^2], for
   srnf_free. */
static inline double *encode_file(const char *path)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_error error = {0};
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;
    struct srnf_mesh mesh;
    size_t size;
    unsigned char *bytes = read_file(path, &size);

    demand(srnf_mesh_read(bytes, size, SRNF_MESH_UNKNOWN, NULL, &mesh, NULL, &error), path, &error);
    demand(srnf_mesh_prepare(&mesh, true, &report), path, NULL);
    options.degree = DEGREE;
    demand(srnf_encode(&mesh, &report, &options, NULL, &encoded, &error), path, &error);
    srnf_mesh_clear(&mesh);
    free(bytes);
    return encoded.coefficients;
}

static inline void write_surface(const char *path, const double *coefficients)
{
    struct srnf_mesh mesh;
    struct srnf_buffer ply = {0};
    FILE *file;

    demand(srnf_surface_triangulate(DEGREE, coefficients, 24, &mesh, NULL), path, NULL);
    demand(srnf_mesh_write(&mesh, SRNF_MESH_PLY, NULL, NULL, 0, &ply), path, NULL);
    file = fopen(path, "wb");
    if (!file || fwrite(ply.data, 1, ply.size, file) != ply.size || fclose(file) != 0) {
        perror(path);
        exit(EXIT_FAILURE);
    }
    srnf_buffer_clear(&ply);
    srnf_mesh_clear(&mesh);
}

#endif
