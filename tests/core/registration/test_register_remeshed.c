/*
 * test_register_remeshed.c - the registered distance is one between surfaces, not between meshes:
 * a real structure meshed anew (each face cut into four, edges flipped, vertices shaken by 1e-3 of
 * the diagonal) lies within little of itself, by area and by star, against the distance between
 * two structures.
 *
 * What is left has three causes: the piecewise flat surface is another one where edges are flipped
 * or vertices moved; the map to the sphere is another one, which registration undoes up to its
 * penalty; and the harmonic series of a surface depends on its parameterization where it is cut.
 * srnfd-test: slow
 * srnfd-test: no-asan (test_register_known.c runs its code)
 */
#include "registrations.h"
#include "support/triangulations.h"

#define DEGREE 15
/* Limits on the squared distance to the surface itself, against that to the other side's. */
#define LIMIT 0.01
#define ROUNDING 1e-12
#define SHAKE 1e-3 /* of the diagonal of the bounding box */

/* One from each hemisphere, which is the scale on which a distance is small. The pallidum is no
   longer star-shaped when it is shaken or its edges are flipped: by star it is cut in four only. */
static const struct {
    const char *name, *other;
    enum srnf_parameterization route;
} structures[] = {
    {REGISTRATIONS_LOCAL "L_thalamus.ply", REGISTRATIONS_LOCAL "R_thalamus.ply",
     SRNF_PARAMETERIZATION_AREA},
    {REGISTRATIONS_LOCAL "L_pallidum.ply", REGISTRATIONS_LOCAL "R_pallidum.ply",
     SRNF_PARAMETERIZATION_STAR},
    {REGISTRATIONS_LOCAL "L_hippocampus.ply", REGISTRATIONS_LOCAL "R_hippocampus.ply",
     SRNF_PARAMETERIZATION_AREA},
};
#define STRUCTURES (FIGURES_SLOW ? 1 : sizeof structures / sizeof structures[0])

static double diagonal(const struct srnf_mesh *mesh)
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double low = INFINITY;
        double high = -INFINITY;

        for (size_t i = 0; i < mesh->n_vertices; i++) {
            low = compare_min(low, mesh->vertices[3 * i + k]);
            high = compare_max(high, mesh->vertices[3 * i + k]);
        }
        sum += (high - low) * (high - low);
    }
    return sqrt(sum);
}

/* Each returns a mesh of its own. */
static struct srnf_mesh subdivided(const struct srnf_mesh *mesh, struct test_random *random)
{
    (void)random;
    return triangulations_subdivided(mesh);
}

/* A tenth of the edges, of a mesh fine enough for that to be another mesh of the same surface. */
static struct srnf_mesh flipped(const struct srnf_mesh *mesh, struct test_random *random)
{
    struct srnf_mesh copy = triangulations_subdivided(mesh);

    triangulations_flip_edges(&copy, copy.n_faces * 3 / 20, random);
    return copy;
}

static struct srnf_mesh shaken(const struct srnf_mesh *mesh, struct test_random *random)
{
    struct srnf_mesh copy = meshes_copy(mesh);

    triangulations_jitter(&copy, SHAKE * diagonal(mesh), random);
    return copy;
}

static const struct {
    const char *name;
    struct srnf_mesh (*make)(const struct srnf_mesh *mesh, struct test_random *random);
    bool stays_star;
} remeshings[] = {{"shaken", shaken, false},
                  {"each face in four", subdivided, true},
                  {"flipped", flipped, false}};
#define REMESHINGS (FIGURES_SLOW ? 1 : sizeof remeshings / sizeof remeshings[0])

static void encode(struct srnf_mesh *mesh, enum srnf_parameterization route,
                   struct shapes_surface *s)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;

    options.degree = DEGREE;
    options.parameterization = route;
    assert_int_equal(srnf_mesh_prepare(mesh, false, &report), SRNF_OK);
    assert_int_equal(srnf_encode(mesh, &report, &options, NULL, &encoded, NULL), SRNF_OK);
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    shapes_update(s);
}

/* ||q_a - q_b||^2 registered; before gets that of the surfaces as they are. */
static double squared_distance(const struct shapes_surface *a, const struct shapes_surface *b,
                               double *before)
{
    struct srnf_registration r;
    double square;

    registrations_run(a, NULL, b->f, NULL, &r);
    *before = r.distance_before * r.distance_before;
    square = r.distance * r.distance;
    srnf_registration_clear(&r);
    return square;
}

static void check_structure(size_t k, struct shapes_surface *a, struct shapes_surface *b)
{
    enum srnf_parameterization route = structures[k].route;
    struct test_random random = test_random_seed(41);
    struct srnf_mesh mesh, other;
    double before, scale;

    assert_true(meshes_load(structures[k].name, &mesh));
    assert_true(meshes_load(structures[k].other, &other));
    encode(&other, route, b);
    encode(&mesh, route, a);
    scale = squared_distance(a, b, &before);
    printf("# %s, route %s: the other side's d^2 %.1e\n", strrchr(structures[k].name, '/') + 1,
           srnf_parameterization_name(route), scale);
    for (size_t i = 0; i < REMESHINGS; i++) {
        struct srnf_mesh again;
        double after;

        if (route == SRNF_PARAMETERIZATION_STAR && !remeshings[i].stays_star) {
            continue;
        }
        again = remeshings[i].make(&mesh, &random);
        encode(&again, route, b);
        after = squared_distance(a, b, &before);
        printf("#   %-17s d^2 %.1e, %.2g of the other side's (as it is: %.1e)\n",
               remeshings[i].name, after, after / scale, before);
        assert_true(after <= LIMIT * scale);
        assert_true(after <= before + ROUNDING);
        srnf_mesh_clear(&again);
    }
    srnf_mesh_clear(&mesh);
    srnf_mesh_clear(&other);
}

static void remeshing_changes_little(void **state)
{
    struct shapes_surface a, b;
    (void)state;

    shapes_open(&a, DEGREE);
    shapes_open(&b, DEGREE);
    for (size_t k = 0; k < STRUCTURES; k++) {
        check_structure(k, &a, &b);
    }
    shapes_close(&a);
    shapes_close(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(remeshing_changes_little),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
