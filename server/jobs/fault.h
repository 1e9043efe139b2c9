/*
 * fault.h - what is left behind when the daemon dies of a fault: one line of the log, and the job
 * that the thread ran, for the next start.
 */
#ifndef SRNFD_JOBS_FAULT_H
#define SRNFD_JOBS_FAULT_H

#include <stdbool.h>

#include "ids.h"

/* Opens, or makes, the file of the data folder in which a fault is recorded, and reads what the
   last one has left: job[STORE_ID_MAX], "" where there was none or no job ran, and what it ended
   by. The record is cleared by fault_clear. False, with errno, where the file cannot be used:
   then faults are logged only. */
bool fault_open(const char *folder, char job[STORE_ID_MAX]);
/* Once what the last fault has left is in the database. */
void fault_clear(void);
void fault_close(void);
/* Handles SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT from now on. Not in builds with
   sanitizers, which report these themselves. */
void fault_watch(void);
/* Gives the calling thread a stack for handling faults, so that an overflow of its own is told
   too. */
void fault_thread(void);
/* The calling thread runs this job from now on; NULL: none. The strings must stay. */
void fault_enter(const char *job, const char *process);

#endif
