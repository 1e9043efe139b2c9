/*
 * priority.h - what the system's scheduler is told of the daemon's threads: those that answer sleep
 * most of the time and are to run at once when they wake up, those that compute run for long.
 */
#ifndef SRNFD_PRIORITY_H
#define SRNFD_PRIORITY_H

/* For the calling thread and those that it starts from now on. Where the system does not know how,
   everything stays as it was. */
void priority_answer(void);
/* For the calling thread: it computes. It keeps its share of the processors beside other programs,
   unlike with a raised nice value. */
void priority_compute(void);

#endif
