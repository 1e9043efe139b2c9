/*
 * losers.c - who has lost a task, who gets it next, and when it fails its job. One broken worker
 * must not fail what others can compute: a task goes to those first that have lost it least.
 *
 * It fails its job when JOBS_TASK_LOSERS_MAX workers have lost it, or two have said of it in the
 * same words that any attempt will fail. Where no worker is left that has not lost it, it fails
 * after JOBS_TASK_LOST_MAX attempts, and where nobody else lives at all, two such words of the same
 * worker are enough.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "store/digest.h"

#include <string.h>

static unsigned times_lost(const struct jobs_slot *slot, const char *who)
{
    for (size_t i = 0; i < slot->n_losers; i++) {
        if (strcmp(slot->losers[i].who, who) == 0) {
            return slot->losers[i].times;
        }
    }
    return 0;
}

/* What others are held against. */
struct measure {
    const struct jobs_slot *slot;
    unsigned times;
};

static bool lost_less(const void *user, const char *who)
{
    const struct measure *measure = user;

    return times_lost(measure->slot, who) < measure->times;
}

bool jobs_slot_suits(struct jobs *jobs, const struct jobs_open_round *round,
                     const struct jobs_slot *slot, const char *who)
{
    struct measure measure = {.slot = slot, .times = times_lost(slot, who)};

    return measure.times == 0 ||
           !jobs_remotes_other(&jobs->remotes, who, round->job, lost_less, &measure);
}

static void add_loser(struct jobs_slot *slot)
{
    size_t i = 0;

    while (i < slot->n_losers && strcmp(slot->losers[i].who, slot->who) != 0) {
        i++;
    }
    if (i < JOBS_TASK_LOSERS_MAX) {
        memcpy(slot->losers[i].who, slot->who, sizeof slot->who);
        slot->losers[i].times++;
        slot->n_losers += i == slot->n_losers;
    }
}

/* Whether the words are those that were said of the task last, and who says them counts. */
static bool is_certain(struct jobs *jobs, const struct jobs_open_round *round,
                       struct jobs_slot *slot, const char *certain)
{
    char digest[65];
    bool enough;

    store_sha256_hex(digest, certain, strlen(certain));
    enough = strcmp(digest, slot->certain) == 0 &&
             (strcmp(slot->certain_who, slot->who) != 0 ||
              !jobs_remotes_other(&jobs->remotes, slot->who, round->job, NULL, NULL));
    memcpy(slot->certain, digest, sizeof digest);
    memcpy(slot->certain_who, slot->who, sizeof slot->who);
    return enough;
}

bool jobs_slot_blame(struct jobs *jobs, const struct jobs_open_round *round, struct jobs_slot *slot,
                     const char *certain)
{
    struct measure fresh = {.slot = slot, .times = 1};

    slot->row.lost++;
    add_loser(slot);
    return (certain && is_certain(jobs, round, slot, certain)) ||
           slot->n_losers == JOBS_TASK_LOSERS_MAX ||
           (slot->row.lost >= JOBS_TASK_LOST_MAX &&
            !jobs_remotes_other(&jobs->remotes, slot->who, round->job, lost_less, &fresh));
}
