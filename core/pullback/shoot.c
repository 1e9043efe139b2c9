/*
 * shoot.c - shooting and transport between surfaces in the pulled-back metric.
 *
 * A velocity is a motion of the surface: given as one, the logarithm of the surface that it is
 * toward, or the motion whose Q_* is nearest to a field. It is shot by one exponential for each
 * time, so that a time's surface does not depend on the others asked for.
 */
#include "pullback.h"

#include <math.h>

static size_t surface_values(const struct srnf_sht *sht)
{
    return 3 * srnf_coefficient_count(srnf_sht_degree(sht));
}

void pullback_paths_clear(struct srnf_deform_paths *paths)
{
    srnf_free(paths->shots);
    *paths = (struct srnf_deform_paths){0};
}

/* ---- Velocities ------------------------------------------------------------------------------ */

/* The velocity as a motion; residual and products where it was a field. */
static int find_motion(const struct srnf_sht *sht, const double *surface,
                       const struct srnf_velocity *velocity, const struct srnf_context *context,
                       double *motion, struct srnf_tangent *tangent,
                       struct srnf_deform_paths *paths, struct srnf_error *error)
{
    size_t count = surface_values(sht);
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_log_figures log;
    int status = SRNF_OK;

    if (velocity->motion) {
        linear_copy(count, velocity->motion, motion);
    } else if (velocity->toward) {
        options.segments = SRNF_DEFORM_SEGMENTS;
        status = srnf_pullback_log(sht, surface, velocity->toward, &options, context, motion, &log,
                                   error);
        if (status >= 0) {
            paths->toward = (struct srnf_deform_path){.figures = log.path,
                                                      .segments = options.segments,
                                                      .iterations = log.iterations,
                                                      .residual = log.gradient,
                                                      .converged = status == SRNF_OK};
            paths->converged = paths->converged && status == SRNF_OK;
            tangent->transforms = log.transforms;
        }
    } else {
        status = srnf_transport(sht, surface, velocity->field, context, tangent, error);
        if (status >= 0) {
            linear_copy(count, tangent->coefficients, motion);
            paths->converged = paths->converged && tangent->converged;
            srnf_free(tangent->coefficients);
            tangent->coefficients = NULL;
        }
    }
    return status < 0 ? status : SRNF_OK;
}

/* ---- Shooting -------------------------------------------------------------------------------- */

void pullback_measure_energy(const struct srnf_sht *sht, const double *surface, const double *base,
                             double t, const double *line, double *scratch, void *workspace,
                             double *energy, double *relative)
{
    size_t values = pullback_field_values(sht);

    for (size_t i = 0; i < values; i++) {
        scratch[i] = base[i] + t * line[i];
    }
    *energy = srnf_energy(sht, surface, scratch, NULL, workspace);
    *relative = *energy / srnf_inner_product(srnf_sht_grid(sht), scratch, scratch);
}

/* The surface at one time into f. */
static int follow(const struct srnf_sht *sht, const double *surface, const double *motion, double t,
                  const struct srnf_context *context, double *scaled, double *f,
                  struct srnf_deform_path *path, double *transforms, struct srnf_error *error)
{
    size_t count = surface_values(sht);
    size_t segments = SRNF_DEFORM_SEGMENTS * (size_t)fmax(1.0, ceil(fabs(t)));
    struct srnf_pullback_shot shot;
    int status;

    *path = (struct srnf_deform_path){.converged = true};
    if (t == 0.0) {
        linear_copy(count, surface, f);
        return SRNF_OK;
    }
    for (size_t i = 0; i < count; i++) {
        scaled[i] = t * motion[i];
    }
    status = srnf_pullback_exp(sht, surface, scaled, segments, context, &shot, error);
    if (status < 0) {
        return status;
    }
    linear_copy(count, shot.coefficients + segments * count, f);
    *path = (struct srnf_deform_path){.figures = shot.path,
                                      .segments = segments,
                                      .iterations = shot.iterations,
                                      .residual = shot.residual,
                                      .converged = status == SRNF_OK};
    *transforms += shot.transforms;
    srnf_pullback_shot_clear(&shot);
    return SRNF_OK;
}

/* Surfaces, energies and figures at all times; progress goes from `from` to 1. */
static int shoot_motion(const struct srnf_sht *sht, const double *surface, const double *motion,
                        const double *line, size_t n, const double *times,
                        const struct srnf_context *context, double from, struct srnf_shot *shot,
                        struct srnf_deform_paths *paths, struct srnf_error *error)
{
    size_t count = surface_values(sht);
    size_t values = pullback_field_values(sht);
    struct srnf_context quiet = srnf_quiet(context);
    double *memory = srnf_alloc(2 * values + count, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    int status = SRNF_OK;

    *shot = (struct srnf_shot){.degree = srnf_sht_degree(sht), .n = n};
    shot->coefficients = srnf_alloc(n * count, sizeof(double));
    shot->energy = srnf_alloc(2 * n, sizeof(double));
    paths->shots = srnf_alloc(n, sizeof *paths->shots);
    if (!memory || !workspace || !shot->coefficients || !shot->energy || !paths->shots) {
        status = pullback_fail(SRNF_ENOMEM, error);
        goto out;
    }
    shot->relative_energy = shot->energy + n;
    paths->n = n;
    srnf_field(sht, surface, memory, workspace);
    for (size_t i = 0; i < n; i++) {
        double *f = shot->coefficients + i * count;

        srnf_report_progress(context, from + (1.0 - from) * (double)i / (double)n,
                             "following the geodesic");
        status = follow(sht, surface, motion, times[i], &quiet, memory + 2 * values, f,
                        &paths->shots[i], &shot->transforms, error);
        if (status) {
            goto out;
        }
        paths->converged = paths->converged && paths->shots[i].converged;
        pullback_measure_energy(sht, f, memory, times[i], line, memory + values, workspace,
                                &shot->energy[i], &shot->relative_energy[i]);
    }
    srnf_report_progress(context, 1.0, "the surfaces are there");
out:
    srnf_free(memory);
    srnf_free(workspace);
    if (status) {
        srnf_shot_clear(shot);
    }
    return status;
}

int pullback_shoot(const struct srnf_sht *sht, const double *surface,
                   const struct srnf_velocity *velocity, const double *line, size_t n,
                   const double *times, const struct srnf_context *context, struct srnf_shot *shot,
                   struct srnf_deform_paths *paths, struct srnf_error *error)
{
    struct srnf_context quiet = srnf_quiet(context);
    struct srnf_tangent tangent = {0};
    double *motion = srnf_alloc(surface_values(sht), sizeof(double));
    int status;

    *paths = (struct srnf_deform_paths){.converged = true};
    if (!motion) {
        return pullback_fail(SRNF_ENOMEM, error);
    }
    status = find_motion(sht, surface, velocity, &quiet, motion, &tangent, paths, error);
    if (status == SRNF_OK) {
        status =
            shoot_motion(sht, surface, motion, line, n, times, context, 0.3, shot, paths, error);
    }
    if (status == SRNF_OK) {
        shot->transforms += tangent.transforms;
    } else {
        pullback_paths_clear(paths);
    }
    srnf_free(motion);
    return status;
}

/* ---- Transport ------------------------------------------------------------------------------- */

/* The motion at `from` becomes tangent->coefficients at `to`, along their geodesic. */
static int carry(const struct srnf_sht *sht, const double *from, const double *to,
                 const double *motion, const struct srnf_context *context,
                 struct srnf_tangent *tangent, struct srnf_deform_paths *paths,
                 struct srnf_error *error)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transported moved;
    struct srnf_pullback_geodesic path;
    int status;

    options.segments = SRNF_DEFORM_TRANSPORT_SEGMENTS;
    options.compare = false;
    status = srnf_pullback_geodesic(sht, from, to, &options, context, &path, error);
    if (status < 0) {
        return status;
    }
    paths->along = (struct srnf_deform_path){.figures = path.path,
                                             .segments = options.segments,
                                             .iterations = path.iterations,
                                             .residual = path.gradient,
                                             .converged = path.converged};
    paths->converged = paths->converged && path.converged;
    status = srnf_pullback_transport(sht, options.segments, path.coefficients, motion, context,
                                     &moved, error);
    if (status >= 0) {
        tangent->coefficients = moved.vector;
        tangent->norm = moved.norm;
        tangent->transforms += path.transforms + moved.transforms;
        paths->norm_from = moved.norm_from;
        paths->norm = moved.norm;
        status = SRNF_OK;
    }
    srnf_pullback_geodesic_clear(&path);
    return status;
}

int pullback_carry(const struct srnf_sht *sht, const double *from, const double *to,
                   const struct srnf_velocity *vector, const struct srnf_context *context,
                   double *line, struct srnf_tangent *tangent, struct srnf_shot *shot,
                   struct srnf_deform_paths *paths, struct srnf_error *error)
{
    const double one = 1.0;
    struct srnf_context quiet = srnf_quiet(context);
    double *motion = srnf_alloc(surface_values(sht), sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    int status;

    *paths = (struct srnf_deform_paths){.converged = true};
    *tangent = (struct srnf_tangent){0};
    if (!motion || !workspace) {
        status = pullback_fail(SRNF_ENOMEM, error);
        goto out;
    }
    status = find_motion(sht, from, vector, &quiet, motion, tangent, paths, error);
    if (status == SRNF_OK) {
        srnf_report_progress(context, 0.4, "transporting the vector");
        status = carry(sht, from, to, motion, &quiet, tangent, paths, error);
    }
    if (status == SRNF_OK) {
        srnf_field_differential(sht, to, tangent->coefficients, line, workspace);
        status = shoot_motion(sht, to, tangent->coefficients, line, 1, &one, context, 0.8, shot,
                              paths, error);
    }
out:
    srnf_free(motion);
    srnf_free(workspace);
    if (status) {
        srnf_tangent_clear(tangent);
        pullback_paths_clear(paths);
    }
    return status;
}
