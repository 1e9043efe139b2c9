/*
 * leases.c - the workers' side of tasks: they lease, read contents, give signs, and end their
 * leases. Called on threads that answer requests.
 *
 * Each change is asked of the store first, without the lock, and noted in the slot afterwards, if
 * the round is still open. What comes for a round that is not open (the daemon has started again,
 * and the job has not come to it yet) is the store's alone: the job finds it there.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "clock.h"
#include "store/digest.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

#define LOST_LOOKS 64         /* tasks that a worker has lost, of those that wait */
#define ASK_AGAIN_SECONDS 2.0 /* after a task was withheld */
#define PROOF_SIZE (JOBS_SECRET_SIZE + STORE_OWNER_MAX + STORE_ID_MAX)

/* ---- Looking up ------------------------------------------------------------------------------ */

struct place {
    struct jobs_open_round *round; /* NULL: none that is open has the task */
    size_t index;
};

static bool find_in(struct jobs_open_round *round, const char *task, size_t *index)
{
    size_t low = 0, high = round->what->n;

    while (low < high) {
        size_t middle = low + (high - low) / 2;
        int order = strcmp(round->slots[round->order[middle]].row.id, task);

        if (order == 0) {
            *index = round->order[middle];
            return true;
        }
        low = order < 0 ? middle + 1 : low;
        high = order > 0 ? middle : high;
    }
    return false;
}

/* The mutex is held. */
static struct place find(struct jobs *jobs, const char *task)
{
    struct place place = {.round = jobs->rounds.first};

    while (place.round && !find_in(place.round, task, &place.index)) {
        place.round = place.round->link;
    }
    return place;
}

/* The round of a task stays open until leave. */
static struct place enter(struct jobs *jobs, const char *task)
{
    struct place place;

    pthread_mutex_lock(&jobs->rounds.mutex);
    place = find(jobs, task);
    if (place.round) {
        place.round->users++;
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
    return place;
}

/* The mutex is held. */
static void leave_held(struct jobs_open_round *round)
{
    if (--round->users == 0) {
        pthread_cond_signal(&round->changed);
    }
}

static void leave(struct jobs *jobs, struct place place)
{
    if (place.round) {
        pthread_mutex_lock(&jobs->rounds.mutex);
        leave_held(place.round);
        pthread_mutex_unlock(&jobs->rounds.mutex);
    }
}

/* ---- Leasing --------------------------------------------------------------------------------- */

/* The first task of the round that waits and is for this worker, or SIZE_MAX. Of those that it has
   lost it looks at a few: a worker that loses all must not cost time. The mutex is held. */
static size_t choose(struct jobs *jobs, struct jobs_open_round *round, const char *who)
{
    size_t i = round->cursor, n = round->what->n;

    while (i < n && round->slots[i].state != SLOT_WAITING) {
        i++;
    }
    round->cursor = i;
    for (size_t lost = 0; i < n && lost < LOST_LOOKS; i++) {
        if (round->slots[i].state != SLOT_WAITING) {
            continue;
        }
        if (jobs_slot_suits(jobs, round, &round->slots[i], who)) {
            return i;
        }
        lost++;
        if (!(round->offer_at > 0.0)) {
            round->offer_at = clock_now() + ASK_AGAIN_SECONDS;
        }
    }
    return SIZE_MAX;
}

/* Takes the next task of the open rounds in turn, of those of one job where one is named. The round
   is entered. */
static struct place take(struct jobs *jobs, const char *job, const char *who)
{
    struct place place = {.round = NULL};

    pthread_mutex_lock(&jobs->rounds.mutex);
    for (struct jobs_open_round *round = jobs->rounds.first; round && !place.round;
         round = round->link) {
        size_t i;

        if (round->failed || (job[0] && strcmp(round->job, job) != 0)) {
            continue;
        }
        i = choose(jobs, round, who);
        if (i != SIZE_MAX) {
            place = (struct place){.round = round, .index = i};
        }
    }
    if (place.round) {
        struct jobs_open_round **link = &jobs->rounds.first;

        place.round->slots[place.index].state = SLOT_TAKEN;
        /* Before the store is asked: it counts among those that its slots allow. */
        jobs_remotes_note(&jobs->remotes, who, REMOTE_LEASED, place.round->what->kind->name);
        place.round->users++;
        /* To the end of the list: the others have their turn. */
        while (*link != place.round) {
            link = &(*link)->link;
        }
        *link = place.round->link;
        while (*link) {
            link = &(*link)->link;
        }
        *link = place.round;
        place.round->link = NULL;
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
    return place;
}

/* What the store keeps the digest of: the secret, and whose it is. */
static void write_proof(const struct jobs_proof *proof, char text[PROOF_SIZE])
{
    (void)snprintf(text, PROOF_SIZE, "%s\n%s\n%s", proof->secret, proof->owner, proof->job);
}

static void make_secret(char secret[JOBS_SECRET_SIZE])
{
    unsigned char bytes[(JOBS_SECRET_SIZE - 1) / 2];

    randombytes_buf(bytes, sizeof bytes);
    (void)sodium_bin2hex(secret, JOBS_SECRET_SIZE, bytes, sizeof bytes);
}

/* Notes what became of the try to lease the slot, and leaves the round. text: of its proof. */
static void settle(struct jobs *jobs, struct place place, const struct jobs_lease *lease,
                   const struct jobs_remote *remote, const char *text, int status)
{
    struct jobs_slot *slot = &place.round->slots[place.index];
    struct store_task *row = &slot->row;

    pthread_mutex_lock(&jobs->rounds.mutex);
    if (status == 0) {
        row->attempt = lease->attempt;
        store_sha256_hex(row->secret, text, strlen(text));
        memcpy(slot->who, remote->who, sizeof slot->who);
        (void)snprintf(row->worker, sizeof row->worker, "%s", remote->name);
        jobs_slot_lease(place.round, place.index, lease->seconds);
    } else {
        jobs_slot_free(place.round, place.index);
        jobs_remotes_note(&jobs->remotes, remote->who, REMOTE_OVER, lease->kind);
    }
    leave_held(place.round);
    pthread_mutex_unlock(&jobs->rounds.mutex);
}

/* Leases that the worker has from before the daemon started again count among those that its slots
   allow. The mutex of the rounds is held. */
static void count_restored(struct jobs *jobs, const struct jobs_remote *remote)
{
    for (struct jobs_open_round *round = jobs->rounds.first; round; round = round->link) {
        for (size_t i = round->first_leased; i != SIZE_MAX; i = round->slots[i].after) {
            if (strcmp(round->slots[i].who, remote->who) == 0) {
                jobs_remotes_note(&jobs->remotes, remote->who, REMOTE_LEASED,
                                  round->what->kind->name);
            }
        }
    }
}

/* Whether the worker, which asks for a task, may have one. No lease of its other slots is given in
   between, which would be counted twice. */
static bool may_have(struct jobs *jobs, const struct jobs_remote *remote)
{
    bool fresh, may;

    pthread_mutex_lock(&jobs->rounds.mutex);
    may = jobs_remotes_sign(&jobs->remotes, remote, &fresh);
    if (fresh) {
        count_restored(jobs, remote);
        may = may && jobs_remotes_sign(&jobs->remotes, remote, &fresh);
    }
    pthread_mutex_unlock(&jobs->rounds.mutex);
    return may;
}

int jobs_lease(struct jobs *jobs, const struct jobs_remote *remote, struct jobs_lease *lease)
{
    struct place place = {.round = NULL};
    const struct jobs_round *what;
    const struct store_task *row;
    char text[PROOF_SIZE];
    int status;

    *lease = (struct jobs_lease){.seconds = jobs->config.lease_seconds};
    if (may_have(jobs, remote)) {
        place = take(jobs, remote->job, remote->who);
    }
    if (!place.round) {
        return STORE_NOT_FOUND;
    }
    what = place.round->what;
    row = &place.round->slots[place.index].row;
    lease->kind = what->kind->name;
    lease->attempt = row->attempt + 1;
    memcpy(lease->task, row->id, sizeof lease->task);
    make_secret(lease->secret);
    write_proof(&(struct jobs_proof){lease->secret, remote->owner, remote->job}, text);
    status = what->describe(what->user, place.index, &lease->what) == 0 ? STORE_OK : STORE_NOMEM;
    if (status == STORE_OK) {
        status =
            store_task_lease(jobs->config.store, lease->task, lease->attempt, text, remote->name,
                             &(struct store_maker){.host = remote->host, .cpu = remote->cpu});
    }
    settle(jobs, place, lease, remote, text, status);
    if (status == STORE_OK) {
        metrics_add(jobs->config.metrics, METRIC_TASKS, METRIC_LABELS(lease->kind, "leased"), 1);
    } else {
        jobs_task_clear(&lease->what);
    }
    return status;
}

/* ---- While it is leased ---------------------------------------------------------------------- */

/* Whether this is the current lease of the task of an open round; then it is known whose it is,
   also of one given before a restart. The mutex is held. */
static bool is_current(struct jobs *jobs, const struct jobs_open_round *round,
                       struct jobs_slot *slot, const struct jobs_proof *proof)
{
    char text[PROOF_SIZE], digest[65];
    bool known = slot->who[0] != '\0';

    write_proof(proof, text);
    store_sha256_hex(digest, text, strlen(text));
    if (slot->state != SLOT_LEASED || sodium_memcmp(digest, slot->row.secret, 64) != 0 ||
        slot->expires <= 0.0) { /* 0: ended on purpose, and to be lost at the next look */
        return false;
    }
    jobs_remote_who(proof->owner, proof->job, slot->row.worker, slot->who);
    if (!known) {
        jobs_remotes_note(&jobs->remotes, slot->who, REMOTE_LEASED, round->what->kind->name);
    }
    return true;
}

/* Enters the round of the lease; its round is NULL where it is not current. */
static struct place enter_current(struct jobs *jobs, const char *task,
                                  const struct jobs_proof *proof)
{
    struct place place = enter(jobs, task);
    bool current = false;

    if (place.round) {
        pthread_mutex_lock(&jobs->rounds.mutex);
        current = is_current(jobs, place.round, &place.round->slots[place.index], proof);
        pthread_mutex_unlock(&jobs->rounds.mutex);
    }
    if (!current) {
        leave(jobs, place);
        place.round = NULL;
    }
    return place;
}

int jobs_lease_content(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                       const char *digest, struct tasks_bytes *content)
{
    struct place place = enter_current(jobs, task, proof);
    struct jobs_task what = {.n_contents = 0};
    int status = STORE_NOT_FOUND;

    *content = (struct tasks_bytes){.bytes = NULL};
    if (!place.round) {
        return STORE_CONFLICT;
    }
    if (place.round->what->describe(place.round->what->user, place.index, &what) != 0) {
        status = STORE_NOMEM;
    }
    for (size_t i = 0; status == STORE_NOT_FOUND && i < what.n_contents; i++) {
        if (strcmp(what.contents[i].digest, digest) == 0) {
            content->size = what.contents[i].size;
            content->bytes = malloc(content->size ? content->size : 1);
            status = content->bytes ? STORE_OK : STORE_NOMEM;
            if (content->bytes) {
                memcpy(content->bytes, what.contents[i].bytes, content->size);
            }
        }
    }
    jobs_task_clear(&what);
    if (status == STORE_OK) {
        metrics_add(jobs->config.metrics, METRIC_TASK_BYTES,
                    METRIC_LABELS(place.round->what->kind->name, "contents"),
                    (double)content->size);
    }
    leave(jobs, place);
    return status;
}

/* In the slot of a lease that is current; the mutex is held. */
static int extend(struct jobs *jobs, struct jobs_slot *slot)
{
    double now = clock_now();

    if (slot->losing) {
        return STORE_CONFLICT;
    }
    if (now - slot->since > jobs->config.task_seconds) {
        slot->expires = now; /* the run loses it at its next look */
        return STORE_CONFLICT;
    }
    slot->expires = now + jobs->config.lease_seconds;
    return STORE_OK;
}

int jobs_lease_extend(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                      double *seconds)
{
    struct place place = enter(jobs, task);
    char text[PROOF_SIZE];
    int status = STORE_CONFLICT;

    write_proof(proof, text);
    *seconds = jobs->config.lease_seconds;
    if (!place.round) { /* the job has not come to it again: it will honour the lease */
        return store_task_holds(jobs->config.store, task, text);
    }
    pthread_mutex_lock(&jobs->rounds.mutex);
    if (is_current(jobs, place.round, &place.round->slots[place.index], proof)) {
        struct jobs_slot *slot = &place.round->slots[place.index];

        status = extend(jobs, slot);
        jobs_remotes_note(&jobs->remotes, slot->who, REMOTE_ALIVE, place.round->what->kind->name);
    }
    leave_held(place.round);
    pthread_mutex_unlock(&jobs->rounds.mutex);
    return status;
}

/* ---- Its end --------------------------------------------------------------------------------- */

/* How a lease ended. */
struct end {
    struct tasks_bytes *result; /* taken over where there is room for it; NULL: there is none */
    bool lost;
    const char *certain; /* why, where any attempt would end so */
};

/* Notes the end of a lease that the store has agreed to. Leaves the round. */
static void note_end(struct jobs *jobs, struct place place, const struct jobs_proof *proof,
                     const struct end *end)
{
    struct jobs_slot *slot = &place.round->slots[place.index];
    const char *kind = place.round->what->kind->name;
    double seconds = 0.0;

    pthread_mutex_lock(&jobs->rounds.mutex);
    if (is_current(jobs, place.round, slot, proof)) {
        seconds = clock_now() - slot->since;
        jobs_remotes_note(&jobs->remotes, slot->who,
                          end->result ? REMOTE_DONE
                          : end->lost ? REMOTE_LOST
                                      : REMOTE_BACK,
                          kind);
        if (end->result) {
            place.round->seconds += seconds;
            place.round->measured++;
            jobs_slot_finish(place.round, place.index, end->result);
        } else if (end->lost) {
            jobs_slot_lose(jobs, place.round, place.index, end->certain);
        } else {
            jobs_slot_free(place.round, place.index);
        }
    }
    leave_held(place.round);
    pthread_mutex_unlock(&jobs->rounds.mutex);
    metrics_add(jobs->config.metrics, METRIC_TASKS,
                METRIC_LABELS(kind, end->result ? "done"
                                    : end->lost ? "lost"
                                                : "returned"),
                1);
    if (end->result) {
        metrics_add(jobs->config.metrics, METRIC_TASK_SECONDS, METRIC_LABELS(kind), seconds);
    } else {
        jobs_rounds_offer(jobs);
    }
}

int jobs_lease_give_back(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                         const char *reason, bool certain)
{
    struct place place = enter(jobs, task);
    char text[PROOF_SIZE];
    int status;

    write_proof(proof, text);
    status = store_task_give_back(jobs->config.store, task, text, reason);
    if (place.round && status == STORE_OK) {
        note_end(jobs, place, proof,
                 &(struct end){.lost = reason != NULL, .certain = certain ? reason : NULL});
    } else {
        leave(jobs, place);
    }
    return status;
}

/* Whether the bytes can be the result of the task, as far as that can be told. */
static bool fits(const struct place *place, const void *bytes, size_t size)
{
    struct jobs_task what = {.n_contents = 0};
    const struct jobs_round *round = place->round ? place->round->what : NULL;
    bool good = true;

    /* Of a round that is not open the job looks when it comes to it. */
    if (round && round->describe(round->user, place->index, &what) == 0) {
        good = jobs_task_suits(round->kind, &what, bytes, size);
        jobs_task_clear(&what);
    }
    return good;
}

/* Whether the task is leased to a worker that is barred. */
static bool is_barred(struct jobs *jobs, const struct place *place)
{
    bool barred;

    pthread_mutex_lock(&jobs->rounds.mutex);
    barred = jobs_remotes_barred(&jobs->remotes, place->round->slots[place->index].who);
    pthread_mutex_unlock(&jobs->rounds.mutex);
    return barred;
}

int jobs_lease_finish(struct jobs *jobs, const char *task, const struct jobs_proof *proof,
                      const struct store_maker *maker, const void *bytes, size_t size)
{
    struct place place = enter(jobs, task);
    struct tasks_bytes copy = {.bytes = malloc(size ? size : 1), .size = size};
    char text[PROOF_SIZE];
    int status = copy.bytes ? STORE_OK : STORE_NOMEM;

    write_proof(proof, text);
    if (status == STORE_OK && place.round && is_barred(jobs, &place)) {
        leave(jobs, place);
        free(copy.bytes);
        return STORE_CONFLICT; /* its lease has ended, and is lost at the next look */
    }
    if (status == STORE_OK && !fits(&place, bytes, size)) {
        leave(jobs, place);
        free(copy.bytes);
        status = jobs_lease_give_back(jobs, task, proof, "a result that cannot be one", false);
        return status == STORE_OK ? STORE_CORRUPT : status;
    }
    if (status == STORE_OK) {
        memcpy(copy.bytes, bytes, size);
        status = store_task_finish(jobs->config.store, task, text, maker, bytes, size);
    }
    if (place.round && status == STORE_OK) {
        metrics_add(jobs->config.metrics, METRIC_TASK_BYTES,
                    METRIC_LABELS(place.round->what->kind->name, "results"), (double)size);
        note_end(jobs, place, proof, &(struct end){.result = &copy});
    } else {
        leave(jobs, place);
    }
    free(copy.bytes);
    return status;
}
