/*
 * npy.c - reading and writing .npy (format described in NumPy's documentation, numpy.lib.format).
 *
 *   6 bytes   \x93NUMPY
 *   2 bytes   major, minor version
 *   2 or 4    length of the header, little-endian: 2 bytes in version 1, 4 in version 2
 *   header    {'descr': '<f8', 'fortran_order': False, 'shape': (48, 96, 3), } padded with spaces
 *   so that the
 *             data begin on a multiple of 64 bytes, closed by a newline
 *   data      count numbers
 *
 * The machine is assumed to be little-endian with IEEE 754 doubles, which the build checks.
 */
#include "api/npy.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "\x93NUMPY"
#define MAGIC_SIZE ((size_t)6)
#define HEADER_MAX ((size_t)4096) /* a header with three members fits many times */
#define ALIGNMENT ((size_t)64)

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the numbers are copied as they are");
_Static_assert(sizeof(double) == 8 && sizeof(float) == 4, "IEEE 754 numbers");

/* What the header says. */
struct header {
    size_t item_size; /* 4 or 8 */
    bool fortran, has_descr, has_order, has_shape;
    size_t n_dimensions;
    size_t shape[NPY_DIMENSIONS_MAX];
};

/* The header's text and how far it was read. */
struct scanner {
    const char *text;
    size_t size, at;
    char *message;
    size_t message_size;
};

__attribute__((format(printf, 3, 4))) static int fail(char *message, size_t size,
                                                      const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(message, size, format, arguments);
    va_end(arguments);
    return -1;
}

bool npy_sniff(const void *bytes, size_t size)
{
    return bytes && size >= MAGIC_SIZE && memcmp(bytes, MAGIC, MAGIC_SIZE) == 0;
}

void npy_clear(struct npy_array *array)
{
    free(array->values);
    *array = (struct npy_array){0};
}

static void skip_space(struct scanner *scanner)
{
    while (scanner->at < scanner->size &&
           (scanner->text[scanner->at] == ' ' || scanner->text[scanner->at] == '\n')) {
        scanner->at++;
    }
}

/* Steps over one character, after space; false when something else is there. */
static bool accept(struct scanner *scanner, char wanted)
{
    skip_space(scanner);
    if (scanner->at < scanner->size && scanner->text[scanner->at] == wanted) {
        scanner->at++;
        return true;
    }
    return false;
}

/* Steps over a bare word such as True. */
static bool accept_word(struct scanner *scanner, const char *word)
{
    size_t length = strlen(word);

    skip_space(scanner);
    if (scanner->size - scanner->at >= length &&
        memcmp(scanner->text + scanner->at, word, length) == 0) {
        scanner->at += length;
        return true;
    }
    return false;
}

/* A quoted string without escapes, shorter than size. */
static bool read_string(struct scanner *scanner, char *buffer, size_t size)
{
    size_t length = 0;
    char quote;

    skip_space(scanner);
    if (scanner->at >= scanner->size) {
        return false;
    }
    quote = scanner->text[scanner->at];
    if (quote != '\'' && quote != '"') {
        return false;
    }
    scanner->at++;
    while (scanner->at < scanner->size && scanner->text[scanner->at] != quote) {
        char c = scanner->text[scanner->at++];
        if (c == '\\' || c < ' ' || length + 1 >= size) {
            return false;
        }
        buffer[length++] = c;
    }
    buffer[length] = '\0';
    return accept(scanner, quote);
}

static bool read_size(struct scanner *scanner, size_t *value)
{
    bool any = false;

    skip_space(scanner);
    *value = 0;
    while (scanner->at < scanner->size && scanner->text[scanner->at] >= '0' &&
           scanner->text[scanner->at] <= '9') {
        size_t digit = (size_t)(scanner->text[scanner->at++] - '0');
        if (__builtin_mul_overflow(*value, (size_t)10, value) ||
            __builtin_add_overflow(*value, digit, value)) {
            return false;
        }
        any = true;
    }
    return any;
}

static int read_descr(struct scanner *scanner, struct header *header)
{
    char type[16];

    if (!read_string(scanner, type, sizeof type)) {
        return fail(scanner->message, scanner->message_size,
                    "the type (descr) is not a plain string: structured types are not supported");
    }
    header->item_size = strcmp(type, "<f8") == 0 ? 8 : strcmp(type, "<f4") == 0 ? 4 : 0;
    if (header->item_size == 0) {
        return fail(scanner->message, scanner->message_size,
                    "the type is '%s'; only little-endian float64 ('<f8') and float32 ('<f4') "
                    "are supported",
                    type);
    }
    header->has_descr = true;
    return 0;
}

static int read_order(struct scanner *scanner, struct header *header)
{
    header->fortran = accept_word(scanner, "True");
    if (!header->fortran && !accept_word(scanner, "False")) {
        return fail(scanner->message, scanner->message_size,
                    "fortran_order is neither True nor False");
    }
    header->has_order = true;
    return 0;
}

static int read_shape(struct scanner *scanner, struct header *header)
{
    bool comma = true;

    if (!accept(scanner, '(')) {
        return fail(scanner->message, scanner->message_size, "the shape is not a tuple");
    }
    header->n_dimensions = 0;
    while (!accept(scanner, ')')) {
        size_t extent;
        if (!comma || !read_size(scanner, &extent)) {
            return fail(scanner->message, scanner->message_size,
                        "the shape is not a tuple of whole numbers");
        }
        if (header->n_dimensions == NPY_DIMENSIONS_MAX) {
            return fail(scanner->message, scanner->message_size,
                        "the array has more than %d dimensions", NPY_DIMENSIONS_MAX);
        }
        header->shape[header->n_dimensions++] = extent;
        comma = accept(scanner, ',');
    }
    header->has_shape = true;
    return 0;
}

static const struct {
    const char *name;
    int (*read)(struct scanner *scanner, struct header *header);
} members[] = {
    {"descr", read_descr},
    {"fortran_order", read_order},
    {"shape", read_shape},
};

static int read_member(struct scanner *scanner, struct header *header)
{
    char name[32];

    if (!read_string(scanner, name, sizeof name) || !accept(scanner, ':')) {
        return fail(scanner->message, scanner->message_size, "the header is not a dictionary");
    }
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        if (strcmp(members[i].name, name) == 0) {
            return members[i].read(scanner, header);
        }
    }
    return fail(scanner->message, scanner->message_size, "the header has an unknown member '%s'",
                name);
}

static int read_header(struct scanner *scanner, struct header *header)
{
    if (!accept(scanner, '{')) {
        return fail(scanner->message, scanner->message_size, "the header is not a dictionary");
    }
    while (!accept(scanner, '}')) {
        if (read_member(scanner, header)) {
            return -1;
        }
        if (!accept(scanner, ',')) {
            if (!accept(scanner, '}')) {
                return fail(scanner->message, scanner->message_size,
                            "the header is not a dictionary");
            }
            break;
        }
    }
    skip_space(scanner);
    if (scanner->at != scanner->size) {
        return fail(scanner->message, scanner->message_size,
                    "something follows the dictionary of the header");
    }
    if (!header->has_descr || !header->has_order || !header->has_shape) {
        return fail(scanner->message, scanner->message_size,
                    "the header lacks descr, fortran_order or shape");
    }
    return 0;
}

/* Finds the header's text and the first byte of the data. */
static int find_header(const unsigned char *bytes, size_t size, struct scanner *scanner,
                       size_t *data)
{
    size_t prefix = MAGIC_SIZE + 2 + 2, length;

    if (!npy_sniff(bytes, size)) {
        return fail(scanner->message, scanner->message_size,
                    "the body is no .npy file: it does not begin with \\x93NUMPY");
    }
    if (size >= MAGIC_SIZE + 2 && bytes[MAGIC_SIZE] != 1 && bytes[MAGIC_SIZE] != 2) {
        return fail(scanner->message, scanner->message_size,
                    "version %d.%d of the .npy format is not supported; 1.0 and 2.0 are",
                    bytes[MAGIC_SIZE], bytes[MAGIC_SIZE + 1]);
    }
    if (size > MAGIC_SIZE && bytes[MAGIC_SIZE] == 2) {
        prefix += 2;
    }
    if (size < prefix) {
        return fail(scanner->message, scanner->message_size, "the file ends in its header");
    }
    length = (size_t)bytes[MAGIC_SIZE + 2] | (size_t)bytes[MAGIC_SIZE + 3] << 8;
    if (prefix == MAGIC_SIZE + 2 + 4) {
        length |= (size_t)bytes[MAGIC_SIZE + 4] << 16 | (size_t)bytes[MAGIC_SIZE + 5] << 24;
    }
    if (length > HEADER_MAX) {
        return fail(scanner->message, scanner->message_size,
                    "the header promises %zu bytes; at most %zu are read", length, HEADER_MAX);
    }
    if (size - prefix < length) {
        return fail(scanner->message, scanner->message_size, "the file ends in its header");
    }
    scanner->text = (const char *)bytes + prefix;
    scanner->size = length;
    *data = prefix + length;
    return 0;
}

/* Sizes of the array, checked against the limit and against the bytes that are there. */
static int check_size(const struct header *header, size_t max_count, size_t available,
                      struct npy_array *array, char *message, size_t message_size)
{
    size_t count = 1, bytes;

    for (size_t i = 0; i < header->n_dimensions; i++) {
        if (__builtin_mul_overflow(count, header->shape[i], &count)) {
            return fail(message, message_size, "the shape overflows");
        }
        array->shape[i] = header->shape[i];
    }
    if (count > max_count) {
        return fail(message, message_size, "the array has %zu numbers; the limit is %zu", count,
                    max_count);
    }
    if (__builtin_mul_overflow(count, header->item_size, &bytes) || bytes != available) {
        return fail(message, message_size,
                    "the shape asks for %zu numbers of %zu bytes, but %zu bytes follow the header",
                    count, header->item_size, available);
    }
    array->n_dimensions = header->n_dimensions;
    array->count = count;
    return 0;
}

static void copy_values(const unsigned char *data, size_t item_size, struct npy_array *array)
{
    if (item_size == 8) {
        memcpy(array->values, data, array->count * 8);
        return;
    }
    for (size_t i = 0; i < array->count; i++) {
        float single;
        memcpy(&single, data + 4 * i, sizeof single);
        array->values[i] = (double)single;
    }
}

int npy_read(const void *bytes, size_t size, size_t max_count, struct npy_array *array,
             char *message, size_t message_size)
{
    struct scanner scanner = {.message = message, .message_size = message_size};
    struct header header = {0};
    size_t data = 0;

    *array = (struct npy_array){0};
    if (find_header(bytes, size, &scanner, &data) || read_header(&scanner, &header)) {
        return -1;
    }
    if (header.fortran && header.n_dimensions > 1) {
        return fail(message, message_size,
                    "the array is in Fortran order; save it in C order (numpy.ascontiguousarray)");
    }
    if (check_size(&header, max_count, size - data, array, message, message_size)) {
        *array = (struct npy_array){0};
        return -1;
    }
    array->values = malloc(array->count ? array->count * sizeof(double) : 1);
    if (!array->values) {
        *array = (struct npy_array){0};
        return fail(message, message_size, "not enough memory for the array");
    }
    copy_values((const unsigned char *)bytes + data, header.item_size, array);
    return 0;
}

/* The header's text with the newline, padded to the alignment; returns its length or 0. */
static size_t format_header(char *text, size_t size, size_t n_dimensions, const size_t *shape)
{
    size_t used, total;
    int written = snprintf(text, size, "{'descr': '<f8', 'fortran_order': False, 'shape': (");

    used = written > 0 ? (size_t)written : size;
    for (size_t i = 0; i < n_dimensions && used < size; i++) {
        written =
            snprintf(text + used, size - used, i + 1 < n_dimensions ? "%zu, " : "%zu", shape[i]);
        used += written > 0 ? (size_t)written : size;
    }
    if (used >= size) {
        return 0;
    }
    written = snprintf(text + used, size - used, n_dimensions == 1 ? ",), }" : "), }");
    used += written > 0 ? (size_t)written : size;
    total = (MAGIC_SIZE + 4 + used + 1 + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT - MAGIC_SIZE - 4;
    if (total > size) {
        return 0;
    }
    memset(text + used, ' ', total - used - 1);
    text[total - 1] = '\n';
    return total;
}

int npy_write(const double *values, size_t n_dimensions, const size_t *shape, unsigned char **bytes,
              size_t *size)
{
    char header[512];
    size_t count = 1, data, total, length;
    unsigned char *out;

    *bytes = NULL;
    *size = 0;
    for (size_t i = 0; i < n_dimensions; i++) {
        if (__builtin_mul_overflow(count, shape[i], &count)) {
            return -1;
        }
    }
    length = format_header(header, sizeof header, n_dimensions, shape);
    if (length == 0 || n_dimensions == 0 || n_dimensions > NPY_DIMENSIONS_MAX ||
        __builtin_mul_overflow(count, sizeof(double), &data) ||
        __builtin_add_overflow(data, MAGIC_SIZE + 4 + length, &total)) {
        return -1;
    }
    out = malloc(total);
    if (!out) {
        return -1;
    }
    memcpy(out, MAGIC "\x01\x00", MAGIC_SIZE + 2);
    out[MAGIC_SIZE + 2] = (unsigned char)(length & 0xff);
    out[MAGIC_SIZE + 3] = (unsigned char)(length >> 8);
    memcpy(out + MAGIC_SIZE + 4, header, length);
    if (data) {
        memcpy(out + MAGIC_SIZE + 4 + length, values, data);
    }
    *bytes = out;
    *size = total;
    return 0;
}
