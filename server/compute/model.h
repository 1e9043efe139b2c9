/*
 * model.h - what is computed with a model that was made before: surfaces from scores (model.c), and
 * scores of a surface (projection.c).
 */
#ifndef SRNFD_COMPUTE_MODEL_H
#define SRNFD_COMPUTE_MODEL_H

#include "compute/compute.h"
#include "store/model.h"

/* A model in memory, with its mean surface. */
struct compute_model {
    struct store_model stored;   /* all arrays */
    struct compute_surface mean; /* at the degree of the model */
    struct srnf_pca pca;         /* a view of the arrays: nothing in it is owned */
};
int compute_model_load(struct jobs_run *run, const char *id, struct compute_model *model,
                       struct jobs_result *result);
void compute_model_clear(struct compute_model *model);
/* The transform of the model's degree and grid. Returns 0, or a negative status with the problem in
   result. */
int compute_model_transform(struct jobs_run *run, const struct compute_model *model,
                            const struct srnf_sht **sht, struct jobs_result *result);

/*
 * Inverts mean_q + sum_k scores[k] mode_k, from a surface nearby, on the calling thread. For those
 * who have no run.
 *   sht      [in]  of the model's degree and grid
 *   stored   [in]  with its arrays
 *   start    [in]  double[3][(L+1)^2]
 *   scores   [in]  double[components]
 *   out      [out] to be cleared by srnf_inversion_clear where the status is not negative
 */
int compute_invert_point(const struct srnf_sht *sht, const struct store_model *stored,
                         const double *start, const double *scores,
                         const struct srnf_context *context, struct srnf_inversion *out,
                         struct srnf_error *error);

/* Surfaces of a model, by their scores. */
struct compute_reconstruction {
    size_t n;
    double *coefficients;    /* [n][3][(L+1)^2], centred at their area centroids */
    double *relative_energy; /* [n] what is left of q: 0 where such a surface exists */
    struct srnf_surface_measures *measures; /* [n] */
};

/*
 * Inverts mean_q + sum_k scores[i][k] mode_k for each i.
 *   scores  [in] double[n][components]
 *   before  [in] size_t[n]: the surface that each starts from, an index below n, or n for the mean;
 *           no cycles
 * Several at a time where they do not wait for each other. Returns 0, or a negative status with
 * the problem in result.
 */
int compute_reconstruct(struct jobs_run *run, const struct compute_model *model, size_t n,
                        const double *scores, const size_t *before,
                        struct compute_reconstruction *out, struct jobs_result *result);
void compute_reconstruction_clear(struct compute_reconstruction *out);

/* The members that a model was made from, in the order of its scores. */
struct compute_subjects {
    size_t count;                        /* subjects whose members they are */
    const double *weights;               /* one a member: 1 / members of its subject */
    size_t n;                            /* of the next three; 0: the model does not tell */
    const char *const *contents;         /* [n] content of compute_surface, or ids of them */
    const double *residuals, *distances; /* [n] as in compute_projection */
};

struct compute_projection {
    double *scores; /* [components], owned */
    double *q;      /* [3][n_theta][n_phi] the surface as it lies beside the mean, owned */
    size_t member;  /* of the model that the surface is, or their number */
    double residual, distance, distance_before;
    size_t subjects;       /* of the model */
    bool training_subject; /* the surface is one of the model's members */
    size_t counted;        /* components of the Mahalanobis distance */
    double mahalanobis;
    bool poses;       /* the model keeps poses apart: nothing was rotated */
    double angle;     /* then: the turn against the mean, radians */
    double turn_back; /* then: largest change of a counted score, in standard deviations, if the
                         surface were turned back */
    /* Each value among the leave-one-out values of the model's members, where it has them, each
       subject counting once. A member's are its own leave-one-out values. The angle is judged
       where poses are kept. */
    bool calibrated;
    struct srnf_typicality typicality[SRNF_CALIBRATION_TRAITS];
};

/*
 * Scores of a surface in the frozen model, registered to its mean SRNF unless registration is NULL.
 *
 * A subject of a registered model is not registered anew: it has the scores, residual and distance
 * that it got with the group. Its registration was refined there from one mean to the next, and one
 * from the start may end in another local minimum: the same surface would then have other scores
 * than the model says. Subjects are told by the content of the surface, at its own degree.
 */
int compute_project(struct jobs_run *run, const struct compute_model *model, const char *surface,
                    const struct srnf_register_options *registration,
                    const struct compute_subjects *subjects, struct compute_projection *out,
                    struct jobs_result *result);
void compute_projection_clear(struct compute_projection *projection);

struct compute_mirror_trial; /* compute/mirror.h */
/*
 * Would the mirror image of the surface, registered like it, lie nearer to one of the members?
 * Their mean says little where they are of several kinds.
 *   projection  [in] of the surface as it is
 * Returns 0, or a negative status with the problem in result.
 */
int compute_project_mirrored(struct jobs_run *run, const struct compute_model *model,
                             const char *surface, const struct srnf_register_options *registration,
                             const struct compute_projection *projection,
                             struct compute_mirror_trial *trial, struct jobs_result *result);

#endif
