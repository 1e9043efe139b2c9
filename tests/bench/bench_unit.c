/*
 * bench_unit.c - processor seconds of one gradient transform of three coordinates, the unit that
 * costs are told in.
 *
 *   build/tests/bench/bench_unit [DEGREE]
 */
#include "support/random.h"
#include "support/shapes.h"
#include "support/timing.h"

#include <stdio.h>
#include <stdlib.h>

#define SAMPLES ((size_t)21)
#define SAMPLE_SECONDS 0.002

struct unit {
    struct shapes_surface surface;
    double *along, *across;
    void *workspace;
};

static void gradient(void *argument)
{
    struct unit *u = argument;

    srnf_sht_gradient(u->surface.sht, 3, u->surface.f, u->along, u->across, u->workspace);
}

int main(int argc, char **argv)
{
    size_t degree = argc > 1 ? strtoul(argv[1], NULL, 10) : 15;
    struct unit unit;
    struct timing_case subject = {.body = gradient, .argument = &unit};
    double seconds[SAMPLES];

    if (degree < 1 || degree > 127) {
        (void)fputs("usage: bench_unit [DEGREE]\n", stderr);
        return EXIT_FAILURE;
    }
    shapes_open(&unit.surface, degree);
    shapes_fill_random_star(&unit.surface, 1, NULL);
    unit.along = shapes_doubles(3 * unit.surface.points);
    unit.across = shapes_doubles(3 * unit.surface.points);
    unit.workspace = srnf_alloc(1, srnf_sht_workspace_size(unit.surface.sht, 3));
    if (!unit.workspace) {
        return EXIT_FAILURE;
    }
    timing_calibrate(&subject, SAMPLE_SECONDS);
    timing_interleave(&subject, 1, SAMPLES, seconds);
    printf("%.9f\n", timing_median(SAMPLES, seconds));
    srnf_free(unit.along);
    srnf_free(unit.across);
    srnf_free(unit.workspace);
    shapes_close(&unit.surface);
    return EXIT_SUCCESS;
}
