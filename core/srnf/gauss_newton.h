/*
 * gauss_newton.h - the energy E = ||Q(f) - q||^2 and its Gauss-Newton model at one surface.
 */
#ifndef SRNF_SRNF_GAUSS_NEWTON_H
#define SRNF_SRNF_GAUSS_NEWTON_H

#include "internal.h"

struct gauss_newton_state {
    double *memory;
    double *f_theta, *f_phi, *unit, *root, *inverse, *residual;
};

struct gauss_newton {
    const struct srnf_sht *sht;
    const double *q;              /* the target; not owned */
    size_t degree, points, count; /* count = 3 (L+1)^2 */
    double q_norm2;
    double *weight;
    double *w_theta, *w_phi, *field;
    void *workspace;
    struct gauss_newton_state state, trial;
    double transforms; /* gradient transforms and adjoints spent, of three coordinates each */
};

int gauss_newton_create(struct gauss_newton **out, const struct srnf_sht *sht, const double *q);
void gauss_newton_destroy(struct gauss_newton *system);
/* Evaluates E at f into trial; gauss_newton_accept makes trial the state. */
double gauss_newton_try(struct gauss_newton *system, const double *f);
void gauss_newton_accept(struct gauss_newton *system);
/* g = J' W (Q(f) - q) at the state: half the gradient of E. */
void gauss_newton_gradient(struct gauss_newton *system, double *g);
/* out = J' W y at the state; 0 in the translations. y must not be w_theta or w_phi. */
void gauss_newton_pull_back(struct gauss_newton *system, const double *y, double *out);
/* field = Q_*f(w) at a state of the system. */
void gauss_newton_differential(struct gauss_newton *system, const struct gauss_newton_state *at,
                               const double *w, double *field);
/* out = J' W J w at the state; 0 in the translations. */
void gauss_newton_product(struct gauss_newton *system, const double *w, double *out);

#endif
