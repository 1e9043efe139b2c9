/*
 * respond.h - what is rarer than the responses of handler.h: a response without a call, and the
 * parsing of queries, names and lists of tokens.
 */
#ifndef SRNFD_API_RESPOND_H
#define SRNFD_API_RESPOND_H

#include "api/handler.h"

/* Fills status, Content-Type and body from a document that it takes over. Without a document, or
   when it cannot be dumped, the response becomes a fixed 500, or 503 for want of memory. */
void response_json(struct api_response *response, int status, const char *content_type,
                   json_t *document);

/* Decodes %XX (and '+' as a space where plus_is_space) from [text, text + length) into buffer.
   False where an escape is broken or stands for a zero byte, or where the buffer is too small. */
bool percent_decode(const char *text, size_t length, bool plus_is_space, char *buffer, size_t size);

/* Takes the header back that was added last. */
void api_response_drop_last(struct api_response *response);

/* As respond_not_modified, for what will never be another under its address: it may be kept for
   good by whoever may see it. */
bool respond_not_modified_ever(struct api_call *call, const char *tag);

/* Steps through name=value pairs of a query: sets the pair at *cursor and moves on; false at the
   end. */
struct query_pair {
    const char *name, *value;
    size_t name_length, value_length;
};
bool query_next(const char **cursor, struct query_pair *pair);

/* A whole number of the query: one to nine digits and nothing else. */
bool query_whole(const char *text, long *number);

/* A number of the query at *text, decimal as JSON's, with a sign or without, and moves on past it.
   False where there is none, as for hexadecimal ones, infinities and NaN. */
bool query_number(const char **text, double *number);

/* What is wrong with a name in UTF-8, or NULL; and the bytes that a good one has at most. */
#define NAME_CHARACTERS_MAX 255
#define NAME_SIZE (4 * NAME_CHARACTERS_MAX + 1)
const char *name_problem(const char *name);

/* Whether the comma-separated list has the token, without regard to case. */
bool list_has(const char *list, const char *token);
/* The same with regard to case. */
bool list_has_exactly(const char *list, const char *token);

/* Whether a mesh may come under this media type of that length (meshes.c). */
bool mesh_type_known(const char *type, size_t length);

#endif
