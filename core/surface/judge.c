/*
 * judge.c - is a surface that was fitted to a mesh still that mesh?
 *
 * With L the degree, d the bounding-box diagonal of the mesh, rms the root mean square and max the
 * largest distance of the fit (fit.c), four figures say how far the two are apart, and one how the
 * map lies:
 *
 *   fit     rms / d
 *   max     max / d
 *   volume  of the surface over that of the mesh
 *   area    the same for the area
 *   energy  symmetric Dirichlet energy of the map / 4 pi, 4 for an isometry
 *
 *               poor beyond            unfaithful beyond
 *   fit         0.25 / L               1.6 / L, and 0.2;  with energy above 100: 0.5 / L
 *   max         0.1
 *   |volume-1|  0.05                   4 / L, and 0.6
 *   area        0.9 to 1.1             0.25 to 1.5
 *   energy      40                     1e5
 *
 * What a band limit leaves out of a shape with creases falls like 1 / L, and so do the limits;
 * "and" gives the ceiling. They were set by what tests/bench/bench_faithful.c prints (degrees 4 to
 * 63, routes area and star). Brain structures, asteroids and ventricles reach fit L = 0.13,
 * |volume - 1| L = 0.18, area 0.86 (at degree 4) and energy 7.5. Ellipsoids
 * of 1:1:100 by the route area reach 0.07, 0.53, 0.81 and 48, and what is all corners and no
 * middle (a box of 12 faces, a tetrahedron of 4) 1.02, 1.4, 0.53 and 11: poor, and not refused.
 * Beyond the second column are maps that have gone wrong (energies of 700 to 1e9, fit L from 1.1
 * to 15), and the route star on what is thirty times as long as it is wide, where it loses a tenth
 * of the volume or more.
 *
 * Volume, area and the largest distance are poor from where whoever measures the surface would be
 * misled, whatever the degree. The area has more room: the steps of a label's marching cubes are 7
 * % of it, which no smooth surface has, and of the twelve nuclei of tests/data L_caudate and the
 * two hippocampi are 6 to 7 % short at degree 8, R_hippocampus 5.6 % at 11, and none from 15 on.
 *
 * Damping by the heat kernel moves the surface away from the mesh on purpose. It is refused for its
 * energy only, and for a volume that is not positive; but it is as poor as any other.
 */
#include "internal.h"

#include <math.h>

#define FIT_POOR 0.25
#define FIT_UNFAITHFUL 1.6
#define FIT_UNFAITHFUL_MAX 0.2
#define FIT_STRAINED 0.5 /* instead of FIT_UNFAITHFUL where the energy is above ENERGY_STRAINED */
#define ENERGY_STRAINED 100.0
#define MAX_POOR 0.1
#define VOLUME_POOR 0.05
#define VOLUME_UNFAITHFUL 4.0
#define VOLUME_UNFAITHFUL_MAX 0.6
#define AREA_POOR_LOW 0.9
#define AREA_POOR_HIGH 1.1
#define AREA_UNFAITHFUL_LOW 0.25
#define AREA_UNFAITHFUL_HIGH 1.5
#define ENERGY_POOR 40.0
#define ENERGY_UNFAITHFUL 1e5

/* Each comparison is written so that a NaN is beyond every limit. */
static bool within(const struct srnf_judgement *j, double fit, double volume, double area_low,
                   double area_high, double energy)
{
    return j->fit <= fit && fabs(j->volume - 1.0) <= volume && j->area >= area_low &&
           j->area <= area_high && j->energy <= energy;
}

enum srnf_verdict srnf_encode_judge(const struct srnf_encoded *encoded,
                                    const struct srnf_mesh_report *report, bool smoothed,
                                    struct srnf_judgement *j)
{
    double degree = (double)encoded->degree;
    double scale = encoded->scale;
    double fit;
    bool poor;

    *j = (struct srnf_judgement){
        .fit = encoded->fit.rms / encoded->fit.diagonal,
        .max = encoded->fit.max / encoded->fit.diagonal,
        .volume = encoded->measures.volume * scale * scale * scale / report->volume,
        .area = encoded->measures.area * scale * scale / report->area,
        .energy = encoded->distortion.symmetric_dirichlet,
    };
    fit = (j->energy <= ENERGY_STRAINED ? FIT_UNFAITHFUL : FIT_STRAINED) / degree;
    poor = !within(j, FIT_POOR / degree, VOLUME_POOR, AREA_POOR_LOW, AREA_POOR_HIGH, ENERGY_POOR) ||
           !(j->max <= MAX_POOR);
    if (smoothed ? !(j->volume > 0.0 && j->energy <= ENERGY_UNFAITHFUL)
                 : !within(j, fmin(fit, FIT_UNFAITHFUL_MAX),
                           fmin(VOLUME_UNFAITHFUL / degree, VOLUME_UNFAITHFUL_MAX),
                           AREA_UNFAITHFUL_LOW, AREA_UNFAITHFUL_HIGH, ENERGY_UNFAITHFUL)) {
        j->verdict = SRNF_UNFAITHFUL;
    } else if (poor) {
        j->verdict = SRNF_POOR;
    }
    return j->verdict;
}
