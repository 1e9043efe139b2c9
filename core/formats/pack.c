/*
 * pack.c - base64 and zlib for the formats that use them (see pack.h).
 *
 * All that zlib allocates comes from srnf_alloc. A file that is packed by gzip is unpacked as a
 * whole before it is read: its length is a promise of its last four bytes, believed only as far as
 * zlib's best ratio and the limit of memory allow; several members one after the other, as bgzip
 * and pigz write them, are one file. What comes out is not unpacked again.
 */
#include "pack.h"

#include <limits.h>
#include <string.h>

#define PIECE ((size_t)1 << 16) /* unpacked between two questions whether to go on */
#define FIRST_CAPACITY ((size_t)4096)
#define GZIP_LEAST ((size_t)18) /* bytes of the shortest gzip file */

/* zlib's memory, from srnf_alloc. */
static void *pack_alloc(void *opaque, unsigned count, unsigned size)
{
    (void)opaque;
    return srnf_alloc(count, size);
}

static void pack_free(void *opaque, void *pointer)
{
    (void)opaque;
    srnf_free(pointer);
}

size_t pack_most(size_t size)
{
    return size > SIZE_MAX / PACK_RATIO_MAX ? SIZE_MAX : size * PACK_RATIO_MAX;
}

static uInt piece_of(size_t left)
{
    return (uInt)(left < PIECE ? left : PIECE);
}

int pack_count(struct mesh_reader *reader, size_t bytes)
{
    return srnf_unpack_count(reader->limits.unpack_left, bytes)
               ? mesh_ask(reader)
               : srnf_fail(reader->error, SRNF_ELIMIT, -1,
                           "what is packed in it unpacks to more than there is room for");
}

bool pack_inflate(struct mesh_reader *reader, const unsigned char *bytes, size_t size,
                  unsigned char *out, size_t capacity, int *status)
{
    z_stream stream = {.zalloc = pack_alloc, .zfree = pack_free};
    unsigned char beyond;
    size_t used = 0, filled = 0;
    int result = inflateInit2(&stream, PACK_ANY_HEADER);

    if (result != Z_OK) {
        *status = srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
        return false;
    }
    while (result == Z_OK && *status == SRNF_OK) {
        uInt in = piece_of(size - used), room = piece_of(capacity - filled);

        stream.next_in = bytes + used;
        stream.avail_in = in;
        /* A byte too many shows that there are more than were promised. */
        stream.next_out = room > 0 ? out + filled : &beyond;
        stream.avail_out = room > 0 ? room : 1;
        result = inflate(&stream, Z_NO_FLUSH);
        used += in - stream.avail_in;
        if (room == 0 && stream.avail_out == 0) {
            break;
        }
        filled += room > 0 ? room - stream.avail_out : 0;
        *status = pack_count(reader, room > 0 ? room - stream.avail_out : 0);
    }
    (void)inflateEnd(&stream);
    if (*status == SRNF_OK && result == Z_MEM_ERROR) {
        *status = srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
    }
    return *status == SRNF_OK && result == Z_STREAM_END && filled == capacity;
}

int pack_deflate(struct srnf_buffer *out, const void *bytes, size_t size)
{
    z_stream stream = {.zalloc = pack_alloc, .zfree = pack_free};
    int status = size > UINT_MAX / 2 ? SRNF_ELIMIT : SRNF_OK;

    out->size = 0;
    if (status != SRNF_OK || deflateInit(&stream, Z_DEFAULT_COMPRESSION) != Z_OK) {
        return status != SRNF_OK ? status : SRNF_ENOMEM;
    }
    status = mesh_buffer_reserve(out, deflateBound(&stream, (uLong)size));
    if (status == SRNF_OK) {
        stream.next_in = bytes;
        stream.avail_in = (uInt)size;
        stream.next_out = out->data;
        stream.avail_out = (uInt)(out->capacity < UINT_MAX ? out->capacity : UINT_MAX);
        status = deflate(&stream, Z_FINISH) == Z_STREAM_END ? SRNF_OK : SRNF_ELIMIT;
        out->size = status == SRNF_OK ? (size_t)stream.total_out : 0;
    }
    (void)deflateEnd(&stream);
    return status;
}

/* ---- Base64 ---------------------------------------------------------------------------------- */

static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

int pack_append_base64(struct srnf_buffer *out, const void *bytes, size_t size)
{
    const unsigned char *in = bytes;
    size_t groups = size / 3 + (size % 3 > 0);
    int status = mesh_buffer_reserve(out, 4 * groups);

    for (size_t i = 0; i < groups && status == SRNF_OK; i++) {
        size_t n = size - 3 * i < 3 ? size - 3 * i : 3;
        uint32_t word = 0;

        for (size_t k = 0; k < 3; k++) {
            word = (word << 8) | (k < n ? in[3 * i + k] : 0u);
        }
        for (size_t k = 0; k < 4; k++) {
            out->data[out->size++] =
                k <= n ? (unsigned char)digits[(word >> (18 - 6 * k)) & 63] : '=';
        }
    }
    return status;
}

int base64_value(unsigned char c)
{
    if (c >= 'A' && c <= 'Z') {
        return c - 'A';
    }
    if (c >= 'a' && c <= 'z') {
        return c - 'a' + 26;
    }
    if (c >= '0' && c <= '9') {
        return c - '0' + 52;
    }
    return c == '+' ? 62 : (c == '/' ? 63 : -1);
}

static void skip_space(struct base64 *cursor)
{
    while (cursor->at < cursor->end && scan_is_space(*cursor->at)) {
        cursor->at++;
    }
}

/* Decodes four characters into spare. */
static bool next_group(struct base64 *cursor)
{
    uint32_t word = 0;
    unsigned n = 0, padding = 0;

    for (unsigned k = 0; k < 4; k++) {
        int value;

        skip_space(cursor);
        if (cursor->at == cursor->end) {
            return false;
        }
        value = base64_value(*cursor->at);
        padding += *cursor->at == '=';
        if ((value < 0 && *cursor->at != '=') || (value >= 0 && padding > 0)) {
            return false;
        }
        word = (word << 6) | (uint32_t)(value < 0 ? 0 : value);
        cursor->at++;
    }
    if (padding > 2) {
        return false;
    }
    for (n = 0; n < 3 - padding; n++) {
        cursor->spare[n] = (unsigned char)(word >> (16 - 8 * n));
    }
    cursor->n_spare = n;
    cursor->taken = 0;
    return true;
}

bool base64_take(struct base64 *cursor, unsigned char *out, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        if (cursor->taken == cursor->n_spare && !next_group(cursor)) {
            return false;
        }
        out[i] = cursor->spare[cursor->taken++];
    }
    return true;
}

/* ---- Files packed by gzip -------------------------------------------------------------------- */

bool pack_is_gzip(const unsigned char *bytes, size_t size)
{
    return size >= 3 && bytes[0] == 0x1f && bytes[1] == 0x8b && bytes[2] == 8;
}

static size_t promised(const unsigned char *bytes, size_t size)
{
    int64_t total = 0;

    if (size < GZIP_LEAST) {
        return 0;
    }
    (void)scalar_index(SCALAR_UINT32, bytes + size - 4, false, &total);
    return (size_t)total;
}

size_t pack_peek(const unsigned char *bytes, size_t size, unsigned char *out, size_t capacity,
                 size_t *total)
{
    z_stream stream = {.zalloc = pack_alloc, .zfree = pack_free};
    size_t filled = 0;

    *total = promised(bytes, size);
    if (inflateInit2(&stream, PACK_ANY_HEADER) != Z_OK) {
        return 0;
    }
    stream.next_in = bytes;
    stream.avail_in = (uInt)(size < UINT_MAX ? size : UINT_MAX);
    stream.next_out = out;
    stream.avail_out = (uInt)capacity;
    (void)inflate(&stream, Z_SYNC_FLUSH);
    filled = capacity - stream.avail_out;
    (void)inflateEnd(&stream);
    return filled;
}

/* Room for more of what is unpacked; false with reader->status where there is none. */
static bool grow(struct mesh_reader *reader, size_t filled, size_t hint)
{
    size_t capacity = reader->unpacked_capacity;
    size_t wanted = capacity == 0 ? hint : capacity + capacity / 2;
    size_t left = reader->limits.max_memory - reader->memory;
    unsigned char *grown;

    wanted = wanted < FIRST_CAPACITY ? FIRST_CAPACITY : wanted;
    wanted = wanted > left && left > capacity ? left : wanted;
    grown = mesh_alloc(reader, wanted, 1);
    if (!grown) {
        return false;
    }
    if (filled > 0) {
        memcpy(grown, reader->unpacked, filled);
    }
    mesh_release(reader, reader->unpacked, capacity, 1);
    reader->unpacked = grown;
    reader->unpacked_capacity = wanted;
    return true;
}

static int unpack(struct mesh_reader *reader, z_stream *stream, size_t hint)
{
    size_t used = 0, filled = 0;
    int result = Z_OK, status = SRNF_OK;

    while (status == SRNF_OK) {
        uInt in = piece_of(reader->size - used), room;

        if (filled == reader->unpacked_capacity && !grow(reader, filled, hint)) {
            return reader->status;
        }
        room = piece_of(reader->unpacked_capacity - filled);
        stream->next_in = reader->bytes + used;
        stream->avail_in = in;
        stream->next_out = reader->unpacked + filled;
        stream->avail_out = room;
        result = inflate(stream, Z_NO_FLUSH);
        used += in - stream->avail_in;
        filled += room - stream->avail_out;
        status = pack_count(reader, room - stream->avail_out);
        if (result == Z_STREAM_END && pack_is_gzip(reader->bytes + used, reader->size - used)) {
            result = inflateReset(stream);
        } else if (result != Z_OK) {
            break;
        }
    }
    if (status != SRNF_OK) {
        return status;
    }
    if (result == Z_MEM_ERROR) {
        return srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
    }
    if (result != Z_STREAM_END) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)used,
                         result == Z_BUF_ERROR ? "the gzip file is cut: it ends at byte %zu"
                                               : "the gzip file is damaged at byte %zu",
                         used);
    }
    reader->size = filled;
    reader->bytes = reader->unpacked;
    return SRNF_OK;
}

int pack_open(struct mesh_reader *reader)
{
    z_stream stream = {.zalloc = pack_alloc, .zfree = pack_free};
    size_t hint, most;
    int status;

    if (!pack_is_gzip(reader->bytes, reader->size)) {
        return SRNF_OK;
    }
    /* A byte more than is promised, so that the end of the stream is found without growing. */
    hint = promised(reader->bytes, reader->size);
    most = pack_most(reader->size);
    hint = (hint < most ? hint : most) + 1;
    if (inflateInit2(&stream, PACK_ANY_HEADER) != Z_OK) {
        return srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
    }
    status = unpack(reader, &stream, hint);
    (void)inflateEnd(&stream);
    if (status == SRNF_OK && pack_is_gzip(reader->bytes, reader->size)) {
        status = srnf_fail(reader->error, SRNF_EFORMAT, -1,
                           "this is packed by gzip twice; unpack it once before it is sent");
    }
    return status;
}

void pack_close(struct mesh_reader *reader)
{
    mesh_release(reader, reader->unpacked, reader->unpacked_capacity, 1);
    reader->unpacked = NULL;
}
