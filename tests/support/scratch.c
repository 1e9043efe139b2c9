/*
 * scratch.c - see scratch.h.
 */
#include "support/scratch.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>

bool scratch_make(char folder[SCRATCH_MAX], const char *name)
{
    const char *base = getenv("TMPDIR");

    (void)snprintf(folder, SCRATCH_MAX, "%.150s/srnfd-%.30s-XXXXXX", base ? base : "/tmp", name);
    return mkdtemp(folder) != NULL;
}

static int remove_one(const char *path, const struct stat *about, int kind, struct FTW *place)
{
    (void)about;
    (void)kind;
    (void)place;
    return remove(path);
}

void scratch_remove(const char *folder)
{
    (void)nftw(folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
}
