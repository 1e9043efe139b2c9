/*
 * typicality.c - members of result documents that say how a surface compares with a group.
 *
 * Every trait is {"value", "limit", "percentile", "percentileInterval"}: the limit is the value
 * beyond which a member falls once in 200 (of a group whose members are judged by one another, once
 * in 1000), null where the others are too few to set one; percentile the share of the others below
 * the value. Angles are in degrees here, in radians in the core.
 */
#include "toolkit/typicality.h"

#include "compute/model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/warnings.h"
#include "toolkit/group_doubts.h"
#include "toolkit/outliers.h"

#define DEGREES (180.0 / 3.14159265358979323846)
/* Limit from which the others do not share a pose: group_doubts.c tells of that. */
#define POSES_ALIKE (90.0 / DEGREES)
#define TWIN_MEMBERS_MIN 5
#define TWIN_PAIRED_MAX ((size_t)500) /* members whose distances from each other are looked at */
#define TWIN_CHANCE 0.02              /* members that would be as near by chance */
#define POSED_MIN 4                   /* members of which one can be told from the others */

static const char *const trait_names[] = {
    [SRNF_TRAIT_RESIDUAL] = "residual",       [SRNF_TRAIT_DISTANCE] = "distance",
    [SRNF_TRAIT_MAHALANOBIS] = "mahalanobis", [SRNF_TRAIT_ANGLE] = "angle",
    [SRNF_TRAIT_NEAREST] = "nearest",
};

json_t *typicality_json(const struct srnf_typicality *t, double unit)
{
    return json_pack("{s:o, s:o, s:f, s:o}", "value", json_finite(unit * t->value), "limit",
                     json_finite(unit * t->limit), "percentile", t->percentile,
                     "percentileInterval", json_vector(t->percentile_interval, 2));
}

/* "residual 0.51 (limit 0.06), .." of the traits beyond their limits. */
static void append_trait(char *text, size_t size, enum srnf_trait trait,
                         const struct srnf_typicality *t)
{
    size_t length = strlen(text);

    (void)snprintf(text + length, size - length, "%s%s %.3g (limit %.3g)", length ? ", " : "",
                   trait_names[trait], t->value, t->limit);
}

/* ---- Projections ----------------------------------------------------------------------------- */

static json_t *projection_json(const struct compute_projection *projection)
{
    json_t *object;

    if (!projection->calibrated) {
        return json_null();
    }
    object = json_pack("{s:I, s:I}", "subjects", (json_int_t)projection->subjects, "components",
                       (json_int_t)projection->counted);
    for (size_t t = 0; t < SRNF_CALIBRATION_TRAITS; t++) {
        bool angle = t == SRNF_TRAIT_ANGLE;

        (void)json_object_set_new(
            object, trait_names[t],
            angle && !projection->poses
                ? json_null()
                : typicality_json(&projection->typicality[t], angle ? DEGREES : 1.0));
    }
    return object;
}

/* expected: the surface is held against what is expected of it, which only the residual does not
   see: what the components do not represent, wherever their mean is. */
static void warn_far(json_t *warnings, const struct compute_projection *projection, bool expected)
{
    char traits[256] = "";
    json_t *figures = json_object();

    for (size_t t = 0; t < SRNF_TRAIT_ANGLE; t++) {
        if (projection->typicality[t].far && (!expected || t == SRNF_TRAIT_RESIDUAL)) {
            append_trait(traits, sizeof traits, (enum srnf_trait)t, &projection->typicality[t]);
            (void)json_object_set_new(figures, trait_names[t],
                                      typicality_json(&projection->typicality[t], 1.0));
        }
    }
    if (*traits) {
        warning_add(warnings, "far-from-model", figures,
                    "The surface is unlike those that the model was made from: %s. The limits are "
                    "those of the model's %zu subjects, each left out in turn. Its scores do not "
                    "describe it.",
                    traits, projection->subjects);
    } else {
        json_decref(figures);
    }
}

static void warn_turned(json_t *warnings, const struct compute_projection *projection)
{
    const struct srnf_typicality *t = &projection->typicality[SRNF_TRAIT_ANGLE];
    char move[96] = "";

    if (!projection->poses || !t->far) {
        return;
    }
    if (projection->turn_back > 0.0) {
        (void)snprintf(move, sizeof move,
                       " Turned back, its scores would move by up to %.2g standard deviations.",
                       projection->turn_back);
    }
    warning_add(
        warnings, "pose-differs",
        json_pack("{s:f, s:o, s:f}", "angle", DEGREES * t->value, "limit",
                  json_finite(DEGREES * t->limit), "standardDeviations", projection->turn_back),
        "The surface is turned by %.3g degrees or more against the model's mean, in space or in "
        "its parameterization; its subjects' own turns allow for %.3g, and the model "
        "rotates nothing.%s Bring it into the pose of the others, or use a model that is made "
        "with rotations (register true, commonPose false).",
        DEGREES * t->value, DEGREES * t->limit, move);
}

void typicality_set_projection(json_t *document, const struct compute_projection *projection)
{
    (void)json_object_set_new(document, "mahalanobis", json_finite(projection->mahalanobis));
    (void)json_object_set_new(document, "typicality", projection_json(projection));
    typicality_warn_projection(document, projection, false);
}

void typicality_warn_projection(json_t *document, const struct compute_projection *projection,
                                bool expected)
{
    json_t *warnings = warnings_of(document);

    if (!projection->calibrated) {
        warning_add(warnings, "model-uncalibrated", NULL,
                    "Nothing says whether the surface is like those that the model was made from: "
                    "the model has no leave-one-out values. It was made from fewer than three "
                    "subjects, or by an older version: then make it again.");
        return;
    }
    warn_far(warnings, projection, expected);
    warn_turned(warnings, projection);
    if (projection->subjects < TYPICALITY_SUBJECTS_FEW && !expected) {
        warning_add(warnings, "few-subjects",
                    json_pack("{s:I}", "subjects", (json_int_t)projection->subjects),
                    "The limits in typicality rest on %zu subjects only and are wide: a surface "
                    "within them may be foreign all the same.",
                    projection->subjects);
    }
}

/* ---- Members --------------------------------------------------------------------------------- */

static double distance_of(size_t components, const double *a, const double *b, double residual)
{
    double sum = residual * residual;

    for (size_t k = 0; k < components; k++) {
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    }
    return sqrt(sum);
}

/* How many dimensions scores of these variances have, about. */
static double dimension_of(size_t components, const double *eigenvalues)
{
    double sum = 0.0, squares = 0.0;

    for (size_t k = 0; k < components; k++) {
        sum += eigenvalues[k];
        squares += eigenvalues[k] * eigenvalues[k];
    }
    return squares > 0.0 ? sum * sum / squares : 1.0;
}

double typicality_quartile(const struct compute_model *model)
{
    const struct srnf_pca *pca = &model->pca;
    size_t count = 0, paired = pca->n < TWIN_PAIRED_MAX ? pca->n : TWIN_PAIRED_MAX;
    double *pairs = pca->n >= TWIN_MEMBERS_MIN ? srnf_alloc(paired, paired * sizeof *pairs) : NULL;
    double quartile = 0.0;

    if (!pairs) {
        if (pca->n >= TWIN_MEMBERS_MIN) {
            json_memory_fail(); /* a warning may be missing */
        }
        return 0.0;
    }
    for (size_t i = 0; i < paired; i++) {
        for (size_t j = 0; j < i; j++) {
            pairs[count++] = distance_of(pca->components, pca->scores + i * pca->components,
                                         pca->scores + j * pca->components, 0.0);
        }
    }
    (void)sorted_median(count, pairs);
    quartile = pairs[count / 4];
    srnf_free(pairs);
    return quartile;
}

bool typicality_is_twin(const struct compute_model *model, double quartile, double least)
{
    const struct srnf_pca *pca = &model->pca;

    return least < SRNF_TWINS_SHARE * quartile &&
           0.25 * (double)pca->n *
                   pow(least / quartile, dimension_of(pca->components, pca->eigenvalues)) <
               TWIN_CHANCE;
}

void typicality_warn_twin(json_t *warnings, const struct compute_model *model, const double *scores,
                          double residual)
{
    const struct srnf_pca *pca = &model->pca;
    double least = INFINITY, quartile = typicality_quartile(model);
    size_t nearest = 0;

    for (size_t i = 0; i < pca->n; i++) {
        double d =
            distance_of(pca->components, scores, pca->scores + i * pca->components, residual);

        nearest = d < least ? i : nearest;
        least = fmin(least, d);
    }
    if (typicality_is_twin(model, quartile, least)) {
        warning_add(warnings, "near-duplicates",
                    json_pack("{s:I, s:f, s:f}", "member", (json_int_t)nearest, "nearest", least,
                              "quartile", quartile),
                    "The surface is far nearer to member %zu of the model than members are to each "
                    "other: %.3g, where three quarters of their pairs are %.3g and more apart. Is "
                    "it another scan of that subject? What the model says of it is then no more "
                    "than what it was made from.",
                    nearest, least, quartile);
    }
}

/* ---- Groups ---------------------------------------------------------------------------------- */

double *typicality_weights(size_t n, const size_t *subjects)
{
    double *weights = srnf_alloc(n ? n : 1, 2 * sizeof(double));

    for (size_t i = 0; weights && i < n; i++) {
        weights[n + subjects[i]] += 1.0;
    }
    for (size_t i = 0; weights && i < n; i++) {
        weights[i] = 1.0 / weights[n + subjects[i]];
    }
    return weights;
}

/* The angle of member i among those of members of other subjects. others: [2][n] scratch. */
static bool judge_angle(const double *angles, const size_t *subjects, const double *weights,
                        size_t n, size_t i, double *others, struct srnf_typicality *t)
{
    size_t count = 0;

    for (size_t j = 0; j < n; j++) {
        if (subjects[j] != subjects[i]) {
            others[count] = angles[j];
            others[n + count++] = weights[j];
        }
    }
    return srnf_typicality_of(SRNF_TRAIT_ANGLE, count, others, others + n, angles[i],
                              SRNF_TYPICAL_ALPHA_GROUP, t) == SRNF_OK &&
           t->far;
}

void typicality_warn_poses(struct jobs_run *run, const struct group_input *members,
                           const struct compute_mean_outputs *outputs, bool positions,
                           json_t *warnings)
{
    const size_t *subjects = members->subjects;
    size_t n = outputs->angles ? outputs->mean.n : 0;
    double *others = n >= POSED_MIN ? srnf_alloc(n, 2 * sizeof(double)) : NULL;
    double *weights = others ? typicality_weights(n, subjects) : NULL;

    if (n >= POSED_MIN && !weights) {
        json_memory_fail(); /* a warning may be missing */
    }
    for (size_t i = 0; i < n && weights; i++) {
        struct srnf_typicality t;
        char name[GROUP_WHO];

        if (judge_angle(outputs->angles, subjects, weights, n, i, others, &t) &&
            t.limit < POSES_ALIKE) {
            group_who(run, members->surfaces, json_object_get(members->cohort, "subjects"), i,
                      name);
            warning_add(warnings, "pose-differs",
                        json_pack("{s:I, s:f, s:o}", "member", (json_int_t)i, "angle",
                                  DEGREES * t.value, "limit", json_finite(DEGREES * t.limit)),
                        "%s lies in another pose than the others: turned by %.0f degrees or more "
                        "against their mean, in space or in its parameterization, where one of "
                        "them in a thousand would be turned by more than %.0f. Nothing is rotated "
                        "here: bring it into their pose, or, where it lies like them and its map "
                        "to the sphere is turned (symmetric shapes), %s.",
                        name, DEGREES * t.value, DEGREES * t.limit, doubts_rotations(positions));
        }
    }
    srnf_free(weights);
    srnf_free(others);
}

json_t *typicality_member(const struct srnf_folds_typicality *typicality, size_t member)
{
    json_t *object = json_object();

    for (size_t t = 0; t < typicality->traits; t++) {
        (void)json_object_set_new(
            object, trait_names[typicality->trait[t]],
            typicality_json(&typicality->verdicts[member * typicality->traits + t], 1.0));
    }
    return object;
}

/* The traits of a member that are beyond their limits, as text; figures gets them. */
static void list_far(const struct srnf_folds_typicality *typicality, size_t member, char *text,
                     size_t size, json_t *figures)
{
    *text = '\0';
    for (size_t t = 0; t < typicality->traits; t++) {
        const struct srnf_typicality *verdict =
            &typicality->verdicts[member * typicality->traits + t];

        if (verdict->far) {
            append_trait(text, size, typicality->trait[t], verdict);
            (void)json_object_set_new(figures, trait_names[typicality->trait[t]],
                                      typicality_json(verdict, 1.0));
        }
    }
}

/* Where only methods that do not register find a member far. */
static void warn_unregistered(json_t *warnings, json_t *figures, const char *who, const char *by,
                              bool asked)
{
    warning_add(warnings, "far-from-group", figures,
                "%s is unlike all other members, of whatever class, %s. %s: it may lie or be "
                "parameterized otherwise than they do, and be of the same shape.",
                who, by,
                asked ? "Only methods that do not register find it so"
                      : "No method that registers was asked");
}

void typicality_warn_members(json_t *warnings, size_t n_methods,
                             const struct srnf_folds_typicality *typicality,
                             const struct typicality_method *methods, const json_t *names)
{
    size_t n = n_methods ? typicality[0].n : 0;
    bool asked = false; /* one that registers */

    for (size_t m = 0; m < n_methods; m++) {
        asked = asked || (methods[m].registers && typicality[m].traits > 0);
    }
    for (size_t i = 0; i < n; i++) {
        json_t *by_method = json_object(), *figures;
        char first[300] = "", also[200] = "", by[520], name[GROUP_WHO];
        bool registered = false;

        for (size_t m = 0; m < n_methods; m++) {
            char text[256];
            json_t *own = json_object();

            list_far(&typicality[m], i, text, sizeof text, own);
            if (*text) {
                (void)json_object_set(by_method, methods[m].name, own);
                registered = registered || methods[m].registers;
                if (!*first) {
                    (void)snprintf(first, sizeof first, "by %.20s: %.230s", methods[m].name, text);
                } else {
                    size_t length = strlen(also);

                    (void)snprintf(also + length, sizeof also - length, "%s%.20s",
                                   length ? ", " : "; so by ", methods[m].name);
                }
            }
            json_decref(own);
        }
        (void)snprintf(name, sizeof name, "Member %zu (%.80s)", i,
                       json_string_value(json_array_get(names, i)));
        (void)snprintf(by, sizeof by, "%s%s", first, also);
        figures = json_pack("{s:I, s:O}", "member", (json_int_t)i, "methods", by_method);
        if (!*first) {
            json_decref(figures);
        } else if (!registered) {
            warn_unregistered(warnings, figures, name, by, asked);
        } else {
            warning_add(warnings, "far-from-group", figures,
                        "%s is unlike all other members, of whatever class, %s. What class it is "
                        "put into says nothing; see whether it belongs to the cohort.",
                        name, by);
        }
        json_decref(by_method);
    }
}
