/*
 * live.c - jobs as they are at this moment: the rows of the store, with what only memory knows of
 * those that run (progress, message, when they last changed, how long they still take) and the
 * place in the queue of those that wait.
 *
 * What memory knows is read before the rows. A run leaves its slot only after its row says how it
 * ended, so a row that says running and has no run in memory was claimed after the look: its
 * progress is 0, as the row says. In the other order a job that ends between the two looks would
 * seem to fall back to nothing.
 *
 * Locks: jobs->mutex, and each run->mutex inside it.
 */
#include "jobs/internal.h"
#include "store/job.h"

#include <stdlib.h>
#include <string.h>

struct live {
    char id[STORE_ID_MAX];
    int64_t attempt, updated_ms;
    double progress, seconds_left;
    char message[JOBS_MESSAGE_MAX];
};

/* Of every run, or of the one with this id. Returns how many; live has room for jobs->n_slots. */
static size_t look(struct jobs *jobs, const char *id, struct live *live)
{
    size_t n = 0;

    pthread_mutex_lock(&jobs->mutex);
    for (size_t i = 0; i < jobs->n_slots; i++) {
        struct jobs_run *run = jobs->slots[i];

        if (run && (!id || strcmp(run->job->id, id) == 0)) {
            struct live *l = &live[n++];

            memcpy(l->id, run->job->id, sizeof l->id);
            l->attempt = run->job->attempt;
            pthread_mutex_lock(&run->mutex);
            l->progress = run->progress;
            l->updated_ms = run->updated_ms;
            l->seconds_left = run->seconds_left;
            memcpy(l->message, run->message, sizeof l->message);
            pthread_mutex_unlock(&run->mutex);
        }
    }
    pthread_mutex_unlock(&jobs->mutex);
    return n;
}

/* Lays what memory knows over the row; NULL where it knows nothing. The message is borrowed. */
static const struct live *overlay(const struct live *live, size_t n, struct store_job *job)
{
    for (size_t i = 0; i < n && job->status == STORE_JOB_RUNNING; i++) {
        if (live[i].attempt == job->attempt && strcmp(live[i].id, job->id) == 0) {
            job->progress = live[i].progress;
            job->seconds_left = live[i].seconds_left;
            /* A cancellation is written into the row. */
            job->updated_ms =
                live[i].updated_ms > job->updated_ms ? live[i].updated_ms : job->updated_ms;
            return &live[i];
        }
    }
    return NULL;
}

int jobs_place(struct jobs *jobs, struct store_job *job)
{
    return job->status == STORE_JOB_ACCEPTED
               ? store_job_position(jobs->config.store, job->id, &job->queue_position)
               : STORE_OK;
}

int jobs_places(struct jobs *jobs, bool (*visit)(void *user, const char *id, size_t position),
                void *user)
{
    return store_job_places(jobs->config.store, visit, user);
}

int jobs_get(struct jobs *jobs, const char *id, struct store_job *job)
{
    struct live *live = calloc(jobs->n_slots, sizeof *live);
    const struct live *found;
    size_t n = live ? look(jobs, id, live) : 0;
    int status = live ? store_job_get(jobs->config.store, id, job) : STORE_NOMEM;

    if (status == STORE_OK && (found = overlay(live, n, job)) != NULL) {
        free(job->message);
        job->message = strdup(found->message);
        status = job->message ? STORE_OK : STORE_NOMEM;
    }
    status = status == STORE_OK ? jobs_place(jobs, job) : status;
    if (status != STORE_OK) {
        store_job_clear(job);
    }
    free(live);
    return status;
}

struct listing {
    const struct live *live;
    size_t n;
    bool (*visit)(void *user, const struct store_job *job);
    void *user;
};

static bool visit_row(void *user, const struct store_job *row)
{
    const struct listing *listing = user;
    struct store_job job = *row;
    const struct live *found = overlay(listing->live, listing->n, &job);
    char message[JOBS_MESSAGE_MAX];

    if (found) {
        memcpy(message, found->message, sizeof message);
        job.message = message;
    }
    return listing->visit(listing->user, &job);
}

int jobs_page(struct jobs *jobs, const struct store_page *page,
              bool (*visit)(void *user, const struct store_job *job), void *user)
{
    struct live *live = calloc(jobs->n_slots, sizeof *live);
    struct listing listing = {.live = live, .visit = visit, .user = user};
    int status = STORE_NOMEM;

    if (live) {
        listing.n = look(jobs, NULL, live);
        status = store_job_list(jobs->config.store, page, visit_row, &listing);
    }
    free(live);
    return status;
}
