/*
 * paper.h - the sections of the report that `make paper` writes: every figure and table of the
 * paper with the data at hand, next to what the paper says.
 */
#ifndef TESTS_PAPER_PAPER_H
#define TESTS_PAPER_PAPER_H

#include "paper/picture.h"
#include "paper/report.h"

#define PAPER_DATA "../shared/data"

struct paper {
    struct report *report;
    struct srnf_context context; /* on two threads */
};

/* Each writes one section and ends the program where a computation fails. */
void paper_inversion(struct paper *paper);      /* Fig. 1 and 2 */
void paper_geodesics(struct paper *paper);      /* Fig. 4 and 5 */
void paper_synthetic(struct paper *paper);      /* Fig. 6 */
void paper_ventricles(struct paper *paper);     /* Fig. 7 */
void paper_transfer(struct paper *paper);       /* Fig. 8 */
void paper_frameworks(struct paper *paper);     /* Table 1 */
void paper_classification(struct paper *paper); /* Table 2 */
void paper_comparison(struct paper *paper);     /* section 5, beside the paper */

/* ---- For the sections (surfaces.c) ----------------------------------------------------------- */

/* A group of surfaces of one degree, each of unit area and centred. */
struct paper_group {
    struct srnf_sht *sht;
    size_t n, degree, count; /* count = 3 (L+1)^2 */
    double **surfaces;       /* [n][count] */
    double *scales;          /* [n] what multiplies them back to their meshes' unit */
    int *labels;             /* [n] or NULL */
};
struct paper_group paper_group_open(size_t degree, size_t n);
void paper_group_close(struct paper_group *group);
/* Encodes a mesh file into surface i; false where there is no such file. */
bool paper_encode(struct paper_group *group, size_t i, const char *path,
                  enum srnf_parameterization route);
/* Scales to unit area and moves to the centroid; returns the scale that was taken out. */
double paper_normalize(const struct paper_group *group, double *surface);
/* The ventricles of labels.csv, with their labels; false where the data are not there. */
bool paper_load_ventricles(struct paper_group *group, size_t degree, size_t limit);

/* A row of surfaces in one view, coloured by their distance to `reference`, or plain. */
void paper_row(struct paper *paper, const char *caption, const struct picture_view *view,
               size_t degree, size_t n, const double *const *surfaces, const double *reference,
               const char *const *captions);

/* ---- Mean, modes, samples (statistics.c) ----------------------------------------------------- */

struct paper_statistics {
    const struct paper_group *group;
    const struct srnf_grid *grid;
    struct srnf_mean mean;
    struct srnf_pca pca;
    double seconds; /* of the mean */
};
/* registration NULL: as parameterized. */
void paper_statistics_open(struct paper *paper, const struct paper_group *group,
                           const struct srnf_register_options *registration,
                           struct paper_statistics *s);
void paper_statistics_close(struct paper_statistics *s);
/* Rows of surfaces from -2 to 2 standard deviations along the first modes. */
void paper_modes(struct paper *paper, const struct paper_statistics *s,
                 const struct picture_view *view, size_t modes);
/* Up to eight random surfaces. */
void paper_samples(struct paper *paper, const struct paper_statistics *s,
                   const struct picture_view *view, size_t count, uint64_t seed);
/* Up to four spectra in one chart. */
void paper_spectrum(struct paper *paper, const char *caption, size_t count,
                    const struct paper_statistics *const *s, const char *const *names);
/* Curves of the quality of the model. */
void paper_quality(struct paper *paper, const struct paper_statistics *s, size_t components,
                   size_t samples);

/* Ends the program unless the status is 0 or a warning. */
void paper_check(int status, const struct srnf_error *error, const char *what);

#endif
