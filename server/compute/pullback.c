/*
 * pullback.c - shoot, transport and transfer in the pulled-back metric.
 *
 * A velocity is a motion of the surface: given as one, the logarithm of the surface that it is
 * toward, or the motion whose Q_* is nearest to a field. It is shot by one exponential for each
 * time, so that a time's surface does not depend on the others asked for.
 *
 * Energies keep the meaning that they have in the space of SRNFs, squared distances from the
 * straight line there: here they tell how far the two frameworks are apart.
 */
#include "compute/pullback.h"

#include <math.h>
#include <string.h>

void compute_pullback_clear(struct compute_pullback *pullback)
{
    srnf_free(pullback->shots);
    *pullback = (struct compute_pullback){0};
}

/* The context of one of several parts: silent, since each would count from 0 again. */
static struct srnf_context quiet_context(const struct srnf_context *context)
{
    struct srnf_context quiet = *context;

    quiet.progress = NULL;
    return quiet;
}

static void tell(const struct srnf_context *context, double fraction, const char *message)
{
    if (context->progress) {
        context->progress(context->user, fraction, message);
    }
}

static size_t field_values(const struct srnf_sht *sht)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);

    return 3 * grid->n_theta * grid->n_phi;
}

static size_t surface_values(const struct srnf_sht *sht)
{
    return 3 * srnf_coefficient_count(srnf_sht_degree(sht));
}

static int out_of_memory(struct srnf_error *error)
{
    *error = (struct srnf_error){.status = SRNF_ENOMEM, .element = -1};
    return SRNF_ENOMEM;
}

/* ---- Velocities ------------------------------------------------------------------------------ */

/* The velocity as a motion; residual and products where it was a field. */
static int find_motion(const struct srnf_sht *sht, const double *surface,
                       const struct compute_pullback_velocity *velocity, size_t segments,
                       const struct srnf_context *context, double *motion,
                       struct srnf_tangent *tangent, struct compute_pullback *pullback,
                       struct srnf_error *error)
{
    size_t size = surface_values(sht) * sizeof(double);
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_log_figures log;
    int status = SRNF_OK;

    if (velocity->motion) {
        memcpy(motion, velocity->motion, size);
    } else if (velocity->toward) {
        options.segments = segments;
        status = srnf_pullback_log(sht, surface, velocity->toward, &options, context, motion, &log,
                                   error);
        if (status >= 0) {
            pullback->toward = (struct compute_pullback_leg){.path = log.path,
                                                             .segments = segments,
                                                             .iterations = log.iterations,
                                                             .residual = log.gradient,
                                                             .converged = status == SRNF_OK};
            pullback->converged = pullback->converged && status == SRNF_OK;
            tangent->transforms = log.transforms;
        }
    } else {
        status = srnf_transport(sht, surface, velocity->field, context, tangent, error);
        if (status >= 0) {
            memcpy(motion, tangent->coefficients, size);
            pullback->converged = pullback->converged && tangent->converged;
            srnf_free(tangent->coefficients);
            tangent->coefficients = NULL;
        }
    }
    return status < 0 ? status : 0;
}

/* ---- Shooting -------------------------------------------------------------------------------- */

/* Squared distance of the surface's SRNF from base + t line, and the same relative to the square of
   that; scratch is a field. */
static void measure_energy(const struct srnf_sht *sht, const double *surface, const double *base,
                           double t, const double *line, double *scratch, void *workspace,
                           double *energy, double *relative)
{
    size_t values = field_values(sht);

    for (size_t i = 0; i < values; i++) {
        scratch[i] = base[i] + t * line[i];
    }
    *energy = srnf_energy(sht, surface, scratch, NULL, workspace);
    *relative = *energy / srnf_inner_product(srnf_sht_grid(sht), scratch, scratch);
}

/* The surface at one time into f. */
static int follow(const struct srnf_sht *sht, const double *surface, const double *motion, double t,
                  const struct srnf_context *context, double *scaled, double *f,
                  struct compute_pullback_leg *leg, double *transforms, struct srnf_error *error)
{
    size_t count = surface_values(sht);
    size_t segments = COMPUTE_PULLBACK_SEGMENTS * (size_t)fmax(1.0, ceil(fabs(t)));
    struct srnf_pullback_shot shot;
    int status;

    *leg = (struct compute_pullback_leg){.converged = true};
    if (t == 0.0) {
        memcpy(f, surface, count * sizeof(double));
        return 0;
    }
    for (size_t i = 0; i < count; i++) {
        scaled[i] = t * motion[i];
    }
    status = srnf_pullback_exp(sht, surface, scaled, segments, context, &shot, error);
    if (status < 0) {
        return status;
    }
    memcpy(f, shot.coefficients + segments * count, count * sizeof(double));
    *leg = (struct compute_pullback_leg){.path = shot.path,
                                         .segments = segments,
                                         .iterations = shot.iterations,
                                         .residual = shot.residual,
                                         .converged = status == SRNF_OK};
    *transforms += shot.transforms;
    srnf_pullback_shot_clear(&shot);
    return 0;
}

/* Surfaces, energies and figures at all times; progress goes from `from` to 1. */
static int shoot_motion(const struct srnf_sht *sht, const double *surface, const double *motion,
                        const double *line, size_t n, const double *times,
                        const struct srnf_context *context, double from, struct srnf_shot *shot,
                        struct compute_pullback *pullback, struct srnf_error *error)
{
    size_t count = surface_values(sht);
    size_t values = field_values(sht);
    struct srnf_context quiet = quiet_context(context);
    double *memory = srnf_alloc(2 * values + count, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    int status = 0;

    *shot = (struct srnf_shot){.degree = srnf_sht_degree(sht), .n = n};
    shot->coefficients = srnf_alloc(n * count, sizeof(double));
    shot->energy = srnf_alloc(2 * n, sizeof(double));
    pullback->shots = srnf_alloc(n, sizeof *pullback->shots);
    if (!memory || !workspace || !shot->coefficients || !shot->energy || !pullback->shots) {
        status = out_of_memory(error);
        goto out;
    }
    shot->relative_energy = shot->energy + n;
    pullback->n = n;
    srnf_field(sht, surface, memory, workspace);
    for (size_t i = 0; i < n; i++) {
        double *f = shot->coefficients + i * count;

        tell(context, from + (1.0 - from) * (double)i / (double)n, "following the geodesic");
        status = follow(sht, surface, motion, times[i], &quiet, memory + 2 * values, f,
                        &pullback->shots[i], &shot->transforms, error);
        if (status) {
            goto out;
        }
        pullback->converged = pullback->converged && pullback->shots[i].converged;
        measure_energy(sht, f, memory, times[i], line, memory + values, workspace, &shot->energy[i],
                       &shot->relative_energy[i]);
    }
    tell(context, 1.0, "the surfaces are there");
out:
    srnf_free(memory);
    srnf_free(workspace);
    if (status) {
        srnf_shot_clear(shot);
    }
    return status;
}

int compute_pullback_shoot(const struct srnf_sht *sht, const double *surface,
                           const struct compute_pullback_velocity *velocity, const double *line,
                           size_t n, const double *times, const struct srnf_context *context,
                           struct srnf_shot *shot, struct compute_pullback *pullback,
                           struct srnf_error *error)
{
    struct srnf_context quiet = quiet_context(context);
    struct srnf_tangent tangent = {0};
    double *motion = srnf_alloc(surface_values(sht), sizeof(double));
    int status;

    *pullback = (struct compute_pullback){.asked = true, .converged = true};
    if (!motion) {
        return out_of_memory(error);
    }
    status = find_motion(sht, surface, velocity, COMPUTE_PULLBACK_SEGMENTS, &quiet, motion,
                         &tangent, pullback, error);
    if (status == 0) {
        status =
            shoot_motion(sht, surface, motion, line, n, times, context, 0.3, shot, pullback, error);
    }
    if (status == 0) {
        shot->transforms += tangent.transforms;
    } else {
        compute_pullback_clear(pullback);
    }
    srnf_free(motion);
    return status;
}

/* ---- Transport ------------------------------------------------------------------------------- */

/* The motion at `from` becomes tangent->coefficients at `to`, along their geodesic. */
static int carry(const struct srnf_sht *sht, const double *from, const double *to,
                 const double *motion, const struct srnf_context *context,
                 struct srnf_tangent *tangent, struct compute_pullback *pullback,
                 struct srnf_error *error)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transported moved;
    struct srnf_pullback_geodesic path;
    int status;

    options.segments = COMPUTE_PULLBACK_TRANSPORT_SEGMENTS;
    options.compare = false;
    status = srnf_pullback_geodesic(sht, from, to, &options, context, &path, error);
    if (status < 0) {
        return status;
    }
    pullback->along = (struct compute_pullback_leg){.path = path.path,
                                                    .segments = options.segments,
                                                    .iterations = path.iterations,
                                                    .residual = path.gradient,
                                                    .converged = path.converged};
    pullback->converged = pullback->converged && path.converged;
    status = srnf_pullback_transport(sht, options.segments, path.coefficients, motion, context,
                                     &moved, error);
    if (status >= 0) {
        tangent->coefficients = moved.vector;
        tangent->norm = moved.norm;
        tangent->transforms += path.transforms + moved.transforms;
        pullback->norm_from = moved.norm_from;
        pullback->norm = moved.norm;
        status = 0;
    }
    srnf_pullback_geodesic_clear(&path);
    return status;
}

int compute_pullback_transport(const struct srnf_sht *sht, const double *from, const double *to,
                               const struct compute_pullback_velocity *vector,
                               const struct srnf_context *context, double *line,
                               struct srnf_tangent *tangent, struct srnf_shot *shot,
                               struct compute_pullback *pullback, struct srnf_error *error)
{
    const double one = 1.0;
    struct srnf_context quiet = quiet_context(context);
    double *motion = srnf_alloc(surface_values(sht), sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    int status;

    *pullback = (struct compute_pullback){.asked = true, .converged = true};
    *tangent = (struct srnf_tangent){0};
    if (!motion || !workspace) {
        status = out_of_memory(error);
        goto out;
    }
    status = find_motion(sht, from, vector, COMPUTE_PULLBACK_SEGMENTS, &quiet, motion, tangent,
                         pullback, error);
    if (status == 0) {
        tell(context, 0.4, "transporting the vector");
        status = carry(sht, from, to, motion, &quiet, tangent, pullback, error);
    }
    if (status == 0) {
        srnf_field_differential(sht, to, tangent->coefficients, line, workspace);
        status = shoot_motion(sht, to, tangent->coefficients, line, 1, &one, context, 0.8, shot,
                              pullback, error);
    }
out:
    srnf_free(motion);
    srnf_free(workspace);
    if (status) {
        srnf_tangent_clear(tangent);
        compute_pullback_clear(pullback);
    }
    return status;
}

/* ---- Transfer -------------------------------------------------------------------------------- */

/* Copies of source, deformed and target, at unit area or as they are; roots of their areas. */
static int copy_surfaces(const struct srnf_sht *sht, const double *const given[3],
                         enum srnf_transfer_size size, double *copies, void *workspace,
                         double sizes[3], struct srnf_error *error)
{
    size_t count = surface_values(sht);

    for (size_t k = 0; k < 3; k++) {
        struct srnf_surface_measures measures;

        srnf_surface_measure(sht, given[k], &measures, workspace);
        sizes[k] = sqrt(measures.area);
        if (!(sizes[k] > 0.0) || !isfinite(sizes[k])) {
            *error = (struct srnf_error){.status = SRNF_EDEGENERATE,
                                         .element = -1,
                                         .message = "a surface has no area, or one beyond range"};
            return SRNF_EDEGENERATE;
        }
        for (size_t i = 0; i < count; i++) {
            copies[k * count + i] =
                size == SRNF_TRANSFER_RATIO ? given[k][i] / sizes[k] : given[k][i];
        }
    }
    return 0;
}

/* Energy against Q(target) + Q(deformed) - Q(source); fields is [4] fields of scratch. */
static void measure_transfer(const struct srnf_sht *sht, const double *copies, double *fields,
                             void *workspace, struct srnf_transferred *transferred)
{
    size_t count = surface_values(sht);
    size_t values = field_values(sht);

    for (size_t k = 0; k < 3; k++) {
        srnf_field(sht, copies + k * count, fields + k * values, workspace);
    }
    for (size_t i = 0; i < values; i++) {
        fields[values + i] -= fields[i];
    }
    measure_energy(sht, transferred->coefficients, fields + 2 * values, 1.0, fields + values,
                   fields + 3 * values, workspace, &transferred->energy,
                   &transferred->relative_energy);
}

/* Gives the shape the size of the target times the ratio of deformed to source. */
static void resize(const struct srnf_sht *sht, const double sizes[3], void *workspace, double *f)
{
    size_t count = surface_values(sht);
    struct srnf_surface_measures measures;
    double factor;

    srnf_surface_measure(sht, f, &measures, workspace);
    factor = sizes[2] * sizes[1] / sizes[0] / sqrt(measures.area);
    for (size_t i = 0; i < count; i++) {
        f[i] *= factor;
    }
}

int compute_pullback_transfer(const struct srnf_sht *sht, const double *source,
                              const double *deformed, const double *target,
                              enum srnf_transfer_size size, const struct srnf_context *context,
                              struct srnf_transferred *transferred,
                              struct compute_pullback *pullback, struct srnf_error *error)
{
    const double *const given[3] = {source, deformed, target};
    size_t count = surface_values(sht);
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transfer moved = {0};
    double *memory = srnf_alloc(3 * count + 4 * field_values(sht), sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    double sizes[3];
    int status;

    *transferred = (struct srnf_transferred){0};
    *pullback = (struct compute_pullback){.asked = true};
    options.segments = COMPUTE_PULLBACK_SEGMENTS;
    status = memory && workspace ? copy_surfaces(sht, given, size, memory, workspace, sizes, error)
                                 : out_of_memory(error);
    if (status == 0) {
        status = srnf_pullback_transfer(sht, memory, memory + count, memory + 2 * count, &options,
                                        context, &moved, error);
    }
    if (status >= 0) {
        *transferred = (struct srnf_transferred){.coefficients = moved.coefficients,
                                                 .size_ratio = sizes[1] / sizes[0],
                                                 .transforms = moved.transforms};
        measure_transfer(sht, memory, memory + 3 * count, workspace, transferred);
        if (size == SRNF_TRANSFER_RATIO) {
            resize(sht, sizes, workspace, transferred->coefficients);
        }
        *pullback = (struct compute_pullback){.asked = true,
                                              .norm_from = moved.norm_from,
                                              .norm = moved.norm,
                                              .deformation = moved.deformation,
                                              .distance = moved.distance,
                                              .converged = moved.converged};
        status = 0;
    }
    srnf_free(memory);
    srnf_free(workspace);
    return status;
}
