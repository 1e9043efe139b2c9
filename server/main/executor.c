/*
 * executor.c - from settings to the executor "slurm": where nodes reach the service, which program
 * they run, and what the arrays of this installation are called.
 */
#include "main/executor.h"

#include "http/http.h"
#include "log.h"
#include "store/digest.h"

#include <cblas.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool executor_is_slurm(const struct config *config)
{
    return strcmp(config->executor, "slurm") == 0;
}

bool executor_offers_tasks(const struct config *config)
{
    return strcmp(config->executor, "local") != 0;
}

static struct slurm_config settings_of(const struct config *config)
{
    return (struct slurm_config){.partition = config->slurm_partition,
                                 .account = config->slurm_account,
                                 .qos = config->slurm_qos,
                                 .time = config->slurm_time,
                                 .arguments = config->slurm_arguments,
                                 .cache = config->slurm_cache,
                                 .certificate = config->tls_certificate,
                                 .cpus = (size_t)config->slurm_cpus,
                                 .memory = (size_t)config->slurm_memory,
                                 .workers = (size_t)config->slurm_workers,
                                 .seconds = config->slurm_seconds,
                                 .poll_seconds = config->slurm_poll_seconds,
                                 .lease_seconds = config->lease_seconds};
}

bool executor_check(const struct config *config, char *message, size_t size)
{
    struct slurm_config settings = settings_of(config);

    if (!executor_is_slurm(config)) {
        return true;
    }
    if (!http_is_loopback(config->listen) && !config->tls_certificate[0]) {
        (void)snprintf(message, size,
                       "--executor slurm serves workers of other machines over TLS alone: set "
                       "--tls-certificate and --tls-key");
        return false;
    }
    return slurm_check(&settings, message, size);
}

/* Where the nodes reach what listens there, unless the settings say. An address that stands for all
   of the machine's becomes its name. */
static void make_server(const struct config *config, const char *address, char *server, size_t size)
{
    const char *scheme = config->tls_certificate[0] ? "https" : "http";
    const char *port = strrchr(address, ':');
    char host[256] = "localhost";

    if (config->slurm_server[0]) {
        (void)snprintf(server, size, "%s", config->slurm_server);
    } else if (port &&
               (strncmp(address, "0.0.0.0:", 8) == 0 || strncmp(address, "[::]:", 5) == 0)) {
        (void)gethostname(host, sizeof host - 1);
        (void)snprintf(server, size, "%s://%s%s", scheme, host, port);
    } else {
        (void)snprintf(server, size, "%s://%s", scheme, address);
    }
}

/* Eight digits of the machine and the data directory: a copy of the data elsewhere is another. */
static void make_installation(const char *data, char installation[16])
{
    char host[256] = "", text[4400], digest[65], *path = realpath(data, NULL);

    (void)gethostname(host, sizeof host - 1);
    (void)snprintf(text, sizeof text, "%s %s", host, path ? path : data);
    store_sha256_hex(digest, text, strlen(text));
    (void)snprintf(installation, 16, "%.8s", digest);
    free(path);
}

/* That of this process, where the settings name no other. */
static void make_program(const struct config *config, char program[CONFIG_TEXT_MAX])
{
    ssize_t n = -1;

    (void)snprintf(program, CONFIG_TEXT_MAX, "%s", config->slurm_program);
    if (!program[0]) {
        n = readlink("/proc/self/exe", program, CONFIG_TEXT_MAX - 1);
        program[n > 0 ? n : 0] = '\0';
    }
}

/* What decides how OpenBLAS computes goes along, so that nodes whose processors are newer compute
   the same bits. One that is older is refused by its build (build.h). */
static void make_variables(const char *variables[5])
{
    const char *size = getenv("OPENBLAS_L2_SIZE");
    size_t n = 0;

    variables[n++] = "OPENBLAS_CORETYPE";
    variables[n++] = openblas_get_corename();
    if (size && size[0]) {
        variables[n++] = "OPENBLAS_L2_SIZE";
        variables[n++] = size;
    }
    variables[n] = NULL;
}

int executor_start(struct executor *executor, const struct config *config, const char *address,
                   struct slurm **slurm, char *message, size_t size)
{
    struct slurm_config settings = settings_of(config);

    *slurm = NULL;
    if (!executor_is_slurm(config)) {
        return 0;
    }
    settings.store = executor->slurm.store;
    settings.jobs = executor->slurm.jobs;
    settings.metrics = executor->slurm.metrics;
    make_server(config, address, executor->server, sizeof executor->server);
    make_installation(config->data, executor->installation);
    make_program(config, executor->program);
    settings.server = executor->server;
    settings.installation = executor->installation;
    settings.program = executor->program;
    make_variables(executor->variables);
    settings.variables = executor->variables;
    executor->slurm = settings;
    if (http_is_loopback(address) && !config->slurm_server[0]) {
        LOG_WARN("pilots-local",
                 log_text("message", "the service listens on loopback: only pilots on this machine "
                                     "reach it, unless --slurm-server names another way"));
    }
    if (slurm_open(slurm, &settings) != 0) {
        (void)snprintf(message, size, "the thread for Slurm could not be started");
        return -1;
    }
    LOG("slurm", log_text("server", executor->server),
        log_text("installation", executor->installation), log_text("program", executor->program),
        log_number("workers", (double)settings.workers));
    return 0;
}
