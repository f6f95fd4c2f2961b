/* Textures of a mesh: images, the maps that lay them on faces, and their means over elements. Knows no file
 * formats. */
#ifndef LAMBERT_SCENE_TEXTURE_H
#define LAMBERT_SCENE_TEXTURE_H

#include "solver/base/scene/scene_pictures.h"
#include "solver/scene/mesh.h"

/* No image, or an element without a textured face. */
#define TEXTURE_NONE 0xFFFFFFFFu

/* 8-bit sRGB, rows from the top. Freed with free(pixels). */
typedef struct texture_image {
    size_t width, height;
    uint8_t (*pixels)[3]; /* [height][width] */
} texture_image;

/* The continuation of an image outside [0, 1]. */
typedef enum texture_wrap { TEXTURE_REPEAT, TEXTURE_MIRROR, TEXTURE_CLAMP } texture_wrap;

/* The quantities that a surface has. */
enum { TEXTURE_REFLECTANCE, TEXTURE_EMISSION, TEXTURE_QUANTITIES };

/* A material: its factors are multiplied by the means of its images. */
typedef struct texture_surface {
    double factor[TEXTURE_QUANTITIES][3];
    uint32_t image[TEXTURE_QUANTITIES]; /* TEXTURE_NONE: the factor alone */
    texture_wrap wrap[TEXTURE_QUANTITIES][2];
    bool clamped; /* set where a mean reflectance was above the largest */
} texture_surface;

/* A face as it was imported. Each value is affine in the place p: [3] + sum over d of [d] (p[d] - origin[d]).
 */
typedef struct texture_face {
    double origin[3];                   /* m */
    float uv[TEXTURE_QUANTITIES][2][4]; /* v runs downwards from the first row */
    float colour[3][4];                 /* linear, kept in [0, 1]; multiplies the reflectance */
    uint32_t surface;
} texture_face;

/* The linear light of each level of sRGB, white is 1 (IEC 61966-2-1). */
void texture_linear_levels(double linear[256]);

/* Shared by a mesh and those that are refined from it; each holds it once. Immutable but for clamped. */
typedef struct mesh_textures {
    size_t n_images, n_surfaces, n_faces, holders;
    texture_image *images;
    texture_surface *surfaces;
    texture_face *faces;
    double largest; /* reflectance, below 1 */
} mesh_textures;

/* Fills the affine values of a face from those at its corners, 3 or 4; with 4 they must be affine already.
 * value [corners] are numbers, stride apart; out is [4], 0 where a value would not be finite. */
void texture_affine(size_t corners, const double (*p)[3], const double *value, size_t stride, float out[4]);

double texture_value_at(const float f[4], const double origin[3], const double p[3]);

/* True where the value at the 4th corner of a planar quad is that of the affine map through the others,
 * within a thousandth of their range. */
bool texture_is_affine(const double (*p)[3], const double *value, size_t stride);

/* Makes reflectance and emission of the elements with a textured face their means over the element's area, of
 * the pixels decoded to linear light; a pixel is constant on its square. A mean of an element whose image
 * lies on a line or in a point is that of 16 x 16 samples. Exact otherwise, but for edges that cross more
 * than 32,768 pixels, along which as many are sampled. m needs areas. Cost: O(pixels + n images + pixels
 * along the elements' edges), memory 12 bytes per pixel of the largest image. Errors: LAM_ERR_MEMORY. */
lam_status mesh_textures_apply(mesh *m, lam_error *error);

/* Takes hold of the textures of another mesh, or none; lets them go. */
void mesh_textures_hold(mesh *m, mesh_textures *t);
void mesh_textures_release(mesh *m);

/* Fills surface, texcoord and surfaces of out by the textures of m whose reflectance has an image, surfaces
 * of one image and factor once; files are those of the images. False with LAM_OK where there is none. */
lam_status mesh_pictures_place(const mesh *m, scene_pictures *out, bool *any, lam_error *error);
void mesh_pictures_drop(mesh *m);

/* The mean of an image over a polygon of n <= 4 corners in u and v, linear. table: texture_table_create. */
typedef struct texture_table texture_table;
lam_status texture_table_create(const texture_image *image, texture_table **out, lam_error *error);
void texture_table_free(texture_table *t);
void texture_table_mean(const texture_table *t, const texture_wrap wrap[2], size_t n, const double (*uv)[2],
                        double mean[3]);

#endif
