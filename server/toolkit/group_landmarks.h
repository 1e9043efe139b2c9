/*
 * group_landmarks.h - the input "landmarks" of processes that register a group to its mean: points
 * that correspond in all of its members; where they lie on the spheres, and what the registrations
 * leave between them.
 */
#ifndef SRNFD_TOOLKIT_GROUP_LANDMARKS_H
#define SRNFD_TOOLKIT_GROUP_LANDMARKS_H

#include "compute/mean.h"
#include "toolkit/group.h"
#include "toolkit/landmarks.h"

/* As typed. */
struct group_landmarks_input {
    size_t n;       /* 0: none */
    json_t *points; /* lists of n vertices and positions: of each member, or one of all */
    bool held_out[LANDMARKS_GIVEN_MAX];
    double weight; /* INFINITY: exact */
};

#define GROUP_LANDMARKS_INPUT(typed, member)                                                       \
    {                                                                                              \
        "landmarks", INPUT_OWN, offsetof(typed, member),                                           \
            "Points that correspond in all members: either vertices, one list of numbers of "      \
            "vertices (from 0) of meshes whose vertices correspond, or points, a list for each "   \
            "member in order, as long as the others, of vertices or positions [x, y, z] as in "    \
            "register. weight: of the mean squared angle, in radians on the sphere, between "      \
            "where the warps take the points of the mean and where they belong, in what is "       \
            "minimized; exact: they take them there. heldOut: numbers of landmarks (from 0) that " \
            "guide nothing and tell how well the warps correspond elsewhere.",                     \
            .own = &group_landmarks_own                                                            \
    }
extern const struct input_own group_landmarks_own;

#define GROUP_LANDMARKS_OUTPUT                                                                    \
    {                                                                                             \
        "landmarks", OUTPUT_OBJECT_OR_NULL,                                                       \
            "null where none were given. points: for each its position on the mean surface, as "  \
            "that is placed, heldOut, and maxAngle, rmsAngle, maxDistance and rmsDistance over "  \
            "the members. members: for each its angles, what the registration leaves on the "     \
            "sphere, in radians; its distances, the same along straight lines between points of " \
            "the member, in the units of its input; and off, how far the points that were given " \
            "are from it. guiding and heldOut: count, maxAngle, rmsAngle, maxDistance, "          \
            "rmsDistance of both kinds over all members; null where there are none of the kind. " \
            "weight."                                                                             \
    }

/* For complete, where the process has the input: problems of members that lack such a vertex or are
   taken mirrored, and of landmarks without registration. */
void group_landmarks_complete(struct process_inputs *inputs);

/* Where the landmarks of a group are. */
struct group_landmarks {
    const struct group_landmarks_input *input; /* NULL: none */
    size_t n, members;
    const char *const *ids;            /* [members] */
    size_t order[LANDMARKS_GIVEN_MAX]; /* number of the k-th of group, whose first ones guide */
    double *points;                    /* [members][n][3] in that order */
    double *off;                       /* [members][n] in the order of the input */
    double *scales;                    /* [members] units of the inputs */
    struct srnf_group_landmarks group;
};
/* Places those of the input on a group that was loaded. Returns 0, or a negative status with the
   problem set; group_landmarks_clear in any case, after the mean. */
int group_landmarks_place(struct jobs_run *run, const struct group_landmarks_input *input,
                          const struct group_input *members, const struct compute_group *group,
                          struct group_landmarks *landmarks, struct jobs_result *result);
void group_landmarks_clear(struct group_landmarks *landmarks);
/* GROUP_LANDMARKS_OUTPUT, and the warnings of points that are off their surfaces, into the document
   of a mean. scale: of the mean surface. Returns 0, or a negative status with the problem set. */
int group_landmarks_report(struct jobs_run *run, const struct group_landmarks *landmarks,
                           const struct compute_mean_outputs *outputs, double scale,
                           json_t *document, struct jobs_result *result);

#endif
