/*
 * classify_classes.c - the classes of a cohort, by the labels of its members.
 */
#include "processes/classify.h"
#include "text.h"

#include <string.h>

void classify_classes_clear(struct classify_classes *classes)
{
    srnf_free(classes->labels);
    srnf_free(classes->sizes);
    srnf_free(classes->subjects);
    srnf_free(classes->names);
}

/* The class of a label, which is a new one where it has not been seen. */
static size_t class_of(struct classify_classes *classes, const char *label)
{
    size_t c = 0;

    while (c < classes->count && strcmp(classes->names[c], label) != 0) {
        c++;
    }
    classes->names[c] = label;
    classes->count += c == classes->count;
    return c;
}

bool classify_classes_find(const json_t *cohort, const size_t *subjects,
                           struct classify_classes *classes, size_t *missing)
{
    const json_t *labels = json_object_get(cohort, "labels");
    size_t n = json_array_size(labels);

    *classes = (struct classify_classes){.n = n,
                                         .labels = srnf_alloc(n, sizeof(size_t)),
                                         .sizes = srnf_alloc(n, sizeof(size_t)),
                                         .subjects = srnf_alloc(n, sizeof(size_t)),
                                         .names = srnf_alloc(n, sizeof(char *))};
    *missing = n;
    if (!classes->labels || !classes->sizes || !classes->subjects || !classes->names) {
        return false;
    }
    for (size_t i = n; i-- > 0;) {
        *missing = json_is_string(json_array_get(labels, i)) ? *missing : i;
    }
    if (*missing < n) {
        return true;
    }
    for (size_t i = 0; i < n; i++) {
        classes->labels[i] = class_of(classes, json_string_value(json_array_get(labels, i)));
        classes->sizes[classes->labels[i]]++;
    }
    if (srnf_class_subjects(n, classes->labels, subjects, classes->count, classes->subjects,
                            &classes->determined) != SRNF_OK) {
        return false;
    }
    for (size_t c = 1; c < classes->count; c++) {
        classes->smallest =
            classes->subjects[c] < classes->subjects[classes->smallest] ? c : classes->smallest;
    }
    return true;
}

void classify_classes_check(struct process_inputs *given, const json_t *cohort, size_t least,
                            classify_check_folds *check)
{
    const json_t *labels = json_object_get(cohort, "labels");
    struct classify_classes classes = {0};
    size_t missing = 0, count, largest, smallest;
    char who[GROUP_MEMBER_TEXT];
    size_t *subjects = group_subject_numbers(json_object_get(cohort, "subjects"),
                                             json_array_size(labels), &count, &largest);
    bool found = subjects && classify_classes_find(cohort, subjects, &classes, &missing);

    smallest = classes.smallest;
    if (!found) {
        problem_add(given->list, "/inputs/cohort", "is too large for the memory there is");
    } else if (missing < classes.n) {
        group_member_text(given, given->members, missing, who);
        problem_add(given->list, "/inputs/cohort", "%s has no label", who);
    } else if (classes.count < 2) {
        problem_add(given->list, "/inputs/cohort", "has one label only: there must be two or more");
    } else if (classes.subjects[smallest] < least) {
        problem_add(
            given->list, "/inputs/cohort",
            "has %zu subject%s (%zu member%s) with the label \"%.60s\"; each label needs %zu",
            classes.subjects[smallest], plural(classes.subjects[smallest]), classes.sizes[smallest],
            plural(classes.sizes[smallest]), classes.names[smallest], least);
    } else {
        check(given, &classes);
    }
    classify_classes_clear(&classes);
    srnf_free(subjects);
}
