#include "solver/formfactor/factor_cost.h"

#include <math.h>

const double factor_entry_seconds = 1e-7;

double factor_cost_pace(double seconds, double expected) {
    static const double too_short = 1e-3, most = 8;
    if (!(seconds > too_short) || !(expected > 0)) return 1;
    return fmin(fmax(seconds / expected, 1 / most), most);
}
