/*
 * timing.h - clocks, and repeated and interleaved measurement for benchmarks.
 */
#ifndef TESTS_TIMING_H
#define TESTS_TIMING_H

#include <stddef.h>

/* Seconds of a clock that never goes back. */
double timing_monotonic(void);

/* Seconds that the calling thread has spent on a processor: what other processes do beside it is
   left out, except for what they take from the shared caches. */
double timing_cpu(void);

/* One thing to be measured. Several calls make one sample: a short body must outlast the clock. */
struct timing_case {
    void (*body)(void *argument);
    void *argument;
    size_t calls;
};

/*
 * Chooses calls so that one sample takes about the given seconds; also warms the caches.
 *   seconds  [in]  of one sample, for example 0.002
 */
void timing_calibrate(struct timing_case *subject, double seconds);

/*
 * Takes samples of every case in turn, so that what disturbs one disturbs its neighbours alike.
 *   seconds  [out] double[count][samples], processor seconds of one call
 */
void timing_interleave(const struct timing_case *cases, size_t count, size_t samples,
                       double *seconds);

/* Least value, n > 0: what the body costs when nothing disturbs it. */
double timing_minimum(size_t n, const double *values);

/* Median, n > 0; sorts values. */
double timing_median(size_t n, double *values);

#endif
