/*
 * request_ids.c - ids for requests that bring none.
 *
 * Each is 96 bits of ChaCha20 by a key drawn at the start, with the number of the request as nonce:
 * no two are the same but by a chance of one in 10^9 in a day of 10^5 a second, nobody counts
 * others' requests by them, and none costs a system call.
 */
#include "http/internal.h"

#include <sodium.h>
#include <string.h>

#define ID_BYTES 12

void request_ids_start(struct http *http)
{
    crypto_stream_chacha20_keygen(http->id_key);
}

void request_id_make(struct http *http, char id[40])
{
    unsigned long long count = atomic_fetch_add_explicit(&http->ids, 1, memory_order_relaxed);
    unsigned char bytes[ID_BYTES], nonce[crypto_stream_chacha20_NONCEBYTES] = {0};

    _Static_assert(sizeof count <= sizeof nonce, "a nonce holds the number of a request");
    memcpy(nonce, &count, sizeof count);
    (void)crypto_stream_chacha20(bytes, sizeof bytes, nonce, http->id_key);
    memcpy(id, "req-", 4);
    (void)sodium_bin2hex(id + 4, 40 - 4, bytes, sizeof bytes);
}
