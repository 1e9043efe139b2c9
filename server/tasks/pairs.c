/*
 * pairs.c - the kind "pairs": registered distances of some pairs of surfaces.
 *
 *   inputs   "srnfpair", the numbers of enum field in their order, the options (options.c), then
 *            first and second of each pair as indexes of surfaces
 *   contents the surfaces, double[3][(L+1)^2] each
 *   result   the distances, in the order of the pairs
 *
 * Each pair is measured as srnf_metric_distances measures it among others, with the same bits: the
 * distance of a pair depends on its two surfaces alone. Cost: a registration both ways for each.
 */
#include "tasks/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "srnfpair"
#define MAGIC_SIZE 8
#define VERSION 2
#define SLACK 1.05 /* of bounds of distances: these are integrals by quadrature */

enum field { FIELD_VERSION, FIELD_DEGREE, FIELD_METRIC, FIELD_SURFACES, FIELD_PAIRS, FIELDS };
#define HEAD (MAGIC_SIZE + 8 * (size_t)FIELDS + TASKS_OPTIONS_SIZE)

/* ---- Inputs as bytes ------------------------------------------------------------------------- */

int tasks_pairs_write(const struct tasks_pairs *pairs, struct tasks_bytes *inputs)
{
    const uint64_t numbers[FIELDS] = {[FIELD_VERSION] = VERSION,
                                      [FIELD_DEGREE] = pairs->degree,
                                      [FIELD_METRIC] = (uint64_t)pairs->metric,
                                      [FIELD_SURFACES] = pairs->n_surfaces,
                                      [FIELD_PAIRS] = pairs->n_pairs};
    unsigned char *at;

    *inputs = (struct tasks_bytes){.bytes = NULL};
    if (pairs->n_surfaces > TASKS_CONTENTS_MAX || pairs->n_pairs > (TASKS_INPUTS_MAX - HEAD) / 16) {
        return SRNF_ELIMIT;
    }
    inputs->size = HEAD + 16 * pairs->n_pairs;
    inputs->bytes = malloc(inputs->size);
    if (!inputs->bytes) {
        return SRNF_ENOMEM;
    }
    memcpy(inputs->bytes, MAGIC, MAGIC_SIZE);
    for (size_t i = 0; i < FIELDS; i++) {
        tasks_put(inputs->bytes + MAGIC_SIZE + 8 * i, numbers[i]);
    }
    tasks_put_options(inputs->bytes + HEAD - TASKS_OPTIONS_SIZE, &pairs->registration);
    at = inputs->bytes + HEAD;
    for (size_t k = 0; k < pairs->n_pairs; k++, at += 16) {
        tasks_put(at, pairs->pairs[k][0]);
        tasks_put(at + 8, pairs->pairs[k][1]);
    }
    return SRNF_OK;
}

static uint64_t number(const unsigned char *inputs, enum field field)
{
    return tasks_get(inputs + MAGIC_SIZE + 8 * (size_t)field);
}

/* All but the pairs, which stay where they are. False: these are no such inputs. */
static bool read_head(const unsigned char *inputs, size_t size, struct tasks_pairs *pairs)
{
    if (size <= HEAD || memcmp(inputs, MAGIC, MAGIC_SIZE) != 0 ||
        number(inputs, FIELD_VERSION) != VERSION ||
        number(inputs, FIELD_DEGREE) > TASKS_DEGREE_MAX ||
        number(inputs, FIELD_METRIC) > SRNF_METRIC_SPHARM ||
        number(inputs, FIELD_SURFACES) > TASKS_CONTENTS_MAX ||
        number(inputs, FIELD_PAIRS) != (size - HEAD) / 16 || (size - HEAD) % 16 != 0) {
        return false;
    }
    *pairs = (struct tasks_pairs){.degree = (size_t)number(inputs, FIELD_DEGREE),
                                  .metric = (enum srnf_metric)number(inputs, FIELD_METRIC),
                                  .n_surfaces = (size_t)number(inputs, FIELD_SURFACES),
                                  .n_pairs = (size_t)number(inputs, FIELD_PAIRS)};
    return tasks_get_options(inputs + HEAD - TASKS_OPTIONS_SIZE, &pairs->registration);
}

/* ---- Computing ------------------------------------------------------------------------------- */

static bool contents_fit(const struct tasks_pairs *pairs, const struct tasks_content *contents,
                         size_t n_contents)
{
    size_t size = 3 * srnf_coefficient_count(pairs->degree) * sizeof(double);
    bool fit = n_contents == pairs->n_surfaces;

    for (size_t i = 0; fit && i < n_contents; i++) {
        fit = contents[i].size == size;
    }
    return fit;
}

/* Surfaces as doubles of this machine: [n][3][(L+1)^2], srnf_free. */
static double *read_surfaces(const struct tasks_pairs *pairs, const struct tasks_content *contents)
{
    size_t count = 3 * srnf_coefficient_count(pairs->degree);
    double *surfaces = srnf_alloc(pairs->n_surfaces * count, sizeof(double));

    for (size_t i = 0; surfaces && i < pairs->n_surfaces; i++) {
        const unsigned char *bytes = contents[i].bytes;

        for (size_t k = 0; k < count; k++) {
            surfaces[i * count + k] = tasks_get_double(bytes + 8 * k);
        }
    }
    return surfaces;
}

static int measure(const struct tasks_pairs *pairs, const unsigned char *at,
                   const struct srnf_sht *sht, const double *surfaces,
                   const struct srnf_context *context, double *distance, struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(pairs->degree);
    uint64_t i = tasks_get(at), j = tasks_get(at + 8);
    const double *pair[2];
    double matrix[4] = {0};
    int status;

    if (i >= pairs->n_surfaces || j >= pairs->n_surfaces) {
        return SRNF_EINVAL;
    }
    pair[0] = surfaces + i * count;
    pair[1] = surfaces + j * count;
    status = srnf_metric_distances(sht, pairs->metric, 2, pair, &pairs->registration, context,
                                   matrix, error);
    *distance = matrix[1];
    return status;
}

static int run_pairs(const void *inputs, size_t size, const struct tasks_content *contents,
                     size_t n_contents, const struct srnf_context *context,
                     struct tasks_bytes *result, struct srnf_error *error)
{
    const unsigned char *bytes = inputs;
    struct srnf_sht *sht = NULL;
    struct tasks_pairs pairs;
    double *surfaces = NULL;
    int status = SRNF_ENOMEM;

    *result = (struct tasks_bytes){.bytes = NULL};
    if (!read_head(bytes, size, &pairs) || !contents_fit(&pairs, contents, n_contents)) {
        return SRNF_EINVAL;
    }
    result->size = 8 * pairs.n_pairs;
    result->bytes = malloc(result->size);
    surfaces = read_surfaces(&pairs, contents);
    if (surfaces && result->bytes) {
        status = srnf_sht_create(&sht, pairs.degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0);
    }
    for (size_t k = 0; status >= 0 && k < pairs.n_pairs; k++) {
        double distance = 0.0;

        status = measure(&pairs, bytes + HEAD + 16 * k, sht, surfaces, context, &distance, error);
        tasks_put_double(result->bytes + 8 * k, distance);
    }
    srnf_sht_destroy(sht);
    srnf_free(surfaces);
    if (status < 0) {
        free(result->bytes);
        *result = (struct tasks_bytes){.bytes = NULL};
    }
    return status;
}

/* ---- Results --------------------------------------------------------------------------------- */

void tasks_pairs_distances(const void *result, size_t n_pairs, double *distances)
{
    const unsigned char *bytes = result;

    for (size_t k = 0; k < n_pairs; k++) {
        distances[k] = tasks_get_double(bytes + 8 * k);
    }
}

static bool check_pairs(const void *inputs, size_t size, const void *result, size_t result_size)
{
    const unsigned char *bytes = result;
    struct tasks_pairs pairs;
    bool good = read_head(inputs, size, &pairs) && result_size == 8 * pairs.n_pairs;

    for (size_t k = 0; good && k < pairs.n_pairs; k++) {
        double distance = tasks_get_double(bytes + 8 * k);

        good = isfinite(distance) && distance >= 0.0;
    }
    return good;
}

/* At least the norm of what the metric compares of a surface f, from its coefficients alone.
   ||q||^2 of an SRNF is the area, at most half the integral of |grad f|^2, which is the sum of
   l (l + 1) |f_lm|^2. That of a square-root map is at most the area times the square of the
   greatest distance from the centroid, which is in the hull of the surface: twice that from the
   point l = 0. It is at most the sum over l of ((2 l + 1) / 4 pi)^(1/2) |f_l|. */
static double norm_at_most(const struct tasks_pairs *pairs, const double *surface)
{
    size_t count = srnf_coefficient_count(pairs->degree);
    double energy = 0.0, reach = 0.0;

    for (size_t l = 1; l <= pairs->degree; l++) {
        double sum = 0.0, order = (double)l;

        for (size_t k = 0; k < 3; k++) {
            for (size_t m = l * l; m < (l + 1) * (l + 1); m++) {
                sum += surface[k * count + m] * surface[k * count + m];
            }
        }
        energy += order * (order + 1.0) * sum;
        reach += sqrt((2.0 * order + 1.0) / (4.0 * PI) * sum);
    }
    return sqrt(0.5 * energy) * (pairs->metric == SRNF_METRIC_SRM ? 2.0 * reach : 1.0);
}

/* A distance by srnf or srm is at most the sum of both norms; those of other metrics are left
   alone. */
static bool possible_pairs(const void *inputs, size_t size, const struct tasks_content *contents,
                           size_t n_contents, const void *result, size_t result_size)
{
    const unsigned char *pair = (const unsigned char *)inputs + HEAD, *bytes = result;
    struct tasks_pairs pairs;
    double *surfaces, norms[TASKS_CONTENTS_MAX];
    size_t count;
    bool good = true;

    (void)result_size;
    if (!read_head(inputs, size, &pairs) || !contents_fit(&pairs, contents, n_contents)) {
        return false;
    }
    if (pairs.metric != SRNF_METRIC_SRNF && pairs.metric != SRNF_METRIC_SRM) {
        return true;
    }
    surfaces = read_surfaces(&pairs, contents);
    count = 3 * srnf_coefficient_count(pairs.degree);
    for (size_t i = 0; surfaces && i < pairs.n_surfaces; i++) {
        norms[i] = norm_at_most(&pairs, surfaces + i * count);
    }
    for (size_t k = 0; surfaces && good && k < pairs.n_pairs; k++, pair += 16) {
        uint64_t i = tasks_get(pair), j = tasks_get(pair + 8);

        good = i < pairs.n_surfaces && j < pairs.n_surfaces &&
               tasks_get_double(bytes + 8 * k) <= SLACK * (norms[i] + norms[j]);
    }
    srnf_free(surfaces);
    return good; /* without memory too: the job will tell */
}

const struct tasks_kind tasks_pairs_kind = {
    .name = TASKS_PAIRS, .run = run_pairs, .check = check_pairs, .possible = possible_pairs};
