/*
 * pullback.h - what the files of the pulled-back metric share: the energy of a tree of surfaces,
 * and its minimizer.
 *
 * The metric <<v, w>>_f = <Q_*f(v), Q_*f(w)> is that of L2 pulled back by Q to the space of
 * surfaces. A path is a chain of m + 1 surfaces with m segments; its energy, m sum ||Q_k+1 -
 * Q_k||^2, tends to the integral of <<f', f'>> with m.
 */
#ifndef SRNF_PULLBACK_INTERNAL_H
#define SRNF_PULLBACK_INTERNAL_H

#include "inversion/inversion.h"

/* ---- tree.c: a tree of surfaces ----------------------------------------------------- */

#define PULLBACK_ROOT SIZE_MAX

struct pullback_node {
    size_t parent;                /* of a higher index, or PULLBACK_ROOT */
    size_t unknown;               /* index among the free nodes; SIZE_MAX: the node is fixed */
    size_t first_child, children; /* in graph->child */
    double degree;                /* number of edges */
    double pivot;                 /* of the elimination of the Laplacian; free nodes only */
    double edge;                  /* energy of the edge to the parent */
    double *memory;               /* of the fields below */
    double *q, *trial;            /* [3][P] the field, and that of a candidate */
    double *f_theta, *f_phi, *unit, *inverse, *image; /* free nodes only */
};

/* What a body needs while it works on a node: there is one for each index of a parallel loop. */
struct pullback_slot {
    double *w_theta, *w_phi, *field, *unit, *root, *inverse;
    void *workspace;
};

struct pullback_graph {
    const struct srnf_sht *sht;
    const struct srnf_context *context;
    bool canceled;                /* nodes were left out because of that */
    size_t degree, points, count; /* count = 3 (L+1)^2 */
    size_t nodes, free;
    double edge_weight;
    struct pullback_node *node;
    size_t *free_node, *child;
    double *memory;
    double *weight, *diagonal; /* of the quadrature; 1 + l (l + 1) / 4 */
    double lambda;             /* damping of the product */
    size_t slots;
    struct pullback_slot *slot;
    char *workspaces;
    /* Of the Hessian: where it is taken, the gradient there, and scratch; [free][count], the
       caller's. */
    const double *base, *base_gradient;
    double *displaced;
    /* Arguments of the loop that runs. */
    const double *in;
    double *out;
    double transforms;
};

/*
 * A tree of surfaces whose edges all weigh the same. parents: of a higher index than the node; the
 * last node is the root. fixed: nodes that stay as they are.
 */
SRNF_CHECKED int pullback_graph_create(struct pullback_graph **out, const struct srnf_sht *sht,
                                       const struct srnf_context *context, size_t nodes,
                                       const size_t *parents, const bool *fixed,
                                       double edge_weight);
void pullback_graph_destroy(struct pullback_graph *graph);

/* ---- graph.c: its energy, gradient and Gauss-Newton model --------------------------- */

/* Energy of all surfaces f, double[nodes][count], fixed ones included; as a trial. */
double pullback_graph_start(struct pullback_graph *graph, const double *f);
/* Energy with the free surfaces at x, double[free][count]; as a trial. */
double pullback_graph_try(struct pullback_graph *graph, const double *x);
/* Linearizes at free surfaces x. */
void pullback_graph_linearize(struct pullback_graph *graph, const double *x);
/* g, double[free][count]: half the gradient of the energy. */
void pullback_graph_gradient(struct pullback_graph *graph, double *g);
/* out = (J' W (Lap x 1) J + lambda Lap x D) x, Lap the weighted Laplacian of the free nodes. */
void pullback_graph_product(void *graph, const double *x, double *out);
/* out = half the Hessian of the energy at base times x, by a difference of gradients. */
void pullback_graph_hessian(void *graph, const double *x, double *out);
/* z = (Lap^-1 x D^-1) r, exact in one sweep to the root and one back. */
void pullback_graph_precondition(void *graph, const double *r, double *z);

/* ---- solve.c ------------------------------------------------------------------------ */

struct pullback_solve {
    double decrease; /* stop when a step lowers the energy by less than this part .. */
    double gradient; /* .. or, where this is above 0, when the gradient is below it */
    size_t max_steps;
    double progress_from, progress_to;
    const char *message;
    /* Results. */
    double energy, gradient_left; /* the latter relative, see solve.c */
    size_t steps;
    bool converged;
};
/* Minimizes over the free surfaces of f, double[nodes][count]. SRNF_ENOMEM, SRNF_ECANCELED,
   SRNF_ENUMERIC when the energy is not finite. */
SRNF_CHECKED int pullback_minimize(struct pullback_graph *graph, double *f,
                                   struct pullback_solve *solve);

/* ---- transport.c: the tangent space at one surface ---------------------------------- */

struct pullback_tangent {
    struct gauss_newton *system;
    struct normal_equations conjugate;
    double *memory, *pulled;
};
SRNF_CHECKED int pullback_tangent_create(struct pullback_tangent *t, const struct srnf_sht *sht,
                                         const struct srnf_context *context);
void pullback_tangent_destroy(struct pullback_tangent *t);
void pullback_tangent_at(struct pullback_tangent *t, const double *f);
/* field = J vector */
void pullback_tangent_image(struct pullback_tangent *t, const double *vector, double *field);
/* The vector whose image is the projection of a field, and that image. Translations are 0. */
void pullback_tangent_project(struct pullback_tangent *t, const double *field, double *vector,
                              double *image);
double pullback_tangent_norm(const struct pullback_tangent *t, const double *field);

/* ---- shoot.c, transfer.c: what srnf/deform.h does in this metric ---------------------------- */

/*
 * Surfaces and energies at n times, as srnf_shoot; paths->toward and shots are set.
 *   line  [in] [3][n_theta][n_phi] the velocity as a field: energies are squared distances from
 *              Q(surface) + t line
 * This and what follows return SRNF_OK or an error with the results empty.
 */
SRNF_CHECKED int pullback_shoot(const struct srnf_sht *sht, const double *surface,
                                const struct srnf_velocity *velocity, const double *line, size_t n,
                                const double *times, const struct srnf_context *context,
                                struct srnf_shot *shot, struct srnf_deform_paths *paths,
                                struct srnf_error *error);
/*
 * The vector carried along the geodesic from `from` to `to`, and the surface that it leads to.
 *   line     [out] [3][n_theta][n_phi] the vector at `to` as a field
 *   tangent  [out] the vector at `to`; residual is what of a field was no motion of `from`
 */
SRNF_CHECKED int pullback_carry(const struct srnf_sht *sht, const double *from, const double *to,
                                const struct srnf_velocity *vector,
                                const struct srnf_context *context, double *line,
                                struct srnf_tangent *tangent, struct srnf_shot *shot,
                                struct srnf_deform_paths *paths, struct srnf_error *error);
/* As srnf_transfer of source, deformed and target; energy is the squared distance from Q(target) +
   Q(deformed) - Q(source). */
SRNF_CHECKED int pullback_transfer_sized(const struct srnf_sht *sht, const double *const given[3],
                                         enum srnf_transfer_size size,
                                         const struct srnf_context *context,
                                         struct srnf_transferred *transferred,
                                         struct srnf_deform_paths *paths, struct srnf_error *error);

void pullback_paths_clear(struct srnf_deform_paths *paths);

/* Squared distance of the surface's SRNF from base + t line, and the same relative to the square of
   that; scratch is a field, workspace as for srnf_field. */
void pullback_measure_energy(const struct srnf_sht *sht, const double *surface, const double *base,
                             double t, const double *line, double *scratch, void *workspace,
                             double *energy, double *relative);

/* ---- path.c: figures and small parts that several files need ------------------------ */

/* Numbers of a field, 3 n_theta n_phi. */
static inline size_t pullback_field_values(const struct srnf_sht *sht)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);

    return 3 * grid->n_theta * grid->n_phi;
}
/* Parents and fixed ends of a chain of nodes: an array of each, to be freed with srnf_free. */
SRNF_CHECKED int pullback_chain(size_t nodes, size_t **parents, bool **fixed);
/* out = (1 - t) a + t b */
void pullback_mix(size_t n, double t, const double *a, const double *b, double *out);
/* ||a - b|| of two fields; difference is scratch of their size. */
double pullback_distance(const struct srnf_grid *grid, const double *a, const double *b,
                         double *difference);
/* Figures of a path, double[segments + 1][count]; speeds may be NULL. SRNF_ENOMEM, SRNF_ENUMERIC.
   */
SRNF_CHECKED int pullback_measure(const struct srnf_sht *sht, const struct srnf_context *context,
                                  size_t segments, const double *path, double *speeds,
                                  struct srnf_path_figures *figures);
/* SRNF_EINVAL, naming the surface, where a coefficient is not finite. */
SRNF_CHECKED int pullback_check_surface(const struct srnf_sht *sht, const double *surface,
                                        const char *name, struct srnf_error *error);
SRNF_CHECKED int pullback_check_segments(size_t segments, struct srnf_error *error);
SRNF_CHECKED int pullback_check_even(size_t segments, struct srnf_error *error);
/* Fills error with the sentence of a status that has brought none of its own; returns status. */
int pullback_fail(int status, struct srnf_error *error);

#endif
