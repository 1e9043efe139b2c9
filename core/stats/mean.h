/*
 * mean.h - what the files of the group mean share.
 *
 * The mean mu, the value rotations O_i and the warps gamma_i minimize together
 *
 *   G = (1/n) sum_i [ ||mu - O_i (q_i, gamma_i)||^2 / N + R(gamma_i) ],   N = (1/n) sum_i
 *   ||q_i||^2,
 *
 * with the penalties R of registration/objective.c. N does not change, so neither does the weight
 * of the penalties, and every part of an iteration lowers one and the same G:
 *
 *   descend  mean_step.c: one Gauss-Newton step of all warps together, refused unless G falls
 *   average  mu <- the mean of the O_i (q_i, gamma_i), the minimum over mu
 *   centre   mean_center.c: the common warp that the penalties are measured from is moved to where
 *            they are least; distances do not see it
 *
 * All of it happens on a working grid that the degree of the fields cannot overfit: where the grid
 * of the caller is coarser, fields would match its nodes and fold between them.
 */
#ifndef SRNF_STATS_MEAN_H
#define SRNF_STATS_MEAN_H

#include "stats.h"
#include "registration/registration.h"

#define MEAN_PROGRESS_LOOP 0.95 /* of all progress: the iterations; then the inversion */

#define MEAN_BLOCK ((size_t)256) /* nodes that one body of a loop over all nodes works on */

/* Where one subject stands: O and its warp. The rest follows from these. */
struct mean_subject {
    double rotation[9];
    struct srnf_warp warp;
    double old_rotation[9];
    double displacement[9]; /* O' of the displacement penalty */
    double energy, penalty; /* ||mu - O (q, gamma)||^2 / N and R, as last measured */
    struct moving moving;
    struct level level;     /* of the steps; nothing is warped: empty */
    struct samples samples; /* of q and its derivative at gamma */
};

struct mean_run {
    const struct srnf_sht *sht;   /* of the caller */
    const struct srnf_sht *work;  /* the same degree on the working grid */
    struct srnf_sht *own;         /* work, where it is another one */
    const struct srnf_grid *grid; /* of work */
    const struct srnf_context *context;
    struct srnf_register_options registration;
    bool registered; /* false: the surfaces stay as they are parameterized */
    bool started;    /* the subjects hold registrations to start from */
    size_t n, points;
    size_t degree; /* of the fields of steps and of centring */
    const double *const *surfaces;
    double *nodes, *weight;    /* [P][3], [P] */
    double *mean_q, *previous; /* [3][P] */
    double *target;            /* [P][3] mean_q */
    double norm2;              /* N */
    struct srnf_warp centring; /* d: see mean_center.c */
    double *center;            /* [P][3] d on the grid; NULL unless registered, like all below */
    double *area;              /* [P] K, the Jacobian of d */
    double *reference;         /* [P][3] sqrt(K) d */
    struct srnf_sht *analysis, *view; /* of the mean; see mean_change.c */
    double *centred, *old_centred;    /* [3][n_theta][n_phi] of view */
    struct mean_subject *subjects;    /* [n] */
    double *q;                        /* [n][3][P] O sqrt(J) q_i(gamma_i) */
    double *gamma, *jacobian;         /* [n][P][3], [n][P]: the warps on the grid */
    double *old_gamma, *old_jacobian; /* the same, where a step has to be taken back */
    double *old_mean;                 /* [3][P] */
    double *potentials;               /* [n][2][(D+1)^2] of the step that is tried */
    size_t iterations;
    struct srnf_mean_iteration *history; /* [max_iterations] */
    size_t history_capacity;
};

/* Whether warps are refined from one iteration to the next, not only rotated anew. */
static inline bool mean_is_warped(const struct mean_run *run)
{
    return run->registered && run->registration.reparameterization;
}

static inline size_t mean_blocks(const struct mean_run *run)
{
    return (run->points + MEAN_BLOCK - 1) / MEAN_BLOCK;
}

/* ---- mean_subject.c: one subject, for many at once; each writes only what is its own --------- */

/* What evaluating and moving a subject takes; once. */
SRNF_CHECKED int mean_prepare(const struct mean_run *run, size_t i);
void mean_subject_clear(struct mean_subject *subject);
/* Registers subject i to the mean from nothing: rotation and warp. */
SRNF_CHECKED int mean_register(const struct mean_run *run, size_t i,
                               const struct srnf_context *context, struct srnf_error *error);
/* gamma and J on the grid. */
SRNF_CHECKED int mean_replay(const struct mean_run *run, size_t i);
/* q at gamma: samples, then O, energy and penalty against the mean as it is. */
void mean_evaluate(const struct mean_run *run, size_t i);
/* The same with the samples as they are. */
void mean_measure(const struct mean_run *run, size_t i);
/* The penalty alone, against the centre as it is. */
void mean_penalize(const struct mean_run *run, size_t i);
/* q of the run from samples, J and O. */
void mean_field(const struct mean_run *run, size_t i);
/* The Gauss-Newton step of the subject's own objective, O at its best. potentials: [2][(D+1)^2] */
SRNF_CHECKED int mean_potentials(const struct mean_run *run, size_t i, double *potentials);

/* ---- mean_step.c ----------------------------------------------------------------------------- */

/* One step of all warps, and the mean after it. Without any that lowers G all stays as it is. */
SRNF_CHECKED int mean_descend(struct mean_run *run, struct stats_progress progress,
                              struct srnf_error *error);

/* ---- mean.c ---------------------------------------------------------------------------------- */

/* mean_q <- the mean of q; target. */
SRNF_CHECKED int mean_average(struct mean_run *run, struct srnf_error *error);
/* target <- mean_q */
void mean_set_target(struct mean_run *run);
/* G with q, the mean and the penalties as they are. */
double mean_objective(const struct mean_run *run);
/* G as the subjects were last measured. */
double mean_measured(const struct mean_run *run);
/* Keeps gamma, J, O and the mean, and goes back to them: q and all that belongs to it as it was. */
void mean_remember(struct mean_run *run);
SRNF_CHECKED int mean_take_back(struct mean_run *run, struct srnf_error *error);
/* gamma, J, samples, q of all subjects from the chains; O is kept. */
SRNF_CHECKED int mean_replay_all(struct mean_run *run, struct srnf_error *error);

/* ---- mean_center.c --------------------------------------------------------------------------- */

/* Moves the centre to where the penalties are least, unless it is there to rounding. moved: the
   root of the mean square of the step, in radians. */
SRNF_CHECKED int mean_center(struct mean_run *run, double *moved, struct srnf_error *error);
/* Fills center, area and reference from the centring. */
SRNF_CHECKED int mean_place_center(struct mean_run *run, struct srnf_error *error);

/* ---- mean_change.c --------------------------------------------------------------------------- */

SRNF_CHECKED int mean_change_create(struct mean_run *run);
/* centred <- the mean as it is parameterized from its centre. */
SRNF_CHECKED int mean_view(struct mean_run *run, struct srnf_error *error);
/* ||centred - old_centred|| / ||centred|| */
double mean_change(const struct mean_run *run);

/* ---- mean_surface.c: what the caller gets, on the caller's grid ------------------------------ */

SRNF_CHECKED int mean_hand_over(struct mean_run *run, struct srnf_mean *mean,
                                struct srnf_error *error);

/* ---- mean_checkpoint.c: a run between two iterations as bytes, and back ---------------------- */

struct mean_bytes {
    unsigned char *data;
    size_t size;
};
SRNF_CHECKED int mean_checkpoint_write(const struct mean_run *run, struct mean_bytes *bytes);
/* Fills mean_q, subjects, iterations and history of a new run. SRNF_EINVAL: foreign or
   damaged. */
SRNF_CHECKED int mean_checkpoint_read(struct mean_run *run, const void *bytes, size_t size,
                                      struct srnf_error *error);

#endif
