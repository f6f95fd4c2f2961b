/* Random numbers of the generated scenes (SplitMix64). Each purpose has its own, so that another number of
 * one thing does not move all others. Private. */
#ifndef LAMBERT_SCENE_GENERATE_DICE_H
#define LAMBERT_SCENE_GENERATE_DICE_H

#include <stdint.h>

typedef struct dice {
    uint64_t state;
} dice;

static inline uint64_t dice_throw(dice *r) {
    uint64_t z = r->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

/* Uniform in [low, high). */
static inline double dice_between(dice *r, double low, double high) {
    return low + (high - low) * ((double)(dice_throw(r) >> 11) * 0x1p-53);
}

static inline dice dice_for(uint64_t seed, uint64_t purpose) {
    dice r = {seed};
    return (dice){dice_throw(&r) + purpose};
}

#endif
