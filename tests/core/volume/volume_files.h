/*
 * volume_files.h - NIfTI files that tests write, byte by byte, with every member of the header
 * where the standard says.
 */
#ifndef TESTS_VOLUME_FILES_H
#define TESTS_VOLUME_FILES_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <zlib.h>

enum {
    NIFTI_UINT8 = 2,
    NIFTI_INT16 = 4,
    NIFTI_INT32 = 8,
    NIFTI_FLOAT = 16,
    NIFTI_DOUBLE = 64,
    NIFTI_INT8 = 256,
    NIFTI_UINT16 = 512,
    NIFTI_UINT32 = 768,
    NIFTI_INT64 = 1024,
    NIFTI_UINT64 = 1280,
};

/* Copies a value in the byte order asked for; the machine is little-endian, as all that build. */
static inline void file_put(unsigned char *at, const void *value, size_t size, bool big)
{
    const unsigned char *bytes = value;

    for (size_t b = 0; b < size; b++) {
        at[b] = bytes[big ? size - 1 - b : b];
    }
}

static inline void file_put_real(unsigned char *header, size_t at, size_t i, double value, bool big)
{
    float single = (float)value;
    bool second = header[0] == 0x1c || header[3] == 0x1c; /* 540 = 0x21c */

    if (second) {
        file_put(header + at + 8 * i, &value, 8, big);
    } else {
        file_put(header + at + 4 * i, &single, 4, big);
    }
}

static inline int16_t nifti_bits(int datatype)
{
    switch (datatype) {
    case NIFTI_UINT8:
    case NIFTI_INT8:
        return 8;
    case NIFTI_INT16:
    case NIFTI_UINT16:
        return 16;
    case NIFTI_INT32:
    case NIFTI_UINT32:
    case NIFTI_FLOAT:
        return 32;
    default:
        return 64;
    }
}

/* A file of version 1 or 2 of these voxels, which have the byte order already: 1 mm, no transform.
   Returns its size. */
static inline size_t nifti_make(unsigned char *file, int version, bool big, int datatype,
                                const int64_t shape[3], const void *voxels, size_t size)
{
    const int32_t header_size = version == 1 ? 348 : 540;
    const size_t offset = version == 1 ? 352 : 544;
    const int16_t type = (int16_t)datatype, bits = nifti_bits(datatype);

    memset(file, 0, offset);
    file_put(file, &header_size, 4, big);
    for (size_t k = 0; k < 4; k++) {
        int64_t wide = k == 0 ? 3 : shape[k - 1];
        int16_t narrow = (int16_t)wide;

        if (version == 1) {
            file_put(file + 40 + 2 * k, &narrow, 2, big);
        } else {
            file_put(file + 16 + 8 * k, &wide, 8, big);
        }
        file_put_real(file, version == 1 ? 76 : 104, k, 1.0, big);
    }
    file_put(file + (version == 1 ? 70 : 12), &type, 2, big);
    file_put(file + (version == 1 ? 72 : 14), &bits, 2, big);
    if (version == 1) {
        float at = (float)offset;

        file_put(file + 108, &at, 4, big);
        memcpy(file + 344, "n+1", 4);
    } else {
        int64_t at = (int64_t)offset;

        file_put(file + 168, &at, 8, big);
        memcpy(file + 4, "n+2\0\r\n\032\n", 8);
    }
    memcpy(file + offset, voxels, size);
    return offset + size;
}

/* The same, by gzip; 0 where it does not fit. */
static inline size_t file_pack(unsigned char *packed, size_t room, const void *bytes, size_t size)
{
    z_stream stream = {.next_in = (unsigned char *)(uintptr_t)bytes, .avail_in = (unsigned)size};
    size_t done;

    if (deflateInit2(&stream, 6, Z_DEFLATED, 31, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
        return 0;
    }
    stream.next_out = packed;
    stream.avail_out = (unsigned)room;
    done = deflate(&stream, Z_FINISH) == Z_STREAM_END ? room - stream.avail_out : 0;
    (void)deflateEnd(&stream);
    return done;
}

#endif
