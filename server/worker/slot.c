/*
 * slot.c - one task at a time: lease, get what it is about, compute, return the result.
 *
 * A request without an answer is sent again for WORKER_PATIENCE seconds: the daemon may be starting
 * again, and honours leases that have not expired. Whatever the service answers with lease-lost is
 * dropped. What goes wrong with a task itself is told as its failure, and another worker tries.
 */
#include "worker/internal.h"

#include "clock.h"
#include "log.h"
#include "priority.h"
#include "text.h"

#include <jansson.h>
#include <math.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define POLL_SECONDS 20.0 /* that a request for a lease waits */
#define REQUEST_SECONDS 60.0
#define PATH_MAX_BYTES 200
#define RESULT_TRIES 3

/* A lease as it came. */
struct lease {
    char task[STORE_ID_MAX], secret[64];
    const struct tasks_kind *kind; /* NULL: this worker has no such kind */
    struct tasks_bytes inputs;
    struct tasks_content *contents; /* [n]; bytes are malloc's */
    struct tasks_bytes *blocks;     /* [n] */
    size_t n_contents;
    double seconds;
};

static void lease_clear(struct lease *lease)
{
    for (size_t i = 0; lease->blocks && i < lease->n_contents; i++) {
        free(lease->blocks[i].bytes);
    }
    free(lease->blocks);
    free(lease->contents);
    free(lease->inputs.bytes);
    sodium_memzero(lease, sizeof *lease);
}

/* ---- Requests that are sent again ------------------------------------------------------------ */

/* Whether the service is not there now: it is full or ends, or a proxy says that for it. */
static bool is_absent(const struct link_answer *answer)
{
    return answer->status == 0 || answer->status == 408 ||
           (answer->status >= 502 && answer->status <= 504);
}

/* Until there is an answer, or patience is over. */
static void send(struct worker_slot *slot, const struct link_request *request,
                 struct link_answer *answer)
{
    struct worker *worker = slot->worker;
    double until = clock_now() + WORKER_PATIENCE, pause = 0.1;

    for (;;) {
        bool told = pause > 0.1;

        link_send(slot->link, request, answer);
        if (!is_absent(answer)) {
            return;
        }
        if ((request->stops && atomic_load(&worker->draining)) || atomic_load(&worker->hurried)) {
            return;
        }
        if (clock_now() >= until) {
            worker_give_up(worker, WORKER_ALONE,
                           answer->status ? "the service was not ready" : answer->why);
            return;
        }
        if (!told) {
            LOG_WARN("service-gone", log_text("message", answer->why),
                     log_number("status", (double)answer->status));
        }
        link_answer_clear(answer);
        worker_sleep(pause, request->stops ? &worker->draining : &worker->hurried);
        pause = fmin(2.0 * pause, 2.0);
    }
}

/* The sentence of a problem; false: the answer is not one of srnfd, and the text says so. */
static bool problem_of(const struct link_answer *answer, char text[400])
{
    json_t *document =
        answer->bytes ? json_loadb((const char *)answer->bytes, answer->size, 0, NULL) : NULL;
    const char *code = json_string_value(json_object_get(document, "code"));
    const char *detail = json_string_value(json_object_get(document, "detail"));

    if (code) {
        (void)snprintf(text, 400, "%ld %s: %s", answer->status, code, detail ? detail : "");
    } else {
        (void)snprintf(text, 400,
                       "%ld, and nothing that srnfd answers: look at what --server names, and at "
                       "what is between",
                       answer->status);
    }
    json_decref(document);
    return code != NULL;
}

/* ---- Leasing --------------------------------------------------------------------------------- */

static bool copy_text(const json_t *document, const char *member, char *text, size_t size)
{
    const char *value = json_string_value(json_object_get(document, member));

    if (!value || strlen(value) >= size) {
        return false;
    }
    memcpy(text, value, strlen(value) + 1);
    return true;
}

/* Whether it can stand in a path or a header as it is. */
static bool is_word(const char *text)
{
    return text[0] && strspn(text, "0123456789abcdefghijklmnopqrstuvwxyz-") == strlen(text);
}

static bool read_inputs(const char *text, struct tasks_bytes *inputs)
{
    size_t most = strlen(text) / 4 * 3 + 3;

    inputs->bytes = malloc(most);
    return inputs->bytes &&
           sodium_base642bin(inputs->bytes, most, text, strlen(text), NULL, &inputs->size, NULL,
                             sodium_base64_VARIANT_ORIGINAL) == 0;
}

/* False: the answer is no lease. */
static bool read_lease(const struct link_answer *answer, struct lease *lease)
{
    json_t *document = json_loadb((const char *)answer->bytes, answer->size, 0, NULL), *digest;
    json_t *contents = json_object_get(document, "contents");
    const char *inputs = json_string_value(json_object_get(document, "inputs"));
    const char *kind = json_string_value(json_object_get(document, "kind"));
    size_t count = json_array_size(contents), i;
    bool good;

    *lease = (struct lease){.kind = kind ? tasks_kind_find(kind) : NULL};
    lease->seconds = json_number_value(json_object_get(document, "expiresInSeconds"));
    good = copy_text(document, "task", lease->task, sizeof lease->task) &&
           copy_text(document, "secret", lease->secret, sizeof lease->secret) &&
           is_word(lease->task) && is_word(lease->secret) && inputs &&
           count <= TASKS_CONTENTS_MAX && read_inputs(inputs, &lease->inputs);
    if (good) {
        lease->contents = calloc(count + 1, sizeof *lease->contents);
        lease->blocks = calloc(count + 1, sizeof *lease->blocks);
        good = lease->contents && lease->blocks;
        lease->n_contents = count;
    }
    json_array_foreach(contents, i, digest)
    {
        const char *text = json_string_value(digest);

        good = good && text && strlen(text) == TASKS_DIGEST_SIZE - 1 && is_word(text);
        if (good) {
            memcpy(lease->contents[i].digest, text, TASKS_DIGEST_SIZE);
        }
    }
    json_decref(document);
    return good;
}

/* What is left of the time without work. */
static double idle_left(const struct worker *worker)
{
    return worker->idle_seconds > 0.0
               ? atomic_load(&worker->worked) + worker->idle_seconds - clock_now()
               : POLL_SECONDS;
}

/* Asks for a lease; false: there is none now. */
static bool ask(struct worker_slot *slot, struct lease *lease)
{
    struct worker *worker = slot->worker;
    /* The first request waits for nothing but the word that this worker may work. */
    double wait =
        atomic_load(&worker->accepted) ? fmin(POLL_SECONDS, fmax(idle_left(worker), 0.0)) : 0.0;
    json_t *document =
        json_pack("{s:s, s:s, s:s, s:I, s:s, s:f}", "worker", worker->name, "host", worker->host,
                  "cpu", worker->cpu, "slots", (json_int_t)worker->n_slots, "numericBuild",
                  worker->build, "wait", wait);
    char *body = json_dumps(document, JSON_COMPACT), text[400];
    struct link_answer answer = {.status = 0};
    bool leased = false;

    json_decref(document);
    if (body) {
        send(slot,
             &(struct link_request){.method = "POST",
                                    .path = "/v1/leases",
                                    .type = "application/json",
                                    .body = body,
                                    .size = strlen(body),
                                    .seconds = wait + REQUEST_SECONDS,
                                    .stops = true},
             &answer);
    }
    free(body);
    if ((answer.status == 201 || answer.status == 204) &&
        !atomic_exchange(&worker->accepted, true)) {
        LOG("working", log_text("server", worker->target.url), log_text("worker", worker->name),
            log_number("slots", (double)worker->n_slots), log_text("numericBuild", worker->build));
    }
    if (answer.status == 201) {
        leased = read_lease(&answer, lease);
        if (!leased) {
            lease_clear(lease);
            worker_give_up(worker, WORKER_REFUSED, "the service answers with no lease");
        }
    } else if (answer.status != 204 && answer.status != 0) {
        bool ours = problem_of(&answer, text);

        if (answer.status == 408 || answer.status == 429 || (ours && answer.status >= 500)) {
            worker_sleep(1.0, &worker->draining);
        } else {
            worker_give_up(worker, WORKER_REFUSED, text);
        }
    }
    link_answer_clear(&answer);
    return leased;
}

/* ---- A task ---------------------------------------------------------------------------------- */

static void make_path(char path[PATH_MAX_BYTES], const struct lease *lease, const char *rest)
{
    (void)snprintf(path, PATH_MAX_BYTES, "/v1/leases/%s%s", lease->task, rest);
}

enum got { GOT_ALL, GOT_NONE, GOT_DAMAGED };

/* All contents, from the disk or the service. GOT_NONE: the lease is lost, or patience is over. */
static enum got get_contents(struct worker_slot *slot, struct lease *lease)
{
    for (size_t i = 0; i < lease->n_contents; i++) {
        struct tasks_content *content = &lease->contents[i];
        struct tasks_bytes *block = &lease->blocks[i];
        char path[PATH_MAX_BYTES], rest[TASKS_DIGEST_SIZE + 12];
        struct link_answer answer = {.status = 0};

        if (!cache_get(slot->worker->cache, content->digest, block)) {
            (void)snprintf(rest, sizeof rest, "/contents/%s", content->digest);
            make_path(path, lease, rest);
            send(slot,
                 &(struct link_request){.method = "GET",
                                        .path = path,
                                        .secret = lease->secret,
                                        .seconds = REQUEST_SECONDS},
                 &answer);
            *block = (struct tasks_bytes){.bytes = answer.bytes, .size = answer.size};
            if (answer.status != 200 || !block->bytes) {
                return GOT_NONE;
            }
            if (!cache_fits(content->digest, block)) {
                return GOT_DAMAGED;
            }
            cache_put(slot->worker->cache, content->digest, block);
        }
        content->bytes = block->bytes;
        content->size = block->size;
    }
    return GOT_ALL;
}

static void give_back(struct worker_slot *slot, const struct lease *lease)
{
    struct link_answer answer;
    char path[PATH_MAX_BYTES];

    make_path(path, lease, "");
    link_send(
        slot->link,
        &(struct link_request){
            .method = "DELETE", .path = path, .secret = lease->secret, .seconds = REQUEST_SECONDS},
        &answer);
    LOG(answer.status == 204 ? "task-returned" : "task-dropped", log_text("task", lease->task),
        log_number("status", (double)answer.status));
    link_answer_clear(&answer);
}

/* certain: the computation itself has failed, as it will anywhere. The text is that which others
   tell; the service adds where it was. */
static void tell_failure(struct worker_slot *slot, const struct lease *lease, const char *what,
                         bool certain)
{
    char path[PATH_MAX_BYTES], detail[232];
    struct link_answer answer;
    json_t *document;
    char *body;

    (void)snprintf(detail, sizeof detail, "%s", what);
    text_trim_cut(detail);
    document = json_pack("{s:s, s:b}", "detail", detail, "certain", certain);
    body = json_dumps(document, JSON_COMPACT);
    make_path(path, lease, "/failure");
    LOG_WARN("task-failed", log_text("task", lease->task), log_text("detail", detail));
    if (body) {
        send(slot,
             &(struct link_request){.method = "POST",
                                    .path = path,
                                    .secret = lease->secret,
                                    .type = "application/json",
                                    .body = body,
                                    .size = strlen(body),
                                    .seconds = REQUEST_SECONDS},
             &answer);
        link_answer_clear(&answer);
    }
    json_decref(document);
    free(body);
}

static void return_result(struct worker_slot *slot, const struct lease *lease,
                          const struct tasks_bytes *result, double seconds)
{
    unsigned char digest[crypto_hash_sha256_BYTES];
    char path[PATH_MAX_BYTES], encoded[48], text[64];
    struct link_answer answer = {.status = 422};

    (void)crypto_hash_sha256(digest, result->bytes, result->size);
    (void)sodium_bin2base64(encoded, sizeof encoded, digest, sizeof digest,
                            sodium_base64_VARIANT_ORIGINAL);
    (void)snprintf(text, sizeof text, "sha-256=:%s:", encoded);
    make_path(path, lease, "/result");
    for (int i = 0; i < RESULT_TRIES && answer.status == 422; i++) {
        link_answer_clear(&answer);
        send(slot,
             &(struct link_request){.method = "PUT",
                                    .path = path,
                                    .secret = lease->secret,
                                    .type = "application/octet-stream",
                                    .digest = text,
                                    .made = true,
                                    .body = result->bytes,
                                    .size = result->size,
                                    .seconds = REQUEST_SECONDS},
             &answer);
    }
    LOG(answer.status == 204 ? "task-done" : "task-dropped", log_text("task", lease->task),
        log_number("status", (double)answer.status), log_number("seconds", seconds),
        log_number("bytes", (double)result->size));
    link_answer_clear(&answer);
}

static bool on_canceled(void *user)
{
    const struct worker_slot *slot = user;

    return atomic_load_explicit(&slot->cancel, memory_order_relaxed) ||
           atomic_load_explicit(&slot->worker->hurried, memory_order_relaxed);
}

static double on_seconds(void *user)
{
    (void)user;
    return clock_now();
}

static void compute(struct worker_slot *slot, struct lease *lease)
{
    const struct srnf_context context = {
        .user = slot, .canceled = on_canceled, .seconds = on_seconds};
    struct tasks_bytes result = {.bytes = NULL};
    struct srnf_error error = {.status = 0};
    double before = clock_now();
    enum got got;
    int status;

    got = get_contents(slot, lease);
    if (got != GOT_ALL) {
        if (got == GOT_DAMAGED) {
            tell_failure(slot, lease, "what the task is about came damaged", false);
        } else {
            give_back(slot, lease);
        }
        return;
    }
    status = lease->kind->run(lease->inputs.bytes, lease->inputs.size, lease->contents,
                              lease->n_contents, &context, &result, &error);
    if (atomic_load(&slot->cancel)) {
        LOG("task-dropped", log_text("task", lease->task));
    } else if (atomic_load(&slot->worker->hurried)) {
        give_back(slot, lease);
    } else if (status < 0) {
        tell_failure(slot, lease, error.message[0] ? error.message : srnf_strerror(status),
                     status != SRNF_ENOMEM && status != SRNF_ECANCELED);
    } else {
        return_result(slot, lease, &result, clock_now() - before);
    }
    free(result.bytes);
}

/* ---- The thread ------------------------------------------------------------------------------ */

static void hold(struct worker_slot *slot, const struct lease *lease)
{
    (void)pthread_mutex_lock(&slot->mutex);
    slot->leased = lease != NULL;
    atomic_store(&slot->cancel, false);
    if (lease) {
        memcpy(slot->task, lease->task, sizeof slot->task);
        memcpy(slot->secret, lease->secret, sizeof slot->secret);
        slot->beat = clock_now() + lease->seconds / 3.0;
    }
    (void)pthread_mutex_unlock(&slot->mutex);
}

static void work(struct worker_slot *slot)
{
    struct worker *worker = slot->worker;
    struct lease lease;

    if (!ask(slot, &lease)) {
        return;
    }
    atomic_store(&worker->worked, clock_now());
    hold(slot, &lease);
    if (lease.kind) {
        compute(slot, &lease);
    } else {
        tell_failure(slot, &lease, "this worker knows no such kind of task", false);
    }
    hold(slot, NULL);
    atomic_store(&worker->worked, clock_now());
    lease_clear(&lease);
}

void *worker_slot_main(void *argument)
{
    struct worker_slot *slot = argument;
    struct worker *worker = slot->worker;

    (void)pthread_setname_np(pthread_self(), "srnfd-slot");
    priority_compute();
    while (!atomic_load(&worker->draining) && idle_left(worker) > 0.0) {
        work(slot);
    }
    (void)atomic_fetch_sub(&worker->running, 1);
    return NULL;
}
