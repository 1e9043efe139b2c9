/*
 * predict_result.c - the result document of the process predict.
 */
#include "processes/predict.h"

#include <stdio.h>
#include <string.h>

#include "api/alike.h"
#include "api/warnings.h"
#include "toolkit/assessment.h"
#include "toolkit/handedness.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/typicality.h"

#define QUOTED_MAX 300

/* ---- One surface ----------------------------------------------------------------------------- */

static json_t *traits_json(const struct srnf_typicality *traits)
{
    static const char *const names[PREDICT_TRAITS] = {"residual", "distance", "mahalanobis",
                                                      "nearest"};
    json_t *object = json_object();

    for (size_t t = 0; t < PREDICT_TRAITS; t++) {
        (void)json_object_set_new(object, names[t], typicality_json(&traits[t], 1.0));
    }
    return object;
}

/* "residual 0.51 (limit 0.06), .." of the traits beyond their limits, as far as there is room. */
static void list_far(const struct srnf_typicality *traits, char *text, size_t size)
{
    static const char *const names[PREDICT_TRAITS] = {"residual", "distance from the mean",
                                                      "Mahalanobis distance",
                                                      "distance from the nearest member"};

    *text = '\0';
    for (size_t t = 0; t < PREDICT_TRAITS; t++) {
        size_t length = strlen(text);

        if (traits[t].far) {
            (void)snprintf(text + length, size - length, "%s%s %.3g (limit %.3g)",
                           length ? ", " : "", names[t], traits[t].value, traits[t].limit);
        }
    }
}

/* A subject that it was trained on, some of whose structures were segmented anew. */
static void warn_known_parts(const struct kept *kept, const struct predict_answer *answer, size_t i,
                             const char *name, json_t *warnings)
{
    size_t first, count = predict_known_parts(kept, answer, i, &first);
    const char *part =
        json_string_value(json_object_get(json_array_get(kept->parts, first), "name"));

    warning_add(warnings, "training-subject",
                json_pack("{s:I, s:I, s:s}", "member", (json_int_t)i, "parts", (json_int_t)count,
                          "part", part ? part : ""),
                "The classifier was trained on %zu of %zu parts of subject %zu (%.60s), \"%.60s\" "
                "first: is it one of its subjects, with the others segmented anew? That it is told "
                "says nothing of others. It is not counted in the assessment.",
                count, kept->model.joint.n_parts, i, name, part ? part : "");
}

static json_t *warnings_of_one(const struct kept *kept, const struct predict_answer *answer,
                               size_t i, const char *name)
{
    const struct srnf_typicality *traits = answer->traits + i * PREDICT_TRAITS;
    json_t *warnings = json_array();
    char far[320];

    list_far(traits, far, sizeof far);
    if (*far) {
        warning_add(
            warnings, "far-from-model",
            json_pack("{s:I, s:o}", "member", (json_int_t)i, "typicality", traits_json(traits)),
            "%s %zu (%.60s) is unlike the members of every class: %s. Its label and "
            "its probabilities say nothing.",
            predict_what(kept), i, name, far);
    }
    if (answer->trained[i]) {
        warning_add(warnings, "training-subject", json_pack("{s:I}", "member", (json_int_t)i),
                    "%s %zu (%.60s) is one that the classifier was trained on: that it is "
                    "told says nothing of others. It is not counted in the assessment.",
                    predict_what(kept), i, name);
    } else if (answer->known[i] > 0) {
        warn_known_parts(kept, answer, i, name, warnings);
    }
    return warnings;
}

/* Another scan of a subject that it was trained on is no other subject. */
static void warn_twin(const struct kept *kept, const struct predict_answer *answer, double quartile,
                      size_t i, const char *name, json_t *warnings)
{
    double nearest = answer->predictions[i].nearest;

    if (!answer->trained[i] && typicality_is_twin(&kept->model, quartile, nearest)) {
        warning_add(warnings, "near-duplicates",
                    json_pack("{s:I, s:f, s:f}", "index", (json_int_t)i, "nearest", nearest,
                              "quartile", quartile),
                    "%s %zu (%.60s) is far nearer to one that the classifier was trained on than "
                    "these are to each other: %.3g, where three quarters of their pairs are %.3g "
                    "and more apart. Is it another scan of that subject? Then that it is told says "
                    "nothing of others, and the assessment that counts it is too good.",
                    predict_what(kept), i, name, nearest, quartile);
    }
}

static json_t *prediction_json(const struct group_input *group, const struct kept *kept,
                               const struct predict_answer *answer, const json_t *subjects,
                               double quartile, size_t i)
{
    bool gauss = kept->classifier.gauss;
    const char *name = json_string_value(json_array_get(subjects, i));
    json_t *truth = json_array_get(json_object_get(group->cohort, "labels"), i);
    json_t *evidence = json_object(),
           *warnings = warnings_of_one(kept, answer, i, name ? name : "");
    json_t *numbers = predict_numbers_json(kept, answer->numbers, i, name ? name : "", warnings);

    warn_twin(kept, answer, quartile, i, name ? name : "", warnings);
    for (size_t c = 0; c < kept->classes; c++) {
        double value = answer->evidence[i * kept->classes + c];

        (void)json_object_set_new(evidence, kept->names[c],
                                  json_finite(gauss ? value : -value + 0.0));
    }
    return json_pack(
        "{s:o, s:O, s:o, s:o, s:s, s:o, s:o, s:o, s:o, s:b, s:o, s:o}", "surface",
        kept->parts ? json_null() : json_string(group->ids[i]), "subject",
        json_array_get(subjects, i), "parts",
        predict_parts_json(group, kept, &answer->predictions[i], i), "position",
        predict_position_json(kept, &answer->predictions[i]), "label",
        kept->names[answer->predicted[i]], "probabilities",
        assessment_by_class(answer->probabilities + i * kept->classes, kept->classes, kept->names),
        gauss ? "logLikelihoods" : "nearestDistances", evidence, "numbers", numbers, "truth",
        json_is_string(truth) ? json_incref(truth) : json_null(), "trainingSubject",
        answer->trained[i], "typicality", traits_json(answer->traits + i * PREDICT_TRAITS),
        "warnings", warnings);
}

/* ---- All of them ----------------------------------------------------------------------------- */

/* The members that have a class and no part of which was trained on, one after the other; numbers:
   [3][n]. */
struct known {
    size_t n;
    size_t *at, *labels, *subjects;
    double *evidence, *probabilities;
};

static bool find_known(const struct group_input *group, const struct kept *kept,
                       const struct predict_answer *answer, struct known *known)
{
    const json_t *labels = json_object_get(group->cohort, "labels");
    size_t n = group->n, k = kept->classes;

    *known = (struct known){.at = srnf_alloc(3 * n, sizeof(size_t)),
                            .evidence = srnf_alloc(2 * n * k, sizeof(double))};
    if (!known->at || !known->evidence) {
        return false;
    }
    known->labels = known->at + n;
    known->subjects = known->labels + n;
    known->probabilities = known->evidence + n * k;
    for (size_t i = 0; i < n; i++) {
        size_t c = kept_class(kept, json_string_value(json_array_get(labels, i)));
        size_t first = 0;

        if (c == k || answer->known[i] > 0) {
            continue;
        }
        while (first < known->n && group->subjects[known->at[first]] != group->subjects[i]) {
            first++;
        }
        known->at[known->n] = i;
        known->labels[known->n] = c;
        known->subjects[known->n] = first;
        memcpy(known->evidence + known->n * k, answer->evidence + i * k, k * sizeof(double));
        memcpy(known->probabilities + known->n * k, answer->probabilities + i * k,
               k * sizeof(double));
        known->n++;
    }
    return true;
}

/* ---- Doubts of all together ------------------------------------------------------------------ */

/* What the labels of the members are to the classifier. */
struct labelled {
    size_t labels, unknown, trained; /* members with a label; with one of no class; of training */
    const char *first;               /* of the labels of no class */
    const char *missing;             /* a class that no member counts for */
};

static struct labelled count_labels(const struct group_input *group, const struct kept *kept,
                                    const struct predict_answer *answer)
{
    const json_t *labels = json_object_get(group->cohort, "labels");
    struct labelled found = {0};

    for (size_t c = kept->classes; c-- > 0;) {
        bool counts = false;

        for (size_t i = 0; i < group->n; i++) {
            const char *label = json_string_value(json_array_get(labels, i));

            counts = counts || (label && kept_class(kept, label) == c && answer->known[i] == 0);
        }
        found.missing = counts ? found.missing : kept->names[c];
    }
    for (size_t i = 0; i < group->n; i++) {
        const char *label = json_string_value(json_array_get(labels, i));
        bool unknown = label && kept_class(kept, label) == kept->classes;

        found.labels += label != NULL;
        found.unknown += unknown;
        found.trained += label && !unknown && answer->known[i] > 0;
        found.first = unknown && !found.first ? label : found.first;
    }
    return found;
}

/* assessed: whether there is an assessment, which then leaves labels out that are no class. */
static void warn_unassessed(json_t *warnings, const struct group_input *group,
                            const struct kept *kept, const struct predict_answer *answer,
                            bool assessed)
{
    struct labelled found = count_labels(group, kept, answer);
    char classes[QUOTED_MAX];
    json_t *names = json_array(), *figures;

    for (size_t c = 0; c < kept->classes; c++) {
        (void)json_array_append_new(names, json_string(kept->names[c]));
    }
    alike_quote(names, classes, sizeof classes);
    json_decref(names);
    if (assessed ? found.unknown == 0 : found.labels == 0) { /* nobody asks for one */
        return;
    }
    figures = json_pack("{s:s?, s:I, s:I, s:I}", "class", found.missing, "labelled",
                        (json_int_t)found.labels, "unknown", (json_int_t)found.unknown,
                        "trainingSubjects", (json_int_t)found.trained);
    if (found.first) {
        (void)json_object_set_new(figures, "label", json_string(found.first));
    }
    if (assessed) {
        warning_add(warnings, "not-assessed", figures,
                    "The assessment leaves out %zu of %zu members with a label: the classifier "
                    "does not know %s, \"%.60s\" first. Its classes are %.300s: correct the label "
                    "if it means one of these. Otherwise the classifier is wrong about all whom it "
                    "belongs to, which its accuracy does not count.",
                    found.unknown, found.labels, found.unknown == 1 ? "it" : "theirs", found.first,
                    classes);
        return;
    }
    warning_add(warnings, "not-assessed", figures,
                "There is no assessment: it needs members of every class that the classifier was "
                "not trained on, and \"%.60s\" has none. Of %zu with a label, %zu %s one that the "
                "classifier does not know%s%.60s%s, and %zu %s among those that it was trained on. "
                "Its classes are %.300s: give these labels, to subjects that are new to it.",
                found.missing ? found.missing : "", found.labels, found.unknown,
                found.unknown == 1 ? "has" : "have", found.first ? ", \"" : "",
                found.first ? found.first : "", found.first ? "\" first" : "", found.trained,
                found.trained == 1 ? "is" : "are", classes);
}

static void warn_repeats(json_t *warnings, const struct group_input *group, const struct kept *kept,
                         const struct predict_answer *answer)
{
    size_t parts = json_array_size(kept->parts);

    for (size_t i = 0; i < group->n; i++) {
        for (size_t k = 1; k < parts * parts; k++) {
            size_t p = k / parts, q = k % parts;
            const json_t *first = json_object_get(json_array_get(kept->parts, p), "name");
            const json_t *second = json_object_get(json_array_get(kept->parts, q), "name");
            const char *content = answer->group.contents[p * group->n + i];

            if (p >= q || strcmp(content, answer->group.contents[q * group->n + i]) != 0) {
                continue;
            }
            warning_add(warnings, "duplicate-content",
                        json_pack("{s:I, s:[O, O], s:s}", "member", (json_int_t)i, "parts", first,
                                  second, "content", group->ids[p * group->n + i]),
                        "The parts \"%.60s\" and \"%.60s\" of subject %zu have the same content, "
                        "%.80s: one of them is likely mistaken, and the subject's label and "
                        "probabilities say nothing. Give each part its own surface.",
                        json_string_value(first), json_string_value(second), i,
                        group->ids[p * group->n + i]);
        }
    }
}

/* ---- The document ---------------------------------------------------------------------------- */

/* Null, with a warning, where the members of some class are not there. False without memory. */
static bool assess(const struct group_input *group, const struct kept *kept,
                   const struct predict_answer *answer, json_t **assessment, json_t *warnings)
{
    struct srnf_assessment found = {0};
    struct known known;
    bool good = find_known(group, kept, answer, &known);
    int status = SRNF_ENOMEM;

    if (good) {
        status = srnf_assess(known.n, kept->classes, known.labels, known.subjects, known.evidence,
                             known.probabilities, answer->priors, NULL, &found);
    }
    *assessment = status == SRNF_OK ? assessment_json(&found, kept->names) : json_null();
    if (status != SRNF_ENOMEM) {
        warn_unassessed(warnings, group, kept, answer, status == SRNF_OK);
    }
    srnf_assessment_clear(&found);
    srnf_free(known.at);
    srnf_free(known.evidence);
    return status != SRNF_ENOMEM;
}

json_t *predict_document(struct jobs_run *run, const struct group_input *group,
                         const struct kept *kept, const struct predict_answer *answer,
                         struct jobs_result *result)
{
    json_t *subjects =
        group_subjects(run, group->surfaces, json_object_get(group->cohort, "subjects"));
    json_t *predictions = json_array(), *classes = json_array(), *assessment = NULL;
    json_t *doubts = json_array();
    json_t *document, *sides;
    double quartile = typicality_quartile(&kept->model);

    for (size_t c = 0; c < kept->classes; c++) {
        (void)json_array_append_new(classes, json_string(kept->names[c]));
    }
    for (size_t i = 0; i < group->n; i++) {
        (void)json_array_append_new(predictions,
                                    prediction_json(group, kept, answer, subjects, quartile, i));
    }
    json_decref(subjects);
    if (!assess(group, kept, answer, &assessment, doubts)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "assessing the predictions");
    }
    document = json_pack(
        "{s:O, s:o, s:o, s:s, s:o, s:o}", "predictions", predictions, "classes", classes, "priors",
        assessment_by_class(answer->priors, kept->classes, kept->names), "method", kept->method,
        "assessment", assessment, "registration", registration_json(&kept->registration));
    warnings_put(document, doubts);
    warn_repeats(warnings_of(document), group, kept, answer);
    for (size_t i = 0; i < group->n; i++) {
        warnings_merge(warnings_of(document),
                       json_object_get(json_array_get(predictions, i), "warnings"));
    }
    json_decref(predictions);
    if (kept->subjects < TYPICALITY_SUBJECTS_FEW) {
        warning_add(warnings_of(document), "few-subjects",
                    json_pack("{s:I}", "subjects", (json_int_t)kept->subjects),
                    "The limits in typicality rest on %zu subjects only and are wide: a surface "
                    "within them may be foreign all the same.",
                    kept->subjects);
    }
    sides = kept->parts ? json_array()
                        : handedness_of_new(run, group->surfaces, group->cohort, kept->made);
    if (json_array_size(sides) == 0) {
        json_decref(sides);
        sides = handedness_of_predictions(run, group->surfaces, group->cohort, answer->nearest,
                                          answer->mirrored);
    }
    warnings_put(document, sides);
    routes_set_bridged(document, answer->group.n, group->ids, answer->group.bridged);
    if (result->problem_code) {
        json_decref(document);
        return NULL;
    }
    return document;
}
