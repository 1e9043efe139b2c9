/*
 * The executor "slurm" without Slurm: programs that are run, hang, print much or nothing; what
 * squeue prints; what sbatch gets; how many pilots jobs get.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clock.h"
#include "slurm/internal.h"

/* ---- Programs -------------------------------------------------------------------------------- */

static struct slurm_answer run(const char *script, const char *input, double seconds,
                               const atomic_bool *hurry)
{
    const char *const arguments[] = {"sh", "-c", script, NULL};
    struct slurm_answer answer;

    slurm_run(
        &(struct slurm_command){
            .arguments = arguments, .input = input, .seconds = seconds, .hurry = hurry},
        &answer);
    return answer;
}

static void a_program_answers(void **state)
{
    struct slurm_answer answer = run("cat; echo why >&2; echo not >&2; exit 3", "in\n", 20, NULL);

    (void)state;
    assert_int_equal(answer.status, 3);
    assert_true(answer.ended);
    assert_string_equal(answer.text, "in\n");
    assert_int_equal(answer.size, 3);
    assert_string_equal(answer.why, "not");
    slurm_answer_clear(&answer);
    answer = run("cat", NULL, 20, NULL);
    assert_int_equal(answer.status, 0);
    assert_string_equal(answer.text, "");
    slurm_answer_clear(&answer);
    answer = run("kill -9 $$", NULL, 20, NULL);
    assert_int_equal(answer.status, -1);
    assert_true(answer.ended);
    slurm_answer_clear(&answer);
    answer = run("printf 'a\\001\\377 b\\n \\n' >&2; exit 1", NULL, 20, NULL);
    assert_string_equal(answer.why, "a?? b");
    slurm_answer_clear(&answer);
}

static void a_program_that_is_not_there_is_told(void **state)
{
    const char *const arguments[] = {"no-such-program-of-slurm", NULL};
    struct slurm_answer answer;

    (void)state;
    slurm_run(&(struct slurm_command){.arguments = arguments, .seconds = 20}, &answer);
    assert_int_equal(answer.status, -1);
    assert_true(answer.ended);
    assert_non_null(strstr(answer.why, "no-such-program-of-slurm cannot be run"));
    slurm_answer_clear(&answer);
    assert_false(slurm_has("no-such-program-of-slurm"));
    assert_true(slurm_has("sh"));
}

/* A child of the program holds its output open, and is killed with it. */
static void a_program_that_hangs_is_killed_with_its_children(void **state)
{
    double before = clock_now();
    struct slurm_answer answer = run("sleep 600 & echo $!; wait", NULL, 0.3, NULL);
    int ms = 0;
    pid_t child;

    (void)state;
    assert_int_equal(answer.status, -1);
    assert_false(answer.ended);
    assert_true(clock_now() - before < 20.0);
    assert_string_equal(answer.why, "sh gave no answer in time");
    child = (pid_t)strtol(answer.text, NULL, 10);
    assert_true(child > 1);
    /* Dead, or not yet reaped by whoever has it now. */
    for (; ms < 5000 && kill(child, 0) == 0; ms += 10) {
        char path[64], line[256] = "";
        FILE *file;

        (void)snprintf(path, sizeof path, "/proc/%ld/stat", (long)child);
        file = fopen(path, "re");
        if (!file || !fgets(line, sizeof line, file) || strstr(line, ") Z")) {
            ms = -1;
        }
        if (file) {
            (void)fclose(file);
        }
        if (ms < 0) {
            break;
        }
        usleep(10000);
    }
    assert_true(ms < 5000);
    slurm_answer_clear(&answer);
}

static void who_closes_is_in_a_hurry(void **state)
{
    const atomic_bool hurry = true;
    double before = clock_now();
    struct slurm_answer answer = run("sleep 600", NULL, 500, &hurry);

    (void)state;
    assert_false(answer.ended);
    assert_true(clock_now() - before < 30.0);
    slurm_answer_clear(&answer);
}

/* What a program leaves behind may hold its output: its end is its end. */
static void a_program_may_leave_children(void **state)
{
    double before = clock_now();
    struct slurm_answer answer = run("sleep 4 & echo 7", NULL, 20, NULL);

    (void)state;
    assert_int_equal(answer.status, 0);
    assert_string_equal(answer.text, "7\n");
    assert_true(clock_now() - before < 3.5);
    slurm_answer_clear(&answer);
}

static void output_is_bounded(void **state)
{
    struct slurm_answer answer = run("head -c 4194305 /dev/zero", NULL, 60, NULL);

    (void)state;
    assert_int_equal(answer.status, 0);
    assert_null(answer.text);
    slurm_answer_clear(&answer);
    answer = run("head -c 4194304 /dev/zero | tr '\\0' x; head -c 100000 /dev/zero >&2; exit 1",
                 NULL, 60, NULL);
    assert_int_equal(answer.size, 4194304);
    slurm_answer_clear(&answer);
}

static void the_environment_stays_here(void **state)
{
    struct slurm_answer answer;

    (void)state;
    assert_int_equal(setenv("SRNFD_SECRET", "1", 1), 0);
    assert_int_equal(setenv("SLURM_CONF", "/nowhere/slurm.conf", 1), 0);
    answer = run("env; ls /proc/self/fd | wc -l", NULL, 20, NULL);
    assert_non_null(strstr(answer.text, "SLURM_CONF=/nowhere/slurm.conf"));
    assert_non_null(strstr(answer.text, "LC_ALL=C"));
    assert_null(strstr(answer.text, "SRNFD_SECRET"));
    assert_non_null(strstr(answer.text, "\n4\n")); /* and that of the folder itself */
    slurm_answer_clear(&answer);
}

/* ---- The queue ------------------------------------------------------------------------------- */

static void the_queue_is_read(void **state)
{
    struct slurm_element *e;
    size_t n;

    (void)state;
    assert_true(slurm_queue_read("a-1|12_3|PENDING|Priority\n"
                                 "a-1|12_4|RUNNING|None\n"
                                 "b|7|COMPLETING|\n"
                                 "b|7_1|OUT_OF_MEMORY|OutOfMemory\n"
                                 "b|7_2|NEW_STATE|a|b (c, d)\n",
                                 &e, &n));
    assert_int_equal(n, 5);
    assert_string_equal(e[0].name, "a-1");
    assert_string_equal(e[0].id, "12_3");
    assert_int_equal(e[0].state, SLURM_PENDING);
    assert_string_equal(e[0].reason, "Priority");
    assert_int_equal(e[1].state, SLURM_RUNNING);
    assert_int_equal(e[2].state, SLURM_LEAVING);
    assert_int_equal(e[3].state, SLURM_ENDED);
    assert_string_equal(e[3].word, "OUT_OF_MEMORY");
    assert_int_equal(e[4].state, SLURM_RUNNING);
    assert_string_equal(e[4].reason, "a|b (c, d)");
    free(e);
    assert_true(slurm_queue_read("", &e, &n));
    assert_int_equal(n, 0);
    free(e);
}

static void what_is_no_queue_is_none(void **state)
{
    static const char *const texts[] = {
        "garbage\n",
        "a|1_2|PENDING|Priority",
        "a|1_2|PENDING\n",
        "|1_2|PENDING|x\n",
        "a||PENDING|x\n",
        "a|x|PENDING|x\n",
        "a|1_|PENDING|x\n",
        "a|1_[1-4]|PENDING|x\n",
        "a|-1|PENDING|x\n",
        "a|1_2 --all|PENDING|x\n",
        "a|11111111111111111111111111111111111111111111|PENDING|x\n",
        "a|1_2|pending|x\n",
        "a|1_2||x\n",
        "a|1_2|PENDING|x\nslurm_load_jobs error\n",
        "\n",
    };

    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct slurm_element *e = NULL;
        size_t n = 1;

        assert_false(slurm_queue_read(texts[i], &e, &n));
        assert_null(e);
        assert_int_equal(n, 0);
    }
}

static void long_fields_are_cut(void **state)
{
    char text[2000];
    struct slurm_element *e;
    size_t n;

    (void)state;
    (void)snprintf(text, sizeof text, "a|1|RUNNING|%0900d\n", 0);
    assert_true(slurm_queue_read(text, &e, &n));
    assert_int_equal(strlen(e[0].reason), SLURM_REASON_MAX - 1);
    free(e);
}

/* ---- What sbatch gets ------------------------------------------------------------------------ */

static const char *const variables[] = {"A", "it's", NULL};

static struct slurm_config settings(void)
{
    return (struct slurm_config){.partition = "p q",
                                 .account = "",
                                 .qos = "",
                                 .time = "1:00",
                                 .arguments = " --exclusive  --gres=x:1 ",
                                 .server = "https://h'st:1",
                                 .program = "/a b/srnfd",
                                 .variables = variables,
                                 .cache = "",
                                 .certificate = "",
                                 .cpus = 3};
}

static void sbatch_gets_arguments_without_secrets(void **state)
{
    static const char *const wanted[] = {
        "sbatch",      "--parsable",         "--array=1-4",   "--job-name=n",
        "--ntasks=1",  "--cpus-per-task=3",  "--mem=512M",    "--partition=p q",
        "--time=1:00", "--requeue",          "--export=NONE", "--propagate=NONE",
        "--chdir=/",   "--output=/dev/null", "--exclusive",   "--gres=x:1",
    };
    struct slurm_config config = settings();
    struct store_pilots row = {.name = "n", .size = 4, .memory = 512, .token = "digest"};
    struct slurm_arguments *arguments = calloc(1, sizeof *arguments);

    (void)state;
    assert_non_null(arguments);
    slurm_submit_arguments(&config, &row, arguments);
    assert_int_equal(arguments->n, sizeof wanted / sizeof wanted[0]);
    for (size_t i = 0; i < arguments->n; i++) {
        assert_string_equal(arguments->list[i], wanted[i]);
    }
    assert_null(arguments->list[arguments->n]);
    free(arguments);
}

static void memory_is_read_in_mib(void **state)
{
    static const struct {
        const char *text;
        int64_t mib;
    } cases[] = {
        {"cpu=2,mem=600M,node=1,billing=2  \ncpu=2,mem=600M,node=1\n", 600},
        {"mem=1.50G,cpu=1\n", 1536},
        {"cpu=1,mem=2T", 1048576},
        {"cpu=1,mem=512K", 1},
        {"cpu=1,mem=9P", 1048576},
        {"cpu=1,node=1,billing=1\n", 0},
        {"gres/gmem=4G\n", 0},
        {"cpu=1,mem=\n", 0},
        {"cpu=1,mem=-4G", 0},
        {"cpu=1,mem=inf", 0},
        {"cpu=1,mem=4", 0},
        {"", 0},
    };

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_int_equal(slurm_memory_read(cases[i].text), cases[i].mib);
    }
}

static void the_script_is_one_command(void **state)
{
    struct slurm_config config = settings();
    char message[200] = "";
    char *text = slurm_script(&config, "token", message, sizeof message);

    (void)state;
    assert_string_equal(text, "#!/bin/sh\n"
                              "export A='it'\\''s'\n"
                              "exec '/a b/srnfd' worker --server 'https://h'\\''st:1' --slots 3 "
                              "--idle-seconds 30 --grace-seconds 10 --token-file - "
                              "<<'SRNFD-CREDENTIALS'\n"
                              "token\n"
                              "SRNFD-CREDENTIALS\n");
    free(text);
    config.certificate = "/nowhere/certificate.pem";
    assert_null(slurm_script(&config, "token", message, sizeof message));
    assert_non_null(strstr(message, "/nowhere/certificate.pem has no certificate"));
}

/* Of a chain the first certificate is trusted, and a key in the same file goes nowhere. */
static void one_certificate_goes_along(void **state)
{
    static const char first[] = "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n";
    char path[] = "/tmp/srnfd-certificate-XXXXXX", message[200], *text;
    struct slurm_config config = settings();
    int fd = mkstemp(path);

    (void)state;
    assert_true(fd >= 0);
    dprintf(fd, "-----BEGIN PRIVATE KEY-----\nsecret\n-----END PRIVATE KEY-----\n%s%s", first,
            "-----BEGIN CERTIFICATE-----\nBBBB\n-----END CERTIFICATE-----\n");
    close(fd);
    config.certificate = path;
    text = slurm_script(&config, "token", message, sizeof message);
    unlink(path);
    assert_non_null(strstr(text, first));
    assert_non_null(strstr(text, "--certificate - "));
    assert_null(strstr(text, "secret"));
    assert_null(strstr(text, "BBBB"));
    free(text);
}

static void arguments_that_would_break_it_are_refused(void **state)
{
    static const char *const bad[] = {"-p x",
                                      "x",
                                      "--",
                                      "--array=2",
                                      "--exclusive --wrap=id",
                                      "--job-name=x",
                                      "--export=ALL",
                                      "--wait",
                                      "--parsable",
                                      "--arr=2",
                                      "--jo=x",
                                      "--exp=ALL",
                                      "--pars"};

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_non_null(slurm_arguments_problem(bad[i]));
    }
    assert_null(slurm_arguments_problem(""));
    assert_null(slurm_arguments_problem(" --exclusive --gres=x:1 --wait-all-nodes=1 "));
}

/* ---- How many -------------------------------------------------------------------------------- */

static void pilots_have_work_for_some_seconds(void **state)
{
    (void)state;
    assert_int_equal(slurm_pilots_wanted(0, 1.0, 1), 0);
    assert_int_equal(slurm_pilots_wanted(1, 0.001, 8), 1);
    assert_int_equal(slurm_pilots_wanted(1, 1e9, 8), 1);
    assert_int_equal(slurm_pilots_wanted(6, 0.0, 1), 2);
    assert_int_equal(slurm_pilots_wanted(1000, 1.0, 1), 250);
    assert_int_equal(slurm_pilots_wanted(1000, 1.0, 4), 63);
    assert_int_equal(slurm_pilots_wanted(10, 60.0, 1), 10);
    assert_int_equal(slurm_pilots_wanted(10, 60.0, 4), 3);
}

static void pilots_are_shared(void **state)
{
    size_t wishes[4] = {1, 100, 3, 0};

    (void)state;
    slurm_share(10, 4, wishes);
    assert_int_equal(wishes[0], 1);
    assert_int_equal(wishes[1], 6);
    assert_int_equal(wishes[2], 3);
    assert_int_equal(wishes[3], 0);
    slurm_share(100, 4, wishes);
    assert_int_equal(wishes[1], 6);
    slurm_share(2, 4, wishes);
    assert_int_equal(wishes[0] + wishes[1] + wishes[2], 2);
    slurm_share(5, 0, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_program_answers),
        cmocka_unit_test(a_program_that_is_not_there_is_told),
        cmocka_unit_test(a_program_that_hangs_is_killed_with_its_children),
        cmocka_unit_test(who_closes_is_in_a_hurry),
        cmocka_unit_test(a_program_may_leave_children),
        cmocka_unit_test(output_is_bounded),
        cmocka_unit_test(the_environment_stays_here),
        cmocka_unit_test(the_queue_is_read),
        cmocka_unit_test(what_is_no_queue_is_none),
        cmocka_unit_test(long_fields_are_cut),
        cmocka_unit_test(sbatch_gets_arguments_without_secrets),
        cmocka_unit_test(memory_is_read_in_mib),
        cmocka_unit_test(the_script_is_one_command),
        cmocka_unit_test(one_certificate_goes_along),
        cmocka_unit_test(arguments_that_would_break_it_are_refused),
        cmocka_unit_test(pilots_have_work_for_some_seconds),
        cmocka_unit_test(pilots_are_shared),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
