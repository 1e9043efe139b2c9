/*
 * json_memory.c - an allocator for jansson that remembers, for each thread, that it has failed.
 *
 * jansson tells of a failure by NULL or -1, deep in code that builds an answer member by member. A
 * member that is missing because memory was short would make a wrong answer, or a wrong row, of a
 * right one, and so would a name that was read without its last letter. So nothing built since
 * json_memory_begin is sent or kept once the flag is up.
 *
 * The flag is thread-local: a request or a job is built on one thread from begin to end.
 */
#include "api/json_memory.h"

static _Thread_local bool failed;

static void *allocate(size_t size)
{
    void *bytes = malloc(size);

    failed = failed || (!bytes && size > 0);
    return bytes;
}

void json_memory_watch(void)
{
    json_set_alloc_funcs(allocate, free);
}

void json_memory_begin(void)
{
    failed = false;
}

bool json_memory_failed(void)
{
    return failed;
}

void json_memory_fail(void)
{
    failed = true;
}

json_t *json_memory_load(const char *text, size_t size, json_error_t *error)
{
    json_t *document = failed ? NULL : json_loadb(text, size, JSON_REJECT_DUPLICATES, error);

    if (failed) {
        json_decref(document);
        document = NULL;
    }
    return document;
}

char *json_memory_dumps(const json_t *document, size_t flags)
{
    char *text = failed || !document ? NULL : json_dumps(document, flags);

    if (failed) {
        free(text);
        text = NULL;
    }
    return text;
}
