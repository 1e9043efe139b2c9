/*
 * gifti_data.c - the characters of a GIfTI data array become numbers.
 *
 * They come in pieces, cut anywhere, and leave as bytes of an array whose size the attributes
 * fixed:
 *
 *     ASCII                 words -> doubles
 *     Base64Binary          groups of four characters -> bytes
 *     GZipBase64Binary      the same bytes -> zlib -> bytes
 *
 * The array is allocated once, after its size has been held against what the file can possibly
 * contain (zlib packs no better than 1 to 1032), and nothing is ever written behind its end:
 * unpacking stops with an error at the first byte too many, so that a small file cannot become a
 * large one.
 */
#include "gifti.h"
#include "pack.h"

#include <limits.h>
#include <string.h>

#define DEFLATE_RATIO_MAX 1032    /* zlib's documentation, "Maximum Compression Factor" */
#define PIECE_SIZE 3072           /* bytes decoded from base64 at a time */
#define WINDOW_BITS_ANY (15 + 32) /* zlib or gzip header, whichever is there */

static int fail(struct gifti_decoder *decoder, const char *what)
{
    return srnf_fail(decoder->reader->error, SRNF_EPARSE, (int64_t)decoder->array->number,
                     "DataArray %zu: %s", decoder->array->number, what);
}

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

/* Text is kept as doubles, whatever type and byte order the array claims. */
static void choose_storage(struct gifti_array *array)
{
    if (array->encoding == GIFTI_ASCII) {
        array->type = SCALAR_FLOAT64;
        array->big_endian = false;
    }
}

/* Can a file of this size hold that many rows? */
static int check_promise(struct mesh_reader *reader, const struct gifti_array *array,
                         const char *what)
{
    size_t binary = (size_t)array->columns * scalar_size(array->type);
    size_t characters = reader->size / 4 * 3;

    if (array->encoding == GIFTI_ASCII) {
        return mesh_promise(reader, what, array->rows, 2 * (size_t)array->columns, reader->size);
    }
    if (array->encoding == GIFTI_GZIP_BASE64) {
        characters =
            characters > SIZE_MAX / DEFLATE_RATIO_MAX ? SIZE_MAX : characters * DEFLATE_RATIO_MAX;
    }
    return mesh_promise(reader, what, array->rows, binary, characters);
}

int gifti_decode_open(struct gifti_decoder *decoder, struct mesh_reader *reader,
                      struct gifti_array *array, size_t limit, const char *what)
{
    int status;

    memset(decoder, 0, sizeof *decoder);
    decoder->reader = reader;
    decoder->array = array;
    choose_storage(array);
    status = check_promise(reader, array, what);
    if (status == SRNF_OK && (uint64_t)array->rows > limit) {
        status = srnf_fail(reader->error, SRNF_ELIMIT, -1, "%lld %s exceed the limit of %zu %s",
                           (long long)array->rows, what, limit, what);
    }
    if (status != SRNF_OK) {
        return status;
    }
    array->size = (size_t)array->rows * (size_t)array->columns * scalar_size(array->type);
    array->raw = mesh_alloc(reader, array->size, 1);
    if (!array->raw) {
        return reader->status;
    }
    if (array->encoding == GIFTI_GZIP_BASE64) {
        decoder->stream.zalloc = stream_alloc;
        decoder->stream.zfree = stream_free;
        if (inflateInit2(&decoder->stream, WINDOW_BITS_ANY) != Z_OK) {
            return srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
        }
        decoder->inflating = true;
    }
    return SRNF_OK;
}

void gifti_decode_close(struct gifti_decoder *decoder)
{
    if (decoder->inflating) {
        (void)inflateEnd(&decoder->stream);
        decoder->inflating = false;
    }
}

/* ---- Bytes ----------------------------------------------------------------------------------- */

static int store_bytes(struct gifti_decoder *decoder, const unsigned char *bytes, size_t size)
{
    struct gifti_array *array = decoder->array;

    if (size > array->size - array->filled) {
        return fail(decoder, "it holds more data than its dimensions promise");
    }
    memcpy(array->raw + array->filled, bytes, size);
    array->filled += size;
    return SRNF_OK;
}

/* Bytes to unpack before it is asked again whether to go on. */
#define INFLATE_AT_ONCE (1u << 20)

/* One call of inflate, into the array or, when that is full, into one byte that must stay empty. */
static int inflate_step(struct gifti_decoder *decoder)
{
    struct gifti_array *array = decoder->array;
    size_t room = array->size - array->filled;
    unsigned char beyond;
    unsigned given = room > INFLATE_AT_ONCE ? INFLATE_AT_ONCE : (unsigned)room;
    int code;

    decoder->stream.next_out = given > 0 ? array->raw + array->filled : &beyond;
    decoder->stream.avail_out = given > 0 ? given : 1;
    code = inflate(&decoder->stream, Z_NO_FLUSH);
    if (given > 0) {
        int status = pack_count(decoder->reader, given - decoder->stream.avail_out);

        array->filled += given - decoder->stream.avail_out;
        if (status != SRNF_OK) {
            return status;
        }
    } else if (decoder->stream.avail_out == 0) {
        return fail(decoder, "it holds more data than its dimensions promise");
    }
    if (code == Z_MEM_ERROR) {
        return srnf_fail(decoder->reader->error, SRNF_ENOMEM, -1, "not enough memory to unpack");
    }
    if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR) {
        return fail(decoder, "its packed data are damaged");
    }
    decoder->stream_ended = code == Z_STREAM_END;
    return SRNF_OK;
}

/* Has inflate filled all that it was given while the array has more room? There may be more to come
   of the input that it has taken. */
static bool has_more(const struct gifti_decoder *decoder)
{
    return decoder->stream.avail_out == 0 && !decoder->stream_ended &&
           decoder->array->filled < decoder->array->size;
}

/* Each round uses up input or fills the output, or it ends. */
static int inflate_bytes(struct gifti_decoder *decoder, unsigned char *bytes, size_t size)
{
    int status = SRNF_OK;

    decoder->stream.next_in = bytes;
    decoder->stream.avail_in = (unsigned)size;
    decoder->stream.avail_out = 1;
    while (status == SRNF_OK && (decoder->stream.avail_in > 0 || has_more(decoder))) {
        if (decoder->stream_ended) {
            return fail(decoder, "something follows behind its packed data");
        }
        status = inflate_step(decoder);
    }
    return status;
}

/* Takes one character; appends the byte that it completes, if any, to bytes[*n]. */
static int take_base64(struct gifti_decoder *decoder, unsigned char c, unsigned char *bytes,
                       size_t *n)
{
    int value = base64_value(c);

    if (scan_is_space(c)) {
        return SRNF_OK;
    }
    if (c == '=' && decoder->n_bits + decoder->padding >= 2 && decoder->padding < 2) {
        decoder->padding++;
        return SRNF_OK;
    }
    if (value < 0 || decoder->padding > 0) {
        return fail(decoder, "a character is no part of Base64");
    }
    decoder->bits = (decoder->bits << 6) | (uint32_t)value;
    decoder->n_bits = (decoder->n_bits + 1) % 4;
    if (decoder->n_bits != 1) {
        /* Two characters complete 8 of 12 bits, three 16 of 18, four 24 of 24. */
        static const unsigned spare[4] = {0, 0, 4, 2};

        bytes[(*n)++] = (unsigned char)(decoder->bits >> spare[decoder->n_bits]);
    }
    return SRNF_OK;
}

static int decode_base64(struct gifti_decoder *decoder, const unsigned char *text, size_t size)
{
    unsigned char bytes[PIECE_SIZE];
    size_t n = 0;
    int status = SRNF_OK;

    for (size_t i = 0; i < size && status == SRNF_OK; i++) {
        status = take_base64(decoder, text[i], bytes, &n);
        if (status == SRNF_OK && i % SRNF_ITEMS_ASKED == SRNF_ITEMS_ASKED - 1) {
            status = mesh_ask(decoder->reader);
        }
        if (status == SRNF_OK && n > 0 && (n == PIECE_SIZE || i + 1 == size)) {
            status = decoder->inflating ? inflate_bytes(decoder, bytes, n)
                                        : store_bytes(decoder, bytes, n);
            n = 0;
        }
    }
    return status;
}

/* ---- Words ----------------------------------------------------------------------------------- */

static int finish_word(struct gifti_decoder *decoder)
{
    struct token word = {decoder->word, decoder->n_word};
    unsigned char bytes[sizeof(double)];
    double value;

    if (decoder->n_word == 0) {
        return SRNF_OK;
    }
    if (!token_number(word, decoder->reader->locale, &value)) {
        return srnf_fail(decoder->reader->error, SRNF_EPARSE, (int64_t)decoder->array->number,
                         "DataArray %zu: '%s' is not a number", decoder->array->number,
                         token_quote(word).text);
    }
    decoder->n_word = 0;
    scalar_put_f64_le(bytes, value);
    return store_bytes(decoder, bytes, sizeof bytes);
}

static int decode_text(struct gifti_decoder *decoder, const unsigned char *text, size_t size)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < size && status == SRNF_OK; i++) {
        if (scan_is_space(text[i])) {
            status = finish_word(decoder);
            status = status == SRNF_OK ? mesh_step(decoder->reader) : status;
        } else if (decoder->n_word < sizeof decoder->word) {
            decoder->word[decoder->n_word++] = text[i];
        } else {
            status = fail(decoder, "a number is too long");
        }
    }
    return status;
}

int gifti_decode(struct gifti_decoder *decoder, const unsigned char *text, size_t size)
{
    return decoder->array->encoding == GIFTI_ASCII ? decode_text(decoder, text, size)
                                                   : decode_base64(decoder, text, size);
}

int gifti_decode_end(struct gifti_decoder *decoder)
{
    const struct gifti_array *array = decoder->array;
    int status = finish_word(decoder);

    if (status != SRNF_OK) {
        return status;
    }
    if (array->filled != array->size) {
        return srnf_fail(decoder->reader->error, SRNF_EPARSE, (int64_t)array->number,
                         "DataArray %zu: it ends after %zu of %zu numbers", array->number,
                         array->filled / scalar_size(array->type),
                         array->size / scalar_size(array->type));
    }
    if (decoder->inflating && !decoder->stream_ended) {
        return fail(decoder, "its packed data are incomplete");
    }
    return SRNF_OK;
}

/* ---- Elements -------------------------------------------------------------------------------- */

static const unsigned char *element_at(const struct gifti_array *array, size_t row, size_t column)
{
    size_t place = array->column_major ? column * (size_t)array->rows + row
                                       : row * (size_t)array->columns + column;

    return array->raw + place * scalar_size(array->type);
}

double gifti_value(const struct gifti_array *array, size_t row, size_t column)
{
    return scalar_value(array->type, element_at(array, row, column), array->big_endian);
}

bool gifti_index(const struct gifti_array *array, size_t row, size_t column, int64_t *index)
{
    return scalar_index(array->type, element_at(array, row, column), array->big_endian, index);
}
