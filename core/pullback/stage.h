/*
 * stage.h - the surfaces of one shooting, transport or transfer as they lie in space: copies that
 * are laid on each other, the velocity at them, and where their centroids are.
 */
#ifndef SRNF_PULLBACK_STAGE_H
#define SRNF_PULLBACK_STAGE_H

#include "pullback.h"

#define STAGE_SURFACES 3

struct stage {
    const struct srnf_sht *sht;
    const struct srnf_register_options *registration;
    const struct srnf_context *context;
    struct srnf_error *error;
    const char **step;       /* what is being done */
    size_t count, values, n; /* of a surface, of a field; surfaces */
    double *memory;          /* of those below */
    double *surfaces[STAGE_SURFACES];
    double *motion;   /* of the velocity, or NULL */
    double *velocity; /* [3][n_theta][n_phi] */
    void *workspace;
    double centroids[STAGE_SURFACES][3]; /* turned with the surfaces when these are registered */
};

/*
 * Copies n surfaces and what is given of the velocity, and measures where the surfaces lie. sht,
 * registration, context, error and step are set before; error is filled by all that fails.
 *   velocity  [in] its surface toward, if there is one, is the last of the surfaces; NULL: there is
 *                  none
 * SRNF_EINVAL (a number that is not finite, a velocity that is none), SRNF_ENOMEM. stage_close in
 * any case.
 */
SRNF_CHECKED int stage_open(struct stage *stage, size_t n, const double *const *surfaces,
                            const struct srnf_velocity *velocity);
void stage_close(struct stage *stage);
/* Fills the error from a status that has brought none of its own, and returns it. */
int stage_fail(const struct stage *stage, int status);

/* Registers one surface of the stage to another and puts it in the place of itself. */
SRNF_CHECKED int stage_lay(struct stage *stage, size_t fixed, size_t moving, const char *step,
                           struct srnf_registration *registration);
/* Takes coefficients along with a registration, in place. */
SRNF_CHECKED int stage_take_along(struct stage *stage, const struct srnf_registration *registration,
                                  double *coefficients);
/* The same for a surface of the stage. */
SRNF_CHECKED int stage_take_surface_along(struct stage *stage,
                                          const struct srnf_registration *registration, size_t i);

/* The velocity at a surface of the stage, as it lies there, into stage->velocity. given: as of
   stage_open; toward: the place of its surface, or STAGE_SURFACES. */
SRNF_CHECKED int stage_find_velocity(struct stage *stage, const struct srnf_velocity *given,
                                     size_t surface, size_t toward);
/* The same velocity for the pulled-back metric. */
struct srnf_velocity stage_velocity(const struct stage *stage, size_t toward);
/* How the centroid goes in one unit of time: by the motion, or between two surfaces. */
void stage_drift(const struct stage *stage, size_t from, size_t toward, double rate[3]);
/* Measures a surface that was reached, and puts its centroid where that of a surface of the stage
   is after so much time. */
void stage_place(const struct stage *stage, size_t from, const double rate[3], double t,
                 double *coefficients, struct srnf_surface_measures *measures);

#endif
