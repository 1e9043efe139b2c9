/*
 * test_mesh_types.c - what the server has of each format of meshes that the core knows: a media
 * type and its place among those that messages list.
 * srnfd-test: once (nothing is computed)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "api/handler.h"
#include "api/meshes.h"
#include "srnf/mesh.h"

/* Whether it is a word of the list. */
static bool is_listed(const char *list, const char *name)
{
    char padded[MESH_FORMATS_TEXT + 8], word[80];

    (void)snprintf(padded, sizeof padded, " %s,", list);
    (void)snprintf(word, sizeof word, " %s,", name);
    if (strstr(padded, word)) {
        return true;
    }
    (void)snprintf(word, sizeof word, " %s or ", name);
    return strstr(padded, word) != NULL;
}

static void every_format_is_listed(void **state)
{
    char list[MESH_FORMATS_TEXT];
    size_t commas = 0;
    int count = 0;

    (void)state;
    mesh_formats_named(list);
    for (int format = SRNF_MESH_UNKNOWN + 1;; format++) {
        const char *name = srnf_mesh_format_name((enum srnf_mesh_format)format);

        if (strcmp(name, "unknown") == 0) {
            break;
        }
        count++;
        if (!is_listed(list, name)) {
            fail_msg("%s is not among: %s", name, list);
        }
        assert_non_null(strchr(mesh_media_type(name), '/'));
    }
    for (const char *at = list; *at; at++) {
        commas += *at == ',';
    }
    assert_int_equal(commas + 2, count); /* and nothing else is */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_format_is_listed),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
