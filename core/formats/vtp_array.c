/*
 * vtp_array.c - the data arrays of a VTP file (see vtp.h).
 *
 *     ascii       words
 *     binary      base64 of [bytes][data], or, packed, of
 *                 [blocks][bytes of a block][bytes of a last, shorter one or 0][packed bytes of
 *                   each]
 *                 and then of the packed blocks
 *     appended    the same, at an offset behind the underscore of AppendedData, as base64 or raw
 *
 * Words of headers have four or eight bytes, and the byte order of the file. Source: VTK's wiki,
 * "VTK XML Formats". Each promise is held against the bytes that are left before anything is
 * allocated: a packed array against zlib's best ratio. In base64 the header may be padded on its
 * own or not; both are read.
 */
#include "pack.h"
#include "vtp.h"

#include <string.h>

enum vtp_encoding vtp_encoding_named(const char *format)
{
    static const char *const names[] = {"", "ascii", "binary", "appended"};

    for (int i = VTP_ASCII; i <= VTP_APPENDED; i++) {
        if (format && strcmp(format, names[i]) == 0) {
            return (enum vtp_encoding)i;
        }
    }
    return VTP_NONE;
}

/* Bytes one after the other, raw or from base64. */
struct stream {
    bool raw;
    const unsigned char *at, *end; /* raw */
    struct base64 text;
};

static bool take(struct stream *stream, unsigned char *out, size_t size)
{
    if (!stream->raw) {
        return base64_take(&stream->text, out, size);
    }
    if (size > (size_t)(stream->end - stream->at)) {
        return false;
    }
    memcpy(out, stream->at, size);
    stream->at += size;
    return true;
}

/* Bytes that may still come. */
static size_t most_left(const struct stream *stream)
{
    return stream->raw ? (size_t)(stream->end - stream->at)
                       : (size_t)(stream->text.end - stream->text.at) / 4 * 3 + 3;
}

static bool take_word(const struct vtp_file *file, struct stream *stream, size_t *word)
{
    unsigned char bytes[8];
    int64_t value = 0;

    if (!take(stream, bytes, file->header)) {
        return false;
    }
    (void)scalar_index(file->header == 4 ? SCALAR_UINT32 : SCALAR_UINT64, bytes, file->big_endian,
                       &value);
    *word = (size_t)value;
    return true;
}

static int fail(const struct vtp_file *file, const struct vtp_array *array, const char *what)
{
    return srnf_fail(file->reader->error, SRNF_EPARSE, -1, "DataArray of %s: %s", array->what,
                     what);
}

static int open_stream(const struct vtp_file *file, const struct vtp_array *array,
                       struct stream *stream)
{
    const unsigned char *end = file->reader->bytes + file->reader->size;

    *stream = (struct stream){.raw = false};
    if (array->encoding == VTP_BINARY) {
        stream->text.at = array->text;
        stream->text.end = array->text_end;
        return SRNF_OK;
    }
    if (!file->appended || array->offset < 0 || array->offset > end - file->appended) {
        return fail(file, array, "its offset is not within the appended data");
    }
    stream->raw = file->raw;
    stream->at = stream->text.at = file->appended + array->offset;
    stream->end = stream->text.end = end;
    return SRNF_OK;
}

/* Room for `bytes` bytes of numbers, of which the file can hold `most`. */
static int make_room(const struct vtp_file *file, struct vtp_array *array, size_t bytes,
                     size_t most, size_t wanted)
{
    size_t size = scalar_size(array->stored);

    if (bytes > most) {
        return srnf_fail(
            file->reader->error, SRNF_EPARSE, -1,
            "DataArray of %s: it promises %zu bytes, but the file can hold %zu at most",
            array->what, bytes, most);
    }
    if (bytes % size != 0 || (wanted != SIZE_MAX && bytes / size != wanted)) {
        return srnf_fail(file->reader->error, SRNF_EPARSE, -1,
                         "DataArray of %s: it has %zu numbers where there should be %zu",
                         array->what, bytes / size, wanted == SIZE_MAX ? bytes / size + 1 : wanted);
    }
    array->count = bytes / size;
    array->bytes = bytes;
    array->data = mesh_alloc(file->reader, bytes > 0 ? bytes : 1, 1);
    return array->data ? SRNF_OK : file->reader->status;
}

static int load_plain(const struct vtp_file *file, struct vtp_array *array, struct stream *stream,
                      size_t wanted)
{
    size_t bytes = 0;
    int status;

    if (!take_word(file, stream, &bytes)) {
        return fail(file, array, "its header is missing or no base64");
    }
    status = make_room(file, array, bytes, most_left(stream), wanted);
    for (size_t at = 0; at < array->bytes && status == SRNF_OK;) {
        size_t piece = array->bytes - at < SRNF_ITEMS_ASKED ? array->bytes - at : SRNF_ITEMS_ASKED;

        if (!take(stream, array->data + at, piece)) {
            return fail(file, array, "its data end early or are no base64");
        }
        at += piece;
        status = mesh_ask(file->reader);
    }
    return status;
}

/* Blocks of a packed array, and what they unpack to. */
struct blocks {
    size_t count, size, last;
    size_t *packed; /* bytes of each, by mesh_alloc */
};

static int take_blocks(const struct vtp_file *file, struct vtp_array *array, struct stream *stream,
                       struct blocks *blocks)
{
    int status = SRNF_OK;

    if (!take_word(file, stream, &blocks->count)) {
        return fail(file, array, "its header is missing or no base64");
    }
    if (blocks->count == 0) {
        return SRNF_OK;
    }
    if (!take_word(file, stream, &blocks->size) || !take_word(file, stream, &blocks->last) ||
        blocks->count > most_left(stream) / file->header || blocks->last > blocks->size) {
        return fail(file, array, "its header of blocks is cut or wrong");
    }
    blocks->packed = mesh_alloc(file->reader, blocks->count, sizeof *blocks->packed);
    if (!blocks->packed) {
        return file->reader->status;
    }
    for (size_t i = 0; i < blocks->count && status == SRNF_OK; i++) {
        if (!take_word(file, stream, &blocks->packed[i])) {
            return fail(file, array, "its header of blocks is cut");
        }
        status = mesh_step(file->reader);
    }
    return status;
}

static int unpack_block(const struct vtp_file *file, const struct vtp_array *array,
                        struct stream *stream, size_t packed, unsigned char *out, size_t size)
{
    struct mesh_reader *reader = file->reader;
    unsigned char *bytes;
    bool done = false;
    int status = SRNF_OK;

    if (packed > most_left(stream)) {
        return fail(file, array, "a block is cut");
    }
    bytes = mesh_alloc(reader, packed > 0 ? packed : 1, 1);
    if (!bytes) {
        return reader->status;
    }
    if (take(stream, bytes, packed)) {
        done = pack_inflate(reader, bytes, packed, out, size, &status);
    }
    mesh_release(reader, bytes, packed > 0 ? packed : 1, 1);
    return status == SRNF_OK && !done ? fail(file, array, "a packed block is damaged") : status;
}

static int load_packed(const struct vtp_file *file, struct vtp_array *array, struct stream *stream,
                       size_t wanted)
{
    struct blocks blocks = {.count = 0};
    size_t total = 0, last, at = 0;
    int status = take_blocks(file, array, stream, &blocks);

    last = blocks.last > 0 ? blocks.last : blocks.size;
    if (status == SRNF_OK && blocks.count > 0 &&
        (__builtin_mul_overflow(blocks.count - 1, blocks.size, &total) ||
         __builtin_add_overflow(total, last, &total))) {
        total = SIZE_MAX;
    }
    if (status == SRNF_OK) {
        status = make_room(file, array, total, pack_most(most_left(stream)), wanted);
    }
    for (size_t i = 0; i < blocks.count && status == SRNF_OK; i++) {
        size_t size = i + 1 == blocks.count ? last : blocks.size;

        status = unpack_block(file, array, stream, blocks.packed[i], array->data + at, size);
        at += size;
    }
    mesh_release(file->reader, blocks.packed, blocks.count, sizeof *blocks.packed);
    return status;
}

/* Numbers as words: counted first, then kept as doubles. */
static int load_text(const struct vtp_file *file, struct vtp_array *array, size_t wanted)
{
    struct mesh_reader *reader = file->reader;
    size_t size = (size_t)(array->text_end - array->text), count = 0;
    struct scan scan;
    struct token word;
    int status = SRNF_OK;

    array->stored = SCALAR_FLOAT64;
    scan_begin(&scan, array->text, size);
    while (status == SRNF_OK && scan_word(&scan, &word)) {
        count++;
        status = mesh_step(reader);
    }
    if (status == SRNF_OK) {
        status = make_room(file, array, count * sizeof(double), SIZE_MAX, wanted);
    }
    scan_begin(&scan, array->text, size);
    for (size_t i = 0; i < array->count && status == SRNF_OK && scan_word(&scan, &word); i++) {
        double value;

        if (!token_number(word, reader->locale, &value)) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                             "DataArray of %s, number %zu: '%s' is not a number", array->what, i,
                             token_quote(word).text);
        }
        memcpy(array->data + i * sizeof value, &value, sizeof value);
        status = mesh_step(reader);
    }
    return status;
}

int vtp_array_load(const struct vtp_file *file, struct vtp_array *array, size_t wanted)
{
    struct stream stream;
    int status;

    array->stored = array->type;
    if (array->encoding == VTP_ASCII) {
        return load_text(file, array, wanted);
    }
    status = open_stream(file, array, &stream);
    if (status != SRNF_OK) {
        return status;
    }
    return file->zip ? load_packed(file, array, &stream, wanted)
                     : load_plain(file, array, &stream, wanted);
}

void vtp_array_clear(const struct vtp_file *file, struct vtp_array *array)
{
    mesh_release(file->reader, array->data, array->bytes > 0 ? array->bytes : 1, 1);
    array->data = NULL;
}

/* Text has become doubles of this machine. */
double vtp_array_number(const struct vtp_file *file, const struct vtp_array *array, size_t index)
{
    const unsigned char *at = array->data + index * scalar_size(array->stored);
    double value;

    if (array->encoding != VTP_ASCII) {
        return scalar_value(array->stored, at, file->big_endian);
    }
    memcpy(&value, at, sizeof value);
    return value;
}

bool vtp_array_index(const struct vtp_file *file, const struct vtp_array *array, size_t index,
                     int64_t *value)
{
    if (array->encoding == VTP_ASCII) {
        return scalar_whole(vtp_array_number(file, array, index), value);
    }
    return scalar_index(array->stored, array->data + index * scalar_size(array->stored),
                        file->big_endian, value);
}
