/*
 * test_mean_pullback.c - the mean in the pulled-back metric in place of that of SRNFs: its surface,
 * the distances to it and what it loses, of surfaces as they are parameterized and registered.
 */
#include "group.h"

#define DEGREE 5
#define N ((size_t)3)

struct pulled {
    struct group g;
    double *coefficients; /* [N][3][C] */
    struct srnf_mean mean;
    struct srnf_pullback_mean pullback;
};

static void open_pulled(struct pulled *p)
{
    group_open_stars(&p->g, DEGREE, N, 0.3);
    p->coefficients = shapes_doubles(N * p->g.count);
    for (size_t i = 0; i < N; i++) {
        memcpy(p->coefficients + i * p->g.count, p->g.f[i], p->g.count * sizeof(double));
    }
    assert_int_equal(srnf_karcher_mean(p->g.sht, N, p->g.surfaces, NULL, NULL, &p->mean, NULL),
                     SRNF_OK);
}

static void close_pulled(struct pulled *p)
{
    srnf_pullback_mean_clear(&p->pullback);
    srnf_mean_clear(&p->mean);
    srnf_free(p->coefficients);
    group_close(&p->g);
}

static int pull_back(struct pulled *p, const struct srnf_register_options *registration, size_t n)
{
    struct srnf_pullback_mean_options options =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);

    return srnf_mean_pull_back(p->g.sht, n, p->coefficients, registration, &options, NULL, &p->mean,
                               &p->pullback, NULL);
}

/* ||Q(f) - q||^2 / ||q||^2 from the field itself. */
static double loss(const struct pulled *p)
{
    double *q = shapes_doubles(3 * p->g.points);
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(p->g.sht));
    double d2;

    assert_non_null(workspace);
    srnf_field(p->g.sht, p->mean.coefficients, q, workspace);
    d2 = stats_distance2(p->g.grid, q, p->mean.mean_q);
    srnf_free(workspace);
    srnf_free(q);
    return d2 / srnf_inner_product(p->g.grid, p->mean.mean_q, p->mean.mean_q);
}

static void expect_replaced(const struct pulled *p)
{
    assert_memory_equal(p->mean.coefficients, p->pullback.coefficients,
                        p->g.count * sizeof(double));
    assert_memory_equal(p->mean.distances, p->pullback.distances, N * sizeof(double));
    assert_true(p->mean.relative_energy > 0.0);
    figure_below("loss off that of the field", fabs(p->mean.relative_energy / loss(p) - 1.0), 1e-9);
}

static void replaces_the_mean_of_srnfs(void **state)
{
    struct pulled p;
    double before;

    (void)state;
    open_pulled(&p);
    before = p.mean.relative_energy;
    assert_int_equal(pull_back(&p, NULL, N), SRNF_OK);
    expect_replaced(&p);
    assert_true(p.mean.converged);
    assert_true(p.mean.relative_energy >= before); /* which was the least there is */
    for (size_t i = 0; i < N; i++) {
        assert_memory_equal(p.coefficients + i * p.g.count, p.g.f[i], p.g.count * sizeof(double));
    }
    close_pulled(&p);
}

/* To the surface of the mean SRNF, in place: to the last bit what srnf_register gives. */
static void registers_the_surfaces_first(void **state)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration registration;
    struct pulled p;

    (void)state;
    options.degree = 3;
    options.start = SRNF_START_IDENTITY;
    open_pulled(&p);
    assert_true(srnf_register(p.g.sht, p.mean.coefficients, NULL, p.g.f[1], &options, NULL, NULL,
                              &registration, NULL) >= 0);
    assert_true(pull_back(&p, &options, N) >= 0);
    expect_replaced(&p);
    assert_memory_equal(p.coefficients + p.g.count, registration.coefficients,
                        p.g.count * sizeof(double));
    assert_memory_not_equal(p.coefficients + p.g.count, p.g.f[1], p.g.count * sizeof(double));
    srnf_registration_clear(&registration);
    close_pulled(&p);
}

/* What is refused leaves the mean as it was. */
static void refuses_other_surfaces(void **state)
{
    struct pulled p;
    double *before;

    (void)state;
    open_pulled(&p);
    before = shapes_doubles(p.g.count);
    memcpy(before, p.mean.coefficients, p.g.count * sizeof(double));
    assert_int_equal(pull_back(&p, NULL, N - 1), SRNF_EINVAL);
    assert_int_equal(pull_back(&p, NULL, 0), SRNF_EINVAL);
    assert_null(p.pullback.coefficients);
    assert_memory_equal(p.mean.coefficients, before, p.g.count * sizeof(double));
    srnf_free(before);
    close_pulled(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(replaces_the_mean_of_srnfs),
        cmocka_unit_test(registers_the_surfaces_first),
        cmocka_unit_test(refuses_other_surfaces),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
