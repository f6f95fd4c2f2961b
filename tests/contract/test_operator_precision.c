/* Operators in a store in fewer bits: every precision a file may have, and what is refused in one clear line.
 */
#include "support/operator_file.h"
#include "support/suite.h"

#define BOTH "/operator/Y /operator/V"
static const file_recipe recipes[] = {
    {.what = "good, f16", .narrow = BOTH, .narrow_type = STORE_F16, .precision = "f16"},
    {.what = "good, f16 with scales",
     .narrow = BOTH,
     .narrow_type = STORE_F16,
     .scales = BOTH,
     .scale = .25f,
     .precision = "f16"},
    {.what = "good, i8", .narrow = BOTH, .narrow_type = STORE_I8, .scales = BOTH, .scale = .5f},
    {.what = "bf16, which is no longer known",
     .narrow = BOTH,
     .narrow_type = STORE_U16,
     .precision = "bf16",
     .status = LAM_ERR_FORMAT,
     .word = "must be of f32, f16 or i8"},
    {.what = "whole numbers",
     .narrow = BOTH,
     .narrow_type = STORE_U32,
     .status = LAM_ERR_FORMAT,
     .word = "must be of f32, f16 or i8"},
    {.what = "only Y in f16",
     .narrow = "/operator/Y",
     .narrow_type = STORE_F16,
     .status = LAM_ERR_FORMAT,
     .word = "one array of f16 and one of f32"},
    {.what = "i8 without a scale",
     .narrow = BOTH,
     .narrow_type = STORE_I8,
     .status = LAM_ERR_FORMAT,
     .word = "no /operator/Y_scale"},
    {.what = "i8, V without a scale",
     .narrow = BOTH,
     .narrow_type = STORE_I8,
     .scales = "/operator/Y",
     .scale = 1,
     .status = LAM_ERR_FORMAT,
     .word = "no /operator/V_scale"},
    {.what = "scale short",
     .narrow = BOTH,
     .narrow_type = STORE_I8,
     .scales = BOTH,
     .scale = 1,
     .scale_size = 1,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/Y_scale"},
    {.what = "scale 0",
     .narrow = BOTH,
     .narrow_type = STORE_I8,
     .scales = BOTH,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/Y_scale[0] = 0, must be above 0"},
    {.what = "scale NaN",
     .narrow = BOTH,
     .narrow_type = STORE_F16,
     .scales = BOTH,
     .scale = NAN,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/Y_scale[0] = nan"},
    {.what = "f32 with a scale",
     .scales = "/operator/V",
     .scale = 1,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/V is of f32 and must not have"},
    {.what = "NaN in f16",
     .narrow = BOTH,
     .narrow_type = STORE_F16,
     .fill = 0x7e00,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/Y[0][0] = nan"},
    {.what = "infinity in f16",
     .narrow = BOTH,
     .narrow_type = STORE_F16,
     .fill = 0xfc00,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/Y[0][0] = -inf"},
    {.what = "another precision said",
     .narrow = BOTH,
     .narrow_type = STORE_F16,
     .precision = "i8",
     .status = LAM_ERR_FORMAT,
     .word = "precision 'i8', its arrays are of f16"},
};

START_TEST(files_are_judged) {
    const file_recipe *r = &recipes[_i];
    operator_file_write(r);
    operator_file_judge(r->what, r->status, r->word);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("operator precision");
    TCase *tests = tcase_create("files");
    tcase_set_timeout(tests, 300);
    tcase_add_checked_fixture(tests, operator_file_setup, operator_file_teardown);
    tcase_add_loop_test(tests, files_are_judged, 0, (int)(sizeof recipes / sizeof *recipes));
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
