/*
 * test_parts.c - joint components of several parts: one part is the ordinary analysis to the last
 * bit; variation that two parts share is found, and told apart from what each has alone; weights
 * scale as stated; scores give the fields back; positions count; nonsense is refused.
 */
#include "core/figures.h"
#include "support/refusing.h"

#define DEGREE 6
#define SUBJECTS 24

/* Fields of subjects about a mean, of the size of one part. */
struct fields {
    struct shapes_surface s;
    size_t size;
    double *mean, *q; /* [size], [SUBJECTS][size] */
};

static void fields_open(struct fields *f)
{
    shapes_open(&f->s, DEGREE);
    shapes_fill(&f->s, shapes_bumpy, 0.0);
    f->size = 3 * f->s.points;
    f->mean = shapes_doubles(f->size);
    f->q = shapes_doubles(SUBJECTS * f->size);
    memcpy(f->mean, f->s.q, f->size * sizeof(double));
}

static void fields_close(struct fields *f)
{
    srnf_free(f->mean);
    srnf_free(f->q);
    shapes_close(&f->s);
}

/* A random field of norm 1. */
static void random_direction(struct test_random *random, const struct fields *f, double *out)
{
    double norm;

    for (size_t m = 0; m < f->size; m++) {
        out[m] = test_random_normal(random);
    }
    norm = sqrt(srnf_inner_product(f->s.grid, out, out));
    for (size_t m = 0; m < f->size; m++) {
        out[m] /= norm;
    }
}

/* q_i = mean + a_i direction, and noise of that norm in random directions; the mean of q is taken
   as their mean. */
static void plant(struct test_random *random, struct fields *f, const double *a,
                  const double *direction, double noise)
{
    double *other = shapes_doubles(f->size);
    double *sum = shapes_doubles(f->size);

    for (size_t i = 0; i < SUBJECTS; i++) {
        random_direction(random, f, other);
        for (size_t m = 0; m < f->size; m++) {
            f->q[i * f->size + m] = f->s.q[m] + a[i] * direction[m] + noise * other[m];
            sum[m] += f->q[i * f->size + m];
        }
    }
    for (size_t m = 0; m < f->size; m++) {
        f->mean[m] = sum[m] / SUBJECTS;
    }
    srnf_free(sum);
    srnf_free(other);
}

static double correlation(const double *a, const double *b, size_t stride)
{
    double ma = 0.0, mb = 0.0, ab = 0.0, aa = 0.0, bb = 0.0;

    for (size_t i = 0; i < SUBJECTS; i++) {
        ma += a[i] / SUBJECTS;
        mb += b[i * stride] / SUBJECTS;
    }
    for (size_t i = 0; i < SUBJECTS; i++) {
        ab += (a[i] - ma) * (b[i * stride] - mb);
        aa += (a[i] - ma) * (a[i] - ma);
        bb += (b[i * stride] - mb) * (b[i * stride] - mb);
    }
    return ab / sqrt(aa * bb);
}

static void draw(struct test_random *random, double sd, double *a)
{
    for (size_t i = 0; i < SUBJECTS; i++) {
        a[i] = sd * test_random_normal(random);
    }
}

static void one_part_is_the_ordinary_analysis(void **state)
{
    struct test_random random = test_random_seed(1);
    struct srnf_joint_pca joint;
    struct srnf_pca pca;
    struct fields f;
    struct srnf_part part;
    double a[SUBJECTS], *direction;
    (void)state;

    fields_open(&f);
    direction = shapes_doubles(f.size);
    draw(&random, 0.2, a);
    random_direction(&random, &f, direction);
    plant(&random, &f, a, direction, 0.1);
    part = (struct srnf_part){f.mean, f.q, 1.0};
    assert_int_equal(srnf_pca_fit(f.s.grid, SUBJECTS, f.mean, f.q, 0, &pca), SRNF_OK);
    assert_int_equal(srnf_joint_pca_fit(f.s.grid, SUBJECTS, 1, &part, NULL, 0.0, 0, NULL, &joint),
                     SRNF_OK);
    assert_int_equal(joint.components, pca.components);
    assert_memory_equal(joint.eigenvalues, pca.eigenvalues, pca.components * sizeof(double));
    assert_memory_equal(joint.explained, pca.explained, pca.components * sizeof(double));
    assert_memory_equal(joint.scores, pca.scores, SUBJECTS * pca.components * sizeof(double));
    assert_memory_equal(joint.modes, pca.modes, pca.components * f.size * sizeof(double));
    assert_true(joint.total_variance == pca.total_variance);
    assert_true(fabs(joint.part_variances[0] - pca.total_variance) < 1e-12 * pca.total_variance);
    assert_true(joint.position_variance == 0.0);
    assert_null(joint.positions);
    for (size_t k = 0; k < pca.components; k++) {
        assert_true(fabs(joint.shares[2 * k] - 1.0) < 1e-12);
    }
    srnf_pca_clear(&pca);
    srnf_joint_pca_clear(&joint);
    srnf_free(direction);
    fields_close(&f);
}

struct two {
    struct fields f[2];
    double *direction[2];
    struct srnf_part parts[2];
    double common[SUBJECTS], alone[SUBJECTS];
};

/* Part 0 varies by the common cause with strength .2, part 1 by the same with .1 and, more, by one
   of its own with .15 in another direction. */
static void two_open(struct two *t)
{
    struct test_random random = test_random_seed(7);
    double scaled[SUBJECTS], *own;

    draw(&random, 1.0, t->common);
    draw(&random, 0.15, t->alone);
    for (size_t p = 0; p < 2; p++) {
        fields_open(&t->f[p]);
        t->direction[p] = shapes_doubles(t->f[p].size);
        random_direction(&random, &t->f[p], t->direction[p]);
        for (size_t i = 0; i < SUBJECTS; i++) {
            scaled[i] = (p ? 0.1 : 0.2) * t->common[i];
        }
        plant(&random, &t->f[p], scaled, t->direction[p], 0.02);
        t->parts[p] = (struct srnf_part){t->f[p].mean, t->f[p].q, 1.0};
    }
    own = shapes_doubles(t->f[1].size);
    random_direction(&random, &t->f[1], own);
    for (size_t i = 0; i < SUBJECTS; i++) {
        for (size_t m = 0; m < t->f[1].size; m++) {
            t->f[1].q[i * t->f[1].size + m] += t->alone[i] * own[m];
            t->f[1].mean[m] += t->alone[i] * own[m] / SUBJECTS;
        }
    }
    srnf_free(own);
}

static void two_close(struct two *t)
{
    for (size_t p = 0; p < 2; p++) {
        srnf_free(t->direction[p]);
        fields_close(&t->f[p]);
    }
}

static void shared_variation_is_found(void **state)
{
    struct srnf_joint_pca joint;
    struct two t;
    double cosine[2], share;
    (void)state;

    two_open(&t);
    assert_int_equal(
        srnf_joint_pca_fit(t.f[0].s.grid, SUBJECTS, 2, t.parts, NULL, 0.0, 0, NULL, &joint),
        SRNF_OK);
    for (size_t p = 0; p < 2; p++) {
        const double *mode = joint.modes + p * t.f[p].size;

        cosine[p] = srnf_inner_product(t.f[p].s.grid, mode, t.direction[p]) /
                    sqrt(srnf_inner_product(t.f[p].s.grid, mode, mode));
    }
    share = joint.shares[0];
    printf("# scores against the common cause %.4f, of the second against the other %.4f, modes "
           "%.4f %.4f, share %.3f\n",
           correlation(t.common, joint.scores, joint.components),
           correlation(t.alone, joint.scores + 1, joint.components), cosine[0], cosine[1], share);
    assert_true(fabs(correlation(t.common, joint.scores, joint.components)) > 0.97);
    assert_true(fabs(correlation(t.alone, joint.scores + 1, joint.components)) > 0.97);
    assert_true(fabs(cosine[0]) > 0.99);
    assert_true(fabs(cosine[1]) > 0.8);
    /* Together they move as they were planted: both along their directions, or both against. */
    assert_true(cosine[0] * cosine[1] > 0.0);
    /* .2^2 against .1^2 of the common cause; the second is the other's alone. */
    assert_true(fabs(share - 0.8) < 0.12);
    assert_true(joint.shares[3] < 0.12);
    assert_true(fabs(joint.shares[0] + joint.shares[1] - 1.0) < 1e-12);
    assert_true(fabs(joint.part_variances[0] + joint.part_variances[1] - joint.total_variance) <
                1e-12 * joint.total_variance);
    srnf_joint_pca_clear(&joint);
    two_close(&t);
}

static void scores_give_the_fields_back(void **state)
{
    struct srnf_joint_pca joint;
    struct two t;
    double *q;
    (void)state;

    two_open(&t);
    q = shapes_doubles(t.f[0].size);
    t.parts[1].weight = 3.0;
    assert_int_equal(
        srnf_joint_pca_fit(t.f[0].s.grid, SUBJECTS, 2, t.parts, NULL, 0.0, 0, NULL, &joint),
        SRNF_OK);
    assert_int_equal(joint.components, SUBJECTS - 1);
    for (size_t i = 0; i < SUBJECTS; i++) {
        for (size_t p = 0; p < 2; p++) {
            srnf_joint_pca_reconstruct(t.f[p].s.grid, &joint, t.parts,
                                       joint.scores + i * joint.components, p, q);
            assert_true(compare_relative(t.f[p].size, q, t.f[p].q + i * t.f[p].size) < 1e-11);
        }
    }
    srnf_free(q);
    srnf_joint_pca_clear(&joint);
    two_close(&t);
}

static void weights_scale_as_stated(void **state)
{
    const double factor = 2.25;
    struct srnf_joint_pca plain, scaled, single;
    struct two t;
    struct srnf_pca pca;
    (void)state;

    two_open(&t);
    assert_int_equal(
        srnf_joint_pca_fit(t.f[0].s.grid, SUBJECTS, 2, t.parts, NULL, 0.0, 0, NULL, &plain),
        SRNF_OK);
    t.parts[0].weight = t.parts[1].weight = factor;
    assert_int_equal(
        srnf_joint_pca_fit(t.f[0].s.grid, SUBJECTS, 2, t.parts, NULL, 0.0, 0, NULL, &scaled),
        SRNF_OK);
    for (size_t k = 0; k < plain.components; k++) {
        assert_true(fabs(scaled.eigenvalues[k] - factor * plain.eigenvalues[k]) <
                    1e-11 * plain.eigenvalues[0]);
        assert_true(fabs(scaled.explained[k] - plain.explained[k]) < 1e-11);
    }
    for (size_t i = 0; i < SUBJECTS; i++) {
        assert_true(fabs(scaled.scores[i * scaled.components] -
                         sqrt(factor) * plain.scores[i * plain.components]) < 1e-11);
    }
    for (size_t m = 0; m < t.f[0].size; m++) {
        assert_true(fabs(scaled.modes[m] - plain.modes[m] / sqrt(factor)) < 1e-10);
    }
    /* A part that weighs next to nothing leaves the components of the other. */
    t.parts[0].weight = 1.0;
    t.parts[1].weight = 1e-12;
    assert_int_equal(
        srnf_joint_pca_fit(t.f[0].s.grid, SUBJECTS, 2, t.parts, NULL, 0.0, 2, NULL, &single),
        SRNF_OK);
    assert_int_equal(srnf_pca_fit(t.f[0].s.grid, SUBJECTS, t.f[0].mean, t.f[0].q, 2, &pca),
                     SRNF_OK);
    for (size_t k = 0; k < 2; k++) {
        assert_true(fabs(single.eigenvalues[k] - pca.eigenvalues[k]) < 1e-9 * pca.eigenvalues[0]);
    }
    srnf_pca_clear(&pca);
    srnf_joint_pca_clear(&single);
    srnf_joint_pca_clear(&scaled);
    srnf_joint_pca_clear(&plain);
    two_close(&t);
}

/* Parts that do not change, but drift apart: only positions tell. */
static void positions_count(void **state)
{
    struct test_random random = test_random_seed(4);
    const double weight = 0.5;
    struct srnf_joint_pca joint;
    struct fields f;
    struct srnf_part parts[2];
    double a[SUBJECTS], positions[SUBJECTS * 6], zeros[SUBJECTS] = {0.0}, *direction, variance;
    double mean = 0.0, sum = 0.0;
    (void)state;

    fields_open(&f);
    direction = shapes_doubles(f.size);
    random_direction(&random, &f, direction);
    plant(&random, &f, zeros, direction, 0.001);
    parts[0] = parts[1] = (struct srnf_part){f.mean, f.q, 1.0};
    draw(&random, 0.3, a);
    for (size_t i = 0; i < SUBJECTS; i++) {
        const double half[6] = {0.5 * a[i] + 1.0, 2.0, 0.0, -0.5 * a[i] - 1.0, -2.0, 0.0};

        memcpy(positions + 6 * i, half, sizeof half);
        mean += a[i] / SUBJECTS;
    }
    for (size_t i = 0; i < SUBJECTS; i++) {
        sum += (a[i] - mean) * (a[i] - mean) / (SUBJECTS - 1);
    }
    variance = weight * 0.5 * sum; /* of two halves */
    assert_int_equal(
        srnf_joint_pca_fit(f.s.grid, SUBJECTS, 2, parts, positions, weight, 1, NULL, &joint),
        SRNF_OK);
    assert_true(fabs(joint.position_variance - variance) < 1e-12);
    assert_true(fabs(joint.eigenvalues[0] - variance) < 1e-4 * variance);
    assert_true(joint.shares[2] > 0.999);
    assert_true(fabs(correlation(a, joint.scores, 1)) > 0.9999);
    assert_true(fabs(joint.positions[0] + joint.positions[3]) < 1e-12);
    assert_true(fabs(fabs(joint.positions[0]) - sqrt(0.5 / weight)) < 1e-3);
    assert_true(fabs(joint.positions[1]) < 1e-12);
    srnf_joint_pca_clear(&joint);
    srnf_free(direction);
    fields_close(&f);
}

/* A stack with positions: what was put in comes out, and products are those of the parts. */
static void stacks_hold_parts(void **state)
{
    const double weights[2] = {1.0, 3.0}, places[6] = {1.0, 2.0, 3.0, -1.0, -2.0, -4.0};
    struct srnf_stack stack;
    struct two t;
    double *a, *b, *field, back[6], sum, direct;
    (void)state;

    two_open(&t);
    assert_int_equal(srnf_stack_open(t.f[0].s.grid, 2, weights, 0.5, &stack), SRNF_OK);
    a = shapes_doubles(3 * stack.grid.n_theta * stack.grid.n_phi);
    b = shapes_doubles(3 * stack.grid.n_theta * stack.grid.n_phi);
    field = shapes_doubles(t.f[0].size);
    for (size_t p = 0; p < 2; p++) {
        srnf_stack_put(&stack, p, t.f[p].q, a);
        srnf_stack_put(&stack, p, t.f[p].mean, b);
    }
    srnf_stack_put_positions(&stack, places, a);
    srnf_stack_put_positions(&stack, places, b);
    direct = srnf_inner_product(t.f[0].s.grid, t.f[0].q, t.f[0].mean) +
             3.0 * srnf_inner_product(t.f[1].s.grid, t.f[1].q, t.f[1].mean) + 0.5 * 35.0;
    sum = srnf_stack_product(&stack, 0, a, b) + srnf_stack_product(&stack, 1, a, b) +
          srnf_stack_product(&stack, 2, a, b);
    assert_true(fabs(srnf_stack_product(&stack, 2, a, b) - 17.5) < 1e-12);
    assert_true(fabs(sum - direct) < 1e-12 * fabs(direct));
    assert_true(fabs(srnf_inner_product(&stack.grid, a, b) - direct) < 1e-12 * fabs(direct));
    for (size_t p = 0; p < 2; p++) {
        srnf_stack_take(&stack, p, a, field);
        assert_memory_equal(field, t.f[p].q, t.f[p].size * sizeof(double));
    }
    srnf_stack_take_positions(&stack, a, back);
    assert_memory_equal(back, places, sizeof places);
    srnf_stack_clear(&stack);
    srnf_free(a);
    srnf_free(b);
    srnf_free(field);
    two_close(&t);
}

/* Kept, one part of weight 1 is the model that pca keeps, to the last bit; two are judged by their
   stacked fields. */
static void kept_models_judge_their_subjects(void **state)
{
    const struct srnf_grid *grid;
    struct srnf_joint_pca joint;
    struct srnf_joint_model kept;
    struct srnf_calibration calibration;
    struct srnf_pca pca;
    struct two t;
    double residuals[SUBJECTS], own;
    (void)state;

    two_open(&t);
    grid = t.f[0].s.grid;
    assert_int_equal(srnf_pca_fit(grid, SUBJECTS, t.f[0].mean, t.f[0].q, 5, &pca), SRNF_OK);
    assert_int_equal(srnf_pca_residuals(grid, &pca, t.f[0].mean, SUBJECTS, t.f[0].q, residuals),
                     SRNF_OK);
    assert_int_equal(srnf_calibrate(grid, &pca, t.f[0].mean, t.f[0].q, NULL, NULL, &calibration),
                     SRNF_OK);
    assert_int_equal(srnf_joint_pca_fit(grid, SUBJECTS, 1, t.parts, NULL, 0.0, 5, NULL, &joint),
                     SRNF_OK);
    assert_int_equal(srnf_joint_model_make(grid, &joint, t.parts, NULL, 0.0, NULL, &kept), SRNF_OK);
    assert_int_equal(kept.n_theta, grid->n_theta);
    assert_memory_equal(kept.mean_q, t.f[0].mean, t.f[0].size * sizeof(double));
    assert_memory_equal(kept.modes, pca.modes, 5 * t.f[0].size * sizeof(double));
    assert_memory_equal(kept.residuals, residuals, sizeof residuals);
    assert_int_equal(kept.calibration.n, SUBJECTS);
    assert_memory_equal(kept.calibration.values, calibration.values,
                        SRNF_CALIBRATION_TRAITS * SUBJECTS * sizeof(double));
    srnf_joint_model_clear(&kept);
    srnf_joint_pca_clear(&joint);
    srnf_calibration_clear(&calibration);
    srnf_pca_clear(&pca);

    t.parts[1].weight = 2.0;
    assert_int_equal(srnf_joint_pca_fit(grid, SUBJECTS, 2, t.parts, NULL, 0.0, 3, NULL, &joint),
                     SRNF_OK);
    assert_int_equal(srnf_joint_model_make(grid, &joint, t.parts, NULL, 0.0, NULL, &kept), SRNF_OK);
    assert_int_equal(kept.n_theta, 2 * grid->n_theta);
    for (size_t i = 0; i < SUBJECTS; i++) {
        double square = 0.0;

        for (size_t k = 0; k < 3; k++) {
            square += joint.scores[3 * i + k] * joint.scores[3 * i + k];
        }
        own = kept.distances[i] * kept.distances[i] - square;
        assert_true(fabs(own - kept.residuals[i] * kept.residuals[i]) < 1e-12);
        assert_true(kept.residuals[i] > 0.01);
    }
    srnf_joint_model_clear(&kept);
    srnf_joint_pca_clear(&joint);
    two_close(&t);
}

static void refuses_nonsense(void **state)
{
    double positions[6 * SUBJECTS] = {0.0};
    struct srnf_joint_pca joint;
    struct two t;
    (void)state;

    two_open(&t);
#define REFUSED(n, n_parts, x, weight)                                                      \
    assert_int_equal(                                                                       \
        srnf_joint_pca_fit(t.f[0].s.grid, n, n_parts, t.parts, x, weight, 0, NULL, &joint), \
        SRNF_EINVAL);                                                                       \
    assert_null(joint.scores)
    REFUSED(1, 2, NULL, 0.0);
    REFUSED(SUBJECTS, 0, NULL, 0.0);
    REFUSED(SUBJECTS, SRNF_PARTS_MAX + 1, NULL, 0.0);
    REFUSED(SUBJECTS, 2, positions, 0.0);
    REFUSED(SUBJECTS, 2, positions, NAN);
    positions[5] = INFINITY;
    REFUSED(SUBJECTS, 2, positions, 1.0);
    t.parts[1].weight = 0.0;
    REFUSED(SUBJECTS, 2, NULL, 0.0);
    t.parts[1].weight = INFINITY;
    REFUSED(SUBJECTS, 2, NULL, 0.0);
    t.parts[1].weight = 1.0;
    t.f[1].q[3] = NAN;
    REFUSED(SUBJECTS, 2, NULL, 0.0);
    two_close(&t);
}

static struct two refused;

static int run_refused(void)
{
    double positions[6 * SUBJECTS] = {0.0};
    struct srnf_joint_pca joint;
    int status = srnf_joint_pca_fit(refused.f[0].s.grid, SUBJECTS, 2, refused.parts, positions, 1.0,
                                    2, NULL, &joint);

    srnf_joint_pca_clear(&joint);
    return status;
}

static void survives_refusals(void **state)
{
    (void)state;
    two_open(&refused);
    refusing_sweep("parts", run_refused, 30, 1);
    two_close(&refused);
    assert_int_equal(refusing.alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_part_is_the_ordinary_analysis),
        cmocka_unit_test(shared_variation_is_found),
        cmocka_unit_test(scores_give_the_fields_back),
        cmocka_unit_test(weights_scale_as_stated),
        cmocka_unit_test(positions_count),
        cmocka_unit_test(stacks_hold_parts),
        cmocka_unit_test(kept_models_judge_their_subjects),
        cmocka_unit_test(refuses_nonsense),
        cmocka_unit_test(survives_refusals),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
