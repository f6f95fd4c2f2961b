/* Gradients of J = sum_i g_i q_i, q being radiosity, irradiance or indirect radiosity, from w = (dq/dE)^T g,
 * which lam_operator_apply_adjoint gives. Plain arithmetic over [C][n]; cannot fail, allocates nothing.
 *
 * With R = diag(rho), M = (I - R F)^-1 and E' = E + rho H0: B = M E', H = H0 + F B, indirect B - E' = R F B.
 * dM = M dR F M, so dB = M dR F B + M dR H0 = M dR H (+ M dE + M R dH0), and
 *
 *   radiosity    w = M^T g          dJ/drho_i = w_i H_i                        dJ/dH0 = rho w
 *   irradiance   w = (F M)^T g      dJ/drho_i = w_i H_i  (dH = F dB + dH0)     dJ/dH0 = g + rho w
 *   indirect     w = (M - I)^T g    dJ/drho_i = w_i H_i + g_i (H_i - H0_i)     dJ/dH0 = rho w
 *                (d(B - E') = M dR H - dR H0 = (M - I) dR H + dR (H - H0))
 *
 * Nothing is divided by rho: all of it holds where rho_i = 0 too, H_i being there what a reflectance would
 * reflect. An approximate operator has M~ in place of M, (M~ - I) R^-1 in place of F M. Where M~ is
 * (I - R F~)^-1 for some F~ free of reflectance (low_rank, two_mesh: F~ = U V^T) this is the gradient of what
 * it answers when it is made again from that F~; of a sparse one, whose entries are dropped by their size, it
 * is the formula and no more. */
#ifndef LAMBERT_OPERATOR_GROUPS_GRADIENT_H
#define LAMBERT_OPERATOR_GROUPS_GRADIENT_H

#include "lambert/lambert.h"
#include "solver/operator/groups/groups.h"

/* dJ/drho [C][n]: H is the irradiance, H0 the direct one of sky, luminaires and sun (NULL: 0). out may be any
 * of the inputs. */
void gradient_of_reflectance(lam_quantity quantity, size_t count, const float *g, const float *w,
                             const float *H, const float *H0, float *out);

/* dJ/dH0, which the adjoints of sky and luminaires turn into dJ/dL and dJ/dD. out may be any of the inputs.
 */
void gradient_of_direct_irradiance(lam_quantity quantity, size_t count, const float *reflectance,
                                   const float *g, const float *w, float *out);

/* dJ/dv [C][g] by the emission v that all elements of a group have: sum of w [C][n] over the group. O(C n).
 */
void gradient_of_groups(size_t n_channels, size_t n, const group_index *groups, const float *w, float *out);

#endif
