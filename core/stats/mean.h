/*
 * mean.h - what the files of the group mean share.
 *
 * The mean mu, the value rotations O_i and the warps gamma_i minimize together
 *
 *   G = (1/n) sum_i [ ||mu - O_i (q_i, gamma_i)||^2 / N + R(gamma_i) ],   N = (1/n) sum_i
 *   ||q_i||^2,
 *
 * with the penalties R of registration/objective.c, and what landmarks add (mean_landmarks.c). N
 * does not change, so neither does the weight of the penalties, and every part of an iteration
 * lowers one and the same G:
 *
 *   descend  mean_step.c: one Gauss-Newton step of all warps together, refused unless G falls
 *   average  mu <- the mean of the O_i (q_i, gamma_i), the minimum over mu
 *   centre   mean_center.c: the common warp that the penalties are measured from is moved to where
 *            they are least; distances do not see it
 *
 * All of it happens on a working grid that the degree of the fields cannot overfit: where the grid
 * of the caller is coarser, fields would match its nodes and fold between them.
 *
 * No field of a subject outlives the batch of subjects that it is made in (mean_batch.c). With
 * E_i = ||m - O_i (q_i, gamma_i)||^2 measured against the mean m from before, the variance about
 * the average mu needs no second look at the fields: (1/n) sum_i E_i - ||mu - m||^2.
 */
#ifndef SRNF_STATS_MEAN_H
#define SRNF_STATS_MEAN_H

#include "registration/tabulated.h"
#include "stats.h"
#include "subjects.h"

#include <stdatomic.h>

#define MEAN_PROGRESS_LOOP 0.95 /* of all progress: the iterations; then the inversion */

#define MEAN_BLOCK ((size_t)256) /* nodes that one body of a loop over all nodes works on */

/* The Gauss-Newton matrix of a subject relative to N, below the diagonal and in `diagonal`, and one
   factor U'U of matrix + s l (l + 1), on the diagonal and above: of the last rung s that was asked
   for. */
struct mean_matrix {
    size_t unknowns, fields; /* all, and those of one kind of field */
    double *square;          /* [unknowns][unknowns], by columns */
    double *diagonal;
    bool factored, regular;
    long rung;
};

/* What evaluating and moving a subject takes. Must stay where it is. */
struct mean_tools {
    struct moving moving;          /* in exact mode */
    struct level level;            /* of the steps, in exact mode */
    struct tabulated_moving table; /* in any other */
    struct mean_matrix matrix;     /* of the steps; nothing is warped: empty */
    double *samples;               /* [9][padded] q and its derivatives, where they are kept */
    bool sampled;                  /* they are those of the points */
};

/* What one body at a time works with, and leaves nothing in. */
struct mean_place {
    atomic_flag taken;
    bool temporary;
    struct tabulated_fields fields; /* nothing is warped: empty */
    struct cloud from, to;          /* of these, arrays of points belong to the subject */
    double *memory;                 /* of both clouds */
    double *vectors;                /* [3][unknowns] */
};
#define MEAN_PLACES ((size_t)32) /* as many threads find one that is there already */

/* How a subject stands to the mean. */
struct mean_stand {
    double rotation[9];     /* O */
    double displacement[9]; /* O' of the displacement penalty */
    double energy, penalty; /* ||mu - O (q, gamma)||^2 / N and R, as last measured */
    double apart;           /* what landmarks with a weight add (mean_landmarks.c) */
};

/* Links of a chain in scratch: so many numbers at an offset. */
struct mean_piece {
    uint64_t offset, count, digest;
};

/* Where one subject stands: O and its warp. The rest follows from these. */
struct mean_subject {
    struct mean_stand at;
    struct mean_stand before;  /* the same, where a step has to be taken back */
    struct srnf_warp warp;     /* its chain, where that is in memory: see mean_chain_open */
    struct mean_piece *pieces; /* [n_pieces], where it is in scratch */
    size_t n_pieces, capacity;
    uint64_t points_digest;  /* of its points, where they are in scratch */
    size_t tabulated;        /* its first links, along which points are carried by tables */
    struct mean_tools tools; /* where they are kept */
};

/* What the caller lends, and where the next piece of a chain goes. */
struct mean_spill {
    struct srnf_scratch lent;
    _Atomic uint64_t end;
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
    bool keeps;      /* tools from one iteration to the next */
    bool remembers;  /* what was evaluated, too */
    size_t n, points;
    size_t padded; /* points, up to a multiple of the lanes */
    size_t degree; /* of the fields of steps and of centring */
    const double *const *surfaces;
    double *nodes, *weight;      /* [P][3], [P] */
    double *mean_q, *previous;   /* [3][P] */
    double *average;             /* [3][P] of the fields that are tried, before it is the mean */
    double *target;              /* [P][3] mean_q */
    double norm2;                /* N */
    double variance;             /* of the registered fields about mean_q, mean square */
    struct srnf_warp centring;   /* d: see mean_center.c */
    double *center;              /* [P][3] d on the grid; NULL unless registered, like all below */
    double *area;                /* [padded] K, the Jacobian of d */
    double *reference;           /* [P][3] sqrt(K) d */
    struct tabulated_target aim; /* target and centre as mean_aim has seen them */
    struct mean_place *places;   /* [MEAN_PLACES] */
    struct tools_pool *pool;     /* for searches and tables */
    struct srnf_sht *analysis, *view; /* of the mean; see mean_change.c */
    double *centred, *old_centred;    /* [3][n_theta][n_phi] of view */
    struct mean_subject *subjects;    /* [n] */
    double *q;                        /* [n][3][P] where nothing is registered; else NULL */
    struct mean_spill *spill;         /* NULL: all is in memory */
    size_t held;                      /* subjects whose points are in memory: the first ones */
    double *held_points;              /* [held][4][padded]: gamma and J, the warp on the grid */
    double *potentials;               /* [n][2][(D+1)^2] of the Gauss-Newton step of each */
    double *taken;                    /* what is taken of them */
    const struct srnf_group_landmarks *landmarks; /* or NULL */
    double *marks;                                /* [landmarks][3] those of the mean */
    uint64_t series;                              /* of the first registrations, as they are kept */
    struct subjects owners;                       /* whose surfaces the subjects are */
    bool *apart;  /* [owners] whose surfaces do not lie alike (mean_visits.c) */
    bool settled; /* no look is due any more (mean_anew.c) */
    size_t looks; /* that have moved subjects */
    size_t joins; /* of visits, that have (mean_visits.c) */
    size_t anew;  /* iterations before the last of these */
    size_t iterations;
    struct srnf_mean_iteration *history; /* [max_iterations] */
    size_t history_capacity;
};

#define MEAN_LINK_DEGREE_MAX 64 /* of a link that is read back */

/* Numbers of a link of a chain. */
static inline size_t mean_link_values(const struct srnf_warp_link *link)
{
    return link->kind == SRNF_WARP_ROTATION ? 9 : 2 * srnf_coefficient_count(link->degree);
}

/* Whether surfaces are rotated, as well as what they are parameterized by. */
static inline bool mean_rotates(const struct mean_run *run)
{
    return run->registration.rotation && !run->registration.common_pose;
}

/* Whether warps are refined from one iteration to the next, not only rotated anew. */
static inline bool mean_is_warped(const struct mean_run *run)
{
    return run->registered && run->registration.reparameterization;
}

static inline size_t mean_blocks(const struct mean_run *run)
{
    return (run->points + MEAN_BLOCK - 1) / MEAN_BLOCK;
}

/* ---- mean_batch.c: sums over fields that are made a batch of subjects at a time -------------- */

/* Makes the field of subject i, double[3][P]. */
typedef int mean_body(void *argument, size_t i, double *field, const struct srnf_context *context,
                      struct srnf_error *error);
/* average <- the mean of what body makes of all subjects, in their order. points: P. Bodies of a
   batch run in parallel, and write nothing but what is their subject's own. */
SRNF_CHECKED int mean_average_of(const struct mean_run *run, mean_body *body, void *argument,
                                 size_t points, struct stats_progress progress, double *average,
                                 struct srnf_error *error);

/* ---- mean_tools.c: what subjects are evaluated and moved with -------------------------------- */

/* What of the tools of all fits into so many bytes. */
void mean_tools_decide(struct mean_run *run, size_t keep_bytes);
/* Makes those that are kept. */
SRNF_CHECKED int mean_prepare(const struct mean_run *run, size_t i);
/* Those that are kept, or made for now, in *now. matrix: as well. To be closed. */
SRNF_CHECKED int mean_tools_open(const struct mean_run *run, size_t i, bool matrix,
                                 struct mean_tools *now, struct mean_tools **tools);
void mean_tools_close(const struct mean_run *run, struct mean_tools *now);
void mean_tools_clear(struct mean_tools *tools);
/* step <- (matrix + damping)^-1 rhs, both [unknowns]; those that are not free stay 0. curvature: of
   the Jacobian penalty. False: there is no factor. */
bool mean_matrix_solve(const struct mean_run *run, struct mean_matrix *matrix, double curvature,
                       const double *rhs, double *step);
SRNF_CHECKED int mean_places_create(struct mean_run *run);
void mean_places_clear(struct mean_run *run);
/* One that nobody has; to be left. NULL: there is no memory for another. */
struct mean_place *mean_place_take(const struct mean_run *run);
void mean_place_leave(struct mean_place *place);

/* ---- mean_measure.c: loops over nodes -------------------------------------------------------- */

/* What measuring needs of mean, centre and area, which do not change before the next call. */
SRNF_CHECKED int mean_aim(struct mean_run *run);
/* Both rotations, energy and penalty of a subject whose q are in the cloud; its Jacobian is J / K.
   */
void mean_stand_at(const struct mean_run *run, const struct cloud *cloud, struct mean_stand *at);
/* The penalty alone, and O' for it, of points whose Jacobian is J / K = ratio. */
void mean_penalty_at(const struct mean_run *run, const double *const point[3], const double *ratio,
                     struct mean_stand *at);
/* ratio <- jacobian / area */
void mean_divide(size_t padded, const double *jacobian, const double *area, double *ratio);
/* field [3][n] <- O sqrt(J) q */
void mean_lay_field(const double rotation[9], const double *jacobian, double *const q[3], size_t n,
                    double *field);

/* What moves the centre, X and S of mean_center.c and the curvature there. */
struct mean_pull {
    double *moment[3], *pressure, *stiffness; /* [padded] */
};
struct mean_points;
/* What nodes of one subject add to it, times share. */
void mean_gather(const double rotation[9], const struct mean_points *points, const double *area,
                 double share, size_t first, size_t last, const struct mean_pull *pull);

/* ---- mean_subject.c: one subject, for many at once; each writes only what is its own --------- */

void mean_subject_clear(struct mean_subject *subject);
/* Registers subject i to the mean from nothing: rotation and warp. placed: its points as well. */
SRNF_CHECKED int mean_register(const struct mean_run *run, size_t i,
                               const struct srnf_context *context, bool *placed,
                               struct srnf_error *error);
/* That it could not be: writes the error, and returns the status. */
int mean_register_failed(size_t i, int status, const struct srnf_error *why,
                         struct srnf_error *error);
/* The same as it was found elsewhere; the links of warp become those of the subject. */
SRNF_CHECKED int mean_take_registered(const struct mean_run *run, size_t i,
                                      const double rotation[9], struct srnf_warp *warp);
/* gamma and J on the grid from the chain. */
SRNF_CHECKED int mean_replay(const struct mean_run *run, size_t i);
/* The points as a cloud, which owns nothing. */
struct cloud mean_cloud_of(const struct mean_run *run, const struct mean_points *points);
/* Points as [P][3] and their Jacobians, and back. */
void mean_points_out(const struct mean_run *run, const struct mean_points *points, double *gamma,
                     double *jacobian);
void mean_points_in(const struct mean_run *run, const double *gamma, const double *jacobian,
                    const struct mean_points *points);

/* ---- mean_register.c ------------------------------------------------------------------------- */

/* All to the mean from nothing, and the mean after it. */
SRNF_CHECKED int mean_register_all(struct mean_run *run, struct stats_progress progress,
                                   struct srnf_error *error);

/* ---- mean_anew.c ----------------------------------------------------------------------------- */

/* Whether a look for better places is due. rests: the mean has come to rest. */
bool mean_looks_anew(const struct mean_run *run, bool rests);
/* Subjects that lie better elsewhere go there, and the mean follows. moved: whether any has; if
   not, nothing has changed. */
SRNF_CHECKED int mean_look_anew(struct mean_run *run, struct stats_progress progress, bool *moved,
                                struct srnf_error *error);

struct mean_points;
/* Subject i sought from nothing on a field: that of the mean (from: NULL), or of another subject,
   which lies at the points from. another: whether that leads to another basin than it is in; found
   is the registration to the field then, else empty; to be cleared. */
SRNF_CHECKED int mean_seek(const struct mean_run *run, size_t i, const double *field,
                           const struct mean_points *from, const struct srnf_context *context,
                           struct warp *found, bool *another, struct srnf_error *error);

/* ---- mean_visits.c --------------------------------------------------------------------------- */

/* Whether subjects are several surfaces of one owner that can lie differently. */
bool mean_has_visits(const struct mean_run *run);
/* Surfaces of one owner that do are laid alike, and the mean follows; fills apart. moved: whether
   any was; if not, nothing has changed. */
SRNF_CHECKED int mean_join_visits(struct mean_run *run, struct stats_progress progress, bool *moved,
                                  struct srnf_error *error);

/* ---- mean_lying.c ---------------------------------------------------------------------------- */

/* Where a subject lies, and how it was measured there. */
struct mean_lying {
    struct srnf_warp warp;
    size_t tabulated;
    struct mean_stand at;
};
/* In place of what was there. */
SRNF_CHECKED int mean_lying_copy(const struct mean_run *run, size_t i, struct mean_lying *copy);
SRNF_CHECKED int mean_lying_restore(const struct mean_run *run, size_t i,
                                    const struct mean_lying *from);
void mean_lying_clear(struct mean_lying *lying);
/* Subject i where it lies on `by` as it is registered to that. */
SRNF_CHECKED int mean_lying_on(const struct mean_run *run, size_t i, size_t by,
                               const struct warp *registered);
/* What a subject adds to G, times n. */
static inline double mean_share(const struct mean_stand *at)
{
    return at->energy + at->penalty;
}

/* ---- mean_stand.c: where a subject is, and its steps ----------------------------------------- */

/* O, energy and penalty against the target, where the subject is; field, or NULL: O sqrt(J)
   q(gamma), [3][P]; potentials, or NULL: the Gauss-Newton step of its own objective. */
SRNF_CHECKED int mean_measure(const struct mean_run *run, size_t i, double *field,
                              double *potentials);
/* The same, and the field, where a part of its step takes it. taken gets what there is of that,
   which is no link of its chain yet: mean_replay goes back. */
SRNF_CHECKED int mean_try(const struct mean_run *run, size_t i, double length,
                          const struct srnf_context *context, double *field);
/* The penalty alone, against the centre as it is. */
SRNF_CHECKED int mean_penalize(const struct mean_run *run, size_t i);

/* ---- mean_spill.c: warps in memory or in scratch --------------------------------------------- */

/* What of the warps of a registered run is where. */
SRNF_CHECKED int mean_spill_create(struct mean_run *run, const struct srnf_mean_options *options);
void mean_spill_clear(struct mean_run *run);

/* The warp of one subject on the grid; what is beyond P repeats the last point. */
struct mean_points {
    double *gamma[3], *jacobian; /* [padded] */
    double *copy;                /* of these, where they are in scratch */
};
/* filled: as they are; else with whatever is there, to be filled. What was opened is kept or
   dropped. */
SRNF_CHECKED int mean_points_open(const struct mean_run *run, size_t i, bool filled,
                                  struct mean_points *points);
void mean_points_drop(struct mean_points *points);
SRNF_CHECKED int mean_points_keep(const struct mean_run *run, size_t i, struct mean_points *points);

/* The chain of subject i, to be closed and not to be changed. */
SRNF_CHECKED int mean_chain_open(const struct mean_run *run, size_t i, struct srnf_warp *chain);
void mean_chain_close(const struct mean_run *run, struct srnf_warp *chain);
/* Takes the chain over; it is empty afterwards, also on failure. */
SRNF_CHECKED int mean_chain_set(const struct mean_run *run, size_t i, struct srnf_warp *chain);
/* One more link, of potentials [2][(D+1)^2]. */
SRNF_CHECKED int mean_chain_step(const struct mean_run *run, size_t i, const double *potentials);
/* Whether an earlier run can have left such a piece. */
bool mean_piece_is_there(const struct mean_run *run, const struct mean_piece *piece);
SRNF_CHECKED int mean_pieces_add(struct mean_subject *subject, const struct mean_piece *piece);

/* A chain of rotations and steps as so many numbers, and back: appended to chain. SRNF_EIO: they
   are none. */
size_t mean_chain_size(const struct srnf_warp *chain);
void mean_chain_write(const struct srnf_warp *chain, double *numbers);
SRNF_CHECKED int mean_chain_read(const double *numbers, size_t count, struct srnf_warp *chain);

/* ---- mean_landmarks.c ------------------------------------------------------------------------ */

/* Whether landmarks guide the warps. */
bool mean_is_guided(const struct mean_run *run);
/* Checks those of all subjects. */
SRNF_CHECKED int mean_landmarks_create(struct mean_run *run, struct srnf_error *error);
/* Those of the mean where it starts: of that subject, or amid all. */
void mean_landmarks_start(struct mean_run *run, size_t start);
/* Those that guide subject i. */
struct srnf_landmarks mean_landmarks_of(const struct mean_run *run, size_t i);
/* What is left of them, after a step of the fields that is not taken yet, or NULL. */
SRNF_CHECKED int mean_landmarks_measure(const struct mean_run *run, size_t i, const double *step);
/* From the step of subject i without landmarks to that with them. matrix, curvature: that the step
   was found by. */
SRNF_CHECKED int mean_landmarks_correct(const struct mean_run *run, size_t i,
                                        struct mean_matrix *matrix, double curvature, double *step);
/* The mean's move to where the squared angles to those of the subjects are least, by one step or
   to the end; exact ones stay. */
SRNF_CHECKED int mean_landmarks_follow(struct mean_run *run, bool to_the_end,
                                       struct srnf_error *error);
SRNF_CHECKED int mean_landmarks_hand_over(struct mean_run *run, struct srnf_mean *mean,
                                          struct srnf_error *error);

/* ---- mean_step.c ----------------------------------------------------------------------------- */

/* One step of all warps, and the mean after it. Without any that lowers G all stays as it is. */
SRNF_CHECKED int mean_descend(struct mean_run *run, struct stats_progress progress,
                              struct srnf_error *error);

/* ---- mean_create.c --------------------------------------------------------------------------- */

/* All that a run works with, from its first members: sht, context, n and surfaces. To be cleared
   in any case. */
SRNF_CHECKED int mean_run_create(struct mean_run *run, const struct srnf_mean_options *options,
                                 struct srnf_error *error);
void mean_run_clear(struct mean_run *run);

/* ---- mean_start.c ---------------------------------------------------------------------------- */

/* The fields of all, or their plain average, N, and the tools that are kept. */
SRNF_CHECKED int mean_begin(struct mean_run *run, struct srnf_error *error);
/* mean_q where nothing is known of it yet. start: a subject, or STATS_START_DEFAULT. */
SRNF_CHECKED int mean_start(struct mean_run *run, size_t start, struct srnf_error *error);
/* As a checkpoint has it. */
SRNF_CHECKED int mean_resume(struct mean_run *run, const struct srnf_mean_options *options,
                             struct srnf_error *error);
/* The mean of all as they are parameterized, and the variance; where nothing is registered. */
void mean_average_plain(struct mean_run *run);

/* ---- mean_objective.c ------------------------------------------------------------------------ */

/* target <- mean_q */
void mean_set_target(struct mean_run *run);
/* The variance about average, of fields whose energies were measured against mean_q. */
double mean_variance_about(const struct mean_run *run, const double *average);
/* mean_q and target <- average, of that variance. */
void mean_adopt(struct mean_run *run, double variance);
/* G with a variance, and the penalties as they are. */
double mean_objective(const struct mean_run *run, double variance);
/* G as the subjects were last measured. */
double mean_measured(const struct mean_run *run);

/* ---- mean_center.c --------------------------------------------------------------------------- */

/* Moves the centre by a Newton step to where the penalties are less, unless it is there to
   rounding. SRNF_ENUMERIC: the step is no number. */
SRNF_CHECKED int mean_center(struct mean_run *run, struct srnf_error *error);
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

/* ---- mean_kept.c: the first registration of each subject as parts of a run ------------------- */

/* A digest, and what there is of landmarks. */
uint64_t mean_hash_landmarks(const struct mean_run *run, uint64_t hash);
uint64_t mean_series(const struct mean_run *run, size_t start);
/* Offers the registration of subject i to be kept. */
void mean_keep_registered(const struct mean_run *run, size_t i, const struct srnf_context *context);
/* Rotation and chain, which the caller closes, as an earlier attempt has left them; false: it has
   left none. */
bool mean_recall_registered(const struct mean_run *run, size_t i,
                            const struct srnf_context *context, struct srnf_warp *chain);

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
