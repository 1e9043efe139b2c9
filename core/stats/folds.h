/*
 * folds.h - what the files of leave-one-out comparison share: the registrations that all folds
 * start from, and what one fold keeps.
 *
 * Fields are double[3][P] in blocks, as in stats.h; points of warps are [P][3].
 */
#ifndef SRNF_STATS_FOLDS_H
#define SRNF_STATS_FOLDS_H

#include "stats.h"
#include "shape/registration.h"

/* All subjects registered to the mean of all (folds_align.c). */
struct alignment {
    const struct srnf_sht *sht;
    const struct srnf_grid *grid;
    const struct srnf_context *context;
    struct srnf_register_options registration;
    size_t n, points, degree, unknowns; /* unknowns of the fields' highest degree */
    const double *const *surfaces;      /* [n] normalised */
    double *nodes, *weight;             /* [P][3], [P] */
    double *mean_q;                     /* [3][P] */
    double *q;                          /* [n][3][P] O sqrt(J) q_i(gamma_i) */
    double *gamma, *jacobian;           /* [n][P][3], [n][P] */
    double *rotation;                   /* [n][9] */
    double *matrices; /* [n][unknowns^2] Gauss-Newton, of the last target's norm */
};
SRNF_CHECKED int alignment_create(struct alignment *a, const struct srnf_sht *sht, size_t n,
                                  const double *const *surfaces,
                                  const struct srnf_compare_options *options,
                                  enum srnf_representation representation,
                                  const struct srnf_context *context);
void alignment_clear(struct alignment *a);
/* Rounds of registering all to the mean and averaging. progress: of the whole. */
SRNF_CHECKED int alignment_run(struct alignment *a, size_t rounds, struct stats_progress progress,
                               struct srnf_error *error);
/*
 * Registers subject i to a target from where the alignment has it: at most so many Gauss-Newton
 * steps of the highest degree. q gets the field, [3][P]; points, jacobian and rotation, if not
 * NULL, what made it; they may be those of the alignment. Re-entrant.
 */
SRNF_CHECKED int alignment_refine(const struct alignment *a, size_t i, const struct target *target,
                                  size_t steps, const struct srnf_context *context, double *q,
                                  double *points, double *jacobian, double *rotation);
/* Target with the nodes of the alignment and a field of its own: memory [P][3], filled. */
struct target alignment_target(const struct alignment *a, const double *field, double *memory);

/*
 * From the inner products of n fields, double[n][n], what the fold that leaves one out knows of
 * them (folds_scores.c).
 *   scores     [out] [n][components]; filled up with 0 beyond the rank
 *   distances  [out] [n] of the one left out
 * Errors: SRNF_ENOMEM, SRNF_ENUMERIC.
 */
SRNF_CHECKED int fold_describe(size_t n, size_t left_out, const double *products, size_t components,
                               double *scores, double *distances, double *spread);
/* Inner products of n fields, double[n][n]. scaled: n times 3 P doubles of scratch. */
void fold_products(const struct srnf_grid *grid, size_t n, const double *q, double *scaled,
                   double *products);

#endif
