/* ledger.c - clients that write down what they were promised: see ledger.h. */
#include "support/ledger.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "store/digest.h"
#include "store/store.h"

#define DRAIN_SECONDS 120
#define JSON_BODY "Content-Type: application/json\r\n"

static unsigned next_random(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

char *ledger_mesh_text(unsigned seed, bool large, size_t *size)
{
    int rings = large ? 60 : 10, around = large ? 120 : 20, vertices = rings * around + 2;
    size_t room = (size_t)vertices * 160 + 256;
    char *text = malloc(room);
    FILE *file = fmemopen(text, room, "w");

    fprintf(file, "OFF\n%d %d 0\n0 0 1.1\n0 0 -1.1\n", vertices, 2 * rings * around);
    for (int i = 0; i < rings; i++) {
        for (int j = 0; j < around; j++) {
            double theta = M_PI * (i + 1) / (rings + 1), phi = 2 * M_PI * j / around;
            double radius = 1 + 0.1 * sin(3 * theta + seed) + 1e-6 * seed;

            fprintf(file, "%.15g %.15g %.15g\n", radius * sin(theta) * cos(phi),
                    radius * sin(theta) * sin(phi), radius * cos(theta));
        }
    }
    for (int j = 0; j < around; j++) {
        int k = (j + 1) % around, last = 2 + (rings - 1) * around;

        fprintf(file, "3 0 %d %d\n3 1 %d %d\n", 2 + j, 2 + k, last + k, last + j);
        for (int i = 0; i + 1 < rings; i++) {
            int a = 2 + i * around + j, b = 2 + i * around + k;

            fprintf(file, "3 %d %d %d\n3 %d %d %d\n", a, a + around, b, b, a + around, b + around);
        }
    }
    *size = (size_t)ftell(file);
    fclose(file);
    return text;
}

static void broken(struct ledger *ledger, const char *what, const char *id, const char *detail)
{
    atomic_fetch_add(&ledger->wrong, 1);
    fprintf(stderr, "promise broken: %s: %s %s\n", what, id, detail);
}

static long log_length(const struct ledger *ledger)
{
    struct stat info;

    return stat(ledger->daemon->log, &info) == 0 ? (long)info.st_size : 0;
}

/* ---- What a client does ---------------------------------------------------------------------- */

/* Uploads a mesh and writes it down; false without an answer. */
static bool upload(struct ledger *ledger, unsigned seed, bool large, char id[64])
{
    struct answer answer;
    size_t size;
    char *text = ledger_mesh_text(seed, large, &size);
    int status =
        daemon_request(ledger->daemon, "POST", "/v1/meshes?format=off", "", text, size, &answer);

    free(text);
    answer_member(&answer, "id", id, 64);
    if (status != 0 && status != 200 && status != 201) {
        broken(ledger, "a mesh is refused", "", answer.body);
    }
    answer_clear(&answer);
    if (status == 200 || status == 201) {
        pthread_mutex_lock(&ledger->mutex);
        if (ledger->n_meshes < LEDGER_MESHES) {
            struct ledger_mesh *mesh = &ledger->meshes[ledger->n_meshes++];

            *mesh = (struct ledger_mesh){.seed = seed, .large = large};
            memcpy(mesh->id, id, 64);
        }
        pthread_mutex_unlock(&ledger->mutex);
        atomic_fetch_add(&ledger->acknowledged, 1);
    }
    return status != 0;
}

bool ledger_begin(struct ledger *ledger)
{
    return upload(ledger, 0, false, ledger->mesh) && ledger->mesh[0];
}

/* Sends an execution with its key, as often as it takes. */
static bool submit(struct ledger *ledger, struct ledger_job *job)
{
    struct answer answer;
    char headers[200], id[64];
    int status;

    snprintf(headers, sizeof headers, JSON_BODY "Prefer: respond-async\r\nIdempotency-Key: %s\r\n",
             job->key);
    status = daemon_request(ledger->daemon, "POST", "/v1/processes/encode/execution", headers,
                            job->body, strlen(job->body), &answer);
    answer_member(&answer, "id", id, sizeof id);
    if (status == 200 || status == 201) {
        pthread_mutex_lock(&ledger->mutex);
        if (job->id[0] && strcmp(job->id, id) != 0) {
            broken(ledger, "a key names another job", job->id, id);
        }
        memcpy(job->id, id, sizeof id);
        job->promise = job->promise == PENDING ? ACCEPTED : job->promise;
        pthread_mutex_unlock(&ledger->mutex);
        atomic_fetch_add(&ledger->acknowledged, 1);
    } else if (status != 0) {
        broken(ledger, "an execution is refused", job->key, answer.body);
    }
    answer_clear(&answer);
    return status != 0;
}

/* A job that nobody has asked for before: the body is its number. */
static bool submit_new(struct ledger *ledger, unsigned random)
{
    struct ledger_job *job = NULL;

    pthread_mutex_lock(&ledger->mutex);
    if (ledger->n_jobs < LEDGER_JOBS) {
        job = &ledger->jobs[ledger->n_jobs++];
        snprintf(job->key, sizeof job->key, "key-%zu", ledger->n_jobs);
        snprintf(job->body, sizeof job->body,
                 "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":%u,\"smoothing\":%.9f}}", ledger->mesh,
                 4 + random % 12, 1e-9 * (double)ledger->n_jobs);
    }
    pthread_mutex_unlock(&ledger->mutex);
    return job ? submit(ledger, job) : true;
}

static struct ledger_job *choose(struct ledger *ledger, unsigned random)
{
    struct ledger_job *job = NULL;

    pthread_mutex_lock(&ledger->mutex);
    if (ledger->n_jobs > 0) {
        size_t recent = ledger->n_jobs > 40 ? 40 : ledger->n_jobs;

        job = &ledger->jobs[ledger->n_jobs - 1 - random % recent];
        job = job->id[0] && job->promise < DELETING ? job : NULL;
    }
    pthread_mutex_unlock(&ledger->mutex);
    return job;
}

/* Reads the results and compares them with what was read before. */
static bool read_results(struct ledger *ledger, struct ledger_job *job)
{
    struct answer answer;
    char path[128], digest[65];
    int status;

    snprintf(path, sizeof path, "/v1/jobs/%s/results", job->id);
    status = daemon_request(ledger->daemon, "GET", path, "", "", 0, &answer);
    pthread_mutex_lock(&ledger->mutex);
    if (status == 200) {
        store_sha256_hex(digest, answer.body, answer.size);
        if (job->results[0] && strcmp(job->results, digest) != 0) {
            broken(ledger, "results have changed", job->id, "");
        }
        memcpy(job->results, digest, sizeof digest);
        if (job->promise == ACCEPTED) {
            job->promise = SUCCESSFUL;
            job->seen_at = log_length(ledger);
            atomic_fetch_add(&ledger->acknowledged, 1);
        }
    } else if (status != 0 && job->promise == SUCCESSFUL) {
        broken(ledger, "results are gone", job->id, answer.body);
    }
    pthread_mutex_unlock(&ledger->mutex);
    answer_clear(&answer);
    return status != 0;
}

static bool cancel(struct ledger *ledger, struct ledger_job *job)
{
    struct answer answer;
    char path[128], state[32];
    int status;

    pthread_mutex_lock(&ledger->mutex);
    job->tried_to_cancel = true;
    pthread_mutex_unlock(&ledger->mutex);
    snprintf(path, sizeof path, "/v1/jobs/%s/cancel", job->id);
    status = daemon_request(ledger->daemon, "POST", path, "", "", 0, &answer);
    answer_member(&answer, "status", state, sizeof state);
    if (status == 200 && strcmp(state, "dismissed") == 0) {
        pthread_mutex_lock(&ledger->mutex);
        if (job->promise == SUCCESSFUL) {
            broken(ledger, "a successful job was dismissed", job->id, "");
        }
        job->promise = job->promise == ACCEPTED ? DISMISSED : job->promise;
        pthread_mutex_unlock(&ledger->mutex);
        atomic_fetch_add(&ledger->acknowledged, 1);
    }
    answer_clear(&answer);
    return status != 0;
}

static bool delete (struct ledger *ledger, struct ledger_job *job)
{
    enum promise before;
    char path[128];
    int status;

    pthread_mutex_lock(&ledger->mutex);
    before = job->promise;
    job->before = before;
    if (before == SUCCESSFUL || before == DISMISSED) {
        job->promise = DELETING;
    }
    pthread_mutex_unlock(&ledger->mutex);
    if (before != SUCCESSFUL && before != DISMISSED) {
        return true;
    }
    snprintf(path, sizeof path, "/v1/jobs/%s", job->id);
    status = daemon_status(ledger->daemon, "DELETE", path, "");
    if (status == 200) {
        job->promise = DELETED;
        atomic_fetch_add(&ledger->acknowledged, 1);
    } else if (status != 0) {
        broken(ledger, "an ended job is not deleted", job->id, "");
    }
    return status != 0;
}

void *ledger_client_main(void *argument)
{
    struct ledger_client *client = argument;
    struct ledger *ledger = client->ledger;
    bool answered = true;
    char id[64];

    while (answered && !atomic_load(&ledger->stop)) {
        unsigned what = next_random(&client->random) % 20, random = next_random(&client->random);
        struct ledger_job *job = what < 10 ? NULL : choose(ledger, random);

        if (what < 9) {
            answered = submit_new(ledger, random);
        } else if (what == 9) {
            answered = upload(ledger, random, random % 2, id);
        } else if (job && what < 17) {
            answered = read_results(ledger, job);
        } else if (job && what == 17) {
            answered = cancel(ledger, job);
        } else if (job) {
            answered = delete (ledger, job);
        }
    }
    return NULL;
}

/* ---- What is left of it ---------------------------------------------------------------------- */

void ledger_resend(struct ledger *ledger)
{
    for (size_t i = 0; i < ledger->n_jobs; i++) {
        if (ledger->jobs[i].promise == PENDING && !submit(ledger, &ledger->jobs[i])) {
            return;
        }
    }
}

static void check_failed(struct ledger *ledger, struct ledger_job *job, const struct answer *answer)
{
    if (job->promise == SUCCESSFUL || job->promise == DISMISSED ||
        !strstr(answer->body, "The daemon stopped during each of 3 attempts")) {
        broken(ledger, "a job failed", job->id, answer->body);
    }
    job->promise = FAILED;
}

static void check_state(struct ledger *ledger, struct ledger_job *job, const char *state,
                        const struct answer *answer)
{
    bool successful = strcmp(state, "successful") == 0;

    if (job->promise == SUCCESSFUL && !successful) {
        broken(ledger, "a successful job is no more", job->id, state);
    } else if (job->promise == DISMISSED && strcmp(state, "dismissed") != 0) {
        broken(ledger, "a dismissed job is no more", job->id, state);
    } else if (strcmp(state, "failed") == 0) {
        check_failed(ledger, job, answer);
    } else if (job->promise == ACCEPTED && strcmp(state, "dismissed") == 0) {
        if (!job->tried_to_cancel) {
            broken(ledger, "a job was dismissed", job->id, "");
        }
        job->promise = DISMISSED;
    } else if (job->promise == ACCEPTED && successful) {
        job->promise = SUCCESSFUL;
        job->seen_at = log_length(ledger);
    }
}

/* Looks at one job; false as long as it has not ended. */
static bool check_job(struct ledger *ledger, struct ledger_job *job)
{
    struct answer answer;
    char path[128], state[32];
    int status;
    bool ended;

    if (job->promise == PENDING) {
        broken(ledger, "an execution has no answer", job->key, "");
        return true;
    }
    snprintf(path, sizeof path, "/v1/jobs/%s", job->id);
    status = daemon_request(ledger->daemon, "GET", path, "", "", 0, &answer);
    answer_member(&answer, "status", state, sizeof state);
    ended = strcmp(state, "accepted") != 0 && strcmp(state, "running") != 0;
    if (job->promise == DELETED || job->promise == DELETING) {
        if (status == 404) {
            job->promise = DELETED;
        } else if (job->promise == DELETED) {
            broken(ledger, "a deleted job is back", job->id, state);
        } else if (status == 200) {
            job->promise = job->before; /* the deletion never came that far */
            check_state(ledger, job, state, &answer);
        }
    } else if (status != 200) {
        broken(ledger, "a job is lost", job->id, answer.body ? answer.body : "");
    } else {
        check_state(ledger, job, state, &answer);
    }
    answer_clear(&answer);
    return ended;
}

static void check_meshes(struct ledger *ledger)
{
    for (size_t i = 0; i < ledger->n_meshes; i++) {
        const struct ledger_mesh *mesh = &ledger->meshes[i];
        struct answer answer;
        char path[128];
        size_t size;
        char *text = ledger_mesh_text(mesh->seed, mesh->large, &size);

        snprintf(path, sizeof path, "/v1/meshes/%s/content", mesh->id);
        if (daemon_request(ledger->daemon, "GET", path, "", "", 0, &answer) != 200 ||
            answer.size != size || memcmp(answer.body, text, size) != 0) {
            broken(ledger, "a mesh is lost or changed", mesh->id, "");
        }
        answer_clear(&answer);
        free(text);
    }
}

/* The states of the latest jobs, or of all of them. Returns how many have not ended. */
static size_t check_jobs(struct ledger *ledger, bool all)
{
    size_t open = 0, from = all || ledger->n_jobs < 60 ? 0 : ledger->n_jobs - 60;

    for (size_t i = from; i < ledger->n_jobs; i++) {
        open += !check_job(ledger, &ledger->jobs[i]);
    }
    return open;
}

void ledger_verify(struct ledger *ledger, bool to_the_end)
{
    struct timespec pause = {.tv_nsec = 100000000};
    int waits = 0;

    while (check_jobs(ledger, to_the_end) > 0 && to_the_end) {
        if (++waits > DRAIN_SECONDS * 10) {
            broken(ledger, "jobs do not end", "", "");
            return;
        }
        nanosleep(&pause, NULL);
    }
    for (size_t i = 0; to_the_end && i < ledger->n_jobs; i++) {
        if (ledger->jobs[i].promise == SUCCESSFUL) {
            (void)read_results(ledger, &ledger->jobs[i]);
        }
    }
    if (to_the_end) {
        check_meshes(ledger);
    }
}
