/*
 * priority.c - the threads that answer ask for short slices, those that compute for long ones and
 * SCHED_BATCH; all keep the nice value that the daemon was started with.
 *
 * Since Linux 6.12 a thread that wakes up goes before one that runs with a longer slice, as far as
 * it has not used up its share: so an answer does not wait for the end of a worker's slice. Older
 * kernels ignore the slice. Ten nice steps for the workers do the same on all kernels, but divide
 * the workers' share beside any other program on the machine by ten.
 */
#include "priority.h"

#include <sched.h>
#include <stdint.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#define SLICE_ANSWER_NS UINT64_C(100000)
#define SLICE_COMPUTE_NS UINT64_C(10000000)

/* struct sched_attr of the kernel in its first size; <linux/sched/types.h> cannot be included
   beside <sched.h>. */
struct attributes {
    uint32_t size, policy;
    uint64_t flags;
    int32_t nice;
    uint32_t priority;
    uint64_t runtime, deadline, period; /* runtime: the slice, in ns */
};

static void set(uint32_t policy, uint64_t slice)
{
    const struct attributes attributes = {.size = sizeof attributes,
                                          .policy = policy,
                                          .nice = getpriority(PRIO_PROCESS, 0),
                                          .runtime = slice};

    (void)syscall(SYS_sched_setattr, 0, &attributes, 0);
}

void priority_answer(void)
{
    set(SCHED_OTHER, SLICE_ANSWER_NS);
}

void priority_compute(void)
{
    set(SCHED_BATCH, SLICE_COMPUTE_NS);
}
