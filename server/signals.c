/*
 * signals.c - signals that one thread waits for, whichever thread the kernel gives them to.
 */
#include "signals.h"

#include <errno.h>
#include <pthread.h>

static pthread_t waiting; /* set before any handler is */

static void pass_on(int received)
{
    int before = errno;

    (void)pthread_kill(waiting, received);
    errno = before;
}

void signals_await(const sigset_t *signals)
{
    struct sigaction action = {.sa_handler = pass_on, .sa_flags = SA_RESTART};

    (void)pthread_sigmask(SIG_BLOCK, signals, NULL);
    waiting = pthread_self();
    action.sa_mask = *signals;
    for (int i = 1; i < NSIG; i++) {
        if (sigismember(signals, i) == 1) {
            (void)sigaction(i, &action, NULL);
        }
    }
}
