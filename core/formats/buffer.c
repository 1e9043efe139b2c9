/*
 * buffer.c - a growing byte buffer with a ceiling, and the text that the writers put into it.
 *
 * Capacity doubles, so appending n bytes costs O(n) in all, and never passes the ceiling.
 */
#include "mesh/mesh_geometry.h"
#include "formats.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define FIRST_CAPACITY ((size_t)256)
#define PRINT_MAX 1024 /* bytes of one piece: a line of a header with a sentence in it */

int mesh_buffer_reserve(struct srnf_buffer *buffer, size_t extra)
{
    size_t max = buffer->max > 0 ? buffer->max : SRNF_BUFFER_MAX;
    size_t capacity = buffer->capacity > 0 ? buffer->capacity : FIRST_CAPACITY;
    unsigned char *grown;

    if (buffer->size > max || extra > max - buffer->size) {
        return SRNF_ELIMIT;
    }
    if (buffer->data && extra <= buffer->capacity - buffer->size) {
        return SRNF_OK;
    }
    while (capacity < buffer->size + extra) {
        capacity = capacity > max / 2 ? max : 2 * capacity;
    }
    capacity = capacity < max ? capacity : max;
    grown = srnf_alloc(capacity, 1);
    if (!grown) {
        return SRNF_ENOMEM;
    }
    if (buffer->data) {
        memcpy(grown, buffer->data, buffer->size);
        srnf_free(buffer->data);
    }
    buffer->data = grown;
    buffer->capacity = capacity;
    return SRNF_OK;
}

int srnf_buffer_append(struct srnf_buffer *buffer, const void *bytes, size_t size)
{
    int status = mesh_buffer_reserve(buffer, size);

    if (status == SRNF_OK && size > 0) {
        memcpy(buffer->data + buffer->size, bytes, size);
        buffer->size += size;
    }
    return status;
}

void srnf_buffer_clear(struct srnf_buffer *buffer)
{
    if (buffer) {
        srnf_free(buffer->data);
        buffer->data = NULL;
        buffer->size = 0;
        buffer->capacity = 0;
    }
}

int mesh_buffer_print(struct srnf_buffer *buffer, const char *format, ...)
{
    char text[PRINT_MAX];
    va_list arguments;
    int size;

    va_start(arguments, format);
    size = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (size < 0 || (size_t)size >= sizeof text) {
        return SRNF_EINVAL;
    }
    return srnf_buffer_append(buffer, text, (size_t)size);
}

/* The only thing that a locale changes in %.17g is the decimal point, which may be several bytes
   there: any run of bytes that is no part of a number stands for it. */
void mesh_number_text(char text[MESH_NUMBER_MAX], double value)
{
    char raw[MESH_NUMBER_MAX];
    size_t n = 0;
    bool in_point = false;

    (void)snprintf(raw, sizeof raw, "%.17g", value);
    for (const char *p = raw; *p; p++) {
        bool is_point = !strchr("0123456789+-e", *p);

        if (!is_point) {
            text[n++] = *p;
        } else if (!in_point) {
            text[n++] = '.';
        }
        in_point = is_point;
    }
    text[n] = '\0';
}

void mesh_face_cross(const struct srnf_mesh *mesh, size_t face, double cross[3])
{
    double u[3], v[3];

    vector_subtract(mesh_corner(mesh, face, 1), mesh_corner(mesh, face, 0), u);
    vector_subtract(mesh_corner(mesh, face, 2), mesh_corner(mesh, face, 0), v);
    vector_cross(u, v, cross);
}

void mesh_unit_vector(const double v[3], const double fallback[3], double unit[3])
{
    double length = hypot(hypot(v[0], v[1]), v[2]);

    for (size_t k = 0; k < 3; k++) {
        unit[k] = isnormal(length) ? v[k] / length : fallback[k];
    }
}
