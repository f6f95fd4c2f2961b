#include "support/weather_text.h"
#include "support/suite.h"

#include <stdlib.h>

FILE *weather_text_begin(bool epw, const char *periods, char path[32]) {
    snprintf(path, 32, "/tmp/test-XXXXXX%s", epw ? ".epw" : ".wea");
    const int descriptor = mkstemps(path, 4);
    ck_assert_int_ge(descriptor, 0);
    FILE *stream = fdopen(descriptor, "w");
    if (epw)
        fprintf(stream,
                "LOCATION,Some Where,CA,USA,TMY3,724930,37.5,-122.25,-8.0,2.0\nDESIGN CONDITIONS,0\n"
                "TYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0\nHOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\n"
                "COMMENTS 1,\nCOMMENTS 2,\nDATA PERIODS,%s\n",
                periods);
    else
        fprintf(stream, "place Somewhere_XX\nlatitude 37.5\nlongitude 122.25\ntime_zone 120\n"
                        "site_elevation 2.0\nweather_data_file_units 1\n");
    return stream;
}
