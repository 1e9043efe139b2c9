/*
 * passes.c - tokens of the service's own making, each for the tasks of one job. In memory: whoever
 * makes them keeps their digests, and adds them again after a restart.
 *
 * Lock: passes.mutex (rank 28, innermost) guards the list.
 */
#include "jobs/internal.h"
#include "jobs/rounds.h"

#include "store/digest.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

struct jobs_pass {
    char digest[65], job[STORE_ID_MAX];
    struct jobs_pass *next;
};

void jobs_passes_init(struct jobs_passes *passes)
{
    pthread_mutex_init(&passes->mutex, NULL);
}

void jobs_passes_destroy(struct jobs_passes *passes)
{
    while (passes->first) {
        struct jobs_pass *pass = passes->first;

        passes->first = pass->next;
        free(pass);
    }
    pthread_mutex_destroy(&passes->mutex);
}

bool jobs_pass_add(struct jobs *jobs, const char digest[65], const char *job)
{
    struct jobs_pass *pass = calloc(1, sizeof *pass);

    if (!pass) {
        return false;
    }
    memcpy(pass->digest, digest, sizeof pass->digest);
    (void)snprintf(pass->job, sizeof pass->job, "%s", job);
    pthread_mutex_lock(&jobs->passes.mutex);
    pass->next = jobs->passes.first;
    jobs->passes.first = pass;
    pthread_mutex_unlock(&jobs->passes.mutex);
    return true;
}

void jobs_pass_drop(struct jobs *jobs, const char digest[65])
{
    struct jobs_pass **link = &jobs->passes.first, *pass;

    pthread_mutex_lock(&jobs->passes.mutex);
    while ((pass = *link) != NULL) {
        if (memcmp(pass->digest, digest, sizeof pass->digest) == 0) {
            *link = pass->next;
            free(pass);
        } else {
            link = &pass->next;
        }
    }
    pthread_mutex_unlock(&jobs->passes.mutex);
}

bool jobs_pass_find(struct jobs *jobs, const char *secret, char job[STORE_ID_MAX])
{
    char digest[65];
    bool found = false;

    if (!jobs || strncmp(secret, JOBS_PASS_PREFIX, sizeof JOBS_PASS_PREFIX - 1) != 0) {
        return false;
    }
    store_sha256_hex(digest, secret, strlen(secret));
    pthread_mutex_lock(&jobs->passes.mutex);
    for (const struct jobs_pass *pass = jobs->passes.first; pass; pass = pass->next) {
        if (sodium_memcmp(pass->digest, digest, 64) == 0) {
            memcpy(job, pass->job, STORE_ID_MAX);
            found = true;
        }
    }
    pthread_mutex_unlock(&jobs->passes.mutex);
    return found;
}

bool jobs_pass_holds(struct jobs *jobs, const char *job)
{
    bool held = false;

    pthread_mutex_lock(&jobs->passes.mutex);
    for (const struct jobs_pass *pass = jobs->passes.first; pass; pass = pass->next) {
        held = held || strcmp(pass->job, job) == 0;
    }
    pthread_mutex_unlock(&jobs->passes.mutex);
    return held;
}
