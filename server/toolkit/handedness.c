/*
 * handedness.c - mirror-images: left and right structures are mirror images of each other, and no
 * registration, which keeps orientation, brings one onto the other. Compared as they are, they
 * differ by their handedness, and that looks like a difference in shape.
 *
 * Where distances are at hand (distances, register, geodesic) a mirrored match is tried and the
 * warning has its figures. Elsewhere what the members are called speaks alone (sides.c).
 */
#include "toolkit/handedness.h"

#include <string.h>

#include "api/json_memory.h"
#include "api/warnings.h"
#include "store/mesh.h"
#include "store/surface.h"

const char *const handedness_choices[] = {"check", "ignore", NULL};

/* ---- Sides of members ------------------------------------------------------------------------ */

/* The name that a mesh or surface has (new reference, or NULL), and whether it is mirrored. */
static json_t *name_of(struct jobs_run *run, const char *id, bool *mirrored)
{
    struct store *store = jobs_run_store(run);
    const char *owner = jobs_run_owner(run);
    struct store_surface surface = {0};
    struct store_mesh mesh = {0};
    json_t *name = NULL;

    *mirrored = false;
    if (compute_is_mesh(id)) {
        if (process_read(store_mesh_get_as(store, owner, id, &mesh)) && mesh.name) {
            name = json_string(mesh.name);
        }
        *mirrored = mesh_mirrored(&mesh);
        store_mesh_clear(&mesh);
    } else if (process_read(store_surface_get_as(store, owner, id, false, &surface))) {
        *mirrored = surface_record_mirrored(&surface);
        name = surface.name ? json_string(surface.name) : NULL;
    }
    store_surface_clear(&surface);
    return name;
}

static void read_member(struct jobs_run *run, const char *id, const json_t *label,
                        const json_t *subject, bool flipped, struct side_reading *readings)
{
    bool mirrored;
    json_t *name = name_of(run, id, &mirrored);
    const char *const texts[SIDES_TEXTS] = {json_string_value(label), json_string_value(subject),
                                            json_string_value(name)};

    for (size_t k = 0; k < SIDES_TEXTS; k++) {
        readings[k] = side_read(texts[k]);
        if (flipped != mirrored) {
            readings[k].side = (enum side) - (int)readings[k].side;
        }
    }
    json_decref(name);
}

bool group_sides_read(struct jobs_run *run, const json_t *surfaces, const json_t *cohort,
                      struct group_sides *sides)
{
    const json_t *labels = json_object_get(cohort, "labels");
    const json_t *subjects = json_object_get(cohort, "subjects");
    const json_t *mirrored = json_object_get(cohort, "mirrored");
    size_t n = json_array_size(surfaces);

    *sides = (struct group_sides){.readings = srnf_alloc(n ? n : 1, sizeof *sides->readings)};
    if (!sides->readings) {
        return false;
    }
    sides->n = n;
    for (size_t i = 0; i < n; i++) {
        const char *id = json_string_value(json_array_get(surfaces, i));

        read_member(run, id ? id : "", json_array_get(labels, i), json_array_get(subjects, i),
                    json_is_true(json_array_get(mirrored, i)), sides->readings[i]);
    }
    return true;
}

void group_sides_clear(struct group_sides *sides)
{
    srnf_free(sides->readings);
    *sides = (struct group_sides){0};
}

bool group_sides_opposite(const void *user, size_t i, size_t j)
{
    const struct group_sides *sides = user;
    bool opposite = false;

    for (size_t k = 0; k < SIDES_TEXTS; k++) {
        opposite = opposite || sides_opposite(&sides->readings[i][k], &sides->readings[j][k]);
    }
    return opposite;
}

/* ---- Warnings -------------------------------------------------------------------------------- */

#define WAY_OUT "encode one side with mirror = true, or set mirror of its members in the cohort"

static const char *label_at(const json_t *labels, size_t i)
{
    const char *label = json_string_value(json_array_get(labels, i));

    return label ? label : "?";
}

json_t *handedness_of_trials(const json_t *labels, const struct compute_handedness *handedness)
{
    json_t *warnings = json_array(), *pairs = json_array();
    const struct compute_mirror_trial *best = NULL;
    size_t better = 0;

    for (size_t k = 0; k < handedness->n_trials; k++) {
        const struct compute_mirror_trial *trial = &handedness->trials[k];

        if (!compute_mirror_better(trial, true)) {
            continue;
        }
        better++;
        best = best && best->mirrored * trial->distance <= trial->mirrored * best->distance ? best
                                                                                            : trial;
        (void)json_array_append_new(
            pairs, json_pack("{s:I, s:I, s:o, s:o}", "first", (json_int_t)trial->first, "second",
                             (json_int_t)trial->second, "distance", json_finite(trial->distance),
                             "mirrored", json_finite(trial->mirrored)));
    }
    if (!best) {
        json_decref(pairs);
        return warnings;
    }
    warning_add(warnings, "mirror-images",
                json_pack("{s:I, s:I, s:o}", "tried", (json_int_t)handedness->n_trials, "better",
                          (json_int_t)better, "pairs", pairs),
                "%.80s and %.80s: mirrored%s, the distance would be %.3g instead of %.3g; so it is "
                "for %zu of the %zu pairs of a left and a right one that were tried. To compare "
                "them by shape, " WAY_OUT ".",
                label_at(labels, best->first), label_at(labels, best->second),
                handedness->registered ? " and registered" : ", unregistered like this one",
                best->mirrored, best->distance, better, handedness->n_trials);
    return warnings;
}

/* What to call a member: its label, unless that is shared and so says little, or its name. */
static json_t *title_of(struct jobs_run *run, const json_t *surfaces, const json_t *cohort,
                        size_t i)
{
    const char *id = json_string_value(json_array_get(surfaces, i));
    json_t *label = json_array_get(json_object_get(cohort, "labels"), i), *name;
    bool mirrored;

    if (json_is_string(label)) {
        return json_incref(label);
    }
    name = name_of(run, id ? id : "", &mirrored);
    return json_string_length(name) > 0 ? name : (json_decref(name), json_string(id ? id : "?"));
}

/* Members that have an opposite one; first and second are the first such pair. */
static size_t count_sided(const struct group_sides *sides, size_t *first, size_t *second)
{
    size_t count = 0;

    for (size_t i = 0; i < sides->n; i++) {
        size_t j = 0;

        while (j < sides->n && !group_sides_opposite(sides, i, j)) {
            j++;
        }
        if (j < sides->n && count++ == 0) {
            *first = i;
            *second = j;
        }
    }
    return count;
}

json_t *handedness_of_names(struct jobs_run *run, const json_t *surfaces, const json_t *cohort)
{
    json_t *warnings = json_array();
    struct group_sides sides;
    size_t first = 0, second = 0, count;

    if (!group_sides_read(run, surfaces, cohort, &sides)) {
        json_memory_fail();
        return warnings;
    }
    count = count_sided(&sides, &first, &second);
    if (count > 0) {
        json_t *a = title_of(run, surfaces, cohort, first);
        json_t *b = title_of(run, surfaces, cohort, second);

        warning_add(warnings, "mirror-images",
                    json_pack("{s:I, s:I, s:I}", "members", (json_int_t)count, "first",
                              (json_int_t)first, "second", (json_int_t)second),
                    "%.80s and %.80s: by what they are called, %zu members are left and right ones "
                    "of the same. Those are mirror images of each other, and unless one side is "
                    "mirrored their handedness counts as a difference in shape: " WAY_OUT ".",
                    json_string_value(a), json_string_value(b), count);
        json_decref(a);
        json_decref(b);
    }
    group_sides_clear(&sides);
    return warnings;
}

/* The member that new surface i is the other side of, or their number. */
static size_t find_opposite(const struct group_sides *sides, size_t i,
                            const struct group_sides *members)
{
    struct side_reading readings[2][SIDES_TEXTS];
    const struct group_sides pair = {.n = 2, .readings = readings};
    size_t j = 0;

    memcpy(readings[0], sides->readings[i], sizeof readings[0]);
    for (; j < members->n; j++) {
        memcpy(readings[1], members->readings[j], sizeof readings[1]);
        if (group_sides_opposite(&pair, 0, 1)) {
            break;
        }
    }
    return j;
}

json_t *handedness_of_new(struct jobs_run *run, const json_t *surfaces, const json_t *cohort,
                          const json_t *made)
{
    const json_t *members = json_object_get(made, "surfaces");
    json_t *warnings = json_array();
    struct group_sides sides = {0}, theirs = {0};
    size_t count = 0, first = 0, second = 0;

    if (!group_sides_read(run, surfaces, cohort, &sides) ||
        !group_sides_read(run, members, made, &theirs)) {
        json_memory_fail();
    }
    for (size_t i = 0; i < sides.n && theirs.n > 0; i++) {
        size_t j = find_opposite(&sides, i, &theirs);

        if (j < theirs.n && count++ == 0) {
            first = i;
            second = j;
        }
    }
    if (count > 0) {
        json_t *a = title_of(run, surfaces, cohort, first),
               *b = title_of(run, members, made, second);

        warning_add(warnings, "mirror-images",
                    json_pack("{s:I, s:I, s:I}", "members", (json_int_t)count, "first",
                              (json_int_t)first, "second", (json_int_t)second),
                    "%.80s: by what it is called, it is the other side of a member that the model "
                    "was made from, %.80s; so it is for %zu of the surfaces. A mirror image of a "
                    "shape is another shape here: encode it with mirror = true, as the members of "
                    "its side were.",
                    json_string_value(a), json_string_value(b), count);
        json_decref(a);
        json_decref(b);
    }
    group_sides_clear(&sides);
    group_sides_clear(&theirs);
    return warnings;
}

json_t *handedness_of_projection(struct jobs_run *run, const char *surface, const json_t *made,
                                 const struct compute_mirror_trial *trial)
{
    bool several = surface[0] == '\0';
    json_t *surfaces = json_pack("[s]", surface);
    json_t *warnings = several ? json_array() : handedness_of_new(run, surfaces, NULL, made);

    if (json_array_size(warnings) == 0 && compute_mirror_better(trial, false)) {
        json_t *title = several ? json_string("The subject") : title_of(run, surfaces, NULL, 0);

        warning_add(
            warnings, "mirror-images",
            json_pack("{s:o, s:o}", "distance", json_finite(trial->distance), "mirrored",
                      json_finite(trial->mirrored)),
            "%.80s: its mirror image would be %.3g from the nearest member of the model "
            "instead of %.3g. If it is of the other side than the members, encode %s with mirror = "
            "true.",
            json_string_value(title), trial->mirrored, trial->distance,
            several ? "all of its parts" : "it");
        json_decref(title);
    }
    json_decref(surfaces);
    return warnings;
}

json_t *handedness_of_predictions(struct jobs_run *run, const json_t *surfaces,
                                  const json_t *cohort, const double *nearest,
                                  const double *mirrored)
{
    json_t *warnings = json_array(), *members = json_array();
    size_t first = 0;

    for (size_t i = 0; i < json_array_size(surfaces); i++) {
        const struct compute_mirror_trial trial = {.distance = nearest[i], .mirrored = mirrored[i]};

        if (compute_mirror_better(&trial, false)) {
            first = json_array_size(members) ? first : i;
            (void)json_array_append_new(
                members, json_pack("{s:I, s:o, s:o}", "member", (json_int_t)i, "distance",
                                   json_finite(nearest[i]), "mirrored", json_finite(mirrored[i])));
        }
    }
    if (json_array_size(members) > 0) {
        size_t count = json_array_size(members);
        json_t *title = title_of(run, surfaces, cohort, first);

        warning_add(
            warnings, "mirror-images", json_pack("{s:O}", "members", members),
            "%.80s: its mirror image would be %.3g from the nearest training member instead "
            "of %.3g; so it is for %zu of the surfaces. If they are of the other side than "
            "the training members, encode them with mirror = true: what they are told to "
            "be now may be wrong.",
            json_string_value(title), mirrored[first], nearest[first], count);
        json_decref(title);
    }
    json_decref(members);
    return warnings;
}

bool handedness_opposite(struct jobs_run *run, const char *first, const char *second)
{
    struct side_reading readings[2][SIDES_TEXTS];
    struct group_sides sides = {.n = 2, .readings = readings};

    read_member(run, first, NULL, NULL, false, readings[0]);
    read_member(run, second, NULL, NULL, false, readings[1]);
    return group_sides_opposite(&sides, 0, 1);
}

json_t *handedness_of_pair(struct jobs_run *run, const char *first, const char *second,
                           bool opposite, const struct compute_mirror_trial *trial)
{
    json_t *warnings = json_array(), *surfaces, *a, *b;

    if (!compute_mirror_better(trial, opposite)) {
        return warnings;
    }
    surfaces = json_pack("[s, s]", first, second);
    a = title_of(run, surfaces, NULL, 0);
    b = title_of(run, surfaces, NULL, 1);
    warning_add(warnings, "mirror-images",
                json_pack("{s:o, s:o}", "distance", json_finite(trial->distance), "mirrored",
                          json_finite(trial->mirrored)),
                "%.80s and %.80s: mirrored and registered, the distance would be %.3g instead of "
                "%.3g. If they are a left and a right one of the same, encode one of them with "
                "mirror = true.",
                json_string_value(a), json_string_value(b), trial->mirrored, trial->distance);
    json_decref(a);
    json_decref(b);
    json_decref(surfaces);
    return warnings;
}
