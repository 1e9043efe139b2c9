/*
 * landmarks.h - registration that is guided by landmarks: gamma should take a_j, points of the
 * template's sphere, to b_j, points of the moving surface's.
 *
 * A left step gamma <- exp(w) o gamma moves the image p_j = gamma(a_j) along w(p_j). With A the
 * matrix that takes the unknowns c of a step to the tangent vectors w(p_j), in an orthonormal frame
 * at each p_j, and r the logarithms of b_j at p_j, the term nu sum_j angle_j^2 is nu |A c - r|^2 to
 * first order, and exp moves p_j to b_j in one step if w(p_j) = r_j. With M the damped Gauss-Newton
 * matrix of the other terms, and c_u = M^-1 rhs the step without landmarks, the step with them is
 *
 *   c = c_u - M^-1 A' (A M^-1 A' + 1 / nu)^-1 (A c_u - r).
 *
 * For nu -> infinity it minimizes the other terms among the steps that meet the landmarks: then 1 /
 * nu = 0. A and r follow the points, but M does not depend on gamma: its factors serve as ever.
 * This is S. Kurtek, A. Srivastava, E. Klassen, H. Laga, "Landmark-guided elastic shape analysis of
 * spherically-parameterized surfaces", Computer Graphics Forum 32 (2013) - first match the
 * landmarks, then move among the warps that keep them - with Newton steps for both.
 */
#ifndef SRNF_REGISTRATION_LANDMARKS_H
#define SRNF_REGISTRATION_LANDMARKS_H

#include "registration.h"
#include "srnf/landmarks.h"

/* Landmarks of a search, in its own direction. */
struct landmark_search {
    struct srnf_landmarks pairs;
    size_t worst; /* the landmark that was farthest off where the last match failed */
};

/* The points p_j through the steps of one degree of fields. */
struct landmark_track {
    const struct srnf_landmarks *landmarks;
    double weight; /* nu; 0: exact */
    size_t unknowns;
    struct fields fields;
    double *memory;
    double *at, *next; /* [n][3] p_j, and where the step that is tried takes them */
    double *rows;      /* [2 n][unknowns] A */
    double *residual;  /* [2 n] r */
    double *solved;    /* [2 n][unknowns] M^-1 A' */
    double *schur;     /* [2 n][2 n] */
    double *gap;       /* [2 n] */
    double *scratch;
};
/* Landmarks of a search at the end of a chain, to be moved by fields of a degree. */
SRNF_CHECKED int landmark_track_create(struct landmark_track *track,
                                       const struct srnf_landmarks *landmarks,
                                       const struct srnf_warp *chain, size_t degree,
                                       const struct srnf_context *context);
void landmark_track_clear(struct landmark_track *track);
/* A and r where the points are. */
void landmark_track_linearize(struct landmark_track *track);
/* out <- M^-1 rhs, [unknowns]; false where M has no factor. */
typedef bool landmark_solver(void *system, const double *rhs, double *out);
/*
 * From the step without landmarks to that with them.
 *   part     [in]     of r that is to be met, up to 1
 *   step     [in/out] [unknowns]
 *   promise  [out]    what the landmarks' own term is expected to fall by, and their part of what
 *                     the others are; or NULL
 * False where the rows of A are not independent, or M has no factor.
 */
bool landmark_track_correct(struct landmark_track *track, landmark_solver *solve, void *system,
                            double part, double *step, double *promise);
/* next <- exp(w) of the points; returns what the landmarks cost there: nu sum angle^2. */
double landmark_track_try(struct landmark_track *track, const double *potentials);
void landmark_track_accept(struct landmark_track *track);
/* What they cost where they are. */
double landmark_track_cost(const struct landmark_track *track);

/* nu sum angle^2 at the end of a chain; 0 for exact ones. */
SRNF_CHECKED int landmarks_cost(const struct srnf_landmarks *landmarks,
                                const struct srnf_warp *chain, double *cost);
/* The angle between two unit vectors. */
double landmarks_angle(const double a[3], const double b[3]);
/* Whether no two of n unit vectors are within SRNF_LANDMARKS_APART of each other. */
bool landmarks_apart(size_t n, const double *points);
/* An orthonormal frame of the tangent plane at p. */
void landmarks_frame(const double p[3], double t1[3], double t2[3]);
/* Coordinates in the frame of the shortest tangent vector from p to b. */
void landmarks_logarithm(const double p[3], const double b[3], const double t1[3],
                         const double t2[3], double out[2]);

/* Lengthens the chain by steps of fields of the search's degree until its landmarks are met.
   SRNF_EUNMATCHED where that would fold or pinch the sphere (landmarks_match.c). */
SRNF_CHECKED int landmarks_match(const struct search *search, struct srnf_warp *chain);
/* Whether a chain meets them; otherwise SRNF_EUNMATCHED. */
SRNF_CHECKED int landmarks_met(const struct search *search, const struct srnf_warp *chain);
/* Names the one that was farthest off; returns SRNF_EUNMATCHED. */
int landmarks_fail(const struct landmark_search *landmarks, struct srnf_error *error);

/* Rotations of the domain that bring the landmarks near, most promising first. Where all lie about
   one axis, the best of the turns about it. Returns their number (landmarks_start.c). */
#define LANDMARK_STARTS ((size_t)2)
SRNF_CHECKED int landmarks_start(const struct search *search, double rotations[LANDMARK_STARTS][9],
                                 size_t *count);

#endif
