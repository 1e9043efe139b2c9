/*
 * pause.c - how long a thread of the engine waits before it tries again what the store has refused.
 */
#include "jobs/internal.h"

#include <time.h>

#define PAUSE_FIRST_MS 20
#define PAUSE_LAST_MS 1000

bool jobs_pause(unsigned failures)
{
    long ms = PAUSE_FIRST_MS;
    struct timespec pause;

    for (; failures > 1 && ms < PAUSE_LAST_MS; failures--) {
        ms *= 2;
    }
    ms = ms < PAUSE_LAST_MS ? ms : PAUSE_LAST_MS;
    pause = (struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000L};
    return nanosleep(&pause, NULL) == 0;
}
