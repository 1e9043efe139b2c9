/*
 * register.h - elastic registration of two surfaces (core/registration).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_REGISTER_H
#define SRNF_PUBLIC_REGISTER_H

#include "srnf/base.h"
#include "srnf/mesh.h"
#include "srnf/sphere.h"
#include "srnf/shape.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum srnf_register_start {
    SRNF_START_TOURNAMENT = 0, /* many rotations, narrowed down while the fields grow */
    SRNF_START_RIGID = 1,      /* the best rotation, refined */
    SRNF_START_IDENTITY = 2,
};

struct srnf_register_options {
    enum srnf_representation representation; /* what is matched; default the SRNF */
    bool rotation;                           /* turn the values; default true */
    bool reparameterization; /* warp the domain; default true. false: rotations of the domain only
                                where start is not identity */
    size_t degree;           /* of the fields that generate the warp, 1 .. 32; default 12. Above 8
                                a field of degree 20 may stand for the first steps */
    double penalty_jacobian; /* weight of integral (1 + J) (log J)^4; default 0.003 */
    double penalty_displacement; /* weight of min integral |e - O' sqrt(J) gamma|^2; default 0.01 */
    enum srnf_register_start start;
    bool common_pose; /* the data share a pose: no rotation anywhere, start identity */
    bool symmetric;   /* both ways, the lower objective, refined: equal for (a, b) and (b, a) */
    bool exact;       /* no penalty, up to degree 32: for surfaces that differ by a warp alone */
    size_t max_steps; /* at most so many for each degree of fields; 0, the default: 120, or 40
                         in exact mode and of surfaces that are nearly the same */
};
struct srnf_register_options srnf_register_options_defaults(void);

/* Why a registration went no further, at the highest degree of its fields, each reason worse than
   the one before. All but SRNF_REGISTER_MAX_ITERATIONS are the end of what can be gained there. Of
   several searches of that degree (symmetric; the two sides of exact) it is the worst, unless the
   registration that is kept is one to rounding. Both ways of symmetric are followed so far up to
   degree 8, with landmarks, in exact mode and from a rigid start, else the better one alone. */
enum srnf_register_stop {
    SRNF_REGISTER_DIRECT = 0,     /* no search: a warp as given, values turned in closed form */
    SRNF_REGISTER_TOLERANCE = 1,  /* registered to rounding: squared distance / ||q1||^2 < 1e-13 */
    SRNF_REGISTER_STATIONARY = 2, /* the last steps gained less than the part that ends a degree */
    SRNF_REGISTER_REFUSED = 3,    /* no step, however short, lowers the objective any more */
    SRNF_REGISTER_MAX_ITERATIONS = 4, /* max_steps, while the objective still fell */
};
/* "direct", "tolerance", "stationary", "stepRefused", "maxIterations", or "unknown". */
const char *srnf_register_stop_name(enum srnf_register_stop stop);

/* A warp gamma as a chain of maps, applied in order: enough to replay it on any points. */
enum srnf_warp_kind {
    SRNF_WARP_ROTATION = 0,    /* values: double[9], row-major */
    SRNF_WARP_EXP = 1,         /* p -> exp_p(w(p)), w = grad phi + p x grad psi; values:
                                  double[2][(degree+1)^2], phi and psi */
    SRNF_WARP_EXP_INVERSE = 2, /* the inverse of that map */
    SRNF_WARP_SERIES = 3,      /* p -> g(p) / |g(p)|, g harmonic series in R^3; values:
                                  double[3][(degree+1)^2]. srnf_warp_between makes it */
};
struct srnf_warp_link {
    enum srnf_warp_kind kind;
    size_t degree;
    double *values;
};
struct srnf_warp {
    size_t n_links, capacity;
    struct srnf_warp_link *links;
};
void srnf_warp_clear(struct srnf_warp *warp);
/* gamma at points [n][3], and its Jacobian [n] (or NULL). Errors: SRNF_ENOMEM, SRNF_ENUMERIC. */
SRNF_CHECKED int srnf_warp_apply(const struct srnf_warp *warp, size_t n, const double *points,
                                 double *warped, double *jacobian);

/*
 * The warp between two maps of one mesh to the sphere: with f_from and f_to the surface by either,
 * f_from = f_to o gamma (core/registration/known.c).
 *   mesh      [in]  faces and the number of vertices are used
 *   from, to  [in]  double[n_vertices][3]: where each vertex goes, as a vector from the centre of
 *                   any length; both bijections, as of srnf_encode_points
 *   degree    [in]  of the series that stands for gamma, 1 .. 255
 *   context   [in]  cancellation, or NULL
 *   warp      [out] one link; srnf_warp_clear
 * Errors: SRNF_EINVAL (degree), SRNF_ENUMERIC (from leaves a direction uncovered, or the series
 * folds), SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_warp_between(const struct srnf_mesh *mesh, const double *from,
                                   const double *to, size_t degree,
                                   const struct srnf_context *context, struct srnf_warp *warp);
/* Appends copies of the links of `more`, which are applied after those of warp. Errors:
   SRNF_ENOMEM, with a part of them appended. */
SRNF_CHECKED int srnf_warp_join(const struct srnf_warp *more, struct srnf_warp *warp);

struct srnf_registration {
    double *coefficients; /* [3][(L+1)^2] of O f2 o gamma, analysed to the degree of the pair */
    double *q;          /* [3][n_theta][n_phi] O sqrt(J) q2 o gamma on the template's grid, exact */
    double rotation[9]; /* O, row-major */
    struct srnf_warp warp;
    double *points;         /* [n_theta][n_phi][3] gamma on the template's grid */
    double *jacobian;       /* [n_theta][n_phi] */
    double distance;        /* ||q1 - O sqrt(J) q2 o gamma||, on the search's grid */
    double distance_before; /* ||q1 - q2|| */
    double objective;       /* distance^2 / ||q1||^2 + penalties; symmetric: / (||q1|| ||q2||) */
    double min_jacobian, max_jacobian; /* between the nodes of the search's grid too */
    double inverse_consistency; /* symmetric only: relative gap of the objectives of the two ways,
                                   each in its basin and before the better one goes on */
    bool rotations_searched;    /* the next three are known: no identity start, no warm start */
    double
        ambiguity_objective; /* objective of the best start in another basin / the best; 0: none */
    double ambiguity_angle;  /* rms angle between the two maps, radians */
    double
        rotational_curvature;   /* smallest eigenvalue of the energy over rotations of the domain */
    double truncation_error;    /* truncation_distance relative to ||q|| */
    double truncation_distance; /* ||q of coefficients - q|| */
    size_t iterations;          /* of all starts, degrees and directions */
    bool converged;             /* stopped is not SRNF_REGISTER_MAX_ITERATIONS */
    enum srnf_register_stop stopped;
};
void srnf_registration_clear(struct srnf_registration *registration);

/*
 * Registers a moving surface to a template: min over O in SO(3) and gamma in Diff+(S^2) of
 * ||q1 - O (q2, gamma)|| with penalties (core/registration/registration.h). Every accepted step
 * keeps orientation.
 *   sht               [in] degree and grid of both surfaces
 *   template_surface  [in] double[3][(L+1)^2], or NULL when template_q is given
 *   template_q        [in] double[3][n_theta][n_phi], or NULL: from template_surface
 *   moving            [in] double[3][(L+1)^2]
 *   warm              [in] a registration of the same pair to start from, or NULL
 * Errors: SRNF_EINVAL, SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED. symmetric needs
 * template_surface.
 */
SRNF_CHECKED int srnf_register(const struct srnf_sht *sht, const double *template_surface,
                               const double *template_q, const double *moving,
                               const struct srnf_register_options *options,
                               const struct srnf_registration *warm,
                               const struct srnf_context *context,
                               struct srnf_registration *registration, struct srnf_error *error);

/*
 * The same report for a warp that is known: nothing is searched, only the rotation of the values
 * (unless fixed). min_jacobian tells whether the warp keeps orientation.
 *   warp  [in] gamma; copied
 * Errors: as srnf_register; SRNF_EINVAL also where warp has no links.
 */
SRNF_CHECKED int
srnf_register_known(const struct srnf_sht *sht, const double *template_surface,
                    const double *moving, const struct srnf_register_options *options,
                    const struct srnf_warp *warp, const struct srnf_context *context,
                    struct srnf_registration *registration, struct srnf_error *error);

/*
 * The search of a registration alone, to a field that need not be the SRNF of a surface: rotation
 * and warp, nothing measured (core/registration/field.c).
 *   sht       [in]  degree of the moving surface, and grid of the field
 *   field     [in]  double[3][n_theta][n_phi]
 *   norm2     [in]  what energies are relative to: that of the registration problem; 0: ||field||^2
 *   moving    [in]  double[3][(L+1)^2]
 *   options   [in]  not symmetric
 *   context   [in]  cancellation, or NULL
 *   rotation  [out] double[9], row-major
 *   warp      [out] srnf_warp_clear
 * Errors: SRNF_EINVAL, SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_register_to_field(const struct srnf_sht *sht, const double *field,
                                        double norm2, const double *moving,
                                        const struct srnf_register_options *options,
                                        const struct srnf_context *context, double rotation[9],
                                        struct srnf_warp *warp, struct srnf_error *error);

struct srnf_landmarks; /* srnf/landmarks.h */

/* Many such searches to one field, for srnf_context.search. */
struct srnf_field_search {
    const struct srnf_sht *sht;
    const double *field;
    double norm2;
    const struct srnf_register_options *options;
    size_t n;
    const double *const *surfaces; /* [n] */
    double from, to;               /* of the progress of the computation that they are part of */
    /* Takes what was found of surface i; the links of warp become its own. SRNF_OK, or an error
       that ends the search. */
    int (*take)(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp);
    /* The landmarks that guide surface i, all of as many, with the same fixed points and weight;
       NULL: none do. Where there are some, a surface may be unable to meet its own: then unmet is
       called with the reason (SRNF_EUNMATCHED) instead of take. */
    void (*landmarks)(void *argument, size_t i, struct srnf_landmarks *landmarks);
    int (*unmet)(void *argument, size_t i, const struct srnf_error *why);
    void *argument;
};

/*
 * Lays something else along with the surface that was registered: out = O f o gamma, analysed to
 * the degree of sht. For surfaces in the parameterization and pose of the moving one (its
 * deformations), and for vectors on it (motions of its points): both transform in the same way, and
 * linearly.
 *   sht           [in]  that of the registration
 *   coefficients  [in]  double[3][(L+1)^2]
 *   context       [in]  cancellation, or NULL
 *   out           [out] double[3][(L+1)^2], may be coefficients
 * Errors: SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_registration_apply(const struct srnf_sht *sht,
                                         const struct srnf_registration *registration,
                                         const double *coefficients,
                                         const struct srnf_context *context, double *out);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
