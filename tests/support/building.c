#include "support/building.h"
#include "support/suite.h"

void set_number(build_options *options, const char *name, double value) {
    lam_error why = {.message = ""};
    ck_assert_msg(build_set_number(options, name, value, &why) == LAM_OK, "%s", why.message);
}

void set_text(build_options *options, const char *name, const char *value) {
    lam_error why = {.message = ""};
    ck_assert_msg(build_set(options, name, value, &why) == LAM_OK, "%s", why.message);
}

build_options options_with(const char *method, double epsilon) {
    build_options options = build_presets(method);
    set_number(&options, "epsilon", epsilon);
    return options;
}

void *own_options(build_options *options, const char *method) {
    return method_own(options, method_find(method));
}
