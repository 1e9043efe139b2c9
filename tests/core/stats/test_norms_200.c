/*
 * test_norms_200.c - 200 models of 40, each asked of one more of the same kind: how often p is at
 * or below .05 as a whole, by its parts and for the largest |z| on the map, with and without
 * covariates; and of 50 surfaces that a model has not seen whether the percentiles are uniform.
 *
 * srnfd-test: nightly
 * srnfd-test: timeout 3600
 */
#include "normals.h"

#define N ((size_t)39) /* p is a multiple of 1/40: at most .05 with the probability .05 */
#define RUNS ((size_t)200)
#define FIGURES ((size_t)5)

static void new_ones_are_odd_at_the_level(void **state)
{
    static const char *const names[FIGURES] = {"overall", "residual", "distance", "Mahalanobis",
                                               "largest z"};

    (void)state;
    for (size_t covariates = 0; covariates < 2; covariates++) {
        size_t odd[FIGURES] = {0};
        double percentiles[FIGURES][RUNS];

        for (size_t run = 0; run < RUNS; run++) {
            struct normals a;
            struct srnf_norm_model model;
            struct srnf_norm_options options = srnf_norm_options_defaults();
            struct srnf_score out;
            double age;
            double *f;
            double *q;

            normals_open(&a, N, 0.01, 1000 * covariates + run);
            normals_fit(&a, NULL);
            model = normals_model(&a, covariates == 1);
            f = shapes_doubles(a.g.count);
            q = shapes_doubles(a.size);
            age = 10.0 * test_random_normal(&a.random);
            normals_draw(&a, age, 0.0, f, q);
            options.at = &age;
            options.check = false;
            assert_int_equal(srnf_score(a.g.sht, &model, q, &options, NULL, &out, NULL), SRNF_OK);
            const struct srnf_norm_rank ranks[FIGURES] = {out.overall, out.trait[0], out.trait[1],
                                                          out.trait[2], out.largest};

            for (size_t k = 0; k < FIGURES; k++) {
                odd[k] += ranks[k].p_value <= 0.05 + 1e-9;
                percentiles[k][run] = ranks[k].percentile;
            }
            srnf_score_clear(&out);
            srnf_free(f);
            srnf_free(q);
            normals_close(&a);
        }
        for (size_t k = 0; k < FIGURES; k++) {
            double distance;
            double p;

            assert_int_equal(srnf_norm_uniform(RUNS, percentiles[k], &distance, &p), SRNF_OK);
            printf("# %s, %s covariates: %zu of %zu at or below .05; uniform: p %.3f\n", names[k],
                   covariates ? "with" : "without", odd[k], RUNS, p);
            /* Binomial(200, .05): above 20 with a chance of 1e-3. */
            assert_true(odd[k] <= 20);
            assert_true(k == 0 || odd[k] >= 2);
            assert_true(p > 1e-4);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(new_ones_are_odd_at_the_level),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
