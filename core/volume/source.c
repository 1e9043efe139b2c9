/*
 * source.c - the bytes of a file of a volume, unpacked as they are read where they are gzip.
 *
 * zlib's memory, some 40 KiB, is charged like all of the library's. What packed bytes unpack to is
 * never held: a file that promises little and unpacks to much is refused at the first bytes beyond.
 * A file of several gzip members, as parallel packers write it, is read as one.
 */
#include "volume.h"

#include <string.h>

#define WINDOW_BITS_GZIP (15 + 16)
/* No deflate stream unpacks to more than 1032 times its size. */
#define DEFLATE_MOST 1032
/* Bytes that may follow behind the voxels. */
#define TRAILING_MAX ((size_t)1 << 20)

static void *stream_alloc(void *opaque, unsigned count, unsigned size)
{
    (void)opaque;
    return srnf_alloc(count, size);
}

static void stream_free(void *opaque, void *pointer)
{
    (void)opaque;
    srnf_free(pointer);
}

static bool is_gzip(const unsigned char *bytes, size_t size)
{
    return size >= 2 && bytes[0] == 0x1f && bytes[1] == 0x8b;
}

int volume_source_open(struct volume_reader *reader, const unsigned char *bytes, size_t size)
{
    struct volume_source *source = &reader->source;

    memset(source, 0, sizeof *source);
    source->at = bytes;
    source->end = bytes + size;
    source->packed = is_gzip(bytes, size);
    if (!source->packed) {
        return SRNF_OK;
    }
    source->stream.zalloc = stream_alloc;
    source->stream.zfree = stream_free;
    if (inflateInit2(&source->stream, WINDOW_BITS_GZIP) != Z_OK) {
        return srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
    }
    source->inflating = true;
    return SRNF_OK;
}

void volume_source_close(struct volume_source *source)
{
    if (source->inflating) {
        (void)inflateEnd(&source->stream);
        source->inflating = false;
    }
}

uint64_t volume_source_most(const struct volume_source *source)
{
    uint64_t left = (uint64_t)(source->end - source->at);

    return source->n_kept - source->kept_at +
           (source->packed ? (left + VOLUME_PIECE) * DEFLATE_MOST : left);
}

/* The member is over: another one follows, or what follows is none and is passed over. */
static int next_member(struct volume_reader *reader)
{
    struct volume_source *source = &reader->source;

    if (!is_gzip(source->at, (size_t)(source->end - source->at))) {
        source->ended = true;
        return SRNF_OK;
    }
    return inflateReset(&source->stream) == Z_OK
               ? SRNF_OK
               : srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
}

/* One call of inflate into out; *n is what it gave. */
static int inflate_some(struct volume_reader *reader, unsigned char *out, size_t room, size_t *n)
{
    struct volume_source *source = &reader->source;
    size_t left = (size_t)(source->end - source->at);
    unsigned given = room < VOLUME_PIECE ? (unsigned)room : (unsigned)VOLUME_PIECE;
    unsigned taken = left < VOLUME_PIECE ? (unsigned)left : (unsigned)VOLUME_PIECE;
    int code;

    /* zlib does not write to its input, but older versions do not say so. */
    source->stream.next_in = (unsigned char *)(uintptr_t)source->at;
    source->stream.avail_in = taken;
    source->stream.next_out = out;
    source->stream.avail_out = given;
    code = inflate(&source->stream, Z_NO_FLUSH);
    source->at += taken - source->stream.avail_in;
    *n = given - source->stream.avail_out;
    if (!srnf_unpack_count(reader->limits.unpack_left, *n)) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1,
                         "what is packed in it unpacks to more than there is room for");
    }
    if (code == Z_STREAM_END) {
        return next_member(reader);
    }
    if (code == Z_MEM_ERROR) {
        return srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
    }
    if (code != Z_OK && code != Z_BUF_ERROR) {
        return srnf_fail(reader->error, SRNF_EPARSE, source->at - reader->bytes,
                         "the gzip data are damaged at byte %zu",
                         (size_t)(source->at - reader->bytes));
    }
    if (*n == 0 && taken == 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->size,
                         "the gzip data are cut off: the file ends inside them");
    }
    return SRNF_OK;
}

static size_t take_kept(struct volume_source *source, unsigned char *out, size_t n)
{
    size_t kept = source->n_kept - source->kept_at;

    n = n < kept ? n : kept;
    memcpy(out, source->kept + source->kept_at, n);
    source->kept_at += n;
    return n;
}

static int read_some(struct volume_reader *reader, unsigned char *out, size_t n, size_t *got)
{
    struct volume_source *source = &reader->source;
    size_t left = (size_t)(source->end - source->at);

    *got = 0;
    if (source->packed) {
        return source->ended ? SRNF_OK : inflate_some(reader, out, n, got);
    }
    *got = n < left ? n : left;
    memcpy(out, source->at, *got);
    source->at += *got;
    return SRNF_OK;
}

static bool is_over(const struct volume_source *source)
{
    return source->packed ? source->ended : source->at == source->end;
}

int volume_source_read(struct volume_reader *reader, unsigned char *out, size_t n, size_t *got)
{
    struct volume_source *source = &reader->source;

    *got = take_kept(source, out, n);
    while (*got < n && !is_over(source)) {
        size_t more = 0;
        int status = read_some(reader, out + *got, n - *got, &more);

        if (status != SRNF_OK) {
            return status;
        }
        *got += more;
    }
    return srnf_is_canceled(reader->limits.context) ? SRNF_ECANCELED : SRNF_OK;
}

int volume_source_byte(struct volume_reader *reader, int *byte)
{
    struct volume_source *source = &reader->source;

    *byte = -1;
    if (source->kept_at == source->n_kept) {
        size_t got = 0;
        int status;

        source->kept_at = source->n_kept = 0;
        status = volume_source_read(reader, source->kept, sizeof source->kept, &got);
        if (status != SRNF_OK) {
            return status;
        }
        source->n_kept = got;
    }
    if (source->kept_at < source->n_kept) {
        *byte = source->kept[source->kept_at++];
    }
    return SRNF_OK;
}

int volume_source_skip(struct volume_reader *reader, uint64_t n)
{
    unsigned char passed[4096];

    while (n > 0) {
        size_t got, some = n < sizeof passed ? (size_t)n : sizeof passed;
        int status = volume_source_read(reader, passed, some, &got);

        if (status != SRNF_OK) {
            return status;
        }
        if (got < some) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->size,
                             "the file ends before its voxels");
        }
        n -= some;
    }
    return SRNF_OK;
}

int volume_source_finish(struct volume_reader *reader)
{
    unsigned char passed[4096];
    size_t got = 1, behind = 0;

    while (reader->source.packed && got > 0) {
        int status = volume_source_read(reader, passed, sizeof passed, &got);

        if (status != SRNF_OK) {
            return status;
        }
        behind += got;
        if (behind > TRAILING_MAX) {
            return srnf_fail(reader->error, SRNF_EPARSE, -1,
                             "the gzip data hold far more bytes than the header promises");
        }
    }
    return SRNF_OK;
}
