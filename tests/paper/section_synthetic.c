/*
 * section_synthetic.c - Fig. 6 of the paper: two synthetic groups of eight, their means, modes and
 * random samples.
 *
 * Group 1 is a body with two bumps of random height; group 2 the same body with a bump whose place
 * wanders. All are star-shaped, share a pose, and are registered in it.
 */
#include <math.h>
#include <string.h>

#include "paper/paper.h"
#include "paper/report_internal.h"
#include "support/random.h"

#define DEGREE 22
#define MEMBERS 8

static double bump(const double e[3], const double at[3], double sharpness)
{
    return exp(sharpness * (e[0] * at[0] + e[1] * at[1] + e[2] * at[2] - 1.0));
}

/* Radius of a member in a direction: heights, or the angle of the wandering bump. */
static double radius(int which, const double parameter[2], const double e[3])
{
    static const double first[3] = {1.0, 0.0, 0.0};
    static const double second[3] = {-0.6, 0.0, 0.8};
    double place[3] = {cos(parameter[0]), sin(parameter[0]), 0.0};
    double body = 1.0 + 0.25 * e[2] * e[2];

    if (which == 0) {
        return body + parameter[0] * bump(e, first, 14.0) + parameter[1] * bump(e, second, 14.0);
    }
    return body + parameter[1] * bump(e, place, 14.0);
}

static void make_member(const struct paper_group *group, int which, const double parameter[2],
                        double *surface)
{
    const struct srnf_grid *grid = srnf_sht_grid(group->sht);
    size_t points = grid->n_theta * grid->n_phi;
    double *values = srnf_alloc(3 * points, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(group->sht, 3));

    report_must(values && workspace, "out of memory");
    for (size_t p = 0; p < points; p++) {
        double phi = 2.0 * acos(-1.0) * (double)(p % grid->n_phi) / (double)grid->n_phi;
        size_t row = p / grid->n_phi;
        double e[3] = {grid->sin_theta[row] * cos(phi), grid->sin_theta[row] * sin(phi),
                       grid->cos_theta[row]};
        double r = radius(which, parameter, e);

        for (size_t c = 0; c < 3; c++) {
            values[c * points + p] = r * e[c];
        }
    }
    srnf_sht_analysis(group->sht, 3, values, surface, workspace);
    (void)paper_normalize(group, surface);
    srnf_free(workspace);
    srnf_free(values);
}

static void one_group(struct paper *paper, int which, const char *what)
{
    static const char *const captions[MEMBERS] = {"1", "2", "3", "4", "5", "6", "7", "8"};
    struct test_random random = test_random_seed((uint64_t)which + 6);
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct paper_group group = paper_group_open(DEGREE, MEMBERS);
    struct paper_statistics s;
    struct picture_view view;
    const double *mean;

    for (size_t i = 0; i < MEMBERS; i++) {
        double parameter[2];

        if (which == 0) {
            parameter[0] = test_random_uniform(&random, 0.2, 0.8);
            parameter[1] = test_random_uniform(&random, 0.2, 0.8);
        } else {
            parameter[0] = test_random_uniform(&random, -0.5, 0.5);
            parameter[1] = test_random_uniform(&random, 0.5, 0.7);
        }
        make_member(&group, which, parameter, group.surfaces[i]);
    }
    registration.common_pose = true;
    paper_statistics_open(paper, &group, &registration, &s);
    view = picture_view_of(DEGREE, s.mean.coefficients);
    /* From above the plane in which the bumps lie or wander. */
    paper_row(paper, what, &view, DEGREE, MEMBERS, (const double *const *)group.surfaces, NULL,
              captions);
    mean = s.mean.coefficients;
    paper_row(paper, "Their mean", &view, DEGREE, 1, &mean, NULL, (const char *const[]){"mean"});
    report_paragraph(paper->report,
                     "Registered mean in %zu iterations and %.2f s (%s), variance %.5f; what is "
                     "lost of the mean SRNF by being that of a surface: %.1e.",
                     s.mean.iterations, s.seconds,
                     s.mean.converged ? "converged" : "stopped before it converged",
                     s.mean.history[s.mean.iterations - 1].variance, s.mean.relative_energy);
    paper_modes(paper, &s, &view, 2);
    paper_samples(paper, &s, &view, 5, 1);
    paper_statistics_close(&s);
    paper_group_close(&group);
}

void paper_synthetic(struct paper *paper)
{
    report_section(paper->report, "Two synthetic groups",
                   "Fig. 6: groups of eight, their means, modes and samples");
    one_group(paper, 0, "Group 1: two bumps of random height");
    one_group(paper, 1, "Group 2: a bump that wanders");
}
