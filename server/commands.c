/*
 * commands.c - srnfd backup and srnfd check. Each finding is a line on stdout, and so is the sum;
 * what keeps a command from its work is a line on stderr.
 *
 * Exit status: 0 all is well, 1 the data are damaged, 2 it could not be done.
 *
 * The data directory is found as serve finds it: --data, SRNFD_DATA, the file of --config.
 */
#include "commands.h"

#include "config.h"
#include "store/maintenance.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STATUS_DAMAGED 1
#define STATUS_FAILED 2

static void print_finding(void *user, const char *kind, const char *detail)
{
    (void)user;
    (void)printf("%s: %s\n", kind, detail);
}

static const struct store_listener listener = {.found = print_finding};

/* Takes the flag out of the arguments; true if it was there. */
static bool take_flag(int *n_arguments, char **arguments, const char *flag)
{
    for (int i = 0; i < *n_arguments; i++) {
        if (strcmp(arguments[i], flag) == 0) {
            memmove(&arguments[i], &arguments[i + 1],
                    (size_t)(*n_arguments - i - 1) * sizeof *arguments);
            (*n_arguments)--;
            return true;
        }
    }
    return false;
}

static int fail(const char *command, const char *message)
{
    (void)fprintf(stderr, "srnfd %s: %s\n", command, message);
    return STATUS_FAILED;
}

/* The exit status that a status of the store means. */
static int conclude(const char *command, int status, const char *message)
{
    if (status == 0) {
        return 0;
    }
    if (status == STORE_CORRUPT && !message[0]) {
        return STATUS_DAMAGED;
    }
    (void)fail(command, message[0] ? message : store_strerror(status));
    return status == STORE_CORRUPT ? STATUS_DAMAGED : STATUS_FAILED;
}

int command_backup(int n_arguments, char **arguments)
{
    bool link = take_flag(&n_arguments, arguments, "--link");
    struct store_report report;
    struct config config;
    char message[600] = "";
    int status;

    if (n_arguments < 1 || arguments[0][0] == '-') {
        return fail("backup", "usage: srnfd backup DIRECTORY [--link] [--data DIRECTORY]");
    }
    if (config_load(&config, n_arguments - 1, arguments + 1, message, sizeof message) != 0) {
        return fail("backup", message);
    }
    status =
        store_backup(config.data, arguments[0], link, &listener, &report, message, sizeof message);
    if (status == STORE_CORRUPT && report.damaged > 0) {
        (void)snprintf(message, sizeof message,
                       "%zu blobs are damaged; the copy is complete but for them", report.damaged);
    }
    if (status == 0) {
        (void)printf("copied: version %lld, %zu files of %zu bytes beside the database\n",
                     (long long)report.version, report.blobs, report.bytes);
    }
    return conclude("backup", status, status == 0 ? "" : message);
}

int command_check(int n_arguments, char **arguments)
{
    bool repair = take_flag(&n_arguments, arguments, "--repair");
    struct store_report report;
    struct config config;
    char message[600] = "";
    int status;

    if (config_load(&config, n_arguments, arguments, message, sizeof message) != 0) {
        return fail("check", message);
    }
    status = store_verify(config.data, repair, &listener, &report, message, sizeof message);
    if (status == 0 || (status == STORE_CORRUPT && !message[0])) {
        (void)printf("version: %lld\ndatabase errors: %zu\nblobs: %zu of %zu bytes\n"
                     "damaged: %zu\nmissing: %zu\norphans: %zu, removed: %zu\n%s",
                     (long long)report.version, report.database_errors, report.blobs, report.bytes,
                     report.damaged, report.missing, report.orphans, report.removed,
                     report.in_use ? "a daemon is running: what it just writes was left out\n"
                                   : "");
    }
    return conclude("check", status, message);
}
