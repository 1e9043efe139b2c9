/*
 * clock.h - the monotonic clock, by which waits and limits are measured.
 */
#ifndef SRNFD_CLOCK_H
#define SRNFD_CLOCK_H

#include <time.h>

/* Seconds of the monotonic clock. */
double clock_now(void);
/* Those of the kernel's last tick, some milliseconds ago, which cost less to ask for. */
double clock_last_tick(void);
/* A moment of that clock as functions with a timeout take it. seconds: [in] finite, not negative.
 */
struct timespec clock_timespec(double seconds);

#endif
