/*
 * encodings_found.c - results of the kind "encodings" as bytes: layout in encodings.c.
 */
#include "tasks/encodings.h"
#include "tasks/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SENTENCE ((size_t)240)

/* Of a surface. Numbers from FOUND_REALS on are doubles. */
enum found {
    FOUND_STATUS,
    FOUND_DEGREE,
    FOUND_ROUTE,
    FOUND_STAR,
    FOUND_FLIPPED,
    FOUND_REALS,
    FOUND_SCALE = FOUND_REALS,
    FOUND_ORIGIN,
    FOUND_STAR_CENTER = FOUND_ORIGIN + 3,
    FOUND_STAR_MARGIN = FOUND_STAR_CENTER + 3,
    FOUND_STAR_VIOLATING,
    FOUND_DIRICHLET,
    FOUND_AREA_DEVIATION,
    FOUND_FIT, /* rms, p95, max, diagonal */
    FOUND_AREA = FOUND_FIT + 4,
    FOUND_VOLUME,
    FOUND_CENTROID,
    FOUND_VOLUME_RATIO = FOUND_CENTROID + 3,
    FOUND_AREA_RATIO,
    FOUNDS
};
#define FOUND_SIZE (8 * (size_t)FOUNDS)
#define FAILED_SIZE ((size_t)16 + SENTENCE) /* status, element, sentence */

static unsigned char *grow(struct tasks_bytes *result, size_t size)
{
    unsigned char *grown = size <= TASKS_RESULT_MAX - result->size
                               ? realloc(result->bytes, result->size + size)
                               : NULL;

    if (!grown) {
        return NULL;
    }
    result->bytes = grown;
    result->size += size;
    memset(grown + result->size - size, 0, size);
    return grown + result->size - size;
}

int encodings_add_failure(struct tasks_bytes *result, int status, const struct srnf_error *error)
{
    const char *message = error->message[0] ? error->message : srnf_strerror(status);
    unsigned char *at = grow(result, FAILED_SIZE);

    if (!at) {
        return SRNF_ENOMEM;
    }
    tasks_put(at, (uint64_t)(int64_t)status);
    tasks_put(at + 8, (uint64_t)(error->message[0] ? error->element : -1));
    memcpy(at + 16, message, strnlen(message, SENTENCE - 1));
    return SRNF_OK;
}

int encodings_add_surface(struct tasks_bytes *result, const struct srnf_encoded *e)
{
    const uint64_t numbers[FOUND_REALS] = {[FOUND_DEGREE] = e->degree,
                                           [FOUND_ROUTE] = (uint64_t)e->route,
                                           [FOUND_STAR] = e->star.value,
                                           [FOUND_FLIPPED] = e->distortion.flipped};
    const double fit[4] = {e->fit.rms, e->fit.p95, e->fit.max, e->fit.diagonal};
    size_t count = 3 * srnf_coefficient_count(e->degree);
    unsigned char *at = grow(result, FOUND_SIZE + SENTENCE + 8 * count);

    if (!at) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < FOUND_REALS; i++) {
        tasks_put(at + 8 * i, numbers[i]);
    }
    tasks_put_double(at + 8 * FOUND_SCALE, e->scale);
    tasks_put_point(at + 8 * FOUND_ORIGIN, e->origin);
    tasks_put_point(at + 8 * FOUND_STAR_CENTER, e->star.center);
    tasks_put_double(at + 8 * FOUND_STAR_MARGIN, e->star.margin);
    tasks_put_double(at + 8 * FOUND_STAR_VIOLATING, e->star.violating_area_fraction);
    tasks_put_double(at + 8 * FOUND_DIRICHLET, e->distortion.symmetric_dirichlet);
    tasks_put_double(at + 8 * FOUND_AREA_DEVIATION, e->distortion.log_area_deviation);
    tasks_put_doubles(at + 8 * FOUND_FIT, fit, 4);
    tasks_put_double(at + 8 * FOUND_AREA, e->measures.area);
    tasks_put_double(at + 8 * FOUND_VOLUME, e->measures.volume);
    tasks_put_point(at + 8 * FOUND_CENTROID, e->measures.centroid);
    tasks_put_double(at + 8 * FOUND_VOLUME_RATIO, e->volume_ratio);
    tasks_put_double(at + 8 * FOUND_AREA_RATIO, e->area_ratio);
    memcpy(at + FOUND_SIZE, e->reason, strnlen(e->reason, SENTENCE - 1));
    tasks_put_doubles(at + FOUND_SIZE + SENTENCE, e->coefficients, count);
    return SRNF_OK;
}

/* Whether the numbers can be those of a surface: only what distorts a map may have no bound. */
static bool is_surface(const unsigned char *at)
{
    bool good = tasks_get(at) == SRNF_OK && tasks_get(at + 8 * FOUND_DEGREE) <= TASKS_DEGREE_MAX &&
                tasks_get(at + 8 * FOUND_ROUTE) <= SRNF_PARAMETERIZATION_GIVEN &&
                tasks_get(at + 8 * FOUND_STAR) <= 1 && tasks_is_sentence(at + FOUND_SIZE, SENTENCE);

    for (size_t i = FOUND_REALS; i < FOUNDS && good; i++) {
        good = i == FOUND_DIRICHLET || i == FOUND_AREA_DEVIATION ||
               isfinite(tasks_get_double(at + 8 * i));
    }
    return good;
}

static void get_surface(const unsigned char *at, struct srnf_encoded *e)
{
    double fit[4];

    e->route = (enum srnf_parameterization)tasks_get(at + 8 * FOUND_ROUTE);
    e->star.value = tasks_get(at + 8 * FOUND_STAR) != 0;
    e->distortion.flipped = (size_t)tasks_get(at + 8 * FOUND_FLIPPED);
    e->scale = tasks_get_double(at + 8 * FOUND_SCALE);
    tasks_get_point(at + 8 * FOUND_ORIGIN, e->origin);
    tasks_get_point(at + 8 * FOUND_STAR_CENTER, e->star.center);
    e->star.margin = tasks_get_double(at + 8 * FOUND_STAR_MARGIN);
    e->star.violating_area_fraction = tasks_get_double(at + 8 * FOUND_STAR_VIOLATING);
    e->distortion.symmetric_dirichlet = tasks_get_double(at + 8 * FOUND_DIRICHLET);
    e->distortion.log_area_deviation = tasks_get_double(at + 8 * FOUND_AREA_DEVIATION);
    (void)tasks_get_doubles(at + 8 * FOUND_FIT, 4, fit);
    e->fit = (struct srnf_fit){fit[0], fit[1], fit[2], fit[3]};
    e->measures.area = tasks_get_double(at + 8 * FOUND_AREA);
    e->measures.volume = tasks_get_double(at + 8 * FOUND_VOLUME);
    tasks_get_point(at + 8 * FOUND_CENTROID, e->measures.centroid);
    e->volume_ratio = tasks_get_double(at + 8 * FOUND_VOLUME_RATIO);
    e->area_ratio = tasks_get_double(at + 8 * FOUND_AREA_RATIO);
    memcpy(e->reason, at + FOUND_SIZE, SENTENCE - 1);
}

bool encodings_is_result(int64_t status)
{
    return status < 0 && status >= SRNF_ENUMERIC && status != SRNF_ENOMEM &&
           status != SRNF_ECANCELED;
}

int encodings_read_one(const unsigned char **at, const unsigned char *end,
                       struct tasks_encoded *found)
{
    size_t left = (size_t)(end - *at), count;
    double *coefficients;

    *found = (struct tasks_encoded){.status = SRNF_OK};
    if (left >= FAILED_SIZE && encodings_is_result((int64_t)tasks_get(*at))) {
        if (!tasks_is_sentence(*at + 16, SENTENCE)) {
            return SRNF_EINVAL;
        }
        found->status = found->error.status = (int)(int64_t)tasks_get(*at);
        found->error.element = (int64_t)tasks_get(*at + 8);
        memcpy(found->error.message, *at + 16, SENTENCE - 1);
        *at += FAILED_SIZE;
        return SRNF_OK;
    }
    if (left < FOUND_SIZE + SENTENCE || !is_surface(*at)) {
        return SRNF_EINVAL;
    }
    found->encoded.degree = (size_t)tasks_get(*at + 8 * FOUND_DEGREE);
    count = 3 * srnf_coefficient_count(found->encoded.degree);
    if (left - FOUND_SIZE - SENTENCE < 8 * count) {
        return SRNF_EINVAL;
    }
    coefficients = srnf_alloc(count, sizeof(double));
    if (!coefficients) {
        return SRNF_ENOMEM;
    }
    if (!tasks_get_doubles(*at + FOUND_SIZE + SENTENCE, count, coefficients)) {
        srnf_free(coefficients);
        return SRNF_EINVAL;
    }
    get_surface(*at, &found->encoded);
    found->encoded.coefficients = coefficients;
    *at += FOUND_SIZE + SENTENCE + 8 * count;
    return SRNF_OK;
}

int tasks_encodings_read(const void *result, size_t size, size_t n, struct tasks_encoded *found)
{
    const unsigned char *at = result, *end = at + size;
    int status = SRNF_OK;
    size_t i = 0;

    for (; i < n && status == SRNF_OK; i++) {
        status = encodings_read_one(&at, end, &found[i]);
    }
    if (status == SRNF_OK && at != end) {
        status = SRNF_EINVAL;
    }
    while (status != SRNF_OK && i-- > 0) {
        srnf_free(found[i].encoded.coefficients);
        found[i] = (struct tasks_encoded){.status = status};
    }
    return status;
}
