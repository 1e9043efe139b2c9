/*
 * test_far_members.c - far-from-group of classify: by which methods a member is far, and whether
 * any of them registers.
 */
#include "toolkit/typicality.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define N ((size_t)3)

static const struct typicality_method methods[] = {{"srnf-nn", true}, {"harmonic-nn", false}};

/* The sentence about member 1, which is far by the methods that are told; NULL: there is none.
   json_decref of *warnings. */
static const char *detail_of(size_t n_methods, const bool *far, json_t **warnings)
{
    struct srnf_typicality verdicts[2][3];
    struct srnf_folds_typicality typicality[2];
    json_t *names = json_pack("[s, s, s]", "Ada", "Bo", "Cy");

    *warnings = json_array();
    for (size_t m = 0; m < n_methods; m++) {
        for (size_t i = 0; i < N; i++) {
            bool beyond = i == 1 && far[m];

            verdicts[m][i] = (struct srnf_typicality){.value = beyond ? 0.5 : 0.1,
                                                      .limit = 0.25,
                                                      .percentile = beyond ? 100.0 : 50.0,
                                                      .percentile_interval = {10.0, 100.0},
                                                      .far = beyond};
        }
        typicality[m] = (struct srnf_folds_typicality){
            .n = N, .traits = 1, .trait = {SRNF_TRAIT_NEAREST}, .verdicts = verdicts[m]};
    }
    typicality_warn_members(*warnings, n_methods, typicality,
                            n_methods == 1 ? methods + 1 : methods, names);
    json_decref(names);
    assert_true(json_array_size(*warnings) <= 1);
    return json_string_value(json_object_get(json_array_get(*warnings, 0), "detail"));
}

static void check(size_t n_methods, bool first, bool second, const char *wanted)
{
    const bool far[] = {first, second};
    json_t *warnings;
    const char *detail = detail_of(n_methods, far, &warnings);

    assert_true((detail != NULL) == (wanted != NULL));
    if (wanted) {
        assert_string_equal(detail, wanted);
    }
    json_decref(warnings);
}

static void the_methods_are_named(void **state)
{
    (void)state;
    check(2, false, false, NULL);
    check(2, true, false,
          "Member 1 (Bo) is unlike all other members, of whatever class, by srnf-nn: nearest 0.5 "
          "(limit 0.25). What class it is put into says nothing; see whether it belongs to the "
          "cohort.");
    check(2, true, true,
          "Member 1 (Bo) is unlike all other members, of whatever class, by srnf-nn: nearest 0.5 "
          "(limit 0.25); so by harmonic-nn. What class it is put into says nothing; see whether "
          "it belongs to the cohort.");
}

static void without_registration_nobody_is_put_out(void **state)
{
    (void)state;
    check(2, false, true,
          "Member 1 (Bo) is unlike all other members, of whatever class, by harmonic-nn: nearest "
          "0.5 (limit 0.25). Only methods that do not register find it so: it may lie or be "
          "parameterized otherwise than they do, and be of the same shape.");
    check(1, true, false,
          "Member 1 (Bo) is unlike all other members, of whatever class, by harmonic-nn: nearest "
          "0.5 (limit 0.25). No method that registers was asked: it may lie or be parameterized "
          "otherwise than they do, and be of the same shape.");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_methods_are_named),
        cmocka_unit_test(without_registration_nobody_is_put_out),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
