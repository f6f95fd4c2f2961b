#include "solver/scene/generate/court.h"

#include <math.h>

double court_half(const court *c, int side) {
    return c->half[side % 2 == 0];
}

void court_point(const court *c, int side, double out, double along, double z, double point[3]) {
    const double sign = side < 2 ? 1 : -1;
    if (side % 2 == 0) {
        point[0] = sign * block_place(c->half[0] + out);
        point[1] = sign * along;
    } else {
        point[0] = -sign * along;
        point[1] = sign * block_place(c->half[1] + out);
    }
    point[2] = z;
}

lam_status court_add(const court *c, int side, int fill, const court_box *box, blocks *all,
                     lam_error *error) {
    double a[3], b[3];
    court_point(c, side, box->out[0], box->along[0], box->z[0], a);
    court_point(c, side, box->out[1], box->along[1], box->z[1], b);
    return block_add(all, fill, fmin(a[0], b[0]), fmin(a[1], b[1]), a[2], fmax(a[0], b[0]), fmax(a[1], b[1]),
                     b[2], error);
}

lam_status court_add_square(const court *c, int fill, double out, double z0, double z1, blocks *all,
                            lam_error *error) {
    const double x = c->half[0] + out, y = c->half[1] + out;
    return block_add(all, fill, -x, -y, z0, x, y, z1, error);
}
