/*
 * scales.c - scales, degrees and volumes of what a process compares, from the records.
 */
#include "toolkit/scales.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/models.h"
#include "api/warnings.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"
#include "toolkit/names.h"

/* Of the area of an encoded surface, which was divided by it: rounding, and the figures of its
   record. */
#define AREA_EXACT 1e-6
#define AREA_NEAR 2.0 /* factor within which a made surface counts as one of unit area */
#define AREA_FAR 10.0 /* factor beyond which it does not */
#define LABEL_SHOWN 60
#define PARTED_MIN 2 /* members of a label that a degree can go with */
#define OTHERS_MIN 3 /* members of which some can be the others */
#define OTHERS_NAMED ((size_t)3)
#define OTHERS_SHOWN ((size_t)100)
#define OTHERS_TEXT 400

/* ---- What is compared ------------------------------------------------------------------------ */

void inputs_each(const json_t *inputs, bool with_transfer,
                 void (*visit)(void *user, const char *id, const char *label), void *user)
{
    static const char *const single[] = {"model",  "surface", "from",     "to",    "template",
                                         "moving", "source",  "deformed", "target"};
    static const char *const velocities[] = {"velocity", "vector"};
    const size_t count = sizeof single / sizeof single[0] - (with_transfer ? 0 : 3);
    const json_t *cohort = json_object_get(inputs, "cohort");
    const json_t *groups[] = {json_object_get(inputs, "surfaces"),
                              json_object_get(cohort, "surfaces")};
    const json_t *labels = json_object_get(cohort, "labels");
    const size_t which = groups[1] ? 1 : 0;
    const char *part;
    json_t *surface;

    for (size_t i = 0; i < count; i++) {
        visit(user, json_string_value(json_object_get(inputs, single[i])), NULL);
    }
    for (size_t i = 0; i < sizeof velocities / sizeof velocities[0]; i++) {
        visit(user,
              json_string_value(json_object_get(json_object_get(inputs, velocities[i]), "toward")),
              NULL);
    }
    for (size_t i = 0; i < json_array_size(groups[which]); i++) {
        visit(user, json_string_value(json_array_get(groups[which], i)),
              json_string_value(json_array_get(labels, i)));
    }
    /* Of a subject of several structures; each has a size of its own. */
    json_object_foreach(with_transfer ? json_object_get(inputs, "parts") : NULL, part, surface)
    {
        visit(user, json_string_value(surface), NULL);
    }
}

struct traits {
    bool known, encoded, measured;
    bool unscaled; /* a classifier, which brings all it is asked about to unit area by itself */
    double area, volume;
    int64_t degree;
};

static void read_surface(struct store *store, const char *id, struct traits *traits)
{
    struct store_surface surface = {0};
    json_t *record = NULL;
    const char *process;

    if (!process_read(store_surface_get(store, id, false, &surface))) {
        return;
    }
    record = json_loads(surface.record ? surface.record : "{}", 0, NULL);
    process = json_string_value(json_object_get(json_object_get(record, "source"), "process"));
    *traits = (struct traits){.known = true,
                              .encoded = process && strcmp(process, "encode") == 0,
                              .measured = json_is_number(json_object_get(record, "volume")),
                              .area = json_number_value(json_object_get(record, "area")),
                              .volume = json_number_value(json_object_get(record, "volume")),
                              .degree = surface.lmax};
    json_decref(record);
    store_surface_clear(&surface);
}

/* A mesh is encoded with the default options; of a model the mean counts. */
static struct traits find_traits(struct store *store, const char *id)
{
    struct traits traits = {.known = false};
    struct store_model model = {.record = NULL};

    if (!id) {
        return traits;
    }
    if (compute_is_mesh(id)) {
        return (struct traits){
            .known = true, .encoded = true, .area = 1.0, .degree = PROCESS_DEGREE_DEFAULT};
    }
    if (strncmp(id, "model-", 6) != 0) {
        read_surface(store, id, &traits);
    } else if (process_read(store_model_get(store, id, 0, &model))) {
        read_surface(store, model.mean, &traits);
        traits.unscaled = strcmp(model_kind(&model), "classifier") == 0;
        store_model_clear(&model);
    }
    return traits;
}

/* ---- Scales ---------------------------------------------------------------------------------- */

enum scale_kind {
    SCALE_UNIT,      /* encoded at unit area */
    SCALE_NEAR_UNIT, /* made, with about that area */
    SCALE_NEAR_OWN,  /* encoded in its own units, with about that area */
    SCALE_OWN,       /* of another area */
    SCALE_KINDS,
    SCALE_UNKNOWN = SCALE_KINDS
};

struct scale_tally {
    struct store *store;
    size_t n[SCALE_KINDS + 1];
    char first[SCALE_KINDS + 1][STORE_ID_MAX];
    double area[SCALE_KINDS + 1]; /* of the first */
};

static enum scale_kind kind_of(const struct traits *traits)
{
    double factor = fmax(traits->area, 1.0 / traits->area);

    if (!traits->known || traits->unscaled || !(traits->area > 0.0)) {
        return SCALE_UNKNOWN;
    }
    if (traits->encoded) {
        return factor < 1.0 + AREA_EXACT ? SCALE_UNIT
               : factor < AREA_NEAR      ? SCALE_NEAR_OWN
                                         : SCALE_OWN;
    }
    return factor < AREA_NEAR ? SCALE_NEAR_UNIT : factor > AREA_FAR ? SCALE_OWN : SCALE_UNKNOWN;
}

static void tally_scale(void *user, const char *id, const char *label)
{
    struct scale_tally *tally = user;
    const struct traits traits = find_traits(tally->store, id);
    enum scale_kind kind = kind_of(&traits);

    (void)label;
    if (tally->n[kind]++ == 0 && id) {
        (void)snprintf(tally->first[kind], STORE_ID_MAX, "%s", id);
        tally->area[kind] = traits.area;
    }
}

bool inputs_scales(struct process_inputs *inputs)
{
    struct scale_tally tally = {.store = inputs->call->api->config.store};
    enum scale_kind unit = SCALE_UNIT, own = SCALE_OWN;

    inputs_each(inputs->canonical, false, tally_scale, &tally);
    if (tally.n[SCALE_UNIT] == 0) {
        unit = SCALE_NEAR_UNIT;
    } else if (tally.n[SCALE_OWN] == 0) {
        own = SCALE_NEAR_OWN;
    }
    if (tally.n[unit] == 0 || tally.n[own] == 0) {
        return true;
    }
    (void)problem_respond(inputs->call, "mixed-scales",
                          "The surfaces are of two scales: %zu of unit area (%s) and %zu of a size "
                          "of their own (%s has the area %.6g). Their sizes would count as "
                          "differences in shape. Encode all meshes again with one scale; meshes "
                          "among the inputs are encoded at unit area.",
                          tally.n[SCALE_UNIT] + tally.n[SCALE_NEAR_UNIT], tally.first[unit],
                          tally.n[own], tally.first[own], tally.area[own]);
    inputs->answered = true;
    return false;
}

/* ---- Degrees --------------------------------------------------------------------------------- */

struct degree_range {
    const char *label; /* borrowed from the inputs */
    int64_t lowest, highest;
    size_t n;
};

struct degree_tally {
    struct store *store;
    int64_t most; /* beyond which all are cut off; 0: nothing is */
    struct degree_range all;
    struct degree_range first, other; /* of the two labels that are furthest from each other */
    bool parted;
    bool as_members;             /* beside a model, for which meshes are encoded as those were */
    struct degree_range *labels; /* [n_labels] */
    size_t n_labels, capacity;
};

static void widen(struct degree_range *range, int64_t degree)
{
    range->lowest = range->n == 0 || degree < range->lowest ? degree : range->lowest;
    range->highest = degree > range->highest ? degree : range->highest;
    range->n++;
}

static void tally_degree(void *user, const char *id, const char *label)
{
    struct degree_tally *tally = user;
    const struct traits traits = find_traits(tally->store, id);
    bool fits = tally->as_members && id && compute_is_mesh(id);
    int64_t degree = tally->most && traits.degree > tally->most ? tally->most : traits.degree;
    size_t i = 0;

    if (!traits.known || fits) {
        return;
    }
    widen(&tally->all, degree);
    while (label && i < tally->n_labels && strcmp(tally->labels[i].label, label) != 0) {
        i++;
    }
    if (!label || i == tally->capacity) {
        return;
    }
    tally->n_labels += i == tally->n_labels;
    tally->labels[i].label = label;
    widen(&tally->labels[i], degree);
}

/* Two labels, of PARTED_MIN members or more: all degrees of one are below all of the other. */
static void find_parted(struct degree_tally *tally)
{
    for (size_t i = 0; i < tally->n_labels; i++) {
        for (size_t j = 0; j < tally->n_labels && !tally->parted; j++) {
            if (tally->labels[i].n >= PARTED_MIN && tally->labels[j].n >= PARTED_MIN &&
                tally->labels[i].highest < tally->labels[j].lowest) {
                tally->parted = true;
                tally->first = tally->labels[i];
                tally->other = tally->labels[j];
            }
        }
    }
}

/* The degree that most have, of several the lowest. */
static int64_t usual_degree(size_t n, const int64_t *degrees)
{
    size_t counts[SRNF_DEGREE_MAX + 1] = {0}, best = 0;

    for (size_t i = 0; i < n; i++) {
        counts[degrees[i] >= 0 && degrees[i] <= SRNF_DEGREE_MAX ? degrees[i] : 0]++;
    }
    for (size_t k = 1; k <= SRNF_DEGREE_MAX; k++) {
        best = counts[k] > (best ? counts[best] : 0) ? k : best;
    }
    return (int64_t)best;
}

/* Names the members of a group that have not the degree of most: the first in words, and up to
   OTHERS_SHOWN in the figures. Of several structures each member has several, and none is named. */
static void name_others(struct jobs_run *run, const struct degree_tally *tally,
                        const json_t *inputs, json_t *figures, char text[OTHERS_TEXT])
{
    const json_t *cohort = json_object_get(inputs, "cohort");
    const json_t *own = json_object_get(cohort, "surfaces");
    const json_t *ids = own ? own : json_object_get(inputs, "surfaces");
    size_t n = json_array_size(ids), count = 0, length = 0;
    int64_t *degrees = n >= OTHERS_MIN ? srnf_alloc(n, sizeof *degrees) : NULL, usual;
    json_t *members = json_array();
    char named[OTHERS_TEXT] = "";

    for (size_t i = 0; degrees && i < n; i++) {
        const struct traits traits =
            find_traits(tally->store, json_string_value(json_array_get(ids, i)));

        degrees[i] = tally->most && traits.degree > tally->most ? tally->most : traits.degree;
    }
    usual = degrees ? usual_degree(n, degrees) : 0;
    for (size_t i = 0; degrees && i < n; i++) {
        char who[GROUP_WHO];

        if (degrees[i] <= 0 || degrees[i] == usual) {
            continue;
        }
        if (count++ < OTHERS_NAMED) {
            group_who(run, ids, json_object_get(cohort, "subjects"), i, who);
            who[0] = 'm';
            (void)snprintf(named + length, sizeof named - length, "%s%.80s at %lld",
                           length ? ", " : "", who, (long long)degrees[i]);
            length = strlen(named);
        }
        if (count <= OTHERS_SHOWN) {
            (void)json_array_append_new(members, json_integer((json_int_t)i));
        }
    }
    if (count > 0) {
        (void)snprintf(text, OTHERS_TEXT,
                       " %zu of %zu members %s not at %lld, which most are: %s%s.", count, n,
                       count == 1 ? "is" : "are", (long long)usual, named,
                       count > OTHERS_NAMED ? " and others" : "");
        (void)json_object_set_new(figures, "usual", json_integer((json_int_t)usual));
        (void)json_object_set_new(figures, "others", json_integer((json_int_t)count));
        (void)json_object_set(figures, "members", members);
    }
    json_decref(members);
    srnf_free(degrees);
}

static void add_degrees(struct jobs_run *run, const struct degree_tally *tally,
                        const json_t *inputs, json_t *document)
{
    json_t *figures = json_pack("{s:I, s:I}", "lowest", (json_int_t)tally->all.lowest, "highest",
                                (json_int_t)tally->all.highest);
    char parted[320] = "", others[OTHERS_TEXT] = "";

    if (tally->parted) {
        (void)snprintf(parted, sizeof parted,
                       " The degree goes with the label: up to %lld for %.*s, from %lld for %.*s; "
                       "what looks like a difference of these groups may be no more than that.",
                       (long long)tally->first.highest, LABEL_SHOWN, tally->first.label,
                       (long long)tally->other.lowest, LABEL_SHOWN, tally->other.label);
        (void)json_object_set_new(figures, "labels",
                                  json_pack("[s, s]", tally->first.label, tally->other.label));
    }
    if (!tally->as_members &&
        json_array_size(json_object_get(json_object_get(inputs, "cohort"), "parts")) == 0) {
        name_others(run, tally, inputs, figures, others);
    }
    warning_add(
        warnings_of(document), "mixed-degrees", figures,
        "What is compared was made at degrees from %lld to %lld: finer detail of some "
        "counts as a difference in shape.%s%s Encode all meshes with one lmax (a mesh among "
        "the inputs is encoded at %d), or take lmax %lld where the process has it.",
        (long long)tally->all.lowest, (long long)tally->all.highest, others, parted,
        PROCESS_DEGREE_DEFAULT, (long long)tally->all.lowest);
}

/* The degree of a classifier, which cuts off what is finer; 0: it is none. */
static int64_t kept_degree(struct store *store, const json_t *inputs)
{
    const char *id = json_string_value(json_object_get(inputs, "model"));
    struct store_model model = {.record = NULL};
    int64_t degree = 0;

    if (json_object_get(inputs, "surfaces") &&
        process_read(store_model_get(store, id, 0, &model))) {
        degree = model.lmax;
        store_model_clear(&model);
    }
    return degree;
}

void degrees_warn(struct jobs_run *run, const json_t *inputs, json_t *document)
{
    const json_t *cohort = json_object_get(inputs, "cohort");
    size_t members = json_array_size(json_object_get(cohort, "labels"));
    struct degree_tally tally = {
        .store = jobs_run_store(run),
        .most = json_integer_value(json_object_get(inputs, "lmax")),
        .labels = srnf_alloc(members ? members : 1, sizeof *tally.labels),
        .capacity = members,
        .as_members = json_is_string(json_object_get(inputs, "model")),
    };

    if (!tally.labels) {
        json_memory_fail(); /* a warning may be missing */
        return;
    }
    if (tally.as_members && tally.most == 0) {
        tally.most = kept_degree(tally.store, inputs);
    }
    inputs_each(inputs, true, tally_degree, &tally);
    find_parted(&tally);
    if (tally.all.n > 1 && tally.all.lowest < tally.all.highest) {
        add_degrees(run, &tally, inputs, document);
    }
    srnf_free(tally.labels);
}

/* ---- Volumes --------------------------------------------------------------------------------- */

struct shape_tally {
    struct store *store;
    struct {
        size_t n;
        char first[STORE_ID_MAX];
        double area, volume; /* of the first */
    } of[SHAPES];
};

static void tally_shape(void *user, const char *id, const char *label)
{
    struct shape_tally *tally = user;
    const struct traits traits = find_traits(tally->store, id);
    enum warning_shape shape =
        traits.measured ? warning_shape_of(traits.area, traits.volume) : SHAPE_SOUND;

    (void)label;
    if (tally->of[shape].n++ == 0 && id) {
        (void)snprintf(tally->of[shape].first, STORE_ID_MAX, "%s", id);
        tally->of[shape].area = traits.area;
        tally->of[shape].volume = traits.volume;
    }
}

void shapes_warn(struct jobs_run *run, const json_t *inputs, json_t *document)
{
    struct shape_tally tally = {.store = jobs_run_store(run)};

    inputs_each(inputs, true, tally_shape, &tally);
    for (size_t i = SHAPE_SOUND + 1; i < SHAPES; i++) {
        if (tally.of[i].n > 0) {
            warning_shape(warnings_of(document), tally.of[i].first, tally.of[i].n, tally.of[i].area,
                          tally.of[i].volume);
        }
    }
}
