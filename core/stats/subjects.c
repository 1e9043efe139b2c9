/*
 * subjects.c - members grouped by subject, and proportions over members of subjects.
 *
 * Formulae and sources stand in srnf/subjects.h.
 */
#include "subjects.h"

#include <math.h>

#define NORMAL_975 1.959963984540054 /* quantile of the standard normal distribution */

void subjects_clear(struct subjects *s)
{
    srnf_free(s->of);
    srnf_free(s->size);
    srnf_free(s->start);
    srnf_free(s->members);
    *s = (struct subjects){0};
}

size_t srnf_subject_count(size_t n, const size_t *subjects)
{
    size_t count = 0;

    for (size_t i = 0; i < n; i++) {
        size_t first = subjects ? 0 : i;

        while (first < i && subjects[first] != subjects[i]) {
            first++;
        }
        count += first == i;
    }
    return count;
}

/* Numbers the subjects in the order of their first members. seen: [n] of scratch, 0. */
static int number(struct subjects *s, const size_t *given, size_t *seen, struct srnf_error *error)
{
    for (size_t i = 0; i < s->n; i++) {
        size_t own = given ? given[i] : i;

        if (own >= s->n) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "subject %zu of member %zu is not below %zu", own, i, s->n);
        }
        if (seen[own] == 0) {
            seen[own] = ++s->count;
        }
        s->of[i] = seen[own] - 1;
    }
    return SRNF_OK;
}

int subjects_open(struct subjects *s, size_t n, const size_t *given, struct srnf_error *error)
{
    int status = SRNF_ENOMEM;

    *s = (struct subjects){.n = n};
    s->of = srnf_alloc(n, sizeof *s->of);
    s->size = srnf_alloc(n, sizeof *s->size);
    s->start = srnf_alloc(n + 1, sizeof *s->start);
    s->members = srnf_alloc(n, sizeof *s->members);
    if (s->of && s->size && s->start && s->members) {
        status = number(s, given, s->members, error); /* members serve as scratch first */
    }
    if (status) {
        return status;
    }
    for (size_t i = 0; i < n; i++) {
        s->size[s->of[i]]++;
    }
    for (size_t k = 0; k < s->count; k++) {
        s->start[k + 1] = s->start[k] + s->size[k];
        s->largest = s->size[k] > s->largest ? s->size[k] : s->largest;
        s->size[k] = 0;
    }
    for (size_t i = 0; i < n; i++) {
        size_t k = s->of[i];

        s->members[s->start[k] + s->size[k]++] = i;
    }
    return SRNF_OK;
}

bool subjects_labels(const struct subjects *s, const size_t *labels, size_t *of_subjects)
{
    for (size_t i = 0; i < s->n; i++) {
        size_t first = s->members[s->start[s->of[i]]];

        if (labels[i] != labels[first]) {
            return false;
        }
        of_subjects[s->of[i]] = labels[i];
    }
    return true;
}

/* ---- Proportions ----------------------------------------------------------------------------- */

void subjects_wilson(double p, double count, double interval[2])
{
    double z2 = NORMAL_975 * NORMAL_975;
    double center = (p + z2 / (2.0 * count)) / (1.0 + z2 / count);
    double half =
        NORMAL_975 / (1.0 + z2 / count) * sqrt(p * (1.0 - p) / count + z2 / (4.0 * count * count));

    interval[0] = p > 0.0 ? fmax(0.0, center - half) : 0.0;
    interval[1] = p < 1.0 ? fmin(1.0, center + half) : 1.0;
}

void subjects_percentile(double below, double count, double interval[2])
{
    interval[0] = 0.0;
    interval[1] = 1.0;
    if (count > 0.0) {
        subjects_wilson(fmin(fmax(below / count, 0.0), 1.0), count, interval);
    }
    interval[0] *= 100.0;
    interval[1] *= 100.0;
}

double subjects_student(double freedom)
{
    return subjects_student_at(freedom, NORMAL_975);
}

double subjects_student_at(double freedom, double z)
{
    const double z3 = z * z * z, z5 = z3 * z * z;

    return z + (z3 + z) / (4.0 * freedom) +
           (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * freedom * freedom) +
           (3.0 * z5 * z * z + 19.0 * z5 + 17.0 * z3 - 15.0 * z) /
               (384.0 * freedom * freedom * freedom);
}

void srnf_wilson_interval(size_t successes, size_t n, double interval[2])
{
    if (n == 0) {
        interval[0] = 0.0;
        interval[1] = 1.0;
    } else {
        subjects_wilson(successes < n ? (double)successes / (double)n : 1.0, (double)n, interval);
    }
}

int srnf_cluster_interval(size_t n, const size_t *subjects, const bool *success, double *effective,
                          double interval[2], struct srnf_error *error)
{
    struct subjects s;
    int status = subjects_open(&s, n, subjects, error);
    double p = 0.0;
    double squares = 0.0;  /* of the sizes */
    double variance = 0.0; /* of p */
    double fewest;

    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        p += success[i] ? 1.0 : 0.0;
    }
    p = n ? p / (double)n : 0.0;
    for (size_t k = 0; k < s.count && status == SRNF_OK; k++) {
        double size = (double)s.size[k];
        double excess = -size * p;

        for (size_t m = s.start[k]; m < s.start[k + 1]; m++) {
            excess += success[s.members[m]] ? 1.0 : 0.0;
        }
        squares += size * size;
        variance += excess * excess;
    }
    if (status == SRNF_OK && n > 0) {
        fewest = (double)n * (double)n / squares;
        variance *= s.count > 1 ? (double)s.count / (double)(s.count - 1) : 0.0;
        *effective = variance > 0.0 ? p * (1.0 - p) * (double)n * (double)n / variance : fewest;
        *effective = fmin(fmax(*effective, fewest), (double)n);
        subjects_wilson(p, *effective, interval);
    } else if (status == SRNF_OK) {
        *effective = 0.0;
        srnf_wilson_interval(0, 0, interval);
    }
    subjects_clear(&s);
    return status;
}
