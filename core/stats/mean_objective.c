/*
 * mean_objective.c - the mean of the registered fields, its variance, and the objective G.
 */
#include "mean.h"

#include <string.h>

void mean_set_target(struct mean_run *run)
{
    for (size_t k = 0; k < run->points; k++) {
        for (size_t c = 0; c < 3; c++) {
            run->target[3 * k + c] = run->mean_q[c * run->points + k];
        }
    }
}

double mean_variance_about(const struct mean_run *run, const double *average)
{
    double sum = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        sum += run->subjects[i].at.energy / (double)run->n;
    }
    /* fmax would hide what is no number */
    sum = run->norm2 * sum - stats_distance2(run->grid, average, run->mean_q);
    return sum < 0.0 ? 0.0 : sum;
}

void mean_adopt(struct mean_run *run, double variance)
{
    memcpy(run->mean_q, run->average, 3 * run->points * sizeof(double));
    run->variance = variance;
    mean_set_target(run);
}

double mean_objective(const struct mean_run *run, double variance)
{
    double penalties = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        penalties += (run->subjects[i].at.penalty + run->subjects[i].at.apart) / (double)run->n;
    }
    return variance / run->norm2 + penalties;
}

double mean_measured(const struct mean_run *run)
{
    double sum = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        const struct mean_stand *at = &run->subjects[i].at;

        sum += (at->energy + at->penalty + at->apart) / (double)run->n;
    }
    return sum;
}
