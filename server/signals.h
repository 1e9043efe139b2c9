/*
 * signals.h - signals that one thread waits for.
 */
#ifndef SRNFD_SIGNALS_H
#define SRNFD_SIGNALS_H

#include <signal.h>

/*
 * From now on these signals are for sigwaitinfo and sigtimedwait in the calling thread alone, which
 * must be the first and outlive the others: it blocks them, and so do the threads that it makes.
 * What a thread that a library made before main is sent (OpenBLAS has such) it passes on: by
 * default it would end the process. Call it once, before any other thread is made.
 */
void signals_await(const sigset_t *signals);

#endif
