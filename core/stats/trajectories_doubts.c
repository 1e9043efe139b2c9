/*
 * trajectories_doubts.c - what makes the table of visits doubtful: visits that lie off the line of
 * their subject, and visits of two subjects that seem to have changed places.
 *
 * With y the visits, SRNFs times the sizes, less what the mean slope b makes of their times, the
 * visits of a subject scatter by
 *
 *     S = sum over a and c of P_ac <y_a, y_c> / f,
 *
 * P the projection on what is left of m visits by their mean, f = m - 1, or, of subjects with three
 * visits or more among themselves, by their line, f = m - 2. A surface that takes the place of
 * visit a is seen at the time of that: z = y_b - (t_a - t_b) b, and then, with d = z - y_a,
 *
 *     f S' = f S + 2 sum over c of P_ac <d, y_c> + P_aa <d, d>.
 *
 * Visits of two subjects seem exchanged where both subjects scatter at least STANDS_OUT times as
 * far as the median of all, and with the two in each other's place at most ORDINARY times as far,
 * and where no other exchange would bring either of them nearer. Subjects who differ no more than
 * their visits do are not told apart in this way: none of them stands out.
 */
#include "stats.h"
#include "trajectories.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define VISITS_MAX ((size_t)4000) /* of whom all pairs are compared */
#define STANDS_OUT 2.0
#define ORDINARY 1.5

struct scatter {
    struct trajectory_run *run;
    const struct subjects *s;
    size_t n;       /* visits */
    bool lines;     /* about lines, of those with three visits or more */
    double *gram;   /* [n + 1][n + 1] of the visits, and the mean slope */
    double *square; /* [subjects] S, -1 of those who are left out; and as many of scratch */
    double *middle; /* [subjects] the mean time of the visits */
    double median;  /* of S */
};

/* Fields times their sizes, about their mean and less the mean slope, which is the last row; with
   the roots of the weights. */
static int fill_gram(const struct trajectory_run *run, double *gram, struct srnf_error *error)
{
    size_t n = run->visits->n;
    size_t size = 3 * run->points;
    double *y = srnf_alloc(n + 1, size * sizeof(double));
    double *slope = y ? y + n * size : NULL;
    int status;

    if (!y) {
        return SRNF_ENOMEM;
    }
    stats_weight(srnf_sht_grid(run->sht), n, run->visits->q, NULL, y);
    for (size_t k = 0; k < run->n * size; k++) {
        slope[k % size] += run->weights[k / size] / (double)run->n * run->slope_q[k];
    }
    for (size_t k = 0; k < size; k++) {
        double mean = 0.0;

        slope[k] *=
            sqrt(srnf_sht_grid(run->sht)->weight[k % run->points / srnf_sht_grid(run->sht)->n_phi]);
        for (size_t i = 0; i < n; i++) {
            y[i * size + k] = y[i * size + k] * run->visits->sizes[i] -
                              (trajectory_time(run, i) - run->out->reference) * slope[k];
            mean += y[i * size + k] / (double)n;
        }
        for (size_t i = 0; i < n; i++) {
            y[i * size + k] -= mean;
        }
    }
    status = stats_gram(n + 1, size, y, gram, error);
    srnf_free(y);
    return status;
}

static bool is_in(const struct scatter *c, size_t k)
{
    return c->s->size[k] > (c->lines ? 2U : 1U);
}

/* P_ac of two visits of subject k. */
static double left_of(const struct scatter *c, size_t k, size_t a, size_t other)
{
    double left = (a == other ? 1.0 : 0.0) - 1.0 / (double)c->s->size[k];

    if (c->lines) {
        left -= (trajectory_time(c->run, a) - c->middle[k]) *
                (trajectory_time(c->run, other) - c->middle[k]) / c->run->spread[k];
    }
    return left;
}

static double freedom_of(const struct scatter *c, size_t k)
{
    return (double)(c->s->size[k] - (c->lines ? 2 : 1));
}

/* S of subject k. */
static double square_of(const struct scatter *c, size_t k)
{
    const struct subjects *s = c->s;
    double sum = 0.0;

    for (size_t v = s->start[k]; v < s->start[k + 1]; v++) {
        const double *row = c->gram + s->members[v] * (c->n + 1);

        for (size_t o = s->start[k]; o < s->start[k + 1]; o++) {
            sum += left_of(c, k, s->members[v], s->members[o]) * row[s->members[o]];
        }
    }
    return fmax(sum, 0.0) / freedom_of(c, k);
}

/* S' of subject k with surface b, another subject's, in the place of its visit a. */
static double square_with(const struct scatter *c, size_t k, size_t a, size_t b)
{
    const struct subjects *s = c->s;
    const double *own = c->gram + a * (c->n + 1), *row = c->gram + b * (c->n + 1);
    const double *slope = c->gram + c->n * (c->n + 1);
    double later = trajectory_time(c->run, a) - trajectory_time(c->run, b);
    double seen = row[b] - 2.0 * later * slope[b] + later * later * slope[c->n]; /* <z, z> */
    double sum = c->square[k] * freedom_of(c, k);

    for (size_t v = s->start[k]; v < s->start[k + 1]; v++) {
        size_t i = s->members[v];

        sum += 2.0 * left_of(c, k, a, i) * (row[i] - later * slope[i] - own[i]);
    }
    sum += left_of(c, k, a, a) * (seen - 2.0 * (row[a] - later * slope[a]) + own[a]);
    return fmax(sum, 0.0) / freedom_of(c, k);
}

static void fill_squares(struct scatter *c)
{
    const struct subjects *s = c->s;
    double *sorted = c->square + s->count;
    size_t count = 0;

    for (size_t k = 0; k < s->count; k++) {
        c->middle[k] = 0.0;
        for (size_t v = s->start[k]; v < s->start[k + 1]; v++) {
            c->middle[k] += trajectory_time(c->run, s->members[v]) / (double)s->size[k];
        }
        c->square[k] = is_in(c, k) ? square_of(c, k) : -1.0;
        if (is_in(c, k)) {
            sorted[count++] = c->square[k];
        }
    }
    stats_sort(count, sorted);
    c->median = count >= SRNF_PAIRS_MIN ? 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]) : 0.0;
}

static double root_over(const struct scatter *c, double square)
{
    return sqrt(square / c->median);
}

/* The best exchange of a visit of k with one of l, if it is one at all: returns what is left of the
   squares of both, or INFINITY. */
static double find_exchange(const struct scatter *c, size_t k, size_t l,
                            struct srnf_exchanged_visits *found)
{
    const struct subjects *s = c->s;
    double most = ORDINARY * ORDINARY * c->median;
    double least = INFINITY;

    for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
        for (size_t o = s->start[l]; o < s->start[l + 1]; o++) {
            size_t a = s->members[m];
            size_t b = s->members[o];
            double one = square_with(c, k, a, b);
            double other = square_with(c, l, b, a);

            if (one <= most && other <= most && one + other < least) {
                least = one + other;
                *found = (struct srnf_exchanged_visits){
                    .members = {a, b},
                    .before = {root_over(c, c->square[k]), root_over(c, c->square[l])},
                    .after = {root_over(c, one), root_over(c, other)}};
            }
        }
    }
    return least;
}

static bool stands_out(const struct scatter *c, size_t k)
{
    return is_in(c, k) && c->square[k] >= STANDS_OUT * STANDS_OUT * c->median;
}

/* The pairs of subjects who are each other's best, of those who are in none so far. best:
   [subjects] of scratch. */
static void find_all(const struct scatter *c, double *best, bool *done,
                     struct srnf_trajectories *out)
{
    size_t count = c->s->count;
    struct srnf_exchanged_visits found;

    for (size_t k = 0; k < count; k++) {
        best[k] = INFINITY;
    }
    for (size_t pass = 0; pass < 2; pass++) {
        for (size_t k = 0; k < count && !srnf_is_canceled(c->run->context); k++) {
            for (size_t l = k + 1; !done[k] && stands_out(c, k) && l < count; l++) {
                double left =
                    !done[l] && stands_out(c, l) ? find_exchange(c, k, l, &found) : INFINITY;

                if (pass == 0) {
                    best[k] = fmin(best[k], left);
                    best[l] = fmin(best[l], left);
                } else if (isfinite(left) && !(left > best[k]) && !(left > best[l])) {
                    out->exchanged[out->exchanges++] = found;
                    done[k] = done[l] = true;
                }
            }
        }
    }
}

int trajectory_doubts(struct trajectory_run *run, struct srnf_error *error)
{
    struct scatter c = {.run = run, .s = &run->subjects, .n = run->visits->n};
    size_t count = run->n;
    bool *done = srnf_alloc(count, sizeof *done);
    int status = done ? SRNF_OK : SRNF_ENOMEM;

    for (size_t k = 0; k < count; k++) {
        size_t visits = run->subjects.size[k];

        run->out->subject[k].left = visits > 2 ? run->left[k] / (double)(visits - 2) : 0.0;
    }
    if (c.n <= VISITS_MAX && status == SRNF_OK) {
        c.gram = srnf_alloc(c.n + 1, (c.n + 1) * sizeof(double));
        c.square = srnf_alloc(count, 3 * sizeof(double));
        c.middle = c.square ? c.square + 2 * count : NULL;
        run->out->exchanged = srnf_alloc(count, sizeof *run->out->exchanged);
        status = c.gram && c.square && run->out->exchanged ? SRNF_OK : SRNF_ENOMEM;
        status = status ? status : fill_gram(run, c.gram, error);
        for (size_t pass = 0; pass < 2 && status == SRNF_OK; pass++) {
            c.lines = pass == 0;
            fill_squares(&c);
            if (c.median > 0.0) {
                find_all(&c, c.square + count, done, run->out);
            }
        }
    }
    srnf_free(done);
    srnf_free(c.gram);
    srnf_free(c.square);
    return status;
}
