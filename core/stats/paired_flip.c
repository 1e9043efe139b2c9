/*
 * paired_flip.c - sign flips of the differences of subjects: formulae in paired.c.
 *
 * The flip of a number has the signs of its bits, the first subject always +: a flip and its
 * opposite give the same. Where there are no more than were asked for, all are taken; else their
 * bits are drawn. Weights of subjects are in the vectors already.
 */
#include "paired.h"

#include <cblas.h>
#include <math.h>

#define BLOCK ((size_t)32)
#define EXACT_SUBJECTS 30
#define LEVEL 0.95

struct flips {
    struct paired_run *run;
    double *squares;  /* [P][6] of the displacements: xx xy xz yy yz zz */
    double *spread2;  /* [P] sum of squares of `along` */
    double *largest;  /* [permutations + 1] of T^2; the first is the observed one */
    double *farthest; /* [permutations] of the means of `along` over their standard errors */
    double observed;
    atomic_uint global;
    atomic_uint *count; /* [P] */
};

static double sign_of(const struct paired_run *run, size_t number, size_t i)
{
    const uint32_t key[2] = {(uint32_t)run->options->seed, (uint32_t)(run->options->seed >> 32)};
    const uint32_t counter[4] = {(uint32_t)number, (uint32_t)((uint64_t)number >> 32),
                                 (uint32_t)(i / 128), 0x5169u};
    uint32_t bits[4];

    if (i == 0 || number == 0) {
        return 1.0;
    }
    if (run->out->test.exact) {
        return number >> (i - 1) & 1 ? -1.0 : 1.0;
    }
    stats_philox(counter, key, bits);
    return bits[i % 128 / 32] >> i % 32 & 1 ? -1.0 : 1.0;
}

/* T^2 of one sample at a node, from the sum of the signed displacements. */
static double hotelling(const struct flips *f, const double *sum, size_t p)
{
    double n = (double)f->run->n;
    size_t points = f->run->points;
    const double *s = f->squares + 6 * p;
    const double b[3] = {sum[p], sum[points + p], sum[2 * points + p]};
    const double e[6] = {s[0] - b[0] * b[0] / n, s[1] - b[0] * b[1] / n, s[2] - b[0] * b[2] / n,
                         s[3] - b[1] * b[1] / n, s[4] - b[1] * b[2] / n, s[5] - b[2] * b[2] / n};

    return stats_quadratic_form(e, b) * (n - 1.0) / n;
}

/* The square of the signed sum of the SRNFs' differences, times the weights. */
static double global_statistic(const struct paired_run *run, const double *signs)
{
    const double *weights = run->weights;
    double sum = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        const double *row = run->gram[0] + i * run->n;
        double along = 0.0;

        for (size_t j = 0; weights && j < run->n; j++) {
            along += row[j] * weights[j] * signs[j];
        }
        sum += weights ? signs[i] * weights[i] * along
                       : signs[i] * cblas_ddot((int)run->n, row, 1, signs, 1);
    }
    return fmax(sum, 0.0);
}

/* Largest of |mean| over its standard error under a flip, along the normal. */
static double farthest_of(const struct flips *f, const double *sum)
{
    double n = (double)f->run->n;
    double farthest = 0.0;

    for (size_t p = 0; p < f->run->points; p++) {
        double rest = f->spread2[p] - sum[p] * sum[p] / n;

        if (rest > 0.0) {
            farthest = fmax(farthest, fabs(sum[p]) / sqrt(n * rest / (n - 1.0)));
        }
    }
    return farthest;
}

static int run_block(void *argument, size_t index, const struct srnf_context *context,
                     struct srnf_error *error)
{
    struct flips *f = argument;
    struct paired_run *run = f->run;
    size_t size = 3 * run->points;
    size_t first = 1 + index * BLOCK;
    size_t left = run->permutations + 1 - first;
    size_t count = left < BLOCK ? left : BLOCK;
    double *memory = srnf_alloc(count, (run->n + size + run->points) * sizeof(double));
    double *signs = memory;
    double *sums = memory ? signs + count * run->n : NULL;
    double *along = memory ? sums + count * size : NULL;

    (void)context;
    (void)error;
    if (!memory) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < count * run->n; k++) {
        signs[k] = sign_of(run, first + k / run->n, k % run->n);
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, (int)size, (int)run->n, 1.0,
                signs, (int)run->n, run->vectors, (int)size, 0.0, sums, (int)size);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)count, (int)run->points,
                (int)run->n, 1.0, signs, (int)run->n, run->along, (int)run->points, 0.0, along,
                (int)run->points);
    for (size_t k = 0; k < count; k++) {
        double largest = 0.0;

        for (size_t p = 0; p < run->points; p++) {
            double t2 = hotelling(f, sums + k * size, p);

            largest = fmax(largest, t2);
            if (stats_as_large(t2, run->out->statistic[p])) {
                atomic_fetch_add_explicit(&f->count[p], 1, memory_order_relaxed);
            }
        }
        f->largest[first + k] = largest;
        f->farthest[first + k - 1] = farthest_of(f, along + k * run->points);
        if (stats_as_large(global_statistic(run, signs + k * run->n), f->observed)) {
            atomic_fetch_add_explicit(&f->global, 1, memory_order_relaxed);
        }
    }
    srnf_free(memory);
    return SRNF_OK;
}

/* ---- Before and after ------------------------------------------------------------------------ */

static int open_flips(struct flips *f)
{
    const struct paired_run *run = f->run;

    f->squares = srnf_alloc(run->points, 6 * sizeof(double));
    f->spread2 = srnf_alloc(run->points, sizeof(double));
    f->largest = srnf_alloc(run->permutations + 1, sizeof(double));
    f->farthest = srnf_alloc(run->permutations, sizeof(double));
    f->count = srnf_alloc(run->points, sizeof *f->count);
    atomic_init(&f->global, 0);
    return f->squares && f->spread2 && f->largest && f->farthest && f->count ? SRNF_OK
                                                                             : SRNF_ENOMEM;
}

static void close_flips(struct flips *f)
{
    srnf_free(f->squares);
    srnf_free(f->spread2);
    srnf_free(f->largest);
    srnf_free(f->farthest);
    srnf_free(f->count);
}

/* Sums of squares, and what the differences are as they were observed: sum [3][P] is scratch. */
static void observe(struct flips *f, double *sum)
{
    struct paired_run *run = f->run;
    struct srnf_paired *out = run->out;
    size_t points = run->points;
    double n = (double)run->n;

    for (size_t i = 0; i < run->n; i++) {
        const double *x = run->vectors + i * 3 * points;
        const double *y = x + points;
        const double *z = y + points;

        for (size_t p = 0; p < points; p++) {
            double *s = f->squares + 6 * p;
            double r = run->along[i * points + p];

            s[0] += x[p] * x[p];
            s[1] += x[p] * y[p];
            s[2] += x[p] * z[p];
            s[3] += y[p] * y[p];
            s[4] += y[p] * z[p];
            s[5] += z[p] * z[p];
            f->spread2[p] += r * r;
        }
        for (size_t k = 0; k < 3 * points; k++) {
            sum[k] += x[k];
        }
    }
    for (size_t p = 0; p < points; p++) {
        double root = run->embedding.root[p];
        double square = 0.0;

        out->statistic[p] = hotelling(f, sum, p);
        f->largest[0] = fmax(f->largest[0], out->statistic[p]);
        for (size_t c = 0; c < 3; c++) {
            double mean = sum[c * points + p] / n;

            square += mean * mean;
            out->normal[p] += root > 0.0 ? run->normal[c * points + p] * mean / root : 0.0;
        }
        out->effect[p] = root > 0.0 ? sqrt(square) / root : 0.0;
        out->standard_error[p] = root > 0.0 ? sqrt(f->spread2[p] / (n * (n - 1.0))) / root : 0.0;
    }
}

static int conclude(struct flips *f)
{
    struct paired_run *run = f->run;
    struct srnf_paired *out = run->out;
    const struct stats_map map = {run->points, run->embedding.root, out->statistic,
                                  out->p,      out->significance,   out->fdr};
    size_t m = run->permutations;
    size_t place = (size_t)ceil(LEVEL * (double)(m + 1)); /* of the m + 1, the observed is 0 */
    double reach;

    stats_sort(m, f->farthest);
    reach = f->farthest[place >= 1 && place <= m ? place - 1 : m - 1];
    for (size_t p = 0; p < run->points; p++) {
        out->confidence[p] = reach * out->standard_error[p];
    }
    out->p_value = (1.0 + (double)atomic_load(&f->global)) / (1.0 + (double)m);
    return stats_map_conclude(&map, m, f->largest, f->count, &out->max_p_value);
}

/* How many flips there are, and whether all are taken. */
static void count_flips(struct paired_run *run)
{
    struct srnf_permutation_test *test = &run->out->test;
    size_t asked = run->options->permutations;

    test->relabellings = ldexp(1.0, (int)run->n - 1);
    test->exact = run->n <= EXACT_SUBJECTS && test->relabellings - 1.0 <= (double)asked;
    test->permutations = test->exact ? (size_t)test->relabellings - 1 : asked;
    test->least = 1.0 / (1.0 + (double)test->permutations);
    run->permutations = test->permutations;
}

int paired_flip(struct paired_run *run, struct stats_progress progress, struct srnf_error *error)
{
    struct flips f = {.run = run};
    double *ones = srnf_alloc(run->n, sizeof(double));
    double *sum = srnf_alloc(3, run->points * sizeof(double));
    int status = SRNF_ENOMEM;

    count_flips(run);
    if (ones && sum) {
        status = open_flips(&f);
    }
    if (status == SRNF_OK) {
        for (size_t i = 0; i < run->n; i++) {
            ones[i] = 1.0;
        }
        f.observed = global_statistic(run, ones);
        run->out->norm = sqrt(f.observed) / (double)run->n;
        observe(&f, sum);
        status = stats_run(run->context, (run->permutations + BLOCK - 1) / BLOCK, run_block, &f,
                           progress, error);
    }
    status = status ? status : conclude(&f);
    close_flips(&f);
    srnf_free(ones);
    srnf_free(sum);
    return status;
}
