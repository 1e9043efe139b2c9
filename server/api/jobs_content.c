/*
 * jobs_content.c - an output that is a file, such as a report: by itself it is given as that file,
 * under the media type that its schema names (contentMediaType).
 *
 * A page of HTML has been made from what callers sent. It has a policy of its own; here the browser
 * is told besides to take it as a page of no origin, which reaches nothing of this service.
 */
#include "api/job_answers.h"

#include "api/framing.h"
#include "store/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TYPE_MAX 64

/* The media type that the process gives the output. False: it is JSON like all others. */
static bool find_type(const struct api_call *call, const struct store_job *job, const char *name,
                      char type[TYPE_MAX])
{
    const struct api_process *process = api_process_find(call->api, job->process);
    json_t *schema = process ? call->api->config.processes->outputs_schema(process->table) : NULL;
    const json_t *output = json_object_get(json_object_get(schema, "properties"), name);
    const char *text = json_string_value(json_object_get(output, "contentMediaType"));
    bool found = text && strlen(text) < TYPE_MAX;

    if (found) {
        memcpy(type, text, strlen(text) + 1);
    }
    json_decref(schema);
    return found;
}

/* Whatever the text is, and were it restored from an archive that somebody forged: it is a page of
   no origin, which asks no server for anything. A report's own policy is narrower. */
static const char policy[] =
    "sandbox allow-scripts allow-downloads; default-src 'none'; img-src data: blob:; "
    "style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

static void respond_text(struct api_call *call, const struct store_job *job, const char *type,
                         const json_t *text)
{
    size_t size = json_string_length(text);
    unsigned char *bytes = malloc(size + 1);
    char full[TYPE_MAX + 16];

    if (!bytes) {
        (void)problem_respond(call, "out-of-memory", "The output does not fit into memory now.");
        return;
    }
    memcpy(bytes, json_string_value(text), size + 1);
    (void)snprintf(full, sizeof full, "%s; charset=utf-8", type);
    (void)api_response_header_text(call->response, "Content-Security-Policy", policy);
    (void)api_response_header_text(call->response, "Referrer-Policy", "no-referrer");
    (void)api_response_header(call->response, "Content-Disposition", "inline; filename=\"%s.%s\"",
                              job->id, strcmp(type, "text/html") == 0 ? "html" : "txt");
    respond_bytes(call, 200, full, bytes, size);
}

bool job_respond_content(struct api_call *call, const struct store_job *job,
                         const struct framing_member *member)
{
    char type[TYPE_MAX];
    json_t *text;

    if (!find_type(call, job, call->parameters[1], type)) {
        return false;
    }
    text = json_loadb(member->value, member->length, JSON_DECODE_ANY, NULL);
    if (json_is_string(text)) {
        respond_text(call, job, type, text);
    } else {
        (void)problem_respond(call, "out-of-memory", "The output does not fit into memory now.");
    }
    json_decref(text);
    return true;
}
