/*
 * transport.c - loads surfaces at their largest degree, lays them on each other where that
 * is asked for, and shoots, transports or transfers.
 *
 * What is registered to what keeps the answer in the pose and parameterisation of the surface that
 * it is about: the target of a velocity is laid on the surface it starts from, a deformed surface
 * on its source; then these, with the vector or the deformation, are laid on the surface where the
 * answer lies, which stays as it is. What goes along is cut to the common degree
 * (srnf_registration_apply).
 *
 * SRNFs do not know translations. Surfaces are placed so that their area centroids move as those of
 * the surfaces that a velocity points between do, or as the l = 0 coefficients of a motion say.
 */
#include "compute/transport.h"

#include <math.h>
#include <string.h>

/* Percent of the job that encoding stands for, if all surfaces are meshes. */
#define SHARE_MESHES 50.0

/* ---- The stage ------------------------------------------------------------------------------- */

static void stage_clear(struct compute_stage *stage)
{
    if (stage->sht) {
        jobs_transform_release(stage->jobs, stage->sht);
    }
    compute_group_clear(&stage->group);
    srnf_free(stage->velocity);
    srnf_free(stage->motion);
    srnf_free(stage->workspace);
    *stage = (struct compute_stage){0};
}

static double *surface_of(const struct compute_stage *stage, size_t i)
{
    return stage->group.coefficients + i * 3 * srnf_coefficient_count(stage->group.degree);
}

static size_t field_values(const struct compute_stage *stage)
{
    const struct srnf_grid *grid = srnf_sht_grid(stage->sht);

    return 3 * grid->n_theta * grid->n_phi;
}

static int stage_open(struct jobs_run *run, size_t n, const char *const *ids,
                      const struct compute_velocity *velocity, struct compute_stage *stage,
                      struct jobs_result *result)
{
    int status =
        compute_group_load(run, n, ids, NULL, NULL, 0, SHARE_MESHES, &stage->group, result);

    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    stage->jobs = jobs_run_jobs(run);
    status = jobs_transform_acquire(stage->jobs, stage->group.degree, SRNF_GRID_GAUSS_LEGENDRE, 0,
                                    0, &stage->sht);
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    stage->velocity = srnf_alloc(field_values(stage), sizeof(double));
    stage->workspace = srnf_alloc(srnf_surface_workspace_size(stage->sht), 1);
    if (velocity && velocity->coefficients) {
        stage->motion = srnf_alloc(srnf_coefficient_count(stage->group.degree), 3 * sizeof(double));
    }
    if (!stage->velocity || !stage->workspace ||
        (velocity && velocity->coefficients && !stage->motion)) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "preparing the surfaces");
    }
    if (stage->motion) {
        compute_change_degree(velocity->degree, velocity->coefficients, stage->group.degree,
                              stage->motion);
    }
    for (size_t i = 0; i < n; i++) {
        struct srnf_surface_measures measures;

        srnf_surface_measure(stage->sht, surface_of(stage, i), &measures, stage->workspace);
        memcpy(stage->centroids[i], measures.centroid, sizeof measures.centroid);
    }
    return 0;
}

static void turn(const double rotation[9], double x[3])
{
    const double y[3] = {x[0], x[1], x[2]};

    for (size_t k = 0; k < 3; k++) {
        x[k] = rotation[3 * k] * y[0] + rotation[3 * k + 1] * y[1] + rotation[3 * k + 2] * y[2];
    }
}

/* Registers one surface of the stage to another and puts it in the place of itself. */
static int lay(struct jobs_run *run, struct compute_stage *stage, size_t fixed, size_t moving,
               const struct srnf_register_options *options, struct srnf_registration *registration,
               const char *what, struct jobs_result *result)
{
    size_t count = 3 * srnf_coefficient_count(stage->group.degree);
    struct srnf_error error = {0};
    int status =
        srnf_register(stage->sht, surface_of(stage, fixed), NULL, surface_of(stage, moving),
                      options, NULL, jobs_run_context(run), registration, &error);

    if (status < 0) {
        return compute_fail(result, status, &error, what);
    }
    memcpy(surface_of(stage, moving), registration->coefficients, count * sizeof(double));
    turn(registration->rotation, stage->centroids[moving]);
    return 0;
}

/* Takes coefficients along with a registration, in place. */
static int take_along(struct jobs_run *run, const struct compute_stage *stage,
                      const struct srnf_registration *registration, double *coefficients,
                      struct jobs_result *result)
{
    int status = srnf_registration_apply(stage->sht, registration, coefficients,
                                         jobs_run_context(run), coefficients);

    return status ? compute_fail(result, status, NULL, "applying the registration") : 0;
}

/* The same for a surface of the stage. */
static int take_surface_along(struct jobs_run *run, struct compute_stage *stage,
                              const struct srnf_registration *registration, size_t i,
                              struct jobs_result *result)
{
    turn(registration->rotation, stage->centroids[i]);
    return take_along(run, stage, registration, surface_of(stage, i), result);
}

/* The velocity at a surface of the stage, as it lies there. */
static int find_velocity(const struct compute_velocity *given, size_t surface, size_t toward,
                         struct compute_stage *stage, struct jobs_result *result)
{
    int status = 0;

    if (given->field) {
        memcpy(stage->velocity, given->field, field_values(stage) * sizeof(double));
    } else if (stage->motion) {
        srnf_field_differential(stage->sht, surface_of(stage, surface), stage->motion,
                                stage->velocity, stage->workspace);
    } else {
        status = srnf_velocity_toward(stage->sht, surface_of(stage, surface),
                                      surface_of(stage, toward), stage->velocity);
    }
    return status ? compute_fail(result, status, NULL, "finding the velocity") : 0;
}

/* How the centroid goes in one unit of time: between two surfaces of the stage, or by the
   motion. */
static void drift(const struct compute_stage *stage, size_t from, size_t toward, double rate[3])
{
    const double sqrt_4_pi = 3.5449077018110320546;

    for (size_t k = 0; k < 3; k++) {
        rate[k] = 0.0;
        if (stage->motion) {
            rate[k] = stage->motion[k * srnf_coefficient_count(stage->group.degree)] / sqrt_4_pi;
        } else if (toward < stage->group.n) {
            rate[k] = stage->centroids[toward][k] - stage->centroids[from][k];
        }
    }
}

/* Measures a surface that was reached, and puts its centroid where that of a surface of the stage
   is after so much time. */
static void place(const struct compute_stage *stage, size_t from, const double rate[3], double t,
                  double *coefficients, struct srnf_surface_measures *measures)
{
    double target[3];

    srnf_surface_measure(stage->sht, coefficients, measures, stage->workspace);
    for (size_t k = 0; k < 3; k++) {
        target[k] = stage->centroids[from][k] + t * rate[k];
    }
    compute_move(stage->group.degree, coefficients, measures, target);
}

/* The same for the pulled-back metric; the field is that of the stage. */
static struct compute_pullback_velocity motion_of(const struct compute_velocity *given,
                                                  const struct compute_stage *stage, size_t toward)
{
    return (struct compute_pullback_velocity){.motion = stage->motion,
                                              .toward =
                                                  given->toward ? surface_of(stage, toward) : NULL,
                                              .field = stage->velocity};
}

/* ---- shoot ----------------------------------------------------------------------------------- */

void compute_shoot_clear(struct compute_shoot_outputs *outputs)
{
    stage_clear(&outputs->stage);
    srnf_registration_clear(&outputs->registration);
    srnf_shot_clear(&outputs->shot);
    compute_pullback_clear(&outputs->pullback);
    srnf_free(outputs->measures);
    outputs->measures = NULL;
}

static int shoot(struct jobs_run *run, const struct compute_shoot_inputs *inputs,
                 struct compute_shoot_outputs *outputs, struct jobs_result *result)
{
    const char *ids[2] = {inputs->surface, inputs->velocity.toward};
    struct compute_stage *stage = &outputs->stage;
    struct srnf_error error = {0};
    double rate[3];
    size_t count;
    int status =
        stage_open(run, inputs->velocity.toward ? 2 : 1, ids, &inputs->velocity, stage, result);

    if (status == 0 && inputs->velocity.toward && inputs->registration) {
        status = lay(run, stage, 0, 1, inputs->registration, &outputs->registration,
                     "registering the surface that the velocity is toward", result);
    }
    if (status == 0) {
        status = find_velocity(&inputs->velocity, 0, 1, stage, result);
    }
    if (status) {
        return status;
    }
    if (inputs->pullback) {
        struct compute_pullback_velocity velocity = motion_of(&inputs->velocity, stage, 1);

        status = compute_pullback_shoot(
            stage->sht, surface_of(stage, 0), &velocity, stage->velocity, inputs->n, inputs->times,
            jobs_run_context(run), &outputs->shot, &outputs->pullback, &error);
    } else {
        status = srnf_shoot(stage->sht, surface_of(stage, 0), stage->velocity, inputs->n,
                            inputs->times, jobs_run_context(run), &outputs->shot, &error);
    }
    if (status < 0) {
        return compute_fail(result, status, &error, "shooting");
    }
    outputs->measures = srnf_alloc(inputs->n, sizeof *outputs->measures);
    if (!outputs->measures) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "measuring the surfaces");
    }
    count = 3 * srnf_coefficient_count(stage->group.degree);
    drift(stage, 0, 1, rate);
    for (size_t i = 0; i < inputs->n; i++) {
        place(stage, 0, rate, inputs->times[i], outputs->shot.coefficients + i * count,
              &outputs->measures[i]);
    }
    return 0;
}

int compute_shoot(struct jobs_run *run, const struct compute_shoot_inputs *inputs,
                  struct compute_shoot_outputs *outputs, struct jobs_result *result)
{
    int status;

    *outputs = (struct compute_shoot_outputs){0};
    status = shoot(run, inputs, outputs, result);
    if (status) {
        compute_shoot_clear(outputs);
    }
    return status;
}

/* ---- transport ------------------------------------------------------------------------------- */

enum { FROM, TO, TOWARD };

void compute_transport_clear(struct compute_transport_outputs *outputs)
{
    stage_clear(&outputs->stage);
    srnf_registration_clear(&outputs->toward);
    srnf_registration_clear(&outputs->from);
    srnf_tangent_clear(&outputs->tangent);
    srnf_shot_clear(&outputs->shot);
    compute_pullback_clear(&outputs->pullback);
}

/* Lays `toward` on `from`, and both with the motion on `to`. */
static int lay_vector(struct jobs_run *run, const struct compute_transport_inputs *inputs,
                      struct compute_transport_outputs *outputs, struct jobs_result *result)
{
    struct compute_stage *stage = &outputs->stage;
    int status = 0;

    if (inputs->vector.toward) {
        status = lay(run, stage, FROM, TOWARD, inputs->registration, &outputs->toward,
                     "registering the surface that the vector is toward", result);
    }
    if (status == 0) {
        status = lay(run, stage, TO, FROM, inputs->registration, &outputs->from,
                     "registering from to to", result);
    }
    if (status == 0 && inputs->vector.toward) {
        status = take_surface_along(run, stage, &outputs->from, TOWARD, result);
    } else if (status == 0 && stage->motion) {
        status = take_along(run, stage, &outputs->from, stage->motion, result);
    }
    return status;
}

/* The vector at `to`, and the surface that it leads to, in the one metric or the other. */
static int carry_vector(struct jobs_run *run, const struct compute_transport_inputs *inputs,
                        struct compute_transport_outputs *outputs, struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    const double one = 1.0;
    const struct compute_stage *stage = &outputs->stage;
    const double *to = surface_of(stage, TO);
    struct srnf_error error = {0};
    int status;

    if (inputs->pullback) {
        struct compute_pullback_velocity vector = motion_of(&inputs->vector, stage, TOWARD);

        status = compute_pullback_transport(stage->sht, surface_of(stage, FROM), to, &vector,
                                            context, stage->velocity, &outputs->tangent,
                                            &outputs->shot, &outputs->pullback, &error);
    } else {
        status =
            srnf_transport(stage->sht, to, stage->velocity, context, &outputs->tangent, &error);
        if (status == 0) {
            status = srnf_shoot(stage->sht, to, stage->velocity, 1, &one, context, &outputs->shot,
                                &error);
        }
    }
    return status ? compute_fail(result, status, &error, "transporting the vector") : 0;
}

static int transport(struct jobs_run *run, const struct compute_transport_inputs *inputs,
                     struct compute_transport_outputs *outputs, struct jobs_result *result)
{
    const char *ids[3] = {inputs->from, inputs->to, inputs->vector.toward};
    struct compute_stage *stage = &outputs->stage;
    double rate[3];
    int status =
        stage_open(run, inputs->vector.toward ? 3 : 2, ids, &inputs->vector, stage, result);

    if (status == 0 && inputs->registration) {
        status = lay_vector(run, inputs, outputs, result);
    }
    if (status == 0) {
        status = find_velocity(&inputs->vector, FROM, TOWARD, stage, result);
    }
    if (status) {
        return status;
    }
    status = carry_vector(run, inputs, outputs, result);
    if (status) {
        return status;
    }
    for (size_t k = 0; stage->motion && k < 3; k++) {
        size_t i = k * srnf_coefficient_count(stage->group.degree);

        outputs->tangent.coefficients[i] = stage->motion[i];
    }
    drift(stage, FROM, TOWARD, rate);
    place(stage, TO, rate, 1.0, outputs->shot.coefficients, &outputs->measures);
    return 0;
}

int compute_transport(struct jobs_run *run, const struct compute_transport_inputs *inputs,
                      struct compute_transport_outputs *outputs, struct jobs_result *result)
{
    int status;

    *outputs = (struct compute_transport_outputs){0};
    status = transport(run, inputs, outputs, result);
    if (status) {
        compute_transport_clear(outputs);
    }
    return status;
}

/* ---- transfer -------------------------------------------------------------------------------- */

enum { SOURCE, DEFORMED, TARGET };

void compute_transfer_clear(struct compute_transfer_outputs *outputs)
{
    stage_clear(&outputs->stage);
    srnf_registration_clear(&outputs->deformed);
    srnf_registration_clear(&outputs->source);
    srnf_transferred_clear(&outputs->transferred);
    compute_pullback_clear(&outputs->pullback);
}

/* In the one metric or the other. */
static int transfer_between(struct jobs_run *run, const struct compute_transfer_inputs *inputs,
                            struct compute_transfer_outputs *outputs, struct jobs_result *result)
{
    const struct compute_stage *stage = &outputs->stage;
    const double *source = surface_of(stage, SOURCE);
    const double *deformed = surface_of(stage, DEFORMED);
    const double *target = surface_of(stage, TARGET);
    struct srnf_error error = {0};
    int status = inputs->pullback
                     ? compute_pullback_transfer(stage->sht, source, deformed, target, inputs->size,
                                                 jobs_run_context(run), &outputs->transferred,
                                                 &outputs->pullback, &error)
                     : srnf_transfer(stage->sht, source, deformed, target, inputs->size,
                                     jobs_run_context(run), &outputs->transferred, &error);

    return status < 0 ? compute_fail(result, status, &error, "transferring the deformation") : 0;
}

static void multiply(size_t n, double factor, double *x)
{
    for (size_t i = 0; i < n; i++) {
        x[i] *= factor;
    }
}

/* Lays the deformed surface on its source, and both on the target. */
static int lay_deformation(struct jobs_run *run, const struct compute_transfer_inputs *inputs,
                           struct compute_transfer_outputs *outputs, struct jobs_result *result)
{
    struct compute_stage *stage = &outputs->stage;
    int status = lay(run, stage, SOURCE, DEFORMED, inputs->registration, &outputs->deformed,
                     "registering the deformed surface to its source", result);

    if (status == 0) {
        status = lay(run, stage, TARGET, SOURCE, inputs->registration, &outputs->source,
                     "registering the source to the target", result);
    }
    return status ? status : take_surface_along(run, stage, &outputs->source, DEFORMED, result);
}

/* Deformed in the units of its source, or all three in the units that they share. */
static void set_units(const struct compute_transfer_inputs *inputs, const double scales[3],
                      struct compute_stage *stage)
{
    size_t count = 3 * srnf_coefficient_count(stage->group.degree);

    double source = inputs->size == SRNF_TRANSFER_ABSOLUTE ? scales[SOURCE] / scales[TARGET] : 1.0;
    double deformed = source * scales[DEFORMED] / scales[SOURCE];

    multiply(count, source, surface_of(stage, SOURCE));
    multiply(3, source, stage->centroids[SOURCE]);
    multiply(count, deformed, surface_of(stage, DEFORMED));
    multiply(3, deformed, stage->centroids[DEFORMED]);
}

/* The surface where the target is, moved as the deformed one is against its source. A change of
   size by a ratio goes into the scale: what has unit area in the store keeps it. */
static void settle(const struct compute_transfer_inputs *inputs, const double scales[3],
                   struct compute_transfer_outputs *outputs)
{
    const struct compute_stage *stage = &outputs->stage;
    struct srnf_transferred *transferred = &outputs->transferred;
    size_t count = 3 * srnf_coefficient_count(stage->group.degree);
    struct srnf_surface_measures source, target;
    double rate[3], ratio = 1.0;

    drift(stage, SOURCE, DEFORMED, rate);
    if (inputs->size == SRNF_TRANSFER_RATIO) {
        srnf_surface_measure(stage->sht, surface_of(stage, SOURCE), &source, stage->workspace);
        srnf_surface_measure(stage->sht, surface_of(stage, TARGET), &target, stage->workspace);
        ratio = transferred->size_ratio;
        multiply(3, sqrt(target.area / source.area), rate);
    }
    place(stage, TARGET, rate, 1.0, transferred->coefficients, &outputs->measures);
    multiply(count, 1.0 / ratio, transferred->coefficients);
    srnf_surface_measure(stage->sht, transferred->coefficients, &outputs->measures,
                         stage->workspace);
    outputs->scale = scales[TARGET] * ratio;
}

int compute_transfer(struct jobs_run *run, const struct compute_transfer_inputs *inputs,
                     struct compute_transfer_outputs *outputs, struct jobs_result *result)
{
    const char *ids[3] = {inputs->source, inputs->deformed, inputs->target};
    struct compute_stage *stage = &outputs->stage;
    double scales[3];
    int status;

    *outputs = (struct compute_transfer_outputs){0};
    status = stage_open(run, 3, ids, NULL, stage, result);
    for (size_t i = 0; status == 0 && i < 3; i++) {
        scales[i] = inputs->scales[i] > 0.0 ? inputs->scales[i] : stage->group.scales[i];
    }
    if (status == 0 && inputs->registration) {
        status = lay_deformation(run, inputs, outputs, result);
    }
    if (status == 0) {
        set_units(inputs, scales, stage);
        status = transfer_between(run, inputs, outputs, result);
    }
    if (status) {
        compute_transfer_clear(outputs);
    } else {
        settle(inputs, scales, outputs);
    }
    return status;
}
