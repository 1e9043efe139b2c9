/*
 * drawn.h - workers that are simulated: threads that lease over HTTP as srnfd worker does, answer
 * after times that are drawn, and return results that they have not computed; and what they cost
 * the daemon. They share the machine with it: where both want the processors, tasks a second are
 * what is left to it, and seconds of a processor for each task say what it can do alone.
 */
#ifndef TESTS_BENCH_DRAWN_H
#define TESTS_BENCH_DRAWN_H

#include "support/compare.h"
#include "support/daemon.h"
#include "worker/link.h"
#include "build.h"

#include <curl/curl.h>
#include <dirent.h>
#include <jansson.h>
#include <math.h>
#include <pthread.h>
#include <sodium.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define DRAWN_WORKERS_MAX ((size_t)1000)
#define DRAWN_THREADS_MAX ((size_t)256) /* of the daemon */

struct drawn {
    struct daemon service;
    char folder[40], url[64], build[BUILD_ARITHMETIC_SIZE];
    struct link_target target;
    atomic_bool stop;
};

static inline double drawn_now(void)
{
    struct timespec time;

    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static inline void drawn_pause(double seconds)
{
    (void)nanosleep(&(struct timespec){.tv_sec = (time_t)seconds,
                                       .tv_nsec = (long)(1e9 * (seconds - floor(seconds)))},
                    NULL);
}

static inline _Noreturn void drawn_give_up(struct drawn *drawn, const char *what,
                                           const char *detail)
{
    (void)fprintf(stderr, "%s: %s\n", what, detail && detail[0] ? detail : "no answer");
    daemon_release(&drawn->service);
    exit(1);
}

/* Starts a daemon that offers its tasks. */
static inline void drawn_open(struct drawn *drawn)
{
    static const char *const options[] = {"--executor",
                                          "workers",
                                          "--lease-seconds",
                                          "60",
                                          "--workers",
                                          "1",
                                          "--max-connections",
                                          "2048",
                                          "--max-owner-requests",
                                          "2048",
                                          "--verify-tasks",
                                          "0",
                                          NULL};

    *drawn = (struct drawn){.folder = "/tmp/srnfd-drawn.XXXXXX"};
    (void)curl_global_init(CURL_GLOBAL_DEFAULT);
    if (!mkdtemp(drawn->folder)) {
        exit(1);
    }
    daemon_prepare(&drawn->service, drawn->folder, "data");
    drawn->service.options = options;
    if (!daemon_start(&drawn->service)) {
        drawn_give_up(drawn, "the daemon", "it does not start");
    }
    (void)snprintf(drawn->url, sizeof drawn->url, "http://127.0.0.1:%d", drawn->service.port);
    build_arithmetic_id(drawn->build);
    drawn->target = (struct link_target){
        .url = drawn->url, .host = "here", .cpu = "drawn", .build = drawn->build};
}

/* Returns the exit status of the bench. */
static inline int drawn_close(struct drawn *drawn)
{
    char command[80];

    (void)daemon_stop(&drawn->service);
    daemon_release(&drawn->service);
    (void)snprintf(command, sizeof command, "rm -rf --one-file-system %s", drawn->folder);
    return system(command) == 0 ? 0 : 1;
}

/* ---- Jobs ------------------------------------------------------------------------------------ */

/* Sends JSON and returns a member of the answer in value. */
static inline void drawn_send(struct drawn *drawn, const char *path, const char *fields,
                              const char *body, const char *name, char value[80])
{
    char headers[120];
    struct answer answer;

    (void)snprintf(headers, sizeof headers, "Content-Type: application/json\r\n%s", fields);
    if (daemon_request(&drawn->service, "POST", path, headers, body, strlen(body), &answer) / 100 !=
        2) {
        drawn_give_up(drawn, path, answer.body);
    }
    answer_member(&answer, name, value, 80);
    answer_clear(&answer);
}

/* The text of a member of the record of a job, as its status. */
static inline void drawn_job(struct drawn *drawn, const char *job, const char *name, char value[80])
{
    struct answer answer;
    char path[120];

    (void)snprintf(path, sizeof path, "/v1/jobs/%s", job);
    (void)daemon_request(&drawn->service, "GET", path, "", NULL, 0, &answer);
    answer_member(&answer, name, value, 80);
    answer_clear(&answer);
}

/* ---- Tasks ----------------------------------------------------------------------------------- */

struct drawn_lease {
    char task[64], secret[64];
    json_t *document; /* NULL: there is none now */
};

/* Asks for a task; false: no answer that has one or says that there is none. */
static inline bool drawn_ask(struct drawn *drawn, struct link *link, size_t number, double wait,
                             struct drawn_lease *lease)
{
    char body[600];
    struct link_answer answer;
    bool good;

    (void)snprintf(body, sizeof body,
                   "{\"worker\":\"thread-%zu\",\"host\":\"bench\",\"cpu\":\"none\",\"slots\":1,"
                   "\"numericBuild\":\"%s\",\"wait\":%g}",
                   number, drawn->build, wait);
    link_send(link,
              &(struct link_request){.method = "POST",
                                     .path = "/v1/leases",
                                     .type = "application/json",
                                     .body = body,
                                     .size = strlen(body),
                                     .seconds = 60.0},
              &answer);
    if (answer.status >= 400 && answer.status < 500) {
        drawn_give_up(drawn, "a lease", (const char *)answer.bytes); /* of another build */
    }
    good = answer.status == 201 || answer.status == 204;
    *lease = (struct drawn_lease){.document = NULL};
    if (answer.status == 201) {
        lease->document = json_loadb((const char *)answer.bytes, answer.size, 0, NULL);
        (void)snprintf(lease->task, sizeof lease->task, "%s",
                       json_string_value(json_object_get(lease->document, "task")));
        (void)snprintf(lease->secret, sizeof lease->secret, "%s",
                       json_string_value(json_object_get(lease->document, "secret")));
    }
    link_answer_clear(&answer);
    return good;
}

static inline const char *drawn_content(const struct drawn_lease *lease, size_t i)
{
    return json_string_value(json_array_get(json_object_get(lease->document, "contents"), i));
}

/* One of the contents of the task (answer->bytes); false: it did not come. */
static inline bool drawn_fetch(struct link *link, const struct drawn_lease *lease, size_t i,
                               struct link_answer *answer)
{
    char path[200];

    (void)snprintf(path, sizeof path, "/v1/leases/%s/contents/%s", lease->task,
                   drawn_content(lease, i));
    link_send(link,
              &(struct link_request){
                  .method = "GET", .path = path, .secret = lease->secret, .seconds = 60.0},
              answer);
    return answer->status == 200;
}

/* The number at an offset in the inputs of the task. */
static inline uint64_t drawn_number(const struct drawn_lease *lease, size_t offset)
{
    const char *text = json_string_value(json_object_get(lease->document, "inputs"));
    static _Thread_local unsigned char inputs[(size_t)64 << 10];
    uint64_t number = 0;
    size_t size = 0;

    (void)sodium_base642bin(inputs, sizeof inputs, text ? text : "", text ? strlen(text) : 0, NULL,
                            &size, NULL, sodium_base64_VARIANT_ORIGINAL);
    for (size_t k = 0; k < 8 && offset + 8 <= size; k++) {
        number |= (uint64_t)inputs[offset + k] << 8 * k;
    }
    return number;
}

/* Returns the result, of so many parts that are all the same, and lets go of the lease; false: it
   was not taken. */
static inline bool drawn_return(struct link *link, struct drawn_lease *lease, const void *part,
                                size_t part_size, size_t parts)
{
    size_t size = parts * part_size;
    unsigned char *bytes = malloc(size + 1);
    unsigned char digest[crypto_hash_sha256_BYTES];
    char path[160], encoded[48], text[64];
    struct link_answer answer;
    bool taken;

    for (size_t i = 0; i < parts; i++) {
        memcpy(bytes + i * part_size, part, part_size);
    }
    (void)crypto_hash_sha256(digest, bytes, size);
    (void)sodium_bin2base64(encoded, sizeof encoded, digest, sizeof digest,
                            sodium_base64_VARIANT_ORIGINAL);
    (void)snprintf(text, sizeof text, "sha-256=:%s:", encoded);
    (void)snprintf(path, sizeof path, "/v1/leases/%s/result", lease->task);
    link_send(link,
              &(struct link_request){.method = "PUT",
                                     .path = path,
                                     .secret = lease->secret,
                                     .type = "application/octet-stream",
                                     .digest = text,
                                     .made = true,
                                     .body = bytes,
                                     .size = size,
                                     .seconds = 60.0},
              &answer);
    taken = answer.status == 204;
    link_answer_clear(&answer);
    free(bytes);
    json_decref(lease->document);
    return taken;
}

/* From 0 up to 1, without 1. */
static inline double drawn_uniform(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) * 0x1p-53;
}

/* Of an exponential distribution, cut at three times its mean: no lease is to expire. */
static inline double drawn_seconds(uint64_t *state, double mean)
{
    double times = -log1p(-drawn_uniform(state));

    return mean * (times < 3.0 ? times : 3.0);
}

/* ---- What it costs --------------------------------------------------------------------------- */

struct drawn_cost {
    double seconds, processor, received, sent, written, memory; /* memory: the largest so far */
    size_t n_threads;
    struct {
        long id;
        char name[16];
        double seconds;
    } threads[DRAWN_THREADS_MAX];
};

static inline double drawn_metric(const char *text, const char *name)
{
    const char *at = text;
    double sum = 0.0;

    while ((at = strstr(at, name)) != NULL) {
        if (at > text && at[-1] == '\n') {
            sum += strtod(strpbrk(at, " ") + 1, NULL);
        }
        at += strlen(name);
    }
    return sum;
}

/* The number after `name` in a file of the daemon's in /proc. */
static inline double drawn_proc(const struct drawn *drawn, const char *file, const char *name)
{
    char path[400], line[256];
    FILE *stream;
    double value = 0.0;

    (void)snprintf(path, sizeof path, "/proc/%ld/%s", (long)drawn->service.pid, file);
    stream = fopen(path, "re");
    while (stream && fgets(line, sizeof line, stream)) {
        if (strncmp(line, name, strlen(name)) == 0) {
            value = strtod(line + strlen(name), NULL);
            break;
        }
    }
    if (stream) {
        (void)fclose(stream);
    }
    return value;
}

static inline void drawn_threads(const struct drawn *drawn, struct drawn_cost *cost)
{
    char path[300];
    const struct dirent *entry;
    DIR *folder;

    (void)snprintf(path, sizeof path, "/proc/%ld/task", (long)drawn->service.pid);
    folder = opendir(path);
    while (folder && (entry = readdir(folder)) && cost->n_threads < DRAWN_THREADS_MAX) {
        FILE *name;
        size_t i = cost->n_threads;

        if (entry->d_name[0] == '.') {
            continue;
        }
        cost->threads[i].id = strtol(entry->d_name, NULL, 10);
        (void)snprintf(path, sizeof path, "task/%.20s/schedstat", entry->d_name);
        cost->threads[i].seconds = 1e-9 * drawn_proc(drawn, path, "");
        (void)snprintf(path, sizeof path, "/proc/%ld/task/%.20s/comm", (long)drawn->service.pid,
                       entry->d_name);
        name = fopen(path, "re");
        if (name && fscanf(name, "%15s", cost->threads[i].name) == 1) {
            cost->n_threads++;
        }
        if (name) {
            (void)fclose(name);
        }
    }
    if (folder) {
        (void)closedir(folder);
    }
}

static inline struct drawn_cost drawn_measure(struct drawn *drawn)
{
    struct drawn_cost cost = {.seconds = drawn_now()};
    struct answer answer;

    if (daemon_request(&drawn->service, "GET", "/metrics", "", NULL, 0, &answer) != 200) {
        drawn_give_up(drawn, "metrics", answer.body);
    }
    cost.processor = drawn_metric(answer.body, "process_cpu_seconds_total ");
    cost.received = drawn_metric(answer.body, "srnfd_http_received_bytes_total ");
    cost.sent = drawn_metric(answer.body, "srnfd_http_sent_bytes_total ");
    answer_clear(&answer);
    cost.written = drawn_proc(drawn, "io", "write_bytes:");
    cost.memory = drawn_proc(drawn, "status", "VmHWM:") / 1024.0;
    drawn_threads(drawn, &cost);
    return cost;
}

/* Seconds of a thread of the daemon between the two. */
static inline double drawn_taken(const struct drawn_cost *before, const struct drawn_cost *after,
                                 size_t i)
{
    double seconds = after->threads[i].seconds;

    for (size_t k = 0; k < before->n_threads; k++) {
        seconds -= before->threads[k].id == after->threads[i].id ? before->threads[k].seconds : 0;
    }
    return seconds;
}

/* Those of the threads that run jobs, or of all others. */
static inline double drawn_sum(const struct drawn_cost *before, const struct drawn_cost *after,
                               bool jobs)
{
    double seconds = 0.0;

    for (size_t i = 0; i < after->n_threads; i++) {
        bool runs = strncmp(after->threads[i].name, "srnfd-work", 10) == 0;

        seconds += runs == jobs ? drawn_taken(before, after, i) : 0.0;
    }
    return seconds;
}

/* Prints what n tasks took between the two: a line of columns (drawn_head) without its end. */
static inline void drawn_print(const struct drawn_cost *before, const struct drawn_cost *after,
                               double n)
{
    const char *name = "?";
    double most = 0.0;

    for (size_t i = 0; i < after->n_threads; i++) {
        double seconds = drawn_taken(before, after, i);

        name = seconds > most ? after->threads[i].name : name;
        most = compare_max(most, seconds);
    }
    (void)printf("%9.0f %8.2f %7.2f %-15s %8.0f %8.0f %8.0f",
                 n / (after->seconds - before->seconds),
                 1e3 * (after->processor - before->processor) / n, 1e3 * most / n, name,
                 (after->received - before->received) / n, (after->sent - before->sent) / n,
                 (after->written - before->written) / n);
}

#define DRAWN_HEAD "  tasks/s   cpu ms  the busiest thread      in B    out B  write B"

#endif
