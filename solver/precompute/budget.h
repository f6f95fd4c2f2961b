/* --time: the recipes that a budget chooses from, as the options that name them, and the choice among them.
 * It knows no scene and no clock. */
#ifndef LAMBERT_PRECOMPUTE_BUDGET_H
#define LAMBERT_PRECOMPUTE_BUDGET_H

#include "solver/precompute/precompute.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum budget_kind { BUDGET_BLOCKS, BUDGET_RAYS, BUDGET_PAIRS } budget_kind;

typedef struct budget_recipe {
    budget_kind kind;
    uint64_t rays;          /* BUDGET_RAYS: from every element; else 0 */
    factor_quality quality; /* BUDGET_PAIRS */
    char epsilon[16];       /* as a command line has it */
    uint64_t probes;
    double error;   /* that single elements are expected to have, indirect */
    double seconds; /* on the wall, by the forecast; negative: not known, or memory has no room */
} budget_recipe;

enum { BUDGET_RECIPES_MOST = 64 };

/* Fills out with all recipes of the kinds that are possible, the coarsest of each kind first, with their
 * expected errors: of blocks .022 (epsilon / .05)^.6, as Cornell boxes, rooms and a maze have it; of rays
 * 9 rays^-1/2, as a canopy and a part of a town have it; of pairs that of the operator alone. seconds are
 * negative. Returns their number. */
size_t budget_list(bool blocks, bool rays, bool pairs, uint64_t probes,
                   budget_recipe out[BUDGET_RECIPES_MOST]);

/* The recipe of the least expected error among those that take at most `seconds`; of equal errors that of the
 * most probes. count where none does: a larger budget never has a larger error. */
size_t budget_pick(const budget_recipe *list, size_t count, double seconds);

/* The recipe that takes least; count where no time is known. */
size_t budget_cheapest(const budget_recipe *list, size_t count);

/* "--form-factors blocks --method hierarchical --epsilon 0.05 --trials 1 --probes 32": the options that stand
 * for the recipe. probes: with --probes. */
enum { BUDGET_TEXT = 160 };
void budget_options(const budget_recipe *r, const char *method, bool probes, char text[BUDGET_TEXT]);

#endif
