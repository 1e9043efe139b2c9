/*
 * pilots.h - arrays of workers that Slurm was asked for (migrations: pilots).
 */
#ifndef SRNFD_STORE_PILOTS_H
#define SRNFD_STORE_PILOTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "store_status.h"

struct store;

#define STORE_PILOTS_NAME_MAX 96
#define STORE_PILOTS_NUMBER_MAX 24

enum store_pilots_status { STORE_PILOTS_INTENDED, STORE_PILOTS_SUBMITTED, STORE_PILOTS_ENDING };

struct store_pilots {
    char name[STORE_PILOTS_NAME_MAX]; /* of the array, as Slurm knows it */
    char job[STORE_ID_MAX];
    char number[STORE_PILOTS_NUMBER_MAX]; /* that Slurm gave it; "": not known */
    enum store_pilots_status status;
    int64_t attempt, size; /* from 1 on */
    int64_t memory;        /* MiB that were asked for each; 0: as the cluster gives */
    char token[65];        /* digest */
    bool vanished;         /* it was submitted, never shown, and given up */
};

/* Writes the row of that name, durably. */
int store_pilots_put(struct store *store, const struct store_pilots *row);
int store_pilots_drop(struct store *store, const char *name);
/* All rows (malloc), by name. */
int store_pilots_list(struct store *store, struct store_pilots **list, size_t *n);
/* Whether the job is accepted or running. */
int store_pilots_wanted(struct store *store, const char *job, bool *wanted);

#endif
