/* Weather files that tests write row by row. */
#ifndef LAMBERT_TESTS_WEATHER_TEXT_H
#define LAMBERT_TESTS_WEATHER_TEXT_H

#include <stdbool.h>
#include <stdio.h>

/* Opens a fresh file for an EPW or a WEA and writes its header; path receives its name, which the caller
 * removes. periods: what an EPW states after DATA PERIODS. */
FILE *weather_text_begin(bool epw, const char *periods, char path[32]);

#endif
