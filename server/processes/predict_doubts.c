/*
 * predict_doubts.c - warnings of all that predict was asked about: not-assessed, duplicate-content.
 */
#include "processes/predict.h"

#include <string.h>

#include "api/alike.h"
#include "api/warnings.h"

#define QUOTED_MAX 300

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

void predict_warn_unassessed(json_t *warnings, const struct group_input *group,
                             const struct kept *kept, const struct predict_answer *answer)
{
    struct labelled found = count_labels(group, kept, answer);
    char classes[QUOTED_MAX];
    json_t *names = json_array(), *figures;

    for (size_t c = 0; c < kept->classes; c++) {
        (void)json_array_append_new(names, json_string(kept->names[c]));
    }
    alike_quote(names, classes, sizeof classes);
    json_decref(names);
    if (found.labels == 0) { /* nobody asks for one */
        return;
    }
    figures = json_pack("{s:s?, s:I, s:I, s:I}", "class", found.missing, "labelled",
                        (json_int_t)found.labels, "unknown", (json_int_t)found.unknown,
                        "trainingSubjects", (json_int_t)found.trained);
    if (found.first) {
        (void)json_object_set_new(figures, "label", json_string(found.first));
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

void predict_warn_repeats(json_t *warnings, const struct group_input *group,
                          const struct kept *kept, const struct predict_answer *answer)
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
