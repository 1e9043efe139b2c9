/*
 * ids.c - ids of jobs: UUID version 7 (RFC 9562, section 5.7, method 1 of 6.2).
 *
 *   48 bits milliseconds | 4 bits version | 12 bits counter | 2 bits variant | 62 bits random
 *
 * Within one millisecond the counter grows; when it is full, or the clock has gone back, the time
 * of the last id is carried on. So ids sort as they were given out, which is the order of the
 * queue and of the lists. The time of creation that goes into the row is the one in the id.
 */
#include "jobs/internal.h"

#include "store/store.h"

#include <sodium.h>
#include <stdio.h>

void jobs_id_next(struct jobs_ids *ids, char id[STORE_ID_MAX], int64_t *created_ms)
{
    unsigned char b[16];
    uint64_t now = (uint64_t)store_now_ms();
    unsigned counter;

    randombytes_buf(b, sizeof b);
    pthread_mutex_lock(&ids->mutex);
    if (now > ids->last_ms) {
        ids->last_ms = now;
        ids->counter = 0;
    } else if (++ids->counter > 0xfff) {
        ids->last_ms++;
        ids->counter = 0;
    }
    now = ids->last_ms;
    counter = ids->counter;
    pthread_mutex_unlock(&ids->mutex);

    for (int i = 0; i < 6; i++) {
        b[i] = (unsigned char)(now >> (40 - 8 * i));
    }
    b[6] = (unsigned char)(0x70 | counter >> 8);
    b[7] = (unsigned char)counter;
    b[8] = (unsigned char)(0x80 | (b[8] & 0x3f));
    snprintf(id, STORE_ID_MAX,
             "job-%02x%02x%02x%02x-%02x%02x-%02x%02x-%02x%02x-%02x%02x%02x%02x%02x%02x", b[0], b[1],
             b[2], b[3], b[4], b[5], b[6], b[7], b[8], b[9], b[10], b[11], b[12], b[13], b[14],
             b[15]);
    *created_ms = (int64_t)now;
}
