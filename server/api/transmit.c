/*
 * transmit.c - ranges, gzip and zstd (transmit.h).
 *
 * Ranges are for answers that have a strong entity tag and a megabyte can be missing of: those of
 * RANGES_FROM bytes or more, and one range at a time; more than one are answered by the whole, as
 * HTTP allows. If-Range names the entity tag.
 *
 * Packing takes up to WORK bytes for zlib or libzstd and a second body of at most the size of the
 * first, on a thread that handles one request, and is charged to the request's account where it has
 * one. What is longer than PACKED_MAX goes as it is, so that nobody waits for the thread long. A
 * packed answer is another representation of the same content: its tag becomes a weak one.
 *
 * Of two codings that a client takes alike zstd is chosen: at its level 1 a mesh of 3 MB (PLY)
 * takes 5 ms and keeps 75 % of its size, where gzip's level 1 takes 61 ms and keeps 70 %; of 300 KB
 * of JSON it keeps 41 % in 0.9 ms, gzip's level 6 44 % in 17 ms.
 */
#include "api/transmit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <zlib.h>
#include <zstd.h>

#include "api/respond.h"
#include "jobs/memory.h"

#define WORK ((size_t)640 << 10)
#define ZSTD_LEVEL 1
#define PACKED_MIN ((size_t)1024)
#define PACKED_MAX ((size_t)4 << 20)
#define FAST_FROM ((size_t)128 << 10) /* from here on speed counts more */
#define RANGES_FROM ((size_t)64 << 10)

static struct api_header *find_header(struct api_response *response, const char *name)
{
    for (size_t i = 0; i < response->n_headers; i++) {
        if (strcmp(response->headers[i].name, name) == 0) {
            return &response->headers[i];
        }
    }
    return NULL;
}

/* Its value, of which the response keeps the text. */
static const char *header_value(struct api_response *response, const char *name)
{
    const struct api_header *header = find_header(response, name);

    return header ? header->value : "";
}

/* ---- Ranges ---------------------------------------------------------------------------------- */

/* One beyond what fits is as large as fits: it lies behind the end all the same. */
static bool read_number(const char **text, size_t *number)
{
    size_t digits = strspn(*text, "0123456789");

    if (digits == 0) {
        return false;
    }
    *number = (size_t)strtoull(*text, NULL, 10);
    *text += digits;
    return true;
}

/* "bytes=3-7", "bytes=3-", "bytes=-5" of a body of this size: 1 with the bytes from first to last,
   0 where there are none, -1 where the field is another, or names more than one range. */
static int read_range(const char *text, size_t size, size_t *first, size_t *last)
{
    size_t suffix;

    if (strncmp(text, "bytes=", 6) != 0) {
        return -1;
    }
    text += 6;
    *last = size - 1;
    if (*text == '-') {
        text++;
        if (!read_number(&text, &suffix) || *text) {
            return -1;
        }
        *first = suffix < size ? size - suffix : 0;
        return suffix > 0;
    }
    if (!read_number(&text, first) || *text++ != '-' || (*text && !read_number(&text, last)) ||
        *text || (*last < *first && *first < size)) {
        return -1;
    }
    *last = *last < size ? *last : size - 1;
    return *first < size;
}

/* Whether the answer was made a range, or says that there is none. */
static bool take_range(struct api_call *call)
{
    struct api_response *response = call->response;
    const char *range, *condition, *tag;
    size_t size = response->body_size, first, last;
    int found;

    if ((!response->body && !response->body_file) || size < RANGES_FROM) {
        return false;
    }
    tag = header_value(response, "ETag");
    if (!tag[0]) {
        return false;
    }
    (void)api_response_header_text(response, "Accept-Ranges", "bytes");
    range = api_request_header(call->request, "Range");
    condition = api_request_header(call->request, "If-Range");
    if (!range || strcmp(call->request->method, "GET") != 0 ||
        (condition && strcmp(condition, tag) != 0)) {
        return false;
    }
    found = read_range(range, size, &first, &last);
    if (found < 0) {
        return false;
    }
    if (found == 0) {
        (void)problem_respond(call, "range-not-satisfiable", "The content has %zu bytes.", size);
        (void)api_response_header(response, "Content-Range", "bytes */%zu", size);
        return true;
    }
    if (response->body_file) {
        response->body_offset = first;
    } else {
        memmove(response->body, response->body + first, last - first + 1);
    }
    response->body_size = last - first + 1;
    response->status = 206;
    (void)api_response_header(response, "Content-Range", "bytes %zu-%zu/%zu", first, last, size);
    return true;
}

/* ---- Packing --------------------------------------------------------------------------------- */

/* Types that gzip makes smaller by a third at least; what is packed already is not among them. */
static bool packs(const char *type)
{
    static const char *const types[] = {"application/json",
                                        "application/problem+json",
                                        "application/yaml",
                                        "application/vnd.oai.openapi+json",
                                        "text/csv",
                                        "text/html",
                                        "model/ply",
                                        "model/obj",
                                        "model/stl",
                                        "model/gltf-binary",
                                        "application/x-vtk",
                                        "application/x-vtp",
                                        "application/x-gifti+xml"};
    size_t length = strcspn(type, ";");

    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        if (strlen(types[i]) == length && strncmp(types[i], type, length) == 0) {
            return true;
        }
    }
    return false;
}

/* How well Accept-Encoding likes the coding: 0 where it is not named, or with that quality. */
static double quality_of(const struct api_request *request, const char *coding)
{
    const char *list = api_request_header(request, "Accept-Encoding");

    while (list && *list) {
        size_t span = strcspn(list, ","), skip = strspn(list, " \t");
        const char *one = list + skip, *end = list + span;
        size_t name = strcspn(one, ",; \t");

        if (name == strlen(coding) && strncasecmp(one, coding, name) == 0) {
            const char *quality = strstr(one, "q=");

            return !quality || quality > end ? 1.0 : strtod(quality + 2, NULL);
        }
        list += span + (*end == ',');
    }
    return 0.0;
}

/* Fills packed, which has room for as many bytes; 0 where they do not become fewer. */
static size_t pack_zstd(const unsigned char *bytes, size_t size, unsigned char *packed)
{
    size_t packed_size = ZSTD_compress(packed, size, bytes, size, ZSTD_LEVEL);

    return ZSTD_isError(packed_size) ? 0 : packed_size;
}

static size_t pack_gzip(const unsigned char *bytes, size_t size, unsigned char *packed)
{
    int level = size < FAST_FROM ? Z_DEFAULT_COMPRESSION : Z_BEST_SPEED;
    union {
        const unsigned char *constant;
        unsigned char *plain;
    } input = {bytes};
    z_stream stream = {.next_in = input.plain, .avail_in = (uInt)size, .avail_out = (uInt)size};
    bool done = false;

    stream.next_out = packed;
    if (deflateInit2(&stream, level, Z_DEFLATED, MAX_WBITS + 16, MAX_MEM_LEVEL,
                     Z_DEFAULT_STRATEGY) == Z_OK) {
        done = deflate(&stream, Z_FINISH) == Z_STREAM_END;
        (void)deflateEnd(&stream);
    }
    return done ? (size_t)stream.total_out : 0;
}

/* The bytes packed (malloc), fewer than there were, or NULL. */
static unsigned char *pack(const unsigned char *bytes, size_t size, bool zstd, size_t *packed_size)
{
    struct jobs_memory *account = jobs_memory_current();
    unsigned char *packed = NULL, *shrunk;

    *packed_size = 0;
    if (!jobs_memory_charge(account, size + WORK)) {
        return NULL;
    }
    packed = malloc(size);
    if (packed) {
        *packed_size = (zstd ? pack_zstd : pack_gzip)(bytes, size, packed);
    }
    jobs_memory_discharge(account, size + WORK);
    shrunk = *packed_size > 0 ? realloc(packed, *packed_size) : NULL;
    if (!shrunk) {
        free(packed);
    }
    return shrunk;
}

static void set_weak(struct api_response *response)
{
    struct api_header *tag = find_header(response, "ETag");
    char weak[200];

    if (tag && strlen(tag->value) + 3 < sizeof weak) {
        (void)snprintf(weak, sizeof weak, "W/%s", tag->value);
        if (api_response_header_text(response, "ETag", weak) == 0) {
            /* The new one takes the place of the old, which is the response's own text. */
            const struct api_header *last = &response->headers[response->n_headers - 1];
            const char *value = tag->value;

            tag->value = last->value;
            response->headers[response->n_headers - 1].value = value;
            api_response_drop_last(response);
        }
    }
}

static void take_packed(struct api_call *call)
{
    struct api_response *response = call->response;
    double gzip, zstd;
    const unsigned char *bytes = response->static_body ? response->static_body : response->body;
    unsigned char *packed;
    size_t size = 0;

    if (!bytes || response->body_size < PACKED_MIN || response->body_size > PACKED_MAX ||
        !packs(header_value(response, "Content-Type")) ||
        header_value(response, "Content-Encoding")[0]) {
        return;
    }
    (void)api_response_header_text(response, "Vary", "Accept-Encoding");
    gzip = quality_of(call->request, "gzip");
    zstd = quality_of(call->request, "zstd");
    packed = gzip > 0 || zstd > 0 ? pack(bytes, response->body_size, zstd >= gzip, &size) : NULL;
    if (!packed) {
        return;
    }
    if (api_response_header_text(response, "Content-Encoding", zstd >= gzip ? "zstd" : "gzip") !=
        0) {
        free(packed);
        return;
    }
    set_weak(response);
    free(response->body);
    response->body = packed;
    response->static_body = NULL;
    response->body_size = size;
}

void transmit(struct api_call *call)
{
    struct api_response *response = call->response;

    if (response->wait.job_id[0] || response->stream.job_id[0] || response->undone != API_DONE) {
        return;
    }
    if (response->status == 200 && !take_range(call) && !response->body_file) {
        take_packed(call);
    }
}
