/*
 * transfers.c - reading the pairs, guessing, and measuring against the truth.
 */
#include "support/transfers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "surface/fit.h"
#include "support/correspondence.h"
#include "support/folders.h"
#include "support/meshes.h"
#include "support/shapes.h"

#define RESOLUTION 24 /* edge divisions of the icosahedron on which surfaces are compared */

const char *const transfers_names[TRANSFERS_WAYS] = {
    [TRANSFERS_NOTHING] = "own end diastole",
    [TRANSFERS_DISPLACEMENT] = "displacement of vertices",
    [TRANSFERS_DISPLACEMENT_RATIO] = "the same, size apart",
    [TRANSFERS_SRNF] = "transfer of SRNFs",
    [TRANSFERS_SRNF_RATIO] = "the same, size apart",
    [TRANSFERS_SRNF_REGISTERED] = "the same, registered",
};

static void must(bool condition, const char *what)
{
    if (!condition) {
        (void)fprintf(stderr, "transfers: %s failed\n", what);
        abort();
    }
}

/* ---- Reading --------------------------------------------------------------------------------- */

/* Meshes of end diastole and end systole of each subject, in turn; how many subjects. */
static size_t load(struct transfers *t, const char *data, struct srnf_mesh *meshes)
{
    static const char suffix[] = "_es_endo.ply";
    char *paths[FOLDERS_FILES_MAX];
    char folder[256];
    size_t n;

    (void)snprintf(folder, sizeof folder, "%s/lv_pairs", data);
    n = folders_list(folder, paths);

    for (size_t i = 0; i < n; i++) {
        const char *name = folders_name(paths[i]);
        size_t length = strlen(name);
        char diastole[512];

        if (t->n < TRANSFERS_SUBJECTS && strncmp(name, "lv_", 3) == 0 &&
            length > sizeof suffix - 1 && length < 60 &&
            strcmp(name + length - (sizeof suffix - 1), suffix) == 0) {
            char *subject = t->subjects[t->n].name;

            memcpy(subject, name, length - (sizeof suffix - 1));
            (void)snprintf(diastole, sizeof diastole, "%s/lv_endocardium_ed/%s.ply", data, subject);
            must(meshes_load(diastole, &meshes[2 * t->n]) &&
                     meshes_load(paths[i], &meshes[2 * t->n + 1]),
                 "reading a pair");
            t->n++;
        }
        free(paths[i]);
    }
    return t->n;
}

/* By the star route, in its place and size. */
static void encode(const struct transfers *t, const struct srnf_mesh *mesh, double *f)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh copy = meshes_copy(mesh);
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;

    options.degree = t->degree;
    options.parameterization = SRNF_PARAMETERIZATION_STAR;
    options.unit_area = false;
    must(srnf_mesh_prepare(&copy, false, &report) == SRNF_OK &&
             srnf_encode(&copy, &report, &options, NULL, &encoded, NULL) == SRNF_OK,
         "encoding");
    for (size_t i = 0; i < t->count; i++) {
        f[i] = encoded.coefficients[i] / TRANSFERS_UNIT;
    }
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&copy);
}

bool transfers_open(struct transfers *t, const char *data, size_t degree)
{
    struct srnf_mesh meshes[2 * TRANSFERS_SUBJECTS];
    double *f[2 * TRANSFERS_SUBJECTS];

    *t = (struct transfers){.degree = degree, .count = 3 * srnf_coefficient_count(degree)};
    if (load(t, data, meshes) == 0) {
        return false;
    }
    must(srnf_sht_create(&t->sht, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0) == SRNF_OK,
         "the transform");
    for (size_t i = 0; i < t->n; i++) {
        struct transfers_subject *s = &t->subjects[i];

        f[2 * i] = s->diastole = shapes_doubles(t->count);
        f[2 * i + 1] = s->systole = shapes_doubles(t->count);
        s->star_diastole = shapes_doubles(t->count);
        s->star_systole = shapes_doubles(t->count);
        encode(t, &meshes[2 * i], s->star_diastole);
        encode(t, &meshes[2 * i + 1], s->star_systole);
    }
    must(correspondence_surfaces(t->sht, 2 * t->n, meshes, TRANSFERS_UNIT, f),
         "the correspondence");
    for (size_t i = 0; i < 2 * t->n; i++) {
        srnf_mesh_clear(&meshes[i]);
    }
    return true;
}

void transfers_close(struct transfers *t)
{
    for (size_t i = 0; i < t->n; i++) {
        srnf_free(t->subjects[i].diastole);
        srnf_free(t->subjects[i].systole);
        srnf_free(t->subjects[i].star_diastole);
        srnf_free(t->subjects[i].star_systole);
    }
    srnf_sht_destroy(t->sht);
}

/* ---- Guessing -------------------------------------------------------------------------------- */

static struct srnf_surface_measures measure(const struct transfers *t, const double *f)
{
    struct srnf_surface_measures measures;
    void *workspace = shapes_doubles(srnf_surface_workspace_size(t->sht) / sizeof(double) + 1);

    srnf_surface_measure(t->sht, f, &measures, workspace);
    srnf_free(workspace);
    return measures;
}

static double transfer(const struct transfers *t, const double *source, const double *deformed,
                       const double *target, enum srnf_transfer_size size, double *guess)
{
    struct srnf_transferred result;
    double transforms;

    must(srnf_transfer(t->sht, source, deformed, target, size, NULL, &result, NULL) == SRNF_OK,
         "a transfer");
    memcpy(guess, result.coefficients, t->count * sizeof(double));
    transforms = result.transforms;
    srnf_transferred_clear(&result);
    return transforms;
}

/* As the process transfer registers: deformed to source, then both along with source to target. */
static double transfer_registered(const struct transfers *t, const struct transfers_subject *from,
                                  const double *target, double *guess)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration to_source;
    struct srnf_registration to_target;
    double transforms;

    options.common_pose = true;
    must(srnf_register(t->sht, from->star_diastole, NULL, from->star_systole, &options, NULL, NULL,
                       &to_source, NULL) == SRNF_OK &&
             srnf_register(t->sht, target, NULL, from->star_diastole, &options, NULL, NULL,
                           &to_target, NULL) == SRNF_OK &&
             srnf_registration_apply(t->sht, &to_target, to_source.coefficients, NULL,
                                     to_source.coefficients) == SRNF_OK,
         "a registration");
    transforms = transfer(t, to_target.coefficients, to_source.coefficients, target,
                          SRNF_TRANSFER_RATIO, guess);
    srnf_registration_clear(&to_target);
    srnf_registration_clear(&to_source);
    return transforms;
}

/* target + (deformed - source) between shapes of unit area, then the size by the ratio. */
static void displace_by_ratio(const struct transfers *t, const struct transfers_subject *from,
                              const double *target, double *guess)
{
    double source = sqrt(measure(t, from->diastole).area);
    double deformed = sqrt(measure(t, from->systole).area);
    double own = sqrt(measure(t, target).area);
    double size;

    for (size_t i = 0; i < t->count; i++) {
        guess[i] = target[i] / own + from->systole[i] / deformed - from->diastole[i] / source;
    }
    size = own * deformed / source / sqrt(measure(t, guess).area);
    for (size_t i = 0; i < t->count; i++) {
        guess[i] *= size;
    }
}

double transfers_guess(const struct transfers *t, size_t from, size_t to, enum transfers_way way,
                       double *guess)
{
    const struct transfers_subject *a = &t->subjects[from];
    const struct transfers_subject *b = &t->subjects[to];
    double factor = way == TRANSFERS_DISPLACEMENT ? 1.0 : 0.0;

    if (way == TRANSFERS_SRNF_REGISTERED) {
        return transfer_registered(t, a, b->star_diastole, guess);
    }
    if (way == TRANSFERS_SRNF || way == TRANSFERS_SRNF_RATIO) {
        return transfer(t, a->diastole, a->systole, b->diastole,
                        way == TRANSFERS_SRNF ? SRNF_TRANSFER_ABSOLUTE : SRNF_TRANSFER_RATIO,
                        guess);
    }
    if (way == TRANSFERS_DISPLACEMENT_RATIO) {
        displace_by_ratio(t, a, b->diastole, guess);
        return 0.0;
    }
    for (size_t i = 0; i < t->count; i++) {
        guess[i] = b->diastole[i] + factor * (a->systole[i] - a->diastole[i]);
    }
    return 0.0;
}

/* ---- Measuring ------------------------------------------------------------------------------- */

/* About its centroid, in mm. */
static double *centred(const struct transfers *t, const double *f)
{
    struct srnf_surface_measures measures = measure(t, f);
    double *own = shapes_doubles(t->count);

    for (size_t i = 0; i < t->count; i++) {
        double shift = i % (t->count / 3) == 0
                           ? sqrt(4.0 * acos(-1.0)) * measures.centroid[i / (t->count / 3)]
                           : 0.0;

        own[i] = TRANSFERS_UNIT * (f[i] - shift);
    }
    return own;
}

/* With the area of the truth as weight: |q|^2 is its density. */
static double point_error(const struct transfers *t, const double *truth, const double *guess)
{
    const struct srnf_grid *grid = srnf_sht_grid(t->sht);
    size_t points = grid->n_theta * grid->n_phi;
    double *difference = shapes_doubles(t->count);
    double *values = shapes_doubles(6 * points);
    double *q = values + 3 * points;
    void *workspace = shapes_doubles(srnf_surface_workspace_size(t->sht) / sizeof(double) + 1);
    void *synthesis = shapes_doubles(srnf_sht_workspace_size(t->sht, 3) / sizeof(double) + 1);
    double sum = 0.0;
    double area = 0.0;

    for (size_t i = 0; i < t->count; i++) {
        difference[i] = guess[i] - truth[i];
    }
    srnf_sht_synthesis(t->sht, 3, difference, values, synthesis);
    srnf_field(t->sht, truth, q, workspace);
    for (size_t i = 0; i < points; i++) {
        double density = 0.0;
        double square = 0.0;

        for (size_t k = 0; k < 3; k++) {
            density += q[k * points + i] * q[k * points + i];
            square += values[k * points + i] * values[k * points + i];
        }
        density *= grid->weight[i / grid->n_phi];
        sum += density * square;
        area += density;
    }
    srnf_free(synthesis);
    srnf_free(workspace);
    srnf_free(values);
    srnf_free(difference);
    return sqrt(sum / area);
}

static double surface_error(const struct transfers *t, const double *truth, const double *guess)
{
    struct srnf_mesh meshes[2];
    struct srnf_index *index = NULL;
    struct srnf_fit fit;

    must(srnf_surface_triangulate(t->degree, truth, RESOLUTION, &meshes[0], NULL) == SRNF_OK &&
             srnf_surface_triangulate(t->degree, guess, RESOLUTION, &meshes[1], NULL) == SRNF_OK &&
             srnf_index_create(&index, &meshes[0]) == SRNF_OK &&
             srnf_fit_measure(&meshes[0], index, &meshes[1], NULL, &fit) == SRNF_OK,
         "comparing surfaces");
    srnf_index_destroy(index);
    srnf_mesh_clear(&meshes[0]);
    srnf_mesh_clear(&meshes[1]);
    return fit.rms;
}

static double srnf_error_of(const struct transfers *t, const double *truth, const double *guess)
{
    const struct srnf_grid *grid = srnf_sht_grid(t->sht);
    double *v = shapes_doubles(3 * grid->n_theta * grid->n_phi);
    double distance;

    must(srnf_velocity_toward(t->sht, truth, guess, v) == SRNF_OK, "a distance");
    distance = sqrt(srnf_inner_product(grid, v, v) / measure(t, truth).area);
    srnf_free(v);
    return distance;
}

struct transfers_error transfers_measure(const struct transfers *t, size_t to,
                                         enum transfers_way way, const double *guess)
{
    double *truth = centred(t, t->subjects[to].systole);
    double *own = centred(t, guess);
    struct transfers_error error = {
        .points = NAN, .surface = surface_error(t, truth, own), .srnf = NAN};

    if (way != TRANSFERS_SRNF_REGISTERED) {
        error.points = point_error(t, truth, own);
        error.srnf = srnf_error_of(t, truth, own);
    }
    srnf_free(own);
    srnf_free(truth);
    return error;
}
