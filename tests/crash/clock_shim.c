/*
 * clock_shim.c - clock_shim.so: loaded before the C library (LD_PRELOAD) into a program under test.
 * The clock of the day is off by the seconds that stand in the file CLOCK_SHIM names, and steps
 * when another number is written there; the monotonic clock goes on as it does.
 */
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

typedef int tell(clockid_t clock, struct timespec *now);

static time_t seconds_off(void)
{
    const char *path = getenv("CLOCK_SHIM");
    int fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    char text[32];
    ssize_t n = fd >= 0 ? read(fd, text, sizeof text - 1) : 0;

    if (fd >= 0) {
        (void)close(fd);
    }
    text[n > 0 ? n : 0] = '\0';
    return (time_t)strtoll(text, NULL, 10);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    tell *next;
    void *symbol = dlsym(RTLD_NEXT, "clock_gettime");
    int status;

    memcpy(&next, &symbol, sizeof next); /* ISO C has no cast between the two */
    status = next(clock, now);
    if (status == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
        now->tv_sec += seconds_off();
    }
    return status;
}

time_t time(time_t *now)
{
    struct timespec exact = {.tv_sec = 0};

    (void)clock_gettime(CLOCK_REALTIME, &exact);
    if (now) {
        *now = exact.tv_sec;
    }
    return exact.tv_sec;
}
