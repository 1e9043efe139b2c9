/*
 * reader.c - the half of reading that all formats share (see formats.h): memory within the
 * limits, promises held against the bytes that are there, vertices, polygons and strips.
 *
 * Polygons are laid down as the fan around their first corner: corners c0 c1 c2 c3 give c0 c1 c2
 * and c0 c2 c3. Corners arrive one by one and only two are remembered; polygon.c notes where the
 * fan of more than three corners begins, and cuts it anew at the end where it is concave. Arrays
 * grow by half, at most to what the limits allow; time is linear in what is added.
 */
#include "formats.h"
#include "polygon.h"

#include <math.h>
#include <string.h>

#define FIRST_CAPACITY 64
/* Vertices whose indices fit the faces of struct srnf_mesh. */
#define VERTICES_MAX ((size_t)UINT32_MAX)

void *mesh_alloc(struct mesh_reader *reader, size_t count, size_t size)
{
    size_t bytes, left = reader->limits.max_memory - reader->memory;
    void *pointer;

    if (__builtin_mul_overflow(count, size, &bytes) || bytes > left) {
        reader->status = srnf_fail(reader->error, SRNF_ELIMIT, -1,
                                   "reading needs more memory than the limit of %zu bytes",
                                   reader->limits.max_memory);
        return NULL;
    }
    pointer = srnf_alloc(count, size);
    if (!pointer) {
        reader->status =
            srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory for %zu bytes", bytes);
        return NULL;
    }
    reader->memory += bytes;
    return pointer;
}

void mesh_release(struct mesh_reader *reader, void *pointer, size_t count, size_t size)
{
    if (pointer) {
        reader->memory -= count * size;
        srnf_free(pointer);
    }
}

int mesh_ask(struct mesh_reader *reader)
{
    reader->canceled = reader->canceled || srnf_is_canceled(reader->limits.context);
    return reader->canceled
               ? srnf_fail(reader->error, SRNF_ECANCELED, -1, "reading was told to stop")
               : SRNF_OK;
}

int mesh_step(struct mesh_reader *reader)
{
    return reader->canceled || ++reader->steps % SRNF_ITEMS_ASKED == 0 ? mesh_ask(reader) : SRNF_OK;
}

int mesh_promise(struct mesh_reader *reader, const char *what, int64_t count, size_t least,
                 size_t left)
{
    if (count < 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "the header promises %lld %s",
                         (long long)count, what);
    }
    if ((uint64_t)count > left / least) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)(left / least),
                         "the header promises %lld %s, but the file has bytes for %zu at most",
                         (long long)count, what, left / least);
    }
    return SRNF_OK;
}

/* Moves an array into a larger one. Returns NULL, with the old one untouched, when that fails. */
static void *regrow(struct mesh_reader *reader, void *old, size_t used, size_t old_capacity,
                    size_t capacity, size_t size)
{
    void *grown = mesh_alloc(reader, capacity, size);

    if (grown && old) {
        memcpy(grown, old, used * size);
        mesh_release(reader, old, old_capacity, size);
    }
    return grown;
}

/* Half as much again, but not above the limit: one element at least is missing below it. */
static size_t next_capacity(size_t capacity, size_t limit)
{
    size_t next = capacity < FIRST_CAPACITY ? FIRST_CAPACITY : capacity + capacity / 2;

    return next < limit ? next : limit;
}

/* The first promise is taken at its word; further parts of a file must not each copy all before. */
static size_t promised_capacity(size_t capacity, size_t promised, size_t limit)
{
    size_t more = capacity > 0 ? next_capacity(capacity, limit) : promised;

    return more > promised ? more : promised;
}

static int set_vertex_capacity(struct mesh_reader *reader, size_t capacity)
{
    double *grown = regrow(reader, reader->mesh.vertices, reader->mesh.n_vertices,
                           reader->vertex_capacity, capacity, 3 * sizeof(double));

    if (!grown) {
        return reader->status;
    }
    reader->mesh.vertices = grown;
    reader->vertex_capacity = capacity;
    return SRNF_OK;
}

static int set_face_capacity(struct mesh_reader *reader, size_t capacity)
{
    uint32_t *grown = regrow(reader, reader->mesh.faces, reader->mesh.n_faces,
                             reader->face_capacity, capacity, 3 * sizeof(uint32_t));

    if (!grown) {
        return reader->status;
    }
    reader->mesh.faces = grown;
    reader->face_capacity = capacity;
    return SRNF_OK;
}

static size_t vertex_limit(const struct mesh_reader *reader)
{
    return reader->limits.max_vertices < VERTICES_MAX ? reader->limits.max_vertices : VERTICES_MAX;
}

int mesh_expect(struct mesh_reader *reader, size_t n_vertices, size_t n_faces)
{
    int status = SRNF_OK;

    if (n_vertices > vertex_limit(reader)) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1,
                         "%zu vertices exceed the limit of %zu vertices", n_vertices,
                         vertex_limit(reader));
    }
    if (n_faces > reader->limits.max_faces) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1, "%zu faces exceed the limit of %zu faces",
                         n_faces, reader->limits.max_faces);
    }
    reader->vertex_total = n_vertices;
    if (n_vertices > reader->vertex_capacity) {
        status = set_vertex_capacity(
            reader, promised_capacity(reader->vertex_capacity, n_vertices, vertex_limit(reader)));
    }
    if (status == SRNF_OK && n_faces > reader->face_capacity) {
        status = set_face_capacity(
            reader, promised_capacity(reader->face_capacity, n_faces, reader->limits.max_faces));
    }
    return status;
}

int mesh_add_vertex(struct mesh_reader *reader, const double position[3])
{
    size_t index = reader->mesh.n_vertices;

    for (size_t k = 0; k < 3; k++) {
        if (!isfinite(position[k])) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)index,
                             "vertex %zu: coordinate %c is not finite", index, "xyz"[k]);
        }
    }
    if (index == reader->vertex_capacity) {
        int status;

        if (index >= vertex_limit(reader)) {
            return srnf_fail(reader->error, SRNF_ELIMIT, (int64_t)index,
                             "the vertices exceed the limit of %zu vertices", vertex_limit(reader));
        }
        status = set_vertex_capacity(reader, next_capacity(index, vertex_limit(reader)));
        if (status != SRNF_OK) {
            return status;
        }
    }
    memcpy(reader->mesh.vertices + 3 * index, position, 3 * sizeof(double));
    reader->mesh.n_vertices++;
    return mesh_step(reader);
}

static int add_triangle(struct mesh_reader *reader, uint32_t a, uint32_t b, uint32_t c)
{
    size_t index = reader->mesh.n_faces;
    uint32_t *corners;

    if (index == reader->face_capacity) {
        int status;

        if (index >= reader->limits.max_faces) {
            return srnf_fail(reader->error, SRNF_ELIMIT, (int64_t)index,
                             "the triangles exceed the limit of %zu faces",
                             reader->limits.max_faces);
        }
        status = set_face_capacity(reader, next_capacity(index, reader->limits.max_faces));
        if (status != SRNF_OK) {
            return status;
        }
    }
    corners = reader->mesh.faces + 3 * index;
    corners[0] = a;
    corners[1] = b;
    corners[2] = c;
    reader->mesh.n_faces++;
    return SRNF_OK;
}

static int check_index(struct mesh_reader *reader, const char *what, size_t element, int64_t index)
{
    if (index < 0 || (uint64_t)index >= reader->vertex_total) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)element,
                         index < 0 ? "%s %zu: index %lld is negative"
                                   : "%s %zu: index %lld is not below the %zu vertices",
                         what, element, (long long)index, reader->vertex_total);
    }
    return SRNF_OK;
}

int mesh_check_corners(struct mesh_reader *reader, size_t face, int64_t corners)
{
    if (corners < 3) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)face,
                         "face %zu: %lld corners are no polygon", face, (long long)corners);
    }
    return SRNF_OK;
}

int mesh_add_corner(struct mesh_reader *reader, size_t face, size_t corner, int64_t index)
{
    int status = check_index(reader, "face", face, index);

    if (status != SRNF_OK) {
        return status;
    }
    if (corner == 0) {
        reader->first = (uint32_t)index;
    }
    if (corner >= 2) {
        status = add_triangle(reader, reader->first, reader->previous, (uint32_t)index);
    }
    reader->info.polygons_triangulated += corner == 3;
    if (status == SRNF_OK && corner >= 3) {
        status = mesh_note_polygon(reader, corner + 1);
    }
    reader->previous = (uint32_t)index;
    return status == SRNF_OK ? mesh_step(reader) : status;
}

int mesh_add_strip_corner(struct mesh_reader *reader, size_t strip, size_t corner, int64_t index)
{
    int status = check_index(reader, "strip", strip, index);
    uint32_t a = reader->first, b = reader->previous, c = (uint32_t)index;

    if (status != SRNF_OK) {
        return status;
    }
    if (corner >= 2 && a != b && b != c && c != a) {
        status = corner % 2 == 0 ? add_triangle(reader, a, b, c) : add_triangle(reader, b, a, c);
    }
    reader->first = b;
    reader->previous = c;
    return status == SRNF_OK ? mesh_step(reader) : status;
}

int mesh_truncated(struct mesh_reader *reader, const char *what, size_t index, size_t count)
{
    return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)index, "the file ends in %s %zu of %zu",
                     what, index, count);
}

int mesh_no_more(struct mesh_reader *reader, const unsigned char *at)
{
    const unsigned char *end = reader->bytes + reader->size;

    for (const unsigned char *p = at; p < end; p++) {
        if (!scan_is_space(*p)) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)(p - reader->bytes),
                             "byte %zu: something follows behind the last element",
                             (size_t)(p - reader->bytes));
        }
    }
    return SRNF_OK;
}
