/*
 * test_trajectories_recovery.c - slopes and differences of slopes that were planted, found with
 * their size; what weights gain; predicted surfaces; a subject that differs.
 *
 * srnfd-test: no-asan (test_trajectories.c runs its code)
 */
#include "lines.h"

/* ---- Recovery -------------------------------------------------------------------------------- */

/* Displacement along the normal that a growth of the z axis by 1 means, about its centre: [P]. */
static double *truth_of(const struct lines *l)
{
    double *growth = shapes_doubles(l->g.count);
    double *points = shapes_doubles(l->size);
    double *normal = shapes_doubles(l->size);
    double *along = shapes_doubles(l->g.points);
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(l->g.sht));

    assert_non_null(workspace);
    growth[2 * l->g.each + 2] = 1.0;
    srnf_sht_synthesis(l->g.sht, 3, growth, points, workspace);
    srnf_field(l->g.sht, l->mean, normal, workspace);
    for (size_t p = 0; p < l->g.points; p++) {
        double length = 0.0;

        for (size_t c = 0; c < 3; c++) {
            length += normal[c * l->g.points + p] * normal[c * l->g.points + p];
            along[p] += normal[c * l->g.points + p] * points[c * l->g.points + p];
        }
        along[p] /= sqrt(length);
    }
    srnf_free(growth);
    srnf_free(points);
    srnf_free(normal);
    srnf_free(workspace);
    return along;
}

static double correlation(size_t n, const double *a, const double *b)
{
    double ab = 0.0;
    double aa = 0.0;
    double bb = 0.0;

    for (size_t k = 0; k < n; k++) { /* about 0: displacements */
        ab += a[k] * b[k];
        aa += a[k] * a[k];
        bb += b[k] * b[k];
    }
    return ab / sqrt(aa * bb);
}

static double error_of(size_t n, const double *a, double factor, const double *truth)
{
    double off = 0.0;
    double all = 0.0;

    for (size_t k = 0; k < n; k++) {
        double one = a[k] - factor * truth[k];

        off += one * one;
        all += factor * truth[k] * factor * truth[k];
    }
    return sqrt(off / all);
}

static void planted_slopes_are_found(void **state)
{
    const size_t numbers[2] = {8, 32};
    double slope[2] = {0.0, 0.0};
    double difference[2] = {0.0, 0.0};

    (void)state;
    for (size_t k = 0; k < 2; k++) {
        for (uint64_t seed = 0; seed < 6; seed++) {
            const struct lines_plan plan = {numbers[k], false, 0.1, 0.08, 0.02, 0.02, 20 + seed};
            struct lines l;
            struct srnf_trajectories out;
            double *truth;

            lines_open(&l, &plan);
            lines_group(&l);
            truth = truth_of(&l);
            assert_int_equal(lines_fit(&l, 99, 1, NULL, &out), SRNF_OK);
            assert_true(out.slope.p_value <= 0.05);
            slope[k] += error_of(l.g.points, out.slope.normal, 0.14, truth) / 6.0;
            difference[k] += error_of(l.g.points, out.model.normal, 0.08, truth) / 6.0;
            assert_true(k == 0 || correlation(l.g.points, out.slope.normal, truth) > 0.99);
            assert_true(k == 0 || correlation(l.g.points, out.model.normal, truth) > 0.9);
            assert_true(k == 0 || out.model.test_of[0].p_value <= 0.05);
            assert_true(out.slope.change.interval[0] <= out.slope.change.value &&
                        out.slope.change.interval[1] >= out.slope.change.value);
            srnf_free(truth);
            srnf_trajectories_clear(&out);
            lines_close(&l);
        }
    }
    printf("# relative error: slope %.3f with 8 subjects, %.3f with 32; difference %.3f, %.3f\n",
           slope[0], slope[1], difference[0], difference[1]);
    figure_below("ratio of errors of slopes off two", fabs(slope[0] / slope[1] - 2.0), 0.7);
    figure_below("ratio of errors of differences off two",
                 fabs(difference[0] / difference[1] - 2.0), 0.7);
}

/* Slopes that are known worse weigh less, and the mean is nearer to the truth for it. */
static void weights_help(void **state)
{
    double weighted = 0.0;
    double plain = 0.0;

    (void)state;
    for (uint64_t seed = 0; seed < 8; seed++) {
        const struct lines_plan plan = {24, true, 0.1, 0.0, 0.0, 0.03, 40 + seed};
        struct lines l;
        struct srnf_trajectories out;
        double *truth;
        double *mean;

        lines_open(&l, &plan);
        truth = truth_of(&l);
        mean = shapes_doubles(l.g.points);
        assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
        for (size_t k = 0; k < l.n * l.g.points; k++) {
            mean[k % l.g.points] += out.slope.normals[k] / (double)l.n;
        }
        weighted += error_of(l.g.points, out.slope.normal, 0.1, truth);
        plain += error_of(l.g.points, mean, 0.1, truth);
        srnf_free(truth);
        srnf_free(mean);
        srnf_trajectories_clear(&out);
        lines_close(&l);
    }
    printf("# errors: %.3f weighted, %.3f not\n", weighted / 8.0, plain / 8.0);
    figure_below("error with weights, of that without", weighted / plain, 0.9);
}

/* Surfaces of either group at two times: the z axis is where it was planted, and slopes of a group
   lead from one to the other. */
static void predictions_lie_on_lines(void **state)
{
    const struct lines_plan plan = {24, true, 0.1, 0.1, 0.01, 0.01, 60};
    struct lines l;
    struct srnf_trajectories out;
    double worst = 0.0;

    (void)state;
    lines_open(&l, &plan);
    lines_group(&l);
    assert_int_equal(lines_fit(&l, 99, 1, NULL, &out), SRNF_OK);
    for (size_t k = 0; k < 4; k++) {
        const struct srnf_predicted_shape *shape = &out.model.predicted[k];
        double z = shape->coefficients[2 * l.g.each + 2];
        double expected = 1.6 + (l.at[k] > 0.5 ? 0.2 : 0.1) * (l.at_times[k] - 1.0);

        printf("# group %g, time %g: z %.4f for %.4f, lost %.1e\n", l.at[k], l.at_times[k], z,
               expected, shape->relative_energy);
        figure_below("z off that planted", fabs(z - expected), 0.03);
        figure_below("relative energy", shape->relative_energy, 1e-3);
        assert_true(compare_largest(l.g.points, shape->confidence) > 0.0);
        assert_true(compare_largest(l.g.points, out.slope_at[k].confidence) > 0.0);
    }
    for (size_t p = 0; p < l.g.points; p++) { /* columns: group; the constant has no map */
        double one = out.slope_at[2].normal[p] - out.slope_at[0].normal[p];

        worst = compare_max(worst, fabs(one - out.model.normal[p]));
    }
    figure_below("difference of the groups' slopes off the coefficient", worst, 1e-12);
    assert_memory_equal(out.slope_at[0].normal, out.slope_at[1].normal,
                        l.g.points * sizeof(double));
    srnf_trajectories_clear(&out);
    lines_close(&l);
}

/* A subject that grows five times as fast is the oddest and the fastest. */
static void a_fast_subject_is_odd(void **state)
{
    const struct lines_plan plan = {15, false, 0.1, 0.0, 0.01, 0.005, 70};
    struct lines l;
    struct srnf_trajectories out;
    void *workspace;

    (void)state;
    lines_open(&l, &plan);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(l.g.sht));
    assert_non_null(workspace);
    for (size_t visit = 0; visit < 3; visit++) { /* subject 4 */
        l.g.f[12 + visit][2 * l.g.each + 2] += 0.4 * ((double)visit - 1.0);
        srnf_field(l.g.sht, l.g.f[12 + visit], l.q + (12 + visit) * l.size, workspace);
    }
    assert_int_equal(lines_fit(&l, 9, 1, NULL, &out), SRNF_OK);
    for (size_t i = 0; i < 15; i++) {
        assert_true(i == 4 || out.subject[i].odd.value < out.subject[4].odd.value);
        assert_true(i == 4 || out.subject[i].speed < out.subject[4].speed);
    }
    figure_below("percentile off the highest of 15",
                 fabs(out.subject[4].odd.percentile - 100.0 * 14.5 / 15.0), 1e-9);
    figure_below("speed off five", fabs(out.subject[4].speed - 5.0), 0.7);
    figure_below("deviation off what it grows more, relative",
                 fabs(out.slope.deviation[4] / (0.4 * out.slope.change.value / 0.1268) - 1.0),
                 0.25);
    srnf_free(workspace);
    srnf_trajectories_clear(&out);
    lines_close(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planted_slopes_are_found),
        cmocka_unit_test(weights_help),
        cmocka_unit_test(predictions_lie_on_lines),
        cmocka_unit_test(a_fast_subject_is_odd),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
