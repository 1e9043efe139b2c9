/*
 * model.h - what is computed with a model that was made before: surfaces from scores (model.c), and
 * scores of a surface (projection.c).
 */
#ifndef SRNFD_COMPUTE_MODEL_H
#define SRNFD_COMPUTE_MODEL_H

#include "compute/compute.h"
#include "store/model.h"

/*
 * What a model is of. One of several structures holds stacked fields (srnf/parts.h): its n_theta is
 * the rows of all parts, and one more with positions; its mean is that of the first part.
 */
struct compute_joint {
    size_t n_parts; /* 1 of a model of one structure */
    double weights[SRNF_PARTS_MAX];
    double position_weight; /* 0: without */
    char means[SRNF_PARTS_MAX][STORE_ID_MAX];
};
/* Of a model of one structure. */
struct compute_joint compute_joint_of_one(const struct store_model *stored);
/* Rows of the grid of one part; 0 where the rows of the model are none of such parts. */
size_t compute_joint_rows(const struct compute_joint *joint, const struct store_model *stored);
/* Makes the model that of one part: its mean, and what the components have of it. Arrays that were
   not read stay away. Returns 0 or SRNF_ENOMEM. */
int compute_joint_take(const struct compute_joint *joint, size_t part, struct store_model *stored);

/* A model in memory, with its mean surface. */
struct compute_model {
    struct store_model stored;   /* all arrays */
    struct compute_surface mean; /* at the degree of the model, of its first part */
    struct srnf_pca pca;         /* a view of the arrays: nothing in it is owned */
    struct compute_joint joint;  /* set by compute_model_load as of one structure */
};
int compute_model_load(struct jobs_run *run, const char *id, struct compute_model *model,
                       struct jobs_result *result);
void compute_model_clear(struct compute_model *model);
/* One part of it, as a model of one structure. out is cleared with compute_model_clear. */
int compute_model_part(struct jobs_run *run, const struct compute_model *model, size_t part,
                       struct compute_model *out, struct jobs_result *result);
/* The transform of the degree and grid of the model's parts. Returns 0, or a negative status with
   the problem in result. */
int compute_model_transform(struct jobs_run *run, const struct compute_model *model,
                            const struct srnf_sht **sht, struct jobs_result *result);

/*
 * The squared norm of sum_k scores[k] mode_k: of a part of a joint model, as the part itself has
 * it, without its weight. Returns SRNF_OK or SRNF_ENOMEM.
 */
int compute_point_norm2(const struct srnf_sht *sht, const struct store_model *stored,
                        const double *scores, double *norm2);
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
    const char *const *contents;         /* [parts][n] content of compute_surface, or ids of them */
    const double *residuals, *distances; /* [n] as in compute_projection */
};

/* What is projected: a surface for each part of the model. */
struct compute_projected {
    const char *surfaces[SRNF_PARTS_MAX]; /* ids */
    size_t mesh_degree;                   /* at which meshes are encoded; 0: the default */
    /* For models with positions: those of n parts, [n][3], whose surfaces are at the degree of sht.
       Returns 0, or a negative status with the problem in result. */
    int (*place)(struct jobs_run *run, const struct srnf_sht *sht, size_t n,
                 const struct compute_surface *surfaces, const double *const *numbers,
                 double *positions, struct jobs_result *result);
};

/* What one part, or the positions, have in a projection; weighted, so that squares add up. */
struct compute_contribution {
    double distance, distance_before;
    double residual; /* NaN of a member of a registered model, whose registration is not kept */
    double share;    /* of the square of the Mahalanobis distance; may be negative */
};

struct compute_projection {
    double *scores; /* [components], owned */
    double *q;      /* [3][n_theta][n_phi] the surface as it lies beside the mean, owned */
    struct compute_contribution *parts; /* [parts + 1], that of the positions last; owned */
    size_t member;                      /* of the model that the surface is, or their number */
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
 * Scores of a surface in the frozen model, registered to its mean SRNF unless registration is NULL;
 * of a subject of several parts each is registered to the mean of its part.
 *
 * A subject of a registered model is not registered anew: it has the scores, residual and distance
 * that it got with the group. Its registration was refined there from one mean to the next, and one
 * from the start may end in another local minimum: the same surface would then have other scores
 * than the model says. Subjects are told by the content of the surface, at its own degree.
 */
int compute_project(struct jobs_run *run, const struct compute_model *model,
                    const struct compute_projected *projected,
                    const struct srnf_register_options *registration,
                    const struct compute_subjects *subjects, struct compute_projection *out,
                    struct jobs_result *result);
void compute_projection_clear(struct compute_projection *projection);
/* The stack of the model's parts on the grid of its transform; srnf_stack_clear in any case. */
int compute_model_stack(const struct compute_model *model, const struct srnf_sht *sht,
                        struct srnf_stack *stack, struct jobs_result *result);

struct compute_mirror_trial; /* compute/mirror.h */
/*
 * Would the mirror image of the surface, or of all parts, registered like it, lie nearer to one of
 * the members?
 * Their mean says little where they are of several kinds.
 *   projection  [in] of the surface as it is
 * Returns 0, or a negative status with the problem in result.
 */
int compute_project_mirrored(struct jobs_run *run, const struct compute_model *model,
                             const struct compute_projected *projected,
                             const struct srnf_register_options *registration,
                             const struct compute_projection *projection,
                             struct compute_mirror_trial *trial, struct jobs_result *result);

#endif
