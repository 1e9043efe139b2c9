/*
 * formula_apply.c - the numbers that the functions of a formula make. center, scale and standardize
 * take mean and deviation of the members, as patsy's stateful transforms do, and keep them for the
 * points at which surfaces are predicted.
 */
#include <math.h>
#include <stdio.h>

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

static const char *taken_by(enum formula_function function)
{
    return function == FORMULA_SQRT    ? "numbers from 0 on"
           : function == FORMULA_LOG1P ? "numbers above -1"
                                       : "numbers above 0";
}

void formula_why(const struct formula_factor *factor, const struct formula_state *state,
                 double value, char text[FORMULA_WHY_MAX])
{
    char inner[FORMULA_FACTOR_MAX];

    text[0] = '\0';
    for (size_t k = 0; k < factor->steps && !text[0]; k++) {
        double made = apply_step(&factor->step[k], state->mean[k], state->deviation[k], value);

        formula_spell(factor, k, inner);
        if (isnan(made)) {
            (void)snprintf(text, FORMULA_WHY_MAX, "%.120s is %.10g there, and %.20s takes %s",
                           inner, value, factor->step[k].name, taken_by(factor->step[k].function));
        } else if (isinf(made)) {
            (void)snprintf(text, FORMULA_WHY_MAX,
                           "%.120s is %.10g there, of which %.20s makes a number too large", inner,
                           value, factor->step[k].name);
        }
        value = made;
    }
}
