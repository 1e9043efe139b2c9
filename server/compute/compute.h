/*
 * compute.h - what the computations of the processes share: how a core status becomes the problem
 * of a failed job, and how an id becomes a surface in memory.
 *
 * The computations are typed C: a struct of inputs in, a struct of outputs out. They read from the
 * store, call the core with the run's context and know nothing of JSON; what of their outputs is
 * kept, and how it is described, is decided by the caller.
 */
#ifndef SRNFD_COMPUTE_H
#define SRNFD_COMPUTE_H

#include "jobs/jobs.h"

/* A surface in memory, from the store or encoded from a mesh of the store. */
struct compute_surface {
    char id[STORE_ID_MAX]; /* as it was named: surf-... or mesh-... */
    size_t degree;
    double *coefficients; /* [3][(degree+1)^2], owned: compute_surface_clear */
    double scale;         /* of a surface encoded here; 0 for a stored one, whose record has it */
    double origin[3];     /* of a surface encoded here, as in struct srnf_encoded */
    bool mirrored;        /* the mirror image is taken of what was named */
    const char *route;    /* of a surface encoded here, static; NULL for a stored one */
    char surface[STORE_ID_MAX]; /* its own id, or that which the encoded mesh has; of a stored
                                   surface that was mirrored an id that no stored one has */
    char older[STORE_ID_MAX];   /* the same as it was before places were in ids */
    char content[STORE_ID_MAX]; /* shape-...: of the coefficients alone (store_shape_id) */
};

/*
 * Sets the problem of a failed job from a core status and returns status. A cancelled call sets
 * nothing: the engine knows. what names the step ("encoding mesh-..."), for the detail.
 */
int compute_fail(struct jobs_result *result, int status, const struct srnf_error *error,
                 const char *what);

/* The same where nothing differs: what is "surfaces" or "subjects". Returns SRNF_ENUMERIC. */
int compute_fail_alike(struct jobs_result *result, const char *what);
/* The same for an enum store_status. */
int compute_fail_store(struct jobs_result *result, int status, const char *id);
/* The same for what a run could not keep; names the quota where it is that. */
int compute_fail_kept(struct jobs_run *run, struct jobs_result *result, int status,
                      const char *what);

/* The problem code of a core status (enum srnf_status): "mesh-not-closed", "not-star-shaped", ...;
   "internal-error" for one that should not have come up. A static string, never NULL. */
const char *compute_problem_code(int status);

/* Whether the id is that of a mesh, which is to be encoded first. */
bool compute_is_mesh(const char *id);

/*
 * Loads a surface; a mesh id is encoded with the default options, which takes the time of an
 * encode: a phase of the job of `share` percent. The caller begins the next phase. Returns 0, or a
 * negative status with the problem set.
 */
int compute_surface_load(struct jobs_run *run, const char *id, double share,
                         struct compute_surface *surface, struct jobs_result *result);
/* The same for what holds for one route only, as the closed form does for star: a mesh id is
   encoded by it. A stored surface is taken as it is. */
int compute_surface_load_by(struct jobs_run *run, const char *id, enum srnf_parameterization route,
                            double share, struct compute_surface *surface,
                            struct jobs_result *result);
/* The first as part of a phase, with a context of the run's user: for several at a time. mirror:
   the mirror image instead, of a mesh as encode makes it, of a surface by srnf_surface_mirror.
   mesh_degree: at which a mesh is encoded; 0: the default. */
int compute_surface_load_within(struct jobs_run *run, const struct srnf_context *context,
                                const char *id, bool mirror, size_t mesh_degree,
                                struct compute_surface *surface, struct jobs_result *result);
void compute_surface_clear(struct compute_surface *surface);

/* Measures of several surfaces of one degree on its working grid: coefficients
   double[count][3][..]. */
int compute_measure(struct jobs_run *run, size_t degree, size_t count, const double *coefficients,
                    struct srnf_surface_measures *measures, struct jobs_result *result);

#endif
