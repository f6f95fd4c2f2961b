#include "support/polygon_corners.h"

#include <string.h>

polygon polygon_of_corners(int n, const double corners[][3]) {
    polygon p = {.n = n};
    for (int c = 0; c < n; c++) memcpy(p.corner[c], corners[c], sizeof p.corner[c]);
    polygon_measure(&p);
    return p;
}
