/* Portals: the openings that rays are aimed at, and how the rays of one element are shared among them. Each
 * element divides its portals into few groups by a tree, as large as they are far away, or into parts where
 * they are near, and gives each group rays by what would come through it if nothing stood between; a group is
 * even in its area. The density of a
 * direction by its solid angle, which passes portals k of groups g at distances r, is
 *     q(w) = sum_k share_g r^2 / (A_g cos_k). */
#ifndef LAMBERT_FORMFACTOR_RAYS_PORTAL_AIM_H
#define LAMBERT_FORMFACTOR_RAYS_PORTAL_AIM_H

#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/facet/face_openings.h"

/* A patch of an opening in recentred coordinates. */
typedef struct portal {
    double corner[3], edge[2][3], normal[3], area;
    double inverse[2][3]; /* inverse[k] . (x - corner) is the share of edge k in a point x */
    bool triangle;
    double strength[2]; /* the share of the lines through it that bring light of the sky to elements on the
                           side of the normal, and to those on the other one */
    uint32_t opening;
} portal;

/* A node holds the neighbouring portals first ... first + count - 1. */
typedef struct portal_node {
    double low[3], high[3];
    double power; /* sum of A_k times the greater strength */
    uint32_t first, count;
    uint32_t second; /* of its two halves; the first one is the next node; 0: one portal */
} portal_node;

typedef struct portals {
    size_t n, n_openings;
    portal *portal; /* [n], in the order of the tree */
    double *before; /* [n + 1], the area of the portals before each */
    portal_node *node;
    double margin;    /* metres, by which boxes of nodes are widened */
    bool in_the_open; /* the scene is open: elements keep their rays by the cosine */
    size_t rays;      /* that each element aims, a multiple of VISIBILITY_PACKET */
} portals;

enum { PORTAL_GROUPS = 16 };

/* Portals first ... first + count - 1, or, of one parallelogram, the part of it between from and to along its
 * edges. */
typedef struct portal_group {
    uint32_t first, count;
    double from[2], to[2]; /* 0 and 1 where it is whole */
    double share;          /* of the rays */
    double area;
} portal_group;

/* The groups of one element. */
typedef struct portal_aim {
    size_t n; /* 0: no portal is in front of the element */
    portal_group group[PORTAL_GROUPS];
} portal_aim;

/* A portal from a patch, with the centre of the scene as in visibility_centre; strengths are 0. */
portal portal_of(const plane_patch *p, const double centre[3]);

/* Takes an array of n portals, which is freed with portals_free, and puts them in the order of a tree.
 * Errors: LAM_ERR_MEMORY, after which the array is freed. */
lam_status portals_build(portal *array, size_t n, portals *out, lam_error *error);
void portals_free(portals *p);

/* All portals as one group. */
portal_aim portals_all(const portals *p);

/* Chooses the groups of an element by its place, its normal and the strengths. Cost: some microseconds. */
void portals_aim(const portals *p, const mesh *m, const visibility *v, size_t element, portal_aim *out);

/* The same for a point in recentred coordinates, with a normal or, NULL, with light from all sides alike. */
void portals_aim_at(const portals *p, const double at[3], const double *normal, portal_aim *out);

/* Weighs the groups of an element by the share of each that is seen as open, [n], by few rays. */
void portal_aim_weigh(portal_aim *aim, const double *open);

/* The point of portals at (x, y) in the unit square, by the shares of the groups. */
void portals_point(const portals *p, const portal_aim *aim, double x, double y, double point[3]);

/* Lists the openings that a ray passes, at most `most` of them; one with several portals may be there twice.
 * Returns how many. */
size_t portals_passed(const portals *p, const double origin[3], const double direction[3], size_t most,
                      uint32_t *openings);

/* q(w), above. direction has length 1. */
double portals_density(const portals *p, const portal_aim *aim, const double origin[3],
                       const double direction[3]);

#endif
