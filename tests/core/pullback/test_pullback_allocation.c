/*
 * test_pullback_allocation.c - the pulled-back metric when memory runs out: each allocation in turn
 * is refused; the call fails cleanly and nothing leaks.
 */
#include "pullbacks.h"
#include "support/refusing.h"

#define SEGMENTS ((size_t)4)

/* What the runs work on: stars, a straight path from the first to the second, and its velocity. */
static struct group g;
static double *path, *velocity;

static int run_geodesic(struct srnf_error *error)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_geodesic result;
    int status;

    options.segments = SEGMENTS;
    options.halving = true;
    status = srnf_pullback_geodesic(g.sht, g.f[0], g.f[1], &options, NULL, &result, error);
    srnf_pullback_geodesic_clear(&result);
    return status;
}

static int run_curves(struct srnf_error *error)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_geodesic result;
    struct srnf_geodesic curves;
    int status;

    options.segments = SEGMENTS;
    options.compare = false;
    status = srnf_pullback_curves(g.sht, g.f[0], g.f[1], &options, NULL, &curves, &result, error);
    assert_true(status >= 0 || (!curves.coefficients && !result.coefficients));
    srnf_geodesic_clear(&curves);
    srnf_pullback_geodesic_clear(&result);
    return status;
}

static int run_exp(struct srnf_error *error)
{
    struct srnf_pullback_shot shot;
    int status = srnf_pullback_exp(g.sht, g.f[0], velocity, SEGMENTS, NULL, &shot, error);

    srnf_pullback_shot_clear(&shot);
    return status;
}

static int run_transport(struct srnf_error *error)
{
    struct srnf_pullback_transported moved;
    int status = srnf_pullback_transport(g.sht, SEGMENTS, path, velocity, NULL, &moved, error);

    srnf_free(moved.vector);
    return status;
}

static int run_transfer(struct srnf_error *error)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_transfer transfer;
    int status;

    options.segments = SEGMENTS;
    status =
        srnf_pullback_transfer(g.sht, g.f[0], g.f[1], g.f[2], &options, NULL, &transfer, error);
    srnf_pullback_transfer_clear(&transfer);
    return status;
}

static int run_deform_shoot(struct srnf_error *error)
{
    const struct srnf_deform_options options = {.pullback = true};
    const struct srnf_velocity toward = {.toward = g.f[1]};
    const double times[] = {0.5, 0.0};
    struct srnf_deform_shoot shot;
    int status = srnf_deform_shoot(g.sht, g.f[0], &toward, 2, times, &options, NULL, &shot, error);

    srnf_deform_shoot_clear(&shot);
    return status;
}

/* Only the values are turned first: registering has a sweep of its own. */
static int run_deform_transport(struct srnf_error *error)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    const struct srnf_deform_options options = {.registration = &registration, .pullback = true};
    const struct srnf_velocity vector = {.motion = velocity};
    struct srnf_deform_transport moved;
    int status;

    registration.reparameterization = false;
    registration.start = SRNF_START_IDENTITY;
    status = srnf_deform_transport(g.sht, g.f[0], g.f[1], &vector, &options, NULL, &moved, error);
    srnf_deform_transport_clear(&moved);
    return status;
}

static int run_deform_transfer(struct srnf_error *error)
{
    const struct srnf_deform_options options = {.pullback = true};
    const double scales[3] = {1.0, 1.0, 1.0};
    struct srnf_deform_transfer transfer;
    int status = srnf_deform_transfer(g.sht, g.surfaces, scales, SRNF_TRANSFER_RATIO, &options,
                                      NULL, &transfer, error);

    srnf_deform_transfer_clear(&transfer);
    return status;
}

static int mean_by(enum srnf_pullback_mean_method method, struct srnf_error *error)
{
    struct srnf_pullback_mean_options options = srnf_pullback_mean_defaults(method);
    struct srnf_pullback_mean mean;
    int status;

    options.segments = 2;
    options.max_iterations = 2;
    status = srnf_pullback_mean(g.sht, g.n, g.surfaces, &options, NULL, &mean, error);
    srnf_pullback_mean_clear(&mean);
    return status;
}

static int run_graph(struct srnf_error *error)
{
    return mean_by(SRNF_PULLBACK_MEAN_GRAPH, error);
}

static int run_steps(struct srnf_error *error)
{
    return mean_by(SRNF_PULLBACK_MEAN_LOG_EXP, error);
}

static int (*subject)(struct srnf_error *error);

static int run_subject(void)
{
    struct srnf_error error = {0};
    int status = subject(&error);

    assert_true(status >= 0 || error.status == status);
    return status;
}

static void survives_each_refusal(void **state)
{
    static const struct {
        const char *name;
        int (*run)(struct srnf_error *error);
    } subjects[] = {
        {"geodesic", run_geodesic},
        {"curves", run_curves},
        {"exponential", run_exp},
        {"transport", run_transport},
        {"transfer", run_transfer},
        {"mean, graph", run_graph},
        {"mean, log-exp", run_steps},
        {"shooting between surfaces", run_deform_shoot},
        {"transport between surfaces", run_deform_transport},
        {"transfer between surfaces", run_deform_transfer},
    };
    (void)state;

    for (size_t k = 0; k < sizeof subjects / sizeof subjects[0]; k++) {
        subject = subjects[k].run;
        assert_true(subject(NULL) >= 0);
        assert_true(refusing_sweep(subjects[k].name, run_subject, 0, 1) > 3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(survives_each_refusal),
    };
    int failed;

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    group_open_stars(&g, 4, 3, 0.5);
    path = shapes_doubles((SEGMENTS + 1) * g.count);
    velocity = shapes_doubles(g.count);
    for (size_t k = 0; k <= SEGMENTS; k++) {
        pullback_mix(g.count, (double)k / (double)SEGMENTS, g.f[0], g.f[1], path + k * g.count);
    }
    for (size_t i = 0; i < g.count; i++) {
        velocity[i] = g.f[1][i] - g.f[0][i];
    }
    failed = cmocka_run_group_tests(tests, NULL, NULL);
    srnf_free(velocity);
    srnf_free(path);
    group_close(&g);
    return failed;
}
