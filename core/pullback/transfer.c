/*
 * transfer.c - deformation transfer in the pulled-back metric (the paper, Algorithm 5).
 *
 * v = log(source, deformed) is transported along the geodesic from source to target and followed
 * from there: exp(target, v'). All three with the same number of segments, so that a target equal
 * to the source gives the deformed surface back to the accuracy of exp(log).
 *
 * With shape and size apart that is done at unit area, and the surface that is reached gets the
 * area of the target times the ratio of deformed to source.
 */
#include "pullback.h"

#include <math.h>

/* Fills velocity with that at the target. */
static int carry(const struct srnf_sht *sht, const double *source, const double *target,
                 const struct srnf_pullback_options *options, const struct srnf_context *context,
                 struct srnf_pullback_transfer *result, struct srnf_error *error)
{
    struct srnf_pullback_options path_options = *options;
    struct srnf_pullback_transported moved;
    struct srnf_pullback_geodesic path;
    int status;

    path_options.compare = false;
    status = srnf_pullback_geodesic(sht, source, target, &path_options, context, &path, error);
    if (status < 0) {
        return status;
    }
    result->distance = path.path.length;
    result->transforms += path.transforms;
    result->converged = result->converged && status == SRNF_OK;
    status = srnf_pullback_transport(sht, options->segments, path.coefficients, result->velocity,
                                     context, &moved, error);
    srnf_pullback_geodesic_clear(&path);
    if (status) {
        return status;
    }
    result->transforms += moved.transforms;
    result->norm_from = moved.norm_from;
    result->norm = moved.norm;
    linear_copy(3 * srnf_coefficient_count(srnf_sht_degree(sht)), moved.vector, result->velocity);
    srnf_free(moved.vector);
    return SRNF_OK;
}

static int follow(const struct srnf_sht *sht, const double *target, size_t segments,
                  const struct srnf_context *context, struct srnf_pullback_transfer *result,
                  struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    struct srnf_pullback_shot shot;
    int status = srnf_pullback_exp(sht, target, result->velocity, segments, context, &shot, error);

    if (status < 0) {
        return status;
    }
    result->converged = result->converged && status == SRNF_OK;
    result->transforms += shot.transforms;
    linear_copy(count, shot.coefficients + segments * count, result->coefficients);
    srnf_pullback_shot_clear(&shot);
    return SRNF_OK;
}

int srnf_pullback_transfer(const struct srnf_sht *sht, const double *source, const double *deformed,
                           const double *target, const struct srnf_pullback_options *options,
                           const struct srnf_context *context,
                           struct srnf_pullback_transfer *result, struct srnf_error *error)
{
    struct srnf_pullback_options defaults = srnf_pullback_options_defaults();
    struct srnf_context quiet = srnf_quiet(context);
    struct srnf_pullback_log_figures log;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    int status;

    options = options ? options : &defaults;
    *result = (struct srnf_pullback_transfer){0};
    status = pullback_check_even(options->segments, error);
    status = status ? status : pullback_check_surface(sht, source, "the source", error);
    status = status ? status : pullback_check_surface(sht, deformed, "the deformed source", error);
    status = status ? status : pullback_check_surface(sht, target, "the target", error);
    if (status) {
        return status;
    }
    result->coefficients = srnf_alloc(2 * count, sizeof(double));
    if (!result->coefficients) {
        return pullback_fail(SRNF_ENOMEM, error);
    }
    result->velocity = result->coefficients + count;
    status =
        srnf_pullback_log(sht, source, deformed, options, &quiet, result->velocity, &log, error);
    result->converged = status == SRNF_OK;
    if (status >= 0) {
        result->deformation = log.path.length;
        result->transforms = log.transforms;
        srnf_report_progress(context, 0.4, "transporting the deformation");
        status = carry(sht, source, target, options, &quiet, result, error);
    }
    if (status >= 0) {
        srnf_report_progress(context, 0.7, "deforming the target");
        status = follow(sht, target, options->segments, &quiet, result, error);
    }
    if (status < 0) {
        srnf_pullback_transfer_clear(result);
        return status;
    }
    srnf_report_progress(context, 1.0, "the deformation is transferred");
    return result->converged ? SRNF_OK : SRNF_WNOT_CONVERGED;
}

void srnf_pullback_transfer_clear(struct srnf_pullback_transfer *result)
{
    srnf_free(result->coefficients);
    *result = (struct srnf_pullback_transfer){0};
}

/* ---- With sizes ------------------------------------------------------------------------------ */

/* Copies of source, deformed and target, at unit area or as they are; roots of their areas. */
static int copy_surfaces(size_t count, const struct srnf_sht *sht, const double *const given[3],
                         enum srnf_transfer_size size, double *copies, void *workspace,
                         double sizes[3], struct srnf_error *error)
{
    for (size_t k = 0; k < 3; k++) {
        struct srnf_surface_measures measures;

        srnf_surface_measure(sht, given[k], &measures, workspace);
        sizes[k] = sqrt(measures.area);
        if (!(sizes[k] > 0.0) || !isfinite(sizes[k])) {
            return srnf_fail(error, SRNF_EDEGENERATE, -1,
                             "a surface has no area, or one beyond range");
        }
        for (size_t i = 0; i < count; i++) {
            copies[k * count + i] =
                size == SRNF_TRANSFER_RATIO ? given[k][i] / sizes[k] : given[k][i];
        }
    }
    return SRNF_OK;
}

/* Energy against Q(target) + Q(deformed) - Q(source); fields is [4] fields of scratch. */
static void measure_transfer(const struct srnf_sht *sht, const double *copies, double *fields,
                             void *workspace, struct srnf_transferred *transferred)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    size_t values = pullback_field_values(sht);

    for (size_t k = 0; k < 3; k++) {
        srnf_field(sht, copies + k * count, fields + k * values, workspace);
    }
    for (size_t i = 0; i < values; i++) {
        fields[values + i] -= fields[i];
    }
    pullback_measure_energy(sht, transferred->coefficients, fields + 2 * values, 1.0,
                            fields + values, fields + 3 * values, workspace, &transferred->energy,
                            &transferred->relative_energy);
}

/* Gives the shape the size of the target times the ratio of deformed to source. */
static void resize(const struct srnf_sht *sht, const double sizes[3], void *workspace, double *f)
{
    struct srnf_surface_measures measures;

    srnf_surface_measure(sht, f, &measures, workspace);
    linear_scale(3 * srnf_coefficient_count(srnf_sht_degree(sht)),
                 sizes[2] * sizes[1] / sizes[0] / sqrt(measures.area), f);
}

int pullback_transfer_sized(const struct srnf_sht *sht, const double *const given[3],
                            enum srnf_transfer_size size, const struct srnf_context *context,
                            struct srnf_transferred *transferred, struct srnf_deform_paths *paths,
                            struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transfer moved = {0};
    double *memory = srnf_alloc(3 * count + 4 * pullback_field_values(sht), sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    double sizes[3];
    int status;

    options.segments = SRNF_DEFORM_SEGMENTS;
    status = memory && workspace
                 ? copy_surfaces(count, sht, given, size, memory, workspace, sizes, error)
                 : pullback_fail(SRNF_ENOMEM, error);
    if (status == SRNF_OK) {
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
        *paths = (struct srnf_deform_paths){.norm_from = moved.norm_from,
                                            .norm = moved.norm,
                                            .deformation = moved.deformation,
                                            .distance = moved.distance,
                                            .converged = moved.converged};
        status = SRNF_OK;
    }
    srnf_free(memory);
    srnf_free(workspace);
    return status;
}
