/*
 * framing.c - results as an execution asks for them (framing.h).
 *
 * Results are stored as the text of one object whose members are the outputs. They can be large,
 * so they are not parsed: the text is walked from member to member, and what is answered is put
 * together from pieces of it. In a document of the standard an object is {"value": object}, since
 * an object by itself would be read as a link or a qualified value; everything else is as it is,
 * and what has no value is absent.
 *
 * An output by reference is a link to /v1/jobs/{id}/results/{output}. Several raw outputs are the
 * parts of a multipart/related; if all are by reference they are Link headers of a 204.
 */
#include "api/framing.h"

#include "api/respond.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LINKS_MAX 12 /* headers of a 204 */

static const char *const responses[] = {"plain", "document", "raw"};

bool framing_is_plain(const struct framing *framing)
{
    return framing->response == FRAMING_PLAIN && framing->n == 0;
}

/* ---- What is asked for ----------------------------------------------------------------------- */

static bool find_response(const char *text, struct framing *framing)
{
    for (int i = 0; text && i <= FRAMING_RAW; i++) {
        if (strcmp(text, responses[i]) == 0) {
            framing->response = (enum framing_response)i;
            return true;
        }
    }
    return false;
}

static bool has_output(const struct framing *framing, const char *name, size_t length)
{
    for (size_t i = 0; i < framing->n; i++) {
        if (strlen(framing->outputs[i].name) == length &&
            memcmp(framing->outputs[i].name, name, length) == 0) {
            return true;
        }
    }
    return false;
}

static bool add_output(struct framing *framing, const char *name, size_t length, bool reference)
{
    if (framing->n == FRAMING_OUTPUTS_MAX || length == 0 || length >= FRAMING_NAME_MAX) {
        return false;
    }
    memcpy(framing->outputs[framing->n].name, name, length);
    framing->outputs[framing->n].name[length] = '\0';
    framing->outputs[framing->n++].reference = reference;
    return true;
}

static const char *transmission_problem(const json_t *output, bool *reference)
{
    const json_t *mode = json_object_get(output, "transmissionMode");
    const json_t *format = json_object_get(output, "format");
    const char *type = json_string_value(json_object_get(format, "mediaType"));
    const char *text = json_string_value(mode);

    *reference = text && strcmp(text, "reference") == 0;
    if (!json_is_object(output)) {
        return "must be an object";
    }
    if (mode && !*reference && !(text && strcmp(text, "value") == 0)) {
        return "transmissionMode must be value or reference";
    }
    if ((format && !json_is_object(format)) || (type && strcmp(type, "application/json") != 0)) {
        return "format: outputs are application/json; the resources that they name have others";
    }
    return NULL;
}

static void read_outputs(const struct api_call *call, const struct api_process *process,
                         const json_t *outputs, struct framing *framing, struct problem_list *list)
{
    json_t *schema = call->api->config.processes->outputs_schema(process->table);
    const json_t *known = json_object_get(schema, "properties");
    /* jansson's iterators take an object that is not const; they do not change it. */
    json_t *object = (json_t *)(uintptr_t)outputs, *output;
    const char *name;
    char pointer[120];

    json_object_foreach(object, name, output)
    {
        bool reference = false, listed = json_object_get(known, name) != NULL;
        const char *problem =
            listed ? transmission_problem(output, &reference) : "this process has no such output";

        if (!problem && !add_output(framing, name, strlen(name), reference)) {
            problem = "more outputs are asked for than a process has";
        }
        if (problem) {
            (void)snprintf(pointer, sizeof pointer, "/outputs/%.100s", name);
            problem_add(list, pointer, "%s", problem);
        }
    }
    json_decref(schema);
}

void framing_read(const struct api_call *call, const struct api_process *process,
                  const json_t *body, struct framing *framing, struct problem_list *list)
{
    const json_t *response = json_object_get(body, "response");
    const json_t *outputs = json_object_get(body, "outputs");

    *framing = (struct framing){.n = 0};
    if (response && !find_response(json_string_value(response), framing)) {
        problem_add(list, "/response", "must be raw, document or plain");
    }
    if (outputs && !json_is_object(outputs)) {
        problem_add(list, "/outputs", "must be an object with a member for each output");
    } else if (outputs) {
        read_outputs(call, process, outputs, framing, list);
    }
    if (json_object_get(body, "subscriber")) {
        problem_add(list, "/subscriber",
                    "this service calls nobody: poll the job, or follow its events");
    }
}

void framing_write(const struct framing *framing, char text[STORE_FRAMING_MAX])
{
    size_t used = 0;

    text[0] = '\0';
    if (framing_is_plain(framing)) {
        return;
    }
    used = (size_t)snprintf(text, STORE_FRAMING_MAX, "%s", responses[framing->response]);
    for (size_t i = 0; i < framing->n && used < STORE_FRAMING_MAX; i++) {
        used +=
            (size_t)snprintf(text + used, STORE_FRAMING_MAX - used, "%c%s",
                             framing->outputs[i].reference ? '@' : ' ', framing->outputs[i].name);
    }
}

void framing_parse(const char *text, struct framing *framing)
{
    size_t length = strcspn(text, " @");
    char word[16];

    *framing = (struct framing){.n = 0};
    if (length >= sizeof word) {
        return;
    }
    memcpy(word, text, length);
    word[length] = '\0';
    (void)find_response(word, framing);
    for (text += length; *text; text += length) {
        bool reference = *text++ == '@';

        length = strcspn(text, " @");
        (void)add_output(framing, text, length, reference);
    }
}

/* A comma-separated list of names. */
static bool query_outputs(const char *list, struct framing *framing)
{
    bool good = true;

    framing->n = 0;
    while (good && *list) {
        size_t length = strcspn(list, ",");

        /* One output has one place in a document, however often it is named. */
        good = has_output(framing, list, length) || add_output(framing, list, length, false);
        list += length + (list[length] == ',');
    }
    return good;
}

static void check_known(const struct api_call *call, const struct api_process *process,
                        const struct framing *framing, struct problem_list *list)
{
    json_t *schema = process ? call->api->config.processes->outputs_schema(process->table) : NULL;
    const json_t *known = json_object_get(schema, "properties");

    for (size_t i = 0; known && i < framing->n; i++) {
        if (!json_object_get(known, framing->outputs[i].name)) {
            problem_add(list, "/outputs", "this process has no output \"%.60s\"",
                        framing->outputs[i].name);
        }
    }
    json_decref(schema);
}

bool framing_query(struct api_call *call, const struct api_process *process,
                   struct framing *framing)
{
    struct problem_list problems = {.errors = NULL};
    char text[STORE_FRAMING_MAX];
    bool refused = false;

    if (query_get(call, "response", text, sizeof text, &refused)) {
        framing->n = 0;
        if (!find_response(text, framing)) {
            problem_add(&problems, "/response", "must be raw, document or plain");
        }
    }
    if (!refused && query_get(call, "outputs", text, sizeof text, &refused)) {
        if (!query_outputs(text, framing)) {
            problem_add(&problems, "/outputs", "must be names of outputs, separated by commas");
        } else {
            check_known(call, process, framing, &problems);
        }
    }
    if (problems.errors) {
        (void)problem_respond_list(call, "invalid-input", &problems);
        return false;
    }
    return !refused;
}

/* ---- The text of results --------------------------------------------------------------------- */

/* Past a string that begins at text. */
static const char *skip_string(const char *text, const char *end)
{
    for (text++; text < end && *text != '"'; text++) {
        text += *text == '\\';
    }
    return text < end ? text + 1 : end;
}

/* Past a value: to the comma or the bracket after it. */
static const char *skip_value(const char *text, const char *end)
{
    size_t depth = 0;

    while (text < end) {
        if (*text == '"') {
            text = skip_string(text, end);
            continue;
        }
        if (depth == 0 && (*text == ',' || *text == '}')) {
            break;
        }
        depth += *text == '{' || *text == '[';
        depth -= *text == '}' || *text == ']';
        text++;
    }
    return text;
}

/* The member at *at, which begins behind the brace or the comma before it. Results are written
   without spaces. */
static bool next_member(const char **at, const char *end, struct framing_member *member)
{
    const char *text = *at;

    if (text >= end || *text != '"') {
        return false;
    }
    member->name = text + 1;
    text = skip_string(text, end);
    member->name_length = (size_t)(text - member->name) - 1;
    if (text >= end || *text != ':') {
        return false;
    }
    member->value = ++text;
    text = skip_value(text, end);
    member->length = (size_t)(text - member->value);
    *at = text < end ? text + 1 : end;
    return true;
}

bool framing_find(const char *results, size_t size, const char *name, struct framing_member *member)
{
    const char *at = results + 1, *end = results + size;

    while (size > 0 && next_member(&at, end, member)) {
        if (member->name_length == strlen(name) &&
            memcmp(member->name, name, member->name_length) == 0) {
            return true;
        }
    }
    return false;
}

static bool is_null(const struct framing_member *member)
{
    return member->length == 4 && memcmp(member->value, "null", 4) == 0;
}

/* ---- The answers ----------------------------------------------------------------------------- */

struct framed {
    struct framing_member members[2 * FRAMING_OUTPUTS_MAX];
    bool references[2 * FRAMING_OUTPUTS_MAX];
    size_t n;
};

static void take(struct framed *framed, const struct framing_member *member, bool reference)
{
    if (framed->n < sizeof framed->members / sizeof framed->members[0]) {
        framed->members[framed->n] = *member;
        framed->references[framed->n++] = reference;
    }
}

/* The members that were asked for, or all. A framed answer has none that is null. */
static void choose(const struct framing *framing, const char *results, size_t size,
                   struct framed *framed)
{
    const char *at = results + 1, *end = results + size;
    bool all = framing->response == FRAMING_PLAIN;
    struct framing_member member;

    framed->n = 0;
    for (size_t i = 0; i < framing->n; i++) {
        if (framing_find(results, size, framing->outputs[i].name, &member) &&
            (all || framing->n == 1 || !is_null(&member))) {
            take(framed, &member, framing->outputs[i].reference);
        }
    }
    while (framing->n == 0 && size > 0 && next_member(&at, end, &member)) {
        if (all || !is_null(&member)) {
            take(framed, &member, false);
        }
    }
}

static void write_document(FILE *out, const struct framed *framed, const char *job, bool wraps)
{
    for (size_t i = 0; i < framed->n; i++) {
        const struct framing_member *one = &framed->members[i];
        bool wrapped = wraps && one->value[0] == '{';

        (void)fprintf(out, "%c\"%.*s\":", i ? ',' : '{', (int)one->name_length, one->name);
        if (framed->references[i]) {
            (void)fprintf(out,
                          "{\"href\":\"/v1/jobs/%s/results/%.*s\",\"type\":\"application/json\"}",
                          job, (int)one->name_length, one->name);
            continue;
        }
        (void)fputs(wrapped ? "{\"value\":" : "", out);
        (void)fwrite(one->value, 1, one->length, out);
        (void)fputs(wrapped ? "}" : "", out);
    }
    (void)fputs(framed->n ? "}\n" : "{}\n", out);
}

static void write_parts(FILE *out, const struct framed *framed, const char *job)
{
    for (size_t i = 0; i < framed->n; i++) {
        const struct framing_member *one = &framed->members[i];

        (void)fprintf(out, "--%s\r\nContent-ID: <%.*s>\r\n", job, (int)one->name_length, one->name);
        if (framed->references[i]) {
            (void)fprintf(out, "Content-Location: /v1/jobs/%s/results/%.*s\r\n\r\n\r\n", job,
                          (int)one->name_length, one->name);
            continue;
        }
        (void)fputs("Content-Type: application/json\r\n\r\n", out);
        (void)fwrite(one->value, 1, one->length, out);
        (void)fputs("\r\n", out);
    }
    (void)fprintf(out, "--%s--\r\n", job);
}

/* Links in the place of all outputs. */
static bool respond_links(struct api_call *call, const struct framed *framed, const char *job)
{
    bool all = framed->n > 0 && framed->n <= LINKS_MAX;

    for (size_t i = 0; i < framed->n; i++) {
        all = all && framed->references[i];
    }
    for (size_t i = 0; all && i < framed->n; i++) {
        const struct framing_member *one = &framed->members[i];

        (void)api_response_header(
            call->response, "Link", "</v1/jobs/%s/results/%.*s>; rel=\"item\"; title=\"%.*s\"", job,
            (int)one->name_length, one->name, (int)one->name_length, one->name);
    }
    if (all) {
        call->response->status = 204;
    }
    return all;
}

/* What was chosen as one text (malloc), or NULL. */
static char *write_framed(const struct framing *framing, const struct framed *framed,
                          const char *job, size_t *size)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, size);
    bool failed = !out;

    if (out && framing->response == FRAMING_RAW && framed->n == 1) {
        (void)fwrite(framed->members[0].value, 1, framed->members[0].length, out);
        (void)fputc('\n', out);
    } else if (out && framing->response == FRAMING_RAW) {
        write_parts(out, framed, job);
    } else if (out) {
        write_document(out, framed, job, framing->response == FRAMING_DOCUMENT);
    }
    failed = failed || ferror(out) != 0;
    failed = (out && fclose(out) != 0) || failed;
    if (failed) {
        free(text);
        text = NULL;
    }
    return text;
}

void framing_respond(struct api_call *call, const char *job, const struct framing *framing,
                     char *results, size_t size)
{
    char type[128] = "application/json", *text = NULL;
    struct framed *framed = NULL;
    size_t length = 0;

    if (framing_is_plain(framing)) {
        respond_bytes(call, 200, type, (unsigned char *)results, size);
        return;
    }
    framed = malloc(sizeof *framed);
    if (framed) {
        choose(framing, results, size, framed);
    }
    if (framed && framing->response == FRAMING_RAW && respond_links(call, framed, job)) {
        goto out;
    }
    text = framed ? write_framed(framing, framed, job, &length) : NULL;
    if (!text) {
        (void)problem_respond(call, "out-of-memory", "The results do not fit into memory now.");
        goto out;
    }
    if (framing->response == FRAMING_RAW && framed->n != 1) {
        (void)snprintf(type, sizeof type,
                       "multipart/related; type=\"application/json\"; boundary=\"%s\"", job);
    }
    respond_bytes(call, 200, type, (unsigned char *)text, length);
out:
    free(framed);
    free(results);
}
