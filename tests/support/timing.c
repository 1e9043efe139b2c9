/*
 * timing.c - clocks, and repeated and interleaved measurement for benchmarks.
 */
#include "support/timing.h"

#include <stdlib.h>
#include <time.h>

#include "support/compare.h"

static double read_clock(clockid_t clock)
{
    struct timespec now;

    if (clock_gettime(clock, &now)) {
        abort(); /* both clocks exist wherever the daemon runs */
    }
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double timing_monotonic(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

double timing_cpu(void)
{
    return read_clock(CLOCK_THREAD_CPUTIME_ID);
}

static double sample(const struct timing_case *subject)
{
    double start = timing_cpu();

    for (size_t i = 0; i < subject->calls; i++) {
        subject->body(subject->argument);
    }
    return (timing_cpu() - start) / (double)subject->calls;
}

void timing_calibrate(struct timing_case *subject, double seconds)
{
    double each;

    subject->calls = 1;
    (void)sample(subject);
    each = sample(subject);
    while (each * (double)subject->calls < 0.25 * seconds && subject->calls < ((size_t)1 << 30)) {
        subject->calls *= 2;
        each = sample(subject);
    }
    subject->calls = each < seconds ? (size_t)(seconds / (each > 0.0 ? each : seconds)) : 1;
    subject->calls = subject->calls > 0 ? subject->calls : 1;
}

void timing_interleave(const struct timing_case *cases, size_t count, size_t samples,
                       double *seconds)
{
    for (size_t i = 0; i < samples; i++) {
        for (size_t k = 0; k < count; k++) {
            seconds[k * samples + i] = sample(&cases[k]);
        }
    }
}

double timing_minimum(size_t n, const double *values)
{
    double least = values[0];

    for (size_t i = 1; i < n; i++) {
        least = compare_min(least, values[i]);
    }
    return least;
}

double timing_median(size_t n, double *values)
{
    qsort(values, n, sizeof *values, compare_order);
    return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}
