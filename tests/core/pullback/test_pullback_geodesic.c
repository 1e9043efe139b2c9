/*
 * test_pullback_geodesic.c - geodesics of the pulled-back metric: between the chord and the other
 * paths in energy and length, at constant speed, the same both ways, under motions and on any
 * number of threads; cancellation and wrong arguments.
 */
#include "pullbacks.h"

#include <fftw3.h>

#define DEGREE 10

static void walk(const struct pullback_pair *p, const struct srnf_pullback_options *options,
                 struct srnf_pullback_geodesic *g)
{
    assert_int_equal(
        srnf_pullback_geodesic(p->from.sht, p->from.f, p->to.f, options, NULL, g, NULL), SRNF_OK);
}

static struct srnf_pullback_options tight(size_t segments)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();

    options.segments = segments;
    options.gradient = 1e-9;
    options.compare = false;
    return options;
}

/* Ends, times, straight translations, and figures as the surfaces have them. */
static void check_path(const struct pullback_pair *p, const struct srnf_pullback_geodesic *g)
{
    const struct shapes_surface *s = &p->from;
    size_t m = g->steps - 1;
    double length = 0.0;
    double energy = 0.0;

    assert_memory_equal(g->coefficients, s->f, s->count * sizeof *s->f);
    assert_memory_equal(g->coefficients + m * s->count, p->to.f, s->count * sizeof *s->f);
    for (size_t k = 0; k <= m; k++) {
        const double *f = g->coefficients + k * s->count;

        assert_true(fabs(g->times[k] - (double)k / (double)m) < 1e-15);
        for (size_t c = 0; c < 3; c++) {
            double t = g->times[k];
            double straight = (1.0 - t) * s->f[c * s->each] + t * p->to.f[c * s->each];

            assert_true(fabs(f[c * s->each] - straight) < 1e-14);
        }
        if (k < m) {
            double d = pullback_chord(s, f, f + s->count);

            assert_true(fabs(g->speeds[k] - (double)m * d) <= 1e-12 * g->path.length);
            length += d;
            energy += (double)m * d * d;
        }
    }
    assert_true(fabs(g->path.length - length) <= 1e-12 * length);
    assert_true(fabs(g->path.energy - energy) <= 1e-12 * energy);
    assert_true(fabs(g->distance - pullback_chord(s, s->f, p->to.f)) <= 1e-12);
    assert_true(g->converged && g->transforms > 0.0);
}

static void lies_between_the_chord_and_other_paths(void **state)
{
    static const char *const names[] = {"stars", "thalami", "star to ellipsoid",
                                        "ellipsoid to bent capsule"};
    (void)state;

    for (size_t k = 0; k < 4; k++) {
        struct srnf_pullback_geodesic g;
        struct pullback_pair p;
        bool there = true;

        if (k == 0) {
            pullback_open_stars(&p, DEGREE);
        } else if (k == 1) {
            there = pullback_open_thalami(&p, DEGREE);
        } else {
            pullback_open_bodies(&p, DEGREE, k == 2 ? "bumpy star" : "ellipsoid",
                                 k == 2 ? "ellipsoid" : "bent capsule");
        }
        if (!there) {
            printf("# %s: skipped, no meshes\n", names[k]);
            pullback_close(&p);
            continue;
        }
        walk(&p, NULL, &g);
        check_path(&p, &g);
        printf("# %s: chord %.6f; E/length straight %.6f/%.6f, inverted %.6f/%.6f, geodesic "
               "%.6f/%.6f; E below the inverted line's by %.2e; %zu steps, %.0f U\n",
               names[k], g.distance, g.linear.energy, g.linear.length, g.inverted.energy,
               g.inverted.length, g.path.energy, g.path.length, g.inverted.energy - g.path.energy,
               g.iterations, g.transforms);
        assert_true(g.path.energy < g.linear.energy && g.path.length < g.linear.length);
        assert_true(g.path.energy < g.inverted.energy && g.path.length <= g.inverted.length);
        assert_true(g.path.length > g.distance);
        figure_below("speed variation", g.path.speed_variation, 2e-3);
        assert_true(fabs(g.path.energy / (g.path.length * g.path.length) - 1.0) < 1e-5);
        srnf_pullback_geodesic_clear(&g);
        pullback_close(&p);
    }
}

static void reverses(void **state)
{
    struct srnf_pullback_options options = tight(8);
    struct srnf_pullback_geodesic there;
    struct srnf_pullback_geodesic back;
    struct pullback_pair p;
    struct pullback_pair swapped;
    double worst = 0.0;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    swapped = (struct pullback_pair){p.to, p.from};
    walk(&p, &options, &there);
    walk(&swapped, &options, &back);
    check_path(&swapped, &back);
    assert_true(there.gradient <= 1e-9 && back.gradient <= 1e-9);
    for (size_t k = 0; k <= 8; k++) {
        worst = compare_max(worst, shapes_distance(DEGREE, there.coefficients + k * p.from.count,
                                                   back.coefficients + (8 - k) * p.from.count));
    }
    figure_below("there and back, surfaces apart", worst, 1e-8);
    figure_below("lengths apart", fabs(there.path.length / back.path.length - 1.0), 1e-12);
    figure_below("speed variation", there.path.speed_variation, 1e-4);
    srnf_pullback_geodesic_clear(&back);
    srnf_pullback_geodesic_clear(&there);
    pullback_close(&p);
}

/* A rotation of both ends turns the path, a factor scales it, a translation of one end does not
   change it. */
static void moves_with_its_ends(void **state)
{
    struct srnf_pullback_options options = tight(6);
    struct test_random random = test_random_seed(7);
    struct srnf_pullback_geodesic plain;
    struct srnf_pullback_geodesic moved;
    struct pullback_pair p;
    double rotation[9];
    double worst = 0.0;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    walk(&p, &options, &plain);
    shapes_random_rotation(&random, rotation);
    for (size_t i = 0; i < p.from.count; i++) {
        p.from.f[i] *= 3.0;
        p.to.f[i] *= 3.0;
    }
    shapes_rotate(rotation, p.from.each, p.from.f);
    shapes_rotate(rotation, p.to.each, p.to.f);
    p.to.f[0] += 5.0;
    walk(&p, &options, &moved);
    check_path(&p, &moved);
    for (size_t k = 0; k <= 6; k++) {
        double *f = plain.coefficients + k * p.from.count;

        for (size_t i = 0; i < p.from.count; i++) {
            f[i] *= 3.0;
        }
        shapes_rotate(rotation, p.from.each, f);
        worst =
            compare_max(worst, shapes_distance(DEGREE, f, moved.coefficients + k * p.from.count));
    }
    figure_below("moved path, surfaces apart", worst, 1e-8);
    figure_below("its length", fabs(moved.path.length / (3.0 * plain.path.length) - 1.0), 1e-12);
    srnf_pullback_geodesic_clear(&moved);
    srnf_pullback_geodesic_clear(&plain);
    pullback_close(&p);
}

/* Q(c f) = c Q(f): between copies of one surface the straight line is the geodesic. */
static void straight_between_copies(void **state)
{
    struct srnf_pullback_geodesic g;
    struct pullback_pair p;
    double worst = 0.0;
    (void)state;

    pullback_open_bodies(&p, DEGREE, "bent capsule", "bent capsule");
    walk(&p, NULL, &g);
    assert_true(g.distance == 0.0 && g.path.length < 1e-13);
    srnf_pullback_geodesic_clear(&g);
    for (size_t i = 0; i < p.to.count; i++) {
        p.to.f[i] *= 2.5;
    }
    walk(&p, NULL, &g);
    check_path(&p, &g);
    for (size_t k = 0; k < g.steps; k++) {
        for (size_t i = 0; i < p.from.count; i++) {
            double truth = (1.0 + 1.5 * g.times[k]) * p.from.f[i];

            worst = compare_max(worst, fabs(g.coefficients[k * p.from.count + i] - truth));
        }
    }
    figure_below("path between copies", worst, 1e-10);
    figure_below("its length", fabs(g.path.length / g.distance - 1.0), 1e-13);
    srnf_pullback_geodesic_clear(&g);
    pullback_close(&p);
}

/* The energy of the discrete geodesic converges with the square of the number of segments. */
static void converges_with_segments(void **state)
{
    double errors[3];
    double energies[4];
    struct pullback_pair p;
    (void)state;

    pullback_open_stars(&p, 7);
    for (size_t k = 0; k < 4; k++) {
        struct srnf_pullback_options options = tight((size_t)2 << k);
        struct srnf_pullback_geodesic g;

        walk(&p, &options, &g);
        energies[k] = g.path.energy;
        srnf_pullback_geodesic_clear(&g);
    }
    for (size_t k = 0; k < 3; k++) {
        errors[k] = fabs(energies[k + 1] - energies[k]) / energies[3];
    }
    figure_order("energy, m = 2 to 16", 3, errors, 2.0, 2.0, 0.3, 1e-12, 2);
    pullback_close(&p);
}

/* How a path is solved does not matter where the ends are near. */
static void halving_finds_the_same(void **state)
{
    struct srnf_pullback_options options = tight(8);
    struct srnf_pullback_geodesic line;
    struct srnf_pullback_geodesic halved;
    struct pullback_pair p;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    for (size_t k = 0; k < 3; k++) {
        const size_t m = (size_t[]){4, 7, 12}[k];
        double worst = 0.0;

        options.segments = m;
        options.halving = false;
        walk(&p, &options, &line);
        options.halving = true;
        walk(&p, &options, &halved);
        check_path(&p, &halved);
        for (size_t i = 0; i <= m; i++) {
            worst = compare_max(worst, shapes_distance(DEGREE, line.coefficients + i * p.from.count,
                                                       halved.coefficients + i * p.from.count));
        }
        figure_below("halving, surfaces apart", worst, 1e-8);
        srnf_pullback_geodesic_clear(&halved);
        srnf_pullback_geodesic_clear(&line);
    }
    pullback_close(&p);
}

static void bits_do_not_depend_on_threads(void **state)
{
    struct srnf_pullback_options options = tight(6);
    struct srnf_pullback_geodesic first = {0};
    struct pullback_pair p;
    (void)state;

    pullback_open_stars(&p, 6);
    for (size_t k = 0; k < GROUP_SPREADS; k++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[k]);
        struct srnf_pullback_geodesic g;

        assert_int_equal(
            srnf_pullback_geodesic(p.from.sht, p.from.f, p.to.f, &options, &context, &g, NULL),
            SRNF_OK);
        assert_true(atomic_load(&watch.bodies) > 0);
        if (k == 0) {
            first = g;
            continue;
        }
        assert_memory_equal(first.coefficients, g.coefficients, 7 * p.from.count * sizeof(double));
        assert_true(first.path.energy == g.path.energy && first.gradient == g.gradient);
        assert_true(first.transforms == g.transforms && first.iterations == g.iterations);
        srnf_pullback_geodesic_clear(&g);
    }
    srnf_pullback_geodesic_clear(&first);
    pullback_close(&p);
}

static int run_default(void *argument, const struct srnf_context *context)
{
    const struct pullback_pair *p = argument;
    struct srnf_pullback_geodesic g;
    struct srnf_error error = {0};
    int status = srnf_pullback_geodesic(p->from.sht, p->from.f, p->to.f, NULL, context, &g, &error);

    if (status < 0) {
        assert_int_equal(error.status, status);
        assert_null(g.coefficients);
        assert_null(g.times);
    }
    srnf_pullback_geodesic_clear(&g);
    srnf_pullback_geodesic_clear(&g); /* clearing twice does no harm */
    return status;
}

static void cancels_and_stops(void **state)
{
    struct srnf_pullback_options options = tight(8);
    struct srnf_pullback_geodesic g;
    struct pullback_pair p;
    (void)state;

    pullback_open_stars(&p, DEGREE);
    pullback_check_cancellation(run_default, &p);
    options.max_iterations = 1;
    assert_int_equal(srnf_pullback_geodesic(p.from.sht, p.from.f, p.to.f, &options, NULL, &g, NULL),
                     SRNF_WNOT_CONVERGED);
    assert_true(!g.converged && g.iterations == 1);
    assert_true(g.path.energy < g.linear.energy && g.gradient > 1e-9);
    srnf_pullback_geodesic_clear(&g);
    pullback_close(&p);
}

static void expect_refusal(const struct pullback_pair *p,
                           const struct srnf_pullback_options *options, int status,
                           const char *what)
{
    struct srnf_error error = {0};
    struct srnf_pullback_geodesic g;

    assert_int_equal(
        srnf_pullback_geodesic(p->from.sht, p->from.f, p->to.f, options, NULL, &g, &error), status);
    assert_int_equal(error.status, status);
    assert_non_null(strstr(error.message, what));
    assert_null(g.coefficients);
}

static void refuses_wrong_arguments(void **state)
{
    const size_t segments[] = {0, 1, 101, SIZE_MAX};
    const double wrong[] = {NAN, INFINITY, -INFINITY};
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct pullback_pair p;
    (void)state;

    pullback_open_stars(&p, 6);
    for (size_t k = 0; k < 4; k++) {
        options.segments = segments[k];
        expect_refusal(&p, &options, SRNF_EINVAL, "segments");
    }
    for (size_t k = 0; k < 3; k++) {
        options = srnf_pullback_options_defaults();
        options.tolerance = k == 0 ? NAN : k == 1 ? -1.0 : 1.5;
        expect_refusal(&p, &options, SRNF_EINVAL, "tolerance");
        options = srnf_pullback_options_defaults();
        options.gradient = k == 0 ? NAN : k == 1 ? -1.0 : 1.5;
        expect_refusal(&p, &options, SRNF_EINVAL, "gradient");
    }
    options = srnf_pullback_options_defaults();
    options.max_iterations = 0;
    expect_refusal(&p, &options, SRNF_EINVAL, "max_iterations");
    for (size_t k = 0; k < 3; k++) {
        double kept = p.to.f[7];

        p.to.f[7] = wrong[k];
        expect_refusal(&p, NULL, SRNF_EINVAL, "second end");
        p.to.f[7] = kept;
        kept = p.from.f[7];
        p.from.f[7] = wrong[k];
        expect_refusal(&p, NULL, SRNF_EINVAL, "first end");
        p.from.f[7] = kept;
    }
    p.to.f[7] = 1e200; /* whose square is beyond the range of doubles */
    expect_refusal(&p, NULL, SRNF_ENUMERIC, srnf_strerror(SRNF_ENUMERIC));
    pullback_close(&p);
}

/* The path is that of srnf_pullback_geodesic, the curves are those of srnf_geodesic. */
static void curves_are_those_of_both(void **state)
{
    struct srnf_pullback_options options = tight(4);
    struct srnf_geodesic_options straight = {.method = SRNF_GEODESIC_LINEAR, .steps = 5};
    struct srnf_pullback_geodesic alone, result;
    struct srnf_geodesic line, curves;
    struct pullback_pair p;
    double *q;
    (void)state;

    pullback_open_stars(&p, 6);
    q = shapes_doubles(3 * p.from.points);
    walk(&p, &options, &alone);
    assert_int_equal(srnf_geodesic(p.from.sht, p.from.f, p.to.f, &straight, NULL, &line, NULL),
                     SRNF_OK);
    assert_int_equal(
        srnf_pullback_curves(p.from.sht, p.from.f, p.to.f, &options, NULL, &curves, &result, NULL),
        SRNF_OK);
    assert_int_equal(curves.steps, 5);
    assert_memory_equal(curves.coefficients, alone.coefficients, 5 * p.from.count * sizeof(double));
    assert_memory_equal(curves.energy_linear, line.energy_linear, 5 * sizeof(double));
    assert_memory_equal(curves.energy_closed_form, line.energy_closed_form, 5 * sizeof(double));
    assert_true(curves.distance == line.distance && curves.length == alone.path.length);
    assert_true(curves.transforms == line.transforms + alone.transforms);
    for (size_t i = 0; i < 5; i++) {
        double energy;

        for (size_t k = 0; k < 3 * p.from.points; k++) {
            q[k] = (1.0 - curves.times[i]) * p.from.q[k] + curves.times[i] * p.to.q[k];
        }
        energy = srnf_energy(p.from.sht, curves.coefficients + i * p.from.count, q, NULL,
                             p.from.workspace);
        assert_true(fabs(curves.energy_geodesic[i] - energy) <= 1e-12 * energy + 1e-28);
        assert_true(i == 0 || i == 4 || curves.energy_geodesic[i] > 1e-6);
    }
    srnf_free(q);
    srnf_geodesic_clear(&line);
    srnf_geodesic_clear(&curves);
    srnf_pullback_geodesic_clear(&alone);
    srnf_pullback_geodesic_clear(&result);
    pullback_close(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lies_between_the_chord_and_other_paths),
        cmocka_unit_test(reverses),
        cmocka_unit_test(moves_with_its_ends),
        cmocka_unit_test(straight_between_copies),
        cmocka_unit_test(converges_with_segments),
        cmocka_unit_test(halving_finds_the_same),
        cmocka_unit_test(bits_do_not_depend_on_threads),
        cmocka_unit_test(cancels_and_stops),
        cmocka_unit_test(refuses_wrong_arguments),
        cmocka_unit_test(curves_are_those_of_both),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
