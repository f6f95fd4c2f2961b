/* Shapes of the luminous openings of luminaires, as files of them, stores and answers have them. */
#ifndef LAMBERT_BASE_LUMINAIRE_SHAPE_H
#define LAMBERT_BASE_LUMINAIRE_SHAPE_H

/* Stores have these numbers (/luminaires/opening in store/FORMAT.md). */
typedef enum luminaire_shape {
    OPENING_POINT,
    OPENING_RECTANGLE, /* a line where one of its sides is 0 */
    OPENING_BOX,
    OPENING_DISC,
    OPENING_ELLIPSE,
    OPENING_CYLINDER, /* upright: its ends are discs, or ellipses */
    OPENING_SPHERE,
    OPENING_ELLIPSOID,
    OPENING_CYLINDER_X, /* lying, along x */
    OPENING_CYLINDER_Y,
    OPENING_UPRIGHT_DISC, /* facing the horizon */
    LUMINAIRE_SHAPES
} luminaire_shape;

/* The name for people, static: "upright cylinder". */
const char *luminaire_shape_name(luminaire_shape shape);

#endif
