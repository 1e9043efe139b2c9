/*
 * folds.c - each subject of a cohort compared with all others, in a fold of its own that it was
 * left out of with all its members: options, normalization, and the loop over folds.
 *
 * Metrics with a registration. Nothing of the subject left out may shape what the others are
 * compared by. So the template of a fold is the medoid of its training members, by distances as
 * parameterized: one of them. A registration to it depends on these two surfaces and nothing else,
 * so folds with the same template share it without a trace of each other's subjects; there are few
 * templates, as leaving out one of many subjects rarely changes the medoid, and the medoid's own
 * fold has the runner-up of another subject. Each further round, where more than one is asked for,
 * takes the mean of the fold's training members as the target and registers everybody to it, those
 * left out by the same steps as the others. Means, components and distances are then those of
 * folds_scores.c. The members of a subject share all of that.
 *
 * Started from the mean of all instead, a fold keeps most of what the subject left out had done to
 * it, however many steps it takes to its own mean: the joint optimum over all warps is so flat.
 *
 * Other metrics are one matrix of distances for all folds.
 *
 * Of one round, what a template costs is kept for a later attempt (srnf_context.keep): the field of
 * each member as it is registered, and the inner products when all are, which take their place.
 *
 * Folds run in parallel, each with registrations of its own: 80 n P bytes.
 */
#include "folds.h"

#include <math.h>
#include <string.h>

#define ROUNDS 1
#define ROUNDS_MAX 20
#define COMPONENTS 20
#define COMPONENTS_MAX 64
#define N_MAX ((size_t)5000)

/* Of the progress of a template. */
#define PART_TEMPLATE 0.5

struct srnf_folds_options srnf_folds_options_defaults(void)
{
    return (struct srnf_folds_options){.registration = srnf_register_options_defaults(),
                                       .rounds = ROUNDS,
                                       .refit = SRNF_REFIT_FOLD,
                                       .max_components = COMPONENTS};
}

void srnf_folds_clear(struct srnf_folds *c)
{
    srnf_free(c->scores);
    srnf_free(c->distances);
    srnf_free(c->spread);
    srnf_free(c->subjects);
    srnf_free(c->templates);
    for (size_t t = 0; c->products && t < c->n; t++) {
        srnf_free(c->products[t]);
    }
    srnf_free(c->products);
    srnf_free(c->registered);
    *c = (struct srnf_folds){0};
}

static int check(size_t n, const struct srnf_folds_options *options, struct srnf_error *error)
{
    if (n < 3 || n > N_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu surfaces are not 3 to %zu", n, N_MAX);
    }
    if (options->rounds == 0 || options->rounds > ROUNDS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "rounds is %zu, not 1 to %d", options->rounds,
                         ROUNDS_MAX);
    }
    if (options->max_components == 0 || options->max_components > COMPONENTS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "max_components is %zu, not 1 to %d",
                         options->max_components, COMPONENTS_MAX);
    }
    if (!options->registration.reparameterization || options->registration.exact) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "a comparison reparameterizes, and not in exact mode");
    }
    if (options->keep && (options->rounds != 1 || options->refit != SRNF_REFIT_FOLD)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "what is kept is of one round, refitted");
    }
    return SRNF_OK;
}

/* ---- Normalized surfaces --------------------------------------------------------------------- */

struct cohort {
    const struct srnf_sht *sht;
    const double *const *given;
    size_t count;
    double *memory;
    const double **surfaces; /* [n] into memory */
};

static int normalize_body(void *argument, size_t i, const struct srnf_context *context,
                          struct srnf_error *error)
{
    struct cohort *cohort = argument;
    double *f = cohort->memory + i * cohort->count;
    int status = srnf_normalize(cohort->sht, cohort->given[i], f, NULL);

    (void)context;
    cohort->surfaces[i] = f;
    return status
               ? srnf_fail(error, status, (int64_t)i, "surface %zu: %s", i, srnf_strerror(status))
               : SRNF_OK;
}

static int normalize_all(struct cohort *cohort, size_t n, const struct srnf_context *context,
                         struct srnf_error *error)
{
    cohort->memory = srnf_alloc(n, cohort->count * sizeof(double));
    cohort->surfaces = srnf_alloc(n, sizeof *cohort->surfaces);
    if (!cohort->memory || !cohort->surfaces) {
        return SRNF_ENOMEM;
    }
    return stats_run(context, n, normalize_body, cohort, (struct stats_progress){0}, error);
}

/* ---- Folds with a registration --------------------------------------------------------------- */

struct folds {
    const struct alignment *a;
    const struct subjects *subjects;
    size_t rounds;
    const double *shared; /* [n][n] inner products of fields that all folds share, or NULL */
    const size_t *list;   /* of the subjects whose folds have one template */
    struct srnf_folds *out;
};

static int products_of(const struct alignment *a, double *products)
{
    double *scaled = srnf_alloc(a->n, 3 * a->points * sizeof(double));

    if (!scaled) {
        return SRNF_ENOMEM;
    }
    fold_products(a->grid, a->n, a->q, scaled, products);
    srnf_free(scaled);
    return SRNF_OK;
}

/* The rounds of one fold, and the inner products they lead to. */
static int refit(const struct folds *folds, size_t left_out, const struct srnf_context *context,
                 double *products, struct srnf_error *error)
{
    struct alignment own;
    int status = alignment_copy(folds->a, &own);

    for (size_t k = 1; k < folds->rounds && status == SRNF_OK; k++) {
        status = alignment_round(&own, folds->subjects, left_out, context, error);
    }
    status = status ? status : products_of(&own, products);
    alignment_clear_copy(&own);
    return status;
}

static int fold_body(void *argument, size_t index, const struct srnf_context *context,
                     struct srnf_error *error)
{
    struct folds *folds = argument;
    const struct subjects *subjects = folds->subjects;
    struct srnf_folds *out = folds->out;
    size_t n = out->n;
    size_t left_out = folds->list[index];
    size_t first = subjects->members[subjects->start[left_out]];
    size_t size = n * out->components;
    double *products = folds->shared ? NULL : srnf_alloc(n, n * sizeof(double));
    int status = folds->shared || products ? SRNF_OK : SRNF_ENOMEM;

    if (products) {
        status = refit(folds, left_out, context, products, error);
    }
    if (status == SRNF_OK) {
        status =
            fold_describe(subjects, left_out, products ? products : folds->shared, out->components,
                          out->scores + first * size, out->distances, out->spread + first);
    }
    for (size_t m = 1; m < subjects->size[left_out] && status == SRNF_OK; m++) {
        size_t i = subjects->members[subjects->start[left_out] + m];

        memcpy(out->scores + i * size, out->scores + first * size, size * sizeof(double));
        out->spread[i] = out->spread[first];
    }
    srnf_free(products);
    return status;
}

/* The inner products of all registered to template number t, of a comparison of one round: they are
   all that its folds need, unless the fields are asked for. An earlier attempt may have left them,
   or some of the fields. */
static int register_once(struct alignment *a, size_t t, const double *field, bool fields,
                         struct stats_progress progress, double *products, struct srnf_error *error)
{
    uint64_t aligned;
    uint64_t series;
    int status;

    if (!a->context || (!a->context->recall && !a->context->keep)) {
        status = alignment_register(a, field, NULL, progress, error);
        return status ? status : products_of(a, products);
    }
    series = stats_series(a->sht, STATS_KEPT_PRODUCTS | (uint64_t)t << 8, a->n, a->surfaces,
                          &a->registration);
    aligned = stats_series(a->sht, STATS_KEPT_ALIGNED | (uint64_t)t << 8, a->n, a->surfaces,
                           &a->registration);
    if (!fields && stats_recall(a->context, series, 0, a->n * a->n, products)) {
        srnf_report_progress(a->context, progress.to, progress.message);
        return SRNF_OK;
    }
    status = alignment_register(a, field, &aligned, progress, error);
    status = status ? status : products_of(a, products);
    if (status == SRNF_OK && !fields) {
        stats_keep(a->context, aligned, 0, 0, NULL);
        stats_keep(a->context, series, 0, a->n * a->n, products);
    }
    return status;
}

/* Registers all to template number t and describes its folds. */
static int run_template(struct alignment *a, const struct subjects *subjects, size_t t,
                        const double *field, const struct srnf_folds_options *options,
                        const size_t *list, size_t count, struct stats_progress progress,
                        struct srnf_folds *out, struct srnf_error *error)
{
    bool shared = options->refit == SRNF_REFIT_SHARED || options->rounds == 1;
    double *products = shared ? srnf_alloc(a->n, a->n * sizeof(double)) : NULL;
    struct folds folds = {a, subjects, options->rounds, products, list, out};
    double middle = progress.from + PART_TEMPLATE * (progress.to - progress.from);
    struct stats_progress first = {progress.from, middle, "registering to the template"};
    struct stats_progress rest = {middle, progress.to, "refitting the folds"};
    int status = shared && !products ? SRNF_ENOMEM : SRNF_OK;

    if (options->rounds == 1) {
        bool fields = options->keep && t == out->medoid;

        status = status ? status : register_once(a, t, field, fields, first, products, error);
        if (fields && status == SRNF_OK) {
            memcpy(out->registered, a->q, 3 * a->n * a->points * sizeof(double));
        }
    } else {
        status = status ? status : alignment_register(a, field, NULL, first, error);
        for (size_t k = 1; k < options->rounds && shared && status == SRNF_OK; k++) {
            status = alignment_round(a, subjects, SIZE_MAX, a->context, error);
        }
        if (shared && status == SRNF_OK) {
            status = products_of(a, products);
        }
    }
    status = status ? status : stats_run(a->context, count, fold_body, &folds, rest, error);
    if (options->keep) {
        out->products[t] = products;
        products = NULL;
    }
    srnf_free(products);
    return status;
}

/* The member with the least sum of distances to all but a subject's; SIZE_MAX leaves none out. */
static size_t find_medoid(const struct subjects *subjects, const double *products, size_t left_out)
{
    const size_t *of = subjects->of;
    size_t n = subjects->n;
    size_t best = SIZE_MAX;
    double least = INFINITY;

    for (size_t a = 0; a < n; a++) {
        double sum = 0.0;

        for (size_t b = 0; b < n && of[a] != left_out; b++) {
            double d2 = products[a * n + a] + products[b * n + b] - 2.0 * products[a * n + b];

            sum += of[b] == left_out ? 0.0 : sqrt(fmax(0.0, d2));
        }
        if (of[a] != left_out && sum < least) {
            least = sum;
            best = a;
        }
    }
    return best;
}

/* Template by template: the subjects whose folds have it, in order. templates: [subjects], list:
   the same size of scratch. */
static int run_templates(struct alignment *a, const struct subjects *subjects, const double *fields,
                         const struct srnf_folds_options *options, const size_t *templates,
                         size_t *list, struct srnf_folds *out, struct srnf_error *error)
{
    double all = (double)subjects->count;
    size_t done = 0;
    int status = SRNF_OK;

    for (size_t t = 0; t < a->n && status == SRNF_OK; t++) {
        size_t count = 0;
        struct stats_progress progress;

        for (size_t k = 0; k < subjects->count; k++) {
            if (templates[k] == t) {
                list[count++] = k;
            }
        }
        if (count > 0 || (options->keep && t == out->medoid)) {
            progress =
                (struct stats_progress){(double)done / all, (double)(done + count) / all, NULL};
            status = run_template(a, subjects, t, fields + 3 * t * a->points, options, list, count,
                                  progress, out, error);
            done += count;
        }
    }
    return status;
}

/* Room for what is kept; templates: [subjects]. */
static int open_kept(const struct subjects *subjects, const size_t *templates, size_t points,
                     struct srnf_folds *out)
{
    size_t n = out->n;

    out->templates = srnf_alloc(n, sizeof *out->templates);
    out->products = srnf_alloc(n, sizeof *out->products);
    out->registered = srnf_alloc(n, 3 * points * sizeof(double));
    if (!out->templates || !out->products || !out->registered) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        out->templates[i] = templates[subjects->of[i]];
    }
    return SRNF_OK;
}

static int compare_registered(const struct srnf_sht *sht, enum srnf_representation representation,
                              const struct subjects *subjects, const double *const *surfaces,
                              const struct srnf_folds_options *options,
                              const struct srnf_context *context, struct srnf_folds *out,
                              struct srnf_error *error)
{
    size_t n = out->n;
    size_t most = n - subjects->largest - 1; /* components that the fewest training members have */
    struct alignment a;
    double *fields = NULL; /* as parameterized */
    double *products = srnf_alloc(n, n * sizeof(double));
    size_t *templates = srnf_alloc(n, 2 * sizeof *templates);
    int status = alignment_create(&a, sht, n, surfaces, options, representation, context);

    out->components = options->max_components < most ? options->max_components : most;
    out->scores = srnf_alloc(n * n, out->components * sizeof(double));
    fields = srnf_alloc(n, 3 * a.points * sizeof(double));
    if (status == SRNF_OK && (!out->scores || !fields || !products || !templates)) {
        status = SRNF_ENOMEM;
    }
    status =
        status ? status : stats_represent(sht, representation, n, surfaces, context, fields, error);
    if (status == SRNF_OK) {
        memcpy(a.q, fields, 3 * n * a.points * sizeof(double));
        status = products_of(&a, products);
    }
    if (options->rounds > 1) {
        status = status ? status : alignment_assemble(&a, fields, error);
    }
    if (status == SRNF_OK) {
        for (size_t k = 0; k < subjects->count; k++) {
            templates[k] =
                find_medoid(subjects, products, options->refit == SRNF_REFIT_SHARED ? SIZE_MAX : k);
        }
        out->medoid = find_medoid(subjects, products, SIZE_MAX);
        status = options->keep ? open_kept(subjects, templates, a.points, out) : SRNF_OK;
    }
    if (status == SRNF_OK) {
        status = run_templates(&a, subjects, fields, options, templates, templates + n, out, error);
    }
    srnf_free(templates);
    srnf_free(products);
    srnf_free(fields);
    alignment_clear(&a);
    return status;
}

/* ---- Folds that read a matrix ---------------------------------------------------------------- */

static void fill_spread(const struct subjects *subjects, struct srnf_folds *c)
{
    const size_t *of = subjects->of;

    for (size_t i = 0; i < c->n; i++) {
        size_t t = c->n - subjects->size[of[i]];
        double sum = 0.0;

        for (size_t a = 0; a < c->n; a++) {
            for (size_t b = 0; b < a && of[a] != of[i]; b++) {
                double d = c->distances[a * c->n + b];

                sum += of[b] == of[i] ? 0.0 : d * d;
            }
        }
        c->spread[i] = sqrt(2.0 * sum / (double)(t * (t - 1)));
    }
}

/* Who belongs together, also for what reads the comparison. */
static int find_subjects(size_t n, const size_t *given, struct subjects *subjects,
                         struct srnf_folds *comparison, struct srnf_error *error)
{
    int status = subjects_open(subjects, n, given, error);

    if (status) {
        return status;
    }
    if (subjects->count < 3) {
        return srnf_fail(error, SRNF_EINVAL, -1, "surfaces of %zu subjects; 3 are needed at least",
                         subjects->count);
    }
    if (given) {
        comparison->subjects = srnf_alloc(n, sizeof *comparison->subjects);
        if (!comparison->subjects) {
            return SRNF_ENOMEM;
        }
        memcpy(comparison->subjects, subjects->of, n * sizeof *subjects->of);
    }
    return SRNF_OK;
}

int srnf_folds_compare(const struct srnf_sht *sht, enum srnf_metric metric, size_t n,
                       const double *const *surfaces, const struct srnf_folds_options *options,
                       const struct srnf_context *context, struct srnf_folds *comparison,
                       struct srnf_error *error)
{
    struct srnf_folds_options defaults = srnf_folds_options_defaults();
    struct srnf_error first = {0};
    struct subjects subjects = {0};
    struct cohort cohort = {
        .sht = sht, .given = surfaces, .count = 3 * srnf_coefficient_count(srnf_sht_degree(sht))};
    int status;

    options = options ? options : &defaults;
    *comparison = (struct srnf_folds){.n = n};
    status = check(n, options, &first);
    status = status ? status : stats_check_surfaces(sht, n, surfaces, &first);
    if (status == SRNF_OK) {
        status = find_subjects(n, options->subjects, &subjects, comparison, &first);
    }
    if (status) {
        goto out;
    }
    comparison->distances = srnf_alloc(n, n * sizeof(double));
    comparison->spread = srnf_alloc(n, sizeof(double));
    status = comparison->distances && comparison->spread ? SRNF_OK : SRNF_ENOMEM;
    status = status ? status : normalize_all(&cohort, n, context, &first);
    if (status) {
        goto out;
    }
    if (metric == SRNF_METRIC_SRNF || metric == SRNF_METRIC_SRM) {
        status = compare_registered(
            sht, metric == SRNF_METRIC_SRM ? SRNF_REPRESENTATION_SRM : SRNF_REPRESENTATION_SRNF,
            &subjects, cohort.surfaces, options, context, comparison, &first);
    } else {
        status = srnf_metric_distances(sht, metric, n, cohort.surfaces, &options->registration,
                                       context, comparison->distances, &first);
        fill_spread(&subjects, comparison);
    }
out:
    srnf_free(cohort.memory);
    srnf_free(cohort.surfaces);
    subjects_clear(&subjects);
    if (status) {
        bool explained = first.status == status;

        (void)srnf_fail(error, status, explained ? first.element : -1, "%s",
                        explained ? first.message : srnf_strerror(status));
        srnf_folds_clear(comparison);
    }
    return status;
}
