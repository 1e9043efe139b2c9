/*
 * trajectories_within.c - how far visits lie off the lines of their subjects, V, and how far that
 * is known.
 *
 * With e_j what the line of its subject leaves of visit j, and f_i = m_i - 2 of the m_i visits of
 * subject i, V = sum |e_j|^2 / f, f = sum f_i. The products <e_j, e_k> of all visits tell in how
 * many directions they scatter, and the sums l_i of the subjects how differently they do: with
 *
 *     n / (n - 1) sum (l_i - V f_i)^2 / (V f)^2
 *
 * for the variance of V over its square where that is more than normal scatter alone would make it,
 * the ends are those of a residual variance of f degrees of freedom (intervals.c).
 */
#include "intervals.h"
#include "trajectories.h"

#include <math.h>

#define FREEDOM_MIN 3             /* as for all intervals of intervals.c */
#define VISITS_MAX ((size_t)4000) /* of whom all pairs are compared */

struct within {
    const struct trajectory_run *run;
    size_t count;  /* visits of subjects with three or more */
    double differ; /* variance of V over its square, from how subjects differ */
};

/* What the lines leave of those visits, with the roots of the weights: [count][3][P]. */
static void fill_residuals(const struct within *w, double *rows)
{
    const struct trajectory_run *run = w->run;
    const struct srnf_grid *grid = srnf_sht_grid(run->sht);
    const struct subjects *s = &run->subjects;
    size_t size = 3 * run->points;

    for (size_t i = 0; i < run->n; i++) {
        for (size_t m = s->start[i]; s->size[i] > 2 && m < s->start[i + 1]; m++) {
            size_t visit = s->members[m];
            double time = trajectory_time(run, visit) - run->out->reference;
            const double *q = run->visits->q + visit * size;

            for (size_t k = 0; k < size; k++) {
                double off = run->visits->sizes[visit] * q[k] - run->level_q[i * size + k] -
                             time * run->slope_q[i * size + k];

                rows[k] = sqrt(grid->weight[k % run->points / grid->n_phi]) * off;
            }
            rows += size;
        }
    }
}

/* tr M^2 over (tr M)^2 of the products M of the residuals. */
static int directions(const struct within *w, double *squares, struct srnf_error *error)
{
    size_t n = w->count;
    size_t size = 3 * w->run->points;
    double *rows = srnf_alloc(n, size * sizeof(double));
    double *gram = srnf_alloc(n, n * sizeof(double));
    double trace = 0.0;
    int status = rows && gram ? SRNF_OK : SRNF_ENOMEM;

    *squares = 0.0;
    if (status == SRNF_OK) {
        fill_residuals(w, rows);
        status = stats_gram(n, size, rows, gram, error);
    }
    for (size_t k = 0; status == SRNF_OK && k < n * n; k++) {
        *squares += gram[k] * gram[k];
        trace += k % (n + 1) == 0 ? gram[k] : 0.0;
    }
    *squares /= trace > 0.0 ? trace * trace : 1.0;
    srnf_free(rows);
    srnf_free(gram);
    return status;
}

static int find_interval(const struct within *w, struct srnf_error *error)
{
    struct srnf_trajectories *out = w->run->out;
    double squares = 0.0; /* of so many visits the subjects tell enough */
    int status = w->count <= VISITS_MAX ? directions(w, &squares, error) : SRNF_OK;

    if (status == SRNF_OK) {
        intervals_of_variance(out->within, (double)out->freedom, squares, w->differ,
                              out->within_interval);
    }
    return status;
}

int trajectory_within(struct trajectory_run *run, struct srnf_error *error)
{
    struct srnf_trajectories *out = run->out;
    struct within w = {.run = run};
    double n = (double)run->n;
    double left = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        left += run->left[i];
        w.count += run->subjects.size[i] > 2 ? run->subjects.size[i] : 0;
    }
    out->within = out->freedom > 0 ? left / (double)out->freedom : 0.0;
    for (size_t i = 0; i < run->n && left > 0.0; i++) {
        double off = run->left[i] - out->within * (double)(run->subjects.size[i] - 2);

        w.differ += n / (n - 1.0) * off * off / (left * left);
    }
    out->within_interval[0] = out->within_interval[1] =
        out->freedom >= FREEDOM_MIN ? out->within : (double)NAN;
    return out->freedom >= FREEDOM_MIN && left > 0.0 ? find_interval(&w, error) : SRNF_OK;
}
