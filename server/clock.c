/*
 * clock.c - the monotonic clock as seconds in a double: exact to a microsecond for
 * decades of uptime.
 */
#include "clock.h"

static double seconds_of(clockid_t clock)
{
    struct timespec now;

    (void)clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double clock_now(void)
{
    return seconds_of(CLOCK_MONOTONIC);
}

double clock_last_tick(void)
{
    return seconds_of(CLOCK_MONOTONIC_COARSE);
}

struct timespec clock_timespec(double seconds)
{
    struct timespec time = {.tv_sec = (time_t)seconds};

    time.tv_nsec = (long)(1e9 * (seconds - (double)time.tv_sec));
    return time;
}
