/*
 * exchange.c - the relabellings of a permutation test: how many different ones there are, all of
 * them one by one where they are few, and what p can come of them.
 *
 * n items of kinds with the counts c_k have N = n! / prod c_k! arrangements, of which N c_k / n
 * begin with kind k, a whole number. Arrangement `number` in the order of the kinds is so read off
 * from the left without those before it, and threads share the work as they like. The subjects are
 * sorted by kind first: number 0 is what was observed.
 */
#include "subjects.h"

#include <math.h>

#define EXACT_MAX 1e9 /* products with counts, which are below 1e6, then are exact */
#define ROUNDING 1e-9
#define PERMUTATIONS_MAX ((size_t)10000000)
#define BOOTSTRAPS_MIN ((size_t)100)
#define BOOTSTRAPS_MAX ((size_t)100000)

int stats_check_draws(size_t permutations, size_t bootstraps, struct srnf_error *error)
{
    if (permutations == 0 || permutations > PERMUTATIONS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "permutations is %zu, not 1 to %zu", permutations,
                         PERMUTATIONS_MAX);
    }
    if (bootstraps < BOOTSTRAPS_MIN || bootstraps > BOOTSTRAPS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "bootstraps is %zu, not %zu to %zu", bootstraps,
                         BOOTSTRAPS_MIN, BOOTSTRAPS_MAX);
    }
    return SRNF_OK;
}

void exchange_clear(struct exchange *e)
{
    srnf_free(e->count);
    srnf_free(e->sorted);
    *e = (struct exchange){0};
}

/* n! / prod c_k!, built up kind by kind from binomial coefficients. */
static double count_arrangements(const struct exchange *e)
{
    double all = 1.0;
    double placed = 0.0;

    for (size_t k = 0; k < e->kinds; k++) {
        for (size_t j = 1; j <= e->count[k]; j++) {
            placed += 1.0;
            all = all * placed / (double)j; /* whole at each step */
        }
    }
    return all;
}

int exchange_open(struct exchange *e, size_t n, const size_t *kind, size_t kinds, size_t asked,
                  double same)
{
    size_t at = 0;
    double all;

    *e = (struct exchange){.n = n, .kinds = kind ? kinds : n};
    e->count = srnf_alloc(e->kinds, sizeof *e->count);
    e->sorted = srnf_alloc(n, sizeof *e->sorted);
    if (!e->count || !e->sorted) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < e->kinds && kind; k++) {
        for (size_t i = 0; i < n; i++) {
            if (kind[i] == k) {
                e->sorted[at++] = i;
                e->count[k]++;
            }
        }
    }
    for (size_t i = 0; i < n && !kind; i++) {
        e->sorted[i] = i;
        e->count[i] = 1;
    }
    all = count_arrangements(e);
    e->test.relabellings = all;
    e->test.exact = all <= EXACT_MAX && all - 1.0 <= (double)asked;
    e->test.permutations = asked;
    e->test.least = 1.0 / (1.0 + (double)asked);
    if (e->test.exact) {
        e->all = (uint64_t)all;
        e->test.permutations = (size_t)e->all - 1;
        e->test.least = fmin(1.0, same / all);
    }
    return SRNF_OK;
}

void exchange_arrange(const struct exchange *e, uint64_t number, size_t *left, size_t *source)
{
    uint64_t arrangements = e->all;

    for (size_t k = 0; k < e->kinds; k++) {
        left[k] = e->count[k];
    }
    for (size_t i = 0; i < e->n; i++) {
        size_t first = 0; /* of the kind among the sorted subjects */

        for (size_t k = 0; k < e->kinds; k++) {
            uint64_t here = arrangements * left[k] / (e->n - i);

            if (number < here) {
                source[e->sorted[i]] = e->sorted[first + e->count[k] - left[k]];
                left[k]--;
                arrangements = here;
                break;
            }
            number -= here;
            first += e->count[k];
        }
    }
}

bool srnf_permutation_at_floor(const struct srnf_permutation_test *test, double p)
{
    return test->permutations > 0 && p <= test->least * (1.0 + ROUNDING);
}

void srnf_permutation_interval(const struct srnf_permutation_test *test, double p,
                               double interval[2])
{
    double m = (double)test->permutations;

    if (test->exact) {
        interval[0] = interval[1] = p;
    } else {
        double as_extreme = fmin(fmax(round(p * (1.0 + m) - 1.0), 0.0), m);

        srnf_wilson_interval((size_t)as_extreme, test->permutations, interval);
    }
}
