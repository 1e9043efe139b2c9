/*
 * trajectories_doubts.c - warnings of tables of visits that look mistaken: the same time twice,
 * times in another unit, visits in reversed order, exchanged with those of another subject, or off
 * the line of their own.
 *
 * None of these is certain: each names the subjects and the figures that it rests on.
 */
#include "processes/trajectories.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/warnings.h"
#include "text.h"
#include "toolkit/dates.h"
#include "toolkit/outliers.h"

#define SPANS_APART 30.0  /* of the spans of subjects, next to each other in size */
#define SPANS_SUSPECT 6.0 /* the same, where slopes differ as much the other way round */
#define AS_FAR 2.0        /* what counts as the same way over the whole span */
#define TURNED 0.5        /* of the opposite slope's distance to the prediction */
#define ODD 5.0           /* of oddness, over the median of the others */
#define OFF_LINE 9.0      /* of the squares about a line, the same */

struct doubts {
    const struct trajectories *asked;
    const struct srnf_trajectories *found;
    const json_t *names; /* of the members */
    json_t *warnings;
    size_t *first;  /* [subjects] their first members */
    double *values; /* [subjects] of scratch */
};

/* The name of subject k. */
static const char *subject_of(const struct doubts *d, size_t k)
{
    const json_t *subjects = json_object_get(d->asked->model.group.cohort, "subjects");
    const char *name = json_string_value(json_array_get(subjects, d->first[k]));

    return name ? name : "?";
}

static const char *member_of(const struct doubts *d, size_t i)
{
    const char *name = json_string_value(json_array_get(d->names, i));

    return name ? name : "?";
}

static const char *more_of(size_t more, char text[64])
{
    text[0] = '\0';
    if (more > 0) {
        (void)snprintf(text, 64, " (and %zu more subject%s)", more, plural(more));
    }
    return text;
}

/* ---- Times ----------------------------------------------------------------------------------- */

static void warn_coincident(const struct doubts *d)
{
    const struct group_input *group = &d->asked->model.group;
    const double *times = d->asked->times;
    size_t pair[2] = {0, 0}, last = SIZE_MAX, count = 0;
    json_t *subjects = json_array();
    char more[64];

    for (size_t i = 0; i + 1 < group->n; i++) { /* visits of a subject come by time */
        bool same = group->subjects[i] == group->subjects[i + 1] && !(times[i + 1] > times[i]);

        if (same && group->subjects[i] != last) {
            last = group->subjects[i];
            pair[0] = count ? pair[0] : i;
            pair[1] = count++ ? pair[1] : i + 1;
            (void)json_array_append(subjects,
                                    json_array_get(json_object_get(group->cohort, "subjects"), i));
        }
    }
    if (count) {
        warning_add(d->warnings, "visits-coincide",
                    json_pack("{s:O, s:f}", "subjects", subjects, "time", times[pair[0]]),
                    "Two visits of one subject are at the same time, %.10g: %.120s and %.120s%s. A "
                    "visit that is there twice counts twice, and one with another's time bends the "
                    "line. Leave repeats out, or mend the times.",
                    times[pair[0]], member_of(d, pair[0]), member_of(d, pair[1]),
                    more_of(count - 1, more));
    }
    json_decref(subjects);
}

static double span_of(const struct doubts *d, size_t k)
{
    return d->found->subject[k].last - d->found->subject[k].first;
}

/* The median way along the prediction of subjects whose span is below a limit, or not. */
static double way_of(const struct doubts *d, double limit, bool below)
{
    size_t count = 0;

    for (size_t k = 0; k < d->found->subjects; k++) {
        if ((span_of(d, k) < limit) == below) {
            d->values[count++] = d->found->subject[k].speed * span_of(d, k);
        }
    }
    return sorted_median(count, d->values);
}

/* Spans fall into two classes that lie far apart; or less far, and slopes differ as much the other
   way round, so that all go about as far: the one class may be in another unit. */
static void warn_spans(const struct doubts *d)
{
    size_t n = d->found->subjects, short_ones = 0, rare = 0;
    double gap = 1.0, limit = 0.0, lowest[2] = {INFINITY, INFINITY}, highest[2] = {0.0, 0.0};
    double ways;
    json_t *subjects = json_array();
    bool few_short;

    for (size_t k = 0; k < n; k++) {
        d->values[k] = span_of(d, k);
    }
    (void)sorted_median(n, d->values);
    for (size_t k = 0; k + 1 < n; k++) {
        if (d->values[k + 1] > gap * d->values[k]) {
            gap = d->values[k + 1] / d->values[k];
            limit = d->values[k + 1];
            short_ones = k + 1;
        }
    }
    ways = way_of(d, limit, false) / way_of(d, limit, true);
    few_short = 2 * short_ones <= n;
    for (size_t k = 0; k < n; k++) {
        bool low = span_of(d, k) < limit;

        lowest[!low] = fmin(lowest[!low], span_of(d, k));
        highest[!low] = fmax(highest[!low], span_of(d, k));
        if (low == few_short) {
            rare = json_array_size(subjects) ? rare : k;
            (void)json_array_append_new(subjects, json_string(subject_of(d, k)));
        }
    }
    if (gap >= SPANS_APART || (gap >= SPANS_SUSPECT && ways > 1.0 / AS_FAR && ways < AS_FAR)) {
        size_t own = few_short ? 0 : 1, count = json_array_size(subjects);
        char more[64];

        warning_add(d->warnings, "spans-differ",
                    json_pack("{s:O, s:[f, f], s:[f, f], s:f}", "subjects", subjects, "spans",
                              lowest[own], highest[own], "others", lowest[!own], highest[!own],
                              "ratio", gap),
                    "Times may be in different units: from first to last visit subject "
                    "\"%.60s\"%s takes %.4g to %.4g, the %zu others %.4g to %.4g, %.3g times apart "
                    "at least. Slopes are per unit of time, and weigh by the span: give all times "
                    "in one unit.",
                    subject_of(d, rare), more_of(count - 1, more), lowest[own], highest[own],
                    n - count, lowest[!own], highest[!own], gap);
    }
    json_decref(subjects);
}

/* ---- Slopes ---------------------------------------------------------------------------------- */

static void warn_reversed(const struct doubts *d)
{
    const struct srnf_subject_trajectory *worst = NULL;
    json_t *subjects = json_array();
    size_t at = 0, count = 0;
    char more[64];

    for (size_t k = 0; k < d->found->subjects; k++) {
        const struct srnf_subject_trajectory *one = &d->found->subject[k];

        if (one->speed < 0.0 && one->turned <= TURNED) {
            at = !worst || one->turned < worst->turned ? k : at;
            worst = &d->found->subject[at];
            count++;
            (void)json_array_append_new(subjects, json_string(subject_of(d, k)));
        }
    }
    if (worst && 2 * count < d->found->subjects) {
        warning_add(d->warnings, "slope-reversed",
                    json_pack("{s:O, s:f, s:f}", "subjects", subjects, "speed", worst->speed,
                              "turned", worst->turned),
                    "Subject \"%.60s\"%s changes against all that the others predict, at %.2f "
                    "times their speed; its opposite would be %.2g times nearer to them. Its "
                    "visits may be in reversed order: see whether the times are right.",
                    subject_of(d, at), more_of(count - 1, more), worst->speed,
                    1.0 / fmax(worst->turned, 1e-3));
    }
    json_decref(subjects);
}

/* Oddness of slopes, or the squares about lines where they have some. */
static double figure_of(const struct doubts *d, size_t k, bool slope)
{
    const struct srnf_subject_trajectory *one = &d->found->subject[k];

    return slope ? one->odd.value : one->visits > 2 ? one->left : -1.0;
}

/* The subject whose figure is largest, over the median of the others; 0: there are too few. */
static double find_largest(const struct doubts *d, bool slope, size_t *at)
{
    size_t n = d->found->subjects, count = 0;
    double median;

    *at = 0;
    for (size_t k = 1; k < n; k++) {
        *at = figure_of(d, k, slope) > figure_of(d, *at, slope) ? k : *at;
    }
    for (size_t k = 0; k < n; k++) {
        double figure = figure_of(d, k, slope);

        if (k != *at && figure >= 0.0) {
            d->values[count++] = figure;
        }
    }
    median = count + 1 >= SRNF_PAIRS_MIN ? sorted_median(count, d->values) : 0.0;
    return median > 0.0 ? figure_of(d, *at, slope) / median : 0.0;
}

static void warn_odd(const struct doubts *d)
{
    size_t at;
    double ratio = find_largest(d, true, &at);

    if (isfinite(ratio) && ratio >= ODD) {
        warning_add(d->warnings, "slope-odd",
                    json_pack("{s:[s], s:f, s:f, s:f}", "subjects", subject_of(d, at), "oddness",
                              d->found->subject[at].odd.value, "speed", d->found->subject[at].speed,
                              "ratio", ratio),
                    "The slope of subject \"%.60s\" is %.3g times as far from what the others "
                    "predict for it as theirs usually are, at %.3g times their speed. See whether "
                    "its visits are its own, and at the times that are given; what the cohort has "
                    "without it tells what rests on it.",
                    subject_of(d, at), ratio, d->found->subject[at].speed);
    }
    ratio = find_largest(d, false, &at);
    if (isfinite(ratio) && ratio >= OFF_LINE) {
        warning_add(
            d->warnings, "visits-off-line",
            json_pack("{s:[s], s:I, s:f}", "subjects", subject_of(d, at), "visits",
                      (json_int_t)d->found->subject[at].visits, "ratio", sqrt(ratio)),
            "The %zu visits of subject \"%.60s\" are %.3g times as far from a line as those "
            "of others usually are. One may be another subject's, or their times be mixed "
            "up.",
            d->found->subject[at].visits, subject_of(d, at), sqrt(ratio));
    }
}

static void warn_exchanged(const struct doubts *d)
{
    const double *times = d->asked->times;

    for (size_t k = 0; k < d->found->exchanges; k++) {
        const struct srnf_exchanged_visits *e = &d->found->exchanged[k];
        size_t a = e->members[0], b = e->members[1];

        warning_add(
            d->warnings, "visits-exchanged",
            json_pack("{s:[s, s], s:[f, f], s:[f, f], s:[f, f]}", "members", member_of(d, a),
                      member_of(d, b), "times", times[a], times[b], "before", e->before[0],
                      e->before[1], "after", e->after[0], e->after[1]),
            "%.120s, at the time %.10g, and %.120s, at %.10g, seem exchanged: the visits of "
            "their subjects scatter %.3g and %.3g times as far as usual, and %.2g and %.2g "
            "times with each in the other's place. See whose they are.",
            member_of(d, a), times[a], member_of(d, b), times[b], e->before[0], e->before[1],
            e->after[0], e->after[1]);
    }
}

void trajectories_warn(struct jobs_run *run, const struct trajectories *asked,
                       const struct srnf_trajectories *found, json_t *document)
{
    const struct group_input *group = &asked->model.group;
    json_t *names = group_labels(run, group->surfaces, json_object_get(group->cohort, "subjects"));
    struct doubts d = {.asked = asked,
                       .found = found,
                       .names = names,
                       .warnings = warnings_of(document),
                       .first = srnf_alloc(found->subjects, sizeof *d.first),
                       .values = srnf_alloc(found->subjects, sizeof *d.values)};

    for (size_t i = 0, k = 0; d.first && i < group->n; i++) {
        if (group->subjects[i] == i) {
            d.first[k++] = i;
        }
    }
    if (d.first && d.values) {
        (void)dates_warn("time", group->n, asked->times, d.warnings);
        warn_coincident(&d);
        warn_spans(&d);
        warn_exchanged(&d);
        warn_reversed(&d);
        warn_odd(&d);
    } else {
        json_memory_fail(); /* a warning may be missing */
    }
    srnf_free(d.first);
    srnf_free(d.values);
    json_decref(names);
}
