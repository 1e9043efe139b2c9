/*
 * config.h - the settings of `srnfd serve`: defaults, then what a service manager hands over
 * (CREDENTIALS_DIRECTORY: tls-certificate, tls-key), then a JSON file, then the environment, then
 * the command line, each overriding the one before.
 */
#ifndef SRNFD_CONFIG_H
#define SRNFD_CONFIG_H

#include <stdbool.h>
#include <stddef.h>

#define CONFIG_TEXT_MAX 512
#define CONFIG_LIST_MAX 4096 /* lists of addresses and networks */

struct config {
    char listen[CONFIG_TEXT_MAX];
    char data[CONFIG_TEXT_MAX];
    double workers;                 /* 0: one per processor */
    char executor[CONFIG_TEXT_MAX]; /* local, workers or slurm */
    double lease_seconds;           /* that a worker may give no sign */
    double task_seconds;            /* that a worker may give no result */
    double verify_tasks;            /* share of results that are computed again */
    /* Of the executor slurm; "" and 0 leave the choice to the cluster. */
    char slurm_partition[CONFIG_TEXT_MAX], slurm_account[CONFIG_TEXT_MAX];
    char slurm_qos[CONFIG_TEXT_MAX], slurm_time[CONFIG_TEXT_MAX];
    char slurm_arguments[CONFIG_TEXT_MAX];                             /* more of them for sbatch */
    char slurm_server[CONFIG_TEXT_MAX];                                /* URL of the service; "": by
                                                                        where it listens */
    char slurm_program[CONFIG_TEXT_MAX], slurm_cache[CONFIG_TEXT_MAX]; /* paths on the nodes */
    double slurm_cpus, slurm_memory; /* of a pilot; memory in MiB */
    double slurm_workers;            /* pilots at once */
    double slurm_seconds;            /* that a program of Slurm may take */
    double slurm_poll_seconds;       /* between two looks at the queue */
    double http_threads;             /* 0: by the number of processors */
    double request_threads;
    double upload_threads; /* that parse bodies */
    double upload_memory;  /* bytes for that; 0: a share of the machine's */
    double max_connections;
    double kept_connections;   /* of them, for known callers; 0: an eighth */
    double max_waiting;        /* connections without a request */
    double max_owner_requests; /* in progress; 0: a quarter of the connections */
    double max_streams;        /* of server-sent events */
    double header_seconds, transfer_seconds, idle_seconds;
    double max_body;                              /* bytes */
    double max_buffered;                          /* bytes */
    double max_owner_buffered, max_peer_buffered; /* of them; 0: a quarter, half */
    double max_owner_exports;                     /* bytes on the disk, of those being sent */
    double least_rate;                            /* of a transfer, bytes a second */
    double max_queued;                            /* jobs */
    double sync_wait_seconds;
    double job_seconds;                  /* that a job may run; 0: any */
    double job_memory;                   /* bytes of a job; 0: its share of the machine */
    double job_cache;                    /* bytes before its scratch; 0: a part of that */
    double kept_encodings;               /* bytes for later jobs; 0: none */
    double kept_meshes;                  /* the same of prepared meshes */
    double retention_days;               /* that ended jobs are kept; 0: for ever */
    double sweep_seconds;                /* between two looks for what may go */
    double grace_seconds;                /* that SIGTERM gives requests and jobs */
    char allowed_hosts[CONFIG_TEXT_MAX]; /* beside loopback names; "": none */
    char access_log[CONFIG_TEXT_MAX];    /* all, requests or refusals */
    double least_free;                   /* bytes on the disk, for /readyz */
    bool insecure;                       /* answer callers from elsewhere without tokens */
    char cors_origins[CONFIG_TEXT_MAX];  /* of pages that may call; "": none */
    char tls_certificate[CONFIG_TEXT_MAX], tls_key[CONFIG_TEXT_MAX]; /* PEM files; "": no TLS */
    /* Where links in inputs may lead beside the service: addresses under which content lies, and
       networks that are not public; "": none. What all links of a request may take. */
    char link_prefixes[CONFIG_LIST_MAX], link_networks[CONFIG_LIST_MAX];
    double link_seconds;
    /* Quotas of tokens that have none of their own; 0: no limit. */
    double quota_queued, quota_running; /* jobs of an owner */
    double quota_bytes;                 /* of an owner */
    double quota_requests;              /* a second, of a token */
    double quota_streams;               /* answers of a token that wait for jobs */
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
