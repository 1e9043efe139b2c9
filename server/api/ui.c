/*
 * ui.c - the dashboard (web/): its pages, styles, programs and example meshes, which are part of
 * the binary.
 *
 * The build packs them by gzip, and they are sent so; a caller that takes no gzip gets them
 * unpacked here. They are the same for everyone and open without a token: what a page shows comes
 * from /v1, which asks for one. A name that has a hash of its content (app-2K7QJ4ZC.js) never means
 * other bytes, so browsers keep it for good; all else is asked for again by its entity tag.
 *
 * The policy allows what comes from this host and nothing else: no script and no style in the page
 * itself, no frame around it, no form, no other address.
 */
#include "api/respond.h"
#include "api/routes.h"
#include "api/ui.h"

#include "embedded.h"
#include "store/digest.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define FOLDER "ui/"
#define HASH_LENGTH 8
#define GZIP_WINDOW (15 + 16)           /* for zlib: with the head and tail of gzip */
#define UNPACKED_MAX ((size_t)16 << 20) /* of one file; they are ours, and smaller */

static const char policy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; worker-src 'self'; form-action 'none'; base-uri 'none'; "
    "frame-ancestors 'none'";

static const struct {
    const char *ending, *type;
} types[] = {
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
    {".ply", "model/ply"},
    {".csv", "text/csv; charset=utf-8"},
    {".txt", "text/plain; charset=utf-8"},
};

/* The file of that name, or NULL. */
static const struct embedded_file *find(const char *name)
{
    for (const struct embedded_file *file = embedded_files; file->path; file++) {
        if (strncmp(file->path, FOLDER, sizeof FOLDER - 1) == 0 &&
            strcmp(file->path + sizeof FOLDER - 1, name) == 0) {
            return file;
        }
    }
    return NULL;
}

static const char *type_of(const char *name)
{
    const char *ending = strrchr(name, '.');

    for (size_t i = 0; ending && i < sizeof types / sizeof types[0]; i++) {
        if (strcmp(ending, types[i].ending) == 0) {
            return types[i].type;
        }
    }
    return "application/octet-stream";
}

/* Whether the name ends in a hash, capitals and digits between a hyphen and the ending. */
static bool is_hashed(const char *name)
{
    const char *hyphen = strrchr(name, '-');
    size_t n = 0;

    while (hyphen &&
           (isupper((unsigned char)hyphen[1 + n]) || isdigit((unsigned char)hyphen[1 + n]))) {
        n++;
    }
    return hyphen && n == HASH_LENGTH && hyphen[1 + n] == '.';
}

static bool takes_gzip(const struct api_request *request)
{
    static const char *const names[] = {"gzip", "*"};
    const char *accept = api_request_header(request, "Accept-Encoding");

    for (size_t i = 0; accept && i < sizeof names / sizeof names[0]; i++) {
        if (list_has(accept, names[i])) {
            return true; /* one with a weight, ";q=0.5" or ";q=0", is no match: unpacked is fine */
        }
    }
    return false;
}

/* The size of what is packed stands in the last four bytes of gzip. */
static size_t unpacked_size(const struct embedded_file *file)
{
    const unsigned char *end = file->bytes + file->size;

    return file->size < 18 ? 0
                           : (size_t)end[-4] | (size_t)end[-3] << 8 | (size_t)end[-2] << 16 |
                                 (size_t)end[-1] << 24;
}

/* The bytes of the file unpacked (malloc), or NULL. */
static unsigned char *unpack(const struct embedded_file *file, size_t size)
{
    z_stream stream = {0};
    unsigned char *bytes = size > 0 && size <= UNPACKED_MAX ? malloc(size) : NULL;
    union {
        const unsigned char *constant;
        unsigned char *pointer;
    } in = {file->bytes};
    int status;

    if (!bytes || inflateInit2(&stream, GZIP_WINDOW) != Z_OK) {
        free(bytes);
        return NULL;
    }
    stream.next_in = in.pointer;
    stream.avail_in = (uInt)file->size;
    stream.next_out = bytes;
    stream.avail_out = (uInt)size;
    status = inflate(&stream, Z_FINISH);
    (void)inflateEnd(&stream);
    if (status != Z_STREAM_END) {
        free(bytes);
        return NULL;
    }
    return bytes;
}

unsigned char *ui_unpacked(const char *name, size_t *size)
{
    const struct embedded_file *file = find(name);

    *size = file ? unpacked_size(file) : 0;
    return file ? unpack(file, *size) : NULL;
}

static void add_fields(struct api_call *call, const char *name)
{
    struct api_response *response = call->response;

    (void)api_response_header_text(response, "Content-Security-Policy", policy);
    (void)api_response_header_text(response, "Referrer-Policy", "no-referrer");
    (void)api_response_header_text(response, "Cross-Origin-Opener-Policy", "same-origin");
    (void)api_response_header_text(response, "Cross-Origin-Resource-Policy", "same-origin");
    (void)api_response_header_text(response, "Vary", "Accept-Encoding");
    (void)api_response_header_text(response, "Cache-Control",
                                   is_hashed(name) ? "public, max-age=31536000, immutable"
                                                   : "no-cache");
}

/* Sets ETag; true where the caller has these bytes already, and 304 is answered. */
static bool not_modified(struct api_call *call, const struct embedded_file *file, bool packed)
{
    const char *known = api_request_header(call->request, "If-None-Match");
    char digest[65], tag[48], weak[52];

    store_sha256_hex(digest, file->bytes, file->size);
    (void)snprintf(tag, sizeof tag, "\"%.32s%s\"", digest, packed ? "-gzip" : "");
    (void)snprintf(weak, sizeof weak, "W/%s", tag);
    (void)api_response_header_text(call->response, "ETag", tag);
    if (!known || !(list_has(known, tag) || list_has(known, weak) || list_has(known, "*"))) {
        return false;
    }
    call->response->status = 304;
    return true;
}

static void send_file(struct api_call *call, const char *name)
{
    const struct embedded_file *file = find(name);
    bool packed = takes_gzip(call->request);
    unsigned char *bytes;
    size_t size;

    if (!file) {
        (void)problem_respond(call, "not-found",
                              "The dashboard has no file of this name; it begins at /ui/.");
        return;
    }
    add_fields(call, name);
    if (not_modified(call, file, packed)) {
        return;
    }
    if (packed) {
        (void)api_response_header_text(call->response, "Content-Encoding", "gzip");
        respond_static(call, 200, type_of(name), file->bytes, file->size);
        return;
    }
    size = unpacked_size(file);
    bytes = unpack(file, size);
    if (!bytes) {
        (void)problem_respond(call, "out-of-memory", "There is not enough memory for the file.");
        return;
    }
    respond_bytes(call, 200, type_of(name), bytes, size);
}

/* Relative to the path asked for, so that it holds behind a proxy that adds a prefix. */
void ui_redirect(struct api_call *call)
{
    call->response->status = 302;
    (void)api_response_header_text(call->response, "Location", "ui/");
    (void)api_response_header_text(call->response, "Vary", "Accept");
}

void ui_index(struct api_call *call)
{
    send_file(call, "index.html");
}

void ui_file(struct api_call *call)
{
    send_file(call, call->parameters[0]);
}

void ui_example(struct api_call *call)
{
    char name[sizeof "example/" + ROUTE_PARAMETER_SIZE];

    (void)snprintf(name, sizeof name, "example/%s", call->parameters[0]);
    send_file(call, name);
}
