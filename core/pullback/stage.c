/*
 * stage.c - surfaces as they lie in space, laid on each other and placed.
 *
 * SRNFs do not know translations: the centroids of the surfaces, as they lie, say where an answer
 * belongs.
 */
#include "stage.h"

#include <string.h>

int stage_fail(const struct stage *stage, int status)
{
    return status ? srnf_fail(stage->error, status, -1, "%s", srnf_strerror(status)) : SRNF_OK;
}

void stage_close(struct stage *stage)
{
    srnf_free(stage->memory);
    srnf_free(stage->workspace);
}

int stage_open(struct stage *stage, size_t n, const double *const *surfaces,
               const struct srnf_velocity *velocity)
{
    const double *motion = velocity ? velocity->motion : NULL;
    const double *field = velocity && !motion && !velocity->toward ? velocity->field : NULL;

    *stage->step = "preparing the surfaces";
    stage->count = 3 * srnf_coefficient_count(srnf_sht_degree(stage->sht));
    stage->values = pullback_field_values(stage->sht);
    stage->n = n;
    for (size_t i = 0; i < n; i++) {
        if (!srnf_check_finite(stage->count, surfaces[i], "coefficient of a surface",
                               stage->error)) {
            return SRNF_EINVAL;
        }
    }
    if (velocity && !motion && !velocity->toward && !field) {
        return srnf_fail(stage->error, SRNF_EINVAL, -1, "there is no velocity");
    }
    if ((motion &&
         !srnf_check_finite(stage->count, motion, "coefficient of the velocity", stage->error)) ||
        (field &&
         !srnf_check_finite(stage->values, field, "value of the velocity", stage->error))) {
        return SRNF_EINVAL;
    }
    stage->memory = srnf_alloc((STAGE_SURFACES + 1) * stage->count + stage->values, sizeof(double));
    stage->workspace = srnf_alloc(1, srnf_surface_workspace_size(stage->sht));
    if (!stage->memory || !stage->workspace) {
        return stage_fail(stage, SRNF_ENOMEM);
    }
    for (size_t i = 0; i < n; i++) {
        struct srnf_surface_measures measures;

        stage->surfaces[i] = stage->memory + i * stage->count;
        linear_copy(stage->count, surfaces[i], stage->surfaces[i]);
        srnf_surface_measure(stage->sht, surfaces[i], &measures, stage->workspace);
        memcpy(stage->centroids[i], measures.centroid, sizeof measures.centroid);
    }
    if (motion) {
        stage->motion = stage->memory + STAGE_SURFACES * stage->count;
        linear_copy(stage->count, motion, stage->motion);
    }
    stage->velocity = stage->memory + (STAGE_SURFACES + 1) * stage->count;
    return SRNF_OK;
}

/* ---- Laying surfaces on each other ----------------------------------------------------------- */

static void turn(const double rotation[9], double x[3])
{
    const double y[3] = {x[0], x[1], x[2]};

    for (size_t k = 0; k < 3; k++) {
        x[k] = rotation[3 * k] * y[0] + rotation[3 * k + 1] * y[1] + rotation[3 * k + 2] * y[2];
    }
}

int stage_lay(struct stage *stage, size_t fixed, size_t moving, const char *step,
              struct srnf_registration *registration)
{
    int status;

    *stage->step = step;
    status = srnf_register(stage->sht, stage->surfaces[fixed], NULL, stage->surfaces[moving],
                           stage->registration, NULL, stage->context, registration, stage->error);
    if (status < 0) {
        return status;
    }
    linear_copy(stage->count, registration->coefficients, stage->surfaces[moving]);
    turn(registration->rotation, stage->centroids[moving]);
    return SRNF_OK;
}

int stage_take_along(struct stage *stage, const struct srnf_registration *registration,
                     double *coefficients)
{
    *stage->step = "applying the registration";
    return stage_fail(stage, srnf_registration_apply(stage->sht, registration, coefficients,
                                                     stage->context, coefficients));
}

int stage_take_surface_along(struct stage *stage, const struct srnf_registration *registration,
                             size_t i)
{
    turn(registration->rotation, stage->centroids[i]);
    return stage_take_along(stage, registration, stage->surfaces[i]);
}

/* ---- Velocities and places ------------------------------------------------------------------- */

int stage_find_velocity(struct stage *stage, const struct srnf_velocity *given, size_t surface,
                        size_t toward)
{
    *stage->step = "finding the velocity";
    if (stage->motion) {
        srnf_field_differential(stage->sht, stage->surfaces[surface], stage->motion,
                                stage->velocity, stage->workspace);
    } else if (toward < stage->n) {
        return stage_fail(stage, srnf_velocity_toward(stage->sht, stage->surfaces[surface],
                                                      stage->surfaces[toward], stage->velocity));
    } else {
        linear_copy(stage->values, given->field, stage->velocity);
    }
    return SRNF_OK;
}

struct srnf_velocity stage_velocity(const struct stage *stage, size_t toward)
{
    return (struct srnf_velocity){.motion = stage->motion,
                                  .toward = toward < stage->n ? stage->surfaces[toward] : NULL,
                                  .field = stage->velocity};
}

void stage_drift(const struct stage *stage, size_t from, size_t toward, double rate[3])
{
    for (size_t k = 0; k < 3; k++) {
        rate[k] = 0.0;
        if (stage->motion) {
            rate[k] = stage->motion[k * stage->count / 3] / SRNF_SQRT_4_PI;
        } else if (toward < stage->n) {
            rate[k] = stage->centroids[toward][k] - stage->centroids[from][k];
        }
    }
}

void stage_place(const struct stage *stage, size_t from, const double rate[3], double t,
                 double *coefficients, struct srnf_surface_measures *measures)
{
    double target[3];

    srnf_surface_measure(stage->sht, coefficients, measures, stage->workspace);
    for (size_t k = 0; k < 3; k++) {
        target[k] = stage->centroids[from][k] + t * rate[k];
    }
    srnf_surface_move(srnf_sht_degree(stage->sht), coefficients, measures, target);
}
