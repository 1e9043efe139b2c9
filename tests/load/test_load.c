/*
 * srnfd-test: alone
 * srnfd-test: release-only
 * srnfd-test: timeout 600
 *
 * test_load.c - what a well-behaved client gets: the requests a second of two cheap routes, against
 * those of libmicrohttpd's own minimal example in the same run, by the same client; and the time of
 * GET /v1/jobs/{id} beside thousands of idle connections, slow senders and slow readers, while all
 * workers compute.
 *
 * SRNFD_LOAD=full (make load) is the whole of it: 15 rounds of 0.7 s for each of four servers and
 * routes, 10,000 idle connections, 500 slow senders, 100 slow readers, and the bounds that are
 * promised. Without it rounds are shorter, the crowd is a tenth and the bounds are wide, so that a
 * busy machine does not fail it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "support/wire.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#define CONNECTIONS 16 /* of the client that counts requests */
#define ROUNDS 15
#define IDLE_MAX 10000
#define SENDERS_MAX 500
#define READERS_MAX 100
#define ASKS_MAX 3000

static bool full;
static struct daemon service;
static struct wire_answer answer;
static char host[64], small_job[80], long_job[80];

/* ---- libmicrohttpd's minimal example --------------------------------------------------------- */

static enum MHD_Result answer_minimal(void *cls, struct MHD_Connection *connection, const char *url,
                                      const char *method, const char *version, const char *data,
                                      size_t *data_size, void **state)
{
    static const char page[] = "{\"status\":\"ok\"}\n";
    static int first;
    struct MHD_Response *response;
    enum MHD_Result result;

    (void)cls;
    (void)url;
    (void)version;
    (void)data;
    (void)data_size;
    if (strcmp(method, "GET") != 0) {
        return MHD_NO;
    }
    if (*state != &first) { /* never at once: that would close the connection */
        *state = &first;
        return MHD_YES;
    }
    *state = NULL;
    response = MHD_create_response_from_buffer(sizeof page - 1, (void *)(uintptr_t)page,
                                               MHD_RESPMEM_PERSISTENT);
    result = MHD_queue_response(connection, MHD_HTTP_OK, response);
    MHD_destroy_response(response);
    return result;
}

/* In a process of its own, as its source has it (the library's choice of polling, one thread), or
   with as many threads as the service has for HTTP; its port comes through the pipe. */
static pid_t start_minimal(unsigned threads, int *port)
{
    int ends[2];
    pid_t child;

    if (pipe(ends) != 0) {
        return -1;
    }
    child = fork();
    if (child == 0) {
        const union MHD_DaemonInfo *info;
        struct MHD_Daemon *daemon =
            MHD_start_daemon(MHD_USE_AUTO | MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_ERROR_LOG, 0,
                             NULL, NULL, answer_minimal, NULL, MHD_OPTION_CONNECTION_TIMEOUT, 120U,
                             MHD_OPTION_THREAD_POOL_SIZE, threads, MHD_OPTION_END);

        info = daemon ? MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_BIND_PORT) : NULL;
        *port = info ? info->port : 0;
        (void)!write(ends[1], port, sizeof *port);
        (void)pause();
        _exit(0);
    }
    (void)close(ends[1]);
    if (read(ends[0], port, sizeof *port) != (ssize_t)sizeof *port) {
        *port = 0;
    }
    (void)close(ends[0]);
    return child;
}

/* ---- Counting requests ----------------------------------------------------------------------- */

struct client {
    int fd;
    size_t used, wanted; /* bytes of the answer so far; of all of it, 0 while unknown */
    char text[8192];
};

/* Reads what is there; true when the answer is whole and was a 200. What the client spends is no
   server's fault, so it looks for the length as the library writes it. */
static bool take(struct client *client)
{
    ssize_t n = recv(client->fd, client->text + client->used,
                     sizeof client->text - 1 - client->used, MSG_DONTWAIT);
    const char *end, *length;

    if (n <= 0) {
        return false;
    }
    client->used += (size_t)n;
    client->text[client->used] = '\0';
    if (client->wanted == 0 && (end = strstr(client->text, "\r\n\r\n")) != NULL) {
        length = strstr(client->text, "\r\nContent-Length:");
        assert_memory_equal(client->text, "HTTP/1.1 200", 12);
        assert_non_null(length);
        client->wanted = (size_t)(end + 4 - client->text) + (size_t)strtoul(length + 17, NULL, 10);
        assert_true(client->wanted < sizeof client->text);
    }
    return client->wanted > 0 && client->used >= client->wanted;
}

/* Requests a second of CONNECTIONS clients that each ask again as soon as they have an answer. */
static double rate(int port, const char *path, double seconds)
{
    const struct daemon at = {.port = port};
    struct client *clients = calloc(CONNECTIONS, sizeof *clients);
    struct pollfd polls[CONNECTIONS];
    char request[300];
    size_t length, done = 0;
    double start, end;

    assert_non_null(clients);
    length = (size_t)snprintf(request, sizeof request,
                              "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", path, port);
    for (size_t i = 0; i < CONNECTIONS; i++) {
        clients[i].fd = wire_dial(&at);
        polls[i] = (struct pollfd){.fd = clients[i].fd, .events = POLLIN};
        assert_true(wire_send(clients[i].fd, request, length));
    }
    start = wire_now();
    end = start + seconds;
    while (wire_now() < end) {
        assert_true(poll(polls, CONNECTIONS, 5000) > 0);
        for (size_t i = 0; i < CONNECTIONS; i++) {
            if (polls[i].revents && take(&clients[i])) {
                clients[i].used = clients[i].wanted = 0;
                done++;
                assert_true(wire_send(clients[i].fd, request, length));
            }
        }
    }
    seconds = wire_now() - start;
    for (size_t i = 0; i < CONNECTIONS; i++) {
        (void)close(clients[i].fd);
    }
    free(clients);
    return (double)done / seconds;
}

/* Microseconds that the process has spent, user and system. */
static double processor_time(pid_t pid)
{
    char path[64], text[1024];
    double fields[16] = {0};
    FILE *file;
    size_t size;
    char *at;

    (void)snprintf(path, sizeof path, "/proc/%d/stat", (int)pid);
    file = fopen(path, "r");
    assert_non_null(file);
    size = fread(text, 1, sizeof text - 1, file);
    (void)fclose(file);
    text[size] = '\0';
    at = strrchr(text, ')');
    assert_non_null(at);
    at += 3; /* the fourth field; 14 and 15 are the times (proc(5)) */
    for (int i = 4; i < 16; i++) {
        fields[i] = strtod(at, &at);
    }
    return 1e6 * (fields[14] + fields[15]) / (double)sysconf(_SC_CLK_TCK);
}

static double total(const double *values)
{
    double sum = 0;

    for (size_t i = 0; i < ROUNDS; i++) {
        sum += values[i];
    }
    return sum;
}

static int by_value(const void *a, const void *b)
{
    const double *x = a, *y = b;

    return (*x > *y) - (*x < *y);
}

static double median(double *values, size_t n)
{
    qsort(values, n, sizeof *values, by_value);
    return n % 2 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

/* ---- The service ----------------------------------------------------------------------------- */

static int ask(const char *method, const char *path, const char *fields, const char *body,
               size_t size)
{
    char head[600];
    int fd = wire_dial(&service);

    assert_true(fd >= 0);
    (void)snprintf(head, sizeof head, "%s %s HTTP/1.1\r\nHost: %s\r\n%sContent-Length: %zu\r\n\r\n",
                   method, path, host, fields, size);
    (void)wire_say(fd, head);
    (void)wire_send(fd, body, size);
    wire_hear(fd, false, &answer);
    (void)close(fd);
    return answer.status;
}

/* The first id of that kind in the answer. */
static void take_id(const char *prefix, char id[80])
{
    char mark[40];
    const char *at;

    (void)snprintf(mark, sizeof mark, "\"id\":\"%s", prefix);
    at = strstr(answer.text, mark);
    assert_non_null(at);
    (void)snprintf(id, 80, "%.*s", (int)strcspn(at + 6, "\""), at + 6);
}

static void upload(const char *path, char id[80])
{
    static char bytes[200000];
    FILE *file = fopen(path, "rb");
    size_t size;

    assert_non_null(file);
    size = fread(bytes, 1, sizeof bytes, file);
    (void)fclose(file);
    assert_true(ask("POST", "/v1/meshes?format=ply", "", bytes, size) < 300);
    take_id("mesh-", id);
}

static void submit(const char *process, const char *inputs, char id[80])
{
    char path[80];

    (void)snprintf(path, sizeof path, "/v1/processes/%s/execution", process);
    assert_int_equal(ask("POST", path,
                         "Content-Type: application/json\r\nPrefer: respond-async\r\n", inputs,
                         strlen(inputs)),
                     201);
    take_id("job-", id);
}

static bool job_is(const char *id, const char *status)
{
    char path[120], member[40];

    (void)snprintf(path, sizeof path, "/v1/jobs/%s", id);
    (void)snprintf(member, sizeof member, "\"status\":\"%s\"", status);
    return ask("GET", path, "", "", 0) == 200 && strstr(answer.text, member);
}

static int set_up(void **state)
{
    static const char *const options[] = {"--header-seconds",
                                          "300",
                                          "--transfer-seconds",
                                          "300",
                                          "--max-waiting",
                                          "20000",
                                          "--workers",
                                          "0",
                                          NULL};
    const char *wanted = getenv("SRNFD_LOAD");
    char mesh[80], inputs[200];
    struct rlimit limit;

    (void)state;
    full = wanted && strcmp(wanted, "full") == 0;
    if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
        limit.rlim_cur = limit.rlim_max;
        (void)setrlimit(RLIMIT_NOFILE, &limit);
    }
    if (!wire_start(&service, options)) {
        return -1;
    }
    (void)snprintf(host, sizeof host, "127.0.0.1:%d", service.port);
    upload("tests/data/aal_subcortex/L_thalamus.ply", mesh);
    (void)snprintf(inputs, sizeof inputs, "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":6}}", mesh);
    submit("encode", inputs, small_job);
    while (!job_is(small_job, "successful")) {
        wire_nap(0.05);
    }
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    return wire_stop(&service);
}

/* ---- Tests ----------------------------------------------------------------------------------- */

static void test_cheap_routes_keep_up(void **state)
{
    double one[ROUNDS], two[ROUNDS], health[ROUNDS], result[ROUNDS], best, before, served = 0;
    double seconds = full ? 0.7 : 0.1, spent[3];
    char path[120];
    int ports[2];
    pid_t children[2] = {start_minimal(0, &ports[0]), start_minimal(2, &ports[1])};

    (void)state;
    assert_true(ports[0] > 0 && ports[1] > 0);
    (void)snprintf(path, sizeof path, "/v1/jobs/%s/results", small_job);
    assert_int_equal(ask("GET", path, "", "", 0), 200);
    print_message("the stored result has %zu bytes with its head\n", answer.size);
    assert_true(answer.size <= 4096 + 600);
    before = processor_time(service.pid);
    for (size_t i = 0; i < ROUNDS; i++) {
        one[i] = rate(ports[0], "/", seconds);
        two[i] = rate(ports[1], "/", seconds);
        best = one[i] > two[i] ? one[i] : two[i];
        health[i] = rate(service.port, "/healthz", seconds) / best;
        result[i] = rate(service.port, path, seconds);
        served += seconds * (health[i] * best + result[i]);
        result[i] /= best;
    }
    spent[2] = (processor_time(service.pid) - before) / served;
    spent[0] = processor_time(children[0]) / (seconds * total(one));
    spent[1] = processor_time(children[1]) / (seconds * total(two));
    for (size_t i = 0; i < 2; i++) {
        (void)kill(children[i], SIGKILL);
        (void)waitpid(children[i], NULL, 0);
    }
    print_message("processor time of a request: minimal example %.1f and %.1f us, the service over "
                  "both routes %.1f us\n",
                  spent[0], spent[1], spent[2]);
    print_message("minimal example %.0f requests/s with one thread, %.0f with two; of the better "
                  "GET /healthz has %.0f %%, a stored result %.0f %%\n",
                  median(one, ROUNDS), median(two, ROUNDS), 100 * median(health, ROUNDS),
                  100 * median(result, ROUNDS));
    assert_true(median(health, ROUNDS) >= (full ? 0.8 : 0.2));
    assert_true(median(result, ROUNDS) >= (full ? 0.4 : 0.1));
}

static int idle[IDLE_MAX], senders[SENDERS_MAX], readers[READERS_MAX];

static void gather(size_t n_idle, size_t n_senders, size_t n_readers)
{
    char request[200];
    int small = 2000;

    for (size_t i = 0; i < n_idle; i++) {
        idle[i] = wire_dial(&service);
        assert_true(idle[i] >= 0);
    }
    for (size_t i = 0; i < n_senders; i++) {
        (void)snprintf(request, sizeof request,
                       i % 2 ? "GET / HTTP/1.1\r\nHost: %s\r\nX-Slow: "
                             : "POST /v1/meshes HTTP/1.1\r\nHost: %s\r\nContent-Length: 1000000"
                               "\r\n\r\n",
                       host);
        senders[i] = wire_dial(&service);
        (void)wire_say(senders[i], request);
    }
    (void)snprintf(request, sizeof request, "GET /v1/openapi.yaml HTTP/1.1\r\nHost: %s\r\n\r\n",
                   host);
    for (size_t i = 0; i < n_readers; i++) {
        readers[i] = wire_dial(&service);
        (void)setsockopt(readers[i], SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        for (int k = 0; k < 60; k++) {
            (void)wire_say(readers[i], request);
        }
    }
}

static void disperse(size_t n_idle, size_t n_senders, size_t n_readers)
{
    for (size_t i = 0; i < n_idle; i++) {
        (void)close(idle[i]);
    }
    for (size_t i = 0; i < n_senders; i++) {
        (void)close(senders[i]);
    }
    for (size_t i = 0; i < n_readers; i++) {
        (void)close(readers[i]);
    }
}

/* Keeps all workers computing: more long jobs than there are. */
static void keep_busy(void)
{
    char left[80], right[80], inputs[300];
    long workers = sysconf(_SC_NPROCESSORS_ONLN);

    upload("tests/data/aal_subcortex/L_thalamus.ply", left);
    upload("tests/data/aal_subcortex/R_thalamus.ply", right);
    for (long i = 0; i < 16 * workers; i++) {
        (void)snprintf(inputs, sizeof inputs,
                       "{\"inputs\":{\"from\":\"%s\",\"to\":\"%s\",\"steps\":%ld}}", left, right,
                       60 + i);
        submit("geodesic", inputs, long_job);
    }
    while (!job_is(long_job, "accepted")) {
        wire_nap(0.05);
    }
}

static void test_crowds_do_not_slow_others(void **state)
{
    static double times[ASKS_MAX];
    size_t n_idle = full ? IDLE_MAX : 1000, n_senders = full ? SENDERS_MAX : 50;
    size_t n_readers = full ? READERS_MAX : 10, asks = full ? ASKS_MAX : 500;
    char request[200];
    int fd;

    (void)state;
    keep_busy();
    gather(n_idle, n_senders, n_readers);
    wire_nap(1.0);
    (void)snprintf(request, sizeof request, "GET /v1/jobs/%s HTTP/1.1\r\nHost: %s\r\n\r\n",
                   small_job, host);
    fd = wire_dial(&service);
    for (size_t i = 0; i < asks; i++) {
        double start = wire_now();

        if (i % 10 == 0) { /* a slow sender's next byte, so that they live */
            (void)wire_say(senders[i / 10 % n_senders], "a");
        }
        assert_true(wire_say(fd, request));
        wire_hear(fd, false, &answer);
        times[i] = 1e3 * (wire_now() - start);
        assert_int_equal(answer.status, 200);
        wire_nap(0.003);
    }
    (void)close(fd);
    qsort(times, asks, sizeof *times, by_value);
    print_message("beside %zu idle, %zu slow senders, %zu slow readers: median %.2f ms, p99 %.2f "
                  "ms, slowest %.2f ms; resident %ld MiB\n",
                  n_idle, n_senders, n_readers, times[asks / 2], times[asks * 99 / 100],
                  times[asks - 1], wire_status_number(&service, "VmRSS") / 1024);
    assert_true(!job_is(long_job, "successful"));
    /* On a busy machine the last per cent is that of its scheduler: the small form asks the
       median. */
    assert_true(times[asks / 2] < 10.0);
    assert_true(!full || times[asks * 99 / 100] < 10.0);
    disperse(n_idle, n_senders, n_readers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cheap_routes_keep_up),
        cmocka_unit_test(test_crowds_do_not_slow_others),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
