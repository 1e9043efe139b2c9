/*
 * color_map.c - colours for a scalar field, perceptually uniform by construction.
 *
 * In OKLab equal distances look equally different. The map is a helix there: lightness rises
 * evenly, hue turns evenly, chroma stays, so that its speed |d(L, a, b)/dt| is the same
 * everywhere, and it reads in greyscale as well. From a deep violet over blue and green to a light
 * yellow; the whole path lies inside sRGB.
 *
 *     L = L0 + (L1 - L0) t,  h = h0 + (h1 - h0) t,  (a, b) = C (cos h, sin h)
 *
 * Source of the colour space, its two matrices and the cube: B. Ottosson, "A perceptual color
 * space for image processing", 2020. The result is linear light, as glTF wants it, with no gamma
 * applied.
 */
#include "formats.h"

#include <math.h>

#define LIGHTNESS_FIRST 0.35
#define LIGHTNESS_LAST 0.92
#define CHROMA 0.095
#define HUE_FIRST (305.0 * SRNF_PI / 180.0)
#define HUE_LAST (100.0 * SRNF_PI / 180.0)

/* OKLab to the cube roots of the cone responses, and those to linear sRGB. */
static const double lab_to_cones[3][3] = {
    {1.0, 0.3963377774, 0.2158037573},
    {1.0, -0.1055613458, -0.0638541728},
    {1.0, -0.0894841775, -1.2914855480},
};
static const double cones_to_rgb[3][3] = {
    {4.0767416621, -3.3077115913, 0.2309699292},
    {-1.2684380046, 2.6097574011, -0.3413193965},
    {-0.0041960863, -0.7034186147, 1.7076147010},
};

static void transform(const double matrix[3][3], const double in[3], double out[3])
{
    for (size_t i = 0; i < 3; i++) {
        out[i] = matrix[i][0] * in[0] + matrix[i][1] * in[1] + matrix[i][2] * in[2];
    }
}

void mesh_color_map(double t, double rgb[3])
{
    double s = fmin(fmax(t, 0.0), 1.0);
    double hue = HUE_FIRST + (HUE_LAST - HUE_FIRST) * s;
    double lab[3] = {LIGHTNESS_FIRST + (LIGHTNESS_LAST - LIGHTNESS_FIRST) * s, CHROMA * cos(hue),
                     CHROMA * sin(hue)};
    double cones[3];

    transform(lab_to_cones, lab, cones);
    for (size_t i = 0; i < 3; i++) {
        cones[i] = cones[i] * cones[i] * cones[i];
    }
    transform(cones_to_rgb, cones, rgb);
    for (size_t i = 0; i < 3; i++) {
        rgb[i] = fmin(fmax(rgb[i], 0.0), 1.0);
    }
}
