#include "solver/base/length_unit.h"

#include <stddef.h>
#include <string.h>

static const length_unit units[] = {{"mm", "millimetres", .001},
                                    {"cm", "centimetres", .01},
                                    {"m", "metres", 1},
                                    {"in", "inches", .0254},
                                    {"ft", "feet", .3048}};

const length_unit *length_unit_find(const char *word) {
    for (size_t k = 0; k < sizeof units / sizeof *units; k++)
        if (strcmp(word, units[k].word) == 0) return &units[k];
    return NULL;
}
