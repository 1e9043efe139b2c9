/*
 * json.h - JSON as glTF needs it: a text is cut into an array of tokens, which are walked in place.
 *
 * Why not jansson: it builds a tree of blocks from malloc, forty bytes and more for each number,
 * beyond the limit of memory of a read, and its allocator can only be changed for a whole process.
 * Here a value takes 16 bytes, charged to the read.
 */
#ifndef SRNF_FORMATS_JSON_H
#define SRNF_FORMATS_JSON_H

#include "formats.h"

enum json_type { JSON_OBJECT, JSON_ARRAY, JSON_STRING, JSON_WORD }; /* a word: number, true, null */

struct json_token {
    uint32_t begin, end; /* in the text: without the quotes of a string */
    uint32_t after;      /* the next token that is not inside this one */
    uint32_t type;
};

struct json {
    struct mesh_reader *reader;
    const unsigned char *text;
    size_t size, at;
    struct json_token *tokens;
    size_t n, capacity;
};

/* A token's number; JSON_NONE: there is no such value. The root is 0. */
#define JSON_NONE UINT32_MAX

/* Cuts a text; json_close must follow in any case. Errors: SRNF_EPARSE, SRNF_ELIMIT (nested deeper
   than 64), those of mesh_alloc, SRNF_ECANCELED. */
SRNF_CHECKED int json_open(struct json *json, struct mesh_reader *reader, const unsigned char *text,
                           size_t size);
void json_close(struct json *json);

/* The member of an object (the first of that name), or JSON_NONE. */
uint32_t json_member(const struct json *json, uint32_t object, const char *name);
/* Walks an array: its first element or JSON_NONE, and the one after. */
uint32_t json_first(const struct json *json, uint32_t array);
uint32_t json_next(const struct json *json, uint32_t array, uint32_t element);
/* Elements of an array; 0 of anything else. */
size_t json_length(const struct json *json, uint32_t array);

struct token json_text(const struct json *json, uint32_t value);
/* A number, or the fallback where there is none: false where there is something else. */
bool json_number(const struct json *json, uint32_t value, double *number);
bool json_count(const struct json *json, uint32_t value, size_t *count);
/* The text of a string is this one. */
bool json_is(const struct json *json, uint32_t value, const char *text);

#endif
