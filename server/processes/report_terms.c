/*
 * report_terms.c - what the members of results are called in a report, which of them say nothing
 * to a reader, and those that fit into a cell of a table.
 */
#include "processes/report.h"

#include <ctype.h>
#include <string.h>

#define SHORT_MAX 8   /* elements of what fits into a cell */
#define TEXTS_MAX 200 /* the same of texts */
#define ALIKE_MIN 4   /* equal texts that are written once */
#define SHAPE_ID_LENGTH 37

/* ---- Names ----------------------------------------------------------------------------------- */

static const struct term {
    const char *name, *words;
} terms[] = {
    {"areaDifference", "area, less that of the mesh, over it"},
    {"betweenInterval", "95 % interval of between"},
    {"brier", "Brier score"},
    {"brierInterval", "95 % interval of the Brier score"},
    {"brierReference", "Brier score of the priors alone"},
    {"chance", "accuracy by chance"},
    {"confidenceInterval", "95 % interval"},
    {"correct", "right"},
    {"distanceInterval", "95 % interval of the distance"},
    {"effectiveCount", "subjects that count"},
    {"eigenvalueIntervals", "95 % intervals of the eigenvalues"},
    {"errorInterval", "95 % interval of error"},
    {"explainedIntervals", "95 % intervals of the shares"},
    {"interval", "95 % interval"},
    {"labels", "members"},
    {"groups", "labels"},
    {"leastFdr", "least false discovery rate of a point"},
    {"leastSignificance", "least p of a point, corrected for all points"},
    {"leastSignificanceInterval", "its interval"},
    {"largestEffect", "largest effect of a point, too large by what noise adds"},
    {"lmax", "degree"},
    {"logLossInterval", "95 % interval of the log loss"},
    {"logLossReference", "log loss of the priors alone"},
    {"majorityRate", "share of the most frequent label"},
    {"individualInterval", "95 % interval of individual"},
    {"interactionInterval", "95 % interval of interaction"},
    {"max", "at most"},
    {"maxAngle", "angle at most"},
    {"maxDistance", "distance at most"},
    {"normInterval", "95 % interval of the norm"},
    {"offFixed", "given point off the fixed surface"},
    {"offMoving", "given point off the moving surface"},
    {"onlyAlone", "right by it alone"},
    {"onlyFirst", "right by the first alone"},
    {"onlySecond", "right by the second alone"},
    {"onlyTogether", "right by all together alone"},
    {"pValue", "p"},
    {"pValueInterval", "interval of p"},
    {"p95", "95 % within"},
    {"percentileInterval", "95 % interval of the percentile"},
    {"perSubject", "subjects"},
    {"predicted", "taken for"},
    {"r2Interval", "interval of r2"},
    {"relabellings", "relabellings there are"},
    {"relativeEnergy", "relative energy (0: the shape exists)"},
    {"relativeToDiagonal", "the same, of the diagonal"},
    {"residualVarianceInterval", "95 % interval of the residual variance"},
    {"rms", "root mean square"},
    {"rmsAngle", "angle, root mean square"},
    {"rmsDistance", "distance, root mean square"},
    {"totalVarianceInterval", "95 % interval of the total variance"},
    {"varianceInterval", "95 % interval of the variance"},
    {"volumeDifference", "volume, less that of the mesh, over it"},
    {"withinInterval", "95 % interval of within"},
};

static const char *const not_told[] = {
    "bridged", "bridgedSurfaces", "cacheHit",   "created",      "history",  "inputs",
    "links",   "madeFrom",        "map",        "numericBuild", "origin",   "registration",
    "seconds", "transforms",      "typicality", "violations",   "warnings", NULL,
};

void report_words(FILE *out, const char *name)
{
    char words[128];
    size_t n = 0;

    for (size_t i = 0; i < sizeof terms / sizeof terms[0]; i++) {
        if (strcmp(terms[i].name, name) == 0) {
            report_text(out, terms[i].words);
            return;
        }
    }
    for (; *name && n + 2 < sizeof words; name++) {
        unsigned char c = (unsigned char)*name;
        bool begins = isupper(c) && n > 0 && !isupper((unsigned char)name[-1]);

        if (begins) {
            words[n++] = ' ';
        }
        words[n++] = begins ? (char)tolower(c) : (char)c;
    }
    words[n] = '\0';
    report_text(out, words);
}

static bool ends_with(const char *name, const char *end)
{
    size_t n = strlen(name), m = strlen(end);

    return n >= m && strcmp(name + n - m, end) == 0;
}

/* The id of a shape: a name of it stands elsewhere. */
static bool is_id(const json_t *value)
{
    const char *text = json_string_value(value);

    return text && strlen(text) == SHAPE_ID_LENGTH &&
           (strncmp(text, "surf-", 5) == 0 || strncmp(text, "mesh-", 5) == 0);
}

bool report_is_told(const char *name, const json_t *value)
{
    for (size_t i = 0; not_told[i]; i++) {
        if (strcmp(not_told[i], name) == 0) {
            /* What is rarely so is told where it is. */
            return strcmp(name, "bridged") == 0 && json_is_true(value);
        }
    }
    return !json_is_null(value) && !ends_with(name, "IsFloor") && !is_id(value);
}

/* ---- Cells ----------------------------------------------------------------------------------- */

static bool is_scalar(const json_t *value)
{
    return value && !json_is_object(value) && !json_is_array(value);
}

/* Of a few scalars. */
static bool is_list(const json_t *value)
{
    size_t n = json_array_size(value), i;
    const json_t *one;

    if (!json_is_array(value) || n == 0 ||
        n > (json_is_string(json_array_get(value, 0)) ? TEXTS_MAX : SHORT_MAX)) {
        return false;
    }
    json_array_foreach(value, i, one)
    {
        if (!is_scalar(one)) {
            return false;
        }
    }
    return true;
}

/* An object of a few scalars or short lists, such as {age: 50, site: A}, and no record. */
static bool is_small(const json_t *value)
{
    void *at;

    if (!json_is_object(value) || json_object_size(value) == 0 ||
        json_object_size(value) > SHORT_MAX || json_is_string(json_object_get(value, "id"))) {
        return false;
    }
    for (at = json_object_iter((json_t *)(uintptr_t)value); at;
         at = json_object_iter_next((json_t *)(uintptr_t)value, at)) {
        if (!is_scalar(json_object_iter_value(at)) && !is_list(json_object_iter_value(at))) {
            return false;
        }
    }
    return true;
}

bool report_is_cell(const json_t *value)
{
    return is_scalar(value) || is_list(value) || is_small(value);
}

static bool are_alike(const json_t *list)
{
    const json_t *one;
    size_t i;

    json_array_foreach(list, i, one)
    {
        if (!json_equal(one, json_array_get(list, 0))) {
            return false;
        }
    }
    return json_array_size(list) >= ALIKE_MIN;
}

static void put_list(FILE *out, const json_t *list, const char *between)
{
    const json_t *one;
    size_t i;

    if (are_alike(list)) {
        report_scalar(out, json_array_get(list, 0));
        (void)fprintf(out, " (all %zu)", json_array_size(list));
        return;
    }
    json_array_foreach(list, i, one)
    {
        (void)fputs(i ? between : "", out);
        report_scalar(out, one);
    }
}

static bool is_floor(const json_t *object, const char *name)
{
    char floor[128];

    (void)snprintf(floor, sizeof floor, "%sIsFloor", name);
    return json_is_true(json_object_get(object, floor));
}

static void put_small(FILE *out, const json_t *object)
{
    const char *before = "";
    void *at;

    for (at = json_object_iter((json_t *)(uintptr_t)object); at;
         at = json_object_iter_next((json_t *)(uintptr_t)object, at)) {
        (void)fputs(before, out);
        report_words(out, json_object_iter_key(at));
        (void)fputs(": ", out);
        report_put_cell(out, object, json_object_iter_key(at));
        before = "; ";
    }
}

void report_put_cell(FILE *out, const json_t *object, const char *name)
{
    const json_t *value = json_object_get(object, name);

    if (!value || !report_is_cell(value)) {
        report_scalar(out, json_null());
    } else if (json_is_array(value)) {
        bool interval = json_array_size(value) == 2 && json_is_number(json_array_get(value, 0)) &&
                        (ends_with(name, "nterval"));

        put_list(out, value, interval ? " to " : ", ");
    } else if (json_is_object(value)) {
        put_small(out, value);
    } else {
        (void)fputs(is_floor(object, name) ? "≤ " : "", out);
        report_scalar(out, value);
    }
}
