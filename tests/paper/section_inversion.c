/*
 * section_inversion.c - Fig. 1 and 2 of the paper: surfaces recovered from nothing but their SRNF.
 *
 * Every numerical inversion starts from a round sphere (method auto, initial sphere). The truth is
 * known: the surface error is the L2 distance of the coefficients at unit area, translations apart.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "paper/paper.h"
#include "paper/report_internal.h"
#include "support/shapes.h"

struct specimen {
    const char *name, *structure; /* a case of shapes.c, or a mesh of tests/data/aal_subcortex */
    size_t degree;
    const char *paper; /* relative energy that the paper reports for its like */
};

static const struct specimen specimens[] = {
    {"bumpy star", NULL, 31, "5.7e-4 (closed form)"},
    {"ellipsoid", NULL, 22, "-"},
    {"bent capsule", NULL, 22, "-"},
    {"5 arms", NULL, 22, "-"},
    {"12 arms", NULL, 22, "-"},
    {"left thalamus", "L_thalamus", 31, "9.0e-4"},
    {"right thalamus", "R_thalamus", 31, "9.0e-4"},
    {"left pallidum", "L_pallidum", 31, "6.9e-4"},
    {"right pallidum", "R_pallidum", 31, "6.9e-4"},
};
#define SPECIMENS (sizeof specimens / sizeof specimens[0])

static void open_specimen(const struct specimen *specimen, struct shapes_surface *s)
{
    shapes_open(s, specimen->degree);
    if (specimen->structure) {
        report_must(shapes_fill_structure(s, specimen->structure, SRNF_PARAMETERIZATION_STAR),
                    "a mesh of tests/data/aal_subcortex is missing");
    } else {
        const struct shapes_case *which = shapes_find(specimen->name);

        shapes_fill(s, which->formula, which->parameter);
    }
}

struct outcome {
    struct shapes_surface s;
    struct srnf_inversion inversion;
    double closed_form; /* relative energy */
    double seconds[2];  /* to the last iteration, and of the certificate after it */
};

static void invert_one(struct paper *paper, const struct specimen *specimen, struct outcome *out)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_error error = {0};
    double *star;
    double start;

    open_specimen(specimen, &out->s);
    star = shapes_doubles(out->s.count);
    srnf_invert_closed_form(out->s.sht, out->s.q, star, &out->closed_form, out->s.workspace);
    srnf_free(star);
    options.initial = SRNF_INITIAL_SPHERE;
    start = paper->context.seconds(NULL);
    paper_check(
        srnf_invert(out->s.sht, out->s.q, &options, &paper->context, &out->inversion, &error),
        &error, specimen->name);
    out->seconds[0] = out->inversion.n_history > 0
                          ? out->inversion.history[out->inversion.n_history - 1].seconds
                          : 0.0;
    out->seconds[1] = paper->context.seconds(NULL) - start - out->seconds[0];
}

static void tell(struct report *report, const struct specimen *specimen, const struct outcome *out)
{
    const struct srnf_inversion *inversion = &out->inversion;
    double error = shapes_distance(out->s.degree, out->s.f, inversion->coefficients);

    report_cell(report, "%s", specimen->name);
    report_cell(report, "%zu", specimen->degree);
    report_cell(report, "%.1e", out->closed_form);
    report_cell(report, "%.1e", inversion->relative_energy);
    report_cell(report, "%.1e", error);
    if (inversion->surface_error_bound >= 0.0) {
        report_cell(report, "%.1e", inversion->surface_error_bound);
    } else {
        report_cell(report, "none");
    }
    report_cell(report, "%s",
                !inversion->certificate.computed ? "-"
                : inversion->certificate.unique  ? "unique"
                                                 : "silent");
    report_cell(report, "%.3f", out->seconds[0]);
    report_cell(report, "%.1f", out->seconds[1]);
    report_cell(report, "%s", specimen->paper);
}

static void show(struct paper *paper, const struct specimen *specimen, const struct outcome *out)
{
    static const char *const captions[] = {"truth", "recovered"};
    const double *const pair[] = {out->s.f, out->inversion.coefficients};
    struct picture_view view = picture_view_of(out->s.degree, out->s.f);

    paper_row(paper, specimen->name, &view, out->s.degree, 2, pair, NULL, captions);
}

void paper_inversion(struct paper *paper)
{
    static const char *const headings[] = {"surface",
                                           "degree",
                                           "closed form, relative E",
                                           "numerical, relative E",
                                           "surface error",
                                           "bound",
                                           "certificate",
                                           "inversion, s",
                                           "certificate, s",
                                           "the paper, relative E"};
    struct outcome outcomes[SPECIMENS];

    report_section(paper->report, "Inversion: surfaces from their normals",
                   "Fig. 1 and 2: closed form and numerical inversion");
    report_paragraph(
        paper->report,
        "Each surface is recovered from its square-root normal field alone, starting from a round "
        "sphere. The closed form holds for star-shaped surfaces in their radial parameterization, "
        "which those of this table need not have. The surface error is the L2 distance of the "
        "harmonic coefficients at unit area, translations apart; the certificate says unique where "
        "the surface is proven to be the only one of its degree up to sign and translation.");
    for (size_t i = 0; i < SPECIMENS; i++) {
        invert_one(paper, &specimens[i], &outcomes[i]);
    }
    report_table_open(paper->report, "Relative energy ||Q(f) - q||^2 / ||q||^2 after inversion",
                      sizeof headings / sizeof headings[0], headings);
    for (size_t i = 0; i < SPECIMENS; i++) {
        tell(paper->report, &specimens[i], &outcomes[i]);
    }
    report_table_close(paper->report);
    for (size_t i = 0; i < SPECIMENS; i++) {
        show(paper, &specimens[i], &outcomes[i]);
        srnf_inversion_clear(&outcomes[i].inversion);
        shapes_close(&outcomes[i].s);
    }
}
