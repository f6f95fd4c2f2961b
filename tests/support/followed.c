#include "support/followed.h"

#include <check.h>
#include <stdio.h>
#include <string.h>

void followed_report(void *context, const char *stage, double share) {
    followed *f = context;
    ck_assert_double_ge(share, 0);
    ck_assert_double_le(share, 1 + 1e-12);
    if (strcmp(f->stage, stage) != 0) {
        if (f->n_stages++ > 0)
            ck_assert_msg(f->share > 1 - 1e-12, "%s ended at %g, then came %s", f->stage, f->share, stage);
        snprintf(f->stage, sizeof f->stage, "%s", stage);
        f->share = 0;
    }
    ck_assert_msg(share >= f->share, "%s: %g after %g", stage, share, f->share);
    f->share = share;
    f->n_reports++;
}
