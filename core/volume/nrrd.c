/*
 * nrrd.c - NRRD with an attached header.
 *
 * G. Kindlmann, "Definition of NRRD file format" (teem.sourceforge.net/nrrd/format.html): lines
 * "field: value" up to an empty one, then the voxels, raw, gzip or as text. space says what the
 * axes of space directions and space origin mean; LPS and LAS are turned into RAS. Names of labels
 * are those that 3D Slicer writes into its segmentations (SegmentN_LabelValue, SegmentN_Name).
 */
#include "nrrd.h"

#include <math.h>
#include <string.h>

bool volume_is_nrrd(const unsigned char *head, size_t size)
{
    return size >= 8 && memcmp(head, "NRRD000", 7) == 0;
}

/* ---- The header ------------------------------------------------------------------------------ */

/* The header's text up to its empty line, which is passed. */
static int read_text(struct volume_reader *reader, struct nrrd_header *header)
{
    bool line_empty = false;
    int byte, status;

    do {
        status = volume_source_byte(reader, &byte);
        if (status != SRNF_OK) {
            return status;
        }
        if (byte < 0 || header->size == NRRD_HEADER_MAX) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)header->size,
                             "the header has no empty line at its end: no voxels follow it");
        }
        if (byte == '\n' && line_empty) {
            return SRNF_OK;
        }
        line_empty = byte == '\n' || (byte == '\r' && line_empty);
        header->text[header->size++] = (char)byte;
    } while (true);
}

static int read_header(struct volume_reader *reader, struct nrrd_header *header)
{
    struct scan lines;
    struct token line;
    int status = read_text(reader, header);

    lines = (struct scan){.at = (const unsigned char *)header->text,
                          .end = (const unsigned char *)header->text + header->size};
    while (status == SRNF_OK && scan_line(&lines, &line)) {
        status = nrrd_read_field(reader, header, line);
        nrrd_read_name(reader, line);
    }
    if (status == SRNF_OK &&
        (reader->type == SCALAR_NONE || header->n_axes == 0 || header->encoding == ENCODING_NONE)) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "the header has no %s",
                         reader->type == SCALAR_NONE ? "type"
                         : header->n_axes == 0       ? "sizes"
                                                     : "encoding");
    }
    if (status == SRNF_OK && header->dimension > 0 &&
        header->dimension != (int64_t)header->n_axes) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "the dimension is %lld, and there are sizes of %zu axes",
                         (long long)header->dimension, header->n_axes);
    }
    if (status == SRNF_OK && header->has_mins && !header->has_origin) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "the field \"axis mins\" is not read: say where the voxels are by \"space "
                         "directions\" and \"space origin\"");
    }
    return status;
}

/* The three axes of space; another one has to be of size 1. */
static int place_axes(struct volume_reader *reader, const struct nrrd_header *header,
                      int64_t sizes[3])
{
    double affine[12] = {0};
    double sign[3] = {1.0, 1.0, 1.0};
    size_t n = 0;

    if (reader->volume.space == SRNF_SPACE_LPS || reader->volume.space == SRNF_SPACE_LAS) {
        sign[0] = -1.0;
        sign[1] = reader->volume.space == SRNF_SPACE_LPS ? -1.0 : 1.0;
    }
    for (size_t axis = 0; axis < header->n_axes; axis++) {
        bool spare = header->has_directions ? !header->spatial[axis] : n == 3;

        if (spare ? header->sizes[axis] != 1 : n == 3) {
            return srnf_fail(reader->error, SRNF_EPARSE, -1,
                             "axis %zu of %lld is none of the three of space: the file has several "
                             "volumes or layers; send one of them, without overlaps",
                             axis, (long long)header->sizes[axis]);
        }
        if (spare) {
            continue;
        }
        sizes[n] = header->sizes[axis];
        for (size_t row = 0; row < 3; row++) {
            affine[4 * row + n] = header->has_directions
                                      ? sign[row] * header->directions[axis][row]
                                      : (row == n ? sign[row] * header->spacings[axis] : 0.0);
            affine[4 * row + 3] = sign[row] * header->origin[row];
        }
        n++;
    }
    for (; n < 3; n++) {
        sizes[n] = 1;
        affine[5 * n] = 1.0;
    }
    return volume_place(reader, affine, header->unit);
}

/* ---- The voxels ------------------------------------------------------------------------------ */

static int read_text_voxels(struct volume_reader *reader)
{
    unsigned char word[SCAN_NUMBER_MAX + 1];
    size_t n = 0, asked = 0;
    int byte, status = SRNF_OK;

    while (status == SRNF_OK && reader->filled < reader->n_voxels) {
        status = volume_source_byte(reader, &byte);
        if (status != SRNF_OK || srnf_asks(reader->limits.context, asked++)) {
            return status != SRNF_OK ? status : SRNF_ECANCELED;
        }
        if (byte > ' ' && byte != ',' && n < sizeof word) {
            word[n++] = (unsigned char)byte;
        } else if (n > 0) {
            struct token token = {word, n};
            double value;

            if (!token_number(token, reader->locale, &value)) {
                return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->filled,
                                 "voxel %zu, \"%s\", is no number", reader->filled,
                                 token_quote(token).text);
            }
            status = volume_add_voxel(reader, value);
            n = 0;
        }
        if (byte < 0 && status == SRNF_OK && reader->filled < reader->n_voxels) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->filled,
                             "the file ends after voxel %zu of %zu", reader->filled,
                             reader->n_voxels);
        }
    }
    return status;
}

static int skip_lines(struct volume_reader *reader, int64_t lines)
{
    int byte = 0, status = SRNF_OK;

    while (status == SRNF_OK && lines > 0 && byte >= 0) {
        status = volume_source_byte(reader, &byte);
        lines -= byte == '\n';
    }
    return status;
}

/* The source of the packed voxels behind a header that is not packed. */
static int unpack_rest(struct volume_reader *reader)
{
    struct volume_source *source = &reader->source;
    const unsigned char *rest = source->at - (source->n_kept - source->kept_at);

    if (source->packed) {
        return srnf_fail(
            reader->error, SRNF_EPARSE, -1,
            "the voxels are packed twice, by gzip within gzip; send the file unpacked");
    }
    if (source->end - rest < 2 || rest[0] != 0x1f || rest[1] != 0x8b) {
        return srnf_fail(reader->error, SRNF_EPARSE, rest - reader->bytes,
                         "the encoding is gzip, and no gzip data follow the header");
    }
    return volume_source_open(reader, rest, (size_t)(source->end - rest));
}

static int read_data(struct volume_reader *reader, const struct nrrd_header *header,
                     const int64_t sizes[3])
{
    bool text = header->encoding == ENCODING_ASCII;
    size_t size = scalar_size(reader->type);
    int status = skip_lines(reader, header->line_skip);

    if (status == SRNF_OK && header->encoding == ENCODING_GZIP) {
        status = unpack_rest(reader);
    }
    if (status == SRNF_OK && header->byte_skip == -1) {
        return srnf_fail(
            reader->error, SRNF_EPARSE, -1,
            "byte skip -1 is not read; save the file with its voxels behind the header");
    }
    if (status == SRNF_OK) {
        status = volume_source_skip(reader, (uint64_t)header->byte_skip);
    }
    if (status == SRNF_OK && !text && size > 1 && !header->has_endian) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "the header has no endian");
    }
    if (status == SRNF_OK) {
        status = volume_expect(reader, sizes, text ? 1 : size);
    }
    if (status == SRNF_OK) {
        status = text ? read_text_voxels(reader) : volume_read_voxels(reader);
    }
    return status;
}

int volume_read_nrrd(struct volume_reader *reader)
{
    struct nrrd_header header = {.unit = 1.0, .spacings = {1.0, 1.0, 1.0, 1.0}};
    int64_t sizes[3] = {1, 1, 1};
    int status;

    header.text = srnf_alloc(NRRD_HEADER_MAX, 1);
    reader->names = srnf_alloc(NRRD_NAMES_MAX, sizeof *reader->names);
    reader->n_names = reader->names ? NRRD_NAMES_MAX : 0;
    if (!header.text || !reader->names) {
        srnf_free(header.text);
        return srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory for the header");
    }
    status = read_header(reader, &header);
    status = status == SRNF_OK ? place_axes(reader, &header, sizes) : status;
    status = status == SRNF_OK ? read_data(reader, &header, sizes) : status;
    srnf_free(header.text);
    return status;
}
