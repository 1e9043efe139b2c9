/*
 * request_ids.c - ids for requests that bring none.
 *
 * Each is 96 bits of ChaCha20 by a key drawn at the start: no two are the same but by a chance of
 * one in 10^9 in a day of 10^5 a second, nobody counts others' requests by them, and none costs a
 * system call. A thread makes some at once, with the number of the batch as nonce.
 */
#include "http/internal.h"

#include <sodium.h>
#include <string.h>

#define ID_BYTES ((size_t)12)
#define BATCH ((size_t)64)

void request_ids_start(struct http *http)
{
    crypto_stream_chacha20_keygen(http->id_key);
}

/* Ids that the thread has made and not given out; those of another service are not used. */
static _Thread_local struct {
    unsigned char bytes[BATCH * ID_BYTES], key[crypto_stream_chacha20_KEYBYTES];
    size_t left;
} made;

static void make_batch(struct http *http)
{
    unsigned long long count = atomic_fetch_add_explicit(&http->ids, 1, memory_order_relaxed);
    unsigned char nonce[crypto_stream_chacha20_NONCEBYTES] = {0};

    _Static_assert(sizeof count <= sizeof nonce, "a nonce holds the number of a batch");
    memcpy(nonce, &count, sizeof count);
    (void)crypto_stream_chacha20(made.bytes, sizeof made.bytes, nonce, http->id_key);
    memcpy(made.key, http->id_key, sizeof made.key);
    made.left = BATCH;
}

void request_id_make(struct http *http, char id[40])
{
    static const char digits[] = "0123456789abcdef";
    const unsigned char *bytes;

    if (made.left == 0 || memcmp(made.key, http->id_key, sizeof made.key) != 0) {
        make_batch(http);
    }
    bytes = made.bytes + --made.left * ID_BYTES;
    memcpy(id, "req-", 4);
    for (size_t i = 0; i < ID_BYTES; i++) {
        id[4 + 2 * i] = digits[bytes[i] >> 4];
        id[5 + 2 * i] = digits[bytes[i] & 15];
    }
    id[4 + 2 * ID_BYTES] = '\0';
}
