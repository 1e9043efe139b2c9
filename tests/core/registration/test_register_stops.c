/*
 * test_register_stops.c - why a registration went no further: a case for each reason, what
 * converged makes of it, and the names; that fields stay within the degree asked for; what is
 * known of ambiguity where rotations were not searched; and that what is no number is told as such.
 *
 * srnfd-test: no-asan (test_register_memory.c and fuzz/test_api.sh run its code)
 * srnfd-test: slow
 */
#include "registrations.h"
#include "registration/register.h"

#define DEGREE 8

struct pair {
    struct shapes_surface a, b;
};

static int open_pair(void **state)
{
    struct pair *pair = malloc(sizeof *pair);

    assert_non_null(pair);
    shapes_open(&pair->a, DEGREE);
    shapes_open(&pair->b, DEGREE);
    shapes_fill(&pair->a, shapes_ellipsoid, 1.7);
    shapes_fill(&pair->b, shapes_bumpy, 0.0);
    *state = pair;
    return 0;
}

static int close_pair(void **state)
{
    struct pair *pair = *state;

    shapes_close(&pair->a);
    shapes_close(&pair->b);
    free(pair);
    return 0;
}

static struct srnf_register_options from_identity(void)
{
    struct srnf_register_options options = srnf_register_options_defaults();

    options.start = SRNF_START_IDENTITY;
    options.degree = 4;
    return options;
}

static void stops(const struct shapes_surface *a, const double *moving,
                  const struct srnf_register_options *options, enum srnf_register_stop expected)
{
    struct srnf_registration r;

    registrations_run(a, NULL, moving, options, &r);
    printf("# %s after %zu iterations, distance %.3e\n", srnf_register_stop_name(r.stopped),
           r.iterations, r.distance);
    assert_int_equal(r.stopped, expected);
    assert_true(r.converged == (expected != SRNF_REGISTER_MAX_ITERATIONS));
    srnf_registration_clear(&r);
}

static void each_reason_appears(void **state)
{
    struct pair *pair = *state;
    struct srnf_register_options options = from_identity();

    stops(&pair->a, pair->b.f, &options, SRNF_REGISTER_STATIONARY);
    options.max_steps = 2;
    stops(&pair->a, pair->b.f, &options, SRNF_REGISTER_MAX_ITERATIONS);
    options = from_identity();
    stops(&pair->a, pair->a.f, &options, SRNF_REGISTER_TOLERANCE);
    options.reparameterization = false;
    stops(&pair->a, pair->b.f, &options, SRNF_REGISTER_DIRECT);
    options.start = SRNF_START_RIGID;
    stops(&pair->a, pair->b.f, &options, SRNF_REGISTER_STATIONARY);
    stops(&pair->a, pair->a.f, &options, SRNF_REGISTER_TOLERANCE);
}

/* No warp brings a sphere nearer to one of another size: there is no way down. What the steps then
   gain is rounding, which is refused where it is a loss and too little where it is a gain. */
static void where_there_is_no_way_down_it_stops_at_once(void **state)
{
    struct pair *pair = *state;
    struct srnf_register_options options = from_identity();
    double *larger = shapes_doubles(pair->b.count);
    struct srnf_registration r;

    shapes_fill(&pair->a, shapes_ellipsoid, 1.0);
    for (size_t i = 0; i < pair->a.count; i++) {
        larger[i] = 2.0 * pair->a.f[i];
    }
    registrations_run(&pair->a, NULL, larger, &options, &r);
    printf("# %s after %zu iterations\n", srnf_register_stop_name(r.stopped), r.iterations);
    assert_true(r.stopped == SRNF_REGISTER_REFUSED || r.stopped == SRNF_REGISTER_STATIONARY);
    assert_true(r.converged);
    assert_true(r.iterations <= 4);
    srnf_registration_clear(&r);
    srnf_free(larger);
}

static enum srnf_register_stop stop_of(const struct shapes_surface *a, const double *moving,
                                       const struct srnf_register_options *options)
{
    struct srnf_registration r;
    enum srnf_register_stop stopped;

    registrations_run(a, NULL, moving, options, &r);
    stopped = r.stopped;
    srnf_registration_clear(&r);
    return stopped;
}

/* Where one of the ways ran out of steps, both together did not converge, whichever is kept.
   Returns how often only one did. */
static size_t compare_ways(const struct pair *pair)
{
    struct srnf_register_options options = from_identity();
    size_t differing = 0;

    for (options.max_steps = 2; options.max_steps <= 12; options.max_steps++) {
        bool there, back;

        options.symmetric = false;
        there = stop_of(&pair->a, pair->b.f, &options) == SRNF_REGISTER_MAX_ITERATIONS;
        back = stop_of(&pair->b, pair->a.f, &options) == SRNF_REGISTER_MAX_ITERATIONS;
        options.symmetric = true;
        differing += there != back;
        if (there || back) {
            assert_int_equal(stop_of(&pair->a, pair->b.f, &options), SRNF_REGISTER_MAX_ITERATIONS);
            assert_int_equal(stop_of(&pair->b, pair->a.f, &options), SRNF_REGISTER_MAX_ITERATIONS);
        }
    }
    return differing;
}

static void the_worse_of_both_ways_counts(void **state)
{
    struct pair *pair = *state;
    size_t differing = compare_ways(pair);

    for (uint64_t seed = 1; seed <= 3; seed++) {
        shapes_fill_random_star(&pair->a, seed, NULL);
        differing += compare_ways(pair);
    }
    printf("# the ways differed %zu times\n", differing);
    assert_true(differing > 0);
}

static void the_worse_reason_is_the_later_one(void **state)
{
    (void)state;
    for (int a = 0; a < 5; a++) {
        for (int b = 0; b < 5; b++) {
            assert_int_equal(
                registration_worse_stop((enum srnf_register_stop)a, (enum srnf_register_stop)b),
                a > b ? a : b);
        }
    }
    assert_true(SRNF_REGISTER_MAX_ITERATIONS > SRNF_REGISTER_REFUSED &&
                SRNF_REGISTER_REFUSED > SRNF_REGISTER_STATIONARY &&
                SRNF_REGISTER_STATIONARY > SRNF_REGISTER_TOLERANCE);
}

/* Stiff displacements, so that the best rigid start is gone on from, by a step of each degree. */
static enum srnf_register_stop stop_of_basin(const struct shapes_surface *a,
                                             const struct shapes_surface *b, size_t degree)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct search search;
    struct search_result found;
    enum srnf_register_stop stopped;

    options.degree = degree;
    options.max_steps = 1;
    options.penalty_displacement = 10.0;
    assert_int_equal(search_create(&search, a->sht, a->q, a->f, b->f, &options, NULL, NULL, NULL),
                     SRNF_OK);
    search.rounds = 0;
    search.basin = true;
    assert_int_equal(search_run(&search, &found), SRNF_OK);
    assert_true(found.rigid_energy < 1.01 * found.warp.objective);
    stopped = found.warp.stopped;
    search_result_clear(&found);
    search_clear(&search);
    return stopped;
}

/* A way that is followed to its basin has a reason where fields of that degree are asked for. */
static void a_basin_has_no_reason_of_a_higher_degree(void **state)
{
    struct shapes_surface a, b;
    (void)state;

    assert_true(registrations_open(&a, DEGREE, REGISTRATIONS_LOCAL "L_thalamus.ply"));
    assert_true(registrations_open(&b, DEGREE, REGISTRATIONS_LOCAL "L_caudate.ply"));
    assert_int_equal(stop_of_basin(&a, &b, 8), SRNF_REGISTER_MAX_ITERATIONS);
    assert_int_equal(stop_of_basin(&a, &b, 10), SRNF_REGISTER_DIRECT);
    shapes_close(&a);
    shapes_close(&b);
}

static void both_ways_have_a_reason(void **state)
{
    struct pair *pair = *state;
    struct srnf_register_options options = from_identity();

    options.symmetric = true;
    stops(&pair->a, pair->b.f, &options, SRNF_REGISTER_STATIONARY);
    stops(&pair->a, pair->a.f, &options, SRNF_REGISTER_TOLERANCE);
    options.max_steps = 1;
    stops(&pair->a, pair->b.f, &options, SRNF_REGISTER_MAX_ITERATIONS);
}

/* Every part of a tournament keeps to the degree asked for. */
static void fields_keep_to_their_degree(void **state)
{
    struct pair *pair = *state;
    struct srnf_register_options options = srnf_register_options_defaults();

    for (size_t degree = 1; degree <= 5; degree += 2) {
        struct srnf_registration r;
        size_t highest = 0;

        options.degree = degree;
        registrations_run(&pair->a, NULL, pair->b.f, &options, &r);
        for (size_t i = 0; i < r.warp.n_links; i++) {
            highest = r.warp.links[i].degree > highest ? r.warp.links[i].degree : highest;
        }
        assert_int_equal(highest, degree);
        srnf_registration_clear(&r);
    }
}

static void ambiguity_is_known_where_rotations_were_searched(void **state)
{
    struct pair *pair = *state;
    struct srnf_register_options options = from_identity();
    struct srnf_registration r;

    registrations_run(&pair->a, NULL, pair->b.f, &options, &r);
    assert_false(r.rotations_searched);
    srnf_registration_clear(&r);
    options.start = SRNF_START_RIGID;
    registrations_run(&pair->a, NULL, pair->b.f, &options, &r);
    assert_true(r.rotations_searched);
    /* An ellipsoid of revolution may be turned about its axis. */
    assert_true(r.ambiguity_objective > 0.0 || r.rotational_curvature > 0.0);
    assert_true(fabs(r.truncation_distance / r.truncation_error -
                     sqrt(srnf_inner_product(pair->a.grid, r.q, r.q))) < 1e-12);
    srnf_registration_clear(&r);
}

#define TURN 1e-3 /* radians, away from where a search has ended */
#define REST 1e-5 /* of the energy: what such a turn may gain */

/* The least relative energy of a rotation and those a small turn about each axis away. */
static double energy_nearby(const struct search *s, const double rotation[9])
{
    double least = INFINITY;

    for (size_t k = 0; k < 6; k++) {
        double sine = k % 2 ? -sin(TURN) : sin(TURN);
        double turned[9];
        struct srnf_warp_link link = {SRNF_WARP_ROTATION, 0, turned};
        const struct srnf_warp chain = {1, 1, &link};
        struct search_result result = {.iterations = 0};
        size_t u = (k / 2 + 1) % 3, v = (k / 2 + 2) % 3;

        memcpy(turned, rotation, sizeof turned);
        for (size_t c = 0; c < 3; c++) {
            turned[3 * u + c] = cos(TURN) * rotation[3 * u + c] - sine * rotation[3 * v + c];
            turned[3 * v + c] = sine * rotation[3 * u + c] + cos(TURN) * rotation[3 * v + c];
        }
        assert_int_equal(search_evaluate(s, &chain, &result), SRNF_OK);
        least = compare_min(least, result.warp.energy);
        search_result_clear(&result);
    }
    return least;
}

/* Whether the values turn with the domain or stay as they are. */
static void rigid_searches_end_where_small_turns_gain_nothing(void **state)
{
    static const char *const names[] = {"L_thalamus.ply", "R_pallidum.ply", "L_amygdala.ply"};
    struct shapes_surface surfaces[3];
    (void)state;

    for (size_t k = 0; k < 3; k++) {
        char path[64];

        (void)snprintf(path, sizeof path, REGISTRATIONS_LOCAL "%s", names[k]);
        assert_true(registrations_open(&surfaces[k], DEGREE, path));
    }
    for (size_t k = 0; k < 6; k++) {
        const struct shapes_surface *a = &surfaces[k / 2], *b = &surfaces[(k / 2 + 1) % 3];
        struct srnf_register_options options = srnf_register_options_defaults();
        struct search search;
        struct search_result found;
        double energy;

        options.rotation = k % 2 == 0;
        options.reparameterization = false;
        options.start = SRNF_START_RIGID;
        assert_int_equal(
            search_create(&search, a->sht, a->q, a->f, b->f, &options, NULL, NULL, NULL), SRNF_OK);
        assert_int_equal(search_run(&search, &found), SRNF_OK);
        energy = found.warp.energy;
        printf("# %s, energy %.6f, %s\n", options.rotation ? "both" : "the domain", energy,
               srnf_register_stop_name(found.warp.stopped));
        figure_below("gained",
                     1.0 - energy_nearby(&search, found.warp.chain.links[0].values) / energy, REST);
        search_result_clear(&found);
        search_clear(&search);
    }
    for (size_t k = 0; k < 3; k++) {
        shapes_close(&surfaces[k]);
    }
}

/* A number that is none, at any node, is not passed over. */
static void extremes_keep_what_is_no_number(void **state)
{
    struct pair *pair = *state;
    struct srnf_register_options options = from_identity();
    struct search search;
    struct search_result found;

    assert_int_equal(search_create(&search, pair->a.sht, pair->a.q, pair->a.f, pair->b.f, &options,
                                   NULL, NULL, NULL),
                     SRNF_OK);
    assert_int_equal(search_run(&search, &found), SRNF_OK);
    assert_int_equal(search_extremes(&search, &found), SRNF_OK);
    assert_true(found.min_jacobian > 0.0 && found.min_jacobian < 1.0 && found.max_jacobian > 1.0);
    for (size_t k = 0; k < 3; k++) {
        size_t at = k * (search.full.target.n - 1) / 2;
        double kept = found.warp.jacobian[at];

        found.warp.jacobian[at] = NAN;
        assert_int_equal(search_extremes(&search, &found), SRNF_OK);
        assert_true(isnan(found.min_jacobian) && isnan(found.max_jacobian));
        found.warp.jacobian[at] = kept;
    }
    search_result_clear(&found);
    search_clear(&search);
}

static void a_way_that_folds_is_worse_by_all(void **state)
{
    (void)state;
    assert_true(register_gap(0.2, 0.1) == 0.5 && register_gap(0.1, 0.2) == 0.5);
    assert_true(register_gap(0.0, 0.0) == 0.0 && register_gap(0.3, 0.3) == 0.0);
    assert_true(register_gap(INFINITY, 0.1) == 1.0 && register_gap(0.1, INFINITY) == 1.0);
    assert_true(isnan(register_gap(INFINITY, INFINITY)));
}

static void names(void **state)
{
    static const char *const expected[] = {"direct", "tolerance", "stationary", "stepRefused",
                                           "maxIterations"};
    (void)state;

    for (int k = 0; k < 5; k++) {
        assert_string_equal(srnf_register_stop_name((enum srnf_register_stop)k), expected[k]);
    }
    assert_string_equal(srnf_register_stop_name((enum srnf_register_stop)5), "unknown");
}

/* What is told of the progress of both ways together goes up and stays within 0 to 1. */
struct told {
    double last;
    bool rises;
};

static void tell(void *user, double fraction, const char *message)
{
    struct told *told = user;

    told->rises = told->rises && fraction >= told->last && fraction <= 1.0 && message;
    told->last = compare_max(told->last, fraction);
}

static void progress_of_both_ways_rises(void **state)
{
    struct pair *pair = *state;
    struct srnf_register_options options = srnf_register_options_defaults();
    struct told told = {0.0, true};
    struct srnf_context context = {.user = &told, .progress = tell};
    struct srnf_registration r;

    options.symmetric = true;
    options.degree = 2;
    assert_int_equal(
        srnf_register(pair->a.sht, pair->a.f, NULL, pair->b.f, &options, NULL, &context, &r, NULL),
        SRNF_OK);
    assert_true(told.rises && told.last > 0.45);
    srnf_registration_clear(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(each_reason_appears, open_pair, close_pair),
        cmocka_unit_test_setup_teardown(where_there_is_no_way_down_it_stops_at_once, open_pair,
                                        close_pair),
        cmocka_unit_test_setup_teardown(the_worse_of_both_ways_counts, open_pair, close_pair),
        cmocka_unit_test_setup_teardown(both_ways_have_a_reason, open_pair, close_pair),
        cmocka_unit_test_setup_teardown(fields_keep_to_their_degree, open_pair, close_pair),
        cmocka_unit_test_setup_teardown(ambiguity_is_known_where_rotations_were_searched, open_pair,
                                        close_pair),
        cmocka_unit_test(a_basin_has_no_reason_of_a_higher_degree),
        cmocka_unit_test(the_worse_reason_is_the_later_one),
        cmocka_unit_test(rigid_searches_end_where_small_turns_gain_nothing),
        cmocka_unit_test_setup_teardown(extremes_keep_what_is_no_number, open_pair, close_pair),
        cmocka_unit_test(a_way_that_folds_is_worse_by_all),
        cmocka_unit_test(names),
        cmocka_unit_test_setup_teardown(progress_of_both_ways_rises, open_pair, close_pair),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
