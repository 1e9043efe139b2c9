/*
 * section_geodesics.c - Fig. 4 and 5 of the paper: geodesics between real structures, and how far
 * each point of three paths is from the straight line between the SRNFs.
 */
#include <stdio.h>

#include "paper/paper.h"

#define DEGREE 22
#define STEPS 7
#define SEGMENTS ((size_t)8) /* of pulled-back geodesics */

static const struct pair {
    const char *name, *from, *to;
} pairs[] = {
    {"left thalamus to left pallidum", "L_thalamus", "L_pallidum"},
    {"left putamen to left hippocampus", "L_putamen", "L_hippocampus"},
    {"left caudate to right caudate", "L_caudate", "R_caudate"},
};
#define PAIRS (sizeof pairs / sizeof pairs[0])

/* Between the ends, which are given: there the energy of all but the closed form is rounding. */
static void energies(struct paper *paper, const char *name, const struct srnf_geodesic *geodesic)
{
    char caption[200];
    const double *times = geodesic->times + 1;
    const struct report_line lines[] = {
        {"numerical inversion", STEPS - 2, times, geodesic->energy_geodesic + 1, NULL},
        {"closed form", STEPS - 2, times, geodesic->energy_closed_form + 1, NULL},
        {"linear path", STEPS - 2, times, geodesic->energy_linear + 1, NULL},
    };

    (void)snprintf(caption, sizeof caption, "%s: ||Q(f_t) - q_t||^2 at unit area", name);
    report_chart(paper->report, caption, "t", "energy", true, 3, lines);
}

/* What is told of a geodesic of the pulled-back metric. */
struct pullback {
    const char *name;
    struct srnf_path_figures linear, inverted, path;
    double distance, seconds;
    bool converged;
};

static void pull_back(struct paper *paper, const struct paper_group *group, const double *to,
                      struct pullback *out)
{
    struct srnf_pullback_options options = srnf_pullback_options_defaults();
    struct srnf_pullback_geodesic geodesic;
    struct srnf_error error = {0};
    double start = paper->context.seconds(NULL);

    options.segments = SEGMENTS;
    paper_check(srnf_pullback_geodesic(group->sht, group->surfaces[0], to, &options,
                                       &paper->context, &geodesic, &error),
                &error, out->name);
    out->linear = geodesic.linear;
    out->inverted = geodesic.inverted;
    out->path = geodesic.path;
    out->distance = geodesic.distance;
    out->converged = geodesic.converged;
    out->seconds = paper->context.seconds(NULL) - start;
    srnf_pullback_geodesic_clear(&geodesic);
}

static void tell_pullbacks(struct report *report, size_t count, const struct pullback *pullbacks)
{
    static const char *const headings[] = {"pair",
                                           "linear path",
                                           "inverted straight line",
                                           "geodesic",
                                           "linear - geodesic",
                                           "inverted - geodesic",
                                           "length",
                                           "length of the inverted line",
                                           "straight line in L2",
                                           "speed, sd / mean",
                                           "converged",
                                           "seconds"};

    report_paragraph(report,
                     "The geodesics of the previous framework, whose metric is pulled back to the "
                     "space of surfaces, stay in it. Of all paths of %zu segments between the same "
                     "two surfaces they have the least energy; their length is at least that of "
                     "the straight line in L2, which leaves the space.",
                     SEGMENTS);
    report_table_open(report, "Path energies: of a geodesic and of the paths it is better than",
                      sizeof headings / sizeof headings[0], headings);
    for (size_t i = 0; i < count; i++) {
        const struct pullback *p = &pullbacks[i];

        report_cell(report, "%s", p->name);
        report_cell(report, "%.5f", p->linear.energy);
        report_cell(report, "%.5f", p->inverted.energy);
        report_cell(report, "%.5f", p->path.energy);
        report_cell(report, "%.2e", p->linear.energy - p->path.energy);
        report_cell(report, "%.2e", p->inverted.energy - p->path.energy);
        report_cell(report, "%.5f", p->path.length);
        report_cell(report, "%.5f", p->inverted.length);
        report_cell(report, "%.5f", p->distance);
        report_cell(report, "%.1e", p->path.speed_variation);
        report_cell(report, "%s", p->converged ? "yes" : "no");
        report_cell(report, "%.1f", p->seconds);
    }
    report_table_close(report);
}

static void one_pair(struct paper *paper, struct paper_group *group, const struct pair *pair,
                     struct pullback *pullback)
{
    static const char *const captions[STEPS] = {"t = 0", "1/6", "2/6", "3/6", "4/6", "5/6", "1"};
    struct srnf_register_options registering = srnf_register_options_defaults();
    struct srnf_geodesic_options options = srnf_geodesic_options_defaults();
    struct srnf_registration registration;
    struct srnf_error error = {0};
    struct srnf_geodesic geodesic;
    struct picture_view view;
    const double *path[STEPS];
    double seconds = paper->context.seconds(NULL);
    double between;
    char caption[300];

    paper_check(srnf_register(group->sht, group->surfaces[0], NULL, group->surfaces[1],
                              &registering, NULL, &paper->context, &registration, &error),
                &error, pair->name);
    between = paper->context.seconds(NULL);
    options.steps = STEPS;
    paper_check(srnf_geodesic(group->sht, group->surfaces[0], registration.coefficients, &options,
                              &paper->context, &geodesic, &error),
                &error, pair->name);
    report_paragraph(paper->report,
                     "%s, degree %d: distance %.4f after registration (%.4f before), length of the "
                     "path %.4f; registered in %.2f s, inverted in %.2f s.",
                     pair->name, DEGREE, registration.distance, registration.distance_before,
                     geodesic.length, between - seconds, paper->context.seconds(NULL) - between);
    for (size_t i = 0; i < STEPS; i++) {
        path[i] = geodesic.coefficients + i * group->count;
    }
    view = picture_view_of(DEGREE, path[0]);
    (void)snprintf(caption, sizeof caption, "%s; colour: displacement from the start", pair->name);
    paper_row(paper, caption, &view, DEGREE, STEPS, path, path[0], captions);
    energies(paper, pair->name, &geodesic);
    pullback->name = pair->name;
    pull_back(paper, group, registration.coefficients, pullback);
    srnf_geodesic_clear(&geodesic);
    srnf_registration_clear(&registration);
}

void paper_geodesics(struct paper *paper)
{
    struct pullback pullbacks[PAIRS];
    size_t done = 0;

    report_section(paper->report, "Geodesics between real structures",
                   "Fig. 4 and 5: three energy curves, and the paths themselves");
    report_paragraph(paper->report,
                     "The second structure is registered to the first. The straight line between "
                     "their SRNFs is inverted numerically and, for comparison, by the closed form; "
                     "the linear path blends the surfaces. The lower a curve, the closer its path "
                     "is to the geodesic of the space of SRNFs; the ends are given, and left out. "
                     "All are laid on the sphere by the route area; the closed form needs "
                     "star-shaped ones in their radial parameterization.");
    for (size_t i = 0; i < PAIRS; i++) {
        struct paper_group group = paper_group_open(DEGREE, 2);
        char from[200];
        char to[200];

        (void)snprintf(from, sizeof from, "tests/data/aal_subcortex/%s.ply", pairs[i].from);
        (void)snprintf(to, sizeof to, "tests/data/aal_subcortex/%s.ply", pairs[i].to);
        if (paper_encode(&group, 0, from, SRNF_PARAMETERIZATION_AREA) &&
            paper_encode(&group, 1, to, SRNF_PARAMETERIZATION_AREA)) {
            one_pair(paper, &group, &pairs[i], &pullbacks[done++]);
        } else {
            report_paragraph(paper->report, "%s: the meshes are not there.", pairs[i].name);
        }
        paper_group_close(&group);
    }
    if (done > 0) {
        tell_pullbacks(paper->report, done, pullbacks);
    }
}
