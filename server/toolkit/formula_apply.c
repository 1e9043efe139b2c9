/*
 * formula_apply.c - the numbers that the functions of a formula make. center, scale and standardize
 * take mean and deviation of the members, as patsy's stateful transforms do, and keep them for the
 * points at which surfaces are predicted.
 */
#include <math.h>

#include "toolkit/formula.h"

/* Mean and deviation of the numbers there are, by B. P. Welford's recurrence (1962). Numbers that
   are all the same have no deviation to divide by. */
static void learn_step(const struct formula_step *step, size_t n, const double *values,
                       double *mean, double *deviation)
{
    double average = 0.0, squares = 0.0;
    size_t count = 0;

    *mean = 0.0;
    *deviation = 1.0;
    if (step->function != FORMULA_STANDARDIZE) {
        return;
    }
    for (size_t i = 0; i < n; i++) {
        double difference = values[i] - average;

        if (isfinite(values[i])) {
            average += difference / (double)++count;
            squares += difference * (values[i] - average);
        }
    }
    if (!step->uncentred) {
        *mean = average;
    }
    if (!step->unscaled && squares > 0.0) {
        *deviation = sqrt(squares / (double)(count - (size_t)step->ddof));
    }
}

static double apply_step(const struct formula_step *step, double mean, double deviation, double x)
{
    double power = 1.0;

    switch (step->function) {
    case FORMULA_LOG:
        return x > 0.0 ? log(x) : NAN;
    case FORMULA_LOG2:
        return x > 0.0 ? log2(x) : NAN;
    case FORMULA_LOG10:
        return x > 0.0 ? log10(x) : NAN;
    case FORMULA_LOG1P:
        return x > -1.0 ? log1p(x) : NAN;
    case FORMULA_EXP:
        return exp(x);
    case FORMULA_SQRT:
        return x >= 0.0 ? sqrt(x) : NAN;
    case FORMULA_POWER:
        for (int k = 0; k < step->power; k++) {
            power *= x;
        }
        return power;
    default:
        return (x - mean) / deviation;
    }
}

void formula_learn(const struct formula_factor *factor, size_t n, double *values,
                   struct formula_state *state)
{
    *state = (struct formula_state){0};
    for (size_t k = 0; k < factor->steps; k++) {
        learn_step(&factor->step[k], n, values, &state->mean[k], &state->deviation[k]);
        for (size_t i = 0; i < n; i++) {
            values[i] =
                apply_step(&factor->step[k], state->mean[k], state->deviation[k], values[i]);
        }
    }
}

double formula_apply(const struct formula_factor *factor, const struct formula_state *state,
                     double value)
{
    for (size_t k = 0; k < factor->steps; k++) {
        value = apply_step(&factor->step[k], state->mean[k], state->deviation[k], value);
    }
    return value;
}
