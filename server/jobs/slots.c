/*
 * slots.c - the moves of a task in an open round: leased, done, free again, lost. The mutex of the
 * rounds is held.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "clock.h"

#include <stdint.h>

/* Between two times that the thread of the run is woken: it takes what has come and tells how many
   are at work, and to be woken for each of thousands costs more than both. */
#define STIR_SECONDS 0.02

/* Wakes the thread of the run, at once where it must be, otherwise unless it was woken just now:
   the next task or its next look does it then. */
static void stir(struct jobs_open_round *round, double now, bool must)
{
    if (must || now - round->stirred >= STIR_SECONDS) {
        round->stirred = now;
        pthread_cond_signal(&round->changed);
    }
}

void jobs_slot_lease(struct jobs_open_round *round, size_t index, double seconds)
{
    struct jobs_slot *slot = &round->slots[index];

    slot->state = SLOT_LEASED;
    slot->losing = slot->restored = false;
    slot->since = clock_now();
    slot->expires = slot->since + seconds;
    slot->before = SIZE_MAX;
    slot->after = round->first_leased;
    if (slot->after != SIZE_MAX) {
        round->slots[slot->after].before = index;
    }
    round->first_leased = index;
    round->leased++;
    stir(round, slot->since, false);
}

/* Out of the list of those that are leased, if it is in it. */
static void unlink_slot(struct jobs_open_round *round, const struct jobs_slot *slot)
{
    if (slot->state != SLOT_LEASED) {
        return;
    }
    if (slot->before != SIZE_MAX) {
        round->slots[slot->before].after = slot->after;
    } else {
        round->first_leased = slot->after;
    }
    if (slot->after != SIZE_MAX) {
        round->slots[slot->after].before = slot->before;
    }
    round->leased--;
}

void jobs_slot_finish(struct jobs_open_round *round, size_t index, struct tasks_bytes *result)
{
    struct jobs_slot *slot = &round->slots[index];

    unlink_slot(round, slot);
    slot->state = SLOT_DONE;
    if (result && jobs_memory_fits(round->memory, result->size)) {
        slot->result = result->bytes;
        slot->size = result->size;
        result->bytes = NULL;
    }
    round->arrived[round->done++] = index;
    stir(round, clock_now(), round->done == round->what->n);
}

void jobs_slot_free(struct jobs_open_round *round, size_t index)
{
    struct jobs_slot *slot = &round->slots[index];

    unlink_slot(round, slot);
    slot->state = SLOT_WAITING;
    round->cursor = index < round->cursor ? index : round->cursor;
    round->offer_at = clock_now(); /* whoever waits is asked at the next look */
    pthread_cond_signal(&round->changed);
}

void jobs_slot_lose(struct jobs *jobs, struct jobs_open_round *round, size_t index,
                    const char *certain)
{
    if (jobs_slot_blame(jobs, round, &round->slots[index], certain) && !round->failed) {
        round->failed = true;
        round->poison = index;
    }
    jobs_slot_free(round, index);
}
