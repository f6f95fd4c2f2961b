/* A choice between two numbers without a branch, for loops over many of them. */
#ifndef LAMBERT_WALK_BLEND_H
#define LAMBERT_WALK_BLEND_H

#include <string.h>

/* a where all bits of the mask are set, b where none is: a choice that stays one when compilers know that
 * others depend on the same condition. */
static inline float blend(int mask, float a, float b) {
    int x, y;
    memcpy(&x, &a, sizeof x);
    memcpy(&y, &b, sizeof y);
    const int both = (x & mask) | (y & ~mask);
    float value;
    memcpy(&value, &both, sizeof value);
    return value;
}

#endif
