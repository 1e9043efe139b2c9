/*
 * test_geodesic.c - paths between two surfaces: their ends, the three energy curves, symmetry, the
 * closed form between stars about one centre, cancellation, and wrong arguments.
 */
#include "core/registration/pairs.h"

#define DEGREE 15

static double chord(const struct pair *p)
{
    double *difference = shapes_doubles(3 * p->from.points);
    double length;

    for (size_t i = 0; i < 3 * p->from.points; i++) {
        difference[i] = p->from.q[i] - p->to.q[i];
    }
    length = sqrt(srnf_inner_product(p->from.grid, difference, difference));
    srnf_free(difference);
    return length;
}

static void walk(const struct pair *p, enum srnf_geodesic_method method, size_t steps,
                 struct srnf_geodesic *result)
{
    struct srnf_geodesic_options options = {.method = method, .steps = steps};

    assert_int_equal(srnf_geodesic(p->from.sht, p->from.f, p->to.f, &options, NULL, result, NULL),
                     SRNF_OK);
    assert_int_equal(result->steps, steps);
    assert_int_equal(result->degree, DEGREE);
}

/* What holds for every method: exact ends, times, energies 0 at the ends, E as srnf_energy has
   it. */
static void check_path(const struct pair *p, const struct srnf_geodesic *g)
{
    const struct shapes_surface *s = &p->from;
    size_t last = g->steps - 1;
    double *q = shapes_doubles(3 * s->points);

    assert_memory_equal(g->coefficients, s->f, s->count * sizeof *s->f);
    assert_memory_equal(g->coefficients + last * s->count, p->to.f, s->count * sizeof *s->f);
    assert_true(fabs(g->distance - chord(p)) <= 1e-13);
    assert_true(g->length >= g->distance - 1e-12);
    assert_true(g->transforms > 0.0);
    for (size_t k = 0; k <= last; k++) {
        double t = (double)k / (double)last;
        double energy;

        assert_true(fabs(g->times[k] - t) < 1e-15);
        for (size_t i = 0; i < 3 * s->points; i++) {
            q[i] = (1.0 - t) * s->q[i] + t * p->to.q[i];
        }
        energy = srnf_energy(s->sht, g->coefficients + k * s->count, q, NULL, s->workspace);
        assert_true(fabs(energy - g->energy_geodesic[k]) <= 1e-12 * energy + 1e-28);
        for (size_t c = 0; c < 3; c++) { /* translations go straight */
            double straight = (1.0 - t) * s->f[c * s->each] + t * p->to.f[c * s->each];

            assert_true(fabs(g->coefficients[k * s->count + c * s->each] - straight) < 1e-14);
        }
    }
    assert_true(g->energy_geodesic[0] < 1e-28 && g->energy_geodesic[last] < 1e-28);
    assert_true(g->energy_linear[0] < 1e-28 && g->energy_linear[last] < 1e-28);
    srnf_free(q);
}

static void print_curves(const struct srnf_geodesic *g)
{
    const struct {
        const char *name;
        const double *values;
    } curves[] = {{"geodesic", g->energy_geodesic},
                  {"closed form", g->energy_closed_form},
                  {"linear", g->energy_linear}};

    for (size_t k = 0; k < 3; k++) {
        printf("#   E %-11s", curves[k].name);
        for (size_t i = 0; i < g->steps; i++) {
            printf(" %.1e", curves[k].values[i]);
        }
        printf("\n");
    }
    printf("#   chord %.6f, length %.6f, %.0f U\n", g->distance, g->length, g->transforms);
}

static void curves_are_ordered(void **state)
{
    static const struct {
        const char *from, *to;
    } bodies[] = {{NULL, NULL},
                  {"bumpy star", "ellipsoid"},
                  {"ellipsoid", "bent capsule"},
                  {"3 arms", "5 arms"}};
    (void)state;

    for (size_t b = 0; b < sizeof bodies / sizeof bodies[0]; b++) {
        struct srnf_geodesic g;
        struct pair p;

        pair_open(&p, DEGREE, bodies[b].from, bodies[b].to);
        walk(&p, SRNF_GEODESIC_SRNF, 7, &g);
        printf("# %s to %s\n", bodies[b].from ? bodies[b].from : "star",
               bodies[b].to ? bodies[b].to : "star");
        print_curves(&g);
        check_path(&p, &g);
        for (size_t k = 0; k < g.steps; k++) {
            assert_true(g.energy_geodesic[k] <= g.energy_linear[k] + 1e-28);
            assert_true(g.energy_geodesic[k] <= g.energy_closed_form[k] + 1e-28);
        }
        assert_true(g.energy_geodesic[3] < 0.5 * g.energy_linear[3]);
        srnf_geodesic_clear(&g);
        pair_close(&p);
    }
}

/* Path k at t against the path from the other end at 1 - t. */
static void reverses(void **state)
{
    struct srnf_geodesic there;
    struct srnf_geodesic back;
    struct pair p;
    struct pair swapped;
    double worst = 0.0;
    (void)state;

    pair_open(&p, DEGREE, NULL, NULL);
    swapped = (struct pair){p.to, p.from, NULL};
    walk(&p, SRNF_GEODESIC_SRNF, 9, &there);
    walk(&swapped, SRNF_GEODESIC_SRNF, 9, &back);
    check_path(&swapped, &back);
    for (size_t k = 0; k < 9; k++) {
        const double *a = there.coefficients + k * p.from.count;
        const double *b = back.coefficients + (8 - k) * p.from.count;

        worst = compare_max(worst, shapes_distance(DEGREE, a, b));
    }
    figure_below("there and back, surfaces apart", worst, 2e-3);
    assert_true(there.distance == back.distance);
    assert_true(fabs(there.length / back.length - 1.0) < 1e-4);
    srnf_geodesic_clear(&back);
    srnf_geodesic_clear(&there);
    pair_close(&p);
}

static void other_methods(void **state)
{
    const enum srnf_geodesic_method methods[] = {SRNF_GEODESIC_CLOSED_FORM, SRNF_GEODESIC_LINEAR};
    struct srnf_geodesic g;
    struct pair p;
    (void)state;

    pair_open(&p, DEGREE, NULL, NULL);
    for (size_t m = 0; m < 2; m++) {
        walk(&p, methods[m], 7, &g);
        check_path(&p, &g);
        for (size_t k = 1; k < 6; k++) {
            double own =
                methods[m] == SRNF_GEODESIC_LINEAR ? g.energy_linear[k] : g.energy_closed_form[k];

            assert_true(fabs(g.energy_geodesic[k] / own - 1.0) < 1e-9);
            for (size_t i = 0; methods[m] == SRNF_GEODESIC_LINEAR && i < p.from.count; i++) {
                double t = g.times[k];
                double straight = (1.0 - t) * p.from.f[i] + t * p.to.f[i];

                assert_true(fabs(g.coefficients[k * p.from.count + i] - straight) < 1e-15);
            }
        }
        srnf_geodesic_clear(&g);
    }
    pair_close(&p);
}

/* Scaled copies of one star: the line stays in the image of Q, where both methods find it. The
   surface at t is the star scaled by (1 - t) + t c. */
static void closed_form_is_right_between_stars_of_one_shape(void **state)
{
    const enum srnf_geodesic_method methods[] = {SRNF_GEODESIC_CLOSED_FORM, SRNF_GEODESIC_SRNF};
    struct srnf_geodesic g;
    struct pair p;
    (void)state;

    pair_open(&p, DEGREE, NULL, NULL);
    for (size_t i = 0; i < p.to.count; i++) {
        p.to.f[i] = 2.5 * p.from.f[i];
    }
    for (size_t c = 0; c < 3; c++) { /* about the same centre, moved */
        p.from.f[c * p.from.each] = p.to.f[c * p.to.each] = 0.3 * (double)(c + 1);
    }
    shapes_update(&p.from);
    shapes_update(&p.to);
    for (size_t m = 0; m < 2; m++) {
        double worst = 0.0;

        walk(&p, methods[m], 7, &g);
        check_path(&p, &g);
        for (size_t k = 0; k < 7; k++) {
            double factor = 1.0 + 1.5 * g.times[k];

            for (size_t i = 0; i < p.from.count; i++) {
                double truth = i % p.from.each == 0 ? p.from.f[i] : factor * p.from.f[i];

                worst = compare_max(worst, fabs(g.coefficients[k * p.from.count + i] - truth));
            }
        }
        figure_below(m == 0 ? "closed form, surface" : "srnf, surface", worst, 1e-12);
        assert_true(fabs(g.length / g.distance - 1.0) < 1e-12);
        assert_true(g.closed_form_applies);
        srnf_geodesic_clear(&g);
    }
    pair_close(&p);
}

/* One end that is not radial is enough, on either side. */
static void closed_form_needs_both_ends(void **state)
{
    struct srnf_geodesic g;
    struct pair p;
    (void)state;

    pair_open(&p, DEGREE, "bumpy star", "bent capsule");
    walk(&p, SRNF_GEODESIC_LINEAR, 2, &g);
    assert_false(g.closed_form_applies);
    srnf_geodesic_clear(&g);
    pair_close(&p);
    pair_open(&p, DEGREE, "bent capsule", "bumpy star");
    walk(&p, SRNF_GEODESIC_LINEAR, 2, &g);
    assert_false(g.closed_form_applies);
    srnf_geodesic_clear(&g);
    pair_close(&p);
}

static void constant_between_equal_ends(void **state)
{
    struct srnf_geodesic g;
    struct pair p;
    double worst = 0.0;
    (void)state;

    pair_open(&p, DEGREE, "bent capsule", "bent capsule");
    walk(&p, SRNF_GEODESIC_SRNF, 5, &g);
    check_path(&p, &g);
    for (size_t k = 0; k < 5; k++) {
        worst = compare_max(
            worst, compare_difference(p.from.count, p.from.f, g.coefficients + k * p.from.count));
    }
    figure_below("path between equal ends, largest change", worst, 1e-14);
    assert_true(g.distance == 0.0 && g.length < 1e-13);
    assert_false(g.closed_form_applies);
    srnf_geodesic_clear(&g);
    pair_close(&p);
}

static void numbers_of_steps(void **state)
{
    const size_t steps[] = {2, 3, 101};
    struct pair p;
    double lengths[3];
    (void)state;

    pair_open(&p, DEGREE, NULL, NULL);
    for (size_t k = 0; k < 3; k++) {
        struct srnf_geodesic g;

        walk(&p, SRNF_GEODESIC_SRNF, steps[k], &g);
        check_path(&p, &g);
        printf("# %zu steps: length %.8f, chord %.8f, %.0f U\n", steps[k], g.length, g.distance,
               g.transforms);
        lengths[k] = g.length;
        srnf_geodesic_clear(&g);
    }
    assert_true(lengths[0] <= lengths[1] + 1e-9 && lengths[1] <= lengths[2] + 1e-9);
    pair_close(&p);
}

/* ---- Caller and library ---------------------------------------------------------------------- */

static void cancels(void **state)
{
    struct srnf_geodesic_options options = srnf_geodesic_options_defaults();
    struct srnf_geodesic g;
    struct watcher w = {.stop_after = SIZE_MAX};
    struct srnf_context context = watcher_context(&w);
    struct pair p;
    size_t calls;
    (void)state;

    pair_open(&p, DEGREE, NULL, NULL);
    assert_int_equal(srnf_geodesic(p.from.sht, p.from.f, p.to.f, &options, &context, &g, NULL),
                     SRNF_OK);
    srnf_geodesic_clear(&g);
    assert_true(w.reports >= options.steps && w.last == 1.0);
    calls = w.calls;
    assert_true(calls >= options.steps - 2);
    for (size_t stop = 0; stop < calls; stop += 1 + calls / 7) {
        struct srnf_error error = {0};

        w = (struct watcher){.stop_after = stop};
        assert_int_equal(
            srnf_geodesic(p.from.sht, p.from.f, p.to.f, &options, &context, &g, &error),
            SRNF_ECANCELED);
        assert_int_equal(error.status, SRNF_ECANCELED);
        assert_null(g.coefficients);
        assert_null(g.times);
    }
    pair_close(&p);
}

static void refuses_wrong_arguments(void **state)
{
    const size_t steps[] = {0, 1, 102, SIZE_MAX};
    const double wrong[] = {NAN, INFINITY, -INFINITY};
    struct srnf_geodesic_options options = srnf_geodesic_options_defaults();
    struct srnf_geodesic g;
    struct srnf_error error = {0};
    struct pair p;
    (void)state;

    pair_open(&p, DEGREE, NULL, NULL);
    for (size_t k = 0; k < 4; k++) {
        options.steps = steps[k];
        assert_int_equal(srnf_geodesic(p.from.sht, p.from.f, p.to.f, &options, NULL, &g, &error),
                         SRNF_EINVAL);
        assert_non_null(strstr(error.message, "steps"));
    }
    for (size_t k = 0; k < 3; k++) {
        double kept = p.to.f[7];

        p.to.f[7] = wrong[k];
        error = (struct srnf_error){0};
        assert_int_equal(srnf_geodesic(p.from.sht, p.from.f, p.to.f, NULL, NULL, &g, &error),
                         SRNF_EINVAL);
        assert_int_equal(error.element, 7);
        assert_int_equal(srnf_geodesic(p.from.sht, p.to.f, p.from.f, NULL, NULL, &g, NULL),
                         SRNF_EINVAL);
        p.to.f[7] = kept;
    }
    assert_int_equal(srnf_geodesic(p.from.sht, p.from.f, p.to.f, NULL, NULL, &g, NULL), SRNF_OK);
    assert_int_equal(g.steps, 7);
    srnf_geodesic_clear(&g);
    srnf_geodesic_clear(&g); /* clearing twice does no harm */
    pair_close(&p);
}

/* Norms against those of the fields; centroids on a straight line, and nothing else changed. */
static void norms_and_places_along_the_line(void **state)
{
    struct srnf_surface_measures measures[5], moved;
    const double far[3] = {3.0, -1.0, 0.5};
    struct srnf_geodesic g;
    struct pair p;
    double norms[5], *q;
    (void)state;

    pair_open(&p, DEGREE, NULL, NULL);
    q = shapes_doubles(3 * p.from.points);
    walk(&p, SRNF_GEODESIC_LINEAR, 5, &g);
    assert_int_equal(srnf_surfaces_measure(p.from.sht, 5, g.coefficients, NULL, measures), SRNF_OK);
    srnf_geodesic_squared_norms(&g, measures[0].area, measures[4].area, norms);
    for (size_t i = 0; i < 5; i++) {
        for (size_t k = 0; k < 3 * p.from.points; k++) {
            q[k] = (1.0 - g.times[i]) * p.from.q[k] + g.times[i] * p.to.q[k];
        }
        assert_true(fabs(norms[i] - srnf_inner_product(p.from.grid, q, q)) <= 1e-12);
    }
    srnf_surface_move(DEGREE, g.coefficients + 4 * p.from.count, &measures[4], far);
    srnf_geodesic_place(&g, measures);
    for (size_t i = 0; i < 5; i++) {
        const double *f = g.coefficients + i * p.from.count;

        srnf_surface_measure(p.from.sht, f, &moved, p.from.workspace);
        assert_true(fabs(moved.area - measures[i].area) <= 1e-12);
        for (size_t k = 0; k < 3; k++) {
            double wanted = (1.0 - g.times[i]) * measures[0].centroid[k] + g.times[i] * far[k];

            assert_true(fabs(moved.centroid[k] - wanted) <= 1e-12);
            assert_true(fabs(measures[i].centroid[k] - wanted) <= 1e-15);
        }
    }
    assert_memory_equal(g.coefficients, p.from.f, p.from.count * sizeof(double));
    srnf_free(q);
    srnf_geodesic_clear(&g);
    pair_close(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(curves_are_ordered),
        cmocka_unit_test(reverses),
        cmocka_unit_test(other_methods),
        cmocka_unit_test(closed_form_is_right_between_stars_of_one_shape),
        cmocka_unit_test(closed_form_needs_both_ends),
        cmocka_unit_test(constant_between_equal_ends),
        cmocka_unit_test(numbers_of_steps),
        cmocka_unit_test(cancels),
        cmocka_unit_test(refuses_wrong_arguments),
        cmocka_unit_test(norms_and_places_along_the_line),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
