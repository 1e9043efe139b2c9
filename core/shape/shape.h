/*
 * shape.h - what the files of core/shape share: pointwise kernels, the linearised problem, the
 * solvers.
 *
 * Vector fields are double[3][n] with n = n_theta n_phi, coefficients double[3][(L+1)^2].
 * "Translations" are the three l = 0 coefficients: they do not change q, and every solver keeps
 * them at 0.
 */
#ifndef SRNF_SHAPE_H
#define SRNF_SHAPE_H

#include "internal.h"

/* ---- pointwise.c: everything that happens at a grid point ------------------------------------ */

/* n = f_theta x f_phi. unit: n / |n|, root: |n|^(1/2), inverse: |n|^(-1/2); all 0 where n = 0. */
void shape_normals(size_t n, const double *f_theta, const double *f_phi, double *unit, double *root,
                   double *inverse);
/* residual = root unit - q */
void shape_residual(size_t n, const double *unit, const double *root, const double *q,
                    double *residual);
/* Q_* at a point: out = (n_w - <unit, n_w> unit / 2) inverse, n_w = f_theta x w_phi + w_theta x
   f_phi. */
void shape_differential(size_t n, const double *f_theta, const double *f_phi, const double *unit,
                        const double *inverse, const double *w_theta, const double *w_phi,
                        double *out);
/* Its transpose, with a weight: z = weight (y - <unit, y> unit / 2) inverse; a = f_phi x z, b = z x
   f_theta. */
void shape_differential_adjoint(size_t n, const double *f_theta, const double *f_phi,
                                const double *unit, const double *inverse, const double *weight,
                                const double *y, double *a, double *b);
/* In place (w_theta, w_phi) <- weight u (<w_theta, u>, <w_phi, u>): the quadratic form T of
   spectral.c. */
void shape_normal_part(size_t n, const double *u, const double *weight, double *w_theta,
                       double *w_phi);
/* sum of weight |a|^2 over a vector field; fixed order of summation. */
double shape_norm2(size_t n, const double *weight, const double *a);
/* Quadrature weights, one for each point. */
void shape_weights(const struct srnf_grid *grid, double *weight);

/* field.c: the field of a surface in one of its representations; workspace as for srnf_field. */
void shape_represent(const struct srnf_sht *sht, enum srnf_representation representation,
                     const double *coefficients, double *q, void *workspace);

/* ---- Vectors of coefficients (vector.c); fixed order of summation ---------------------------- */

double shape_dot(size_t n, const double *a, const double *b);
double shape_dot_weighted(size_t n, const double *weight, const double *a, const double *b);
void shape_axpy(size_t n, double factor, const double *x, double *y);
void shape_scale(size_t n, double factor, double *x);
void shape_copy(size_t n, const double *from, double *to);
/* Diagonals over double[3][(L+1)^2]: a + b l (l + 1), and 0 for l = 0. */
void shape_diagonal(size_t degree, double a, double b, double *diagonal);

/* ---- system.c: E and its Gauss-Newton model at one surface ----------------------------------- */

struct shape_state {
    double *memory;
    double *f_theta, *f_phi, *unit, *root, *inverse, *residual;
};

struct shape_system {
    const struct srnf_sht *sht;
    const double *q;              /* the target; not owned */
    size_t degree, points, count; /* count = 3 (L+1)^2 */
    double q_norm2;
    double *weight;
    double *w_theta, *w_phi, *field;
    void *workspace;
    struct shape_state state, trial;
    double transforms; /* gradient transforms and adjoints spent, of three coordinates each */
};

int shape_system_create(struct shape_system **out, const struct srnf_sht *sht, const double *q);
void shape_system_destroy(struct shape_system *system);
/* Evaluates E at f into trial; shape_system_accept makes trial the state. */
double shape_system_try(struct shape_system *system, const double *f);
void shape_system_accept(struct shape_system *system);
/* g = J' W (Q(f) - q) at the state: half the gradient of E. */
void shape_system_gradient(struct shape_system *system, double *g);
/* out = J' W y at the state; 0 in the translations. y must not be w_theta or w_phi. */
void shape_system_pull_back(struct shape_system *system, const double *y, double *out);
/* field = Q_*f(w) at a state of the system. */
void shape_system_differential(struct shape_system *system, const struct shape_state *at,
                               const double *w, double *field);
/* out = J' W J w at the state; 0 in the translations. */
void shape_system_product(struct shape_system *system, const double *w, double *out);

/* ---- conjugate.c: (J' W J + lambda D) x = b at the state, D = diag(1 + l (l + 1) / 4) -------- */

struct shape_conjugate {
    double *memory;
    double *diagonal, *r, *work;        /* work: of conjugate gradients */
    const struct srnf_context *context; /* asked for cancellation now and then; may be NULL */
    size_t iterations;                  /* of the last solve */
    double residual; /* what it left of b, relative, in the norm of the preconditioner */
};
int shape_conjugate_create(struct shape_conjugate *conjugate, const struct shape_system *system);
void shape_conjugate_destroy(struct shape_conjugate *conjugate);
/* From x = 0, down to `tolerance` in the preconditioned norm, at most `cap` products. b and x must
   not overlap. Returns SRNF_OK whether that was reached or not, or SRNF_ECANCELED. */
int shape_conjugate_solve(struct shape_conjugate *conjugate, struct shape_system *system,
                          const double *b, double lambda, double tolerance, size_t cap, double *x);

/* ---- The solvers ----------------------------------------------------------------------------- */

/* A x = b for A given by its products. */
struct shape_linear {
    size_t n;
    void (*product)(void *argument, const double *x, double *out);
    void (*precondition)(void *argument, const double *r, double *z);
    void *argument;
    double tolerance;                   /* on the residual, relative to that of x = 0 */
    size_t cap;                         /* on the products */
    const struct srnf_context *context; /* asked for cancellation now and then; may be NULL */
};

/* What conjugate gradients came to. */
struct shape_linear_figures {
    size_t products;
    double residual; /* sqrt(r' P r) relative to that of x = 0; 0 for b = 0 */
};

/* cg.c. r: b on entry, b - A x on return; x from 0; work double[3][n]. Returns SRNF_OK whether the
   tolerance was reached or not, or SRNF_ECANCELED. */
int shape_conjugate_gradients(const struct shape_linear *problem, double *r, double *x,
                              double *work, struct shape_linear_figures *figures);
/* gmres.c; precondition is not used. work: shape_gmres_doubles. Returns the products. */
size_t shape_gmres_doubles(size_t n, size_t cap);
size_t shape_gmres(const struct shape_linear *problem, const double *b, double *x, double *work);

/* What a solver reads and writes while it goes on; history grows up to its capacity and then stops.
   */
struct shape_run {
    struct shape_system *system;
    const struct srnf_context *context;
    double start_seconds;
    double *f;        /* current surface */
    double energy;    /* at f; the system's state belongs to f */
    double tolerance; /* on energy / q_norm2 */
    size_t iterations, max_iterations;
    enum srnf_stop stopped;
    struct srnf_iteration *history;
    size_t n_history, history_capacity;
};
void shape_run_record(struct shape_run *run);
static inline double shape_run_relative(const struct shape_run *run)
{
    return run->energy / run->system->q_norm2;
}

/* levenberg.c */
struct shape_lm_options {
    double lambda;          /* damping to start with, relative to 1 + l (l + 1) / 4 */
    size_t max_steps;       /* accepted or refused */
    size_t inner_cap;       /* conjugate-gradient products a step */
    double inner_tolerance; /* 0: max(1e-6, min(.1, sqrt(relative E))) */
    double decrease;        /* stop when an accepted step lowers E by less than this part */
};
SRNF_CHECKED int shape_levenberg(struct shape_run *run, const struct shape_lm_options *options);

/* neighbour.c */
struct shape_neighbour {
    double tolerance; /* on energy / q_norm2 */
    double decrease;  /* stop when an accepted step lowers E by less than this part */
    bool refine;      /* take a target that turns out to be exact down to the tolerance */
};
/* Inverts the target of the system into f, which holds a surface nearby on entry. E never rises.
   energy: E at the end. */
SRNF_CHECKED int shape_invert_neighbour(struct shape_system *system,
                                        const struct shape_neighbour *options,
                                        const struct srnf_context *context, double *f,
                                        double *energy);

/* transport.c: the vector at the state whose Q_* is nearest to a field, as srnf_transport has it,
   down to `tolerance` on the gradient. tangent is untouched on failure. */
SRNF_CHECKED int shape_pull_velocity(struct shape_system *system, const double *velocity,
                                     double tolerance, const struct srnf_context *context,
                                     struct srnf_tangent *tangent);
/* True where all n numbers are finite; otherwise error names the first that is not. */
bool shape_check_finite(size_t n, const double *values, const char *what, struct srnf_error *error);

/* shoot.c: as srnf_shoot, with a start for the surface at the only time, or NULL. */
SRNF_CHECKED int shape_shoot(const struct srnf_sht *sht, const double *surface,
                             const double *velocity, size_t n, const double *times,
                             const double *hint, const struct srnf_context *context,
                             struct srnf_shot *shot, struct srnf_error *error);

/* descent.c */
SRNF_CHECKED int shape_descend(struct shape_run *run);

/* lobpcg.c: smallest eigenvalue of A x = mu M x, A symmetric and positive semidefinite, M diagonal.
   */
struct shape_eigen {
    size_t n;
    void (*product)(void *argument, const double *x, double *out);
    void *argument;
    const double *mass;         /* diagonal; entries 0 are left out of the space */
    const double *precondition; /* diagonal of the approximate inverse */
    double target;              /* stop below this value of mu */
    double change;              /* or when ten steps lowered mu by less than this part */
    size_t cap;
    const struct srnf_context *context;
};
/* x: start and result, M-normalised. residual: ||A x - mu M x|| in the norm of the preconditioner.
   */
SRNF_CHECKED int shape_lobpcg(const struct shape_eigen *problem, double *x, double *mu,
                              double *residual);

/* spectral.c: the linear eigenproblem of inversion. */
SRNF_CHECKED int shape_spectral_start(struct shape_run *run, const double *start, double *f,
                                      double *mu);
SRNF_CHECKED int shape_spectral_dense(struct shape_run *run, const double *start, double *f);
SRNF_CHECKED int shape_certify(struct shape_run *run, struct srnf_certificate *certificate);
/* singular.c: smallest singular value of Q_* at the state, off the translations. */
SRNF_CHECKED int shape_smallest_singular(struct shape_run *run, double *sigma);

/* surface.c: srnf_surface_triangulate that can be canceled. */
SRNF_CHECKED int surface_triangulate(const struct srnf_context *context, size_t degree,
                                     const double *coefficients, size_t frequency,
                                     struct srnf_mesh *mesh, double **normals);

/* start.c */
void shape_sphere_start(const struct shape_system *system, double *f);

#endif
