/*
 * scratch.h - a folder of one's own for the time of a test.
 */
#ifndef TESTS_SCRATCH_H
#define TESTS_SCRATCH_H

#include <stdbool.h>
#include <stddef.h>

#define SCRATCH_MAX ((size_t)200) /* bytes of the path of a folder */

/* Makes srnfd-NAME-XXXXXX below TMPDIR, which tests/run.sh sets, or below /tmp. */
bool scratch_make(char folder[SCRATCH_MAX], const char *name);

/* Removes a folder with all that is in it; a missing one is no error. Links are not followed. */
void scratch_remove(const char *folder);

#endif
