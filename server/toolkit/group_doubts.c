/*
 * group_doubts.c - near-duplicates, far-from-group, mirror-images and pose-differs of the processes
 * on groups, from what compute/likeness.h found.
 */
#include "toolkit/group_doubts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/group.h"
#include "toolkit/typicality.h"
#include "api/json_numbers.h"
#include "api/warnings.h"

#define DEGREES (180.0 / 3.14159265358979323846)

/* A member in words, at the begin of a sentence and within one. */
static void name_member(struct jobs_run *run, const struct group_doubts *doubts, size_t i,
                        char who[GROUP_WHO])
{
    group_who(run, doubts->surfaces, json_object_get(doubts->cohort, "subjects"), i, who);
}

static void name_within(struct jobs_run *run, const struct group_doubts *doubts, size_t i,
                        char who[GROUP_WHO])
{
    name_member(run, doubts, i, who);
    who[0] = 'm';
}

static void warn_twins(struct jobs_run *run, const struct group_doubts *doubts,
                       const struct srnf_twins *twins, json_t *warnings)
{
    char first[GROUP_WHO], second[GROUP_WHO];

    if (twins->count == 0) {
        return;
    }
    name_within(run, doubts, twins->first, first);
    name_within(run, doubts, twins->second, second);
    warning_add(warnings, "near-duplicates",
                json_pack("{s:I, s:o, s:o, s:I, s:I}", "pairs", (json_int_t)twins->count, "nearest",
                          json_finite(twins->nearest), "median", json_finite(twins->median),
                          "first", (json_int_t)twins->first, "second", (json_int_t)twins->second),
                "%zu pairs of members are far nearer to each other than the rest: the nearest, "
                "%s and %s, is %.3g apart where half of all pairs are %.3g and more. "
                "Scans of one subject count as several subjects here, which makes p-values and "
                "accuracies too good: name their subject in a cohort, or keep one of each.",
                twins->count, first, second, twins->nearest, twins->median);
}

static const struct compute_match *match_of(const struct compute_likeness *likeness, size_t member)
{
    for (size_t k = 0; k < likeness->n_members; k++) {
        if (likeness->members[k].second == member) {
            return &likeness->members[k];
        }
    }
    return NULL;
}

const char *doubts_rotations(bool positions)
{
    return positions ? "leave out relativePose, which does not go with turns, and let rotations be "
                       "sought (register true, commonPose false)"
                     : "let rotations be sought (register true, commonPose false)";
}

static bool is_posed_apart(const struct compute_match *match)
{
    return srnf_match_is_turned(&match->match) || compute_match_on_sphere(match);
}

/* Members beyond their limit that no other reason explains. */
static void warn_far(struct jobs_run *run, const struct compute_likeness *likeness,
                     const struct group_doubts *doubts, json_t *warnings)
{
    for (size_t i = 0; likeness->distances && i < likeness->n; i++) {
        const struct srnf_typicality *t = &likeness->distances[i];
        const struct compute_match *match = match_of(likeness, i);
        char name[GROUP_WHO];

        if (!t->far || (match && srnf_match_is_mirrored(&match->match)) ||
            (match && !doubts->rotates && is_posed_apart(match))) {
            continue;
        }
        name_member(run, doubts, i, name);
        warning_add(
            warnings, "far-from-group",
            json_pack("{s:I, s:o}", "member", (json_int_t)i, "distance", typicality_json(t, 1.0)),
            "%s is unlike all other members: %.3g from their mean, where one in a thousand "
            "would be beyond %.3g. It moves means, components and p-values; see whether it "
            "belongs to the group.",
            name, t->value, t->limit);
    }
}

static void warn_mirrored(const struct compute_match *match, const char *first, const char *second,
                          const char *advice, json_t *warnings)
{
    warning_add(warnings, "mirror-images",
                json_pack("{s:I, s:I, s:o, s:o}", "first", (json_int_t)match->first, "second",
                          (json_int_t)match->second, "distance", json_finite(match->match.plain),
                          "mirrored", json_finite(match->match.mirrored)),
                "%s looks like a mirror image: rigidly matched with %s it would be %.3g away "
                "mirrored, and is %.3g as it is. %s",
                second, first, match->match.mirrored, match->match.plain, advice);
}

/* Names may have told of two sides before. */
static bool is_told(const json_t *warnings, const char *code)
{
    bool told = false;

    for (size_t i = 0; i < json_array_size(warnings) && !told; i++) {
        const char *other = json_string_value(json_object_get(json_array_get(warnings, i), "code"));

        told = other && strcmp(other, code) == 0;
    }
    return told;
}

/* Whether a whole class is mirrored: its members are then not told one by one. */
static bool of_class(const struct compute_likeness *likeness)
{
    bool mirrored = false;

    for (size_t k = 0; k < likeness->n_classes; k++) {
        mirrored = mirrored || srnf_match_is_mirrored(&likeness->classes[k].match);
    }
    return mirrored;
}

static void warn_members(struct jobs_run *run, const struct compute_likeness *likeness,
                         const struct group_doubts *doubts, json_t *warnings)
{
    for (size_t k = 0; k < likeness->n_members; k++) {
        const struct compute_match *match = &likeness->members[k];
        char name[GROUP_WHO], medoid[GROUP_WHO];

        if (!srnf_match_is_mirrored(&match->match) || of_class(likeness)) {
            continue;
        }
        name_member(run, doubts, match->second, name);
        name_within(run, doubts, match->first, medoid);
        warn_mirrored(match, medoid, name,
                      "See whether its file is of the other side or its axes are turned over; set "
                      "mirror of the member in the cohort, or encode it with mirror = true.",
                      warnings);
    }
}

#define WHOLE " before they are encoded, each subject as a whole"
#define TURN_MAX 720 /* bytes of two names and the sentence about them */

/* How the one that is turned most compares with the member that all are nearest to. */
static void describe_turn(char text[TURN_MAX], const struct compute_match *most, const char *name,
                          const char *medoid, bool positions)
{
    const char *rotations = doubts_rotations(positions);

    if (compute_match_on_sphere(most)) {
        (void)snprintf(text, TURN_MAX,
                       "%s lies as %s does, but their maps to the sphere are turned, as of "
                       "symmetric shapes: with the sphere turned back they are %.3g apart instead "
                       "of %.3g. commonPose cannot undo that: %s.",
                       name, medoid, most->on_sphere, most->match.unturned, rotations);
        return;
    }
    (void)snprintf(text, TURN_MAX,
                   "%s matches %s turned by about %.0f degrees, and is then %.3g from it instead "
                   "of %.3g. Bring all into one pose%s, or %s.",
                   name, medoid, DEGREES * most->match.angle, most->match.plain,
                   most->match.unturned, positions ? WHOLE : "", rotations);
}

static json_t *turned_json(const struct compute_match *match)
{
    bool sphere = compute_match_on_sphere(match);

    return json_pack("{s:I, s:o, s:b, s:o, s:o}", "member", (json_int_t)match->second, "angle",
                     json_finite(DEGREES * (sphere ? match->sphere_angle : match->match.angle)),
                     "sphereAlone", (int)sphere, "distance", json_finite(match->match.unturned),
                     "turned", json_finite(sphere ? match->on_sphere : match->match.plain));
}

/* One warning of all members that lie in another pose; whether there is one. */
static bool warn_poses(struct jobs_run *run, const struct compute_likeness *likeness,
                       const struct group_doubts *doubts, json_t *warnings)
{
    const struct compute_match *most = NULL;
    json_t *members = json_array();
    size_t count = 0;
    char name[GROUP_WHO], medoid[GROUP_WHO], turn[TURN_MAX];

    for (size_t k = 0; k < likeness->n_members; k++) {
        const struct compute_match *match = &likeness->members[k];

        if (is_posed_apart(match)) {
            most = most && most->match.angle >= match->match.angle ? most : match;
            count++;
            (void)json_array_append_new(members, turned_json(match));
        }
    }
    if (!most || (count == 1 && !compute_match_on_sphere(most) &&
                  is_told(warnings, "pose-differs"))) { /* by its angle */
        json_decref(members);
        return most != NULL;
    }
    name_member(run, doubts, most->second, name);
    name_within(run, doubts, most->first, medoid);
    describe_turn(turn, most, name, medoid, doubts->positions);
    warning_add(warnings, "pose-differs",
                json_pack("{s:I, s:I, s:o}", "tried", (json_int_t)likeness->n_members, "turned",
                          (json_int_t)count, "members", members),
                "Nothing is rotated here, and %zu of %zu members tried are turned. %s", count,
                likeness->n_members, turn);
    return true;
}

static void warn_classes(const struct compute_likeness *likeness, const struct group_doubts *doubts,
                         json_t *warnings)
{
    for (size_t k = 0; k < likeness->n_classes; k++) {
        const struct compute_match *match = &likeness->classes[k];
        bool sphere = compute_match_on_sphere(match);
        double angle = sphere ? match->sphere_angle : match->match.angle;
        double turned = sphere ? match->on_sphere : match->match.plain;
        char first[80], second[80];

        (void)snprintf(first, sizeof first, "the group %.60s", doubts->names[match->first]);
        (void)snprintf(second, sizeof second, "The group %.60s", doubts->names[match->second]);
        if (srnf_match_is_mirrored(&match->match)) {
            warn_mirrored(match, first, second,
                          "The groups then differ by their handedness: set mirror of the members "
                          "of one in the cohort, or encode them with mirror = true.",
                          warnings);
        } else if (!doubts->rotates && is_posed_apart(match)) {
            warning_add(
                warnings, "pose-differs",
                json_pack("{s:[s, s], s:f, s:b, s:f, s:f}", "groups", doubts->names[match->first],
                          doubts->names[match->second], "angle", DEGREES * angle, "sphereAlone",
                          (int)sphere, "distance", match->match.unturned, "turned", turned),
                "Nothing is rotated here, and the group %.60s lies in another pose than %s, in "
                "%s: turned by about %.0f degrees, its members are %.3g from those instead of "
                "%.3g. What looks like a difference of the groups may be no more than that. "
                "%s%s%s.",
                doubts->names[match->second], first, sphere ? "its maps to the sphere" : "space",
                DEGREES * angle, turned, match->match.unturned,
                sphere ? "commonPose cannot undo it: " : "Bring all into one pose",
                sphere              ? ""
                : doubts->positions ? WHOLE ", or "
                                    : ", or ",
                doubts_rotations(doubts->positions));
        }
    }
}

bool group_doubts_warn(struct jobs_run *run, const struct group_doubts *doubts, json_t *document,
                       struct jobs_result *result)
{
    const json_t *subjects = json_object_get(doubts->cohort, "subjects");
    size_t n = doubts->group->n, count, largest;
    size_t *numbers = group_subject_numbers(subjects, n, &count, &largest);
    const struct compute_likeness_inputs inputs = {
        .group = doubts->group,
        .pairs = doubts->pairs,
        .subjects = numbers,
        .classes = doubts->classes,
        .n_classes = doubts->n_classes,
        .rotates = doubts->rotates,
        .mirrors = doubts->mirrors && !is_told(warnings_of(document), "mirror-images")};
    struct compute_likeness likeness = {0};
    json_t *warnings = warnings_of(document);
    int status = numbers ? 0 : compute_fail(result, SRNF_ENOMEM, NULL, "comparing the members");

    if (status == 0 && doubts->pairs) {
        status = compute_likeness(run, &inputs, &likeness, result);
    }
    if (status == 0 && doubts->pairs) {
        if (doubts->rotates || !warn_poses(run, &likeness, doubts, warnings)) {
            warn_twins(run, doubts, &likeness.twins,
                       warnings); /* poses in common make members near */
        }
        warn_members(run, &likeness, doubts, warnings);
        if (doubts->members) {
            warn_far(run, &likeness, doubts, warnings);
        }
        warn_classes(&likeness, doubts, warnings);
    }
    compute_likeness_clear(&likeness);
    srnf_free(numbers);
    return status == 0;
}
