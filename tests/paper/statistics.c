/*
 * statistics.c - mean, modes and samples of a group, as the sections on groups show them.
 */
#include <math.h>
#include <stdio.h>

#include "paper/paper.h"
#include "paper/report_internal.h"

#define ALONG 5 /* surfaces along a mode */

void paper_statistics_open(struct paper *paper, const struct paper_group *group,
                           const struct srnf_register_options *registration,
                           struct paper_statistics *s)
{
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_error error = {0};

    *s = (struct paper_statistics){.group = group, .grid = srnf_sht_grid(group->sht)};
    options.registration = registration;
    s->seconds = paper->context.seconds(NULL);
    paper_check(srnf_karcher_mean(group->sht, group->n, (const double *const *)group->surfaces,
                                  &options, &paper->context, &s->mean, &error),
                &error, "computing a mean");
    s->seconds = paper->context.seconds(NULL) - s->seconds;
    paper_check(srnf_pca_fit(s->grid, group->n, s->mean.mean_q, s->mean.registered_q, 0, &s->pca),
                NULL, "fitting principal components");
}

void paper_statistics_close(struct paper_statistics *s)
{
    srnf_mean_clear(&s->mean);
    srnf_pca_clear(&s->pca);
}

/* The surface with these scores, searched from `start`; returns the relative energy. */
static double reconstruct(struct paper *paper, const struct paper_statistics *s,
                          const double *scores, const double *start, double *out)
{
    size_t field = 3 * s->grid->n_theta * s->grid->n_phi;
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_error error = {0};
    struct srnf_inversion inversion;
    double *q = srnf_alloc(field, sizeof(double));
    double energy;

    report_must(q != NULL, "out of memory");
    srnf_pca_reconstruct(s->grid, &s->pca, s->mean.mean_q, scores, q);
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = start;
    options.certify = false;
    paper_check(srnf_invert(s->group->sht, q, &options, &paper->context, &inversion, &error),
                &error, "inverting a point of a model");
    for (size_t k = 0; k < s->group->count; k++) {
        out[k] = inversion.coefficients[k];
    }
    energy = inversion.relative_energy;
    srnf_inversion_clear(&inversion);
    srnf_free(q);
    return energy;
}

void paper_modes(struct paper *paper, const struct paper_statistics *s,
                 const struct picture_view *view, size_t modes)
{
    static const double deviations[ALONG] = {-2.0, -1.0, 0.0, 1.0, 2.0};
    double *scores = srnf_alloc(s->pca.components + 1, sizeof(double));

    report_must(scores != NULL, "out of memory");
    for (size_t k = 0; k < modes && k < s->pca.components; k++) {
        const double *surfaces[ALONG];
        double *all = srnf_alloc(ALONG, s->group->count * sizeof(double));
        char texts[ALONG][64];
        const char *captions[ALONG];
        char caption[200];

        report_must(all != NULL, "out of memory");
        for (size_t i = 0; i < ALONG; i++) {
            double *out = all + i * s->group->count;
            double energy;

            scores[k] = deviations[i] * sqrt(s->pca.eigenvalues[k]);
            energy = reconstruct(paper, s, scores, s->mean.coefficients, out);
            (void)snprintf(texts[i], sizeof texts[i], "%+g sd, E %.1e", deviations[i], energy);
            surfaces[i] = out;
            captions[i] = texts[i];
        }
        scores[k] = 0.0;
        (void)snprintf(caption, sizeof caption,
                       "Mode %zu, %.1f %% of the variance; colour: displacement from the mean",
                       k + 1, 100.0 * s->pca.explained[k]);
        paper_row(paper, caption, view, s->group->degree, ALONG, surfaces, s->mean.coefficients,
                  captions);
        srnf_free(all);
    }
    srnf_free(scores);
}

void paper_samples(struct paper *paper, const struct paper_statistics *s,
                   const struct picture_view *view, size_t count, uint64_t seed)
{
    const double *surfaces[8];
    char texts[8][64];
    const char *captions[8];
    double *scores = srnf_alloc(count, s->pca.components * sizeof(double));
    double *all = srnf_alloc(count, s->group->count * sizeof(double));

    report_must(scores && all && count <= 8, "out of memory");
    srnf_pca_sample(&s->pca, seed, count, s->pca.components, scores);
    for (size_t i = 0; i < count; i++) {
        double *out = all + i * s->group->count;
        double energy =
            reconstruct(paper, s, scores + i * s->pca.components, s->mean.coefficients, out);

        (void)snprintf(texts[i], sizeof texts[i], "sample %zu, E %.1e", i + 1, energy);
        surfaces[i] = out;
        captions[i] = texts[i];
    }
    paper_row(paper, "Samples of the Gaussian model; colour: displacement from the mean", view,
              s->group->degree, count, surfaces, s->mean.coefficients, captions);
    srnf_free(all);
    srnf_free(scores);
}

void paper_spectrum(struct paper *paper, const char *caption, size_t count,
                    const struct paper_statistics *const *s, const char *const *names)
{
    struct report_line lines[4];
    double *x[4];
    double *y[4];

    report_must(count <= 4, "too many spectra in one chart");
    for (size_t i = 0; i < count; i++) {
        size_t n = s[i]->pca.components < 30 ? s[i]->pca.components : 30;

        x[i] = srnf_alloc(n, sizeof(double));
        y[i] = srnf_alloc(n, sizeof(double));
        report_must(x[i] && y[i], "out of memory");
        for (size_t k = 0; k < n; k++) {
            x[i][k] = (double)k + 1.0;
            y[i][k] = s[i]->pca.eigenvalues[k] / s[i]->pca.total_variance;
        }
        lines[i] = (struct report_line){names[i], n, x[i], y[i], NULL};
    }
    report_chart(paper->report, caption, "component", "share of the variance", true, count, lines);
    for (size_t i = 0; i < count; i++) {
        srnf_free(x[i]);
        srnf_free(y[i]);
    }
}

void paper_quality(struct paper *paper, const struct paper_statistics *s, size_t components,
                   size_t samples)
{
    struct srnf_quality_options options = srnf_quality_options_defaults();
    struct srnf_error error = {0};
    struct srnf_quality quality;
    double *x;

    options.components = components;
    options.samples = samples;
    paper_check(srnf_model_quality(s->group->sht, s->group->n, s->mean.coefficients, s->mean.mean_q,
                                   s->mean.registered_q, &options, &paper->context, &quality,
                                   &error),
                &error, "judging a model");
    x = srnf_alloc(quality.components, sizeof(double));
    report_must(x != NULL, "out of memory");
    for (size_t k = 0; k < quality.components; k++) {
        x[k] = (double)k + 1.0;
    }
    {
        const struct report_line lines[] = {
            {"generalisation", quality.components, x, quality.generalisation.value,
             quality.generalisation.standard_error},
            {"specificity", quality.components, x, quality.specificity.value,
             quality.specificity.standard_error},
        };
        const struct report_line compactness = {"compactness", quality.components, x,
                                                quality.compactness.value,
                                                quality.compactness.standard_error};

        report_chart(paper->report,
                     "Generalisation (leave-one-out) and specificity of the model, surface "
                     "distance at unit area",
                     "components", "distance", false, 2, lines);
        report_chart(paper->report, "Compactness", "components", "share of the variance", false, 1,
                     &compactness);
    }
    srnf_free(x);
    srnf_quality_clear(&quality);
}
