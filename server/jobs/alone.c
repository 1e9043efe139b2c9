/*
 * alone.c - jobs that the daemon has died with several times run one at a time, with no other job
 * beside them.
 *
 * When the daemon dies, the rows of the jobs that ran say no more than that they ran. What ended it
 * may have been a request, another job, the system or somebody. So all of them are put back, and
 * the death is counted with each; from the JOBS_DEATHS_MAX-th on a job is claimed alone. If the
 * daemon dies with it then, it was the job, which has failed; otherwise it ends as any other.
 *
 *   before engine start + calm_seconds   such jobs wait, the others run
 *   then, while such a job waits         no other job starts; those that run end
 *   nothing runs                         a worker claims such a job; the others help its loops
 *   none waits any more                  all is as before
 *
 * Without the first line somebody who ends the daemon again and again would make jobs fail: each
 * dies soon with jobs that happen to run alone. So a daemon must have lived for a while first.
 *
 * Jobs come to this state by recovery only (store_job_recover), so their number is known when the
 * engine opens, and falls. They have no tickets. Lock: jobs->mutex (rank 20).
 */
#include "jobs/internal.h"

#include "clock.h"

bool jobs_alone_holds(struct jobs *jobs)
{
    struct jobs_alone *alone = &jobs->alone;
    bool hold = alone->runs || (alone->waiting > 0 && clock_now() >= alone->from);

    atomic_store(&alone->hold, hold);
    return hold;
}

bool jobs_alone_is_due(struct jobs *jobs)
{
    return jobs_alone_holds(jobs) && !jobs->alone.runs && jobs->running == 0;
}

void jobs_alone_wait(struct jobs *jobs)
{
    struct timespec until = clock_timespec(jobs->alone.from);

    jobs->idle++;
    if (jobs->alone.waiting > 0 && !jobs_alone_holds(jobs)) {
        (void)pthread_cond_clockwait(&jobs->wake, &jobs->mutex, CLOCK_MONOTONIC, &until);
    } else {
        pthread_cond_wait(&jobs->wake, &jobs->mutex);
    }
    jobs->idle--;
}
