/*
 * section_comparison.c - whether and where two groups differ (srnf_compare_groups): the ventricles
 * after infarction against the asymptomatic ones, the same with a region planted, and with labels
 * that mean nothing.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "paper/paper.h"
#include "paper/report_internal.h"
#include "support/classification.h"

#define DEGREE 15
#define SUBJECTS 100
#define PERMUTATIONS ((size_t)10000)
#define SHUFFLED_PERMUTATIONS ((size_t)199)
#define SEEDS ((size_t)20)
#define LEVEL 0.05
#define HEIGHT 0.15 /* of what is planted, in radii */
#define SHARPNESS 12.0
#define INSIDE 0.9    /* e_x of the nodes that must be found */
#define BRIGHTEST 4.0 /* -log10 of the significance that is drawn brightest: all permutations */

static void compare(struct paper *paper, const struct paper_statistics *s, const int *labels,
                    size_t permutations, uint64_t seed, struct srnf_comparison *out)
{
    struct srnf_compare_options options = srnf_compare_options_defaults();
    struct srnf_error error = {0};

    options.permutations = permutations;
    options.seed = seed;
    paper_check(srnf_compare_groups(s->group->sht, s->group->n, s->mean.coefficients,
                                    s->mean.registered_q, labels, 0, NULL, &options,
                                    &paper->context, out, &error),
                &error, "comparing two groups");
}

/* Share of the sphere's area, from where the mean is parameterized, that is reported at LEVEL. */
static double reported(const struct srnf_grid *grid, const struct srnf_comparison *c)
{
    double area = 0.0;

    for (size_t p = 0; p < grid->n_theta * grid->n_phi; p++) {
        area += c->significance[p] <= LEVEL ? grid->weight[p / grid->n_phi] : 0.0;
    }
    return area / (4.0 * acos(-1.0));
}

/* The mean surface with -log10 of the significance and with the displacement along the normal. */
static void show(struct paper *paper, const struct paper_statistics *s, const char *caption,
                 const struct srnf_comparison *c)
{
    static const double turned[9] = {-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0};
    size_t points = s->grid->n_theta * s->grid->n_phi;
    double *field = srnf_alloc(points, sizeof(double));
    struct picture_view views[2];

    report_must(field != NULL, "out of memory");
    for (size_t p = 0; p < points; p++) {
        field[p] = -log10(c->significance[p]);
    }
    views[0] = picture_view_of(s->group->degree, s->mean.coefficients);
    views[1] = views[0];
    for (size_t k = 0; k < 9; k++) { /* from behind: right and towards the viewer turned about */
        views[1].rotation[k] *= turned[k / 3 * 4];
    }
    report_row_open(paper->report, caption);
    for (size_t v = 0; v < 2; v++) {
        struct picture picture = picture_draw_field(s->group->degree, s->mean.coefficients,
                                                    &views[v], s->grid, field, BRIGHTEST);

        report_picture(paper->report, picture.png, picture.size, "%s",
                       v == 0 ? "from the front" : "from behind");
        picture_clear(&picture);
    }
    report_row_close(paper->report);
    srnf_free(field);
}

static void real(struct paper *paper, const struct paper_group *group)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct paper_statistics s;
    struct srnf_comparison c;

    registration.common_pose = true; /* the meshes share one */
    paper_statistics_open(paper, group, &registration, &s);
    compare(paper, &s, group->labels, PERMUTATIONS, 1, &c);
    report_paragraph(paper->report,
                     "Asymptomatic ventricles against those after infarction, %zu in all, shapes "
                     "of unit area registered to their mean: p = %.4f for the difference of the "
                     "means, least corrected significance %.4f, of %zu permutations; %.0f %% of "
                     "the sphere is reported at %.2f.",
                     group->n, c.p_value, c.max_p_value, PERMUTATIONS, 100.0 * reported(s.grid, &c),
                     LEVEL);
    show(paper, &s,
         "Where the groups differ, on the mean: from dark, significance 1, to bright, 1e-4 or less",
         &c);
    srnf_comparison_clear(&c);
    paper_statistics_close(&s);
}

/* A copy of the group in which the surfaces labelled 1 are raised about the direction (1, 0, 0). */
static void plant(const struct paper_group *group, const int *labels, struct paper_group *out)
{
    const struct srnf_grid *grid = srnf_sht_grid(group->sht);
    size_t points = grid->n_theta * grid->n_phi;
    double *values = srnf_alloc(3 * points, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(group->sht, 3));

    report_must(values && workspace, "out of memory");
    *out = paper_group_open(group->degree, group->n);
    for (size_t i = 0; i < group->n; i++) {
        srnf_sht_synthesis(group->sht, 3, group->surfaces[i], values, workspace);
        for (size_t k = 0; k < 3 * points && labels[i]; k++) {
            size_t p = k % points;
            double phi = 2.0 * acos(-1.0) * (double)(p % grid->n_phi) / (double)grid->n_phi;
            double x = grid->sin_theta[p / grid->n_phi] * cos(phi);

            values[k] *= 1.0 + HEIGHT * exp(-SHARPNESS * (1.0 - x));
        }
        srnf_sht_analysis(group->sht, 3, values, out->surfaces[i], workspace);
        (void)paper_normalize(out, out->surfaces[i]);
    }
    srnf_free(workspace);
    srnf_free(values);
}

/* Alternating labels of a group that has no such two, in the order of a seed. */
static int *meaningless(size_t n, uint64_t seed)
{
    size_t *in = calloc(2 * n, sizeof *in);
    int *labels = calloc(n, sizeof *labels);

    report_must(in && labels, "out of memory");
    for (size_t i = 0; i < n; i++) {
        in[i] = i % 2;
    }
    classification_shuffle(seed, n, in, in + n);
    for (size_t i = 0; i < n; i++) {
        labels[i] = (int)in[n + i];
    }
    free(in);
    return labels;
}

static void planted(struct paper *paper, const struct paper_group *group)
{
    int *labels = meaningless(group->n, 77);
    struct paper_group raised;
    struct paper_statistics s;
    struct srnf_comparison c;
    size_t count[2] = {0, 0}; /* nodes inside, and on the far side */
    size_t found[2] = {0, 0};

    plant(group, labels, &raised);
    paper_statistics_open(paper, &raised, NULL, &s);
    compare(paper, &s, labels, PERMUTATIONS, 1, &c);
    for (size_t p = 0; p < s.grid->n_theta * s.grid->n_phi; p++) {
        double phi = 2.0 * acos(-1.0) * (double)(p % s.grid->n_phi) / (double)s.grid->n_phi;
        double x = s.grid->sin_theta[p / s.grid->n_phi] * cos(phi);

        if (x > INSIDE || x < 0.0) {
            count[x < 0.0]++;
            found[x < 0.0] += c.significance[p] <= LEVEL;
        }
    }
    report_paragraph(paper->report,
                     "The same ventricles in two groups by lot, a region of one raised by %.0f %% "
                     "of the radius: p = %.4f, least significance %.4f; at %.2f the map reports "
                     "%zu of %zu nodes of the region and %zu of %zu of the far half.",
                     100.0 * HEIGHT, c.p_value, c.max_p_value, LEVEL, found[0], count[0], found[1],
                     count[1]);
    show(paper, &s, "The planted region, as the map has it", &c);
    srnf_comparison_clear(&c);
    paper_statistics_close(&s);
    paper_group_close(&raised);
    free(labels);
}

static void shuffled(struct paper *paper, const struct paper_group *group)
{
    struct paper_statistics s;
    size_t rejected = 0;
    size_t mapped = 0;

    paper_statistics_open(paper, group, NULL, &s);
    for (size_t seed = 0; seed < SEEDS; seed++) {
        int *labels = meaningless(group->n, 200 + seed);
        struct srnf_comparison c;

        compare(paper, &s, labels, SHUFFLED_PERMUTATIONS, seed, &c);
        rejected += c.p_value <= LEVEL;
        mapped += c.max_p_value <= LEVEL;
        srnf_comparison_clear(&c);
        free(labels);
    }
    report_paragraph(
        paper->report,
        "Two groups by lot, nothing planted, over %zu seeds: at %.2f the difference of "
        "the means is rejected %zu times and the map reports anything %zu times; "
        "%.0f is nominal, and more than 4 has a chance of 0.3 %%.",
        SEEDS, LEVEL, rejected, mapped, LEVEL * (double)SEEDS);
    paper_statistics_close(&s);
}

void paper_comparison(struct paper *paper)
{
    struct paper_group group;

    report_section(paper->report, "Comparing two groups",
                   "Beside section 5: a permutation test of the difference of means, and a map of "
                   "its significance, corrected for all points by the largest statistic");
    if (!paper_load_ventricles(&group, DEGREE, SUBJECTS)) {
        report_paragraph(paper->report, "Left out: the ventricles are not there.");
        return;
    }
    real(paper, &group);
    planted(paper, &group);
    shuffled(paper, &group);
    paper_group_close(&group);
}
