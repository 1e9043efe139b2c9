/*
 * deform.c - shooting, transport and transfer between surfaces as they lie in space: they are laid
 * on each other where that is asked for, moved in one metric or the other, and what is reached is
 * placed.
 *
 * What is registered to what keeps the answer in the pose and parameterization of the surface that
 * it is about. What goes along is cut to the degree of the transform (srnf_registration_apply).
 */
#include "geodesic/geodesic.h"
#include "stage.h"

#include <math.h>

static struct stage stage_of(const struct srnf_sht *sht, const struct srnf_deform_options *options,
                             const struct srnf_context *context, const char **step,
                             struct srnf_error *error)
{
    return (struct stage){.sht = sht,
                          .registration = options->registration,
                          .context = context,
                          .step = step,
                          .error = error};
}

/* ---- Shooting -------------------------------------------------------------------------------- */

void srnf_deform_shoot_clear(struct srnf_deform_shoot *result)
{
    srnf_registration_clear(&result->toward);
    srnf_shot_clear(&result->shot);
    srnf_free(result->measures);
    pullback_paths_clear(&result->paths);
    *result = (struct srnf_deform_shoot){.step = result->step};
}

static int shoot(struct stage *stage, const struct srnf_velocity *velocity, size_t toward, size_t n,
                 const double *times, bool pullback, struct srnf_deform_shoot *result)
{
    const double *surface = stage->surfaces[0];
    struct srnf_velocity motion;
    double rate[3];
    int status = SRNF_OK;

    if (toward < stage->n && stage->registration) {
        status = stage_lay(stage, 0, 1, "registering the surface that the velocity is toward",
                           &result->toward);
    }
    status = status ? status : stage_find_velocity(stage, velocity, 0, toward);
    if (status) {
        return status;
    }
    *stage->step = "shooting";
    motion = stage_velocity(stage, toward);
    status = geodesic_check_times(n, times, stage->error);
    if (status == SRNF_OK && pullback) {
        status = pullback_shoot(stage->sht, surface, &motion, stage->velocity, n, times,
                                stage->context, &result->shot, &result->paths, stage->error);
    } else if (status == SRNF_OK) {
        status = srnf_shoot(stage->sht, surface, stage->velocity, n, times, stage->context,
                            &result->shot, stage->error);
    }
    if (status) {
        return status;
    }
    *stage->step = "measuring the surfaces";
    result->measures = srnf_alloc(n, sizeof *result->measures);
    if (!result->measures) {
        return stage_fail(stage, SRNF_ENOMEM);
    }
    stage_drift(stage, 0, toward, rate);
    for (size_t i = 0; i < n; i++) {
        stage_place(stage, 0, rate, times[i], result->shot.coefficients + i * stage->count,
                    &result->measures[i]);
    }
    return SRNF_OK;
}

int srnf_deform_shoot(const struct srnf_sht *sht, const double *surface,
                      const struct srnf_velocity *velocity, size_t n, const double *times,
                      const struct srnf_deform_options *options, const struct srnf_context *context,
                      struct srnf_deform_shoot *result, struct srnf_error *error)
{
    const double *surfaces[2] = {surface, velocity->toward};
    bool pointed = !velocity->motion && velocity->toward;
    struct stage stage = stage_of(sht, options, context, &result->step, error);
    int status;

    *result = (struct srnf_deform_shoot){.step = NULL};
    status = stage_open(&stage, pointed ? 2 : 1, surfaces, velocity);
    if (status == SRNF_OK) {
        status = shoot(&stage, velocity, pointed ? 1 : STAGE_SURFACES, n, times, options->pullback,
                       result);
    }
    if (status) {
        srnf_deform_shoot_clear(result);
    }
    stage_close(&stage);
    return status;
}

/* ---- Transport ------------------------------------------------------------------------------- */

enum { FROM, TO, TOWARD };

void srnf_deform_transport_clear(struct srnf_deform_transport *result)
{
    srnf_registration_clear(&result->toward);
    srnf_registration_clear(&result->from);
    srnf_free(result->velocity);
    srnf_tangent_clear(&result->tangent);
    srnf_shot_clear(&result->shot);
    pullback_paths_clear(&result->paths);
    *result = (struct srnf_deform_transport){.step = result->step};
}

/* Lays `toward` on `from`, and both with the motion on `to`. */
static int lay_vector(struct stage *stage, size_t toward, struct srnf_deform_transport *result)
{
    int status = SRNF_OK;

    if (toward < stage->n) {
        status = stage_lay(stage, FROM, TOWARD, "registering the surface that the vector is toward",
                           &result->toward);
    }
    if (status == SRNF_OK) {
        status = stage_lay(stage, TO, FROM, "registering from to to", &result->from);
    }
    if (status == SRNF_OK && toward < stage->n) {
        status = stage_take_surface_along(stage, &result->from, TOWARD);
    } else if (status == SRNF_OK && stage->motion) {
        status = stage_take_along(stage, &result->from, stage->motion);
    }
    return status;
}

/* The vector at `to`, and the surface that it leads to, in the one metric or the other. */
static int carry_vector(struct stage *stage, size_t toward, bool pullback,
                        struct srnf_deform_transport *result)
{
    const double one = 1.0;
    const double *to = stage->surfaces[TO];
    struct srnf_velocity vector = stage_velocity(stage, toward);
    int status;

    *stage->step = "transporting the vector";
    if (pullback) {
        return pullback_carry(stage->sht, stage->surfaces[FROM], to, &vector, stage->context,
                              stage->velocity, &result->tangent, &result->shot, &result->paths,
                              stage->error);
    }
    status = srnf_transport(stage->sht, to, stage->velocity, stage->context, &result->tangent,
                            stage->error);
    return status ? status
                  : srnf_shoot(stage->sht, to, stage->velocity, 1, &one, stage->context,
                               &result->shot, stage->error);
}

static int transport(struct stage *stage, const struct srnf_velocity *vector, size_t toward,
                     bool pullback, struct srnf_deform_transport *result)
{
    double rate[3];
    int status = stage->registration ? lay_vector(stage, toward, result) : SRNF_OK;

    status = status ? status : stage_find_velocity(stage, vector, FROM, toward);
    status = status ? status : carry_vector(stage, toward, pullback, result);
    if (status) {
        return status;
    }
    result->velocity = srnf_alloc(stage->values, sizeof(double));
    if (!result->velocity) {
        return stage_fail(stage, SRNF_ENOMEM);
    }
    linear_copy(stage->values, stage->velocity, result->velocity);
    for (size_t k = 0; stage->motion && k < 3; k++) {
        size_t i = k * stage->count / 3;

        result->tangent.coefficients[i] = stage->motion[i];
    }
    stage_drift(stage, FROM, toward, rate);
    stage_place(stage, TO, rate, 1.0, result->shot.coefficients, &result->measures);
    return SRNF_OK;
}

int srnf_deform_transport(const struct srnf_sht *sht, const double *from, const double *to,
                          const struct srnf_velocity *vector,
                          const struct srnf_deform_options *options,
                          const struct srnf_context *context, struct srnf_deform_transport *result,
                          struct srnf_error *error)
{
    const double *surfaces[3] = {from, to, vector->toward};
    bool pointed = !vector->motion && vector->toward;
    struct stage stage = stage_of(sht, options, context, &result->step, error);
    int status;

    *result = (struct srnf_deform_transport){.step = NULL};
    status = stage_open(&stage, pointed ? 3 : 2, surfaces, vector);
    if (status == SRNF_OK) {
        status =
            transport(&stage, vector, pointed ? TOWARD : STAGE_SURFACES, options->pullback, result);
    }
    if (status) {
        srnf_deform_transport_clear(result);
    }
    stage_close(&stage);
    return status;
}

/* ---- Transfer -------------------------------------------------------------------------------- */

#define UNIT_AREA 1e-6 /* how near to 1 the area of a surface is that was divided by it */

enum { SOURCE, DEFORMED, TARGET };

void srnf_deform_transfer_clear(struct srnf_deform_transfer *result)
{
    srnf_registration_clear(&result->deformed);
    srnf_registration_clear(&result->source);
    srnf_transferred_clear(&result->transferred);
    pullback_paths_clear(&result->paths);
    *result = (struct srnf_deform_transfer){.step = result->step};
}

/* Lays the deformed surface on its source, and both on the target. */
static int lay_deformation(struct stage *stage, struct srnf_deform_transfer *result)
{
    int status = stage_lay(stage, SOURCE, DEFORMED,
                           "registering the deformed surface to its source", &result->deformed);

    if (status == SRNF_OK) {
        status = stage_lay(stage, TARGET, SOURCE, "registering the source to the target",
                           &result->source);
    }
    return status ? status : stage_take_surface_along(stage, &result->source, DEFORMED);
}

/* Deformed in the units of its source, or all three in the units that they share. */
static void set_units(struct stage *stage, const double scales[3], enum srnf_transfer_size size)
{
    double source = size == SRNF_TRANSFER_ABSOLUTE ? scales[SOURCE] / scales[TARGET] : 1.0;
    double deformed = source * scales[DEFORMED] / scales[SOURCE];

    linear_scale(stage->count, source, stage->surfaces[SOURCE]);
    linear_scale(3, source, stage->centroids[SOURCE]);
    linear_scale(stage->count, deformed, stage->surfaces[DEFORMED]);
    linear_scale(3, deformed, stage->centroids[DEFORMED]);
}

/* In the one metric or the other. */
static int transfer_between(struct stage *stage, enum srnf_transfer_size size, bool pullback,
                            struct srnf_deform_transfer *result)
{
    const double *const surfaces[3] = {stage->surfaces[SOURCE], stage->surfaces[DEFORMED],
                                       stage->surfaces[TARGET]};

    *stage->step = "transferring the deformation";
    return pullback
               ? pullback_transfer_sized(stage->sht, surfaces, size, stage->context,
                                         &result->transferred, &result->paths, stage->error)
               : srnf_transfer(stage->sht, surfaces[SOURCE], surfaces[DEFORMED], surfaces[TARGET],
                               size, stage->context, &result->transferred, stage->error);
}

/* Whether sizes are in the coefficients, as of surfaces that were never scaled, and not in the
   scale: then the scale is 1, and the area is not, but by chance. */
static bool has_own_size(const double scales[3], double area)
{
    return scales[TARGET] == 1.0 &&
           ((scales[SOURCE] == 1.0 && scales[DEFORMED] == 1.0) || fabs(area - 1.0) > UNIT_AREA);
}

/* The surface where the target is, moved as the deformed one is against its source. A change of
   size by a ratio goes to where the target has its size: of unit area into the scale. */
static void settle(struct stage *stage, const double scales[3], enum srnf_transfer_size size,
                   struct srnf_deform_transfer *result)
{
    struct srnf_transferred *transferred = &result->transferred;
    struct srnf_surface_measures source, target;
    double rate[3], ratio = 1.0;

    stage_drift(stage, SOURCE, DEFORMED, rate);
    if (size == SRNF_TRANSFER_RATIO) {
        srnf_surface_measure(stage->sht, stage->surfaces[SOURCE], &source, stage->workspace);
        srnf_surface_measure(stage->sht, stage->surfaces[TARGET], &target, stage->workspace);
        linear_scale(3, sqrt(target.area / source.area), rate);
        ratio = has_own_size(scales, target.area) ? 1.0 : transferred->size_ratio;
    }
    stage_place(stage, TARGET, rate, 1.0, transferred->coefficients, &result->measures);
    linear_scale(stage->count, 1.0 / ratio, transferred->coefficients);
    srnf_surface_measure(stage->sht, transferred->coefficients, &result->measures,
                         stage->workspace);
    result->scale = scales[TARGET] * ratio;
}

int srnf_deform_transfer(const struct srnf_sht *sht, const double *const surfaces[3],
                         const double scales[3], enum srnf_transfer_size size,
                         const struct srnf_deform_options *options,
                         const struct srnf_context *context, struct srnf_deform_transfer *result,
                         struct srnf_error *error)
{
    struct stage stage = stage_of(sht, options, context, &result->step, error);
    int status;

    *result = (struct srnf_deform_transfer){.step = NULL};
    for (size_t i = 0; i < 3; i++) {
        if (!(scales[i] > 0.0) || !isfinite(scales[i])) {
            result->step = "reading the scales";
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i, "scale %zu is not above 0", i);
        }
    }
    status = stage_open(&stage, 3, surfaces, NULL);
    if (status == SRNF_OK && stage.registration) {
        status = lay_deformation(&stage, result);
    }
    if (status == SRNF_OK) {
        set_units(&stage, scales, size);
        status = transfer_between(&stage, size, options->pullback, result);
    }
    if (status == SRNF_OK) {
        settle(&stage, scales, size, result);
    } else {
        srnf_deform_transfer_clear(result);
    }
    stage_close(&stage);
    return status;
}
