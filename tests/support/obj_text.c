#include "support/obj_text.h"

#include <stdarg.h>
#include <stdio.h>

void obj_text_put(obj_text *o, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    o->used += (size_t)vsnprintf(o->text + o->used, sizeof o->text - o->used, format, arguments);
    va_end(arguments);
    ck_assert_uint_lt(o->used, sizeof o->text);
}

mesh obj_text_mesh(const obj_text *o) {
    char folder[64];
    import_report report;
    folder_make(folder);
    mesh m = obj_good(folder, o->text, &report);
    folder_remove(folder);
    return m;
}
