/*
 * test_encode_fails.c - the route area where the map to the sphere fails on the numbers. No mesh is
 * known for which it does, so this program brings its own srnf_spherical_map: no other route takes
 * its place unasked, and the message names the one that would do.
 */
#include "core/figures.h"
#include "support/meshes.h"

#include <string.h>

int srnf_spherical_map(const struct srnf_mesh *mesh, const struct srnf_context *context,
                       struct srnf_spherical_map *map, struct srnf_error *error)
{
    (void)mesh;
    (void)context;
    *map = (struct srnf_spherical_map){0};
    *error =
        (struct srnf_error){.status = SRNF_ENUMERIC, .element = 7, .message = "face 7 is flat"};
    return SRNF_ENUMERIC;
}

static int encode(struct srnf_mesh *mesh, enum srnf_parameterization route,
                  struct srnf_encoded *encoded, struct srnf_error *error)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh_report report;

    options.degree = 8;
    options.parameterization = route;
    *error = (struct srnf_error){0};
    assert_int_equal(srnf_mesh_prepare(mesh, false, &report), SRNF_OK);
    return srnf_encode(mesh, &report, &options, NULL, encoded, error);
}

static void no_other_route_takes_its_place(void **state)
{
    struct srnf_mesh mesh = meshes_star(8);
    struct srnf_encoded encoded;
    struct srnf_error error;
    (void)state;

    assert_int_equal(encode(&mesh, SRNF_PARAMETERIZATION_AUTO, &encoded, &error), SRNF_ENUMERIC);
    assert_null(encoded.coefficients);
    assert_int_equal(error.element, 7);
    assert_non_null(strstr(error.message, "face 7 is flat; "));
    assert_non_null(strstr(error.message, "the route star would do"));
    assert_int_equal(encode(&mesh, SRNF_PARAMETERIZATION_STAR, &encoded, &error), SRNF_OK);
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
}

static void star_is_not_named_where_it_would_not_do(void **state)
{
    struct srnf_mesh mesh = meshes_bent_capsule(6.0, 0.4, 4.0, 40, 16);
    struct srnf_encoded encoded;
    struct srnf_error error;
    (void)state;

    assert_int_equal(encode(&mesh, SRNF_PARAMETERIZATION_AUTO, &encoded, &error), SRNF_ENUMERIC);
    assert_string_equal(error.message, "face 7 is flat");
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_other_route_takes_its_place),
        cmocka_unit_test(star_is_not_named_where_it_would_not_do),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
