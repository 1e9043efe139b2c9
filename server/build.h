/*
 * build.h - what this binary was built from and runs on: versions for /v1/version and the log, and
 * the numeric build id that is part of every cache key.
 */
#ifndef SRNFD_BUILD_H
#define SRNFD_BUILD_H

#include <stddef.h>

#define BUILD_ID_SIZE 384

/* One component: "openblas", its version as it says itself. */
struct build_part {
    const char *name;
    char version[128];
};
#define BUILD_PARTS 15

/* Fills parts[0 .. BUILD_PARTS). */
void build_parts(struct build_part parts[BUILD_PARTS]);

/* Everything that the last bits of a result may depend on, as one line: two daemons with the same
   id compute the same bits. */
void build_numeric_id(char id[BUILD_ID_SIZE]);

#define BUILD_ARITHMETIC_SIZE (BUILD_ID_SIZE + 32)
/* The same with the instructions that this processor makes the loops over grids use, which decide
   last bits too: two machines with this id compute the same bits. */
void build_arithmetic_id(char id[BUILD_ARITHMETIC_SIZE]);

#endif
