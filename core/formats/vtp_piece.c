/*
 * vtp_piece.c - the vertices and faces of one piece of a VTP file, whose arrays have been found.
 */
#include "vtp.h"

/* Polygons or strips of a piece; corners and ends are loaded. */
static int add_cells(const struct vtp_file *file, const struct vtp_array *corners,
                     const struct vtp_array *ends, bool strips, size_t base, int64_t n_points)
{
    struct mesh_reader *reader = file->reader;
    int64_t begin = 0, end = 0, index = 0;
    int status = SRNF_OK;

    for (size_t i = 0; i < ends->count && status == SRNF_OK; i++) {
        if (!vtp_array_index(file, ends, i, &end) || end < begin ||
            (uint64_t)end > corners->count) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                             "%s %zu: its offset is below the one before or beyond the "
                             "%zu corners",
                             strips ? "strip" : "face", i, corners->count);
        }
        status = strips ? mesh_step(reader) : mesh_check_corners(reader, i, end - begin);
        for (int64_t k = begin; k < end && status == SRNF_OK; k++) {
            size_t corner = (size_t)(k - begin);

            if (!vtp_array_index(file, corners, (size_t)k, &index) || index < 0 ||
                index >= n_points) {
                status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                                   "%s %zu: an index is not one of the %lld points",
                                   strips ? "strip" : "face", i, (long long)n_points);
            } else {
                status = strips ? mesh_add_strip_corner(reader, i, corner, (int64_t)base + index)
                                : mesh_add_corner(reader, i, corner, (int64_t)base + index);
            }
        }
        begin = end;
    }
    return status;
}

static int load_cells(const struct vtp_file *file, struct vtp_piece *piece, bool strips,
                      size_t base)
{
    struct mesh_reader *reader = file->reader;
    struct vtp_array *corners = &piece->arrays[strips ? VTP_STRIP_CORNERS : VTP_POLY_CORNERS];
    struct vtp_array *ends = corners + 1;
    size_t count = (size_t)(strips ? piece->strips : piece->polys);
    int status = SRNF_OK;

    if (count == 0) {
        return SRNF_OK;
    }
    if (!corners->present || !ends->present) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "a Piece with %zu %s has no connectivity or no offsets", count,
                         strips ? "strips" : "polygons");
    }
    status = vtp_array_load(file, corners, SIZE_MAX);
    if (status == SRNF_OK) {
        status = vtp_array_load(file, ends, count);
    }
    if (status == SRNF_OK && !strips) {
        status = mesh_expect(reader, reader->mesh.n_vertices, reader->mesh.n_faces + count);
    }
    if (status == SRNF_OK) {
        status = add_cells(file, corners, ends, strips, base, piece->points);
    }
    vtp_array_clear(file, corners);
    vtp_array_clear(file, ends);
    return status;
}

int vtp_piece_load(const struct vtp_file *file, struct vtp_piece *piece)
{
    struct mesh_reader *reader = file->reader;
    struct vtp_array *points = &piece->arrays[VTP_POINTS];
    size_t base = reader->mesh.n_vertices, count = (size_t)piece->points, wanted;
    int status = SRNF_OK;

    if (count == 0) {
        return SRNF_OK;
    }
    if (!points->present || __builtin_mul_overflow(count, 3, &wanted)) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "a Piece has no Points");
    }
    if (count > reader->limits.max_vertices - base) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1,
                         "%zu vertices exceed the limit of %zu vertices", base + count,
                         reader->limits.max_vertices);
    }
    status = vtp_array_load(file, points, wanted);
    if (status == SRNF_OK) {
        status = mesh_expect(reader, base + count, reader->mesh.n_faces);
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        double position[3];

        for (size_t k = 0; k < 3; k++) {
            position[k] = vtp_array_number(file, points, 3 * i + k);
        }
        status = mesh_add_vertex(reader, position);
    }
    vtp_array_clear(file, points);
    if (status == SRNF_OK) {
        status = load_cells(file, piece, false, base);
    }
    return status == SRNF_OK ? load_cells(file, piece, true, base) : status;
}
