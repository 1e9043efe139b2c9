/*
 * paper.c - `make paper`: reproduces the figures and tables of the paper with the data at hand and
 * writes one HTML file.
 *
 *   paper OUT.html [SECTION..]     sections by name; without any, all of them
 *
 * Tells each section, its seconds and the processor seconds of both threads on standard output;
 * ends with 1 if one fails, and then leaves no report.
 */
#include <fftw3.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "paper/paper.h"
#include "support/parallel.h"
#include "support/timing.h"

#define THREADS 2

/* OpenBLAS has no header of its own for this on every distribution. */
extern void openblas_set_num_threads(int threads);

static const struct section {
    const char *name;
    void (*write)(struct paper *paper);
} sections[] = {
    {"inversion", paper_inversion},
    {"geodesics", paper_geodesics},
    {"synthetic", paper_synthetic},
    {"ventricles", paper_ventricles},
    {"transfer", paper_transfer},
    {"frameworks", paper_frameworks},
    {"classification", paper_classification},
    {"comparison", paper_comparison},
};
#define SECTIONS (sizeof sections / sizeof sections[0])

static double seconds(void *user)
{
    (void)user;
    return timing_monotonic();
}

/* Of all threads of the process. */
static double processor_seconds(void)
{
    return (double)clock() / (double)CLOCKS_PER_SEC;
}

static void spread(void *user, size_t count, void (*body)(void *argument, size_t index),
                   void *argument)
{
    (void)user;
    parallel_spread(THREADS, count, body, argument);
}

static bool wanted(const struct section *section, int argc, char **argv)
{
    bool found = argc <= 2;

    for (int i = 2; i < argc; i++) {
        found = found || strcmp(argv[i], section->name) == 0;
    }
    return found;
}

int main(int argc, char **argv)
{
    struct paper paper = {.context = {.parallel_for = spread, .seconds = seconds}};
    double start = timing_monotonic();

    if (argc < 2) {
        (void)fprintf(stderr, "usage: paper OUT.html [SECTION..]\n");
        return 2;
    }
    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    paper.report =
        report_open(argv[1], "Elastic shape analysis with srnfd: the paper's figures and "
                             "tables");
    report_paragraph(
        paper.report,
        "After Q. Xie, I. Jermyn, S. Kurtek, A. Srivastava, Numerical Inversion of "
        "SRNFs for Efficient Elastic Shape Analysis of Star-Shaped Objects, ECCV "
        "2014. Written by `make paper` (srnfd %s); degrees and options stand with each "
        "figure; seconds are of this machine on %d threads.",
        SRNF_VERSION, THREADS);
    for (size_t i = 0; i < SECTIONS; i++) {
        double before = timing_monotonic();
        double worked = processor_seconds();

        if (wanted(&sections[i], argc, argv)) {
            sections[i].write(&paper);
            printf("%-15s %6.1f s, of processors %6.1f s\n", sections[i].name,
                   timing_monotonic() - before, processor_seconds() - worked);
            (void)fflush(stdout);
        }
    }
    report_paragraph(paper.report, "Written in %.0f s.", timing_monotonic() - start);
    report_close(paper.report);
    printf("%-15s %6.1f s, of processors %6.1f s\n", "all", timing_monotonic() - start,
           processor_seconds());
    return 0;
}
