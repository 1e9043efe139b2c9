/*
 * prepared.h - a stored mesh as it is computed with: read, welded, repaired, measured, and with the
 * centre of its kernel.
 */
#ifndef SRNFD_COMPUTE_PREPARED_H
#define SRNFD_COMPUTE_PREPARED_H

#include "jobs/jobs.h"

struct compute_prepared {
    struct srnf_mesh mesh;
    struct srnf_mesh sphere;        /* prepared with the mesh (srnf_mesh_prepare_pair); or empty */
    struct srnf_mesh_report report; /* of the mesh */
    bool untransformed;             /* srnf_mesh_read_info.transform_ignored of the mesh's file */
    bool kernel_known;
    struct srnf_star kernel; /* srnf_star_kernel of the mesh, where it is known */
};

/*
 * Prepares a mesh that was read, and a sphere unless that is empty, in place; and solves the kernel
 * of a mesh without problems. *kernel_status is what srnf_star_kernel said, SRNF_OK where it was
 * not asked. Returns a core status of the rest; the meshes are to be cleared in any case.
 */
int compute_prepare(struct compute_prepared *prepared, const struct srnf_context *context,
                    int *kernel_status);
/* Keeps what was prepared of a stored mesh of the owner, as it was uploaded, for later jobs, unless
   it has problems. What cannot be kept is made again. */
void compute_prepared_keep(struct jobs *jobs, struct store *store, const char *owner,
                           const char *mesh, const struct compute_prepared *prepared);
/*
 * A stored mesh, prepared: as it was kept by this numeric build, or made anew from what was
 * uploaded, and then kept.
 *   sphere    [in]  id of a sphere for it, or ""
 *   mirror    [in]  the mirror images of both, x to -x before all else
 *   prepared  [out] compute_prepared_clear; empty on failure
 * Returns 0, or a negative status with the problem in result.
 */
int compute_prepared_load(struct jobs_run *run, const char *mesh, const char *sphere, bool mirror,
                          struct compute_prepared *prepared, struct jobs_result *result);
/* A stored mesh as it was uploaded, whatever its problems; a transform of its file that was not
   applied is a doubt of the run. Returns 0, or a negative status with the problem in result, and no
   mesh. */
int compute_mesh_read(struct jobs_run *run, const char *mesh, struct srnf_mesh *read,
                      struct jobs_result *result);
void compute_prepared_clear(struct compute_prepared *prepared);

#endif
