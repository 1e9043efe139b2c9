/*
 * test_sides.c - which texts name a side of the body, and which two are the left and the right one
 * of the same.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "toolkit/sides.h"

static const struct {
    const char *text;
    enum side side;
    const char *rest;
} texts[] = {
    {"L", SIDE_LEFT, ""},
    {"right", SIDE_RIGHT, ""},
    {"RIGHT", SIDE_RIGHT, ""},
    {"L_hippocampus", SIDE_LEFT, "hippocampus"},
    {"hippocampus_l", SIDE_LEFT, "hippocampus"},
    {"hippocampus_R.ply", SIDE_RIGHT, "hippocampus ply"},
    {"Left-Hippocampus", SIDE_LEFT, "hippocampus"},
    {"Right Cerebellum (cortex)", SIDE_RIGHT, "cerebellum cortex"},
    {"ctx-rh-superiorfrontal", SIDE_RIGHT, "ctx superiorfrontal"},
    {"lh.pial", SIDE_LEFT, "pial"},
    {"LHPial", SIDE_LEFT, "pial"},
    {"rhemi.white", SIDE_RIGHT, "white"},
    {"sub-07_hemi-R_white", SIDE_RIGHT, "sub 07 hemi white"},
    {"hippocampusL", SIDE_LEFT, "hippocampus"},
    {"leftThalamus", SIDE_LEFT, "thalamus"},
    {"RHippocampus", SIDE_RIGHT, "hippocampus"},
    {"femur 12R", SIDE_RIGHT, "femur 12"},
    {"left2", SIDE_LEFT, "2"},
    {"Lt kidney", SIDE_LEFT, "kidney"},
    {"lh.L_amygdala", SIDE_LEFT, "amygdala"},
    {"f\xc3\xa9mur_L", SIDE_LEFT, "f\xc3\xa9mur"},
    /* no side */
    {"", SIDE_NONE, ""},
    {"hippocampus", SIDE_NONE, ""},
    {"model", SIDE_NONE, ""},
    {"liver", SIDE_NONE, ""},
    {"LV", SIDE_NONE, ""},
    {"RV_endo", SIDE_NONE, ""},
    {"bright", SIDE_NONE, ""},
    {"leftover", SIDE_NONE, ""},
    {"upright", SIDE_NONE, ""},
    {"L5", SIDE_NONE, ""},
    {"vertebra_L3", SIDE_NONE, ""},
    {"R2star", SIDE_NONE, ""},
    {"lateral", SIDE_NONE, ""},
    {"rest_run1", SIDE_NONE, ""},
    {"lh1n", SIDE_LEFT, "1n"}, /* words end before the digit: of no harm without an rh1n */
    {"control", SIDE_NONE, ""},
    {"RL", SIDE_NONE, ""},
    {"XL", SIDE_NONE, ""},
    {"left-right difference", SIDE_NONE, ""},
    {"L_minus_R", SIDE_NONE, ""},
    {"\xc3\xa9l", SIDE_NONE, ""},
    {"l\xc3\xa9", SIDE_NONE, ""},
};

static void words_are_sides_only_as_a_whole(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct side_reading reading = side_read(texts[i].text);

        if (reading.side != texts[i].side || strcmp(reading.rest, texts[i].rest) != 0) {
            fail_msg("\"%s\" is read as side %d of \"%s\", not %d of \"%s\"", texts[i].text,
                     (int)reading.side, reading.rest, (int)texts[i].side, texts[i].rest);
        }
    }
    assert_int_equal(side_read(NULL).side, SIDE_NONE);
}

static void long_texts_fit_or_have_no_side(void **state)
{
    char text[SIDES_TEXT_MAX + 2];
    struct side_reading reading;
    (void)state;

    for (size_t i = 0; i < SIDES_TEXT_MAX + 1; i++) {
        text[i] = i % 2 ? '1' : 'X'; /* a word each but the last: X1X1.. is cut before every X */
    }
    text[0] = 'L';
    text[1] = '_';
    text[SIDES_TEXT_MAX] = '\0';
    reading = side_read(text);
    assert_int_equal(reading.side, SIDE_LEFT);
    assert_true(strlen(reading.rest) > SIDES_TEXT_MAX);
    assert_true(strlen(reading.rest) < SIDES_REST_MAX);
    text[SIDES_TEXT_MAX] = 'X';
    text[SIDES_TEXT_MAX + 1] = '\0';
    assert_int_equal(side_read(text).side, SIDE_NONE);
}

static bool opposite(const char *a, const char *b)
{
    struct side_reading first = side_read(a), second = side_read(b);

    return sides_opposite(&first, &second);
}

static void opposites_agree_in_all_but_the_side(void **state)
{
    (void)state;
    assert_true(opposite("L_hippocampus", "R_hippocampus"));
    assert_true(opposite("lh.pial", "rh.pial"));
    assert_true(opposite("left", "R"));
    assert_true(opposite("hippocampus_l", "Right-Hippocampus"));
    assert_false(opposite("L_hippocampus", "L_hippocampus"));
    assert_false(opposite("L_hippocampus", "R_thalamus"));
    assert_false(opposite("L. Jones", "R. Smith"));
    assert_false(opposite("L_hippocampus", "hippocampus"));
    assert_false(opposite("hippocampus", "hippocampus"));
    assert_false(opposite("LV", "RV"));
    assert_false(opposite("L5", "R5"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(words_are_sides_only_as_a_whole),
        cmocka_unit_test(long_texts_fit_or_have_no_side),
        cmocka_unit_test(opposites_agree_in_all_but_the_side),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
