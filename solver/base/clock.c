#include "solver/base/clock.h"

#include <math.h>
#include <stdio.h>

void clock_format_seconds(double seconds, char text[32]) {
    const long whole = lround(fmin(seconds, 1e8));
    if (seconds < 9.95)
        snprintf(text, 32, "%.1f s", seconds);
    else if (whole < 60)
        snprintf(text, 32, "%ld s", whole);
    else if (whole < 3600)
        snprintf(text, 32, "%ld min %ld s", whole / 60, whole % 60);
    else
        snprintf(text, 32, "%ld h %ld min", whole / 3600, whole % 3600 / 60);
}
