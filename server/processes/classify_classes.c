/*
 * classify_classes.c - the classes of a cohort, by the labels of its members.
 */
#include "processes/classify.h"

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
    return srnf_class_subjects(n, classes->labels, subjects, classes->count, classes->subjects,
                               &classes->determined) == SRNF_OK;
}
