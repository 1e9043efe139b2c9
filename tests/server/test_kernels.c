/*
 * test_kernels.c - kernels of OpenBLAS are replaced where it fell back, and by none that the
 * processor cannot run. tests/api/test_daemon.sh has the daemon on this processor.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "main/kernels.h"

static void the_fallback_is_replaced(void **state)
{
    (void)state;
    assert_string_equal(kernels_better("Prescott", (struct kernels_processor){true, true}),
                        "SkylakeX");
    assert_string_equal(kernels_better("Prescott", (struct kernels_processor){true, false}),
                        "Haswell");
    assert_null(kernels_better("Prescott", (struct kernels_processor){false, false}));
}

static void what_openblas_knows_stays(void **state)
{
    static const char *const known[] = {"Haswell",    "Zen",     "SkylakeX",
                                        "Cooperlake", "Nehalem", "armv8"};

    (void)state;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        assert_null(kernels_better(known[i], (struct kernels_processor){true, true}));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_fallback_is_replaced),
        cmocka_unit_test(what_openblas_knows_stays),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
