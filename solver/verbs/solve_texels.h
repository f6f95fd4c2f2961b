/* The light of `lambert solve` at texels, --at texels: a lightmap, as OpenEXR or in a glTF. */
#ifndef LAMBERT_VERBS_SOLVE_TEXELS_H
#define LAMBERT_VERBS_SOLVE_TEXELS_H

#include "solver/base/terminal.h"
#include "solver/output/output.h"
#include "solver/verbs/light_options.h"

/* Checks the extension of a file: .glb or .exr. Errors: LAM_ERR_ARGUMENT. */
lam_status solve_texels_check(const char *path, lam_error *error);

/* Solves the one light of lit, gathers it at texels and writes the map to path. texel: m, 0: as
 * lightmap_charts_make has it. out: quantity irradiance or radiosity, scene, unit, groups. Errors: those of
 * the answer, of the store and of lightmap_make, LAM_ERR_ARGUMENT (a batch), LAM_ERR_UNSUPPORTED (a store of
 * positions of a light, an exact sun), LAM_ERR_IO. */
lam_status solve_texels(store *s, const mesh *m, lit_store *lit, double texel, const char *path,
                        const solution *out, terminal *t, lam_error *error);

#endif
