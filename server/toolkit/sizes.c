/*
 * sizes.c - see sizes.h.
 *
 * A size is the root of the area that a surface has in the units of its file: what its record calls
 * area and scale; of a mesh the area that its report has.
 */
#include "toolkit/sizes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/models.h"
#include "api/warnings.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"
#include "toolkit/names.h"
#include "toolkit/outliers.h"
#include "toolkit/scales.h"

#define UNITS_FACTOR 10.0 /* of two sizes that count: more than any growth, less than mm and cm */
#define CLASSES_APART 4.0 /* of the sizes of two classes next to each other */
#define CLASS_MIN 3       /* members of the larger class */
#define STRUCTURES_APART 5.0 /* of two structures of a subject: few are so unlike in size */
#define MODEL_APART 5.0      /* of a surface and the mean of a model */

struct size {
    double value;    /* 0: not known */
    double compared; /* as the surface is stored: 1, or about that, of unit area; 0: not known */
    bool encoded;    /* from a file of the user */
};

static double sound(double value)
{
    return value > 0.0 && isfinite(value) ? value : 0.0;
}

/* A mesh among inputs is encoded at unit area. */
static struct size size_of_record(const char *text, bool mesh)
{
    json_t *record = json_loads(text ? text : "{}", 0, NULL);
    const char *process =
        json_string_value(json_object_get(json_object_get(record, "source"), "process"));
    double scale = mesh ? 1.0 : json_number_value(json_object_get(record, "scale"));
    double root = sqrt(json_number_value(json_object_get(record, "area")));
    struct size size = {.value = sound(root * scale),
                        .compared = mesh ? 1.0 : sound(root),
                        .encoded = mesh || (process && strcmp(process, "encode") == 0)};

    json_decref(record);
    return size;
}

static struct size size_of(struct store *store, const char *id)
{
    struct store_surface surface = {0};
    struct store_mesh mesh = {0};
    struct size size = {.value = 0.0};

    if (!id || strncmp(id, "model-", 6) == 0) {
        return size;
    }
    if (compute_is_mesh(id)) {
        if (process_read(store_mesh_get(store, id, &mesh))) {
            size = size_of_record(mesh.report, true);
        }
        store_mesh_clear(&mesh);
    } else if (process_read(store_surface_get(store, id, false, &surface))) {
        size = size_of_record(surface.record, false);
        store_surface_clear(&surface);
    }
    return size;
}

/* The mean of a model as it is compared with surfaces. */
static double compared_model(struct store *store, const char *id)
{
    struct store_model model = {.record = NULL};
    double compared = 0.0;

    if (process_read(store_model_get(store, id, 0, &model))) {
        compared = size_of(store, model.mean).compared;
        store_model_clear(&model);
    }
    return compared;
}

/* ---- Sizes that count ------------------------------------------------------------------------ */

struct size_tally {
    struct store *store;
    bool compared;            /* sizes as the surfaces are stored, and not those of their files */
    char id[2][STORE_ID_MAX]; /* of the least and the greatest */
    double size[2];
    size_t n;
};

static void tally_size(void *user, const char *id, const char *label)
{
    struct size_tally *tally = user;
    const struct size own = size_of(tally->store, id);
    double size = tally->compared ? own.compared : own.value;

    (void)label;
    if (tally->compared && id && strncmp(id, "model-", 6) == 0) {
        size = compared_model(tally->store, id);
    }
    if (!(size > 0.0)) {
        return;
    }
    for (int end = 0; end < 2; end++) {
        if (tally->n == 0 || (end ? size > tally->size[1] : size < tally->size[0])) {
            tally->size[end] = size;
            (void)snprintf(tally->id[end], STORE_ID_MAX, "%s", id);
        }
    }
    tally->n++;
}

/* Of a transfer the target has its own units, unless sizes are absolute. */
static void tally_transfer(struct size_tally *tally, const json_t *inputs)
{
    const char *size = json_string_value(json_object_get(inputs, "size"));

    tally_size(tally, json_string_value(json_object_get(inputs, "source")), NULL);
    tally_size(tally, json_string_value(json_object_get(inputs, "deformed")), NULL);
    if (size && strcmp(size, "absolute") == 0) {
        tally_size(tally, json_string_value(json_object_get(inputs, "target")), NULL);
    }
}

/* Whether two are far apart, and then that they are.
     part  [in] of several structures the name of the one that was counted; NULL: all there is */
static bool tell_apart(const struct size_tally *tally, const json_t *part, json_t *document)
{
    const char *name = json_string_value(part);

    if (tally->n < 2 || tally->size[1] < UNITS_FACTOR * tally->size[0]) {
        return false;
    }
    warning_add(warnings_of(document), "mixed-units",
                json_pack("{s:o, s:s, s:o, s:s, s:s*}", "least", json_finite(tally->size[0]),
                          "smallest", tally->id[0], "greatest", json_finite(tally->size[1]),
                          "largest", tally->id[1], "part", name),
                "%s%.60s%sizes count here, and %s is %.3g times as large as %s (roots of their "
                "areas: %.4g and %.4g). Are the files in one unit, and not some in millimetres and "
                "others in metres?",
                name ? "Part " : "", name ? name : "", name ? ": s" : "S", tally->id[1],
                tally->size[1] / tally->size[0], tally->id[0], tally->size[1], tally->size[0]);
    return true;
}

/* Each structure of a cohort by itself: its size is a number of its own. */
static bool tell_parts(struct store *store, const json_t *cohort, bool compared, json_t *document)
{
    const json_t *ids = json_object_get(cohort, "surfaces"), *part;
    const json_t *parts = json_object_get(cohort, "parts");
    size_t n = json_array_size(ids) / json_array_size(parts), p;
    bool told = false;

    json_array_foreach(parts, p, part)
    {
        struct size_tally tally = {.store = store, .compared = compared};

        for (size_t i = 0; i < n; i++) {
            tally_size(&tally, json_string_value(json_array_get(ids, p * n + i)), NULL);
        }
        told = tell_apart(&tally, part, document) || told;
    }
    return told;
}

static bool sizes_count(const json_t *inputs)
{
    const char *scale = json_string_value(json_object_get(inputs, "scale"));

    return json_object_get(inputs, "deformed") || (scale && strcmp(scale, "shape-and-size") == 0);
}

/* Whether what is compared is compared as it is stored, so that the sizes of surfaces that are not
   of unit area count. Processes with an input scale do by themselves what that says, transfer and
   classifiers bring all to one area; the parts of a subject have sizes of their own. */
static bool compares_as_stored(struct store *store, const json_t *inputs)
{
    const char *id = json_string_value(json_object_get(inputs, "model"));
    struct store_model model = {.record = NULL};
    bool classifier = false;

    if (id && process_read(store_model_get(store, id, 0, &model))) {
        classifier = strcmp(model_kind(&model), "classifier") == 0;
        store_model_clear(&model);
    }
    return !json_object_get(inputs, "scale") && !json_object_get(inputs, "deformed") &&
           json_object_size(json_object_get(inputs, "parts")) == 0 && !classifier;
}

/* Whether sizes, which count, are far apart, and then that they are.
     compared  [in] those that the surfaces are stored with */
static bool warn_counted(struct store *store, const json_t *inputs, bool compared, json_t *document)
{
    const json_t *cohort = json_object_get(inputs, "cohort");
    struct size_tally tally = {.store = store, .compared = compared};

    if (json_object_get(inputs, "deformed")) {
        tally_transfer(&tally, inputs);
    } else if (json_array_size(json_object_get(cohort, "parts")) > 0) {
        return tell_parts(store, cohort, compared, document);
    } else {
        inputs_each(inputs, true, tally_size, &tally);
    }
    return tell_apart(&tally, NULL, document);
}

/* ---- Sizes of groups ------------------------------------------------------------------------- */

static double middle_of(size_t n, const double *sorted)
{
    return 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
}

size_t sizes_split(size_t n, double *sizes, double *ratio)
{
    double gap = 1.0;
    size_t low = 0;

    (void)sorted_median(n, sizes);
    for (size_t i = 0; i + 1 < n; i++) {
        if (sizes[i + 1] > gap * sizes[i]) {
            gap = sizes[i + 1] / sizes[i];
            low = i + 1;
        }
    }
    if (!(gap >= CLASSES_APART) || (low < CLASS_MIN && n - low < CLASS_MIN) ||
        !(gap > sizes[low - 1] / sizes[0]) || !(gap > sizes[n - 1] / sizes[low])) {
        return 0;
    }
    *ratio = middle_of(n - low, sizes + low) / middle_of(low, sizes);
    return low;
}

struct sizes {
    struct jobs_run *run;
    struct store *store;
    const json_t *subjects; /* of the cohort, or NULL */
    size_t n;               /* surfaces */
    const json_t *ids;      /* [n] */
    double *values;         /* [n] 0: not known */
    double *sorted;         /* [n] of scratch */
    const json_t *parts;    /* names of the structures, part after part; NULL: one */
    bool stored;            /* surfaces are compared as they are stored */
    bool count;             /* as well as shapes */
};

/* "Part amygdala: ", or nothing. */
static void name_part(const struct sizes *s, size_t part, char text[96])
{
    const char *name = json_string_value(json_array_get(s->parts, part));

    text[0] = '\0';
    if (name) {
        (void)snprintf(text, 96, "Part %.60s: ", name);
    }
}

/* The known sizes of members [from, from + n), sorted. */
static size_t sort_known(const struct sizes *s, size_t from, size_t n)
{
    size_t count = 0;

    for (size_t i = from; i < from + n; i++) {
        if (s->values[i] > 0.0) {
            s->sorted[count++] = s->values[i];
        }
    }
    (void)sorted_median(count, s->sorted);
    return count;
}

/* Of a part members are subjects, and have numbers of their own. */
static void name_first(const struct sizes *s, size_t from, size_t first, char who[GROUP_WHO])
{
    json_t *own = json_array();

    for (size_t i = from; i <= first; i++) {
        (void)json_array_append(own, json_array_get(s->ids, i));
    }
    group_who(s->run, own, s->subjects, first - from, who);
    who[0] = 'm';
    json_decref(own);
}

static void warn_classes(const struct sizes *s, size_t part, size_t n, json_t *document)
{
    size_t from = part * n, count = sort_known(s, from, n), low, first = from, few;
    double ratio = 1.0, limit;
    char name[96], who[GROUP_WHO];
    json_t *figures, *members = json_array();
    bool below;

    low = count > 0 ? sizes_split(count, s->sorted, &ratio) : 0;
    if (low == 0) {
        json_decref(members);
        return;
    }
    below = 2 * low <= count;
    few = below ? low : count - low;
    limit = s->sorted[low];
    for (size_t i = from + n; i > from; i--) {
        if (s->values[i - 1] > 0.0 && (s->values[i - 1] < limit) == below) {
            first = i - 1;
            (void)json_array_insert_new(members, 0, json_integer((json_int_t)(first - from)));
        }
    }
    name_part(s, part, name);
    name_first(s, from, first, who);
    figures = json_pack("{s:o, s:o, s:f, s:f, s:f}", "members", members, "first",
                        json_incref(json_array_get(s->ids, first)), "size", s->values[first],
                        "median", middle_of(count, s->sorted), "ratio", ratio);
    if (*name) {
        (void)json_object_set(figures, "part", json_array_get(s->parts, part));
    }
    warning_add(
        warnings_of(document), "mixed-units", figures,
        "%sSizes fall into two classes: those of %zu of %zu members, %s first, "
        "are %.3g times %s than those of the others (medians of roots of areas). Are they "
        "in another unit, as centimetres among millimetres, or of another structure? %s",
        name, few, count, who, ratio, below ? "smaller" : "larger",
        s->count ? "Sizes count here, and decide what is found."
                 : "Where sizes do not count a unit changes no distance of shapes, and a structure "
                   "does.");
}

/* Structures of which one is far larger than another, where their distances from each other count
   in units of their sizes. */
static void warn_structures(const struct sizes *s, size_t n_parts, size_t n, json_t *document)
{
    size_t end[2] = {0, 0};
    double size[2] = {INFINITY, 0.0};
    const char *names[2];

    for (size_t p = 0; p < n_parts; p++) {
        size_t count = sort_known(s, p * n, n);
        double middle = count > 0 ? middle_of(count, s->sorted) : 0.0;

        if (middle > 0.0 && middle < size[0]) {
            size[0] = middle;
            end[0] = p;
        }
        if (middle > size[1]) {
            size[1] = middle;
            end[1] = p;
        }
    }
    if (!(size[1] >= STRUCTURES_APART * size[0])) {
        return;
    }
    for (int k = 0; k < 2; k++) {
        names[k] = json_string_value(json_array_get(s->parts, end[k]));
    }
    warning_add(
        warnings_of(document), "mixed-units",
        json_pack("{s:f, s:s, s:f, s:s}", "least", size[0], "smallest", names[0], "greatest",
                  size[1], "largest", names[1]),
        "Part %.60s is %.3g times as large as part %.60s (medians of the roots of their "
        "areas: %.4g and %.4g), and where the parts are to each other counts. Are the files "
        "of both in one unit, and not one in millimetres and the other in centimetres?",
        names[1], size[1] / size[0], names[0], size[1], size[0]);
}

/* Surfaces beside a model whose mean has another size by far. A mean of surfaces that were sent in
   has the scale 1, and no size that is known. */
static void warn_beside(struct store *store, const json_t *inputs, json_t *document)
{
    const char *id = json_string_value(json_object_get(inputs, "model"));
    const char *surface = json_string_value(json_object_get(inputs, "surface"));
    struct size own = size_of(store, surface), mean = {.value = 0.0};
    struct store_model model = {.record = NULL};
    struct store_surface stored = {0};
    bool known = false;

    if (!id || !own.encoded || !process_read(store_model_get(store, id, 0, &model))) {
        return;
    }
    if (process_read(store_surface_get(store, model.mean, false, &stored))) {
        json_t *record = json_loads(stored.record ? stored.record : "{}", 0, NULL);

        known = json_number_value(json_object_get(record, "scale")) != 1.0;
        mean = size_of_record(stored.record, false);
        json_decref(record);
        store_surface_clear(&stored);
    }
    store_model_clear(&model);
    if (known && own.value > 0.0 && mean.value > 0.0 &&
        fmax(own.value, mean.value) >= MODEL_APART * fmin(own.value, mean.value)) {
        warning_add(warnings_of(document), "mixed-units",
                    json_pack("{s:f, s:f}", "size", own.value, "mean", mean.value),
                    "The surface has the size %.4g, the mean of the model %.4g (roots of their "
                    "areas). Is its file in the unit of theirs, and of the same structure? A unit "
                    "changes nothing of its shape.",
                    own.value, mean.value);
    }
}

static bool read_sizes(struct sizes *s)
{
    double least = INFINITY, greatest = 0.0;

    s->values = srnf_alloc(s->n, 2 * sizeof *s->values);
    if (!s->values) {
        json_memory_fail(); /* a warning may be missing */
        return false;
    }
    s->sorted = s->values + s->n;
    for (size_t i = 0; i < s->n; i++) {
        struct size size = size_of(s->store, json_string_value(json_array_get(s->ids, i)));

        s->values[i] = size.encoded ? size.value : 0.0;
        if (size.encoded && size.compared > 0.0) {
            least = fmin(least, size.compared);
            greatest = fmax(greatest, size.compared);
        }
    }
    s->count = s->count || (s->stored && greatest >= CLASSES_APART * least);
    return true;
}

/* The names of the structures that surfaces are of, part after part (new reference): those of the
   cohort, or of the subjects that predict is given one by one; empty: it is one structure. */
static json_t *parts_of(const json_t *inputs, const json_t *surfaces)
{
    json_t *names = json_object_get(json_object_get(inputs, "cohort"), "parts");
    json_t *first = json_array_get(json_object_get(inputs, "parts"), 0), *id;
    size_t count = json_object_size(first);
    const char *name;

    names = names ? json_incref(names) : json_array();
    for (size_t p = 0; p < count; p++) {
        const json_t *own = json_array_get(surfaces, p * (json_array_size(surfaces) / count));

        json_object_foreach(first, name, id)
        {
            if (json_equal(id, own) && json_array_size(names) == p) {
                (void)json_array_append_new(names, json_string(name));
            }
        }
    }
    return names;
}

void units_warn(struct jobs_run *run, const json_t *inputs, json_t *document)
{
    const json_t *surfaces = json_object_get(json_object_get(inputs, "cohort"), "surfaces");
    struct sizes s = {.run = run,
                      .store = jobs_run_store(run),
                      .subjects = json_object_get(json_object_get(inputs, "cohort"), "subjects"),
                      .count = sizes_count(inputs)};
    json_t *parts;
    size_t n_parts;

    s.stored = !s.count && compares_as_stored(s.store, inputs);
    if ((s.count || s.stored) && warn_counted(s.store, inputs, s.stored, document)) {
        return;
    }
    if (!s.count) {
        warn_beside(s.store, inputs, document);
    }
    s.ids = surfaces ? surfaces : json_object_get(inputs, "surfaces");
    s.n = json_array_size(s.ids);
    s.parts = parts = parts_of(inputs, s.ids);
    n_parts = json_array_size(s.parts) ? json_array_size(s.parts) : 1;
    if (s.n > 1 && s.n % n_parts == 0 && read_sizes(&s)) {
        for (size_t p = 0; p < n_parts; p++) {
            warn_classes(&s, p, s.n / n_parts, document);
        }
        if (json_is_true(json_object_get(inputs, "relativePose"))) {
            warn_structures(&s, n_parts, s.n / n_parts, document);
        }
    }
    json_decref(parts);
    srnf_free(s.values);
}
