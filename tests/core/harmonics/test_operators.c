/*
 * test_operators.c - the five transforms as linear operators: adjoint pairs, batches,
 * workspace. For threads see test_threads.c.
 *
 * Equality here is of bits where the library promises determinism: the result of a field depends on
 * neither its neighbours in the batch, nor what the workspace held before.
 *
 * srnfd-test: no-asan (api/test_standard.sh and core/stats/test_classify.c run its code)
 */
#include "fixture.h"
#include "operators.h"

#include "harmonics/harmonics.h"

#define BATCH_MAX ((size_t)7)
#define ADJOINT_TOLERANCE 1e-13

static void assert_same_bits(size_t n, const double *a, const double *b)
{
    assert_memory_equal(a, b, n * sizeof(double));
}

static void assert_same_arrays(const struct fixture *f, size_t batch, const struct arrays *a,
                               const struct arrays *b)
{
    assert_same_bits(batch * f->coefficients, a->coefficients, b->coefficients);
    assert_same_bits(batch * f->points, a->first, b->first);
    assert_same_bits(batch * f->points, a->second, b->second);
}

/* <A x, y> - <x, A' y>, relative to |A x| |y|. */
static double adjoint_defect(const struct transform *forward, const struct transform *adjoint,
                             const struct fixture *f, struct test_random *random)
{
    struct arrays x = arrays_create(f, 1);
    struct arrays y = arrays_create(f, 1);
    size_t n = f->points;
    double left;
    double right;
    double scale;

    arrays_fill(forward, f, 1, random, &x);
    arrays_fill(adjoint, f, 1, random, &y);
    forward->apply(f, 1, &x, f->workspace);
    adjoint->apply(f, 1, &y, f->workspace);
    left = fixture_dot(n, x.first, y.first);
    scale = sqrt(fixture_dot(n, x.first, x.first) * fixture_dot(n, y.first, y.first));
    if (forward->derivatives) {
        left += fixture_dot(n, x.second, y.second);
        scale = sqrt((fixture_dot(n, x.first, x.first) + fixture_dot(n, x.second, x.second)) *
                     (fixture_dot(n, y.first, y.first) + fixture_dot(n, y.second, y.second)));
    }
    right = fixture_dot(f->coefficients, x.coefficients, y.coefficients);
    arrays_free(&x);
    arrays_free(&y);
    return fabs(left - right) / scale;
}

static void adjoints_are_transposes(void **state)
{
    struct test_random random = test_random_seed(11);

    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        for (size_t degree = 1; degree <= SRNF_DEGREE_MAX; degree += degree < 16 ? 1 : 37) {
            struct fixture f;

            fixture_open(&f, degree, &grid_shapes[s]);
            for (size_t repetition = 0; repetition < 3; repetition++) {
                assert_at_most(adjoint_defect(&operators[0], &operators[1], &f, &random),
                               ADJOINT_TOLERANCE);
                assert_at_most(adjoint_defect(&operators[3], &operators[4], &f, &random),
                               ADJOINT_TOLERANCE);
            }
            fixture_close(&f);
        }
    }
}

/* Every entry of the matrix, not a random combination: A' is A transposed, element by element. */
static void adjoints_are_transposes_entry_by_entry(void **state)
{
    const size_t degree = 5;

    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        struct fixture f;
        struct arrays x;
        struct arrays y;

        fixture_open(&f, degree, &grid_shapes[s]);
        x = arrays_create(&f, 1);
        y = arrays_create(&f, 1);
        for (size_t node = 0; node < f.points; node++) {
            memset(y.first, 0, f.points * sizeof(double));
            memset(y.second, 0, f.points * sizeof(double));
            y.first[node] = 1.0;
            gradient_adjoint(&f, 1, &y, f.workspace);
            for (size_t i = 0; i < f.coefficients; i++) {
                memset(x.coefficients, 0, f.coefficients * sizeof(double));
                x.coefficients[i] = 1.0;
                gradient(&f, 1, &x, f.workspace);
                assert_at_most(fabs(x.first[node] - y.coefficients[i]), 1e-14);
            }
        }
        arrays_free(&x);
        arrays_free(&y);
        fixture_close(&f);
    }
}

/* analysis = synthesis_adjoint after the weights. */
static void analysis_is_the_weighted_adjoint(void **state)
{
    struct test_random random = test_random_seed(12);

    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        struct fixture f;
        struct arrays a;
        struct arrays b;

        fixture_open(&f, 21, &grid_shapes[s]);
        a = arrays_create(&f, 1);
        b = arrays_create(&f, 1);
        arrays_fill(&operators[2], &f, 1, &random, &a);
        analysis(&f, 1, &a, f.workspace);
        for (size_t i = 0; i < f.points; i++) {
            b.first[i] = a.first[i] * f.grid->weight[i / f.grid->n_phi];
        }
        synthesis_adjoint(&f, 1, &b, f.workspace);
        assert_at_most(compare_relative(f.coefficients, a.coefficients, b.coefficients), 1e-14);
        arrays_free(&a);
        arrays_free(&b);
        fixture_close(&f);
    }
}

static void assert_same_input(const struct transform *op, const struct fixture *f, size_t batch,
                              const struct arrays *a, const struct arrays *b)
{
    if (!op->from_fields) {
        assert_same_bits(batch * f->coefficients, a->coefficients, b->coefficients);
        return;
    }
    assert_same_bits(batch * f->points, a->first, b->first);
    if (op->derivatives) {
        assert_same_bits(batch * f->points, a->second, b->second);
    }
}

/* One operator on one grid, all batches: field by field the same bits, the inputs unchanged. */
static void check_batches(const struct transform *op, const struct fixture *f,
                          struct test_random *random)
{
    struct arrays whole = arrays_create(f, BATCH_MAX);
    struct arrays parts = arrays_create(f, BATCH_MAX);
    struct arrays before = arrays_create(f, BATCH_MAX);

    for (size_t batch = 1; batch <= BATCH_MAX; batch++) {
        arrays_fill(op, f, batch, random, &whole);
        arrays_copy_input(op, f, batch, &whole, &parts);
        arrays_copy_input(op, f, batch, &whole, &before);
        op->apply(f, batch, &whole, f->workspace);
        assert_same_input(op, f, batch, &whole, &before);
        for (size_t i = 0; i < batch; i++) {
            struct arrays one = {parts.coefficients + i * f->coefficients,
                                 parts.first + i * f->points, parts.second + i * f->points};

            op->apply(f, 1, &one, f->workspace);
        }
        assert_same_arrays(f, batch, &whole, &parts);
    }
    arrays_free(&whole);
    arrays_free(&parts);
    arrays_free(&before);
}

static void a_batch_equals_its_fields_one_by_one(void **state)
{
    static const size_t degrees[] = {1, 4, 15, 30, 63};
    struct test_random random = test_random_seed(13);

    (void)state;
    for (size_t s = 0; s < GRID_SHAPES; s++) {
        for (size_t d = 0; d < sizeof degrees / sizeof degrees[0]; d++) {
            struct fixture f;

            fixture_open(&f, degrees[d], &grid_shapes[s]);
            assert_true(srnf_sht_workspace_size(f.sht, 1) <= f.workspace_size);
            for (size_t o = 0; o < OPERATORS; o++) {
                check_batches(&operators[o], &f, &random);
            }
            fixture_close(&f);
        }
    }
}

static void an_empty_batch_touches_nothing(void **state)
{
    const struct arrays none = {NULL, NULL, NULL};
    struct fixture f;

    (void)state;
    fixture_open(&f, 4, &grid_shapes[0]);
    for (size_t o = 0; o < OPERATORS; o++) {
        operators[o].apply(&f, 0, &none, f.workspace);
    }
    for (size_t i = 0; i < f.workspace_size; i++) {
        assert_int_equal(f.workspace[i], 0xff);
    }
    fixture_close(&f);
}

/* Two transforms of the same shape are interchangeable, to the bit: plans do not depend on
   measurements. */
static void equal_transforms_give_equal_bits(void **state)
{
    struct test_random random = test_random_seed(14);
    struct fixture f[2];

    (void)state;
    for (size_t i = 0; i < 2; i++) {
        fixture_open(&f[i], 31, &grid_shapes[0]);
    }
    memset(f[1].workspace, 0x40, f[1].workspace_size); /* other remains, too */
    for (size_t o = 0; o < OPERATORS; o++) {
        struct arrays a = arrays_create(&f[0], 3);
        struct arrays b = arrays_create(&f[0], 3);

        arrays_fill(&operators[o], &f[0], 3, &random, &a);
        arrays_copy_input(&operators[o], &f[0], 3, &a, &b);
        operators[o].apply(&f[0], 3, &a, f[0].workspace);
        operators[o].apply(&f[1], 3, &b, f[1].workspace);
        assert_same_arrays(&f[0], 3, &a, &b);
        arrays_free(&a);
        arrays_free(&b);
    }
    fixture_close(&f[0]);
    fixture_close(&f[1]);
}

/* The least grid is that of a transform with plans and a workspace of its own, to the bit. It works
   in the workspace of the one that it was made of, which the strip of the fixture guards. */
static void the_least_grid_is_like_any_other(void **state)
{
    struct test_random random = test_random_seed(15);

    (void)state;
    for (size_t shape = 0; shape < GRID_SHAPES; shape++) {
        for (size_t degree = 1; degree <= 31; degree += 5) {
            struct fixture f;
            struct fixture own;
            struct fixture least;

            fixture_open(&f, degree, &grid_shapes[shape]);
            least = f;
            assert_int_equal(sphere_sht_least(&least.sht, f.sht), SRNF_OK);
            least.grid = srnf_sht_grid(least.sht);
            least.points = least.grid->n_theta * least.grid->n_phi;
            assert_true(least.points <= f.points && least.grid->n_theta == degree + 1);
            assert_true(least.grid->n_phi <= 2 * degree + 2 + (degree + 1) / 2);
            fixture_open(&own, degree,
                         &(struct grid_shape){.kind = SRNF_GRID_GAUSS_LEGENDRE,
                                              .rows_constant = degree + 1,
                                              .columns_constant = least.grid->n_phi});
            for (size_t o = 0; o < OPERATORS; o++) {
                struct arrays a = arrays_create(&own, 3);
                struct arrays b = arrays_create(&own, 3);

                arrays_fill(&operators[o], &own, 3, &random, &a);
                arrays_copy_input(&operators[o], &own, 3, &a, &b);
                operators[o].apply(&own, 3, &a, own.workspace);
                operators[o].apply(&least, 3, &b, f.workspace);
                assert_same_arrays(&own, 3, &a, &b);
                arrays_free(&a);
                arrays_free(&b);
            }
            srnf_sht_destroy(least.sht);
            fixture_close(&own);
            fixture_close(&f);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(adjoints_are_transposes),
        cmocka_unit_test(adjoints_are_transposes_entry_by_entry),
        cmocka_unit_test(analysis_is_the_weighted_adjoint),
        cmocka_unit_test(a_batch_equals_its_fields_one_by_one),
        cmocka_unit_test(an_empty_batch_touches_nothing),
        cmocka_unit_test(equal_transforms_give_equal_bits),
        cmocka_unit_test(the_least_grid_is_like_any_other),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
