/*
 * memory.c - the daemon's srnf_alloc and srnf_free: those of core/memory.c with an account.
 *
 * A block has one unit of alignment (64 bytes) in front of it, with the account it was charged to
 * and its size. Charging is a compare-and-exchange on the account, so that it never holds more than
 * its limit, not even for a moment; a request that would pass it is refused as if the machine had
 * no memory, the run ends with SRNF_ENOMEM, and the account tells the engine why. Under
 * AddressSanitizer the front of a block is poisoned, so that writing before an array is found as
 * it is without one.
 *
 * Cost: 64 bytes and two atomic operations a block, where a block is zeroed in any case; the core
 * allocates plans and workspaces, not in its inner loops.
 *
 * The account of a thread is thread-local. No locks.
 */
#include "jobs/memory.h"

#include <malloc.h>
#include <sanitizer/asan_interface.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "srnf.h"

#define ALIGNMENT ((size_t)64)

/* From this size on a block comes from calloc, which takes pages of the system that are cleared
   when they are first used: clearing a gigabyte at once takes seconds. What comes so is not
   aligned, and gets one unit more. */
#define LAZY_FROM ((size_t)16 << 20)

/* From this size on the C library takes pages for a block alone. By itself it raises that to the
   size of the largest block that was freed, up to 32 MiB; blocks that grow from one to the next, as
   checkpoints do, then leave holes that no later one fits: 2 GB beside 353 MiB in use, of 10,000
   subjects. */
#define PAGES_FROM ((size_t)256 << 10)

/* What a thread keeps of the blocks that it frees, from PAGES_FROM up to LAZY_FROM, for its next
   ones: pages of the system anew for each workspace of a registration took a seventh to a quarter
   of the time of a mean at degree 15. A block stands in for one that is smaller by a fifth at most.
   Under AddressSanitizer none is kept, so that it sees all that is freed. */
#define KEPT_MAX 16
#define KEPT_BYTES ((size_t)16 << 20)

#ifndef __has_feature
#define __has_feature(x) 0
#endif
#if defined __SANITIZE_ADDRESS__ || __has_feature(address_sanitizer)
#define KEEPS false
#else
#define KEEPS true
#endif

struct front {
    struct jobs_memory *memory; /* NULL: none */
    size_t bytes;               /* charged: what was asked for, with its front */
    size_t room;                /* of the allocation; bytes at least */
    void *base;                 /* of the allocation, at the front or before it */
};
_Static_assert(sizeof(struct front) <= ALIGNMENT, "a front fits before a block");

static _Thread_local struct jobs_memory *current;

static _Thread_local struct {
    struct front *blocks[KEPT_MAX]; /* the oldest first */
    size_t count, bytes;
} kept;

void jobs_memory_prepare(void)
{
    (void)mallopt(M_MMAP_THRESHOLD, (int)PAGES_FROM);
}

void jobs_memory_begin(struct jobs_memory *memory, size_t limit)
{
    memory->limit = limit;
    atomic_store(&memory->peak, atomic_load(&memory->used));
    atomic_store(&memory->refused, 0);
    atomic_store(&memory->held, 0);
}

/* ---- Blocks that are kept -------------------------------------------------------------------- */

static struct front *take_kept(size_t i)
{
    struct front *front = kept.blocks[i];

    kept.count--;
    kept.bytes -= front->room;
    memmove(kept.blocks + i, kept.blocks + i + 1, (kept.count - i) * sizeof kept.blocks[0]);
    return front;
}

static void drop_kept(size_t most, size_t bytes)
{
    while (kept.count > most || kept.bytes > bytes) {
        free(take_kept(0)->base);
    }
}

/* Whether the block was kept. Without an account nothing tells when it is to go. */
static bool keep(struct front *front)
{
    if (!KEEPS || !current || front->room < PAGES_FROM || front->room >= LAZY_FROM) {
        return false;
    }
    drop_kept(KEPT_MAX - 1, KEPT_BYTES - front->room);
    kept.blocks[kept.count++] = front;
    kept.bytes += front->room;
    return true;
}

/* The smallest that does, or NULL. */
static struct front *find_kept(size_t bytes)
{
    size_t best = kept.count;

    for (size_t i = 0; i < kept.count; i++) {
        size_t room = kept.blocks[i]->room;

        if (room >= bytes && room - bytes <= room / 5 &&
            (best == kept.count || room < kept.blocks[best]->room)) {
            best = i;
        }
    }
    return best < kept.count ? take_kept(best) : NULL;
}

struct jobs_memory *jobs_memory_enter(struct jobs_memory *memory)
{
    struct jobs_memory *before = current;

    current = memory;
    if (!memory) {
        drop_kept(0, 0);
    }
    return before;
}

struct jobs_memory *jobs_memory_current(void)
{
    return current;
}

/* Remembers the first request that was refused. */
static void refuse(struct jobs_memory *memory, size_t used, size_t bytes)
{
    size_t none = 0;

    if (atomic_compare_exchange_strong(&memory->refused, &none, bytes)) {
        atomic_store(&memory->held, used);
    }
}

/* needed: to have no room is a refusal. */
static bool charge_one(struct jobs_memory *memory, size_t bytes, bool needed)
{
    size_t used, peak;

    used = atomic_load_explicit(&memory->used, memory_order_relaxed);
    do {
        if (used > memory->limit || bytes > memory->limit - used) {
            if (needed) {
                refuse(memory, used, bytes);
            }
            return false;
        }
    } while (!atomic_compare_exchange_weak_explicit(&memory->used, &used, used + bytes,
                                                    memory_order_relaxed, memory_order_relaxed));
    used += bytes;
    peak = atomic_load_explicit(&memory->peak, memory_order_relaxed);
    while (used > peak &&
           !atomic_compare_exchange_weak_explicit(&memory->peak, &peak, used, memory_order_relaxed,
                                                  memory_order_relaxed)) {
    }
    return true;
}

/* The account within another one is told why that refused, and who held the rest. */
static bool charge_parent(struct jobs_memory *memory, size_t bytes)
{
    size_t all, own;

    if (charge_one(memory->parent, bytes, true)) {
        return true;
    }
    all = atomic_load(&memory->parent->used);
    own = atomic_fetch_sub_explicit(&memory->used, bytes, memory_order_relaxed) - bytes;
    refuse(memory, own, bytes);
    atomic_store(&memory->beside, all > own ? all - own : 0);
    return false;
}

bool jobs_memory_told(struct jobs_memory *memory)
{
    if (!memory || !memory->stop || !atomic_load_explicit(memory->stop, memory_order_relaxed)) {
        return false;
    }
    atomic_store(&memory->stopped, true);
    return true;
}

bool jobs_memory_charge(struct jobs_memory *memory, size_t bytes)
{
    if (!memory) {
        return true;
    }
    if (jobs_memory_told(memory)) {
        return false;
    }
    return charge_one(memory, bytes, true) && (!memory->parent || charge_parent(memory, bytes));
}

bool jobs_memory_fits(struct jobs_memory *memory, size_t bytes)
{
    return charge_one(memory, bytes, false);
}

void jobs_memory_discharge(struct jobs_memory *memory, size_t bytes)
{
    for (; memory; memory = memory->parent) {
        atomic_fetch_sub_explicit(&memory->used, bytes, memory_order_relaxed);
    }
}

void jobs_memory_lend(struct jobs_memory *memory, size_t most, struct jobs_memory *other)
{
    size_t used = atomic_load_explicit(&memory->used, memory_order_relaxed), room;

    do {
        room = used < memory->limit ? memory->limit - used : 0;
        room = room < most ? room : most;
    } while (!atomic_compare_exchange_weak_explicit(&memory->used, &used, used + room,
                                                    memory_order_relaxed, memory_order_relaxed));
    *other = (struct jobs_memory){.limit = room};
}

void jobs_memory_return(struct jobs_memory *memory, const struct jobs_memory *other)
{
    atomic_fetch_sub_explicit(&memory->used, other->limit, memory_order_relaxed);
}

/* Zeroed and aligned: the front, with its base and room. */
static struct front *take(size_t bytes)
{
    struct front *front = find_kept(bytes);
    size_t skipped;
    void *base;

    if (front) {
        memset((char *)front + ALIGNMENT, 0, bytes - ALIGNMENT);
        return front;
    }
    base = bytes < LAZY_FROM ? aligned_alloc(ALIGNMENT, bytes) : calloc(1, bytes);
    if (!base) {
        return NULL;
    }
    if (bytes < LAZY_FROM) {
        memset(base, 0, bytes);
    }
    skipped = (ALIGNMENT - (uintptr_t)base % ALIGNMENT) % ALIGNMENT;
    front = (struct front *)(void *)((char *)base + skipped);
    front->base = base;
    front->room = bytes;
    return front;
}

void *srnf_alloc(size_t count, size_t size)
{
    struct front *front;
    size_t bytes;

    if (__builtin_mul_overflow(count, size, &bytes) || bytes > PTRDIFF_MAX - 3 * ALIGNMENT) {
        return NULL;
    }
    bytes = (bytes + ALIGNMENT) / ALIGNMENT * ALIGNMENT + ALIGNMENT;
    bytes += bytes < LAZY_FROM ? 0 : ALIGNMENT;
    if (!jobs_memory_charge(current, bytes)) {
        return NULL;
    }
    front = take(bytes);
    if (!front) {
        jobs_memory_discharge(current, bytes);
        return NULL;
    }
    front->memory = current;
    front->bytes = bytes;
    ASAN_POISON_MEMORY_REGION(front, ALIGNMENT);
    return (char *)front + ALIGNMENT;
}

void srnf_free(void *pointer)
{
    struct front *front;

    if (pointer) {
        front = (struct front *)(void *)((char *)pointer - ALIGNMENT);
        ASAN_UNPOISON_MEMORY_REGION(front, ALIGNMENT);
        jobs_memory_discharge(front->memory, front->bytes);
        if (!keep(front)) {
            free(front->base);
        }
    }
}
