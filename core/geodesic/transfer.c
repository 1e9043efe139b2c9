/*
 * transfer.c - deformation transfer: shooting from a target with the velocity that takes another
 * surface to its deformed one (the paper, Algorithm 6).
 *
 *   q = Q(target) + Q(deformed) - Q(source)
 *
 * With shape and size apart all three are scaled to unit area first, and the result to the target's
 * area times the ratio of the other two areas. Beside the extrapolation of the path the target
 * moved by deformed - source in coefficients is tried as a start for the end: it is the answer at
 * once where target and source are the same.
 *
 * Costs what one shot costs.
 */
#include "geodesic.h"

#include <math.h>

struct transfer {
    size_t count, values;
    double *memory;
    double *source, *deformed, *target, *moved; /* scaled copies; target + deformed - source */
    double *velocity;
    double sizes[3]; /* square roots of the areas of source, deformed, target */
};

/* Copies at unit area, or as they are; l = 0 terms included. */
static int prepare(struct transfer *work, const struct srnf_sht *sht, const double *const given[3],
                   enum srnf_transfer_size size)
{
    double *const copies[3] = {work->source, work->deformed, work->target};
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    int status = SRNF_OK;

    if (!workspace) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < 3; k++) {
        struct srnf_surface_measures measures;

        srnf_surface_measure(sht, given[k], &measures, workspace);
        work->sizes[k] = sqrt(measures.area);
        if (!(measures.area > 0.0) || !isfinite(measures.area)) {
            status = SRNF_EDEGENERATE;
        }
        linear_copy(work->count, given[k], copies[k]);
        if (size == SRNF_TRANSFER_RATIO) {
            linear_scale(work->count, 1.0 / work->sizes[k], copies[k]);
        }
    }
    srnf_free(workspace);
    for (size_t i = 0; i < work->count; i++) {
        work->moved[i] = work->target[i] + (work->deformed[i] - work->source[i]);
    }
    return status;
}

/* Gives the shape that was reached its size, and its place. */
static int finish(struct transfer *work, const struct srnf_sht *sht, const double *const given[3],
                  enum srnf_transfer_size size, double *f)
{
    double ratio = 1.0;

    if (size == SRNF_TRANSFER_RATIO) {
        void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
        struct srnf_surface_measures measures;

        if (!workspace) {
            return SRNF_ENOMEM;
        }
        srnf_surface_measure(sht, f, &measures, workspace);
        srnf_free(workspace);
        ratio = work->sizes[2] / work->sizes[0];
        linear_scale(work->count, ratio * work->sizes[1] / sqrt(measures.area), f);
    }
    for (size_t k = 0; k < 3; k++) {
        size_t i = k * work->count / 3;

        f[i] = given[2][i] + ratio * (given[1][i] - given[0][i]);
    }
    return SRNF_OK;
}

static int transfer(struct transfer *work, const struct srnf_sht *sht, const double *const given[3],
                    enum srnf_transfer_size size, const struct srnf_context *context,
                    struct srnf_transferred *transferred, struct srnf_error *error)
{
    const double time = 1.0;
    struct srnf_shot shot = {0};
    int status = prepare(work, sht, given, size);

    if (status == SRNF_OK) {
        status = srnf_velocity_toward(sht, work->source, work->deformed, work->velocity);
    }
    if (status) {
        return srnf_fail(error, status, -1, "%s",
                         status == SRNF_EDEGENERATE ? "a surface has no area, or one beyond range"
                                                    : srnf_strerror(status));
    }
    status = geodesic_shoot(sht, work->target, work->velocity, 1, &time, work->moved, context,
                            &shot, error);
    if (status) {
        return status;
    }
    status = finish(work, sht, given, size, shot.coefficients);
    if (status) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
    } else {
        *transferred = (struct srnf_transferred){.coefficients = shot.coefficients,
                                                 .size_ratio = work->sizes[1] / work->sizes[0],
                                                 .energy = shot.energy[0],
                                                 .relative_energy = shot.relative_energy[0],
                                                 .transforms = shot.transforms};
        shot.coefficients = NULL;
    }
    srnf_shot_clear(&shot);
    return status;
}

int srnf_transfer(const struct srnf_sht *sht, const double *source, const double *deformed,
                  const double *target, enum srnf_transfer_size size,
                  const struct srnf_context *context, struct srnf_transferred *transferred,
                  struct srnf_error *error)
{
    static const char *const words[3] = {"coefficient of the source",
                                         "coefficient of the deformed surface",
                                         "coefficient of the target"};
    const double *const given[3] = {source, deformed, target};
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct transfer work = {.count = 3 * srnf_coefficient_count(srnf_sht_degree(sht)),
                            .values = 3 * grid->n_theta * grid->n_phi};
    int status;

    *transferred = (struct srnf_transferred){0};
    for (size_t k = 0; k < 3; k++) {
        if (!srnf_check_finite(work.count, given[k], words[k], error)) {
            return SRNF_EINVAL;
        }
    }
    work.memory = srnf_alloc(4 * work.count + work.values, sizeof(double));
    if (!work.memory) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
    }
    work.source = work.memory;
    work.deformed = work.memory + work.count;
    work.target = work.memory + 2 * work.count;
    work.moved = work.memory + 3 * work.count;
    work.velocity = work.memory + 4 * work.count;
    status = transfer(&work, sht, given, size, context, transferred, error);
    srnf_free(work.memory);
    return status;
}

void srnf_transferred_clear(struct srnf_transferred *transferred)
{
    srnf_free(transferred->coefficients);
    *transferred = (struct srnf_transferred){0};
}
