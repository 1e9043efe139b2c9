/*
 * change_doubts.c - warnings of tables of two visits that look mistaken: a subject that changes
 * against all others, one that changes otherwise, two subjects whose visits seem exchanged, and a
 * visit that is there twice.
 *
 * As in trajectories_doubts.c none of these is certain: each names the subjects and the figures
 * that it rests on. With v_i the displacement of subject i and m the mean of the others', length
 * |v_i|, deviation |v_i - m| and along <v_i, m> / |m| give |m| as the larger root of
 *
 *     |m|^2 - 2 along |m| + length^2 - deviation^2 = 0,
 *
 * of which there is one alone where the subject goes against the others (along below 0) and its
 * opposite is nearer to them.
 */
#include "processes/paired.h"

#include <math.h>
#include <string.h>

#include "api/json_memory.h"
#include "api/warnings.h"
#include "toolkit/outliers.h"

#define TURNED 0.5  /* of the opposite's distance to the mean of the others */
#define ODD 5.0     /* of deviation, over the median of the others */
#define ODD_FEW 0.8 /* of what one subject can reach, which moves the mean of the n - 1 others */
#define APART 2.0   /* times the median of the distances within subjects: stands out */
#define USUAL 1.5   /* the same: does not */
#define TOLD_MAX 8  /* exchanges */
#define SAME 0.02   /* of that median, below which two visits are the same one */

struct visits {
    const struct paired *asked;
    const struct srnf_paired *found;
    const double *pairs; /* [members][members] distances; NULL: not known */
    json_t *warnings;
    double *values; /* [n] of scratch */
    size_t n;
};

static const char *subject_of(const struct visits *v, size_t k)
{
    const json_t *subjects = json_object_get(v->asked->group.cohort, "subjects");
    const char *name = json_string_value(json_array_get(subjects, v->asked->first[k]));

    return name ? name : "?";
}

/* ---- Changes --------------------------------------------------------------------------------- */

/* How far the opposite of a subject's change is from the mean of the others, over how far it is
   itself. speed: its part along that mean, over the length of that. */
static double turned_of(const struct visits *v, size_t k, double *speed)
{
    double along = v->found->along[k], length = v->found->length[k];
    double deviation = v->found->deviation[k];
    double square = along * along - length * length + deviation * deviation;
    double others = along + sqrt(fmax(square, 0.0));

    *speed = others > 0.0 ? along / others : 0.0;
    return deviation > 0.0
               ? sqrt(fmax(deviation * deviation + 4.0 * along * others, 0.0)) / deviation
               : INFINITY;
}

static bool is_reversed(const struct visits *v, size_t k)
{
    double speed, turned = turned_of(v, k, &speed);

    return speed < 0.0 && turned <= TURNED;
}

static void warn_reversed(const struct visits *v)
{
    json_t *subjects = json_array();
    size_t at = 0, count = 0;
    double least = INFINITY, worst = 0.0, speed;

    for (size_t k = 0; k < v->n; k++) {
        double turned = turned_of(v, k, &speed);

        if (is_reversed(v, k)) {
            (void)json_array_append_new(subjects, json_string(subject_of(v, k)));
            at = turned < least ? k : at;
            worst = turned < least ? speed : worst;
            least = fmin(least, turned);
            count++;
        }
    }
    if (count > 0 && 2 * count < v->n) {
        warning_add(
            v->warnings, "slope-reversed",
            json_pack("{s:O, s:f, s:f}", "subjects", subjects, "speed", worst, "turned", least),
            "Subject \"%.60s\"%s changes against all others, at %.2f times their change; "
            "its opposite would be %.2g times nearer to them. Its visits may be in "
            "reversed order: see whether the times are right.",
            subject_of(v, at), count > 1 ? " (and others)" : "", worst, 1.0 / fmax(least, 1e-3));
    }
    json_decref(subjects);
}

static void warn_odd(const struct visits *v)
{
    size_t at = 0, count = 0;
    double median, ratio, speed;

    for (size_t k = 1; k < v->n; k++) {
        at = v->found->deviation[k] > v->found->deviation[at] ? k : at;
    }
    for (size_t k = 0; k < v->n; k++) {
        if (k != at) {
            v->values[count++] = v->found->deviation[k];
        }
    }
    median = sorted_median(count, v->values);
    ratio = median > 0.0 ? v->found->deviation[at] / median : 0.0;
    if (ratio >= fmin(ODD, ODD_FEW * (double)(v->n - 1)) && !is_reversed(v, at)) {
        (void)turned_of(v, at, &speed);
        warning_add(v->warnings, "slope-odd",
                    json_pack("{s:[s], s:f, s:f}", "subjects", subject_of(v, at), "speed", speed,
                              "ratio", ratio),
                    "The change of subject \"%.60s\" is %.3g times as far from that of the others "
                    "as theirs usually are. See whether both visits are its own and of one "
                    "structure; what the cohort has without it tells what rests on it.",
                    subject_of(v, at), ratio);
    }
}

/* ---- Visits ---------------------------------------------------------------------------------- */

/* Between the first visit of a subject and the last of another, or its own. */
static double between(const struct visits *v, size_t k, size_t l)
{
    return v->pairs[v->asked->first[k] * v->asked->group.n + v->asked->second[l]];
}

/* Two subjects whose visits are far apart, and with their last visits exchanged are not; of many,
   as where sides are mixed up in a fifth of a cohort, the first. */
static void warn_exchanged(const struct visits *v, double median)
{
    size_t told = 0;

    for (size_t k = 0; k < v->n; k++) {
        for (size_t l = k + 1; l < v->n && told < TOLD_MAX; l++) {
            double before[2] = {between(v, k, k), between(v, l, l)};
            double after[2] = {between(v, k, l), between(v, l, k)};

            if (fmin(before[0], before[1]) >= APART * median &&
                fmax(after[0], after[1]) <= USUAL * median) {
                told++;
                warning_add(
                    v->warnings, "visits-exchanged",
                    json_pack("{s:[s, s], s:[f, f], s:[f, f]}", "members", subject_of(v, k),
                              subject_of(v, l), "before", before[0] / median, before[1] / median,
                              "after", after[0] / median, after[1] / median),
                    "A visit of \"%.60s\" and one of \"%.60s\" seem exchanged: their two visits "
                    "are %.3g and %.3g times as far apart as is usual, and %.2g and %.2g times "
                    "with each in the other's place. See whose they are.",
                    subject_of(v, k), subject_of(v, l), before[0] / median, before[1] / median,
                    after[0] / median, after[1] / median);
            }
        }
    }
}

/* Two visits that are one surface, saved twice: nothing changes so little. Equal contents are told
   of as duplicate-content. */
static void warn_same(const struct visits *v, double median)
{
    json_t *subjects = json_array();
    size_t at = v->n;

    for (size_t k = v->n; k-- > 0;) {
        if (between(v, k, k) < SAME * median) {
            (void)json_array_insert_new(subjects, 0, json_string(subject_of(v, k)));
            at = k;
        }
    }
    if (at < v->n) {
        warning_add(v->warnings, "visits-coincide", json_pack("{s:O}", "subjects", subjects),
                    "The two visits of subject \"%.60s\"%s are the same surface or next to it: "
                    "%.2g times as far apart as visits usually are. Was one file given for both?",
                    subject_of(v, at), json_array_size(subjects) > 1 ? " (and of others)" : "",
                    between(v, at, at) / median);
    }
    json_decref(subjects);
}

void change_warn(const struct paired *asked, const struct group_mean *mean,
                 const struct srnf_paired *found, json_t *document)
{
    struct visits v = {.asked = asked,
                       .found = found,
                       .pairs = mean->outputs.pairs,
                       .warnings = warnings_of(document),
                       .values = srnf_alloc(asked->n, sizeof *v.values),
                       .n = asked->n};
    double median;

    if (!v.values) {
        json_memory_fail(); /* a warning may be missing */
        return;
    }
    warn_reversed(&v);
    warn_odd(&v);
    for (size_t k = 0; k < v.n && v.pairs; k++) {
        v.values[k] = between(&v, k, k);
    }
    median = v.pairs ? sorted_median(v.n, v.values) : 0.0;
    if (median > 0.0) {
        warn_exchanged(&v, median);
        warn_same(&v, median);
    }
    srnf_free(v.values);
}
