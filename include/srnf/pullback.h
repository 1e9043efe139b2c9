/*
 * pullback.h - the metric pulled back by Q to the space of surfaces (core/pullback).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * <<v, w>>_f = <Q_*f(v), Q_*f(w)>: the length of a path of surfaces is that of its SRNFs in L2. Its
 * geodesics stay in the space of surfaces, which the straight line in L2 leaves; its distance is
 * therefore the larger one. This is the framework that the paper compares with (Algorithms 1, 3 and
 * 5). Surfaces are compared as they are parameterized: register them first. Vectors, that is
 * velocities of surfaces, are double[3][(L+1)^2] like surfaces; their l = 0 terms are translations,
 * which the metric does not see and everything here carries along unchanged.
 *
 * Everything returns SRNF_EINVAL (the message says what), SRNF_ENOMEM, SRNF_ECANCELED, and
 * SRNF_ENUMERIC where an energy is not finite; results are then empty. Surfaces of a path or a mean
 * are worked on in parallel through the context, with the same bits on any number of threads.
 */
#ifndef SRNF_PUBLIC_PULLBACK_H
#define SRNF_PUBLIC_PULLBACK_H

#include "srnf/shape.h"
#include "srnf/sphere.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

#define SRNF_PULLBACK_SEGMENTS_MAX ((size_t)100)

/* A path of m + 1 surfaces at equal times, by its fields q_k. */
struct srnf_path_figures {
    double energy;          /* m sum ||q_k+1 - q_k||^2, at least length^2 */
    double length;          /* sum ||q_k+1 - q_k|| */
    double speed_variation; /* standard deviation of the ||q_k+1 - q_k|| over their mean */
};

struct srnf_pullback_options {
    size_t segments;       /* m, 2 .. SRNF_PULLBACK_SEGMENTS_MAX; default 8 */
    bool halving;          /* path solved with a few segments first, halved up to m; default false:
                              from the straight line between the surfaces at once */
    double tolerance;      /* stop when a step lowers the energy by less than this part; default
                              1e-6 */
    double gradient;       /* above 0: go on until the relative gradient is below this, whatever the
                              energy does; 1e-9 is what srnf_pullback_log asks for. Default 0 */
    size_t max_iterations; /* at each number of segments; default 100 */
    bool compare; /* the inverted straight line too, which costs about as much; default true */
};
struct srnf_pullback_options srnf_pullback_options_defaults(void);

struct srnf_pullback_geodesic {
    size_t degree, steps;              /* steps = m + 1 surfaces */
    double *coefficients;              /* [steps][3][(L+1)^2], both ends included */
    double *times;                     /* [steps], 0 to 1 */
    double *speeds;                    /* [m] m ||q_k+1 - q_k|| */
    struct srnf_path_figures path;     /* of the surfaces returned */
    struct srnf_path_figures linear;   /* of (1 - t) f_0 + t f_1 */
    struct srnf_path_figures inverted; /* of srnf_geodesic's path; all 0 unless asked for */
    double distance;                   /* ||q_1 - q_0||: at most path.length */
    double gradient;                   /* relative: sqrt(<g, P g> / E), core/pullback/solve.c */
    size_t iterations;
    bool converged;
    double transforms; /* of the path alone */
};

/*
 * Geodesic between two surfaces by path-straightening with fixed ends (the paper, Algorithm 1,
 * section 4.1): the path of m segments with the least energy near the start.
 *   from, to  [in] double[3][(L+1)^2]
 * Returns SRNF_OK or SRNF_WNOT_CONVERGED (result valid, converged false). No minimum is certified
 * to be the global one: pairs that lie far apart can have several.
 */
SRNF_CHECKED int srnf_pullback_geodesic(const struct srnf_sht *sht, const double *from,
                                        const double *to,
                                        const struct srnf_pullback_options *options,
                                        const struct srnf_context *context,
                                        struct srnf_pullback_geodesic *result,
                                        struct srnf_error *error);
void srnf_pullback_geodesic_clear(struct srnf_pullback_geodesic *result);

/*
 * The same geodesic with the curves of srnf_geodesic beside it. Progress is that of the geodesic.
 *   curves  [out] as srnf_geodesic has it by SRNF_GEODESIC_LINEAR, but for the surfaces, their
 *                 energy_geodesic and their length, which are those of the path; transforms are
 *                 those of both. Freed with srnf_geodesic_clear; empty on failure
 * Returns as srnf_pullback_geodesic.
 */
SRNF_CHECKED int srnf_pullback_curves(const struct srnf_sht *sht, const double *from,
                                      const double *to, const struct srnf_pullback_options *options,
                                      const struct srnf_context *context,
                                      struct srnf_geodesic *curves,
                                      struct srnf_pullback_geodesic *result,
                                      struct srnf_error *error);

/* The path that a logarithm was taken from. */
struct srnf_pullback_log_figures {
    struct srnf_path_figures path;
    double gradient; /* relative, as of srnf_pullback_geodesic */
    size_t iterations;
    double transforms;
};

/*
 * Logarithm: the velocity at `from` of the geodesic to `to`, m (f_1 - f_0) of the path of m
 * segments, solved until the relative gradient is 1e-9 unless options say otherwise. It differs
 * from that of the continuous geodesic by O(1 / m), and is the one that srnf_pullback_exp with the
 * same m takes back to `to`.
 *   velocity  [out] double[3][(L+1)^2]
 *   figures   [out] of the path; NULL: not wanted
 * Returns SRNF_OK or SRNF_WNOT_CONVERGED (velocity valid, the gradient above what was asked for).
 */
SRNF_CHECKED int srnf_pullback_log(const struct srnf_sht *sht, const double *from, const double *to,
                                   const struct srnf_pullback_options *options,
                                   const struct srnf_context *context, double *velocity,
                                   struct srnf_pullback_log_figures *figures,
                                   struct srnf_error *error);

struct srnf_pullback_shot {
    size_t degree, steps; /* steps = m + 1 surfaces */
    double *coefficients; /* [steps][3][(L+1)^2]; the last one is the exponential */
    double *times;        /* [steps], 0 to 1 */
    struct srnf_path_figures path;
    double residual;   /* the largest of the equations' relative residuals */
    size_t iterations; /* Newton steps in all */
    double transforms;
};

/*
 * Exponential map: m steps of the discrete geodesic that starts with f_1 = f_0 + velocity / m (the
 * paper, Algorithm 3). Each next surface solves J_k' (q_k+1 - 2 q_k + q_k-1) = 0: no tangential
 * acceleration.
 *   segments  [in] m, 2 .. SRNF_PULLBACK_SEGMENTS_MAX
 * Returns SRNF_OK or SRNF_WNOT_CONVERGED (a step's equation was left with a residual above 1e-8).
 */
SRNF_CHECKED int srnf_pullback_exp(const struct srnf_sht *sht, const double *from,
                                   const double *velocity, size_t segments,
                                   const struct srnf_context *context,
                                   struct srnf_pullback_shot *result, struct srnf_error *error);
void srnf_pullback_shot_clear(struct srnf_pullback_shot *result);

struct srnf_pullback_transported {
    double *vector;   /* [3][(L+1)^2] at the last surface; owned, srnf_free */
    double norm_from; /* of the vector given, in the metric at the first surface */
    double norm;      /* of the one returned, at the last surface: equal but for O(1/m^3) */
    double transforms;
};

/*
 * Parallel transport of a vector along a path, by reflection in the tangent spaces midway: w' = 2
 * P_k+1 w - w, projected to the tangent space of k + 2 (the paper, Algorithm 3, with the error of
 * second order in the number of segments instead of the first).
 *   path    [in] double[segments + 1][3][(L+1)^2], as of srnf_pullback_geodesic
 *   vector  [in] double[3][(L+1)^2] at path[0]
 *   segments     even, 2 .. SRNF_PULLBACK_SEGMENTS_MAX; 16 for 1e-3
 */
SRNF_CHECKED int srnf_pullback_transport(const struct srnf_sht *sht, size_t segments,
                                         const double *path, const double *vector,
                                         const struct srnf_context *context,
                                         struct srnf_pullback_transported *result,
                                         struct srnf_error *error);

struct srnf_pullback_transfer {
    double *coefficients;   /* [3][(L+1)^2] the target, deformed; owned, srnf_free */
    double *velocity;       /* [3][(L+1)^2] at the target; in the same allocation */
    double deformation;     /* length of the geodesic from source to deformed */
    double distance;        /* length of the geodesic from source to target */
    double norm_from, norm; /* of the velocity at the source and at the target */
    bool converged;         /* both geodesics and the exponential */
    double transforms;
};

/*
 * Deformation transfer (the paper, Algorithm 5): the initial velocity of the geodesic from source
 * to deformed is transported along the geodesic from source to target, and followed from there.
 * segments of options must be even. Returns SRNF_OK or SRNF_WNOT_CONVERGED.
 */
SRNF_CHECKED int srnf_pullback_transfer(const struct srnf_sht *sht, const double *source,
                                        const double *deformed, const double *target,
                                        const struct srnf_pullback_options *options,
                                        const struct srnf_context *context,
                                        struct srnf_pullback_transfer *result,
                                        struct srnf_error *error);
void srnf_pullback_transfer_clear(struct srnf_pullback_transfer *result);

enum srnf_pullback_mean_method {
    SRNF_PULLBACK_MEAN_GRAPH = 0,   /* all geodesics and their common end at once */
    SRNF_PULLBACK_MEAN_LOG_EXP = 1, /* the paper's: average of the logarithms, a step along it */
};

struct srnf_pullback_mean_options {
    enum srnf_pullback_mean_method method;
    size_t segments;       /* of each geodesic; default 8, 2 .. SRNF_PULLBACK_SEGMENTS_MAX */
    double tolerance;      /* graph: as of a path, default 1e-7. log-exp: on the norm of the mean
                              velocity, relative to the root of the variance, default 1e-3 */
    size_t max_iterations; /* default 100 (graph), 20 (log-exp) */
};
struct srnf_pullback_mean_options
srnf_pullback_mean_defaults(enum srnf_pullback_mean_method method);

struct srnf_pullback_mean {
    size_t n;
    double *coefficients; /* [3][(L+1)^2] the mean surface */
    double *extrinsic;    /* [3][(L+1)^2] the plain mean of the q, inverted: what it started from */
    double *distances;    /* [n] lengths of the geodesics to the mean */
    double variance;      /* mean squared distance */
    double mean_velocity; /* norm of the mean of the logarithms at the mean: 0 at a minimum */
    double moved;         /* ||Q(mean) - Q(extrinsic)|| */
    size_t iterations;
    bool converged, stalled; /* stalled: log-exp, the mean velocity no longer falls */
    double *history; /* [iterations] mean velocity before each step (log-exp); NULL (graph) */
    double transforms;
};

/*
 * Karcher mean: the surface with the least sum of squared lengths of geodesics (of m segments) to
 * all. Both methods start from the extrinsic mean.
 *   surfaces  [in] n pointers to double[3][(L+1)^2], registered to one another
 * Returns SRNF_OK or SRNF_WNOT_CONVERGED. Memory of the graph: some 200 P n m bytes, P the points
 * of the grid.
 */
SRNF_CHECKED int srnf_pullback_mean(const struct srnf_sht *sht, size_t n,
                                    const double *const *surfaces,
                                    const struct srnf_pullback_mean_options *options,
                                    const struct srnf_context *context,
                                    struct srnf_pullback_mean *mean, struct srnf_error *error);
void srnf_pullback_mean_clear(struct srnf_pullback_mean *mean);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
