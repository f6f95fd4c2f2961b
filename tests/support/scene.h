/* Small scenes, files and measures that the tests of scenes share. */
#ifndef LAMBERT_TESTS_SCENE_H
#define LAMBERT_TESTS_SCENE_H

#include "solver/scene/generate/generate.h"
#include "solver/scene/import/import.h"
#include "support/suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A fresh folder for a test; removed by folder_remove. */
void folder_make(char path[64]);

void folder_remove(const char *path);

void file_write(const char *folder, const char *name, const char *text, char path[256]);

import_options import_plain(void);

/* Imports with plain options; the test fails when that does. */
mesh import_good(const char *path, import_report *report);

/* Imports a text as scene.obj of the folder, with plain options; on LAM_OK m is the caller's. obj_good: the
 * test fails unless that succeeds. obj_bad: it fails unless the text is refused by a message that names the
 * folder and has `says` in it. mtl_write: the text becomes scene.mtl. */
lam_status obj_import(const char *folder, const char *text, mesh *m, import_report *report, lam_error *error);
mesh obj_good(const char *folder, const char *text, import_report *report);
void obj_bad(const char *folder, const char *text, const char *says);
void mtl_write(const char *folder, const char *text);

double total_area(const mesh *m);

/* A scene of `lambert generate`, imported with plain options. */
mesh generate_good(const generate_options *how);

/* The index of a group, or n_groups. */
size_t group_find(const mesh *m, const char *name);

double group_area(const mesh *m, const char *name, size_t *elements);

/* Solid angle of a triangle seen from p, positive when its front is seen (Van Oosterom and Strackee 1983). */
double solid_angle(const double p[3], const double *a, const double *b, const double *c);

/* All that is seen from p: 4 pi inside a closed scene whose fronts look inwards, 0 outside or inside a block.
 */
double seen_from(const mesh *m, const double p[3]);

/* Imports a file of tests/fixtures. */
lam_status import_fixture(const char *name, mesh *m, import_report *report, lam_error *error);

#endif
