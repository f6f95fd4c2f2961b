/* The elements of a scene as binary glTF 2.0 (Khronos, ISO/IEC 12113:2022). Knows neither stores nor files.
 */
#ifndef LAMBERT_CODEC_GLTF_GLTF_H
#define LAMBERT_CODEC_GLTF_GLTF_H

#include "solver/base/scene/scene_glass.h"
#include "solver/base/scene/scene_pictures.h"
#include "solver/codec/buffer.h"
#include "solver/operator/corners/corner_nodes.h"
#include "solver/operator/corners/corner_plan.h"
#include "solver/operator/groups/groups.h"

/* More elements have numbers that a float does not hold. */
#define GLTF_ELEMENTS_MOST ((size_t)1 << 24)

/* The largest number of a face that a float holds with all before it. */
#define GLTF_FACES_MOST ((uint32_t)1 << 24)

/* The 4th vertex of an element that is a triangle. */
#define GLTF_NO_VERTEX 0xFFFFFFFFu

/* Light of a scene: attributes of the vertices, by columns, and their colour. */
typedef struct gltf_light {
    size_t n_columns;
    const char *const *columns; /* [n_columns]: names of attributes, which begin with _ */
    /* The finite value of a column at a corner of an element. */
    float (*value)(const void *context, size_t column, size_t element, size_t corner);
    const void *context;
    double white; /* the value that COLOR_0 shows as 1, of the first 3 columns of 3 channels, or else of the
                     mean of the first C */
} gltf_light;

/* A map of light over a scene: an image, and the places of corners in it. */
typedef struct gltf_lightmap {
    const float (*texcoord)[4][2]; /* [n], v downwards */
    const unsigned char *png;      /* the file of the image */
    size_t png_bytes;
    bool emissive;    /* the image is the light that leaves, as sRGB; else the irradiance, linear */
    double intensity; /* of an irradiance, by MOZ_lightmap: what the image is multiplied by */
    double white;     /* the value of the image's 1, in the unit of the light */
    const char *unit; /* "lx" */
} gltf_lightmap;

/* Corners that elements share, of which elements have polygons with those inside their edges. */
typedef struct gltf_corners {
    const corner_nodes *nodes;   /* of the mesh, whose numbers ascend by group */
    bool shared;                 /* a vertex is a corner; else elements have vertices of their own */
    const corner_matrix *matrix; /* the weights of corners over elements; or NULL */
} gltf_corners;

/* A scene as it is stored (store/FORMAT.md, /mesh). Every index is below its bound, every number finite. */
typedef struct gltf_mesh {
    const char *name, *kind; /* of the scene and of its operator; kind NULL: it is left out */
    size_t n_vertices, n, n_channels;
    const double (*vertices)[3];   /* [n_vertices][3], m */
    const uint32_t (*elements)[4]; /* [n] */
    const float (*normal)[3];      /* [n][3] */
    const double *area;            /* [n], m^2 */
    const float *reflectance;      /* [C][n] */
    const float *emission;         /* [C][n], W/m^2 */
    const uint32_t *face;          /* [n], of the scene file (scene_faces); NULL: not known */
    const group_index *groups;
    const scene_glass *glass;       /* with panes, by group; or NULL */
    const gltf_light *light;        /* or NULL */
    const scene_pictures *pictures; /* or NULL; not beside light, of 1 channel (grey images) or 3 */
    const gltf_lightmap *lightmap;  /* or NULL; not beside light, emissive not beside pictures */
    const gltf_corners *corners;    /* or NULL; not beside light or a lightmap, shared not beside pictures */
    char up;                        /* 'x', 'y' or 'z' */
} gltf_mesh;

/* Appends the mesh to out, which is empty: metres, y up, north -z (as of a scene that has y up), every
 * element with 3 or 4 vertices of its own.
 *   - A scene of one root node, which has a child for each group that has elements, of the group's name. Its
 *     mesh is one primitive of triangles with POSITION, NORMAL, _ELEMENT and _FACE (the numbers of the
 *     element and of its face, floats; -1: of none, of several, not known or beyond GLTF_FACES_MOST) and
 *     indices of 32 bits; elements ascend, and the triangles of one follow each other.
 *   - Corners of a group at one position share a normal, bit for bit, if they belong to one surface: elements
 *     that meet there at less than 30 degrees, directly or by others between them. It is the mean of their
 *     elements' normals by area. All other corners have those of their elements.
 *   - A material for each group: the mean by area of its reflectance as base colour, and of its emission,
 *     divided by pi, as emissive factor and KHR_materials_emissive_strength, which are a luminance. Of 1
 *     channel these are grey, of 3 red, green and blue, of others the grey of their mean. That of a pane is
 *     blended (gltf_surface.h), and shows no image.
 *   - With corners vertices have _CORNER, the number of the corner, and elements are polygons of all corners
 * on their edges. Shared ones ascend over all groups, vertex v of the file being corner v; _ELEMENT, _FACE
 * and NORMAL are those of the first element that has it. With a matrix extras say "corners": {"count",
 * "parts", "first", "elements", "weights"}, the last four numbers of views: corner j is the sum of parts p
 * from parts[j] (u32, [count + 1]) to parts[j + 1] - 1, each of weights[k] times the light of elements[k]
 * (u32) for k from first[p] (u32) to first[p + 1] - 1, put to its bound (corner_plan.h).
 *   - With light each column is one more attribute (a float), and COLOR_0 its colour, cut to [0, 1].
 * Materials are then white and unlit (KHR_materials_unlit), and extras say "white".
 *   - A group whose elements all have one image (pictures) has TEXCOORD_0, _REFLECTANCE (three floats, that
 * of the element) and a material of the image and its factor in place of the mean. The JPEG files stand in
 * the file.
 *   - With a lightmap TEXCOORD_1 is the place in it, and TEXCOORD_0 too where a group has no image. Materials
 *     have MOZ_lightmap {index, texCoord, intensity}; of an emissive one they are black and have its image
 *     as emissiveTexture. extras of the file say "lightmap": {"quantity", "unit", "white", "encoding"}.
 *   - extras of the file and of the root node: {"lambert":{"name","elements","channels","up","kind"}}, `up`
 *     being the axis that was turned into y; of the node of a group: {"group","elements"}, and "buried", the
 *     numbers of elements that figures of groups leave out, where there are any; of that of a pane "glass":
 *     {"transmittance","faces"} (scene_glass.h), and of a file with panes "glass_law" in "lambert".
 * O(n). Errors: LAM_ERR_ARGUMENT (more than GLTF_ELEMENTS_MOST elements, more bytes than a file of glTF has,
 * a position beyond float), LAM_ERR_MEMORY; out is then empty. */
lam_status gltf_write(const gltf_mesh *m, buffer *out, lam_error *error);

/* The sizes of a mesh that is not read yet; n_texts: bytes of all names. */
typedef struct gltf_sizes {
    size_t n, n_vertices, n_groups, n_texts;
    size_t n_buried;                /* elements */
    bool corners;                   /* gltf_corners */
    size_t n_inside, n_weights;     /* corners inside edges, and weights of corners, at most; 0: none */
    size_t n_textured;              /* elements that may have an image: n or 0 */
    size_t n_textures, image_bytes; /* surfaces and images together */
} gltf_sizes;

/* Bytes of a group while the file is made, at most. */
#define GLTF_PART_BYTES 256

/* Bytes that gltf_write leaves in out of a mesh without light, and bytes that it takes meanwhile beside them,
 * at most; SIZE_MAX where a size_t does not hold them. */
size_t gltf_bytes_most(const gltf_sizes *sizes);
size_t gltf_work_bytes(const gltf_sizes *sizes);

#endif
