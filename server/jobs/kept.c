/*
 * kept.c - the checkpoint of a job: the state that its process saves as a whole, and the parts of
 * its computation that the core keeps for a later attempt (srnf_context.recall and keep).
 *
 * Layout, all numbers little-endian: 8 bytes "srnfkept", u64 version, u64 n, u64 bytes of the
 * state, the state, then n times u64 series, u64 index, u64 count and the bits of so many doubles,
 * and u64 FNV-1a of all bytes before it. What is damaged, or not of this form, is as if it were not
 * there; whether a part belongs to what is computed is told by its series.
 *
 * Parts beyond BYTES_MAX are not kept: only a crash would cost more. The state is as large as its
 * process makes it. Both, and as much again while a checkpoint is written, come on top of the
 * memory of the job. When one is written says checkpoint.c.
 *
 * Lock: kept->mutex (rank 25). What was recalled does not change and is read without it.
 */
#include "jobs/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define VERSION 2
#define HEAD ((size_t)32)
#define ENTRY ((size_t)24)           /* before the values */
#define BYTES_MAX ((size_t)64 << 20) /* of entries with their values */
#define PARTS_MAX (BYTES_MAX / (ENTRY + 8))
#define FNV_START UINT64_C(14695981039346656037)
#define FNV_PRIME UINT64_C(1099511628211)

static const unsigned char magic[8] = {'s', 'r', 'n', 'f', 'k', 'e', 'p', 't'};

static void put_u64(unsigned char *bytes, uint64_t x)
{
    for (unsigned i = 0; i < 8; i++) {
        bytes[i] = (unsigned char)(x >> (8 * i));
    }
}

static uint64_t get_u64(const unsigned char *bytes)
{
    uint64_t x = 0;

    for (unsigned i = 0; i < 8; i++) {
        x |= (uint64_t)bytes[i] << (8 * i);
    }
    return x;
}

static uint64_t sum(const unsigned char *bytes, size_t size)
{
    uint64_t hash = FNV_START;

    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ bytes[i]) * FNV_PRIME;
    }
    return hash;
}

static int order(const void *a, const void *b)
{
    const struct jobs_part *x = a, *y = b;

    if (x->series != y->series) {
        return x->series < y->series ? -1 : 1;
    }
    return (x->index > y->index) - (x->index < y->index);
}

static const double *values_of(const struct jobs_part *part)
{
    return part->count == 1 ? &part->one : part->many;
}

static size_t bytes_of(size_t count)
{
    return ENTRY + 8 * count;
}

/* ---- Reading --------------------------------------------------------------------------------- */

/* The entries at bytes, which end at `end`; the values of all are put into kept->old_values, which
   has room for them. False where they do not fill the bytes. */
static bool read_parts(struct jobs_kept *kept, const unsigned char *bytes, const unsigned char *end)
{
    double *values = kept->old_values;

    for (size_t i = 0; i < kept->n; i++) {
        struct jobs_part *part = &kept->parts[i];
        uint64_t count;

        if ((size_t)(end - bytes) < ENTRY) {
            return false;
        }
        count = get_u64(bytes + 16);
        if (count == 0 || count > ((size_t)(end - bytes) - ENTRY) / 8) {
            return false;
        }
        *part = (struct jobs_part){
            .series = get_u64(bytes), .index = get_u64(bytes + 8), .count = (size_t)count};
        part->many = values;
        bytes += ENTRY;
        for (size_t k = 0; k < part->count; k++, bytes += 8) {
            uint64_t bits = get_u64(bytes);

            memcpy(values++, &bits, sizeof bits);
        }
        part->one = part->many[0];
        kept->bytes += bytes_of(part->count);
    }
    return bytes == end;
}

/* As initialized again. */
static void clear(struct jobs_kept *kept)
{
    for (size_t i = 0; kept->parts && i < kept->n; i++) {
        if (kept->parts[i].owned) {
            free(kept->parts[i].many);
        }
    }
    free(kept->parts);
    free(kept->old);
    free(kept->old_values);
    free(kept->state);
    kept->parts = kept->old = NULL;
    kept->old_values = NULL;
    kept->state = NULL;
    kept->n = kept->capacity = kept->recalled = kept->bytes = kept->state_size = 0;
}

bool jobs_kept_read(struct jobs_kept *kept, const unsigned char *bytes, size_t size)
{
    uint64_t n, state;
    bool good;

    if (size < HEAD + 8 || memcmp(bytes, magic, sizeof magic) != 0 ||
        get_u64(bytes + 8) != VERSION || get_u64(bytes + size - 8) != sum(bytes, size - 8)) {
        return false;
    }
    n = get_u64(bytes + 16);
    state = get_u64(bytes + 24);
    if (state > size - HEAD - 8 || n > (size - HEAD - 8 - (size_t)state) / (ENTRY + 8)) {
        return false;
    }
    kept->parts = calloc(n ? (size_t)n : 1, sizeof *kept->parts);
    kept->old = calloc(n ? (size_t)n : 1, sizeof *kept->old);
    kept->old_values = malloc(size);
    kept->state = malloc(state ? (size_t)state : 1);
    kept->n = kept->capacity = (size_t)n;
    good = kept->parts && kept->old && kept->old_values && kept->state &&
           read_parts(kept, bytes + HEAD + state, bytes + size - 8);
    if (!good) {
        clear(kept);
        return false;
    }
    memcpy(kept->state, bytes + HEAD, (size_t)state);
    kept->state_size = (size_t)state;
    qsort(kept->parts, kept->n, sizeof *kept->parts, order);
    memcpy(kept->old, kept->parts, kept->n * sizeof *kept->old);
    kept->recalled = kept->n;
    return true;
}

bool jobs_kept_recall(const struct jobs_kept *kept, uint64_t series, uint64_t index, size_t count,
                      double *values)
{
    const struct jobs_part wanted = {.series = series, .index = index};
    const struct jobs_part *found = NULL;

    if (kept->recalled > 0) {
        found = bsearch(&wanted, kept->old, kept->recalled, sizeof wanted, order);
    }
    if (!found || found->count != count) {
        return false;
    }
    memcpy(values, values_of(found), count * sizeof(double));
    return true;
}

/* ---- Writing --------------------------------------------------------------------------------- */

unsigned char *jobs_kept_write(const struct jobs_kept *kept, size_t *size)
{
    unsigned char *bytes, *at;

    *size = HEAD + kept->state_size + kept->bytes + 8;
    bytes = malloc(*size);
    if (!bytes) {
        return NULL;
    }
    memcpy(bytes, magic, sizeof magic);
    put_u64(bytes + 8, VERSION);
    put_u64(bytes + 16, kept->n);
    put_u64(bytes + 24, kept->state_size);
    if (kept->state_size > 0) {
        memcpy(bytes + HEAD, kept->state, kept->state_size);
    }
    at = bytes + HEAD + kept->state_size;
    for (size_t i = 0; i < kept->n; i++) {
        const struct jobs_part *part = &kept->parts[i];

        put_u64(at, part->series);
        put_u64(at + 8, part->index);
        put_u64(at + 16, part->count);
        at += ENTRY;
        for (size_t k = 0; k < part->count; k++, at += 8) {
            uint64_t bits;

            memcpy(&bits, values_of(part) + k, sizeof bits);
            put_u64(at, bits);
        }
    }
    put_u64(at, sum(bytes, *size - 8));
    return bytes;
}

/* Room for one more of so many values; kept->mutex is held. */
static bool grow(struct jobs_kept *kept, size_t count)
{
    size_t capacity = kept->capacity < 256 ? 256 : 2 * kept->capacity;
    struct jobs_part *parts;

    if (count > BYTES_MAX / 8 || bytes_of(count) > BYTES_MAX - kept->bytes) {
        return false;
    }
    if (kept->n < kept->capacity) {
        return true;
    }
    parts = kept->n < PARTS_MAX ? realloc(kept->parts, capacity * sizeof *parts) : NULL;
    if (parts) {
        kept->parts = parts;
        kept->capacity = capacity;
    }
    return parts != NULL;
}

/* Takes the values of a part over: many, malloc, where there are several. kept->mutex is held. */
static void add(struct jobs_kept *kept, const struct jobs_part *part)
{
    if (grow(kept, part->count)) {
        kept->parts[kept->n++] = *part;
        kept->bytes += bytes_of(part->count);
    } else if (part->owned) {
        free(part->many);
    }
}

/* Drops the parts of a series; kept->mutex is held. */
static void forget(struct jobs_kept *kept, uint64_t series)
{
    size_t left = 0;

    for (size_t i = 0; i < kept->n; i++) {
        struct jobs_part part = kept->parts[i];

        if (part.series != series) {
            kept->parts[left++] = part;
        } else {
            kept->bytes -= bytes_of(part.count);
            if (part.owned) {
                free(part.many);
            }
        }
    }
    kept->n = left;
}

void jobs_kept_keep(struct jobs_kept *kept, uint64_t series, uint64_t index, size_t count,
                    const double *values)
{
    struct jobs_part part = {.series = series, .index = index, .count = count};

    if (count == 1) {
        part.one = values[0];
    } else if (count > 1 && count <= BYTES_MAX / 8) {
        part.many = malloc(count * sizeof(double));
        part.owned = part.many != NULL;
        if (!part.owned) {
            return;
        }
        memcpy(part.many, values, count * sizeof(double));
    }
    pthread_mutex_lock(&kept->mutex);
    if (count == 0) {
        forget(kept, series);
    } else {
        add(kept, &part);
    }
    pthread_mutex_unlock(&kept->mutex);
}

/* ---- Life ------------------------------------------------------------------------------------ */

void jobs_kept_init(struct jobs_kept *kept)
{
    *kept = (struct jobs_kept){.parts = NULL};
    pthread_mutex_init(&kept->mutex, NULL);
}

void jobs_kept_destroy(struct jobs_kept *kept)
{
    clear(kept);
    pthread_mutex_destroy(&kept->mutex);
}
