/*
 * regress.h - what the files of the linear models of shape share.
 */
#ifndef SRNF_STATS_REGRESS_H
#define SRNF_STATS_REGRESS_H

#include "compare.h"
#include "maps.h"

#define REGRESS_DIMENSIONS 3 /* of a displacement, whose covariance must be regular */

/* ---- regress_design.c ------------------------------------------------------------------------ */

/* An orthonormal basis of columns, the constant first, or a `lead`, [n], in its place: where
   subjects have weights, rows and data are multiplied by their roots; the constant becomes them. */
struct regress_basis {
    size_t n, count;
    double *vectors; /* [count][n] */
};

/* A nested pair: the first `reduced` vectors span the smaller model, all of them the larger. */
struct regress_model {
    struct regress_basis basis;
    size_t reduced, tested;
};
/* SRNF_EINVAL with a sentence: nothing is left to test, or too few subjects. number: of the test.
   Cleared in any case. */
SRNF_CHECKED int regress_model_create(struct regress_model *model, size_t n, const double *lead,
                                      const struct srnf_nested *nested, size_t number,
                                      struct srnf_error *error);
void regress_model_clear(struct regress_model *model);
static inline size_t regress_model_freedom(const struct regress_model *model)
{
    return model->basis.n - model->basis.count;
}

/* The whole model. */
struct regress_fit {
    struct regress_basis basis;
    double *weights; /* [count][n]: coefficient k is the sum of weights[k][i] y_i */
};
/* SRNF_EINVAL: a column follows, element is its number. Cleared in any case. */
SRNF_CHECKED int regress_fit_create(struct regress_fit *fit, size_t n, const double *lead,
                                    size_t columns, const double *values, struct srnf_error *error);
void regress_fit_clear(struct regress_fit *fit);
/* Takes the first `count` vectors of the basis out of v. */
void regress_reduce(const struct regress_basis *basis, size_t count, double *v);

/* ---- The run --------------------------------------------------------------------------------- */

struct regress_run {
    const struct srnf_sht *sht;
    size_t n, points; /* subjects, nodes */
    size_t permutations, bootstraps;
    uint64_t seed;
    const struct srnf_context *context;
    const struct srnf_regress_design *design;
    const double *lead;        /* [n] roots of the subjects' weights, or NULL */
    const double *values;      /* [n][columns] of subjects */
    const double *q;           /* [n][3][P] of subjects */
    const double *const *near; /* [n] surfaces to search from, or NULL */
    struct regress_fit fit;
    struct regress_model *models; /* [tests] */
    struct exchange exchange;
    struct stats_embedding embedding;
    double *gram;    /* [n][n] of centred SRNFs */
    double *vectors; /* [n][3][P] centred displacements times the roots of the areas */
    double *along;   /* [n][P] displacements along the mean's normal */
    double total;    /* trace of gram */
    bool embedded; /* vectors are given: displacements, not centred yet; else they are made of q */
    bool no_surfaces; /* q is none of surfaces: predictions have no coefficients */
    struct srnf_regression *out;
};

/* regress.c: all of `out`, of subjects, whose rows and data are multiplied by the roots of their
   weights already. Of the run are set all numbers, sht, context, design without its values, lead,
   values, q and out; and embedded with vectors, which the run then owns. nested: [tests].
   regress_close in any case. */
SRNF_CHECKED int regress_compute(struct regress_run *run, const double *mean,
                                 const struct srnf_nested *nested, struct srnf_error *error);
void regress_close(struct regress_run *run);

/* The nested models, of subjects: their columns averaged over members. nested, memory: [tests];
   memory to be freed, also on failure. */
SRNF_CHECKED int regress_average_nested(const struct srnf_regress_design *design,
                                        const struct subjects *subjects, struct srnf_nested *nested,
                                        double **memory);

/* regress_permute.c: the permutations of one test. */
SRNF_CHECKED int regress_permute(struct regress_run *run, size_t test,
                                 struct stats_progress progress, struct srnf_error *error);
/* Of the first drawing: beyond the numbers of the permutations. */
#define REGRESS_DRAWN (UINT64_C(1) << 40)
/* regress_shares.c: intervals of the shares. */
SRNF_CHECKED int regress_shares(struct regress_run *run, struct stats_progress progress,
                                struct srnf_error *error);
/* regress_bootstrap.c: confidence regions of the predictions. */
SRNF_CHECKED int regress_bootstrap(struct regress_run *run, struct stats_progress progress,
                                   struct srnf_error *error);
/* E, [n][n]: data times it are the residuals, with the variance of the errors; rest, [n]: 1 - h_i,
   and 0 of a subject whose value the design fixes, whose row is 0. */
void regress_standardize(const struct regress_run *run, double *e, double *rest);
/* Of sorted values, between neighbours. */
double regress_quantile(size_t n, const double *sorted, double part);
/* regress_effects.c: coefficients, what they mean on the surface, and predicted surfaces. */
SRNF_CHECKED int regress_effects(struct regress_run *run, const double *mean,
                                 struct stats_progress progress, struct srnf_error *error);
/* Sum of x' G x over the columns of x, [count][n]. */
double regress_quadratic(const struct regress_run *run, size_t count, const double *x,
                         double *scratch);

#endif
