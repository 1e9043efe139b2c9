/*
 * folds.h - what the files of leave-one-out comparison share: the registrations that all folds
 * start from, and what one fold keeps.
 *
 * A fold leaves out a subject with all of its members. The surfaces are counted by member here; in
 * the plain case a member is a subject.
 *
 * Fields are double[3][P] in blocks, as in stats.h; points of warps are [P][3].
 */
#ifndef SRNF_STATS_FOLDS_H
#define SRNF_STATS_FOLDS_H

#include "stats.h"
#include "subjects.h"
#include "registration/registration.h"

/* All subjects registered to one target (folds_align.c). */
struct alignment {
    const struct srnf_sht *sht;
    const struct srnf_grid *grid;
    const struct srnf_context *context;
    struct srnf_register_options registration;
    size_t n, points, degree, unknowns; /* unknowns of the fields' highest degree */
    const double *const *surfaces;      /* [n] normalized */
    double *nodes, *weight;             /* [P][3], [P] */
    double *q;                          /* [n][3][P] O sqrt(J) q_i(gamma_i) */
    double *gamma, *jacobian;           /* [n][P][3], [n][P] */
    double *rotation;                   /* [n][9] */
    double *matrices;                   /* [n][unknowns^2] Gauss-Newton */
};
SRNF_CHECKED int alignment_create(struct alignment *a, const struct srnf_sht *sht, size_t n,
                                  const double *const *surfaces,
                                  const struct srnf_folds_options *options,
                                  enum srnf_representation representation,
                                  const struct srnf_context *context);
void alignment_clear(struct alignment *a);
/* Fills the matrices; fields: [n][3][P] as parameterized. */
SRNF_CHECKED int alignment_assemble(struct alignment *a, const double *fields,
                                    struct srnf_error *error);
/* Registers all to a field, [3][P], from nothing. series NULL: nothing is kept; otherwise the
   fields of the members are, and only they are filled. */
SRNF_CHECKED int alignment_register(struct alignment *a, const double *field,
                                    const uint64_t *series, struct stats_progress progress,
                                    struct srnf_error *error);
/* Registers all to the mean of their fields, those of the subject left_out not counted (SIZE_MAX:
   of all), from where they are. */
SRNF_CHECKED int alignment_round(struct alignment *a, const struct subjects *subjects,
                                 size_t left_out, const struct srnf_context *context,
                                 struct srnf_error *error);
/* A copy that rounds may change while others read the original: its registrations are its own, all
   else is borrowed. To be cleared in any case. */
SRNF_CHECKED int alignment_copy(const struct alignment *from, struct alignment *to);
void alignment_clear_copy(struct alignment *copy);

/*
 * From the inner products of n fields, double[n][n], what the fold that leaves a subject out knows
 * of them (folds_scores.c).
 *   scores     [out] [n][components]; filled up with 0 beyond the rank
 *   distances  [out] [n][n]: the rows of its members
 * Errors: SRNF_ENOMEM, SRNF_ENUMERIC.
 */
SRNF_CHECKED int fold_describe(const struct subjects *subjects, size_t left_out,
                               const double *products, size_t components, double *scores,
                               double *distances, double *spread);
/* Subjects of several structures, each compared in folds of its own. */
struct folds_sum {
    size_t n_parts;
    const struct srnf_folds *parts;
    const double *weights;
    const double *positions; /* [n][n_parts][3], or NULL */
    double position_weight;
};
/* Their inner products, [n][n]: the sum of the weights times those of the parts
   (srnf_folds.products) and of the positions, as they lie in the fold of a member or, member being
   SIZE_MAX, registered to the medoids of all (folds_join.c). */
void folds_sum_products(const struct folds_sum *sum, size_t member, double *products);
/* Whether the positions of n members, if there are any, and their weight are numbers that count. */
SRNF_CHECKED int folds_check_positions(size_t n, const struct folds_sum *sum,
                                       struct srnf_error *error);
/* Inner products of n fields, double[n][n]. scaled: n times 3 P doubles of scratch. */
void fold_products(const struct srnf_grid *grid, size_t n, const double *q, double *scaled,
                   double *products);

#endif
