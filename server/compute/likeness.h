/*
 * likeness.h - do the members of a group belong together? From the distances between them,
 * which a process has at hand, and a few rigid matches of members cut to a low degree.
 */
#ifndef SRNFD_COMPUTE_LIKENESS_H
#define SRNFD_COMPUTE_LIKENESS_H

#include "compute/group.h"

#define LIKENESS_MEMBERS_MIN 5 /* below which none stands out from the others */
/* What turns leave of a distance at most, where so few are told to lie in different poses. Shapes
   that differ come down to a third: pallidum and amygdala, from 1.04 to .34 at degree 12. */
#define LIKENESS_FEW_LEFT 0.3
#define LIKENESS_TRIED_MAX 6   /* members that are matched with the medoid */
#define LIKENESS_CLASSES_MAX 4 /* between which medoids are matched */
#define LIKENESS_OF_CLASS 3    /* members of a class that stand for it: the nearest to its middle */

struct compute_likeness_inputs {
    const struct compute_group *group;
    const double *pairs;    /* double[n][n] */
    const size_t *subjects; /* [n], NULL: each its own */
    const size_t *classes;  /* [n] below n_classes; NULL: none */
    size_t n_classes;
    bool rotates; /* the process lets values rotate; if not, poses are doubted too */
    bool mirrors; /* whether mirror images are looked for */
};

/* Rigid matches of `first` with `second`, members or classes; of classes the means of several. */
struct compute_match {
    size_t first, second;
    struct srnf_match match; /* mirrored is plain where that was not tried */
    /* With the sphere alone turned, by the least such angle; unturned and INFINITY where turns gain
       little, or where the process rotates. */
    double on_sphere, sphere_angle;
};
/* Whether the surfaces lie alike and their maps to the sphere are turned against each other. */
bool compute_match_on_sphere(const struct compute_match *match);

struct compute_likeness {
    size_t n;
    struct srnf_twins twins;
    struct srnf_typicality *distances; /* [n] to the mean of the others, owned; NULL: too few */
    size_t medoid;                     /* the member that all are nearest to */
    size_t n_members, n_classes;
    struct compute_match members[LIKENESS_TRIED_MAX];
    struct compute_match classes[LIKENESS_CLASSES_MAX * (LIKENESS_CLASSES_MAX - 1) / 2];
};

/*
 * A member is matched with the medoid where it is further from the mean of the others than is
 * usual, the furthest first; where nothing rotates, the furthest ones in any case, and of fewer
 * than LIKENESS_MEMBERS_MIN all, for their poses alone. One that is mirrored is matched with the
 * member of the most alike coefficients as well, whose copy it may be. A match of two ventricles
 * takes 20 to 30 ms, of the sphere alone 100 ms, at any degree.
 * Returns 0, or a negative status with the problem in result; compute_likeness_clear in any case.
 */
int compute_likeness(struct jobs_run *run, const struct compute_likeness_inputs *inputs,
                     struct compute_likeness *likeness, struct jobs_result *result);
/* Matches two surfaces of a degree, which a process compares without turning them. As
   compute_likeness; no mirror image is tried. Turns that leave more than this share of the
   distance, and those where it is less than a tenth of the norm, count as none: plain and on_sphere
   are unturned. */
int compute_match_pair(struct jobs_run *run, size_t degree, const double *first,
                       const double *second, double share, struct compute_match *match,
                       struct jobs_result *result);
void compute_likeness_clear(struct compute_likeness *likeness);

#endif
