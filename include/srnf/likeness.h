/*
 * likeness.h - do the members of a group belong together? What the distances between them, and
 * matches of two of them, say about it. (core/stats)
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_LIKENESS_H
#define SRNF_PUBLIC_LIKENESS_H

#include "srnf/base.h"
#include "srnf/typicality.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/*
 * The member whose distances to the others have the least sum; of equal ones the first.
 *   distances  [in] double[n][n], symmetric, 0 on the diagonal
 *   classes    [in] [n] numbers: only the members of class `which` count; NULL: all do
 *   taken      [in] [n] members that are not to be it, though their distances count; NULL: none
 * n where there is no such member.
 */
size_t srnf_medoid(size_t n, const double *distances, const size_t *classes, size_t which,
                   const bool *taken);

/*
 * How far each member is from the mean of the others, from the distances alone: with m the mean of
 * the n - 1 others in a Euclidean space, as that of registered SRNFs is,
 *
 *     ||q_i - m||^2 = sum_j d_ij^2 / (n - 1) - sum_{j < k; j, k != i} d_jk^2 / (n - 1)^2;
 *
 * 0 where other distances make that negative.
 *   distances  [in]  double[n][n], symmetric, 0 on the diagonal; n at least 2
 *   values     [out] double[n]
 */
void srnf_distances_from_others(size_t n, const double *distances, double *values);

/*
 * Those values, each against those of the other members (srnf_typicality_of, as distances, with
 * SRNF_TYPICAL_ALPHA_GROUP).
 *   verdicts  [out] [n]
 * Errors: SRNF_EINVAL (n below 4), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_members_judge(size_t n, const double *distances,
                                    struct srnf_typicality *verdicts);

/* Rigid matches of two surfaces, or the means of several such matches. */
struct srnf_match {
    double plain;    /* distance, rotated as it is best */
    double mirrored; /* the same with one of the two mirrored (srnf_surface_mirror) */
    double unturned; /* not rotated */
    double angle;    /* of the rotation of the values, radians; the least of several */
};
/* The mirrored match is much nearer: below 0.8 of the distance as it is. */
bool srnf_match_is_mirrored(const struct srnf_match *match);
/* The two are turned against each other by more than 30 degrees, and turned back they are below
   half as far apart: shapes that look alike from two sides are not turned. */
bool srnf_match_is_turned(const struct srnf_match *match);
/* Angle of a rotation, 0 .. pi, by its trace 1 + 2 cos(angle). rotation: row-major. */
double srnf_rotation_angle(const double rotation[9]);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
