/*
 * test_stats_allocation.c - distances, mean, principal components, the quality of a model, what its
 * members are judged by, and the comparison of groups when memory runs out: each allocation in turn
 * is refused; the call fails cleanly and nothing leaks.
 * srnfd-test: slow
 */
#include "group.h"
#include "support/refusing.h"

#define N ((size_t)3)
#define COMPARED ((size_t)6)
#define VISITS ((size_t)10)
#define DEGREE 5
#define EACH ((size_t)60) /* refused one by one, before strides; make faults refuses all */

/* What the runs work on. */
static struct group g;
static double *fields;                 /* [N + 1][3][P]: the mean and N fields */
static double *visited;                /* [VISITS + 1][3][P]: the same */
static double *compared;               /* [COMPARED][3][P]: the N fields again and again */
static struct srnf_pca model;          /* of the N fields */
static struct srnf_pca repeated_model; /* of all that are compared */
static struct srnf_register_options registration;

static int run_distances(void)
{
    double matrix[N * N];

    return srnf_distances(g.sht, N, g.surfaces, NULL, NULL, matrix, NULL);
}

static int run_registered_distance(void)
{
    double matrix[4];

    return srnf_distances(g.sht, 2, g.surfaces, &registration, NULL, matrix, NULL);
}

static int run_neighbours(void)
{
    struct srnf_neighbours neighbours;
    int status =
        srnf_nearest_neighbours(g.sht, 2, g.surfaces, 1, &registration, NULL, &neighbours, NULL);

    if (status >= 0) {
        srnf_neighbours_clear(&neighbours);
    }
    assert_null(neighbours.indices);
    return status;
}

static int measure_nothing(void *user, const struct srnf_pair_search *pairs,
                           struct srnf_error *error)
{
    (void)user;
    (void)error;
    memset(pairs->distances, 0, pairs->count * sizeof(double));
    return SRNF_OK;
}

static int run_neighbours_elsewhere(void)
{
    const struct srnf_context context = {.measure = measure_nothing};
    struct srnf_neighbours neighbours;
    int status = srnf_nearest_neighbours(g.sht, 2, g.surfaces, 1, &registration, &context,
                                         &neighbours, NULL);

    if (status >= 0) {
        srnf_neighbours_clear(&neighbours);
    }
    assert_null(neighbours.indices);
    return status;
}

static void ignore(void *user, const void *bytes, size_t size)
{
    (void)user;
    (void)bytes;
    (void)size;
}

/* Scratch in memory. */
static unsigned char scratch_bytes[(size_t)2 << 20];

static int write_scratch(void *user, uint64_t offset, const void *bytes, size_t size)
{
    (void)user;
    assert_true(offset + size <= sizeof scratch_bytes);
    memcpy(scratch_bytes + offset, bytes, size);
    return SRNF_OK;
}

static int read_scratch(void *user, uint64_t offset, void *bytes, size_t size)
{
    (void)user;
    memcpy(bytes, scratch_bytes + offset, size);
    return SRNF_OK;
}

static const struct srnf_scratch scratch = {.write = write_scratch, .read = read_scratch};

static int run_mean_with(const struct srnf_register_options *options, size_t iterations,
                         size_t held_bytes)
{
    struct srnf_mean_options mean_options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    int status;

    mean_options.registration = options;
    mean_options.max_iterations = iterations;
    mean_options.tolerance = 0.0;
    mean_options.checkpoint = ignore;
    mean_options.scratch = held_bytes < SIZE_MAX ? &scratch : NULL;
    mean_options.held_bytes = held_bytes;
    status = srnf_karcher_mean(g.sht, 2, g.surfaces, &mean_options, NULL, &mean, NULL);
    if (status >= 0) {
        srnf_mean_clear(&mean);
    }
    assert_null(mean.mean_q);
    return status;
}

static int run_mean(void)
{
    return run_mean_with(NULL, 1, SIZE_MAX);
}

static int run_registered_mean(void)
{
    return run_mean_with(&registration, 2, SIZE_MAX);
}

/* Two landmarks that guide, and one that does not. */
static int run_guided_mean(void)
{
    static const double points[] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0.8, 0.6, 0, 0, 1, 0, 0.6, 0, 0.8};
    static const struct srnf_group_landmarks landmarks = {3, 2, points, 1.0};
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;
    int status;

    options.registration = &registration;
    options.max_iterations = 2;
    options.tolerance = 0.0;
    options.landmarks = &landmarks;
    options.checkpoint = ignore;
    status = srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, NULL);
    if (status >= 0) {
        srnf_mean_clear(&mean);
    }
    assert_null(mean.landmarks);
    return status;
}

static int run_spilled_mean(void)
{
    return run_mean_with(&registration, 2, 0);
}

/* In the pulled-back metric, of registered surfaces: the mean of SRNFs comes before it. */
static int run_pulled_mean(void)
{
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_pullback_mean_options pulled =
        srnf_pullback_mean_defaults(SRNF_PULLBACK_MEAN_GRAPH);
    struct srnf_pullback_mean pullback = {0};
    double *coefficients = malloc(2 * g.count * sizeof(double));
    struct srnf_mean mean = {0};
    int status;

    assert_non_null(coefficients);
    for (size_t i = 0; i < 2; i++) {
        memcpy(coefficients + i * g.count, g.f[i], g.count * sizeof(double));
    }
    options.registration = NULL;
    options.max_iterations = 1;
    pulled.max_iterations = 1;
    status = srnf_karcher_mean(g.sht, 2, g.surfaces, &options, NULL, &mean, NULL);
    if (status >= 0) {
        status = srnf_mean_pull_back(g.sht, 2, coefficients, &registration, &pulled, NULL, &mean,
                                     &pullback, NULL);
    }
    srnf_pullback_mean_clear(&pullback);
    srnf_mean_clear(&mean);
    free(coefficients);
    return status;
}

static int run_residuals(void)
{
    double residuals[N];

    return srnf_pca_residuals(g.grid, &model, fields, N, fields + 3 * g.points, residuals);
}

static int run_pca(void)
{
    struct srnf_pca pca;
    int status = srnf_pca_fit_within(g.grid, N, fields, fields + 3 * g.points, 0, NULL, &pca);

    if (status >= 0) {
        srnf_pca_clear(&pca);
    }
    assert_null(pca.modes);
    return status;
}

static int run_pca_largest(void)
{
    double bounds[2];
    struct srnf_pca pca;
    int status =
        srnf_pca_fit_largest(g.grid, N, fields, fields + 3 * g.points, 2, NULL, &pca, bounds);

    if (status >= 0) {
        srnf_pca_clear(&pca);
    }
    assert_null(pca.modes);
    return status;
}

static int run_quality(void)
{
    struct srnf_quality_options options = srnf_quality_options_defaults();
    struct srnf_quality quality = {0};
    int status;

    options.samples = 2;
    status = srnf_model_quality(g.sht, N, g.f[0], fields, fields + 3 * g.points, &options, NULL,
                                &quality, NULL);
    assert_true((status < 0) == (quality.specificity.value == NULL));
    srnf_quality_clear(&quality);
    return status;
}

static int run_comparison(void)
{
    static const int group[COMPARED] = {0, 1, 0, 1, 1, 0};
    double covariate[COMPARED] = {1.0, 2.0, 4.0, 3.0, 7.0, 6.0};
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct srnf_comparison comparison = {0};
    int status;

    options.permutations = 40;
    status = srnf_compare_groups(g.sht, COMPARED, g.f[0], compared, group, 1, covariate, &options,
                                 NULL, &comparison, NULL);
    assert_true((status < 0) == (comparison.statistic == NULL));
    srnf_comparison_clear(&comparison);
    return status;
}

static int run_regression(void)
{
    static const double ages[COMPARED] = {1.0, 2.0, 4.0, 3.0, 7.0, 6.0};
    static const size_t subjects[COMPARED] = {0, 1, 2, 3, 4, 5};
    const struct srnf_nested nested = {.tested = 1, .columns = ages};
    const struct srnf_regress_design design = {
        .columns = 1, .values = ages, .tests = 1, .nested = &nested, .points = 1, .at = ages};
    struct srnf_regress_options options = srnf_regress_options_defaults();
    struct srnf_regression regression = {0};
    int status;

    options.permutations = 20;
    options.bootstraps = 100;
    options.subjects = subjects;
    status =
        srnf_regress(g.sht, COMPARED, g.f[0], compared, &design, &options, NULL, &regression, NULL);
    assert_true((status < 0) == (regression.test_of == NULL));
    srnf_regression_clear(&regression);
    return status;
}

static int run_score(void)
{
    static const double ages[COMPARED] = {1.0, 2.0, 4.0, 3.0, 7.0, 6.0};
    const struct srnf_norm_model norm = {.pca = &repeated_model,
                                         .mean = g.f[0],
                                         .mean_q = fields,
                                         .complete = true,
                                         .columns = 1,
                                         .values = ages};
    struct srnf_norm_options options = srnf_norm_options_defaults();
    struct srnf_score score = {0};
    int status;

    options.at = ages;
    status = srnf_score(g.sht, &norm, compared, &options, NULL, &score, NULL);
    assert_true((status < 0) == (score.z == NULL));
    srnf_score_clear(&score);
    return status;
}

static int run_map(void)
{
    const struct srnf_norm_model norm = {
        .pca = &repeated_model, .mean = g.f[0], .mean_q = fields, .complete = true};
    struct srnf_score score = {0};
    int status = srnf_norm_map(g.sht, &norm, compared, NULL, NULL, &score, NULL);

    assert_true((status < 0) == (score.z == NULL));
    srnf_score_clear(&score);
    return status;
}

static int run_pairs(void)
{
    static const double sizes[5] = {1.0, 1.0, 1.0, 1.0, 1.0};
    const struct srnf_pairs pairs = {.n = 5,
                                     .mean = g.f[0],
                                     .first_q = compared,
                                     .second_q = compared + 3 * g.points,
                                     .first_size = sizes,
                                     .second_size = sizes};
    struct srnf_paired_options options = srnf_paired_options_defaults();
    struct srnf_paired paired = {0};
    int status;

    options.permutations = 20;
    options.bootstraps = 100;
    status = srnf_paired_differences(g.sht, &pairs, &options, NULL, &paired, NULL);
    assert_true((status < 0) == (paired.statistic == NULL));
    srnf_paired_clear(&paired);
    return status;
}

static int run_measurements(void)
{
    static const double sizes[11] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    static const size_t subjects[11] = {0, 0, 2, 2, 4, 4, 6, 6, 8, 8, 8};
    static const int side[11] = {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 1};
    const struct srnf_measurements given = {11, visited, sizes, subjects, side};
    struct srnf_paired_options options = srnf_paired_options_defaults();
    struct srnf_asymmetry_test found = {.p_value = 2.0};
    int status;

    options.permutations = 20;
    options.bootstraps = 100;
    status = srnf_test_asymmetry(g.sht, &given, &options, NULL, &found, NULL);
    assert_true((status < 0) == (found.p_value > 1.0));
    return status;
}

static int run_trajectories(void)
{
    static const double sizes[10] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    static const double times[10] = {0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0};
    static const size_t subjects[10] = {0, 0, 2, 2, 4, 4, 6, 6, 8, 8};
    static const double column[10] = {0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0};
    static const double at[1] = {1.0};
    const struct srnf_nested nested = {0, 1, NULL, column};
    const struct srnf_regress_design design = {1, column, 1, &nested, 1, at};
    const struct srnf_visits visits = {.n = VISITS,
                                       .mean = g.f[0],
                                       .q = visited,
                                       .sizes = sizes,
                                       .times = times,
                                       .subjects = subjects,
                                       .at_times = at};
    struct srnf_trajectories_options options = srnf_trajectories_options_defaults();
    struct srnf_trajectories trajectories = {0};
    int status;

    options.permutations = 20;
    options.bootstraps = 100;
    status = srnf_fit_trajectories(g.sht, &visits, &design, &options, NULL, &trajectories, NULL);
    assert_true((status < 0) == (trajectories.subject == NULL));
    srnf_trajectories_clear(&trajectories);
    return status;
}

static int run_ranks(void)
{
    static const double values[4] = {1.0, 2.0, 4.0, 3.0};
    struct srnf_norm_rank rank;
    double distance;
    double p;
    int status = srnf_norm_rank_together(2, 2, values, NULL, values, &rank);

    return status ? status : srnf_norm_uniform(4, values, &distance, &p);
}

static int run_interval(void)
{
    static const size_t subjects[4] = {1, 1, 0, 3};
    static const bool success[4] = {true, false, true, true};
    double interval[2];
    double effective;

    return srnf_cluster_interval(4, subjects, success, &effective, interval, NULL);
}

static int run_repeated_comparison(void)
{
    static const int group[COMPARED] = {0, 1, 0, 1, 1, 0};
    static const size_t subjects[COMPARED] = {0, 1, 2, 3, 4, 0};
    const double *const near[COMPARED] = {g.f[0], g.f[1], g.f[2], g.f[0], g.f[1], g.f[2]};
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct srnf_comparison comparison = {0};
    int status;

    options.subjects = subjects; /* five have 10 divisions, which are all taken */
    options.surfaces = near;
    status = srnf_compare_groups(g.sht, COMPARED, g.f[0], compared, group, 0, NULL, &options, NULL,
                                 &comparison, NULL);
    assert_true((status < 0) == (comparison.statistic == NULL));
    srnf_comparison_clear(&comparison);
    return status;
}

static int run_twins_distances(void)
{
    double pairs[N * N];

    return srnf_twins_distances(g.grid, N, fields + 3 * g.points, pairs);
}

static int run_twins(void)
{
    static const double pairs[N * N] = {0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0, 1.0, 0.0};
    struct srnf_twins twins;

    return srnf_twins_find(N, pairs, NULL, NULL, &twins);
}

static int run_members(void)
{
    static const double pairs[16] = {0, 1, 2, 3, 1, 0, 1, 2, 2, 1, 0, 1, 3, 2, 1, 0};
    struct srnf_typicality verdicts[4];

    return srnf_members_judge(4, pairs, verdicts);
}

static int run_covariates(void)
{
    static const double values[N] = {1.0, 2.0, 4.0};
    enum srnf_covariate verdict;

    return srnf_covariates_check(1, N, values, &verdict);
}

static int run_inflation(void)
{
    static const double values[N] = {1.0, 2.0, 4.0};
    static const size_t subjects[N] = {0, 1, 2};
    static const int group[N] = {0, 0, 1};
    double inflation;
    size_t closest;

    return srnf_covariates_inflation(N, subjects, group, 1, values, &inflation, &closest);
}

static int run_term_inflation(void)
{
    static const double values[2 * N] = {1.0, 2.0, 4.0, 1.0, 0.0, 3.0};
    static const size_t subjects[N] = {0, 1, 2};
    static const enum srnf_column roles[2] = {SRNF_COLUMN_OF_TERM, SRNF_COLUMN_BESIDE};
    double inflation;

    return srnf_term_inflation(N, subjects, 2, values, roles, &inflation);
}

static int run_calibration(void)
{
    struct srnf_calibration calibration = {0};
    int status =
        srnf_calibrate(g.grid, &model, fields, fields + 3 * g.points, NULL, NULL, &calibration);

    assert_true((status < 0) == (calibration.values == NULL));
    srnf_calibration_clear(&calibration);
    return status;
}

static int run_repeated_calibration(void)
{
    static const size_t subjects[COMPARED] = {0, 1, 2, 3, 1, 2};
    struct srnf_calibration calibration = {0};
    int status =
        srnf_calibrate(g.grid, &repeated_model, fields, compared, subjects, NULL, &calibration);

    assert_true((status < 0) == (calibration.values == NULL));
    srnf_calibration_clear(&calibration);
    return status;
}

static int run_pose(void)
{
    double angles[N];

    return srnf_pose_angles(g.grid, N, fields + 3 * g.points, NULL, angles);
}

static int run_typicality(void)
{
    const double values[N] = {1.0, 2.0, 3.0};
    struct srnf_typicality typicality;

    return srnf_typicality_of(SRNF_TRAIT_DISTANCE, N, values, NULL, 2.0, 0.01, &typicality);
}

static int run_folds_typicality(void)
{
    double distances[16] = {0, 1, 2, 3, 1, 0, 2, 3, 2, 2, 0, 1, 3, 3, 1, 0};
    const struct srnf_folds folds = {.n = 4, .distances = distances};
    struct srnf_folds_typicality typicality = {0};
    int status = srnf_folds_typicality(&folds, 0.01, &typicality);

    assert_true((status < 0) == (typicality.verdicts == NULL));
    srnf_folds_typicality_clear(&typicality);
    return status;
}

static void distances_survive(void **state)
{
    (void)state;
    refusing_sweep("distances", run_distances, EACH, 1);
    refusing_sweep("a registered distance", run_registered_distance, EACH, 11);
    refusing_sweep("nearest neighbours", run_neighbours, FIGURES_SLOW ? 20 : 60, 29);
    refusing_sweep("nearest neighbours, measured elsewhere", run_neighbours_elsewhere, EACH, 29);
}

static void mean_survives(void **state)
{
    (void)state;
    refusing_sweep("mean", run_mean, EACH, 1);
    refusing_sweep("registered mean", run_registered_mean, EACH, 7);
    refusing_sweep("mean guided by landmarks", run_guided_mean, EACH, 29);
    refusing_sweep("mean with its warps in scratch", run_spilled_mean, EACH, 13);
    refusing_sweep("mean in the pulled-back metric", run_pulled_mean, EACH / 4, 7);
}

static void components_survive(void **state)
{
    (void)state;
    refusing_sweep("principal components", run_pca, EACH, 1);
    refusing_sweep("the largest components", run_pca_largest, EACH, 1);
}

static void typicality_survives(void **state)
{
    (void)state;
    assert_int_equal(srnf_pca_fit(g.grid, N, fields, fields + 3 * g.points, 0, &model), SRNF_OK);
    refusing_sweep("residuals of a model", run_residuals, EACH, 1);
    refusing_sweep("leave-one-out values", run_calibration, EACH, 1);
    assert_int_equal(srnf_pca_fit(g.grid, COMPARED, fields, compared, 0, &repeated_model), SRNF_OK);
    refusing_sweep("leave-one-out values of repeated subjects", run_repeated_calibration, EACH, 1);
    refusing_sweep("a surface beside the norm", run_score, EACH, 3);
    refusing_sweep("the map of a part", run_map, EACH, 3);
    refusing_sweep("ranks and their uniformity", run_ranks, 2, 1);
    srnf_pca_clear(&repeated_model);
    refusing_sweep("distances of registered members", run_twins_distances, EACH, 1);
    refusing_sweep("members that repeat", run_twins, EACH, 1);
    refusing_sweep("members that stand out", run_members, EACH, 1);
    refusing_sweep("covariates that follow", run_covariates, EACH, 1);
    refusing_sweep("covariates that tell the groups", run_inflation, EACH, 1);
    refusing_sweep("columns that tell a term", run_term_inflation, EACH, 1);
    refusing_sweep("pose angles", run_pose, EACH, 1);
    refusing_sweep("a value among others", run_typicality, EACH, 1);
    refusing_sweep("members among others", run_folds_typicality, EACH, 1);
    srnf_pca_clear(&model);
}

static void judging_survives(void **state)
{
    (void)state;
    refusing_sweep("quality of a model", run_quality, EACH, 3);
    refusing_sweep("comparison of groups", run_comparison, EACH, 3);
    refusing_sweep("interval of a proportion", run_interval, 4, 1);
    refusing_sweep("linear model", run_regression, EACH, 3);
    refusing_sweep("differences within subjects", run_pairs, EACH, 3);
    refusing_sweep("trajectories", run_trajectories, EACH, 3);
    refusing_sweep("repeated measurements", run_measurements, EACH, 3);
    refusing_sweep("comparison with a subject twice", run_repeated_comparison, EACH, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_survive),  cmocka_unit_test(mean_survives),
        cmocka_unit_test(components_survive), cmocka_unit_test(typicality_survives),
        cmocka_unit_test(judging_survives),
    };
    void *workspace;
    int failed;

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    group_open_stars(&g, DEGREE, N, 0.3);
    fields = shapes_doubles((N + 1) * 3 * g.points);
    workspace = shapes_doubles(srnf_surface_workspace_size(g.sht) / sizeof(double) + 1);
    for (size_t i = 0; i < N; i++) {
        srnf_field(g.sht, g.f[i], fields + (i + 1) * 3 * g.points, workspace);
    }
    stats_average(g.grid, N, fields + 3 * g.points, fields);
    compared = shapes_doubles(COMPARED * 3 * g.points);
    for (size_t i = 0; i < COMPARED; i++) {
        memcpy(compared + i * 3 * g.points, fields + (1 + i % N) * 3 * g.points,
               3 * g.points * sizeof(double));
    }
    visited = shapes_doubles((VISITS + 1) * 3 * g.points);
    for (size_t i = 0; i <= VISITS; i++) {
        memcpy(visited + i * 3 * g.points, fields + (1 + i * i % N) * 3 * g.points,
               3 * g.points * sizeof(double));
    }
    registration = srnf_register_options_defaults();
    registration.degree = 2;
    registration.common_pose = true;
    failed = cmocka_run_group_tests(tests, NULL, NULL);
    srnf_free(workspace);
    srnf_free(compared);
    srnf_free(visited);
    srnf_free(fields);
    group_close(&g);
    return failed;
}
