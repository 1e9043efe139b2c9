/*
 * quality.c - compactness, generalisation and specificity of a linear model (definitions and
 * sources in srnf/groups.h).
 *
 * Subjects and samples are tasks of their own; each writes its own row of distances, and the curves
 * are averages over rows in their order, so that results do not depend on the number of threads.
 *
 * Standard errors: of an average of m distances of samples, their standard deviation over sqrt(m);
 * of members, that of the sums over subjects (srnf/groups.h), which is the same where nobody is
 * repeated. Of the share s = A / (A + B) of the first k eigenvalues, A their sum and B that of the
 * others, with the variance 2 lambda^2 / (S - 1) of each eigenvalue for S subjects, independent of
 * one another, to first order
 *
 *     var s = (B^2 var A + A^2 var B) / (A + B)^4.
 */
#include "quality.h"

#include <cblas.h>
#include <math.h>
#include <string.h>

#define SAMPLES 1000
#define SAMPLES_MAX ((size_t)100000)
#define N_MAX ((size_t)10000)
/* Share of the progress that embedding the subjects takes. */
#define PROGRESS_EMBED 0.1

struct srnf_quality_options srnf_quality_options_defaults(void)
{
    return (struct srnf_quality_options){.samples = SAMPLES};
}

/* ---- A surface that follows a q -------------------------------------------------------------- */

int quality_walk_open(struct quality_walk *walk, const struct quality_run *run)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(run->sht));

    *walk = (struct quality_walk){.run = run};
    walk->q = srnf_alloc(3 * run->points, sizeof(double));
    walk->vector = srnf_alloc(3 * run->points, sizeof(double));
    walk->from = srnf_alloc(count, sizeof(double));
    walk->found = srnf_alloc(count, sizeof(double));
    walk->workspace = srnf_alloc(1, stats_embedding_workspace_size(&run->embedding));
    if (!walk->q || !walk->vector || !walk->from || !walk->found || !walk->workspace) {
        return SRNF_ENOMEM;
    }
    memcpy(walk->found, run->mean, count * sizeof(double));
    return SRNF_OK;
}

void quality_walk_close(struct quality_walk *walk)
{
    srnf_free(walk->q);
    srnf_free(walk->vector);
    srnf_free(walk->from);
    srnf_free(walk->found);
    srnf_free(walk->workspace);
}

int quality_walk_step(struct quality_walk *walk, const struct srnf_context *context,
                      struct srnf_error *error)
{
    double *swap = walk->from;
    int status;

    walk->from = walk->found;
    walk->found = swap;
    status = stats_invert_near(walk->run->sht, walk->q, walk->from, context, walk->found, error);
    if (status == SRNF_OK) {
        stats_embed(&walk->run->embedding, walk->found, walk->vector, walk->workspace);
    }
    return status;
}

double quality_walk_distance(const struct quality_walk *walk, size_t subject)
{
    size_t size = 3 * walk->run->points;
    const double *other = walk->run->vectors + subject * size;
    double sum = 0.0;

    for (size_t k = 0; k < size; k++) {
        double d = walk->vector[k] - other[k];

        sum += d * d;
    }
    return sqrt(sum);
}

/* ---- The run --------------------------------------------------------------------------------- */

static int check(const struct quality_run *run, const struct srnf_quality_options *options,
                 struct srnf_error *error)
{
    if (run->n < 3 || run->n > N_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu surfaces; 3 to %zu are needed", run->n,
                         N_MAX);
    }
    if (options->samples < 2 || options->samples > SAMPLES_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "samples is %zu, not 2 to %zu", options->samples,
                         SAMPLES_MAX);
    }
    return SRNF_OK;
}

/* The most components that every fold has. */
static size_t components_max(const struct quality_run *run)
{
    return run->n - run->subjects.largest - 1;
}

static int find_subjects(struct quality_run *run, const struct srnf_quality_options *options,
                         struct srnf_error *error)
{
    int status = subjects_open(&run->subjects, run->n, options->subjects, error);

    if (status) {
        return status;
    }
    if (run->subjects.count < 3) {
        return srnf_fail(error, SRNF_EINVAL, -1, "surfaces of %zu subjects; three are needed",
                         run->subjects.count);
    }
    if (options->components > components_max(run)) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "components is %zu; without one subject of %zu surfaces there are at most "
                         "%zu",
                         options->components, run->n, components_max(run));
    }
    return SRNF_OK;
}

/* G from the fields, weighted and centred. */
static int fill_gram(struct quality_run *run, struct srnf_error *error)
{
    size_t size = 3 * run->points;
    double *weighted = srnf_alloc(run->n, size * sizeof(double));
    int status = SRNF_ENOMEM;

    if (weighted) {
        stats_weight(run->grid, run->n, run->q, run->mean_q, weighted);
        status = stats_gram(run->n, size, weighted, run->gram, error);
    }
    srnf_free(weighted);
    return status;
}

static int open_run(struct quality_run *run, const struct srnf_context *context,
                    struct stats_progress progress, struct srnf_error *error)
{
    size_t all;
    int status;

    if (__builtin_mul_overflow(run->n, 3 * run->points, &all)) {
        return SRNF_ENOMEM;
    }
    run->gram = srnf_alloc(run->n, run->n * sizeof(double));
    run->vectors = srnf_alloc(all, sizeof(double));
    if (!run->gram || !run->vectors) {
        return SRNF_ENOMEM;
    }
    status = fill_gram(run, error);
    status = status ? status : stats_embedding_create(run->sht, run->mean, &run->embedding);
    return status ? status
                  : stats_embed_fields(&run->embedding, run->mean, NULL, run->n, run->q, context,
                                       progress, run->vectors, error);
}

static void close_run(struct quality_run *run)
{
    srnf_free(run->gram);
    srnf_free(run->vectors);
    subjects_clear(&run->subjects);
    stats_embedding_clear(&run->embedding);
}

/* ---- Curves ---------------------------------------------------------------------------------- */

static int open_curve(struct srnf_curve *curve, size_t components)
{
    curve->value = srnf_alloc(components, sizeof(double));
    curve->standard_error = srnf_alloc(components, sizeof(double));
    return curve->value && curve->standard_error ? SRNF_OK : SRNF_ENOMEM;
}

static void close_curve(struct srnf_curve *curve)
{
    srnf_free(curve->value);
    srnf_free(curve->standard_error);
}

static int open_quality(struct srnf_quality *quality, size_t n, size_t components)
{
    struct srnf_curve *curves[] = {&quality->compactness, &quality->generalisation,
                                   &quality->specificity, &quality->generalisation_elastic,
                                   &quality->specificity_elastic};
    int status = SRNF_OK;

    quality->n = n;
    quality->components = components;
    for (size_t i = 0; i < sizeof curves / sizeof curves[0] && status == SRNF_OK; i++) {
        status = open_curve(curves[i], components);
    }
    return status;
}

void srnf_quality_clear(struct srnf_quality *quality)
{
    close_curve(&quality->compactness);
    close_curve(&quality->generalisation);
    close_curve(&quality->specificity);
    close_curve(&quality->generalisation_elastic);
    close_curve(&quality->specificity_elastic);
    *quality = (struct srnf_quality){0};
}

/* Averages of the columns of rows [m][components], and their standard errors. subjects: whose rows
   they are, NULL: all independent. */
static void average(const double *rows, size_t m, size_t components,
                    const struct subjects *subjects, struct srnf_curve *curve)
{
    size_t groups = subjects ? subjects->count : m;

    for (size_t k = 0; k < components; k++) {
        double mean = 0.0;
        double square = 0.0;

        for (size_t i = 0; i < m; i++) {
            mean += rows[i * components + k] / (double)m;
        }
        for (size_t g = 0; g < groups; g++) {
            size_t end = subjects ? subjects->start[g + 1] : g + 1;
            double d = 0.0;

            for (size_t j = subjects ? subjects->start[g] : g; j < end; j++) {
                d += rows[(subjects ? subjects->members[j] : j) * components + k] - mean;
            }
            square += d * d;
        }
        curve->value[k] = mean;
        curve->standard_error[k] = sqrt(square * (double)groups / (double)(groups - 1)) / (double)m;
    }
}

static void fill_compactness(const struct quality_run *run, const struct srnf_pca *pca,
                             struct srnf_curve *curve)
{
    double degrees = (double)(run->n - 1);
    double independent = (double)(run->subjects.count - 1);
    double all = pca->total_variance;
    double squares = 0.0; /* sum of the squares of all eigenvalues: the square of |G| */
    double share = 0.0;
    double first = 0.0;

    for (size_t k = 0; k < run->n * run->n; k++) {
        squares += run->gram[k] / degrees * (run->gram[k] / degrees);
    }
    for (size_t k = 0; k < run->components; k++) {
        double a;
        double b;

        share += pca->eigenvalues[k] / all;
        first += pca->eigenvalues[k] * pca->eigenvalues[k];
        a = 2.0 * first / independent;
        b = 2.0 * fmax(squares - first, 0.0) / independent;
        curve->value[k] = fmin(share, 1.0);
        curve->standard_error[k] =
            sqrt((1.0 - curve->value[k]) * (1.0 - curve->value[k]) * a + share * share * b) / all;
    }
}

/* ---- Generalisation and specificity ---------------------------------------------------------- */

struct rows {
    const struct quality_run *run;
    const struct srnf_pca *pca;
    const double *scores; /* [samples][components] */
    double *surface, *elastic;
    const struct srnf_context *context; /* of the caller */
    uint64_t series;                    /* of what is kept of the rows; see keep_row */
    stats_body *body;
};

static struct quality_distances row(const struct rows *rows, size_t i)
{
    size_t first = i * rows->run->components;

    return (struct quality_distances){rows->surface + first, rows->elastic + first};
}

static int leave_out(void *argument, size_t i, const struct srnf_context *context,
                     struct srnf_error *error)
{
    struct rows *rows = argument;

    return quality_fold(rows->run, i, context, row(rows, i), error);
}

/* Square of the elastic distance between subject i and a sample of k components. */
static double elastic_distance2(const struct rows *rows, size_t i, const double *scores, size_t k)
{
    size_t components = rows->run->components;
    const double *own = rows->pca->scores + i * components;
    double sum = rows->run->gram[i * rows->run->n + i];

    for (size_t j = 0; j < components; j++) {
        double d = (j < k ? scores[j] : 0.0) - own[j];

        sum += d * d - own[j] * own[j];
    }
    return fmax(sum, 0.0);
}

static int measure_sample(void *argument, size_t s, const struct srnf_context *context,
                          struct srnf_error *error)
{
    struct rows *rows = argument;
    const struct quality_run *run = rows->run;
    const double *scores = rows->scores + s * run->components;
    struct quality_distances out = row(rows, s);
    struct quality_walk walk;
    int status = quality_walk_open(&walk, run);

    if (status == SRNF_OK) {
        memcpy(walk.q, run->mean_q, 3 * run->points * sizeof(double));
    }
    for (size_t k = 0; k < run->components && status == SRNF_OK; k++) {
        cblas_daxpy((int)(3 * run->points), scores[k], rows->pca->modes + k * 3 * run->points, 1,
                    walk.q, 1);
        status = quality_walk_step(&walk, context, error);
        out.surface[k] = out.elastic[k] = INFINITY;
        for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
            out.surface[k] = fmin(out.surface[k], quality_walk_distance(&walk, i));
            out.elastic[k] = fmin(out.elastic[k], sqrt(elastic_distance2(rows, i, scores, k + 1)));
        }
    }
    quality_walk_close(&walk);
    return status;
}

/* What the rows of an attempt are of: everything that enters. */
static uint64_t series_of(const struct rows *rows, size_t count, enum stats_kept what)
{
    const struct quality_run *run = rows->run;
    size_t coefficients = 3 * srnf_coefficient_count(srnf_sht_degree(run->sht));
    uint64_t hash = stats_hash(STATS_HASH_START, what);

    if (!rows->context || (!rows->context->recall && !rows->context->keep)) {
        return hash;
    }
    hash = stats_hash(hash, count);
    hash = stats_hash(hash, run->components);
    hash = stats_hash(hash, run->points);
    for (size_t i = 0; i < run->n; i++) {
        hash = stats_hash(hash, run->subjects.of[i]);
    }
    hash = stats_hash_doubles(hash, coefficients, run->mean);
    hash = stats_hash_doubles(hash, 3 * run->points, run->mean_q);
    hash = stats_hash_doubles(hash, run->n * 3 * run->points, run->q);
    return what == STATS_KEPT_SAMPLES
               ? stats_hash_doubles(hash, count * run->components, rows->scores)
               : hash;
}

/* A row, that of an earlier attempt if there is one: [2][components] are kept. */
static int keep_row(void *argument, size_t i, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct rows *rows = argument;
    size_t components = rows->run->components;
    struct quality_distances out = row(rows, i);
    double *both = srnf_alloc(2 * components, sizeof(double));
    int status = both ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK && stats_recall(context, rows->series, i, 2 * components, both)) {
        memcpy(out.surface, both, components * sizeof(double));
        memcpy(out.elastic, both + components, components * sizeof(double));
    } else if (status == SRNF_OK) {
        status = rows->body(argument, i, context, error);
        memcpy(both, out.surface, components * sizeof(double));
        memcpy(both + components, out.elastic, components * sizeof(double));
        if (status >= 0) {
            stats_keep(context, rows->series, i, 2 * components, both);
        }
    }
    srnf_free(both);
    return status;
}

/* Distances of `count` subjects or samples, and the two curves that are their averages. */
static int measure(struct rows *rows, size_t count, const struct subjects *subjects,
                   enum stats_kept what, struct stats_progress progress, struct srnf_curve *surface,
                   struct srnf_curve *elastic, struct srnf_error *error)
{
    size_t components = rows->run->components;
    int status = SRNF_ENOMEM;

    rows->surface = srnf_alloc(count, components * sizeof(double));
    rows->elastic = srnf_alloc(count, components * sizeof(double));
    if (rows->surface && rows->elastic) {
        rows->series = series_of(rows, count, what);
        rows->body = what == STATS_KEPT_SAMPLES ? measure_sample : leave_out;
        status = stats_run(rows->context, count, keep_row, rows, progress, error);
    }
    if (status == SRNF_OK) {
        average(rows->surface, count, components, subjects, surface);
        average(rows->elastic, count, components, subjects, elastic);
    }
    srnf_free(rows->surface);
    srnf_free(rows->elastic);
    return status;
}

static int judge(struct quality_run *run, const struct srnf_quality_options *options,
                 struct srnf_pca *pca, const struct srnf_context *context,
                 struct srnf_quality *quality, struct srnf_error *error)
{
    double work = (double)run->n + (double)options->samples;
    double middle = PROGRESS_EMBED + (1.0 - PROGRESS_EMBED) * (double)run->n / work;
    double *scores = srnf_alloc(options->samples, run->components * sizeof(double));
    struct rows rows = {.run = run, .pca = pca, .scores = scores, .context = context};
    int status = scores ? open_quality(quality, run->n, run->components) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        fill_compactness(run, pca, &quality->compactness);
        srnf_pca_sample(pca, options->seed, options->samples, run->components, scores);
        status = measure(&rows, run->n, &run->subjects, STATS_KEPT_FOLDS,
                         (struct stats_progress){PROGRESS_EMBED, middle, "leaving one out"},
                         &quality->generalisation, &quality->generalisation_elastic, error);
    }
    if (status == SRNF_OK) {
        status = measure(&rows, options->samples, NULL, STATS_KEPT_SAMPLES,
                         (struct stats_progress){middle, 1.0, "measuring samples"},
                         &quality->specificity, &quality->specificity_elastic, error);
    }
    srnf_free(scores);
    return status;
}

int srnf_model_quality(const struct srnf_sht *sht, size_t n, const double *mean,
                       const double *mean_q, const double *registered_q,
                       const struct srnf_quality_options *options,
                       const struct srnf_context *context, struct srnf_quality *quality,
                       struct srnf_error *error)
{
    struct srnf_quality_options defaults = srnf_quality_options_defaults();
    struct quality_run run = {.sht = sht,
                              .grid = srnf_sht_grid(sht),
                              .n = n,
                              .points = stats_points(srnf_sht_grid(sht)),
                              .mean = mean,
                              .mean_q = mean_q,
                              .q = registered_q};
    struct srnf_pca pca = {0};
    struct srnf_quality found = {0};
    struct srnf_error first = {0};
    int status;

    options = options ? options : &defaults;
    status = check(&run, options, &first);
    status = status ? status : find_subjects(&run, options, &first);
    if (status == SRNF_OK) {
        found.subjects = run.subjects.count;
        status = srnf_pca_fit_within(
            run.grid, n, mean_q, registered_q,
            options->components ? options->components : components_max(&run), context, &pca);
    }
    if (status == SRNF_OK && pca.components == 0) {
        status = srnf_fail(&first, SRNF_EDEGENERATE, -1, "the surfaces do not differ");
    }
    if (status == SRNF_OK) {
        run.components = pca.components;
        status = open_run(&run, context,
                          (struct stats_progress){0.0, PROGRESS_EMBED, "inverting the subjects"},
                          &first);
    }
    status = status ? status : judge(&run, options, &pca, context, &found, &first);
    close_run(&run);
    srnf_pca_clear(&pca);
    if (status) {
        srnf_quality_clear(&found);
        return stats_fail(error, status, &first);
    }
    *quality = found;
    return SRNF_OK;
}
