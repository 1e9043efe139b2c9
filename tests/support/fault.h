/*
 * fault.h - what a test and the shim (fault_shim.c) in the daemon under test share: a page of
 * memory, mapped by both from the file that SRNFD_FAULT_CONTROL names.
 *
 * The shim numbers, from 1, the calls that change files below the folder SRNFD_FAULT_DIR and that
 * the masks select. Those numbered first..last fail with an errno, or kill the process. All fields
 * are atomic: the test changes them while the daemon runs.
 */
#ifndef SRNFD_TEST_FAULT_H
#define SRNFD_TEST_FAULT_H

#include <stdatomic.h>
#include <stdint.h>

enum fault_kind {
    FAULT_OPEN = 1, /* for writing */
    FAULT_WRITE = 2,
    FAULT_SYNC = 4,
    FAULT_RENAME = 8,
    FAULT_TRUNCATE = 16,
    FAULT_MKDIR = 32,
    FAULT_UNLINK = 64,
    FAULT_LINK = 128,
    FAULT_ALL_KINDS = 255,
};

enum fault_file {
    FAULT_LOG = 1,      /* srnfd.db-wal */
    FAULT_DATABASE = 2, /* srnfd.db */
    FAULT_INDEX = 4,    /* srnfd.db-shm */
    FAULT_STAGED = 8,   /* blobs/tmp/... */
    FAULT_BLOB = 16,    /* blobs/ab/... */
    FAULT_OTHER = 32,   /* the folders, lock, reserve */
    FAULT_ALL_FILES = 63,
};

enum fault_action { /* above 0: an errno */
                    FAULT_KILL_BEFORE = -1,
                    FAULT_KILL_HALF =
                        -2, /* writes: after half of the bytes; otherwise as KILL_BEFORE */
                    FAULT_KILL_AFTER = -3,
};

struct fault_control {
    _Atomic int64_t kinds, files; /* masks; 0 selects nothing */
    _Atomic int64_t calls;        /* selected calls so far */
    _Atomic int64_t first, last;  /* numbers of the calls that fail */
    _Atomic int64_t action;
    _Atomic int64_t hits;        /* calls that failed so far */
    _Atomic int64_t clock_ms;    /* added to what CLOCK_REALTIME says */
    _Atomic int64_t allocations; /* so far, by the modules that malloc_shim.c watches */
    _Atomic int64_t no_memory_first, no_memory_last; /* numbers of those that fail */
};

#endif
