/* The groups of a store, each path once, and who writes it (store/FORMAT.md says what is in them). A path of
 * an array is the group's followed by a name: STORE_MESH "/area". Other files do not spell these paths. */
#ifndef LAMBERT_STORE_GROUPS_H
#define LAMBERT_STORE_GROUPS_H

#define STORE_MESH "/mesh"         /* solver/scene/mesh_store.c; solver/base/scene/scene_{backs,pictures}.c */
#define STORE_CAMERAS "/cameras"   /* solver/base/scene/scene_cameras.c */
#define STORE_OPERATOR "/operator" /* solver/operator, each kind its own; solver/method/report.c */
#define STORE_FORM_FACTORS "/form_factors" /* solver/formfactor, solver/operator/{blocks,refine} */
#define STORE_SKY "/sky"                   /* solver/formfactor/sky_bounce.c */
#define STORE_LUMINAIRES "/luminaires"     /* solver/luminaire/placed_store.c, solver/direct */
#define STORE_SENSORS "/sensors"           /* solver/sensor/sensors_store.c */
#define STORE_IMPORTANCE "/importance"     /* solver/operator/blocks/importance.c */
#define STORE_SOURCES "/sources"           /* the same */
#define STORE_ERROR "/error"               /* solver/operator/stated/error_figures.c */
#define STORE_POSITIONS "/positions"       /* solver/precompute/positions_error.c */
#define STORE_CHECKSUM "/checksum"         /* store/store_checksum.c, when a store is sealed */

#endif
