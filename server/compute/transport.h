/*
 * transport.h - the processes shoot, transport and transfer: what moves one surface moves
 * another.
 */
#ifndef SRNFD_COMPUTE_TRANSPORT_H
#define SRNFD_COMPUTE_TRANSPORT_H

#include "compute/group.h"
#include "compute/pullback.h"

/* A velocity at a surface: exactly one of the three is given. */
struct compute_velocity {
    const char *toward;         /* id of a surface or mesh: the line ends there at t = 1 */
    const double *coefficients; /* [3][(degree+1)^2]: the motion of the surface's points */
    size_t degree;              /* at most that of the surfaces */
    const double *field; /* [3][n_theta][n_phi] in the space of SRNFs, on the working grid of the
                            largest degree */
};

/* Surfaces of a common degree and the transform of its working grid. */
struct compute_stage {
    struct jobs *jobs;
    struct compute_group group;
    const struct srnf_sht *sht;
    double *velocity; /* [3][n_theta][n_phi] */
    double *motion;   /* the coefficients of the velocity at the common degree, or NULL */
    void *workspace;
    double centroids[3][3]; /* of the surfaces, where they lie: turned with them when registered */
};

struct compute_shoot_inputs {
    const char *surface;
    struct compute_velocity velocity;
    const struct srnf_register_options *registration; /* of toward to surface; NULL: as they are */
    size_t n;
    const double *times;
    bool pullback; /* in the pulled-back metric instead of L2: here and below */
};
struct compute_shoot_outputs {
    struct compute_stage stage; /* surface, toward if there is one */
    struct srnf_registration registration;
    struct srnf_shot shot;
    struct compute_pullback pullback;
    struct srnf_surface_measures *measures; /* [n], owned */
};
/* Each returns 0, or a negative status with the problem in result and outputs cleared. */
int compute_shoot(struct jobs_run *run, const struct compute_shoot_inputs *inputs,
                  struct compute_shoot_outputs *outputs, struct jobs_result *result);
void compute_shoot_clear(struct compute_shoot_outputs *outputs);

struct compute_transport_inputs {
    const char *from, *to;
    struct compute_velocity vector;                   /* at from */
    const struct srnf_register_options *registration; /* of toward to from, and from to to */
    bool pullback;
};
struct compute_transport_outputs {
    struct compute_stage stage; /* from, to, toward if there is one; velocity as it arrived */
    struct srnf_registration toward, from;
    struct srnf_tangent tangent;
    struct srnf_shot shot; /* the surface reached from to at t = 1 */
    struct compute_pullback pullback;
    struct srnf_surface_measures measures;
};
int compute_transport(struct jobs_run *run, const struct compute_transport_inputs *inputs,
                      struct compute_transport_outputs *outputs, struct jobs_result *result);
void compute_transport_clear(struct compute_transport_outputs *outputs);

struct compute_transfer_inputs {
    const char *source, *deformed, *target;
    const struct srnf_register_options *registration; /* of deformed to source, source to target */
    enum srnf_transfer_size size;
    double scales[3]; /* of source, deformed, target; 0: encoded here */
    bool pullback;
};
struct compute_transfer_outputs {
    struct compute_stage stage; /* source, deformed, target */
    struct srnf_registration deformed, source;
    struct srnf_transferred transferred; /* at the size of the target for SRNF_TRANSFER_RATIO */
    struct compute_pullback pullback;
    double scale; /* of the surface: what multiplies it back to the units of the target */
    struct srnf_surface_measures measures;
};
int compute_transfer(struct jobs_run *run, const struct compute_transfer_inputs *inputs,
                     struct compute_transfer_outputs *outputs, struct jobs_result *result);
void compute_transfer_clear(struct compute_transfer_outputs *outputs);

#endif
