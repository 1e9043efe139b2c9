/*
 * test_every_allocation.c - public functions whose memory runs out, on inputs so small that every
 * request can be refused in turn, alone and with all after it: the call says SRNF_ENOMEM, nothing
 * stays allocated, what the caller handed in is untouched or empty, and the next call succeeds.
 *
 * Functions that have a test of the kind beside their other ones are not repeated here, but for
 * routes through them that those do not take; tests/lint/lint.sh sees to it that none is left out.
 * srnfd-test: slow
 */
#include "core/registration/registrations.h"
#include "core/stats/group.h"
#include "support/refusing.h"

#define DEGREE ((size_t)4)
#define N ((size_t)3)
#define EACH ((size_t)50)   /* requests refused one by one; make faults refuses all */
#define STRIDE ((size_t)23) /* between those after them */

/* What the runs work on. */
static struct group g;
static struct srnf_mesh ball, box;
static struct srnf_register_options rigid, warping;
static struct srnf_registration registered; /* g.f[1] to g.f[0] */
static struct srnf_warp chain;              /* links of every kind, of two degrees */
static double *field;                       /* q of g.f[0] */
static double *nearby;                      /* g.f[0], changed by parts of a thousand */
static double *out;                         /* as large as any output */
static size_t out_size;
static unsigned char *checkpoint;
static size_t checkpoint_size;

/* ---- What is left in outputs ----------------------------------------------------------------- */

#define UNTOUCHED (-7.25)

static void mark(void)
{
    for (size_t i = 0; i < out_size; i++) {
        out[i] = UNTOUCHED;
    }
}

/* All of it after a failure; after a success the first `written` are numbers. */
static int marked(int status, size_t written)
{
    for (size_t i = 0; i < out_size; i++) {
        assert_true(status < 0 || i >= written ? out[i] == UNTOUCHED : isfinite(out[i]));
    }
    return status;
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

static int run_measure(void)
{
    struct srnf_surface_measures measures;

    return srnf_surfaces_measure(g.sht, 1, g.f[0], NULL, &measures);
}

static int run_normalize(void)
{
    double log_scale = UNTOUCHED;
    int status;

    mark();
    status = srnf_normalize(g.sht, g.f[0], out, &log_scale);
    assert_int_equal(log_scale == UNTOUCHED, status < 0);
    return marked(status, g.count);
}

static int run_ellipsoid(void)
{
    mark();
    return marked(srnf_align_ellipsoid(g.sht, g.f[0], out), g.count);
}

static int run_triangulate(void)
{
    struct srnf_mesh mesh = {0};
    int status = srnf_surface_triangulate(DEGREE, g.f[0], 2, &mesh, NULL);

    assert_int_equal(mesh.vertices == NULL, status < 0);
    srnf_mesh_clear(&mesh);
    return status;
}

static int run_velocity(void)
{
    mark();
    return marked(srnf_velocity_toward(g.sht, g.f[0], g.f[1], out), 3 * g.points);
}

static int run_icp(void)
{
    struct srnf_icp result;
    struct srnf_error error = {0};
    int status = srnf_icp(&ball, &box, NULL, NULL, &result, &error);

    assert_true(status < 0 ? error.status == status : result.distance > 0.0);
    return status;
}

static int run_buffer(void)
{
    static const char text[3000];
    struct srnf_buffer buffer = {0};
    int status = SRNF_OK;
    size_t size = 0;

    for (size_t k = 0; k < 9 && status == SRNF_OK; k++) {
        status = srnf_buffer_append(&buffer, text, sizeof text);
        size += status == SRNF_OK ? sizeof text : 0;
        assert_int_equal(buffer.size, size); /* a refusal loses nothing of what was there */
    }
    srnf_buffer_clear(&buffer);
    return status;
}

/* ---- Inversion and paths --------------------------------------------------------------------- */

static int invert_by(enum srnf_inversion_method method, enum srnf_initial initial)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_inversion result;
    struct srnf_error error = {0};
    int status;

    options.method = method;
    options.initial = initial;
    options.surface = initial == SRNF_INITIAL_SURFACE ? g.f[1] : NULL;
    status = srnf_invert(g.sht, field, &options, NULL, &result, &error);
    assert_true(status >= 0 || (!result.coefficients && !result.history));
    assert_true(status >= 0 || error.status == status);
    srnf_inversion_clear(&result);
    return status;
}

static int run_gauss_newton(void)
{
    return invert_by(SRNF_INVERT_GAUSS_NEWTON, SRNF_INITIAL_SURFACE);
}

static int run_closed_form(void)
{
    return invert_by(SRNF_INVERT_CLOSED_FORM, SRNF_INITIAL_AUTO);
}

static int geodesic_by(enum srnf_geodesic_method method)
{
    struct srnf_geodesic_options options = {.method = method, .steps = 3};
    struct srnf_geodesic result;
    int status = srnf_geodesic(g.sht, g.f[0], g.f[1], &options, NULL, &result, NULL);

    assert_true(status >= 0 || (!result.coefficients && !result.times));
    srnf_geodesic_clear(&result);
    return status;
}

static int run_path_of_closed_forms(void)
{
    return geodesic_by(SRNF_GEODESIC_CLOSED_FORM);
}

static int run_straight_line(void)
{
    return geodesic_by(SRNF_GEODESIC_LINEAR);
}

static int run_log(void)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_error error = {0};
    int status;

    options.segments = 2;
    mark();
    status = srnf_pullback_log(g.sht, g.f[0], g.f[1], &options, NULL, out, NULL, &error);
    assert_true(status >= 0 || error.status == status);
    return marked(status, g.count);
}

static int run_transfer(void)
{
    struct srnf_transferred transferred;
    int status = srnf_transfer(g.sht, g.f[0], g.f[1], g.f[2], SRNF_TRANSFER_ABSOLUTE, NULL,
                               &transferred, NULL);

    assert_true(status >= 0 || !transferred.coefficients);
    srnf_transferred_clear(&transferred);
    return status;
}

/* ---- Registration ---------------------------------------------------------------------------- */

static int register_with(const struct srnf_register_options *options, bool by_field,
                         const struct srnf_registration *warm)
{
    struct srnf_registration r;
    struct srnf_error error = {0};
    int status = srnf_register(g.sht, by_field ? NULL : g.f[0], by_field ? field : NULL, g.f[1],
                               options, warm, NULL, &r, &error);

    assert_true(status >= 0 || (!r.coefficients && !r.q && !r.points && !r.warp.links));
    assert_true(status >= 0 || error.status == status);
    srnf_registration_clear(&r);
    return status;
}

static int run_rigid(void)
{
    return register_with(&rigid, false, NULL);
}

static int run_register_to_field(void)
{
    return register_with(&warping, true, NULL);
}

static int run_register_on(void)
{
    return register_with(&warping, false, &registered);
}

/* Nearly the same surface: near enough for exact mode to polish. */
static int run_exact(void)
{
    struct srnf_register_options options = rigid;
    struct srnf_registration r;
    int status;

    options.reparameterization = options.exact = true;
    options.degree = 2;
    status = srnf_register(g.sht, g.f[0], NULL, nearby, &options, NULL, NULL, &r, NULL);
    assert_true(status >= 0 || !r.coefficients);
    srnf_registration_clear(&r);
    return status;
}

static int run_square_root_maps(void)
{
    struct srnf_register_options options = warping;

    options.representation = SRNF_REPRESENTATION_SRM;
    return register_with(&options, false, NULL);
}

static int run_apply(void)
{
    mark();
    return marked(srnf_registration_apply(g.sht, &registered, g.f[2], NULL, out), g.count);
}

static int run_warp(void)
{
    const double points[2][3] = {{0.0, 0.6, 0.8}, {0.0, 0.0, -1.0}};

    mark();
    return marked(srnf_warp_apply(&chain, 2, points[0], out, out + 6), 8);
}

static int run_points(void)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh_report report;
    struct srnf_error error = {0};
    double *points;
    size_t index = refusing.refused;
    int status;

    refusing_none();
    assert_int_equal(srnf_mesh_prepare(&box, false, &report), SRNF_OK);
    points = shapes_doubles(3 * box.n_vertices);
    options.degree = 4;
    refusing_at(index);
    status = srnf_encode_points(&box, &report, &options, NULL, points, &error);
    assert_true(status >= 0 || error.status == status);
    srnf_free(points);
    return status;
}

static int run_between(void)
{
    struct srnf_warp warp;
    int status = srnf_warp_between(&ball, ball.vertices, ball.vertices, 3, NULL, &warp);

    assert_true(status >= 0 || warp.n_links == 0);
    srnf_warp_clear(&warp);
    return status;
}

static int run_join(void)
{
    struct srnf_warp warp = {0};
    int status = srnf_warp_join(&chain, &warp);

    assert_true(status < 0 || warp.n_links == chain.n_links);
    srnf_warp_clear(&warp);
    return status;
}

static int run_known(void)
{
    struct srnf_registration r;
    struct srnf_error error = {0};
    int status = srnf_register_known(g.sht, g.f[0], g.f[1], &warping, &chain, NULL, &r, &error);

    assert_true(status >= 0 || (!r.coefficients && error.status == status));
    srnf_registration_clear(&r);
    return status;
}

/* ---- Groups ---------------------------------------------------------------------------------- */

static int metric_by(enum srnf_metric metric, const struct srnf_register_options *registration)
{
    struct srnf_error error = {0};
    int status =
        srnf_metric_distances(g.sht, metric, 2, g.surfaces, registration, NULL, out, &error);

    assert_true(status >= 0 || error.status == status);
    return status;
}

static int run_elastic_metric(void)
{
    return metric_by(SRNF_METRIC_SRNF, &rigid);
}

static int run_square_root_metric(void)
{
    return metric_by(SRNF_METRIC_SRM, NULL);
}

static int run_closest_points_as_they_stand(void)
{
    return metric_by(SRNF_METRIC_ICP, NULL);
}

static int run_shared_folds(void)
{
    struct srnf_folds_options options = srnf_folds_options_defaults();
    struct srnf_folds c;
    int status;

    options.registration = warping;
    options.refit = SRNF_REFIT_SHARED;
    options.max_components = 1;
    status = srnf_folds_compare(g.sht, SRNF_METRIC_SRNF, N, g.surfaces, &options, NULL, &c, NULL);
    assert_int_equal(c.distances == NULL, status < 0);
    srnf_folds_clear(&c);
    return status;
}

static struct srnf_mean_options mean_options(void)
{
    struct srnf_mean_options options = srnf_mean_options_defaults();

    options.registration = &warping;
    options.max_iterations = 2;
    options.tolerance = 0.0;
    return options;
}

static int run_resumed_mean(void)
{
    struct srnf_mean_options options = mean_options();
    struct srnf_mean mean;
    int status;

    options.resume = checkpoint;
    options.resume_size = checkpoint_size;
    status = srnf_karcher_mean(g.sht, N, g.surfaces, &options, NULL, &mean, NULL);
    assert_int_equal(mean.mean_q == NULL, status < 0);
    srnf_mean_clear(&mean);
    return status;
}

/* ---- The table ------------------------------------------------------------------------------- */

static void survives_each_refusal(void **state)
{
    static const struct {
        const char *name;
        int (*run)(void);
    } subjects[] = {
        {"srnf_normalize", run_normalize},
        {"srnf_align_ellipsoid", run_ellipsoid},
        {"srnf_surface_triangulate, no normals", run_triangulate},
        {"srnf_surfaces_measure", run_measure},
        {"srnf_velocity_toward", run_velocity},
        {"srnf_icp", run_icp},
        {"srnf_buffer_append", run_buffer},
        {"srnf_invert, Gauss-Newton from a surface", run_gauss_newton},
        {"srnf_invert, closed form", run_closed_form},
        {"srnf_geodesic, closed form", run_path_of_closed_forms},
        {"srnf_geodesic, linear", run_straight_line},
        {"srnf_pullback_log", run_log},
        {"srnf_transfer, absolute", run_transfer},
        {"srnf_register, rotations", run_rigid},
        {"srnf_register, to a field", run_register_to_field},
        {"srnf_register, warm", run_register_on},
        {"srnf_register, exact", run_exact},
        {"srnf_register, square-root maps", run_square_root_maps},
        {"srnf_registration_apply", run_apply},
        {"srnf_warp_apply", run_warp},
        {"srnf_encode_points", run_points},
        {"srnf_warp_between", run_between},
        {"srnf_warp_join", run_join},
        {"srnf_register_known", run_known},
        {"srnf_metric_distances, srnf", run_elastic_metric},
        {"srnf_metric_distances, srm as parameterized", run_square_root_metric},
        {"srnf_metric_distances, icp as it stands", run_closest_points_as_they_stand},
        {"srnf_folds_compare, shared", run_shared_folds},
        {"srnf_karcher_mean, resumed", run_resumed_mean},
    };
    (void)state;

    for (size_t k = 0; k < sizeof subjects / sizeof subjects[0]; k++) {
        refusing_sweep(subjects[k].name, subjects[k].run, EACH, STRIDE);
        refusing.lasting = true;
        refusing_sweep(subjects[k].name, subjects[k].run, 4, STRIDE);
        refusing.lasting = false;
    }
}

/* ---- Set-up ---------------------------------------------------------------------------------- */

static void keep_first(void *user, const void *bytes, size_t size)
{
    (void)user;
    if (!checkpoint) {
        checkpoint = malloc(size);
        assert_non_null(checkpoint);
        memcpy(checkpoint, bytes, size);
        checkpoint_size = size;
    }
}

static void open_chain(void)
{
    double potentials[2 * 9] = {0};

    potentials[2] = 0.1;
    potentials[9 + 5] = 0.05;
    registrations_warp(NULL, 1.0, &chain);
    assert_int_equal(warp_append(&chain, SRNF_WARP_EXP, 2, potentials), SRNF_OK);
    assert_int_equal(warp_append(&chain, SRNF_WARP_EXP_INVERSE, 1, potentials), SRNF_OK);
}

static void open_inputs(void)
{
    struct srnf_mean_options options;
    struct srnf_mean mean;
    void *workspace;

    group_open_stars(&g, DEGREE, N, 0.3);
    ball = meshes_sphere(2);
    box = meshes_box(1.0, 1.5, 2.0);
    out_size = 3 * g.points + g.count;
    out = shapes_doubles(out_size);
    field = shapes_doubles(3 * g.points);
    workspace = srnf_alloc(1, srnf_surface_workspace_size(g.sht));
    assert_non_null(workspace);
    srnf_field(g.sht, g.f[0], field, workspace);
    srnf_free(workspace);
    nearby = shapes_doubles(g.count);
    for (size_t i = 0; i < g.count; i++) {
        nearby[i] = (1.0 + 1e-3 * (double)(i % 3)) * g.f[0][i];
    }
    rigid = srnf_register_options_defaults();
    rigid.reparameterization = false;
    rigid.start = SRNF_START_IDENTITY;
    warping = srnf_register_options_defaults();
    warping.degree = 2;
    warping.common_pose = true;
    assert_int_equal(
        srnf_register(g.sht, g.f[0], NULL, g.f[1], &warping, NULL, NULL, &registered, NULL),
        SRNF_OK);
    open_chain();
    options = mean_options();
    options.checkpoint = keep_first;
    assert_true(srnf_karcher_mean(g.sht, N, g.surfaces, &options, NULL, &mean, NULL) >= 0);
    srnf_mean_clear(&mean);
}

static void close_inputs(void)
{
    free(checkpoint);
    srnf_warp_clear(&chain);
    srnf_registration_clear(&registered);
    srnf_free(nearby);
    srnf_free(field);
    srnf_free(out);
    srnf_mesh_clear(&box);
    srnf_mesh_clear(&ball);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(survives_each_refusal),
    };
    int failed;

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    open_inputs();
    failed = cmocka_run_group_tests(tests, NULL, NULL);
    close_inputs();
    return failed;
}
