/*
 * section_geodesics.c - Fig. 4 and 5 of the paper: geodesics between real structures, and how far
 * each point of three paths is from the straight line between the SRNFs.
 */
#include <stdio.h>

#include "paper/paper.h"

#define DEGREE 22
#define STEPS 7

static const struct pair {
    const char *name, *from, *to;
} pairs[] = {
    {"left thalamus to left pallidum", "L_thalamus", "L_pallidum"},
    {"left putamen to left hippocampus", "L_putamen", "L_hippocampus"},
    {"left caudate to right caudate", "L_caudate", "R_caudate"},
};
#define PAIRS (sizeof pairs / sizeof pairs[0])

static void energies(struct paper *paper, const char *name, const struct srnf_geodesic *geodesic)
{
    char caption[200];
    const struct report_line lines[] = {
        {"numerical inversion", STEPS, geodesic->times, geodesic->energy_geodesic, NULL},
        {"closed form", STEPS, geodesic->times, geodesic->energy_closed_form, NULL},
        {"linear path", STEPS, geodesic->times, geodesic->energy_linear, NULL},
    };

    (void)snprintf(caption, sizeof caption, "%s: ||Q(f_t) - q_t||^2 at unit area", name);
    report_chart(paper->report, caption, "t", "energy", true, 3, lines);
}

static void one_pair(struct paper *paper, struct paper_group *group, const struct pair *pair)
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
    srnf_geodesic_clear(&geodesic);
    srnf_registration_clear(&registration);
}

void paper_geodesics(struct paper *paper)
{
    report_section(paper->report, "Geodesics between real structures",
                   "Fig. 4 and 5: three energy curves, and the paths themselves");
    report_paragraph(paper->report,
                     "The second structure is registered to the first. The straight line between "
                     "their SRNFs is inverted numerically and, for comparison, by the closed form; "
                     "the linear path blends the surfaces. The lower a curve, the closer its path "
                     "is to the geodesic of the space of SRNFs. Most of these structures are not "
                     "star-shaped, which the closed form needs.");
    for (size_t i = 0; i < PAIRS; i++) {
        struct paper_group group = paper_group_open(DEGREE, 2);
        char from[200];
        char to[200];

        (void)snprintf(from, sizeof from, "tests/data/aal_subcortex/%s.ply", pairs[i].from);
        (void)snprintf(to, sizeof to, "tests/data/aal_subcortex/%s.ply", pairs[i].to);
        if (paper_encode(&group, 0, from, SRNF_PARAMETERIZATION_AUTO) &&
            paper_encode(&group, 1, to, SRNF_PARAMETERIZATION_AUTO)) {
            one_pair(paper, &group, &pairs[i]);
        } else {
            report_paragraph(paper->report, "%s: the meshes are not there.", pairs[i].name);
        }
        paper_group_close(&group);
    }
}
