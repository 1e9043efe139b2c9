/*
 * json_memory.c - an allocator for jansson that remembers, for each thread, that it has failed.
 *
 * jansson tells of a failure by NULL or -1, deep in code that builds an answer member by member. A
 * member that is missing because memory was short would make a wrong answer, or a wrong row, of a
 * right one, and so would a name that was read without its last letter. So nothing built since
 * json_memory_begin is sent or kept once the flag is up.
 *
 * While a text is read, what its document takes is counted, as the allocator rounds it, and an
 * allocation beyond the budget fails on purpose.
 *
 * Flag and count are thread-local: a request or a job is built on one thread from begin to end.
 */
#include "api/json_memory.h"

#include <malloc.h>

#include "jobs/memory.h"

#define CHARGE_STEP ((size_t)1 << 20) /* bytes */
#define CHARGE_PARTS 2 /* of them for each of a document: it, and what is made of it */

static _Thread_local bool failed;
static _Thread_local bool exceeded;          /* the budget of the text that is being read */
static _Thread_local size_t budget_left = 0; /* while `reading` */
static _Thread_local bool reading;
/* What documents were charged to the thread's account, and how much of that is not used yet. */
static _Thread_local struct jobs_memory *account;
static _Thread_local size_t charged, charge_left;

/* Charges steps until there is room for so many bytes more. */
static bool charge(size_t bytes)
{
    while (account && charge_left < bytes) {
        if (!jobs_memory_charge(account, CHARGE_PARTS * CHARGE_STEP)) {
            return false;
        }
        charged += CHARGE_PARTS * CHARGE_STEP;
        charge_left += CHARGE_STEP;
    }
    charge_left -= account ? bytes : 0;
    return true;
}

static void give_back(void)
{
    if (account) {
        jobs_memory_discharge(account, charged);
    }
    account = NULL;
    charged = charge_left = 0;
}

static void *allocate(size_t size)
{
    void *bytes = exceeded ? NULL : malloc(size);
    size_t taken = malloc_usable_size(bytes);

    failed = failed || (!bytes && size > 0);
    if (reading && bytes && !charge(taken)) {
        free(bytes);
        bytes = NULL;
        failed = true;
    }
    if (reading && bytes) {
        exceeded = taken > budget_left;
        budget_left -= exceeded ? budget_left : taken;
    }
    return bytes;
}

static void release(void *bytes)
{
    if (reading && bytes) {
        budget_left += malloc_usable_size(bytes);
        charge_left += account ? malloc_usable_size(bytes) : 0;
    }
    free(bytes);
}

void json_memory_watch(void)
{
    json_set_alloc_funcs(allocate, release);
}

void json_memory_begin(void)
{
    failed = false;
    give_back();
}

bool json_memory_failed(void)
{
    return failed;
}

void json_memory_fail(void)
{
    failed = true;
}

json_t *json_memory_load(const char *text, size_t size, size_t budget, bool *over,
                         json_error_t *error)
{
    json_t *document = NULL;
    bool beyond;

    if (!failed) {
        budget_left = budget;
        reading = budget > 0;
        if (reading) { /* otherwise what was charged before is still to be given back */
            account = jobs_memory_current();
        }
        document = json_loadb(text, size, JSON_REJECT_DUPLICATES, error);
        reading = false;
    }
    beyond = exceeded;
    exceeded = false;
    if (failed || beyond) {
        json_decref(document);
        document = NULL;
    }
    if (beyond) {
        failed = false; /* by its budget, and for nothing else */
    }
    if (over) {
        *over = beyond;
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
