#include "solver/base/luminaire_shape.h"

const char *luminaire_shape_name(luminaire_shape shape) {
    static const char *const names[LUMINAIRE_SHAPES] = {"point",
                                                        "rectangle",
                                                        "box",
                                                        "disc",
                                                        "ellipse",
                                                        "upright cylinder",
                                                        "sphere",
                                                        "ellipsoid",
                                                        "cylinder along x",
                                                        "cylinder along y",
                                                        "upright disc"};
    return names[shape];
}
