/* A scene that a test writes line by line, as OBJ. */
#ifndef LAMBERT_TESTS_OBJ_TEXT_H
#define LAMBERT_TESTS_OBJ_TEXT_H

#include "support/scene.h"

/* Begins as {.used = 0}. */
typedef struct obj_text {
    char text[1 << 16];
    size_t used;
} obj_text;

/* Adds to the text, as printf does; the test fails where it has no room. */
void obj_text_put(obj_text *o, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Imports it with plain options; the test fails when that does. */
mesh obj_text_mesh(const obj_text *o);

#endif
