/* The options of a mesh that a scene is generated or imported with. Limits stand here once. */
#ifndef LAMBERT_SCENE_MESH_OPTIONS_H
#define LAMBERT_SCENE_MESH_OPTIONS_H

#include "solver/base/options/options.h"

/* --elements N, a uint64_t, at most the largest. */
#define OPTION_ROW_ELEMENTS(place, largest, ...)                                                             \
    {.name = "elements",                                                                                     \
     .kind = OPTION_COUNT,                                                                                   \
     .offset = (place),                                                                                      \
     .argument = "N",                                                                                        \
     .least = 1,                                                                                             \
     .most = (largest),                                                                                      \
     __VA_ARGS__}

/* --reflectance X, a double: grey, below 1, so that light dies out. */
#define OPTION_ROW_REFLECTANCE(place, ...)                                                                   \
    {.name = "reflectance",                                                                                  \
     .kind = OPTION_NUMBER,                                                                                  \
     .offset = (place),                                                                                      \
     .argument = "X",                                                                                        \
     .least = 0,                                                                                             \
     .most = 1,                                                                                              \
     .below = true,                                                                                          \
     __VA_ARGS__}

/* --assets DIR, a text or NULL. */
#define OPTION_ROW_ASSETS(place, ...)                                                                        \
    {.name = "assets",                                                                                       \
     .kind = OPTION_TEXT,                                                                                    \
     .offset = (place),                                                                                      \
     .argument = "DIR",                                                                                      \
     .help = "Folder of files that the scene names and that do not lie in its own; others are not read",     \
     __VA_ARGS__}

#endif
