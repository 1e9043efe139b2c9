/*
 * inversion.h - what the solvers of the inversion share.
 */
#ifndef SRNF_INVERSION_INTERNAL_H
#define SRNF_INVERSION_INTERNAL_H

#include "srnf/field.h"
#include "srnf/gauss_newton.h"
#include "linear/linear.h"

/* ---- sliding.c: what the preconditioner D^-1 leaves out -------------------------------------- */

struct sliding;
SRNF_CHECKED int sliding_create(struct sliding **out, const struct gauss_newton *system);
void sliding_destroy(struct sliding *s);
/* For the equations at the state of the system, whose surface is f. diagonal: of D. */
void sliding_prepare(struct sliding *s, struct gauss_newton *system, const double *f,
                     const double *diagonal, double lambda);
/* z <- z + C B C' r. r is 0 in the translations, and what is added to z is. */
void sliding_precondition(struct sliding *s, struct gauss_newton *system, const double *r,
                          double *z);
/* Dirichlet energy of the normals of the state, over that of a round sphere: how often they go
   about the sphere, and 1 at least. work: system->count. */
double sliding_turning(struct gauss_newton *system, double *work);

/* ---- normal_equations.c: (J' W J + lambda D) x = b, D = diag(1 + l (l + 1) / 4) ------------- */

struct normal_equations {
    double *memory;
    double *diagonal, *r, *work;        /* work: of conjugate gradients */
    const struct srnf_context *context; /* asked for cancellation now and then; may be NULL */
    double enough;                      /* of b'x: see struct linear_problem */
    struct sliding *sliding;            /* prepared for these equations; NULL: D alone */
    size_t iterations;                  /* of the last solve */
    double residual; /* what it left of b, relative, in the norm of the preconditioner */
};
int normal_equations_create(struct normal_equations *conjugate, const struct gauss_newton *system);
void normal_equations_destroy(struct normal_equations *conjugate);
/* From x = 0, down to `tolerance` in the preconditioned norm, at most `cap` products. b and x must
   not overlap. Returns SRNF_OK whether that was reached or not, or SRNF_ECANCELED. */
int normal_equations_solve(struct normal_equations *conjugate, struct gauss_newton *system,
                           const double *b, double lambda, double tolerance, size_t cap, double *x);

/* ---- Runs ------------------------------------------------------------------------------------ */

/* What a solver reads and writes while it goes on; history grows up to its capacity and then stops.
   */
struct inversion_run {
    struct gauss_newton *system;
    const struct srnf_context *context;
    double start_seconds;
    double *f;        /* current surface */
    double energy;    /* at f; the system's state belongs to f */
    double tolerance; /* on energy / q_norm2 */
    size_t iterations, max_iterations;
    enum srnf_stop stopped;
    struct sliding *sliding; /* made when first needed, destroyed by who made the run */
    double turning;          /* of a surface near the solution, see sliding_turning; 0: unknown */
    struct srnf_iteration *history;
    size_t n_history, history_capacity;
};
void inversion_run_record(struct inversion_run *run);
static inline double inversion_run_relative(const struct inversion_run *run)
{
    return run->energy / run->system->q_norm2;
}

/* levenberg.c */
struct levenberg_options {
    double lambda;          /* damping to start with, relative to 1 + l (l + 1) / 4 */
    size_t max_steps;       /* accepted or refused */
    size_t inner_cap;       /* conjugate-gradient products a step */
    double inner_tolerance; /* 0: max(1e-6, min(.1, sqrt(relative E))), and sliding.c */
    double decrease;        /* stop when an accepted step lowers E by less than this part */
    double
        goal; /* part of the tolerance at which the model's E is low enough; 0: lower is better */
};
SRNF_CHECKED int inversion_levenberg(struct inversion_run *run,
                                     const struct levenberg_options *options);

/* continuation.c */
struct continuation {
    double tolerance; /* on energy / q_norm2 */
    double decrease;  /* stop when an accepted step lowers E by less than this part */
    bool refine;      /* take a target that turns out to be exact down to the tolerance */
};
/* Inverts the target of the system into f, which holds a surface nearby on entry. E never rises.
   energy: E at the end. */
SRNF_CHECKED int inversion_continue(struct gauss_newton *system, const struct continuation *options,
                                    const struct srnf_context *context, double *f, double *energy);

/* descent.c */
SRNF_CHECKED int inversion_descend(struct inversion_run *run);

/* spectral.c and spectral_dense.c: the linear eigenproblem of inversion. */
SRNF_CHECKED int spectral_start(struct inversion_run *run, const double *start, double *f,
                                double *mu);
SRNF_CHECKED int spectral_dense(struct inversion_run *run, const double *start, double *f);
SRNF_CHECKED int spectral_certify(struct inversion_run *run, struct srnf_certificate *certificate);
/* singular.c: smallest singular value of Q_* at the state, off the translations. */
SRNF_CHECKED int inversion_smallest_singular(struct inversion_run *run, double *sigma);

/* sphere_start.c */
void inversion_sphere_start(const struct gauss_newton *system, double *f);

#endif
