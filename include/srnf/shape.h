/*
 * shape.h - SRNFs, their differential, inversion, geodesics (core/srnf, core/inversion,
 * core/geodesic).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_SHAPE_H
#define SRNF_PUBLIC_SHAPE_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/surface.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/*
 * SRNF of a surface on the grid of sht: q double[3][n_theta][n_phi]. workspace as for
 * srnf_surface_measure. The degree of sht is the degree of the surface.
 */
void srnf_field(const struct srnf_sht *sht, const double *coefficients, double *q, void *workspace);

/* Fields that stand for a surface. gamma acts on both as (q, gamma) = sqrt(J) q o gamma, isometric
   in L2, and a rotation as q -> O q. */
enum srnf_representation {
    SRNF_REPRESENTATION_SRNF = 0, /* q = n / |n|^(1/2): translations drop out */
    SRNF_REPRESENTATION_SRM = 1,  /* q = |n|^(1/2) f, the square-root map: f has to be centred */
};

/*
 * The square-root map (S. Kurtek, E. Klassen, Z. Ding, A. Srivastava, "A novel Riemannian framework
 * for shape analysis of 3D objects", CVPR 2010): q = |n|^(1/2) f on the grid of sht,
 * double[3][n_theta][n_phi]. workspace as for srnf_field.
 */
void srnf_square_root_map(const struct srnf_sht *sht, const double *coefficients, double *q,
                          void *workspace);

/*
 * The differential Q_*f(w) (the paper, section 3; formula in core/README.md): out
 * double[3][n_theta][n_phi]. Where n = 0 the differential does not exist and 0 is returned.
 */
void srnf_field_differential(const struct srnf_sht *sht, const double *coefficients,
                             const double *direction, double *out, void *workspace);

/*
 * E(f) = ||Q(f) - q||^2 and, when gradient is not NULL, its derivative in the coefficients,
 * double[3][(L+1)^2] (the paper, Eq. 1 to 5, in the orthonormal basis).
 */
double srnf_energy(const struct srnf_sht *sht, const double *coefficients, const double *q,
                   double *gradient, void *workspace);

/* integral of <a, b> over the sphere, a and b double[3][n_theta][n_phi]. */
double srnf_inner_product(const struct srnf_grid *grid, const double *a, const double *b);

/*
 * Closed-form inverse (the paper, Eq. 9): r = sqrt(|q| <q, e>), f = r e, analysed to the degree of
 * sht. Exact to rounding when q is the SRNF of a star-shaped surface in its radial parameterization
 * about any centre with r of degree L - 1; anything else must be checked with srnf_energy. Where
 * <q, e> < 0, r = 0.
 *   relative_energy [out] E(f) / ||q||^2; 1 when q = 0
 */
void srnf_invert_closed_form(const struct srnf_sht *sht, const double *q, double *coefficients,
                             double *relative_energy, void *workspace);

/* The closed form applies to q where its relative energy is at most this: its SRNF is then q to
   1 %. Of 15 real surfaces (brain structures, ventricles, asteroids; degrees 8 to 31) it is below
   1e-26 in the radial parameterization, where there is one, and 1.4 to 1.7 by area. */
#define SRNF_CLOSED_FORM_APPLIES 1e-4

enum srnf_inversion_method {
    SRNF_INVERT_AUTO = 0,
    SRNF_INVERT_GAUSS_NEWTON = 1,
    SRNF_INVERT_SPECTRAL = 2,
    SRNF_INVERT_GRADIENT = 3,
    SRNF_INVERT_CLOSED_FORM = 4,
};

enum srnf_initial {
    SRNF_INITIAL_AUTO = 0,    /* the closed form where it is good, the sphere otherwise */
    SRNF_INITIAL_SPHERE = 1,  /* R e with R in SO(3) maximizing <R e, q>, at the area of q */
    SRNF_INITIAL_STAR = 2,    /* the closed form */
    SRNF_INITIAL_SURFACE = 3, /* coefficients given */
};

enum srnf_stop {
    SRNF_STOP_TOLERANCE = 0,  /* relative energy at or below the tolerance */
    SRNF_STOP_STATIONARY = 1, /* the energy no longer falls: a minimum with positive energy */
    SRNF_STOP_MAX_ITERATIONS = 2,
    SRNF_STOP_CANCELED = 3,    /* of no result: the call answers SRNF_ECANCELED */
    SRNF_STOP_CLOSED_FORM = 4, /* the closed form was asked for, as it is: no search */
};
const char *srnf_stop_name(enum srnf_stop stop);

struct srnf_invert_options {
    enum srnf_inversion_method method;
    enum srnf_initial initial;
    const double *surface; /* [3][(L+1)^2] for SRNF_INITIAL_SURFACE */
    double tolerance;      /* on the relative energy; default 1e-12, 1e-30 .. 1 */
    /* Of iterations, see struct srnf_inversion: of all searches together. A step that is refused is
       still tried again, some 25 times at most. The eigenproblem has no such limit. 0: the
       method's own (LM 200 steps, gradient 20,000). */
    size_t max_iterations;
    bool certify; /* singular value and certificate too (costly above degree 31); default true */
};
struct srnf_invert_options srnf_invert_options_defaults(void);
struct srnf_iteration {
    double energy;     /* raw E */
    double seconds;    /* since the start, by context->seconds */
    double transforms; /* cost so far in gradient transforms of three coordinates */
};

#define SRNF_CERTIFIED_DEGREE_MAX 31 /* beyond it no certificate is computed */

struct srnf_certificate {
    bool computed;   /* false: too large, not asked for, not converged, or q not exact */
    double residual; /* smallest eigenvalue of T against int |grad f|^2, in [0, 1], at the result */
    double second_eigenvalue; /* the next one; where it is at or below the threshold, a bound on it
                                 from above; 0 where it drowned in rounding */
    double threshold;         /* what it must exceed to mean anything */
    bool unique; /* the surface is the only one of its degree, up to sign and translation */
};

struct srnf_inversion {
    double *coefficients; /* [3][(L+1)^2], positive volume, l = 0 terms 0; owned, srnf_free */
    double energy, relative_energy;
    double gradient_norm; /* of E in the coefficients */
    /* Steps tried, accepted or refused: of all searches of the method, and those that take a
       solution on beyond the tolerance. The work of the eigenproblem is in transforms alone. */
    size_t iterations;
    bool converged;
    enum srnf_stop stopped;
    enum srnf_inversion_method method; /* that produced the result */
    /* The start, each step accepted, and each surface of the eigenproblem that was kept:
       n_history - 1 may be less than iterations, or more. Owned. */
    size_t n_history;
    struct srnf_iteration *history;
    double transforms;
    bool flipped;                   /* -f was found first and turned */
    double smallest_singular_value; /* of Q_* off the translations; 0: not computed */
    double surface_error_bound; /* L2 distance to the true surface, see core/README.md; < 0: none */
    struct srnf_certificate certificate;
    double closed_form_relative_energy; /* means nothing above SRNF_CLOSED_FORM_APPLIES */
};

/*
 * Finds f with Q(f) = q (recipe and theory in core/README.md).
 *   sht      [in]  degree and grid
 *   q        [in]  double[3][n_theta][n_phi]
 * Returns SRNF_OK, SRNF_WNOT_CONVERGED (result valid, converged false), or SRNF_EINVAL (q is 0 or
 * not finite), SRNF_ENOMEM, SRNF_ECANCELED, SRNF_ENUMERIC.
 */
SRNF_CHECKED int srnf_invert(const struct srnf_sht *sht, const double *q,
                             const struct srnf_invert_options *options,
                             const struct srnf_context *context, struct srnf_inversion *result,
                             struct srnf_error *error);
void srnf_inversion_clear(struct srnf_inversion *result);

enum srnf_geodesic_method {
    SRNF_GEODESIC_SRNF = 0,        /* each point of the straight line in Q inverted numerically */
    SRNF_GEODESIC_CLOSED_FORM = 1, /* ... by the closed form */
    SRNF_GEODESIC_LINEAR = 2,      /* straight line between the surfaces */
};

struct srnf_geodesic_options {
    enum srnf_geodesic_method method;
    size_t steps; /* surfaces, both ends included; 2 .. 101, default 7 */
};
struct srnf_geodesic_options srnf_geodesic_options_defaults(void);
struct srnf_geodesic {
    size_t degree, steps;
    double *coefficients;       /* [steps][3][(L+1)^2] */
    double *times;              /* [steps], 0 to 1 */
    double *energy_geodesic;    /* [steps] ||Q(f_t) - q_t||^2 of the surfaces returned */
    double *energy_closed_form; /* [steps] the same of the closed form (the paper, Fig. 4) */
    bool closed_form_applies;   /* to both ends (SRNF_CLOSED_FORM_APPLIES); false:
                                   energy_closed_form is of surfaces that have nothing to do with
                                   the ends */
    double *energy_linear;      /* [steps] the same of (1 - t) f_0 + t f_1 */
    double distance;            /* ||Q(f_0) - Q(f_1)||: the length of the straight line in Q */
    double length;              /* sum of ||Q(f_i+1) - Q(f_i)|| along the surfaces returned */
    double transforms;
};

/*
 * Geodesic between two surfaces as they are parameterized (the paper, section 4.1). The points are
 * inverted in order; each starts from the best of the path extrapolated so far, the linear blend
 * and the closed form.
 *   from, to  [in] double[3][(L+1)^2]
 * Errors as srnf_invert. The result is freed with srnf_geodesic_clear.
 */
SRNF_CHECKED int srnf_geodesic(const struct srnf_sht *sht, const double *from, const double *to,
                               const struct srnf_geodesic_options *options,
                               const struct srnf_context *context, struct srnf_geodesic *result,
                               struct srnf_error *error);
void srnf_geodesic_clear(struct srnf_geodesic *result);

/*
 * Moves the surfaces between the ends so that area centroids lie on the straight line between those
 * of the ends: an SRNF knows no translations. The ends stay as they are.
 *   measures  [in/out] [steps], of the surfaces of the path
 */
void srnf_geodesic_place(struct srnf_geodesic *geodesic, struct srnf_surface_measures *measures);
/*
 * ||q_t||^2 on the straight line q_t = (1 - t) q_0 + t q_1, by which the energies are made
 * relative: (1 - t)^2 a_0 + t^2 a_1 + t (1 - t) (a_0 + a_1 - d^2), with the areas a_0, a_1 of the
 * ends and their distance d.
 *   squared_norms  [out] [steps]
 */
void srnf_geodesic_squared_norms(const struct srnf_geodesic *geodesic, double area_from,
                                 double area_to, double *squared_norms);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
