/* Options of builds for tests: presets, and the options that differ from them. */
#ifndef LAMBERT_TESTS_BUILDING_H
#define LAMBERT_TESTS_BUILDING_H

#include "solver/method/method.h"

void set_number(build_options *options, const char *name, double value);
void set_text(build_options *options, const char *name, const char *value);

build_options options_with(const char *method, double epsilon);

/* The own options of the method, to set what a command line could not. */
void *own_options(build_options *options, const char *method);

#endif
