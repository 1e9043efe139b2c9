/*
 * registration.h - what the files of elastic registration share.
 *
 * min over O in SO(3) and gamma in Diff+(S^2) of ||q1 - O (q2, gamma)||^2, (q2, gamma) = sqrt(J) q2
 * o gamma.
 *
 * The state is the points p_i = gamma(s_i) on the template's grid and J_i. A left step gamma <-
 * exp(w) o gamma moves the points, and multiplies J by the step's own Jacobian. Since the action is
 * isometric, the Gauss-Newton matrix of left steps, H_kl = integral <D X_k, D X_l>, D X = X . grad
 * q2 + div X q2 / 2, does not depend on gamma: it is assembled once for a moving surface and a
 * degree of fields.
 *
 * All but exact mode, and surfaces that are nearly the same, reads q2, its derivative and the steps
 * from tables of splines (tabulated.h). The direct path resamples nothing: q2 and its derivative at
 * p_i come from the harmonics of the moving surface itself, and steps are taken in closed form.
 * The objective that is reported is measured with the surface itself in either case.
 *
 * Fields are X = grad phi + p x grad psi with phi and psi of degree D; their coefficients, divided
 * by sqrt(l (l + 1)), are the unknowns: double[2][(D+1)^2], entries l = 0 unused.
 */
#ifndef SRNF_REGISTRATION_INTERNAL_H
#define SRNF_REGISTRATION_INTERNAL_H

#include "linear/linear.h"
#include "srnf/field.h"
#include "mesh/mesh_geometry.h"
#include "harmonics/points.h"

/* ---- The moving surface (moving.c) ------------------------------------------------
   */

struct tabulated_moving;
struct tabulated_tools;
struct subject;

/* A grid of nodes by its sizes alone. */
struct nodes_of {
    enum srnf_grid_kind kind;
    size_t n_theta, n_phi;
};

struct moving {
    enum srnf_representation representation; /* of moving_create: the SRNF */
    const struct tabulated_moving *table;    /* read instead of the harmonics, or NULL */
    size_t degree;
    double *coefficients; /* [3][(L+1)^2] */
    struct sphere_jets plan;
};

/* From coefficients of one degree, cut to `degree` if that is lower. context: asked for
   cancellation by all that evaluates it, see harmonics/points.h; it outlives the moving surface,
   or is NULL. */
SRNF_CHECKED int moving_create(struct moving *moving, size_t from_degree,
                               const double *coefficients, size_t degree,
                               const struct srnf_context *context);
static inline const struct srnf_context *moving_context(const struct moving *moving)
{
    return moving->plan.points.context;
}
void moving_clear(struct moving *moving);

/* q2 at points: q and its derivatives along the orthonormal tangents t1, t2 (t1 x t2 = p), all
   [n][3]. */
struct samples {
    size_t n;
    double *memory;
    double *q, *q_1, *q_2, *t1, *t2;
    double *jets, *values; /* scratch of the evaluation */
};
SRNF_CHECKED int samples_create(struct samples *samples, size_t n);
void samples_clear(struct samples *samples);
void moving_evaluate(const struct moving *moving, const double *points, struct samples *out);
/* What reports and measures ask for, without derivatives and never from a table: q [n][3] and the
   points of the surface, f [3][n], or NULL. */
void moving_values(const struct moving *moving, size_t n, const double *points, double *f,
                   double *q);

/* ---- Fields and steps (step.c) -----------------------------------------------------
   */

/* Everything of one degree of fields that steps need. */
struct fields {
    size_t degree, count; /* count = (D+1)^2 */
    struct sphere_jets plan;
    double *scale; /* [count] 1 / sqrt(l (l + 1)), 0 for l = 0 */
};
SRNF_CHECKED int fields_create(struct fields *fields, size_t degree,
                               const struct srnf_context *context);
void fields_clear(struct fields *fields);
/* Moves points by exp(w) and multiplies J; returns the least Jacobian of the step. potentials:
   [2][count]. In place is allowed. scratch: FIELDS_SCRATCH n doubles. */
#define FIELDS_SCRATCH ((size_t)2 * JET_KINDS + 6)
double fields_apply(const struct fields *fields, const double *potentials, size_t n,
                    const double *points, const double *jacobian, double *new_points,
                    double *new_jacobian, double *scratch);

/* The inverse of exp(w), by Newton's method at each point; in place. scratch:
   FIELDS_INVERSE n doubles. Errors: SRNF_ENUMERIC where it does not converge. */
#define FIELDS_NEWTON ((size_t)8)
#define FIELDS_INVERSE (FIELDS_SCRATCH + 4 + FIELDS_NEWTON)
SRNF_CHECKED int fields_apply_inverse(const struct fields *fields, const double *potentials,
                                      size_t n, double *points, double *jacobian, double *scratch);

/* ---- Gauss-Newton matrix (matrix.c) --------------------------------------------- */

/* Unknowns: 2 ((D+1)^2 - 1) of the field, then 3 of the value rotation. */
static inline size_t registration_unknowns(size_t degree)
{
    return 2 * ((degree + 1) * (degree + 1) - 1) + 3;
}
/* H of the data term and, times displacement, of the displacement penalty; column-major, lower
   triangle. Of a moving surface that is read from a table: tabulated_matrix. */
SRNF_CHECKED int registration_matrix(const struct moving *moving, size_t degree,
                                     double displacement, double *matrix);

/* ---- The problem and its state (objective.c) ------------------------------------ */

struct target {
    size_t n;
    const double *points; /* [n][3] nodes s_i */
    const double *weight; /* [n] */
    const double *q;      /* [n][3] */
    double norm2;         /* ||q||^2, or what energies are told relative to */
    /* The penalties compare gamma with another warp d than the identity, for a group whose
       parameterization is centred elsewhere: that of gamma o d^-1. Both NULL: the identity. */
    const double *reference; /* [n][3] sqrt(K) d(s_i) */
    const double *area;      /* [n] K, the Jacobian of d */
};
/* What gamma is compared with: (e, d) at all nodes, and K at one. */
static inline const double *target_reference(const struct target *target)
{
    return target->reference ? target->reference : target->points;
}
static inline double target_area(const struct target *target, size_t i)
{
    return target->area ? target->area[i] : 1.0;
}

struct penalty {
    double jacobian, displacement;
};

struct warp {
    size_t n;
    double *points, *jacobian; /* [n][3], [n] */
    double rotation[9];        /* O, row-major: values of the moving surface are turned by it */
    double energy;             /* relative to ||q1||^2 */
    double objective;
    enum srnf_register_stop stopped; /* of the last search that moved it */
    struct srnf_warp chain;          /* what made the points of the nodes */
};
/* The identity on the nodes of a target. */
SRNF_CHECKED int warp_create(struct warp *warp, const struct target *target);
void warp_clear(struct warp *warp);
/* Replays a chain on the nodes of a target and keeps a copy of it in place of its own. */
SRNF_CHECKED int warp_replay(struct warp *warp, const struct target *target,
                             const struct srnf_warp *chain, const struct srnf_context *context);
/* srnf_warp_apply that can be canceled. */
SRNF_CHECKED int warp_apply(const struct srnf_warp *chain, const struct srnf_context *context,
                            size_t n, const double *points, double *warped, double *jacobian);
/* Starts anew from a rotation of the domain. */
SRNF_CHECKED int warp_rotate(struct warp *warp, const struct target *target,
                             const double rotation[9]);
SRNF_CHECKED int warp_append(struct srnf_warp *chain, enum srnf_warp_kind kind, size_t degree,
                             const double *values);
/* Moves points along a chain and multiplies J by its Jacobian, in place. */
SRNF_CHECKED int warp_follow(const struct srnf_warp *chain, const struct srnf_context *context,
                             size_t n, double *points, double *jacobian);
/* p -> g(p) / |g(p)| at points, in place, J multiplied by its Jacobian (known.c).
   values: double[3][(degree+1)^2]. */
SRNF_CHECKED int warp_follow_series(size_t degree, const double *values,
                                    const struct srnf_context *context, size_t n, double *points,
                                    double *jacobian);
/* out <- the inverse of the chain; out must be empty. SRNF_ENUMERIC: a series has none. */
SRNF_CHECKED int warp_invert(const struct srnf_warp *chain, struct srnf_warp *out);

struct problem {
    struct target target;
    const struct moving *moving;
    struct penalty penalty;
    bool free_rotation; /* of the values: false in a common pose */
};

/* Sets rotation (unless fixed), energy and objective; fills samples. displacement_rotation: O' of
   the penalty; NULL where displacements cost nothing. */
void registration_objective(const struct problem *problem, struct warp *warp,
                            struct samples *samples, double displacement_rotation[9]);
/* The same with the samples as they are. */
void registration_measure(const struct problem *problem, struct warp *warp,
                          const struct samples *samples, double displacement_rotation[9]);
/* What an objective is raised by where the area of a warp, sum w J over a grid, is not that of the
   sphere: there the warp squeezes a part of the moving surface between the nodes, where no sum sees
   it, or folds. 0 for what a grid resolves. */
double registration_hidden(double area);
/* R maximizing trace(R' B), B row-major: closest rotation; returns that trace. */
double registration_closest_rotation(const double b[9], double rotation[9]);

/* ---- Optimization (optimize.c) -------------------------------------------------- */

/* What one degree of fields needs for one moving surface. */
struct level {
    struct fields fields;
    double *matrix; /* relative to ||q1||^2, penalties included */
};
SRNF_CHECKED int level_create(struct level *level, const struct problem *problem, size_t degree);
void level_clear(struct level *level);
/* The part of a matrix of another degree, at least as high, that belongs to fields of a degree. */
void registration_restrict(size_t from_degree, const double *from, size_t degree, double *matrix);

struct schedule {
    size_t max_steps;
    double decrease; /* stop after two steps that gain less than this part */
};
/* Levenberg-Marquardt with left steps. The warp must have been evaluated by registration_objective;
   its member stopped says why the steps ended. */
SRNF_CHECKED int registration_optimize(const struct problem *problem, const struct level *level,
                                       const struct schedule *schedule,
                                       const struct srnf_context *context, struct warp *warp,
                                       struct samples *samples, size_t *iterations);
/* Minus half the derivative of the objective in the unknowns; samples and rotation as
   registration_objective left them. gradient: [registration_unknowns]. curvature, or NULL: of the
   Jacobian penalty, times l (l + 1). */
SRNF_CHECKED int registration_gradient(const struct problem *problem, const struct level *level,
                                       const struct warp *warp, const struct samples *samples,
                                       const double displacement_rotation[9], double *gradient,
                                       double *curvature);
/* Cholesky factor of the first so many rows of matrix + curvature + lambda times damping; false
   when there is none. Column-major, lower triangle. damping: [unknowns] or NULL: as
   registration_damping fills it. */
bool registration_factor(const struct level *level, size_t unknowns, double curvature,
                         double lambda, const double *damping, double *factor);
/* Diagonal of the damping: trace / k times l (l + 1) / its mean; the value rotation like degree
   one. damping: [registration_unknowns]; unknowns: those that are free. */
void registration_damping(const struct level *level, size_t unknowns, double *damping);
/* The potentials of a step in the unknowns: [2][(D+1)^2]. */
void registration_potentials(const struct fields *fields, const double *step, double *potentials);

/* ---- Global start (screen.c, start.c) ------------------------------------------- */

struct start_rotation {
    double rotation[9]; /* of the domain, row-major */
    double energy;      /* relative; rough after the screening, exact after refinement */
    enum srnf_register_stop stopped; /* of the refinement */
};
/* Best rotations of the domain, at least 20 degrees apart, best first, by the coefficients of q1
   and q2 up to this degree: double[3][(6 + 1)^2] each. Returns their number. (screen.c) */
#define REGISTRATION_SCREEN_DEGREE 6
size_t registration_screen(const double *first, const double *second, size_t capacity,
                           struct start_rotation *starts, int *status);
/* Levenberg-Marquardt over both rotations; curvature: smallest eigenvalue over rotations of the
   domain, or NULL. */
SRNF_CHECKED int registration_rigid(const struct problem *problem, struct start_rotation *start,
                                    double *curvature);

/* ---- One way (search_create.c, search.c, search_rigid.c, search_measure.c) ------ */

struct landmark_search;

/* Both surfaces prepared for a search in one direction. */
struct search {
    const struct srnf_register_options *options;
    const struct srnf_context *context;
    const struct srnf_sht *sht;
    struct problem full;
    struct moving moving_full;
    struct moving moving_template; /* in exact mode, where the template's surface is known */
    bool has_template;
    const struct subject *subject;     /* tables of the moving surface */
    struct subject *own;               /* the same, where they were made for this search */
    struct tabulated_tools *tools;     /* of its thread, or NULL */
    size_t rounds;                     /* of steps in both domains in turn, at most */
    double round_gain;                 /* of the objective, by a round that has another after it */
    bool basin;                        /* by tables: no further than where the basin is known */
    bool chain;                        /* nothing but the chain and the rotation is asked for */
    struct landmark_search *landmarks; /* landmarks.h; NULL: none, as search_create leaves it */
    double *template_series;           /* double[3][(L+1)^2]: harmonics of q1 */
    double *full_memory;               /* of the target */
    struct nodes_of nodes;             /* the same */
};
/* q1: double[3][n_theta][n_phi] on the grid of sht. template_surface: what q1 belongs to, or
   NULL. subject: of the moving surface, or NULL. tools: or NULL. */
SRNF_CHECKED int search_create(struct search *search, const struct srnf_sht *sht, const double *q1,
                               const double *template_surface, const double *moving,
                               const struct srnf_register_options *options,
                               const struct subject *subject, struct tabulated_tools *tools,
                               const struct srnf_context *context);
void search_clear(struct search *search);

struct search_result {
    struct warp warp; /* on the nodes of the full target, which may be finer than the template's */
    bool carried;     /* its points are where tables carry the nodes along its chain, to the bit */
    double min_jacobian, max_jacobian; /* by search_extremes */
    double distance;
    bool rotations_searched; /* the three that follow are known */
    double ambiguity_objective, ambiguity_angle, rotational_curvature;
    double rigid_energy; /* of the best of the screening, refined on a coarse grid */
    size_t iterations;
};
/* From nothing: global start, then the fields by rising degree. */
SRNF_CHECKED int search_run(const struct search *search, struct search_result *result);
/* On from what a search by tables has found, for the rounds that search says now. */
SRNF_CHECKED int search_refine(const struct search *search, struct search_result *result);
/* From a chain that is known: the fields alone. */
SRNF_CHECKED int search_continue(const struct search *search, const struct srnf_warp *chain,
                                 struct search_result *result);
/* A chain as it is: points, Jacobian, rotation and objective. result keeps its other members. */
SRNF_CHECKED int search_evaluate(const struct search *search, const struct srnf_warp *chain,
                                 struct search_result *result);
void search_result_clear(struct search_result *result);
/* The least and the largest J of a result whose warp is on the nodes (extremes.c). */
SRNF_CHECKED int search_extremes(const struct search *search, struct search_result *result);
/* The best rotation of the domain, refined: the points of result->warp, unmeasured, and what there
   is to tell of rotations (search_rigid.c). */
SRNF_CHECKED int search_rigid(const struct search *search, struct search_result *result);
/* The degrees that are screened, of [3][(degree+1)^2]; out: zero where there are none
   (screen.c). */
void search_cut_series(size_t degree, const double *series, double *out);
/* q1 by its harmonics up to a degree, on a coarser grid. memory: to be freed. */
SRNF_CHECKED int search_coarsen(const struct search *search, size_t rows, size_t degree,
                                double **memory, struct target *target);
size_t search_screen(const struct search *search, size_t capacity, struct start_rotation *starts,
                     int *status);
/* Energy and objective of a warp on the full target, by the moving field itself, and what its
   chain leaves of the landmarks. */
SRNF_CHECKED int search_measure(const struct search *search, struct warp *warp);
/* The distance that its energy is. */
double search_distance(const struct search *search, const struct warp *warp);
/* The reason that leaves more to be doubted, of two searches that are told of together
   (options.c). */
enum srnf_register_stop registration_worse_stop(enum srnf_register_stop a,
                                                enum srnf_register_stop b);
/* What srnf/register.h allows as degree and penalties (options.c). */
SRNF_CHECKED int registration_check(const struct srnf_register_options *options,
                                    struct srnf_error *error);
/* What belongs to one surface of a pair alone, for all registrations with these options that it
   takes part in (subject.c). *subject: NULL where they ask for nothing; tools: of the thread, or
   NULL; context: of this call. */
SRNF_CHECKED int registration_subject(const struct srnf_sht *sht, const double *surface,
                                      const struct srnf_register_options *options,
                                      struct tabulated_tools *tools,
                                      const struct srnf_context *context, struct subject **subject);
void registration_subject_destroy(struct subject *subject);
/* Bytes of one, at most. */
double registration_subject_bytes(size_t degree);
/* The distance of srnf_register, without the rest of its report, which takes as long as a third of
   the search. The subjects of both surfaces, and tools (tabulated.h) that no other thread uses, or
   NULL: they are made. */
SRNF_CHECKED int registration_distance(const struct srnf_sht *sht, const double *template_surface,
                                       const double *moving, const struct subject *template_subject,
                                       const struct subject *moving_subject,
                                       struct tabulated_tools *tools,
                                       const struct srnf_register_options *options,
                                       const struct srnf_context *context, double *distance,
                                       struct srnf_error *error);
/* srnf_register_to_field, guided by landmarks, whose fixed points are those of the field; or NULL.
   tools: of the thread, or NULL. found: rotation and chain; its points, if they are where tables
   carry the nodes of the field along the chain (follow_table), and NULL otherwise. To be cleared.
   SRNF_EUNMATCHED: as srnf_register_landmarks. */
SRNF_CHECKED int registration_to_field(const struct srnf_sht *sht, const double *field,
                                       double norm2, const double *moving,
                                       const struct srnf_register_options *options,
                                       const struct srnf_landmarks *landmarks,
                                       struct tabulated_tools *tools,
                                       const struct srnf_context *context, struct warp *found,
                                       struct srnf_error *error);
/* Where the tournament of such a search ends, a chain near the best warp: a third of the search or
   less. */
SRNF_CHECKED int registration_basin(const struct srnf_sht *sht, const double *field, double norm2,
                                    const double *moving,
                                    const struct srnf_register_options *options,
                                    struct tabulated_tools *tools,
                                    const struct srnf_context *context, struct srnf_warp *chain);
/* A surface as it is registered by a chain: gamma [n][3] and J [n] at the nodes of the grid of sht,
   O sqrt(J) q(gamma), [3][n], and O f(gamma), [3][n], or NULL (field.c). */
SRNF_CHECKED int registration_lay(const struct srnf_sht *sht,
                                  enum srnf_representation representation, const double *moving,
                                  const double rotation[9], const struct srnf_warp *warp,
                                  const struct srnf_context *context, double *points,
                                  double *jacobian, double *q, double *f);
/* Rows of a grid of 2 rows^2 nodes that fields of a degree do not overfit (nodes.c). */
size_t registration_rows(size_t degree);
/* The parallels of a Gauss-Legendre grid of 2 rows^2 nodes, without the tables of a transform; to
   be freed. NULL: no memory. */
double *registration_parallels(size_t rows, struct srnf_grid *grid);
/* Nodes and weights of a grid: [n][3] and [n]. */
void registration_nodes(const struct srnf_grid *grid, double *points, double *weight);

#endif
