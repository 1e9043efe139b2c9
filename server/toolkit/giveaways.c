/*
 * giveaways.c - see giveaways.h.
 */
#include "toolkit/giveaways.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/alike.h"
#include "api/json_memory.h"
#include "api/warnings.h"
#include "toolkit/group.h"
#include "toolkit/outliers.h"

#define CHANCE 1e-3

static int compare_values(const void *a, const void *b)
{
    const struct giveaway *x = a, *y = b;

    return (x->value > y->value) - (x->value < y->value);
}

/* log n! */
static double log_factorial(size_t n)
{
    double sum = 0.0;

    for (size_t k = 2; k <= n; k++) {
        sum += log((double)k);
    }
    return sum;
}

bool giveaways_find(size_t n, struct giveaway *pairs, size_t classes)
{
    size_t different = n > 0, ranges = n > 0;
    double dealt = log_factorial(n), ways;

    qsort(pairs, n, sizeof *pairs, compare_values);
    for (size_t i = 1; i < n; i++) {
        bool same = pairs[i].label == pairs[i - 1].label;

        if (!(pairs[i].value > pairs[i - 1].value) && !same) {
            return false;
        }
        different += pairs[i].value > pairs[i - 1].value;
        ranges += !same;
    }
    for (size_t k = 0; k < classes; k++) {
        size_t own = 0;

        for (size_t i = 0; i < n; i++) {
            own += pairs[i].label == k;
        }
        dealt -= log_factorial(own);
    }
    ways = (double)different * log((double)classes);
    ways = ranges == classes ? fmin(ways, log_factorial(classes)) : ways;
    return classes > 1 && ways - dealt < log(CHANCE);
}

/* ---- Members --------------------------------------------------------------------------------- */

struct labelled {
    size_t n, classes; /* subjects, and labels that they have */
    size_t *member;    /* [n] the first of each */
    size_t *label;     /* [n] */
    struct giveaway *pairs;
    double *values; /* of all members */
};

static void clear_labels(struct labelled *l)
{
    srnf_free(l->member);
    srnf_free(l->label);
    srnf_free(l->pairs);
    srnf_free(l->values);
}

/* The number of the label of a member: the place of the first subject with the same, counted among
   different ones. */
static size_t number_of(const struct labelled *l, const json_t *labels, size_t member)
{
    for (size_t k = 0; k < l->n; k++) {
        if (json_equal(json_array_get(labels, member), json_array_get(labels, l->member[k]))) {
            return l->label[k];
        }
    }
    return l->classes;
}

/* False without memory, or where a member has no label. */
static bool open_labels(struct labelled *l, const json_t *subjects, const json_t *labels)
{
    size_t n = json_array_size(labels), count, largest;
    size_t *numbers = group_subject_numbers(subjects, n, &count, &largest);
    bool good;

    *l = (struct labelled){.member = srnf_alloc(n, sizeof(size_t)),
                           .label = srnf_alloc(n, sizeof(size_t)),
                           .pairs = srnf_alloc(n, sizeof(struct giveaway)),
                           .values = srnf_alloc(n, sizeof(double))};
    good = numbers && l->member && l->label && l->pairs && l->values;
    if (!good) {
        json_memory_fail(); /* a warning may be missing */
    }
    for (size_t i = 0; i < n && good; i++) {
        good = json_is_string(json_array_get(labels, i));
        if (good && numbers[i] == i) {
            l->label[l->n] = number_of(l, labels, i);
            l->classes += l->label[l->n] == l->classes;
            l->member[l->n++] = i;
        }
    }
    srnf_free(numbers);
    return good;
}

void giveaways_warn_labels(const json_t *inputs, json_t *document)
{
    const json_t *cohort = json_object_get(inputs, "cohort");
    const json_t *of_subjects = json_object_get(cohort, "subjectLabels");
    const json_t *labels = of_subjects ? of_subjects : json_object_get(cohort, "labels");
    json_t *collection = json_object(), *texts = json_array(), *found, *missing, *label;
    const char *key;
    size_t i;

    json_array_foreach(labels, i, label)
    {
        if (json_is_string(label)) {
            alike_add(collection, json_string_value(label));
        }
    }
    found = json_object_get(inputs, "formula") ? NULL : alike_found(collection);
    alike_warn(warnings_of(document), "label", found);
    json_object_foreach(collection, key, label)
    {
        (void)json_array_append(texts, json_array_get(label, 0));
    }
    missing = json_object_get(inputs, "formula") ? NULL : alike_missing(texts);
    alike_warn_missing(warnings_of(document), "label", missing);
    json_decref(missing);
    json_decref(texts);
    json_decref(found);
    json_decref(collection);
}

void giveaways_warn_subjects(const json_t *inputs, json_t *document)
{
    const json_t *subjects = json_object_get(json_object_get(inputs, "cohort"), "subjects");
    json_t *collection = json_object(), *subject;
    size_t i;

    json_array_foreach(subjects, i, subject)
    {
        if (json_is_string(subject)) {
            alike_add_subject(collection, json_string_value(subject));
        }
    }
    alike_warn_subjects(warnings_of(document), collection);
    json_decref(collection);
}

void giveaways_warn(const json_t *inputs, json_t *document)
{
    const json_t *cohort = json_object_get(inputs, "cohort");
    const json_t *names = json_object_get(inputs, "covariates");
    const json_t *table = json_object_get(cohort, "values"); /* where members are classified */
    const json_t *of_subjects =
        json_object_get(cohort, "subjectLabels"); /* of several structures */
    const json_t *labels = of_subjects ? of_subjects : json_object_get(cohort, "labels");
    size_t n = json_array_size(labels);
    struct labelled l = {0};
    bool good = json_array_size(names) > 0 && n > 0 &&
                json_array_size(json_array_get(table, 0)) == n &&
                open_labels(&l, of_subjects ? NULL : json_object_get(cohort, "subjects"), labels);

    for (size_t c = 0; good && c < json_array_size(names); c++) {
        const json_t *one = json_array_get(names, c);
        const char *name =
            json_string_value(json_is_object(one) ? json_object_get(one, "name") : one);

        if (!name || !outliers_read(table, false, c, n, l.values)) {
            continue;
        }
        for (size_t k = 0; k < l.n; k++) {
            l.pairs[k] = (struct giveaway){l.values[l.member[k]], l.label[k]};
        }
        if (giveaways_find(l.n, l.pairs, l.classes)) {
            warning_add(warnings_of(document), "covariate-is-label",
                        json_pack("{s:s, s:I, s:I}", "covariate", name, "subjects", (json_int_t)l.n,
                                  "labels", (json_int_t)l.classes),
                        "%.60s tells the label of all %zu subjects by itself. What is found with "
                        "it beside shape says nothing of shape: leave it out of covariates if it "
                        "is the label in other words, or a thing that follows from it.",
                        name, l.n);
        }
    }
    clear_labels(&l);
}
