/*
 * test_old_records.c - records that were kept before there were mirror images: nothing in them was
 * mirrored, and what is read says so.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "api/cohorts.h"
#include "api/handler.h"
#include "api/surfaces.h"
#include "store/cohort.h"
#include "store/surface.h"

static void surfaces_are_not_mirrored(void **state)
{
    char old[] = "{\"area\":1.0}", mirrored[] = "{\"area\":1.0,\"mirrored\":true}";
    struct store_surface surface = {.id = "surf-0", .record = old};
    json_t *record = surface_record(&surface);
    (void)state;

    assert_true(json_is_false(json_object_get(record, "mirrored")));
    assert_false(surface_record_mirrored(&surface));
    json_decref(record);
    surface.record = mirrored;
    record = surface_record(&surface);
    assert_true(json_is_true(json_object_get(record, "mirrored")));
    assert_true(surface_record_mirrored(&surface));
    json_decref(record);
}

static void members_are_not_mirrored(void **state)
{
    char old[] = "[{\"id\":\"mesh-0\"},{\"id\":\"mesh-0\",\"mirror\":true}]";
    struct store_cohort cohort = {.record = old};
    json_t *members = cohort_members(&cohort);
    (void)state;

    assert_int_equal(json_array_size(members), 2);
    assert_true(json_is_false(json_object_get(json_array_get(members, 0), "mirror")));
    assert_true(json_is_true(json_object_get(json_array_get(members, 1), "mirror")));
    json_decref(members);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surfaces_are_not_mirrored),
        cmocka_unit_test(members_are_not_mirrored),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
