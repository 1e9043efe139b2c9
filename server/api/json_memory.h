/*
 * json_memory.h - whether JSON was built in full. Building a document takes hundreds of small
 * allocations whose failures nobody looks at one by one; here they are noted, once for all.
 */
#ifndef SRNFD_API_JSON_MEMORY_H
#define SRNFD_API_JSON_MEMORY_H

#include <stdbool.h>
#include <stdlib.h>

#include <jansson.h>

/* Makes jansson allocate through this file: once, before other threads use it. */
void json_memory_watch(void);
/* The calling thread begins something new: no allocation of its own has failed yet, and what
   documents were charged is given back. */
void json_memory_begin(void);
/* Whether one has since then: what was built may lack members, and what was parsed may be valid. */
bool json_memory_failed(void);

/* The same for what else a document needs and cannot have, such as a row that could not be read:
   from now on it lacks something. */
void json_memory_fail(void);

/*
 * json_loadb of a text, which jansson may read with characters missing where memory is short: NULL
 * then, with the flag set. A text of a few MiB may hold a document of a GiB; one that would take
 * more than `budget` bytes is given up as soon as it does: NULL, *over set, the flag not.
 * Where the thread has an account (jobs/memory.h), it is charged twice what the document takes, for
 * that and for what is made of it, until json_memory_begin; where the account has no room, the
 * document is given up as if memory were short.
 *   budget  [in] bytes; 0: any
 *   over    [out] NULL where no budget is given
 */
json_t *json_memory_load(const char *text, size_t size, size_t budget, bool *over,
                         json_error_t *error);
/* json_dumps of what was built in full; NULL otherwise, with the flag set. */
char *json_memory_dumps(const json_t *document, size_t flags);

#endif
