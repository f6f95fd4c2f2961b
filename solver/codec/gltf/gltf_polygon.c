/* Edge by edge: the places of an edge that has some inside, and its end, are joined with the place behind the
 * end, which takes the place of that end. An edge before another one that has places inside begins, as the
 * place behind its end may lie on the last edge else. */
#include "solver/codec/gltf/gltf_polygon.h"

#include <assert.h>

enum { CORNERS_MOST = 4 };

static size_t first_edge(size_t n_corners, const uint32_t *corner, const uint32_t *next) {
    size_t found = 0;
    for (size_t e = 0; e < n_corners; e++) {
        const size_t after = (e + 1) % n_corners, last = (e + 2) % n_corners;
        if (next[corner[e]] == corner[after]) continue;
        found = e;
        if (next[corner[after]] != corner[last]) return e;
    }
    return found;
}

void gltf_polygon(size_t count, const bool *inside, uint32_t *next, uint32_t (*triangles)[3]) {
    uint32_t corner[CORNERS_MOST], begin[CORNERS_MOST], alive = 0;
    size_t n_corners = 0, n = 0;
    for (uint32_t k = 0; k < count; k++) {
        next[k] = k + 1 < count ? k + 1 : 0;
        if (inside[k]) continue;
        assert(n_corners < CORNERS_MOST);
        corner[n_corners] = begin[n_corners] = k;
        n_corners++;
    }
    const size_t first = first_edge(n_corners, corner, next);
    for (size_t s = 0; s < n_corners; s++) {
        const size_t e = (first + s) % n_corners, after = (e + 1) % n_corners;
        const uint32_t end = corner[after], apex = next[end];
        alive = begin[e];
        if (begin[e] == end || next[begin[e]] == end) continue;
        for (uint32_t k = begin[e]; k != end; k = next[k]) {
            triangles[n][0] = k;
            triangles[n][1] = next[k];
            triangles[n++][2] = apex;
        }
        next[begin[e]] = apex;
        begin[after] = apex;
    }
    for (uint32_t k = next[alive]; next[k] != alive; k = next[k]) {
        triangles[n][0] = alive;
        triangles[n][1] = k;
        triangles[n++][2] = next[k];
    }
    assert(n + 2 == count);
}
