/*
 * json.c - cuts a JSON text into tokens (see json.h).
 *
 * RFC 8259, read leniently where that does no harm: words are checked only when they are taken as
 * numbers, and escapes of strings are left as they are, since no name that glTF defines has any.
 * One pass with a stack of the containers that are open.
 */
#include "json.h"

#include <string.h>

#define DEPTH_MAX 64
#define FIRST_CAPACITY ((size_t)256)

static int fail(struct json *json, const char *what)
{
    return srnf_fail(json->reader->error, SRNF_EPARSE, (int64_t)json->at, "JSON, byte %zu: %s",
                     json->at, what);
}

static void skip_space(struct json *json)
{
    while (json->at < json->size &&
           (json->text[json->at] == ' ' || json->text[json->at] == '\t' ||
            json->text[json->at] == '\n' || json->text[json->at] == '\r')) {
        json->at++;
    }
}

static bool take(struct json *json, unsigned char c)
{
    skip_space(json);
    if (json->at < json->size && json->text[json->at] == c) {
        json->at++;
        return true;
    }
    return false;
}

static int add(struct json *json, enum json_type type, size_t begin)
{
    if (json->n == json->capacity) {
        size_t capacity =
            json->capacity < FIRST_CAPACITY ? FIRST_CAPACITY : json->capacity + json->capacity / 2;
        struct json_token *grown = mesh_alloc(json->reader, capacity, sizeof *grown);

        if (!grown) {
            return json->reader->status;
        }
        if (json->n > 0) {
            memcpy(grown, json->tokens, json->n * sizeof *grown);
        }
        mesh_release(json->reader, json->tokens, json->capacity, sizeof *grown);
        json->tokens = grown;
        json->capacity = capacity;
    }
    json->tokens[json->n] = (struct json_token){.begin = (uint32_t)begin,
                                                .end = (uint32_t)begin,
                                                .after = (uint32_t)json->n + 1,
                                                .type = type};
    json->n++;
    return mesh_step(json->reader);
}

static int take_string(struct json *json)
{
    size_t begin = ++json->at;
    int status = add(json, JSON_STRING, begin);

    if (status != SRNF_OK) {
        return status;
    }
    while (json->at < json->size && json->text[json->at] != '"') {
        json->at += json->text[json->at] == '\\' ? 2 : 1;
    }
    if (json->at >= json->size) {
        json->at = json->size;
        return fail(json, "a string does not end");
    }
    json->tokens[json->n - 1].end = (uint32_t)json->at++;
    return SRNF_OK;
}

static int take_word(struct json *json)
{
    size_t begin = json->at;
    int status = add(json, JSON_WORD, begin);

    while (json->at < json->size && !strchr(" \t\r\n,]}:\"[{", json->text[json->at])) {
        json->at++;
    }
    if (status == SRNF_OK && json->at == begin) {
        return fail(json, "a value is missing");
    }
    if (status == SRNF_OK) {
        json->tokens[json->n - 1].end = (uint32_t)json->at;
    }
    return status;
}

static int take_name(struct json *json)
{
    int status;

    skip_space(json);
    if (json->at == json->size || json->text[json->at] != '"') {
        return fail(json, "the name of a member is missing");
    }
    status = take_string(json);
    return status == SRNF_OK && !take(json, ':') ? fail(json, "a colon is missing") : status;
}

/* The containers that are open. */
struct stack {
    uint32_t open[DEPTH_MAX];
    size_t depth;
};

/* Takes a value, or the beginning of one that holds others. */
static int take_value(struct json *json, struct stack *stack)
{
    unsigned char c;
    int status;

    skip_space(json);
    c = json->at < json->size ? json->text[json->at] : 0;
    if (c == '"') {
        return take_string(json);
    }
    if (c != '{' && c != '[') {
        return take_word(json);
    }
    if (stack->depth == DEPTH_MAX) {
        return srnf_fail(json->reader->error, SRNF_ELIMIT, DEPTH_MAX,
                         "JSON values are nested deeper than %d", DEPTH_MAX);
    }
    stack->open[stack->depth++] = (uint32_t)json->n;
    status = add(json, c == '{' ? JSON_OBJECT : JSON_ARRAY, json->at++);
    return status;
}

/* Closes what ends here; *more: another value follows. */
static int after_value(struct json *json, struct stack *stack, bool *more)
{
    *more = false;
    while (stack->depth > 0) {
        uint32_t open = stack->open[stack->depth - 1];
        bool object = json->tokens[open].type == JSON_OBJECT;
        bool empty = json->n == (size_t)open + 1;

        if (take(json, object ? '}' : ']')) {
            json->tokens[open].end = (uint32_t)json->at;
            json->tokens[open].after = (uint32_t)json->n;
            stack->depth--;
            continue;
        }
        if (!empty && !take(json, ',')) {
            return fail(json, "a comma or the end of an object or array is missing");
        }
        *more = true;
        return object ? take_name(json) : SRNF_OK;
    }
    return SRNF_OK;
}

int json_open(struct json *json, struct mesh_reader *reader, const unsigned char *text, size_t size)
{
    struct stack stack = {.depth = 0};
    bool more = true;
    int status = SRNF_OK;

    *json = (struct json){.reader = reader, .text = text, .size = size};
    if (size >= UINT32_MAX / 2) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1, "the JSON text is too long");
    }
    while (more && status == SRNF_OK) {
        status = take_value(json, &stack);
        if (status == SRNF_OK) {
            status = after_value(json, &stack, &more);
        }
    }
    skip_space(json);
    if (status == SRNF_OK && json->at < size && json->text[json->at] != 0) {
        status = fail(json, "something follows behind the document");
    }
    return status;
}

void json_close(struct json *json)
{
    mesh_release(json->reader, json->tokens, json->capacity, sizeof *json->tokens);
    json->tokens = NULL;
}

struct token json_text(const struct json *json, uint32_t value)
{
    const struct json_token *token = &json->tokens[value];

    return (struct token){json->text + token->begin, token->end - token->begin};
}

bool json_is(const struct json *json, uint32_t value, const char *text)
{
    struct token token;

    if (value == JSON_NONE || json->tokens[value].type != JSON_STRING) {
        return false;
    }
    token = json_text(json, value);
    return token.size == strlen(text) && memcmp(token.text, text, token.size) == 0;
}

uint32_t json_member(const struct json *json, uint32_t object, const char *name)
{
    if (object == JSON_NONE || json->tokens[object].type != JSON_OBJECT) {
        return JSON_NONE;
    }
    for (uint32_t at = object + 1; at < json->tokens[object].after;
         at = json->tokens[at + 1].after) {
        if (json_is(json, at, name)) {
            return at + 1;
        }
    }
    return JSON_NONE;
}

uint32_t json_first(const struct json *json, uint32_t array)
{
    if (array == JSON_NONE || json->tokens[array].type != JSON_ARRAY ||
        json->tokens[array].after == array + 1) {
        return JSON_NONE;
    }
    return array + 1;
}

uint32_t json_next(const struct json *json, uint32_t array, uint32_t element)
{
    uint32_t next = json->tokens[element].after;

    return next < json->tokens[array].after ? next : JSON_NONE;
}

size_t json_length(const struct json *json, uint32_t array)
{
    size_t n = 0;

    for (uint32_t at = json_first(json, array); at != JSON_NONE; at = json_next(json, array, at)) {
        n++;
    }
    return n;
}

bool json_number(const struct json *json, uint32_t value, double *number)
{
    if (value == JSON_NONE) {
        return true;
    }
    return json->tokens[value].type == JSON_WORD &&
           token_number(json_text(json, value), json->reader->locale, number);
}

bool json_count(const struct json *json, uint32_t value, size_t *count)
{
    double number = (double)*count;
    int64_t whole = 0;

    if (!json_number(json, value, &number) || !scalar_whole(number, &whole) || whole < 0) {
        return false;
    }
    *count = (size_t)whole;
    return true;
}
