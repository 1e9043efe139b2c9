/*
 * executor.h - the executor "slurm" as the settings describe it.
 */
#ifndef SRNFD_MAIN_EXECUTOR_H
#define SRNFD_MAIN_EXECUTOR_H

#include <stdbool.h>
#include <stddef.h>

#include "config.h"
#include "slurm/slurm.h"

/* Texts that the configuration of the executor borrows. */
struct executor {
    struct slurm_config slurm;
    char server[CONFIG_TEXT_MAX + 32], program[CONFIG_TEXT_MAX], installation[16];
    const char *variables[5];
};

/* Whether jobs offer their tasks to workers, and whether Slurm is to bring them. */
bool executor_offers_tasks(const struct config *config);
bool executor_is_slurm(const struct config *config);
/* Whether the settings of the executor can be served; otherwise a sentence. */
bool executor_check(const struct config *config, char *message, size_t size);
/* Starts it. address: where the service listens, "127.0.0.1:41234". store, jobs and metrics of
   executor->slurm are set. Returns 0, or -1 with a sentence. */
int executor_start(struct executor *executor, const struct config *config, const char *address,
                   struct slurm **slurm, char *message, size_t size);

#endif
