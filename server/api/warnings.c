/*
 * warnings.c - the table of warning codes, and the entries made from it.
 *
 * api/openapi.yaml lists the codes with what each means (schema Warning).
 */
#include "api/warnings.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#define DETAIL_MAX 1024

/* One row a line; kept in alphabetical order. */
static const char *const codes[] = {
    "closed-form-inapplicable",
    "column-is-text",
    "components-missing",
    "coordinates-coarse",
    "covariate-far",
    "covariate-is-date",
    "covariate-is-label",
    "covariates-collinear",
    "duplicate-content",
    "encoding-poor",
    "extrapolated",
    "far-from-group",
    "far-from-model",
    "few-replicates",
    "few-subjects",
    "files-passed-over",
    "inversion-not-converged",
    "label-at-border",
    "labels-alike",
    "landmark-off-surface",
    "landmarks-raise-distance",
    "level-says-missing",
    "mean-not-converged",
    "members-not-compared",
    "mirror-images",
    "mixed-degrees",
    "mixed-routes",
    "mixed-units",
    "model-uncalibrated",
    "names-one-class",
    "near-duplicates",
    "no-label-column",
    "not-above-chance",
    "not-analysable",
    "not-assessed",
    "not-reached",
    "p-floor",
    "parameters-not-registered",
    "path-jumps",
    "pose-differs",
    "registration-ambiguous",
    "registration-distorted",
    "registration-not-converged",
    "registration-truncated",
    "self-crossing",
    "shapes-omitted",
    "slope-odd",
    "slope-reversed",
    "spans-differ",
    "spreads-differ",
    "subjects-alike",
    "surface-flat",
    "surface-inside-out",
    "topology-changed",
    "training-subject",
    "transform-not-applied",
    "visits-apart",
    "visits-coincide",
    "visits-exchanged",
    "visits-off-line",
};

static bool is_known(const char *code)
{
    for (size_t i = 0; i < sizeof codes / sizeof codes[0]; i++) {
        if (strcmp(codes[i], code) == 0) {
            return true;
        }
    }
    return false;
}

/* Names are quoted cut to so many bytes, which may leave half a character: bytes that are no UTF-8
   become question marks. */
static void mend_utf8(char *text)
{
    for (unsigned char *at = (unsigned char *)text; *at;) {
        size_t more = *at < 0x80 ? 0 : *at < 0xe0 ? 1 : *at < 0xf0 ? 2 : 3;
        json_t *whole = NULL;
        char character[5] = "";

        if (more > 0 && strnlen((char *)at, more + 1) == more + 1) {
            memcpy(character, at, more + 1);
            whole = json_string(character);
        }
        if (more > 0 && !whole) {
            *at = '?';
            more = 0;
        }
        json_decref(whole);
        at += more + 1;
    }
}

void warning_add(json_t *warnings, const char *code, json_t *figures, const char *format, ...)
{
    char detail[DETAIL_MAX];
    json_t *entry = json_object();
    va_list arguments;

    assert(is_known(code));
    va_start(arguments, format);
    (void)vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    mend_utf8(detail);
    (void)json_object_set_new(entry, "code", json_string(code));
    (void)json_object_set_new(entry, "detail", json_string(detail));
    if (figures) {
        (void)json_object_set_new(entry, "figures", figures);
    }
    (void)json_array_append_new(warnings, entry);
}

json_t *warnings_of(json_t *document)
{
    json_t *warnings = json_object_get(document, "warnings");

    if (!json_is_array(warnings)) {
        (void)json_object_set_new(document, "warnings", json_array());
        warnings = json_object_get(document, "warnings");
    }
    return warnings;
}

void warnings_merge(json_t *warnings, const json_t *from)
{
    for (size_t i = 0; i < json_array_size(from); i++) {
        json_t *entry = json_array_get(from, i);
        bool there = false;

        for (size_t k = 0; k < json_array_size(warnings) && !there; k++) {
            there = json_equal(json_array_get(warnings, k), entry);
        }
        if (!there) {
            (void)json_array_append(warnings, entry);
        }
    }
}

void warnings_put(json_t *document, json_t *from)
{
    warnings_merge(warnings_of(document), from);
    json_decref(from);
}

void warning_coarse(json_t *warnings, const char *mesh, double coarseness)
{
    json_t *figures = json_object();

    if (mesh) {
        (void)json_object_set_new(figures, "mesh", json_string(mesh));
    }
    (void)json_object_set_new(figures, "coarseness", json_real(coarseness));
    warning_add(warnings, "coordinates-coarse", figures,
                "The coordinates of %s come in steps of %.3g times the mean edge: points are "
                "rounded, and some may fall on each other. Write the mesh nearer to the origin, or "
                "in double precision.",
                mesh ? mesh : "the mesh", coarseness);
}

void warning_untransformed(json_t *warnings, const char *mesh, size_t count)
{
    json_t *figures =
        mesh ? json_pack("{s:s, s:I}", "mesh", mesh, "count", (json_int_t)count) : NULL;
    char others[40] = "";

    if (count > 1) {
        (void)snprintf(others, sizeof others, " (and of %zu more)", count - 1);
    }
    warning_add(
        warnings, "transform-not-applied", figures,
        "The file%s%s%s has a CoordinateSystemTransformMatrix that turns, scales or reflects "
        "its points into another space. They are taken as they stand in the file. "
        "Where the other space is meant, apply the matrix before.",
        mesh ? " of " : "", mesh ? mesh : "", others);
}

enum warning_shape warning_shape_of(double area, double volume)
{
    double ratio = volume / (area * sqrt(area));
    double quotient = 36.0 * acos(-1.0) * ratio * ratio;

    return !isfinite(quotient) || quotient < SHAPE_FLAT ? SHAPE_FLAT_SURFACE
           : volume < 0.0                               ? SHAPE_INSIDE_OUT
                                                        : SHAPE_SOUND;
}

void warning_shape(json_t *warnings, const char *surface, size_t count, double area, double volume)
{
    enum warning_shape shape = warning_shape_of(area, volume);
    json_t *figures;
    char others[40] = "";

    if (shape == SHAPE_SOUND) {
        return;
    }
    figures = json_pack("{s:f, s:f}", "area", area, "volume", volume);
    if (surface) {
        (void)json_object_set_new(figures, "surface", json_string(surface));
        (void)json_object_set_new(figures, "count", json_integer((json_int_t)count));
    }
    if (count > 1) {
        (void)snprintf(others, sizeof others, " (and %zu more)", count - 1);
    }
    if (shape == SHAPE_FLAT_SURFACE) {
        warning_add(warnings, "surface-flat", figures,
                    "%s%s encloses next to nothing: a volume of %.3g at an area of %.3g. It is a "
                    "flat sheet, or parts of it are inside out; no closed surface of a body is so.",
                    surface ? surface : "The surface", others, volume, area);
        return;
    }
    warning_add(warnings, "surface-inside-out", figures,
                "%s%s has its normals inwards: its volume is %.3g. The field of such a surface is "
                "that of its point reflection, so what is compared is a mirror image. Turn one "
                "axis of its parameters: the columns of a grid in reverse order, or the sign of "
                "the coefficients with m < 0.",
                surface ? surface : "The surface", others, volume);
}
