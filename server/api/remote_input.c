/*
 * remote_input.c - a link of an input to another server: what it leads to is fetched and becomes a
 * mesh or volume of the caller, exactly as if the caller had uploaded it (remote.h).
 *
 * It is fetched before the job is accepted, on a thread for uploads, while its memory is charged to
 * their account. So an accepted job knows its input by the digest of its bytes: it runs again after
 * a crash without that server, and the same link may stand for another mesh tomorrow. What was
 * fetched stays when the execution is refused for what only its content showed, as an upload does.
 */
#include "api/remote.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/imports.h"
#include "api/routes.h"
#include "api/volumes.h"
#include "clock.h"
#include "jobs/memory.h"
#include "log.h"
#include "store/mesh.h"
#include "store/volume.h"

/* A fetched mesh or volume is read by a request of its own, for the same caller. */
struct upload {
    struct api_header headers[1];
    struct api_request request;
    struct api_response response;
    struct api_call call;
    char name[NAME_SIZE], query[48];
};

/* The path of the address without its query, decoded as far as it can be. */
static void path_of(const char *url, char path[REMOTE_URL_MAX])
{
    const char *host = strstr(url, "://") + 3;
    size_t skip = strcspn(host, "/");

    if (!percent_decode(host + skip, strcspn(host + skip, "?"), false, path, REMOTE_URL_MAX)) {
        path[0] = '\0';
    }
}

/* type: as the link says, or else the server. */
static void prepare(struct upload *upload, struct api_call *call, const struct import_given *given)
{
    const char *dot = strrchr(given->path, '.');

    memset(upload, 0, sizeof *upload);
    upload->request = (struct api_request){.method = "POST",
                                           .path = call->request->path,
                                           .query = upload->query,
                                           .body = given->bytes,
                                           .body_size = given->size,
                                           .caller = call->request->caller};
    upload->call = (struct api_call){
        .api = call->api, .request = &upload->request, .response = &upload->response};
    import_name_of(given->path, upload->name);
    if (srnf_mesh_sniff(given->bytes, given->size) == SRNF_MESH_UNKNOWN && dot &&
        strlen(dot) < 16 && srnf_mesh_format_from_name(dot + 1) != SRNF_MESH_UNKNOWN) {
        (void)snprintf(upload->query, sizeof upload->query, "format=%s", dot + 1);
    } else if (mesh_type_known(given->type, strlen(given->type))) {
        upload->headers[0] = (struct api_header){"Content-Type", given->type};
        upload->request.headers = upload->headers;
        upload->request.n_headers = 1;
    }
}

/* The problem that was answered to the upload becomes that of the execution. */
static void pass_on(struct api_call *call, const struct upload *upload, const char *pointer)
{
    const struct api_response *response = &upload->response;
    json_t *problem = response->body
                          ? json_loadb((const char *)response->body, response->body_size, 0, NULL)
                          : NULL;
    const char *code = json_string_value(json_object_get(problem, "code"));
    const char *detail = json_string_value(json_object_get(problem, "detail"));

    (void)problem_respond(call, code && problem_known(code) ? code : "out-of-memory",
                          "%s, what its link leads to: %.380s", pointer,
                          detail ? detail : "there is no memory for it");
    json_decref(problem);
}

/* Keeps the bytes; the id of what they are (new reference), or NULL with a problem answered. */
static json_t *keep(struct api_call *call, const struct import_given *given, const char *pointer)
{
    struct upload *upload = malloc(sizeof *upload);
    struct store_volume volume = {.id = ""};
    struct store_mesh mesh = {0};
    const char *id = NULL;
    json_t *text = NULL;
    bool created;

    if (!upload) {
        (void)problem_respond(call, "out-of-memory", "There is not enough memory for this.");
        return NULL;
    }
    prepare(upload, call, given);
    if (import_is_volume(given)) {
        id = volume_keep_body(&upload->call, upload->name, &volume, &created) ? volume.id : NULL;
    } else {
        id = mesh_keep_body(&upload->call, upload->name, &mesh, &created) ? mesh.id : NULL;
    }
    if (id) {
        text = json_string(id);
    } else {
        pass_on(call, upload, pointer);
    }
    store_volume_clear(&volume);
    store_mesh_clear(&mesh);
    api_response_clear(&upload->response);
    free(upload);
    return text;
}

/* Bytes that it may have: those of the body of an upload of this caller. */
static size_t most_bytes(const struct api_call *call)
{
    int64_t quota = call->request->caller.quotas[STORE_QUOTA_BYTES];
    size_t most = call->api->config.max_body;

    return quota > 0 && (uint64_t)quota < most ? (size_t)quota : most;
}

static void refuse(struct api_call *call, enum remote_result result, const char *pointer,
                   const char *detail)
{
    switch (result) {
    case REMOTE_NO_MEMORY:
        (void)problem_respond(call, "out-of-memory",
                              "%s: there is not enough memory for what its link leads to.",
                              pointer);
        break;
    case REMOTE_STOPPED:
        (void)problem_respond(call, "shutting-down", "Fetching was stopped.");
        break;
    default:
        (void)problem_respond(call, result == REMOTE_TOO_LARGE ? "body-too-large" : "link-failed",
                              "%s: what its link leads to was not fetched: %s.", pointer, detail);
        break;
    }
}

/* Addresses have names in them, which are for no log: the host is enough. */
static void log_fetch(const struct api_call *call, const char *url, enum remote_result result,
                      const struct remote_content *content, double seconds)
{
    const char *host = strstr(url, "://") + 3;
    char text[256];

    (void)snprintf(text, sizeof text, "%.*s", (int)strcspn(host, "/?"), host);
    if (result == REMOTE_FETCHED) {
        LOG("link-fetched", log_text("request", call->request->id), log_text("host", text),
            log_number("bytes", (double)content->size), log_number("ms", 1e3 * seconds));
    } else {
        LOG_WARN("link-failed", log_text("request", call->request->id), log_text("host", text),
                 log_text("detail", content->detail), log_number("ms", 1e3 * seconds));
    }
}

json_t *remote_input(struct api_call *call, const char *href, const char *type, const char *pointer,
                     double *seconds)
{
    struct remote_content content;
    char url[REMOTE_URL_MAX], path[REMOTE_URL_MAX];
    double began = clock_now(), took;
    enum remote_result result;
    json_t *id = NULL;

    if (!remote_permits(call->api->remote, href, url)) { /* only the caller's fault */
        (void)problem_respond(call, "internal-error", "%s: its link is not permitted.", pointer);
        return NULL;
    }
    result = remote_fetch(call->api->remote, url, most_bytes(call), *seconds, &content);
    took = clock_now() - began;
    *seconds -= took;
    log_fetch(call, url, result, &content, took);
    if (result == REMOTE_FETCHED) {
        const struct import_given given = {.path = path,
                                           .type = type ? type : content.type,
                                           .bytes = content.bytes,
                                           .size = content.size};

        path_of(url, path);
        id = keep(call, &given, pointer);
    } else {
        refuse(call, result, pointer, content.detail);
    }
    remote_clear(&content);
    return id;
}
