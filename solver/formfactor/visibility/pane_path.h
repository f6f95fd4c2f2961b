/* Rays that go on behind panes (scene/glass.h), straight on, weaker by what each pane passes. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_PANE_PATH_H
#define LAMBERT_FORMFACTOR_VISIBILITY_PANE_PATH_H

#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/glass.h"

/* Called where ray i of a packet comes to the front of a pane with the light that the panes before it have
 * passed. */
typedef struct pane_visitor {
    void (*meet)(void *context, size_t i, uint32_t element, double weight);
    void *context;
} pane_visitor;

/* Takes those of n rays whose hits are panes on to the first opaque face behind them, or out of the scene:
 * hits then are these, origins lie behind the last pane, and weight[i] is multiplied by what the panes pass.
 * The first pane of a ray is met already; visitor, unless NULL, is told of the others. Other rays and their
 * weights stay as they are. Cost: a cast for each pane that rays of the packet cross. */
void pane_path_follow(const visibility *v, const mesh *m, ray_packet *rays, size_t n, hit_packet *hits,
                      double weight[VISIBILITY_PACKET], const pane_visitor *visitor);

/* The same for segments from origin to origin + direction, whose ends lie on faces: what is not nearer than
 * end[i], a share of the segment, counts no more. weight[i] is 0 where anything opaque is nearer. */
void pane_path_reach(const visibility *v, const mesh *m, ray_packet *segments, size_t n, hit_packet *hits,
                     const double end[VISIBILITY_PACKET], double weight[VISIBILITY_PACKET]);

/* passed[i]: 1 of segments from points of the elements from[i] to points of to[i] that are not blocked, which
 * are those without a bit of visibility_blocked, what panes pass of the others, and 0 where anything opaque
 * is between. Faces in the planes of both ends block nothing. */
void pane_path_between(const visibility *v, const mesh *m, const ray_packet *segments, size_t n,
                       const uint32_t *from, const uint32_t *to, unsigned blocked,
                       double passed[VISIBILITY_PACKET]);

/* Takes rays i of n with ahead[i], whose hits are panes, to what lies behind these; how: of visibility_cast.
 */
void pane_path_step(const visibility *v, const mesh *m, ray_packet *rays, size_t n, const bool *ahead,
                    unsigned how, hit_packet *hits);

/* The part of ray i of a packet that the pane which it has met passes. */
double pane_path_passes(const mesh *m, uint32_t pane, const ray_packet *rays, size_t i);

#endif
