/*
 * script.c - what sbatch gets: its arguments, and on its standard input the script of the pilots.
 *
 * Arguments, names and comments of jobs can be read by everybody on a cluster; the script cannot.
 * So the token stands in the script alone, as the standard input of the worker (exec <<), and never
 * in an argument, the environment or a file of its own. The certificate that pilots trust goes the
 * same way.
 */
#include "slurm/internal.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CERTIFICATE_MAX 12000
#define IDLE_SECONDS 30  /* without a task, after which a pilot leaves */
#define GRACE_SECONDS 10 /* that it has to end its tasks when it is cancelled */
#define BEGIN "-----BEGIN CERTIFICATE-----"
#define END "-----END CERTIFICATE-----"

/* ---- The script ------------------------------------------------------------------------------ */

/* As one word of a shell. */
static void put_quoted(FILE *out, const char *text)
{
    (void)fputc('\'', out);
    for (; *text; text++) {
        (void)fputs(*text == '\'' ? "'\\''" : (const char[]){*text, '\0'}, out);
    }
    (void)fputc('\'', out);
}

/* The first certificate of the file, with a newline after it. False with a sentence. */
static bool read_certificate(const char *path, char text[CERTIFICATE_MAX], char *message,
                             size_t size)
{
    FILE *file = fopen(path, "re");
    char *bytes = calloc(1, 4 * CERTIFICATE_MAX), *begin, *end;
    bool good;

    if (file && bytes) {
        (void)!fread(bytes, 1, 4 * CERTIFICATE_MAX - 1, file);
    }
    if (file) {
        (void)fclose(file);
    }
    begin = bytes ? strstr(bytes, BEGIN) : NULL;
    end = begin ? strstr(begin, END) : NULL;
    good = end && (size_t)(end - begin) + sizeof END + 1 < CERTIFICATE_MAX;
    if (good) {
        (void)snprintf(text, CERTIFICATE_MAX, "%.*s\n", (int)(end - begin + (long)sizeof END - 1),
                       begin);
    } else {
        (void)snprintf(message, size, "%.120s has no certificate that pilots could trust", path);
    }
    free(bytes);
    return good;
}

static void put_script(FILE *out, const struct slurm_config *config, const char *token,
                       const char *certificate)
{
    (void)fputs("#!/bin/sh\n", out);
    for (const char *const *variable = config->variables; *variable; variable += 2) {
        (void)fprintf(out, "export %s=", variable[0]);
        put_quoted(out, variable[1]);
        (void)fputc('\n', out);
    }
    (void)fputs("exec ", out);
    put_quoted(out, config->program);
    (void)fputs(" worker --server ", out);
    put_quoted(out, config->server);
    (void)fprintf(out, " --slots %zu --idle-seconds %d --grace-seconds %d", config->cpus,
                  IDLE_SECONDS, GRACE_SECONDS);
    if (config->cache[0]) {
        (void)fputs(" --cache ", out);
        put_quoted(out, config->cache);
    }
    (void)fprintf(out, " --token-file -%s <<'SRNFD-CREDENTIALS'\n%s\n%sSRNFD-CREDENTIALS\n",
                  certificate[0] ? " --certificate -" : "", token, certificate);
}

char *slurm_script(const struct slurm_config *config, const char *token, char *message, size_t size)
{
    char certificate[CERTIFICATE_MAX] = "", *text = NULL;
    size_t length = 0;
    FILE *out;

    if (config->certificate[0] &&
        !read_certificate(config->certificate, certificate, message, size)) {
        return NULL;
    }
    out = open_memstream(&text, &length);
    if (out) {
        put_script(out, config, token, certificate);
    }
    if (!out || fclose(out) != 0) {
        free(text);
        text = NULL;
        (void)snprintf(message, size, "not enough memory");
    }
    return text;
}

/* ---- Arguments ------------------------------------------------------------------------------- */

static void add(struct slurm_arguments *arguments, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* What does not fit is left out; the settings are bounded so that all fits. */
static void add(struct slurm_arguments *arguments, const char *format, ...)
{
    size_t left = sizeof arguments->text - arguments->used;
    char *text = arguments->text + arguments->used;
    va_list values;
    int length;

    va_start(values, format);
    length = vsnprintf(text, left, format, values);
    va_end(values);
    if (length >= 0 && (size_t)length < left && arguments->n < SLURM_ARGUMENTS_MAX - 1) {
        arguments->list[arguments->n++] = text;
        arguments->list[arguments->n] = NULL;
        arguments->used += (size_t)length + 1;
    }
}

void slurm_submit_arguments(const struct slurm_config *config, const struct store_pilots *row,
                            struct slurm_arguments *arguments)
{
    const struct {
        const char *option, *value;
    } choices[] = {{"--partition", config->partition},
                   {"--account", config->account},
                   {"--qos", config->qos},
                   {"--time", config->time}};

    arguments->n = arguments->used = 0;
    add(arguments, "sbatch");
    add(arguments, "--parsable");
    add(arguments, "--array=1-%lld", (long long)row->size);
    add(arguments, "--job-name=%s", row->name);
    add(arguments, "--ntasks=1");
    add(arguments, "--cpus-per-task=%zu", config->cpus);
    if (row->memory > 0) {
        add(arguments, "--mem=%lldM", (long long)row->memory);
    }
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; i++) {
        if (choices[i].value[0]) {
            add(arguments, "%s=%s", choices[i].option, choices[i].value);
        }
    }
    add(arguments, "--requeue");
    add(arguments, "--export=NONE");
    add(arguments, "--propagate=NONE");
    add(arguments, "--chdir=/");
    add(arguments, "--output=/dev/null");
    for (const char *at = config->arguments; *at;) {
        size_t length = strcspn(at, " \t");

        if (length > 0) {
            add(arguments, "%.*s", (int)length, at);
        }
        at += length + strspn(at + length, " \t");
    }
}

const char *slurm_arguments_problem(const char *text)
{
    static const char *const own[] = {"--array",  "--job-name", "--wrap",     "--parsable",
                                      "--export", "--wait",     "--test-only"};

    for (const char *at = text + strspn(text, " \t"); *at; at += strspn(at, " \t")) {
        size_t length = strcspn(at, " \t"), name = strcspn(at, " \t=");

        if (length < 4 || strncmp(at, "--", 2) != 0) {
            return "each of them must be as in --option or --option=value";
        }
        for (size_t i = 0; i < sizeof own / sizeof own[0]; i++) {
            if (strncmp(at, own[i], name) == 0) { /* sbatch takes the beginning of a name for it */
                return "--array, --job-name, --wrap, --parsable, --export, --wait and --test-only "
                       "are the service's";
            }
        }
        at += length;
    }
    return NULL;
}
