/*
 * srnf.h - all of libsrnf: elastic shape analysis of closed surfaces of genus
 * zero by square-root normal fields (SRNFs).
 *
 * Source of the method: Q. Xie, I. Jermyn, S. Kurtek, A. Srivastava, "Numerical Inversion of SRNFs
 * for Efficient Elastic Shape Analysis of Star-Shaped Objects", ECCV 2014; "the paper" below. The
 * glossary of symbols and the derivations that go beyond the paper are in core/README.md.
 *
 * CONVENTIONS, used everywhere and never departed from
 *
 *   Sphere      colatitude theta in (0, pi), longitude phi in [0, 2 pi),
 *               e = (sin theta cos phi, sin theta sin phi, cos theta). Integrals are over the area
 *               of the unit sphere, 4 pi in all.
 *   Grid        n_theta rows of n_phi equispaced longitudes phi_j = 2 pi j / n_phi. Rows run from
 *               north to south: Gauss-Legendre nodes, or equiangular rows
 *               theta_i = pi i / (n_theta - 1) with the poles. The working grid of degree L has
 *               n_theta = ceil(3 (L + 1) / 2), n_phi = 2 n_theta.
 *   Basis       real orthonormal spherical harmonics Y_lm, 0 <= l <= L, at index l*l + l + m:
 *               m > 0 carries cos(m phi), m < 0 sin(|m| phi), no Condon-Shortley sign.
 *   Surface     f : S^2 -> R^3 as double[3][(L+1)^2]: the x block, the y block, the z block.
 *   Fields      scalar fields on the grid as double[n_theta][n_phi]; a batch of b fields is
 *               double[b][n_theta][n_phi]. A vector field is a batch of three.
 *   Normal      n = f_theta x (f_phi / sin theta), outward for f = e.
 *   SRNF        q = n / |n|^(1/2), the zero vector where n = 0; integral of |q|^2 = area.
 *   Action      a rotation O acts as f -> O f and q -> O q; translations leave q unchanged;
 *               Q(-f) = Q(f).
 *
 * The library is pure: no input or output, no global state, no clock, no random device, no locale,
 * no printing. Seeds, threads, progress and cancellation come in as arguments. Every function may
 * be called from any number of threads at once on distinct outputs; objects described as immutable
 * may be shared. The one exception lies in FFTW: see srnf_sht_create.
 */
#ifndef SRNF_H
#define SRNF_H

#include "srnf/base.h"
#include "srnf/sphere.h"
#include "srnf/mesh.h"
#include "srnf/volume.h"
#include "srnf/mend.h"
#include "srnf/surface.h"
#include "srnf/shape.h"
#include "srnf/transport.h"
#include "srnf/register.h"
#include "srnf/landmarks.h"
#include "srnf/stats.h"
#include "srnf/parts.h"
#include "srnf/subjects.h"
#include "srnf/groups.h"
#include "srnf/pullback.h"
#include "srnf/deform.h"
#include "srnf/classify.h"
#include "srnf/typicality.h"
#include "srnf/train.h"
#include "srnf/methods.h"
#include "srnf/twins.h"
#include "srnf/likeness.h"
#include "srnf/covariates.h"
#include "srnf/regress.h"
#include "srnf/norms.h"
#include "srnf/paired.h"
#include "srnf/trajectories.h"

#endif
