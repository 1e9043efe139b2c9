/*
 * request_ids.c - ids for requests that bring none: a random start, the daemon's own, and a count.
 * No two are the same, and none costs a system call.
 */
#include "http/internal.h"

#include "digits.h"

#include <sodium.h>
#include <string.h>

void request_ids_start(struct http *http)
{
    unsigned char bytes[6];

    randombytes_buf(bytes, sizeof bytes);
    (void)sodium_bin2hex(http->id_start, sizeof http->id_start, bytes, sizeof bytes);
}

void request_id_make(struct http *http, char id[40])
{
    unsigned long long count = atomic_fetch_add_explicit(&http->ids, 1, memory_order_relaxed);

    memcpy(id, "req-", 4);
    memcpy(id + 4, http->id_start, sizeof http->id_start - 1);
    (void)digits_hex48(id + 4 + sizeof http->id_start - 1, count);
}
