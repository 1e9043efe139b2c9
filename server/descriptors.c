/*
 * descriptors.c - what takes descriptors, at most:
 *
 *   - a connection without a request: its own; and as many again are closing, whose clients still
 *     read the answer (http/front_waiting.c)
 *   - a connection with a request: its own, and the file that it is sent
 *   - connections that give way until the HTTP library has closed them (http/slots.c), the log, the
 *     database and its folders, what listens, what libraries keep
 *   - a thread that handles requests or computes: its reader of the database and that one's log,
 *     and files that it reads and writes
 *
 * Without room for the last two, nobody's request could be answered; without room for the first
 * two, newcomers would wait unseen, behind connections that are entitled to stay.
 */
#include "descriptors.h"

#include <stdint.h>
#include <sys/resource.h>

#define OF_SERVICE 192 /* 128 that give way (LEAVING_MAX in http/slots.c), and 64 */
#define OF_THREAD 8

size_t descriptors_raise(void)
{
    struct rlimit limit;

    if (getrlimit(RLIMIT_NOFILE, &limit) != 0) {
        return SIZE_MAX;
    }
    if (limit.rlim_cur < limit.rlim_max) {
        struct rlimit raised = {.rlim_cur = limit.rlim_max, .rlim_max = limit.rlim_max};

        limit.rlim_cur = setrlimit(RLIMIT_NOFILE, &raised) == 0 ? limit.rlim_max : limit.rlim_cur;
    }
    return (size_t)limit.rlim_cur;
}

static size_t of_files(const struct descriptors *descriptors)
{
    return OF_SERVICE + OF_THREAD * descriptors->threads;
}

size_t descriptors_needed(const struct descriptors *descriptors)
{
    return of_files(descriptors) + 2 * (descriptors->connections + descriptors->waiting);
}

bool descriptors_fit(struct descriptors *descriptors)
{
    size_t files = of_files(descriptors), most = descriptors->limit / 4 * 3, room, least;

    if (descriptors_needed(descriptors) <= descriptors->limit) {
        return false;
    }
    files = files < most ? files : most; /* with so few, not all are needed at once */
    room = (descriptors->limit - files) / 2;
    room = room > 2 ? room : 2;
    least = room / 4 > 1 ? room / 4 : 1;
    least = descriptors->waiting < least ? descriptors->waiting : least;
    if (descriptors->connections > room - least) {
        descriptors->connections = room - least;
    }
    if (descriptors->waiting > room - descriptors->connections) {
        descriptors->waiting = room - descriptors->connections;
    }
    return true;
}
