/*
 * test_log.c - the log's lines: whole, each thread's in their order, valid JSON whatever they tell,
 * none lost while they are gathered; what is worse than info is there at once; and a pipe that
 * nobody reads stops nobody: lines are dropped then, and counted.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "log.h"
#include "support/scratch.h"

#define THREADS 4
#define LINES 3000 /* of each thread: more than both buffers hold */

static char folder[SCRATCH_MAX], path[SCRATCH_MAX + 8];
static int terminal = -1;

/* From here to look_again standard error is a file. */
static int divert(void **state)
{
    int fd;

    (void)state;
    if (!scratch_make(folder, "log")) {
        return -1;
    }
    (void)snprintf(path, sizeof path, "%s/log", folder);
    fd = open(path, O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0600);
    terminal = dup(STDERR_FILENO);
    return fd < 0 || terminal < 0 || dup2(fd, STDERR_FILENO) < 0 || close(fd) != 0 ? -1 : 0;
}

static int restore(void **state)
{
    (void)state;
    (void)dup2(terminal, STDERR_FILENO);
    (void)close(terminal);
    scratch_remove(folder);
    return 0;
}

/* The lines so far, as JSON; fails where one is not. */
static json_t *read_lines(void)
{
    json_t *lines = json_array();
    FILE *file = fopen(path, "r");
    char *line = NULL;
    size_t capacity = 0;

    assert_non_null(file);
    while (getline(&line, &capacity, file) >= 0) {
        json_t *object = json_loads(line, 0, NULL);

        if (!object) {
            (void)fclose(file);
            fail_msg("no JSON: %s", line);
        }
        (void)json_array_append_new(lines, object);
    }
    free(line);
    (void)fclose(file);
    return lines;
}

static void *tell(void *argument)
{
    const int *thread = argument;

    for (int i = 0; i < LINES; i++) {
        LOG("told", log_number("thread", *thread), log_number("number", i));
    }
    return NULL;
}

static void no_line_is_lost_or_overtaken(void **state)
{
    pthread_t threads[THREADS];
    int numbers[THREADS], next[THREADS] = {0};
    json_t *lines, *line;
    size_t i;

    (void)state;
    log_start();
    for (int t = 0; t < THREADS; t++) {
        numbers[t] = t;
        assert_int_equal(pthread_create(&threads[t], NULL, tell, &numbers[t]), 0);
    }
    for (int t = 0; t < THREADS; t++) {
        (void)pthread_join(threads[t], NULL);
    }
    log_stop();
    lines = read_lines();
    assert_int_equal(json_array_size(lines), THREADS * LINES);
    json_array_foreach(lines, i, line)
    {
        json_int_t thread = json_integer_value(json_object_get(line, "thread"));

        assert_true(thread >= 0 && thread < THREADS);
        assert_int_equal(json_integer_value(json_object_get(line, "number")), next[thread]);
        next[thread]++;
    }
    json_decref(lines);
}

static void what_is_worse_is_there_at_once(void **state)
{
    json_t *lines;

    (void)state;
    log_start();
    LOG("first", log_number("n", 1));
    LOG_WARN("second", log_number("n", 2));
    lines = read_lines();
    log_stop();
    assert_int_equal(json_array_size(lines), 2);
    assert_string_equal(json_string_value(json_object_get(json_array_get(lines, 0), "event")),
                        "first");
    assert_string_equal(json_string_value(json_object_get(json_array_get(lines, 1), "level")),
                        "warn");
    json_decref(lines);
    LOG("third", log_number("n", 3)); /* nothing is gathered any more */
    lines = read_lines();
    assert_int_equal(json_array_size(lines), 3);
    json_decref(lines);
}

static void anything_may_be_told(void **state)
{
    static char endless[9000];
    json_t *lines, *line;

    (void)state;
    memset(endless, '"', sizeof endless - 1);
    LOG("odd", log_text("text", "a\"b\\c\n\x01\x7f\xff z"), log_number("nan", NAN),
        log_number("third", 1.0 / 3), log_text("none", NULL));
    LOG("long", log_text("endless", endless), log_text("after", "kept"));
    lines = read_lines();
    assert_int_equal(json_array_size(lines), 2);
    line = json_array_get(lines, 0);
    assert_string_equal(json_string_value(json_object_get(line, "text")),
                        "a\"b\\c\n\x01\x7f\xc3\xbf z");
    assert_true(json_is_null(json_object_get(line, "nan")));
    assert_true(fabs(json_real_value(json_object_get(line, "third")) - 1.0 / 3) < 1e-15);
    assert_string_equal(json_string_value(json_object_get(line, "none")), "");
    assert_int_equal(strlen(json_string_value(json_object_get(line, "ts"))), 24);
    line = json_array_get(lines, 1);
    assert_null(json_object_get(line, "endless"));
    assert_string_equal(json_string_value(json_object_get(line, "after")), "kept");
    json_decref(lines);
}

/* Standard error is a pipe of which `reading` gets the other end. */
static void divert_to_pipe(int *reading)
{
    int ends[2];

    assert_int_equal(pipe(ends), 0);
    assert_true(dup2(ends[1], STDERR_FILENO) >= 0);
    (void)close(ends[1]);
    *reading = ends[0];
}

/* Every line that comes until the pipe is closed: how many were told, and how many are told to have
   been dropped. */
static void *count_lines(void *argument)
{
    size_t *counts = argument, capacity = 0;
    FILE *file = fdopen((int)counts[0], "r");
    char *line = NULL;

    counts[1] = counts[2] = counts[3] = 0;
    while (file && getline(&line, &capacity, file) >= 0) {
        json_t *object = json_loads(line, 0, NULL);
        const char *event = json_string_value(json_object_get(object, "event"));

        if (event && strcmp(event, "log-lines-dropped") == 0) {
            counts[2] += (size_t)json_integer_value(json_object_get(object, "count"));
        } else {
            counts[event ? 1 : 3]++;
        }
        json_decref(object);
    }
    free(line);
    (void)fclose(file);
    return NULL;
}

static void nobody_waits_for_a_reader(void **state)
{
    size_t counts[4], before = log_dropped();
    struct timespec from, to;
    pthread_t reader;
    int reading;

    (void)state;
    divert_to_pipe(&reading);
    counts[0] = (size_t)reading;
    (void)clock_gettime(CLOCK_MONOTONIC, &from);
    log_start();
    for (int i = 0; i < 20000; i++) {
        LOG("told", log_number("number", i));
        if (i % 100 == 0) {
            LOG_WARN("warned", log_number("number", i));
        }
    }
    (void)clock_gettime(CLOCK_MONOTONIC, &to);
    assert_true(to.tv_sec - from.tv_sec < 5);
    assert_true(log_dropped() - before > 15000);
    assert_int_equal(pthread_create(&reader, NULL, count_lines, counts), 0);
    usleep(300000);
    LOG_WARN("last", log_number("number", -1));
    log_stop();
    (void)dup2(terminal, STDERR_FILENO); /* closes the pipe */
    (void)pthread_join(reader, NULL);
    assert_int_equal(counts[3], 0);
    assert_int_equal(counts[2], log_dropped() - before);
    assert_int_equal(counts[1] + counts[2], 20201);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(no_line_is_lost_or_overtaken, divert, restore),
        cmocka_unit_test_setup_teardown(what_is_worse_is_there_at_once, divert, restore),
        cmocka_unit_test_setup_teardown(anything_may_be_told, divert, restore),
        cmocka_unit_test_setup_teardown(nobody_waits_for_a_reader, divert, restore),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
