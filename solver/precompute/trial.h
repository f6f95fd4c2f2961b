/* --epsilon as an error that is kept: the knobs of a build, and how a finished trial turns them. */
#ifndef LAMBERT_PRECOMPUTE_TRIAL_H
#define LAMBERT_PRECOMPUTE_TRIAL_H

#include "solver/formfactor/recipe.h"
#include "solver/method/judge/judge.h"

/* Operators that are built for one --epsilon, at most. */
enum { TRIALS_MOST = 3 };

typedef struct trial_knobs {
    double epsilon; /* that the operator is built for: its threshold */
    recipe recipe;  /* of the form factors: rays, or the accuracy of pairs or blocks */
} trial_knobs;

/* The knobs of a recipe that may be turned, and the finest accuracy of pairs. */
typedef struct trial_limits {
    bool rays, accuracy;
    bool fixed_epsilon; /* the operator does not follow epsilon */
    double power;       /* of epsilon in the compression, as measured; 0: not known */
    double finest;
    double aimed_share; /* of the error asked for, that the next trial aims at; 0: .9, as laws are no exact
                           ones */
} trial_limits;

/* The stated error of a trial, and its parts, which add up in squares: compression is the error against the
 * very F that the operator was built from, factors the rest of it. */
typedef struct trial_errors {
    double total, compression, factors;
    bool by_noise; /* the threshold follows the noise of rays, and not epsilon */
} trial_errors;

/* The group that --epsilon is about: the scene's own lights, or random emission where it has none. */
const error_group *trial_group(const error_report *errors);
trial_errors trial_errors_of(const error_group *g, bool by_noise);

/* An error that trials keep: of trial_group by --epsilon, or of the worst group of the scene by
 * --group-error. */
typedef struct trial_goal {
    double asked; /* 0: nothing is to be kept */
    trial_errors errors;
} trial_goal;
trial_goal trial_goal_of_group(double asked, const worst_group *worst, bool by_noise);

/* The power of epsilon in the compression, by two trials, where it is smaller than usual: errors of dark
 * rooms fall slowly as long as nearly all of their light is lost. 0: epsilon was not turned. */
double trial_power(double epsilon, double compression, double epsilon_before, double compression_before);

/* The error over the limit; 0 where nothing is to be kept. */
double trial_excess(const trial_goal *g);

/* "the mean of floor by random emission": the worst group by its name, of which the first 60 bytes are there,
 * and the light. */
enum { TRIAL_WORST_TEXT = 128 };
void trial_describe_worst(const worst_group *worst, const char *name, char text[TRIAL_WORST_TEXT]);

/* True if a finer trial is worth while for a total error of at most `asked`, which errors->total is above,
 * and sets *next. The larger part is turned, and the smaller one too where it is more than half of the
 * squared error asked for; a part without a free knob stays, and the other is not pushed below half of it.
 * Laws: the noise of rays falls as N^-1/2; an error of pairs as their accuracy^.65 (.61 to .7 in an atrium,
 * a patio and an anechoic room); of blocks as the root of theirs (at most); compression as epsilon^.6 (.58
 * to 1.03 in a Cornell box of 641 elements), or as two trials have it. No knob is turned by more than a
 * factor of 64. */
bool trial_turn(double asked, const trial_errors *errors, const trial_limits *limits, const trial_knobs *from,
                trial_knobs *next);

/* "coefficients for --epsilon 0.002 in place of 0.01, 4096 rays in place of 512": the knobs that differ. */
enum { TRIAL_TEXT = 160 };
void trial_describe(const trial_knobs *from, const trial_knobs *to, char text[TRIAL_TEXT]);

#endif
