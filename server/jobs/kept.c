/*
 * kept.c - the numbers that a job keeps for a later attempt (srnf_context.recall and keep), as its
 * checkpoint.
 *
 * Layout, all numbers little-endian: 8 bytes "srnfkept", u64 version, u64 n, then n times u64
 * series, u64 index and the bits of a double, and u64 FNV-1a of all bytes before it. What is
 * damaged, or not of this form, is as if it were not there; whether a number belongs to what is
 * computed is told by its series.
 *
 * Numbers come from all threads that help the job. Whoever brings one when the last checkpoint is
 * INTERVAL old writes the next, unless somebody is about to: at most once in INTERVAL, and in
 * COST times what writing took, so that a large one does not take the time of what it saves.
 *
 * Lock: kept->mutex (rank 25), never held across the store. What was recalled does not change and
 * is read without it.
 */
#include "jobs/internal.h"

#include <stdlib.h>
#include <string.h>

#define VERSION 1
#define HEAD ((size_t)24)
#define ENTRY ((size_t)24)
#define ENTRIES_MAX ((size_t)1 << 20) /* 24 MiB; the pairs of 500 surfaces are an eighth */
#define INTERVAL 1.0                  /* seconds */
#define COST 50.0
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
    const struct jobs_number *x = a, *y = b;

    if (x->series != y->series) {
        return x->series < y->series ? -1 : 1;
    }
    return (x->index > y->index) - (x->index < y->index);
}

/* ---- Reading --------------------------------------------------------------------------------- */

bool jobs_kept_read(struct jobs_kept *kept, const unsigned char *bytes, size_t size)
{
    size_t n = size >= HEAD + 8 ? (size - HEAD - 8) / ENTRY : 0;

    if (size < HEAD + 8 || memcmp(bytes, magic, sizeof magic) != 0 ||
        get_u64(bytes + 8) != VERSION || n > ENTRIES_MAX || get_u64(bytes + 16) != n ||
        size != HEAD + n * ENTRY + 8 || get_u64(bytes + size - 8) != sum(bytes, size - 8)) {
        return false;
    }
    kept->numbers = calloc(n ? n : 1, sizeof *kept->numbers);
    if (!kept->numbers) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        const unsigned char *entry = bytes + HEAD + i * ENTRY;
        uint64_t bits = get_u64(entry + 16);

        kept->numbers[i].series = get_u64(entry);
        kept->numbers[i].index = get_u64(entry + 8);
        memcpy(&kept->numbers[i].value, &bits, sizeof bits);
    }
    qsort(kept->numbers, n, sizeof *kept->numbers, order);
    kept->n = kept->capacity = kept->recalled = n;
    return true;
}

static bool recall(void *user, uint64_t series, uint64_t index, double *value)
{
    struct jobs_run *run = user;
    const struct jobs_number wanted = {.series = series, .index = index};
    const struct jobs_number *found = NULL;

    if (run->kept.recalled > 0) {
        found = bsearch(&wanted, run->kept.old, run->kept.recalled, sizeof wanted, order);
    }
    if (found) {
        *value = found->value;
        jobs_run_resumed(run);
    }
    return found != NULL;
}

/* ---- Writing --------------------------------------------------------------------------------- */

unsigned char *jobs_kept_write(const struct jobs_kept *kept, size_t *size)
{
    unsigned char *bytes;

    *size = HEAD + kept->n * ENTRY + 8;
    bytes = malloc(*size);
    if (!bytes) {
        return NULL;
    }
    memcpy(bytes, magic, sizeof magic);
    put_u64(bytes + 8, VERSION);
    put_u64(bytes + 16, kept->n);
    for (size_t i = 0; i < kept->n; i++) {
        unsigned char *entry = bytes + HEAD + i * ENTRY;
        uint64_t bits;

        memcpy(&bits, &kept->numbers[i].value, sizeof bits);
        put_u64(entry, kept->numbers[i].series);
        put_u64(entry + 8, kept->numbers[i].index);
        put_u64(entry + 16, bits);
    }
    put_u64(bytes + *size - 8, sum(bytes, *size - 8));
    return bytes;
}

/* Room for one more; kept->mutex is held. */
static bool grow(struct jobs_kept *kept)
{
    size_t capacity = kept->capacity < 256 ? 256 : 2 * kept->capacity;
    struct jobs_number *numbers;

    if (kept->n < kept->capacity) {
        return true;
    }
    numbers = kept->n < ENTRIES_MAX ? realloc(kept->numbers, capacity * sizeof *numbers) : NULL;
    if (numbers) {
        kept->numbers = numbers;
        kept->capacity = capacity;
    }
    return numbers != NULL;
}

static void keep(void *user, uint64_t series, uint64_t index, double value)
{
    struct jobs_run *run = user;
    struct jobs_kept *kept = &run->kept;
    double now = run->context.seconds(run);
    unsigned char *bytes = NULL;
    size_t size = 0;

    pthread_mutex_lock(&kept->mutex);
    if (grow(kept)) {
        kept->numbers[kept->n++] =
            (struct jobs_number){.series = series, .index = index, .value = value};
    }
    if (!kept->writing && now >= kept->next) {
        bytes = jobs_kept_write(kept, &size);
        kept->writing = bytes != NULL;
    }
    pthread_mutex_unlock(&kept->mutex);
    if (bytes) {
        double took;

        (void)jobs_run_checkpoint_save(run, bytes, size);
        free(bytes);
        took = run->context.seconds(run) - now;
        pthread_mutex_lock(&kept->mutex);
        kept->next = now + took + (COST * took > INTERVAL ? COST * took : INTERVAL);
        kept->writing = false;
        pthread_mutex_unlock(&kept->mutex);
    }
}

/* ---- A run ----------------------------------------------------------------------------------- */

void jobs_run_keep_numbers(struct jobs_run *run)
{
    struct jobs_kept *kept = &run->kept;
    unsigned char *bytes = NULL;
    size_t size = 0;

    if (run->context.keep) {
        return;
    }
    if (jobs_run_checkpoint_load(run, &bytes, &size) == STORE_OK) {
        if (jobs_kept_read(kept, bytes, size)) {
            kept->old = calloc(kept->n ? kept->n : 1, sizeof *kept->old);
            kept->recalled = kept->old ? kept->n : 0;
        }
        if (kept->recalled > 0) {
            memcpy(kept->old, kept->numbers, kept->n * sizeof *kept->old);
        }
    }
    free(bytes);
    kept->next = run->context.seconds(run) + INTERVAL;
    run->context.recall = recall;
    run->context.keep = keep;
}

void jobs_kept_init(struct jobs_kept *kept)
{
    *kept = (struct jobs_kept){.numbers = NULL};
    pthread_mutex_init(&kept->mutex, NULL);
}

void jobs_kept_destroy(struct jobs_kept *kept)
{
    free(kept->numbers);
    free(kept->old);
    pthread_mutex_destroy(&kept->mutex);
}
