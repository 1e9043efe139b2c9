/*
 * heart.c - heartbeats: a sign for each lease three times in the time that it holds. The service
 * tells by lease-lost that the lease is another's or the job has ended: then the slot breaks off.
 * Without an answer the next try comes after a second, and the task goes on: the daemon may be
 * starting again.
 */
#include "worker/internal.h"

#include "clock.h"
#include "log.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define REQUEST_SECONDS 10.0
#define LOOK_SECONDS 0.5

void worker_sleep(double seconds, const atomic_bool *flag)
{
    double until = clock_now() + seconds;

    while (!atomic_load(flag) && clock_now() < until) {
        struct timespec pause = {.tv_nsec = 50 * 1000000L};

        (void)nanosleep(&pause, NULL);
    }
}

/* Seconds that the lease holds, as the answer says. */
static double seconds_of(const struct link_answer *answer)
{
    json_t *document =
        json_loadb((const char *)answer->bytes, answer->size, JSON_REJECT_DUPLICATES, NULL);
    double seconds = json_number_value(json_object_get(document, "expiresInSeconds"));

    json_decref(document);
    return seconds > 0.3 ? seconds : 0.3;
}

static void beat(struct link *link, struct worker_slot *slot)
{
    char task[STORE_ID_MAX], secret[sizeof slot->secret], path[sizeof task + 40];
    struct link_answer answer;
    bool due;

    (void)pthread_mutex_lock(&slot->mutex);
    due = slot->leased && clock_now() >= slot->beat;
    memcpy(task, slot->task, sizeof task);
    memcpy(secret, slot->secret, sizeof secret);
    (void)pthread_mutex_unlock(&slot->mutex);
    if (!due) {
        return;
    }
    (void)snprintf(path, sizeof path, "/v1/leases/%s/heartbeat", task);
    link_send(link,
              &(struct link_request){
                  .method = "POST", .path = path, .secret = secret, .seconds = REQUEST_SECONDS},
              &answer);
    (void)pthread_mutex_lock(&slot->mutex);
    if (slot->leased && strcmp(slot->secret, secret) == 0) {
        if (answer.status == 409) {
            LOG_WARN("lease-lost", log_text("task", task));
            atomic_store(&slot->cancel, true);
        }
        slot->beat = clock_now() + (answer.status == 200 ? seconds_of(&answer) / 3.0 : 1.0);
    }
    (void)pthread_mutex_unlock(&slot->mutex);
    link_answer_clear(&answer);
}

void *worker_heart_main(void *argument)
{
    struct worker *worker = argument;
    struct link *link = link_create(&worker->target, &worker->over);

    (void)pthread_setname_np(pthread_self(), "srnfd-heart");
    while (link && !atomic_load(&worker->over)) {
        for (size_t i = 0; i < worker->n_slots; i++) {
            beat(link, &worker->slots[i]);
        }
        worker_sleep(LOOK_SECONDS, &worker->over);
    }
    link_destroy(link);
    return NULL;
}
