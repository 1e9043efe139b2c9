/*
 * tabulated.h - registration by tables: the same objective, gradient and steps as registration.h,
 * with every field read from a spline on the sphere (harmonics/spline.h).
 *
 * The normal n = f_1 x f_2 of the moving surface is a polynomial of degree 2 L, which its SRNF q is
 * not: so n is tabulated, and q and its derivatives follow at each point. A step field w = grad phi
 * + p x grad psi is tabulated as its three Cartesian components, and right-hand sides by the
 * transposed table, which has a fourth component for the divergence. An evaluation costs the same
 * at every degree.
 *
 * Points lie in structures of arrays, four to a vector, the last ones repeated with weight 0 up to
 * a multiple of four. Steps allocate nothing. What is found here is an approximation of the problem
 * (objective to some 1e-6 on the grid of the full problem); the chain that it gives is a warp like
 * any other, and the answer is measured by the direct way (search_measure.c).
 */
#ifndef SRNF_REGISTRATION_TABULATED_H
#define SRNF_REGISTRATION_TABULATED_H

#include "harmonics/spline.h"
#include "registration.h"

#include <stdatomic.h>

/* ---- The moving surface (tabulated_moving.c) ------------------------------------------------ */

struct tabulated_moving {
    enum srnf_representation representation;
    size_t degree;
    struct sphere_spline normal;   /* n */
    struct sphere_spline position; /* f, of square-root maps only */
    bool pulled;                   /* back by a warp: the surface is f o gamma */
    struct sphere_spline carried;  /* then sqrt(J) gamma */
};
/* Cut to `degree`, if that is lower than from_degree. order: of the splines; fineness: rows a
   degree of n, 1 at least. tools: of the thread, or NULL. */
SRNF_CHECKED int tabulated_moving_create(struct tabulated_moving *moving,
                                         enum srnf_representation representation,
                                         size_t from_degree, const double *coefficients,
                                         size_t degree, size_t order, double fineness,
                                         struct tabulated_tools *tools);
/* f o gamma for a chain of rotations and steps, which penalties still see: where points are taken
   by further steps in its domain, they are measured at the points of both. (tabulated_pull.c) */
SRNF_CHECKED int tabulated_moving_pull(struct tabulated_moving *moving,
                                       const struct tabulated_moving *from,
                                       const struct srnf_warp *chain, struct tabulated_tools *tools,
                                       const struct srnf_context *context);
void tabulated_moving_clear(struct tabulated_moving *moving);
/* Rows of the table of a surface of a degree. */
size_t tabulated_moving_rows(size_t degree, double fineness);

/* ---- Points (tabulated_points.c) ------------------------------------------------------------ */

/* What does not change: nodes, weights, values of the template. Arrays of n doubles. */
struct tabulated_target {
    size_t n; /* a multiple of four */
    double *memory;
    double *node[3], *weight, *q[3];
    double norm2;
};
SRNF_CHECKED int tabulated_target_create(struct tabulated_target *target,
                                         const struct target *from);
void tabulated_target_clear(struct tabulated_target *target);

/* Where gamma takes the nodes, and what is there. */
#define CLOUD_ARRAYS ((size_t)22)
struct cloud {
    size_t n;
    double *memory;
    double *point[3], *jacobian;
    double *q[3], *q_1[3], *q_2[3]; /* derivatives along e_theta and e_phi at the points */
    double *carried[3], *carried_1[3], *carried_2[3]; /* of pulled surfaces alone */
    double rotation[9], displacement[9];              /* O, and O' of the penalty */
    double energy, objective;
};
/* Of so many nodes, on the template's own points. */
SRNF_CHECKED int cloud_create(struct cloud *cloud, size_t n);
void cloud_clear(struct cloud *cloud);
void cloud_rotate(struct cloud *cloud, const struct tabulated_target *target,
                  const double rotation[9]);
/* Its points turned; what is there is not. */
void cloud_turn(struct cloud *cloud, const double rotation[9]);

/* Arrays of a cloud of n points, in CLOUD_ARRAYS n doubles. */
void cloud_place(struct cloud *cloud, size_t n, double *memory);
/* Tables of step fields: nodes of the spline, and rows a degree. */
struct field_table {
    size_t order;
    double fineness;
};
size_t field_table_rows(const struct field_table *table, size_t degree);
extern const struct field_table follow_table; /* points to some 1e-10 a step */
/* Moves the points along a chain of rotations and steps, and multiplies their Jacobians. */
SRNF_CHECKED int cloud_follow(struct cloud *cloud, const struct srnf_warp *chain,
                              const struct field_table *table, struct tabulated_tools *tools,
                              const struct srnf_context *context);

/* moving_evaluate, from a table. */
void tabulated_sample(const struct tabulated_moving *moving, const double *points,
                      struct samples *out);

struct tabulated_problem {
    const struct tabulated_target *target;
    const struct tabulated_moving *moving;
    struct penalty penalty;
    bool free_rotation;
};

/* ---- Loops over points (tabulated_step.c, tabulated_load.c) --------------------------------- */

/* to <- exp(w) of from, with its Jacobian; returns the least Jacobian of the step, or a negative
   number where a step is longer than half a great circle. field: of tabulated_fields. */
double cloud_move(const struct sphere_spline *field, const struct cloud *from, struct cloud *to);
/* q and its derivatives at the points. */
void cloud_evaluate(const struct tabulated_moving *moving, struct cloud *cloud);
/* Rotations, energy and objective from what cloud_evaluate left. */
void cloud_measure(const struct tabulated_problem *problem, struct cloud *cloud);
/* Minus half the derivative of the objective, spread over a table of fields: components v and
   alpha. Returns the curvature of the Jacobian penalty. */
double cloud_load(const struct tabulated_problem *problem, const struct cloud *cloud,
                  struct sphere_spline *field, double torque[3]);
/* R maximizing trace(R' B), by Newton's method on the largest root of the characteristic polynomial
   of Horn's matrix; returns that trace. rotation: may be NULL. */
double tabulated_closest_rotation(const double b[9], double rotation[9]);

/* ---- Fields of one degree (tabulated_fields.c) ---------------------------------------------- */

struct tabulated_fields {
    size_t degree, count;
    struct srnf_sht *sht; /* on the nodes of the table */
    struct sphere_spline table;
    double *memory;
    double *scale, *frames, *gradients, *divergence, *moments;
    void *workspace;
};
SRNF_CHECKED int tabulated_fields_create(struct tabulated_fields *fields, size_t degree,
                                         size_t order, size_t rows);
void tabulated_fields_clear(struct tabulated_fields *fields);
/* Fills the table with w. potentials: [2][count]. */
void tabulated_fields_fill(struct tabulated_fields *fields, const double *potentials);
/* From the loads spread over the table to the right-hand side; rhs: [registration_unknowns]. */
void tabulated_fields_transpose(struct tabulated_fields *fields, const double torque[3],
                                double *rhs);
void tabulated_fields_potentials(const struct tabulated_fields *fields, const double *step,
                                 double *potentials);

/* ---- Tools (tabulated_tools.c) --------------------------------------------------------------- */

/* Of one thread. What goes beyond is not kept, and neither are higher degrees. */
#define TOOLS_FIELDS ((size_t)24)
#define TOOLS_TRANSFORMS ((size_t)20)
#define TOOLS_DEGREE ((size_t)32)
struct tabulated_tools {
    size_t place; /* in its pool */
    size_t n_fields, n_transforms;
    struct tabulated_fields fields[TOOLS_FIELDS];
    struct srnf_sht *transforms[TOOLS_TRANSFORMS];
};
/* NULL: no memory. */
struct tabulated_tools *tools_create(void);
void tools_destroy(struct tabulated_tools *tools);
/* As tabulated_fields_create and srnf_sht_create, of what is kept if it is there. tools NULL:
   nothing is kept. */
SRNF_CHECKED int tools_fields(struct tabulated_tools *tools, size_t degree, size_t order,
                              size_t rows, struct tabulated_fields *fields);
void tools_return_fields(struct tabulated_tools *tools, struct tabulated_fields *fields);
SRNF_CHECKED int tools_transform(struct tabulated_tools *tools, size_t degree,
                                 const struct nodes_of *nodes, struct srnf_sht **sht);
void tools_return_transform(struct tabulated_tools *tools, struct srnf_sht *sht);

/* Those of the threads of one job. */
#define TOOLS_PLACES ((size_t)32)
struct tools_place {
    atomic_flag taken;
    struct tabulated_tools *tools;
};
struct tools_pool {
    struct tools_place places[TOOLS_PLACES];
};
void tools_pool_open(struct tools_pool *pool);
void tools_pool_clear(struct tools_pool *pool);
/* Some that no other thread has, to be given back; NULL: all are taken. */
SRNF_CHECKED int tools_take(struct tools_pool *pool, struct tabulated_tools **tools);
void tools_give_back(struct tools_pool *pool, const struct tabulated_tools *tools);

/* ---- Steps to rounding (tabulated_follow.c) -------------------------------------------------- */

/* What steps of one degree are followed by at many points, wherever a map is told. */
struct fine_steps {
    struct tabulated_fields fields;
    struct fields direct;
};
/* Whether that costs less than to move so many points directly. */
bool fine_steps_pay(size_t degree, bool inverse, size_t n);
SRNF_CHECKED int fine_steps_create(struct fine_steps *steps, size_t degree,
                                   const struct srnf_context *context);
void fine_steps_clear(struct fine_steps *steps);
/* fields_apply or fields_apply_inverse, in place. Errors: those of the latter. */
SRNF_CHECKED int fine_steps_apply(struct fine_steps *steps, const double *potentials, bool inverse,
                                  const struct srnf_context *context, size_t n, double *points,
                                  double *jacobian);

/* ---- Gauss-Newton matrix and its factors (tabulated_matrix.c, tabulated_level.c) ------------- */

/* registration_matrix of the data term, from a table and on a coarse grid: it only shapes the
   steps. Column-major, lower triangle; what lies above it is undefined. */
SRNF_CHECKED int tabulated_matrix(const struct tabulated_moving *moving, size_t degree,
                                  const struct srnf_context *context, double *matrix);

/* The matrix of one degree and Cholesky factors of matrix + s diag(l (l + 1)), s on a geometric
   ladder. All entrants of a tournament share them; the oldest makes room. */
#define LEVEL_SLOTS_MAX 12
struct tabulated_level {
    size_t degree, unknowns, fields; /* all that are free; of one kind of field */
    double *memory;
    double *matrix;  /* [k][k], k = registration_unknowns */
    double *eigen;   /* [k] l (l + 1); of the rotation 2 */
    double *factors; /* [slots][unknowns][unknowns] */
    double scale;    /* damping is lambda times scale times eigen */
    size_t slots, clock;
    long last; /* rung */
    long key[LEVEL_SLOTS_MAX];
    size_t used[LEVEL_SLOTS_MAX]; /* when; 0: never */
    bool regular[LEVEL_SLOTS_MAX];
};
/* matrix: of from_degree, at least `degree`; its part is copied, divided by norm2. displacement:
   weight of that penalty. */
SRNF_CHECKED int tabulated_level_create(struct tabulated_level *level, size_t degree,
                                        size_t from_degree, const double *matrix, double norm2,
                                        double displacement, bool free_rotation);
void tabulated_level_clear(struct tabulated_level *level);
/* step <- (matrix + s diag eigen)^-1 rhs for the rung nearest to lambda and the curvature of the
   Jacobian penalty, or for the last one that was asked for, where that is near; *expected: the gain
   that the model promises. False: there is no factor. */
bool tabulated_level_solve(struct tabulated_level *level, double lambda, double curvature,
                           const double *rhs, double *step, double *expected);

/* ---- What earlier steps tell (secant.c) ------------------------------------------------------ */

#define SECANT_PAIRS ((size_t)5)
struct secant_pair {
    double *step, *change; /* of the right-hand side by it */
    double product, share;
};
struct secant {
    size_t n, count;
    double *memory;
    struct secant_pair pairs[SECANT_PAIRS];
};
/* Of so many unknowns; empty. */
SRNF_CHECKED int secant_create(struct secant *secant, size_t n);
void secant_clear(struct secant *secant);
void secant_forget(struct secant *secant);
/* A step, and the right-hand sides before and after it; nothing where the objective is not convex
   along it. */
void secant_add(struct secant *secant, const double *step, const double *before,
                const double *after);
/* In place, before and after the matrix is solved. */
void secant_before(struct secant *secant, double *rhs);
void secant_after(const struct secant *secant, double *step);

/* ---- Optimization (tabulated_optimize.c) ----------------------------------------------------- */

struct landmark_track;

struct tabulated_optimizer {
    const struct tabulated_problem *problem;
    struct tabulated_fields *fields;
    struct tabulated_level *level;
    struct cloud *spare; /* of as many points; holds nothing afterwards */
    const struct srnf_context *context;
    struct landmark_track *track;   /* landmarks.h; the objective of the cloud is without them */
    struct tabulated_fields *loads; /* whose table right-hand sides are spread over; NULL: fields */
    double limit; /* of the objective: what will not come below it is given up; 0: none */
};
/* registration_optimize. cloud: evaluated and measured, before and after; chain: what made its
   points, grows by each step. */
SRNF_CHECKED int tabulated_optimize(const struct tabulated_optimizer *o,
                                    const struct schedule *schedule, struct cloud *cloud,
                                    struct srnf_warp *chain, enum srnf_register_stop *stopped,
                                    size_t *iterations);

#endif
