/* Emissions of few emitters some of which are of the sky, against all references: the first bounce of their
 * light is judged, too. Private to judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_EMITTERS_H
#define LAMBERT_METHOD_JUDGE_EMITTERS_H

#include "solver/method/judge/judge_round.h"

/* True where the light of probes is partly that of a sky that is judged. */
bool judge_emitters_are_lit(const lam_operator *op, const judge_input *input);

/* Adds the probes to the total errors of the whole scene, as judge_lit.h tells them, a few at a time. An
 * emitter that is a single tile is lit by what is known closer of it, up to judge_sky_tiles of them. Errors:
 * those of guided_reference_each and of the sky's `tiles`. */
lam_status judge_emitters_add(const lam_operator *op, const probes *p, judge_rounds *r, lam_error *error);

#endif
