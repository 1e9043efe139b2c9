/*
 * collinearity.h - terms of a formula that others all but tell.
 */
#ifndef SRNFD_TOOLKIT_COLLINEARITY_H
#define SRNFD_TOOLKIT_COLLINEARITY_H

#include "toolkit/design.h"

/*
 * Warns (covariates-collinear) where the generalized variance inflation of a term is ten or more,
 * by the columns of terms that share no covariate with it: those of x and I(x^2), or of a and a:b,
 * go together whatever the data are. One warning, of the worst term.
 *   design    [in] as design_describe makes it; without a formula nothing is judged
 *   numbers   [in] those of it, of n members
 *   subjects  [in] [n] numbers below n, the same for members of one subject
 */
void collinearity_warn(json_t *warnings, const json_t *design,
                       const struct srnf_regress_design *numbers, size_t n, const size_t *subjects);

#endif
