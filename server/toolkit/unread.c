/*
 * unread.c - what a run could not read: its results are not made, and it fails by that name.
 */
#include "toolkit/process.h"

#include "api/json_memory.h"
#include "compute/compute.h"

/* The first status of the store with which process_read could not read, of the thread's run. */
static _Thread_local int unread;

bool process_read(int status)
{
    if (status != STORE_OK && status != STORE_NOT_FOUND) {
        unread = unread ? unread : status;
        json_memory_fail();
    }
    return status == STORE_OK;
}

void process_fail_document(struct jobs_result *result, const char *what)
{
    (void)compute_fail(result, unread ? unread : SRNF_ENOMEM, NULL, what);
}

void process_read_begin(void)
{
    unread = STORE_OK;
    json_memory_begin();
}
