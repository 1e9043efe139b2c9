/*
 * test_judge.c - the guard on encodings: sound meshes pass at every degree, what is another shape
 * does not, the figures are those of the shapes, and no NaN passes.
 *
 * srnfd-test: no-asan (test_encode_adversarial.c runs its code)
 */
#include "core/figures.h"
#include "support/meshes.h"

struct subject {
    struct srnf_mesh mesh;
    struct srnf_mesh_report report;
};

static void encode(const struct subject *subject, enum srnf_parameterization route, size_t degree,
                   struct srnf_encoded *encoded)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();

    options.parameterization = route;
    options.degree = degree;
    assert_int_equal(srnf_encode(&subject->mesh, &subject->report, &options, NULL, encoded, NULL),
                     SRNF_OK);
}

static enum srnf_verdict verdict_of(const struct subject *subject, enum srnf_parameterization route,
                                    size_t degree)
{
    struct srnf_encoded encoded;
    struct srnf_judgement judgement;
    enum srnf_verdict verdict;

    encode(subject, route, degree, &encoded);
    verdict = srnf_encode_judge(&encoded, &subject->report, false, &judgement);
    assert_int_equal(judgement.verdict, verdict);
    srnf_free(encoded.coefficients);
    return verdict;
}

static struct subject subject_of(struct srnf_mesh mesh)
{
    struct subject subject = {.mesh = mesh};

    assert_int_equal(srnf_mesh_prepare(&subject.mesh, true, &subject.report), SRNF_OK);
    assert_int_equal(subject.report.n_problems, 0);
    return subject;
}

static void sound_shapes_pass(void **state)
{
    static const size_t degrees[] = {4, 8, 15, 31};
    static const char *const files[] = {"L_caudate", "L_hippocampus", "R_thalamus"};
    (void)state;

    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        struct srnf_mesh mesh;
        struct subject subject;
        char path[80];

        (void)snprintf(path, sizeof path, "tests/data/aal_subcortex/%s.ply", files[i]);
        assert_true(meshes_load(path, &mesh));
        subject = subject_of(mesh);
        for (size_t d = 0; d < sizeof degrees / sizeof degrees[0]; d++) {
            enum srnf_verdict verdict =
                verdict_of(&subject, SRNF_PARAMETERIZATION_AREA, degrees[d]);

            assert_true(verdict != SRNF_UNFAITHFUL);
            if (degrees[d] >= 8) {
                assert_int_equal(verdict, SRNF_FAITHFUL);
            }
        }
        srnf_mesh_clear(&subject.mesh);
    }
}

/* Long thin shapes, and those that are all corners, are never refused by the route area. */
static void extreme_shapes_are_not_refused(void **state)
{
    struct srnf_mesh meshes[] = {meshes_capsule(100, 1, 120, 9), meshes_box(1, 2, 8),
                                 meshes_tetrahedron(), meshes_bent_capsule(20, 1, 5, 80, 12)};
    (void)state;

    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
        struct subject subject = subject_of(meshes[i]);

        for (size_t degree = 4; degree <= 63; degree = 2 * degree + 1) {
            assert_true(verdict_of(&subject, SRNF_PARAMETERIZATION_AREA, degree) !=
                        SRNF_UNFAITHFUL);
        }
        srnf_mesh_clear(&subject.mesh);
    }
}

static void another_shape_is_refused(void **state)
{
    struct srnf_mesh needle = meshes_sphere(12);
    struct subject subject;
    (void)state;

    meshes_stretch(&needle, 1, 1, 100);
    subject = subject_of(needle);
    for (size_t degree = 4; degree <= 63; degree = 2 * degree + 1) {
        assert_int_equal(verdict_of(&subject, SRNF_PARAMETERIZATION_STAR, degree), SRNF_UNFAITHFUL);
    }
    srnf_mesh_clear(&subject.mesh);
    subject = subject_of(meshes_tetrahedron());
    assert_int_equal(verdict_of(&subject, SRNF_PARAMETERIZATION_STAR, 4), SRNF_POOR);
    srnf_mesh_clear(&subject.mesh);
}

/* An encoding that is sound, with one figure of it changed. */
static enum srnf_verdict changed(const struct subject *subject, const struct srnf_encoded *sound,
                                 size_t which, double value)
{
    struct srnf_encoded encoded = *sound;
    struct srnf_judgement judgement;

    switch (which) {
    case 0:
        encoded.fit.rms = value * encoded.fit.diagonal;
        break;
    case 1:
        encoded.measures.volume *= value;
        break;
    case 2:
        encoded.measures.area *= value;
        break;
    case 4:
        encoded.fit.max = value * encoded.fit.diagonal;
        break;
    default:
        encoded.distortion.symmetric_dirichlet = value;
    }
    return srnf_encode_judge(&encoded, &subject->report, false, &judgement);
}

static void each_figure_counts(void **state)
{
    struct subject subject = subject_of(meshes_star(10));
    /* Sound, poor and unfaithful values of the fit, volume, area and energy at degree 10. */
    static const double values[4][3] = {
        {0.02, 0.03, 0.17}, {0.96, 0.94, 0.5}, {0.92, 0.88, 0.2}, {30.0, 60.0, 2e5}};
    struct srnf_encoded encoded;
    struct srnf_judgement judgement;
    (void)state;

    encode(&subject, SRNF_PARAMETERIZATION_AREA, 10, &encoded);
    assert_int_equal(srnf_encode_judge(&encoded, &subject.report, false, &judgement),
                     SRNF_FAITHFUL);
    assert_true(judgement.fit == encoded.fit.rms / encoded.fit.diagonal);
    assert_true(fabs(judgement.volume - 1.0) < 0.01 && fabs(judgement.area - 1.0) < 0.02);
    for (size_t which = 0; which < 4; which++) {
        for (size_t k = 0; k < 3; k++) {
            assert_int_equal(changed(&subject, &encoded, which, values[which][k]), k);
        }
        assert_int_equal(changed(&subject, &encoded, which, NAN), SRNF_UNFAITHFUL);
        assert_int_equal(changed(&subject, &encoded, which, (double)INFINITY), SRNF_UNFAITHFUL);
    }
    assert_int_equal(changed(&subject, &encoded, 1, -1.0), SRNF_UNFAITHFUL); /* inside out */
    assert_int_equal(changed(&subject, &encoded, 1, 1.5), SRNF_UNFAITHFUL);
    assert_int_equal(changed(&subject, &encoded, 2, 1.6), SRNF_UNFAITHFUL);

    assert_int_equal(changed(&subject, &encoded, 2, 1.12), SRNF_POOR);
    assert_int_equal(changed(&subject, &encoded, 4, 0.09), SRNF_FAITHFUL);
    assert_int_equal(changed(&subject, &encoded, 4, 0.11), SRNF_POOR);
    assert_int_equal(changed(&subject, &encoded, 4, NAN), SRNF_POOR);

    /* Damped on purpose: it is no reason to refuse it that it is off, but one to say so. */
    assert_int_equal(srnf_encode_judge(&encoded, &subject.report, true, &judgement), SRNF_FAITHFUL);
    encoded.fit.rms = 0.3 * encoded.fit.diagonal;
    encoded.measures.volume *= 0.2;
    assert_int_equal(srnf_encode_judge(&encoded, &subject.report, true, &judgement), SRNF_POOR);
    encoded.distortion.symmetric_dirichlet = 60.0;
    assert_int_equal(srnf_encode_judge(&encoded, &subject.report, true, &judgement), SRNF_POOR);
    encoded.distortion.symmetric_dirichlet = NAN;
    assert_int_equal(srnf_encode_judge(&encoded, &subject.report, true, &judgement),
                     SRNF_UNFAITHFUL);
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&subject.mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sound_shapes_pass),
        cmocka_unit_test(extreme_shapes_are_not_refused),
        cmocka_unit_test(another_shape_is_refused),
        cmocka_unit_test(each_figure_counts),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
