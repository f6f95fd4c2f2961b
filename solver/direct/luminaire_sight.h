/* The scene between a luminaire and its receivers: faces and panes hide its light, but neither its own
 * housing nor the plane that its opening lies in. */
#ifndef LAMBERT_DIRECT_LUMINAIRE_SIGHT_H
#define LAMBERT_DIRECT_LUMINAIRE_SIGHT_H

#include "solver/direct/placed_source.h"
#include "solver/formfactor/visibility/visibility.h"

/* An element that a receiver does not lie on. */
#define SIGHT_OPEN SIZE_MAX

/* The groups that hide nothing from a luminaire, ascending; of a group its backs are among them. */
typedef struct ignored_groups {
    size_t n;
    uint32_t *groups; /* [n] */
} ignored_groups;

/* The boxes of all groups, [n_groups][2][3]. The caller frees them. */
lam_status group_boxes_make(const mesh *m, double (**out)[2][3], lam_error *error);

/* The groups that the luminaire names in `ignore`, and those that wrap its opening: their boxes hold its
 * middle, and along each axis of the scene they extend over at most three times as much as the opening, or as
 * much as its longest side, or IGNORED_LEAST: a small room is none. The caller frees out->groups. Errors:
 * LAM_ERR_ARGUMENT for a name that no group has, with the nearest one; LAM_ERR_MEMORY. */
#define IGNORED_LEAST .5
lam_status ignored_groups_find(const mesh *m, const double (*boxes)[2][3], const placed_luminaires *list,
                               const placed_luminaire *l, ignored_groups *out, lam_error *error);

/* A scene without some groups. */
typedef struct luminaire_sight {
    const mesh *m;
    mesh kept;       /* without the ignored groups; it has no names of its own */
    uint32_t *place; /* [n]: of an element in it, or VISIBILITY_NOTHING; NULL: all are in it */
    visibility *v;   /* NULL where no element is left */
} luminaire_sight;

/* The mesh must outlive it. Freed by luminaire_sight_free. Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status luminaire_sight_make(const mesh *m, const ignored_groups *ignored, luminaire_sight *out,
                                lam_error *error);
void luminaire_sight_free(luminaire_sight *s);

/* A point of the scene relative to the middle of what hides, in single precision. */
void luminaire_sight_recentre(const luminaire_sight *s, const double point[3], float recentred[3]);

/* The way from the opening's plane into the scene, where a face that looks as the opening does covers it by
 * a few millimetres: recessed luminaires whose coordinates are rounded. Places of the opening are moved by it
 * before segments end there. */
void luminaire_sight_settle(const luminaire_sight *s, const placed_source *source, double moved[3]);

/* passed[i] of n segments from origin to origin + direction: 1, what panes pass, or 0. element[i]: that the
 * segment leaves, or SIGHT_OPEN. */
void luminaire_sight_passed(const luminaire_sight *s, const ray_packet *segments, size_t n,
                            const size_t *element, double passed[VISIBILITY_PACKET]);

/* The share of the flux that ends nearer than so many metres to the opening. */
double luminaire_sight_near(const luminaire_sight *s, const placed_source *source, const double moved[3],
                            double metres);

#endif
