/*
 * test_typicality.c - how far a surface is from a group: closed leave-one-out values against
 * models that are fitted anew, the angle of a turn, and shapes of another kind, which are beyond
 * the limits (of which test_typicality_limits.c is).
 */
#include "group.h"
#include "stats/folds.h"
#include "stats/subjects.h"
#include "support/compare.h"

#define DEGREE 6
#define N ((size_t)24)
#define HELD_OUT ((size_t)80)
#define FOREIGN ((size_t)20)
#define SPREAD 0.3
#define DEGREES (SRNF_PI / 180.0)
/* Three limits of .5 % each: 1.5 % of HELD_OUT are 1.2. Six or more of 80 have at that rate the
   probability 1e-3, and at 5 % that of .21. */
#define FALSE_MAX ((size_t)5)

struct model {
    struct group g;
    size_t size;
    double *q, *mean_q;     /* [N][size], [size] */
    const size_t *subjects; /* of the members, or NULL */
    struct srnf_pca pca;
    struct srnf_calibration calibration;
};

static void fit(struct model *m, size_t n, size_t components)
{
    stats_average(m->g.grid, n, m->q, m->mean_q);
    assert_int_equal(srnf_pca_fit(m->g.grid, n, m->mean_q, m->q, components, &m->pca), SRNF_OK);
    assert_int_equal(
        srnf_calibrate(m->g.grid, &m->pca, m->mean_q, m->q, m->subjects, NULL, &m->calibration),
        SRNF_OK);
    assert_int_equal(m->calibration.n, n);
}

static void field_of(const struct group *g, const double *f, double *q)
{
    assert_int_equal(stats_fields(g->sht, 1, &f, NULL, q, NULL), SRNF_OK);
}

/* The first n of stars about one centre, as parameterized. */
static void open_model(struct model *m, size_t all, size_t n, size_t components)
{
    m->subjects = NULL;
    group_open_stars(&m->g, DEGREE, all, SPREAD);
    m->size = 3 * m->g.points;
    m->q = shapes_doubles(n * m->size);
    m->mean_q = shapes_doubles(m->size);
    assert_int_equal(stats_fields(m->g.sht, n, m->g.surfaces, NULL, m->q, NULL), SRNF_OK);
    fit(m, n, components);
}

static void close_fit(struct model *m)
{
    srnf_calibration_clear(&m->calibration);
    srnf_pca_clear(&m->pca);
}

static void close_model(struct model *m)
{
    close_fit(m);
    srnf_free(m->q);
    srnf_free(m->mean_q);
    group_close(&m->g);
}

static const double *values_of(const struct model *m, enum srnf_trait trait)
{
    return m->calibration.values + (size_t)trait * m->calibration.n;
}

/* ---- Leave-one-out values -------------------------------------------------------------------- */

struct left_out {
    double residual, distance, mahalanobis, angle;
};

/* Of member i in a model that is fitted to those of other subjects. count: how many subjects. */
static struct left_out refit(const struct model *m, size_t i, size_t components, size_t count)
{
    size_t n = m->calibration.n;
    size_t t = 0;
    double *others = shapes_doubles(n * m->size);
    double *mean = shapes_doubles(m->size);
    double scores[GROUP_MAX];
    struct left_out out;
    struct srnf_pca pca;

    for (size_t j = 0; j < n; j++) {
        if (m->subjects ? m->subjects[j] != m->subjects[i] : j != i) {
            memcpy(others + t++ * m->size, m->q + j * m->size, m->size * sizeof(double));
        }
    }
    stats_average(m->g.grid, t, others, mean);
    assert_int_equal(srnf_pca_fit(m->g.grid, t, mean, others, components, &pca), SRNF_OK);
    srnf_pca_project(m->g.grid, &pca, mean, m->q + i * m->size, scores, &out.residual);
    out.distance = sqrt(stats_distance2(m->g.grid, mean, m->q + i * m->size));
    out.mahalanobis =
        srnf_mahalanobis(srnf_mahalanobis_components(count, m->pca.components, m->pca.eigenvalues),
                         pca.eigenvalues, scores);
    out.angle = srnf_pose_angle(m->g.grid, mean, m->q + i * m->size, NULL);
    srnf_pca_clear(&pca);
    srnf_free(mean);
    srnf_free(others);
    return out;
}

static void expect_close(const char *what, double value, double expected, double scale)
{
    if (!(fabs(value - expected) <= 1e-9 * scale)) {
        fail_msg("%s: %.12g is not %.12g", what, value, expected);
    }
}

static void expect_refits(const struct model *m, size_t components, size_t count)
{
    for (size_t i = 0; i < m->calibration.n; i++) {
        struct left_out expected = refit(m, i, components, count);

        expect_close("residual", values_of(m, SRNF_TRAIT_RESIDUAL)[i], expected.residual, 1.0);
        expect_close("distance", values_of(m, SRNF_TRAIT_DISTANCE)[i], expected.distance, 1.0);
        expect_close("Mahalanobis distance", values_of(m, SRNF_TRAIT_MAHALANOBIS)[i],
                     expected.mahalanobis, 1e3 * expected.mahalanobis);
        expect_close("angle", values_of(m, SRNF_TRAIT_ANGLE)[i], expected.angle, 1.0);
    }
}

static void leaving_one_out_is_fitting_anew(void **state)
{
    static const size_t components[] = {0, 1, 4, N - 2};
    struct model m;

    (void)state;
    open_model(&m, N, N, 0);
    assert_int_equal(m.pca.components, N - 1);
    for (size_t k = 0; k < sizeof components / sizeof components[0]; k++) {
        close_fit(&m);
        fit(&m, N, components[k]);
        expect_refits(&m, components[k], N);
    }
    close_model(&m);
}

/* Subjects of one, two, three, and eight members, apart and close together: all of a subject's are
   left out at a time. At a hundredth their differences are components of 1e-4 of the variance,
   whose directions a Gram matrix tells to 1e-12. */
static void leaving_a_subject_out_is_fitting_anew(void **state)
{
    static const size_t components[] = {0, 1, 4, N - 2};
    size_t subjects[N];
    struct model m;

    (void)state;
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i < 8 ? 3 : (7 * i) % 9 + 9; /* ten, of which the first is a third of all */
    }
    subjects[20] = 0; /* alone */
    open_model(&m, N, N, 0);
    for (size_t i = 0; i + 1 < N; i++) {
        double near = i % 2 == 0 && subjects[i] == subjects[i + 1] ? 1e-2 : 1.0;

        for (size_t k = 0; k < m.size; k++) {
            double *other = &m.q[(i + 1) * m.size + k];

            *other = m.q[i * m.size + k] + near * (*other - m.q[i * m.size + k]);
        }
    }
    m.subjects = subjects;
    for (size_t k = 0; k < sizeof components / sizeof components[0]; k++) {
        close_fit(&m);
        fit(&m, N, components[k]);
        expect_refits(&m, components[k], 11);
    }
    close_model(&m);
}

static bool is_canceled(void *user)
{
    size_t *left = user;

    *left -= *left > 0;
    return *left == 0; /* and so for good: who has said stop says so again */
}

/* Asked to stop at any time it does, with nothing left behind. */
static void calibration_stops_when_asked(void **state)
{
    struct model m;
    size_t asked = 0;
    int status = SRNF_ECANCELED;

    (void)state;
    open_model(&m, N, N, 0);
    while (status == SRNF_ECANCELED) {
        size_t left = ++asked;
        const struct srnf_context context = {.user = &left, .canceled = is_canceled};
        struct srnf_calibration calibration = {0};

        status =
            srnf_calibrate(m.g.grid, &m.pca, m.mean_q, m.q, m.subjects, &context, &calibration);
        assert_true((status == SRNF_OK) == (calibration.values != NULL));
        srnf_calibration_clear(&calibration);
    }
    assert_int_equal(status, SRNF_OK);
    assert_true(asked > N); /* once a subject at least */
    close_model(&m);
}

/* Two subjects with one field: without a third one the others have a dimension less. */
static void of_twins_the_others_are_judged_as_ever(void **state)
{
    struct model m;

    (void)state;
    open_model(&m, N, N, 0);
    memcpy(m.q + m.size, m.q, m.size * sizeof(double));
    close_fit(&m);
    fit(&m, N, 0);
    assert_int_equal(m.pca.components, N - 2);
    expect_refits(&m, 0, N);
    close_model(&m);
}

/* Fields of few dimensions, and two that are equal: eigenvalues are 0, and some coincide. */
static void fields_of_few_dimensions_are_no_exception(void **state)
{
    struct model m;
    double *frame;

    (void)state;
    open_model(&m, N, N, 4);
    frame = shapes_doubles(m.size);
    memcpy(frame, m.mean_q, m.size * sizeof(double));
    for (size_t i = 0; i < N; i++) {
        srnf_pca_reconstruct(m.g.grid, &m.pca, frame, m.pca.scores + (i - i % 2) * 4,
                             m.q + i * m.size);
    }
    close_fit(&m);
    fit(&m, N, 3);
    expect_refits(&m, 3, N);
    close_fit(&m);
    fit(&m, N, 0);
    assert_int_equal(m.pca.components, 4);
    for (size_t i = 0; i < N; i++) {
        double norm = sqrt(srnf_inner_product(m.g.grid, m.mean_q, m.mean_q));

        assert_true(values_of(&m, SRNF_TRAIT_RESIDUAL)[i] >= 1e-9 * norm);
        assert_true(values_of(&m, SRNF_TRAIT_RESIDUAL)[i] <= 2e-9 * norm);
    }
    srnf_free(frame);
    close_model(&m);
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

struct verdict {
    bool far, turned;
};

static struct verdict judge(const struct model *m, const double *q)
{
    size_t n = m->calibration.n;
    size_t counted = srnf_mahalanobis_components(n, m->pca.components, m->pca.eigenvalues);
    double scores[GROUP_MAX];
    double found[SRNF_CALIBRATION_TRAITS];
    struct verdict verdict = {0};

    srnf_pca_project(m->g.grid, &m->pca, m->mean_q, q, scores, &found[SRNF_TRAIT_RESIDUAL]);
    found[SRNF_TRAIT_DISTANCE] = sqrt(stats_distance2(m->g.grid, m->mean_q, q));
    found[SRNF_TRAIT_MAHALANOBIS] = srnf_mahalanobis(counted, m->pca.eigenvalues, scores);
    found[SRNF_TRAIT_ANGLE] = srnf_pose_angle(m->g.grid, m->mean_q, q, NULL);
    for (size_t t = 0; t < SRNF_CALIBRATION_TRAITS; t++) {
        struct srnf_typicality typicality;

        assert_int_equal(srnf_typicality_of((enum srnf_trait)t, n, values_of(m, (enum srnf_trait)t),
                                            NULL, found[t], SRNF_TYPICAL_ALPHA, &typicality),
                         SRNF_OK);
        if (t == SRNF_TRAIT_ANGLE) {
            verdict.turned = typicality.far;
        } else {
            verdict.far = verdict.far || typicality.far;
        }
    }
    return verdict;
}

static void held_out_members_are_not_far(void **state)
{
    struct model m;
    double *q;
    size_t far = 0;
    size_t turned = 0;

    (void)state;
    open_model(&m, N + HELD_OUT, N, 0);
    q = shapes_doubles(m.size);
    for (size_t i = N; i < N + HELD_OUT; i++) {
        struct verdict verdict;

        field_of(&m.g, m.g.f[i], q);
        verdict = judge(&m, q);
        far += verdict.far;
        turned += verdict.turned;
    }
    printf("# of %zu held out %zu far, %zu turned\n", HELD_OUT, far, turned);
    assert_true(far <= FALSE_MAX);
    assert_true(turned <= FALSE_MAX);
    srnf_free(q);
    close_model(&m);
}

/* Stars about another centre, of the same area, and their like. */
static void foreign_shapes_are_far(void **state)
{
    struct shapes_surface other;
    struct model m;
    double *q;

    (void)state;
    open_model(&m, N, N, 0);
    shapes_open(&other, DEGREE);
    q = shapes_doubles(m.size);
    for (size_t i = 0; i < FOREIGN; i++) {
        struct srnf_surface_measures measures;

        shapes_fill_random_star(&other, 5000 + i, NULL);
        srnf_surface_measure(m.g.sht, other.f, &measures, other.workspace);
        for (size_t k = 0; k < m.g.count; k++) {
            other.f[k] /= sqrt(measures.area);
        }
        field_of(&m.g, other.f, q);
        if (!judge(&m, q).far) {
            fail_msg("foreign star %zu passes for a member", i);
        }
    }
    srnf_free(q);
    shapes_close(&other);
    close_model(&m);
}

/* The field turned about an axis between the coordinate ones. */
static void turn(const struct group *g, double angle, const double *q, double *turned)
{
    const double axis[3] = {2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0};
    double c = cos(angle);
    double s = sin(angle);

    for (size_t k = 0; k < g->points; k++) {
        double v[3] = {q[k], q[g->points + k], q[2 * g->points + k]};
        double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];

        for (size_t r = 0; r < 3; r++) {
            size_t a = (r + 1) % 3;
            size_t b = (r + 2) % 3;

            turned[r * g->points + k] =
                c * v[r] + s * (axis[a] * v[b] - axis[b] * v[a]) + (1.0 - c) * along * axis[r];
        }
    }
}

static void the_angle_is_that_of_the_turn(void **state)
{
    struct model m;
    double *q;

    (void)state;
    open_model(&m, N, N, 0);
    q = shapes_doubles(m.size);
    for (double angle = 1e-6; angle < 3.1; angle *= 4.0) {
        double rotation[9];

        turn(&m.g, angle, m.mean_q, q);
        assert_true(fabs(srnf_pose_angle(m.g.grid, m.mean_q, q, rotation) - angle) <= 1e-9);
        assert_true(fabs(rotation[0] + rotation[4] + rotation[8] - 1.0 - 2.0 * cos(angle)) <=
                    1e-12);
    }
    assert_true(srnf_pose_angle(m.g.grid, m.mean_q, m.mean_q, NULL) <= 1e-9);
    srnf_free(q);
    close_model(&m);
}

/* Members that are turned are beyond the limit of the angle; less than a degree is not told. */
static void turned_members_differ_in_pose(void **state)
{
    static const double angles[] = {0.4, 10.0, 90.0};
    size_t turned[3] = {0};
    struct model m;
    double *q;

    (void)state;
    open_model(&m, N + FOREIGN, N, 0);
    q = shapes_doubles(2 * m.size);
    for (size_t a = 0; a < 3; a++) {
        for (size_t i = N; i < N + FOREIGN; i++) {
            field_of(&m.g, m.g.f[i], q + m.size);
            turn(&m.g, angles[a] * DEGREES, q + m.size, q);
            turned[a] += judge(&m, q).turned;
        }
        printf("# turned by %g degrees: %zu of %zu\n", angles[a], turned[a], FOREIGN);
    }
    assert_true(turned[0] <= 1);
    assert_int_equal(turned[1], FOREIGN);
    assert_int_equal(turned[2], FOREIGN);
    srnf_free(q);
    close_model(&m);
}

/* ---- Members of a comparison ----------------------------------------------------------------- */

static size_t count_far(const struct srnf_folds_typicality *typicality, size_t member)
{
    size_t far = 0;

    for (size_t t = 0; t < typicality->traits; t++) {
        far += typicality->verdicts[member * typicality->traits + t].far;
    }
    return far;
}

/* The residual and the distance of a member, from the scores of one fold and by definition. */
static void expect_distances(const struct srnf_folds *c,
                             const struct srnf_folds_typicality *typicality, const double *q,
                             const struct group *g)
{
    size_t size = 3 * g->points;
    double *mean = shapes_doubles(size);

    for (size_t i = 0; i < c->n; i++) {
        double distance;

        memset(mean, 0, size * sizeof(double));
        for (size_t j = 0; j < c->n; j++) {
            for (size_t k = 0; j != i && k < size; k++) {
                mean[k] += q[j * size + k] / (double)(c->n - 1);
            }
        }
        distance = sqrt(stats_distance2(g->grid, mean, q + i * size));
        expect_close("distance in a fold", typicality->verdicts[3 * i + 1].value, distance, 10.0);
    }
    srnf_free(mean);
}

/* Folds as parameterized, from the fields alone: what srnf_folds_compare makes of registered ones
   (its inner products stand in folds_scores.c). */
static struct srnf_folds make_folds(const struct group *g, size_t components, const double *q)
{
    size_t n = g->n;
    struct subjects subjects;
    double *scaled = shapes_doubles(n * 3 * g->points);
    double *products = shapes_doubles(n * n);
    struct srnf_folds c = {.n = n, .components = components};

    c.scores = shapes_doubles(n * n * components);
    c.distances = shapes_doubles(n * n);
    c.spread = shapes_doubles(n);
    fold_products(g->grid, n, q, scaled, products);
    assert_int_equal(subjects_open(&subjects, n, NULL, NULL), SRNF_OK);
    for (size_t i = 0; i < n; i++) {
        assert_int_equal(fold_describe(&subjects, i, products, components,
                                       c.scores + i * n * components, c.distances, c.spread + i),
                         SRNF_OK);
    }
    subjects_clear(&subjects);
    srnf_free(products);
    srnf_free(scaled);
    return c;
}

static void a_foreign_member_of_a_comparison_is_told(void **state)
{
    struct group g;
    struct shapes_surface other;

    (void)state;
    group_open_stars(&g, DEGREE, N, SPREAD);
    shapes_open(&other, DEGREE);
    for (size_t foreign = 0; foreign < 2; foreign++) {
        double *q = shapes_doubles(N * 3 * g.points);
        struct srnf_folds_typicality typicality;
        struct srnf_folds c;
        size_t far = 0;

        if (foreign) {
            struct srnf_surface_measures measures;

            shapes_fill_random_star(&other, 5000, NULL);
            srnf_surface_measure(g.sht, other.f, &measures, other.workspace);
            for (size_t k = 0; k < g.count; k++) {
                g.f[3][k] = other.f[k] / sqrt(measures.area);
            }
        }
        assert_int_equal(stats_fields(g.sht, N, g.surfaces, NULL, q, NULL), SRNF_OK);
        c = make_folds(&g, 6, q);
        for (size_t with_scores = 2; with_scores-- > 0;) {
            assert_int_equal(srnf_folds_typicality(&c, SRNF_TYPICAL_ALPHA_GROUP, &typicality),
                             SRNF_OK);
            assert_int_equal(typicality.traits, with_scores ? 3 : 1);
            if (with_scores) {
                expect_distances(&c, &typicality, q, &g);
            }
            far = 0;
            for (size_t i = 0; i < N; i++) {
                far += i != 3 && count_far(&typicality, i) > 0;
            }
            assert_int_equal(far, 0);
            assert_int_equal(count_far(&typicality, 3) > 0, foreign);
            srnf_folds_typicality_clear(&typicality);
            srnf_free(c.scores);
            c.scores = NULL;
        }
        srnf_folds_clear(&c);
        srnf_free(q);
    }
    shapes_close(&other);
    group_close(&g);
}

/* A foreign subject with two surfaces: each has the other beside it, which its fold leaves out. */
static void a_subject_is_not_judged_by_itself(void **state)
{
    size_t subjects[N];
    double distances[N * N] = {0};
    struct srnf_folds c = {.n = N, .distances = distances};
    struct test_random random = test_random_seed(7);

    (void)state;
    for (size_t i = 0; i < N; i++) {
        subjects[i] = i == N - 1 ? N - 2 : i;
        for (size_t j = 0; j < i; j++) {
            distances[i * N + j] = i >= N - 2 ? 30.0 : exp(0.2 * test_random_normal(&random));
            distances[j * N + i] = distances[i * N + j];
        }
    }
    distances[(N - 1) * N + N - 2] = distances[(N - 2) * N + N - 1] = 0.01;
    for (size_t known = 0; known < 2; known++) {
        struct srnf_folds_typicality typicality;

        c.subjects = known ? subjects : NULL;
        assert_int_equal(srnf_folds_typicality(&c, SRNF_TYPICAL_ALPHA_GROUP, &typicality), SRNF_OK);
        for (size_t i = 0; i < N; i++) {
            assert_int_equal(count_far(&typicality, i), known && i >= N - 2);
        }
        srnf_folds_typicality_clear(&typicality);
    }
}

/* ---- Wrong arguments ------------------------------------------------------------------------- */

static void refuses_what_it_cannot_judge(void **state)
{
    double values[] = {1.0, 2.0, 3.0};
    struct srnf_typicality t = {.limit = 7.0};
    struct srnf_calibration calibration = {0};
    struct srnf_folds folds = {.n = 3};
    struct srnf_folds_typicality typicality;
    struct model m;
    double weights[] = {1.0, 1.0, 0.5};
    size_t two[N] = {1, 1};
    double angles[3];
    double angle;

    (void)state;
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 3, values, weights, 1.0, 0.01, &t),
                     SRNF_EINVAL);
    weights[0] = NAN;
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 3, values, weights, 1.0, 0.01, &t),
                     SRNF_EINVAL);
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 2, values, NULL, 1.0, 0.01, &t),
                     SRNF_EINVAL);
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 3, values, NULL, NAN, 0.01, &t),
                     SRNF_EINVAL);
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 3, values, NULL, 1.0, 0.0, &t),
                     SRNF_EINVAL);
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 3, values, NULL, 1.0, NAN, &t),
                     SRNF_EINVAL);
    values[1] = NAN;
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 3, values, NULL, 1.0, 0.01, &t),
                     SRNF_EINVAL);
    assert_true(t.limit == 7.0);
    assert_int_equal(srnf_folds_typicality(&folds, 0.01, &typicality), SRNF_EINVAL);
    open_model(&m, N, N, 0);
    assert_int_equal(srnf_pose_angles(m.g.grid, 1, m.q, NULL, &angle), SRNF_EINVAL);
    m.pca.n = 2;
    assert_int_equal(srnf_calibrate(m.g.grid, &m.pca, m.mean_q, m.q, NULL, NULL, &calibration),
                     SRNF_EINVAL);
    m.pca.n = N;
    assert_int_equal(srnf_calibrate(m.g.grid, &m.pca, m.mean_q, m.q, two, NULL, &calibration),
                     SRNF_EINVAL);
    two[3] = N;
    assert_int_equal(srnf_calibrate(m.g.grid, &m.pca, m.mean_q, m.q, two, NULL, &calibration),
                     SRNF_EINVAL);
    memset(two, 0, sizeof two);
    assert_int_equal(srnf_pose_angles(m.g.grid, 3, m.q, two, angles), SRNF_EINVAL);
    m.q[11] = NAN;
    assert_int_equal(srnf_calibrate(m.g.grid, &m.pca, m.mean_q, m.q, NULL, NULL, &calibration),
                     SRNF_EINVAL);
    assert_null(calibration.values);
    close_model(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(leaving_one_out_is_fitting_anew),
        cmocka_unit_test(leaving_a_subject_out_is_fitting_anew),
        cmocka_unit_test(calibration_stops_when_asked),
        cmocka_unit_test(of_twins_the_others_are_judged_as_ever),
        cmocka_unit_test(fields_of_few_dimensions_are_no_exception),
        cmocka_unit_test(held_out_members_are_not_far),
        cmocka_unit_test(foreign_shapes_are_far),
        cmocka_unit_test(the_angle_is_that_of_the_turn),
        cmocka_unit_test(turned_members_differ_in_pose),
        cmocka_unit_test(a_foreign_member_of_a_comparison_is_told),
        cmocka_unit_test(a_subject_is_not_judged_by_itself),
        cmocka_unit_test(refuses_what_it_cannot_judge),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
