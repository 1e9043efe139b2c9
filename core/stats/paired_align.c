/*
 * paired_align.c - the difference of the two surfaces of each subject, after they are registered to
 * each other.
 *
 * Both are registered to the mean of all surfaces already. With a and b the SRNFs as they lie
 * there, and b_a and a_b those of either one registered to the other from there on, the difference
 * is
 *
 *     d = 1/2 ((t b_a - s a) + (t b - s a_b)),
 *
 * s and t the sizes: exchanging the two surfaces gives exactly -d, so that signs are all that an
 * exchange changes. Displacements are made in the same way of the surfaces themselves.
 */
#include "paired.h"

#include <string.h>

struct pair {
    double *memory;
    double *a, *b;    /* coefficients of the surfaces as they lie */
    double *fields;   /* [4][3][P] their SRNFs, a and b, and those registered, b_a and a_b */
    double *embedded; /* [4][3][P] their points, in the same order */
    void *workspace;
};

static int open_pair(const struct paired_run *run, struct pair *pair)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(run->sht));
    size_t size = 3 * run->points;
    size_t embed = stats_embedding_workspace_size(&run->embedding);
    size_t field = srnf_surface_workspace_size(run->sht);

    *pair = (struct pair){.memory = srnf_alloc(2 * count + 8 * size, sizeof(double))};
    pair->workspace = srnf_alloc(1, embed > field ? embed : field);
    if (!pair->memory || !pair->workspace) {
        return SRNF_ENOMEM;
    }
    pair->a = pair->memory;
    pair->b = pair->a + count;
    pair->fields = pair->b + count;
    pair->embedded = pair->fields + 4 * size;
    return SRNF_OK;
}

static void close_pair(struct pair *pair)
{
    srnf_free(pair->memory);
    srnf_free(pair->workspace);
}

/* The surface `moving` registered to `fixed`, as field and embedded `which`. */
static int lay(const struct paired_run *run, struct pair *pair, const double *fixed,
               const double *moving, size_t which, const struct srnf_context *context,
               struct srnf_error *error)
{
    struct srnf_registration registration;
    size_t size = 3 * run->points;
    int status = srnf_register(run->sht, fixed, NULL, moving, run->options->registration, NULL,
                               context, &registration, error);

    if (status < 0) {
        return status;
    }
    memcpy(pair->fields + which * size, registration.q, size * sizeof(double));
    stats_embed(&run->embedding, registration.coefficients, pair->embedded + which * size,
                pair->workspace);
    srnf_registration_clear(&registration);
    return SRNF_OK;
}

static int register_both(const struct paired_run *run, struct pair *pair,
                         const struct srnf_context *context, struct srnf_error *error)
{
    size_t size = 3 * run->points;
    int status;

    if (!run->options->registration) {
        memcpy(pair->fields + 2 * size, pair->fields + size, size * sizeof(double));
        memcpy(pair->fields + 3 * size, pair->fields, size * sizeof(double));
        memcpy(pair->embedded + 2 * size, pair->embedded + size, size * sizeof(double));
        memcpy(pair->embedded + 3 * size, pair->embedded, size * sizeof(double));
        return SRNF_OK;
    }
    status = lay(run, pair, pair->a, pair->b, 2, context, error);
    return status ? status : lay(run, pair, pair->b, pair->a, 3, context, error);
}

/* parts: [3][3][P] */
static void fill_parts(const struct paired_run *run, const struct pair *pair, size_t i,
                       double *parts)
{
    size_t size = 3 * run->points;
    double s = run->pairs->first_size[i];
    double t = run->pairs->second_size[i];
    const double *q = pair->fields;
    const double *v = pair->embedded;

    for (size_t k = 0; k < size; k++) {
        parts[k] =
            0.5 * ((t * q[2 * size + k] - s * q[k]) + (t * q[size + k] - s * q[3 * size + k]));
        parts[size + k] =
            0.5 * ((t * v[2 * size + k] - s * v[k]) + (t * v[size + k] - s * v[3 * size + k]));
        parts[2 * size + k] = 0.5 * (s * v[k] + t * v[size + k]);
    }
}

/* The surface of a field: of surfaces that lie far from the mean only a search from nearby finds
   them. */
static int invert(const struct paired_run *run, const double *q, const double *const *near,
                  size_t i, const struct srnf_context *context, double *coefficients,
                  struct srnf_error *error)
{
    return stats_invert_near(run->sht, q + i * 3 * run->points, near ? near[i] : run->pairs->mean,
                             context, coefficients, error);
}

static int align_one(const struct paired_run *run, size_t i, const struct srnf_context *context,
                     double *parts, struct srnf_error *error)
{
    size_t size = 3 * run->points;
    struct pair pair;
    int status = open_pair(run, &pair);

    status = status
                 ? status
                 : invert(run, run->pairs->first_q, run->pairs->first, i, context, pair.a, error);
    status = status
                 ? status
                 : invert(run, run->pairs->second_q, run->pairs->second, i, context, pair.b, error);
    if (status == SRNF_OK) {
        srnf_field(run->sht, pair.a, pair.fields, pair.workspace);
        srnf_field(run->sht, pair.b, pair.fields + size, pair.workspace);
        stats_embed(&run->embedding, pair.a, pair.embedded, pair.workspace);
        stats_embed(&run->embedding, pair.b, pair.embedded + size, pair.workspace);
        status = register_both(run, &pair, context, error);
    }
    if (status == SRNF_OK) {
        fill_parts(run, &pair, i, parts);
    }
    close_pair(&pair);
    return status;
}

struct loop {
    struct paired_run *run;
    uint64_t series;
};

static int align_body(void *argument, size_t i, const struct srnf_context *context,
                      struct srnf_error *error)
{
    const struct loop *loop = argument;
    struct paired_run *run = loop->run;
    size_t count = 9 * run->points;
    double *parts = run->parts + i * count;
    int status;

    if (stats_recall(run->context, loop->series, i, count, parts)) {
        return SRNF_OK;
    }
    status = align_one(run, i, context, parts, error);
    if (status == SRNF_OK) {
        stats_keep(run->context, loop->series, i, count, parts);
    }
    return status;
}

static uint64_t hash_surfaces(const struct paired_run *run, uint64_t hash,
                              const double *const *surfaces)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(run->sht));

    hash = stats_hash(hash, surfaces != NULL);
    for (size_t i = 0; surfaces && i < run->n; i++) {
        hash = stats_hash_doubles(hash, count, surfaces[i]);
    }
    return hash;
}

static uint64_t series_of(const struct paired_run *run)
{
    const struct srnf_register_options defaults = srnf_register_options_defaults();
    const struct srnf_register_options *registration = run->options->registration;
    const struct srnf_pairs *pairs = run->pairs;
    uint64_t hash = stats_series(run->sht, STATS_KEPT_VISITS, 1, &pairs->mean,
                                 registration ? registration : &defaults);

    hash = stats_hash(hash, registration != NULL);
    hash = stats_hash_doubles(hash, run->n * 3 * run->points, pairs->first_q);
    hash = stats_hash_doubles(hash, run->n * 3 * run->points, pairs->second_q);
    hash = stats_hash_doubles(hash, run->n, pairs->first_size);
    hash = stats_hash_doubles(hash, run->n, pairs->second_size);
    hash = hash_surfaces(run, hash, pairs->first);
    return hash_surfaces(run, hash, pairs->second);
}

int paired_align(struct paired_run *run, struct stats_progress progress, struct srnf_error *error)
{
    struct loop loop = {run, series_of(run)};

    return stats_run(run->context, run->n, align_body, &loop, progress, error);
}
