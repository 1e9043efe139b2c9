/*
 * transfer.c - deformation transfer in the pulled-back metric (the paper, Algorithm 5).
 *
 * v = log(source, deformed) is transported along the geodesic from source to target and followed
 * from there: exp(target, v'). All three with the same number of segments, so that a target equal
 * to the source gives the deformed surface back to the accuracy of exp(log).
 */
#include "pullback.h"

/* The context of one of three parts: silent, since each would count from 0 again. */
static struct srnf_context quiet_context(const struct srnf_context *context)
{
    struct srnf_context quiet = context ? *context : (struct srnf_context){0};

    quiet.progress = NULL;
    return quiet;
}

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
    struct srnf_context quiet = quiet_context(context);
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
        return pullback_told(SRNF_ENOMEM, error);
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
