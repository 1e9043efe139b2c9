/*
 * searches.c - the kind "searches": registrations of some surfaces to one field, as a mean or the
 * folds of a classification ask for them.
 *
 *   inputs   "srnfsrch", the numbers of enum field in their order, the options (options.c); where
 *            landmarks guide, their points on the field's sphere, then those of each surface
 *   contents the field, double[3][n_theta][n_phi]; the surfaces, double[3][(L+1)^2] each
 *   result   for each surface the number of links, the rotation, and for each link kind, degree and
 *            values; or, of a surface that cannot meet its landmarks, FAILED, the landmark, and why
 *
 * What is found of a surface depends on field, surface, options and landmarks alone
 * (srnf_register_to_field_landmarks).
 * Cost: a search for each.
 */
#include "tasks/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "srnfsrch"
#define MAGIC_SIZE 8
#define VERSION 2
#define LINKS_MAX 4096
#define FAILED UINT64_MAX /* in the place of the number of links */
#define SENTENCE sizeof(((struct srnf_error *)0)->message)
#define LINK_DEGREE_MAX 64
#define ROUNDING 1e-6             /* of rotations that are found: theirs is some 1e-15 */
#define LOOKS ((size_t)64)        /* nodes at which a warp is looked at */
#define GOLDEN 0.6180339887498949 /* spreads them over the grid */

enum field {
    FIELD_VERSION,
    FIELD_DEGREE,
    FIELD_ROWS,
    FIELD_COLUMNS,
    FIELD_NORM2,
    FIELD_SURFACES,
    FIELD_LANDMARKS,
    FIELD_WEIGHT,
    FIELDS
};
#define HEAD (MAGIC_SIZE + 8 * (size_t)FIELDS + TASKS_OPTIONS_SIZE)

/* ---- Inputs as bytes ------------------------------------------------------------------------- */

size_t tasks_searches_most(size_t n_landmarks)
{
    size_t room = n_landmarks ? (TASKS_INPUTS_MAX - HEAD) / (24 * n_landmarks) - 1 : SIZE_MAX;

    return room < TASKS_CONTENTS_MAX - 1 ? room : TASKS_CONTENTS_MAX - 1;
}

int tasks_searches_write(const struct tasks_searches *searches, struct tasks_bytes *inputs)
{
    const uint64_t numbers[FIELDS] = {
        [FIELD_VERSION] = VERSION,        [FIELD_DEGREE] = searches->degree,
        [FIELD_ROWS] = searches->n_theta, [FIELD_COLUMNS] = searches->n_phi,
        [FIELD_SURFACES] = searches->n,   [FIELD_LANDMARKS] = searches->n_landmarks};
    size_t points = 3 * searches->n_landmarks;

    *inputs = (struct tasks_bytes){.bytes = NULL};
    if (searches->n == 0 || searches->n_landmarks > SRNF_LANDMARKS_MAX ||
        searches->n > tasks_searches_most(searches->n_landmarks)) {
        return SRNF_ELIMIT;
    }
    inputs->size = HEAD + (points ? 8 * points * (1 + searches->n) : 0);
    inputs->bytes = malloc(inputs->size);
    if (!inputs->bytes) {
        return SRNF_ENOMEM;
    }
    memcpy(inputs->bytes, MAGIC, MAGIC_SIZE);
    for (size_t i = 0; i < FIELDS; i++) {
        tasks_put(inputs->bytes + MAGIC_SIZE + 8 * i, numbers[i]);
    }
    tasks_put_double(inputs->bytes + MAGIC_SIZE + 8 * FIELD_NORM2, searches->norm2);
    tasks_put_options(inputs->bytes + HEAD - TASKS_OPTIONS_SIZE, &searches->registration);
    tasks_put_double(inputs->bytes + MAGIC_SIZE + 8 * FIELD_WEIGHT,
                     points ? searches->weight : 0.0);
    if (points) {
        tasks_put_doubles(inputs->bytes + HEAD, searches->fixed, points);
        tasks_put_doubles(inputs->bytes + HEAD + 8 * points, searches->moving,
                          points * searches->n);
    }
    return SRNF_OK;
}

static uint64_t number(const unsigned char *inputs, enum field field)
{
    return tasks_get(inputs + MAGIC_SIZE + 8 * (size_t)field);
}

/* All but the points of landmarks, which stay where they are. False: these are no such inputs. */
static bool read_inputs(const unsigned char *inputs, size_t size, struct tasks_searches *searches)
{
    if (size < HEAD || memcmp(inputs, MAGIC, MAGIC_SIZE) != 0 ||
        number(inputs, FIELD_VERSION) != VERSION ||
        number(inputs, FIELD_DEGREE) > TASKS_DEGREE_MAX ||
        number(inputs, FIELD_ROWS) > SRNF_GRID_ROWS_MAX ||
        number(inputs, FIELD_COLUMNS) > 2 * SRNF_GRID_ROWS_MAX ||
        number(inputs, FIELD_SURFACES) == 0 ||
        number(inputs, FIELD_LANDMARKS) > SRNF_LANDMARKS_MAX ||
        number(inputs, FIELD_SURFACES) > tasks_searches_most(number(inputs, FIELD_LANDMARKS)) ||
        size != HEAD + (number(inputs, FIELD_LANDMARKS) ? 24 * number(inputs, FIELD_LANDMARKS) *
                                                              (1 + number(inputs, FIELD_SURFACES))
                                                        : 0)) {
        return false;
    }
    *searches =
        (struct tasks_searches){.degree = (size_t)number(inputs, FIELD_DEGREE),
                                .n_theta = (size_t)number(inputs, FIELD_ROWS),
                                .n_phi = (size_t)number(inputs, FIELD_COLUMNS),
                                .norm2 = tasks_get_double(inputs + MAGIC_SIZE + 8 * FIELD_NORM2),
                                .n = (size_t)number(inputs, FIELD_SURFACES),
                                .n_landmarks = (size_t)number(inputs, FIELD_LANDMARKS),
                                .weight = tasks_get_double(inputs + MAGIC_SIZE + 8 * FIELD_WEIGHT)};
    return (searches->n_landmarks ? searches->weight > 0.0 : number(inputs, FIELD_WEIGHT) == 0) &&
           tasks_get_options(inputs + HEAD - TASKS_OPTIONS_SIZE, &searches->registration);
}

/* ---- Results as bytes ------------------------------------------------------------------------ */

/* Numbers of a link after its kind and degree; 0: no link of a search. */
static size_t count_values(uint64_t kind, uint64_t degree)
{
    if (kind == SRNF_WARP_ROTATION) {
        return degree == 0 ? 9 : 0;
    }
    return kind == SRNF_WARP_EXP && degree <= LINK_DEGREE_MAX
               ? 2 * srnf_coefficient_count((size_t)degree)
               : 0;
}

/* Appends what was found of one surface. */
static int append(struct tasks_bytes *result, const double rotation[9],
                  const struct srnf_warp *warp)
{
    size_t size = 80;
    unsigned char *grown, *at;

    for (size_t k = 0; k < warp->n_links; k++) {
        const struct srnf_warp_link *link = &warp->links[k];
        size_t count =
            count_values(link->kind, link->kind == SRNF_WARP_ROTATION ? 0 : (uint64_t)link->degree);

        if (count == 0) {
            return SRNF_ENUMERIC;
        }
        size += 16 + 8 * count;
    }
    grown = size <= TASKS_RESULT_MAX - result->size ? realloc(result->bytes, result->size + size)
                                                    : NULL;
    if (!grown) {
        return SRNF_ENOMEM;
    }
    at = grown + result->size;
    tasks_put(at, warp->n_links);
    tasks_put_doubles(at + 8, rotation, 9);
    at += 80;
    for (size_t k = 0; k < warp->n_links; k++) {
        const struct srnf_warp_link *link = &warp->links[k];
        uint64_t degree = link->kind == SRNF_WARP_ROTATION ? 0 : (uint64_t)link->degree;
        size_t count = count_values(link->kind, degree);

        tasks_put(at, (uint64_t)link->kind);
        tasks_put(at + 8, degree);
        tasks_put_doubles(at + 16, link->values, count);
        at += 16 + 8 * count;
    }
    result->bytes = grown;
    result->size += size;
    return SRNF_OK;
}

/* Appends that the landmarks of one surface could not be met. */
static int append_failure(struct tasks_bytes *result, const struct srnf_error *why)
{
    const size_t size = 16 + SENTENCE;
    unsigned char *grown = size <= TASKS_RESULT_MAX - result->size
                               ? realloc(result->bytes, result->size + size)
                               : NULL;

    if (!grown) {
        return SRNF_ENOMEM;
    }
    tasks_put(grown + result->size, FAILED);
    tasks_put(grown + result->size + 8, (uint64_t)why->element);
    memset(grown + result->size + 16, 0, SENTENCE);
    memcpy(grown + result->size + 16, why->message, strlen(why->message));
    result->bytes = grown;
    result->size += size;
    return SRNF_OK;
}

/* The failure at *at, which moves on. */
static int read_failure(const unsigned char **at, const unsigned char *end, struct srnf_error *why)
{
    if ((size_t)(end - *at) < 16 + SENTENCE || tasks_get(*at + 8) >= SRNF_LANDMARKS_MAX ||
        !tasks_is_sentence(*at + 16, SENTENCE)) {
        return SRNF_EINVAL;
    }
    *why = (struct srnf_error){.status = SRNF_EUNMATCHED, .element = (int64_t)tasks_get(*at + 8)};
    memcpy(why->message, *at + 16, SENTENCE);
    *at += 16 + SENTENCE;
    return SRNF_OK;
}

/* Whether it is one, to rounding: what is found turns a surface, and neither stretches nor mirrors
   it. */
static bool is_rotation(const double m[9])
{
    double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                         m[2] * (m[3] * m[7] - m[4] * m[6]);
    bool good = fabs(determinant - 1.0) < ROUNDING;

    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j <= i; j++) {
            double product =
                m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2];

            good = good && fabs(product - (i == j ? 1.0 : 0.0)) < ROUNDING;
        }
    }
    return good;
}

/* The link at the bytes, appended to the warp (NULL: only looked at); *size: that it takes. */
static int read_link(const unsigned char *bytes, size_t left, struct srnf_warp *warp, size_t *size)
{
    struct srnf_warp_link link;
    const struct srnf_warp one = {.n_links = 1, .links = &link};
    double values[2 * (LINK_DEGREE_MAX + 1) * (LINK_DEGREE_MAX + 1)];
    size_t count = left >= 16 ? count_values(tasks_get(bytes), tasks_get(bytes + 8)) : 0;

    *size = 16 + 8 * count;
    if (count == 0 || *size > left || !tasks_get_doubles(bytes + 16, count, values) ||
        (tasks_get(bytes) == SRNF_WARP_ROTATION && !is_rotation(values))) {
        return SRNF_EINVAL;
    }
    link = (struct srnf_warp_link){.kind = (enum srnf_warp_kind)tasks_get(bytes),
                                   .degree = (size_t)tasks_get(bytes + 8),
                                   .values = values};
    return warp ? srnf_warp_join(&one, warp) : SRNF_OK;
}

/* What was found of one surface, at *at, which moves on. warp NULL: only looked at. */
static int read_found(const unsigned char **at, const unsigned char *end, double rotation[9],
                      struct srnf_warp *warp)
{
    size_t left = (size_t)(end - *at), size = 0;
    uint64_t links = left >= 80 ? tasks_get(*at) : 0;
    int status = SRNF_OK;

    if (left < 80 || links > LINKS_MAX || !tasks_get_doubles(*at + 8, 9, rotation) ||
        !is_rotation(rotation)) {
        return SRNF_EINVAL;
    }
    *at += 80;
    for (uint64_t k = 0; k < links && status == SRNF_OK; k++) {
        status = read_link(*at, (size_t)(end - *at), warp, &size);
        *at += status == SRNF_OK ? size : 0;
    }
    return status;
}

int tasks_searches_read(const void *result, size_t size, size_t n,
                        int (*take)(void *argument, size_t i, const double rotation[9],
                                    struct srnf_warp *warp),
                        int (*fail)(void *argument, size_t i, const struct srnf_error *why),
                        void *argument)
{
    const unsigned char *at = result, *end = at + size;
    int status = SRNF_OK;

    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        struct srnf_warp warp = {.n_links = 0};
        struct srnf_error why;
        double rotation[9];

        if (fail && end - at >= 8 && tasks_get(at) == FAILED) {
            status = read_failure(&at, end, &why);
            status = status == SRNF_OK ? fail(argument, i, &why) : status;
            continue;
        }
        status = read_found(&at, end, rotation, take ? &warp : NULL);
        if (status == SRNF_OK && take) {
            status = take(argument, i, rotation, &warp);
        }
        srnf_warp_clear(&warp);
    }
    return status == SRNF_OK && at != end ? SRNF_EINVAL : status;
}

/* Of no interest but that it can be read. */
static int pass_over(void *argument, size_t i, const struct srnf_error *why)
{
    (void)argument;
    (void)i;
    (void)why;
    return SRNF_OK;
}

static bool check_searches(const void *inputs, size_t size, const void *result, size_t result_size)
{
    struct tasks_searches searches;

    return read_inputs(inputs, size, &searches) &&
           tasks_searches_read(result, result_size, searches.n, NULL,
                               searches.n_landmarks ? pass_over : NULL, NULL) == SRNF_OK;
}

/* ---- What can be found ----------------------------------------------------------------------- */

struct looking {
    double points[LOOKS][3], warped[LOOKS][3], jacobian[LOOKS];
};

/* Some nodes of the grid. */
static int choose_nodes(const struct tasks_searches *searches, struct looking *looking)
{
    size_t n = searches->n_theta * searches->n_phi;
    const struct srnf_grid *grid;
    struct srnf_sht *sht;
    int status =
        srnf_sht_create(&sht, 0, SRNF_GRID_GAUSS_LEGENDRE, searches->n_theta, searches->n_phi);

    if (status) {
        return status;
    }
    grid = srnf_sht_grid(sht);
    for (size_t k = 0; k < LOOKS; k++) {
        size_t i = (size_t)(fmod((double)k * GOLDEN, 1.0) * (double)n), row = i / grid->n_phi;
        double phi = 2.0 * PI * (double)(i % grid->n_phi) / (double)grid->n_phi;

        looking->points[k][0] = grid->sin_theta[row] * cos(phi);
        looking->points[k][1] = grid->sin_theta[row] * sin(phi);
        looking->points[k][2] = grid->cos_theta[row];
    }
    srnf_sht_destroy(sht);
    return SRNF_OK;
}

/* A search takes no step that folds the sphere at a node, where the computation goes on with the
   root of the Jacobian. */
static int look_at(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp)
{
    struct looking *looking = argument;
    int status =
        srnf_warp_apply(warp, LOOKS, looking->points[0], looking->warped[0], looking->jacobian);

    (void)i;
    (void)rotation;
    for (size_t k = 0; k < LOOKS && status == SRNF_OK; k++) {
        status = looking->jacobian[k] >= 0.0 ? SRNF_OK : SRNF_ENUMERIC;
    }
    return status;
}

static bool possible_searches(const void *inputs, size_t size, const struct tasks_content *contents,
                              size_t n_contents, const void *result, size_t result_size)
{
    struct tasks_searches searches;
    struct looking looking;
    int status;

    (void)contents;
    if (!read_inputs(inputs, size, &searches) || n_contents != searches.n + 1) {
        return false;
    }
    status = choose_nodes(&searches, &looking);
    if (status == SRNF_OK) {
        status = tasks_searches_read(result, result_size, searches.n, look_at,
                                     searches.n_landmarks ? pass_over : NULL, &looking);
    }
    return status == SRNF_OK || status == SRNF_ENOMEM; /* without memory the job will tell */
}

/* ---- Computing ------------------------------------------------------------------------------- */

/* The numbers of a content (srnf_free), or NULL with the reason. */
static double *read_content(const struct tasks_content *content, size_t count, int *status)
{
    double *values = NULL;

    *status = SRNF_EINVAL;
    if (content->size == 8 * count) {
        values = srnf_alloc(count, sizeof(double));
        *status = values ? SRNF_OK : SRNF_ENOMEM;
    }
    if (values && !tasks_get_doubles(content->bytes, count, values)) {
        *status = SRNF_EINVAL;
        srnf_free(values);
        values = NULL;
    }
    return values;
}

/* marks: of the surface, NULL where no landmarks guide. */
static int search_one(const struct tasks_searches *searches, const struct srnf_sht *sht,
                      const double *field, const double *marks, const struct tasks_content *content,
                      const struct srnf_context *context, struct tasks_bytes *result,
                      struct srnf_error *error)
{
    const struct srnf_landmarks landmarks = {searches->n_landmarks, searches->fixed, marks,
                                             searches->weight};
    struct srnf_warp warp = {.n_links = 0};
    struct srnf_error why = {.status = SRNF_OK};
    double rotation[9];
    int status;
    double *surface = read_content(content, 3 * srnf_coefficient_count(searches->degree), &status);

    if (surface) {
        status = srnf_register_to_field_landmarks(
            sht, field, searches->norm2, surface, &searches->registration,
            marks ? &landmarks : NULL, context, rotation, &warp, &why);
    }
    if (status == SRNF_OK) {
        status = append(result, rotation, &warp);
    } else if (status == SRNF_EUNMATCHED) {
        status = append_failure(result, &why);
    } else if (error) {
        *error = why;
    }
    srnf_warp_clear(&warp);
    srnf_free(surface);
    return status;
}

static int run_searches(const void *inputs, size_t size, const struct tasks_content *contents,
                        size_t n_contents, const struct srnf_context *context,
                        struct tasks_bytes *result, struct srnf_error *error)
{
    struct tasks_searches searches;
    struct srnf_sht *sht = NULL;
    double *field, *marks = NULL;
    size_t points;
    int status;

    *result = (struct tasks_bytes){.bytes = NULL};
    if (!read_inputs(inputs, size, &searches) || n_contents != searches.n + 1) {
        return SRNF_EINVAL;
    }
    points = 3 * searches.n_landmarks;
    field = read_content(&contents[0], 3 * searches.n_theta * searches.n_phi, &status);
    if (field && points) {
        marks = read_content(&(struct tasks_content){.bytes = (const unsigned char *)inputs + HEAD,
                                                     .size = size - HEAD},
                             points * (1 + searches.n), &status);
        searches.fixed = marks;
    }
    if (status == SRNF_OK) {
        status = srnf_sht_create(&sht, searches.degree, SRNF_GRID_GAUSS_LEGENDRE, searches.n_theta,
                                 searches.n_phi);
    }
    for (size_t i = 0; i < searches.n && status == SRNF_OK; i++) {
        status = search_one(&searches, sht, field, marks ? marks + points * (1 + i) : NULL,
                            &contents[1 + i], context, result, error);
    }
    srnf_free(marks);
    srnf_sht_destroy(sht);
    srnf_free(field);
    if (status) {
        free(result->bytes);
        *result = (struct tasks_bytes){.bytes = NULL};
    }
    return status;
}

const struct tasks_kind tasks_searches_kind = {.name = TASKS_SEARCHES,
                                               .run = run_searches,
                                               .check = check_searches,
                                               .possible = possible_searches};
