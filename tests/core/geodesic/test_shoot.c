/*
 * test_shoot.c - shooting: it ends where the velocity points, goes back the way it came, does not
 * depend on which other times are asked for, commutes with rotations and scalings, and says how far
 * the line is from any surface.
 *
 * srnfd-test: no-asan (api/test_transport.sh and test_transport.c run its code)
 */
#include "core/registration/pairs.h"

#define DEGREE 15

/* With the velocity from one to the other. */
static void open_pair(struct pair *p, const char *from, const char *to)
{
    pair_open(p, DEGREE, from, to);
    pair_aim(p);
}

static struct srnf_shot shoot(const struct shapes_surface *s, const double *velocity, size_t n,
                              const double *times)
{
    struct srnf_shot shot;

    assert_int_equal(srnf_shoot(s->sht, s->f, velocity, n, times, NULL, &shot, NULL), SRNF_OK);
    assert_int_equal(shot.n, n);
    assert_int_equal(shot.degree, s->degree);
    return shot;
}

static void ends_where_it_points(void **state)
{
    static const struct {
        const char *from, *to;
    } bodies[] = {{NULL, NULL},
                  {"bumpy star", "ellipsoid"},
                  {"ellipsoid", "bent capsule"},
                  {"3 arms", "5 arms"}};
    const double times[] = {0.0, 0.5, 1.0};
    (void)state;

    for (size_t b = 0; b < sizeof bodies / sizeof bodies[0]; b++) {
        struct pair p;
        struct srnf_shot shot;

        open_pair(&p, bodies[b].from, bodies[b].to);
        shot = shoot(&p.from, p.velocity, 3, times);
        printf("# %s to %s: relative E half way %.1e, at the end %.1e, %.0f U\n",
               bodies[b].from ? bodies[b].from : "star", bodies[b].to ? bodies[b].to : "star",
               shot.relative_energy[1], shot.relative_energy[2], shot.transforms);
        assert_memory_equal(shot.coefficients, p.from.f, p.from.count * sizeof(double));
        assert_true(shot.energy[0] < 1e-28);
        figure_below("the end",
                     shapes_distance(DEGREE, shot.coefficients + 2 * p.from.count, p.to.f), 1e-6);
        assert_true(shot.relative_energy[2] < 1e-14);
        srnf_shot_clear(&shot);
        pair_close(&p);
    }
}

/* Energies are those of the surfaces returned, and a minimum: no blend of the ends is nearer. */
static void energies_are_those_of_the_line(void **state)
{
    const double times[] = {0.25, 0.75, -0.3, 1.2};
    struct pair p;
    struct srnf_shot shot;
    double *q;
    double *blend;
    (void)state;

    open_pair(&p, "bumpy star", "ellipsoid");
    q = shapes_doubles(3 * p.from.points);
    blend = shapes_doubles(p.from.count);
    shot = shoot(&p.from, p.velocity, 4, times);
    for (size_t k = 0; k < 4; k++) {
        double energy;
        double linear;

        for (size_t i = 0; i < 3 * p.from.points; i++) {
            q[i] = p.from.q[i] + times[k] * p.velocity[i];
        }
        for (size_t i = 0; i < p.from.count; i++) {
            blend[i] = (1.0 - times[k]) * p.from.f[i] + times[k] * p.to.f[i];
        }
        energy = srnf_energy(p.from.sht, shot.coefficients + k * p.from.count, q, NULL,
                             p.from.workspace);
        linear = srnf_energy(p.from.sht, blend, q, NULL, p.from.workspace);
        assert_true(fabs(energy - shot.energy[k]) <= 1e-10 * energy);
        assert_true(fabs(shot.relative_energy[k] * srnf_inner_product(p.from.grid, q, q) / energy -
                         1.0) < 1e-10);
        assert_true(energy < 0.5 * linear);
    }
    srnf_shot_clear(&shot);
    srnf_free(blend);
    srnf_free(q);
    pair_close(&p);
}

/* From the end with the opposite velocity: the surfaces in between and the start again. */
static void goes_back_the_way_it_came(void **state)
{
    const double times[] = {0.5, 1.0};
    struct pair p;
    struct srnf_shot there;
    struct srnf_shot back;
    (void)state;

    open_pair(&p, NULL, NULL);
    there = shoot(&p.from, p.velocity, 2, times);
    for (size_t i = 0; i < 3 * p.from.points; i++) {
        p.velocity[i] = -p.velocity[i];
    }
    back = shoot(&p.to, p.velocity, 2, times);
    figure_below("half way", shapes_distance(DEGREE, there.coefficients, back.coefficients), 1e-3);
    figure_below("back", shapes_distance(DEGREE, back.coefficients + p.to.count, p.from.f), 1e-6);
    assert_true(fabs(there.energy[0] / back.energy[0] - 1.0) < 1e-3);
    srnf_shot_clear(&back);
    srnf_shot_clear(&there);
    pair_close(&p);
}

/* The same surface, whatever other times are asked for, in any order, on either side, twice. */
static void times_in_any_order(void **state)
{
    const double many[] = {1.0, -0.5, 0.0, 0.25, 1.0, -0.125, 0.5};
    struct pair p;
    struct srnf_shot shot;
    (void)state;

    open_pair(&p, "bumpy star", "ellipsoid");
    shot = shoot(&p.from, p.velocity, 7, many);
    assert_memory_equal(shot.coefficients, shot.coefficients + 4 * p.from.count,
                        p.from.count * sizeof(double));
    assert_true(shot.energy[0] == shot.energy[4] &&
                shot.relative_energy[0] == shot.relative_energy[4]);
    assert_memory_equal(shot.coefficients + 2 * p.from.count, p.from.f,
                        p.from.count * sizeof(double));
    for (size_t k = 0; k < 7; k++) {
        struct srnf_shot alone = shoot(&p.from, p.velocity, 1, many + k);

        figure_below(
            "alone and among others",
            shapes_distance(DEGREE, alone.coefficients, shot.coefficients + k * p.from.count),
            1e-3);
        assert_true(fabs(alone.energy[0] - shot.energy[k]) <= 2e-3 * shot.energy[k] + 1e-14);
        srnf_shot_clear(&alone);
    }
    srnf_shot_clear(&shot);
    pair_close(&p);
}

/* Along its own SRNF a surface grows: Q((1 + t) f) = Q(f) + t Q(f). Down to nothing at t = -1,
   which is no surface. */
static void growing_is_exact(void **state)
{
    const double times[] = {1.5, -0.75, 0.1};
    const double nothing = -1.0;
    struct shapes_surface s;
    struct srnf_shot shot;
    struct srnf_error error = {0};
    (void)state;

    shapes_open_case(&s, shapes_find("3 arms"));
    for (size_t c = 0; c < 3; c++) { /* where it is does not matter, and stays */
        s.f[c * s.each] = 0.3 * (double)(c + 1);
    }
    shot = shoot(&s, s.q, 3, times);
    for (size_t k = 0; k < 3; k++) {
        double worst = 0.0;

        for (size_t i = 0; i < s.count; i++) {
            double truth = i % s.each == 0 ? s.f[i] : (1.0 + times[k]) * s.f[i];

            worst = compare_max(worst, fabs(shot.coefficients[k * s.count + i] - truth));
        }
        figure_below("grown surface", worst, 1e-8);
    }
    srnf_shot_clear(&shot);
    assert_int_equal(srnf_shoot(s.sht, s.f, s.q, 1, &nothing, NULL, &shot, &error), SRNF_ENUMERIC);
    assert_non_null(strstr(error.message, "point"));
    assert_null(shot.coefficients);
    shapes_close(&s);
}

/* No velocity, no motion. */
static void stands_still(void **state)
{
    const double times[] = {-2.0, 1.0, 7.0};
    struct shapes_surface s;
    struct srnf_shot shot;
    double *nothing;
    (void)state;

    shapes_open_case(&s, shapes_find("bent capsule"));
    nothing = shapes_doubles(3 * s.points);
    shot = shoot(&s, nothing, 3, times);
    for (size_t k = 0; k < 3; k++) {
        assert_memory_equal(shot.coefficients + k * s.count, s.f, s.count * sizeof(double));
        assert_true(shot.relative_energy[k] < 1e-28);
    }
    srnf_shot_clear(&shot);
    srnf_free(nothing);
    shapes_close(&s);
}

/* Turned and scaled surfaces are shot to turned and scaled ones. */
static void commutes_with_similarities(void **state)
{
    const double time = 0.6;
    const double size = 40.0;
    struct test_random random = test_random_seed(3);
    double rotation[9];
    struct pair p;
    struct srnf_shot plain;
    struct srnf_shot moved;
    (void)state;

    open_pair(&p, NULL, NULL);
    plain = shoot(&p.from, p.velocity, 1, &time);
    shapes_random_rotation(&random, rotation);
    shapes_rotate(rotation, p.from.each, p.from.f);
    shapes_rotate(rotation, p.from.each, plain.coefficients);
    shapes_rotate(rotation, p.from.points, p.velocity);
    for (size_t i = 0; i < p.from.count; i++) {
        p.from.f[i] *= size;
        plain.coefficients[i] *= size;
    }
    for (size_t i = 0; i < 3 * p.from.points; i++) {
        p.velocity[i] *= size;
    }
    moved = shoot(&p.from, p.velocity, 1, &time);
    figure_below("turned and scaled",
                 shapes_distance(DEGREE, plain.coefficients, moved.coefficients) / size, 1e-6);
    srnf_shot_clear(&moved);
    srnf_shot_clear(&plain);
    pair_close(&p);
}

/* ---- Caller and library ---------------------------------------------------------------------- */

static void cancels(void **state)
{
    const double times[] = {0.5, 1.0, -0.5};
    struct watcher w = {.stop_after = SIZE_MAX};
    struct srnf_context context = watcher_context(&w);
    struct pair p;
    struct srnf_shot shot;
    size_t calls;
    (void)state;

    open_pair(&p, NULL, NULL);
    assert_int_equal(srnf_shoot(p.from.sht, p.from.f, p.velocity, 3, times, &context, &shot, NULL),
                     SRNF_OK);
    srnf_shot_clear(&shot);
    assert_true(w.reports == 3 && w.last == 1.0);
    calls = w.calls;
    assert_true(calls > 6);
    for (size_t stop = 0; stop < calls; stop += 1 + calls / 7) {
        struct srnf_error error = {0};

        w = (struct watcher){.stop_after = stop};
        assert_int_equal(
            srnf_shoot(p.from.sht, p.from.f, p.velocity, 3, times, &context, &shot, &error),
            SRNF_ECANCELED);
        assert_int_equal(error.status, SRNF_ECANCELED);
        assert_null(shot.coefficients);
    }
    pair_close(&p);
}

static void refuses_wrong_arguments(void **state)
{
    const double wrong_times[] = {10.5, -11.0, NAN, INFINITY};
    const double times[SRNF_SHOOT_TIMES_MAX + 1] = {0.0};
    const double one = 1.0;
    struct pair p;
    struct srnf_shot shot;
    struct srnf_error error = {0};
    (void)state;

    open_pair(&p, NULL, NULL);
    for (size_t k = 0; k < 4; k++) {
        assert_int_equal(
            srnf_shoot(p.from.sht, p.from.f, p.velocity, 1, wrong_times + k, NULL, &shot, &error),
            SRNF_EINVAL);
        assert_non_null(strstr(error.message, "time 0"));
    }
    assert_int_equal(srnf_shoot(p.from.sht, p.from.f, p.velocity, 0, times, NULL, &shot, &error),
                     SRNF_EINVAL);
    assert_int_equal(srnf_shoot(p.from.sht, p.from.f, p.velocity, SRNF_SHOOT_TIMES_MAX + 1, times,
                                NULL, &shot, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "number of times"));
    p.velocity[9] = NAN;
    assert_int_equal(srnf_shoot(p.from.sht, p.from.f, p.velocity, 1, &one, NULL, &shot, &error),
                     SRNF_EINVAL);
    assert_int_equal(error.element, 9);
    assert_non_null(strstr(error.message, "velocity"));
    p.velocity[9] = 0.0;
    p.from.f[5] = INFINITY;
    assert_int_equal(srnf_shoot(p.from.sht, p.from.f, p.velocity, 1, &one, NULL, &shot, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "surface"));
    memset(p.from.f, 0, p.from.count * sizeof(double)); /* a point has no size to step by */
    assert_int_equal(srnf_shoot(p.from.sht, p.from.f, p.velocity, 1, &one, NULL, &shot, &error),
                     SRNF_EINVAL);
    assert_null(shot.coefficients);
    srnf_shot_clear(&shot); /* clearing nothing does no harm */
    pair_close(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ends_where_it_points),
        cmocka_unit_test(energies_are_those_of_the_line),
        cmocka_unit_test(goes_back_the_way_it_came),
        cmocka_unit_test(times_in_any_order),
        cmocka_unit_test(growing_is_exact),
        cmocka_unit_test(stands_still),
        cmocka_unit_test(commutes_with_similarities),
        cmocka_unit_test(cancels),
        cmocka_unit_test(refuses_wrong_arguments),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
