/*
 * kept.c - the response that a connection gave last, to be given again.
 *
 * Who keeps a connection mostly asks the same again, and the answers differ in the request's id and
 * in their time. For each field of a response libmicrohttpd makes a record and two copies, and
 * frees them: with four fields that was a quarter of the instructions of GET /healthz. So a
 * connection keeps its last response from its second request on, and where the next one has the
 * same fields, with values as long, and a body as long, it is that response with its texts written
 * over.
 *
 * libmicrohttpd has copied the fields by the time that a response is on its way, and is done with
 * one before it shows the next request of the connection: nobody reads what is written here. The
 * values are in memory of the response's own, whose text it gives by pointer; a value is written
 * over by one of the same length alone, and by none that the library would refuse.
 *
 * Threads: all of it is the connection's.
 */
#include "http/internal.h"

#include <stdlib.h>
#include <string.h>

#define FIELDS_MAX ((size_t)12)
#define BODY_MAX ((size_t)4 << 10) /* of a body that a connection keeps: a small result's */

struct kept {
    struct MHD_Response *response;
    const void *static_body; /* as that of the api's response; NULL: body */
    unsigned char *body;     /* the response's */
    size_t body_size, n_fields;
    struct {
        const char *name; /* static */
        char *value;      /* the response's */
        size_t length;
    } fields[FIELDS_MAX];
};

/* ---- Giving it again ------------------------------------------------------------------------- */

static bool is_alike(const struct kept *kept, const struct api_response *response)
{
    if (kept->body_size != response->body_size || kept->static_body != response->static_body ||
        kept->n_fields != response->n_headers || response->body_file ||
        response->stream.job_id[0]) {
        return false;
    }
    for (size_t i = 0; i < kept->n_fields; i++) {
        const char *value = response->headers[i].value;
        size_t length = kept->fields[i].length;

        if (kept->fields[i].name != response->headers[i].name || strlen(value) != length ||
            (memcmp(value, kept->fields[i].value, length) != 0 &&
             value[strcspn(value, "\r\n\t")])) {
            return false;
        }
    }
    return true;
}

struct MHD_Response *kept_again(struct exchange *exchange)
{
    struct api_response *response = &exchange->response;
    struct kept *kept = exchange->connection->kept;

    if (!kept || !kept->response || exchange->close || !is_alike(kept, response)) {
        return NULL;
    }
    for (size_t i = 0; i < kept->n_fields; i++) {
        memcpy(kept->fields[i].value, response->headers[i].value, kept->fields[i].length);
    }
    if (response->body) {
        memcpy(kept->body, response->body, response->body_size);
        free(response->body);
        response->body = NULL;
    }
    return kept->response;
}

/* ---- Keeping it ------------------------------------------------------------------------------ */

struct taking {
    struct kept *kept;
    const struct api_response *response;
};

/* Notes where the next field's value lies; stops where it is another than was given. */
static enum MHD_Result take_field(void *cls, enum MHD_ValueKind kind, const char *name,
                                  const char *value)
{
    struct taking *taking = cls;
    struct kept *kept = taking->kept;
    size_t i = kept->n_fields;
    union {
        const char *given;
        char *ours;
    } text = {value};

    (void)kind;
    if (i == taking->response->n_headers || !value ||
        strcmp(taking->response->headers[i].name, name) != 0 ||
        strcmp(taking->response->headers[i].value, value) != 0) {
        kept->n_fields = SIZE_MAX;
        return MHD_NO;
    }
    kept->fields[i].name = taking->response->headers[i].name;
    kept->fields[i].value = text.ours;
    kept->fields[i].length = strlen(value);
    kept->n_fields++;
    return MHD_YES;
}

static void let_go(struct kept *kept)
{
    if (kept && kept->response) {
        MHD_destroy_response(kept->response);
        kept->response = NULL;
    }
}

void kept_keep(struct exchange *exchange, struct MHD_Response *mhd, unsigned char *body)
{
    struct connection *connection = exchange->connection;
    const struct api_response *response = &exchange->response;
    struct taking taking = {connection->kept, response};

    let_go(connection->kept);
    if (connection->frame.heads < 2 || exchange->close || response->n_headers > FIELDS_MAX ||
        (!response->static_body && response->body_size > BODY_MAX)) {
        return;
    }
    if (!taking.kept) {
        taking.kept = connection->kept = calloc(1, sizeof *taking.kept);
    }
    if (!taking.kept) {
        return;
    }
    taking.kept->n_fields = 0;
    (void)MHD_get_response_headers(mhd, take_field, &taking);
    if (taking.kept->n_fields == response->n_headers) {
        taking.kept->response = mhd;
        taking.kept->static_body = response->static_body;
        taking.kept->body = body;
        taking.kept->body_size = response->body_size;
    }
}

bool kept_has(const struct connection *connection, const struct MHD_Response *mhd)
{
    return connection->kept && connection->kept->response == mhd;
}

void kept_drop(struct connection *connection)
{
    let_go(connection->kept);
    free(connection->kept);
    connection->kept = NULL;
}
