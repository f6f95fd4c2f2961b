#include "solver/formfactor/pairs/element_neighbours.h"

#include <stdlib.h>
#include <string.h>

typedef struct edge_use {
    uint32_t low, high, element;
} edge_use;

static int compare_edges(const void *a, const void *b) {
    const edge_use *one = a, *two = b;
    if (one->low != two->low) return one->low < two->low ? -1 : 1;
    if (one->high != two->high) return one->high < two->high ? -1 : 1;
    return one->element < two->element ? -1 : one->element > two->element;
}

static void add_neighbour(uint32_t list[NEIGHBOURS_MOST], uint32_t element) {
    for (int k = 0; k < NEIGHBOURS_MOST; k++) {
        if (list[k] == element) return;
        if (list[k] == UINT32_MAX) {
            list[k] = element;
            return;
        }
    }
}

lam_status element_neighbours_find(const mesh *m, uint32_t (*neighbours)[NEIGHBOURS_MOST], lam_error *error) {
    size_t n_edges = 0;
    edge_use *edges = memory_allocate(m->n, 4 * sizeof *edges, "neighbours", error);
    if (edges == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t *corner = m->elements[i];
        const size_t corners = mesh_corners(m, i);
        for (size_t c = 0; c < corners; c++) {
            const uint32_t a = corner[c], b = corner[(c + 1) % corners];
            edges[n_edges++] = (edge_use){a < b ? a : b, a < b ? b : a, (uint32_t)i};
        }
    }
    qsort(edges, n_edges, sizeof *edges, compare_edges);
    memset(neighbours, 0xff, m->n * sizeof *neighbours);
    for (size_t e = 0; e + 1 < n_edges; e++)
        for (size_t f = e + 1; f < n_edges && edges[f].low == edges[e].low && edges[f].high == edges[e].high;
             f++) {
            add_neighbour(neighbours[edges[e].element], edges[f].element);
            add_neighbour(neighbours[edges[f].element], edges[e].element);
        }
    free(edges);
    return LAM_OK;
}
