/*
 * section_ventricles.c - Fig. 7 of the paper: mean and modes of a real cohort, here the hundred
 * left ventricles at end diastole.
 */
#include "paper/paper.h"

#define DEGREE 15
#define SUBJECTS 100
#define COMPONENTS 12
#define SAMPLES 200

void paper_ventricles(struct paper *paper)
{
    static const char *const names[] = {"registered", "as parameterized"};
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct paper_statistics registered;
    struct paper_statistics plain;
    const struct paper_statistics *const both[] = {&registered, &plain};
    struct paper_group group;
    struct picture_view view;
    const double *mean;
    double first = 0.0;

    report_section(paper->report, "A real cohort: one hundred left ventricles",
                   "Fig. 7: mean and modes of variation");
    if (!paper_load_ventricles(&group, DEGREE, SUBJECTS)) {
        report_paragraph(paper->report, "Left out: the ventricles are not there.");
        return;
    }
    registration.common_pose = true; /* the meshes share one */
    paper_statistics_open(paper, &group, &registration, &registered);
    paper_statistics_open(paper, &group, NULL, &plain);
    for (size_t k = 0; k < COMPONENTS; k++) {
        first += plain.pca.explained[k];
    }
    report_paragraph(
        paper->report,
        "%zu subjects, degree %d. The registered mean took %zu iterations and %.1f s (%.2f s an "
        "iteration; %s). The data were rebuilt from %d published modes: as they are parameterized "
        "here, the first %d components carry %.1f %% of the variance; registration moves the "
        "surfaces over themselves, and so changes the spectrum.",
        group.n, DEGREE, registered.mean.iterations, registered.seconds,
        registered.seconds / (double)registered.mean.iterations,
        registered.mean.converged ? "converged" : "not converged", COMPONENTS, COMPONENTS,
        100.0 * first);
    view = picture_view_of(DEGREE, registered.mean.coefficients);
    mean = registered.mean.coefficients;
    paper_row(paper, "The registered mean", &view, DEGREE, 1, &mean, NULL,
              (const char *const[]){"mean"});
    paper_modes(paper, &registered, &view, 3);
    paper_samples(paper, &registered, &view, 5, 7);
    paper_spectrum(paper, "Spectra of the cohort", 2, both, names);
    paper_quality(paper, &registered, COMPONENTS, SAMPLES);
    paper_statistics_close(&registered);
    paper_statistics_close(&plain);
    paper_group_close(&group);
}
