/*
 * config.h - the settings of `srnfd serve`: defaults, then a JSON file, then the environment, then
 * the command line, each overriding the one before.
 */
#ifndef SRNFD_CONFIG_H
#define SRNFD_CONFIG_H

#include <stdbool.h>
#include <stddef.h>

#define CONFIG_TEXT_MAX 512

struct config {
    char listen[CONFIG_TEXT_MAX];
    char data[CONFIG_TEXT_MAX];
    double workers; /* 0: one per processor */
    double http_threads;
    double request_threads;
    double max_connections;
    double max_waiting; /* connections without a request */
    double max_streams; /* of server-sent events */
    double header_seconds, transfer_seconds, idle_seconds;
    double max_body;     /* bytes */
    double max_buffered; /* bytes */
    double max_queued;   /* jobs */
    double sync_wait_seconds;
    double grace_seconds;                /* that SIGTERM gives requests and jobs */
    char allowed_hosts[CONFIG_TEXT_MAX]; /* beside loopback names; "": none */
    char access_log[CONFIG_TEXT_MAX];    /* all or refusals */
    double least_free;                   /* bytes on the disk, for /readyz */
    bool insecure;                       /* listen beyond loopback without tokens */
};

/* One line of the table of settings, for help and for the tests. */
struct config_help {
    const char *member, *environment, *option, *text;
};
size_t config_table(const struct config_help **table);

/* Reads all sources; arguments are those after "serve". Returns 0, or -1 with a sentence in
   message. */
int config_load(struct config *config, int n_arguments, char *const *arguments, char *message,
                size_t size);

#endif
