/*
 * group.h - several surfaces at one degree: the input of distances and statistics.
 */
#ifndef SRNFD_COMPUTE_GROUP_H
#define SRNFD_COMPUTE_GROUP_H

#include "compute/bridge.h"

#define COMPUTE_GROUP_MAX 10000

/* Members of a group of which all pairs are compared, for warnings of what is there twice or stands
   out, and each is left out of a model of components once: n^2 numbers and n^3 operations. */
#define COMPUTE_PAIRS_MAX 4000

/* Which members of a group are replaced by their mirror images. */
struct compute_mirrored {
    bool member[COMPUTE_GROUP_MAX];
};

struct compute_group {
    size_t n, degree;
    double *coefficients;    /* [n][3][(degree+1)^2], owned */
    const double **surfaces; /* [n] into coefficients, owned */
    double *scales;          /* [n] of members encoded here; 0 for stored ones. Owned */
    double (*origins)[3];    /* [n] of members encoded here, as in struct compute_surface. Owned */
    bool *bridged;           /* [n] encoded here by area in the stead of a stored one. Owned */
    /* [n] content and surface of compute_surface. Owned */
    char (*contents)[STORE_ID_MAX], (*ids)[STORE_ID_MAX];
};

/*
 * Loads the members, meshes among them encoded with the default options, several at a time.
 *   mirrored [in] the members that are taken mirrored; NULL: none
 *   origins  [in] [n] of members by star that are to be bridged (compute_bridge_load), the others
 *            without a surface; NULL: none
 *   mesh_degree [in] at which meshes are encoded; 0: the default
 *   degree  [in] of the group; 0: the largest of its members. Others are cut, or filled with zeros
 *   share   [in] percent of the job that encoding stands for if all of them are meshes: a phase,
 *           after which the caller begins the next
 * Returns 0, or a negative status with the problem of the first member that has one.
 */
int compute_group_load(struct jobs_run *run, size_t n, const char *const *ids,
                       const struct compute_mirrored *mirrored,
                       const struct compute_origin *origins, size_t mesh_degree, size_t degree,
                       double share, struct compute_group *group, struct jobs_result *result);
void compute_group_clear(struct compute_group *group);

#endif
