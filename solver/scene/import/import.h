/* Scene files to meshes: the parent side. The importing library runs in a child process with limits. */
#ifndef LAMBERT_SCENE_IMPORT_IMPORT_H
#define LAMBERT_SCENE_IMPORT_IMPORT_H

#include "solver/scene/coincident.h"
#include "solver/scene/mesh.h"
#include "solver/scene/size_question.h"

#define IMPORT_FORMATS "obj|gltf|glb|ply|stl|off"

typedef struct import_options {
    double unit;          /* metres per unit of the file; 1 */
    char up;              /* 'x', 'y', 'z', or 0: y for glTF, z otherwise */
    bool guess_unit;      /* that which mesh_likely_unit finds, in place of unit; else unit */
    bool guess_up;        /* the same of mesh_likely_up */
    double reflectance;   /* for every face, grey; negative: the file's own */
    bool two_sided;       /* both sides of each face will be elements: `--two-sided` */
    bool fronts_only;     /* no face gets a back by its material: `--two-sided=no` */
    const char *format;   /* one of IMPORT_FORMATS; NULL: by the file's extension */
    const char *assets;   /* folder that files which the scene names may lie in, beside its own; NULL: none */
    unsigned cpu_seconds; /* limit for the child; 0 gives 120 */
    size_t memory_bytes;  /* limit for the child; 0 gives 8 GiB */
} import_options;

typedef struct import_report {
    const length_unit *unit;      /* that was guessed; NULL: none */
    char up;                      /* that was guessed; 0: none */
    size_t dropped_faces;         /* of zero area */
    size_t luminous;              /* materials of a glTF that emit; their luminance was multiplied by pi */
    size_t clamped;               /* materials whose diffuse value was too near to 1, or more */
    coincident_report coincident; /* faces that were written twice and dropped, or overlap */
    char warnings[2048];          /* one line each, '\n' between them; cut with a count when there are more */
} import_report;

/* Reads OBJ+MTL, glTF/GLB, PLY, STL, OFF; path - is standard input, of the given format, as a file of the
 * current folder that is called stdin. m is filled and owned by the caller (mesh_free); faces of double-sided
 * materials of a glTF are marked in has_back. The lights of a glTF that has any, in cd/m2 or cd, make the
 * mesh photometric; those that are no faces (KHR_lights_punctual) are its punctual ones. Every failure is one
 * line that names the file and the place: unreadable, unknown format, missing MTL, non-finite coordinate,
 * empty scene, a crash, time-out or memory limit of the child. */
lam_status scene_import(const char *path, const import_options *options, mesh *m, import_report *report,
                        lam_error *error);

#endif
