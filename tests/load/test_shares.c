/*
 * srnfd-test: alone
 * srnfd-test: release-only
 * srnfd-test: timeout 600
 *
 * test_shares.c - four users, twenty clients, one queue: how many jobs of each user end while all
 * of them have jobs waiting. The users' clients do not begin together: the first user has queued
 * all its jobs before the others send their first. Two workers, on any machine: more would be done
 * before all is queued.
 *
 * SRNFD_LOAD=full (make load) queues 2,000 jobs, without it 200.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "support/compare.h"
#include "support/wire.h"

#include <jansson.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define USERS 4
#define CLIENTS 20
#define EACH_MAX 100 /* jobs of a client */
#define JOBS_MAX (CLIENTS * EACH_MAX)
#define TIME_SIZE 32
#define CURSOR_SIZE 400
#define TOLERANCE 0.1 /* of a user's share */

struct user {
    char fields[200]; /* of its requests */
    char mesh[64];
    size_t ended;         /* while all had jobs waiting */
    char last[TIME_SIZE]; /* when its last job ended */
};

struct client {
    size_t number, user, jobs;
    size_t refused;
    pthread_t thread;
};

/* One job as it ended. */
struct end {
    size_t user;
    char created[TIME_SIZE], finished[TIME_SIZE]; /* RFC 3339, of one length: ordered as texts */
};

static struct daemon service;
static struct user users[USERS];
static struct end ends[JOBS_MAX];
static size_t n_ends;

/* ---- Users ----------------------------------------------------------------------------------- */

static void make_user(struct user *user, const char *name)
{
    const char *arguments[] = {"token", "add", "--data", service.data, "--name", name, NULL};
    static char mesh[200000];
    struct answer answer;
    const char *secret;
    char text[600];
    FILE *file;
    size_t size;

    assert_int_equal(daemon_command(arguments, text, sizeof text), 0);
    secret = strstr(text, "srnfd_");
    assert_non_null(secret);
    (void)snprintf(user->fields, sizeof user->fields,
                   "Content-Type: application/json\r\nPrefer: respond-async\r\n"
                   "Authorization: Bearer %.*s\r\n",
                   (int)strcspn(secret, "\n"), secret);
    file = fopen("tests/data/aal_subcortex/L_thalamus.ply", "rb");
    assert_non_null(file);
    size = fread(mesh, 1, sizeof mesh, file);
    (void)fclose(file);
    (void)snprintf(text, sizeof text, "%s", strstr(user->fields, "Authorization"));
    assert_int_equal(
        daemon_request(&service, "POST", "/v1/meshes?format=ply", text, mesh, size, &answer), 201);
    answer_member(&answer, "id", user->mesh, sizeof user->mesh);
    answer_clear(&answer);
}

static int set_up(void **state)
{
    static const char *const options[] = {"--quota-requests", "0",        "--workers", "2",
                                          "--access-log",     "refusals", NULL};
    static const char *const names[USERS] = {"ada", "ben", "cleo", "dan"};

    (void)state;
    if (!wire_start(&service, options)) {
        return -1;
    }
    for (size_t i = 0; i < USERS; i++) {
        make_user(&users[i], names[i]);
    }
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    return wire_stop(&service);
}

/* ---- Clients --------------------------------------------------------------------------------- */

/* Queues its jobs, no two of which are the same. */
static void *queue(void *argument)
{
    struct client *client = argument;
    const struct user *user = &users[client->user];
    struct answer answer;
    char inputs[200];

    for (size_t i = 0; i < client->jobs; i++) {
        (void)snprintf(inputs, sizeof inputs,
                       "{\"inputs\":{\"mesh\":\"%s\",\"lmax\":8,\"smoothing\":%.9f}}", user->mesh,
                       1e-6 * (double)(1 + client->number * EACH_MAX + i));
        client->refused += daemon_request(&service, "POST", "/v1/processes/encode/execution",
                                          user->fields, inputs, strlen(inputs), &answer) != 201;
        answer_clear(&answer);
    }
    return NULL;
}

static void run_clients(struct client *clients, size_t first, size_t end)
{
    for (size_t i = first; i < end; i++) {
        assert_int_equal(pthread_create(&clients[i].thread, NULL, queue, &clients[i]), 0);
    }
    for (size_t i = first; i < end; i++) {
        (void)pthread_join(clients[i].thread, NULL);
        assert_int_equal(clients[i].refused, 0);
    }
}

/* ---- What became of the jobs ----------------------------------------------------------------- */

static void take_time(char time[TIME_SIZE], const json_t *job, const char *member)
{
    const char *text = json_string_value(json_object_get(job, member));

    assert_non_null(text);
    (void)snprintf(time, TIME_SIZE, "%s", text);
}

/* A page of the list of a user's successful jobs. False after the last; cursor goes from page to
   page, "" in the beginning. */
static bool take_page(size_t user, char cursor[CURSOR_SIZE])
{
    struct answer answer;
    char path[CURSOR_SIZE + 80];
    json_t *page, *job;
    const char *next;
    size_t i;

    (void)snprintf(path, sizeof path, "/v1/jobs?status=successful&limit=100%s%s",
                   cursor[0] ? "&cursor=" : "", cursor);
    assert_int_equal(daemon_request(&service, "GET", path, users[user].fields, "", 0, &answer),
                     200);
    page = json_loads(answer.body, 0, NULL);
    answer_clear(&answer);
    assert_non_null(page);
    json_array_foreach(json_object_get(page, "jobs"), i, job)
    {
        assert_true(n_ends < JOBS_MAX);
        ends[n_ends].user = user;
        take_time(ends[n_ends].created, job, "created");
        take_time(ends[n_ends].finished, job, "finished");
        n_ends++;
    }
    next = json_string_value(json_object_get(page, "next"));
    (void)snprintf(cursor, CURSOR_SIZE, "%s", next ? next : "");
    json_decref(page);
    return cursor[0] != '\0';
}

static void take_ends(void)
{
    n_ends = 0;
    for (size_t user = 0; user < USERS; user++) {
        char cursor[CURSOR_SIZE] = "";

        while (take_page(user, cursor)) {
        }
    }
}

static void await_ends(size_t jobs)
{
    double end = wire_now() + 400;

    for (take_ends(); n_ends < jobs; take_ends()) {
        assert_true(wire_now() < end);
        wire_nap(1.0);
    }
}

/* ---- Tests ----------------------------------------------------------------------------------- */

static void test_users_have_equal_shares(void **state)
{
    const char *wanted = getenv("SRNFD_LOAD");
    size_t each = wanted && strcmp(wanted, "full") == 0 ? EACH_MAX : EACH_MAX / 10, counted = 0;
    struct client clients[CLIENTS];
    char from[TIME_SIZE] = "", to[TIME_SIZE] = "~";
    double share, farthest = 0;

    (void)state;
    for (size_t i = 0; i < CLIENTS; i++) {
        clients[i] = (struct client){.number = i, .user = i / (CLIENTS / USERS), .jobs = each};
    }
    run_clients(clients, 0, CLIENTS / USERS);
    run_clients(clients, CLIENTS / USERS, CLIENTS);
    await_ends(each * CLIENTS);
    /* From the moment when the last job was queued to that when the first user had none left. */
    for (size_t i = 0; i < n_ends; i++) {
        struct user *user = &users[ends[i].user];

        if (strcmp(ends[i].created, from) > 0) {
            memcpy(from, ends[i].created, TIME_SIZE);
        }
        if (strcmp(ends[i].finished, user->last) > 0) {
            memcpy(user->last, ends[i].finished, TIME_SIZE);
        }
    }
    for (size_t i = 0; i < USERS; i++) {
        if (strcmp(users[i].last, to) < 0) {
            memcpy(to, users[i].last, TIME_SIZE);
        }
    }
    for (size_t i = 0; i < n_ends; i++) {
        if (strcmp(ends[i].finished, from) >= 0 && strcmp(ends[i].finished, to) < 0) {
            users[ends[i].user].ended++;
            counted++;
        }
    }
    share = (double)counted / USERS;
    for (size_t i = 0; i < USERS; i++) {
        double away = ((double)users[i].ended - share) / share;

        farthest = compare_max(farthest, fabs(away));
    }
    print_message("%zu jobs of %d users; while all had jobs waiting %zu ended: %zu, %zu, %zu, %zu, "
                  "at most %.1f %% from equal\n",
                  n_ends, USERS, counted, users[0].ended, users[1].ended, users[2].ended,
                  users[3].ended, 100 * farthest);
    assert_true(counted >= each * CLIENTS / 4);
    assert_true(farthest <= TOLERANCE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_users_have_equal_shares),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
