/*
 * stats.h - what the files of core/stats share: parallel tasks that may fail, fields as vectors.
 *
 * A field is double[3][P] with P = n_theta n_phi; norms and inner products are those of
 * srnf_inner_product. Sums over subjects run in the order of the subjects, whatever thread made the
 * terms: results do not depend on the number of threads.
 */
#ifndef SRNF_STATS_INTERNAL_H
#define SRNF_STATS_INTERNAL_H

#include "internal.h"

/* ---- tasks.c: a parallel loop whose bodies may fail ------------------------------------------ */

/*
 * One body for each index. context: cancellation and clock of the caller, without progress and
 * without a parallel loop of its own; handed on to what the body calls. Returns a status; fills
 * error on failure as srnf_fail does. Warnings count as success.
 */
typedef int stats_body(void *argument, size_t index, const struct srnf_context *context,
                       struct srnf_error *error);

/* How the progress of a loop is told: from `from` to `to`, after each body. message NULL: not. */
struct stats_progress {
    double from, to;
    const char *message;
};

/*
 * Calls body(argument, i) for each i in [0, count) through the context. When some fail, the loop
 * ends early and returns status and error of the lowest index that fails: always the same one.
 * SRNF_ECANCELED when the caller asked to stop before the last body began.
 */
SRNF_CHECKED int stats_run(const struct srnf_context *context, size_t count, stats_body *body,
                           void *argument, struct stats_progress progress,
                           struct srnf_error *error);

/* Fills error from the first failure inside, where that is the one of this status, and returns
   status. */
int stats_fail(struct srnf_error *error, int status, const struct srnf_error *first);

/* ---- exchange.c ------------------------------------------------------------------------------ */

/* How many permutations and draws of a bootstrap are taken: 1 to ten million, 100 to 100,000. */
SRNF_CHECKED int stats_check_draws(size_t permutations, size_t bootstraps,
                                   struct srnf_error *error);

/* ---- covariates.c ---------------------------------------------------------------------------- */

/* A column, [n], as models take it: less the multiple of the constant, or of the lead, that its
   first entry is, so that one far from 0 keeps its digits, and by its largest entry. False, and not
   scaled: to rounding it is that multiple. lead: [n], none 0, or NULL. */
bool stats_center(size_t n, const double *lead, double *column);

/* ---- part.c ---------------------------------------------------------------------------------- */

/* Parts of a computation, one after the other, each with the share of the progress it costs. */
struct stats_part {
    const struct srnf_context *whole;
    double from, to;  /* of the whole, 0 .. 1 */
    double done, all; /* costs of what is over, and of everything */
};
/* The next part begins, of such a cost: the context that it runs in. */
struct srnf_context stats_part_enter(struct stats_part *part, double cost);

/* ---- fields.c: the surfaces of a group and their fields -------------------------------------- */

/* SRNF_EINVAL where there is no surface or a coefficient is not finite. */
SRNF_CHECKED int stats_check_surfaces(const struct srnf_sht *sht, size_t n,
                                      const double *const *surfaces, struct srnf_error *error);
static inline size_t stats_points(const struct srnf_grid *grid)
{
    return grid->n_theta * grid->n_phi;
}
/* q of every surface, double[n][3][P], in parallel. */
SRNF_CHECKED int stats_fields(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                              const struct srnf_context *context, double *q,
                              struct srnf_error *error);
/* The same in another representation. */
SRNF_CHECKED int stats_represent(const struct srnf_sht *sht,
                                 enum srnf_representation representation, size_t n,
                                 const double *const *surfaces, const struct srnf_context *context,
                                 double *q, struct srnf_error *error);
/* Increasing; none may be NaN. sort.c */
void stats_sort(size_t n, double *values);
/* ||a - b||^2 */
double stats_distance2(const struct srnf_grid *grid, const double *a, const double *b);
/* mean = sum of q_i / n, in the order of i. */
void stats_average(const struct srnf_grid *grid, size_t n, const double *q, double *mean);
/* out = sqrt(weight) (q_i - centre), double[n][3][P], whose plain products are those of L2.
   centre NULL: 0. */
void stats_weight(const struct srnf_grid *grid, size_t n, const double *q, const double *centre,
                  double *out);
/* The matrix of products of the n rows of x, double[n][size]. SRNF_EINVAL: one is not finite. */
SRNF_CHECKED int stats_gram(size_t n, size_t size, const double *x, double *gram,
                            struct srnf_error *error);
/* Fills explained from eigenvalues. Where these sum to more than total_variance, which rounding can
   make them, it becomes their sum: no share is above 1. */
void stats_take_shares(struct srnf_pca *pca);
/* Unit vectors of the nodes, double[P][3]. */
void stats_nodes(const struct srnf_grid *grid, double *nodes);

/* ---- embedding.c: registered surfaces as points of a Euclidean space ------------------------- */

struct stats_embedding {
    const struct srnf_sht *sht;
    size_t points;
    double *root; /* [P] root of each node's share of the mean's area */
};

/* mean: double[3][(L+1)^2]. SRNF_EDEGENERATE: it has no area. */
SRNF_CHECKED int stats_embedding_create(const struct srnf_sht *sht, const double *mean,
                                        struct stats_embedding *embedding);
void stats_embedding_clear(struct stats_embedding *embedding);
/* The point of a surface, double[3][P]; workspace: stats_embedding_workspace_size bytes. */
size_t stats_embedding_workspace_size(const struct stats_embedding *embedding);
void stats_embed(const struct stats_embedding *embedding, const double *coefficients,
                 double *vector, void *workspace);
/* Points of n fields, double[n][3][P], in parallel. Their surfaces are searched from the mean
   surface on, or from the near ones, [n], where these are known: from the mean on only surfaces in
   about its pose are found. */
SRNF_CHECKED int stats_embed_fields(const struct stats_embedding *embedding, const double *mean,
                                    const double *const *near, size_t n, const double *q,
                                    const struct srnf_context *context,
                                    struct stats_progress progress, double *vectors,
                                    struct srnf_error *error);
/* The surface whose SRNF comes nearest to q, searched from another. Where q is the SRNF of no
   surface its energy stays positive: that is no failure. */
SRNF_CHECKED int stats_invert_near(const struct srnf_sht *sht, const double *q, const double *start,
                                   const struct srnf_context *context, double *coefficients,
                                   struct srnf_error *error);

/* ---- kept.c ---------------------------------------------------------------------------------- */

/* A digest that grows by what is put to it. */
#define STATS_HASH_START UINT64_C(14695981039346656037)
uint64_t stats_hash(uint64_t hash, uint64_t x);
uint64_t stats_hash_doubles(uint64_t hash, size_t count, const double *x);
/* What a series is of; one of folds has the number of its template in the bits from 8 on, and
   registrations to the start of a mean that start, if it is of choice. */
enum stats_kept {
    STATS_KEPT_DISTANCES = 0,
    STATS_KEPT_ALIGNED = 1,
    STATS_KEPT_PRODUCTS = 2,
    STATS_KEPT_FOLDS = 3,
    STATS_KEPT_SAMPLES = 4,
    STATS_KEPT_NORMS = 5,
    STATS_KEPT_VISITS = 6,
    STATS_KEPT_REGISTERED = 7,
    STATS_KEPT_SPILLED = 8,
    STATS_STATE_MEAN = 9
};
/* The series of what is computed of surfaces so registered, for the two below. what tells apart
   what else is computed of them. */
uint64_t stats_series(const struct srnf_sht *sht, uint64_t what, size_t n,
                      const double *const *surfaces, const struct srnf_register_options *options);
/* Numbers that an earlier attempt has left, all finite; false: there are none, and values are as
   they come. */
bool stats_recall(const struct srnf_context *context, uint64_t series, size_t index, size_t count,
                  double *values);
void stats_keep(const struct srnf_context *context, uint64_t series, size_t index, size_t count,
                const double *values);

/* ---- distances.c, metric.c ------------------------------------------------------------------- */

/* Registered distances (registered.c). */
struct stats_registered {
    const struct srnf_sht *sht;
    size_t n;
    const double *const *surfaces;               /* [n] */
    const struct srnf_register_options *options; /* symmetric */
    uint64_t series;                             /* kept.c */
    size_t held; /* of them, ready for their pairs at a time, two at least; 0: what memory allows */
};
/* Of pairs by their numbers, each once; pairs NULL: the first `count`. matrix: [n][n], of which
   entries (i, j) with i < j are set. */
SRNF_CHECKED int stats_registered_distances(const struct stats_registered *asked, size_t count,
                                            const size_t *pairs, struct stats_progress progress,
                                            const struct srnf_context *context, double *matrix,
                                            struct srnf_error *error);
/* srnf_distances in a representation, whatever the options say of it. */
SRNF_CHECKED int
stats_field_distances(const struct srnf_sht *sht, enum srnf_representation representation, size_t n,
                      const double *const *surfaces, const struct srnf_register_options *options,
                      const struct srnf_context *context, double *matrix, struct srnf_error *error);

/* ---- neighbours.c ---------------------------------------------------------------------------- */

/* What two surfaces are bounded apart by: numbers that neither rotations nor warps change. */
#define STATS_NEIGHBOUR_FEATURES ((size_t)37)
SRNF_CHECKED int stats_neighbour_features(const struct srnf_sht *sht, const double *surface,
                                          double *features);
/* No more than the distance of the two, however registered. */
double stats_neighbour_bound(const double *a, const double *b);

/* ---- mean.c: see mean.h ---------------------------------------------------------------------- */

/* The mean with a start of choice: the index of a subject, or STATS_START_DEFAULT. */
#define STATS_START_DEFAULT SIZE_MAX
SRNF_CHECKED int stats_mean(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                            const struct srnf_mean_options *options, size_t start,
                            const struct srnf_context *context, struct srnf_mean *mean,
                            struct srnf_error *error);

/* ---- sample.c -------------------------------------------------------------------------------- */

/* Philox 4x32 with ten rounds: 128 random bits from a counter and a key. */
void stats_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]);
/* A number below bound from a seed, the number of the drawing and that of the draw in it
   (compare_design.c). */
uint32_t stats_below(uint64_t seed, uint64_t number, uint32_t draw, uint32_t bound);
/* Natural logarithm of x in (0, 1], by additions, multiplications and divisions only: the same bits
   on every machine with IEEE 754 arithmetic. Relative error below 1e-15. */
double stats_log(double x);

#endif
